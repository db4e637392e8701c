"""Checks, made before Qt is loaded, that this computer can show a window."""

from __future__ import annotations

import ctypes
import importlib.util
import os
import re
import socket
import sys
import threading
import tomllib
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Final

from app.core.base.errors import CoreError
from app.core.base.paths import resources
from app.core.text import tr, tr_plural
from app.devices.errors import DeviceError

_PATIENCE_S: Final = 8.0  # seconds, for a display on another computer


class DesktopError(CoreError):
    """The window cannot be shown on this computer."""


class DisplayError(DeviceError):
    """The display does not respond."""

    default_code = "no-display"


@cache
def _packages() -> dict[str, list[str]]:
    """Return the Debian and Fedora packages that provide each library."""
    return tomllib.loads((resources() / "packages.toml").read_text(encoding="utf-8"))


_BY_NAME_ONLY: Final = ("libasound", "libgssapi", "libpulse", "libwayland")
_MISSING: Final = re.compile(r"(lib[\w.+-]+?\.so[\d.]*): cannot open shared object file")
_DAMAGED: Final = re.compile(
    r"(\S*lib[\w.+-]+?\.so[\d.]*): (?:file too short|invalid ELF header|ELF file)"
)
_TOO_OLD: Final = re.compile(r"version [`'](GLIBC_[\d.]+|GLIBCXX_[\d.]+)' not found")


def check_display(
    environ: Mapping[str, str] | None = None, platform: str = sys.platform
) -> str | None:
    """Find a display that responds.

    Returns:
        The Qt platform to use if Qt's default would fail, or None otherwise.

    Raises:
        DesktopError: If there is no display, or a library needed to show windows is missing.
        DisplayError: If the display in the environment does not respond.
    """
    env = os.environ if environ is None else environ
    if platform in ("win32", "darwin"):
        return None
    platform_name = env.get("QT_QPA_PLATFORM", "")
    if platform_name:
        names = [part.partition(":")[0] for part in platform_name.split(";")]
    else:
        wayland = env.get("WAYLAND_DISPLAY") or env.get("XDG_SESSION_TYPE") == "wayland"
        names = ["wayland"] * bool(wayland) + ["xcb"] * bool(env.get("DISPLAY"))
    if not names:
        raise DesktopError(
            tr("There is no display here (neither DISPLAY nor WAYLAND_DISPLAY is set)."), _WITHOUT
        )
    problems: list[CoreError | DeviceError] = []
    for name in names:
        try:
            _try(name, env)
        except (DesktopError, DisplayError) as error:
            problems.append(error)
        else:
            return None if platform_name or name == names[0] else name
    raise next((one for one in problems if isinstance(one, DesktopError)), problems[-1])


_WITHOUT: Final = tr("turnlight solve PANORAMA works without a display.")


def _try(name: str, env: Mapping[str, str]) -> None:
    """Connect to the display of a Qt platform, and load the platform plugin as Qt does."""
    wayland = name.startswith("wayland")
    if name == "xcb":
        reason = _no_x11(env.get("DISPLAY", ""))
    else:
        reason = _no_wayland(env) if wayland else _unknown(name, env)
    if reason:
        raise DisplayError(reason, _WITHOUT)
    file = _plugins() / f"libq{'wayland' if wayland else name}.so"
    if file.is_file():
        try:
            ctypes.CDLL(str(file))
        except OSError as error:
            raise missing_library(str(error)) from error


def _unknown(name: str, env: Mapping[str, str]) -> str | None:
    platforms = sorted(file.stem.removeprefix("libq") for file in _plugins().glob("libq*.so"))
    elsewhere = env.get("QT_PLUGIN_PATH") or env.get("QT_QPA_PLATFORM_PLUGIN_PATH")
    if name in platforms or elsewhere or not platforms:
        return None
    return tr(
        "QT_QPA_PLATFORM is set to {name!r}, which is not available here: unset "
        "it or choose one of {names}.",
        name=name,
        names=", ".join(platforms),
    )


def _no_x11(display: str) -> str | None:
    if not display:
        return tr("DISPLAY is not set.")
    try:
        xcb = ctypes.CDLL("libxcb.so.1")
    except OSError as error:
        raise missing_library(str(error)) from error
    xcb.xcb_connect.restype = ctypes.c_void_p
    xcb.xcb_connect.argtypes = (ctypes.c_char_p, ctypes.c_void_p)
    answer: list[int] = []

    def connect() -> None:
        connection = ctypes.c_void_p(xcb.xcb_connect(os.fsencode(display), None))
        answer.append(xcb.xcb_connection_has_error(connection))
        xcb.xcb_disconnect(connection)

    # A display on a computer that is off would block the program for minutes.
    caller = threading.Thread(target=connect, daemon=True)
    caller.start()
    caller.join(_PATIENCE_S)
    if answer == [0]:
        return None
    return tr("The display {display} (DISPLAY) cannot be reached.", display=display)


def _no_wayland(env: Mapping[str, str]) -> str | None:
    if env.get("WAYLAND_SOCKET"):
        return None
    name = env.get("WAYLAND_DISPLAY") or "wayland-0"
    with socket.socket(socket.AF_UNIX) as line:
        line.settimeout(_PATIENCE_S)
        try:
            line.connect(os.path.join(env.get("XDG_RUNTIME_DIR", ""), name))
        except OSError:
            return tr("The display {name} (WAYLAND_DISPLAY) cannot be reached.", name=name)
    return None


def _plugins() -> Path:
    """Return the folder of Qt's platform plugins without importing Qt."""
    spec = importlib.util.find_spec("PySide6")
    folders = [] if spec is None else spec.submodule_search_locations or []
    return Path(*folders[:1]) / "Qt" / "plugins" / "platforms"


def missing_library(message: str) -> DesktopError:
    """Return the error for a system loader's message, with the packages to install.

    The error names every missing library, so one command can install them all.

    Examples:
        >>> print(missing_library("libx.so.2: cannot open shared object file"))
        A library that Turnlight needs is missing: libx.so.2. Install the package that contains it.
    """
    if (old := _TOO_OLD.search(message)) is not None:
        return DesktopError(
            tr(
                "This system is too old for Turnlight’s libraries: {library} is missing.",
                library=old[1],
            ),
            tr("Debian 12, Ubuntu 22.04, Fedora 36 and later versions include it."),
        )
    damaged = _DAMAGED.search(message)
    match = _MISSING.search(message)
    if match is None:
        what = message
        if damaged:
            what = tr("A library that Turnlight needs is damaged: {file}.", file=damaged[1])
        name = os.path.basename(damaged[1]) if damaged else ""
        return DesktopError(what, _commands([name], "--reinstall ", "reinstall"))
    names = list(dict.fromkeys([match[1], *(_absent() if match[1] in _packages() else ())]))
    what = tr_plural(
        "A library that Turnlight needs is missing: {libraries}.",
        "Libraries that Turnlight needs are missing: {libraries}.",
        len(names),
        libraries=", ".join(names),
    )
    return DesktopError(what, _commands(names) or tr("Install the package that contains it."))


def _absent() -> Iterable[str]:
    for name in _packages():
        if not name.startswith(_BY_NAME_ONLY):
            try:
                ctypes.CDLL(name)
            except OSError as error:
                # The library may exist but lack one of its own dependencies.
                match = _MISSING.search(str(error))
                if match is not None and match[1] == name:
                    yield name


def _commands(names: list[str], option: str = "", verb: str = "install") -> str:
    """Return the commands that install the packages, each on a separate line for copying."""
    packages = [_packages()[name] for name in names if name in _packages()]
    if not packages:
        return ""
    debian, fedora = (" ".join(dict.fromkeys(each)) for each in zip(*packages, strict=True))
    lines = (
        tr("Install it and start Turnlight again."),
        f"Debian, Ubuntu:  sudo apt install {option}{debian}",
        f"Fedora:  sudo dnf {verb} {fedora}",
    )
    return "\n".join(lines)
