"""Carries what `requests` sends to a simulated camera in the same process, on its clock.

Only the socket is simulated. Everything above it is real: `requests`, `urllib3` and `http.client`
build the request, parse the answer, keep connections open, count Content-Length, undo chunks and
raise their own exceptions. So a body that ends before its Content-Length breaks with
`ChunkedEncodingError`, bytes beyond it are left in the connection, which is not used again, and a
pause longer than the read timeout ends with `ReadTimeout` (in the headers) or `ConnectionError`
(in the body) after exactly that time.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any, Final

import requests
from requests.adapters import HTTPAdapter
from requests.utils import select_proxy
from urllib3 import PoolManager
from urllib3.connection import HTTPConnection
from urllib3.connectionpool import HTTPConnectionPool
from urllib3.exceptions import ConnectTimeoutError
from urllib3.util import Timeout

from app.devices.simulated.exchange import Pause, Request, head_of
from tests.faulty_camera.silence import Drop

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from app.devices.simulated.exchange import Piece, Reply
    from tests.faulty_camera.camera import FaultyCamera

_PATIENCE_S: Final = 120.0
"""What the system waits for a connection where the client sets no limit."""

_BUFFERED_S: Final = 0.05
"""How far a camera sends ahead of a client that does not read."""


class CameraAdapter(HTTPAdapter):
    """A transport adapter whose every address is one simulated camera.

    Examples:
        ::

            session = requests.Session()
            session.mount("http://", CameraAdapter(camera))
    """

    def __init__(self, camera: FaultyCamera) -> None:
        self._camera = camera
        super().__init__(pool_connections=4, pool_maxsize=4)

    def init_poolmanager(
        self, connections: int, maxsize: int, block: bool = False, **pool_kwargs: Any
    ) -> None:
        """Make the pools, as `HTTPAdapter` does, of connections to the camera."""
        manager = PoolManager(connections, maxsize=maxsize, block=block, **pool_kwargs)
        manager.pool_classes_by_scheme = {"http": _pool_class(self._camera)}
        self.poolmanager = manager

    def get_connection_with_tls_context(
        self,
        request: requests.PreparedRequest,
        verify: Any,
        proxies: Mapping[str, str] | None = None,
        cert: Any = None,
    ) -> Any:
        """Find a pool.

        Raises `requests.exceptions.ProxyError` when the request would go over a proxy, which would
        not find the camera.
        """
        if select_proxy(str(request.url), dict(proxies or {})):
            raise requests.exceptions.ProxyError("a proxy does not find the camera")
        return super().get_connection_with_tls_context(request, verify, {}, cert)


def _pool_class(camera: FaultyCamera) -> type[HTTPConnectionPool]:
    class Connection(_Connection):
        def open_socket(self) -> _Socket:
            return _Socket(camera, f"{self.host}" + f":{self.port}" * (self.port != 80))

    class Pool(HTTPConnectionPool):
        ConnectionCls = Connection

    return Pool


class _Connection(HTTPConnection):
    """A connection of urllib3 whose socket is simulated."""

    def open_socket(self) -> _Socket:
        """Make the socket."""
        raise NotImplementedError

    def connect(self) -> None:
        """Connect, or fail as a network would where nobody is there."""
        made = self.open_socket()
        limit = Timeout.resolve_default_timeout(self.timeout)
        if not made.connect(_PATIENCE_S if limit is None else limit):
            raise ConnectTimeoutError(self, f"Connection to {self.host} timed out.")
        self.sock = made

    @property
    def is_connected(self) -> bool:
        """Whether it can be used for another request."""
        return isinstance(self.sock, _Socket) and self.sock.idle


class _Socket:
    """As much of a socket as http.client touches."""

    def __init__(self, camera: FaultyCamera, host: str) -> None:
        self._camera = camera
        self._host = host
        self._epoch = camera.epoch
        self._heard = bytearray()
        self._stream: _Stream | None = None
        self.timeout: float | None = None

    def connect(self, limit: float) -> bool:
        """Wait for the camera to take the connection."""
        if self._camera.reachable():
            self._epoch = self._camera.epoch
            return True
        self._camera.clock.sleep(limit)
        return False

    @property
    def idle(self) -> bool:
        """Whether nothing is left of the last answer and nobody has hung up."""
        return self._alive and (self._stream is None or self._stream.over)

    @property
    def _alive(self) -> bool:
        return self._epoch == self._camera.epoch

    def settimeout(self, value: float | None) -> None:
        """Set the patience of every following read, in seconds."""
        self.timeout = value

    def setsockopt(self, *args: Any) -> None:
        """Do nothing; there is nothing to tune."""

    def sendall(self, data: bytes) -> None:
        """Take a piece of a request; a whole one is answered at once."""
        if not self._alive or (self._stream is not None and not self._stream.over):
            raise ConnectionResetError("Connection reset by peer")
        self._heard += data
        request = _parsed(bytes(self._heard), self._host)
        if request is not None:
            self._heard.clear()
            self._stream = _Stream(self, self._camera, self._camera.answer(request))

    def makefile(self, mode: str) -> io.BufferedReader:
        """Open what comes back for reading."""
        assert mode == "rb"
        assert self._stream is not None
        return io.BufferedReader(self._stream)

    def shutdown(self, how: int) -> None:
        """End reading and writing."""
        del how
        self.close()

    def close(self) -> None:
        """Hang up; the camera's body learns of it when its reader is closed too."""


class _Stream(io.RawIOBase):
    """The bytes of one answer as they arrive at the socket."""

    def __init__(self, socket: _Socket, camera: FaultyCamera, reply: Reply) -> None:
        super().__init__()
        self._socket = socket
        self._clock = camera.clock
        self._pieces = iter(reply.pieces)
        self._wire = _wire(reply, self._pieces)
        self._due = self._clock.now()
        self._rest = b""
        self.over = False

    def readable(self) -> bool:
        """Say yes."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Give what has come, or wait for it as long as the socket's timeout allows."""
        view = memoryview(buffer).cast("B")
        while not self._rest and not self.over:
            self._receive(self._clock.now())
        count = min(len(view), len(self._rest))
        view[:count] = self._rest[:count]
        self._rest = self._rest[count:]
        return count

    def close(self) -> None:
        """Tell the camera that nobody listens any more."""
        if not self.closed:
            close = getattr(self._pieces, "close", None)
            if close is not None:
                close()
        super().close()

    def _receive(self, asked: float) -> None:
        """Take pieces until there are bytes; time passes for pauses."""
        limit = self._socket.timeout
        # What was sent while nobody read lies in buffers, which are not endless.
        self._due = max(self._due, asked - _BUFFERED_S)
        for piece in self._wire:
            if isinstance(piece, Drop):
                self.over = True
                raise ConnectionResetError("Connection reset by peer")
            if isinstance(piece, Pause):
                self._due += piece.seconds
                self._wait(asked, limit)
            elif piece:
                self._rest = piece
                return
        self.over = True

    def _wait(self, asked: float, limit: float | None) -> None:
        now = self._clock.now()
        if limit is not None and self._due - asked > limit:
            self._clock.sleep(asked + limit - now)
            raise TimeoutError("timed out")
        self._clock.sleep(self._due - now)


def _wire(reply: Reply, pieces: Iterator[Piece]) -> Iterator[Piece]:
    """Turn an answer into what passes over the wire."""
    if reply.delay_s > 0.0:
        yield Pause(reply.delay_s)
    if reply.status == 0:
        # Hung up before the first word: the end of the stream, not a reset.
        return
    stated = any(name.lower() == "content-length" for name, _ in reply.headers)
    extra = () if stated else (("Transfer-Encoding", "chunked"),)
    yield head_of(reply.status, (*reply.headers, *extra))
    for piece in pieces:
        if stated or isinstance(piece, Pause | Drop):
            yield piece
        elif piece:
            yield b"%x\r\n%b\r\n" % (len(piece), piece)
    if not stated:
        yield b"0\r\n\r\n"


def _parsed(data: bytes, host: str) -> Request | None:
    """Read a request as http.client sends it; None while it is not whole."""
    head, gap, body = data.partition(b"\r\n\r\n")
    if not gap:
        return None
    lines = head.decode("latin-1").split("\r\n")
    method, target, _ = lines[0].split(" ", 2)
    pairs = (line.partition(":") for line in lines[1:])
    headers = {name.strip().lower(): value.strip() for name, _, value in pairs}
    if len(body) < int(headers.get("content-length", "0")):
        return None
    return Request(method, target, headers, body, headers.get("host", host))
