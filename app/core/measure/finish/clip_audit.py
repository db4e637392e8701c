"""The clip audit, which finds missing light and the results that depend on it.

Where every frame is clipped, the merged panorama is a lower bound. The audit reports how much of
the light is affected, computes the results for brighter light, and separates the styles that would
lose under brighter light from the others. A style is in doubt if its turn would lose more than 5%
of what the place could offer were any clipped lamp, any part of a wide lamp, or all lamps together
1, 3, 6 or 10 stops brighter. Styles that would come within reach or go out of reach are also
reported. In brackets of 20 places that were clipped 1 to 15 stops deep, every result with an error
of more than 10% was among those in doubt.

`choices` finds the turns for many lights at once, using the rule of `app.core.solver.turn_choice`
without its refinement.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS, turn_of_index
from app.core.base.arrays import Float32, Float64, Floats, Indices
from app.core.base.colour import luminance
from app.core.base.remarks import Remark
from app.core.environment.environment import reduce_radiance, solid_angles
from app.core.measure.finish.findings import advise
from app.core.measure.finish.lamp_detection import Light, LightGrid, light_grid
from app.core.measure.finish.remarks import (
    BlindMatters,
    ClippingMatters,
    ClippingSafe,
    RestoredRange,
)
from app.core.measure.finish.restoration import Restoration, added_light
from app.core.measure.finish.sun import find_sun, may_be_sun, sun_core
from app.core.measure.finish.sunlight import SPREAD, direct_normal_lux
from app.core.measure.read.frame import MergedLight
from app.core.solver import turn_choice
from app.core.solver.relighting_cache import normalised
from app.core.solver.search import curves_of
from app.core.solver.solve import measure
from app.core.solver.turn_choice import LIMITS, Choice, Limits, Objective, StyleMeasures
from app.core.styles.style_pack import StylePack

_AT_ONCE: Final = 16  # number of lights, few enough to keep their spectra in the cache


def choices(
    pack: StylePack,
    lights: Sequence[Floats],
    objective: Objective = "picture",
    limits: Limits = LIMITS,
) -> Choice:
    """Choose the turns of all styles under each of several lights.

    Args:
        lights: One array per light, either radiance in linear Rec. 709, (H, W, 3), or luminance,
            (H, W), at turn 0, in the pack's size and at any exposure.

    Raises:
        EnvironmentFileError: If a light is black or not finite.
    """
    parts = []
    for start in range(0, len(lights), _AT_ONCE):
        some = lights[start : start + _AT_ONCE]
        values = [pack.project(normalised(light, pack.header.environment)[0]) for light in some]
        parts.append(measure(pack, curves_of(pack.tables, np.stack(values))))
    names = [each.name for each in fields(StyleMeasures)]
    measured = StyleMeasures(*(np.concatenate([getattr(one, n) for one in parts]) for n in names))
    return turn_choice.choose(measured, objective, limits)


def given_up(truth: Choice, turns: NDArray[np.integer[Any]]) -> Float64:
    """Return the fraction of a style's range that a different turn loses, 0 to 1.

    The loss is the best value of the objective among the permitted turns, minus the value at the
    given turn, divided by the range of the objective's curve. A turn that matches better but has a
    lower grade counts as losing by the same amount, since it lacks the grade. The result has the
    shape (S,) or (N, S).

    Args:
        truth: Choice under the true light.
        turns: (S,) integers in 0..63. The turn of each style.
    """
    best = np.where(truth.eligible, truth.curve, -np.inf).max(axis=-1)
    at_turns = truth.curve[..., np.arange(len(turns)), turns]
    span = np.ptp(truth.curve, axis=-1)
    loss = np.abs(best - at_turns) / np.maximum(span, 1e-30)
    return np.asarray(np.clip(loss, 0.0, 1.0), np.float64)


GAINS: Final = (1.0, 3.0, 6.0)
"""Numbers of stops by which the report assumes clipped lamps to be brighter."""

DOUBT: Final = 0.05
"""Fraction of its curve's range that a style's turn may lose before the style is in doubt."""

BLIND: Final = "blind"
"""Stands in for a lamp's letter where light was filled in because no frame shows it."""

_FURTHER: Final = 10.0  # stops, as for a bare bulb or the sun behind an apparent window
_PART_GAINS: Final = (3.0, 6.0)
_WIDE_DEG: Final = 20.0
_PART_ROWS, _PART_COLUMNS = 6, 16  # blocks of 30 x 22.5 degrees
_PART_SHARE: Final = 0.02  # minimum fraction of all clipped light for a part to be tried alone


@dataclass(frozen=True, slots=True)
class WhatIf:
    """A style's best turn, in degrees, if one lamp were brighter by a given number of stops."""

    light: str
    stops: float
    turn_deg: float
    given_up: float


@dataclass(frozen=True, slots=True)
class StyleChange:
    """How a style's result depends on clipped light.

    Attributes:
        turn_deg: Turn on the search grid, in degrees.
        cases: The best turns if each clipped lamp, or all of them, were 1, 3 or 6 stops brighter,
            and if a restored light were at either end of its likely range.
        worst: Largest loss in any trial, including the trials with parts of wide lamps and those
            with 10 stops.
        least_stops: Smallest brightening, among the trials, that puts the turn in doubt, or None if
            none does.
        reach_stops: Smallest brightening that moves the style within reach or out of reach, or None
            if none does.
    """

    name: str
    title: str
    turn_deg: float
    cases: tuple[WhatIf, ...]
    worst: float
    least_stops: float | None
    in_reach: bool
    reach_stops: float | None

    @property
    def in_doubt(self) -> bool:
        """Whether clipping puts the turn in doubt."""
        return self.least_stops is not None


@dataclass(frozen=True, slots=True)
class Audit:
    """The result of the clip audit.

    Attributes:
        clipped_energy_range: Fraction of the light in clipped texels, 0 to 1. The first value is
            the measured one, a lower bound. The second applies if all clipped light is 6 stops
            brighter, or if the sun is as bright as the clear-sky model allows.
    """

    clipped_energy_range: tuple[float, float]
    advice: tuple[Remark, ...]
    style_changes: tuple[StyleChange, ...]

    @property
    def in_doubt(self) -> tuple[str, ...]:
        """Names of the doubtful styles."""
        return tuple(style.name for style in self.style_changes if style.in_doubt)


def audit(
    merged: MergedLight,
    lights: Sequence[Light],
    pack: StylePack,
    *,
    objective: Objective = "picture",
    limits: Limits = LIMITS,
    environment: Floats | None = None,
    restoration: Restoration | None = None,
    room_stops: float | None = None,
    grid: LightGrid | None = None,
    blind: Float32 | None = None,
) -> Audit:
    """Audit the light that is clipped in every frame and the answers that depend on it.

    Args:
        environment: (H, W). Luminance of `merged`, reduced to the pack's size, or None to compute
            it here.
        restoration: The restored sun or lamp in `merged`, or None. Both ends of its likely range
            are tried too, and the sun is not searched for again.
        room_stops: How many stops below its darkest frame the camera can go, or None if unknown.
        grid: Result of `light_grid`, or None to compute it here.
        blind: (H, W). Mask that is 1 where the light was filled in because no frame shows it. The
            light there may be a stop brighter.

    Raises:
        ProbeError: If `merged` is not a full panorama.
    """
    grid = light_grid(merged) if grid is None else grid
    bound = float((grid.loss * grid.solid_angle).sum()) / grid.total
    sun = find_sun(merged, lights, grid) if bound > 0 and restoration is None else None
    maybe = next((light.id for light in lights if may_be_sun(light, merged, grid)), "")
    unseen = None if blind is None else luminance(merged.radiance) * blind
    changes = _changes(lights, pack, (objective, limits), grid, environment, restoration, unseen)
    return Audit(
        clipped_energy_range=(bound, _upper(merged, grid, bound, sun)),
        advice=(
            *advise(merged, lights, sun, room_stops, maybe),
            *_verdict(changes, bound, restoration),
            *(_blind_remarks(changes) if blind is not None else ()),
        ),
        style_changes=changes,
    )


def _verdict(
    changes: Sequence[StyleChange], bound: float, restoration: Restoration | None
) -> tuple[Remark, ...]:
    """Report the styles in doubt and the extra stops of light that would affect them."""
    names = [s.name for s in changes if s.least_stops is not None and s.least_stops < GAINS[0]]
    if bound <= 0:
        if restoration is None or restoration.light is None or not names:
            return ()
        return (RestoredRange(restoration.light, tuple(names), _rest(names, changes)),)
    relevant = [s for s in changes if s.least_stops is not None or s.reach_stops is not None]
    if not relevant:
        return (ClippingSafe(len(changes), every=True),)
    lines: list[Remark] = []
    for soon, least, most in ((True, 0.0, GAINS[1]), (False, GAINS[1], math.inf)):
        turn = [s.name for s in changes if _between(s.least_stops, least, most)]
        reach = [s for s in changes if _between(s.reach_stops, least, most)]
        gains = tuple(s.name for s in reach if not s.in_reach)
        loses = tuple(s.name for s in reach if s.in_reach)
        if turn:
            lines.append(ClippingMatters(soon, "turn", tuple(turn), _rest(turn, changes)))
        if gains:
            lines.append(ClippingMatters(soon, "into reach", gains))
        if loses:
            lines.append(ClippingMatters(soon, "out of reach", loses))
    safe = len(changes) - len(relevant)
    return (*lines, ClippingSafe(safe)) if safe else tuple(lines)


def _blind_remarks(changes: Sequence[StyleChange]) -> tuple[Remark, ...]:
    """Report the styles that depend on the light in the gaps."""
    unsure = [
        style.name
        for style in changes
        if any(case.light == BLIND and case.given_up > DOUBT for case in style.cases)
    ]
    return (BlindMatters(tuple(unsure), _rest(unsure, changes)),)


def _rest(names: Sequence[str], changes: Sequence[StyleChange]) -> tuple[str, ...]:
    return tuple(style.name for style in changes if style.name not in names)


def _between(stops: float | None, least: float, most: float) -> bool:
    """Return whether a limit is above `least` stops but no higher than `most` stops."""
    return stops is not None and least < stops <= most


def _upper(merged: MergedLight, grid: LightGrid, bound: float, sun: Light | None) -> float:
    """Return the upper end of the range of the clipped fraction."""
    if bound <= 0:
        return 0.0
    if sun is None or merged.cd_m2 is None:
        factor = 2.0 ** GAINS[-1]
        return float(factor * bound / (1.0 + (factor - 1.0) * bound))
    most = direct_normal_lux(sun_core(sun, merged).elevation_deg) * SPREAD[1]
    extra = most / merged.cd_m2 / grid.total
    return (bound + extra) / (1.0 + extra)


def _changes(
    lights: Sequence[Light],
    pack: StylePack,
    rule: tuple[Objective, Limits],
    grid: LightGrid,
    environment: Floats | None,
    restoration: Restoration | None,
    unseen: Float32 | None,
) -> tuple[StyleChange, ...]:
    names, maps, whole = _brightened(lights, grid, pack.header.environment)
    base = whole if environment is None else np.asarray(environment, np.float64)
    trials = [
        (name, stops, (2.0**stops - 1.0) * extra)
        for name, extra in zip(names, maps, strict=True)
        for stops in ((*GAINS, _FURTHER) if name else _PART_GAINS)
    ]
    if restoration is not None:
        trials += _restoration_trials(restoration, pack.header.environment)
    if unseen is not None:
        extra = reduce_radiance(unseen[..., None], pack.header.environment)[..., 0]
        trials.append((BLIND, GAINS[0], extra))
    brighter = [np.maximum(base + extra, 0.0) for _, _, extra in trials]
    choice = choices(pack, [base, *brighter], *rule)
    turns, then, reach = choice[0].turns, choice[1:], choice.in_reach
    loss = given_up(then, turns)
    amounts = np.array([abs(stops) for _, stops, _ in trials])[:, None]
    least = np.where(loss > DOUBT, amounts, np.inf).min(axis=0, initial=np.inf)
    flips = np.where(reach[1:] != reach[0], amounts, np.inf).min(axis=0, initial=np.inf)
    degrees = [turn_of_index(turn) for turn in range(TURNS)]
    rows = [k for k, (name, stops, _) in enumerate(trials) if name and stops != _FURTHER]
    now = choice[0].offer
    bests = then.turns
    best = {k: _offer(then[k], bests[k], turns, now) for k in rows}
    return tuple(
        StyleChange(
            style.name,
            style.title,
            degrees[now[row]],
            tuple(WhatIf(*trials[k][:2], degrees[best[k][row]], float(loss[k, row])) for k in rows),
            float(loss[:, row].max(initial=0.0)),
            _or_none(least[row]),
            bool(reach[0, row]),
            _or_none(flips[row]),
        )
        for row, style in enumerate(pack.styles)
    )


def _offer(then: Choice, best: Indices, turns: Indices, now: Indices) -> Indices:
    """Return the grid turns that are offered in brighter light, (S,).

    A style whose best turn stays the same keeps its current offer.
    """
    turns_offer = now.copy()
    for row in np.flatnonzero(best != turns).tolist():
        turns_offer[row] = then[row].peak(int(best[row])).index
    return turns_offer


def _or_none(stops: np.floating[Any]) -> float | None:
    return float(stops) if np.isfinite(stops) else None


def _restoration_trials(
    restoration: Restoration, shape: tuple[int, int]
) -> list[tuple[str, float, Float64]]:
    """Return the name, stops and added light for both ends of a restored light's likely range."""
    lux, held_lux = restoration.illuminance_lux, restoration.held_lux
    if restoration.light is None or lux <= held_lux:
        return []
    disc = added_light(restoration, shape)
    return [
        (restoration.light, math.log2(end / lux), (end - lux) / (lux - held_lux) * disc)
        for end in restoration.range_lux
    ]


def _brightened(
    lights: Sequence[Light], grid: LightGrid, shape: tuple[int, int]
) -> tuple[list[str], Float64, Float64]:
    """Return the clipped light that may be brighter: each lamp, parts of wide lamps and all of it.

    Returns:
        The names, which are lamp IDs, "" for a part of a wide lamp, or "all"; one map for each
        name, (K, H, W); and the whole panorama, (H, W).
    """
    loss = grid.loss.ravel()
    clipped = [light for light in lights if light.clipped]
    sources = [(light.id, light.texels) for light in clipped]
    sources += [("", part) for light in clipped for part in _parts(light, grid)]
    names = [name for name, _ in sources]
    if float(loss.max()) > 0:
        sources.append(("all", np.arange(loss.size, dtype=np.int32)))
        names.append("all")
    cells, weights = _cells(grid.luminance.shape[0], shape)
    size = shape[0] * shape[1]
    maps = np.zeros((len(sources), *shape))
    for into, (_, texels) in zip(maps, sources, strict=True):
        shares = loss[texels] * weights[texels]
        into[:] = np.bincount(cells[texels], shares, size).reshape(shape)
    whole = reduce_radiance(grid.luminance[..., None], shape)[..., 0]
    return names, maps, whole.astype(np.float64)


@lru_cache(maxsize=4)
def _cells(height: int, shape: tuple[int, int]) -> tuple[Indices, Float64]:
    """Return each texel's cell in the reduced panorama and the fraction of the cell it covers."""
    width = 2 * height
    row, column = np.divmod(np.arange(height * width), width)
    cells = (row * shape[0] // height) * shape[1] + column * shape[1] // width
    areas = np.repeat(solid_angles((height, width)), width)
    whole = np.bincount(cells, areas, shape[0] * shape[1])
    return cells, np.asarray(areas / whole[cells])


def _parts(light: Light, grid: LightGrid) -> list[NDArray[np.int32]]:
    """Divide a wide clipped light into blocks, since one part of the sky may hide the sun."""
    if light.diameter_deg < _WIDE_DEG:
        return []
    height, width = grid.luminance.shape
    row, column = np.divmod(light.texels, width)
    block = row * _PART_ROWS // height * _PART_COLUMNS + column * _PART_COLUMNS // width
    loss = (grid.loss * grid.solid_angle).ravel()
    least = _PART_SHARE * float(loss.sum())
    parts = [light.texels[block == each] for each in np.unique(block)]
    return [part for part in parts if float(loss[part].sum()) >= least]
