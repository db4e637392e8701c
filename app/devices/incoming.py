"""Pictures as they come into a folder, and what makes several of them a bracket."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Final

from app.core.base.errors import ProbeError
from app.core.base.files import open_file
from app.core.base.image_input import open_image
from app.core.hdr.bracket import EQUAL_STOPS, MAX_FRAMES
from app.core.hdr.decoding import READ_ROWS, FileRows, row_bands
from app.core.hdr.frame import listed
from app.core.hdr.metadata import ENDINGS, read_header
from app.devices.capture.file_integrity import sha256_of, whole_file
from app.devices.theta.untrusted import words

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from app.core.hdr.frame import Exposure, Frame

MAX_BYTES: Final = 2_000_000_000
"""Largest file that is looked into; a JPEG must be a quarter of that."""

_TEMPORARY: Final = re.compile(
    r"\.|~|.*(?:~|\.(?:part|partial|tmp|temp|crdownload|download|filepart))$"
)
_LONGEST: Final = 300
_STAMP: Final = "%Y:%m:%d %H:%M:%S"
_TAKEN: Final = ("Exif:DateTimeOriginal", "DateTime")
_PATIENCE: Final = 6.0
_DIGITS: Final = re.compile(r"(\d+)", re.ASCII)


@dataclass(frozen=True, slots=True)
class Arrival:
    """A picture that has come whole.

    Attributes
    ----------
    shape : tuple[int, int]
        Rows and columns.
    kind : str
        How its pixels are stored.
    taken_s : float or None
        Time of EXIF in seconds; comparable only with that of the same camera.
    """

    path: Path
    camera: str
    shape: tuple[int, int]
    kind: str
    exposure: Exposure
    taken_s: float | None
    order: tuple[float, tuple[tuple[int, str], ...]]


@dataclass(frozen=True, slots=True)
class IncomingBracket:
    """Frames that belong together."""

    paths: tuple[Path, ...]
    exposures: tuple[Exposure, ...]
    reasons: tuple[str, ...]


def is_wanted(name: str) -> bool:
    """Tell by its name whether a file could be a picture that is read."""
    usable = name.isprintable() and not _TEMPORARY.match(name)
    return usable and name.lower().endswith(ENDINGS)


def passed_over(name: str) -> str:
    """Say why a file of this name is passed over; "" where nobody needs to hear of it.

    Returns
    -------
    str
        A sentence, the same for all files of one kind.
    """
    if not name.isprintable():
        return f"{words(name, 60)}: files with control characters in their names are passed over."
    ending = name.rpartition(".")[2].lower()
    if _TEMPORARY.match(name) or "." not in name or not 0 < len(ending) <= len("filepart"):
        return ""
    return f"Files ending in .{ending} are passed over; {listed(ENDINGS)} are read."


def read_arrival(path: Path, size: int, modified_s: float) -> Arrival | str:
    """Look into a file that has come.

    Parameters
    ----------
    size : int
        Its length in bytes.
    modified_s : float
        When it was changed last, in seconds, for files that do not say when they were taken.

    Returns
    -------
    Arrival or str
        The picture, or a sentence why it cannot be a frame.
    """
    try:
        _check_whole(path, size)
        frame = read_header(path).frame
    except ProbeError as error:
        return words(str(error), _LONGEST)
    if frame.exposure is None:
        return f"{path.name} does not state its exposure time and is left out."
    if frame.tone_mapped:
        return f"{path.name} was taken with HDR rendering on and is left out."
    taken = _taken_s(path)
    return Arrival(
        path=path,
        camera=frame.camera,
        shape=frame.shape,
        kind=frame.kind,
        exposure=frame.exposure,
        taken_s=taken,
        order=(modified_s if taken is None else taken, _numbers(path.name)),
    )


def _check_whole(path: Path, size: int) -> None:
    incomplete = ProbeError(
        f"{path.name} is damaged or incomplete; it is looked at when it changes."
    )
    if size > MAX_BYTES:
        raise ProbeError(f"{path.name} is too large for a picture.")
    try:
        with open_file(path) as stream:
            jpeg = stream.read(3) == b"\xff\xd8\xff"
    except OSError as error:
        raise ProbeError(
            f"{path.name} cannot be read: {(error.strerror or str(error)).lower()}."
        ) from None
    if jpeg:
        if size > MAX_BYTES // 4 or not whole_file(path):
            raise incomplete
        return
    frame = read_header(path).frame
    # Other formats do not end in a mark; their last rows are missing when they are cut off.
    try:
        _decode(frame.as_stored)
    except ProbeError as error:
        raise incomplete from error


def _decode(frame: Frame) -> None:
    rows = FileRows(frame)
    try:
        for start, stop in row_bands(frame.shape[0], READ_ROWS):
            rows.rows(start, stop)
    finally:
        rows.close()


def _taken_s(path: Path) -> float | None:
    with suppress(UnicodeError):
        source = open_image(path)
        if source is None:
            return None
        try:
            texts = [str(source.spec().getattribute(name) or "") for name in _TAKEN]
        finally:
            source.close()
        for text in texts:
            with suppress(ValueError, OverflowError, OSError):
                return datetime.strptime(text[:19], _STAMP).timestamp()
    return None


def _numbers(name: str) -> tuple[tuple[int, str], ...]:
    """Split a name so that IMG_10 comes after IMG_9."""
    return tuple(
        (int(part), "") if part.isdecimal() else (-1, part.lower()) for part in _DIGITS.split(name)
    )


@dataclass(slots=True)
class _Open:
    """A bracket that more frames may belong to."""

    frames: list[Arrival]
    last_s: float
    quiet_from_s: float


class Grouping:
    """Sorts arrivals into brackets.

    Parameters
    ----------
    quiet_s : float
        A bracket is complete when nothing has come for so many seconds; frames that were taken
        further apart, besides their exposures, are of different brackets.
    """

    def __init__(self, quiet_s: float) -> None:
        self._quiet_s = quiet_s
        self._open: dict[tuple[object, ...], _Open] = {}
        self._ready: list[IncomingBracket] = []
        self._notes: list[str] = []

    def add(self, arrival: Arrival, now: float) -> None:
        """Take a picture in.

        Parameters
        ----------
        now : float
            Time in seconds.
        """
        key = (arrival.camera, arrival.shape, arrival.kind)
        group = self._open.get(key)
        if group is not None:
            twin = _equal(group.frames, arrival)
            if twin is not None and _copies(twin, arrival):
                self._notes.append(f"{arrival.path.name} is a copy of {twin.path.name}.")
                return
            reason = self._another(group, arrival, twin)
            if reason:
                self._close(key, reason)
        group = self._open.setdefault(key, _Open([], now, now))
        group.frames.append(arrival)
        group.last_s = group.quiet_from_s = now

    def touch(self, now: float) -> None:
        """Wait a while longer with what is open: something is on its way."""
        for group in self._open.values():
            group.quiet_from_s = min(now, group.last_s + _PATIENCE * self._quiet_s)

    def forget(self, path: Path) -> None:
        """Drop a file that was removed or has changed."""
        for key, group in tuple(self._open.items()):
            group.frames = [frame for frame in group.frames if frame.path != path]
            if not group.frames:
                del self._open[key]

    def complete(self, now: float) -> Iterator[IncomingBracket]:
        """Give away what is complete.

        Parameters
        ----------
        now : float
            Time in seconds.
        """
        for key, group in tuple(self._open.items()):
            if now - group.quiet_from_s >= self._quiet_s:
                self._close(key, f"Nothing more came for {self._quiet_s:g} seconds.")
        while self._ready:
            yield self._ready.pop(0)

    def take_notes(self) -> list[str]:
        """Give away what there is to say."""
        notes, self._notes = self._notes, []
        return notes

    def _another(self, group: _Open, arrival: Arrival, twin: Arrival | None) -> str:
        """Say why a picture begins a new bracket; "" where it belongs to this one."""
        name = arrival.path.name
        if twin is not None:
            return f"{name} has the exposure of {twin.path.name}, so it begins another bracket."
        if len(group.frames) >= MAX_FRAMES:
            return f"A bracket has at most {MAX_FRAMES} frames."
        gap = _gap_s(group.frames, arrival)
        if gap > self._quiet_s:
            return f"{name} was taken {gap:.0f} s apart from the others."
        return ""

    def _close(self, key: tuple[object, ...], reason: str) -> None:
        frames = sorted(self._open.pop(key).frames, key=lambda frame: frame.order)
        if len(frames) > 1:
            self._ready.append(
                IncomingBracket(
                    tuple(frame.path for frame in frames),
                    tuple(frame.exposure for frame in frames),
                    (reason,),
                )
            )
        elif frames:
            self._notes.append(f"{frames[0].path.name} came alone and is no bracket.")


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
    """Time to the nearest frame besides what the exposures take; 0 where it is not known."""
    if arrival.taken_s is None:
        return 0.0
    gaps = [
        # Many cameras take a second, dark picture after a long exposure.
        abs(arrival.taken_s - frame.taken_s)
        - 2.0 * max(frame.exposure.shutter_s, arrival.exposure.shutter_s)
        for frame in frames
        if frame.taken_s is not None
    ]
    return max(min(gaps), 0.0) if gaps else 0.0
