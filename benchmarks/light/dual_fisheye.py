"""Unstitched brackets made of known panoramas: lamps, light, turns and seam after stitching.

    python benchmarks/light/dual_fisheye.py [--side 1520] [--keep FOLDER] [-o FILE.json]

The camera is that of `tests/helpers/fisheye.py`: two 195 degree lenses 3 cm apart in a room of 2 m
to every wall, misaligned by a degree, unequal by 0.1 stop, with vignetting, circles off centre and
JPEG. Each panorama is shot twice: as it is, and with its brightest lamp on the seam; every second
one by a camera that stores its circles stacked and sideways. Lamps are limited to the range of the
darkest of the five frames, so that the panorama itself is the truth.

Lamps with at least 1 % of the light and at most 12 degrees wide are compared: the centre of the
light around them, and its sum. Light is the irradiance of 26 directions. The step across the seam
is that of log luminance over 0.8 degrees, the reference's gradient the largest such step of the
true panorama within a degree, plus 2 % for noise.
"""

from __future__ import annotations

import argparse
import itertools
import json
import subprocess
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from app.core.base.colour import luminance
from app.core.base.imaging.images import write_png
from app.core.base.sphere import direction, directions, positions
from app.core.environment.environment import (
    read_environment,
    reduce_radiance,
    solid_angles,
)
from app.core.measure.bracket.measure import measure
from app.core.measure.finish.clip_audit import given_up
from app.core.measure.finish.display import display_panorama
from app.core.measure.finish.lamp_detection import find_lights
from app.core.measure.fisheye.stitch import Stitching
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions
from app.core.solver.solve import solve_all
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.speed.plain_search import choose
from tests.helpers.fisheye import Rig, bracket

if TYPE_CHECKING:
    from app.core.measure.read.frame import MergedLight

ROOT = Path(__file__).resolve().parents[2]


STOPS = (2.0, -1.0, -4.0, -7.0, -10.0)
MOST = 500.0
SCENES = (
    "interior",
    "courtyard",
    "studio",
    "city",
    "leadenhall_market_1k",
    "st_fagans_interior_1k",
)
SHAPE = (512, 1024)
NOISE = 0.02
LARGEST_DEG = 12.0
SIDEWAYS = {"turns": (90.0, 90.0), "stacked": True, "swapped": True}


def load(name: str, shared: Path) -> np.ndarray[Any, Any]:
    """Read a panorama, with its brightest sixth clipped at 0 EV and its lamps limited."""
    path = ROOT / "resources" / "demo" / "scenes" / f"{name}.exr"
    path = path if path.is_file() else shared / "hdri" / f"{name}.hdr"
    radiance = reduce_radiance(read_environment(path).radiance.astype(np.float32), SHAPE)
    scaled = np.minimum(radiance / np.percentile(radiance.max(axis=-1), 85), MOST)
    return np.asarray(scaled, np.float32)


def with_lamp_on_the_seam(light: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Rotate a panorama so that its brightest spot is at azimuth 90."""
    spots = cv2.GaussianBlur(luminance(light), (0, 0), 3.0)
    spots[:100] = spots[-100:] = 0.0  # near the poles everything is near the seam
    column = int(np.unravel_index(np.argmax(spots), spots.shape)[1])
    return np.roll(light, 3 * light.shape[1] // 4 - column, axis=1)


def irradiances(light: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return the luminous irradiance of 26 directions."""
    energy = luminance(light) * solid_angles(SHAPE)[:, None]
    toward = directions(SHAPE)
    axes = [np.array(a, np.float32) for a in itertools.product((-1, 0, 1), repeat=3) if any(a)]
    return np.array([(np.maximum(toward @ a, 0.0) * energy).sum() for a in axes])


def lamps_off(stitched: Any, light: Any, truth: MergedLight) -> list[dict[str, float]]:
    """Compare position and light of the true panorama's compact lamps, each in a window."""
    rows = []
    toward, weights = directions(SHAPE), solid_angles(SHAPE)[:, None]
    for lamp in find_lights(truth):
        if lamp.share < 0.01 or lamp.diameter_deg > LARGEST_DEG:
            continue
        at = direction(lamp.azimuth_deg, lamp.elevation_deg).astype(np.float32)
        radius = lamp.diameter_deg / 2.0 + 2.0
        window = toward @ at > np.cos(np.radians(radius))
        places, energies = [], []
        for picture in (light, stitched):
            level = luminance(picture)[window]
            excess = (
                np.maximum(level - np.median(level), 0.0) * np.broadcast_to(weights, SHAPE)[window]
            )
            centre = excess @ toward[window]
            places.append(centre / np.linalg.norm(centre))
            energies.append(float((level * np.broadcast_to(weights, SHAPE)[window]).sum()))
        off = float(np.degrees(np.arccos(min(float(places[0] @ places[1]), 1.0))))
        rows.append({"off_deg": off, "light_off": abs(energies[1] / energies[0] - 1.0)})
    return rows


def seam_steps(probe: Measurement, stitched: Any, light: Any) -> np.ndarray[Any, Any]:
    """Return the step across the seam over the reference's within a degree, all around."""
    stitching = probe.of(Stitching)
    assert stitching is not None
    pair = stitching.pair
    around = np.arange(0, 1440, 2)
    toward = pair.seam[around]
    angle = np.radians(around * 0.25)

    def at(picture: Any, off: float, along: float) -> Any:
        up = np.radians(toward + off)
        turn = angle + np.radians(along)
        vectors = np.stack(
            [-np.sin(turn) * np.cos(up), np.cos(turn) * np.cos(up), np.sin(up)], axis=-1
        ).astype(np.float32)
        x, y = positions(vectors, picture.shape[:2])
        level = cv2.remap(picture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
        return np.log(np.maximum(level.ravel(), 1e-6))

    one, two = luminance(stitched), luminance(light)
    step = np.abs(at(one, 0.4, 0.0) - at(one, -0.4, 0.0))
    shifts = np.arange(-1.0, 1.01, 0.25)
    allowed = np.max(
        [abs(at(two, o + 0.4, a) - at(two, o - 0.4, a)) for o in shifts for a in shifts], axis=0
    )
    return np.asarray(step / (allowed + NOISE))


def try_one(name: str, light: Any, rig: Rig, pack: StylePack, keep: Path | None) -> dict[str, Any]:
    """Shoot, stitch and compare one panorama."""
    # The first circle counts as the front, so a camera that stores the back one first looks back.
    light, shot = np.roll(light, SHAPE[1] // 2, axis=1) if rig.swapped else light, light
    with tempfile.TemporaryDirectory() as folder:
        files = bracket(Path(folder), shot, STOPS, rig)
        started = time.process_time()
        probe = measure(files, MeasureOptions(sun="leave"))
        seconds = time.process_time() - started
    stitching = probe.of(Stitching)
    assert stitching is not None
    # The middle frame saturates at 2^4.
    whole = probe.finished.measured.radiance * np.float32(2.0 ** -STOPS[2])
    stitched = reduce_radiance(whole, SHAPE)
    zeros = np.zeros(SHAPE, np.float32)
    truth = replace(probe.finished.measured, radiance=light, clipped=zeros, dark=zeros)
    lamps, ratio = lamps_off(stitched, light, truth), irradiances(stitched) / irradiances(light)
    size = pack.header.environment
    turns = (solve_all(pack, reduce_radiance(each, size)) for each in (light, stitched))
    pairs = [(one, two) for one, two in zip(*turns, strict=True) if one.attainable]
    names = {one.name for one, _ in pairs}
    off = np.array(
        [abs((b.turn_refined_deg - a.turn_refined_deg + 180.0) % 360.0 - 180.0) for a, b in pairs]
    )
    best = choose(pack, reduce_radiance(light, size))
    lost = given_up(best, choose(pack, reduce_radiance(stitched, size)).turns)
    steps = seam_steps(probe, whole, light)
    if keep is not None:
        write_png(keep / f"{name}.png", display_panorama(whole, width=2048))
        write_png(keep / f"{name}-true.png", display_panorama(light, width=2048))
    return {
        "scene": name,
        **stitching.facts(),
        "lamps": len(lamps),
        "lamp_off_deg": round(max((lamp["off_deg"] for lamp in lamps), default=0.0), 2),
        "lamp_light_off": round(max((lamp["light_off"] for lamp in lamps), default=0.0), 4),
        "light_off": round(float(np.abs(ratio - 1.0).max()), 4),
        "total_off": round(float(ratio.mean() - 1.0), 4),
        "turns": len(off),
        "turn_off_deg": round(float(off.max(initial=0.0)), 2),
        "turns_within_2_deg": int((off <= 2.0).sum()),
        "given_up": round(float(lost[[s.name in names for s in pack.styles]].max(initial=0.0)), 4),
        "seam_over_1_5": round(float((steps > 1.5).mean()), 4),
        "seam_p99": round(float(np.quantile(steps, 0.99)), 3),
        "processor_s": round(seconds, 2),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--shared", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--side", type=int, default=1520, help="of one circle's half, pixels")
    parser.add_argument("--scenes", nargs="*", default=list(SCENES))
    parser.add_argument("--keep", type=Path, help="folder for pictures to look at")
    parser.add_argument("-o", "--output", type=Path)
    wanted = parser.parse_args()
    pack = load_named_pack("generic")
    rows = []
    if wanted.keep is not None:
        wanted.keep.mkdir(parents=True, exist_ok=True)
    for index, name in enumerate(wanted.scenes):
        light = load(name, wanted.shared)
        # Every second one is stored sideways, back lens first.
        side: dict[str, Any] = SIDEWAYS if index % 2 else {}
        for kind, shot in (("", light), (" lamp on seam", with_lamp_on_the_seam(light))):
            rows.append(
                try_one(name + kind, shot, Rig(side=wanted.side, **side), pack, wanted.keep)
            )
            print(json.dumps(rows[-1]))
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    ).stdout.strip()
    if wanted.output is not None:
        result = {"commit": commit, "side": wanted.side, "rows": rows}
        wanted.output.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
