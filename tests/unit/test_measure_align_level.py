"""Levelling: what the pose means, when it is left alone, and that the scene stands upright."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import wrap
from app.core.base.colour import luminance, panorama_exposure, to_bytes, tone_map
from app.core.base.sphere import angle_of, direction, remap_frame, rotation
from app.core.environment.environment import read_environment
from app.core.measure.bracket.alignment.levelling import first_shot, levelling, tilt_rotation
from app.core.measure.read.frame import Bracket, Frame, XmpPose
from tests.helpers.shared import SHARED, needs_shared
from tests.helpers.verticals import edge_normals, leans_deg, tilt_deg

SCENES = Path(__file__).resolve().parents[2] / "resources/demo/scenes"
TILTS = [(-29.0, -35.8), (40.0, 0.0), (0.0, -40.0), (-25.0, 30.0), (40.0, 40.0), (12.0, -3.0)]


def _frame(
    name: str = "R0010001.JPG",
    pose: XmpPose | None = None,
    corrected: bool | None = None,
    camera: str = "RICOH THETA S",
    shape: tuple[int, int] = (64, 128),
) -> Frame:
    return Frame(Path(name), shape, pose=pose, zenith_corrected=corrected, camera=camera)


def _bracket(*frames: Frame) -> Bracket:
    return Bracket(frames, tuple(2.0 - k for k in range(len(frames))))


def _azimuth(vector: NDArray[np.float64]) -> float:
    return float(np.degrees(np.arctan2(-vector[0], vector[2])))


def _picture(name: str) -> NDArray[np.uint8]:
    light = np.array(read_environment(SCENES / f"{name}.exr").radiance)
    fine = np.asarray(cv2.resize(light, (2048, 1024)), np.float32)
    return to_bytes(tone_map(fine, panorama_exposure(luminance(fine))))


def _small(picture: NDArray[np.generic]) -> NDArray[np.uint8]:
    bytes_ = np.asarray(picture, np.uint8)
    return np.asarray(cv2.resize(bytes_, (672, 336), interpolation=cv2.INTER_AREA), np.uint8)


def _theta_tilt(up: NDArray[np.float64]) -> XmpPose:
    """What an accelerometer on each axis alone says of a zenith direction in the camera's axes."""
    return XmpPose(
        float(np.degrees(np.arctan(up[2] / up[1]))), float(np.degrees(np.arctan(up[0] / up[1])))
    )


def test_the_signs_of_the_standard() -> None:
    # Pitch: the centre of the picture is so far above the horizon.
    lifted = tilt_rotation(XmpPose(20.0, 0.0)) @ direction(0, 0)
    assert np.degrees(np.arcsin(lifted[1])) == pytest.approx(20.0)
    # Roll: the horizon turns counter-clockwise in the picture, so it is lower on the left.
    level = tilt_rotation(XmpPose(0.0, 20.0))
    left, right = level @ direction(-90, -20), level @ direction(90, 20)
    assert left[1] == pytest.approx(0.0, abs=1e-12)
    assert right[1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("gravity", [True, False])
@pytest.mark.parametrize(("pitch", "roll"), [*TILTS, (5.0, 170.0), (-89.0, 10.0)])
def test_the_front_lens_stays_at_azimuth_0(pitch: float, roll: float, gravity: bool) -> None:
    for heading in (None, 0.0, 225.0):
        matrix = tilt_rotation(XmpPose(pitch, roll, heading), gravity=gravity)
        assert np.allclose(matrix @ matrix.T, np.eye(3))
        assert _azimuth(matrix @ direction(0, 0)) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("pitch", "roll"), TILTS)
def test_a_theta_states_each_axis_of_its_accelerometer_alone(pitch: float, roll: float) -> None:
    truth = rotation(0.0, pitch, roll)
    pose = _theta_tilt(truth[1])
    found = levelling(_bracket(_frame(pose=pose)))
    assert found.rotation is not None
    assert angle_of(found.rotation @ truth.T) < 1e-6
    assert (found.pitch_deg, found.roll_deg) == (pose.pitch_deg, pose.roll_deg)
    assert found.remark is not None
    assert not found.remark.by_camera


@pytest.mark.parametrize(("pitch", "roll"), TILTS)
def test_other_cameras_follow_the_standard(pitch: float, roll: float) -> None:
    found = levelling(_bracket(_frame(pose=XmpPose(pitch, roll, 99.0), camera="GoPro Max")))
    assert found.rotation is not None
    assert np.allclose(found.rotation, rotation(0.0, pitch, roll))


@pytest.mark.slow
@pytest.mark.parametrize(("pitch", "roll"), [(-29.0, -35.8)])
@pytest.mark.parametrize("name", ["studio", "interior", "sunset"])
@pytest.mark.parametrize("camera", ["RICOH THETA V", "Insta360 ONE"])
def test_the_picture_decides_between_readings(
    name: str, pitch: float, roll: float, camera: str
) -> None:
    scene, pose = _picture(name), XmpPose(pitch, roll)
    for gravity in (True, False):
        truth = tilt_rotation(pose, gravity=gravity)
        seen = _small(remap_frame(scene, truth.T))
        found = levelling(_bracket(_frame(pose=pose, camera=camera)), picture=seen)
        assert found.rotation is not None
        assert angle_of(found.rotation @ truth.T) < 0.3


@pytest.mark.parametrize("name", ["forest", "night", "sunrise"])
def test_pictures_without_upright_edges_leave_it_to_the_maker(name: str) -> None:
    pose = XmpPose(-20.0, 25.0)
    truth = tilt_rotation(pose)
    seen = _small(remap_frame(_picture(name), truth.T))
    found = levelling(_bracket(_frame(pose=pose)), picture=seen)
    assert found.rotation is not None
    assert angle_of(found.rotation @ truth.T) < 0.3


def test_files_that_are_left_alone() -> None:
    assert levelling(_bracket(_frame())).rotation is None
    assert levelling(_bracket(_frame(pose=XmpPose(0.0, 0.0, 225.0)))) == levelling(
        _bracket(_frame())
    )
    assert levelling(_bracket(_frame(pose=XmpPose(0.0, 360.0)))).rotation is None
    flat = _frame(pose=XmpPose(5.0, 5.0), shape=(64, 96))
    assert levelling(_bracket(flat)).rotation is None
    wrong = levelling(_bracket(_frame(pose=XmpPose(7.0, -3.0), corrected=True)))
    assert wrong.rotation is None
    assert (wrong.pitch_deg, wrong.roll_deg) == (0.0, 0.0)
    assert wrong.remark is not None
    assert wrong.remark.by_camera
    tilted = _frame(pose=XmpPose(7.0, -3.0), corrected=False)
    assert levelling(_bracket(tilted)).rotation is not None


def test_one_tilt_for_all_frames_that_of_the_first_shot() -> None:
    frames = [
        _frame("img10.jpg", XmpPose(9.0, 9.0)),
        _frame("IMG9.JPG", XmpPose(1.0, 2.0)),
        _frame("IMG8.JPG"),
    ]
    assert first_shot(_bracket(*frames)) == 1
    assert levelling(_bracket(*frames)).pitch_deg == 1.0
    # Silent about the flag itself, but shot by a camera that levels.
    frames[0] = _frame("img10.jpg", XmpPose(0.0, 0.0), corrected=True)
    assert levelling(_bracket(*frames)).rotation is None


def test_the_first_shots_tilt_is_carried_over_to_the_reference_frame() -> None:
    pose, shift = XmpPose(-10.0, 20.0), rotation(3.0, 2.0, 1.0)
    plain = levelling(_bracket(_frame(pose=pose)))
    found = levelling(_bracket(_frame(pose=pose)), first_rotation=shift)
    assert plain.rotation is not None
    assert found.rotation is not None
    up_in_reference = shift @ plain.rotation.T @ direction(0, 90)
    assert np.allclose(found.rotation @ up_in_reference, direction(0, 90))
    assert _azimuth(found.rotation @ direction(0, 0)) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.slow
def test_the_measure_of_uprightness_sees_a_tilt() -> None:
    scene = _picture("studio")
    upright = tilt_deg(scene)
    assert upright < 1.5
    for angle in (4.0, -6.0):
        leaning = np.asarray(remap_frame(scene, rotation(0.0, 0.0, angle)), np.uint8)
        assert tilt_deg(leaning) == pytest.approx(abs(angle), abs=1.5)


@pytest.mark.slow
@needs_shared
def test_a_tilted_theta_picture_stands_upright() -> None:
    data = cv2.imread(str(SHARED / "theta/theta_s_tilted_R0010298.JPG"), cv2.IMREAD_COLOR)
    assert data is not None
    picture = np.ascontiguousarray(data[..., ::-1]).astype(np.uint8)
    pose = XmpPose(-29.0, -35.8, 225.0)
    frame = _frame(pose=pose, corrected=False, shape=(2688, 5376), camera="RICOH THETA S")
    for small in (None, _small(picture)):
        found = levelling(_bracket(frame), picture=small)
        assert found.rotation is not None
        assert wrap(_azimuth(found.rotation @ direction(0, 0))) == pytest.approx(0.0, abs=1e-6)
    assert found.rotation is not None
    level = remap_frame(picture, found.rotation)
    half = np.asarray(cv2.resize(level, (4096, 2048), interpolation=cv2.INTER_AREA), np.uint8)
    assert tilt_deg(half) < 1.5
    normals, lengths = edge_normals(half)
    lean, total = leans_deg(normals, lengths)
    assert lean < 1.5
    assert total > 1000.0  # degrees of edges
