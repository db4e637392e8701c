"""Looking for cameras: in their own Wi-Fi, where the last one was, and announced in the network.

All places are asked at the same time, each in a thread of its own, since an address where nothing
is may swallow everything that is sent there. Whatever answers is asked what it is: only what
describes itself as a camera of this protocol, or is announced as one and wants a password, counts.

A Ricoh Theta that has joined a network announces itself as "THETA" and its serial number under
``_osc._tcp.local.``, without further facts. Anybody in the network can announce anything, and
anybody who can write to the user's folder can change the camera that was used last: names and
addresses are only hints; at the address it is asked what is there. Only addresses that are near are
tried without the user's asking. No password is kept here.
"""

from __future__ import annotations

import ipaddress
import json
import re
import socket
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Final, Literal, Protocol, TypeAlias

from app.core.base.atomic_files import atomic_write_text, make_folder
from app.core.base.errors import CoreError
from app.core.base.paths import user_data
from app.core.base.progress import Token
from app.core.measure.plan.camera_models import CAMERAS
from app.core.text import tr
from app.devices.client_profiles import profile_for
from app.devices.clock import Clock, wait
from app.devices.errors import (
    LOSSES,
    BadReply,
    CameraRefused,
    DeviceError,
    PasswordNeeded,
    Unreachable,
)
from app.devices.theta.client import Info, parse_info
from app.devices.theta.endpoint import ACCESS_POINT, Endpoint
from app.devices.theta.first_contact import FirstContact
from app.devices.theta.link import BUSY, Link, Timeouts
from app.devices.theta.untrusted import JsonValue, parse_json, table, whole, words

if TYPE_CHECKING:
    from zeroconf import Zeroconf


SERVICE: Final = "_osc._tcp.local."
"""Type under which cameras of this kind announce themselves."""

_MOST_ADVERTS: Final = 32
_LONGEST_NAME: Final = 255
_TICK_S: Final = 0.1
_ASK_MS: Final = 400

FILE: Final = "last-camera.json"
"""Name of the file in the user's folder."""

_MOST_BYTES: Final = 4096
_PORTS: Final = 65535
_FORMAT: Final = 1
_LOCAL_NAME: Final = re.compile(r"[a-z0-9_-]+(?:\.(?:local|lan|home|internal|home\.arpa))?")
_NEAR: Final = tuple(
    ipaddress.ip_network(text)
    for text in (
        "10.0.0.0/8",
        "172.16.0.0/12",
        "192.168.0.0/16",
        "169.254.0.0/16",
        "127.0.0.0/8",
        "fc00::/7",
        "fe80::/10",
        "::1/128",
    )
)
_INSTANCE: Final = re.compile(r"(THETA([A-Z]{2})(\d{8}))(?:$|[. ])", re.ASCII)
_MODELS: Final = {each.user_prefix: each.model_text for each in CAMERAS if each.user_prefix}
_LONGEST: Final = 64
_ORDER: Final = ("typed", "access point", "remembered", "network")


@dataclass(frozen=True, slots=True)
class Advert:
    """One announcement, as it came."""

    name: str
    addresses: tuple[str, ...]
    port: int


def browse_network(
    on_advert: Callable[[Advert], None],
    stop: threading.Event,
    *,
    interfaces: Sequence[str] | None = None,
) -> None:
    """Listen to announcements until told to stop; blocks.

    `stop`: ends it, within half a second. Raises `Unreachable` when this machine cannot listen: no
    network, or another program or a firewall forbids it. The code is "no-mdns".
    """
    # Takes a quarter of a second and is needed only here.
    from zeroconf import Error, InterfaceChoice, ServiceBrowser, Zeroconf

    names: SimpleQueue[str] = SimpleQueue()

    def on_service(service_type: str, name: str, **_: Any) -> None:
        if len(name) <= _LONGEST_NAME and name.endswith(f".{service_type}"):
            names.put(name)

    try:
        network = Zeroconf(interfaces=list(interfaces) if interfaces else InterfaceChoice.All)
    except (OSError, Error, RuntimeError, ValueError) as error:
        raise _deaf(error) from error
    try:
        ServiceBrowser(network, SERVICE, handlers=[on_service])
        _resolve(network, names, on_advert, stop)
    except (OSError, Error) as error:
        raise _deaf(error) from error
    finally:
        network.close()


def _resolve(
    network: Zeroconf,
    names: SimpleQueue[str],
    on_advert: Callable[[Advert], None],
    stop: threading.Event,
) -> None:
    """Find out the addresses behind the names that are heard."""
    from zeroconf import BadTypeInNameException, ServiceInfo

    waiting: dict[str, None] = {}
    visited: set[str] = set()
    while not stop.wait(_TICK_S):
        for name in _drain(names):
            if name not in visited and len(visited) < _MOST_ADVERTS:
                visited.add(name)
                waiting[name] = None
        for name in tuple(waiting):
            try:
                info = ServiceInfo(SERVICE, name)
                is_resolved = info.load_from_cache(network) or info.request(network, _ASK_MS)
            except BadTypeInNameException:
                del waiting[name]
                continue
            if is_resolved and info.port:
                del waiting[name]
                addresses = sorted(info.parsed_scoped_addresses(), key=lambda text: ":" in text)
                label = name.removesuffix(f".{SERVICE}")
                on_advert(Advert(label, tuple(addresses), int(info.port)))
            if stop.is_set():
                return


def _drain(names: SimpleQueue[str]) -> list[str]:
    batch: list[str] = []
    while len(batch) < _MOST_ADVERTS:
        try:
            batch.append(names.get_nowait())
        except Empty:
            break
    return batch


def _deaf(error: BaseException) -> Unreachable:
    reason = error.strerror if isinstance(error, OSError) else str(error)
    return Unreachable(
        tr("The network cannot be searched for cameras: {reason}.", reason=reason.lower())
        if reason and not isinstance(error, socket.gaierror)
        else tr("The network cannot be searched for cameras."),
        tr("Type the camera's address instead."),
        "no-mdns",
    )


def remember(camera: FoundCamera, folder: Path | None = None) -> bool:
    """Keep a camera for the next time.

    False when it could not be kept, which is no reason to stop: the folder is not writable, or the
    address is not one that is tried without being asked to.
    """
    place = user_data() if folder is None else folder
    if not _may_be_tried(camera.endpoint.host):
        return False
    facts = {
        "format": _FORMAT,
        "host": camera.endpoint.host,
        "port": camera.endpoint.port,
        "model": camera.model,
        "serial": camera.serial,
    }
    try:
        make_folder(place)
        atomic_write_text(place / FILE, json.dumps(facts, indent=1) + "\n")
    except (OSError, CoreError):
        return False
    return True


def last_camera(folder: Path | None = None) -> FoundCamera | None:
    """Look up the camera that was used last. None where none is kept, or the file is invalid."""
    place = user_data() if folder is None else folder
    try:
        if not (place / FILE).is_file():
            return None
        with (place / FILE).open("rb") as stream:
            data = stream.read(_MOST_BYTES + 1)
    except OSError:
        return None
    if len(data) > _MOST_BYTES:
        return None
    with suppress(BadReply, DeviceError):
        facts = table(parse_json(data))
        host, port = words(facts.get("host")), whole(facts.get("port"), _PORTS)
        if port and _may_be_tried(host):
            model, serial = words(facts.get("model"), 64), words(facts.get("serial"), 40)
            return described(Endpoint(host, port), "remembered", Info(model, serial_number=serial))
    return None


def _may_be_tried(host: str) -> bool:
    return is_near(host) or _LOCAL_NAME.fullmatch(host.lower()) is not None


Source: TypeAlias = Literal["access point", "network", "remembered", "typed"]
"""Where an address came from: a camera's own Wi-Fi, an announcement, last time, the user."""


@dataclass(frozen=True, slots=True)
class FoundCamera:
    """A camera that answers, or one that is there for certain but wants a password first."""

    name: str
    endpoint: Endpoint
    model: str
    serial: str
    source: Source
    needs_password: bool = False
    user: str = ""
    used_last: bool = False


def described(
    endpoint: Endpoint, source: Source, info: Info | None = None, announced: str = ""
) -> FoundCamera:
    """Put together what is known of a camera.

    `info`: what the camera said of itself; None when it wants a password before it says anything.
    """
    label = words(announced, _LONGEST)
    serial = words(info.serial_number, _LONGEST) if info else serial_in(label)
    user = theta_user(label) if serial_in(label) == serial else ""
    model = words(info.model, _LONGEST) if info else _MODELS.get(user[5:7], "")
    if model and serial and not user:
        user = profile_for(info or Info(model)).user_name(serial)
    title = " ".join(text for text in (model, serial) if text)
    return FoundCamera(
        name=title or label or endpoint.host[:_LONGEST],
        endpoint=endpoint,
        model=model,
        serial=serial,
        source=source,
        needs_password=info is None,
        user=user,
    )


def theta_user(announced: str) -> str:
    """Give the user name in an announced name, "" where there is none.

    Examples:
        >>> theta_user("THETAYL00105377._osc._tcp.local.")
        'THETAYL00105377'
    """
    match = _INSTANCE.match(announced)
    return match.group(1) if match else ""


def serial_in(announced: str) -> str:
    """Give the digits of the serial number in an announced name, "" where there is none."""
    match = _INSTANCE.match(announced)
    return match.group(3) if match else ""


def is_near(host: str) -> bool:
    """Tell whether an address is one of a private network, of this link or of this machine.

    Only such addresses are tried when the user has not typed them.

    Examples:
        >>> is_near("192.168.1.1"), is_near("8.8.8.8"), is_near("fe80::1%eth0")
        (True, False, True)
    """
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return False
    return any(address in network for network in _NEAR)


def merged(cameras: Iterable[FoundCamera]) -> tuple[FoundCamera, ...]:
    """Leave each camera once.

    Returns the nearest address of each: one that works without a password before one that wants it,
    then typed, access point, remembered, network; sorted so. What the other finds of the same
    camera know is filled in.
    """
    ranked = sorted(
        cameras, key=lambda camera: (camera.needs_password, _ORDER.index(camera.source))
    )
    distinct: list[FoundCamera] = []
    for camera in ranked:
        twin = next((k for k, other in enumerate(distinct) if same_camera(camera, other)), None)
        if twin is None:
            distinct.append(camera)
        else:
            distinct[twin] = _fill_in(distinct[twin], camera)
    return tuple(distinct)


def same_camera(one: FoundCamera, other: FoundCamera) -> bool:
    """Tell whether two finds are one camera: by serial number and model, or by the address."""
    if one.serial and other.serial and one.serial != other.serial:
        return False
    if one.endpoint == other.endpoint:
        return True
    # The digits are counted for each model again, so they alone do not make two cameras one.
    return bool(one.serial) and one.serial == other.serial and _agree(one.model, other.model)


def _agree(one: str, other: str) -> bool:
    return not one or not other or one == other


def _fill_in(best: FoundCamera, other: FoundCamera) -> FoundCamera:
    user = other.user if other.source == "network" else ""
    return replace(
        best,
        name=best.name if best.model or not other.model else other.name,
        model=best.model or other.model,
        serial=best.serial or other.serial,
        user=user or best.user or other.user,
    )


CONNECT_S: Final = 2.5
"""Seconds in which an address must accept a connection."""

_LATE_S: Final = 1.0
_STEP_S: Final = 0.05
_BUSY_S: Final = 0.5
_SILENCES: Final = 2
_MOST: Final = 16
_PER_ADVERT: Final = 4
_JOIN: Final = tr(
    "Switch the camera's Wi-Fi on and choose it on this computer (its name "
    'ends in ".OSC"), or type the address that the camera has in your '
    "network."
)
_ROUTER: Final = tr(
    "Something answers at 192.168.1.1, but it is not a camera: probably the "
    "router of the network that this computer is in. To use a camera's own "
    'Wi-Fi, choose it on this computer (its name ends in ".OSC").'
)


class Asker(Protocol):
    """What is needed of a `Link` to ask a camera what it is."""

    def get(self, path: str) -> JsonValue:
        """Ask for JSON."""

    def close(self) -> None:
        """End all connections."""


@dataclass(frozen=True, slots=True)
class Discovery:
    """What a search brought."""

    cameras: tuple[FoundCamera, ...] = ()
    notes: tuple[str, ...] = ()

    def one(self) -> FoundCamera:
        """Choose the camera that is meant when the user names none.

        Returns the only one; of several the one that was used last. Raises `Unreachable` when there
        is none; the code is "no-camera"; `DeviceError` when there are several, none of which was
        used last; the code is "several-cameras".
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
            tr("Give the address of the one you mean."),
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
    """Look for cameras in all places at once.

    `timeout_s`: how long to listen, in seconds; answers to questions asked last come up to a second
    later. After `timeout_s` + 1 s at the latest, however many addresses swallow what they are sent.
    Raises `Cancelled` when the token was cancelled.
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


def check_address(text: str) -> Endpoint:
    """Read an address that the user typed; nothing is sent to it.

    `text`: "192.168.1.1", "http://cam.local:8080/", "[fe80::1%eth0]". Host and port. Any host is
    accepted, also outside the own network: the user asked for it. Raises `DeviceError` when it is
    no address, or one that no single camera can have; the code is "bad-address".
    """
    endpoint = Endpoint.parse(text)
    address = None
    with suppress(ValueError):  # A name.
        address = ipaddress.ip_address(endpoint.host.partition("%")[0])
    everybody = endpoint.host == "255.255.255.255"
    if everybody or (address and (address.is_multicast or address.is_unspecified)):
        raise DeviceError(
            tr("{host} is not the address of a single camera.", host=endpoint.host),
            tr('Type it like "192.168.1.1" or "THETAYL00105377.local".'),
            "bad-address",
        )
    return endpoint


def look_at(
    endpoint: Endpoint,
    clock: Clock,
    *,
    token: Token | None = None,
    link_factory: Callable[[Endpoint], Asker] | None = None,
    timeout_s: float = 5.0,
) -> FoundCamera:
    """Ask what is at an address that the user typed.

    Cut and garbled replies are asked for again, see `FirstContact`; silence ends it the second
    time. Raises `DeviceError`: `Unreachable`, `NotACamera`, `CameraRefused` or `BadReply`, as the
    link tells; `Cancelled` when the token was cancelled.
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
    """What came of asking one address."""

    source: Source
    info: Info | None = None
    error: DeviceError | None = None
    announced: str = ""
    done: bool = False


@dataclass(slots=True)
class _Search:
    """A search on its way; everything in it is used under its lock."""

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
        """Ask an address what is there, once, in a thread of its own."""
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
        """Hear announcements and ask the addresses in them."""

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
        """Wait until nothing more can come."""
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
        """Sum up what has come until now."""
        with self._lock:
            answers = {place: answer for place, answer in self._answers.items() if answer.done}
            notes = list(self._notes)
        answers_in = [self._camera(endpoint, answer) for endpoint, answer in answers.items()]
        last = self.last_camera
        cameras = tuple(
            replace(camera, used_last=last is not None and same_camera(camera, last))
            for camera in merged(camera for camera in answers_in if camera is not None)
        )
        # In a home network there is a router, which is not worth a word.
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
        # In its own Wi-Fi no camera asks for a password; a router does.
        if source == "remembered" and self.last_camera is not None and endpoint != ACCESS_POINT:
            return _as_known(self.last_camera, source)
        return None

    def _on_advert(self, advert: Advert) -> None:
        near = [address for address in advert.addresses[:_PER_ADVERT] if is_near(address)]
        # Not both kinds: two questions at once are too much for some cameras.
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
        """Ask what is there; a cut or garbled reply is asked for again while there is time."""
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
    """Ask what is there; a camera that is busy is asked again until the deadline."""
    while True:
        try:
            return parse_info(link.get("/osc/info"))
        except CameraRefused as error:
            late = clock.now() + _BUSY_S >= deadline or (stop is not None and stop.is_set())
            if error.code != BUSY or late:
                raise
        wait(clock, _BUSY_S)


def _trouble(endpoint: Endpoint, error: DeviceError | None) -> str:
    """Say why what answers is not offered; "" where nothing answers."""
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
    """Describe a camera that says nothing without a password by what it was last time."""
    return replace(camera, source=source, needs_password=True)
