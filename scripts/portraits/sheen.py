"""What the surface of skin and eyes mirrors into each sample: how much, and from where."""

from __future__ import annotations

from typing import Any

import drjit as dr  # noqa: TID253 - a module that only a rendering process imports
import mitsuba as mi  # noqa: TID253
import numpy as np
from numpy.typing import NDArray

from app.core.baking.skin import EYE_COAT
from portraits.scene import Frame

Float32 = NDArray[np.float32]
_TRIES = 256
_LANES = 1 << 21
_LOBES = (
    (mi.MicrofacetType.Beckmann, 0.3, 1.4, True),
    (mi.MicrofacetType.GGX, EYE_COAT.roughness**2, EYE_COAT.index, False),
)
"""Distribution, roughness, index, and whether it is skin."""


def mirrored(
    scene: Any, frame: Frame, positions: Float32, normals: Float32, seed: int = 0
) -> tuple[Float32, Float32]:
    """Look out from each sample along its surface's own glossy lobe.

    Args:
        normals: (n, 3) float32. Shading normals, pores included.

    Returns:
        gain: (n,) float32. Share of even light from all around that is mirrored into the camera,
            where nothing of the head is in the way.
        way: (n, 3) float32. Mean direction that it comes from, unit.
    """
    gain, way = np.zeros(len(positions), np.float32), np.zeros((len(positions), 3), np.float32)
    step = _LANES // _TRIES
    for start in range(0, len(positions), step):
        part = slice(start, start + step)
        gain[part], way[part] = _some(scene, frame, positions[part], normals[part], seed + start)
    return gain, way


def _some(
    scene: Any, frame: Frame, positions: Float32, normals: Float32, seed: int
) -> tuple[Float32, Float32]:
    count = len(positions)
    lane = dr.arange(mi.UInt32, count * _TRIES) // _TRIES
    rng = mi.PCG32(count * _TRIES, seed + 1)
    eye = mi.Point3f(*frame.origin)
    place = mi.Point3f(_gathered(positions, lane))
    ray = mi.Ray3f(eye, dr.normalize(place - eye))
    si = scene.ray_intersect(ray)
    si.sh_frame = mi.Frame3f(dr.normalize(_gathered(normals, lane)))
    si.wi = si.to_local(-ray.d)
    skin = next(shape for shape in scene.shapes() if shape.id() == "skin")
    amount, wo = mi.Float(0), mi.Vector3f(0)
    film = mi.Point2f(rng.next_float32(), rng.next_float32())
    for kind, alpha, index, mine in (*_LOBES,):
        lobe = mi.MicrofacetDistribution(kind, alpha, sample_visible=True)
        facet, _ = lobe.sample(si.wi, film)
        out = mi.reflect(si.wi, facet)
        share = mi.fresnel(dr.dot(si.wi, facet), index)[0] * lobe.smith_g1(out, facet)
        chosen = (si.shape == skin) == mine
        amount, wo = dr.select(chosen, share, amount), dr.select(chosen, out, wo)
    out = si.to_world(wo)
    good = si.is_valid() & (wo.z > 0) & (dr.dot(out, si.n) > 0) & (si.wi.z > 0)
    good &= ~scene.ray_test(si.spawn_ray(out), good)
    amount = dr.select(good, amount, 0)
    parts = [
        np.array(amount * axis).reshape(count, _TRIES).mean(1) for axis in (1, out.x, out.y, out.z)
    ]
    mean = np.stack(parts[1:], axis=1)
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    return parts[0].astype(np.float32), np.where(
        length > 1e-6, mean / np.maximum(length, 1e-9), normals
    )


def _gathered(values: Float32, index: Any) -> Any:
    parts = (mi.Float(np.ascontiguousarray(values[:, k])) for k in range(3))
    return mi.Vector3f(*(dr.gather(mi.Float, part, index) for part in parts))
