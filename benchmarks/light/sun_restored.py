"""Accuracy of the restored sun, from brackets that clip it, with and without restoring.

Each scene with an intact sun is scaled so that its disc (within 2.5 deg) gives the clear-sky
model's normal illuminance times a factor from 0.6 to 1.6, which the merge does not know. It is
exposed by each simulated camera's `full` plan from its metered exposure, as JPEG frames of 2048 x
1024 with noise, and measured like files. The other scenes, at ten absolute brightnesses each (with
a perfect merge in place of the frames), must never be changed.

    python benchmarks/light/sun_restored.py [--shared DIR] [--draws N] [-o FILE.json]
"""

from __future__ import annotations

import argparse
import json
import math
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.core import camera_catalogue as camera_table
from app.core.base.colour import luminance, srgb_encode
from app.core.base.sphere import direction, directions_at
from app.core.camera_catalogue import CameraLimits
from app.core.environment.environment import (
    read_environment,
    reduce_radiance,
    solid_angles,
)
from app.core.measure.bracket.measure import measure
from app.core.measure.finish.clip_audit import given_up
from app.core.measure.finish.lamp_detection import find_lights
from app.core.measure.finish.restoration import restore
from app.core.measure.finish.sunlight import SkyWord, direct_normal_lux
from app.core.measure.options import MeasureOptions
from app.core.measure.plan.planner import plan
from app.core.measure.read.frame import Exposure, MergedLight
from app.core.solver.turn_choice import OBJECTIVES
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from app.devices.simulated.cameras import SENSORS
from app.devices.simulated.optics import meter as meter_with
from benchmarks.light.shots.brackets import write_bracket
from benchmarks.speed.plain_search import choose

ROOT = Path(__file__).resolve().parents[2]


Float32 = NDArray[np.float32]

# Scenes with an intact disc, and a photographer's description of their sky.
SUNS: dict[str, SkyWord] = {
    "chinese_garden_1k": "clear",
    "quarry_01_1k": "clear",
    "rooitou_park_1k": "clear",
    "sunrise": "clear",
    "city": "thin cloud",
    "sunset": "hazy",
}
CAMERAS = ("S", "SC2", "V", "Z1", "X")
BAR = 0.02
APERTURE_DEG = 2.5
METERED = 0.46  # mean of the sRGB-coded frame at the metered exposure
# Mean luminance, cd/m2, of scenes without a sun: lamp-lit, overcast, full day.
LEVELS = (3.0, 10.0, 30.0, 100.0, 300.0, 1_000.0, 3_000.0, 6_000.0, 10_000.0, 20_000.0)


@dataclass(frozen=True)
class Scene:
    """A panorama in relative radiance, with the position and light of its sun, if any."""

    name: str
    radiance: Float32
    elevation_deg: float = 0.0
    disc: float = 0.0


def load(path: Path) -> Scene:
    """Read a scene and measure its disc."""
    radiance = read_environment(path).radiance
    light = luminance(radiance)
    height, width = light.shape
    row, column = np.unravel_index(int(light.argmax()), light.shape)
    elevation = 90.0 - 180.0 * (float(row) + 0.5) / height
    sun = direction(360.0 * ((float(column) + 0.5) / width - 0.5), elevation)
    near = directions_at((height, width), np.arange(light.size)) @ sun
    inside = near >= math.cos(math.radians(APERTURE_DEG))
    areas = np.repeat(solid_angles((height, width)), width)
    disc = float((light.ravel() * areas)[inside].sum())
    return Scene(path.stem, radiance, elevation, disc)


def meter(light: Float32) -> float:
    """Return the saturation luminance, cd/m2, of a camera's automatic exposure."""
    areas = solid_angles((light.shape[0], light.shape[1]))[:, None]
    low, high = float(light.max()) * 1e-9 + 1e-6, float(light.max()) + 1e-6
    for _ in range(40):
        middle = math.sqrt(low * high)
        coded = float((srgb_encode(light / middle) * areas).sum() / areas.sum() / light.shape[1])
        low, high = (middle, high) if coded > METERED else (low, middle)
    return high


def expose(cd_m2: Float32, limits: CameraLimits) -> MergedLight:
    """Return a perfect merge of the camera's full plan for a scene."""
    iso, aperture = min(limits.isos), min(limits.apertures)
    factor = 1.2 / meter(luminance(cd_m2))
    metered = Exposure(factor * aperture**2 * 100.0 / iso, iso, aperture)
    shots = plan(metered, limits, "full").shots
    unit = 1.2 / metered.factor
    clip = 2.0 ** (metered.ev - min(shot.exposure.ev for shot in shots))
    relative = cd_m2 / np.float32(unit)
    lost = (relative.max(axis=2) >= clip).astype(np.float32)
    return MergedLight(
        radiance=np.minimum(relative, np.float32(clip)),
        clipped=lost,
        dark=np.zeros_like(lost),
        reference_ev=metered.ev,
        clip_level=clip,
        cd_m2=unit,
    )


@dataclass(frozen=True)
class Trial:
    """One scene, camera and factor: regrets of all styles, by objective."""

    scene: str
    sky: str
    camera: str
    factor: float
    clipped_stops: float
    restored: bool
    without: dict[str, list[float]]
    with_sun: dict[str, list[float]]


def photograph(cd_m2: Float32, camera: str, pack: StylePack, seed: int) -> MergedLight:
    """Shoot a scene with a simulated camera's full plan, and merge the files."""
    model = SENSORS[camera]
    shots = plan(meter_with(cd_m2, model), limits_of(camera), "full").shots
    exposures = [shot.exposure for shot in shots]
    with tempfile.TemporaryDirectory() as folder:
        paths = write_bracket(folder, cd_m2, model, exposures, seed=seed, shape=(1024, 2048))
        return measure(paths, MeasureOptions(sun="leave")).merged


def try_sun(
    scene: Scene, word: SkyWord, camera: str, factor: float, pack: StylePack, ideal: bool
) -> Trial:
    """Return the regret of every style without and with restoring."""
    lux = direct_normal_lux(scene.elevation_deg, word) * factor
    truth = scene.radiance * np.float32(lux / scene.disc)
    if ideal:
        merged = expose(truth, limits_of(camera))
    else:
        merged = photograph(truth, camera, pack, round(1000 * factor))
    done = restore(merged, find_lights(merged), word)
    true, held, given = (
        luminance(reduce_radiance(each)) for each in (truth, merged.radiance, done.merged.radiance)
    )
    without: dict[str, list[float]] = {}
    with_sun: dict[str, list[float]] = {}
    for objective in OBJECTIVES:
        best = choose(pack, true, objective)
        without[objective] = given_up(best, choose(pack, held, objective).turns).tolist()
        with_sun[objective] = given_up(best, choose(pack, given, objective).turns).tolist()
    assert merged.cd_m2 is not None
    stops = math.log2(float(luminance(truth).max()) / (merged.clip_level * merged.cd_m2))
    restored = done.light is not None
    return Trial(scene.name, word, camera, factor, stops, restored, without, with_sun)


def limits_of(camera: str) -> CameraLimits:
    """Return a camera's limits."""
    return next(each.limits for each in camera_table.CAMERAS if each.name == camera)


def find_scenes(shared: Path) -> dict[str, Path]:
    """Return bundled scenes and those that are not shipped, by name."""
    paths = sorted((ROOT / "resources" / "demo" / "scenes").glob("*.exr"))
    paths += sorted((shared / "hdri").glob("*.hdr"))
    return {path.stem: path for path in paths}


def false_restorations(scene: Scene) -> list[tuple[str, float]]:
    """Return cameras and levels at which a sun is found in a scene without one."""
    mean = float(luminance(reduce_radiance(scene.radiance, (1, 2))).mean())
    wrong = []
    for camera in CAMERAS:
        for level in LEVELS:
            merged = expose(scene.radiance * np.float32(level / mean), limits_of(camera))
            if restore(merged, find_lights(merged), "clear").light is not None:
                wrong.append((camera, level))
    return wrong


def good(trials: list[Trial], objective: str, restored: bool = True) -> float:
    """Return the share of (scene, style) pairs within the target."""
    lost = [v for t in trials for v in (t.with_sun if restored else t.without)[objective]]
    return float(np.mean(np.array(lost) <= BAR))


def mean(trials: list[Trial], objective: str, restored: bool) -> float:
    """Return the mean regret."""
    return float(np.mean([(t.with_sun if restored else t.without)[objective] for t in trials]))


def table(trials: list[Trial]) -> list[dict[str, object]]:
    """Return one row per scene and camera."""
    rows: list[dict[str, object]] = []
    for scene, sky in SUNS.items():
        for camera in CAMERAS:
            part = [t for t in trials if t.scene == scene and t.camera == camera]
            if not part:
                continue
            row: dict[str, object] = {
                "scene": scene,
                "sky": sky,
                "camera": camera,
                "factors": [round(t.factor, 3) for t in part],
                "clipped_stops": round(float(np.mean([t.clipped_stops for t in part])), 1),
                "restored": sum(t.restored for t in part),
                "trials": len(part),
            }
            for objective in OBJECTIVES:
                row[objective] = {
                    "mean_regret_without": round(mean(part, objective, False), 4),
                    "mean_regret_with": round(mean(part, objective, True), 4),
                    "within_2_percent_without": round(good(part, objective, False), 4),
                    "within_2_percent_with": round(good(part, objective), 4),
                }
            rows.append(row)
    return rows


def show(rows: list[dict[str, object]]) -> None:
    """Print the table as Markdown (picture objective)."""
    print("| scene | sky | camera | stops clipped | restored | regret without | with | <= 2 % |")
    print("|---|---|---|---|---|---|---|---|")
    for row in rows:
        values = row["picture"]
        assert isinstance(values, dict)
        print(
            f"| {row['scene']} | {row['sky']} | {row['camera']} | {row['clipped_stops']} "
            f"| {row['restored']} of {row['trials']} "
            f"| {100 * values['mean_regret_without']:.1f} % "
            f"| {100 * values['mean_regret_with']:.2f} % "
            f"| {100 * values['within_2_percent_with']:.0f} % |"
        )


def main() -> None:
    """Run everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--shared", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--draws", type=int, default=3, help="factors per scene and camera")
    parser.add_argument("--ideal", action="store_true", help="no frames: a perfect merge")
    parser.add_argument(
        "-o", "--output", type=Path, default=ROOT / "benchmarks" / "results" / "sun-restored.json"
    )
    wanted = parser.parse_args()
    pack = load_named_pack("generic")
    random = np.random.default_rng(2019)
    trials: list[Trial] = []
    wrong: dict[str, list[tuple[str, float]]] = {}
    for name, path in find_scenes(wanted.shared).items():
        scene = load(path)
        if name not in SUNS:
            wrong[name] = false_restorations(scene)
            continue
        for camera in CAMERAS:
            factors = random.uniform(0.6, 1.6, wanted.draws).tolist()
            trials += [
                try_sun(scene, SUNS[name], camera, each, pack, wanted.ideal) for each in factors
            ]
    rows = table(trials)
    show(rows)
    summary = {
        "pairs": len(trials) * len(pack.styles),
        **{f"within_2_percent_{o}": round(good(trials, o), 4) for o in OBJECTIVES},
        **{f"without_{o}": round(good(trials, o, False), 4) for o in OBJECTIVES},
        "by_scene": {
            name: round(good([t for t in trials if t.scene == name], "picture"), 4)
            for name in SUNS
            if any(t.scene == name for t in trials)
        },
        "scenes_without_sun": len(wrong),
        "false_restorations": {name: cases for name, cases in wrong.items() if cases},
    }
    print(json.dumps(summary, indent=1))
    wanted.output.write_text(json.dumps({"summary": summary, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
