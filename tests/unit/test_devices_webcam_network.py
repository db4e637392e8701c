"""Network cameras over http against a server on loopback, friendly and hostile."""

from __future__ import annotations

import base64
import itertools
import shutil
import socket
import ssl
import subprocess
import threading
import time
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from app.devices.clock import SystemClock
from app.devices.mjpeg import MAX_FRAME_BYTES
from app.devices.passwords import Credentials
from app.devices.simulated.exchange import Reply, Request
from app.devices.simulated.preview import PREVIEW_HEADERS, LivePicture, preview_pieces
from app.devices.simulated.server import CameraServer
from app.devices.webcam import WebcamError, WebcamState
from app.devices.webcam.network import MjpegWebcam
from app.devices.webcam.network_connection import Address, Wire, unreachable
from tests.helpers.live_server import Answer, LiveServer, head, jpegs, part, stream
from tests.helpers.scaled_clock import ScaledClock
from tests.helpers.waiting import PATIENCE_S, until

PICTURES: Final = jpegs(4)
KEYS: Final = Credentials("anna", "süß:1")


def source(server: LiveServer, path: str = "/video", width: int = 0) -> MjpegWebcam:
    return MjpegWebcam(Address.parse(server.url(path)), SystemClock(), width=width)


def said(status: str, kind: str = "", body: bytes = b"", **more: str) -> Answer:
    return lambda connection, _: connection.sendall(head(status, kind, **more) + body)


def error_of(answer: Answer, path: str = "/video") -> WebcamError:
    with LiveServer(answer) as server, pytest.raises(WebcamError) as caught:
        source(server, path).connect()
    assert caught.value.hint
    return caught.value


def test_pictures_come() -> None:
    with LiveServer(stream(PICTURES)) as server:
        webcam = MjpegWebcam(Address.parse(server.url()), SystemClock())
        assert webcam.fov_deg is None
        webcam.open()
        frame = webcam.frames.get(PATIENCE_S)
        until(lambda: webcam.count > 10)
        assert webcam.state is WebcamState.LIVE
        assert webcam.error is None
        webcam.close(PATIENCE_S)
    assert frame is not None
    assert frame.picture.shape == (48, 64, 3)
    assert webcam.name == f"Network camera 127.0.0.1:{server.port}"
    request = server.requests[0].decode()
    assert request.startswith("GET /video HTTP/1.1\r\n")
    assert f"\r\nHost: 127.0.0.1:{server.port}\r\n" in request


@pytest.mark.slow
def test_pictures_in_chunks_come_at_their_full_rate() -> None:
    """With every picture comes the end of a chunk, which is no reason to wait for the next one."""
    light = np.random.default_rng(3).gamma(0.5, 100.0, (64, 128, 3)).astype(np.float32)
    live = LivePicture(light, (512, 1024))

    class Camera:
        def answer(self, request: Request) -> Reply:
            del request
            return Reply(200, PREVIEW_HEADERS, preview_pieces(live, 30.0, SystemClock()))

    with CameraServer(Camera()) as server:
        webcam = MjpegWebcam(Address.parse(f"{server.url}/video"), SystemClock())
        webcam.open()
        until(lambda: webcam.count > 10)
        until(lambda: webcam.count > 40)
        webcam.close(PATIENCE_S)


def test_pictures_are_made_no_wider_than_is_wanted() -> None:
    with LiveServer(stream(jpegs(1, (480, 640)))) as server:
        wide = source(server, width=320)
        wide.connect()
        picture = wide.read()
        wide.disconnect()
    assert picture is not None
    assert picture.shape == (240, 320, 3)


def test_dropped_and_back_by_itself() -> None:
    """A phone that leaves the Wi-Fi and comes back; the pauses in between pass 20 times as fast."""
    refuse = said("503 Busy")
    with LiveServer(stream(PICTURES), refuse, refuse, stream(PICTURES)) as server:
        webcam = MjpegWebcam(Address.parse(server.url()), ScaledClock(20.0))
        webcam.open()
        until(lambda: webcam.count > 3)
        server.drop()
        until(lambda: webcam.state in (WebcamState.LOST, WebcamState.RETRYING))
        error = webcam.error
        assert error is not None
        assert error.code in ("unplugged", "not-a-stream")
        count = webcam.count
        until(lambda: webcam.count > count + 3)
        assert webcam.state is WebcamState.LIVE
        assert webcam.error is None
        webcam.close(PATIENCE_S)
    assert len(server.requests) == 4


@pytest.mark.slow
def test_silence_is_lost_and_closing_does_not_wait() -> None:
    waits: list[bool] = []

    def once(connection: socket.socket, _request: bytes) -> None:
        connection.sendall(head() + part(PICTURES[0]))
        if not server.wait(PATIENCE_S):
            waits.append(True)

    with LiveServer(once) as server:
        webcam = MjpegWebcam(Address.parse(server.url()), SystemClock())
        webcam.open()
        assert webcam.frames.get(PATIENCE_S) is not None
        webcam.close(PATIENCE_S)
        assert not waits, "a read that waits is ended before the camera speaks"
        webcam.open()
        until(lambda: webcam.state is WebcamState.LIVE)
        until(lambda: webcam.state is not WebcamState.LIVE)
        error = webcam.error
        assert error is not None
        assert "network camera" in error.message
        webcam.close(PATIENCE_S)
    assert not [t for t in threading.enumerate() if t.name == "webcam"]


def test_without_a_path_the_usual_ones_are_tried() -> None:
    page = said("200 OK", "text/html", b"<html>")
    with LiveServer(page, stream(PICTURES)) as server:
        found = source(server, "")
        found.connect()
        assert found.read() is not None
        found.disconnect()
    assert [r.split()[1] for r in server.requests] == [b"/", b"/video"]
    assert error_of(page, "").code == "not-a-stream"


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (said("302 Found", Location="http://10.0.0.1/"), "redirects to another"),
        (said("404 Not Found"), "no pictures at this address"),
        (said("500 Error"), "error 500"),
        (said("200 OK", "text/html", b"<html>"), "a web page instead of pictures"),
        (said("200 OK", "image/jpeg", PICTURES[0]), "does not send a stream"),
        (lambda c, _: c.sendall(b"SSH-2.0-OpenSSH_9.6\r\n"), "is not a camera"),
        (lambda c, _: c.sendall(b"\x00" * 5000), "is not a camera"),
        (lambda c, _: c.sendall(b"HTTP/1.1 200 OK\r\n" + b"X: y\r\n" * 5000), "is not a camera"),
        (lambda c, _: c.sendall(b"HTTP/1.1 200 OK\r\nX: " + b"y" * 200_000), "is not a camera"),
        (lambda c, _: None, "is not a camera"),
    ],
)
def test_what_is_no_stream_is_said(answer: Answer, words: str) -> None:
    assert words in error_of(answer).message


def test_a_redirection_is_not_followed() -> None:
    with LiveServer(stream(PICTURES)) as other:
        error_of(said("302 Found", Location=other.url()))
        assert other.requests == []


def test_an_endless_header_ends() -> None:
    """Dripping for ever; ten times as fast, so that the limit of 5 s is half a second here."""

    def drip(connection: socket.socket, _request: bytes) -> None:
        connection.sendall(b"HTTP/1.1 200 OK\r\nX-Drip: ")
        while not server.wait(0.02):
            connection.sendall(b"y")

    with LiveServer(drip) as server:
        slow = MjpegWebcam(Address.parse(server.url()), ScaledClock(10.0))
        with pytest.raises(WebcamError) as caught:
            slow.connect()
    assert caught.value.code == "unreachable"


def test_a_dripping_picture_ends() -> None:
    def drip(connection: socket.socket, _request: bytes) -> None:
        connection.sendall(head() + part(PICTURES[0])[:200])
        while not server.wait(0.01):
            connection.sendall(b"\x55")

    with LiveServer(drip) as server:
        slow = MjpegWebcam(Address.parse(server.url()), ScaledClock(10.0))
        slow.connect()
        with pytest.raises(WebcamError):
            slow.read()
        slow.disconnect()


@pytest.mark.parametrize("kind", ["garbage", "giant", "chunks"])
def test_floods_neither_fill_the_memory_nor_stop_it(kind: str) -> None:
    """However much comes, one read takes a bounded share of it and returns."""

    def flood(connection: socket.socket, _request: bytes) -> None:
        connection.sendall(head(Transfer_Encoding="chunked") if kind == "chunks" else head())
        if kind == "giant":
            size = MAX_FRAME_BYTES * 100
            connection.sendall(b"--frame0boundary\r\nContent-Length: %d\r\n\r\n" % size)
            connection.sendall(b"\xff\xd8\xff\xdb\x00\x10" + b"\x00" * 14)
        junk = np.random.default_rng(0).integers(0, 256, 1 << 16, np.uint8).tobytes()
        lead = b"10000\r\n" if kind == "chunks" else b""
        while not server.wait(0.0):
            connection.sendall(lead + junk + (b"\r\n" if lead else b""))

    with LiveServer(flood) as server:
        flooded = source(server)
        flooded.connect()
        for _ in range(2):
            try:
                assert flooded.read() is None
            except WebcamError:
                break
        assert len(flooded._parser._buffer) <= MAX_FRAME_BYTES + (1 << 20)
        flooded.disconnect()


def test_a_chunk_length_that_is_none() -> None:
    with LiveServer(said("200 OK", body=b"zz\r\n", Transfer_Encoding="chunked")) as server:
        broken = source(server)
        broken.connect()
        with pytest.raises(WebcamError) as caught:
            broken.read()
        assert caught.value.code == "unplugged"
        broken.disconnect()


def test_damaged_pictures_are_passed_over() -> None:
    cut = PICTURES[0][:300] + b"\xff\xd9"

    def answer(connection: socket.socket, _request: bytes) -> None:
        connection.sendall(head())
        for data in itertools.cycle([cut, PICTURES[1]]):
            connection.sendall(part(data))
            time.sleep(0.03)

    with LiveServer(answer) as server:
        webcam = MjpegWebcam(Address.parse(server.url()), SystemClock())
        webcam.open()
        until(lambda: webcam.count >= 3)
        assert webcam.state is WebcamState.LIVE
        webcam.close(PATIENCE_S)


def test_only_the_newest_picture_counts() -> None:
    """A burst that came while nobody read is passed over, but for its end."""
    many = jpegs(30)

    def burst(connection: socket.socket, _request: bytes) -> None:
        connection.sendall(head() + b"".join(part(data) for data in many))
        server.wait(PATIENCE_S)

    with LiveServer(burst) as server:
        late = source(server)
        late.connect()
        time.sleep(0.3)
        picture = late.read()
        late.disconnect()
    assert picture is not None
    last = np.random.default_rng(29).integers(30, 256, (48, 64, 3), np.uint8)
    first = np.random.default_rng(0).integers(30, 256, (48, 64, 3), np.uint8)
    assert np.abs(picture.astype(int) - last).mean() < np.abs(picture.astype(int) - first).mean()


def locked(kind: str) -> Answer:
    """Ask for a password, and stream to whoever gives the right one."""

    def answer(connection: socket.socket, request: bytes) -> None:
        right = base64.b64encode(f"{KEYS.user}:{KEYS.password}".encode())
        if (b"Authorization: Basic " + right) in request or (
            kind == "digest" and b'Authorization: Digest username="anna"' in request
        ):
            connection.sendall(head() + part(PICTURES[0]) * 5)
            return
        challenge = 'Digest realm="cam", nonce="a1", qop="auth"' if kind == "digest" else "Basic"
        connection.sendall(head("401 Unauthorized", "text/html", WWW_Authenticate=challenge))

    return answer


@pytest.mark.parametrize("kind", ["basic", "digest"])
def test_a_password_opens_it(kind: str) -> None:
    with LiveServer(locked(kind)) as server:
        address = Address.parse(server.url())
        opened = MjpegWebcam(address, SystemClock(), keys=lambda: KEYS)
        opened.connect()
        assert opened.read() is not None
        opened.disconnect()
        closed = MjpegWebcam(address, SystemClock())
        with pytest.raises(WebcamError) as caught:
            closed.connect()
        assert caught.value.code == "password"
    assert b"Authorization" not in server.requests[0], "none is sent unasked"


@pytest.mark.parametrize("kind", ["basic", "digest"])
def test_a_wrong_password_is_tried_once_and_then_waited_for(kind: str) -> None:
    challenge = 'Digest realm="cam", nonce="a1"' if kind == "digest" else 'Basic realm="cam"'
    with LiveServer(said("401 No", "text/html", WWW_Authenticate=challenge)) as server:
        clock = ScaledClock(50.0)
        webcam = MjpegWebcam(Address.parse(server.url()), clock, keys=lambda: KEYS)
        webcam.open()
        until(lambda: webcam.error is not None)
        error = webcam.error
        assert error is not None
        assert error.code == "password-refused"
        assert KEYS.password not in str(error)
        time.sleep(0.3)
        assert len(server.requests) == 2
        assert webcam.state is WebcamState.RETRYING
        webcam.close(PATIENCE_S)


def test_nobody_there() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    with pytest.raises(WebcamError) as caught:
        MjpegWebcam(Address.parse(f"127.0.0.1:{port}"), SystemClock()).connect()
    assert caught.value.code == "unreachable"
    assert "resumes automatically" in caught.value.hint


def test_https_at_a_camera_that_speaks_http() -> None:
    with LiveServer(stream(PICTURES)) as server, pytest.raises(WebcamError) as caught:
        MjpegWebcam(Address.parse(server.url(scheme="https")), SystemClock()).connect()
    assert caught.value.code == "unreachable"


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Make a certificate for 127.0.0.1 that nobody has signed, and its key."""
    openssl = shutil.which("openssl")
    if openssl is None:
        pytest.skip("no openssl to make a certificate with")
    folder = tmp_path_factory.mktemp("tls")
    own, key = folder / "own.pem", folder / "key.pem"
    made = subprocess.run(
        [
            openssl,
            "req",
            "-x509",
            "-newkey",
            "rsa:2048",
            "-nodes",
            "-days",
            "2",
            "-keyout",
            str(key),
            "-out",
            str(own),
            "-subj",
            "/CN=phone",
            "-addext",
            "subjectAltName=IP:127.0.0.1",
        ],
        capture_output=True,
        check=False,
    )
    if made.returncode:
        pytest.skip("this openssl makes no certificate")
    return own, key


def encrypted(certificate: tuple[Path, Path]) -> LiveServer:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(*certificate)
    return LiveServer(stream(jpegs(3, (480, 640))), context=context)


def test_https_with_a_certificate_that_is_trusted(
    certificate: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    trusting = ssl.create_default_context(cafile=str(certificate[0]))
    monkeypatch.setattr(ssl, "create_default_context", lambda: trusting)
    with encrypted(certificate) as server:
        webcam = MjpegWebcam(Address.parse(server.url(scheme="https")), SystemClock())
        webcam.open()
        until(lambda: webcam.count > 5)
        assert webcam.error is None
        webcam.close(PATIENCE_S)


def test_https_with_a_certificate_that_nobody_signed(certificate: tuple[Path, Path]) -> None:
    with encrypted(certificate) as server, pytest.raises(WebcamError) as caught:
        MjpegWebcam(Address.parse(server.url(scheme="https")), SystemClock()).connect()
    assert "not trusted" in caught.value.message
    assert server.requests == [], "nothing is sent to it"


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ssl.SSLCertVerificationError("self-signed"), "not trusted"),
        (ssl.SSLError("wrong version"), "does not support HTTPS"),
        (socket.gaierror("unknown"), "no device with this name"),
        (UnicodeError("label too long"), "no device with this name"),
        (TimeoutError(), "does not answer"),
    ],
)
def test_why_there_is_no_connection(error: Exception, words: str) -> None:
    assert words in unreachable(error).message


def test_a_request_cannot_be_split() -> None:
    with LiveServer(stream(PICTURES)) as server:
        wire = Wire(Address.parse(server.url()), SystemClock())
        with pytest.raises(OSError, match="not connected"):
            wire.send(["GET / HTTP/1.1"])
        wire.connect()
        with pytest.raises(ValueError, match="control characters"):
            wire.get("/", {"Authorization": "x\r\nEvil: 1"})
        wire.close()
        wire.close()
