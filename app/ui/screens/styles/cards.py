"""The order and the text of the cards in the gallery."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Final, Literal, TypeAlias

from app.core.base.angles import direction_of, whole
from app.core.base.arrays import Bytes
from app.core.places.offers import Offer, offers, pairs
from app.core.solver.solve import proposal
from app.core.solver.style_result import StyleResult
from app.core.solver.turn_choice import LIMITS
from app.core.storage.item_library import DamagedItem
from app.core.styles.style import Side, Style
from app.core.styles.styles import mirror_name
from app.core.text import tr
from app.ui.screens.styles.gallery import Snapshot
from app.words import verdict
from app.words.phrases.directions import BARE_SIDES, lit_aside_brief, lit_aside_words
from app.words.phrases.turns import size_words
from app.words.styles import full_title, side_words
from app.words.verdict import other_side_words
from app.words.why_out_of_reach import reason_sentence

CANNOT_READ: Final = tr("This style cannot be read. Its file is untouched.")
_NOTHING: Final = tr("No style yet. Look for one strong light, or try a lamp.")
_MINE: Final = tr("Paint a style, or drop a portrait whose light you like.")

Way: TypeAlias = Literal["", "clockwise", "counter-clockwise", "none"]
"""Direction of a turn, or an empty string if there is no turn."""


class Filter(StrEnum):
    """The filters for the cards."""

    ALL = "all"
    MINE = "mine"


class Sort(StrEnum):
    """The sort orders of the cards. Cards for styles out of reach always come last."""

    MATCH = "match"
    NAME = "name"
    TURN = "turn"


@dataclass(frozen=True, slots=True)
class CardState:
    """A card in the gallery. Cards that compare equal look the same.

    A card stands for both sides of a style, and for the styles that have the same picture. It shows
    one of them.

    Attributes:
        key: Name of the style that the card shows.
        word: The verdict in a word, such as "Soft", or an empty string without a verdict.
        line, brief: At most five words after the verdict, and a shorter form for a narrow card.
        turn: Text such as "96°", or an empty string if there is no turn.
        side: Side of the key lamp, as seen by the sitter.
        other: Name of the style for the other side, or an empty string if there is none.
        other_words: What the other side gives: "Show the sitter’s right: soft, 40° clockwise".
        swapped: Whether `target` and `here` are swapped.
        version: Version of the pictures. It is compared in place of the pictures themselves.
        stale: Whether the answer is for another selection, in which case the card is dimmed.
        target, here: The two pictures, each (h, w, 3) uint8 sRGB at the size shown on a card, or
            None if there is none.
    """

    key: str
    title: str
    line: str
    word: str = ""
    brief: str = ""
    tip: str = ""
    spoken: str = ""
    turn: str = ""
    way: Way = ""
    side: Side = "none"
    other: str = ""
    other_words: str = ""
    in_reach: bool = True
    chosen: bool = False
    marked: bool = False
    swapped: bool = False
    damaged: Path | None = None
    version: int = 0
    stale: bool = False
    target: Bytes | None = field(default=None, compare=False, repr=False)
    here: Bytes | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class CardGroup:
    """Cards under a common heading.

    Attributes:
        title: Heading, or an empty string to show none.
        count: Number after the heading, or None to show none.
        empty: Message in place of the cards, or an empty string.
    """

    title: str = ""
    count: int | None = None
    cards: tuple[CardState, ...] = ()
    empty: str = ""


def filters_of(snapshot: Snapshot) -> tuple[tuple[Filter, str], ...]:
    """Return each filter with its label and count."""
    damaged = len(snapshot.question.damaged)
    every = len(_offers(snapshot, Filter.ALL)) + damaged
    return (
        (Filter.ALL, tr("All {count}", count=every)),
        (Filter.MINE, tr("Mine {count}", count=len(snapshot.mine) + damaged)),
    )


def groups_of(
    snapshot: Snapshot,
    card_filter: Filter,
    sort: Sort,
    front: str | None,
    recent: Sequence[str] = (),
) -> tuple[CardGroup, ...]:
    """Return the cards in the gallery in reading order, with unreadable files last.

    Args:
        front: The chosen style. The card that stands for it shows it.
        recent: Styles chosen before, the latest first. Their cards still show them.
    """
    every = _offers(snapshot, card_filter)
    if sort is not Sort.MATCH:
        every = tuple(sorted(every, key=lambda offer: _order(snapshot, offer.name, sort)))
    cards = [_offered_card(snapshot, offer, front, recent) for offer in every]
    damaged = tuple(_damaged_card(one) for one in snapshot.question.damaged)
    if not snapshot.results:
        nothing = "" if cards or damaged else _MINE
        return (CardGroup(cards=(*cards, *damaged), empty=nothing),)
    within = [_is_within(snapshot, offer.name) for offer in every]
    gives = tuple(card for card, yes in zip(cards, within, strict=True) if yes)
    rest = tuple(card for card, yes in zip(cards, within, strict=True) if not yes)
    if card_filter is Filter.MINE and not cards and not damaged:
        return (CardGroup(empty=_MINE),)
    groups = [CardGroup(tr("This place gives"), len(gives), gives, "" if gives else _NOTHING)]
    if rest or damaged:
        groups.append(CardGroup(tr("Not here"), len(rest), (*rest, *damaged)))
    return tuple(groups)


def card_of(snapshot: Snapshot, name: str, is_chosen: bool = False) -> CardState:
    """Return the card that shows a style."""
    return _with_note(_card(snapshot, name, is_chosen), snapshot)


def _offers(snapshot: Snapshot, card_filter: Filter) -> tuple[Offer, ...]:
    """Return the offers that pass a filter, best first. Without light, keep the styles' order."""
    names = [name for name in snapshot.styles if card_filter is Filter.ALL or name in snapshot.mine]
    if not snapshot.results:
        return pairs(names)
    results = [snapshot.results[name] for name in names if name in snapshot.results]
    unsolved = [name for name in names if name not in snapshot.results]
    return (*offers(results, snapshot.within), *pairs(unsolved))


def _offered_card(
    snapshot: Snapshot, offer: Offer, front: str | None, recent: Sequence[str]
) -> CardState:
    """Return the card of an offer, which shows the style chosen last, or else the best one."""
    name = next((one for one in (front, *recent) if one in offer.members), offer.name)
    card = card_of(snapshot, name, name == front)
    other = mirror_name(name)
    if other == name or other not in offer.members:
        return card
    words = other_side_words(snapshot.styles[other], snapshot.results.get(other))
    return replace(card, other=other, other_words=words)


def _is_within(snapshot: Snapshot, name: str) -> bool:
    result = snapshot.results.get(name)
    return result is not None and snapshot.within(result)


def stale_group(group: CardGroup) -> CardGroup:
    """Dim cards whose answers are for another selection, and hide their count."""
    return replace(group, count=None, cards=tuple(map(_stale_card, group.cards)))


def _stale_card(card: CardState) -> CardState:
    """Dim a card. Screen readers skip its numbers."""
    words = tr("{title}, computing", title=card.title)
    return replace(card, stale=True, spoken=words, tip=words)


def front_of(snapshot: Snapshot, chosen: str | None) -> str | None:
    """Return the current style: the chosen style if it exists, otherwise the suggested style."""
    if chosen is not None and chosen in snapshot.styles:
        return chosen
    return proposal(tuple(snapshot.results.values())) or next(iter(snapshot.styles), None)


def _order(snapshot: Snapshot, name: str, sort: Sort) -> tuple[float | str, ...]:
    style, result = snapshot.styles[name], snapshot.results.get(name)
    title = style.title.casefold()
    if sort is Sort.TURN and result is not None:
        return float(abs(whole(result.turn_refined_deg))), -result.match
    return title, name


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
        side=style.side,
        chosen=is_chosen,
        version=snapshot.version,
        target=target,
        here=here,
    )
    if result is None:
        return card
    within, turn = snapshot.within(result), result.turn_refined_deg
    if within:
        card = replace(card, turn=size_words(turn), way=direction_of(turn))
    grade = None if snapshot.paper else result.grade
    return replace(
        card,
        word=verdict.grade_on_card(grade, within=within),
        line=_reason(style, result, snapshot),
        tip=_tip(style, result, snapshot),
        in_reach=within,
    )


def _reason(style: Style, result: StyleResult, snapshot: Snapshot) -> str:
    """Return at most five words after the grade on a card."""
    if snapshot.paper:
        within = snapshot.within(result)
        return verdict.paper_card(snapshot.quality(result), result, within=within)
    titles = {name: one.title for name, one in snapshot.styles.items()}
    reason = verdict.reason_on_card(result, titles)
    aside = lit_aside_brief(result.yaw_deg, result.lighting) if result.attainable else ""
    return reason or aside or BARE_SIDES.get(style.side, "")


def _tip(style: Style, result: StyleResult, snapshot: Snapshot) -> str:
    """Return everything that a card has no room for."""
    why = reason_sentence(result.shortfall)
    last = ""
    if snapshot.paper:
        quality = verdict.paper_quality(snapshot.quality(result))
        lines = [quality, verdict.ours_words(result), why]
    elif result.attainable:
        aside = lit_aside_words(result.yaw_deg, result.lighting)
        beside = beside_words(result, snapshot)
        lines = [*beside, close_to(result, snapshot), aside, *gain_lines(result)]
    else:
        lines, last = [why], verdict.verdict_sentence(result)
    words = ". ".join(filter(None, (full_title(style), *lines))) + "."
    return f"{words} {last}".rstrip()


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
        line = tr("doubtful: {line}", line=card.line) if card.line else tr("doubtful")
        card = replace(card, line=line, brief=tr("doubtful"))
    note = " ".join(filter(None, (lamps_note(snapshot, card.key), doubt)))
    if not note:
        return card
    # Without an answer, the tooltip has only the title and side, and no full stop.
    stop = "" if card.key in snapshot.results else "."
    return replace(card, tip=f"{card.tip}{stop} {note}", spoken=f"{card.spoken}. {note}")


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
