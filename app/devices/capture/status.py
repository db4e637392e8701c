"""How far a capture is, for whoever shows it."""

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
    """What a capture is doing."""

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
    """How far one frame has come over."""

    name: str
    received: int = 0
    size: int = 0
    bytes_per_s: float = 0.0
    done: bool = False
    thumbnail: Path | None = None


@dataclass(frozen=True, slots=True)
class Status:
    """How far a capture is.

    * `fraction`: share of the whole that is done, 0 to 1; never goes back, except after a failed
      start.
    * `shot`, `shots`: the exposure that is being made, counted from 1, and how many there will be;
      0 before.
    * `seconds_left`: until the last exposure while exposing, until the last byte while downloading,
      until the end of the search while the camera is out of reach; None where that cannot be said.
    * `seeking`: the camera is out of reach, and the connection is sought.
    * `may_move`: all exposures have been made: people may walk about again.
    * `timer_s`: until the self-timer ends, at the moment of this status; 0 while none runs.
    * `metered`: small JPEG of the picture for metering, not checked; empty before there is one.
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
        """The time left: "4 s left", "almost done", or nothing where it cannot be said."""
        seconds = self.seconds_left
        if seconds is None:
            return ""
        # A wait for the camera that ends without it is not almost done.
        almost = seconds < _ALMOST_S and not self.seeking
        return tr("almost done") if almost else time_left(seconds)


def time_left(seconds: float) -> str:
    """Say how long something will take.

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
"""Part of the whole that each stage takes; those that end a capture early leave it as it was."""


class Board:
    """Holds the status and tells it on every change."""

    def __init__(self, tell: Callable[[Status], None]) -> None:
        self._tell = tell
        self.status = Status()

    def show(
        self, stage: Stage, message: Progress | str, part: float = 0.0, **changes: Any
    ) -> None:
        """Say what is being done.

        * `part`: share of the stage that is done, 0 to 1.
        * `**changes`: further fields of `Status`; `seconds_left` is None, `seeking` False and
          `timer_s` 0 unless given.
        """
        low, high = _SPANS.get(stage, (self.status.fraction, self.status.fraction))
        fraction = low + (high - low) * min(max(part, 0.0), 1.0)
        changes = {"seconds_left": None, "seeking": False, "timer_s": 0.0, **changes}
        self.status = replace(
            self.status, stage=stage, message=message, fraction=fraction, **changes
        )
        self._tell(self.status)

    def say(self, message: str, left_s: float | None = None, *, seeking: bool = False) -> None:
        """Change the message and the time left only."""
        changes: dict[str, Any] = {"seconds_left": left_s, "seeking": seeking}
        self.status = replace(self.status, message=message, **changes)
        self._tell(self.status)
