"""Requests over a simulated socket: what `requests` makes of what the camera does."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest
import requests
from requests.auth import HTTPDigestAuth

from app.devices.clock import VirtualClock
from app.devices.simulated.exchange import (
    Pause,
    Piece,
    Reply,
    Request,
)
from tests.faulty_camera.camera import FaultyCamera
from tests.faulty_camera.silence import NO_ANSWER, Drop
from tests.helpers.camera_adapter import CameraAdapter
from tests.helpers.simulated import QUICK, room, stored

AT = "http://192.168.1.1"


class Scripted(FaultyCamera):
    """A camera that answers what it is told to."""

    def __init__(self, *replies: Reply) -> None:
        super().__init__(room(), "V", VirtualClock(), shape=QUICK)
        self.replies = list(replies)
        self.there = True
        self.asked: list[Request] = []

    def answer(self, request: Request) -> Reply:
        self.asked.append(request)
        return self.replies.pop(0)

    def reachable(self) -> bool:
        return self.there


def _session(camera: FaultyCamera) -> requests.Session:
    session = requests.Session()
    session.trust_env = False
    session.mount("http://", CameraAdapter(camera))
    return session


def _reply(*pieces: Piece, length: int | None = None, status: int = 200) -> Reply:
    headers = () if length is None else (("Content-Length", str(length)),)
    return Reply(status, headers, pieces, 0.01)


def test_a_request_arrives_whole_and_its_answer_too() -> None:
    camera = Scripted(_reply(b"hel", b"", Pause(0.5), b"lo", length=5, status=206))
    with _session(camera) as session:
        answer = session.post(f"{AT}:8080/a/b?c=d", json={"x": 1}, headers={"X-Own": "y"})
    assert (answer.status_code, answer.content) == (206, b"hello")
    request = camera.asked[0]
    assert (request.method, request.target) == ("POST", "/a/b?c=d")
    assert request.host == "192.168.1.1:8080"
    assert request.body == b'{"x": 1}'
    assert request.headers["x-own"] == "y"
    assert camera.clock.now() == pytest.approx(0.51)


def test_a_body_without_a_length_comes_in_chunks() -> None:
    camera = Scripted(_reply(b"one", b"two"))
    with _session(camera) as session, session.get(AT, stream=True) as answer:
        assert answer.headers["Transfer-Encoding"] == "chunked"
        assert list(answer.iter_content(None)) == [b"one", b"two"]


def test_chunks_arrive_when_they_are_sent() -> None:
    camera = Scripted(_reply(b"one", Pause(1.0), b"two", Pause(1.0), b"three"))
    with _session(camera) as session, session.get(AT, stream=True) as answer:
        times = [camera.clock.now() for _ in answer.iter_content(None)]
    assert times == pytest.approx([0.01, 1.01, 2.01])


def test_silence_before_the_answer_is_a_read_timeout_at_its_time() -> None:
    camera = Scripted(Reply(200, (), (), 30.0))
    with _session(camera) as session, pytest.raises(requests.exceptions.ReadTimeout):
        session.get(AT, timeout=(3.0, 7.0))
    assert camera.clock.now() == pytest.approx(7.0)


def test_silence_within_a_body_breaks_it_at_its_time() -> None:
    camera = Scripted(_reply(b"x" * 10, Pause(1.0), b"y", Pause(60.0), b"z", length=12))
    with (
        _session(camera) as session,
        session.get(AT, stream=True, timeout=(3, 7)) as answer,
        pytest.raises(requests.exceptions.ConnectionError, match="timed out"),
    ):
        answer.content  # noqa: B018
    assert camera.clock.now() == pytest.approx(8.01)


def test_a_cut_in_a_body_and_before_one() -> None:
    camera = Scripted(_reply(b"x" * 10, Drop(), length=100), Reply(0))
    with _session(camera) as session:
        with pytest.raises(requests.exceptions.ChunkedEncodingError, match="reset"):
            session.get(AT)
        with pytest.raises(requests.exceptions.ConnectionError, match="without response"):
            session.get(AT)


def test_a_body_shorter_than_its_length_breaks() -> None:
    camera = Scripted(_reply(b"x" * 10, length=100))
    failure = requests.exceptions.ChunkedEncodingError
    with _session(camera) as session, pytest.raises(failure, match="10 bytes read"):
        session.get(AT)


def test_a_body_longer_than_its_length_is_cut_and_spoils_nothing() -> None:
    camera = Scripted(_reply(b"x" * 100, length=10), _reply(b"fine", length=4))
    with _session(camera) as session:
        assert session.get(AT).content == b"x" * 10
        assert session.get(AT).content == b"fine"


def test_nobody_there_is_a_connect_timeout() -> None:
    camera = Scripted()
    camera.there = False
    with _session(camera) as session:
        with pytest.raises(requests.exceptions.ConnectTimeout):
            session.get(AT, timeout=(3.0, 20.0))
        assert camera.clock.now() == pytest.approx(3.0)


def test_an_open_connection_dies_in_silence_with_the_camera() -> None:
    camera = Scripted(_reply(b"fine", length=4), NO_ANSWER, _reply(b"back", length=4))
    with _session(camera) as session:
        assert session.get(AT).content == b"fine"
        with pytest.raises(requests.exceptions.ReadTimeout):
            session.get(AT, timeout=5.0)
        camera.reconnect()
        assert session.get(AT).content == b"back"


def test_the_camera_learns_that_nobody_listens_any_more() -> None:
    closed = threading.Event()

    def endless() -> Iterator[Piece]:
        try:
            while True:
                yield b"x" * 1000
        finally:
            closed.set()

    camera = Scripted(Reply(200, (), endless()))
    with _session(camera) as session, session.get(AT, stream=True) as answer:
        parts = answer.iter_content(100)
        next(parts)
        assert not closed.is_set()
    assert closed.is_set()


def test_the_preview_is_given_back() -> None:
    camera = FaultyCamera(room(), "V", VirtualClock(), shape=QUICK)
    body = {"name": "camera.getLivePreview"}
    with _session(camera) as session:
        with session.post(f"{AT}/osc/commands/execute", json=body, stream=True) as answer:
            parts = answer.iter_content(None)
            assert b"osclivepreview" in next(parts)
            assert camera.preview.body is not None
        assert camera.preview.body is None


def test_what_a_client_does_in_the_meantime_is_not_waited_for_again() -> None:
    camera = Scripted(_reply(Pause(1.0), b"x", Pause(1.0), b"y", length=2))
    with _session(camera) as session, session.get(AT, stream=True) as answer:
        parts = answer.iter_content(1)
        next(parts)
        camera.clock.sleep(10.0)
        next(parts)
    assert camera.clock.now() == pytest.approx(2.01 + 10.0 - 0.05)


def test_proxies_do_not_find_the_camera(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("http_proxy", "http://127.0.0.1:1")
    monkeypatch.delenv("no_proxy", raising=False)
    monkeypatch.delenv("NO_PROXY", raising=False)
    camera = Scripted(_reply(b"fine", length=4))
    with _session(camera) as session:
        session.trust_env = True
        with pytest.raises(requests.exceptions.ProxyError):
            session.get(AT)
        session.trust_env = False
        assert session.get(AT).content == b"fine"


def test_digest_with_requests_own_authentication() -> None:
    camera = FaultyCamera(
        room(), "Z1", VirtualClock(), password="geheimnis", shape=QUICK, older_files=1
    )
    with _session(camera) as session:
        assert session.get(f"{AT}/osc/info").status_code == 401
        session.auth = HTTPDigestAuth("THETAYN10086420", "geheimnis")
        assert session.get(f"{AT}/osc/info").json()["model"] == "RICOH THETA Z1"
        assert session.post(f"{AT}/osc/state").status_code == 200
        url = camera.url(stored(camera)[0])
        assert session.get(url).content == stored(camera)[0].data
        assert session.get(f"{url}?type=thumb").content == stored(camera)[0].thumb
        with session.post(
            f"{AT}/osc/commands/execute", json={"name": "camera.getLivePreview"}, stream=True
        ) as answer:
            assert answer.status_code == 200
        # Nonces do not live for ever; requests asks for another.
        camera.clock.sleep(1000.0)
        assert session.get(f"{AT}/osc/info").status_code == 200
        session.auth = HTTPDigestAuth("THETAYN10086420", "falsch")
        assert session.get(f"{AT}/osc/info").status_code == 401
        session.auth = ("THETAYN10086420", "geheimnis")
        assert session.get(f"{AT}/osc/info").status_code == 401


def test_the_rate_holds_through_requests() -> None:
    camera = FaultyCamera(
        room(), "Z1", VirtualClock(), shape=(256, 512), older_files=0, rate_mbit=8.0
    )
    with _session(camera) as session:
        body = {"name": "camera.takePicture"}
        session.post(f"{AT}/osc/commands/execute", json=body)
        camera.clock.sleep(30.0)
        file = stored(camera)[0]
        before = camera.clock.now()
        assert session.get(camera.url(file)).content == file.data
        took = camera.clock.now() - before
    assert took == pytest.approx(file.size / 1e6, abs=0.05)
