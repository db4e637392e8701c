"""The live preview: a camera's pictures, the newest always at hand.

`PreviewStream` reads in a thread of its own, over a connection of its own, and puts every picture
into a `Mailbox`, undecoded; whoever shows them takes the newest and decodes that one. Cameras end
their preview whenever they like (the SC2 at random, all of them when they are touched), and refuse
it for a while after a capture, so the stream asks again until it is stopped.
"""

from __future__ import annotations

import contextlib
import threading
from collections import deque
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from app.core.base.errors import Cancelled
from app.core.base.progress import Token
from app.devices.clock import wait
from app.devices.errors import BadReply, CameraRefused, DeviceError, PasswordNeeded, Unreachable
from app.devices.mjpeg import MjpegParser, boundary_of, jpeg_size

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

    from numpy.typing import NDArray

    from app.devices.clock import Clock
    from app.devices.mailbox import Mailbox
    from app.devices.profiles import ModelProfile
    from app.devices.theta.client import OscClient
    from app.devices.theta.link import Incoming
    from app.devices.theta.untrusted import JsonValue

__all__ = ["LOST_S", "MAX_SHAPE", "MjpegParser", "PreviewFrame", "PreviewState", "PreviewStream"]
__all__ += ["decode", "opened_preview"]

LOST_S: Final = 5.0
"""The preview counts as lost after so many seconds without a picture."""

MAX_SHAPE: Final = (2048, 4096)
"""Most rows and columns of a picture that is decoded."""

_FPS_OVER_S: Final = 1.0
_MAX_FPS: Final = 240
_BUSY_TRIES: Final = 4
_BUSY_S: Final = 0.5
_ENDED_S: Final = 0.1
_JOIN_S: Final = 0.05
_PAUSES_S: Final = (0.5, 1.0, 2.0)
_SETTLE_S: Final = 1.0  # cameras want it between options and a preview
_FLAGS: Final = cv2.IMREAD_COLOR_RGB | cv2.IMREAD_IGNORE_ORIENTATION


class PreviewState(StrEnum):
    """What a preview is doing."""

    OFF = "off"
    CONNECTING = "connecting"
    LIVE = "live"
    LOST = "lost"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class PreviewFrame:
    """One picture of the preview.

    `received_s`: the clock's time when its last byte was here.
    """

    jpeg: bytes = field(repr=False)
    number: int
    received_s: float


@contextlib.contextmanager
def opened_preview(client: OscClient, profile: ModelProfile) -> Iterator[Incoming]:
    """Open a camera's preview, in the best format for looking that it accepts.

    Raises `DeviceError` when the camera refuses or cannot be reached.
    """
    if profile.api_switch:
        client.use_api_2()
    _choose_format(client, profile)
    with client.live_preview() as incoming:
        yield incoming


def _choose_format(client: OscClient, profile: ModelProfile) -> None:
    """Set the first format that the camera knows, unless it is set already."""
    if not profile.previews:
        return
    now = client.get_options(["previewFormat"]).get("previewFormat")
    for width, height, rate in profile.previews:
        wanted: dict[str, JsonValue] = {"width": width, "height": height, "framerate": rate}
        if now == wanted:
            return
        try:
            client.set_options({"previewFormat": wanted})
        except CameraRefused as error:
            if not error.code.startswith("invalidParameter"):
                raise
        else:
            wait(client.clock, _SETTLE_S)
            return


def decode(frame: PreviewFrame) -> NDArray[np.uint8]:
    """Decode a picture, in the caller's thread.

    Returns (H, W, 3) uint8: sRGB, red first; at most `MAX_SHAPE`. Rotations that the file asks for
    are ignored. Raises `BadReply` when it is larger, or no JPEG that can be read. Hold the picture
    until the next one is decoded, as a screen does anyway: memory that is given back at once is
    asked of the system anew each time, which can cost as much as decoding.
    """
    shape = jpeg_size(frame.jpeg)
    if shape[0] > MAX_SHAPE[0] or shape[1] > MAX_SHAPE[1]:
        raise BadReply(
            f"A preview picture of {shape[1]} x {shape[0]} pixels is too large.", code="bad-picture"
        )
    try:
        picture = cv2.imdecode(np.frombuffer(frame.jpeg, np.uint8), _FLAGS)
    except cv2.error:
        picture = None
    if picture is None or picture.shape != (*shape, 3):
        raise BadReply("A preview picture of the camera is damaged.", code="bad-picture")
    return np.asarray(picture, np.uint8)


class PreviewStream:
    """Keeps a camera's preview coming until it is stopped.

    After an answer that ends, a broken connection or `LOST_S` without a picture it asks again:
    at once after an end, four times half a second apart where the camera refuses, and else after
    growing pauses up to two seconds. Where no camera would change its mind (wrong password, no
    preview) it gives up.

    * `open_preview`: asks for the preview over a connection that nothing else uses and gives the
      answer as a context manager, as `OscClient.live_preview` does. It is called anew for each try,
      and may first do what a fresh connection needs. Its reads should give up after `LOST_S`
      without a byte.
    * `cut`: ends the opening of that connection from another thread, as `Link.close` does, so that
      stopping need not wait for a camera that does not answer.
    """

    def __init__(
        self,
        open_preview: Callable[[], AbstractContextManager[Incoming]],
        mailbox: Mailbox[PreviewFrame],
        clock: Clock,
        cut: Callable[[], None] = lambda: None,
    ) -> None:
        self._open = open_preview
        self._mailbox = mailbox
        self._clock = clock
        self._cut = cut
        self._lock = threading.Lock()  # of what the properties tell
        self._switching = threading.Lock()  # of starting and stopping
        self._thread: threading.Thread | None = None
        self._token = Token()
        self._incoming: Incoming | None = None
        self._state = PreviewState.OFF
        self._error: DeviceError | None = None
        self._times: deque[float] = deque(maxlen=_MAX_FPS)
        self._last_s = clock.now()
        self._count = 0

    def start(self) -> None:
        """Begin, or begin again; does nothing while it runs."""
        with self._switching:
            if self._thread is not None and self._thread.is_alive():
                return
            self._token = Token()
            self._note(PreviewState.CONNECTING)
            self._last_s = self._clock.now()
            self._thread = threading.Thread(
                target=self._run, args=(self._token,), name="preview", daemon=True
            )
            self._thread.start()

    def stop(self) -> None:
        """Close the connection and wait for the thread; safe at any time and any number of times.

        When it returns the camera is free for a capture (Ricoh's want half a second to a second
        after it), and no further picture comes.
        """
        with self._switching:
            thread, self._thread = self._thread, None
            self._token.cancel()
            while thread is not None and thread.is_alive():
                # Again and again: the connection may only now be on its way.
                self._cut()
                incoming = self._incoming
                if incoming is not None:
                    incoming.close()
                thread.join(_JOIN_S)
            with self._lock:
                self._times.clear()
            self._note(PreviewState.OFF)

    @property
    def state(self) -> PreviewState:
        """What it is doing now."""
        with self._lock:
            silent = self._clock.now() - self._last_s > LOST_S
            trying = self._state in (PreviewState.CONNECTING, PreviewState.LIVE)
            return PreviewState.LOST if trying and silent else self._state

    @property
    def error(self) -> DeviceError | None:
        """What went wrong last, until pictures come again or it is stopped."""
        return self._error

    @property
    def fps(self) -> float:
        """Pictures per second, over the last second."""
        with self._lock:
            since = self._clock.now() - _FPS_OVER_S
            return sum(time > since for time in self._times) / _FPS_OVER_S

    @property
    def count(self) -> int:
        """How many pictures have come."""
        return self._count

    def _run(self, token: Token) -> None:
        failures = 0
        with contextlib.suppress(Cancelled):
            while True:
                before = self._count
                error = self._attempt(token)
                token.check()
                came = self._count > before
                failures = 0 if came else failures + 1
                if error is None and not came:
                    error = Unreachable("The camera ended its preview without a picture.")
                if _is_final(error):
                    self._note(PreviewState.FAILED, error)
                    return
                busy = isinstance(error, CameraRefused) and failures < _BUSY_TRIES
                going_on = busy or error is None
                self._note(PreviewState.CONNECTING if going_on else PreviewState.LOST, error)
                wait(self._clock, _pause(error, failures), token)

    def _attempt(self, token: Token) -> DeviceError | None:
        """Ask for the preview and deliver it until it ends; say why, where something failed."""
        token.check()
        try:
            with self._open() as incoming:
                self._incoming = incoming
                self._receive(incoming, token)
        except DeviceError as error:
            return error
        finally:
            self._incoming = None
        return None

    def _receive(self, incoming: Incoming, token: Token) -> None:
        """Deliver pictures until the answer ends."""
        parser = MjpegParser(boundary_of(incoming.headers.get("content-type", "")))
        since = self._clock.now()
        for chunk in incoming.chunks():
            if token.cancelled:
                return
            now = self._clock.now()
            for jpeg in parser.feed(chunk):
                self._deliver(jpeg, now)
                since = now
            if now - since > LOST_S:
                raise Unreachable(
                    f"The camera has sent no preview picture for {LOST_S:.0f} seconds.",
                    "Check that it is switched on and near.",
                    "timeout",
                )

    def _deliver(self, jpeg: bytes, now: float) -> None:
        with self._lock:
            number, self._count = self._count, self._count + 1
            self._times.append(now)
            self._last_s = now
            self._state, self._error = PreviewState.LIVE, None
        self._mailbox.put(PreviewFrame(jpeg, number, now))

    def _note(self, state: PreviewState, error: DeviceError | None = None) -> None:
        with self._lock:
            self._state, self._error = state, error


def _is_final(error: DeviceError | None) -> bool:
    if isinstance(error, PasswordNeeded):
        return True
    return isinstance(error, CameraRefused) and error.code == "unknownCommand"


def _pause(error: DeviceError | None, failures: int) -> float:
    if error is None:
        return _ENDED_S
    if isinstance(error, CameraRefused):
        return _BUSY_S if failures < _BUSY_TRIES else _PAUSES_S[-1]
    return _PAUSES_S[min(max(failures, 1), len(_PAUSES_S)) - 1]
