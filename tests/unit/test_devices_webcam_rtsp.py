"""RTSP: what is said of a camera that does not serve, and that nothing waits for ever.

What stands before the pictures is tried with a camera that knows one request; the pictures, and
standing still in the middle of them, with a small server of JPEG over RTP.
"""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
import time
from typing import Any, Final

import cv2
import numpy as np
import pytest

from app.core.base.imaging.video import OPEN_S, open_url
from app.devices.clock import SystemClock, VirtualClock
from app.devices.passwords import Credentials
from app.devices.webcam import WebcamError, WebcamState
from app.devices.webcam.network import RtspWebcam
from app.devices.webcam.network_connection import Address
from tests.helpers.live_server import Answer, LiveServer
from tests.helpers.rtsp_server import RtspServer
from tests.helpers.scaled_clock import ScaledClock
from tests.helpers.waiting import PATIENCE_S, until

KEYS: Final = Credentials("an/na", "pa@ss")


class Plug:
    """What `cv2.VideoCapture` would be."""

    def __init__(self, *given: object, opens: bool = True) -> None:
        self.given, self.opens, self.released = list(given), opens, 0

    def isOpened(self) -> bool:
        return self.opens

    def read(self) -> tuple[bool, Any]:
        what = self.given.pop(0) if self.given else None
        if isinstance(what, Exception):
            raise what
        return what is not None, what

    def set(self, propId: int, value: float) -> bool:
        return propId >= 0 and value >= 0

    def get(self, propId: int) -> float:
        return float(propId)

    def release(self) -> None:
        self.released += 1


def said(status: str) -> Answer:
    return lambda c, _: c.sendall(f"RTSP/1.0 {status}\r\nCSeq: 1\r\n\r\n".encode())


def opened(server: LiveServer, plug: Plug, keys: Credentials | None = None) -> list[str]:
    """Open a stream and give the URLs that FFmpeg was asked for."""
    asked: list[str] = []

    def make(url: str) -> Plug:
        asked.append(url)
        return plug

    address = Address.parse(server.url("/live", "rtsp"))
    source = RtspWebcam(address, SystemClock(), keys=lambda: keys, capture=make)
    source.connect()
    source.disconnect()
    source.disconnect()
    return asked


def test_it_is_described_first_and_then_opened() -> None:
    plug = Plug()
    with LiveServer(said("200 OK")) as server:
        assert opened(server, plug) == [server.url("/live", "rtsp")]
    assert plug.released == 1
    request = server.requests[0]
    assert request.startswith(f"DESCRIBE rtsp://127.0.0.1:{server.port}/live RTSP/1.0".encode())


def test_the_password_goes_to_ffmpeg_alone() -> None:
    with LiveServer(said("401 Unauthorized")) as server:
        urls = opened(server, Plug(), KEYS)
        assert urls == [f"rtsp://an%2Fna:pa%40ss@127.0.0.1:{server.port}/live"]
        with pytest.raises(WebcamError) as caught:
            opened(server, Plug(), None)
        assert caught.value.code == "password"
        with pytest.raises(WebcamError) as caught:
            opened(server, Plug(opens=False), KEYS)
        assert caught.value.code == "password-refused"
        assert KEYS.password not in str(caught.value)
    assert not any(b"pa%40ss" in request for request in server.requests)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (said("404 Not Found"), "no stream at this address"),
        (said("302 Moved"), "redirects to another"),
        (said("454 Session Not Found"), "error 454"),
        (lambda c, _: c.sendall(b"HTTP/1.1 200 OK\r\n\r\n"), "is not an RTSP camera"),
        (lambda c, _: c.sendall(b"x" * 100_000), "is not an RTSP camera"),
        (lambda c, _: None, "is not an RTSP camera"),
    ],
)
def test_what_is_no_stream_is_said(answer: Answer, words: str) -> None:
    with LiveServer(answer) as server, pytest.raises(WebcamError, match=words) as caught:
        opened(server, Plug())
    assert caught.value.code == "not-a-stream"
    assert caught.value.hint


def test_one_that_ffmpeg_cannot_open() -> None:
    with LiveServer(said("200 OK")) as server:
        with pytest.raises(WebcamError, match="cannot be opened"):
            opened(server, Plug(opens=False))

        def fails(url: str) -> Plug:
            raise cv2.error(url)

        source = RtspWebcam(Address.parse(server.url("/", "rtsp")), SystemClock(), capture=fails)
        with pytest.raises(WebcamError, match="cannot be opened"):
            source.connect()


def test_one_that_says_nothing_is_given_up() -> None:
    """Ten times as fast, so that the limit of 5 s is half a second here."""

    def silent(_connection: socket.socket, _request: bytes) -> None:
        if not server.wait(PATIENCE_S):
            waits.append(True)

    waits: list[bool] = []
    with LiveServer(silent) as server:
        address = Address.parse(server.url("/", "rtsp"))
        source = RtspWebcam(address, ScaledClock(10.0), capture=lambda _: Plug())
        with pytest.raises(WebcamError, match="does not answer"):
            source.connect()
        assert not waits, "it ends before the camera hangs up"


@pytest.mark.slow
def test_ffmpeg_gives_a_silent_camera_up(capfd: pytest.CaptureFixture[str]) -> None:
    """Its own limit, in real time; nothing of the address is written to the terminal."""
    with socket.create_server(("127.0.0.1", 0)) as silent:
        began = time.monotonic()
        capture = open_url(f"rtsp://anna:geheim@127.0.0.1:{silent.getsockname()[1]}/live")
        took = time.monotonic() - began
    assert not capture.isOpened()
    assert took < OPEN_S + 4.0
    shown = capfd.readouterr()
    assert "geheim" not in shown.out + shown.err


@pytest.mark.slow
def test_a_camera_that_stands_still_for_some_seconds_is_not_hung_up_on() -> None:
    """It serves one client, and might not let the next one in."""
    with RtspServer(stalls=3.5) as server:
        webcam = RtspWebcam(Address.parse(server.url), SystemClock())
        webcam.open()
        end = time.monotonic() + 30.0
        lost = False
        while webcam.count < 40:
            assert time.monotonic() < end
            lost |= webcam.count >= 30 and webcam.state is WebcamState.LOST
            time.sleep(0.05)
        assert lost  # It is shown as what it is meanwhile.
        webcam.close(10.0)
        assert server.played == 1


LEAVING = """
import sys, time
from app.devices.clock import SystemClock
from app.core.base.imaging import video
from app.devices.webcam import network
from app.devices.webcam.network_connection import Address
video.READ_S = 1.0
webcam = network.RtspWebcam(Address.parse(sys.argv[1]), SystemClock())
webcam.open()
end = time.monotonic() + 30.0
while webcam.count < 30 and time.monotonic() < end:
    time.sleep(0.01)
time.sleep(float(sys.argv[2]))
"""


@pytest.mark.slow
@pytest.mark.parametrize("wait_s", ["0.5", "0.9", "1.0"])
def test_the_program_can_end_while_the_camera_is_frozen(wait_s: str) -> None:
    """FFmpeg's read came back into an interpreter that was gone, and aborted it."""
    with RtspServer(stalls=60.0) as server:
        ended = subprocess.run(
            [sys.executable, "-c", LEAVING, server.url, wait_s],
            capture_output=True,
            timeout=600,
            check=False,
        )
    assert (ended.returncode, ended.stderr) == (0, b"")


def test_pictures_and_their_end() -> None:
    shot = np.random.default_rng(0).integers(40, 256, (96, 128, 3), np.uint8)
    plug = Plug(shot, None, shot, cv2.error("broken"), None, None)
    source = RtspWebcam(
        Address.parse("rtsp://cam/"), VirtualClock(), width=64, capture=lambda _: plug
    )
    with pytest.raises(WebcamError, match="disconnected"):
        source.read()
    source.begin("rtsp://cam/")
    first = source.read()
    assert first is not None
    assert first.shape == (48, 64, 3)
    assert source.read() is None
    assert source.read() is not None
    assert [source.read() for _ in range(2)] == [None, None]
    with pytest.raises(WebcamError) as caught:
        source.read()
    assert caught.value.code == "unplugged"


def test_a_whole_webcam_that_drops_and_returns() -> None:
    shots = [np.random.default_rng(n).integers(40, 256, (48, 64, 3), np.uint8) for n in range(4)]
    plugs = [Plug(*shots[:2]), Plug(*shots[2:])]
    with LiveServer(said("200 OK")) as server:
        webcam = RtspWebcam(
            Address.parse(server.url("/live", "rtsp")),
            ScaledClock(20.0),
            capture=lambda _: plugs.pop(0) if plugs else Plug(opens=False),
        )
        assert webcam.name == f"Network camera 127.0.0.1:{server.port}"
        webcam.open()
        until(lambda: webcam.count >= 4)
        until(lambda: webcam.state is not WebcamState.LIVE)
        webcam.close(PATIENCE_S)
    assert not [t for t in threading.enumerate() if t.name == "webcam"]
