"""Cameras that were found: announced in the network, remembered from the last time, and described.

A Ricoh Theta that has joined a network announces itself as "THETA" and its serial number under
``_osc._tcp.local.``, without further facts. Anybody in the network can announce anything, and
anybody who can write to the user's folder can change the camera that was used last: names and
addresses are only hints here; whoever uses them asks at the address what is there. Only addresses
that are near are tried without the user's asking. No password is kept here.
"""

from __future__ import annotations

import ipaddress
import json
import re
import socket
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

from app.core.base.errors import CoreError
from app.core.base.files import atomic_write_text
from app.core.base.paths import user_data
from app.core.hdr.camera_table import CAMERAS
from app.core.text import tr
from app.devices.errors import BadReply, DeviceError, Unreachable
from app.devices.profiles import profile_for
from app.devices.theta.endpoint import Endpoint
from app.devices.theta.messages import Info
from app.devices.theta.untrusted import parse_json, table, whole, words

if TYPE_CHECKING:
    import threading

    from zeroconf import Zeroconf

SERVICE: Final = "_osc._tcp.local."
"""Type under which cameras of this kind announce themselves."""

_MOST_ADVERTS: Final = 32
_LONGEST_NAME: Final = 255
_STEP_S: Final = 0.1
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
_MODELS: Final = {each.user_prefix: each.stated for each in CAMERAS if each.user_prefix}
_LONGEST: Final = 64
_ORDER: Final = ("typed", "access point", "remembered", "network")


@dataclass(frozen=True, slots=True)
class Advert:
    """One announcement, as it came."""

    name: str
    addresses: tuple[str, ...]
    port: int


def browse_network(
    found: Callable[[Advert], None],
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

    def heard(service_type: str, name: str, **_: Any) -> None:
        if len(name) <= _LONGEST_NAME and name.endswith(f".{service_type}"):
            names.put(name)

    try:
        network = Zeroconf(interfaces=list(interfaces) if interfaces else InterfaceChoice.All)
    except (OSError, Error, RuntimeError, ValueError) as error:
        raise _deaf(error) from error
    try:
        ServiceBrowser(network, SERVICE, handlers=[heard])
        _resolve(network, names, found, stop)
    except (OSError, Error) as error:
        raise _deaf(error) from error
    finally:
        network.close()


def _resolve(
    network: Zeroconf,
    names: SimpleQueue[str],
    found: Callable[[Advert], None],
    stop: threading.Event,
) -> None:
    """Find out the addresses behind the names that are heard."""
    from zeroconf import BadTypeInNameException, ServiceInfo

    waiting: dict[str, None] = {}
    known: set[str] = set()
    while not stop.wait(_STEP_S):
        for name in _taken(names):
            if name not in known and len(known) < _MOST_ADVERTS:
                known.add(name)
                waiting[name] = None
        for name in tuple(waiting):
            try:
                info = ServiceInfo(SERVICE, name)
                resolved = info.load_from_cache(network) or info.request(network, _ASK_MS)
            except BadTypeInNameException:
                del waiting[name]
                continue
            if resolved and info.port:
                del waiting[name]
                addresses = sorted(info.parsed_scoped_addresses(), key=lambda text: ":" in text)
                label = name.removesuffix(f".{SERVICE}")
                found(Advert(label, tuple(addresses), int(info.port)))
            if stop.is_set():
                return


def _taken(names: SimpleQueue[str]) -> list[str]:
    taken: list[str] = []
    while len(taken) < _MOST_ADVERTS:
        try:
            taken.append(names.get_nowait())
        except Empty:
            break
    return taken


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
        place.mkdir(parents=True, exist_ok=True)
        atomic_write_text(place / FILE, json.dumps(facts, indent=1) + "\n")
    except (OSError, CoreError):
        return False
    return True


def last_camera(folder: Path | None = None) -> FoundCamera | None:
    """Look up the camera that was used last.

    None where none is kept, or the file is invalid.
    """
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
    called = " ".join(text for text in (model, serial) if text)
    return FoundCamera(
        name=called or label or endpoint.host[:_LONGEST],
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
    found = _INSTANCE.match(announced)
    return found.group(1) if found else ""


def serial_in(announced: str) -> str:
    """Give the digits of the serial number in an announced name, "" where there is none."""
    found = _INSTANCE.match(announced)
    return found.group(3) if found else ""


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
    kept: list[FoundCamera] = []
    for camera in ranked:
        twin = next((k for k, other in enumerate(kept) if same_camera(camera, other)), None)
        if twin is None:
            kept.append(camera)
        else:
            kept[twin] = _filled(kept[twin], camera)
    return tuple(kept)


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


def _filled(best: FoundCamera, other: FoundCamera) -> FoundCamera:
    announced = other.user if other.source == "network" else ""
    return replace(
        best,
        name=best.name if best.model or not other.model else other.name,
        model=best.model or other.model,
        serial=best.serial or other.serial,
        user=announced or best.user or other.user,
    )
