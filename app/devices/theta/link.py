"""HTTP communication with one camera: one request at a time, limited in size and time.

`requests` prepares each request, and one of its adapters sends it. `requests.Session.send` is not
used, because it applies proxies and cookies, and reads the whole body of a redirect or a 401
regardless of its length.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import Any, Final

import requests
from requests.adapters import BaseAdapter

from app.devices.bounded_socket import Watch, WatchedAdapter
from app.devices.clock import Clock
from app.devices.passwords import (
    Credentials,
    Digest,
    password_needed,
    password_refused,
    wants_digest,
)
from app.devices.theta.endpoint import Endpoint
from app.devices.theta.network_errors import (
    CLOSED,
    NETWORK_ERRORS,
    broken,
    failure,
    no_camera,
    timeout,
)
from app.devices.theta.reply import ERROR_BYTES, Incoming, Timeouts, judge_json, judge_stream
from app.devices.theta.untrusted import MAX_BYTES, JsonValue, write_json

_HEADERS: Final = {
    "Accept": "application/json",
    "Accept-Encoding": "identity",  # nothing is decompressed, so no reply can expand in memory
    "Cache-Control": "no-store",
    "User-Agent": "Turnlight",
    "X-XSRF-Protected": "1",
}
_JSON_TYPE: Final = {"Content-Type": "application/json;charset=utf-8"}
_UNAUTHORIZED: Final = 401
_KEEP_S: Final = 3.0  # seconds after which an idle connection is no longer trusted
_ANSWERS: Final = 3


class Link:
    """The connection to one camera.

    Args:
        adapter: Adapter that sends the requests, or None for real connections. The adapter
            must return bytes as they arrive.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        clock: Clock,
        credentials: Credentials | None = None,
        *,
        adapter: BaseAdapter | None = None,
        timeouts: Timeouts | None = None,
    ) -> None:
        self.endpoint = endpoint
        self.timeouts = timeouts or Timeouts()
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
        """Request JSON.

        Raises:
            Unreachable: If nothing answers in time or the connection breaks.
            NotACamera: If something other than a camera answers.
            PasswordNeeded: If the camera requires a password or rejects the one given.
            CameraRefused: If the reply is an HTTP error.
            BadReply: If the reply is too large or cannot be read.
        """
        return self._exchange(self._request("GET", path), patience_s)

    def post(
        self, path: str, body: Mapping[str, Any] | None, patience_s: float | None = None
    ) -> JsonValue:
        """Send JSON, or an empty body if `body` is None, and read the reply as JSON.

        Raises:
            DeviceError: As in `get`.
        """
        return self._exchange(self._request("POST", path, body), patience_s)

    @contextmanager
    def stream(
        self,
        url: str,
        headers: Mapping[str, str] | None = None,
        body: Mapping[str, Any] | None = None,
    ) -> Iterator[Incoming]:
        """Open a file, or a command's stream if `body` is given, until the ``with`` block ends.

        Raises:
            DeviceError: As in `get`, when the stream is opened and while it is read.
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
        """End all streams and connections. The link can be used again afterwards."""
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
        """Allow only one request at a time, since cameras confuse concurrent requests."""
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
        """Send a request, with a password if the camera requires one, and leave the body unread."""
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
        """Store the challenge of a 401, and return whether only the nonce was stale."""
        challenge = reply.headers.get("www-authenticate", "")
        try:
            if not wants_digest(challenge):
                raise no_camera()
            if self._digest is None:
                raise password_needed()
            reply.whole(ERROR_BYTES)
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
