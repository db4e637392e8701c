"""The state of the chosen style at any turn, including its numbers and sentences."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final, Literal, TypeAlias

from app.core.base.angles import direction_of, wrap
from app.core.base.arrays import Bytes, Float32
from app.core.solver.peaks import value_at
from app.core.solver.style_result import StyleResult
from app.core.solver.turn_choice import LIMITS
from app.core.text import tr
from app.ui.screens.styles.cards import (
    Way,
    beside_words,
    close_to,
    doubt_note,
    gain_lines,
    least_match,
)
from app.ui.screens.styles.gallery import Snapshot
from app.ui.screens.styles.reason.reason import NO_REASON, ReasonState
from app.words.phrases.directions import lit_aside_words
from app.words.phrases.quantities import contrast_words, lower_first, upper_first
from app.words.phrases.turns import (
    arc_words,
    clock_words,
    direction_words,
    signed,
    size_words,
    turn_words,
)
from app.words.styles import caution_words
from app.words.verdict import (
    numbers_words,
    paper_verdict,
    quality_words,
    verdict_sentence,
    whole_of,
)
from app.words.why_out_of_reach import grade_words, reason_line, reason_sentence

_SAME_DEG: Final = 1e-6

Main: TypeAlias = Literal["turn", "lamp", "probe"]
"""The main button's action: go to the turn, try a second light, or measure the light first."""


@dataclass(frozen=True, slots=True)
class CurveMark:
    """A marked turn on the curve, with its picture.

    Attributes:
        tag, words: Display text such as "Median" and "Median at −84°: C 12".
        picture: Picture at that turn, (h, w, 3) uint8 sRGB, at the size of the portraits.
    """

    tag: str
    turn_deg: float
    words: str
    picture: Bytes = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class DetailState:
    """The chosen style at one turn. All text is ready for display, and empty text is hidden.

    Attributes:
        target, here: Portraits with the same size, crop and exposure rule, each (h, w, 3) uint8
            sRGB or None.
        target_tag, here_tag: Display text such as "Target" and "Here, at 96°".
        target_exposed, here_exposed: Text such as "+1.3 stops", set only for the picture here.
        exposed_tip: Sentence that explains the reference for these stops.
        lamps_note: Text such as "Shown with its own lamps: lamps of 2:1 would not show it."
        marks: Turns with the median and the minimum C, as in figure 4 of the paper. Used only in
            paper mode.
        curve: Match at 64 turns, from 0 to 100, or an empty tuple before the light is measured.
        close: Text such as "Close to Rembrandt".
        numbers, limit_words: Display text such as "match 87" and "Limit of reach: 45", worded as on
            the card.
        arc: Tolerance arc, in degrees, or None if the style is out of reach.
        best: Best turn, in degrees, or None before the light is measured.
        peaks: Turns of the other peaks, in degrees.
        needle: Displayed turn, in degrees.
        turn: Text such as "96°".
        direction, clock: Display text such as "clockwise" and "towards 3 o’clock".
        good_from, match, contrast: Display text such as "79° to 111°", "96" and "62% of the
            studio’s".
        ratio, ratio_short, ratio_tip: Display text such as "2.3 stops" and "4.9:1 key + fill :
            fill", and the ratio as a whole sentence.
        verdict, reason: For a style out of reach, the verdict, such as "The best match here is 29
            at 62° counter-clockwise. The limit is 45.", and the reason.
        why: The light in the way of the style at the best turn, and the areas of the face that show
            it.
        panorama: Panorama of the place, (H, W, 3) uint8 sRGB, or None. All states of a place share
            the same object.
        front: Panorama azimuth of the photographer, in degrees.
        weights: Pre-integrated target at turn 0, (h, w) float32, or None. All states of a style and
            head share the same object.
        background: View behind the sitter at the needle's turn, (h, w, 3) uint8 sRGB, or None.
        stale: Whether the state is for another selection and therefore dimmed under "Computing…".
    """

    key: str = ""
    title: str = ""
    side: str = ""
    close: str = ""
    target: Bytes | None = field(default=None, repr=False)
    here: Bytes | None = field(default=None, repr=False)
    marks: tuple[CurveMark, ...] = ()
    target_tag: str = tr("Target")
    lamps_note: str = ""
    here_tag: str = ""
    target_exposed: str = ""
    here_exposed: str = ""
    exposed_tip: str = ""
    curve: tuple[float, ...] = ()
    curve_name: str = tr("Match by turn")
    numbers: str = ""
    limit: float = 45.0
    limit_words: str = ""
    arc: tuple[float, float] | None = None
    best: float | None = None
    peaks: tuple[float, ...] = ()
    needle: float = 0.0
    at_best: bool = True
    turn: str = ""
    way: Way = ""
    direction: str = ""
    clock: str = ""
    good_from: str = ""
    quality: str = ""
    match: str = ""
    contrast: str = ""
    caution: str = ""
    ratio: str = ""
    ratio_short: str = ""
    ratio_tip: str = ""
    glare: str = ""
    glare_tip: str = ""
    glare_strong: bool = False
    in_reach: bool = True
    verdict: str = ""
    reason: str = ""
    why: ReasonState = NO_REASON
    panorama: Bytes | None = field(default=None, repr=False)
    front: float = 0.0
    weights: Float32 | None = field(default=None, repr=False)
    background: Bytes | None = field(default=None, repr=False)
    main: Main = "turn"
    main_words: str = tr("Turn to this")
    main_works: bool = True
    stale: bool = False


def with_words(
    base: DetailState, snapshot: Snapshot, result: StyleResult, turn: float, *, at_best: bool
) -> DetailState:
    """Return the state with the numbers and sentences for the given turn, in degrees."""
    within = snapshot.within(result)
    # At the best turn, show the same numbers as the card.
    match = result.match if at_best else value_at(result.match_curve, turn)
    strength = result.strength if at_best else value_at(result.strength_curve, turn)
    quality = None
    if snapshot.paper:
        scaled = result.quality_curve * snapshot.quality_scale
        quality = snapshot.quality(result) if at_best else value_at(scaled, turn)
    least = least_match(snapshot, snapshot.styles[result.name])
    peaks = tuple(peak.turn_refined_deg for peak in result.peaks[1:])
    state = replace(
        base,
        side=". ".join(
            filter(None, (upper_first(lit_aside_words(result.yaw_deg, result.lighting)), base.side))
        ),
        here_tag=tr("Here, at {turn}", turn=signed(turn)),
        curve=tuple(result.match_curve.tolist()),
        numbers=numbers_words(match, quality),
        limit=least,
        limit_words=tr("Limit of reach: {limit:.0f}", limit=least),
        arc=result.arc_near(turn) if within else None,
        best=result.turn_refined_deg,
        peaks=peaks,
        needle=turn,
        at_best=at_best or abs(wrap(turn - result.turn_refined_deg)) < _SAME_DEG,
        turn=size_words(turn),
        way=direction_of(turn),
        direction=direction_words(turn),
        clock=clock_words(turn),
        good_from=_good(result, turn, within, snapshot),
        caution=_caution(result, snapshot),
        match=str(whole_of(match)),
        contrast=contrast_words(strength),
        in_reach=within,
        close=close_to(result, snapshot),
    )
    if quality is not None:
        state = _with_quality(state, snapshot, result, quality)
    beside = beside_words(result, snapshot) + gain_lines(result)
    if within:
        return replace(state, reason=" ".join(f"{words}." for words in beside))
    verdict = verdict_sentence(result)
    if quality is not None:
        verdict = paper_verdict(snapshot.quality(result))
    # A style that only the paper's rule puts out of reach has no shortfall.
    lacks = None if result.attainable else result.shortfall
    cause = reason_line(lacks) if result.grade is None else reason_sentence(lacks)
    return replace(
        state,
        verdict=verdict,
        reason=f"{cause}." if cause else "",
        main="lamp",
        main_words=tr("Try a lamp"),
    )


def _with_quality(
    state: DetailState, snapshot: Snapshot, result: StyleResult, quality: float
) -> DetailState:
    """Show C instead of the match, scaled from the lower of its minimum and 0 to its maximum."""
    curve, limit = result.quality_curve * snapshot.quality_scale, LIMITS.quality
    low = min(float(curve.min()), 0.0)
    size = max(float(curve.max()), limit, low + 1e-30) - low
    match = state.match
    if state.at_best:
        # The grade applies to the picture at the best turn.
        grade = grade_words(result.grade, result.attainable)
        match = tr("{match}, ours: {grade}", match=match, grade=grade)
    return replace(
        state,
        here_tag=tr("Maximum") if state.at_best else tr("Here"),
        curve=tuple((100.0 * (curve - low) / size).tolist()),
        curve_name=tr("Quality by turn"),
        limit=100.0 * (limit - low) / size,
        limit_words=tr("Limit of C: {limit:.0f}", limit=limit),
        quality=quality_words(quality),
        match=match,
        contrast="",
    )


def _caution(result: StyleResult, snapshot: Snapshot) -> str:
    """Return a warning if the turn depends on the sitter's head or on an estimate, or else ""."""
    words = caution_words(snapshot.source(result.name)) if result.attainable else None
    parts = (doubt_note(snapshot, result.name), f"{words}." if words else "")
    return " ".join(filter(None, parts))


def _good(result: StyleResult, turn: float, within: bool, snapshot: Snapshot) -> str:
    """Describe the tolerance arc and its reliability, or return "" if the style is out of reach."""
    if not within:
        return ""
    arc = arc_words(result.arc_near(turn))
    name = result.name
    unsure = snapshot.hazards(name) or (result.attainable and caution_words(snapshot.source(name)))
    return tr("{arc}, less certain", arc=arc) if unsure else arc


def numbers_text(state: DetailState, place: str = "") -> str:
    """Return a style's numbers as lines of text for the clipboard."""
    lines = [f"{state.title}, {lower_first(state.side)}"]
    if place:
        lines.append(tr("Place: {place}", place=place))
    if state.match:
        turn = turn_words(state.needle)
        lines.append(tr("Turn: {turn}, {clock}", turn=turn, clock=state.clock))
        numbers = tr("C {quality}, match {match}", quality=state.quality, match=state.match)
        if not state.quality:
            values = {"match": state.match, "contrast": state.contrast}
            numbers = tr("Match {match}, contrast {contrast}", **values)
        lines.append(numbers)
    if state.good_from:
        lines.append(tr("Good from {arc}", arc=state.good_from))
    lines += [
        text for text in (state.verdict, state.caution, state.ratio_tip, state.glare_tip) if text
    ]
    return "\n".join(lines) + "\n"
