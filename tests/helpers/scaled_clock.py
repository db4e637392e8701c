"""A clock that runs faster than the machine's, for trials over real connections."""

from __future__ import annotations

import time


class ScaledClock:
    """A clock that runs faster than the machine's, for trials over real connections.

    Args:
        speed: Seconds of this clock in one real second, > 0.
    """

    def __init__(self, speed: float) -> None:
        if not speed > 0.0:
            raise ValueError("the speed of a clock must be greater than 0")
        self._speed = speed

    def now(self) -> float:
        """Return the time in this clock's seconds."""
        return time.monotonic() * self._speed

    def sleep(self, seconds: float) -> None:
        """Let this clock's time pass."""
        if seconds > 0.0:
            time.sleep(seconds / self._speed)
