"""The status of a capture: its stage, message and progress."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

from app.core.base.progress import Progress
from app.core.text import tr

_ALMOST_S: Final = 1.5


class Stage(StrEnum):
    """The stages of a capture."""

    IDLE = "idle"
    CONNECTING = "connecting"
    METERING = "metering"
    EXPOSING = "exposing"
    DOWNLOADING = "downloading"
    MERGING = "merging"
    DONE = "done"
    CANCELLED = "cancelled"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class FrameProgress:
    """The download of one frame."""

    name: str
    received: int = 0
    size: int = 0
    bytes_per_s: float = 0.0
    done: bool = False
    thumbnail: Path | None = None


@dataclass(frozen=True, slots=True)
class Status:
    """The status of a capture.

    Attributes:
        fraction: Completed fraction of the capture, 0 to 1. It never decreases, except after a
            failed start.
        shot, shots: Number of the current exposure, counted from 1 (0 before the first), and the
            total number of exposures.
        seconds_left: Seconds until the last exposure, the last byte, or the end of the time allowed
            for reconnecting, or None if unknown.
        seeking: Whether the camera is unreachable and the program is reconnecting.
        may_move: Whether all exposures are done and people may walk about again.
        timer_s: Seconds from this status until the self-timer ends, or 0 if no timer is running.
        metered: Unchecked JPEG thumbnail of the metering photo, or b"" before there is one.
    """

    stage: Stage = Stage.IDLE
    message: Progress | str = ""
    fraction: float = 0.0
    shot: int = 0
    shots: int = 0
    seconds_left: float | None = None
    seeking: bool = False
    may_move: bool = False
    timer_s: float = 0.0
    metered: bytes = field(default=b"", repr=False)
    frames: tuple[FrameProgress, ...] = ()

    @property
    def left_words(self) -> str:
        """The time left, such as "4 s left" or "almost done", or "" if it is unknown."""
        seconds = self.seconds_left
        if seconds is None:
            return ""
        # The time limit for reconnecting is not the end of the capture.
        almost = seconds < _ALMOST_S and not self.seeking
        return tr("almost done") if almost else time_left(seconds)


def time_left(seconds: float) -> str:
    """Describe the time left in words.

    Examples:
        >>> time_left(167.4), time_left(47.0)
        ('2:47 left', '47 s left')
    """
    whole = max(round(seconds), 1)
    if whole < 60:
        return tr("{seconds} s left", seconds=whole)
    return tr("{minutes}:{seconds:02d} left", minutes=whole // 60, seconds=whole % 60)


_SPANS: Final = {
    Stage.IDLE: (0.0, 0.0),
    Stage.CONNECTING: (0.0, 0.05),
    Stage.METERING: (0.05, 0.25),
    Stage.EXPOSING: (0.25, 0.6),
    Stage.DOWNLOADING: (0.6, 0.9),
    Stage.MERGING: (0.9, 1.0),
    Stage.DONE: (1.0, 1.0),
}
"""Range of `fraction` for each stage. A stage that ends a capture early keeps the last fraction."""


class Board:
    """Holds the current status and reports every change."""

    def __init__(self, tell: Callable[[Status], None]) -> None:
        self._tell = tell
        self.status = Status()

    def show(
        self, stage: Stage, message: Progress | str, part: float = 0.0, **changes: Any
    ) -> None:
        """Show a stage and its message.

        Args:
            part: Completed fraction of the stage, 0 to 1.
            **changes: Other fields of `Status`. By default `seconds_left` is None, `seeking` False
                and `timer_s` 0.
        """
        low, high = _SPANS.get(stage, (self.status.fraction, self.status.fraction))
        fraction = low + (high - low) * min(max(part, 0.0), 1.0)
        changes = {"seconds_left": None, "seeking": False, "timer_s": 0.0, **changes}
        self.status = replace(
            self.status, stage=stage, message=message, fraction=fraction, **changes
        )
        self._tell(self.status)

    def say(self, message: str, left_s: float | None = None, *, seeking: bool = False) -> None:
        """Change only the message and the time left."""
        changes: dict[str, Any] = {"seconds_left": left_s, "seeking": seeking}
        self.status = replace(self.status, message=message, **changes)
        self._tell(self.status)
