"""Search every turn and yaw at a place, for all styles at once.

The light on a face, and therefore the grade, depends on the direction of the nose. The position of
the lens relative to the nose determines the background, the visible side of the face, and the
match, which is the similarity between the picture from that position and the style. Curves in this
module are functions of the azimuth of the nose. The azimuth of the lens as seen from the sitter is
the turn, where turn = nose + yaw.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Final

import numpy as np

from app.core.base.angles import TURNS, direction, turn_of_index, wrap
from app.core.base.arrays import Bools, Float64, Floats, Indices, Int64
from app.core.solver.lens.lens_wish import ASIDE, LIGHTINGS, STRAIGHT, LensWish, obstacle_of
from app.core.solver.lens.view_tables import ViewTables, match_curves
from app.core.solver.light_map import LightMap
from app.core.solver.peaks import ARC_SHARE, best_index
from app.core.solver.place_light import main_azimuth
from app.core.solver.relighting_cache import normalised
from app.core.solver.search import (
    curves,
    luminance_of,
)
from app.core.solver.shortfall import LensShortfall
from app.core.solver.solve import PlaceSearch, answer, asked_for
from app.core.solver.style_result import Gain, Lighting, StyleResult
from app.core.solver.style_signature import GRADES, NO, YES
from app.core.solver.style_verdict import Verdict
from app.core.solver.turn_choice import LIMITS, Choice, Limits, Objective, StyleMeasures, choose
from app.core.styles.lamps import mirror_rows
from app.core.styles.style import Style
from app.core.styles.style_pack import StylePack

NAMED_GAIN: Final = 5.0
"""Smallest gain in match that is reported, in points of match."""

_GRADE_POINTS: Final = 1000.0
_FRONT_DEG: Final = 15.0  # degrees; a key this close to the direction of the nose lights both sides
_STRAIGHT_DEG: Final = 10.0


def lighting_of(yaw_deg: float, keys_deg: Float64) -> Int64:
    """Return the kind of lighting on a turned face, as indices into `LIGHTINGS`.

    Args:
        keys_deg: (...) float64. Azimuth of the main light relative to the nose, positive towards
            the sitter's left, or NaN if there is no main light.

    Examples:
        >>> [LIGHTINGS[n] for n in lighting_of(30.0, np.array([60.0, -60.0, 5.0]))]
        ['short', 'broad', 'front']
    """
    keys = (keys_deg + 180.0) % 360.0 - 180.0
    # A face turned towards its own left shows more of its right side.
    aside = np.where((keys > 0) == (yaw_deg > 0), 1, 2)
    # Light from straight behind is also equal on both sides.
    middle = np.minimum(np.abs(keys), 180.0 - np.abs(keys)) < _FRONT_DEG
    front = np.isnan(keys) | middle | (abs(yaw_deg) < _STRAIGHT_DEG)
    return np.where(front, 0, aside)


@dataclass(frozen=True)
class LensSearch:
    """A place evaluated for every position of the lens.

    Attributes:
        styles: The styles, or None for painted styles.
        front: Measures with the lens directly in front of the face.
        grades: (S, 64). Grades by azimuth of the nose.
        verdict: Function that grades the picture at a grid turn of the nose for the style at a
            given row.
        curves: Match and contrast by yaw, from `match_curves`.
        counts: (S,) bool by yaw, as in `ViewTables`.
        by_areas: (S,) bool. Whether the match of each style is independent of the yaw.
        main_deg: Azimuth of the main light in the panorama, or None if there is none.
    """

    styles: Sequence[Style | None]
    front: StyleMeasures
    grades: Indices
    verdict: Callable[[int, int], Verdict]
    objective: Objective
    limits: Limits
    curves: dict[float, tuple[Float64, Float64]]
    counts: dict[float, Bools]
    by_areas: Bools
    main_deg: float | None

    def at(self, yaw_deg: float) -> StyleMeasures:
        """Return the measures at a yaw. Only the match and the contrast depend on the yaw."""
        front = self.front
        if yaw_deg == 0.0:
            return front
        yaws = sorted(self.curves)
        above = min(int(np.searchsorted(yaws, yaw_deg)), len(yaws) - 1)
        below = max(above - 1, 0)
        share = (yaw_deg - yaws[below]) / max(yaws[above] - yaws[below], 1e-9)
        (m, c), (n, d) = self.curves[yaws[below]], self.curves[yaws[above]]
        by_areas = self.by_areas[:, None]
        match = np.where(by_areas, front.match, m + share * (n - m))
        contrast = np.where(by_areas, front.contrast, c + share * (d - c))
        return replace(front, match=match, contrast=contrast)

    def visible(self, yaw_deg: float) -> Bools:
        """Return a mask, (S,), of the styles whose areas are visible at a yaw."""
        beyond = [yaw for yaw in self.counts if yaw * yaw_deg > 0 and abs(yaw) >= abs(yaw_deg)]
        return self.counts[min(beyond, key=abs, default=0.0)]

    @cached_property
    def keys_deg(self) -> Float64:
        """Azimuth of the main light relative to the nose, (S, 64), in degrees."""
        nose = np.arange(TURNS) * 360.0 / TURNS
        main = np.nan if self.main_deg is None else self.main_deg
        keys = np.tile(nose - main, (len(self.styles), 1))
        for row, style in enumerate(self.styles):
            if style is not None and style.side != "none":
                # The key is the light that gives the style, even beside brighter lights.
                key = max(style.lamps, key=lambda lamp: lamp.power).azimuth_deg
                keys[row, self.grades[row] > NO] = key
        return keys

    def choice(self, yaw_deg: float, wish: LensWish) -> tuple[Choice, Bools]:
        """Choose turns at a yaw, and return them with a mask, (S,), of styles that fit the wish."""
        nose = np.arange(TURNS) * 360.0 / TURNS
        fits = [wish.met_by(turn) for turn in (nose + yaw_deg).tolist()]
        is_open: Bools = np.outer(self.visible(yaw_deg), fits)
        if wish.yaw in ASIDE:
            lighting = lighting_of(yaw_deg, self.keys_deg)
            is_open &= lighting == LIGHTINGS.index(wish.yaw)
        some = np.asarray(is_open.any(axis=1))
        is_open[~some] = True
        return choose(self.at(yaw_deg), self.objective, self.limits, is_open), some

    def answer(self, row: int, yaw_deg: float, choice: Choice, scale: float) -> StyleResult:
        """Return the result for one style at a yaw."""
        best = int(best_index(choice.curve[row], choice.eligible[row]))
        judge = partial(self.verdict, row)
        result = answer(self.styles[row], choice[row], scale, best, judge)
        at = result.turn_index
        lighting = LIGHTINGS[int(lighting_of(yaw_deg, self.keys_deg[row, at]))]
        result = replace(
            result, yaw_deg=yaw_deg, lighting=lighting, yaw_arc_deg=self._arc(row, at, yaw_deg)
        )
        return result.seen_from(-yaw_deg) if yaw_deg else result

    def _arc(self, row: int, at: int, yaw_deg: float) -> tuple[float, float]:
        """Return the range of yaws, (from, to), over which the picture is about equally good."""
        yaws = sorted({*self.curves, yaw_deg})
        least = (1.0 - ARC_SHARE) * float(self.at(yaw_deg).match[row, at])
        good = [
            bool(self.visible(yaw)[row]) and float(self.at(yaw).match[row, at]) >= least
            for yaw in yaws
        ]
        low = high = yaws.index(yaw_deg)
        while low > 0 and good[low - 1]:
            low -= 1
        while high < len(yaws) - 1 and good[high + 1]:
            high += 1
        return yaws[low], yaws[high]


def solve_lens(
    pack: StylePack,
    views: Sequence[ViewTables],
    light: Floats,
    wish: LensWish,
    objective: Objective = "picture",
    *,
    limits: Limits = LIMITS,
    styles: Sequence[str] | None = None,
    front_deg: float = 0.0,
) -> tuple[StyleResult, ...]:
    """Find the best turn and yaw for every style.

    Args:
        light: As in `solve_all`.
        wish: Permitted positions of the lens. Azimuths of its background are measured from
            `front_deg`, like turns.

    Raises:
        EnvironmentFileError: If the environment is black, is not finite, or has the wrong size.
        StyleError: If a style is unknown.
    """
    light, scale = normalised(light, pack.header.environment)
    values, light_map = pack.project(light), LightMap(luminance_of(light))
    here = PlaceSearch(pack, limits, light_map, curves(pack.tables, values))
    counts, rows = {0.0: np.ones(len(pack.styles), bool)}, mirror_rows(pack.styles)
    for view in views:
        counts[view.yaw_deg] = view.counts
        if not pack.header.paired:
            counts[-view.yaw_deg] = view.counts[rows]
    place = LensSearch(
        styles=pack.styles,
        front=here.measured,
        grades=here.grades,
        verdict=here.verdict,
        objective=objective,
        limits=limits,
        curves=match_curves(pack, views, values, here.measured),
        counts=counts,
        by_areas=pack.signatures.by_areas,
        main_deg=main_azimuth(light),
    )
    every = best_answers(place, wish.moved(-front_deg), scale)
    return asked_for(pack, every, styles, front_deg)


def best_answers(place: LensSearch, wish: LensWish, scale: float) -> list[StyleResult]:
    """Return the best answer for each style over all yaws, ranked by grade and then by match."""
    yaws = sorted(place.curves, key=lambda yaw: (abs(yaw), yaw))
    trial_yaws = [wish.yaw] if isinstance(wish.yaw, float) else yaws
    choices = [place.choice(yaw, wish) for yaw in trial_yaws]
    best = np.argmax([_merit(*each) for each in choices], axis=0).tolist()
    straight, results = place.choice(0.0, STRAIGHT)[0], []
    for row, number in enumerate(best):
        choice, some = choices[number]
        if some[row]:
            results.append(_inside(place.answer(row, trial_yaws[number], choice, scale), wish))
        else:
            result = place.answer(row, 0.0, straight, scale)
            grade = result.grade and GRADES[NO]
            why = LensShortfall(obstacle_of(wish))
            results.append(replace(result, attainable=False, grade=grade, shortfall=why))
    if wish == STRAIGHT:
        gains = _gains(place, straight, results)
        results = [replace(one, gains=gain) for one, gain in zip(results, gains, strict=True)]
    return results


def _merit(choice: Choice, some: Bools) -> Float64:
    """Rate a yaw for each style, (S,), by grade, then match; -inf means no turn meets the wish."""
    match = np.take_along_axis(choice.measured.match, choice.best[:, None], axis=1)[:, 0]
    return np.where(some, choice.grade * _GRADE_POINTS + match, -np.inf)


def _gains(
    place: LensSearch, straight: Choice, results: Sequence[StyleResult]
) -> list[tuple[Gain, ...]]:
    """Return the gains from short and broad light for each style that they improve."""
    least = _merit(straight, np.ones(len(straight.grade), bool)) + NAMED_GAIN
    yaws = [yaw for yaw in place.curves if yaw]
    gains: list[tuple[Gain, ...]] = [()] * len(least)
    if not yaws:
        return gains
    for lighting in ASIDE:
        choices = [place.choice(yaw, LensWish(lighting)) for yaw in yaws]
        merits = np.array([_merit(*each) for each in choices])
        for row, number in enumerate(merits.argmax(axis=0).tolist()):
            if merits[number, row] >= least[row]:
                choice, yaw = choices[number][0], yaws[number]
                gains[row] += _gain(place, choice, row, (lighting, yaw), results[row])
    return gains


def _gain(
    place: LensSearch, choice: Choice, row: int, aside: tuple[Lighting, float], now: StyleResult
) -> tuple[Gain, ...]:
    """Return the gain from turning the face: a better grade, or a better match at the same grade.

    A style that remains out of reach has no gain.
    """
    lighting, yaw = aside
    best = best_index(choice.curve[row], choice.eligible[row])
    at = choice[row].peak(best).index
    match = float(choice.measured.match[row, at])
    then, before = _rank(place.verdict(row, at)), _rank(now)
    if then == NO or then < before or (then == before and match < now.match + NAMED_GAIN):
        return ()
    return (Gain(lighting, wrap(turn_of_index(at) + yaw), yaw, match),)


def _rank(verdict: Verdict | StyleResult) -> int:
    """Return the index of a grade in `GRADES`. A painted style counts as yes or no."""
    return GRADES.index(verdict.grade) if verdict.grade else YES * verdict.attainable


def _inside(result: StyleResult, wish: LensWish) -> StyleResult:
    """Move the refined turn into the permitted background if it lies outside."""
    if wish.background is None or wish.met_by(result.turn_refined_deg):
        return result
    ends = [wrap(end + 180.0) for end in wish.background]
    nearest = min(ends, key=lambda end: abs(wrap(end - result.turn_refined_deg)))
    return replace(result, turn_refined_deg=nearest, direction=direction(nearest))
