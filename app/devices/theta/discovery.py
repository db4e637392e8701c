"""Search for cameras on their own Wi-Fi, at the last known address and through announcements.

All addresses are queried at once, each in a separate thread, since an unused address may silently
drop everything sent to it. A device counts only if it describes itself as an OSC camera, or if it
is announced as one and requires a password. Addresses outside the local network are tried only if
the user types them.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Final, Protocol

from app.core.base.progress import Token
from app.core.text import tr
from app.devices.clock import Clock, wait
from app.devices.errors import (
    LOSSES,
    CameraRefused,
    DeviceError,
    PasswordNeeded,
    Unreachable,
)
from app.devices.theta.announcements import Advert, browse_network
from app.devices.theta.camera_identity import FoundCamera, Source, described, merged, same_camera
from app.devices.theta.endpoint import ACCESS_POINT, Endpoint, is_near
from app.devices.theta.first_contact import FirstContact
from app.devices.theta.last_camera import last_camera
from app.devices.theta.link import Link
from app.devices.theta.messages import Info, parse_info
from app.devices.theta.refusals import BUSY
from app.devices.theta.reply import Timeouts
from app.devices.theta.untrusted import JsonValue

CONNECT_S: Final = 2.5
"""Time allowed for an address to accept a connection, in seconds."""

_LATE_S: Final = 1.0
_STEP_S: Final = 0.05
_BUSY_S: Final = 0.5
_SILENCES: Final = 2
_MOST: Final = 16
_PER_ADVERT: Final = 4
_JOIN: Final = tr(
    "Switch on the camera’s Wi-Fi and join it on this computer (its name ends in "
    "“.OSC”), or type the camera’s address on your network."
)
_ROUTER: Final = tr(
    "The device at 192.168.1.1 is probably your router, not a camera. To use a "
    "camera’s own Wi-Fi, join it on this computer (its name ends in “.OSC”)."
)


class Asker(Protocol):
    """The part of a `Link` that discovery uses."""

    def get(self, path: str) -> JsonValue:
        """Request JSON."""

    def close(self) -> None:
        """Close all connections."""


@dataclass(frozen=True, slots=True)
class Discovery:
    """The result of a search: the cameras, and remarks on any failures."""

    cameras: tuple[FoundCamera, ...] = ()
    notes: tuple[str, ...] = ()

    def one(self) -> FoundCamera:
        """Choose a camera if the user names none: either the only one or the one used last.

        Raises:
            Unreachable: With the code "no-camera" if there is none.
            DeviceError: With the code "several-cameras" if there are several and none was used
                last.
        """
        if not self.cameras:
            raise Unreachable(
                tr("No camera was found."), " ".join(self.notes) or _JOIN, "no-camera"
            )
        last = [camera for camera in self.cameras if camera.used_last]
        if len(self.cameras) == 1 or last:
            return (*last, *self.cameras)[0]
        names = ", ".join(
            tr("{name} at {address}", name=each.name, address=each.endpoint.base)
            for each in self.cameras
        )
        raise DeviceError(
            tr("Several cameras were found: {cameras}.", cameras=names),
            tr("Enter the address of the camera to use."),
            "several-cameras",
        )


def discover(
    clock: Clock,
    timeout_s: float = 3.0,
    *,
    token: Token | None = None,
    link_factory: Callable[[Endpoint], Asker] | None = None,
    browse: Callable[[Callable[[Advert], None], threading.Event], None] = browse_network,
    last: FoundCamera | None = None,
) -> Discovery:
    """Search for cameras at all addresses at once.

    Args:
        timeout_s: Time to listen, in seconds. The last replies may take another second.

    Raises:
        Cancelled: If the token is cancelled.
    """
    search = _Search(clock, timeout_s, link_factory or _links(clock, timeout_s))
    before = last if last is not None else last_camera()
    if before is not None:
        search.last_camera = before
        search.ask(before.endpoint, "remembered")
    search.ask(ACCESS_POINT, "access point")
    search.listen(browse)
    try:
        search.wait(token or Token())
    finally:
        search.stop.set()
    return search.outcome()


def look_at(
    endpoint: Endpoint,
    clock: Clock,
    *,
    token: Token | None = None,
    link_factory: Callable[[Endpoint], Asker] | None = None,
    timeout_s: float = 5.0,
) -> FoundCamera:
    """Identify the camera at an address that the user typed.

    A cut or garbled reply is requested again (see `FirstContact`). A second timeout is final.

    Raises:
        DeviceError: As in `Link.get`.
        Cancelled: If the token is cancelled.
    """
    link = (link_factory or _links(clock, timeout_s))(endpoint)
    try:
        info = _info(link, clock, timeout_s, token)
    except PasswordNeeded:
        info = None
    finally:
        link.close()
    camera = last_camera()
    if info is None and camera is not None and camera.endpoint == endpoint:
        return _as_known(camera, "typed")
    return described(endpoint, "typed", info)


def _info(link: Asker, clock: Clock, timeout_s: float, token: Token | None) -> Info:
    first = FirstContact(clock, silences=_SILENCES)
    while True:
        try:
            return _ask_info(link, clock, clock.now() + timeout_s)
        except LOSSES as error:
            if first.hopeless(error):
                raise
        wait(clock, first.pause_s(), token)


@dataclass(slots=True)
class _Reply:
    """The reply from one address."""

    source: Source
    info: Info | None = None
    error: DeviceError | None = None
    announced: str = ""
    done: bool = False


@dataclass(slots=True)
class _Search:
    """A search in progress. Its lock is held while its fields are accessed."""

    clock: Clock
    timeout_s: float
    link_factory: Callable[[Endpoint], Asker]
    last_camera: FoundCamera | None = None
    stop: threading.Event = field(default_factory=threading.Event)
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _changed: threading.Event = field(default_factory=threading.Event)
    _answers: dict[Endpoint, _Reply] = field(default_factory=dict)
    _notes: list[str] = field(default_factory=list)
    _listening: bool = False
    _start: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        self._start = (self.clock.now(), time.monotonic())

    def ask(self, endpoint: Endpoint, source: Source, announced: str = "") -> None:
        """Identify the camera at an address once, in a separate thread."""
        with self._lock:
            before = self._answers.get(endpoint)
            if before is not None:
                before.announced = before.announced or announced
                return
            if len(self._answers) >= _MOST or self.stop.is_set():
                return
            answer = self._answers[endpoint] = _Reply(source, announced=announced)
        self._run(lambda: self._put(endpoint, answer))

    def listen(self, browse: Callable[[Callable[[Advert], None], threading.Event], None]) -> None:
        """Listen for announcements and identify the cameras at their addresses."""

        def run() -> None:
            try:
                browse(self._on_advert, self.stop)
            except DeviceError as error:
                with self._lock:
                    self._notes.append(str(error))
            finally:
                self._listening = False
                self._changed.set()

        self._listening = True
        self._run(run)

    def wait(self, token: Token) -> None:
        """Wait until no more replies can arrive."""
        while True:
            token.check()
            with self._lock:
                busy = any(not answer.done for answer in self._answers.values())
            elapsed_s = max(self.clock.now() - self._start[0], time.monotonic() - self._start[1])
            if elapsed_s >= self.timeout_s + (_LATE_S if busy else 0.0):
                return
            if not busy and not self._listening:
                return
            if elapsed_s >= self.timeout_s:
                self.stop.set()
            self._changed.wait(_STEP_S)
            self._changed.clear()

    def outcome(self) -> Discovery:
        """Return the results so far."""
        with self._lock:
            answers = {place: answer for place, answer in self._answers.items() if answer.done}
            notes = list(self._notes)
        answers_in = [self._camera(endpoint, answer) for endpoint, answer in answers.items()]
        last = self.last_camera
        cameras = tuple(
            replace(camera, used_last=last is not None and same_camera(camera, last))
            for camera in merged(camera for camera in answers_in if camera is not None)
        )
        # Every home network has a router, so do not mention it if a camera was found.
        if not cameras:
            notes += [_trouble(endpoint, answer.error) for endpoint, answer in answers.items()]
        return Discovery(cameras, tuple(dict.fromkeys(note for note in notes if note)))

    def _camera(self, endpoint: Endpoint, answer: _Reply) -> FoundCamera | None:
        source: Source = answer.source
        if answer.info is not None:
            return described(endpoint, source, answer.info, answer.announced)
        if not isinstance(answer.error, PasswordNeeded):
            return None
        if answer.announced:
            return described(endpoint, source, None, answer.announced)
        # Cameras never require a password on their own Wi-Fi; routers do.
        if source == "remembered" and self.last_camera is not None and endpoint != ACCESS_POINT:
            return _as_known(self.last_camera, source)
        return None

    def _on_advert(self, advert: Advert) -> None:
        near = [address for address in advert.addresses[:_PER_ADVERT] if is_near(address)]
        # Query IPv4 or IPv6 but not both, since some cameras cannot answer two requests at once.
        plain = [address for address in near if ":" not in address]
        for address in plain or near:
            with suppress(DeviceError):
                self.ask(Endpoint(address, advert.port), "network", advert.name)

    def _put(self, endpoint: Endpoint, answer: _Reply) -> None:
        info: Info | None = None
        error: DeviceError | None = Unreachable(tr("No camera answered."))
        try:
            info, error = self._put_to(endpoint), None
        except DeviceError as trouble:
            error = trouble
        finally:
            with self._lock:
                answer.info, answer.error, answer.done = info, error, True
            self._changed.set()

    def _put_to(self, endpoint: Endpoint) -> Info:
        link = self.link_factory(endpoint)
        try:
            return self._info(link)
        finally:
            link.close()

    def _info(self, link: Asker) -> Info:
        """Request the description, repeating while time remains if the reply is cut or garbled."""
        deadline, first = self._start[0] + self.timeout_s, FirstContact(self.clock, silences=1)
        while True:
            try:
                return _ask_info(link, self.clock, deadline, self.stop)
            except LOSSES as error:
                pause = first.pause_s()
                late = self.clock.now() + pause >= deadline or self.stop.is_set()
                if first.hopeless(error) or late:
                    raise
            wait(self.clock, pause)

    def _run(self, work: Callable[[], None]) -> None:
        threading.Thread(target=work, name="turnlight-discovery", daemon=True).start()


def _ask_info(
    link: Asker, clock: Clock, deadline: float, stop: threading.Event | None = None
) -> Info:
    """Request the description, repeating until the deadline while the camera is busy."""
    while True:
        try:
            return parse_info(link.get("/osc/info"))
        except CameraRefused as error:
            late = clock.now() + _BUSY_S >= deadline or (stop is not None and stop.is_set())
            if error.code != BUSY or late:
                raise
        wait(clock, _BUSY_S)


def _trouble(endpoint: Endpoint, error: DeviceError | None) -> str:
    """Explain why a device that answers is not listed, or return "" if nothing answered."""
    if error is None or isinstance(error, Unreachable):
        return ""
    if isinstance(error, CameraRefused):
        return tr("At {host}: {reason}", host=endpoint.host, reason=error)
    return _ROUTER if endpoint == ACCESS_POINT else ""


def _links(clock: Clock, timeout_s: float) -> Callable[[Endpoint], Asker]:
    limits = Timeouts(
        connect_s=min(CONNECT_S, timeout_s), read_s=timeout_s, whole_s=timeout_s, idle_s=timeout_s
    )
    return lambda endpoint: Link(endpoint, clock, timeouts=limits)


def _as_known(camera: FoundCamera, source: Source) -> FoundCamera:
    """Return a camera that requires a password, with its description saved in the last session."""
    return replace(camera, source=source, needs_password=True)
