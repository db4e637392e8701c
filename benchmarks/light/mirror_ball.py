"""Accuracy of light measured with a mirror ball, and false detections where there is none.

Stock Mitsuba renders a ball of 12 cm, 5 % dirty, in front of eight panoramas: camera and
photographer 1.5 m away at azimuth 0, and again at 90 (`mirror_ball_scene.py`); also, balls in the
modelled location are traced (`mirror_ball_location.py`). `--render` makes the pictures once, in
half an hour. Each becomes a bracket of five 8-bit frames, measured like files: the turns from the
ball are compared with those from the panorama, and its light outside the gaps.

    DRJIT_LIBLLVM_PATH=... python benchmarks/light/mirror_ball.py DIR --render stock
    DRJIT_LIBLLVM_PATH=... python benchmarks/light/mirror_ball.py DIR --render location
    python benchmarks/light/mirror_ball.py DIR [--pictures FOLDER] [-o FILE.json]

`--pictures` is a folder of pictures without a ball (scikit-image ships 26); views of panoramas are
added.
"""

from __future__ import annotations

import argparse
import json
import platform
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from app.core.base.angles import difference  # noqa: E402
from app.core.base.colour import luminance, srgb_decode, srgb_encode  # noqa: E402
from app.core.base.errors import ProbeError  # noqa: E402
from app.core.base.sphere import direction, directions  # noqa: E402
from app.core.environment.environment import (  # noqa: E402
    read_environment,
    reduce_radiance,
    solid_angles,
)
from app.core.localization.views import Lens, look  # noqa: E402
from app.core.measure.ball.ball_finder import Ball, find_ball  # noqa: E402
from app.core.measure.ball.measure import BallFacts, measure  # noqa: E402
from app.core.measure.ball.mirror_ball import BallOptions  # noqa: E402
from app.core.measure.finish.sunlight import direct_normal_lux  # noqa: E402
from app.core.measure.measurement import Measurement  # noqa: E402
from app.core.measure.options import MeasureOptions  # noqa: E402
from app.core.solver.solve import solve_all  # noqa: E402
from app.core.styles.style_pack import StylePack  # noqa: E402
from app.core.styles.style_pack_file import load_named_pack  # noqa: E402
from benchmarks.light.sun_restored import METERED, SUNS, load  # noqa: E402
from tests.helpers.mirror_ball import write_bracket  # noqa: E402

Float32 = NDArray[np.float32]
PLACES = (
    "st_fagans_interior_1k",
    "quarry_01_1k",
    "interior",
    "city",
    "leadenhall_market_1k",
    "rooitou_park_1k",
    "studio",
    "forest",
)
# Focal length on 24 x 36, lens above the ball in metres, pitch and yaw of the camera in degrees.
SHOTS = ((85, 0.0, 0.0, 0.0), (50, 0.1, 0.0, 0.0), (85, 0.15, -5.7, 0.0), (70, 0.0, 0.0, 4.0))
# In the modelled location: the file, and cd/m2 per unit.
LOCATION = {
    "cafe": ("cafe/probe.exr", 200.0),
    "probe-1": ("location/probe-1.exr", 200.0),
    "probe-3": ("location/probe-3.exr", 25000.0),
    "probe-2": ("location/probe-2.exr", 200.0),
}
LOCATION_SIZE, LOCATION_MM = (2800, 4200), 50  # like a phone
SIDE_DEG = 90.0
BAR_DEG = 3.0
SHAPE = (32, 64)
OUTDOORS = ("quarry_01_1k", "rooitou_park_1k", "city", "forest")


def find_places(shared: Path) -> dict[str, Path]:
    """Return bundled scenes and those that are not shipped, by name."""
    paths = [*(ROOT / "resources/demo/scenes").glob("*.exr"), *(shared / "hdri").glob("*.hdr")]
    return {path.stem: path for path in sorted(paths)}


def render(places: dict[str, Path], folder: Path) -> None:
    """Render the pictures, from the front and from the side."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    from benchmarks.light.mirror_ball_scene import Shot
    from benchmarks.light.mirror_ball_scene import render as picture

    for number, name in enumerate(PLACES):
        panorama = read_environment(places[name]).radiance
        for side, azimuth in (("front", 0.0), ("side", SIDE_DEG)):
            path = folder / f"{name}-{side}.npy"
            if not path.exists():
                mm, *pose = shot_of(number)
                shot = Shot((1600, 2400), mm, azimuth, *pose)
                np.save(path, picture(panorama, shot, seed=number + 1))
                print(path.name, flush=True)


def render_location(folder: Path) -> None:
    """Render the pictures in the modelled location; building it takes some minutes."""
    from app.core.baking.kernel_lanes import select_variant

    select_variant("llvm")
    from benchmarks.light.mirror_ball_location import Location
    from benchmarks.light.mirror_ball_scene import Shot

    location = Location()
    for number, (name, (file, unit)) in enumerate(LOCATION.items()):
        panorama = read_environment(ROOT / "resources/demo" / file).radiance * np.float32(unit)
        _, *pose = shot_of(number)
        for side, azimuth in (("front", 0.0), ("side", SIDE_DEG)):
            path = folder / f"{name}-{side}.npy"
            if not path.exists():
                shot = Shot(LOCATION_SIZE, LOCATION_MM, azimuth, *pose)
                np.save(path, location.render(name, panorama, shot, number + 1))
                print(path.name, flush=True)


def shot_of(number: int) -> tuple[int, float, float, float]:
    """Return the shot of a place's picture."""
    return SHOTS[number % len(SHOTS)]


def bracket(
    folder: Path, light: Float32, ball: Ball, lit: float, mm: int
) -> tuple[list[Path], float]:
    """Write five frames; return them with the light that saturates one of exposure 1.

    The darkest holds the lamps if the camera can; they are two stops apart, or three.

    Args:
        lit: cd/m2 of the light's unit.
    """
    x, y = (int(each) for each in ball.project(ball.axis))
    half = int(0.7 * ball.radius_px)
    level = saturating(luminance(light[y - half : y + half, x - half : x + half]))
    shutter_s = 1.2 / (level * lit) * 8.0**2
    disc = cv2.circle(np.zeros(light.shape[:2], np.uint8), (x, y), int(ball.radius_px), 1, -1) > 0
    top = float(light[disc].max()) / level
    # 1/8000 s and f/16 are the darkest settings of cameras.
    darkest = -min(np.ceil(np.log2(top)), 12.0, np.floor(np.log2(shutter_s * 8000.0)) + 2.0)
    stops = [darkest + (2.0 if darkest > -8.0 else 3.0) * step for step in (4, 3, 2, 1, 0)]
    light = light / np.float32(level)
    paths = write_bracket(folder, light, mm=mm, stops=stops, shutter_s=shutter_s)
    return paths, level * shutter_s / 8.0**2


def saturating(light: Float32) -> float:
    """Return the saturation of the exposure with a mean coded picture of `METERED`."""
    low, high = 1e-6, float(light.max())
    for _ in range(40):
        middle = (low * high) ** 0.5
        coded = float(srgb_encode(np.minimum(light / middle, 1.0)).mean())
        low, high = (middle, high) if coded > METERED else (low, middle)
    return high


def cd_m2(path: Path) -> float:
    """Return the luminance of one unit, from the sun under a clear sky or the kind of place."""
    scene = load(path)
    if path.stem in SUNS:
        return direct_normal_lux(scene.elevation_deg) / scene.disc
    mean = 3000.0 if path.stem in OUTDOORS else 100.0
    return mean / float(luminance(reduce_radiance(scene.radiance, (1, 2))).mean())


def seen_from_front(above_m: float) -> NDArray[np.bool_]:
    """Return the texels of 64 x 32 not hidden by the ball or the photographer, (32, 64)."""
    toward = directions(SHAPE)
    lens = np.degrees(np.arctan(above_m / 1.5))
    behind = toward @ direction(180.0, -lens).astype(np.float32) > np.cos(np.radians(25.0))
    azimuth = np.abs(360.0 * ((np.arange(SHAPE[1]) + 0.5) / SHAPE[1] - 0.5)) < 20.0
    elevation = 90.0 - 180.0 * (np.arange(SHAPE[0]) + 0.5) / SHAPE[0]
    person = np.outer((elevation > -60.0) & (elevation < 20.0), azimuth)
    return np.asarray(~behind & ~person)


def compared(
    probe: Measurement, panorama: Float32, pack: StylePack, above_m: float, scale: float
) -> dict[str, Any]:
    """Compare turns and light of a ball's environment with the panorama's own."""
    true, made = (reduce_radiance(each, SHAPE) for each in (panorama, probe.merged.radiance))
    pairs = {
        own.name: round(abs(difference(own.turn_refined_deg, other.turn_refined_deg)), 2)
        for own, other in zip(solve_all(pack, true), solve_all(pack, made), strict=True)
        if own.attainable
    }
    areas = np.repeat(solid_angles(SHAPE)[:, None], SHAPE[1], axis=1)
    seen = areas * seen_from_front(above_m)
    # One unit of the merge saturates its reference frame.
    unit = scale / 2.0**probe.merged.reference_ev
    ratio = float((luminance(made) * seen).sum() / (luminance(true) * seen).sum()) * unit
    # The sun's place is known, but no bracket captures it: the rest of the light is reported
    # separately.
    most = np.float32(8.0 * (luminance(true) * areas).sum() / areas.sum())
    dim = seen * (luminance(true) < most)
    rest = float((luminance(made) * dim).sum() / (luminance(true) * dim).sum()) * unit
    return {
        "light": round(ratio, 4),
        "light_but_lamps": round(rest, 4),
        "blind": round(probe.blind, 4),
        "clipped": round(probe.finished.measured_clipped, 4),
        "within": sum(off <= BAR_DEG for off in pairs.values()),
        "attainable": len(pairs),
        "off_deg": pairs,
    }


def balls(places: dict[str, Path], folder: Path) -> list[dict[str, Any]]:
    """Measure every place from one side and from two."""
    pack, rows = load_named_pack("generic"), []
    tasks = [(n, name, places[name], 1.0) for n, name in enumerate(PLACES)]
    tasks += [
        (n, name, ROOT / "resources/demo" / file, unit)
        for n, (name, (file, unit)) in enumerate(LOCATION.items())
    ]
    for number, name, source, unit in tasks:
        if not (folder / f"{name}-front.npy").exists():
            continue
        mm, above, pitch, _ = shot_of(number)
        mm = LOCATION_MM if name in LOCATION else mm
        panorama = read_environment(source).radiance * np.float32(unit)
        lit = 1.0 if name in LOCATION else cd_m2(source)
        row: dict[str, Any] = {"place": name, "mm": mm}
        with tempfile.TemporaryDirectory() as work:
            sides, scales = [], []
            for side in ("front", "side"):
                path = folder / f"{name}-{side}.npy"
                if path.exists():
                    light = np.load(path).astype(np.float32)
                    try:
                        ball = find_ball(luminance(light), mm)
                    except ProbeError:
                        row.setdefault("not_found", []).append(side)
                        continue
                    paths, scale = bracket(Path(work) / side, light, ball, lit, mm)
                    sides.append(paths)
                    scales.append(scale)
            options = MeasureOptions(sun=SUNS.get(name, "clear"), own=BallOptions(pitch_deg=pitch))
            start = time.perf_counter()
            probe = measure(sides[0], options)
            row["seconds"] = round(time.perf_counter() - start, 2)
            facts = probe.of(BallFacts)
            assert facts is not None
            row["width_px"] = round(2.0 * facts.ball.radius_px)
            row["one"] = compared(probe, panorama, pack, above, scales[0])
            if len(sides) > 1:
                # Nobody paces exactly a quarter of a circle.
                wanted = BallOptions(tuple(sides[1]), SIDE_DEG + 6.0, pitch_deg=pitch)
                try:
                    probe = measure(sides[0], replace(options, own=wanted))
                    row["two"] = compared(probe, panorama, pack, above, scales[0])
                except ProbeError:
                    row.setdefault("not_found", []).append("side")
        print(json.dumps(row), flush=True)
        rows.append(row)
    return rows


def without(places: dict[str, Path], pictures: Path | None) -> dict[str, Any]:
    """Search for a ball where there is none: pictures, portraits and views of panoramas."""
    shown: list[tuple[str, Float32]] = []
    for path in sorted(pictures.iterdir()) if pictures is not None else []:
        picture = cv2.imread(str(path)) if path.suffix in (".png", ".jpg") else None
        if picture is not None and min(picture.shape[:2]) >= 100:
            shown.append((path.name, srgb_decode(picture[..., ::-1].astype(np.float32) / 255)))
    for number, (name, path) in enumerate(places.items()):
        panorama = read_environment(path).radiance
        for view in range(2):
            lens = Lens(60.0, (1500, 1000))
            pitch = (-20.0, 15.0, 0.0)[number % 3]
            turn = 100.0 * number + 170.0 * view
            shown.append((f"{name}, {turn:.0f}", look(panorama, turn, lens, pitch)))
    found, slowest = [], 0.0
    for name, picture in shown:
        start = time.perf_counter()
        try:
            find_ball(luminance(picture))
            found.append(name)
        except ProbeError:
            slowest = max(slowest, time.perf_counter() - start)
    return {"pictures": len(shown), "found_in": found, "slowest_s": round(slowest, 2)}


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the targets: in front of panoramas and in the location, from one side and two."""
    stock = [row for row in rows if row["place"] not in LOCATION]
    parts = {
        "one": [row["one"] for row in stock],
        "two": [row["two"] for row in stock],
        "location_one": [row["one"] for row in rows if row["place"] in LOCATION],
        "location_two": [row["two"] for row in rows if row["place"] in LOCATION and "two" in row],
    }
    missed = [f"{row['place']} {side}" for row in rows for side in row.get("not_found", [])]
    made: dict[str, Any] = {"found": len(rows), "not_found": missed}
    for name, some in parts.items():
        pairs, good = (sum(row[key] for row in some) for key in ("attainable", "within"))
        made[name] = {
            "places": len(some),
            "pairs": pairs,
            "within_3_deg": round(good / max(pairs, 1), 4),
            "light_but_lamps": [row["light_but_lamps"] for row in some],
            "light_within_5_percent": sum(abs(row["light_but_lamps"] - 1) <= 0.05 for row in some),
            "light_with_lamps": [row["light"] for row in some],
        }
    return made


def main() -> None:
    """Render, or measure the rendered pictures."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("folder", type=Path, help="of the rendered pictures")
    parser.add_argument("--render", choices=("stock", "location"))
    parser.add_argument("--shared", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("-o", type=Path, default=ROOT / "benchmarks/results/mirror-ball.json")
    args = parser.parse_args()
    places = find_places(args.shared)
    args.folder.mkdir(parents=True, exist_ok=True)
    if args.render == "stock":
        render(places, args.folder)
        return
    if args.render == "location":
        render_location(args.folder)
        return
    start = time.perf_counter()
    none = without(places, args.pictures)
    print(json.dumps(none), flush=True)
    rows = balls(places, args.folder)
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()
    made = {
        "commit": commit,
        "machine": platform.machine(),
        "seconds": round(time.perf_counter() - start),
        "summary": summary(rows),
        "without": none,
        "places": rows,
    }
    args.o.write_text(json.dumps(made, indent=1) + "\n")
    print(json.dumps(made["summary"], indent=1))


if __name__ == "__main__":
    main()
