"""Retry limits for an address that has not yet answered as a camera.

Real Wi-Fi loses, cuts and garbles replies temporarily, whereas a router's page or a closed port is
permanent.
"""

from __future__ import annotations

from typing import Final

from app.devices.clock import Clock
from app.devices.errors import BadReply, DeviceError, NotACamera, PasswordNeeded, Unreachable
from app.devices.theta.network_errors import BROKEN, NO_SUCH_NAME, NOBODY

GARBLED_S: Final = 20.0
"""Time during which cut, garbled or interrupted replies are tolerated, in seconds."""

PAUSES_S: Final = (0.5, 1.0, 2.0, 4.0)
"""Pauses between successive requests, in seconds. The last pause repeats."""

_STRANGERS: Final = 3
_REFUSALS: Final = 3


class FirstContact:
    """The failures at one address, in order.

    Args:
        silences: Number of consecutive timeouts after which to give up.
    """

    def __init__(self, clock: Clock, silences: int) -> None:
        self._clock, self._began = clock, clock.now()
        self._most = {"stranger": _STRANGERS, "nobody": _REFUSALS, "silence": silences}
        self._kind, self._in_a_row = "", 0
        self._pauses = 0

    def hopeless(self, error: DeviceError) -> bool:
        """Count a failure, and return whether to give up."""
        kind = _kind(error)
        if kind == "garbled":
            return self._clock.now() - self._began > GARBLED_S
        self._in_a_row = self._in_a_row + 1 if kind == self._kind else 1
        self._kind = kind
        return self._in_a_row >= self._most[kind]

    def pause_s(self) -> float:
        """Return the pause before the next request, in seconds, from `PAUSES_S`."""
        self._pauses += 1
        return PAUSES_S[min(self._pauses, len(PAUSES_S)) - 1]


def _kind(error: DeviceError) -> str:
    if isinstance(error, NotACamera | PasswordNeeded):
        return "stranger"
    if error.code in (NOBODY, NO_SUCH_NAME):
        return "nobody"
    garbled = isinstance(error, BadReply) or (
        isinstance(error, Unreachable) and error.code == BROKEN
    )
    return "garbled" if garbled else "silence"
