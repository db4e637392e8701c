"""The gallery: pictures of all styles in this place, made at once, and the words on their cards."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, Final, TypeAlias, TypeVar

import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.base.colour import FloatImage
from app.core.base.progress import Token
from app.core.painting.library import CANNOT_READ
from app.core.painting.user_style import Asking, UserStyle, prepare_user_style
from app.core.solver.lamps import studio_words
from app.core.solver.place_light import PlaceLight, pictures_at, turned
from app.core.solver.portraits import framing, greyed, portraits, skin_gains
from app.core.solver.solve import StyleResult, quality_scale
from app.core.solver.styles import Style
from app.core.solver.turn_choice import Limits
from app.core.storage.library import Damaged
from app.core.text import tr, tr_plural
from app.core.text.grades import grade_words
from app.core.text.turns import direction_of, size_words, turn_words, whole
from app.ui.presenters.model import Head, Model
from app.ui.screens.styles.state import CardState, Filter, Size, Sort

Pair: TypeAlias = "tuple[Bytes | None, Bytes | None]"
T = TypeVar("T")

_SIDES: Final = {"left": 0, "right": 1, "none": 2}
# What does not fit on a card beside the number; the tool tip has the whole sentence.
_NOTHING_LIKE: Final = 10  # of 100: a match under it is no likeness at all
_PLACES: Final = (
    *(tr("below"), tr("above"), tr("behind")),
    *(tr("the side"), tr("high in front"), tr("the front")),
)
_SHORTER: Final = {
    tr("No turn gives this pattern here"): tr("No turn gives this pattern"),
    tr("Not all of its lights are here at one turn"): tr("Not all its lights at one turn"),
    **{
        tr("Only one of its two lights is here, none from {place}", place=place): tr(
            "No second light from {place}", place=place
        )
        for place in _PLACES
    },
    **{
        tr("No strong light from {place} here", place=place): tr(
            "No strong light from {place}", place=place
        )
        for place in _PLACES
    },
    tr("No strong light from {place} here", place=tr("high in front")): tr(
        "No light high in front"
    ),
}
"""Causes of `app.core.solver.turn_choice`, and what a card has room for."""
_SPOKEN: Final = {
    "left": tr("light from the sitter's left, camera right"),
    "right": tr("light from the sitter's right, camera left"),
}


_OURS: Final = {
    "left": tr("sitter’s left; ours: {grade}"),
    "right": tr("sitter’s right; ours: {grade}"),
}
# What a card has room for beside its number: its side, and what its picture may be taken for.
_LIKE: Final = {
    "left": tr("sitter’s left; like {style}"),
    "right": tr("sitter’s right; like {style}"),
    "none": tr("like {style}"),
}
_LIKE_BRIEF: Final = {
    "left": tr("left; like {style}"),
    "right": tr("right; like {style}"),
    "none": tr("like {style}"),
}
_RARE_POINTS: Final = 15.0  # of match by which a style that is rarely wanted stands behind others


class Kept:
    """One value of each kind, kept for as long as its key and its owner stay the same.

    Args:
        before: Its values are taken over; nothing is shared, so another thread may use it still.
    """

    def __init__(self, before: Kept | None = None) -> None:
        self._values: dict[str, tuple[Hashable, object, Any]] = (
            dict(before._values) if before else {}
        )

    def once(self, what: str, key: Hashable, owner: object, make: Callable[[], T]) -> T:
        """Return the value of a kind, made again when it is of another key or owner."""
        known = self._values.get(what)
        if known is None or known[0] != key or known[1] is not owner:
            self._values[what] = known = (key, owner, make())
        made: T = known[2]
        return made


@dataclass(frozen=True, slots=True, eq=False)
class Question:
    """Everything the gallery is made from.

    Attributes:
        light: None while no light was measured; then there are no results.
        objective: "picture" or "paper".
        sun: tuple of float or None. Azimuth in the panorama and elevation, deg.
        size: Rows and columns of a card's picture.
    """

    head: Head
    light: PlaceLight | None = None
    front_deg: float = 0.0
    results: tuple[StyleResult, ...] = ()
    own: tuple[UserStyle, ...] = ()
    damaged: tuple[Damaged, ...] = ()
    objective: str = "picture"
    limits: Limits = field(default_factory=Limits)
    sun: tuple[float, float] | None = None
    size: Size = (68, 94)


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A gallery whose numbers and pictures belong together.

    Attributes:
        targets: Mapping[str, uint8]. (h, w, 3) target portraits, never grey.
        pictures: Target and here as the cards show them; here is None without light.
    """

    question: Question
    styles: Mapping[str, Style]
    results: Mapping[str, StyleResult]
    asking: Mapping[str, Asking] = field(repr=False)
    targets: Mapping[str, Bytes] = field(repr=False)
    pictures: Mapping[str, Pair] = field(repr=False)
    version: int = 1

    @property
    def paper(self) -> bool:
        """Whether the paper's rule counts: a style is out of reach where C is below its limit."""
        return self.question.objective == "paper" and self.question.light is not None

    @cached_property
    def quality_scale(self) -> float:
        """What C is multiplied by to be held against its limit."""
        head, light = self.question.head, self.question.light
        return 1.0 if light is None else quality_scale(light.searched, head.pack.header.picture)

    def quality(self, result: StyleResult) -> float:
        """Largest C of all turns, on the scale of its limit."""
        return float(result.quality_curve.max()) * self.quality_scale

    def within(self, result: StyleResult) -> bool:
        """Whether a style is in reach, by the rule that counts."""
        if self.paper:
            return self.quality(result) >= self.question.limits.quality
        return result.attainable

    def target(self, name: str) -> FloatImage:
        """Target picture of a style, (N, N, 3) float32 linear, largest value 1."""
        if name in self.asking:
            return self.asking[name].target
        return self.question.head.pack.target(name)


def question_of(model: Model, size: Size) -> Question | None:
    """Read off the model what the gallery is to be made from.

    Args:
        size: Rows and columns of a card's picture.
    """
    if model.head is None:
        return None
    settings, place = model.settings, model.place
    where = place.location if place is not None else None
    sun = None
    if where is not None and where.sun_azimuth_deg is not None:
        sun = (where.sun_azimuth_deg, where.sun_elevation_deg or 0.0)
    return Question(
        head=model.head,
        light=model.light,
        front_deg=model.front_deg,
        results=model.results if model.light is not None else (),
        own=model.user_styles,
        damaged=model.damaged_styles,
        objective=settings.objective,
        limits=settings.limits,
        sun=sun,
        size=size,
    )


def look(question: Question, known: Snapshot | None, token: Token) -> Snapshot:
    """Make all cards' pictures; what is known already is taken over."""
    pack, transport = question.head.pack, question.head.transport
    before = known if known is not None and known.question.head is question.head else None
    asking = _prepared(question, before, token)
    styles = {style.name: style for style in pack.styles}
    styles.update((one.name, one.style) for one in question.own)
    results = {one.name: one for one in question.results if one.name in styles}
    draft = Snapshot(question, styles, results, asking, {}, {}, 1)
    frame = framing(transport.size, question.size)
    coverage = pack.coverage.astype(np.float32)
    targets = _old_targets(before, question, asking)
    missing = [name for name in styles if name not in targets]
    if missing:
        gains = skin_gains(transport, [styles[name] for name in missing])
        linear = np.stack([draft.target(name) for name in missing])
        shown = portraits(linear, coverage, frame, gains)
        targets.update(zip(missing, shown, strict=True))
    token.check()
    here: dict[str, Bytes] = {}
    if question.light is not None and results:
        turns = [wrap(one.turn_refined_deg + question.front_deg) for one in results.values()]
        linear = pictures_at(transport, question.light, turns)
        token.check()
        gains = skin_gains(transport, [partial(turned, question.light, turn) for turn in turns])
        here.update(zip(results, portraits(linear, coverage, frame, gains), strict=True))
    pictures = {}
    for name in styles:
        pair, result = (targets[name], here.get(name)), results.get(name)
        clear = result is None or draft.within(result)
        pictures[name] = pair if clear else _greyed(*pair)
    version = 1 if known is None else known.version + 1
    return replace(draft, targets=targets, pictures=pictures, version=version)


def _prepared(question: Question, before: Snapshot | None, token: Token) -> dict[str, Asking]:
    asking = {}
    for style in question.own:
        old = before.asking.get(style.name) if before is not None else None
        if old is None or old.style is not style:
            token.check()
            old = prepare_user_style(question.head.transport, style)
        asking[style.name] = old
    return asking


def _old_targets(
    before: Snapshot | None, question: Question, asking: Mapping[str, Asking]
) -> dict[str, Bytes]:
    if before is None or before.question.size != question.size:
        return {}
    return {
        name: picture
        for name, picture in before.targets.items()
        if before.asking.get(name) is asking.get(name)
    }


def _greyed(target: Bytes, here: Bytes | None) -> Pair:
    return greyed(target), None if here is None else greyed(here)


def whole_of(value: float) -> int:
    """Round match or strength down, so that a value under a limit never reads as the limit."""
    return max(math.floor(value), 0)


def filters_of(snapshot: Snapshot) -> tuple[tuple[Filter, str], ...]:
    """Words of the filters, with how many cards each would show.

    Returns:
        tuple of (Filter, str).
    """
    within = sum(snapshot.within(one) for one in snapshot.results.values())
    without = len(snapshot.results) - within
    measured = snapshot.question.light is not None
    mine = len(snapshot.asking) + len(snapshot.question.damaged)
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
    snapshot: Snapshot, wanted: Filter, sort: Sort, chosen: str | None
) -> tuple[CardState, ...]:
    """Make the cards of the gallery.

    Returns:
        In the order of reading; files that cannot be read come last.
    """
    names = [name for name in snapshot.styles if _passes(snapshot, name, wanted)]
    names.sort(key=lambda name: _order(snapshot, name, sort))
    if sort is Sort.MATCH and snapshot.results:
        names = _proposed(snapshot, names)
    cards = [_with_note(_card(snapshot, name, name == chosen), snapshot) for name in names]
    if wanted in (Filter.ALL, Filter.MINE):
        cards += [_damaged_card(one) for one in snapshot.question.damaged]
    return tuple(cards)


def front_of(snapshot: Snapshot, chosen: str | None) -> str | None:
    """Say which style is in front: the chosen one, or the first card until that is there."""
    if chosen is not None and chosen in snapshot.styles:
        return chosen
    styles = snapshot.styles
    # What is rarely wanted is never proposed first.
    names = sorted(styles, key=lambda n: (_hidden(snapshot, n), *_order(snapshot, n, Sort.MATCH)))
    return names[0] if names else None


def _proposed(snapshot: Snapshot, names: list[str]) -> list[str]:
    """Put a style that is not rare in front, where one of the first one's grade is there."""
    found = [snapshot.results.get(name) for name in names]
    ranks = [_rank(snapshot, result) if result else 0 for result in found]
    for name, rank in zip(names, ranks, strict=True):
        if rank == ranks[0] and not snapshot.styles[name].rare:
            return [name, *(other for other in names if other != name)]
    return names


def _hidden(snapshot: Snapshot, name: str) -> bool:
    result = snapshot.results.get(name)
    return result is not None and (snapshot.styles[name].rare or not snapshot.within(result))


def _passes(snapshot: Snapshot, name: str, wanted: Filter) -> bool:
    if wanted is Filter.ALL:
        return True
    if wanted is Filter.MINE:
        return name in snapshot.asking
    result = snapshot.results.get(name)
    return result is not None and snapshot.within(result) == (wanted is Filter.IN_REACH)


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
    # Without numbers in the order in which styles are listed everywhere.
    return out, match + (_RARE_POINTS if result is not None and style.rare else 0.0)


def _rank(snapshot: Snapshot, result: StyleResult) -> int:
    """0 in reach, 1 nearly, 2 out of reach."""
    if snapshot.paper or not result.attainable:
        return 2 * (not snapshot.within(result))
    return int(result.grade == "nearly")


def rules_words(snapshot: Snapshot) -> str:
    """Say on how many styles the paper's rule and ours disagree; empty where only ours counts."""
    results = snapshot.results.values()
    if not snapshot.paper or not results:
        return ""
    apart = sum(snapshot.within(one) != one.attainable for one in results)
    return tr(
        "The paper’s rule and ours disagree on {count} of {all} styles.",
        count=apart,
        all=len(results),
    )


def side_line(style: Style) -> str:
    """Side of a style as the second line of its card; one without any says so."""
    return style.side_words or tr("painted")


def _card(snapshot: Snapshot, name: str, chosen: bool) -> CardState:
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
        own=name in snapshot.asking,
        chosen=chosen,
        version=snapshot.version,
        target=target,
        here=here,
    )
    if result is None:
        return card
    match = whole_of(result.match)
    card = replace(card, match=str(match), meter=float(min(match, 100)))
    turn = result.turn_refined_deg
    if snapshot.paper:
        return _paper_card(card, style, result, snapshot)
    if result.attainable:
        taken = taken_for(result, snapshot)
        card = replace(card, turn=size_words(turn), way=direction_of(turn))
        beside = beside_words(result, snapshot)
        tip = ". ".join([style.full_title, *beside, *([taken] if taken else [])])
        if beside:
            return replace(card, line=short_words(beside[0]), tip=f"{tip}.")
        if taken:
            title = snapshot.styles[result.neighbour or ""].title
            line, brief = (words[style.side].format(style=title) for words in (_LIKE, _LIKE_BRIEF))
            card = replace(card, line=line, brief=brief)
        return replace(card, tip=f"{tip}.")
    reason, brief = _short_reason(result, snapshot.question.limits)
    tip = f"{style.full_title}. {result.reason}. {verdict_of(result, snapshot)}"
    return replace(card, line=reason, brief=brief, tip=tip, in_reach=False)


def lamps_note(snapshot: Snapshot, name: str) -> str:
    """Say that a style is not lit by the lamps that were chosen, where it is not."""
    head = snapshot.question.head
    wanted = head.studio_wanted(name)
    if name in snapshot.asking or head.pack.studio(name) == wanted:
        return ""
    words = studio_words(wanted)
    return tr("Shown with its own lamps: at {lamps} it would not be seen.", lamps=words)


def _with_note(card: CardState, snapshot: Snapshot) -> CardState:
    note = lamps_note(snapshot, card.key)
    if not note:
        return card
    tip = f"{card.tip.removesuffix('.')}. {note}"
    return replace(card, tip=tip, spoken=f"{card.spoken}. {note}")


def _paper_card(
    card: CardState, style: Style, result: StyleResult, snapshot: Snapshot
) -> CardState:
    """Card by the paper's rule: C, grey below its limit, and our grade where that differs."""
    quality, least = snapshot.quality(result), snapshot.question.limits.quality
    most = max(*map(snapshot.quality, snapshot.results.values()), least, 1e-30)
    within, turn = snapshot.within(result), result.turn_refined_deg
    words = quality_words(quality)
    grade = grade_words(result.grade, result.attainable)
    ours = tr("Ours: {grade}", grade=grade)
    told = tr("Largest C {quality}, limit {limit:.0f}", quality=words, limit=least)
    why = result.reason or result.shortfall
    tip = [style.full_title, told, ours, *([why] if why else [])]
    card = replace(
        card,
        match=tr("C {quality}", quality=words),
        meter=100.0 * max(quality, 0.0) / most,
        limit=100.0 * least / most,
        in_reach=within,
        tip=". ".join(tip) + ".",
    )
    if within:
        card = replace(card, turn=size_words(turn), way=direction_of(turn))
    if within == result.attainable:
        return card
    line = _OURS.get(style.side, tr("Ours: {grade}")).format(grade=grade)
    return replace(card, line=line, brief=ours)


def quality_words(value: float) -> str:
    """Write C, rounded down, so that a value under the limit never reads as the limit."""
    return f"{math.floor(value)}".replace("-", "−")


def numbers_words(match: float, quality: float | None) -> str:
    """Write match, and C where that decides, as cards and plots say them."""
    told = {"match": str(whole_of(match))}
    if quality is None:
        return tr("match {match}", **told)
    return tr("C {quality}, match {match}", quality=quality_words(quality), **told)


def least_match(snapshot: Snapshot, style: Style) -> float:
    """Match that a style in reach has at least."""
    own = style.signature
    return own.match[1] if own.relations else snapshot.question.limits.match


def beside_words(result: StyleResult, snapshot: Snapshot) -> list[str]:
    """Say in what respect a style in reach comes only near, and what it may be taken for."""
    titles = {name: style.full_title for name, style in snapshot.styles.items()}
    found = []
    if result.looks_more_like is not None:
        found.append(tr("Looks more like {style}", style=titles[result.looks_more_like]))
    elif result.shortfall:
        found.append(tr("Nearly. {what}", what=result.shortfall))
    same = [titles[name] for name in result.same_picture if name in titles]
    if same:
        found.append(tr("The same picture as {styles}", styles=", ".join(same)))
    return found


def taken_for(result: StyleResult, snapshot: Snapshot) -> str:
    """Say what the picture of a style in reach may be taken for; empty where that is said."""
    other = snapshot.styles.get(result.neighbour or "")
    if other is None or not result.attainable or result.neighbour == result.looks_more_like:
        return ""
    title = other.title if other.side in (result.side, "none") else other.full_title
    return tr("May be taken for {style}", style=title)


def short_words(sentence: str) -> str:
    """Keep of a sentence what a card has room for: what stands before the numbers' reason."""
    words = sentence.partition(";")[0].partition(":")[0]
    return _SHORTER.get(words, words)


def _short_reason(result: StyleResult, limits: Limits) -> tuple[str, str]:
    """Say why not as a card can, and as a narrow card can."""
    if result.grade is not None:
        words = short_words(result.reason or "")
        return words, words
    if result.match >= limits.match and result.strength < limits.strength:
        told = {"strength": whole_of(result.strength), "least": f"{limits.strength:.0f}"}
        return (
            tr("Too soft: strength {strength}, needs {least}", **told),
            tr("Too soft: {strength}, needs {least}", **told),
        )
    words = short_words(result.reason or "")
    return words, words


def verdict_of(result: StyleResult, snapshot: Snapshot) -> str:
    """Say what the best is that a place can do for a style out of reach.

    Returns:
        "Best match here is 29 at 62° counter-clockwise. The limit is 45."
    """
    limits, turn = snapshot.question.limits, result.turn_refined_deg
    told = {"turn": turn_words(turn)}
    if result.grade is not None:
        told["best"] = str(whole_of(result.match))
        if whole(turn) == 0:
            return tr("Best match here is {best} without a turn.", **told)
        return tr("Best match here is {best} at {turn}.", **told)
    if result.match >= limits.match:
        told |= {"best": str(whole_of(result.strength)), "limit": f"{limits.strength:.0f}"}
        if whole(turn) == 0:
            return tr("Best strength here is {best} without a turn. The limit is {limit}.", **told)
        return tr("Best strength here is {best} at {turn}. The limit is {limit}.", **told)
    match = whole_of(result.match)
    told |= {"best": str(match), "limit": f"{limits.match:.0f}"}
    if match < _NOTHING_LIKE:
        return tr(
            "No turn here comes close: the best match is {best}, and {limit} is needed.", **told
        )
    if whole(turn) == 0:
        return tr("Best match here is {best} without a turn. The limit is {limit}.", **told)
    return tr("Best match here is {best} at {turn}. The limit is {limit}.", **told)


def _spoken(style: Style, result: StyleResult | None, snapshot: Snapshot) -> str:
    light = _SPOKEN.get(style.side) or (
        tr("light {place}", place=style.side_words) if style.place else tr("painted")
    )
    if result is None:
        return tr("{title}, {light}, not measured yet", title=style.title, light=light)
    turn = whole(result.turn_refined_deg)
    way = tr("no turn needed")
    if turn > 0:
        way = tr_plural("turn {count} degree clockwise", "turn {count} degrees clockwise", turn)
    elif turn < 0:
        way = tr_plural(
            "turn {count} degree counter-clockwise", "turn {count} degrees counter-clockwise", -turn
        )
    reach = tr("nearly in reach") if result.grade == "nearly" else tr("in reach")
    if not result.attainable:
        reason = short_words(result.reason or "")
        reach = tr("out of reach: {reason}", reason=reason[:1].lower() + reason[1:])
    elif taken := taken_for(result, snapshot):
        reach = tr("{reach}. {taken}", reach=reach, taken=taken)
    if snapshot.paper:
        rule = tr("in reach") if snapshot.within(result) else tr("out of reach")
        grade = grade_words(result.grade, result.attainable)
        reach = tr("{rule} by the paper’s rule, ours: {grade}", rule=rule, grade=grade)
    return tr(
        "{title}, {light}, {way}, {numbers}, {reach}",
        title=style.title,
        light=light,
        way=way,
        numbers=numbers_words(result.match, snapshot.quality(result) if snapshot.paper else None),
        reach=reach,
    )


def _damaged_card(damaged: Damaged) -> CardState:
    return CardState(
        key=str(damaged.path),
        title=damaged.path.stem,
        line=CANNOT_READ,
        tip=damaged.reason,
        spoken=f"{damaged.path.stem}, {CANNOT_READ} {damaged.reason}",
        in_reach=False,
        own=True,
        damaged=damaged.path,
    )
