"""HTTP to one camera: one request at a time, with bounded replies and bounded waiting.

`requests` prepares a request and an adapter of its kind carries it. Its `Session.send` is not
used: that follows proxies and cookies, and reads the whole body of a redirect or a 401, however
long it is.
"""

from __future__ import annotations

import threading
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any, Final

import requests

from app.devices.theta.digest import (
    Credentials,
    Digest,
    password_needed,
    password_refused,
    wants_digest,
)
from app.devices.theta.failures import CLOSED, NETWORK_ERRORS, broken, failure, no_camera, timeout
from app.devices.theta.reply import Incoming, Reply, Timeouts
from app.devices.theta.transport import Transport, Watch
from app.devices.theta.untrusted import MAX_BYTES, JsonValue, write_json
from app.devices.theta.verdict import judge_json, judge_stream

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from requests.adapters import BaseAdapter

    from app.devices.clock import Clock
    from app.devices.theta.endpoint import Endpoint

__all__ = ["Credentials", "Incoming", "Link", "Timeouts"]

_HEADERS: Final = {
    "Accept": "application/json",
    "Accept-Encoding": "identity",  # nothing is unpacked, so nothing can swell
    "Cache-Control": "no-store",
    "User-Agent": "Turnlight",
    "X-XSRF-Protected": "1",
}
_JSON_TYPE: Final = {"Content-Type": "application/json;charset=utf-8"}
_UNAUTHORIZED: Final = 401
_ERROR_BYTES: Final = 65536
_KEEP_S: Final = 3.0  # an idle connection is not trusted longer
_ANSWERS: Final = 3


class Link:
    """A way to one camera.

    Parameters
    ----------
    adapter : BaseAdapter, optional
        Carries the requests; real connections when left out. Must return bytes as they come.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        clock: Clock,
        credentials: Credentials | None = None,
        *,
        adapter: BaseAdapter | None = None,
        timeouts: Timeouts = Timeouts(),  # noqa: B008 - frozen
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

        Raises
        ------
        Unreachable
            When nothing answers in time or the connection breaks.
        NotACamera
            When a web page or another program answers.
        PasswordNeeded
            When the camera wants a password, or another one.
        CameraRefused
            When it answers with an HTTP error.
        BadReply
            When the reply is too large or cannot be read.
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
        url_or_path: str,
        *,
        headers: Mapping[str, str] | None = None,
        method: str = "GET",
        body: Mapping[str, Any] | None = None,
        parallel: bool = False,
    ) -> Iterator[Incoming]:
        """Open something long: a file or the live preview.

        Parameters
        ----------
        method : str, optional
            "GET" or "POST".

        Yields
        ------
        Incoming
            The open reply; its connection is given back at the end of the block.

        Raises
        ------
        DeviceError
            As `get`, while it is opened or read.
        """
        data = b"" if body is None else write_json(body)
        watch = Watch(self._clock)
        with ExitStack() as stack:
            self._streams.add(watch)
            stack.callback(self._streams.discard, watch)
            # Entered first, so that it ends last: after the connection was given back.
            turn = stack.enter_context(ExitStack())
            turn.enter_context(self._turn())
            reply = self._open(
                method, url_or_path, data, watch, headers or {}, self.timeouts.idle_s
            )
            stack.callback(reply.release)
            judge_stream(reply)
            if parallel:
                turn.close()
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
    ) -> Reply:
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

    def _challenged(self, reply: Reply) -> bool:
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
    ) -> Reply:
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
        reply = Reply(response, watch, self._clock, limits)
        if watch.late:
            reply.release()
            raise timeout()
        return reply
