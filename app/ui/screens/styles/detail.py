"""The detail of the chosen style at any turn: pictures, plot, numbers and words.

All of it follows the needle while it is dragged; what does not depend on the turn is kept.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.base.colour import FloatImage
from app.core.localization.views import background_view
from app.core.portrait.face_light import (
    DEEPEST_STOPS,
    Glare,
    LightingRatio,
    eye_light,
    glare,
    lighting_ratio,
    ratio_words,
)
from app.core.solver.place_light import PlaceLight, picture_at
from app.core.solver.portraits import framing, portraits, value_at
from app.core.solver.solve import StyleResult
from app.core.solver.styles import Style
from app.core.solver.turn_choice import caution
from app.core.text import tr, tr_plural
from app.core.text.directions import face_direction_words, light_words
from app.core.text.turns import (
    arc_words,
    clock_words,
    direction_of,
    direction_words,
    signed,
    size_words,
    turn_words,
)
from app.ui.screens.styles.gallery import (
    Kept,
    Snapshot,
    beside_words,
    lamps_note,
    least_match,
    verdict_of,
    whole_of,
)
from app.ui.screens.styles.state import DetailState, Sizes

_ARC_SHARE: Final = 97.0  # of the best quality: where the tolerance arc ends
_SAME_DEG: Final = 1e-6
# Keyed by whether it is the sun, and whether it is strong.
_GLARE: Final = {
    (True, True): tr("Sun in the eyes: {where}"),
    (True, False): tr("Sun in view: {where}"),
    (False, True): tr("Bright lamp in the eyes: {where}"),
    (False, False): tr("Bright lamp in view: {where}"),
}


class Detail:
    """Resolves the detail; keeps what stays the same from one turn to the next.

    Args:
        before: What it has kept is taken over; nothing is shared, so another thread may use it.
    """

    def __init__(self, before: Detail | None = None) -> None:
        self._kept: Kept = Kept(None if before is None else before._kept)

    def at(
        self, snapshot: Snapshot, name: str, needle_deg: float | None, sizes: Sizes
    ) -> DetailState:
        """Resolve the detail of a style.

        Args:
            needle_deg: Turn that is looked at, deg; None is the best.
        """
        return self._kept.once(
            "state",
            (name, needle_deg, sizes),
            snapshot,
            lambda: self._resolved(snapshot, name, needle_deg, sizes),
        )

    def _resolved(
        self, snapshot: Snapshot, name: str, needle_deg: float | None, sizes: Sizes
    ) -> DetailState:
        style = snapshot.styles[name]
        base = DetailState(
            key=name,
            title=style.title,
            side=_side(style),
            own=name in snapshot.asking,
            target=self._target(snapshot, name, sizes),
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
        return self._with_pictures(state, snapshot, light, turn, sizes)

    def _with_pictures(
        self, state: DetailState, snapshot: Snapshot, light: PlaceLight, turn: float, sizes: Sizes
    ) -> DetailState:
        question = snapshot.question
        transport = question.head.transport
        facing = wrap(turn + question.front_deg)
        linear = picture_at(transport, light, facing)
        warning = self._glare(light, facing, question.sun)
        ratio = lighting_ratio(transport, linear.reshape(-1, 3)[transport.pixels])
        number, two = _ratio_words(ratio)
        return replace(
            state,
            ratio=number,
            ratio_short=tr("{ratio} key + fill : fill", ratio=two),
            ratio_tip=tr("Lighting ratio: {ratio}", ratio=ratio.words),
            here=self._portrait(snapshot, linear, sizes),
            background=self._background(light, turn, question.front_deg, sizes),
            panorama=light.display,
            glare=_glare_words(warning),
            glare_tip=warning.words if warning.warns else "",
            glare_strong=warning.level == "strong",
        )

    def _target(self, snapshot: Snapshot, name: str, sizes: Sizes) -> Bytes:
        owner = snapshot.asking.get(name, snapshot.question.head)
        return self._kept.once(
            "target",
            (name, sizes.portrait),
            owner,
            lambda: self._portrait(snapshot, snapshot.target(name), sizes),
        )

    def _weights(self, snapshot: Snapshot, name: str) -> FloatImage:
        head, asking = snapshot.question.head, snapshot.asking.get(name)
        if asking is not None:
            return self._kept.once(
                "weights", name, asking, lambda: asking.weights.preintegrated(head.transport)
            )
        pack = head.pack
        return self._kept.once("weights", name, head, lambda: pack.preintegrated[pack.index(name)])

    def _portrait(self, snapshot: Snapshot, linear: FloatImage, sizes: Sizes) -> Bytes:
        head = snapshot.question.head
        coverage = self._kept.once(
            "coverage", 0, head, lambda: head.pack.coverage.astype(np.float32)
        )
        frame = framing(head.transport.size, sizes.portrait)
        shown: Bytes = portraits(linear[np.newaxis], coverage, frame)[0]
        return shown

    def _background(self, light: PlaceLight, turn: float, front: float, sizes: Sizes) -> Bytes:
        rows, columns = sizes.background
        return background_view(light.display, turn, (columns, rows), front)

    def _glare(self, light: PlaceLight, facing: float, sun: tuple[float, float] | None) -> Glare:
        eyes = self._kept.once("eyes", 0, light, lambda: eye_light(light.environment.radiance))
        return glare(eyes, facing, sun)


def _side(style: Style) -> str:
    return light_words(style.side, style.place) or tr("Painted")


def _with_words(
    base: DetailState, snapshot: Snapshot, result: StyleResult, turn: float, *, at_best: bool
) -> DetailState:
    question = snapshot.question
    paper = question.objective == "paper"
    # At the best turn they are those of the card.
    match = result.match if at_best else value_at(result.match_curve, turn)
    strength = result.strength if at_best else value_at(result.strength_curve, turn)
    peaks = tuple(peak.turn_refined_deg for peak in result.peaks[1:])
    state = replace(
        base,
        here_tag=tr("Here, at {turn}", turn=signed(turn)),
        curve=_quality(result) if paper else tuple(result.match_curve.tolist()),
        curve_name=tr("Quality by turn") if paper else tr("Match by turn"),
        limit=_ARC_SHARE if paper else least_match(snapshot, snapshot.styles[result.name]),
        arc=result.arc_deg if result.attainable else None,
        best=result.turn_refined_deg,
        peaks=peaks,
        needle=turn,
        at_best=at_best or abs(wrap(turn - result.turn_refined_deg)) < _SAME_DEG,
        turn=size_words(turn),
        way=direction_of(turn),
        direction=direction_words(turn),
        clock=clock_words(turn),
        good_from=_good(result),
        caution=_caution(result),
        match=str(whole_of(match)),
        strength=str(whole_of(strength)),
        in_reach=result.attainable,
    )
    beside = beside_words(result, snapshot)
    if result.attainable:
        return replace(state, reason=" ".join(f"{words}." for words in beside))
    reason = result.reason or ""
    cause = reason if result.grade is not None else reason.partition(":")[0]
    return replace(
        state,
        verdict=verdict_of(result, snapshot),
        reason=f"{cause}." if cause else "",
        main="lamp",
        main_words=tr("Try a lamp"),
    )


def _caution(result: StyleResult) -> str:
    """Say that the turn depends on the sitter's own head, where it does."""
    words = caution(result.name) if result.attainable else None
    return f"{words}." if words else ""


def _good(result: StyleResult) -> str:
    """Write the tolerance arc, and whether other heads would have another."""
    if not result.attainable:
        return ""
    arc = arc_words(result.arc_deg)
    return tr("{arc}, less certain", arc=arc) if _caution(result) else arc


def _quality(result: StyleResult) -> tuple[float, ...]:
    """Quality in per cent of its largest value: C itself has the unit of the exposure."""
    largest = float(np.abs(result.quality_curve).max())
    return tuple((100.0 * result.quality_curve / max(largest, 1e-30)).tolist())


def _ratio_words(ratio: LightingRatio) -> tuple[str, str]:
    """Write stops, and the two numbers."""
    stops = ratio.stops
    if stops > DEEPEST_STOPS:
        most = f"{DEEPEST_STOPS:.0f}"
        return tr("over {stops} stops", stops=most), tr(
            "over {ratio}", ratio=ratio_words(DEEPEST_STOPS)
        )
    number = f"{stops:.1f}"
    count = 1 if number == "1.0" else 2
    return tr_plural("{stops} stop", "{stops} stops", count, stops=number), ratio.ratio


def _glare_words(warning: Glare) -> str:
    if not warning.warns:
        return ""
    where = face_direction_words(warning.azimuth_deg, warning.elevation_deg)
    where = where.replace("to the sitter", "sitter")  # in English that fits in the line
    words = _GLARE[tr("The sun") in warning.words, warning.level == "strong"]
    return words.format(where=where)


def numbers_text(state: DetailState, place: str = "") -> str:
    """Write down the numbers of a style, to be pasted elsewhere."""
    lines = [f"{state.title}, {state.side[:1].lower()}{state.side[1:]}"]
    if place:
        lines.append(tr("Place: {place}", place=place))
    if state.match:
        turn = turn_words(state.needle)
        lines.append(tr("Turn: {turn}, {clock}", turn=turn, clock=state.clock))
        lines.append(
            tr("Match {match}, strength {strength}", match=state.match, strength=state.strength)
        )
    if state.good_from:
        lines.append(tr("Good from {arc}", arc=state.good_from))
    lines += [
        text for text in (state.verdict, state.caution, state.ratio_tip, state.glare_tip) if text
    ]
    return "\n".join(lines) + "\n"
