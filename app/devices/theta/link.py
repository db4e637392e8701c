"""HTTP to one camera: one request at a time, with bounded replies and bounded waiting.

`requests` prepares a request and an adapter of its kind carries it. Its `Session.send` is not
used: that follows proxies and cookies, and reads the whole body of a redirect or a 401, however
long it is.
A reply's body is read piece by piece, within limits of size, time and pace.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import requests
from requests.adapters import BaseAdapter
from urllib3 import BaseHTTPResponse

from app.core.text import tr
from app.devices.bounded_socket import Transport, Watch
from app.devices.clock import Clock
from app.devices.errors import BadReply, CameraRefused
from app.devices.passwords import (
    Credentials,
    Digest,
    password_needed,
    password_refused,
    wants_digest,
)
from app.devices.theta.errors import (
    CLOSED,
    NETWORK_ERRORS,
    bare_refusal,
    broken,
    failure,
    no_camera,
    refused,
    timeout,
)
from app.devices.theta.untrusted import MAX_BYTES, JsonValue, parse_json, write_json

if TYPE_CHECKING:
    from app.devices.theta.endpoint import Endpoint

_OK: Final = 200
_STREAMS: Final = frozenset({200, 206})
_NOT_OK: Final = 300
_ERRORS: Final = 400
_SERVER_ERRORS: Final = 500
_ELSEWHERE: Final = frozenset({404, 405, 407, 410, 421, 426, 451, 511})
_ERROR_BYTES: Final = 65536
_PAGE: Final = re.compile(rb"[\s\xef\xbb\xbf]*<")
_CHUNK: Final = 65536
_LENGTH_DIGITS: Final = 15
_PLAIN: Final = frozenset({"", "identity"})
_WHOLE: Final = frozenset({"", "identity", "chunked"})

_HEADERS: Final = {
    "Accept": "application/json",
    "Accept-Encoding": "identity",  # nothing is unpacked, so nothing can swell
    "Cache-Control": "no-store",
    "User-Agent": "Turnlight",
    "X-XSRF-Protected": "1",
}
_JSON_TYPE: Final = {"Content-Type": "application/json;charset=utf-8"}
_UNAUTHORIZED: Final = 401
_KEEP_S: Final = 3.0  # an idle connection is not trusted longer
_ANSWERS: Final = 3


@dataclass(frozen=True, slots=True)
class Timeouts:
    """How long a camera may take, in seconds of the clock."""

    connect_s: float = 3.0
    read_s: float = 20.0
    whole_s: float = 60.0
    idle_s: float = 10.0
    least_bytes: int = 1024


class Incoming:
    """A reply whose body is still to be read."""

    def __init__(
        self, response: requests.Response, watch: Watch, clock: Clock, timeouts: Timeouts
    ) -> None:
        self.status = response.status_code
        self.headers: Mapping[str, str] = {
            str(name).lower(): str(value) for name, value in response.headers.items()
        }
        self.length = _length(self.headers)
        self._response = response
        self._watch = watch
        self._clock = clock
        self._timeouts = timeouts

    def chunks(self, size: int = _CHUNK) -> Iterator[bytes]:
        """Read the body as it comes.

        `size`: most bytes in a piece. Raises `Unreachable` when the connection breaks, falls
        silent, brings too little, or is closed by `Link.close`.
        """
        idle_s, least = self._timeouts.idle_s, self._timeouts.least_bytes
        waited, brought = 0.0, 0
        pieces = self._pieces(size)
        while True:
            start = self._clock.now()
            self._watch.allow(idle_s)
            piece = self._next(pieces)
            if piece is None:
                return
            waited += self._clock.now() - start
            brought += len(piece)
            if waited >= idle_s:
                if brought < least:
                    raise timeout()
                waited, brought = 0.0, 0
            yield piece

    def whole(self, most: int) -> bytes:
        """Read all of a short body before the watch's deadline.

        Raises `BadReply` when it is larger; the code is "too-large"; `Unreachable` as `chunks`.
        """
        data = bytearray()
        pieces = self._pieces(min(_CHUNK, most + 1))
        while (piece := self._next(pieces)) is not None:
            data += piece
            if len(data) > most:
                raise BadReply(
                    tr("The camera's answer is too large."),
                    tr("Switch it off and on."),
                    "too-large",
                )
        return bytes(data)

    def release(self) -> None:
        """Give the connection back; it is cut unless all of the body was read."""
        self._response.close()

    def _next(self, pieces: Iterator[bytes]) -> bytes | None:
        self._check_open()
        try:
            piece = next(pieces, None)
        except NETWORK_ERRORS as error:
            self._check_open()
            raise failure(error) from error
        self._check_open()
        if piece is not None and self._watch.late:
            raise timeout()
        return piece

    def _check_open(self) -> None:
        if self._watch.closed:
            raise broken(CLOSED)

    def _pieces(self, size: int) -> Iterator[bytes]:
        """Read until the end, and find out whether it came too early."""
        if self.headers.get("content-encoding", "").strip().lower() not in _PLAIN:
            raise _packed()
        if self.headers.get("transfer-encoding", "").strip().lower() not in _WHOLE:
            raise _packed()
        received = 0
        for piece in _raw_pieces(self._response, size):
            received += len(piece)
            yield piece
        if self.length is not None and received < self.length:
            raise broken()


def _raw_pieces(response: requests.Response, size: int) -> Iterator[bytes]:
    """Take bytes as they come: `iter_content` would wait until a piece is full."""
    if not isinstance(response.raw, BaseHTTPResponse):
        yield from (piece for piece in response.iter_content(size) if piece)
        return
    while piece := response.raw.read1(size, decode_content=False):
        yield piece


def _length(headers: Mapping[str, str]) -> int | None:
    text = headers.get("content-length", "").strip()
    if "chunked" in headers.get("transfer-encoding", "").lower():
        return None
    sound = text.isascii() and text.isdigit() and len(text) <= _LENGTH_DIGITS
    return int(text) if sound else None


def _packed() -> BadReply:
    return BadReply(
        tr("The camera sent its answer in an unexpected encoding."),
        tr("Switch the camera off and on; if that does not help, update its firmware."),
        "packed",
    )


def judge_json(reply: Incoming, data: bytes) -> JsonValue:
    """Read a reply that should be JSON.

    Returns the value; an error object inside a good reply is left to the reader of the message.
    Raises `CameraRefused` for an HTTP error, with the camera's code where it gave one; `NotACamera`
    for a web page, a redirect or an unknown path; `BadReply` for anything else that is no
    JSON.
    """
    if _OK <= reply.status < _NOT_OK:
        if _is_page(reply, data):
            raise no_camera()
        return parse_json(data)
    _raise_error_within(data, reply.status)
    elsewhere = reply.status < _ERRORS or reply.status in _ELSEWHERE
    if elsewhere or (reply.status < _SERVER_ERRORS and _is_page(reply, data)):
        raise no_camera()
    raise bare_refusal(reply.status)


def judge_stream(reply: Incoming) -> None:
    """Make sure that a reply is something to be streamed.

    Raises `CameraRefused` for an HTTP error, and for an error object where a file should be; 404 is
    "notFound"; `NotACamera` for a redirect, and for a web page where a file should be; `BadReply`
    for a reply of any other kind.
    """
    kind = reply.headers.get("content-type", "").lower()
    if reply.status in _STREAMS:
        if "html" in kind:
            raise no_camera()
        if "json" not in kind:
            return
    data = reply.whole(_ERROR_BYTES)
    _raise_error_within(data, reply.status)
    if _NOT_OK <= reply.status < _ERRORS:
        raise no_camera()
    if reply.status >= _ERRORS:
        raise bare_refusal(reply.status)
    raise BadReply(tr("The camera sent something other than the file."), tr("Try again."))


def _raise_error_within(data: bytes, status: int) -> None:
    error: CameraRefused | None = None
    with suppress(BadReply):
        error = refused(parse_json(data), status)
    if error is not None:
        raise error


def _is_page(reply: Incoming, data: bytes) -> bool:
    return "html" in reply.headers.get("content-type", "").lower() or bool(_PAGE.match(data))


__all__ = ["Credentials", "Incoming", "Link", "Timeouts"]


class Link:
    """A way to one camera.

    `adapter`: carries the requests; real connections when left out. Must return bytes as they come.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        clock: Clock,
        credentials: Credentials | None = None,
        *,
        adapter: BaseAdapter | None = None,
        timeouts: Timeouts = Timeouts(),
    ) -> None:
        self.endpoint = endpoint
        self.timeouts = timeouts
        self._clock = clock
        self._digest = Digest(credentials) if credentials is not None else None
        self._adapter: BaseAdapter = adapter if adapter is not None else Transport()
        self._session = requests.Session()
        self._session.trust_env = False
        self._session.headers.clear()
        self._session.headers.update(_HEADERS)
        self._session.mount("http://", self._adapter)
        self._lock = threading.Lock()
        self._holder: int | None = None
        self._streams: set[Watch] = set()
        self._used_s = clock.now()

    def get(self, path: str, patience_s: float | None = None) -> JsonValue:
        """Ask for JSON.

        Raises `Unreachable` when nothing answers in time or the connection breaks; `NotACamera`
        when a web page or another program answers; `PasswordNeeded` when the camera wants a
        password, or another one; `CameraRefused` when it answers with an HTTP error; `BadReply`
        when the reply is too large or cannot be read.
        """
        return self._exchange("GET", path, b"", patience_s)

    def post(
        self, path: str, body: Mapping[str, Any] | None, patience_s: float | None = None
    ) -> JsonValue:
        """Send JSON, or nothing where the body is None, and read JSON; as `get`."""
        return self._exchange("POST", path, b"" if body is None else write_json(body), patience_s)

    @contextmanager
    def stream(
        self,
        url: str,
        headers: Mapping[str, str] | None = None,
        body: Mapping[str, Any] | None = None,
    ) -> Iterator[Incoming]:
        """Open a file, or with a body what a command sends; given back at the end of the block.

        Raises `DeviceError` as `get`, while it is opened or read.
        """
        watch = Watch(self._clock)
        with ExitStack() as stack:
            self._streams.add(watch)
            stack.callback(self._streams.discard, watch)
            stack.enter_context(self._turn())
            method, data = ("GET", b"") if body is None else ("POST", write_json(body))
            reply = self._open(method, url, data, watch, headers or {}, self.timeouts.idle_s)
            stack.callback(reply.release)
            judge_stream(reply)
            yield reply

    def close(self) -> None:
        """End all streams and connections; the link can be used again."""
        for watch in tuple(self._streams):
            watch.close()
        self._session.close()

    def _exchange(self, method: str, path: str, body: bytes, patience_s: float | None) -> JsonValue:
        quiet_s = min(self.timeouts.read_s, patience_s or self.timeouts.read_s)
        with self._turn():
            reply = self._open(method, path, body, Watch(self._clock), {}, quiet_s)
            try:
                data = reply.whole(MAX_BYTES)
            finally:
                reply.release()
        return judge_json(reply, data)

    @contextmanager
    def _turn(self) -> Iterator[None]:
        """Let one request after the other through: cameras mix up two at a time."""
        if self._holder == threading.get_ident():
            raise RuntimeError("a stream of this link is still open in this thread")
        with self._lock:
            self._holder = threading.get_ident()
            try:
                yield
            finally:
                self._holder = None
                self._used_s = self._clock.now()

    def _open(
        self,
        method: str,
        path: str,
        body: bytes,
        watch: Watch,
        headers: Mapping[str, str],
        quiet_s: float,
    ) -> Incoming:
        """Send a request, with a password where the camera wants one; the body is unread."""
        url = self.endpoint.url(path)
        watch.allow(self.timeouts.whole_s)
        if isinstance(self._adapter, Transport):
            self._adapter.watch = watch
            if self._clock.now() - self._used_s > _KEEP_S:
                self._adapter.close()
        answered = False
        for _ in range(_ANSWERS):
            signed = self._digest is not None and self._digest.ready
            reply = self._send(method, url, body, watch, headers, quiet_s)
            if reply.status != _UNAUTHORIZED:
                return reply
            stale = self._challenged(reply)
            if signed and answered and not stale:
                break
            answered = True
        raise password_refused()

    def _challenged(self, reply: Incoming) -> bool:
        """Take in a 401: whether only the nonce was too old."""
        challenge = reply.headers.get("www-authenticate", "")
        try:
            if not wants_digest(challenge):
                raise no_camera()
            if self._digest is None:
                raise password_needed()
            reply.whole(_ERROR_BYTES)
        finally:
            reply.release()
        return self._digest.take(challenge)

    def _send(
        self,
        method: str,
        url: str,
        body: bytes,
        watch: Watch,
        headers: Mapping[str, str],
        quiet_s: float,
    ) -> Incoming:
        extra = {**(_JSON_TYPE if method == "POST" else {}), **headers}
        limits = self.timeouts
        try:
            request = self._session.prepare_request(
                requests.Request(method, url, headers=extra, data=body or None)
            )
            if self._digest is not None and self._digest.ready:
                request.headers["Authorization"] = self._digest.answer(method, str(request.url))
            response = self._adapter.send(
                request, stream=True, timeout=(limits.connect_s, quiet_s), proxies={}
            )
        except NETWORK_ERRORS as error:
            raise (broken(CLOSED) if watch.closed else failure(error)) from error
        reply = Incoming(response, watch, self._clock, limits)
        if watch.late:
            reply.release()
            raise timeout()
        return reply
