"""HTTP to one camera: one request at a time, with bounded replies and bounded waiting.

`requests` prepares a request and an adapter of its kind carries it. Its `Session.send` is not
used: that follows proxies and cookies, and reads the whole body of a redirect or a 401, however
long it is.
A reply's body is read piece by piece, within limits of size, time and pace.
What goes wrong below HTTP is said by `failure`, and the camera's own error codes by `REFUSALS`.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from http.client import BadStatusLine, RemoteDisconnected, UnknownProtocol
from types import MappingProxyType
from typing import Any, Final

import requests
from requests.adapters import BaseAdapter
from urllib3 import BaseHTTPResponse
from urllib3 import exceptions as urllib3_errors

from app.core.text import tr
from app.devices.bounded_socket import Watch, WatchedAdapter
from app.devices.clock import Clock
from app.devices.errors import BadReply, CameraRefused, DeviceError, NotACamera, Unreachable
from app.devices.passwords import (
    Credentials,
    Digest,
    password_needed,
    password_refused,
    wants_digest,
)
from app.devices.theta.endpoint import Endpoint
from app.devices.theta.untrusted import MAX_BYTES, JsonValue, parse_json, table, words, write_json

BUSY: Final = "serviceUnavailable"
"""The one code after which the same request may simply be sent again."""

_UPDATE: Final = tr(
    "Update the camera's firmware with Ricoh's app; if it is new, tell us the model."
)
_RESTART: Final = tr("Restart the camera, then try again.")
_WAIT: Final = tr("Wait a few seconds, then try again.")
REFUSALS: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "unknownCommand": (tr("The camera does not know this command."), _UPDATE),
        "missingParameter": (tr("The request to the camera was incomplete."), _UPDATE),
        "invalidParameterName": (tr("The camera does not know one of the settings."), _UPDATE),
        "invalidParameterValue": (
            tr("The camera does not accept a value, or the file is no longer on it."),
            tr("Connect again, so that the camera's own lists are read again."),
        ),
        "tooManyParameters": (tr("The camera was sent too much at once."), _UPDATE),
        "disabledCommand": (
            tr("The camera cannot do this at the moment."),
            tr(
                "Wait until it has finished, close plug-ins, set it to still pictures, "
                "then try again."
            ),
        ),
        "corruptedFile": (
            tr("A file on the camera is damaged."),
            tr("Take the picture again; if it happens often, check the camera's storage."),
        ),
        "powerOffSequenceRunning": (
            tr("The camera is switching itself off."),
            tr("Switch it on again and charge it if needed."),
        ),
        "invalidFileFormat": (
            tr("The camera cannot store pictures in this format."),
            tr("Choose another picture size."),
        ),
        "canceledShooting": (tr("The shot was cancelled on the camera."), tr("Start it again.")),
        "canceledConversion": (
            tr("The conversion was cancelled on the camera."),
            tr("Start it again."),
        ),
        BUSY: (tr("The camera is busy."), _WAIT),
        "unexpected": (tr("The camera has an internal error."), _RESTART),
        "serverError": (tr("The camera has an internal error."), _RESTART),
        "notFound": (
            tr("This is not on the camera."),
            tr("The file may have been deleted; look at the camera's pictures."),
        ),
        "invalidSessionId": (tr("The camera closed the connection."), tr("Reconnect the camera.")),
        "cameraInExclusiveUse": (
            tr("Another app is using the camera."),
            tr("Close it on the other device, or switch the camera's Wi-Fi off and on."),
        ),
        "unactivated": (
            tr("The camera is not activated yet."),
            tr("Activate it with its maker's app, then connect again."),
        ),
    }
)
"""Error code of the camera: a sentence, and what to do next."""

_UNKNOWN: Final = (tr("The camera refused."), _WAIT)
_CODE: Final = re.compile(r"[A-Za-z][A-Za-z0-9_.-]{0,59}")
_BY_STATUS: Final = MappingProxyType({404: "notFound", 416: "invalidParameterValue", 503: BUSY})
CLOSED: Final = "closed"
"""Code of the error that a reader gets whose stream was closed from another thread."""

BROKEN: Final = "broken"
"""Code of a connection that ended too early."""

NOBODY: Final = "connection-refused"
"""Code of an address at which a computer refuses the connection: no program listens there."""

NO_SUCH_NAME: Final = "no-such-name"
"""Code of a name that nobody in the network has."""

# UnicodeError and ValueError: names that no resolver takes, chunk lengths that are no numbers.
NETWORK_ERRORS: Final = (
    requests.RequestException,
    urllib3_errors.HTTPError,
    OSError,
    UnicodeError,
    ValueError,
)
"""Everything that `requests`, `urllib3` and the sockets below them raise."""

_WIFI: Final = tr("Check that the camera is on and this computer is in its Wi-Fi, then try again.")
_NEARER: Final = tr("Go nearer to the camera, then try again; what has arrived is kept.")
_TIMEOUTS: Final = (
    requests.Timeout,
    urllib3_errors.TimeoutError,
    TimeoutError,
)
_NONSENSE: Final = (
    requests.exceptions.InvalidHeader,
    requests.exceptions.ContentDecodingError,
    urllib3_errors.InvalidHeader,
    urllib3_errors.DecodeError,
    urllib3_errors.ResponseNotChunked,
)


def refused(value: JsonValue, status: int) -> CameraRefused | None:
    """Find an error object in a message."""
    message = table(value)
    error = message.get("error")
    if not isinstance(error, dict) and message.get("state") != "error":
        return None
    fields = table(error)
    return refusal(words(fields.get("code")), status, words(fields.get("message")))


def bare_refusal(status: int) -> CameraRefused:
    """Make the error for a reply that has only an HTTP status."""
    return refusal(_BY_STATUS.get(status, "unexpected"), status)


def refusal(code: str, status: int, message: str = "") -> CameraRefused:
    """Make the error for what a camera answered.

    * `code`: the camera's; one that does not look like a code is taken as "unexpected".
    * `message`: the camera's own sentence, shown only for a code that `REFUSALS` does not know.

    With code and status kept.
    """
    sound = code if _CODE.fullmatch(code) else "unexpected"
    sentence, hint = REFUSALS.get(sound, _UNKNOWN)
    if sound not in REFUSALS:
        sentence = tr('The camera refused: "{said}".', said=message or sound)
    return CameraRefused(sentence, hint, sound, status)


def timeout() -> Unreachable:
    """Say that nothing came in time."""
    return Unreachable(tr("The camera does not answer in time."), _WIFI, "timeout")


def broken(code: str = "") -> Unreachable:
    """Say that the connection ended too early."""
    return Unreachable(tr("The connection to the camera broke."), _NEARER, code or BROKEN)


def no_camera() -> NotACamera:
    """Say that something else answers."""
    return NotACamera(
        tr("Something answers at this address, but it is not a 360 camera."),
        tr(
            "It is probably the router of your own network: choose the camera's "
            'Wi-Fi (its name ends in ".OSC"), or type the address that the camera '
            "has in this network."
        ),
    )


def failure(error: BaseException) -> DeviceError:
    """Say what a failed request means.

    `Unreachable` for silence, refusal and broken connections, `NotACamera` where something speaks
    another language, `BadReply` for headers that make no sense.
    """
    chain = tuple(_chain(error))
    # urllib3 derives its errors of names and refused connections from its timeouts.
    if any(isinstance(link, (urllib3_errors.NameResolutionError, UnicodeError)) for link in chain):
        return Unreachable(
            tr("No camera of this name is in the network."),
            tr("Check the spelling, or type the camera's address in numbers."),
            NO_SUCH_NAME,
        )
    if any(isinstance(link, urllib3_errors.NewConnectionError) for link in chain):
        closed = any(isinstance(link, ConnectionRefusedError) for link in chain)
        code = NOBODY if closed else ""
        return Unreachable(tr("Nothing answers at the camera's address."), _WIFI, code)
    if any(isinstance(link, _TIMEOUTS) for link in chain):
        return timeout()
    if any(_foreign(link) for link in chain):
        return no_camera()
    if any(isinstance(link, _NONSENSE) for link in chain):
        return BadReply(
            tr("The camera sent an invalid response."), tr("Restart the camera, then try again.")
        )
    return broken()


def _foreign(error: BaseException) -> bool:
    return isinstance(error, (BadStatusLine, UnknownProtocol)) and not isinstance(
        error, RemoteDisconnected
    )


def _chain(error: BaseException) -> Iterator[BaseException]:
    """Walk an error and what it carries; each once."""
    waiting, visited = [error], set()
    while waiting:
        link = waiting.pop()
        if id(link) in visited:
            continue
        visited.add(id(link))
        yield link
        causes = (*link.args, getattr(link, "reason", None), link.__cause__, link.__context__)
        waiting.extend(item for item in causes if isinstance(item, BaseException))


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
        waits_s, count = 0.0, 0
        pieces = self._pieces(size)
        while True:
            start = self._clock.now()
            self._watch.allow(idle_s)
            piece = self._next(pieces)
            if piece is None:
                return
            waits_s += self._clock.now() - start
            count += len(piece)
            if waits_s >= idle_s:
                if count < least:
                    raise timeout()
                waits_s, count = 0.0, 0
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
            raise _packed_error()
        if self.headers.get("transfer-encoding", "").strip().lower() not in _WHOLE:
            raise _packed_error()
        count = 0
        for piece in _raw_pieces(self._response, size):
            count += len(piece)
            yield piece
        if self.length is not None and count < self.length:
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


def _packed_error() -> BadReply:
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
    _raise_error_within(reply.whole(_ERROR_BYTES), reply.status)
    if _NOT_OK <= reply.status < _ERRORS:
        raise no_camera()
    if reply.status >= _ERRORS:
        raise bare_refusal(reply.status)
    raise BadReply(tr("The camera sent something other than the file."), tr("Try again."))


def _raise_error_within(data: bytes, status: int) -> None:
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
        self._adapter: BaseAdapter = adapter if adapter is not None else WatchedAdapter()
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
        return self._exchange(self._request("GET", path), patience_s)

    def post(
        self, path: str, body: Mapping[str, Any] | None, patience_s: float | None = None
    ) -> JsonValue:
        """Send JSON, or nothing where the body is None, and read JSON; as `get`."""
        return self._exchange(self._request("POST", path, body), patience_s)

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
            request = self._request("GET" if body is None else "POST", url, body, headers)
            reply = self._open(request, watch, self.timeouts.idle_s)
            stack.callback(reply.release)
            judge_stream(reply)
            yield reply

    def close(self) -> None:
        """End all streams and connections; the link can be used again."""
        for watch in tuple(self._streams):
            watch.close()
        self._session.close()

    def _request(
        self,
        method: str,
        path: str,
        body: Mapping[str, Any] | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> requests.Request:
        all_headers = {**(_JSON_TYPE if method == "POST" else {}), **(headers or {})}
        data = None if body is None else write_json(body)
        return requests.Request(method, self.endpoint.url(path), headers=all_headers, data=data)

    def _exchange(self, request: requests.Request, patience_s: float | None) -> JsonValue:
        quiet_s = min(self.timeouts.read_s, patience_s or self.timeouts.read_s)
        with self._turn():
            reply = self._open(request, Watch(self._clock), quiet_s)
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

    def _open(self, request: requests.Request, watch: Watch, quiet_s: float) -> Incoming:
        """Send a request, with a password where the camera wants one; the body is unread."""
        watch.allow(self.timeouts.whole_s)
        if isinstance(self._adapter, WatchedAdapter):
            self._adapter.watch = watch
            if self._clock.now() - self._used_s > _KEEP_S:
                self._adapter.close()
        has_answer = False
        for _ in range(_ANSWERS):
            signed = self._digest is not None and self._digest.ready
            reply = self._send(request, watch, quiet_s)
            if reply.status != _UNAUTHORIZED:
                return reply
            stale = self._challenged(reply)
            if signed and has_answer and not stale:
                break
            has_answer = True
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

    def _send(self, request: requests.Request, watch: Watch, quiet_s: float) -> Incoming:
        limits = self.timeouts
        try:
            prepared_request = self._session.prepare_request(request)
            if self._digest is not None and self._digest.ready:
                answer = self._digest.answer(
                    str(prepared_request.method), str(prepared_request.url)
                )
                prepared_request.headers["Authorization"] = answer
            response = self._adapter.send(
                prepared_request, stream=True, timeout=(limits.connect_s, quiet_s), proxies={}
            )
        except NETWORK_ERRORS as error:
            raise (broken(CLOSED) if watch.closed else failure(error)) from error
        reply = Incoming(response, watch, self._clock, limits)
        if watch.late:
            reply.release()
            raise timeout()
        return reply
