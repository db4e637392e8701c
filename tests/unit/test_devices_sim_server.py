"""The HTTP server of the simulated camera: what the camera says goes out as it was meant."""

from __future__ import annotations

import http.client
import itertools
import socket
import threading
from collections.abc import Callable, Iterable, Iterator

import pytest
import requests

from app.devices.simulated.exchange import Pause, Piece, Reply, Request
from app.devices.simulated.server import MAX_BODY_BYTES
from tests.faulty_camera.server import FaultyServer
from tests.faulty_camera.silence import Drop
from tests.helpers.scaled_clock import ScaledClock
from tests.helpers.waiting import PATIENCE_S, until

JSON = ("Content-Type", "application/json")


class Fake:
    """Answers as the test says, and keeps what it was asked."""

    def __init__(self, *replies: Reply) -> None:
        self.replies = list(replies)
        self.asked: list[Request] = []

    def answer(self, request: Request) -> Reply:
        self.asked.append(request)
        return self.replies.pop(0) if self.replies else body(b"{}")


def body(data: bytes, *, status: int = 200, length: int = -1) -> Reply:
    stated = len(data) if length < 0 else length
    return Reply(status, (JSON, ("Content-Length", str(stated))), (data,))


@pytest.fixture
def serve() -> Iterator[Callable[..., FaultyServer]]:
    running: list[FaultyServer] = []

    def make(camera: Fake, **options: object) -> FaultyServer:
        server = FaultyServer(camera, **options)  # type: ignore[arg-type]
        running.append(server)
        server.start()
        return server

    yield make
    for server in running:
        server.stop()
    left = [thread for thread in threading.enumerate() if thread.name.startswith("camera")]
    assert not left


Serve = Callable[..., FaultyServer]


def connect(server: FaultyServer) -> http.client.HTTPConnection:
    return http.client.HTTPConnection("127.0.0.1", server.port, timeout=PATIENCE_S)


def raw(server: FaultyServer, data: bytes) -> bytes:
    """Send bytes and read until the server closes."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE_S) as connection:
        connection.sendall(data)
        found = b""
        while True:
            try:
                some = connection.recv(65536)
            except ConnectionResetError:
                return found + b"<reset>"
            if not some:
                return found
            found += some


def test_what_was_asked_and_answered(serve: Serve) -> None:
    camera = Fake(body(b'{"a": 1}'), body(b'{"error": 1}', status=403))
    server = serve(camera)
    assert server.url == f"http://127.0.0.1:{server.port}"
    with requests.Session() as session:
        first = session.get(f"{server.url}/osc/info?x=%20y", headers={"X-Thing": "Some"})
        second = session.post(f"{server.url}/osc/state", data=b"\x00\xff body")
    assert first.json() == {"a": 1}
    assert second.status_code == 403
    assert second.reason == "Forbidden"
    get, post = camera.asked
    assert (get.method, get.target, get.body) == ("GET", "/osc/info?x=%20y", b"")
    assert get.headers["x-thing"] == "Some"
    assert get.host == f"127.0.0.1:{server.port}"
    assert (post.method, post.body) == ("POST", b"\x00\xff body")


def test_one_connection_for_many_requests(serve: Serve) -> None:
    server = serve(Fake())
    connection = connect(server)
    for _ in range(3):
        connection.request("GET", "/osc/info")
        assert connection.getresponse().read() == b"{}"
        assert connection.sock is not None
    connection.close()


def test_pieces_without_a_length_go_in_chunks(serve: Serve) -> None:
    pieces: Iterable[Piece] = (b"one", b"", Pause(0.01), b"two")
    server = serve(Fake(Reply(200, (JSON,), pieces), Reply(200, (JSON,), pieces)))
    wire = raw(server, b"GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
    assert b"Transfer-Encoding: chunked\r\n" in wire
    assert wire.endswith(b"\r\n\r\n3\r\none\r\n3\r\ntwo\r\n0\r\n\r\n")
    old = raw(server, b"GET / HTTP/1.0\r\n\r\n")
    assert old.endswith(b"\r\n\r\nonetwo")


def test_an_empty_body_has_a_length(serve: Serve) -> None:
    server = serve(Fake(Reply(200, (JSON,))))
    assert requests.get(server.url, timeout=PATIENCE_S).headers["Content-Length"] == "0"


@pytest.mark.parametrize(("length", "text"), [(3, b"12345"), (90, b"12345")])
def test_wrong_lengths_are_sent_as_they_are(serve: Serve, length: int, text: bytes) -> None:
    server = serve(Fake(body(text, length=length)))
    wire = raw(server, b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
    head, _, sent = wire.partition(b"\r\n\r\n")
    assert b"Content-Length: %d" % length in head
    assert sent == text


def test_a_drop_resets_the_connection(serve: Serve) -> None:
    headers = (JSON, ("Content-Length", "100"))
    server = serve(Fake(Reply(200, headers, (b"some", Pause(0.05), Drop(), b"never"))))
    wire = raw(server, b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
    assert wire.endswith(b"some<reset>")


def test_cut_before_anything_is_said(serve: Serve) -> None:
    server = serve(Fake(Reply(0), Reply(200, (JSON,), (Drop(),))))
    assert raw(server, b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n") == b"<reset>"
    with pytest.raises(requests.exceptions.ChunkedEncodingError):
        requests.get(server.url, timeout=PATIENCE_S)


def test_pauses_and_delays_are_the_clocks(serve: Serve) -> None:
    slow = Reply(200, (JSON,), (b"{", Pause(10.0), b"}"), delay_s=10.0)
    clock = ScaledClock(100.0)
    server = serve(Fake(slow), clock=clock)
    start = clock.now()
    assert requests.get(server.url, timeout=PATIENCE_S).json() == {}
    assert clock.now() - start > 19.0


def test_a_stream_ends_when_its_reader_goes(serve: Serve) -> None:
    gone = threading.Event()

    def endless() -> Iterator[Piece]:
        try:
            for _ in itertools.count():
                yield bytes(10_000)
                yield Pause(0.005)
        finally:
            gone.set()

    server = serve(Fake(Reply(200, (JSON,), endless())))
    connection = connect(server)
    connection.request("GET", "/")
    reply = connection.getresponse()
    assert len(reply.read(50_000)) == 50_000
    assert not gone.is_set()
    reply.close()
    connection.close()
    assert gone.wait(PATIENCE_S)


def test_several_connections_at_once(serve: Serve) -> None:
    hold = Reply(200, (JSON,), (b"1", Pause(30.0), b"2"))
    server = serve(Fake(hold))
    waiting = connect(server)
    waiting.request("GET", "/")
    reply = waiting.getresponse()
    assert requests.get(server.url, timeout=PATIENCE_S).json() == {}
    reply.close()
    waiting.close()


def test_stopping_cuts_what_is_under_way() -> None:
    hold = Reply(200, (JSON,), (b"1", Pause(600.0), b"2"))
    server = FaultyServer(Fake(hold, Reply(200, (JSON,), (), delay_s=600.0)))
    server.start()
    threads = threading.active_count()
    connections = [connect(server) for _ in range(3)]
    for connection in connections[:2]:
        connection.request("GET", "/")
    connections[2].connect()
    until(lambda: threading.active_count() >= threads + 2)
    server.stop()
    server.stop()
    assert threading.active_count() < threads
    for connection in connections:
        connection.close()
    with pytest.raises(ConnectionError):
        connections[2].connect()


def test_large_and_odd_requests_are_refused(serve: Serve) -> None:
    camera = Fake()
    server = serve(camera)
    start = b"POST /osc/state HTTP/1.1\r\nHost: localhost\r\n"
    for extra, status in (
        (b"Content-Length: %d" % (MAX_BODY_BYTES + 1), 413),
        (b"Content-Length: " + b"9" * 5000, 413),
        (b"Content-Length: -5", 411),
        (b"Content-Length: many", 411),
        (b"Transfer-Encoding: chunked", 411),
    ):
        found = raw(server, start + extra + b"\r\n\r\n")
        assert found.startswith(b"HTTP/1.1 %d " % status), extra[:40]
    assert raw(server, b"GET /" + b"x" * 70_000 + b" HTTP/1.1\r\n\r\n")[9:12] in (b"414", b"")
    many = b"".join(b"X-%d: 1\r\n" % number for number in range(200))
    assert raw(server, b"GET / HTTP/1.1\r\n" + many + b"\r\n").startswith(b"HTTP/1.1 431")
    assert raw(server, b"DELETE / HTTP/1.1\r\nConnection: close\r\n\r\n")[9:12] == b"501"
    assert camera.asked == []
    body_of_the_right_size = b"x" * MAX_BODY_BYTES
    assert requests.post(server.url, data=body_of_the_right_size, timeout=PATIENCE_S).ok


def test_a_request_that_stops_in_the_middle(serve: Serve) -> None:
    camera = Fake()
    server = serve(camera)
    with socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE_S) as connection:
        connection.sendall(b"POST / HTTP/1.1\r\nContent-Length: 50\r\n\r\nshort")
    assert requests.get(server.url, timeout=PATIENCE_S).ok
    assert [request.method for request in camera.asked] == ["GET"]


def test_the_host_is_that_of_this_machine(serve: Serve) -> None:
    camera = Fake()
    server = serve(camera)

    def answer(host: str) -> bytes:
        head = f"GET / HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"
        return raw(server, head.encode("latin-1"))

    for host in ("127.0.0.1:8080", "localhost", "[::1]:81", "192.168.1.1"):
        assert answer(host).startswith(b"HTTP/1.1 200")
        assert camera.asked[-1].host == host
    answer("")
    assert camera.asked[-1].host == f"127.0.0.1:{server.port}"
    known = len(camera.asked)
    for host in (
        "evil.example",
        "a b",
        "x" * 300,
        "caf\u00e9",
        "127.0.0.1:x",
        "127.0.0.1.evil.example",
    ):
        assert answer(host).startswith(b"HTTP/1.1 403")
    assert len(camera.asked) == known


def test_unknown_status_and_hostile_headers(serve: Serve) -> None:
    reply = Reply(799, (("X-Odd", "\u2603 snow"), ("Content-Length", "2")), (b"{}",))
    wire = raw(serve(Fake(reply)), b"GET / HTTP/1.1\r\nConnection: close\r\n\r\n")
    assert wire.startswith(b"HTTP/1.1 799 Unknown\r\nX-Odd: ? snow\r\n")


def test_quiet_unless_asked(serve: Serve, capfd: pytest.CaptureFixture[str]) -> None:
    lines: list[str] = []
    requests.get(serve(Fake()).url, timeout=PATIENCE_S)
    requests.get(serve(Fake(), log=lines.append).url, timeout=PATIENCE_S)
    assert lines == ['"GET / HTTP/1.1" 200 -']
    assert capfd.readouterr().err == ""


def test_a_port_that_is_taken(serve: Serve) -> None:
    server = serve(Fake())
    with pytest.raises(OSError, match="in use"):
        FaultyServer(Fake(), server.port)


def test_as_a_context_manager() -> None:
    with FaultyServer(Fake()) as server:
        assert requests.get(server.url, timeout=PATIENCE_S).ok
    with pytest.raises(requests.ConnectionError):
        requests.get(server.url, timeout=PATIENCE_S)
