"""The app put together: which devices, which window, and what runs when it starts and ends."""

from __future__ import annotations

import os
from collections.abc import Callable
from types import ModuleType

from app.ui.shell.display import LaunchOptions, check_display, missing_library
from app.ui.shell.jobs import reading_in

__all__ = ["LaunchOptions", "start"]


def start(options: LaunchOptions, walk: Callable[[], ModuleType]) -> int:
    """Show the window until it is closed, or walk through it for pictures with `walk`'s `Walk`.

    Returns:
        Exit code.

    Raises:
        CoreError: When this computer cannot show a window, and what is missing; or when the
            program's own files are damaged.
        DeviceError: When its display cannot be reached.
    """
    if options.screenshots is not None:
        # Pictures are drawn in memory: the same on every machine, with or without a display.
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    if options.scale is not None:
        os.environ["QT_SCALE_FACTOR"] = str(options.scale)
    platform = check_display()
    if platform is not None:
        os.environ["QT_QPA_PLATFORM"] = platform
    try:
        with reading_in():
            from app.ui.shell.jobs import leave_if_stuck
            from app.ui.shell.start import run, show_until_closed

            use, folder = show_until_closed, options.screenshots
            if folder is not None:
                pictures = walk().Walk
                use = lambda app: pictures(app, folder).run()  # noqa: E731
    except ImportError as error:
        if ".so" not in str(error):
            raise
        raise missing_library(str(error)) from error
    from app.devices.clock import SystemClock
    from app.devices.device_sets import RealDevices

    clock = SystemClock()
    if options.demo:
        from app.core.base.paths import resources
        from app.devices.device_sets import DemoDevices

        devices = DemoDevices(clock, resources() / "demo" / "cafe")
        try:
            code = run(options, devices, clock, use)
        finally:
            devices.close()
    else:
        code = run(options, RealDevices(clock), clock, use)
    leave_if_stuck(code)
    return code
