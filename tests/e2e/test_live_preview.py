"""The simulated camera's live preview over HTTP: numbered pictures, and an SC2 that ends them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import closing, contextmanager
from http.client import HTTPConnection

import numpy as np
import pytest

from app.devices.clock import Clock, SystemClock
from app.devices.mjpeg import MjpegParser, boundary_of, decode
from app.devices.simulated.camera import SimulatedCamera
from app.devices.simulated.scene import Scene
from app.devices.simulated.server import CameraServer
from tests.faulty_camera.camera import FaultyCamera
from tests.helpers.live_marks import read_number
from tests.helpers.scaled_clock import ScaledClock


@contextmanager
def preview(
    model: str, clock: Clock, make: type[SimulatedCamera] = SimulatedCamera
) -> Iterator[Iterator[bytes]]:
    """Open the preview of a served camera: its pictures, until the camera ends them."""
    light = np.random.default_rng(3).gamma(0.5, 100.0, (32, 64, 3)).astype(np.float32)
    camera = make(Scene(light), model, clock, shape=(64, 128))
    with closing(camera), CameraServer(camera, clock=clock) as server:
        connection = HTTPConnection("127.0.0.1", server.port, timeout=600)
        body = json.dumps({"name": "camera.getLivePreview"})
        connection.request("POST", "/osc/commands/execute", body)
        answer = connection.getresponse()
        assert answer.status == 200
        parser = MjpegParser(boundary_of(answer.headers["Content-Type"]))

        def pictures() -> Iterator[bytes]:
            while chunk := answer.read1(65536):
                yield from parser.feed(chunk)

        with closing(connection):
            yield pictures()


@pytest.mark.parametrize(
    ("model", "shape"), [("V", (512, 1024)), ("X", (512, 1024)), ("S", (320, 640))]
)
def test_numbered_pictures_arrive(model: str, shape: tuple[int, int]) -> None:
    with preview(model, SystemClock()) as pictures:
        for number in range(8):
            picture = decode(next(pictures))
            assert picture is not None
            assert picture.shape == (*shape, 3)
            assert read_number(picture) == number


def test_an_sc2_ends_its_preview() -> None:
    with preview("SC2", ScaledClock(20.0), FaultyCamera) as pictures:
        # Of three pieces a picture, 300 to 1500 pieces long.
        assert 90 <= len(list(pictures)) <= 501
