"""Find the answers that depend on missing light, whether it is clipped or in gaps.

The same rule applies to a photo, a file with a clipped lamp and a stitched panorama with a gap. The
light is changed in every plausible way, and a style whose answer changes with it is in doubt.

Clipped light is assumed to be brighter, as in `measure.finish.clipped_light`: all of it by several
stops, the middle of each white area more than its edge, or one of the largest areas alone.

Gaps are filled from their surroundings. In reality, they may be dark or several times as bright, or
they may hide a lamp in any direction, although only a weak one below the horizon. The strengths
were chosen so that 96% of the styles whose answer differs from the answer for the whole panorama
are in doubt (see `benchmarks/light/marred_panoramas.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from app.core.base.angles import TURNS
from app.core.base.arrays import Bools, Float32, Float64, Floats
from app.core.base.colour import FloatImage
from app.core.base.sphere import bounded
from app.core.environment.environment import Environment, reduce_light, solid_angles
from app.core.measure.finish.clip_audit import choices, given_up
from app.core.measure.finish.clipped_light import DOUBT, brightened, dimmed, doubts, guesses
from app.core.measure.read.frame import MergedLight
from app.core.solver.turn_choice import Choice, Objective, grade_at
from app.core.styles.style_pack import StylePack

_COLUMNS: Final = 2048
_FEW_STOPS: Final = 2.0
_WHOLE: Final = 2  # number of further alternatives for all clipped light
_GIVEN_UP: Final = 0.05  # maximum loss, as a fraction of a curve's range
_FAR_TURNS: Final = 2  # steps of the grid, or 11 degrees
_FACTORS: Final = (0.0, 4.0)  # factors for the filled light
_BLOCKS: Final = (4, 8)  # rows and columns of 45 degrees, each of which may hide a lamp
_LEAST_GAP: Final = 0.03  # minimum fraction of a block that is a gap
_LEAST_STRENGTH: Final = 0.3
_WIDE: Final = 0.2  # maximum that the whole gap may add, as a fraction of all light
_LAMP: Final = 0.2  # maximum that a lamp in a block may add, as a fraction of all light
_GROUND_LAMP: Final = 0.04
_GROUND_ROW: Final = 3  # first row at least 45 degrees below the horizon


@dataclass(frozen=True, slots=True)
class Doubt:
    """The styles whose turn or grade depends on clipped light, and those that depend on gaps."""

    clipped: tuple[str, ...] = ()
    unseen: tuple[str, ...] = ()

    @property
    def styles(self) -> frozenset[str]:
        """All doubtful styles."""
        return frozenset((*self.clipped, *self.unseen))


def doubt_of(
    environment: Environment,
    pack: StylePack,
    objective: Objective = "picture",
) -> Doubt | None:
    """Return the doubtful styles in an environment, or None if all of its light was measured."""
    if environment.clipped is None and environment.unseen is None and not environment.rough:
        return None
    radiance = bounded(environment.radiance, _COLUMNS)
    names = [style.name for style in pack.styles]
    clipped = unseen = np.zeros(len(names), np.bool_)
    if environment.clipped is not None:
        light = MergedLight(
            radiance,
            bounded(environment.clipped, _COLUMNS),
            np.zeros(radiance.shape[:2], np.float32),
            reference_ev=0.0,
            clip_level=1.0,
        )
        clipped = _by_clipping(light, environment.rough, pack, objective)
    if environment.unseen is not None:
        gap = bounded(environment.unseen.astype(np.float32), _COLUMNS)
        unseen = _by_gaps(radiance, gap, pack, objective)
    return Doubt(*(tuple(np.array(names)[marks].tolist()) for marks in (clipped, unseen)))


def _by_clipping(light: MergedLight, rough: bool, pack: StylePack, objective: Objective) -> Bools:
    """Return a mask of the styles that depend on clipped light. `rough` is already brightened."""
    shape = pack.header.environment
    if rough:
        lights = guesses(dimmed(light), light)
        choice = choices(pack, [reduce_light(one, shape) for one in lights], objective)
        return np.asarray(doubts(choice) > DOUBT)
    likely, looks, *others = guesses(light, brightened(light))
    fewer = guesses(light, brightened(light, _FEW_STOPS))[0]
    alone = [looks + likely - one for one in others[_WHOLE:]]
    lights = [looks, fewer, likely, *others[:_WHOLE], *alone]
    return has_changed(choices(pack, [reduce_light(one, shape) for one in lights], objective))


def _by_gaps(radiance: FloatImage, unseen: Float32, pack: StylePack, objective: Objective) -> Bools:
    """Return a mask of the styles that depend on the gaps, given as `unseen`, (H, 2 H), 0 to 1."""
    shape = pack.header.environment
    whole = reduce_light(radiance, shape)
    gap = reduce_light(radiance * unseen[..., None], shape)
    cover = reduce_light(np.repeat(unseen[..., None], 3, axis=2), shape)
    lights = [whole, *(whole + (factor - 1.0) * gap for factor in _FACTORS)]
    lights += [whole + lamp[..., None] for lamp in hidden_lamps(cover[..., 0], whole)]
    return has_changed(choices(pack, [np.maximum(one, 0.0) for one in lights], objective))


def hidden_lamps(cover: Float32, light: Float32) -> list[Float32]:
    """Return the light that gaps may hide, (h, w) each, throughout the gaps and by block.

    Args:
        cover: (h, w) float32. The fraction of each texel that is in a gap.
        light: (h, w, 3) float32. The light of the panorama.
    """
    height, width = cover.shape
    areas = np.repeat(solid_angles((height, width))[:, None], width, axis=1)
    total = float((light.mean(axis=-1) * areas).sum())
    lamps = [np.asarray(cover * (_WIDE * total / float((cover * areas).sum())), np.float32)]
    rows = np.arange(height) * _BLOCKS[0] // height
    columns = np.arange(width) * _BLOCKS[1] // width
    for row in range(_BLOCKS[0]):
        for column in range(_BLOCKS[1]):
            inside = np.outer(rows == row, columns == column)
            gap = np.where(inside, cover, 0.0)
            share = float((gap * areas).sum()) / float(areas[inside].sum())
            if share > _LEAST_GAP:
                lamps.append(_at_middle(gap, areas, _strength(row, share) * total))
    return lamps


def _strength(row: int, gap: float) -> float:
    """Return the fraction of all light that a lamp in a block's gap adds."""
    return (_GROUND_LAMP if row >= _GROUND_ROW else _LAMP) * min(
        max(2.0 * gap, _LEAST_STRENGTH), 1.0
    )


def _at_middle(gap: Floats, areas: Float64, strength: float) -> Float32:
    """Return a lamp a few texels in size, in the middle of a block's gap."""
    weight = gap * areas
    row = round(float((weight.sum(axis=1) @ np.arange(len(gap))) / weight.sum()))
    column = round(float((weight.sum(axis=0) @ np.arange(gap.shape[1])) / weight.sum()))
    lamp = np.zeros(gap.shape, np.float32)
    patch = np.s_[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
    lamp[patch] = strength / float(areas[patch].sum())
    return lamp


def has_changed(choice: Choice) -> Bools:
    """Return a mask of styles whose grade changes or whose turn loses in any later light."""
    turns, best = choice[0].turns, choice.best
    best[0] = turns
    loss = given_up(choice[1:], turns)
    away = np.abs((best[1:] - turns + TURNS // 2) % TURNS - TURNS // 2)
    grade = grade_at(choice.measured, choice.limits, best)
    differs = (away >= _FAR_TURNS) & (loss > _GIVEN_UP)
    return np.asarray((differs | (grade[1:] != grade[0])).any(axis=0))
