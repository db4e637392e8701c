"""The app put together: which devices, which window, and what runs when it starts and ends."""

from __future__ import annotations

import ctypes.util
import os
import sys
from typing import TYPE_CHECKING, Final

from app.core.errors import CoreError
from app.ui.memory import reading_in
from app.ui.wishes import Wishes

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["DesktopError", "Wishes", "display_problem", "start"]

_PACKAGES: Final = {
    "libEGL": "libegl1",
    "libGL": "libgl1",
    "libdbus-1": "libdbus-1-3",
    "libfontconfig": "libfontconfig1",
    "libglib-2.0": "libglib2.0-0",
    "libxkbcommon": "libxkbcommon0",
    "libxkbcommon-x11": "libxkbcommon-x11-0",
    "libxcb-cursor": "libxcb-cursor0",
    "libxcb-icccm": "libxcb-icccm4",
    "libxcb-image": "libxcb-image0",
    "libxcb-keysyms": "libxcb-keysyms1",
    "libxcb-render-util": "libxcb-render-util0",
    "libxcb-shape": "libxcb-shape0",
    "libxcb-xinerama": "libxcb-xinerama0",
}
"""Debian's and Ubuntu's package of each library that Qt looks for."""

_XCB_NEEDS: Final = (
    "xcb-cursor",
    "xcb-icccm",
    "xcb-image",
    "xcb-keysyms",
    "xcb-render-util",
    "xkbcommon-x11",
)


class DesktopError(CoreError):
    """The window cannot be shown on this computer."""


def display_problem(
    environ: Mapping[str, str] | None = None, platform: str = sys.platform
) -> str | None:
    """Say why no window can be shown here.

    Parameters
    ----------
    environ : Mapping[str, str], optional
        As `os.environ`.
    platform : str, optional
        As `sys.platform`.

    Returns
    -------
    str or None
        A sentence; None when nothing speaks against it.
    """
    env = os.environ if environ is None else environ
    if platform in ("win32", "darwin") or env.get("QT_QPA_PLATFORM"):
        return None
    if env.get("WAYLAND_DISPLAY"):
        return None
    if not env.get("DISPLAY"):
        return "There is no display here (neither DISPLAY nor WAYLAND_DISPLAY is set)."
    missing = [f"lib{name}" for name in _XCB_NEEDS if not ctypes.util.find_library(name)]
    return _install_words(missing) if missing else None


def start(wishes: Wishes) -> int:
    """Show the window until it is closed.

    Parameters
    ----------
    wishes : Wishes
        From the command line.

    Returns
    -------
    int
        Exit code.

    Raises
    ------
    DesktopError
        When this computer cannot show a window; the message says what is missing.
    CoreError
        When the program's own files are damaged.
    """
    if wishes.screenshots is not None:
        # Pictures are drawn in memory: the same on every machine, with or without a display.
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    if wishes.scale is not None:
        os.environ["QT_SCALE_FACTOR"] = str(wishes.scale)
    problem = display_problem()
    if problem is not None:
        raise DesktopError(problem, "turnlight solve PANORAMA works without one.")
    try:
        with reading_in():
            from app.ui.start import run
    except ImportError as error:
        library = getattr(error, "name", None) or str(error).split(":", 1)[0]
        if ".so" not in str(error):
            raise
        raise DesktopError(_install_words([library])) from error
    from app.devices.at_hand import DevicesAtHand
    from app.devices.clock import SystemClock

    clock = SystemClock()
    if not wishes.demo:
        return run(wishes, DevicesAtHand(clock), clock)
    from app.core.paths import resources
    from app.devices.demo import DemoDevices

    devices = DemoDevices(clock, resources() / "demo" / "location")
    try:
        return run(wishes, devices, clock)
    finally:
        devices.close()


def _install_words(libraries: list[str]) -> str:
    names = sorted({_package(library) for library in libraries})
    listed = ", ".join(library.split(".so", 1)[0] for library in libraries)
    return (
        f"A library that windows need is missing: {listed}. "
        f"On Debian and Ubuntu: sudo apt install {' '.join(names)}"
    )


def _package(library: str) -> str:
    stem = library.split(".so", 1)[0]
    return _PACKAGES.get(stem, stem)
