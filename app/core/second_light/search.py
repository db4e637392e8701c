"""Search for the best turn and lamp placement by eq. 7 of the paper, exactly for both objectives.

All 64 turns times 576 placements are evaluated for every style. As without a lamp, the decision
does not depend on the exposure. The place's light is divided by its mean luminance, and the lamp's
light is divided by the same number, so only the lamp's strength relative to the place matters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from app.core.base.angles import TURNS, turn_of_index, wrap
from app.core.base.arrays import Bools, Float32, Floats
from app.core.second_light.added_light import AddedLight
from app.core.second_light.contrast import norm_at
from app.core.second_light.lamp_tables import (
    LampTables,
    SearchPlace,
    lamp_tables,
    see_place,
    values_at,
)
from app.core.second_light.place_pictures import lamp_pictures, place_pictures
from app.core.second_light.placements import ALTITUDES_DEG, COUNT, placement
from app.core.second_light.search_kernel import BestSpot, seek
from app.core.second_light.visible_change import VisibleChange
from app.core.solver.light_map import LightMap, light_shortfall
from app.core.solver.relighting_cache import normalised
from app.core.solver.search import luminance_of
from app.core.solver.shortfall import Cause, LightShortfall, Shortfall
from app.core.solver.solve import solve_all
from app.core.solver.style_result import Lighting, StyleResult
from app.core.solver.style_signature import GRADES, Grade
from app.core.solver.style_verdict import PictureMeasure, judge, picture_of
from app.core.solver.transport import Transport
from app.core.solver.turn_choice import LIMITS, Limits, Objective
from app.core.styles.style_pack import StylePack

ALL: Final = TURNS * COUNT
"""Number of combinations of turn and placement."""

_STEP_DEG: Final = 360.0 / TURNS
_TILT_DEG: Final = float(ALTITUDES_DEG[1] - ALTITUDES_DEG[0])
_WEAK: Final = 0.1  # fraction of the face's mean below which a lamp cannot shape it


@dataclass(frozen=True, slots=True)
class LampPlacement:
    """The result for a style at a place with a lamp."""

    name: str
    title: str
    side: str
    # turn_index, placement: on the grids, 0..63 and 0..575; the turn counts from the panorama's
    # centre column
    turn_index: int
    placement: int
    # turn_deg, turn_refined_deg: the turn on the grid, and refined, in degrees within (-180, 180],
    # positive clockwise
    turn_deg: float
    turn_refined_deg: float
    # lamp_azimuth_deg, lamp_altitude_deg: placement of the lamp on the grid, in degrees, positive
    # towards the sitter's left and up
    lamp_azimuth_deg: float
    lamp_altitude_deg: float
    lamp_azimuth_refined_deg: float
    lamp_altitude_refined_deg: float
    # quality, match, strength: values at that grid point. Quality (eq. 7) is in the unit of the
    # environment, the others are 0 to 100
    quality: float
    match: float
    strength: float
    attainable: bool
    before: StyleResult
    # change of the picture, against the best turn without the lamp and against the same turn
    change: VisibleChange
    # (9, 64), the objective at the chosen turn: match, 0 to 100, or quality; altitude by azimuth
    map: Float32 = field(repr=False)
    evaluated: int
    power: float = 1.0
    # as in `app.core.solver.style_result.StyleResult`
    grade: Grade | None = None
    shortfall: Shortfall | None = None
    looks_more_like: str | None = None
    # yaw of the face relative to the lens; `turn_deg` is then the turn of the lens
    yaw_deg: float = 0.0
    lighting: Lighting = "front"

    @property
    def raised(self) -> bool:
        """Whether the lamp raises the grade, or brings a style without a grade within reach."""
        if self.grade is None or self.before.grade is None:
            return self.attainable and not self.before.attainable
        return GRADES.index(self.grade) > GRADES.index(self.before.grade)

    @property
    def rescued(self) -> bool:
        """Whether the lamp visibly brings a style within reach that is out of reach without it."""
        return self.raised and not self.before.attainable and not self.hardly_changed

    @property
    def hardly_changed(self) -> bool:
        """Whether the pictures with and without the lamp look the same."""
        return not self.change.visible


def place_all(
    pack: StylePack,
    transport: Transport,
    radiance: Floats,
    lamp_light: AddedLight,
    objective: Objective = "picture",
    *,
    styles: Sequence[str] | None = None,
    is_open: Bools | None = None,
    greedy: bool = False,
    powers: Sequence[float] = (1.0,),
    limits: Limits = LIMITS,
    front_deg: float = 0.0,
    tables: LampTables | None = None,
) -> tuple[LampPlacement, ...]:
    """Find the best turn and lamp placement for every style (eq. 7).

    Args:
        radiance: (32, 64, 3) float. Environment at turn 0, as linear Rec. 709 in cd/m2, which is
            also the unit of the lamp.
        is_open: (576,) bool. Placements within reach. By default, all placements are.
        powers: Possible powers of the lamp, as fractions of its full power (see
            `app.core.second_light.lamp_presets`). The picture objective uses the power with the
            best match, or the first of several equally good ones. The paper's objective always
            gains from more light, so it uses the first power.
        front_deg: Azimuth of the photographer at turn 0, in degrees, from which turns are measured.

    Raises:
        EnvironmentFileError: If the environment is black, is not finite, or has the wrong size.
        StyleError: If a style is unknown.
        CoreError: If no placement is allowed.
    """
    light, scale = normalised(radiance, pack.header.environment)
    if light.ndim == 2:
        light = np.repeat(light[..., None], 3, axis=2)
    indices = None if styles is None else {pack.index(name) for name in styles}
    rows = [row for row in range(len(pack.styles)) if indices is None or row in indices]
    before = solve_all(
        pack,
        radiance,
        objective,
        limits=limits,
        styles=[pack.styles[row].name for row in rows],
        front_deg=front_deg,
    )
    tables = lamp_tables(pack, transport, lamp_light) if tables is None else tables
    place = see_place(tables, light, scale)
    if greedy:
        turns = [result.turn_index for result in before]
        spots = [
            seek(tables, place, [row], objective, limits, is_open, powers, turn=turn)[0]
            for row, turn in zip(rows, turns, strict=True)
        ]
    else:
        spots = list(seek(tables, place, rows, objective, limits, is_open, powers))
    count = COUNT if is_open is None else int(np.count_nonzero(is_open))
    evaluated = TURNS + count if greedy else TURNS * count
    ask = _Query(tables, place, limits, objective, max(powers), evaluated, front_deg, greedy)
    changes = _changes(tables, transport, light * scale, spots, before)
    answers = zip(spots, before, changes, strict=True)
    return tuple(_answer(ask, one, result, change) for one, result, change in answers)


def _changes(
    tables: LampTables,
    transport: Transport,
    light: Floats,
    spots: Sequence[BestSpot],
    before: Sequence[StyleResult],
) -> list[VisibleChange]:
    """Compare the pictures without and with the lamp.

    Args:
        light: (32, 64, 3) float. Linear Rec. 709 radiance at turn 0, in cd/m2.
    """
    pack = tables.pack
    turns = [(result.turn_index, one.spot.turn) for result, one in zip(before, spots, strict=True)]
    every = [turn for pair in turns for turn in pair]
    alone = place_pictures(transport, light, every, int(np.count_nonzero(pack.region)))
    pictures = lamp_pictures(
        transport,
        light,
        tables.lamp_light,
        [one.spot for one in spots],
        [one.power for one in spots],
    )
    return [
        alone.change(pack.styles[one.row].expose, pair, picture)
        for one, pair, picture in zip(spots, turns, pictures, strict=True)
    ]


@dataclass(frozen=True, slots=True, eq=False)
class _Query:
    tables: LampTables
    place: SearchPlace
    limits: Limits
    objective: Objective
    most: float
    evaluated: int
    front_deg: float
    greedy: bool


def _answer(
    ask: _Query, best: BestSpot, before: StyleResult, change: VisibleChange
) -> LampPlacement:
    tables, place, limits = ask.tables, ask.place, ask.limits
    spot, style = best.spot, tables.pack.styles[best.row]
    quality, picture = _measure(tables, place, best)
    if ask.objective == "paper":
        # Use exactly the value from the search, so that the hidden part of the sun is rounded in
        # the same way.
        quality = float(best.values[spot.number])
    match, strength = float(picture.match[best.row]), float(picture.strength[best.row])
    verdict = judge(tables.pack, best.row, picture, limits)
    shortfall = verdict.shortfall
    if not verdict.attainable:
        weak = _light_shortfall(tables, place, best, match, strength, limits, ask.most)
        shortfall = weak or shortfall
    turn, (azimuth, altitude) = turn_of_index(spot.turn), placement(spot.number)
    fine = best.moves
    refined = wrap(turn + fine[0] * _STEP_DEG - ask.front_deg)
    if ask.greedy:
        # The turn was chosen and refined before the lamp was added.
        refined = before.turn_refined_deg
    values = best.values * (1.0 if ask.objective == "picture" else place.scale)
    return LampPlacement(
        name=style.name,
        title=style.title,
        side=style.side,
        turn_index=spot.turn,
        placement=spot.number,
        turn_deg=wrap(turn - ask.front_deg),
        turn_refined_deg=refined,
        lamp_azimuth_deg=azimuth,
        lamp_altitude_deg=altitude,
        lamp_azimuth_refined_deg=wrap(azimuth + fine[1] * _STEP_DEG),
        lamp_altitude_refined_deg=altitude + fine[2] * _TILT_DEG,
        quality=quality * place.scale,
        match=match,
        strength=strength,
        attainable=verdict.attainable,
        grade=verdict.grade,
        shortfall=shortfall,
        looks_more_like=verdict.looks_more_like,
        before=before,
        change=change,
        map=values.reshape(-1, TURNS).astype(np.float32),
        evaluated=ask.evaluated,
        power=best.power,
    )


def _measure(
    tables: LampTables, place: SearchPlace, best: BestSpot
) -> tuple[float, PictureMeasure]:
    """Return the quality of one combination and the measures of its picture.

    All coordinates are used for the contrast.
    """
    pack, lamp_light, count = tables.pack, tables.lamp_light, tables.count
    spot, power = best.spot, best.power
    values = values_at(tables, place, spot, power)
    mean, areas = max(float(values[count]), 1e-30), values[tables.areas]
    product = values[tables.face(0) :]
    norm = norm_at(
        lamp_light.contrast,
        lamp_light.hidden,
        place.light,
        place.scale,
        spot.turn,
        spot.number,
        power,
    )
    match = 100.0 * product / (pack.weight_norm * norm) if norm > 0 else np.zeros(count)
    strength = 100.0 * product / (pack.studio_ratio * mean)
    return float(values[best.row]), picture_of(pack, areas, match, strength)


def _light_shortfall(
    tables: LampTables,
    place: SearchPlace,
    best: BestSpot,
    match: float,
    strength: float,
    limits: Limits,
    most: float,
) -> LightShortfall | None:
    """Find the reason why a style is out of reach even with the lamp.

    Args:
        most: Largest power of the lamp.

    Returns:
        The shortfall, or None if a missing relation in the style's signature is the better reason.
    """
    spot, mean = best.spot, tables.count
    strongest = most * float(tables.lamp_products[mean].max()) / place.scale
    if strongest < _WEAK * float(place.curves[mean, spot.turn]):
        weak = strength < limits.strength and match >= limits.match
        return limits.miss(Cause.WEAK_LAMP, match, strength, weak=weak)
    if tables.pack.styles[best.row].signature.relations:
        return None
    rolled = np.roll(place.light, -spot.turn, axis=1) * place.scale
    light = luminance_of(tables.lamp_light.over(rolled, spot.number, best.power))
    style = tables.pack.styles[best.row]
    return light_shortfall(style, match, strength, limits, LightMap(light), 0.0)
