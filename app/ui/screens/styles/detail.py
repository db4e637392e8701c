"""The detail of the chosen style at any turn: pictures, plot, numbers and words.

All of it follows the needle while it is dragged; what does not depend on the turn is kept.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Final

import numpy as np

from app.core.base.angles import direction_of, turn_of_index, wrap
from app.core.base.arrays import Bytes
from app.core.base.colour import FloatImage
from app.core.localization.views import background_view
from app.core.portrait.face_light import (
    Glare,
    cheeks,
    eye_light,
    glare,
    lighting_ratio,
)
from app.core.portrait.gallery_portraits import exposure_in_mean_light
from app.core.solver.peaks import best_index, value_at
from app.core.solver.place_light import Facing, PlaceLight, picture_at
from app.core.solver.style_result import StyleResult
from app.core.solver.turn_choice import LIMITS
from app.core.text import tr
from app.ui.presenters.model import COMPUTING, looking_words
from app.ui.screens.styles.cards import (
    beside_words,
    close_to,
    doubt_note,
    gain_lines,
    lamps_note,
    least_match,
)
from app.ui.screens.styles.gallery import GalleryQuestion, Snapshot, ValueCache
from app.ui.screens.styles.state import CurveMark, DetailState, Sizes
from app.words.phrases.directions import light_words, lit_aside_words
from app.words.phrases.quantities import contrast_words, exposed_words, lower_first, upper_first
from app.words.phrases.turns import (
    arc_words,
    clock_words,
    direction_words,
    signed,
    size_words,
    turn_words,
)
from app.words.portrait.face_light import (
    catchlight_words,
    glare_line,
    glare_sentence,
    ratio_line,
    ratio_sentence,
    stops_words,
)
from app.words.shortfall import grade_words, reason_line, reason_sentence
from app.words.styles import caution_words
from app.words.verdict import (
    numbers_words,
    paper_verdict,
    quality_words,
    verdict_sentence,
    whole_of,
)

_SAME_DEG: Final = 1e-6
_EXPOSED: Final = tr("Exposure {exposed}, relative to a face in this place’s average light")
_ALIKE: Final = tr("Exposure {exposed}, the same for all pictures here, set by the selected style")

_OF_PICTURE: Final = (
    *("here", "here_exposed", "exposed_tip", "lamps_note", "marks"),
    *("ratio", "ratio_short", "ratio_tip", "glare", "glare_tip", "glare_strong"),
)
"""What is read off the picture here, and so comes with it."""


class DetailResolver:
    """Resolves the detail; keeps what stays the same from one turn to the next.

    Args:
        before: What it has kept is taken over; nothing is shared, so another thread may use it.
    """

    def __init__(self, before: DetailResolver | None = None) -> None:
        self._cache: ValueCache = ValueCache(None if before is None else before._cache)

    def at(
        self,
        snapshot: Snapshot,
        name: str,
        needle_deg: float | None,
        sizes: Sizes,
        *,
        quick: bool = False,
        draft: bool = False,
        last: DetailState | None = None,
    ) -> DetailState:
        """Resolve the detail of a style.

        Args:
            needle_deg: Turn that is looked at, deg; None is the best.
            quick: With pictures that follow a hand, unless larger ones are there already.
            draft: With one of half as many pixels, and no catchlights read off it.
            last: Its larger picture, shown in place of a quick one.
        """
        key = (name, needle_deg, sizes.portrait, sizes.background)
        quick = quick and not self._cache.has("state", (*key, None), snapshot)
        last = last if quick else None
        return self._cache.once(
            "quick-state" if quick else "draft-state" if draft else "state",
            (*key, last),
            snapshot,
            lambda: self._resolved(snapshot, name, needle_deg, sizes, last, quick, draft),
        )

    def is_quick(self, state: DetailState) -> bool:
        """Whether larger pictures of a state are still to be made."""
        return self._cache.is_value("quick-state", state)

    def _resolved(
        self,
        snapshot: Snapshot,
        name: str,
        needle_deg: float | None,
        sizes: Sizes,
        last: DetailState | None,
        quick: bool,
        draft: bool,
    ) -> DetailState:
        style = snapshot.styles[name]
        base = DetailState(
            key=name,
            title=style.title,
            side=light_words(style.side, style.place) or tr("Painted"),
            target=self._target(snapshot, name, sizes, quick),
            lamps_note=lamps_note(snapshot, name),
            weights=self._weights(snapshot, name),
            front=snapshot.question.front_deg,
        )
        light, result = snapshot.question.light, snapshot.results.get(name)
        if light is None:
            return replace(base, main="probe", main_words=tr("Go to Probe"))
        if result is None:
            return replace(base, panorama=light.display, main_works=False)
        turn = result.turn_refined_deg if needle_deg is None else needle_deg
        state = _with_words(base, snapshot, result, turn, at_best=needle_deg is None)
        view = self._background(light, turn, snapshot.question.front_deg, sizes)
        state = replace(state, panorama=light.display, background=view)
        if last is not None:
            return self._with_last_picture(state, snapshot, last)
        return self._with_pictures(state, snapshot, light, turn, sizes, quick, draft)

    def _with_last_picture(
        self, state: DetailState, snapshot: Snapshot, last: DetailState
    ) -> DetailState:
        """Keep the last picture under a moving needle; what is read off it is of its own turn."""
        if last.needle == state.needle:
            return replace(state, **{name: getattr(last, name) for name in _OF_PICTURE})
        return replace(
            state,
            here=last.here,
            here_tag=COMPUTING,
            marks=last.marks,
            lamps_note=state.lamps_note or looking_words(snapshot.head_for(state.key)),
            ratio=COMPUTING,
        )

    def _with_pictures(
        self,
        state: DetailState,
        snapshot: Snapshot,
        light: PlaceLight,
        turn: float,
        sizes: Sizes,
        quick: bool,
        draft: bool,
    ) -> DetailState:
        head = snapshot.head_for(state.key)
        marks: tuple[CurveMark, ...] = ()
        if snapshot.paper:
            marks = self._marks(snapshot, snapshot.results[state.key], light, sizes, quick)
        # The draft and the picture with all pixels that follows have these in common.
        values, linear, exposed = self._cache.once(
            "lit",
            (state.key, turn),
            snapshot,
            lambda: self._portrait_parts(snapshot, state.key, light, turn),
        )
        here = Facing(light, wrap(turn + snapshot.question.front_deg - head.yaw_deg))
        return replace(
            state,
            **values,
            lamps_note=state.lamps_note
            or (
                looking_words(head)
                if quick or draft
                else catchlight_words(head.catchlights(here, snapshot.question.findings()))
            ),
            here=head.portraits(
                [linear], sizes.portrait, [here], quick=quick, draft=draft, gains=exposed
            )[0],
            marks=marks,
        )

    def _portrait_parts(
        self, snapshot: Snapshot, name: str, light: PlaceLight, turn: float
    ) -> tuple[dict[str, Any], FloatImage, tuple[float, ...]]:
        """What a turn's light says of itself, its picture and by what that is exposed."""
        question, head = snapshot.question, snapshot.head_for(name)
        transport = question.head.transport
        facing = wrap(turn + question.front_deg)
        nose = wrap(facing - head.yaw_deg)
        straight = picture_at(transport, light, nose)
        linear = picture_at(head.transport, light, nose) if head.yaw_deg else straight
        warning = self._glare(light, facing, question)
        areas = self._cache.once("cheeks", 0, question.head, lambda: cheeks(transport))
        ratio = lighting_ratio(transport, straight.reshape(-1, 3)[transport.pixels], areas)
        exposed = snapshot.exposed or head.exposures([linear], [Facing(light, nose)])
        zero = self._cache.once(
            "zero",
            question.head.name,
            light,
            lambda: exposure_in_mean_light(transport, light.searched),
        )
        stops = exposed_words(math.log2(exposed[0] / zero))
        values = {
            "here_exposed": stops,
            "exposed_tip": (_ALIKE if snapshot.exposed else _EXPOSED).format(exposed=stops),
            "ratio": stops_words(ratio),
            "ratio_short": ratio_line(ratio),
            "ratio_tip": tr("Lighting ratio: {ratio}", ratio=ratio_sentence(ratio)),
            "glare": glare_line(warning),
            "glare_tip": glare_sentence(warning) if warning.warns else "",
            "glare_strong": warning.level == "strong",
        }
        return values, linear, exposed

    def _marks(
        self,
        snapshot: Snapshot,
        result: StyleResult,
        light: PlaceLight,
        sizes: Sizes,
        quick: bool,
    ) -> tuple[CurveMark, ...]:
        """Median and least C of all turns, with their pictures: figure 4 of the paper."""
        curve, head = result.quality_curve, snapshot.question.head
        everywhere = np.ones(len(curve), bool)

        def mark(tag: str, words: str, index: int) -> CurveMark:
            turn = turn_of_index(index)
            facing = wrap(turn + snapshot.question.front_deg)
            linear = picture_at(head.transport, light, facing)
            here = [Facing(light, facing)]
            (picture,) = head.portraits(
                [linear], sizes.portrait, here, quick=quick, gains=snapshot.exposed
            )
            value = quality_words(float(curve[index]) * snapshot.quality_scale)
            text = words.format(turn=signed(turn), quality=value)
            return CurveMark(tag, turn, text, picture)

        def make() -> tuple[CurveMark, ...]:
            middle = -np.abs(curve - np.median(curve))
            return (
                mark(
                    tr("Median"),
                    tr("Median at {turn}: C {quality}"),
                    best_index(middle, everywhere),
                ),
                mark(
                    tr("Minimum"),
                    tr("Minimum at {turn}: C {quality}"),
                    best_index(-curve, everywhere),
                ),
            )

        return self._cache.once(f"marks {quick}", (sizes.portrait, snapshot.exposed), result, make)

    def _target(self, snapshot: Snapshot, name: str, sizes: Sizes, quick: bool) -> Bytes:
        head, size = snapshot.head_for(name), sizes.portrait
        owner, style = snapshot.asking.get(name, head), snapshot.lit_style(name)
        quick = quick and not self._cache.has("target", (name, size), owner)
        return self._cache.once(
            "quick-target" if quick else "target",
            (name, size),
            owner,
            lambda: head.portraits([snapshot.target(name)], size, [style], quick=quick)[0],
        )

    def _weights(self, snapshot: Snapshot, name: str) -> FloatImage:
        head, asking = snapshot.question.head, snapshot.asking.get(name)
        if asking is not None:
            return self._cache.once(
                "weights", name, asking, lambda: asking.weights.preintegrated(head.transport)
            )
        pack, yaw = head.pack, snapshot.head_for(name).yaw_deg
        name = snapshot.source(name)
        # Shown at the turn of the lens; a texel is the nearest that a picture can show.
        columns = round(yaw / 360.0 * pack.header.environment[1])

        def make() -> FloatImage:
            return np.roll(pack.preintegrated[pack.index(name)], -columns, axis=1)

        return self._cache.once("weights", (name, columns), head, make)

    def _background(self, light: PlaceLight, turn: float, front: float, sizes: Sizes) -> Bytes:
        rows, columns = sizes.background
        return self._cache.once(
            "background",
            (turn, front, sizes.background),
            light,
            lambda: background_view(light.display, turn, (columns, rows), front),
        )

    def _glare(self, light: PlaceLight, facing: float, question: GalleryQuestion) -> Glare:
        eyes = self._cache.once("eyes", 0, light, lambda: eye_light(light.environment.radiance))
        return glare(eyes, facing, question.sun, question.findings())


def _with_words(
    base: DetailState, snapshot: Snapshot, result: StyleResult, turn: float, *, at_best: bool
) -> DetailState:
    within = snapshot.within(result)
    # At the best turn they are those of the card.
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
    # What is out of reach by the paper's rule alone lacks nothing of the style.
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
    """Show C in place of match: from 0, or from the least where that is below, to the largest."""
    curve, limit = result.quality_curve * snapshot.quality_scale, LIMITS.quality
    low = min(float(curve.min()), 0.0)
    size = max(float(curve.max()), limit, low + 1e-30) - low
    match = state.match
    if state.at_best:
        # The grade is that of the picture there.
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
    """Say that the turn depends on the sitter's own head, or on a guess, where it does."""
    words = caution_words(snapshot.source(result.name)) if result.attainable else None
    parts = (doubt_note(snapshot, result.name), f"{words}." if words else "")
    return " ".join(filter(None, parts))


def _good(result: StyleResult, turn: float, within: bool, snapshot: Snapshot) -> str:
    """Write the tolerance arc, and whether other heads would have another."""
    if not within:
        return ""
    arc = arc_words(result.arc_near(turn))
    name = result.name
    unsure = snapshot.is_doubtful(name) or (
        result.attainable and caution_words(snapshot.source(name))
    )
    return tr("{arc}, less certain", arc=arc) if unsure else arc


def numbers_text(state: DetailState, place: str = "") -> str:
    """Write down the numbers of a style, to be pasted elsewhere."""
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
