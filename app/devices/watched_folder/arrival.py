"""A photo that has arrived in the folder, with its integrity, exposure and date."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final

from app.core.base.atomic_files import open_file, os_errors_as
from app.core.base.errors import ProbeError
from app.core.base.imaging.image_input import open_image
from app.core.base.phrases import listed
from app.core.base.progress import Token
from app.core.measure.bracket.half_size import is_whole
from app.core.measure.read.frame import Exposure
from app.core.measure.read.metadata import ENDINGS, read_header
from app.core.text import tr
from app.devices.capture.file_integrity import whole_file
from app.devices.theta.untrusted import words

UNTIMED: Final = tr("{name} is skipped: it has no exposure time.")
TOO_LARGE: Final = tr("{name} is too large for a photo.")
MAX_BYTES: Final = 2_000_000_000
"""Size limit for a file, in bytes. A JPEG may be only a quarter of this size."""

_TEMPORARY: Final = re.compile(
    r"\.|~|.*(?:~|\.(?:part|partial|tmp|temp|crdownload|download|filepart))$"
)
_LONGEST: Final = 300
_STAMP: Final = "%Y:%m:%d %H:%M:%S"
_DATE_TAGS: Final = ("Exif:DateTimeOriginal", "DateTime")
_DIGITS: Final = re.compile(r"(\d+)", re.ASCII)


@dataclass(frozen=True, slots=True)
class Arrival:
    """A photo that has arrived completely.

    Attributes:
        shape: Rows and columns.
        kind: Format of the pixels.
        taken_s: EXIF time in seconds, or None if not recorded. Times are comparable only for photos
            from the same camera.
    """

    path: Path
    camera: str
    shape: tuple[int, int]
    kind: str
    exposure: Exposure
    taken_s: float | None
    order: tuple[float, tuple[tuple[int, str], ...]]


def is_wanted(name: str) -> bool:
    """Return whether a file's name suggests that it is a photo the program can read."""
    usable = name.isprintable() and not _TEMPORARY.match(name)
    return usable and name.lower().endswith(ENDINGS)


def passed_over(name: str) -> str:
    """Return the reason for skipping a file with this name, or "" if no reason is needed.

    All files of one kind get the same sentence.
    """
    if not name.isprintable():
        return tr(
            "{name} is skipped: its name contains control characters.",
            name=words(name, 60),
        )
    ending = name.rpartition(".")[2].lower()
    if _TEMPORARY.match(name) or "." not in name or not 0 < len(ending) <= len("filepart"):
        return ""
    return tr(
        "Files ending in .{ending} are skipped; {endings} are read.",
        ending=ending,
        endings=listed(ENDINGS),
    )


def read_arrival(path: Path, size: int, modified_s: float) -> Arrival | str:
    """Read a file that has arrived.

    Args:
        size: Size in bytes.
        modified_s: Modification time in seconds, used for files that contain no date.

    Returns:
        The photo, or a sentence explaining why the file is not a frame.
    """
    try:
        _check_whole(path, size)
        frame = read_header(path).frame
    except ProbeError as error:
        return words(str(error), _LONGEST)
    if frame.exposure is None:
        return UNTIMED.format(name=path.name)
    if frame.tone_mapped:
        return tr("{name} is skipped: it was taken with the camera’s HDR on.", name=path.name)
    shot_s = _taken_s(path)
    return Arrival(
        path=path,
        camera=frame.camera,
        shape=frame.shape,
        kind=frame.kind,
        exposure=frame.exposure,
        taken_s=shot_s,
        order=(modified_s if shot_s is None else shot_s, _numbers(path.name)),
    )


def _check_whole(path: Path, size: int) -> None:
    incomplete = ProbeError(
        tr(
            "{name} is damaged or incomplete; it will be checked again when it changes.",
            name=path.name,
        )
    )
    if size > MAX_BYTES:
        raise ProbeError(TOO_LARGE.format(name=path.name))
    sentence = tr("{name} cannot be read: {reason}.")
    with os_errors_as(ProbeError, sentence, name=path.name), open_file(path) as stream:
        jpeg = stream.read(3) == b"\xff\xd8\xff"
    if jpeg:
        if size > MAX_BYTES // 4 or not whole_file(path):
            raise incomplete
        return
    # Other formats have no end marker; if truncated, they lack their last rows.
    if not is_whole(read_header(path).frame.as_stored, Token()):
        raise incomplete


def _taken_s(path: Path) -> float | None:
    with suppress(UnicodeError):
        source = open_image(path)
        if source is None:
            return None
        try:
            texts = [str(source.spec().getattribute(name) or "") for name in _DATE_TAGS]
        finally:
            source.close()
        for text in texts:
            with suppress(ValueError, OverflowError, OSError):
                return datetime.strptime(text[:19], _STAMP).timestamp()
    return None


def _numbers(name: str) -> tuple[tuple[int, str], ...]:
    """Return a sort key that puts IMG_10 after IMG_9."""
    return tuple(
        (int(part), "") if part.isdecimal() else (-1, part.lower()) for part in _DIGITS.split(name)
    )
