"""Whether a file from a camera has come over whole."""

from __future__ import annotations

import hashlib
import math
import re
from typing import TYPE_CHECKING, Final

from app.core.base.errors import ProbeError
from app.core.base.files import open_file
from app.core.base.progress import Token
from app.core.hdr.decoding import READ_ROWS, FileRows, row_bands
from app.core.hdr.metadata import Header, read_header
from app.core.hdr.words import listed
from app.devices.errors import CaptureFailed

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from app.core.hdr.frame import Exposure
    from app.core.hdr.planner import Plan


_EQUAL_STOPS: Final = 0.05
_SAME_STOPS: Final = 1.0 / 6.0
_NUMBERS: Final = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")


def check_frames(paths: Sequence[Path], plan: Plan) -> tuple[str, ...]:
    """Compare the frames with the plan.

    Sentences for the user about frames that were taken differently; their true values count. Raises
    `CaptureFailed` when they are no bracket: equal exposures, or compressed in the camera. The
    files stay.
    """
    headers = [_header(path) for path in dict.fromkeys(paths)]
    _check_tone(headers)
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


def _check_tone(headers: Sequence[Header]) -> None:
    mapped = [header.frame.path.name for header in headers if header.frame.tone_mapped]
    if mapped:
        verb = "was" if len(mapped) == 1 else "were"
        raise CaptureFailed(
            f"{listed(mapped)} {verb} taken with HDR rendering or range compensation on, which"
            " changes every pixel in its own way.",
            "Switch the filter off on the camera and shoot again. The files were kept.",
            "tone-mapped",
        )


def _check_different(headers: Sequence[Header]) -> None:
    stops = [header.frame.exposure.ev for header in headers if header.frame.exposure]
    if len(stops) < 2 or max(stops) - min(stops) > _EQUAL_STOPS:
        return
    number = _NUMBERS[len(stops)] if len(stops) < len(_NUMBERS) else str(len(stops))
    raise CaptureFailed(
        f"The camera took {number} equal exposures instead of a bracket.",
        "Switch it off and on, close other apps that use it, and shoot again. The files were kept.",
        "equal-exposures",
    )


def _differences(headers: Sequence[Header], plan: Plan) -> list[str]:
    """Name frames that match no shot of the plan."""
    left = [shot.exposure for shot in plan.shots]
    strange: list[Header] = []
    for header in headers:
        taken = header.frame.exposure
        match = next((each for each in left if taken and _same(taken, each)), None)
        if match is not None:
            left.remove(match)
        else:
            strange.append(header)
    sentences = []
    for number, header in enumerate(strange):
        taken, name = header.frame.exposure, header.frame.path.name
        if taken is None:
            sentences.append(f"{name} does not state its exposure.")
        elif number < len(left):
            sentences.append(
                f"{name} was taken with {_words(taken)} instead of {_words(left[number])};"
                " its true values are used."
            )
        else:
            sentences.append(f"{name} ({_words(taken)}) was not asked for; it is used as it is.")
    return sentences


def _same(taken: Exposure, planned: Exposure) -> bool:
    pairs = [(taken.shutter_s, planned.shutter_s)]
    if taken.known:
        pairs += [(taken.iso, planned.iso), (taken.aperture**2, planned.aperture**2)]
    return all(abs(math.log2(one / other)) <= _SAME_STOPS for one, other in pairs)


def _words(exposure: Exposure) -> str:
    time = exposure.shutter_s
    shutter = f"{time:.3g} s" if time > 0.3 else f"1/{1.0 / time:.0f} s"
    return f"{shutter}, ISO {exposure.iso:g}, f/{exposure.aperture:g}"


_CHUNK: Final = 1 << 20
_START: Final = b"\xff\xd8\xff"
# A marker that ends a stretch of coded picture: neither a stuffed 0, a restart, nor padding.
_MARKER: Final = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]")
_STANDALONE: Final = frozenset({0x01, *range(0xD0, 0xD8)})


def jpeg_end(data: bytes) -> int | None:
    """Find where a JPEG ends, by its structure.

    Number of bytes up to and with the end marker; None where the data is not a JPEG or stops before
    it. That the picture in between can be decoded is not looked at.

    Examples
    --------
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
            found = _MARKER.search(data, place)
            if found is None:
                return None
            place = found.start()
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
    if not whole_file(path):
        return False
    token = token or Token()
    try:
        frame = read_header(path).frame
        rows = FileRows(frame)
        try:
            for start, stop in row_bands(frame.shape[0], READ_ROWS):
                token.check()
                rows.rows(start, stop)
        finally:
            rows.close()
    except ProbeError:
        return False
    return True


def sha256_of(path: Path) -> str:
    """Checksum of a file in hexadecimal digits."""
    digest = hashlib.sha256()
    with open_file(path) as stream:
        while block := stream.read(_CHUNK):
            digest.update(block)
    return digest.hexdigest()
