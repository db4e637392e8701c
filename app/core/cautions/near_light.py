"""Find the styles whose answer would differ if the camera had stood elsewhere.

The camera measures the light at its own position, and the head may be 30 to 60 cm away from it.
That matters where light is near: the directions and sizes of lamps and windows change. The light is
moved by 30 and 60 cm in six directions, at distances estimated from the panorama, and every style
is solved again. A style is cautioned if its turn would lose more than 4 points of match, which was
chosen so that the styles that really lose 3 points are found (see `benchmarks/near-light.md`).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np

from app.core.base.arrays import Float32, Float64
from app.core.base.sphere import directions, positions
from app.core.cautions.caution import Caution, Hazard
from app.core.cautions.lost_match import lost_match
from app.core.cautions.surroundings import SHAPE, SurfaceMap, estimate_surroundings, reduced
from app.core.environment.environment import Environment, solid_angles
from app.core.measure.finish.clip_audit import choices
from app.core.solver.turn_choice import Objective
from app.core.styles.style_pack import StylePack

DISTANCES_M: Final = (0.3, 0.6)
"""Distances by which the camera may have been away from the head."""

LOSS: Final = 4.0
"""Points of match that a turn may lose by the estimate before its style is cautioned."""

_LEAST_ROWS: Final = 64
_NEAREST_M: Final = 0.1
_MOST_GROWTH: Final = 16.0  # of a surface's solid angle
_FLATTEST: Final = 0.05  # cosine at which a surface is seen
_MOST_TILT: Final = 4.0  # ratio of the cosines from both positions


def near_light(
    environment: Environment, pack: StylePack, objective: Objective = "picture"
) -> tuple[Caution, ...]:
    """Return a caution about near light, or none if no style would change.

    Its amount is the smallest tested distance at which any style would change, in metres. The floor
    and the walls cannot be found in panoramas of fewer than 64 rows or with gaps, nor by the light
    of one photo.
    """
    whole = environment.unseen is None and not environment.rough
    if not whole or environment.shape[0] < _LEAST_ROWS:
        return ()
    light = reduced(environment.radiance)
    surroundings = estimate_surroundings(light)
    losses = losses_nearby(light, surroundings, pack, objective)
    changes = losses.max(axis=1) > LOSS
    if not changes.any():
        return ()
    amount = DISTANCES_M[int(changes.any(axis=1).argmax())]
    names = np.array([style.name for style in pack.styles])
    styles = tuple(names[changes.any(axis=0)].tolist())
    return (Caution(Hazard.NEAR_LIGHT, amount, styles),)


def losses_nearby(
    light: Float32, surroundings: SurfaceMap, pack: StylePack, objective: Objective = "picture"
) -> Float64:
    """Return the points of match that each style's turn would lose if the head were elsewhere.

    Args:
        light: (128, 256, 3) float32. Light at the camera.

    Returns:
        (2, 6, S) float64. Losses by distance, direction and style, negative if a turn has more
        match than the best turn of a better grade.
    """
    shape = pack.header.environment
    offsets = [np.zeros(3)]
    offsets += [far * way for far in DISTANCES_M for way in np.vstack([np.eye(3), -np.eye(3)])]
    lights = [moved_light(light, surroundings, offset, shape) for offset in offsets]
    loss = lost_match(choices(pack, lights, objective))
    return loss.reshape(len(DISTANCES_M), -1, len(pack.styles))


def moved_light(
    light: Float32, surroundings: SurfaceMap, offset: Float64, shape: tuple[int, int]
) -> Float32:
    """Return the light at another position in the same surroundings.

    Every texel keeps its radiance. Its direction follows from its distance, and its solid angle
    from its distance and tilt. Surfaces hidden from the camera are missing.

    Args:
        light: (128, 256, 3) float32. Linear radiance at the camera.
        offset: (3,) float64. The other position relative to the camera, in metres, in the
            panorama's coordinate system.
        shape: Rows and columns of the result.

    Returns:
        (rows, columns, 3) float32. Linear radiance at the other position.
    """
    before, areas = _texels()
    points = surroundings.distance[..., None] * before - offset
    distance = np.maximum(np.linalg.norm(points, axis=-1), _NEAREST_M)
    after = points / distance[..., None]
    tilt_before, tilt_after = (
        np.maximum(np.abs((surroundings.normal * ways).sum(axis=-1)), _FLATTEST)
        for ways in (before, after)
    )
    growth = np.minimum(tilt_after / tilt_before, _MOST_TILT)
    growth *= (surroundings.distance / distance) ** 2
    return _gathered(light, after, areas * np.minimum(growth, _MOST_GROWTH), shape)


@lru_cache(maxsize=1)
def _texels() -> tuple[Float64, Float64]:
    """Return the direction, (128, 256, 3), and the solid angle, (128, 256), of each texel."""
    areas = np.repeat(solid_angles(SHAPE)[:, None], SHAPE[1], axis=1)
    return directions(SHAPE).astype(np.float64), areas


def _gathered(light: Float32, ways: Float64, areas: Float64, shape: tuple[int, int]) -> Float32:
    """Average texels in other directions over the nearest texels of a panorama.

    Args:
        light: (h, w, 3) float32. Radiance of each texel.
        ways: (h, w, 3) float64. Direction of each texel.
        areas: (h, w) float64. Solid angle of each texel.
        shape: Rows and columns of the result.
    """
    columns, rows = positions(ways.astype(np.float32), shape)
    left, top = np.floor(columns).astype(np.int64), np.floor(rows).astype(np.int64)
    right, low = columns - left, rows - top
    size = shape[0] * shape[1]
    sums, total = np.zeros((size, 3)), np.zeros(size)
    for down, across in np.ndindex(2, 2):
        share = np.where(down, low, 1.0 - low) * np.where(across, right, 1.0 - right)
        row = np.clip(top + down, 0, shape[0] - 1)
        cell = (row * shape[1] + (left + across) % shape[1]).ravel()
        weight = (areas * share).ravel()
        total += np.bincount(cell, weight, size)
        for channel in range(3):
            energy = weight * light[..., channel].ravel()
            sums[:, channel] += np.bincount(cell, energy, size)
    mean = sums / np.maximum(total, 1e-12)[:, None]
    return mean.reshape(*shape, 3).astype(np.float32)
