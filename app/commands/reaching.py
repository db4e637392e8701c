"""Which camera a command speaks to, and with which password."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from app.core.errors import CoreError
from app.devices.discovery import check_address, discover, look_at
from app.devices.errors import PasswordNeeded
from app.devices.last_camera import last_camera
from app.devices.osc.link import Credentials
from app.devices.passwords import Passwords, default_password_hint, read_password_file

if TYPE_CHECKING:
    from pathlib import Path

    from app.core.progress import Token
    from app.devices.clock import Clock
    from app.devices.found import FoundCamera

__all__ = ["find_camera", "given_password", "keep_password", "kept_password"]


def find_camera(address: str, clock: Clock, token: Token) -> FoundCamera:
    """Look for a camera, or ask what is at an address.

    Parameters
    ----------
    address : str
        As typed, or "auto".
    clock : Clock
        Time.
    token : Token
        Stops the search.

    Returns
    -------
    FoundCamera

    Raises
    ------
    DeviceError
        When nothing answers, something else does, or several cameras do.
    """
    if address != "auto":
        return look_at(check_address(address), clock)
    _say("Looking for cameras.")
    found = discover(clock, token=token, remembered=last_camera())
    for note in found.notes:
        _say(note)
    camera = found.one()
    _say(f"Found {camera.name} at {camera.endpoint.base}.")
    return camera


def given_password(user: str | None, password_file: Path | None) -> Credentials | None:
    """Read the password that a user gave.

    Parameters
    ----------
    user : str or None
        User name.
    password_file : Path or None
        File whose first line is the password; given together with `user`.

    Returns
    -------
    Credentials or None
        None where none was given.

    Raises
    ------
    CoreError
        When only one of both was given, or the file cannot be read.
    """
    if user is None and password_file is None:
        return None
    if user is None or password_file is None:
        raise CoreError("--user and --password-file go together.", "Give both or neither.")
    return Credentials(user, read_password_file(password_file, _say))


def kept_password(camera: FoundCamera) -> Credentials | None:
    """Look into the system's keyring where a camera asks for a password.

    Parameters
    ----------
    camera : FoundCamera
        Who may ask for one.

    Returns
    -------
    Credentials or None
        None where none is needed.

    Raises
    ------
    PasswordNeeded
        When one is needed and none is known.
    """
    if not camera.needs_password:
        return None
    kept = Passwords(_say).get(camera.user) if camera.user else None
    if kept is None:
        hint = default_password_hint(camera.model, camera.serial)
        raise PasswordNeeded(
            f"{camera.name} asks for a password.", f"Give --user and --password-file. {hint}"
        )
    return Credentials(camera.user, kept)


def keep_password(credentials: Credentials | None) -> None:
    """Put a password that worked into the system's keyring, if there is one."""
    if credentials is not None:
        Passwords(_say).set(credentials.user, credentials.password)


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
