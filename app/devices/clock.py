"""Real and virtual clocks for clients and simulators.

Every wait, timeout, poll and rate in `app.devices` uses a `Clock`, so tests can run hundreds of
captures, with all their timeouts, in a few seconds.
"""

from __future__ import annotations

import threading
import time
from typing import Final, Protocol

from app.core.base.progress import Token

_STEP_S: Final = 0.1  # seconds until a cancelled wait ends


class Clock(Protocol):
    """A source of monotonic time in seconds, counted from an arbitrary moment."""

    def now(self) -> float:
        """Return the time in seconds."""

    def sleep(self, seconds: float) -> None:
        """Sleep, or return immediately if `seconds` is zero or less."""


class SystemClock:
    """The computer's own monotonic clock."""

    def now(self) -> float:
        """Return the time in seconds."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Sleep for the given number of seconds."""
        if seconds > 0.0:
            time.sleep(seconds)


class VirtualClock:
    """A clock that advances only when `sleep` is called.

    Args:
        start: Initial reading, in seconds.

    Examples:
        >>> clock = VirtualClock()
        >>> clock.sleep(3600)
        >>> clock.now()
        3600.0
    """

    def __init__(self, start: float = 0.0) -> None:
        self._now = float(start)
        self._lock = threading.Lock()

    def now(self) -> float:
        """Return the time in seconds."""
        return self._now

    def sleep(self, seconds: float) -> None:
        """Advance the time without waiting."""
        if seconds > 0.0:
            with self._lock:
                self._now += seconds


def wait(clock: Clock, seconds: float, token: Token | None = None) -> None:
    """Wait in short steps so that cancelling takes effect promptly.

    Raises:
        Cancelled: If the token is cancelled.
    """
    end = clock.now() + seconds
    while True:
        if token is not None:
            token.check()
        remaining_s = end - clock.now()
        if remaining_s <= 0.0:
            return
        clock.sleep(min(remaining_s, _STEP_S))
