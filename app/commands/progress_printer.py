"""Telling on stderr how far long work has come."""

from __future__ import annotations

import sys
import time

_PAUSE_S = 1.0  # between two lines about the same step


class ProgressPrinter:
    """A `Report` that prints to stderr, with the time left by the rate of the long part."""

    def __init__(self) -> None:
        self._last = (-_PAUSE_S, "")
        self._first: tuple[float, float] | None = None
        self._said = ""

    def __call__(self, fraction: float, message: str) -> None:
        """Say how far the work is; what was said already is not said again."""
        now = time.monotonic()
        left = ""
        if self._first is None or fraction < self._first[0]:
            self._first = (fraction, now)
        gained = fraction - self._first[0]
        if gained > 0.02 and fraction < 1:
            seconds = (now - self._first[1]) / gained * (1 - fraction)
            left = f", about {_duration(seconds)} left"
        line = f"{100 * fraction:3.0f} %  {message}{left}"
        due = message != self._last[1] or now - self._last[0] >= _PAUSE_S or fraction >= 1
        if line != self._said and due:
            print(line, file=sys.stderr, flush=True)
            self._said, self._last = line, (now, message)


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{max(5, 5 * round(seconds / 5))} s"
    if seconds < 90 * 60:
        return f"{round(seconds / 60)} min"
    return f"{round(seconds / 3600)} h"
