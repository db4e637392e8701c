"""Reflection of skin and eyes in each sample: its strength, and its direction."""

from __future__ import annotations

from typing import Any

import drjit as dr  # noqa: TID253 - a module that only a rendering process imports
import mitsuba as mi  # noqa: TID253
import numpy as np
from numpy.typing import NDArray

from app.core.baking.skin import EYE_COAT
from scenes.portraits.scene import Frame

Float32 = NDArray[np.float32]
_TRIES = 256
_LANES = 1 << 21
_OFFSET = 1e-3
_LOBES = {
    True: (mi.MicrofacetType.Beckmann, 0.3, 1.4),
    False: (mi.MicrofacetType.GGX, EYE_COAT.roughness**2, EYE_COAT.index),
}
"""Distribution, roughness and index, of skin and of eyes."""


def mirrored(
    scene: Any, frame: Frame, positions: Float32, normals: Float32, skin: bool, seed: int = 0
) -> tuple[Float32, Float32]:
    """Sample the surroundings of points along their surface's own glossy lobe.

    Args:
        normals: (n, 3) float32. Shading normals, pores included.
        skin: Whether they are on the skin, not on an eye.

    Returns:
        gain: (n,) float32. Share of even light that is reflected to the camera where the head does
            not block it.
        way: (n, 3) float32. Mean direction of that light, unit.
    """
    gain, way = np.zeros(len(positions), np.float32), np.zeros((len(positions), 3), np.float32)
    step = _LANES // _TRIES
    for start in range(0, len(positions), step):
        part = slice(start, start + step)
        gain[part], way[part] = _some(
            scene, frame, positions[part], normals[part], _LOBES[skin], seed + start
        )
    return gain, way


def _some(
    scene: Any, frame: Frame, positions: Float32, normals: Float32, lobe: Any, seed: int
) -> tuple[Float32, Float32]:
    kind, alpha, index = lobe
    count = len(positions)
    lane = dr.arange(mi.UInt32, count * _TRIES) // _TRIES
    rng = mi.PCG32(count * _TRIES, seed + 1)
    place, normal = mi.Point3f(_gathered(positions, lane)), _gathered(normals, lane)
    axes = mi.Frame3f(dr.normalize(normal))
    wi = axes.to_local(dr.normalize(mi.Point3f(*frame.origin) - place))
    facets = mi.MicrofacetDistribution(kind, alpha, sample_visible=True)
    facet, _ = facets.sample(wi, mi.Point2f(rng.next_float32(), rng.next_float32()))
    wo = mi.reflect(wi, facet)
    amount = mi.fresnel(dr.dot(wi, facet), index)[0] * facets.smith_g1(wo, facet)
    out = axes.to_world(wo)
    good = (wo.z > 0) & (wi.z > 0)
    good &= ~scene.ray_test(mi.Ray3f(place + normal * _OFFSET, out), good)
    amount = dr.select(good, amount, 0)
    sums = amount, amount * out.x, amount * out.y, amount * out.z
    parts = [np.array(one).reshape(count, _TRIES).mean(axis=1) for one in sums]
    mean = np.stack(parts[1:], axis=1)
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    way = np.where(length > 1e-6, mean / np.maximum(length, 1e-9), normals)
    return parts[0].astype(np.float32), way


def _gathered(values: Float32, index: Any) -> Any:
    parts = (mi.Float(np.ascontiguousarray(values[:, k])) for k in range(3))
    return mi.Vector3f(*(dr.gather(mi.Float, part, index) for part in parts))
