"""Which camera a command speaks to, and with which password."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from app.commands.printing import say
from app.core.base.errors import CoreError
from app.devices.errors import DeviceError, PasswordNeeded
from app.devices.passwords import Passwords, default_password_hint, read_password_file
from app.devices.theta.discovery import check_address, discover, look_at
from app.devices.theta.found import remember
from app.devices.theta.link import Credentials

if TYPE_CHECKING:
    from pathlib import Path

    from app.core.base.progress import Token
    from app.devices.clock import Clock
    from app.devices.theta.endpoint import Endpoint
    from app.devices.theta.found import FoundCamera
    from app.devices.theta.messages import Info


def find_camera(address: str, clock: Clock, token: Token) -> FoundCamera:
    """Look for a camera, or ask what is at an address.

    Raises:
        CoreError: When the address is not valid.
        DeviceError: When nothing answers, something else does, or several cameras do.
    """
    if address != "auto":
        return look_at(_typed(address), clock)
    say("Looking for cameras.")
    found = discover(clock, token=token)
    # Where there is none, the error says what the notes say.
    camera = found.one()
    for note in found.notes:
        say(note)
    say(f"Found {camera.name} at {camera.endpoint.base}.")
    return camera


def given_password(user: str | None, password_file: Path | None) -> Credentials | None:
    """Read the password that a user gave.

    Raises:
        CoreError: When only one of both was given, or the file cannot be read.
    """
    if user is None and password_file is None:
        return None
    if user is None or password_file is None:
        raise CoreError("--user and --password-file go together.", "Give both or neither.")
    return Credentials(user, read_password_file(password_file, say))


def kept_password(camera: FoundCamera) -> Credentials | None:
    """Look into the system's keyring where a camera asks for a password.

    Raises:
        PasswordNeeded: When the camera wants a password and we know none.
    """
    if not camera.needs_password:
        return None
    kept = Passwords(say).get(camera.user) if camera.user else None
    if kept is None:
        hint = default_password_hint(camera.model, camera.serial)
        raise PasswordNeeded(
            f"{camera.name} asks for a password.", f"Give --user and --password-file. {hint}"
        )
    return Credentials(camera.user, kept)


def keep(camera: FoundCamera, info: Info | None, credentials: Credentials | None) -> None:
    """Remember a camera that worked, and a new password that it wanted.

    Args:
        info: Info or None. What it said of itself: one that wants a password says so only when it
            has got it.
        credentials: Typed for this camera; None where they came from the keyring or there are
            none. Not kept if the camera never asked for them: they may be wrong.
    """
    wanted = camera.needs_password
    if info is not None:
        camera = replace(camera, model=info.model, serial=info.serial_number)
    remember(camera)
    if credentials is not None and wanted:
        Passwords(say).set(credentials.user, credentials.password)


def _typed(address: str) -> Endpoint:
    """Read an address; a slip of the fingers is bad usage and no failing device."""
    try:
        return check_address(address)
    except DeviceError as error:
        raise CoreError(error.message, error.hint) from error
