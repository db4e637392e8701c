"""Search for the lens: all turns and yaws of a place, for all styles at once.

How light falls on a face depends on where the nose points, and so do grades. Where the lens stands
beside the nose decides what is behind the sitter, which side of the face is seen, and how much the
picture looks like the style's own from there: the match. Curves here count the azimuth of the
nose; turn = nose + yaw is the azimuth of the lens, seen from the sitter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Final, Literal, TypeAlias

import cv2
import numpy as np

from app.core.base.angles import TURNS, direction, turn_of_index, wrap
from app.core.base.arrays import Bools, Float32, Float64, Floats, Indices, Int64
from app.core.portrait.head_views import HeadView, HeadViews, load_views_of
from app.core.solver.face import AREAS, AROUND, region_in_view
from app.core.solver.head_shape import HeadShape
from app.core.solver.peaks import ARC_SHARE, best_index
from app.core.solver.place_light import main_azimuth
from app.core.solver.relighting_cache import normalised
from app.core.solver.search import (
    Curves,
    SearchTables,
    build_tables,
    colours_as,
    curves,
    curves_of,
    luminance_of,
)
from app.core.solver.shortfall import LensShortfall, Obstacle
from app.core.solver.solve import (
    Gain,
    Lighting,
    PlaceSearch,
    StyleResult,
    Verdict,
    answer,
    asked_for,
)
from app.core.solver.style_signature import GRADES, NO, YES
from app.core.solver.transport import render
from app.core.solver.turn_choice import (
    LIMITS,
    Choice,
    LightMap,
    Limits,
    Objective,
    StyleMeasures,
    choose,
)
from app.core.solver.weights import region_weights
from app.core.styles.lamps import AS_PUBLISHED, mirror_rows, studio_light
from app.core.styles.style import Style
from app.core.styles.style_pack import StylePack

YawWord: TypeAlias = Literal["auto", "short", "broad"]
YawAsked: TypeAlias = float | YawWord

_ASIDE: Final[tuple[Literal["short", "broad"], ...]] = ("short", "broad")
LIGHTINGS: Final[tuple[Lighting, ...]] = ("front", *_ASIDE)
NAMED_GAIN: Final = 5.0
"""Points of match from which on a gain is named."""

_GRADE_POINTS: Final = 1000.0
LEAST_VISIBLE: Final = 0.7
"""Of the skin that makes a style: with less it is not asked for from there."""

_EDGES: Final = ("edge", "outline")
_SAME_PLACE_M: Final = 0.004
_LEFT_OUT: Final = 1e-5  # of the contrast that the search basis of a view leaves out
_FRONT_DEG: Final = 15.0  # a key this near to the line of the nose lights both sides
_STRAIGHT_DEG: Final = 10.0


@dataclass(frozen=True, slots=True, eq=False)
class ViewTables:
    """Search tables of one view, toward the sitter's own left.

    Attributes:
        tables: Targets and basis over the view's own face pixels.
        weight_norm: (S,) float64. As that of a pack.
        counts: (S,) bool. Styles whose areas are all seen well enough.
    """

    yaw_deg: float
    tables: SearchTables = field(repr=False)
    weight_norm: Float64 = field(repr=False)
    counts: Bools = field(repr=False)


def view_tables(pack: StylePack, view: HeadView, shape: HeadShape) -> ViewTables:
    """Pre-integrate the styles of a pack in a view.

    Args:
        shape: Of the head as it is seen from the front.
    """
    whole = region_in_view(view.transport, view.shape, shape)
    face = whole > 0
    # The face alone: with skull and neck it would take twice the room while it is worked out.
    transport = replace(
        view.transport,
        pixels=view.transport.pixels[face],
        coverage=view.transport.coverage[face],
        pixel_basis=view.transport.pixel_basis[:, face],
    )
    colours, region = colours_as(transport, pack.mixing, pack.mixtures), whole[face]
    targets = targets_in(pack, view)[:, face]
    weights = np.stack([region_weights(target, region) for target in targets])
    rows = _contrast_rows(colours.bases, region, colours.texels, colours.mixed)
    half = rows.shape[-1] // 2
    left, right = rows[..., :half], rows[..., : half - 1 : -1]
    tables = build_tables(
        colours.integrate(weights),
        colours.integrate(region / region.sum()),
        0.5 * (left + right),
        0.5 * (left - right),
        paired=True,
    )
    # Half the room; what is lost is a millionth of a point.
    tables = replace(tables, basis=tables.basis.astype(np.float32))
    norm = np.sqrt((weights**2 / region).sum(axis=1))
    return ViewTables(view.yaw_deg, tables, norm, counts_in(pack, view, shape))


def targets_in(pack: StylePack, view: HeadView) -> Float32:
    """Return the luminance, (S, P), of the styles in a view, under the pack's lamps."""
    targets, transport = view.targets.copy(), view.transport
    for row, studio in enumerate(pack.studios):
        if studio != AS_PUBLISHED:
            light = studio_light(pack.styles[row], studio, transport.environment_shape)
            picture = np.maximum(render(transport, light), 0)
            targets[row] = picture / max(float(picture.max()), 1e-30)
    return targets


def _contrast_rows(bases: Float32, region: Float64, texels: Float32, mixed: Float32) -> Float32:
    """(r, Q, W): rows whose squares, times light, sum to the squared contrast of the face."""
    centred = bases.astype(np.float64)
    centred -= np.einsum("p,kpr->kr", region, centred)[:, None] / region.sum()
    centred *= np.sqrt(region)[:, None]
    grey, tint = centred
    values, vectors = np.linalg.eigh(grey.T @ grey)
    order = np.argsort(-values)
    left_out = 1.0 - np.cumsum(values[order]) / values.sum()
    rows = order[: int(np.argmax(left_out < _LEFT_OUT)) + 1]
    size = np.sqrt(values[rows])
    first = np.tensordot((vectors[:, rows] * size).T, texels, 1)
    second = np.tensordot((grey @ vectors[:, rows] / size).T @ tint, mixed, 1)
    return np.asarray(np.concatenate([first, second], axis=1), np.float32)


def counts_in(pack: StylePack, view: HeadView, shape: HeadShape) -> Bools:
    """Return, (S,), whether a view shows enough of each area that makes a style."""
    visibility = seen_from(view, shape.positions).astype(np.float64)
    areas = pack.areas.reshape(len(AREAS), -1)[:, shape.pixels].astype(np.float64)
    share = (areas @ visibility) / np.maximum(areas.sum(axis=1), 1e-30)
    share[AROUND] = 0.0  # what is behind the nose is not behind the sitter, seen from aside
    hidden = {
        name for name, part in zip(AREAS, share.tolist(), strict=True) if part < LEAST_VISIBLE
    }
    # An edge that must only not be too bright does no harm where it is not seen.
    harmless = {name for name in hidden if name.split()[-1] in _EDGES}
    return np.array(
        [
            all(
                not ({r.bright, r.dark} & (hidden if r.least > 0 else hidden - harmless))
                for r in style.signature.relations
            )
            for style in pack.styles
        ]
    )


def seen_from(view: HeadView, places: Float32) -> Bools:
    """Return, (n,), whether the camera of a view sees points on the skin, (n, 3)."""
    side, pixels = view.transport.size, view.transport.pixels
    yaw = np.radians(view.yaw_deg)
    far = view.transport.header.distance_m + float(view.shape.eye_point[2])
    right, ahead = np.array([[np.cos(yaw), 0, np.sin(yaw)], [np.sin(yaw), 0, -np.cos(yaw)]])

    def slopes(points: Float32) -> tuple[Float64, Float64]:
        away = points @ ahead + far
        return away, np.stack([points @ right, -points[:, 1], away], axis=1) / away[:, None]

    # The camera is known but for where it cuts its picture: that is read off the view's own pixels.
    depth, front_slopes = slopes(view.shape.positions)
    pixel_places = np.stack([pixels % side, pixels // side], axis=1)
    camera = [
        np.linalg.lstsq(front_slopes[:, [axis, 2]], pixel_places[:, axis])[0] for axis in (0, 1)
    ]
    away, place_slopes = slopes(places)
    column, row = (np.rint(place_slopes[:, [axis, 2]] @ camera[axis]) for axis in (0, 1))
    farthest = np.full((side, side), -np.inf, np.float32)
    farthest.flat[pixels] = depth
    around = cv2.dilate(farthest, np.ones((3, 3), np.uint8))
    inside = (row >= 0) & (row < side) & (column >= 0) & (column < side)
    at = np.where(inside, row, 0).astype(np.intp), np.where(inside, column, 0).astype(np.intp)
    return np.asarray(inside & (away <= around[at] + _SAME_PLACE_M))


def match_curves(
    pack: StylePack, views: Sequence[ViewTables], light: Floats, front: StyleMeasures
) -> dict[float, tuple[Float64, Float64]]:
    """Return the match of all styles at all turns of the nose, by yaw.

    Args:
        light: (Q, W) float. As the search sees it at turn 0, see `StylePack.seen`.
        front: The same place at yaw 0.

    Returns:
        (S, 64) float64 each: match of 100, and the contrast in it.
    """
    both = np.stack([light, light[:, ::-1]])
    rows = mirror_rows(pack.styles)
    back = -np.arange(TURNS) % TURNS
    by_yaw = {0.0: (front.match, front.contrast)}
    for view in views:
        curves = curves_of(view.tables, both)
        here, there = (_match(pack, view, curves, number) for number in (0, 1))
        by_yaw[view.yaw_deg] = here
        if pack.header.paired:  # a head that is not symmetric has views from both sides
            continue
        by_yaw[-view.yaw_deg] = there[0][rows][:, back], there[1][:, back]
    return by_yaw


def _match(
    pack: StylePack, view: ViewTables, curves: Curves, number: int
) -> tuple[Float64, Float64]:
    contrast = np.maximum(curves.contrast[number], 1e-12 * curves.contrast[number].max() + 1e-30)
    match = 100.0 * curves.quality[number] / (view.weight_norm[:, None] * contrast)
    return match, np.broadcast_to(contrast, match.shape)


def lighting_of(yaw_deg: float, keys_deg: Float64) -> Int64:
    """Return the lighting of a face seen from aside, as indices of `LIGHTINGS`.

    Args:
        keys_deg: (...) float64. Azimuth of the main light from the nose, positive toward the
            sitter's left; nan where there is none.

    Examples:
        >>> [LIGHTINGS[n] for n in lighting_of(30.0, np.array([60.0, -60.0, 5.0]))]
        ['short', 'broad', 'front']
    """
    keys = (keys_deg + 180.0) % 360.0 - 180.0
    # A face turned toward its own left shows more of its right side.
    aside = np.where((keys > 0) == (yaw_deg > 0), 1, 2)
    # Straight from behind both sides are lit alike, too.
    middle = np.minimum(np.abs(keys), 180.0 - np.abs(keys)) < _FRONT_DEG
    front = np.isnan(keys) | middle | (abs(yaw_deg) < _STRAIGHT_DEG)
    return np.where(front, 0, aside)


@dataclass(frozen=True, slots=True)
class LensWish:
    """Where the lens may be.

    Attributes:
        yaw: A number of degrees, or what to choose it by: the best light of all, or short or broad
            light.
        background: Azimuths (from, to), clockwise, deg, in which the middle of the background must
            lie; None for any.
    """

    yaw: YawAsked = 0.0
    background: tuple[float, float] | None = None

    def met_by(self, turn_deg: float) -> bool:
        """Return whether the background at a turn is acceptable."""
        if self.background is None:
            return True
        start, end = self.background
        return (turn_deg + 180.0 - start) % 360.0 <= (end - start) % 360.0

    def moved(self, by_deg: float) -> LensWish:
        """Return the wish with azimuths counted from another zero."""
        if self.background is None:
            return self
        start, end = self.background
        return replace(self, background=(wrap(start - by_deg), wrap(end - by_deg)))


STRAIGHT: Final = LensWish()
"""The lens straight in front of the face, whatever is behind."""


@dataclass(frozen=True)
class LensSearch:
    """A place evaluated for every position of the lens.

    Attributes:
        styles: None where one is painted.
        front: Measured with the lens straight in front.
        grades: (S, 64) of the nose's azimuth.
        verdict: Grades the picture at a grid turn of the nose for the style at a row.
        curves: Match and contrast by yaw, as of `match_curves`.
        counts: (S,) bool by yaw, as in `ViewTables`.
        by_areas: (S,) bool. Styles whose match is that of the front from wherever it is seen.
        main_deg: Azimuth in the panorama of the main light.
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
        """What is measured with the face turned aside: only the match is another one."""
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
        """(S,) whether the areas of each style are seen at a yaw."""
        beyond = [yaw for yaw in self.counts if yaw * yaw_deg > 0 and abs(yaw) >= abs(yaw_deg)]
        return self.counts[min(beyond, key=abs, default=0.0)]

    @cached_property
    def keys_deg(self) -> Float64:
        """(S, 64) azimuth of the main light from the nose, for each style."""
        nose = np.arange(TURNS) * 360.0 / TURNS
        main = np.nan if self.main_deg is None else self.main_deg
        keys = np.tile(nose - main, (len(self.styles), 1))
        for row, style in enumerate(self.styles):
            if style is not None and style.side != "none":
                # The light that makes the style is its key, whatever else there is.
                key = max(style.lamps, key=lambda lamp: lamp.power).azimuth_deg
                keys[row, self.grades[row] > NO] = key
        return keys

    def choice(self, yaw_deg: float, wish: LensWish) -> tuple[Choice, Bools]:
        """The best turns at a yaw; with (S,) whether there are any that are wanted."""
        nose = np.arange(TURNS) * 360.0 / TURNS
        fits = [wish.met_by(turn) for turn in (nose + yaw_deg).tolist()]
        is_open: Bools = np.outer(self.visible(yaw_deg), fits)
        if wish.yaw in _ASIDE:
            lighting = lighting_of(yaw_deg, self.keys_deg)
            is_open &= lighting == LIGHTINGS.index(wish.yaw)
        some = np.asarray(is_open.any(axis=1))
        is_open[~some] = True
        return choose(self.at(yaw_deg), self.objective, self.limits, is_open), some

    def answer(self, row: int, yaw_deg: float, choice: Choice, scale: float) -> StyleResult:
        """The answer for one style at a yaw."""
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
        """Yaws around one at which the picture is about as good."""
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
    """Find the best turn and yaw of every style.

    Args:
        light: As `solve_all` takes it.
        wish: Its background counts from `front_deg`, as turns do.

    Raises:
        EnvironmentFileError: If the environment is black, not finite or has another size.
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
    """Return the best answer of all yaws for each style: by grade, then by match."""
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
    """(S,) by which yaws are compared: grade, then match; least where no turn is wanted."""
    match = np.take_along_axis(choice.measured.match, choice.best[:, None], axis=1)[:, 0]
    return np.where(some, choice.grade * _GRADE_POINTS + match, -np.inf)


def _gains(
    place: LensSearch, straight: Choice, results: Sequence[StyleResult]
) -> list[tuple[Gain, ...]]:
    """What short and broad light gain for each style that they bring into reach, or improve."""
    least = _merit(straight, np.ones(len(straight.grade), bool)) + NAMED_GAIN
    yaws = [yaw for yaw in place.curves if yaw]
    gains: list[tuple[Gain, ...]] = [()] * len(least)
    if not yaws:
        return gains
    for lighting in _ASIDE:
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
    """The turn offered with the face aside, where its grade is better, or alike and its match is.

    A style that stays out of reach gains nothing.
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
    """Position of a grade in `GRADES`; a painted style is in reach or not."""
    return GRADES.index(verdict.grade) if verdict.grade else YES * verdict.attainable


def _inside(result: StyleResult, wish: LensWish) -> StyleResult:
    """Keep the refined turn where its background is wanted."""
    if wish.background is None or wish.met_by(result.turn_refined_deg):
        return result
    ends = [wrap(end + 180.0) for end in wish.background]
    nearest = min(ends, key=lambda end: abs(wrap(end - result.turn_refined_deg)))
    return replace(result, turn_refined_deg=nearest, direction=direction(nearest))


def obstacle_of(wish: LensWish) -> Obstacle:
    """Return why no position of the lens meets a wish."""
    if wish.background is not None:
        return Obstacle.BACKGROUND
    if isinstance(wish.yaw, float):
        return Obstacle.FACE_HIDDEN
    return Obstacle.NO_SHORT_LIGHT if wish.yaw == "short" else Obstacle.NO_BROAD_LIGHT


def views_of(pack: StylePack, name: str) -> list[ViewTables]:
    """Load all views of a head and prepare them for the search.

    Args:
        name: Of a shipped head, or of a transport's file.

    Raises:
        TransportError: If the views cannot be read.
    """
    return tables_of(pack, load_views_of(pack, name))


def tables_of(pack: StylePack, views: HeadViews) -> list[ViewTables]:
    """Prepare loaded views for the search."""
    return [view_tables(pack, views.at(yaw, pack.styles), views.shape) for yaw in views.parts]
