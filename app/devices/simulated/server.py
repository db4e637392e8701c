"""A simulated camera on the network: real HTTP on the loopback address."""

from __future__ import annotations

import contextlib
import re
import socket
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, HTTPServer
from ipaddress import ip_address
from itertools import chain
from types import TracebackType
from typing import Any, ClassVar, Final, Protocol, Self

from app.core.base.errors import Cancelled
from app.core.base.progress import Token
from app.devices.clock import Clock, SystemClock, wait
from app.devices.simulated.exchange import Pause, Piece, Reply, Request, head_of

MAX_BODY_BYTES: Final = 1 << 20
"""Maximum length of a request body in bytes. Longer bodies are refused."""

_HOST: Final = "127.0.0.1"
_IDLE_S: Final = 60.0  # seconds that an idle connection is kept open
_LOCAL: Final = re.compile(r"(?:\[([0-9A-Fa-f:.]{2,45})\]|([A-Za-z0-9.]{1,45}))(?::\d{1,5})?")
_JOIN_S: Final = 5.0
_LAG_S: Final = 0.05


class Answering(Protocol):
    """Maps requests to replies, and is called from several threads."""

    def answer(self, request: Request) -> Reply:
        """Return the reply to a request."""


class CameraServer:
    """Serves a camera over HTTP/1.1 until stopped, and can be used as a context manager.

    Raises:
        OSError: If the port is in use.
    """

    handler: ClassVar[type[CameraHandler]]
    """Class that serves one connection."""

    def __init__(
        self,
        camera: Answering,
        port: int = 0,
        *,
        clock: Clock | None = None,
        log: Callable[[str], None] | None = None,
    ) -> None:
        self._http = _Http((_HOST, port), self.handler, camera, clock or SystemClock(), log)
        self._thread: threading.Thread | None = None

    @property
    def port(self) -> int:
        """The port on which the server listens."""
        return int(self._http.server_address[1])

    @property
    def url(self) -> str:
        """Address for clients, without a trailing slash."""
        return f"http://{_HOST}:{self.port}"

    def start(self) -> None:
        """Start answering. Calling this again has no effect."""
        if self._thread is None:
            self._thread = threading.Thread(
                target=self._http.serve_forever, args=(0.05,), name="camera server", daemon=True
            )
            self._thread.start()

    def stop(self) -> None:
        """Close all connections and wait for all threads. Calling this again has no effect."""
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
    """Listens, and serves each connection in a separate thread."""

    request_queue_size = 16

    def __init__(
        self,
        address: tuple[str, int],
        handler: type[CameraHandler],
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
        super().__init__(address, handler)

    def server_bind(self) -> None:
        """Bind without looking up the host's own name, which may take seconds."""
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, sys.platform != "win32")
        self.socket.bind(self.server_address)
        self.server_address = self.socket.getsockname()
        self.server_name, self.server_port = _HOST, self.server_address[1]

    def process_request(self, request: Any, client_address: Any) -> None:
        """Start the thread of a connection."""
        thread = threading.Thread(
            target=self._serve, args=(request, client_address), name="camera", daemon=True
        )
        with self._lock:
            self._open[request] = thread
        thread.start()

    def _serve(self, request: socket.socket, client_address: Any) -> None:
        # A client may disconnect at any time.
        with contextlib.suppress(OSError, Cancelled):
            self.finish_request(request, client_address)
        with contextlib.suppress(OSError):
            request.close()
        with self._lock:
            self._open.pop(request, None)

    def end(self) -> None:
        """Stop listening, interrupt all waits and wait for all threads."""
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
    """Return whether a Host header names this computer or is an IP address, with or without a port.

    Only such a host is used in the camera's URLs.
    """
    match = _LOCAL.fullmatch(host)
    if match is None:
        return False
    with contextlib.suppress(ValueError):
        ip_address(match[1] or match[2])
        return True
    return match[2] is not None and match[2].lower() in ("localhost", "camera.local")


class CameraHandler(BaseHTTPRequestHandler):
    """One connection, whose requests are handled one by one."""

    protocol_version = "HTTP/1.1"
    timeout = _IDLE_S
    disable_nagle_algorithm = True
    server: _Http

    def do_GET(self) -> None:
        """Answer a GET request."""
        self._exchange(b"")

    def do_POST(self) -> None:
        """Answer a POST request once its body has arrived."""
        length_header = self.headers.get("Content-Length", "0").strip()
        if "Transfer-Encoding" in self.headers or not (
            length_header.isascii() and length_header.isdigit()
        ):
            self._refuse(HTTPStatus.LENGTH_REQUIRED)
            return
        # Python refuses to convert a number with thousands of digits.
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
        """Pass a line to the log, if there is one."""
        if self.server.log is not None:
            self.server.log(format % args)

    def _refuse(self, status: HTTPStatus) -> None:
        self.close_connection = True
        self.send_error(status)

    def _exchange(self, body: bytes) -> None:
        host = self.headers.get("Host", "").strip() or f"{_HOST}:{self.server.server_port}"
        if not _is_here(host):
            # The request is from a web page whose host name resolves to this computer.
            self._refuse(HTTPStatus.FORBIDDEN)
            return
        request = Request(self.command, self.path, self._headers(), body, host)
        reply = self.server.camera.answer(request)
        self.log_request(reply.status)
        if reply.delay_s > 0.0:
            wait(self.server.clock, reply.delay_s, self.server.token)
        pieces = iter(reply.pieces)
        try:
            self.play(reply, pieces)
        finally:
            # Ends the generator if the client has disconnected.
            close = getattr(pieces, "close", None)
            if close is not None:
                close()

    def _headers(self) -> dict[str, str]:
        return {name.lower(): value for name, value in self.headers.items()}

    def play(self, reply: Reply, pieces: Iterator[Piece]) -> None:
        """Send a reply whose body consists of `pieces`."""
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
        self._send_body(pieces if first is None else chain([first], pieces), chunked=chunked)
        if chunked:
            self._send(b"0\r\n\r\n")

    def _send_body(self, pieces: Iterable[Piece], *, chunked: bool) -> None:
        clock = self.server.clock
        due = clock.now()
        for piece in pieces:
            if isinstance(piece, Pause):
                # Pauses follow the clock, since otherwise the time spent sending would lower the
                # rate. A slow reader does not catch up.
                due = max(due, clock.now() - _LAG_S) + piece.seconds
                wait(clock, due - clock.now(), self.server.token)
            elif piece:
                self._send(b"%x\r\n%b\r\n" % (len(piece), piece) if chunked else piece)

    def _send(self, data: bytes) -> None:
        self.server.token.check()
        self.connection.sendall(data)


CameraServer.handler = CameraHandler
