"""A camera that was found, and which addresses may be tried for one without being asked to."""

from __future__ import annotations

import ipaddress
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from app.devices.profiles import profile_for
from app.devices.theta.messages import Info
from app.devices.theta.untrusted import words

if TYPE_CHECKING:
    from collections.abc import Iterable

    from app.devices.theta.endpoint import Endpoint

Source: TypeAlias = Literal["access point", "network", "remembered", "typed"]
"""Where an address came from: a camera's own Wi-Fi, an announcement, last time, the user."""

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
_MODELS: Final = {"YL": "RICOH THETA V", "YN": "RICOH THETA Z1", "YR": "RICOH THETA X"}
_LONGEST: Final = 64
_ORDER: Final = ("typed", "access point", "remembered", "network")


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

    Parameters
    ----------
    info : Info, optional
        What the camera said of itself; None when it wants a password before it says anything.
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

    Examples
    --------
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

    Examples
    --------
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

    Returns
    -------
    tuple[FoundCamera, ...]
        The nearest address of each: one that works without a password before one that wants it,
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
    # The digits are counted for each model anew, so they alone do not make two cameras one.
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
