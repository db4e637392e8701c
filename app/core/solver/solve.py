"""Solve a place: find the turn, the quality and the shortfall for each style.

The exposure of the environment is divided out first, so it affects no decision. Only the quality C,
which is linear in the exposure, is returned in the same unit as the caller's light.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from app.core.base.angles import (
    TURNS,
    direction,
    turn_of_index,
    wrap,
)
from app.core.base.arrays import Bools, Float64, Floats, Indices
from app.core.solver.face import AREAS
from app.core.solver.light_map import LightMap, light_shortfall
from app.core.solver.peaks import Peak, best_index
from app.core.solver.place_light import Expose
from app.core.solver.relighting_cache import (
    CountedLight,
    LightTable,
    PaintedCurves,
    normalised,
    painted_curves,
)
from app.core.solver.search import Curves, curves, luminance_of
from app.core.solver.style_result import PeakResult, StyleAnswer, StyleResult
from app.core.solver.style_signature import (
    grades,
    stops_of,
    unrivalled,
)
from app.core.solver.style_verdict import PictureMeasure, Verdict, judge
from app.core.solver.turn_choice import LIMITS, Choice, Limits, Objective, StyleMeasures, choose
from app.core.solver.weights import PaintedWeights
from app.core.styles.style import Style
from app.core.styles.style_pack import StylePack
from app.core.styles.styles import RARE

_EVEN = 0.7  # fraction of the target's contrast below which the light is even
_SAME_DEG = 2.0  # turns closer together than this give the same picture


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
    """Find the best turn for every style, by eq. 5 or by the picture objective.

    Args:
        light: (H, W, 3) or (H, W) float. Environment at turn 0 in the pack's size, linear Rec. 709
            radiance, or luminance of grey light, at any exposure.
        front_deg: Azimuth of the photographer, in degrees (see `StyleResult.seen_from`).
        is_open: (64,) bool. Permitted turns. By default, all turns are permitted.

    Raises:
        EnvironmentFileError: If the environment is black, is not finite, or has the wrong size.
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
    """Select results by style name, with turns measured from the photographer.

    Raises:
        StyleError: If a style is unknown.
    """
    equals = name_equals(every, {style.name: style.expose for style in pack.styles})
    rows = range(len(equals)) if styles is None else sorted({pack.index(name) for name in styles})
    return tuple(equals[row].seen_from(front_deg) if front_deg else equals[row] for row in rows)


@dataclass(frozen=True)
class PlaceSearch:
    """Every turn at a place, evaluated for every style in a pack."""

    pack: StylePack
    limits: Limits
    light: LightMap
    curves: Curves

    @cached_property
    def alone(self) -> StyleMeasures:
        """Measures of each style without its rivals (see `measure_alone`)."""
        return measure_alone(self.pack, self.curves)

    @cached_property
    def measured(self) -> StyleMeasures:
        """Measures of each style among its rivals (see `measure`)."""
        return among_rivals(self.pack, self.alone)

    @cached_property
    def grades(self) -> Indices:
        """Grade of each picture for each style, (S, 64), regardless of rivals.

        The grade is `NO` for a style without a signature.
        """
        return grades(self.alone.yes, self.alone.soft)

    def verdict(self, row: int, at: int) -> Verdict:
        """Grade the picture at a grid turn for the style at `row`, among all its rivals."""
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
    """Return the factor that makes C comparable across places and heads.

    C increases with the exposure and the number of pixels, and the paper does not state its unit.
    Here, C refers to light whose texels have a mean luminance of 1, on 100 x 100 pixels.

    Args:
        light: (H, W, 3) or (H, W) float. The light used in the search.
        picture: Side of the head's picture, in pixels.
    """
    return float((100.0 / picture) ** 2 / max(float(luminance_of(light).mean()), 1e-30))


def measure(pack: StylePack, curve_set: Curves) -> StyleMeasures:
    """Return the match, strength and grades of every style, judged among its rivals."""
    return among_rivals(pack, measure_alone(pack, curve_set))


def among_rivals(pack: StylePack, alone: StyleMeasures) -> StyleMeasures:
    """Lower the grade of any picture graded yes that reads as another style, as `judge` does."""
    apart = unrivalled(alone.yes, alone.match, pack.rivalry)
    return replace(alone, yes=np.minimum(alone.yes, apart))


def measure_alone(pack: StylePack, curve_set: Curves) -> StyleMeasures:
    """Return the match and strength of each style, independent of exposure and rivals.

    The match is Pearson's correlation of target and picture over the face region. The strength is
    their covariance divided by the mean of the face, relative to the target picture. With the
    curves of several lights, the results have an additional axis.
    """
    areas, product = np.split(curve_set.others, [len(AREAS)], axis=-2)
    ratio = product / np.maximum(curve_set.mean, 1e-30)[..., None, :]
    match = _match(product, pack.weight_norm[:, None], curve_set.contrast[..., None, :])
    strength = 100.0 * ratio / pack.studio_ratio[:, None]
    pack.signatures.take_areas(areas, match, strength)
    # Light is even if no turn gives the face the contrast of the target.
    depth = np.max(curve_set.contrast / np.maximum(curve_set.mean, 1e-30), axis=-1)
    even = depth[..., None] < _EVEN * pack.studio_ratio / pack.weight_norm
    yes, soft = pack.signatures.slack(stops_of(areas), match, even)
    contrast = np.where(pack.signatures.by_areas[:, None], 1.0, curve_set.contrast[..., None, :])
    return StyleMeasures(curve_set.quality, match, strength, yes, soft, contrast)


def solve_on_table(
    table: LightTable,
    weights: PaintedWeights,
    objective: Objective = "picture",
    *,
    counted: CountedLight | None = None,
    limits: Limits = LIMITS,
) -> StyleResult:
    """Solve painted weights in prepared light, fast enough to follow brush strokes.

    Args:
        counted: Result of `counted_light` for the same active pixels, if already computed.
    """
    measured = measure_painted(painted_curves(table, weights, counted))
    choice = choose(measured, objective, limits)
    at = best_index(choice.curve, choice.eligible)
    verdict = partial(judge_painted, measured, limits=limits, light=table.light)
    return answer(None, choice, table.scale, at, verdict)


def measure_painted(curve_set: PaintedCurves) -> StyleMeasures:
    """Return the match and strength of painted weights (see `measure`)."""
    ratio = curve_set.quality / np.maximum(curve_set.mean, 1e-30)
    strength = 100.0 * ratio / curve_set.studio if curve_set.studio > 0 else np.zeros(TURNS)
    match, none = (
        _match(curve_set.quality, curve_set.norm, curve_set.contrast),
        np.full(TURNS, np.nan),
    )
    return StyleMeasures(curve_set.quality, match, strength, none, none, curve_set.contrast)


def judge_painted(measured: StyleMeasures, at: int, limits: Limits, light: LightMap) -> Verdict:
    """Judge painted weights at a grid turn (see `judge`)."""
    numbers = float(measured.match[at]), float(measured.strength[at])
    if limits.are_met(*numbers):
        return Verdict(True)
    shortfall = light_shortfall(None, *numbers, limits, light, turn_of_index(at))
    return Verdict(False, shortfall=shortfall)


def _match(quality: Float64, norm: Float64 | float, contrast: Float64) -> Float64:
    """Return the correlation times 100, or 0 if the face has no contrast."""
    product = norm * contrast
    flat = product <= 1e-12 * np.max(product, axis=-1, keepdims=True)
    return np.where(flat, 0.0, 100.0 * quality / np.where(flat, 1.0, product))


def proposal(results: Sequence[StyleResult]) -> str | None:
    """Return the style to suggest first: within reach, common, and best in grade and match."""
    return max(results, key=merit).name if results else None


def merit(result: StyleAnswer) -> tuple[bool, bool, bool, float]:
    """Return the key by which results are ranked, the largest first."""
    common = result.name not in RARE
    return result.attainable, common, result.grade != "soft", result.match


def name_equals(results: Sequence[StyleResult], exposes: Mapping[str, Expose]) -> list[StyleResult]:
    """Fill in `same_picture` for styles with the same turn, the same lens and the same exposure.

    Args:
        exposes: For each style, the subject for which its picture is exposed.
    """
    within = [one for one in results if one.attainable]

    def has_same_picture(one: StyleResult, other: StyleResult) -> bool:
        apart = abs(wrap(other.turn_refined_deg - one.turn_refined_deg))
        alike = (one.yaw_deg, exposes[one.name]) == (other.yaw_deg, exposes[other.name])
        return one is not other and alike and apart < _SAME_DEG

    equals = []
    for one in results:
        same = tuple(each.name for each in within if has_same_picture(one, each))
        equals.append(replace(one, same_picture=same) if one.attainable and same else one)
    return equals


def answer(
    style: Style | None,
    choice: Choice,
    scale: float,
    best_index: int,
    judge: Callable[[int], Verdict],
) -> StyleResult:
    """Build the result for a style at the offered turn.

    Args:
        best_index: Best grid turn.
        judge: Function that grades the picture at a grid turn.
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
