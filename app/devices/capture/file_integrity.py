"""Whether files have come whole, and are the bracket that was planned, by their own EXIF.

Cameras do not always do what they were told, and say nothing: some take three equal exposures,
some ignore ISO outside the manual program. `core.measure` reports what a bracket shows by itself
(lenses with different exposures, copies).
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final

from app.core.base.atomic_files import open_file, os_errors_as
from app.core.base.errors import ProbeError
from app.core.base.imaging.image_input import open_image
from app.core.base.phrases import listed, shutter_words
from app.core.base.progress import Token
from app.core.measure.bracket.grouping import rendered_frames
from app.core.measure.bracket.half_size import is_whole
from app.core.measure.plan.planner import Plan
from app.core.measure.read.frame import Exposure
from app.core.measure.read.metadata import ENDINGS, Header, read_header
from app.core.text import tr, tr_plural
from app.devices.errors import CaptureFailed
from app.devices.theta.untrusted import words

_EQUAL_STOPS: Final = 0.05
_SAME_STOPS: Final = 1.0 / 6.0
_NUMBERS: Final = {
    2: tr("two"),
    3: tr("three"),
    4: tr("four"),
    5: tr("five"),
    6: tr("six"),
    7: tr("seven"),
    8: tr("eight"),
    9: tr("nine"),
}

_CHUNK: Final = 1 << 20
_START: Final = b"\xff\xd8\xff"
# A marker that ends a stretch of coded picture: neither a stuffed 0, a restart, nor padding.
_MARKER: Final = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]")
_STANDALONE: Final = frozenset({0x01, *range(0xD0, 0xD8)})
MAX_BYTES: Final = 2_000_000_000
"""Largest file that is looked into; a JPEG must be a quarter of that."""

_TEMPORARY: Final = re.compile(
    r"\.|~|.*(?:~|\.(?:part|partial|tmp|temp|crdownload|download|filepart))$"
)
_LONGEST: Final = 300
_STAMP: Final = "%Y:%m:%d %H:%M:%S"
_DATE_TAGS: Final = ("Exif:DateTimeOriginal", "DateTime")
_DIGITS: Final = re.compile(r"(\d+)", re.ASCII)


def check_frames(paths: Sequence[Path], plan: Plan) -> tuple[str, ...]:
    """Compare the frames with the plan.

    Sentences for the user about frames that were taken differently; their true values count. Raises
    `CaptureFailed` when they are no bracket: equal exposures, or compressed in the camera. The
    files stay.
    """
    headers = [_header(path) for path in dict.fromkeys(paths)]
    if names := rendered_frames(headers):
        raise CaptureFailed(
            tr_plural(
                "{names} was taken with HDR rendering or range compensation on, "
                "which changes every pixel in its own way.",
                "{names} were taken with HDR rendering or range compensation on, "
                "which changes every pixel in its own way.",
                len(names),
                names=listed(names),
            ),
            tr("Switch the filter off on the camera and shoot again. The files were kept."),
            "tone-mapped",
        )
    _check_different(headers)
    return tuple(_differences(headers, plan))


def planned_times(paths: Sequence[Path], plan: Plan) -> tuple[float, ...] | None:
    """Exposure times of the plan, where files state none and each shot has its file.

    In seconds, in the order of `paths`; None where EXIF is to be used.
    """
    headers = [_header(path) for path in paths]
    silent = all(header.shutter_s is None for header in headers)
    if not silent or len(headers) != len(plan.shots):
        return None
    return tuple(shot.exposure.shutter_s for shot in plan.shots)


def _header(path: Path) -> Header:
    try:
        return read_header(path)
    except ProbeError as error:
        raise CaptureFailed(error.message, error.hint, "bad-frame") from error


def _check_different(headers: Sequence[Header]) -> None:
    stops = [header.frame.exposure.ev for header in headers if header.frame.exposure]
    if len(stops) < 2 or max(stops) - min(stops) > _EQUAL_STOPS:
        return
    number = _NUMBERS.get(len(stops), str(len(stops)))
    raise CaptureFailed(
        tr("The camera took {number} equal exposures instead of a bracket.", number=number),
        tr(
            "Switch it off and on, close other apps that use it, and shoot again. "
            "The files were kept."
        ),
        "equal-exposures",
    )


def _differences(headers: Sequence[Header], plan: Plan) -> list[str]:
    """Name frames that match no shot of the plan."""
    exposures = [shot.exposure for shot in plan.shots]
    strange: list[Header] = []
    for header in headers:
        exposure = header.frame.exposure
        match = next((each for each in exposures if exposure and _same(exposure, each)), None)
        if match is not None:
            exposures.remove(match)
        else:
            strange.append(header)
    sentences = []
    for number, header in enumerate(strange):
        exposure, name = header.frame.exposure, header.frame.path.name
        if exposure is None:
            sentences.append(tr("{name} does not state its exposure.", name=name))
        elif number < len(exposures):
            sentences.append(
                tr(
                    "{name} was taken with {taken} instead of {planned}; its true values are used.",
                    name=name,
                    taken=_words(exposure),
                    planned=_words(exposures[number]),
                )
            )
        else:
            sentences.append(
                tr(
                    "{name} ({taken}) was not asked for; it is used as it is.",
                    name=name,
                    taken=_words(exposure),
                )
            )
    return sentences


def _same(actual: Exposure, plan: Exposure) -> bool:
    pairs = [(actual.shutter_s, plan.shutter_s)]
    if actual.known:
        pairs += [(actual.iso, plan.iso), (actual.aperture**2, plan.aperture**2)]
    return all(abs(math.log2(one / other)) <= _SAME_STOPS for one, other in pairs)


def _words(exposure: Exposure) -> str:
    return tr(
        "{shutter}, ISO {iso:g}, f/{aperture:g}",
        shutter=shutter_words(exposure.shutter_s),
        iso=exposure.iso,
        aperture=exposure.aperture,
    )


def jpeg_end(data: bytes) -> int | None:
    """Find where a JPEG ends, by its structure.

    Number of bytes up to and with the end marker; None where the data is not a JPEG or stops before
    it. That the picture in between can be decoded is not looked at.

    Examples:
        >>> jpeg_end(bytes.fromhex("ffd8 ffe00004abcd ffda0002 1234ff00 ffd9 99"))
        18
    """
    if data[:3] != _START:
        return None
    place = 2
    while place + 4 <= len(data) or data[place : place + 2] == b"\xff\xd9":
        if data[place] != 0xFF:
            return None
        marker = data[place + 1]
        if marker == 0xD9:
            return place + 2
        if marker == 0xFF or marker in _STANDALONE:
            place += 1 if marker == 0xFF else 2
            continue
        place += 2 + int.from_bytes(data[place + 2 : place + 4], "big")
        if marker == 0xDA:
            match = _MARKER.search(data, place)
            if match is None:
                return None
            place = match.start()
    return None


def whole_file(path: Path) -> bool:
    """Whether a file has the structure of a whole JPEG, from its first to its last byte.

    `path`: the file. Trailing bytes after the picture (a second, smaller picture, padding) are
    allowed.
    """
    try:
        with open_file(path) as stream:
            return jpeg_end(stream.read()) is not None
    except OSError:
        return False


def whole_picture(path: Path, token: Token | None = None) -> bool:
    """Whether a JPEG can be decoded to its last row.

    `token`: checked every few rows. False for everything that is not a JPEG, is cut off or damaged.
    Raises `Cancelled` when the token was cancelled.
    """
    try:
        return whole_file(path) and is_whole(read_header(path).frame, token or Token())
    except ProbeError:
        return False


def sha256_of(path: Path) -> str:
    """Checksum of a file in hexadecimal digits."""
    digest = hashlib.sha256()
    with open_file(path) as stream:
        while block := stream.read(_CHUNK):
            digest.update(block)
    return digest.hexdigest()


@dataclass(frozen=True, slots=True)
class Arrival:
    """A picture that has come whole.

    * `shape`: rows and columns.
    * `kind`: how its pixels are stored.
    * `taken_s`: time of EXIF in seconds; comparable only with that of the same camera.
    """

    path: Path
    camera: str
    shape: tuple[int, int]
    kind: str
    exposure: Exposure
    taken_s: float | None
    order: tuple[float, tuple[tuple[int, str], ...]]


def is_wanted(name: str) -> bool:
    """Tell by its name whether a file could be a picture that is read."""
    usable = name.isprintable() and not _TEMPORARY.match(name)
    return usable and name.lower().endswith(ENDINGS)


def passed_over(name: str) -> str:
    """Say why a file of this name is passed over; "" where that needs no words.

    Returns a sentence, the same for all files of one kind.
    """
    if not name.isprintable():
        return tr(
            "{name}: files with control characters in their names are passed over.",
            name=words(name, 60),
        )
    ending = name.rpartition(".")[2].lower()
    if _TEMPORARY.match(name) or "." not in name or not 0 < len(ending) <= len("filepart"):
        return ""
    return tr(
        "Files ending in .{ending} are passed over; {endings} are read.",
        ending=ending,
        endings=listed(ENDINGS),
    )


def read_arrival(path: Path, size: int, modified_s: float) -> Arrival | str:
    """Look into a file that has come.

    * `size`: its length in bytes.
    * `modified_s`: when it was changed last, in seconds, for files that do not say when they were
      taken.

    Returns the picture, or a sentence why it cannot be a frame.
    """
    try:
        _check_whole(path, size)
        frame = read_header(path).frame
    except ProbeError as error:
        return words(str(error), _LONGEST)
    if frame.exposure is None:
        return tr("{name} does not state its exposure time and is left out.", name=path.name)
    if frame.tone_mapped:
        return tr("{name} was taken with HDR rendering on and is left out.", name=path.name)
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
        tr("{name} is damaged or incomplete; it is looked at when it changes.", name=path.name)
    )
    if size > MAX_BYTES:
        raise ProbeError(tr("{name} is too large for a picture.", name=path.name))
    sentence = tr("{name} cannot be read: {reason}.")
    with os_errors_as(ProbeError, sentence, name=path.name), open_file(path) as stream:
        jpeg = stream.read(3) == b"\xff\xd8\xff"
    if jpeg:
        if size > MAX_BYTES // 4 or not whole_file(path):
            raise incomplete
        return
    # Other formats do not end in a mark; their last rows are missing when they are cut off.
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
    """Split a name so that IMG_10 comes after IMG_9."""
    return tuple(
        (int(part), "") if part.isdecimal() else (-1, part.lower()) for part in _DIGITS.split(name)
    )
