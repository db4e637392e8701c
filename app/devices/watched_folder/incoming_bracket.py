"""Brackets: photos with different exposures that arrive together.

A bracket is complete when no more photos have arrived for a while, or when an exposure repeats.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.core.measure.bracket.grouping import EQUAL_STOPS, MAX_FRAMES
from app.core.text import tr
from app.devices.capture.file_integrity import sha256_of
from app.devices.watched_folder.arrival import Arrival

_PATIENCE: Final = 6.0
QUIET: Final = tr("Nothing more arrived for {seconds:g} seconds.")
SAME_EXPOSURE: Final = tr("{name} has the same exposure as {other}, so it starts a new bracket.")
ALONE: Final = tr("{name} arrived alone, so it is not a bracket.")


@dataclass(frozen=True, slots=True)
class IncomingBracket:
    """The frames of one bracket."""

    paths: tuple[Path, ...]
    reasons: tuple[str, ...]


@dataclass(slots=True)
class _OpenBracket:
    """A bracket to which more frames may be added."""

    frames: list[Arrival]
    last_s: float
    quiet_from_s: float


class Grouping:
    """Groups photos into brackets.

    Args:
        quiet_s: Seconds without new arrivals after which a bracket is complete. Frames taken
            further apart than this, not counting their exposure times, belong to different
            brackets.
    """

    def __init__(self, quiet_s: float) -> None:
        self._quiet_s = quiet_s
        self._open: dict[tuple[object, ...], _OpenBracket] = {}
        self._ready: list[IncomingBracket] = []
        self._notes: list[str] = []

    def add(self, arrival: Arrival, now: float) -> None:
        """Add a photo that arrived at time `now`, in seconds."""
        key = (arrival.camera, arrival.shape, arrival.kind)
        group = self._open.get(key)
        if group is not None:
            twin = _equal(group.frames, arrival)
            if twin is not None and _copies(twin, arrival):
                self._notes.append(
                    tr("{name} is a copy of {other}.", name=arrival.path.name, other=twin.path.name)
                )
                return
            reason = self._another(group, arrival, twin)
            if reason:
                self._close(key, reason)
        group = self._open.setdefault(key, _OpenBracket([], now, now))
        group.frames.append(arrival)
        group.last_s = group.quiet_from_s = now

    def touch(self, now: float) -> None:
        """Extend the wait for open brackets because a file is still being copied."""
        for group in self._open.values():
            group.quiet_from_s = min(now, group.last_s + _PATIENCE * self._quiet_s)

    def forget(self, path: Path) -> None:
        """Remove a file that was deleted or modified."""
        for key, group in tuple(self._open.items()):
            group.frames = [frame for frame in group.frames if frame.path != path]
            if not group.frames:
                del self._open[key]

    def complete(self, now: float) -> Iterator[IncomingBracket]:
        """Yield the brackets that are complete at time `now`, in seconds, and remove them."""
        for key, group in tuple(self._open.items()):
            if now - group.quiet_from_s >= self._quiet_s:
                self._close(key, QUIET.format(seconds=self._quiet_s))
        while self._ready:
            yield self._ready.pop(0)

    def take_notes(self) -> list[str]:
        """Return the notes added since the last call."""
        notes, self._notes = self._notes, []
        return notes

    def _another(self, group: _OpenBracket, arrival: Arrival, twin: Arrival | None) -> str:
        """Return why a photo starts a new bracket, or "" if it belongs to the current one."""
        name = arrival.path.name
        if twin is not None:
            return SAME_EXPOSURE.format(name=name, other=twin.path.name)
        if len(group.frames) >= MAX_FRAMES:
            return tr("A bracket has at most {most} frames.", most=MAX_FRAMES)
        gap = _gap_s(group.frames, arrival)
        if gap > self._quiet_s:
            return tr(
                "{name} and the other frames were taken {gap:.0f} s apart.", name=name, gap=gap
            )
        return ""

    def _close(self, key: tuple[object, ...], reason: str) -> None:
        frames = sorted(self._open.pop(key).frames, key=lambda frame: frame.order)
        if len(frames) > 1:
            self._ready.append(IncomingBracket(tuple(frame.path for frame in frames), (reason,)))
        elif frames:
            self._notes.append(ALONE.format(name=frames[0].path.name))


def _equal(frames: list[Arrival], arrival: Arrival) -> Arrival | None:
    for frame in frames:
        if abs(frame.exposure.ev - arrival.exposure.ev) < EQUAL_STOPS:
            return frame
    return None


def _copies(one: Arrival, other: Arrival) -> bool:
    if one.taken_s != other.taken_s:
        return False
    with suppress(OSError):
        return sha256_of(one.path) == sha256_of(other.path)
    return False


def _gap_s(frames: list[Arrival], arrival: Arrival) -> float:
    """Return the seconds to the nearest frame, not counting exposure times, or 0 if unknown."""
    if arrival.taken_s is None:
        return 0.0
    gaps = [
        # Many cameras record a second, dark frame after a long exposure.
        abs(arrival.taken_s - frame.taken_s)
        - 2.0 * max(frame.exposure.shutter_s, arrival.exposure.shutter_s)
        for frame in frames
        if frame.taken_s is not None
    ]
    return max(min(gaps), 0.0) if gaps else 0.0
