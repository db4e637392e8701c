"""The list of styles that a lamp makes possible or better, hardly changes or leaves out of reach.

A style that the picture shows no differently is not counted among those that the lamp helps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from app.core.base.arrays import Bytes
from app.core.second_light.lamp_answers import Answers, Nearer, kind_of, powers_for
from app.core.second_light.search import LampPlacement
from app.core.solver.shortfall import Cause, LightShortfall
from app.core.solver.turn_choice import LIMITS
from app.core.styles.style import Style
from app.core.text import tr
from app.ui.screens.light.lamp import lamp_words
from app.ui.screens.styles.cards import side_line
from app.words.lamps import HARDLY_CHANGES, power_share
from app.words.phrases.quantities import lower_first, metres
from app.words.verdict import whole_of
from app.words.why_out_of_reach import reason_line, too_soft_words

NOW_POSSIBLE: Final = tr("Now possible with this lamp")
BETTER: Final = tr("Better with this lamp")
STILL_OUT: Final = tr("Still out of reach")
TOO_WEAK: Final = tr("This lamp is too weak at {distance}.")
STRONGER: Final = tr("Try a stronger one.")


@dataclass(frozen=True, slots=True)
class RowState:
    """A row in the list. Rows that compare equal look the same.

    Attributes:
        picture: Target portrait, (h, w, 3) uint8 sRGB, or None if there is none. It is ignored in
            comparisons.
    """

    key: str
    title: str
    line: str
    before: int
    after: int
    limit: float = 45.0
    power: str = ""
    chosen: bool = False
    spoken: str = ""
    version: int = 0
    picture: Bytes | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Section:
    """A section of the list, with its title, its count (such as "3 of 9") and its styles."""

    title: str
    count: str
    rows: tuple[RowState, ...] = ()


GAIN: Final = 10
"""Minimum gain in match that improves a style already within reach that has no grade."""


def rescued(placements: Sequence[LampPlacement]) -> tuple[LampPlacement, ...]:
    """Return the styles that only the lamp brings within reach, best first."""
    return tuple(sorted((one for one in placements if one.rescued), key=lambda one: -one.match))


def better(placements: Sequence[LampPlacement]) -> tuple[LampPlacement, ...]:
    """Return the styles already within reach that the lamp visibly improves, largest gain first."""
    winners = [
        one
        for one in placements
        if one.before.attainable and _improved(one) and not one.hardly_changed
    ]
    return tuple(sorted(winners, key=lambda one: (-_gain(one), -one.match)))


def hardly_changed(placements: Sequence[LampPlacement]) -> tuple[LampPlacement, ...]:
    """Return the styles whose grade the lamp raises without a visible change, best first."""
    members = [one for one in placements if one.hardly_changed and _improved(one)]
    return tuple(sorted(members, key=lambda one: -one.match))


def _improved(one: LampPlacement) -> bool:
    """Return whether the numbers improve, by the grade or, without a grade, by the match."""
    return one.raised or (one.grade is None and one.before.attainable and _gain(one) >= GAIN)


def _gain(one: LampPlacement) -> int:
    return whole_of(one.match) - whole_of(one.before.match)


def front_of(answers: Answers, style_name: str | None) -> LampPlacement | None:
    """Return the style to show, which is the chosen one unless the lamp helps only other styles."""
    candidates = (*rescued(answers.placements), *better(answers.placements))
    one = answers.of(style_name)
    listed = (*candidates, *hardly_changed(answers.placements))
    if one is not None and (not one.before.attainable or one in listed):
        return one
    return candidates[0] if candidates else one or next(iter(answers.placements), None)


def sections_of(
    answers: Answers, front: str | None, pictures: Mapping[str, Bytes], version: int
) -> tuple[Section, ...]:
    """Build the list, omitting all empty sections other than the first."""
    placements = answers.placements
    styles = {style.name: style for style in answers.hand.head.pack.styles}
    out = sum(not one.before.attainable for one in placements)
    rescues, gains, same = rescued(placements), better(placements), hardly_changed(placements)
    hopeless = (one for one in placements if not (one.before.attainable or one.attainable))
    rest = sorted(hopeless, key=lambda one: -one.match)
    parts = (
        (NOW_POSSIBLE, tr("now possible with this lamp"), rescues, out),
        (BETTER, tr("better with this lamp"), gains, len(placements) - out),
        (HARDLY_CHANGES, lower_first(HARDLY_CHANGES), same, len(placements)),
        (STILL_OUT, tr("still out of reach"), rest, out),
    )

    def row(one: LampPlacement, how: str) -> RowState:
        state = _row(one, styles[one.name], how, answers)
        picture = pictures.get(one.name)
        return replace(state, version=version, picture=picture, chosen=one.name == front)

    return tuple(
        Section(
            title,
            tr("{number} of {count}", number=len(members), count=count),
            tuple(row(one, how) for one in members),
        )
        for number, (title, how, members, count) in enumerate(parts)
        if members or (out and not number)
    )


def _row(one: LampPlacement, style: Style, how: str, answers: Answers) -> RowState:
    kind = kind_of(answers)
    before, after = whole_of(one.before.match), whole_of(one.match)
    side = side_line(style)
    why = "" if one.attainable else reason_line(one.shortfall)
    if isinstance(one.shortfall, LightShortfall) and one.shortfall.cause is Cause.WEAK_LAMP:
        # One sentence covers all rows, but a row with a sufficient match needs its own reason.
        soft = too_soft_words(one.strength, LIMITS.strength)
        why = soft if one.grade is None and one.match >= LIMITS.match else ""
    dims = kind and len(powers_for(answers)) > 1
    power = tr("{share} power", share=power_share(one.power, kind)) if dims else ""
    values = {
        "title": style.title,
        "side": side,
        "before": before,
        "after": after,
        "power": power,
        "how": how,
    }
    return RowState(
        key=one.name,
        title=style.title,
        line=why or side,
        before=before,
        after=after,
        limit=LIMITS.match,
        power=power,
        spoken=tr(
            "{title}, {side}, match {before} without the lamp, {after} with it at {power}, {how}",
            **values,
        )
        if power
        else tr(
            "{title}, {side}, match {before} without the lamp, {after} with it, {how}", **values
        ),
    )


def note_of(
    answers: Answers, distance_m: float, busy: bool, coming_closer: bool, nearer: Nearer | None
) -> tuple[str, str]:
    """Return the note above the list and the label of the note's button. Either may be empty."""
    if all(one.before.attainable for one in answers.placements):
        return tr("Every style is within reach here. A lamp can still improve some of them."), ""
    if rescued(answers.placements) or busy:
        return "", ""
    if not answers.is_open.all():
        return tr(
            "No style comes within reach from where you can hold the lamp. Allow more positions."
        ), ""
    weak = TOO_WEAK.format(distance=metres(distance_m))
    if coming_closer:
        return weak, ""
    if nearer is None:
        return " ".join((weak, STRONGER)), ""
    name, match = lamp_words(nearer.one.title), whole_of(nearer.one.match)
    near = metres(nearer.distance_m)
    values = {"near": near, "style": name, "match": match}
    if nearer.one.attainable and not nearer.one.rescued:
        return " ".join((weak, STRONGER)), ""
    if nearer.one.attainable:
        brings = tr("At {near}, it raises {style} to {match}.", **values)
        return f"{weak} {brings}", tr("Hold the lamp at {near}", near=near)
    beyond = tr("{style} is out of reach even at {near}.", **values)
    return f"{weak} {beyond}", ""
