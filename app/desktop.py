"""Assembly of the app: its devices, its window, and the steps taken at start-up and exit."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from types import ModuleType

from app.core.base.paths import user_data
from app.core.text import tr
from app.devices.screen_check import check_display, missing_library
from app.ui.shell.jobs import leave_if_stuck, reading_in
from app.ui.shell.launch_options import LaunchOptions
from app.ui.shell.log import LOGS, CrashLog, log_to

__all__ = ["LaunchOptions", "start"]


def start(options: LaunchOptions, walk: Callable[[], ModuleType]) -> int:
    """Show the window until it is closed, or run `walk`'s `Walk` to take screenshots.

    Returns:
        The exit code.

    Raises:
        CoreError: If this computer cannot show a window (the message names what is missing), or if
            the program's own files are damaged.
        DeviceError: If the display cannot be reached.
    """
    if options.screenshots is not None:
        # Screenshots are drawn in memory, so that they look the same with or without a display.
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    if options.scale is not None:
        os.environ["QT_SCALE_FACTOR"] = str(options.scale)
    try:
        with reading_in():
            from app.ui.shell.one_window import enter
    except ImportError as error:
        raise _not_installed(error) from error
    lock = enter(user_data(), options.paths)
    if lock is None:
        sys.stderr.write(tr("Turnlight is already open. Its window is in front now.") + "\n")
        return 0
    logs = user_data() / LOGS
    log_to(logs)
    crash_log = CrashLog(logs)
    try:
        code = _open(options, walk, crashed=crash_log.crashed)
    finally:
        crash_log.close()
        lock.release()
    leave_if_stuck(code)
    return code


def _open(options: LaunchOptions, walk: Callable[[], ModuleType], *, crashed: bool) -> int:
    """Open the window on a data folder that no other process is using."""
    platform = check_display()
    if platform is not None:
        os.environ["QT_QPA_PLATFORM"] = platform
    try:
        with reading_in():
            from app.ui.shell.start import run, show_until_closed

            use, folder = show_until_closed, options.screenshots
            if folder is not None:
                pictures = walk().Walk
                use = lambda app: pictures(app, folder).run()  # noqa: E731
    except ImportError as error:
        raise _not_installed(error) from error
    from app.devices.clock import SystemClock
    from app.devices.device_sets import RealDevices

    clock = SystemClock()
    if options.demo:
        from app.core.base.paths import resources
        from app.devices.device_sets import DemoDevices

        devices = DemoDevices(clock, resources() / "demo" / "cafe")
        try:
            code = run(options, devices, clock, use, crashed=crashed)
        finally:
            devices.close()
    else:
        code = run(options, RealDevices(clock), clock, use, crashed=crashed)
    return code


def _not_installed(error: ImportError) -> Exception:
    return missing_library(str(error)) if ".so" in str(error) else error
