"""Photos all around, placed and merged: errors, and their cost in turns.

24 photos of 70 degrees are cut from a panorama in two rings of 12, at -20 and +25 degrees of
elevation, handheld (2 degrees in direction and roll), with an exposure that drifts by 0.3 stops
without being stated in EXIF, noise and JPEG. `turnlight stitch` knows neither the field of view nor
the directions.

Run it from the clone's folder: ``python -m benchmarks.light.stitch_photos PANORAMA ... -o JSON``.
"""

from __future__ import annotations

import argparse
import json
import math
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from app.core.base.angles import difference
from app.core.base.arrays import Bytes, Float32, Float64
from app.core.base.colour import luminance, srgb_decode, srgb_encode
from app.core.base.progress import Token, silent
from app.core.base.sphere import angle_of, angles_of, positions, rotate_light, rotation
from app.core.environment.environment import read_environment, reduce_radiance, solid_angles
from app.core.localization.picture_file import read_shown_panorama
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions
from app.core.measure.photos.measure import Photograph, PhotosFacts, measure
from app.core.measure.photos.remarks import GapsFilled
from app.core.solver.solve import solve_all
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack

AXES: Final = np.diag([-1.0, -1.0, 1.0])
RINGS_DEG: Final = (-20.0, 25.0)
BRACKET: Final = (0.0, -3.0, -6.0)
FOV_DEG: Final = 70.0
SIZE: Final = (1280, 960)
HELD: Final = {"upright": (55.4, (960, 1280)), "across": (FOV_DEG, SIZE)}
"""Horizontal field of view, and columns and rows: 70 degrees along the longer side."""

FINE: Final = 2048  # columns of a panorama
APERTURE: Final = 8.0
SUN: Final = 3000.0  # times the mean: from there on, a panorama's brightest texel is the sun
SUN_LUX: Final = 90_000.0
ROOM_CD: Final = 100.0


@dataclass(frozen=True)
class Taken:
    """Photos in a folder, and the truth: rotations, (3, 3), camera axes to the panorama's."""

    files: tuple[Path, ...]
    rotations: tuple[Float64, ...]
    stops: tuple[float, ...]


def photograph(
    radiance: Float32, turned: Float64, fov_deg: float = FOV_DEG, size: tuple[int, int] = SIZE
) -> Float32:
    """Return a linear picture, (rows, columns, 3), of a panorama through a pinhole."""
    columns, rows = size
    focal = columns / 2.0 / math.tan(math.radians(fov_deg) / 2.0)
    x, y = np.meshgrid(np.arange(columns) + 0.5 - columns / 2.0, np.arange(rows) + 0.5 - rows / 2.0)
    rays = np.stack([x / focal, y / focal, np.ones_like(x)], axis=-1)
    at = positions((rays @ turned.T).astype(np.float32), radiance.shape[:2])
    return np.asarray(
        cv2.remap(radiance, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP), np.float32
    )


def rings(random: np.random.Generator, jitter_deg: float = 2.0, a_ring: int = 12) -> list[Float64]:
    """Return the directions of a handheld camera that goes around twice."""
    found = []
    for elevation in RINGS_DEG:
        for azimuth in np.arange(a_ring) * 360.0 / a_ring:
            yaw, pitch, roll = np.array([azimuth, elevation, 0.0]) + random.normal(
                0.0, jitter_deg / 2.0, 3
            ).clip(-jitter_deg, jitter_deg)
            found.append(rotation(yaw, pitch, roll) @ AXES)
    return found


def take(
    folder: Path,
    radiance: Float32,
    rotations: Sequence[Float64],
    bracket: Sequence[float] = (0.0, -3.0),
    *,
    seed: int = 0,
    exif: bool = True,
    size: tuple[int, int] = SIZE,
    fov_deg: float = FOV_DEG,
    drift: float = 0.3,
) -> Taken:
    """Photograph a panorama all around, with one picture per exposure, in stops, at each place."""
    random = np.random.default_rng(seed)
    shutter_s = _shutter(radiance)
    base = _base(radiance)
    files, turned, stops = [], [], []
    for number, place in enumerate(rotations):
        own = random.uniform(-drift, drift)
        for step, stop in enumerate(bracket):
            moved = place
            if step:  # a hand between two exposures
                moved = rotation(*random.normal(0.0, 0.1, 3)) @ place
            light = photograph(radiance, moved, fov_deg, size) * base * 2.0 ** (stop + own)
            light += random.normal(size=light.shape) * np.sqrt(np.abs(light) / 8000.0 + 4e-7)
            codes = np.rint(255.0 * srgb_encode(np.clip(light, 0.0, 1.0))).astype(np.uint8)
            file = folder / f"IMG_{number:02}{step}.jpg"
            save(file, codes, shutter_s * 2.0**stop if exif else None)
            files.append(file)
            turned.append(moved)
            stops.append(stop + own)
    return Taken(tuple(files), tuple(turned), tuple(stops))


def _base(radiance: Float32) -> float:
    """Return the linear value of a radiance of 1 at the metered exposure."""
    return 0.5 / float(np.quantile(luminance(radiance), 0.85))


def has_sun(radiance: Float32) -> bool:
    """Return whether the brightest texel can only be the sun."""
    light = luminance(radiance)
    return float(light.max()) > SUN * float(light.mean())


def _shutter(radiance: Float32) -> float:
    """Return the shutter time at ISO 100 for a typical brightness: in the sun, or in a room.

    A value of 1 is 1.2 / (time / f-number squared) cd/m2 (ISO 12232).
    """
    light = luminance(radiance)
    angles = solid_angles((radiance.shape[0], radiance.shape[1]))[:, None]
    mean = float((light * angles).sum() / (4.0 * math.pi))
    bright = light > SUN / 10.0 * mean
    cd = ROOM_CD / mean
    if has_sun(radiance):
        cd = SUN_LUX / float((light * angles * bright).sum())
    return 1.2 * _base(radiance) / cd * APERTURE**2


def save(file: Path, codes: Bytes, shutter_s: float | None, **tags: Any) -> None:
    """Write a JPEG of quality 90, with EXIF if an exposure time is given."""
    import OpenImageIO as oiio

    spec = oiio.ImageSpec(codes.shape[1], codes.shape[0], 3, "uint8")
    spec.attribute("Compression", "jpeg:90")
    if shutter_s is not None:
        spec.attribute("ExposureTime", shutter_s)
        spec.attribute("FNumber", APERTURE)
        spec.attribute("Exif:PhotographicSensitivity", 100)
    for name, value in tags.items():
        spec.attribute(name, value)
    output = oiio.ImageOutput.create(str(file))
    assert output is not None
    output.open(str(file), spec)
    output.write_image(np.ascontiguousarray(codes))
    output.close()


def common_turn(truth: Sequence[Float64], found: Sequence[Float64 | None]) -> Float64:
    """Return the rotation, (3, 3), from the result to the truth."""
    both = [(a, b) for a, b in zip(truth, found, strict=True) if b is not None]
    u, _, v = np.linalg.svd(sum(a @ b.T for a, b in both))
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v)


def placed_off(truth: Sequence[Float64], found: Sequence[Float64 | None]) -> list[float]:
    """Return the error of each photo after removing one common rotation, degrees."""
    common = common_turn(truth, found)
    return [angle_of(a.T @ common @ b) for a, b in zip(truth, found, strict=True) if b is not None]


def read_light(file: Path) -> Float32:
    """Read the linear radiance of a panorama, HDR or a picture."""
    if file.suffix.lower() in (".exr", ".hdr"):
        return read_environment(file).radiance
    return np.asarray(srgb_decode(read_shown_panorama(file) / np.float32(255.0)), np.float32)


def measured(file: Path, fov_deg: float, size: tuple[int, int], pack: StylePack) -> dict[str, Any]:
    """Photograph a place all around, stitch it, and compare: an entry of the result."""
    radiance = read_light(file)
    exposures = len(BRACKET) if file.suffix in (".exr", ".hdr") else 1
    with tempfile.TemporaryDirectory() as folder:
        taken = take(
            Path(folder),
            radiance,
            rings(np.random.default_rng(1)),
            BRACKET[:exposures],
            size=size,
            fov_deg=fov_deg,
        )
        started, processor = time.perf_counter(), time.process_time()
        found = measure(taken.files, MeasureOptions(), Token(), silent)
        seconds = time.perf_counter() - started, time.process_time() - processor
    rotations = [each.rotation for each in photographs_of(found)]
    common = common_turn(taken.rotations, rotations)
    yaw = angles_of(common)[0]
    shape = pack.header.environment
    truth = solve_all(pack, reduce_radiance(radiance, shape))
    # In the panorama's own frame: a sun between two texels of 5.6 degrees changes answers by
    # itself.
    light = rotate_light(found.merged.radiance, rotation(yaw, 0.0, 0.0))
    told = solve_all(pack, reduce_radiance(light, shape))
    off = placed_off(taken.rotations, rotations)
    turns = [
        round(abs(difference(b.turn_refined_deg, a.turn_refined_deg)), 2)
        for a, b in zip(truth, told, strict=True)
        if a.attainable
    ]
    audit = found.finished.audit
    return {
        "place": f"{file.parent.name}/{file.name}",
        "columns": int(radiance.shape[1]),
        "exposures": exposures,
        "photographs": len(rotations),
        "placed": len(off),
        "off_deg_most": round(max(off), 3),
        "off_deg_median": round(float(np.median(off)), 3),
        "level_deg": round(math.hypot(*angles_of(common)[1:]), 3),
        "stops_off_most": round(_stops_off(taken, found), 3),
        "blind": round(found.blind, 4),
        "turns_off_deg": turns,
        "in_doubt": 0 if audit is None else len(audit.in_doubt),
        "gaps_told": any(isinstance(each, GapsFilled) for each in found.warnings),
        "seconds": round(seconds[0], 1),
        "processor_seconds": round(seconds[1], 1),
    }


def photographs_of(measured: Measurement) -> tuple[Photograph, ...]:
    """Return the photos of a measurement, with their directions."""
    own = measured.of(PhotosFacts)
    return () if own is None else own.photographs


def _stops_off(taken: Taken, found: Measurement) -> float:
    placed = [each.rotation is not None for each in photographs_of(found)]
    off = np.array(found.bracket.stops) - np.array(taken.stops)[placed]
    return float(np.abs(off - np.median(off)).max())


def main() -> None:
    """Measure, and write the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("places", type=Path, nargs="+")
    parser.add_argument("-o", "--output", type=Path, required=True)
    args = parser.parse_args()
    pack = load_named_pack("generic")
    rows: dict[str, list[dict[str, Any]]] = {name: [] for name in HELD}
    for name, (fov_deg, size) in HELD.items():
        for file in args.places:
            row = measured(file, fov_deg, size, pack)
            rows[name].append(row)
            print(name, json.dumps(row), flush=True)
            write(args.output, rows)


def write(output: Path, rows: dict[str, list[dict[str, Any]]]) -> None:
    """Summarise and write."""
    output.write_text(
        json.dumps(
            {name: summary(found) | {"places": found} for name, found in rows.items()}, indent=1
        )
        + "\n",
        encoding="utf-8",
    )


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the target values, over places of sufficient resolution and over coarser ones."""
    found = {}
    for name, chosen in (
        ("fine", [row for row in rows if row["columns"] >= FINE]),
        ("enlarged", [row for row in rows if row["columns"] < FINE]),
    ):
        turns = [turn for row in chosen for turn in row["turns_off_deg"]]
        if turns:
            found[name] = {
                "places": len(chosen),
                "photographs": sum(row["photographs"] for row in chosen),
                "placed": sum(row["placed"] for row in chosen),
                "off_deg_most": max(row["off_deg_most"] for row in chosen),
                "turns": len(turns),
                "turns_within_3_deg": round(float(np.mean(np.array(turns) <= 3.0)), 3),
                "seconds_most": max(row["seconds"] for row in chosen),
            }
    return found


if __name__ == "__main__":
    main()
