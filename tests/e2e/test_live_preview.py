"""The whole way of a preview: simulated camera, HTTP, client, parser, mailbox, decoded picture."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable

import numpy as np
import pytest

from app.devices.clock import Clock, SystemClock
from app.devices.errors import PasswordNeeded
from app.devices.mailbox import Mailbox
from app.devices.profiles import profile_named
from app.devices.simulated.camera import SimulatedCamera
from app.devices.simulated.preview import LOOP, read_number
from app.devices.simulated.scene import Scene
from app.devices.simulated.server import CameraServer
from app.devices.theta.client import OscClient
from app.devices.theta.endpoint import Endpoint
from app.devices.theta.link import Credentials, Incoming, Link, Timeouts
from app.devices.theta.preview import (
    LOST_S,
    PreviewFrame,
    PreviewState,
    PreviewStream,
    decode,
    opened_preview,
)
from tests.helpers.scaled_clock import ScaledClock

SHAPE = (64, 128)


class Rig:
    """A served camera, a client for commands, and a preview over a connection of its own."""

    def __init__(self, model: str, clock: Clock, password: str = "", said: str = "") -> None:
        light = np.random.default_rng(3).gamma(0.5, 100.0, (32, 64, 3)).astype(np.float32)
        self.camera = SimulatedCamera(
            Scene(light), model, clock, shape=SHAPE, user="me", password=password
        )
        self.server = CameraServer(self.camera, clock=clock)
        keys = Credentials("me", said or password) if password else None
        endpoint = Endpoint.parse(self.server.url)
        self.links = [
            Link(endpoint, clock, keys, timeouts=Timeouts(idle_s=LOST_S)) for _ in range(2)
        ]
        self.client, self.viewer = (OscClient(link, clock) for link in self.links)
        self.box: Mailbox[PreviewFrame] = Mailbox()
        self.stream = PreviewStream(self._open, self.box, clock, self.links[1].close)

    def _open(self) -> contextlib.AbstractContextManager[Incoming]:
        return opened_preview(self.viewer, profile_named(self.camera.personality.name))

    def __enter__(self) -> Rig:
        self.server.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stream.stop()
        for link in self.links:
            link.close()
        self.server.stop()
        self.camera.close()


def until(condition: Callable[[], bool], seconds: float = 20.0) -> bool:
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.005)
    return condition()


@pytest.mark.parametrize(
    ("model", "password", "shape"),
    [("V", "", (512, 1024)), ("X", "12345678", (512, 1024)), ("S", "", (320, 640))],
)
def test_numbered_pictures_arrive(model: str, password: str, shape: tuple[int, int]) -> None:
    with Rig(model, SystemClock(), password) as rig:
        rig.stream.start()
        numbers: list[int | None] = []
        while len(numbers) < 8:
            frame = rig.box.get(20.0)
            assert frame is not None, rig.stream.error
            picture = decode(frame)
            assert picture.shape == (*shape, 3)
            numbers.append(read_number(picture))
        assert None not in numbers
        assert 0 < rig.stream.fps <= 31


def test_stopped_for_a_picture_and_back_again() -> None:
    # An SC refuses its preview for a while after each picture.
    clock = ScaledClock(10.0)
    with Rig("SC", clock) as rig:
        rig.stream.start()
        assert until(lambda: rig.stream.state is PreviewState.LIVE)
        rig.stream.stop()
        assert until(lambda: rig.camera.preview.body is None)
        clock.sleep(1.5)
        taken = rig.client.take_picture()
        # As Ricoh's examples have it, only the first reply carries the id.
        number = str(taken.id)
        while taken.state == "inProgress":
            clock.sleep(0.5)
            taken = rig.client.status(number)
        count = rig.stream.count
        rig.stream.start()
        assert until(lambda: rig.stream.count > count + 3)
        assert rig.camera.stored_files


def test_an_sc2_that_ends_its_preview_is_asked_again() -> None:
    with Rig("SC2", ScaledClock(20.0)) as rig:
        rig.stream.start()
        first = rig.camera.preview
        assert until(lambda: first.body is not None)
        body = first.body
        assert until(lambda: first.body not in (None, body)), rig.stream.error
        count = rig.stream.count
        assert until(lambda: rig.stream.count > count + LOOP)


def test_a_wrong_password_is_said() -> None:
    with Rig("V", SystemClock(), "right-one", "wrong-one") as rig:
        rig.stream.start()
        assert until(lambda: rig.stream.state is PreviewState.FAILED)
        assert isinstance(rig.stream.error, PasswordNeeded)


def test_a_camera_that_goes_away_and_comes_back() -> None:
    with Rig("V", ScaledClock(5.0)) as rig:
        rig.stream.start()
        assert until(lambda: rig.stream.state is PreviewState.LIVE)
        port = rig.server.port
        rig.server.stop()
        assert until(lambda: rig.stream.state is PreviewState.LOST)
        assert rig.stream.error is not None
        rig.server = CameraServer(rig.camera, port, clock=ScaledClock(5.0))
        rig.server.start()
        assert until(lambda: rig.stream.state is PreviewState.LIVE), rig.stream.error


@pytest.mark.parametrize(("model", "size"), [("S", (640, 320)), ("V", (1024, 512))])
def test_the_best_format_for_looking_is_chosen(model: str, size: tuple[int, int]) -> None:
    with Rig(model, ScaledClock(10.0)) as rig:
        if model == "V":
            rig.client.set_options(
                {"previewFormat": {"width": 640, "height": 320, "framerate": 30}}
            )
        rig.stream.start()
        frame = rig.box.get(10.0)
        assert frame is not None
        picture = decode(frame)
        assert (picture.shape[1], picture.shape[0]) == size
