"""Brackets: metering, frames in memory and as files, people who walk through."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from app.core.base import sphere
from app.core.base.colour import srgb_encode
from app.core.base.errors import CoreError
from app.core.base.paths import resources
from app.core.environment.environment import read_environment, solid_angles
from app.core.measure.read.frame import Exposure, XmpPose
from app.core.measure.read.metadata import read_header
from app.devices.simulated.cameras import GENERIC, THETA_S, THETA_V
from app.devices.simulated.optics import meter
from benchmarks.light.shots.brackets import develop, make_bracket, write_bracket
from tests.helpers.people import mean_luminance, with_person

BRACKET = [Exposure(t, 100.0, 2.0) for t in (1.0 / 60.0, 1.0 / 15.0, 1.0 / 250.0)]


def _picture(data: bytes) -> np.ndarray:
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    return np.asarray(picture[..., ::-1]).astype(float)


def _room() -> np.ndarray:
    return read_environment(resources() / "demo" / "scenes" / "interior.exr").radiance[::4, ::4]


@pytest.mark.parametrize("name", ["interior", "sunset", "night"])
@pytest.mark.parametrize("scale", [1.0, 2500.0])
def test_metered_frames_are_of_middle_brightness(name: str, scale: float) -> None:
    place = read_environment(resources() / "demo" / "scenes" / f"{name}.exr").radiance
    exposure = meter(place, THETA_V, scale=scale)
    assert exposure.iso == 64.0
    assert exposure.aperture == 2.0
    coded = develop(place, THETA_V, exposure, scale=scale, noise=False) / 255.0
    weights = np.broadcast_to(solid_angles((512, 1024))[:, None, None], coded.shape)
    assert np.average(coded, weights=weights) == pytest.approx(0.46, abs=0.01)
    twice = meter(place, THETA_V, scale=2.0 * scale)
    assert twice.shutter_s == pytest.approx(0.5 * exposure.shutter_s, rel=1e-6)


def test_metering_against_the_formula() -> None:
    """A uniform place of 100 cd/m2: sRGB 0.46 is 0.1793 of saturation, 78 N^2 / (q t S)."""
    exposure = meter(np.ones((16, 32, 3), np.float32), GENERIC, scale=100.0)
    share = 100.0 * exposure.factor / 1.2
    assert float(srgb_encode(share)) == pytest.approx(0.46, abs=1e-3)


def test_files_are_named_stamped_and_readable(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "100RICOH"
    paths = write_bracket(folder, _room(), THETA_S, BRACKET, first=21, tilt=XmpPose(4.0, -3.0))
    assert [path.name for path in paths] == ["R0010021.JPG", "R0010022.JPG", "R0010023.JPG"]
    assert sorted(folder.iterdir()) == paths
    frames = [read_header(path).frame for path in paths]
    for frame, wanted in zip(frames, BRACKET, strict=True):
        assert frame.exposure is not None
        assert frame.exposure.ev == pytest.approx(wanted.ev, abs=1e-4)
        assert frame.pose == XmpPose(4.0, -3.0)
    stamps = [b"2026:06:21 12:00:00", b"2026:06:21 12:00:04", b"2026:06:21 12:00:08"]
    for path, stamp in zip(paths, stamps, strict=True):
        assert path.read_bytes().count(stamp) == 3


def test_a_folder_that_is_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "R0010001.JPG").mkdir()
    with pytest.raises(CoreError, match="folder"):
        write_bracket(tmp_path, _room(), THETA_S, BRACKET)


def test_frames_follow_their_exposures() -> None:
    data = make_bracket(_room(), THETA_S, BRACKET, scale=5.0, noise=False)
    means = [_picture(frame).mean() for frame in data]
    assert means[1] > means[0] > means[2]
    again = make_bracket(_room(), THETA_S, BRACKET, scale=5.0, noise=False)
    assert data == again


def test_noise_differs_between_frames_of_one_exposure() -> None:
    flat = np.full((64, 128, 3), 50.0, dtype=np.float32)
    first, second = make_bracket(flat, THETA_S, BRACKET[:1] * 2, seed=5)
    one, other = (_picture(frame) - _picture(frame).mean() for frame in (first, second))
    assert abs((one * other).mean()) < 0.1 * one.var()
    assert make_bracket(flat, THETA_S, BRACKET[:1] * 2, seed=5) == [first, second]


def test_shifts_and_edits_of_single_frames(tmp_path: Path) -> None:
    shift = sphere.rotation(3.0, 2.0, 1.0)
    options: dict[str, Any] = {"smooth": True, "shape": (256, 512), "scale": 5.0, "noise": False}
    plain = make_bracket(_room(), THETA_S, BRACKET, **options)
    data = make_bracket(
        _room(),
        THETA_S,
        BRACKET,
        shifts=[None, shift, None],
        edits=[None, None, lambda tags: replace(tags, iso=200.0)],
        **options,
    )
    assert data[0] == plain[0]
    np.testing.assert_array_equal(_picture(data[2]), _picture(plain[2]))
    path = tmp_path / "a.jpg"
    path.write_bytes(data[2])
    exposure = read_header(path).frame.exposure
    assert exposure is not None
    assert exposure.iso == 200.0
    moved = np.abs(_picture(data[1]) - _picture(plain[1])).mean()
    back = np.asarray(sphere.remap_frame(_picture(data[1]), shift))
    assert np.abs(back - _picture(plain[1])).mean() < 0.5 * moved


def test_lists_must_match() -> None:
    with pytest.raises(ValueError, match="3 exposures"):
        make_bracket(_room(), THETA_S, BRACKET, shifts=[None])
    with pytest.raises(ValueError, match="3 exposures"):
        make_bracket([_room()] * 2, THETA_S, BRACKET)


def test_a_person_walks_by_ten_degrees() -> None:
    room = _room()
    places, masks = zip(*(with_person(room, azimuth) for azimuth in (20.0, 30.0)), strict=True)
    assert room.max() == _room().max()
    azimuth = 360.0 * ((np.arange(256) + 0.5) / 256 - 0.5)
    for mask, wanted in zip(masks, (20.0, 30.0), strict=True):
        assert np.average(azimuth, weights=mask.sum(axis=0)) == pytest.approx(wanted, abs=0.5)
    data = make_bracket(list(places), GENERIC, BRACKET[:2], scale=5.0, noise=False)
    neither = ~(masks[0] | masks[1])
    clean = make_bracket(room, GENERIC, BRACKET[:2], scale=5.0, noise=False)
    wide = cv2.dilate((~neither).astype(np.uint8), np.ones((33, 33), np.uint8)) == 0
    for one, other in zip(data, clean, strict=True):
        np.testing.assert_array_equal(_picture(one)[wide], _picture(other)[wide])


def test_a_person_is_as_large_as_geometry_says() -> None:
    _, mask = with_person(
        np.ones((512, 1024, 3), np.float32), 0.0, distance_m=3.0, height_m=1.8, camera_m=1.5
    )
    rows = np.nonzero(mask.any(axis=1))[0]
    elevation = 90.0 - 180.0 * (rows[[0, -1]] + 0.5) / 512
    # The crown of a ball 0.12 m wide 0.3 - 0.12 m up; feet 1.5 m down, rounded by 0.23 m.
    crown = np.degrees(np.arctan2(0.18, 3.0) + np.arcsin(0.12 / np.hypot(3.0, 0.18)))
    feet = -np.degrees(np.arctan2(1.27, 3.0) + np.arcsin(0.23 / np.hypot(3.0, 1.27)))
    np.testing.assert_allclose(elevation, [crown, feet], atol=0.4)
    width = mask.sum(axis=1).max() * 360.0 / 1024
    assert width == pytest.approx(2.0 * np.degrees(np.arcsin(0.23 / 3.0)), rel=0.12)


def test_a_persons_colour_is_given() -> None:
    room = _room()
    placed, mask = with_person(room, -60.0, reflectance=(0.1, 0.2, 0.3))
    wanted = mean_luminance(np.ascontiguousarray(room)) * np.array([0.1, 0.2, 0.3])
    np.testing.assert_allclose(placed[mask], np.broadcast_to(wanted, placed[mask].shape), rtol=1e-5)
    np.testing.assert_array_equal(placed[~mask], room[~mask])
    with pytest.raises(ValueError, match="cannot stand"):
        with_person(room, 0.0, distance_m=0.3)
