"""Integrity of downloaded files: complete JPEGs, and EXIF that matches the planned bracket.

Some cameras silently ignore settings: they take three identical exposures, or ignore ISO outside
the manual program. `core.measure` reports what can be seen from a bracket alone, such as lenses
with different exposures or duplicate frames.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from app.core.base.atomic_files import open_file
from app.core.base.errors import ProbeError
from app.core.base.phrases import listed, shutter_words
from app.core.base.progress import Token
from app.core.measure.bracket.grouping import rendered_frames
from app.core.measure.bracket.half_size import is_whole
from app.core.measure.plan.planner import Plan
from app.core.measure.read.frame import Exposure
from app.core.measure.read.metadata import Header, read_header
from app.core.text import tr, tr_plural
from app.devices.errors import CaptureFailed

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
# A marker that ends compressed data: not a stuffed 0, a restart marker or padding.
_MARKER: Final = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]")
_STANDALONE: Final = frozenset({0x01, *range(0xD0, 0xD8)})


def check_frames(paths: Sequence[Path], plan: Plan) -> tuple[str, ...]:
    """Compare the frames with the plan. The files are always kept.

    Returns:
        Sentences about frames whose exposures differ from the plan. The exposures that the files
        record are used.

    Raises:
        CaptureFailed: If the exposures are identical and the frames therefore form no bracket, or
            if the camera tone-mapped the frames.
    """
    headers = [_header(path) for path in dict.fromkeys(paths)]
    if names := rendered_frames(headers):
        raise CaptureFailed(
            tr_plural(
                "{names} was taken with the camera’s HDR or range compensation on.",
                "{names} were taken with the camera’s HDR or range compensation on.",
                len(names),
                names=listed(names),
            ),
            tr("Switch it off on the camera and shoot again. The files were kept."),
            "tone-mapped",
        )
    _check_different(headers)
    return tuple(_differences(headers, plan))


def planned_times(paths: Sequence[Path], plan: Plan) -> tuple[float, ...] | None:
    """Return the planned exposure times if no file records its own and each shot has a file.

    The times are in seconds, in the order of `paths`. Otherwise the result is None.
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
        tr("The camera took {number} identical exposures instead of a bracket.", number=number),
        tr(
            "Restart the camera, close other apps that use it and shoot again. The files were kept."
        ),
        "equal-exposures",
    )


def _differences(headers: Sequence[Header], plan: Plan) -> list[str]:
    """Return a sentence about each frame that matches no planned shot."""
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
            sentences.append(tr("{name} has no exposure data.", name=name))
        elif number < len(exposures):
            sentences.append(
                tr(
                    "{name} was taken at {taken} instead of {planned}; its actual values are used.",
                    name=name,
                    taken=_words(exposure),
                    planned=_words(exposures[number]),
                )
            )
        else:
            sentences.append(
                tr(
                    "{name} ({taken}) is not in the plan; it is used anyway.",
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
    """Find the end of a JPEG by its structure, without decoding it.

    Returns:
        The number of bytes including the end marker, or None if the data is not a JPEG or ends
        before the marker.

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
    """Return whether a file has the structure of a complete JPEG.

    Bytes after the image (a second, smaller image, or padding) are allowed.
    """
    try:
        with open_file(path) as stream:
            return jpeg_end(stream.read()) is not None
    except OSError:
        return False


def whole_picture(path: Path, token: Token | None = None) -> bool:
    """Return whether a JPEG can be decoded to its last row.

    Returns:
        False if the file is truncated, damaged or not a JPEG.

    Raises:
        Cancelled: If the token, which is checked every few rows, is cancelled.
    """
    try:
        return whole_file(path) and is_whole(read_header(path).frame, token or Token())
    except ProbeError:
        return False


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file as hexadecimal digits."""
    digest = hashlib.sha256()
    with open_file(path) as stream:
        while block := stream.read(_CHUNK):
            digest.update(block)
    return digest.hexdigest()
