"""Wait for what other threads and processes do, with patience for any machine."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

PATIENCE_S: Final = 120.0
"""No test waits longer; nothing that works takes this long, however slow the machine is."""


def until(happened: Callable[[], object], what: str = "it", step_s: float = 0.005) -> None:
    """Wait until a call gives something true.

    Args:
        what: Named where the patience ends.
    """
    end = time.monotonic() + PATIENCE_S
    while not happened():
        assert time.monotonic() < end, f"waited {PATIENCE_S:.0f} s for {what}"
        time.sleep(step_s)
