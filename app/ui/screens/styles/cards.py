"""The order and the text of the cards in the gallery."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Final, Literal, TypeAlias

from app.core.base.angles import direction_of, whole
from app.core.base.arrays import Bytes
from app.core.solver.solve import proposal
from app.core.solver.style_result import StyleResult
from app.core.solver.turn_choice import LIMITS
from app.core.storage.item_library import DamagedItem
from app.core.styles.style import Style
from app.core.styles.styles import RARE
from app.core.text import tr
from app.ui.presenters.window_model import NO_LIGHT
from app.ui.screens.styles.gallery import Snapshot
from app.words import verdict
from app.words.phrases.directions import lit_aside_brief, lit_aside_words
from app.words.phrases.turns import size_words
from app.words.styles import full_title, side_words
from app.words.why_out_of_reach import (
    reason_card,
    reason_sentence,
    soft_card,
    too_soft_card,
    too_soft_words,
)

CANNOT_READ: Final = tr("This style cannot be read. Its file is untouched.")
_SIDES: Final = {"left": 0, "right": 1, "none": 2}
_RARE_POINTS: Final = 15.0  # penalty on the match that ranks rarely used styles behind others

Way: TypeAlias = Literal["", "clockwise", "counter-clockwise", "none"]
"""Direction of a turn, or an empty string if there is no turn."""


class Filter(StrEnum):
    """The filters for the cards."""

    ALL = "all"
    IN_REACH = "in"
    OUT_OF_REACH = "out"
    MINE = "mine"


class Sort(StrEnum):
    """The sort orders of the cards. Cards for styles out of reach always come last."""

    MATCH = "match"
    NAME = "name"
    TURN = "turn"
    SIDE = "side"


@dataclass(frozen=True, slots=True)
class CardState:
    """A card in the gallery. Cards that compare equal look the same.

    Attributes:
        turn: Text such as "96°", or an empty string if there is no turn.
        swapped: Whether `target` and `here` are swapped.
        meter: Match on the meter, 0 to 100, or None to hide the meter.
        version: Version of the pictures. It is compared in place of the pictures themselves.
        stale: Whether the answer is for another selection, in which case the card is dimmed.
        target, here: The two pictures, each (h, w, 3) uint8 sRGB at the size shown on a card, or
            None if there is none.
    """

    key: str
    title: str
    line: str
    brief: str = ""
    tip: str = ""
    spoken: str = ""
    turn: str = ""
    way: Way = ""
    match: str = ""
    meter: float | None = None
    limit: float = 45.0
    in_reach: bool = True
    chosen: bool = False
    marked: bool = False
    swapped: bool = False
    damaged: Path | None = None
    version: int = 0
    stale: bool = False
    target: Bytes | None = field(default=None, compare=False, repr=False)
    here: Bytes | None = field(default=None, compare=False, repr=False)


_EMPTY: Final = {
    Filter.ALL: "",
    Filter.IN_REACH: tr("No style is within reach here. A lamp may help."),
    Filter.OUT_OF_REACH: tr("Every style is within reach here."),
    Filter.MINE: tr("Paint a style, or drop a portrait whose light you like."),
}


def empty_words(card_filter: Filter, measured: bool) -> str:
    """Return the message for a filter that leaves no cards."""
    if not measured and card_filter is not Filter.MINE:
        return NO_LIGHT
    return _EMPTY[card_filter]


def filters_of(snapshot: Snapshot, stale: bool = False) -> tuple[tuple[Filter, str], ...]:
    """Return the filters with their labels and counts.

    Args:
        stale: Whether the answers are for another selection. If so, the counts are omitted.

    Returns:
        A pair for each filter: the filter and its label.
    """
    within = sum(snapshot.within(one) for one in snapshot.results.values())
    without = len(snapshot.results) - within
    measured = snapshot.question.light is not None and not stale
    mine = len(snapshot.mine) + len(snapshot.question.damaged)
    return (
        (
            Filter.ALL,
            tr("All {count}", count=len(snapshot.styles) + len(snapshot.question.damaged)),
        ),
        (Filter.IN_REACH, tr("In reach {count}", count=within) if measured else tr("In reach")),
        (
            Filter.OUT_OF_REACH,
            tr("Out of reach {count}", count=without) if measured else tr("Out of reach"),
        ),
        (Filter.MINE, tr("Mine {count}", count=mine)),
    )


def cards_of(
    snapshot: Snapshot, card_filter: Filter, sort: Sort, front: str | None
) -> tuple[CardState, ...]:
    """Return the cards in the gallery in reading order, with unreadable files last."""
    names = [name for name in snapshot.styles if _passes(snapshot, name, card_filter)]
    names.sort(key=lambda name: _order(snapshot, name, sort))
    if sort is Sort.MATCH and snapshot.results:
        names = _proposed(snapshot, names)
    cards = [_with_note(_card(snapshot, name, name == front), snapshot) for name in names]
    if card_filter in (Filter.ALL, Filter.MINE):
        cards += [_damaged_card(one) for one in snapshot.question.damaged]
    return tuple(cards)


def stale_card(card: CardState) -> CardState:
    """Dim a card whose answer is for another selection. Screen readers skip the card's numbers."""
    words = tr("{title}, computing", title=card.title)
    return replace(card, stale=True, spoken=words, tip=words)


def front_of(snapshot: Snapshot, chosen: str | None) -> str | None:
    """Return the current style: the chosen style if it exists, otherwise the suggested style."""
    if chosen is not None and chosen in snapshot.styles:
        return chosen
    return proposal(tuple(snapshot.results.values())) or next(iter(snapshot.styles), None)


def _proposed(snapshot: Snapshot, names: list[str]) -> list[str]:
    """Move the first common style ahead of any rare styles with the same grade."""
    results = [snapshot.results.get(name) for name in names]
    ranks = [_rank(snapshot, result) if result else 0 for result in results]
    for name, rank in zip(names, ranks, strict=True):
        if rank == ranks[0] and name not in RARE:
            return [name, *(other for other in names if other != name)]
    return names


def _passes(snapshot: Snapshot, name: str, card_filter: Filter) -> bool:
    if card_filter is Filter.ALL:
        return True
    if card_filter is Filter.MINE:
        return name in snapshot.mine
    result = snapshot.results.get(name)
    return result is not None and snapshot.within(result) == (card_filter is Filter.IN_REACH)


def _order(snapshot: Snapshot, name: str, sort: Sort) -> tuple[float | str, ...]:
    style, result = snapshot.styles[name], snapshot.results.get(name)
    title = style.title.casefold()
    out = 0.0 if result is None else float(_rank(snapshot, result))
    match = -result.match if result is not None else 0.0
    if sort is Sort.NAME:
        return out, title, _SIDES[style.side], name
    if sort is Sort.TURN and result is not None:
        return out, float(abs(whole(result.turn_refined_deg))), match
    if sort is Sort.SIDE:
        return out, _SIDES[style.side], match, title
    # Without numbers, keep the usual order of styles.
    return out, match + (_RARE_POINTS if result is not None and name in RARE else 0.0)


def _rank(snapshot: Snapshot, result: StyleResult) -> int:
    """Return the rank of a result: 0 for yes, 1 for soft, or 2 for out of reach."""
    if snapshot.paper or not result.attainable:
        return 2 * (not snapshot.within(result))
    return int(result.grade == "soft")


def rules_words(snapshot: Snapshot) -> str:
    """Return a sentence on styles that the paper grades differently, or "" outside paper mode."""
    results = snapshot.results.values()
    if not snapshot.paper or not results:
        return ""
    apart = sum(snapshot.within(one) != one.attainable for one in results)
    return verdict.rules_words(apart, len(results))


def side_line(style: Style) -> str:
    """Return the side of a style as text for the second line of its card."""
    return side_words(style) or tr("painted")


def _card(snapshot: Snapshot, name: str, is_chosen: bool) -> CardState:
    style, result = snapshot.styles[name], snapshot.results.get(name)
    target, here = snapshot.pictures[name]
    line = side_line(style)
    card = CardState(
        key=name,
        title=style.title,
        line=line,
        tip=f"{style.title}: {line}",
        spoken=_spoken(style, result, snapshot),
        limit=least_match(snapshot, style),
        chosen=is_chosen,
        version=snapshot.version,
        target=target,
        here=here,
    )
    if result is None:
        return card
    match = verdict.whole_of(result.match)
    card = replace(card, match=str(match), meter=float(min(match, 100)))
    turn = result.turn_refined_deg
    if snapshot.paper:
        return _paper_card(card, style, result, snapshot)
    if result.attainable:
        close = close_to(result, snapshot)
        card = replace(card, turn=size_words(turn), way=direction_of(turn))
        beside = beside_words(result, snapshot)
        aside = lit_aside_words(result.yaw_deg, result.lighting)
        lines = [full_title(style), *beside, close, aside, *gain_lines(result)]
        tip = ". ".join(filter(None, lines))
        if beside:
            line, brief = _beside_card(result, snapshot)
            line = tr("{near}: {aside}", near=brief, aside=aside) if aside else line
            return replace(card, line=line, brief=brief, tip=f"{tip}.")
        if aside:
            brief = lit_aside_brief(result.yaw_deg, result.lighting)
            return replace(card, line=aside, brief=brief, tip=f"{tip}.")
        if close:
            title = snapshot.styles[result.neighbour or ""].title
            line, brief = verdict.close_to_card(title, style.side)
            card = replace(card, line=line, brief=brief)
        return replace(card, tip=f"{tip}.")
    line, brief = _out_of_reach(result)
    why = reason_sentence(result.shortfall)
    tip = f"{full_title(style)}. {why}. {verdict.verdict_sentence(result)}"
    return replace(card, line=line, brief=brief, tip=tip, in_reach=False)


def lamps_note(snapshot: Snapshot, name: str) -> str:
    """Return a note if a style does not use the chosen lamps, or "" if it does."""
    head = snapshot.question.head
    name = snapshot.source(name)
    studio = head.studio_wanted(name)
    if name in snapshot.asking or head.pack.studio(name) == studio:
        return ""
    return verdict.own_lamps_words(studio)


def doubt_note(snapshot: Snapshot, name: str) -> str:
    """Return a note if an answer is rough or depends on a hazard, or else ""."""
    question = snapshot.question
    if name not in snapshot.results:
        return ""
    return verdict.doubt_words(snapshot.hazards(name), rough=question.rough)


def _with_note(card: CardState, snapshot: Snapshot) -> CardState:
    doubt = doubt_note(snapshot, card.key)
    if snapshot.hazards(card.key) and card.in_reach:
        card = replace(card, line=tr("Doubtful: {line}", line=card.line), brief=tr("Doubtful"))
    note = " ".join(filter(None, (lamps_note(snapshot, card.key), doubt)))
    if not note:
        return card
    # Without an answer, the tooltip has only the title and side, and no full stop.
    stop = "" if card.key in snapshot.results else "."
    return replace(card, tip=f"{card.tip}{stop} {note}", spoken=f"{card.spoken}. {note}")


def _paper_card(
    card: CardState, style: Style, result: StyleResult, snapshot: Snapshot
) -> CardState:
    """Return the card graded by the paper's C, with our own grade if the two differ."""
    quality, least = snapshot.quality(result), LIMITS.quality
    most = max(*map(snapshot.quality, snapshot.results.values()), least, 1e-30)
    within, turn = snapshot.within(result), result.turn_refined_deg
    ours = verdict.ours_words(result)
    text = verdict.paper_quality(quality)
    why = reason_sentence(result.shortfall)
    tip = [full_title(style), text, ours, *([why] if why else [])]
    card = replace(
        card,
        match=tr("C {quality}", quality=verdict.quality_words(quality)),
        meter=100.0 * max(quality, 0.0) / most,
        limit=100.0 * least / most,
        in_reach=within,
        tip=". ".join(tip) + ".",
    )
    if within:
        card = replace(card, turn=size_words(turn), way=direction_of(turn))
    if within == result.attainable:
        return card
    return replace(card, line=verdict.ours_card(result, style.side), brief=ours)


def least_match(snapshot: Snapshot, style: Style) -> float:
    """Return the minimum match at which a style is within reach."""
    own = style.signature
    return own.match[1] if own.relations else LIMITS.match


def beside_words(result: StyleResult, snapshot: Snapshot) -> list[str]:
    """Return sentences about a style that is only soft or easily taken for another."""
    titles = {name: full_title(style) for name, style in snapshot.styles.items()}
    return verdict.near_words(
        result,
        snapshot.styles[result.name].title,
        titles[result.looks_more_like] if result.looks_more_like is not None else "",
        [titles[name] for name in result.same_picture if name in titles],
    )


def _beside_card(result: StyleResult, snapshot: Snapshot) -> tuple[str, str]:
    """Return the first sentence of `beside_words`, worded for a normal and a narrow card."""
    styles = snapshot.styles
    if result.looks_more_like is not None:
        other = styles[result.looks_more_like]
        return verdict.reads_as(full_title(other)), verdict.reads_as(other.title)
    if result.shortfall is not None:
        return soft_card(result.shortfall), tr("Soft")
    same = [styles[name] for name in result.same_picture if name in styles]
    titles = [full_title(style) for style in same]
    return verdict.same_picture(titles), verdict.same_picture([same[0].title])


def gain_lines(result: StyleResult) -> list[str]:
    """Return sentences about what is gained by turning the face away from the lens."""
    return [verdict.gain_words(gain, result.match) for gain in result.gains]


def close_style(result: StyleResult, snapshot: Snapshot) -> str:
    """Return the title of the style that the picture is close to, or "" if there is none."""
    other = snapshot.styles.get(result.neighbour or "")
    if other is None or not result.attainable or result.neighbour == result.looks_more_like:
        return ""
    return other.title if other.side in (result.side, "none") else full_title(other)


def close_to(result: StyleResult, snapshot: Snapshot) -> str:
    """Return a sentence about the style that the picture is close to, or "" if there is none."""
    title = close_style(result, snapshot)
    return verdict.close_to(title) if title else ""


def _out_of_reach(result: StyleResult) -> tuple[str, str]:
    """Return the reason why a style is out of reach, worded for a normal and a narrow card."""
    soft = result.match >= LIMITS.match and result.strength < LIMITS.strength
    if result.grade is None and soft:
        numbers = result.strength, LIMITS.strength
        return too_soft_words(*numbers), too_soft_card(*numbers)
    words = reason_card(result.shortfall)
    return words, words


def _spoken(style: Style, result: StyleResult | None, snapshot: Snapshot) -> str:
    if result is None:
        return verdict.spoken_words(style, None)
    return verdict.spoken_words(
        style,
        result,
        close_style(result, snapshot),
        snapshot.quality(result) if snapshot.paper else None,
        within=snapshot.within(result),
    )


def _damaged_card(damaged: DamagedItem) -> CardState:
    return CardState(
        key=str(damaged.path),
        title=damaged.path.stem,
        line=CANNOT_READ,
        tip=damaged.reason,
        spoken=f"{damaged.path.stem}, {CANNOT_READ} {damaged.reason}",
        in_reach=False,
        damaged=damaged.path,
    )
