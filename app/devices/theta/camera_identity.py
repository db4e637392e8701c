"""Identification of cameras by name, model and serial number, so that none is counted twice."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias

from app.core.camera_catalogue import CAMERAS
from app.devices.protocol_profiles import profile_for
from app.devices.theta.endpoint import Endpoint
from app.devices.theta.messages import Info
from app.devices.theta.untrusted import words

_INSTANCE: Final = re.compile(r"(THETA([A-Z]{2})(\d{8}))(?:$|[. ])", re.ASCII)
_MODELS: Final = {each.user_prefix: each.model_text for each in CAMERAS if each.user_prefix}
_LONGEST: Final = 64
_ORDER: Final = ("typed", "access point", "remembered", "network")

Source: TypeAlias = Literal["access point", "network", "remembered", "typed"]
"""Origin of an address: a camera's own Wi-Fi, an announcement, the last session or the user."""


@dataclass(frozen=True, slots=True)
class FoundCamera:
    """A camera that answers, or one that is identified but requires a password first."""

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
    """Combine an address, an announcement and a camera's own description.

    Args:
        info: The camera's description, or None if it requires a password first.
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
    """Return the user name in an announced name, or "" if there is none.

    Examples:
        >>> theta_user("THETAYL00105377._osc._tcp.local.")
        'THETAYL00105377'
    """
    match = _INSTANCE.match(announced)
    return match.group(1) if match else ""


def serial_in(announced: str) -> str:
    """Return the digits of the serial number in an announced name, or "" if there are none."""
    match = _INSTANCE.match(announced)
    return match.group(3) if match else ""


def merged(cameras: Iterable[FoundCamera]) -> tuple[FoundCamera, ...]:
    """Keep each camera once, with its best address.

    Addresses that work without a password come first. Otherwise the order is typed, access point,
    remembered and network. The cameras are returned in the same order. Missing data is filled in
    from the camera's other addresses.
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
    """Return whether two entries agree in serial number and model, or in their address."""
    if one.serial and other.serial and one.serial != other.serial:
        return False
    if one.endpoint == other.endpoint:
        return True
    # Every model has its own series of serial numbers, so equal digits alone prove nothing.
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
