"""From files to light, whole: what must hold of any bracket, and what goes wrong with peers' tools.

Truth is a bundled scene at a known brightness, shot by a simulated Theta V.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.core.base import sphere
from app.core.base.angles import difference
from app.core.base.colour import luminance
from app.core.base.errors import ProbeError
from app.core.base.paths import resources
from app.core.camera_catalogue import camera_facts
from app.core.environment.environment import read_environment, reduce_radiance
from app.core.measure.bracket.measure import measure
from app.core.measure.finish.clip_audit import given_up
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions
from app.core.measure.plan.planner import plan
from app.core.measure.read.frame import Exposure, XmpPose
from app.core.solver.solve import solve_all
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from app.devices.simulated.cameras import THETA_S, THETA_V
from app.devices.simulated.optics import meter, saturation_cd_m2
from app.words.remarks import sentences
from benchmarks.light.camera_curves import FILMIC, GAMMA_18, GAMMA_26, LOG, SHOULDER, Curve
from benchmarks.light.shots.brackets import enlarged, write_bracket
from benchmarks.speed.plain_search import choose
from tests.helpers.cases import sample_first
from tests.helpers.people import with_person

SCENES = tuple(sorted(p.stem for p in (resources() / "demo" / "scenes").glob("*.exr")))
EV100 = 10.0


@cache
def light(name: str) -> Any:
    """A bundled scene in cd/m2, all at the same metered brightness."""
    radiance = read_environment(resources() / "demo" / "scenes" / f"{name}.exr").radiance
    return radiance * np.float32(meter(radiance, THETA_V).factor * 2.0**EV100)


@cache
def pack() -> StylePack:
    return load_named_pack("generic")


def exposures(radiance: Any, kind: Any = "paper") -> list[Exposure]:
    model = camera_facts(THETA_V.model)
    assert model is not None
    shots = plan(meter(radiance, THETA_V), model.limits, kind, model.max_shots).shots
    return [shot.exposure for shot in shots]


def shoot(folder: Path, radiance: Any, kind: Any = "paper", **options: Any) -> list[Path]:
    return write_bracket(folder, radiance, THETA_V, exposures(radiance, kind), seed=5, **options)


def merged(files: list[Path], **wishes: Any) -> Measurement:
    return measure(files, MeasureOptions(sun="leave", **wishes))


def errors(probe: Measurement, radiance: Any) -> Any:
    """Relative error of luminance where some frame is neither clipped nor black."""
    assert probe.merged.cd_m2 is not None
    return np.abs(ratios(probe, radiance) * probe.merged.cd_m2 - 1.0)


def ratios(probe: Measurement, radiance: Any) -> Any:
    """Luminance over the true one, where some frame is neither clipped nor black."""
    true = luminance(radiance)
    known = (probe.merged.clipped == 0) & (probe.merged.dark == 0) & (true > 0)
    return luminance(probe.merged.radiance)[known] / true[known]


@pytest.mark.slow
@pytest.mark.parametrize("scene", sample_first(SCENES, 3))
def test_radiance_is_right(scene: str, tmp_path: Path) -> None:
    """Whole frames of the camera, sRGB curve, JPEG 95, noise: median 1 %, 95th percentile 4 %."""
    shape = THETA_V.shape
    probe = merged(shoot(tmp_path, light(scene), shape=shape, smooth=True))
    truth = reduce_radiance(enlarged(light(scene), shape, smooth=True), (1024, 2048))
    found = errors(probe, truth)
    assert np.median(found) <= 0.01
    assert np.percentile(found, 95) <= 0.04


@pytest.mark.slow
@pytest.mark.parametrize(
    "curve",
    sample_first([FILMIC, LOG, GAMMA_18, GAMMA_26, SHOULDER], 2),
    ids=lambda c: str(c.name),
)
def test_other_curves_are_recovered(curve: Curve, tmp_path: Path) -> None:
    """A curve that is not sRGB, found out by `auto`: median 3 %, 95th percentile 10 %."""
    probe = merged(shoot(tmp_path, light("interior"), curve=curve))
    assert probe.response.response.name != "sRGB"
    assert any("curve" in warning for warning in sentences(probe.warnings))
    ratio = ratios(probe, light("interior"))
    found = np.abs(ratio / np.median(ratio) - 1.0)
    assert np.median(found) <= 0.03
    assert np.percentile(found, 95) <= 0.10


def test_lamp_clipped_in_all_frames_is_the_brightest_thing(tmp_path: Path) -> None:
    """The black sun: what no frame holds is a lower bound, flagged, never darker than around."""
    radiance = light("studio")
    probe = merged(shoot(tmp_path, radiance))
    lost = probe.merged.clipped == 1
    assert lost.sum() > 100
    values = luminance(probe.merged.radiance)
    assert np.isfinite(values).all()
    assert values[lost].min() >= 0.90 * probe.merged.clip_level
    assert values[lost].min() >= 0.90 * values[~lost].max()
    assert np.percentile(values[lost] * probe.merged.cd_m2 / luminance(radiance)[lost], 99) <= 1.05


def test_what_is_black_in_all_frames_is_dark(tmp_path: Path) -> None:
    radiance = np.maximum(light("studio").copy(), 0.0)
    radiance[400:460, 300:500] = 0.0
    files = write_bracket(
        tmp_path, radiance, THETA_V, [Exposure(t, 64.0, 2.0) for t in (1e-3, 2.5e-4)], seed=5
    )
    probe = merged(files)
    values = probe.merged.radiance[410:450, 310:490]
    assert np.isfinite(probe.merged.radiance).all()
    assert values.max() < 0.02 * probe.merged.radiance.mean()
    assert probe.merged.dark[410:450, 310:490].mean() > 0.5


@pytest.mark.parametrize("colour", [(8.0, 1.0, 1.0), (1.0, 1.0, 8.0), (5.0, 5.0, 1.0)])
def test_one_clipped_channel_does_not_paint_a_lamp(
    colour: tuple[float, float, float], tmp_path: Path
) -> None:
    """A warm lamp stays at its hue or goes towards white; it never turns to another hue."""
    shape = (256, 512)
    radiance = np.full((*shape, 3), 50.0, np.float32)
    place = sphere.directions(shape) @ sphere.direction(40.0, 20.0) > np.cos(np.radians(8.0))
    lamp = np.array(colour) / np.max(colour)
    shots = [Exposure(t, 100.0, 2.0) for t in (0.02, 0.005, 0.00125)]
    top = saturation_cd_m2(shots[-1])
    radiance[place] = 3.0 * top * lamp
    probe = merged(write_bracket(tmp_path, radiance, THETA_V, shots, seed=5))
    inside = probe.merged.radiance[place]
    assert probe.merged.clipped[place].mean() > 0.9
    share = inside / inside.max(axis=1, keepdims=True)
    # Between its own hue and white: no channel falls under its true share.
    assert (np.median(share, axis=0) >= lamp - 0.02).all()
    assert np.abs(np.median(share[:, lamp == 1.0], axis=0) - 1.0).max() < 0.02


def test_a_rotated_frame_is_laid_on_the_others(tmp_path: Path) -> None:
    """One frame rotated by 3, 2 and 1 degrees: less than 0.3 degrees left."""
    turn = sphere.rotation(3.0, 2.0, 1.0)
    files = shoot(
        tmp_path, light("interior"), shape=(1024, 2048), smooth=True, shifts=[None, turn, None]
    )
    probe = merged(files)
    found = [a.rotation for a in probe.alignments if a.rotation is not None]
    assert len(found) == 1
    assert sphere.angle_of(found[0] @ np.linalg.inv(turn)) < 0.3 or (
        sphere.angle_of(found[0] @ turn) < 0.3
    )


def test_frames_that_lie_on_each_other_are_left_alone(tmp_path: Path) -> None:
    probe = merged(shoot(tmp_path, light("courtyard")))
    assert all(a.rotation is None for a in probe.alignments)
    assert probe.motion.share == 0.0
    assert probe.response.response.name == "sRGB"
    assert probe.warnings == ()


def test_a_frame_that_is_cut_off_is_left_out_and_named(tmp_path: Path) -> None:
    files = shoot(tmp_path, light("interior"))
    files[1].write_bytes(files[1].read_bytes()[: files[1].stat().st_size // 2])
    probe = merged(files)
    assert len(probe.bracket.frames) == 2
    assert any(files[1].name in warning for warning in sentences(probe.warnings))
    assert np.median(errors(probe, light("interior"))) < 0.02


def test_two_frames_of_which_one_is_cut_off_are_refused(tmp_path: Path) -> None:
    files = shoot(tmp_path, light("interior"))[:2]
    files[1].write_bytes(files[1].read_bytes()[: files[1].stat().st_size // 2])
    with pytest.raises(ProbeError, match=files[1].name):
        merged(files)


@pytest.mark.parametrize("wrong", [0, 1, 2])
def test_an_exposure_that_lies_is_found_out(wrong: int, tmp_path: Path) -> None:
    """One tag off by a stop: said, corrected from the pixels, and the light still right."""
    edits: list[Any] = [None, None, None]
    edits[wrong] = lambda tags: replace(tags, iso=tags.iso * 2)
    files = shoot(tmp_path, light("interior"), edits=edits)
    probe = merged(files)
    assert any(files[wrong].name in warning for warning in sentences(probe.warnings))
    ratio = ratios(probe, light("interior"))
    found = np.abs(ratio / np.median(ratio) - 1.0)
    assert np.median(found) <= 0.02
    assert np.percentile(found, 95) <= 0.06


@pytest.mark.parametrize("tilt", [XmpPose(-29.0, 0.0), XmpPose(0.0, 40.0), XmpPose(-29.0, -35.8)])
def test_a_tilt_is_undone(tilt: XmpPose, tmp_path: Path) -> None:
    """A lamp at a known place is back there within 0.3 degrees after levelling."""
    shape = (512, 1024)
    radiance = np.full((*shape, 3), 50.0, np.float32)
    place = sphere.directions(shape) @ sphere.direction(50.0, 25.0) > np.cos(np.radians(3.0))
    radiance[place] = 400.0
    shots = [Exposure(t, 100.0, 2.0) for t in (0.02, 0.005)]
    files = write_bracket(tmp_path, radiance, THETA_S, shots, seed=5, tilt=tilt)
    lamp = merged(files).finished.lights[0]
    away = sphere.direction(lamp.azimuth_deg, lamp.elevation_deg) @ sphere.direction(50.0, 25.0)
    assert np.degrees(np.arccos(np.minimum(away, 1.0))) < 0.3


@pytest.mark.usefixtures("best_turns")
def test_a_lamp_on_the_right_gives_the_turn_of_split(tmp_path: Path) -> None:
    """A lamp at +90 in the bracket: left split at 180, right split at 0, as in the panorama."""
    shape = (256, 512)
    radiance = np.full((*shape, 3), 2.0, np.float32)
    place = sphere.directions(shape) @ sphere.direction(90.0, 10.0) > np.cos(np.radians(6.0))
    radiance[place] = 2000.0
    shots = [Exposure(t, 100.0, 2.0) for t in (0.1, 0.01, 0.001, 0.0002)]
    probe = merged(write_bracket(tmp_path, radiance, THETA_V, shots, seed=5))
    grey = luminance(reduce_radiance(probe.merged.radiance))
    turns = {r.name: r.turn_refined_deg for r in solve_all(pack(), grey)}
    assert abs(difference(turns["left-split"], 180.0)) < 4.5
    assert abs(difference(turns["right-split"], 0.0)) < 4.5


def test_somebody_who_walked_does_not_change_the_turns(tmp_path: Path) -> None:
    """A person 10 degrees further in each frame: at most 2 % of a curve's range is given up."""
    scenes = [with_person(light("interior"), azimuth)[0] for azimuth in (60.0, 70.0, 80.0)]
    shots = exposures(light("interior"))
    probe = merged(write_bracket(tmp_path, scenes, THETA_V, shots, seed=5))
    held = choose(pack(), luminance(reduce_radiance(probe.merged.radiance)))
    still = [
        merged(write_bracket(_fresh(tmp_path, k), scene, THETA_V, shots, seed=5))
        for k, scene in enumerate(scenes)
    ]
    lost = [
        given_up(choose(pack(), luminance(reduce_radiance(each.merged.radiance))), held.turns)
        for each in still
    ]
    assert np.min(lost, axis=0).max() <= 0.02


def _fresh(folder: Path, number: int) -> Path:
    place = folder / str(number)
    place.mkdir()
    return place
