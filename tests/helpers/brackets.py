"""Samples of brackets made from HDR scenes, and what a response curve does to the light."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.devices.simulated.cameras import GENERIC
from app.devices.simulated.optics import meter, saturation_cd_m2
from benchmarks.light.camera_curves import SRGB, Curve

Float = NDArray[np.float64]
Bytes = NDArray[np.uint8]

SCENES = ("city", "courtyard", "forest", "interior", "night", "studio", "sunrise", "sunset")
PAPER = (2.0, 0.0, -2.0)
FULL = (2.0, 0.0, -2.0, -4.0, -6.0)

_WELL = 8000.0  # electrons at saturation
_READ = 0.0007


@lru_cache
def light(scene: str) -> Float:
    """A bundled scene, (512, 1024, 3), scaled so that 0 EV is what a meter would choose."""
    radiance = read_environment(resources() / "demo" / "scenes" / f"{scene}.exr").radiance
    return radiance.astype(np.float64) / saturation_cd_m2(meter(radiance, GENERIC))


def pictures(
    radiance: Float,
    stops: Sequence[float],
    curves: Curve | tuple[Curve, Curve, Curve] = SRGB,
    *,
    seed: int = 1,
    quality: int | None = 95,
    black: int = 0,
) -> list[Bytes]:
    """Frames with shot and read noise, clipping, curve, rounding and JPEG."""
    random = np.random.default_rng(seed)
    each = curves if isinstance(curves, tuple) else (curves,) * 3
    tables = [curve.table() for curve in each]
    frames = []
    for stop in stops:
        exposed = radiance * 2.0**stop
        noise = np.sqrt(np.minimum(exposed, 4.0) / _WELL + _READ**2)
        exposed = np.clip(exposed + noise * random.standard_normal(exposed.shape), 0.0, 1.0)
        index = np.rint(np.sqrt(exposed) * 65535.0).astype(np.int64)
        codes = np.stack([table[index[..., c]] for c, table in enumerate(tables)], axis=-1)
        if black:
            codes = (black + codes * ((255.0 - black) / 255.0)).round().astype(np.uint8)
        frames.append(codes if quality is None else _jpeg(codes, quality))
    return frames


def _jpeg(codes: Bytes, quality: int) -> Bytes:
    done, data = cv2.imencode(".jpg", codes[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert done
    decoded: Any = cv2.imdecode(data, cv2.IMREAD_COLOR)
    return np.ascontiguousarray(decoded[..., ::-1])


def samples(frames: Sequence[Bytes], step: int = 5) -> Bytes:
    """The same places of all frames, (K, N, 3)."""
    return np.stack(
        [frame[step // 2 :: step, step // 2 :: step].reshape(-1, 3) for frame in frames]
    )


def shot(
    scene: str, stops: Sequence[float], curve: Curve | tuple[Curve, Curve, Curve] = SRGB
) -> Bytes:
    """Samples of a bundled scene."""
    return samples(pictures(light(scene), stops, curve))


def errors(table: Float, curve: Curve, radiance: Float, stops: Sequence[float]) -> Float:
    """Relative errors that a curve alone brings into the merged light, up to a common scale.

    The frames have no noise and are not rounded, and are merged with the weights of the least
    variance, where at least one is not clipped and down to 9 stops below the clip of the first.
    """
    true = radiance[::3, ::3].reshape(-1, 3)
    codes = np.arange(256)
    slope = np.gradient(table)
    total, weight = np.zeros_like(true), np.zeros_like(true)
    for stop in stops:
        coded = curve.encode(true * 2.0**stop) * 255.0
        open_ = np.clip((254.0 - coded.max(axis=-1, keepdims=True)) / 10.0, 0.0, 1.0)
        linear = np.interp(coded, codes, table)
        rounding = 0.5 * np.interp(coded, codes, slope)
        each = open_ * 4.0**stop / (linear / _WELL + _READ**2 + rounding**2)
        total += each * linear * 2.0**-stop
        weight += each
    seen = (weight > 0.0) & (true * 2.0 ** max(stops) > 2.0**-9)
    ratio = total[seen] / weight[seen] / true[seen]
    result: Float = np.abs(ratio / np.median(ratio) - 1.0)
    return result
