"""The base class of all live cameras, and the thread that each of them runs.

The thread opens the device, delivers frames in one format, and reopens the device after a failure.
"""

from __future__ import annotations

import atexit
import contextlib
import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

import numpy as np

from app.core.base.arrays import Bytes
from app.core.base.errors import Cancelled
from app.core.base.progress import Token
from app.core.text import tr
from app.devices.clock import Clock, wait
from app.devices.errors import DeviceError
from app.devices.latest_frame import Mailbox

LOST_S: Final = 2.0
"""Seconds without a frame after which a webcam counts as lost."""

_OVER_S: Final = 2.0  # seconds over which frames are counted
_MOST: Final = 400
_NOTHING_S: Final = 0.02
_FROZEN_S: Final = 4.0
_BLACK: Final = 12
_SLOW_FPS: Final = 5.0
_SLOW_AFTER_S: Final = 4.0
_FINAL: Final = frozenset({"password", "password-refused"})
_LEAVING_S: Final = 12.0

_RUNNING: dict[threading.Thread, tuple[Token, Callable[[], None]]] = {}
GUESS_FOV_DEG: Final = 65.0
"""Horizontal field of view used for drawing if the true one is unknown, in degrees.

Most webcams have 60 to 78 degrees.
"""


@dataclass(frozen=True, slots=True)
class Manner:
    """The name of a kind of source, with the hints and timeouts that apply to it.

    Attributes:
        pauses_s: Pauses, in seconds, before the source is reopened: after a frame, after the first
            failure, and so on. The last pause repeats.
        still: Whether the same frame may legitimately repeat forever.
        silence_s: Seconds without a frame after which the source is reopened. The source counts as
            lost earlier, but a camera that serves one client may not accept another immediately.
    """

    noun: str = tr("webcam")
    revive: str = tr("Unplug it and plug it in again.")
    quicken: str = tr("Add light, or use another USB port.")
    pauses_s: tuple[float, ...] = (0.5, 1.0, 2.0)
    still: bool = False
    silence_s: float = LOST_S


WEBCAM: Final = Manner()
"""Defaults for a webcam plugged into this computer."""


class Webcam(ABC):
    """A live camera with its own thread.

    Each kind of source implements `connect`, `read` and `disconnect`, which only that thread calls.
    All other methods may be called from any thread.

    Args:
        name: Name for display.
        fov_deg: Horizontal field of view in degrees, or None if unknown.
        frames: Mailbox that holds the newest frame.
        count: Number of frames so far.
    """

    def __init__(
        self, name: str, fov_deg: float | None, clock: Clock, manner: Manner = WEBCAM
    ) -> None:
        self.name = name
        self.fov_deg = fov_deg
        self._clock = clock
        self._manner = manner
        self.frames: Mailbox[WebcamFrame] = Mailbox()
        self._lock = threading.Lock()  # guards the state behind the properties
        self._switching = threading.Lock()  # guards opening and closing
        self._using = threading.Lock()  # guards the source, which an old thread may still be using
        self._thread: threading.Thread | None = None
        self._token = Token()
        self._state = WebcamState.OFF
        self._error: WebcamError | None = None
        self._times: deque[float] = deque(maxlen=_MOST)
        self.count = 0
        self._due_s = 0.0
        self._last_s = 0.0
        self._live_s = 0.0
        self._print = b""
        self._print_s = 0.0

    @abstractmethod
    def connect(self) -> None:
        """Open the source.

        Raises:
            WebcamError: If the source cannot be opened.
        """

    @abstractmethod
    def read(self) -> Bytes | None:
        """Return the next frame as (H, W, 3) uint8 sRGB, or None if there is none.

        Raises:
            WebcamError: If the source has disappeared.
        """

    @abstractmethod
    def disconnect(self) -> None:
        """Close the source. Calling this again has no effect."""

    def pace(self, step_s: float, behind_s: float) -> None:
        """Wait until the next frame is due, or restart the timing if the frame is too late.

        A slow reader therefore gets fewer frames instead of a burst.
        """
        self._due_s = max(self._due_s + step_s, self._clock.now() - behind_s)
        self._clock.sleep(self._due_s - self._clock.now())

    def cut(self) -> None:
        """Interrupt a blocking read from another thread. By default, this does nothing."""
        return

    @property
    def state(self) -> WebcamState:
        """The current state, which changes to ``lost`` even while a read is hanging."""
        with self._lock:
            silent = self._clock.now() - self._last_s > LOST_S
            return WebcamState.LOST if self._state is WebcamState.LIVE and silent else self._state

    @property
    def error(self) -> WebcamError | None:
        """The current error, or None if there is none."""
        if self.state is WebcamState.LOST and self._error is None:
            return self._silent()
        return self._error

    @property
    def fps(self) -> float:
        """Frames per second over the last two seconds."""
        with self._lock:
            return self._rate(self._clock.now())

    def open(self) -> None:
        """Start the thread. This has no effect while the thread is running."""
        with self._switching:
            if self._thread is not None and self._thread.is_alive():
                return
            self._token = Token()
            self.frames.get()  # discard an old frame
            self._note(self._token, WebcamState.CONNECTING)
            self._thread = threading.Thread(
                target=self._run, args=(self._token,), name="webcam", daemon=True
            )
            _RUNNING[self._thread] = (self._token, self.cut)
            self._thread.start()

    def close(self, wait_s: float = 0.5) -> None:
        """Stop the thread. No frame arrives afterwards, even if a read from the device hangs.

        Args:
            wait_s: Time to wait for the device, in real seconds.
        """
        with self._switching:
            thread, self._thread = self._thread, None
            self._token.cancel()
            self.cut()
            if thread is not None and thread is not threading.current_thread():
                thread.join(wait_s)
            with self._lock:
                self._state, self._error = WebcamState.OFF, None
                self._times.clear()

    def _run(self, token: Token) -> None:
        try:
            self._serve(token)
        finally:
            _RUNNING.pop(threading.current_thread(), None)

    def _serve(self, token: Token) -> None:
        failures = 0
        with contextlib.suppress(Cancelled), self._using:
            while True:
                before = self.count
                error = self._attempt(token)
                failures = 0 if self.count > before else failures + 1
                if error.code in _FINAL:
                    # Repeated requests with a wrong password lock some cameras.
                    self._note(token, WebcamState.RETRYING, error)
                    return
                is_lost = failures == 0 or (failures == 1 and before > 0)
                self._note(token, WebcamState.LOST if is_lost else WebcamState.RETRYING, error)
                pauses = self._manner.pauses_s
                wait(self._clock, pauses[min(failures, len(pauses) - 1)], token)
                self._note(token, WebcamState.RETRYING, error)

    def _attempt(self, token: Token) -> WebcamError:
        """Deliver frames until something fails, and return the error."""
        token.check()
        try:
            self.connect()
            self._deliver(token)
        except WebcamError as error:
            return error
        finally:
            self.disconnect()
        raise Cancelled

    def _deliver(self, token: Token) -> None:
        last = self._clock.now()
        while not token.cancelled:
            picture = self.read()
            now = self._clock.now()
            if picture is not None:
                last = now
                self._put(picture, now, token)
                continue
            if now - last > self._manner.silence_s:
                raise self._silent()
            wait(self._clock, _NOTHING_S, token)

    def _put(self, picture: Bytes, now: float, token: Token) -> None:
        picture.setflags(write=False)
        with self._lock:
            if token.cancelled:
                return
            number, self.count = self.count, self.count + 1
            if self._state is not WebcamState.LIVE:
                self._times.clear()
                self._live_s, self._print_s, self._print = now, now, b""
            self._times.append(now)
            self._last_s, self._state = now, WebcamState.LIVE
            self._error = self._trouble(picture, now)
            self.frames.put(WebcamFrame(picture, number))

    def _trouble(self, picture: Bytes, now: float) -> WebcamError | None:
        """Return what is wrong with a frame, or None if the frame is usable."""
        manner = self._manner
        few = picture[8::16, 8::16]
        mark = few.tobytes()
        if mark != self._print:
            self._print, self._print_s = mark, now
        if int(np.max(few)) <= _BLACK:
            return WebcamError(
                tr("The {noun}’s picture is black.", noun=manner.noun),
                tr("Open its cover, or turn on a light."),
                "black",
            )
        if not manner.still and now - self._print_s > _FROZEN_S:
            return WebcamError(
                tr("The {noun} has frozen.", noun=manner.noun),
                manner.revive,
                "frozen",
            )
        if now - self._live_s > _SLOW_AFTER_S and self._rate(now) < _SLOW_FPS:
            return WebcamError(
                tr(
                    "The {noun} sends only {rate:.0f} pictures a second.",
                    noun=manner.noun,
                    rate=max(self._rate(now), 0.5),
                ),
                manner.quicken,
                "slow",
            )
        return None

    def _rate(self, now: float) -> float:
        return sum(time > now - _OVER_S for time in self._times) / _OVER_S

    def _note(self, token: Token, state: WebcamState, error: WebcamError | None = None) -> None:
        with self._lock:
            if not token.cancelled:
                self._state, self._error = state, error

    def _silent(self) -> WebcamError:
        return WebcamError(
            tr(
                "The {noun} has sent no picture for {seconds:.0f} seconds.",
                noun=self._manner.noun,
                seconds=LOST_S,
            ),
            tr("{revive} The video resumes automatically.", revive=self._manner.revive),
            "silent",
        )


@atexit.register
def _leave() -> None:
    """Wait for blocked reads to end, since a read that returns during exit aborts the process."""
    running = dict(_RUNNING)
    for token, cut in running.values():
        token.cancel()
        cut()
    until = time.monotonic() + _LEAVING_S
    for thread in running:
        thread.join(max(until - time.monotonic(), 0.0))


class WebcamError(DeviceError):
    """A webcam or its video is unusable.

    Codes: ``no-webcam``, ``busy``, ``unplugged``, ``silent`` (no frame arrives), ``black``,
    ``frozen``, ``slow``, ``no-views`` (the demo's images are missing). For network cameras:
    ``bad-address``, ``unreachable``, ``not-a-stream``, ``password``, ``password-refused``. For
    files and folders: ``no-file``, ``bad-file``.
    """

    default_code = "webcam"


def no_webcam() -> WebcamError:
    """Return the error for a missing webcam."""
    return WebcamError(
        tr("No webcam is connected."), tr("Plug one in; it starts automatically."), "no-webcam"
    )


def unplugged() -> WebcamError:
    """Return the error for an unplugged webcam."""
    return WebcamError(tr("Webcam disconnected."), tr("Plug it back in to continue."), "unplugged")


class WebcamState(StrEnum):
    """The state of a webcam.

    A webcam is ``off`` until it is opened, ``connecting`` the first time, ``live`` while frames
    arrive, ``lost`` when they have just stopped, and ``retrying`` while it is being reopened or is
    waiting for a password.
    """

    OFF = "off"
    CONNECTING = "connecting"
    LIVE = "live"
    LOST = "lost"
    RETRYING = "retrying"


@dataclass(frozen=True, slots=True, eq=False)
class WebcamFrame:
    """One frame from a webcam.

    Attributes:
        picture: (H, W, 3) uint8 sRGB, not mirrored, read-only.
    """

    picture: Bytes = field(repr=False)
    number: int
