"""Solve a place: for each style the turn, its quality, and what is missing.

All numbers that decide anything are free of the environment's exposure: it is divided out
first, and only the quality C, which is linear in it, is given back in the caller's unit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Literal, TypeAlias

import numpy as np

from app.core.base.angles import (
    TURNS,
    difference,
    direction,
    lies_on_arc,
    turn_of_index,
    whole,
    wrap,
)
from app.core.base.arrays import Bools, Float64, Floats, Indices
from app.core.solver.face import AREAS
from app.core.solver.peaks import Peak, best_index, shift
from app.core.solver.relighting_cache import (
    CountedLight,
    LightTable,
    PaintedCurves,
    normalised,
    painted_curves,
)
from app.core.solver.search import Curves, curves, luminance_of
from app.core.solver.shortfall import AreaShortfall, Cause, LightShortfall, Shortfall
from app.core.solver.style_signature import (
    GRADES,
    NEARLY,
    NO,
    YES,
    Grade,
    better,
    grades,
    neighbour,
    stops_of,
    unrivalled,
    worst_relation,
)
from app.core.solver.transport import Transport
from app.core.solver.turn_choice import (
    LIMITS,
    Choice,
    LightMap,
    Limits,
    Objective,
    StyleMeasures,
    choose,
    light_shortfall,
)
from app.core.solver.weights import PaintedWeights
from app.core.styles.style import Style
from app.core.styles.style_pack import StylePack
from app.core.styles.styles import RARE

_EVEN = 0.7  # of the target's contrast
_SAME_DEG = 2.0  # turns nearer than this give the same picture


@dataclass(frozen=True, slots=True)
class PeakResult:
    """A turn at which an objective has a local maximum.

    Attributes:
        turn_deg, turn_refined_deg: On the grid of 5.625 deg, and between; deg in (-180, 180],
            positive clockwise.
        arc_deg: Tolerance arc (from, to), clockwise, deg.
    """

    turn_deg: float
    turn_refined_deg: float
    quality: float
    match: float
    strength: float
    arc_deg: tuple[float, float]


Lighting: TypeAlias = Literal["front", "short", "broad"]


@dataclass(frozen=True, slots=True)
class Gain:
    """Improvement of a style with the face turned aside; turn and yaw as in `StyleResult`."""

    lighting: Lighting
    turn_deg: float
    yaw_deg: float
    match: float


@dataclass(frozen=True, slots=True)
class StyleResult:
    """The answer of a place for a style.

    Attributes:
        turn_index: Grid turn 0..63, counted from the panorama's centre column whatever `front` is.
        turn_deg, turn_refined_deg: The turn offered, on the grid, and refined as it is shown, at
            most a step of 5.625 deg apart; deg, positive clockwise. See
            `app.core.solver.peaks.find_peak`.
        direction: Of the refined turn: clockwise, counter-clockwise or none.
        quality_curve, match_curve, strength_curve: (64,) float64. At turn 5.625 k deg. Quality in
            the unit of the environment, the others of 100.
        attainable: Whether the grade is yes or nearly; without a signature, whether match and
            strength reach their limits.
        arc_deg: Tolerance arc (from, to) around the best turn, going clockwise, deg. It ends where
            the grade does. The refined turn lies toward its middle.
        grade: How far the picture shows the style; None without a signature.
        shortfall: Why it is out of reach, or in what respect it comes only near.
        looks_more_like: Name of the style that explains the picture better.
        same_picture: Names of the attainable styles that come out at the same turn.
        neighbour: Name of the style that explains the picture second best: what it may be taken
            for. Never the same style of the other side.
        yaw_deg: How far the face turns toward the sitter's own left from the line to the lens; the
            turn is that of the lens. Match and its curve are of the picture from there.
        yaw_arc_deg: Yaws (from, to) at which that picture is about as good with the nose where it
            is.
        lighting: Whether the side away from the lens is lit, or the side toward it.
        gains: What a face turned aside gains: a better grade, or the same with a better match.
            Empty where the style stays out of reach.
    """

    name: str
    title: str
    side: str
    turn_index: int
    turn_deg: float
    turn_refined_deg: float
    direction: str
    quality_curve: Float64
    match_curve: Float64
    strength_curve: Float64
    quality: float
    match: float
    strength: float
    attainable: bool
    arc_deg: tuple[float, float]
    peaks: tuple[PeakResult, ...]
    grade: Grade | None = None
    shortfall: Shortfall | None = None
    looks_more_like: str | None = None
    same_picture: tuple[str, ...] = ()
    neighbour: str | None = None
    yaw_deg: float = 0.0
    yaw_arc_deg: tuple[float, float] = (0.0, 0.0)
    lighting: Lighting = "front"
    gains: tuple[Gain, ...] = ()

    @property
    def nose_deg(self) -> float:
        """Azimuth of the nose at the refined turn, deg."""
        return wrap(self.turn_refined_deg - self.yaw_deg)

    def arc_at(self, turn_deg: float) -> tuple[float, float] | None:
        """Return the tolerance arc, (from, to) in deg, that contains a turn; None without one.

        Of the peak nearest to it. Both are compared in the whole degrees that are shown.
        """
        peaks = [(self.turn_refined_deg, self.arc_deg)]
        peaks += [(peak.turn_refined_deg, peak.arc_deg) for peak in self.peaks]
        _, arc = min(peaks, key=lambda peak: abs(difference(peak[0], turn_deg)))
        ends = (float(whole(arc[0])), float(whole(arc[1])))
        if arc[1] - arc[0] >= 360.0 or lies_on_arc(float(whole(turn_deg)), ends):
            return arc
        return None

    def arc_near(self, turn_deg: float) -> tuple[float, float]:
        """Return the arc that contains a turn, otherwise that of the best turn, deg."""
        return self.arc_at(turn_deg) or self.arc_deg

    @property
    def background_deg(self) -> float:
        """Azimuth straight behind the sitter at the refined turn, deg."""
        return wrap(self.turn_refined_deg + 180.0)

    def seen_from(self, front_deg: float) -> StyleResult:
        """Return the result with turns counted from the photographer at `front_deg`.

        Args:
            front_deg: Panorama azimuth of the photographer, deg.

        Returns:
            Every turn t became wrap(t - front_deg); the curves belong to the new turns.
        """

        def shifted(angle: float) -> float:
            return wrap(angle - front_deg)

        def arc(ends: tuple[float, float]) -> tuple[float, float]:
            return ends if ends == (-180.0, 180.0) else (shifted(ends[0]), shifted(ends[1]))

        refined = shifted(self.turn_refined_deg)
        return replace(
            self,
            turn_deg=shifted(self.turn_deg),
            turn_refined_deg=refined,
            direction=direction(refined),
            quality_curve=shift(self.quality_curve, front_deg),
            match_curve=shift(self.match_curve, front_deg),
            strength_curve=shift(self.strength_curve, front_deg),
            arc_deg=arc(self.arc_deg),
            gains=tuple(replace(gain, turn_deg=shifted(gain.turn_deg)) for gain in self.gains),
            peaks=tuple(
                replace(
                    peak,
                    turn_deg=shifted(peak.turn_deg),
                    turn_refined_deg=shifted(peak.turn_refined_deg),
                    arc_deg=arc(peak.arc_deg),
                )
                for peak in self.peaks
            ),
        )


def solve_all(
    pack: StylePack,
    light: Floats,
    objective: Objective = "picture",
    *,
    limits: Limits = LIMITS,
    styles: Sequence[str] | None = None,
    front_deg: float = 0.0,
    is_open: Bools | None = None,
) -> tuple[StyleResult, ...]:
    """Find the best turn of every style (eq. 5, and the picture objective beside it).

    Args:
        light: (H, W, 3) or (H, W) float. Environment at turn 0 in the pack's size, linear Rec. 709
            radiance, or luminance of light that counts as grey; any exposure.
        front_deg: Azimuth at which the photographer stands, deg; see `StyleResult.seen_from`.
        is_open: (64,) bool. Turns that may be chosen; all by default.

    Raises:
        EnvironmentFileError: If the environment is black, not finite or has another size.
        StyleError: If a style is unknown.
    """
    light, scale = normalised(light, pack.header.environment)
    here = PlaceSearch(
        pack, limits, LightMap(luminance_of(light)), curves(pack.tables, pack.project(light))
    )
    choices = choose(here.measured, objective, limits, is_open)
    results = [
        answer(style, choices[row], scale, at, partial(here.verdict, row))
        for row, (style, at) in enumerate(zip(pack.styles, choices.turns.tolist(), strict=True))
    ]
    return asked_for(pack, results, styles, front_deg)


def asked_for(
    pack: StylePack, every: list[StyleResult], styles: Sequence[str] | None, front_deg: float
) -> tuple[StyleResult, ...]:
    """Select results by style name, with turns counted from the photographer.

    Raises `StyleError` if a style is unknown.
    """
    equals = name_equals(every)
    rows = range(len(equals)) if styles is None else sorted({pack.index(name) for name in styles})
    return tuple(equals[row].seen_from(front_deg) if front_deg else equals[row] for row in rows)


@dataclass(frozen=True)
class PlaceSearch:
    """All turns of a place, evaluated for all styles of a pack."""

    pack: StylePack
    limits: Limits
    light: LightMap
    curves: Curves

    @cached_property
    def alone(self) -> StyleMeasures:
        """See `measure_alone`."""
        return measure_alone(self.pack, self.curves)

    @cached_property
    def measured(self) -> StyleMeasures:
        """See `measure`."""
        return among_rivals(self.pack, self.alone)

    @cached_property
    def grades(self) -> Indices:
        """(S, 64) grade of each picture for each style alone, `NO` without a signature."""
        return grades(self.alone.yes, self.alone.nearly)

    def verdict(self, row: int, at: int) -> Verdict:
        """Grade the picture at a grid turn for the style at `row`, beside all others."""
        match, strength = self.measured.match[:, at], self.measured.strength[:, at]
        areas = self.curves.others[: len(AREAS), at]
        verdict = judge(
            self.pack, row, PictureMeasure(areas, match, strength, self.grades[:, at]), self.limits
        )
        if not verdict.attainable and (verdict.shortfall is None or self.light.is_even):
            numbers = float(match[row]), float(strength[row])
            arguments = (*numbers, self.limits, self.light, turn_of_index(at))
            shortfall = light_shortfall(self.pack.styles[row], *arguments) or verdict.shortfall
            verdict = replace(verdict, shortfall=shortfall)
        return verdict


def quality_scale(light: Floats, picture: int) -> float:
    """Return the factor that makes C comparable between places and heads.

    C grows with the exposure and with the number of pixels, and the paper does not state its unit.
    Here it counts light whose texels have a mean luminance of 1, on 100 x 100 pixels.

    Args:
        light: (H, W, 3) or (H, W) float. As it was searched.
        picture: Side of the head's picture, pixels.
    """
    return float((100.0 / picture) ** 2 / max(float(luminance_of(light).mean()), 1e-30))


def measure(pack: StylePack, curve_set: Curves) -> StyleMeasures:
    """Return match, strength and grades of all styles, rivals considered."""
    return among_rivals(pack, measure_alone(pack, curve_set))


def among_rivals(pack: StylePack, alone: StyleMeasures) -> StyleMeasures:
    """Deny yes to pictures that read as another style, as `judge` does."""
    apart = unrivalled(alone.yes, alone.match, pack.rivalry)
    return replace(alone, yes=np.minimum(alone.yes, apart))


def measure_alone(pack: StylePack, curve_set: Curves) -> StyleMeasures:
    """Return exposure-free match and strength of each style, without its rivals.

    Match is Pearson's correlation of target and picture over the face region. Strength is their
    covariance over the mean of the face, over the same in the target picture. Curves of several
    lights give results with one more axis.
    """
    areas, product = np.split(curve_set.others, [len(AREAS)], axis=-2)
    ratio = product / np.maximum(curve_set.mean, 1e-30)[..., None, :]
    match = _match(product, pack.weight_norm[:, None], curve_set.contrast[..., None, :])
    strength = 100.0 * ratio / pack.studio_ratio[:, None]
    pack.signatures.take_areas(areas, match, strength)
    # Where no turn brings the face the contrast of the target, the light is even all round.
    depth = np.max(curve_set.contrast / np.maximum(curve_set.mean, 1e-30), axis=-1)
    even = depth[..., None] < _EVEN * pack.studio_ratio / pack.weight_norm
    yes, nearly = pack.signatures.slack(stops_of(areas), match, even)
    contrast = np.where(pack.signatures.by_areas[:, None], 1.0, curve_set.contrast[..., None, :])
    return StyleMeasures(curve_set.quality, match, strength, yes, nearly, contrast)


def solve_on_table(
    table: LightTable,
    weights: PaintedWeights,
    objective: Objective = "picture",
    *,
    counted: CountedLight | None = None,
    limits: Limits = LIMITS,
) -> StyleResult:
    """Solve painted weights in a prepared light, fast enough for strokes.

    Args:
        counted: From `counted_light` for the same active pixels, where it is known already.
    """
    measured = measure_painted(painted_curves(table, weights, counted))
    choice = choose(measured, objective, limits)
    at = best_index(choice.curve, choice.eligible)
    verdict = partial(judge_painted, measured, limits=limits, light=table.light)
    return answer(None, choice, table.scale, at, verdict)


def measure_painted(curve_set: PaintedCurves) -> StyleMeasures:
    """Return match and strength of painted weights; see `measure`."""
    ratio = curve_set.quality / np.maximum(curve_set.mean, 1e-30)
    strength = 100.0 * ratio / curve_set.studio if curve_set.studio > 0 else np.zeros(TURNS)
    match, none = (
        _match(curve_set.quality, curve_set.norm, curve_set.contrast),
        np.full(TURNS, np.nan),
    )
    return StyleMeasures(curve_set.quality, match, strength, none, none, curve_set.contrast)


def judge_painted(measured: StyleMeasures, at: int, limits: Limits, light: LightMap) -> Verdict:
    """Judge painted weights at a grid turn; see `judge`."""
    numbers = float(measured.match[at]), float(measured.strength[at])
    shortfall = light_shortfall(None, *numbers, limits, light, turn_of_index(at))
    return Verdict(shortfall is None, shortfall=shortfall)


def _match(quality: Float64, norm: Float64 | float, contrast: Float64) -> Float64:
    """100 x correlation; 0 where the face has no contrast at all."""
    product = norm * contrast
    flat = product <= 1e-12 * np.max(product, axis=-1, keepdims=True)
    return np.where(flat, 0.0, 100.0 * quality / np.where(flat, 1.0, product))


def proposal(results: Sequence[StyleResult]) -> str | None:
    """Return the style to propose first: in reach, common, with the best grade and match."""

    def merit(result: StyleResult) -> tuple[bool, bool, bool, float]:
        common = result.name not in RARE
        return result.attainable, common, result.grade != "nearly", result.match

    return max(results, key=merit).name if results else None


@dataclass(frozen=True, slots=True, eq=False)
class PictureMeasure:
    """Numbers by which a picture is judged.

    Attributes:
        areas: (A,) float64. Means of `AREAS`, any exposure.
        match, strength: (S,) float64. Of all styles, of 100.
        grade: (S,) int. Of all styles; `NO` for those without a signature.
    """

    areas: Float64
    match: Float64
    strength: Float64
    grade: Indices


def picture_of(
    pack: StylePack, areas: Float64, match: Float64, strength: Float64
) -> PictureMeasure:
    """Grade a picture for all styles; the arrays of `PictureMeasure` may be changed."""
    pack.signatures.take_areas(areas[:, None], match[:, None], strength[:, None])
    yes, nearly = pack.signatures.slack(stops_of(areas[:, None]), match[:, None])
    return PictureMeasure(areas, match, strength, grades(yes[:, 0], nearly[:, 0]))


def measure_picture(pack: StylePack, transport: Transport, luminance: Floats) -> PictureMeasure:
    """Measure a single picture; see `measure` for all turns.

    Args:
        luminance: (P,) float. Linear, on the head's pixels, any exposure.
    """
    grey, region = np.asarray(luminance, np.float64), pack.region_on(transport)
    weights = pack.weights_on(transport)
    mean = float(grey @ region) / float(region.sum())
    contrast = float(np.sqrt(region @ (grey - mean) ** 2))
    areas = pack.areas.reshape(len(pack.areas), -1)[:, transport.pixels].astype(np.float64)
    product = weights @ grey
    match = 100.0 * product / np.maximum(pack.weight_norm * contrast, 1e-30)
    strength = 100.0 * product / np.maximum(pack.studio_ratio * mean, 1e-30)
    # Of what is around the head, a picture of it tells nothing.
    means = areas @ grey / np.maximum(areas.sum(axis=1), 1e-30)
    return picture_of(pack, means, match, strength)


@dataclass(frozen=True, slots=True)
class Verdict:
    """Grade of a picture for a style; fields as in `StyleResult`."""

    attainable: bool
    grade: Grade | None = None
    shortfall: Shortfall | None = None
    looks_more_like: str | None = None
    neighbour: str | None = None


def judge(pack: StylePack, row: int, picture: PictureMeasure, limits: Limits) -> Verdict:
    """Grade a picture for the style at `row`, among its rivals.

    Returns:
        Without a shortfall where the style has no signature.
    """
    style, match = pack.styles[row], float(picture.match[row])
    if not style.signature.relations:
        return Verdict(limits.are_met(match, float(picture.strength[row])))
    grade_of, match_of = picture.grade.tolist(), picture.match.tolist()
    rivals, apart = pack.rivals[row]
    other = better(row, grade_of, match_of, rivals)
    second = neighbour(grade_of, match_of, apart)
    alike = None if other is None or picture.grade[other] == NO else pack.styles[other].name
    grade = grade_of[row] if alike is None else min(grade_of[row], NEARLY)
    shortfall = None if grade == YES else _shortfall(style, picture.areas, match, grade)
    return Verdict(
        attainable=grade > NO,
        grade=GRADES[grade],
        shortfall=shortfall,
        looks_more_like=alike,
        neighbour=None if second is None else pack.styles[second].name,
    )


def _shortfall(style: Style, areas: Float64, match: float, grade: int) -> Shortfall | None:
    """Find what a picture lacks of its style; None where the signature is whole."""
    worst = worst_relation(style.signature, areas, nearly=grade == NO)
    if worst is None:
        least = style.signature.match[0 if grade == NEARLY else 1]
        return None if match >= least else LightShortfall(Cause.SPOILED, "match", match, least)
    relation, value = worst
    band = relation.nearly if grade == NO else 0.0
    low = relation.least - band
    limit = low if value < low else relation.most + band
    return AreaShortfall(relation.aspect, style.title, relation.bright, relation.dark, value, limit)


def name_equals(results: list[StyleResult]) -> list[StyleResult]:
    """Fill in `same_picture` of styles that come out at the same turn."""
    turns = [(each.name, each.turn_refined_deg) for each in results if each.attainable]
    equals = []
    for one in results:
        here = one.turn_refined_deg if one.attainable else np.nan
        same = [name for name, turn in turns if abs(wrap(turn - here)) < _SAME_DEG]
        others = tuple(name for name in same if name != one.name)
        equals.append(replace(one, same_picture=others) if others else one)
    return equals


def answer(
    style: Style | None,
    choice: Choice,
    scale: float,
    best_index: int,
    judge: Callable[[int], Verdict],
) -> StyleResult:
    """Build the result of a style at the turn offered.

    Args:
        best_index: Grid turn of the best.
        judge: Grades the picture at a grid turn.
    """
    curve, peaks = choice.measured, choice.peaks(best_index)
    best, index = peaks[0], peaks[0].index
    verdict = judge(index)
    return StyleResult(
        name=style.name if style else "painted",
        title=style.title if style else "",
        side=style.side if style else "none",
        turn_index=index,
        turn_deg=best.turn_deg,
        turn_refined_deg=best.refined_deg,
        direction=direction(best.refined_deg),
        quality_curve=curve.quality * scale,
        match_curve=curve.match,
        strength_curve=curve.strength,
        quality=float(curve.quality[index]) * scale,
        match=float(curve.match[index]),
        strength=float(curve.strength[index]),
        attainable=verdict.attainable,
        arc_deg=best.arc_deg,
        peaks=tuple(_peak_result(peak, curve, scale) for peak in peaks),
        grade=verdict.grade,
        shortfall=verdict.shortfall,
        looks_more_like=verdict.looks_more_like,
        neighbour=verdict.neighbour,
    )


def _peak_result(peak: Peak, curve: StyleMeasures, scale: float) -> PeakResult:
    return PeakResult(
        turn_deg=peak.turn_deg,
        turn_refined_deg=peak.refined_deg,
        quality=float(curve.quality[peak.index]) * scale,
        match=float(curve.match[peak.index]),
        strength=float(curve.strength[peak.index]),
        arc_deg=peak.arc_deg,
    )
