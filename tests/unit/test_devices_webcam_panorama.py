"""A webcam inside a panorama: it points where it is pointed."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.localization.views import Lens, look
from app.devices.clock import VirtualClock
from app.devices.webcam import PanoramaWebcam, WebcamError, WebcamState
from app.devices.webcam.simulated import PANORAMA_FPS
from tests.helpers.demo_place import demo_panorama
from tests.helpers.fragile_webcam import FragilePanorama
from tests.helpers.scaled_clock import ScaledClock
from tests.helpers.waiting import PATIENCE_S, until

Bytes = NDArray[np.uint8]
SIZE: Final = (320, 180)


@pytest.fixture(scope="module")
def panorama() -> Bytes:
    return np.asarray(cv2.resize(demo_panorama(), (1024, 512)), np.uint8)


def scene(panorama: Bytes | Path) -> FragilePanorama:
    made = FragilePanorama(panorama, VirtualClock(), size=SIZE)
    made.connect()
    return made


def test_it_shows_the_view_it_is_pointed_at(panorama: Bytes) -> None:
    made = scene(panorama)
    made.point(75.0)
    picture = made.read()
    assert picture is not None
    np.testing.assert_array_equal(picture, look(panorama, 75.0, Lens(60.0, SIZE)))
    assert made.read() is picture, "the same view is the same array"


def test_headings_and_turns() -> None:
    webcam = PanoramaWebcam(np.zeros((64, 128, 3), np.uint8), VirtualClock(), fov_deg=55.0)
    assert webcam.fov_deg == 55.0
    webcam.set_turn(455.0)
    assert webcam.turn_deg == 95.0
    assert webcam.heading_deg == -85.0
    webcam.point(190.0)
    assert webcam.heading_deg == -170.0


def test_it_keeps_its_pace(panorama: Bytes) -> None:
    made = scene(panorama)
    start = made._clock.now()
    for _ in range(round(PANORAMA_FPS)):
        made.read()
    assert made._clock.now() - start == pytest.approx(1.0)


def test_a_file_unplugged_and_plugged_in() -> None:
    from app.core.base.paths import resources

    path = resources() / "demo" / "location" / "probe-1.exr"
    webcam = FragilePanorama(path, ScaledClock(10.0), size=SIZE)
    webcam.open()
    frame = webcam.frames.get(PATIENCE_S)
    assert frame is not None
    assert frame.picture.shape == (180, 320, 3)
    webcam.plugged = False
    until(lambda: webcam.state is not WebcamState.LIVE)
    count = webcam.count
    webcam.plugged = True
    until(lambda: webcam.count > count)
    webcam.close(PATIENCE_S)


def test_what_is_not_a_panorama(tmp_path: Path) -> None:
    (tmp_path / "x.exr").write_bytes(b"no picture")
    for given in (tmp_path / "x.exr", tmp_path / "missing.exr", np.zeros((64, 64, 3), np.uint8)):
        with pytest.raises(WebcamError) as caught:
            scene(given)
        assert caught.value.code == "bad-file"
    unplugged = scene(np.zeros((64, 128, 3), np.uint8))
    unplugged.plugged = False
    with pytest.raises(WebcamError, match="No webcam"):
        unplugged.connect()
    with pytest.raises(WebcamError, match="disconnected"):
        unplugged.read()
