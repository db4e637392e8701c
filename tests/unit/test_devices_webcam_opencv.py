"""Real webcams through OpenCV, with a device that does what one is told."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import pytest

from app.devices.clock import VirtualClock
from app.devices.webcam import OpenCvWebcam, WebcamError, list_webcams
from app.devices.webcam import opencv as module
from app.devices.webcam.opencv import SIZE, _probe_indices


class Plug:
    """What `cv2.VideoCapture` would be."""

    def __init__(self, *given: object, opens: bool = True) -> None:
        self.given = list(given)
        self.opens = opens
        self.released = 0
        self.was_set: list[tuple[int, float]] = []

    def isOpened(self) -> bool:
        return self.opens

    def read(self) -> tuple[bool, Any]:
        what = self.given.pop(0) if self.given else None
        if isinstance(what, Exception):
            raise what
        return what is not None, what

    def set(self, propId: int, value: float) -> bool:
        self.was_set.append((propId, value))
        return True

    def get(self, propId: int) -> float:
        return float(propId)

    def release(self) -> None:
        self.released += 1


def device(plug: Plug, there: bool | None = True) -> OpenCvWebcam:
    return OpenCvWebcam(0, VirtualClock(), capture=lambda _: plug, is_there=lambda _: there)


def code_of(source: OpenCvWebcam) -> str:
    with pytest.raises(WebcamError) as caught:
        source.connect()
    assert caught.value.hint
    return caught.value.code


def test_pictures_come_red_first() -> None:
    blue_first = np.zeros((48, 64, 3), np.uint8)
    blue_first[..., 2] = 200
    plug = Plug(blue_first, np.full((48, 64), 9, np.uint8), np.full((48, 64, 1), 9, np.uint8))
    source = device(plug)
    source.connect()
    first = source.read()
    assert first is not None
    assert (first[..., 0] == 200).all()
    assert (first[..., 2] == 0).all()
    for _ in range(2):
        grey = source.read()
        assert grey is not None
        assert grey.shape == (48, 64, 3)
    source.disconnect()
    source.disconnect()
    assert plug.released == 1


@pytest.mark.parametrize(
    "wrong",
    [
        np.zeros((48, 64, 3), np.float32),
        np.zeros((4, 4, 3), np.uint8),
        np.zeros((48, 64, 2), np.uint8),
        np.zeros((16, 9000, 3), np.uint8),
        np.zeros(10, np.uint8),
    ],
)
def test_what_is_no_picture_is_left_out(wrong: object) -> None:
    source = device(Plug(wrong))
    source.connect()
    assert source.read() is None


def test_no_camera_busy_and_unknown() -> None:
    assert code_of(device(Plug(), there=False)) == "no-webcam"
    busy = Plug(opens=False)
    assert code_of(device(busy)) == "busy"
    assert busy.released == 1
    assert code_of(device(Plug(opens=False), there=None)) == "no-webcam"


def test_a_driver_that_fails_while_it_opens() -> None:
    def fails(index: int) -> Plug:
        raise cv2.error(f"device {index}")

    assert (
        code_of(OpenCvWebcam(0, VirtualClock(), capture=fails, is_there=lambda _: True)) == "busy"
    )


def test_a_few_failed_reads_are_forgiven_and_many_are_not() -> None:
    fine = np.zeros((48, 64, 3), np.uint8)
    source = device(Plug(None, None, cv2.error("once"), fine))
    source.connect()
    assert [source.read() is None for _ in range(4)] == [True, True, True, False]
    assert [source.read() for _ in range(9)] == [None] * 9
    with pytest.raises(WebcamError) as caught:
        source.read()
    assert caught.value.code == "unplugged"


def test_a_device_that_is_gone_is_unplugged_at_once() -> None:
    there = [True, False]
    source = OpenCvWebcam(
        0, VirtualClock(), capture=lambda _: Plug(), is_there=lambda _: there.pop(0)
    )
    source.connect()
    with pytest.raises(WebcamError, match="disconnected"):
        source.read()
    source.disconnect()
    with pytest.raises(WebcamError, match="disconnected"):
        source.read()


@pytest.mark.parametrize(
    ("width", "size"), [(1280, None), (640, (640, 480)), (1920, (1920, 1080)), (77, None)]
)
def test_a_size_can_be_asked_for(width: int, size: tuple[int, int] | None) -> None:
    shot = np.random.default_rng(0).integers(0, 256, (48, 64, 3), np.uint8)
    plug = Plug(*[shot] * 3)
    webcam = OpenCvWebcam(0, VirtualClock(), capture=lambda _: plug, is_there=lambda _: True)
    webcam.ask_width(width)
    webcam.open()
    assert webcam.frames.get(120.0) is not None
    webcam.close(5.0)
    asked = [] if size is None else [(cv2.CAP_PROP_FRAME_WIDTH, size[0])]
    asked += [] if size is None else [(cv2.CAP_PROP_FRAME_HEIGHT, size[1])]
    assert plug.was_set[:2] == asked
    assert SIZE == (1280, 720)


def test_a_whole_webcam() -> None:
    shot = np.random.default_rng(0).integers(0, 256, (48, 64, 3), np.uint8)
    plug = Plug(*[shot] * 3)
    webcam = OpenCvWebcam(2, VirtualClock(), capture=lambda _: plug, is_there=lambda _: True)
    assert webcam.name == "Webcam 3"
    assert webcam.fov_deg is None
    webcam.open()
    frame = webcam.frames.get(120.0)
    webcam.close(5.0)
    assert frame is not None
    assert frame.picture.shape == (48, 64, 3)
    assert plug.released >= 1


def test_elsewhere_the_first_few_are_tried() -> None:
    plugs: dict[int, Plug] = {}

    def capture(index: int) -> Plug:
        if index == 3:
            raise cv2.error("none")
        plugs[index] = Plug(opens=index in (0, 2))
        return plugs[index]

    assert _probe_indices(capture) == (0, 2)
    assert all(plug.released == 1 for plug in plugs.values())


@pytest.mark.parametrize("system", ["linux", "darwin"])
def test_the_list_on_this_machine_is_a_list(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], system: str
) -> None:
    """Whatever is connected here; a device that cannot be opened prints nothing."""
    monkeypatch.setattr(module, "_SYSTEM", system)
    assert all(index >= 0 and name for index, name in list_webcams())
    assert capfd.readouterr().err == ""
