from __future__ import annotations

import gzip
import hashlib
import io
import re
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import requests
from requests.adapters import HTTPAdapter

from app.devices.clock import Clock, SystemClock, VirtualClock
from app.devices.errors import (
    BadReply,
    CameraRefused,
    DeviceError,
    NotACamera,
    PasswordNeeded,
    Unreachable,
)
from app.devices.passwords import Credentials, Digest
from app.devices.simulated.exchange import Pause
from app.devices.theta.endpoint import Endpoint
from app.devices.theta.link import Link
from app.devices.theta.reply import Timeouts
from app.devices.theta.untrusted import MAX_BYTES
from tests.faulty_camera.silence import Drop
from tests.helpers.osc_wire import INFO, REFUSED, STATE, Rig, http
from tests.helpers.scaled_clock import ScaledClock
from tests.helpers.waiting import PATIENCE_S

PATH = "/osc/info"
KEYS = Credentials("THETAYN10020030", "10020030")

# What is sent


def test_headers_of_every_request() -> None:
    rig = Rig([http(STATE)])
    rig.link.get(PATH)
    rig.link.post("/osc/state", None)
    rig.link.post("/osc/commands/status", {"id": "4"})
    for request in rig.adapter.log:
        assert request.headers["X-XSRF-Protected"] == "1"
        assert request.headers["Cache-Control"] == "no-store"
        assert request.headers["Accept"] == "application/json"
        assert request.headers["Accept-Encoding"] == "identity"
        assert "Cookie" not in request.headers
    get, empty, full = rig.adapter.log
    assert "Content-Type" not in get.headers
    assert empty.headers["Content-Type"] == "application/json;charset=utf-8"
    assert (empty.body, empty.headers["Content-Length"]) == (None, "0")
    assert (full.body, full.headers["Content-Length"]) == (b'{"id":"4"}', "10")


def test_the_surroundings_are_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("http_proxy", "http://127.0.0.1:9")
    monkeypatch.setenv("HTTP_PROXY", "http://127.0.0.1:9")
    with serving(whole(b"{}")) as server:
        assert server.link().get(PATH) == {}


def test_passwords_of_other_programs_are_not_sent(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    keys = tmp_path / "netrc"
    keys.write_text("default login me password mine\n", encoding="utf-8")
    monkeypatch.setenv("NETRC", str(keys))
    rig = Rig([http(STATE)])
    rig.link.get(PATH)
    assert "Authorization" not in rig.adapter.log[0].headers


def test_cookies_are_not_kept() -> None:
    rig = Rig([http(STATE, headers={"Set-Cookie": "a=b"})])
    rig.link.get(PATH)
    rig.link.get(PATH)
    assert "Cookie" not in rig.adapter.log[1].headers


# What comes back


@pytest.mark.parametrize(
    ("reply", "kind", "code"),
    [
        (http(REFUSED, 403), CameraRefused, "disabledCommand"),
        (http(REFUSED, 500), CameraRefused, "disabledCommand"),
        (http({"error": {"code": "notFound"}}, 404), CameraRefused, "notFound"),
        (http(b"", 503), CameraRefused, "serviceUnavailable"),
        (http(b"<html>busy</html>", 503), CameraRefused, "serviceUnavailable"),
        (http(b"", 500), CameraRefused, "unexpected"),
        (http(b"", 400), CameraRefused, "unexpected"),
        (http(b"", 999), CameraRefused, "unexpected"),
        (http(b"not json", 403), CameraRefused, "unexpected"),
        (http(b"<!DOCTYPE html>", 404), NotACamera, "not-a-camera"),
        (http(b"", 404), NotACamera, "not-a-camera"),
        (http({}, 404), NotACamera, "not-a-camera"),
        (http(b"<html>", 403), NotACamera, "not-a-camera"),
        (http(b"<html>"), NotACamera, "not-a-camera"),
        (http(b" \n<?xml version='1.0'?>"), NotACamera, "not-a-camera"),
        (http(b"hello", headers={"Content-Type": "text/html"}), NotACamera, "not-a-camera"),
        (http(b"", 302, {"Location": "https://router.lan/"}), NotACamera, "not-a-camera"),
        (http(b"", 401, {"WWW-Authenticate": 'Basic realm="x"'}), NotACamera, "not-a-camera"),
        (http(b"", 401), NotACamera, "not-a-camera"),
        ([b"SSH-2.0-OpenSSH_9.2\r\n"], NotACamera, "not-a-camera"),
        ([b"ICY 200 OK\r\n\r\n"], NotACamera, "not-a-camera"),
        (http(b""), BadReply, "bad-reply"),
        (http(b"{"), BadReply, "bad-reply"),
        (http(b"", 204), BadReply, "bad-reply"),
        (http(b"{}", headers={"Content-Length": "1"}), BadReply, "bad-reply"),
        (http(b"{}", headers={"Content-Encoding": "br"}), BadReply, "packed"),
        (http(b"{}", headers={"Transfer-Encoding": "gzip, chunked"}), BadReply, "packed"),
        (http(b"{}", headers={"Content-Length": "500"}), Unreachable, "broken"),
        (http(b"5\r\n{}", headers={"Transfer-Encoding": "chunked"}), Unreachable, "broken"),
        (http(b"zz\r\n{}", headers={"Transfer-Encoding": "chunked"}), Unreachable, "broken"),
        ([], Unreachable, "broken"),
        ([Drop()], Unreachable, "broken"),
        ([b"HTTP/1.1 200", Drop()], Unreachable, "broken"),
        ([*http(b"{}", headers={"Content-Length": "9"}), Drop()], Unreachable, "broken"),
        ([Pause(21.0)], Unreachable, "timeout"),
        ([*http(b"{}", headers={"Content-Length": "9"}), Pause(21.0)], Unreachable, "timeout"),
    ],
)
def test_every_reply_has_one_meaning(reply: Any, kind: type[DeviceError], code: str) -> None:
    rig = Rig([reply])
    with pytest.raises(kind) as caught:
        rig.link.get(PATH)
    assert type(caught.value) is kind
    assert caught.value.code == code
    assert caught.value.hint
    assert len(rig.adapter.log) == 1


@pytest.mark.parametrize(
    "headers",
    [
        {"Content-Length": ""},
        {"Content-Length": "-5"},
        {"Content-Length": "two"},
        {"Content-Type": "text/plain"},
        {"Content-Encoding": "identity"},
    ],
)
def test_small_sins_are_forgiven(headers: dict[str, str]) -> None:
    assert Rig([http(b'{"a": 1}', headers=headers)]).link.get(PATH) == {"a": 1}


def test_a_packed_bomb_is_not_opened() -> None:
    bomb = gzip.compress(b" " * 20_000_000)
    for status in (200, 503):
        rig = Rig([http(bomb, status, {"Content-Encoding": "gzip"})])
        with pytest.raises(BadReply) as caught:
            rig.link.get(PATH)
        assert caught.value.code == "packed"


def test_a_reply_without_an_end_is_cut() -> None:
    def endless() -> Iterator[bytes]:
        yield b"HTTP/1.1 200 OK\r\n\r\n"
        while True:
            yield b" " * 65536

    with pytest.raises(BadReply) as caught:
        Rig([endless()]).link.get(PATH)
    assert caught.value.code == "too-large"
    with pytest.raises(BadReply):
        Rig([http(b" " * (MAX_BYTES + 1))]).link.get(PATH)


@pytest.mark.parametrize("status", [200, 404, 503])
def test_a_drip_ends_at_the_deadline(status: int) -> None:
    def drip() -> Iterator[Any]:
        yield b"HTTP/1.1 %d OK\r\nContent-Length: 999999\r\n\r\n" % status
        while True:
            yield Pause(1.0)
            yield b" "

    for keeps_watch in (True, False):
        rig = Rig([drip()], keeps_watch=keeps_watch)
        with pytest.raises(Unreachable) as caught:
            rig.link.get(PATH)
        assert caught.value.code == "timeout"
        assert rig.clock.now() == pytest.approx(rig.link.timeouts.whole_s, abs=2.0)


class PlainAdapter(HTTPAdapter):
    """Gives a body that is nothing but a file."""

    def send(self, request: requests.PreparedRequest, **how: Any) -> requests.Response:  # type: ignore[override]
        del how
        response = requests.Response()
        response.status_code = 200
        response.headers["Content-Length"] = "4"
        response.raw = io.BytesIO(b"{} " if request.path_url == "/short" else b"{}  ")
        return response


def test_an_adapter_of_any_kind_will_do() -> None:
    link = Link(Endpoint("cam"), VirtualClock(), adapter=PlainAdapter())
    assert link.get("/whole") == {}
    with pytest.raises(Unreachable):
        link.get("/short")


# Streams


def test_a_stream_gives_what_comes() -> None:
    data = bytes(range(256)) * 1000
    rig = Rig([http(data)])
    with rig.link.stream("/files/R1.JPG", headers={"Range": "bytes=5-"}) as incoming:
        assert (incoming.status, incoming.length) == (200, len(data))
        assert incoming.headers["content-type"] == "application/octet-stream"
        assert b"".join(incoming.chunks(1000)) == data
    assert rig.adapter.log[0].headers["Range"] == "bytes=5-"


@pytest.mark.parametrize(
    ("reply", "kind", "code"),
    [
        (http(b"<h1>", 404), CameraRefused, "notFound"),
        (http(b"", 416), CameraRefused, "invalidParameterValue"),
        (http(REFUSED, 403), CameraRefused, "disabledCommand"),
        (http(REFUSED), CameraRefused, "disabledCommand"),
        (http({"fine": True}), BadReply, "bad-reply"),
        (http(b"", 302), NotACamera, "not-a-camera"),
        (http(b"<html>", 200, {"Content-Type": "text/html"}), NotACamera, "not-a-camera"),
        (http(b"", 204), BadReply, "bad-reply"),
        ([Pause(10.5)], Unreachable, "timeout"),
    ],
)
def test_a_stream_that_is_none(reply: Any, kind: type[DeviceError], code: str) -> None:
    with pytest.raises(kind) as caught, Rig([reply]).link.stream("/files/R1.JPG"):
        pass
    assert caught.value.code == code


@pytest.mark.parametrize(
    ("tail", "code"),
    [([], "broken"), ([Drop()], "broken"), ([Pause(10.5), b"y" * 500], "timeout")],
)
def test_a_stream_that_breaks_off_keeps_what_came(tail: Any, code: str) -> None:
    rig = Rig([[*http(b"x" * 300, headers={"Content-Length": "800"}), *tail]])
    got: list[bytes] = []
    with rig.link.stream("/files/R1.JPG") as incoming:
        chunks = incoming.chunks()
        with pytest.raises(Unreachable) as caught:
            got.extend(chunks)
    assert b"".join(got) == b"x" * 300
    assert caught.value.code == code


def test_a_stream_that_drips_ends_but_a_slow_one_does_not() -> None:
    for rate, fine in ((10, False), (2000, True)):
        pieces: list[Any] = [http(b"", headers={"Content-Length": str(60 * rate)})[0]]
        for _ in range(60):
            pieces += [Pause(1.0), b"x" * rate]
        rig = Rig([pieces])
        with rig.link.stream("/files/R1.JPG") as incoming:
            if fine:
                assert sum(map(len, incoming.chunks())) == 60 * rate
            else:
                with pytest.raises(Unreachable):
                    list(incoming.chunks())
                assert rig.clock.now() < 15.0


def test_the_time_of_the_reader_is_not_the_cameras() -> None:
    rig = Rig([http(b"x" * 1000)])
    with rig.link.stream("/files/R1.JPG") as incoming:
        for _ in incoming.chunks(100):
            rig.clock.sleep(100.0)


def test_closing_ends_the_reader() -> None:
    rig = Rig([http(b"x" * 1000), http(STATE)])
    with rig.link.stream("/files/R1.JPG") as incoming:
        chunks = incoming.chunks(100)
        next(chunks)
        rig.link.close()
        with pytest.raises(Unreachable) as caught:
            next(chunks)
    assert caught.value.code == "closed"
    assert rig.link.get(PATH) == STATE


# One at a time


def test_a_second_request_in_the_same_thread_is_a_mistake() -> None:
    rig = Rig([http(b"x" * 1000), http(STATE)])
    with rig.link.stream("/files/R1.JPG"), pytest.raises(RuntimeError):
        rig.link.get(PATH)
    assert rig.link.get(PATH) == STATE


def test_requests_of_many_threads_never_overlap() -> None:
    inside, most = 0, 0
    guard = threading.Lock()

    def answer(connection: socket.socket) -> None:
        nonlocal inside, most
        with guard:
            inside += 1
            most = max(most, inside)
        time.sleep(0.005)
        with guard:
            inside -= 1
        connection.sendall(whole_bytes(b"{}"))

    with serving(answer) as server:
        link = server.link()
        threads = [
            threading.Thread(target=lambda: [link.get(PATH) for _ in range(5)]) for _ in range(4)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(PATIENCE_S)
    assert server.requests == 20
    assert most == 1


# Passwords


def challenge(nonce: str, more: str = "") -> Any:
    header = f'Digest realm="RICOH THETA Z1", nonce="{nonce}", qop="auth", algorithm=MD5{more}'
    return http(b"", 401, {"WWW-Authenticate": header})


def is_right(request: requests.PreparedRequest, nonce: str) -> bool:
    """Compute RFC 7616's answer anew."""
    header = str(request.headers.get("Authorization", ""))
    given = dict(re.findall(r'(\w+)="?([^",]+)"?', header.removeprefix("Digest ")))

    def md5(text: str) -> str:
        return hashlib.md5(text.encode()).hexdigest()

    first = md5(f"{KEYS.user}:RICOH THETA Z1:{KEYS.password}")
    second = md5(f"{request.method}:{request.path_url}")
    middle = f"{nonce}:{given.get('nc')}:{given.get('cnonce')}:auth"
    return given.get("uri") == request.path_url and given.get("response") == md5(
        f"{first}:{middle}:{second}"
    )


def test_a_password_is_given_when_it_is_asked_for_and_then_kept() -> None:
    rig = Rig([challenge("n1"), http(STATE), http(STATE), http(b"jpeg")], credentials=KEYS)
    rig.link.post("/osc/state", None)
    rig.link.post("/osc/commands/status", {"id": 4})
    with rig.link.stream("/files/R1.JPG?type=thumb", headers={"Accept": "*/*"}) as incoming:
        assert incoming.status == 200
    first, *others = rig.adapter.log
    assert "Authorization" not in first.headers
    assert len(others) == 3
    assert all(is_right(request, "n1") for request in others)
    counts = [str(request.headers["Authorization"]).split("nc=")[1][:8] for request in others]
    assert counts == ["00000001", "00000002", "00000003"]


def test_a_new_nonce_is_taken() -> None:
    rig = Rig(
        [challenge("n1"), http(STATE), challenge("n2", ", stale=TRUE"), http(STATE)],
        credentials=KEYS,
    )
    rig.link.post("/osc/state", None)
    rig.link.post("/osc/state", None)
    assert len(rig.adapter.log) == 4
    assert is_right(rig.adapter.log[3], "n2")


@pytest.mark.parametrize(("more", "tries"), [("", 2), (", stale=true", 3)])
def test_a_wrong_password_is_not_tried_for_ever(more: str, tries: int) -> None:
    rig = Rig([challenge("n1", more)], credentials=KEYS)
    with pytest.raises(PasswordNeeded) as caught:
        rig.link.get(PATH)
    assert caught.value.code == "password-refused"
    assert len(rig.adapter.log) == tries


def test_a_missing_password_is_asked_for_with_where_to_find_it() -> None:
    rig = Rig([challenge("n1")])
    with pytest.raises(PasswordNeeded) as caught:
        rig.link.get(PATH)
    assert caught.value.code == "password"
    assert "serial number" in caught.value.hint
    with pytest.raises(PasswordNeeded), Rig([challenge("n1")]).link.stream("/files/R1.JPG"):
        pass


def test_a_password_is_never_shown() -> None:
    rig = Rig([challenge("n1")], credentials=Credentials("u", "very-secret"))
    with pytest.raises(PasswordNeeded) as caught:
        rig.link.get(PATH)
    shown = f"{caught.value!r} {caught.value} {rig.credentials!r} {vars(rig.link)!r}"
    assert "very-secret" not in shown
    assert not any(b"very-secret" in str(item.headers).encode() for item in rig.adapter.log)


@pytest.mark.parametrize(
    "header",
    [
        "Digest",
        "Digest realm",
        'Digest realm="x"',
        'Digest nonce="x"',
        'Digest realm="x", nonce="y", algorithm=ROT13',
        'Digest realm="x", nonce="y", qop="auth-int"',
        'Digest realm="x\x07", nonce="y"',
        'Digest realm="\xe4", nonce="y"',
        "Digest " + 'realm="x",' * 5000,
    ],
)
def test_a_challenge_that_cannot_be_answered(header: str) -> None:
    digest = Digest(KEYS)
    with pytest.raises(PasswordNeeded):
        _ = digest.take(header) or digest.answer("GET", "http://cam/osc/info")


@pytest.mark.parametrize(
    "header",
    [
        'digest realm="x", nonce="y"',
        'Basic realm="b", Digest realm="x", nonce="y", qop="auth"',
        'Digest realm="x", nonce="y", qop="auth-int, auth"',
        'Digest realm="x", nonce="y", algorithm=SHA-256, qop="auth", opaque="z"',
    ],
)
def test_other_challenges_are_answered(header: str) -> None:
    digest = Digest(KEYS)
    assert not digest.take(header)
    answer = digest.answer("GET", "http://cam/osc/info")
    assert answer.startswith("Digest ")
    assert 'realm="x"' in answer
    assert KEYS.password not in answer.replace(KEYS.user, "")


# Real connections


def whole_bytes(body: bytes) -> bytes:
    return b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n%b" % (len(body), body)


def whole(body: bytes) -> Callable[[socket.socket], None]:
    return lambda connection: connection.sendall(whole_bytes(body))


class Server:
    """Lets `answer` write whatever it likes after each request; its errors end a connection."""

    def __init__(self, answer: Callable[[socket.socket], None]) -> None:
        self._answer = answer
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self.requests = 0
        self.connections = 0
        self.stop = threading.Event()
        self._threads = [threading.Thread(target=self._listen)]
        self._threads[0].start()

    def _listen(self) -> None:
        self._listener.settimeout(0.05)
        while not self.stop.is_set():
            try:
                connection, _ = self._listener.accept()
            except TimeoutError:
                continue
            self.connections += 1
            thread = threading.Thread(target=self._serve, args=(connection,))
            self._threads.append(thread)
            thread.start()

    def _serve(self, connection: socket.socket) -> None:
        with connection:
            connection.settimeout(5.0)
            while not self.stop.is_set():
                try:
                    heard = b""
                    while b"\r\n\r\n" not in heard:
                        got = connection.recv(65536)
                        if not got:
                            return
                        heard += got
                    self.requests += 1
                    self._answer(connection)
                except OSError:
                    return

    def close(self) -> None:
        self.stop.set()
        for thread in self._threads:
            thread.join(PATIENCE_S)
            assert not thread.is_alive()
        self._listener.close()

    def link(
        self,
        clock: Clock | None = None,
        timeouts: Timeouts = Timeouts(),  # noqa: B008
    ) -> Link:
        self.made = Link(
            Endpoint("127.0.0.1", self.port), clock or SystemClock(), timeouts=timeouts
        )
        return self.made


@contextmanager
def serving(answer: Callable[[socket.socket], None]) -> Iterator[Server]:
    server = Server(answer)
    try:
        yield server
    finally:
        server.made.close()
        server.close()


def slowly(head: bytes, drop: bytes, pause_s: float) -> Callable[[socket.socket], None]:
    def answer(connection: socket.socket) -> None:
        connection.sendall(head)
        # Until the other side hangs up: only its own limit ends this in time.
        for _ in range(round(PATIENCE_S / pause_s)):
            connection.sendall(drop)
            time.sleep(pause_s)

    return answer


def waited(event: threading.Event) -> None:
    """Say nothing until the test has its answer; an answer that needs the end of this fails."""
    assert event.wait(PATIENCE_S)


def test_a_connection_is_kept_while_all_is_well() -> None:
    with serving(whole(b'{"a": 1}')) as server:
        link = server.link()
        for _ in range(5):
            assert link.get(PATH) == {"a": 1}
        assert (server.connections, server.requests) == (1, 5)


def test_an_idle_connection_and_one_with_an_error_are_not_used_again() -> None:
    clock = VirtualClock()
    with serving(whole(b"{}")) as server:
        link = server.link(clock)
        link.get(PATH)
        clock.sleep(10.0)
        link.get(PATH)
        assert server.connections == 2
    with serving(whole(b" " * (2 * MAX_BYTES))) as server:
        link = server.link()
        for _ in range(2):
            with pytest.raises(BadReply):
                link.get(PATH)
        assert server.connections == 2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("head", "drop"),
    [
        (b"", b"H"),
        (b"HTTP/1.1 200 OK\r\nX-Long: ", b"a"),
        (b"HTTP/1.1 100 Continue\r\n\r\n", b"HTTP/1.1 100 Continue\r\n\r\n"),
        (b"HTTP/1.1 200 OK\r\nContent-Length: 9999\r\n\r\n", b" "),
        (b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n1;", b"x"),
        (b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n", b"1\r\n \r\n"),
        (b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n", b"X: y\r\n"),
        (b"HTTP/1.1 401 No\r\nWWW-Authenticate: Digest realm=a, nonce=b\r\n\r\n", b" "),
    ],
)
def test_a_drip_ends_wherever_it_is(head: bytes, drop: bytes) -> None:
    """Header, chunk length, trailer: a byte now and then, never silent for long."""
    with serving(slowly(head, drop, 0.02)) as server:
        link = server.link(timeouts=Timeouts(read_s=1.0, whole_s=0.3))
        with pytest.raises(DeviceError) as caught:
            link.get(PATH)
        assert isinstance(caught.value, Unreachable | PasswordNeeded)
        link.close()
        server.stop.set()


def test_a_trailer_that_drips_ends_a_stream() -> None:
    head = b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n0\r\n"
    with serving(slowly(head, b"X: y\r\n", 0.02)) as server:
        link = server.link(timeouts=Timeouts(idle_s=0.3))
        with link.stream("/files/R1.JPG") as incoming, pytest.raises(Unreachable):
            list(incoming.chunks())


def test_silence_ends_on_the_clock_that_was_given() -> None:
    """Nearly an hour of silence on that clock is a third of a second here."""
    quiet = threading.Event()
    with serving(lambda connection: waited(quiet)) as server:
        clock = ScaledClock(10_000.0)
        link = server.link(clock, Timeouts(read_s=3000.0, whole_s=3000.0))
        start = clock.now()
        with pytest.raises(Unreachable) as caught:
            link.get(PATH)
        assert caught.value.code == "timeout"
        assert clock.now() - start > 2500.0
        quiet.set()


def test_silence_ends_in_real_time_although_the_clock_stands_still() -> None:
    quiet = threading.Event()
    with serving(lambda connection: waited(quiet)) as server:
        link = server.link(VirtualClock(), Timeouts(read_s=0.2))
        with pytest.raises(Unreachable):
            link.get(PATH)
        quiet.set()


def test_a_drip_ends_in_real_time_although_the_clock_stands_still() -> None:
    head = b"HTTP/1.1 200 OK\r\nContent-Length: 9999\r\n\r\n"
    with serving(slowly(head, b" ", 0.02)) as server:
        link = server.link(VirtualClock(), Timeouts(whole_s=0.2))
        with pytest.raises(Unreachable):
            link.get(PATH)


def test_another_thread_ends_a_silent_stream() -> None:
    quiet = threading.Event()

    def answer(connection: socket.socket) -> None:
        connection.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: 9999\r\n\r\nabc")
        waited(quiet)

    with serving(answer) as server:
        link = server.link()
        with link.stream("/files/R1.JPG") as incoming:
            chunks = incoming.chunks()
            assert next(chunks) == b"abc"
            timer = threading.Timer(0.1, link.close)
            timer.start()
            with pytest.raises(Unreachable) as caught:
                next(chunks)
            assert caught.value.code == "closed"
            timer.join()
        quiet.set()


def test_closing_the_link_ends_an_opening() -> None:
    quiet = threading.Event()

    def answer(connection: socket.socket) -> None:
        connection.sendall(b"HTTP/1.1 200 OK\r\n")
        waited(quiet)

    with serving(answer) as server:
        link = server.link()
        timer = threading.Timer(0.1, link.close)
        timer.start()
        with pytest.raises(Unreachable) as caught, link.stream("/files/R1.JPG"):
            pass
        assert caught.value.code == "closed"
        timer.join()
        quiet.set()


def test_closing_the_link_ends_its_streams_and_leaves_it_usable() -> None:
    with serving(whole(b"{}")) as server:
        link = server.link()
        with link.stream("/files/R1.JPG") as incoming:
            link.close()
            with pytest.raises(Unreachable):
                next(incoming.chunks())
        assert link.get(PATH) == {}


def test_nobody_there() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with pytest.raises(Unreachable) as caught:
        Link(Endpoint("127.0.0.1", port), SystemClock()).get(PATH)
    assert "Nothing answers" in caught.value.message
    with pytest.raises(Unreachable) as caught:
        Link(Endpoint("no-such-camera.invalid"), SystemClock()).get(PATH)
    assert caught.value.code == "no-such-name"


def test_a_redirect_with_an_endless_body_is_not_read() -> None:
    head = b"HTTP/1.1 302 Found\r\nLocation: http://other/\r\n\r\n"
    with serving(lambda connection: connection.sendall(head + b"x" * 30_000_000)) as server:
        with pytest.raises(DeviceError), server.link().stream("/files/R1.JPG"):
            pass
        server.stop.set()


def test_info_over_a_real_connection() -> None:
    from app.devices.theta.client import OscClient
    from app.devices.theta.untrusted import write_json

    with serving(whole(write_json(INFO))) as server:
        clock = SystemClock()
        assert OscClient(server.link(clock), clock).info().firmware == (3, 60, 3)
