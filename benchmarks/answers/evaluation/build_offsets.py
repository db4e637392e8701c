"""Render the demo location's light 1 and 2 ft off its spots: the evaluation's `offsets.npz`.

Usage::

    python -m benchmarks.answers.evaluation.build_offsets --samples 96

Each place is a panorama of 128 x 64 texels, stored at 64 x 32. The sun is half a degree wide, far
too small for random rays: it is sampled separately, in the few texels around it.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_OUT: Final = Path(__file__).with_name("offsets.npz")
_SHAPE: Final = (64, 128)
_FOOT_M: Final = 0.3048
_FEET: Final = (0.0, 1.0, 2.0)
_BEARINGS: Final = (0.0, 90.0, 180.0, 270.0)
_SUN_SIDE_DEG: Final = 0.8
_SUN_RAYS: Final = 1 << 14
_SUN_ALONE: Final = 1e7  # cd/m2; the sky next to the sun is a thousand times darker


def _say(words: str) -> None:
    sys.stdout.write(f"{time.strftime('%H:%M:%S')}  {words}\n")
    sys.stdout.flush()


class _Camera:
    """Renders panoramas anywhere in the place."""

    def __init__(self) -> None:
        import mitsuba as mi

        from scenes.demo_location.assemble import World, build_place

        self.world = World(build_place(), None)
        self.sampler = mi.load_dict({"type": "independent"})
        self._seed = 0

    def panorama(self, position: NDArray[np.float64], samples: int) -> NDArray[np.float64]:
        """Return the mean radiance, (H, W, 3), cd/m2, with the sun added separately."""
        from scenes.demo_location.rays import panorama_rays

        rows = np.arange(_SHAPE[0])
        total = np.zeros((*_SHAPE, 3))
        for _ in range(samples):
            self._next(_SHAPE[0] * _SHAPE[1])
            light = self._radiance(panorama_rays(position, _SHAPE, rows, self.sampler))
            light[light.max(axis=1) > _SUN_ALONE] = 0.0
            total += light.reshape(*_SHAPE, 3)
        return total / samples + self._sun(position)

    def _sun(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the radiance that the sun's disc adds to its texels, (H, W, 3)."""
        import mitsuba as mi

        from scenes.demo_location.frame import SUN_AZIMUTH, SUN_ELEVATION

        self._next(_SUN_RAYS)
        shift = np.array(self.sampler.next_2d()).reshape(2, -1) - 0.5
        azimuth = np.radians(SUN_AZIMUTH + 2 * _SUN_SIDE_DEG * shift[0])
        elevation = np.radians(SUN_ELEVATION + 2 * _SUN_SIDE_DEG * shift[1])
        parts = [-np.sin(azimuth) * np.cos(elevation), np.sin(elevation)]
        parts.append(np.cos(azimuth) * np.cos(elevation))
        ray = mi.Ray3f(
            mi.Point3f(*[float(x) for x in position]), mi.Vector3f(*[mi.Float(p) for p in parts])
        )
        light = self._radiance(ray)
        light[light.max(axis=1) <= _SUN_ALONE] = 0.0
        texel = np.radians(180.0 / _SHAPE[0]) ** 2  # in azimuth times elevation, like the square
        weight = np.radians(2 * _SUN_SIDE_DEG) ** 2 / _SUN_RAYS / texel
        column = ((azimuth / (2 * np.pi) + 0.5) % 1.0 * _SHAPE[1]).astype(int)
        row = ((0.5 - elevation / np.pi) * _SHAPE[0]).astype(int)
        found = np.zeros((*_SHAPE, 3))
        np.add.at(found, (row, column), light * weight)
        return found

    def _next(self, count: int) -> None:
        self._seed += 1
        self.sampler.seed(self._seed, count)

    def _radiance(self, rays: Any) -> NDArray[np.float64]:
        from scenes.demo_location.tracer import radiance

        found = np.array(radiance(self.world.tables, self.sampler, rays), np.float64)
        return np.ascontiguousarray(found.T if found.shape[0] == 3 else found)


def build(out: Path, samples: int, spots: int) -> None:
    """Render every place and write the table."""
    from app.core.baking.kernel_lanes import select_variant
    from app.core.environment.environment import reduce_radiance
    from benchmarks.answers.evaluation.offsets import Offsets, save_offsets

    select_variant("llvm")
    from scenes.demo_location.frame import EYE_HEIGHT, SPOTS, direction, to_world

    camera = _Camera()
    found: list[tuple[int, float, float, NDArray[np.float32]]] = []
    for number, spot in enumerate(SPOTS[:spots]):
        centre = to_world(spot.building[0], EYE_HEIGHT, spot.building[1])
        for feet in _FEET:
            for bearing in _BEARINGS if feet else _BEARINGS[:1]:
                began = time.monotonic()
                position = centre + feet * _FOOT_M * direction(bearing)
                light = camera.panorama(position, samples).astype(np.float32)
                found.append((number, feet, bearing, reduce_radiance(light)))
                _say(
                    f"{spot.name}, {feet:g} ft at {bearing:g} deg: {time.monotonic() - began:.0f} s"
                )
    which, feet_, bearings, lights = zip(*found, strict=True)
    offsets = Offsets(
        spots=tuple(spot.words for spot in SPOTS[:spots]),
        spot=np.array(which, np.int32),
        feet=np.array(feet_, np.float32),
        bearing_deg=np.array(bearings, np.float32),
        light=np.array(lights, np.float32),
    )
    out.parent.mkdir(parents=True, exist_ok=True)
    save_offsets(out, offsets)
    _say(f"written: {len(found)} places, {out.stat().st_size / 1e3:.0f} kB")


def main(argv: list[str] | None = None) -> int:
    """Command line entry."""
    parser = argparse.ArgumentParser(description="Render the light beside the demo's spots.")
    parser.add_argument("--out", type=Path, default=_OUT, help="file to write")
    parser.add_argument("--samples", type=int, default=96, help="paths per texel of 128 x 64")
    parser.add_argument("--spots", type=int, default=3, help="how many of the spots")
    args = parser.parse_args(argv)
    build(args.out, args.samples, args.spots)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
