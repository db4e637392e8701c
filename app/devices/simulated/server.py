"""A simulated camera on the network: real HTTP on the loopback address.

The camera says what to answer; this plays it over a socket, as wrong as it was meant: a length
that is not that of the body, a connection that is reset in the middle, nothing at all.
"""

from __future__ import annotations

import contextlib
import re
import socket
import struct
import sys
import threading
from collections.abc import Callable, Iterator
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, HTTPServer
from ipaddress import ip_address
from types import TracebackType
from typing import Any, Final, Protocol, Self

from app.core.base.errors import Cancelled
from app.core.base.progress import Token
from app.devices.clock import Clock, SystemClock, wait
from app.devices.simulated.exchange import Drop, Pause, Piece, Reply, Request, head_of

MAX_BODY_BYTES: Final = 1 << 20
"""Longest body of a request; more is refused."""

_HOST: Final = "127.0.0.1"
_IDLE_S: Final = 60.0  # of a connection that is kept open
_LOCAL: Final = re.compile(r"(?:\[([0-9A-Fa-f:.]{2,45})\]|([A-Za-z0-9.]{1,45}))(?::\d{1,5})?")
_LINGER: Final = struct.pack("ii", 1, 0)  # closing resets instead of saying goodbye
_JOIN_S: Final = 5.0
_LAG_S: Final = 0.05


class Answering(Protocol):
    """Whatever turns requests into replies; called from several threads."""

    def answer(self, request: Request) -> Reply:
        """Answer one request."""


class CameraServer:
    """Serves a camera over HTTP/1.1 until it is stopped; also a context manager.

    Raises `OSError` when the port is taken.
    """

    def __init__(
        self,
        camera: Answering,
        port: int = 0,
        *,
        clock: Clock | None = None,
        log: Callable[[str], None] | None = None,
    ) -> None:
        self._http = _Http((_HOST, port), camera, clock or SystemClock(), log)
        self._thread: threading.Thread | None = None

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self._http.server_address[1])

    @property
    def url(self) -> str:
        """Address for a client, without a slash at the end."""
        return f"http://{_HOST}:{self.port}"

    def start(self) -> None:
        """Begin to answer; once."""
        if self._thread is None:
            self._thread = threading.Thread(
                target=self._http.serve_forever, args=(0.05,), name="camera server", daemon=True
            )
            self._thread.start()

    def stop(self) -> None:
        """Cut every connection and wait for all threads; safe to call again."""
        if self._thread is not None:
            self._http.shutdown()
            self._thread.join()
            self._thread = None
        self._http.end()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.stop()


class _Http(HTTPServer):
    """Listens; every connection has a thread of its own, which ends with it."""

    request_queue_size = 16

    def __init__(
        self,
        address: tuple[str, int],
        camera: Answering,
        clock: Clock,
        log: Callable[[str], None] | None,
    ) -> None:
        self.camera = camera
        self.clock = clock
        self.log = log
        self.token = Token()
        self._lock = threading.Lock()
        self._open: dict[socket.socket, threading.Thread] = {}
        super().__init__(address, _Handler)

    def server_bind(self) -> None:
        """Bind without asking the name service who we are, which may take seconds."""
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, sys.platform != "win32")
        self.socket.bind(self.server_address)
        self.server_address = self.socket.getsockname()
        self.server_name, self.server_port = _HOST, self.server_address[1]

    def process_request(self, request: Any, client_address: Any) -> None:
        """Give a connection its thread."""
        thread = threading.Thread(
            target=self._serve, args=(request, client_address), name="camera", daemon=True
        )
        with self._lock:
            self._open[request] = thread
        thread.start()

    def _serve(self, request: socket.socket, client_address: Any) -> None:
        # A client that goes away in the middle is nothing to speak of.
        with contextlib.suppress(OSError, Cancelled):
            _Handler(request, client_address, self)
        with contextlib.suppress(OSError):
            request.close()
        with self._lock:
            self._open.pop(request, None)

    def end(self) -> None:
        """Stop listening, wake everything that waits, and wait for it to end."""
        self.token.cancel()
        self.server_close()
        with self._lock:
            connections = dict(self._open)
        for connection in connections:
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
        for thread in connections.values():
            thread.join(_JOIN_S)


def _is_here(host: str) -> bool:
    """Whether a Host header names this machine, or is an address in numbers; with or without port.

    Only such a host goes into the camera's URLs.
    """
    match = _LOCAL.fullmatch(host)
    if match is None:
        return False
    with contextlib.suppress(ValueError):
        ip_address(match[1] or match[2])
        return True
    return match[2] is not None and match[2].lower() in ("localhost", "camera.local")


class _Handler(BaseHTTPRequestHandler):
    """One connection: requests after each other, until an answer ends it."""

    protocol_version = "HTTP/1.1"
    timeout = _IDLE_S
    disable_nagle_algorithm = True
    server: _Http

    def do_GET(self) -> None:
        self._exchange(b"")

    def do_POST(self) -> None:
        """Answer a POST, once its body is here."""
        length_header = self.headers.get("Content-Length", "0").strip()
        if "Transfer-Encoding" in self.headers or not (
            length_header.isascii() and length_header.isdigit()
        ):
            self._refuse(HTTPStatus.LENGTH_REQUIRED)
            return
        # A number of thousands of digits is not converted at all.
        length = int(length_header) if len(length_header) < 10 else MAX_BODY_BYTES + 1
        if length > MAX_BODY_BYTES:
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
            return
        body = self.rfile.read(length)
        if len(body) == length:
            self._exchange(body)
        else:
            self.close_connection = True

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - the base class's name
        """Tell whoever asked to be told."""
        if self.server.log is not None:
            self.server.log(format % args)

    def _refuse(self, status: HTTPStatus) -> None:
        self.close_connection = True
        self.send_error(status)

    def _exchange(self, body: bytes) -> None:
        host = self.headers.get("Host", "").strip() or f"{_HOST}:{self.server.server_port}"
        if not _is_here(host):
            # A web page whose name was made to lead here.
            self._refuse(HTTPStatus.FORBIDDEN)
            return
        request = Request(self.command, self.path, self._headers(), body, host)
        reply = self.server.camera.answer(request)
        self.log_request(reply.status)
        if reply.delay_s > 0.0:
            wait(self.server.clock, reply.delay_s, self.server.token)
        pieces = iter(reply.pieces)
        try:
            if reply.status == 0:
                self._reset()
            else:
                self._play(reply, pieces)
        finally:
            # A generator learns here that the client is gone.
            close = getattr(pieces, "close", None)
            if close is not None:
                close()

    def _headers(self) -> dict[str, str]:
        return {name.lower(): value for name, value in self.headers.items()}

    def _play(self, reply: Reply, pieces: Iterator[Piece]) -> None:
        length_header = next((v for n, v in reply.headers if n.lower() == "content-length"), None)
        first = next(pieces, None)
        extra = []
        chunked = length_header is None and first is not None
        if chunked and self.request_version == "HTTP/1.0":
            chunked = False
            self.close_connection = True
        elif chunked:
            extra = [("Transfer-Encoding", "chunked")]
        elif length_header is None:
            extra = [("Content-Length", "0")]
        if self.close_connection:
            extra.append(("Connection", "close"))
        self._send(head_of(reply.status, (*reply.headers, *extra)))
        count = self._send_body(first, pieces, chunked=chunked)
        if count is None:
            return
        if chunked:
            self._send(b"0\r\n\r\n")
        elif length_header is not None and length_header != str(count):
            self.close_connection = True

    def _send_body(
        self, first: Piece | None, pieces: Iterator[Piece], *, chunked: bool
    ) -> int | None:
        """Play the pieces; how many bytes went out, None where the connection was cut."""
        clock = self.server.clock
        sent, due = 0, clock.now()
        piece = first
        while piece is not None:
            if isinstance(piece, Drop):
                self._reset()
                return None
            if isinstance(piece, Pause):
                # By the clock and not one after the other: else a rate falls short by the time
                # that sending takes. What a slow reader has lost is not made up for.
                due = max(due, clock.now() - _LAG_S) + piece.seconds
                wait(clock, due - clock.now(), self.server.token)
            elif piece:
                self._send(b"%x\r\n%b\r\n" % (len(piece), piece) if chunked else piece)
                sent += len(piece)
            piece = next(pieces, None)
        return sent

    def _send(self, data: bytes) -> None:
        self.server.token.check()
        self.connection.sendall(data)

    def _reset(self) -> None:
        self.close_connection = True
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _LINGER)
