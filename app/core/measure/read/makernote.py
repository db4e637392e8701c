r"""Read the Ricoh maker note of a Theta.

A Theta sets the sensitivity of its two lenses separately, and it may already have levelled the
picture or compressed its range. Only the maker note, which OpenImageIO ignores, records this. The
following tags are read. They follow theta-api-specs, "THETA Metadata Spec", and, from 0x0101 on,
ExifTool's table `Ricoh::ThetaSubdir`:

====== ============================ ==========================================================
tag    type, count                  meaning
====== ============================ ==========================================================
0x0001 SHORT, 1                     picture: 1 equirectangular, 2 to 6 fisheye
0x0002 SHORT, 1                     HDR rendering 0/1
0x0007 SHORT, 1                     zenith correction applied 0/1
0x0008 SHORT, 1                     dynamic range compensation 0/1 (not on the X)
0x000E SHORT, 1                     handheld HDR 0/1 (not on the S)
0x0101 SHORT, 2 (X) or 4 (S, V)     ISO of each lens; four are two values, each followed by a 0
0x0103 RATIONAL, 2 (S, V),          exposure time of each lens in seconds
       SRATIONAL, 2 (X)
====== ============================ ==========================================================

Types and counts are those in files from the S (firmware 1.11), V (3.30.1) and X (1.00.1, 2.00.0).
All are big-endian. The EXIF segment comes first in the file, or second after a JFIF segment (as in
the X reductions). The note starts with ``Ricoh\0\0\0`` and a directory, whose entry 0x4001 (LONG,
1) contains the offset of the Theta directory. All offsets count from the TIFF header, not from the
note.

Files are untrusted, so only the EXIF segment's own bytes (at most 64 KiB) are read, each offset is
checked against the segment's end, and at most four directories of 256 entries are read one after
another. An invalid note counts as absent.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

from app.core.base.atomic_files import open_file

_MAX_SEGMENTS: Final = 64
_MAX_FILL: Final = 16
_MAX_ENTRIES: Final = 256
_MAX_VALUES: Final = 4
_EXIF: Final = b"Exif\x00\x00"
_RICOH: Final = b"Ricoh\x00\x00\x00"

_EXIF_IFD: Final = 0x8769
_MAKER_NOTE: Final = 0x927C
_THETA_IFD: Final = 0x4001
_PICTURE: Final = 0x0001
_ZENITH: Final = 0x0007
_TONE: Final = (0x0002, 0x0008, 0x000E)
_LENS_ISO: Final = 0x0101
_LENS_TIME: Final = 0x0103

_SHORT: Final = 3
_LONG: Final = 4
_UNDEFINED: Final = 7
_INTEGERS: Final = {_SHORT: "H", _LONG: "I"}
_FRACTIONS: Final = {5: "II", 10: "ii"}

_ISO_LIMITS: Final = (1.0, 1e6)
_TIME_LIMITS: Final = (1e-7, 1e5)


@dataclass(frozen=True, slots=True)
class RicohNote:
    """The values in a Theta's maker note. A missing value is empty or None."""

    lens_isos: tuple[float, ...] = ()
    lens_shutters_s: tuple[float, ...] = ()
    zenith_corrected: bool | None = None
    tone_mapped: bool = False
    equirectangular: bool | None = None


def read_ricoh_note(path: Path) -> RicohNote | None:
    """Read the maker note of a JPEG file, or return None if there is no valid one."""
    try:
        with open_file(path) as stream:
            segment = exif_segment(stream)
    except (OSError, ValueError):
        return None
    return None if segment is None else parse_ricoh_note(segment)


def exif_segment(stream: BinaryIO) -> bytes | None:
    """Find the EXIF segment of a JPEG file (APP1 of JIS X 5-3, EXIF 2.32 section 4.5).

    Returns:
        The bytes from the TIFF header to the segment's end, less than 64 KiB, or None if the
        segment is missing or truncated.
    """
    if stream.read(2) != b"\xff\xd8":
        return None
    for _ in range(_MAX_SEGMENTS):
        size = _segment_size(stream)
        if size is None:
            return None
        marker, length = size
        if marker != 0xE1 or length < len(_EXIF):
            stream.seek(length, 1)
            continue
        data = stream.read(length)
        if data.startswith(_EXIF):
            return data[len(_EXIF) :] if len(data) == length else None
    return None


def _segment_size(stream: BinaryIO) -> tuple[int, int] | None:
    """Return a segment's marker and remaining size, or None at the start of the picture data."""
    marker = stream.read(2)
    for _ in range(_MAX_FILL):  # A marker may be preceded by any number of fill bytes.
        if marker != b"\xff\xff":
            break
        marker = b"\xff" + stream.read(1)
    length = stream.read(2)
    if len(marker) < 2 or len(length) < 2 or marker[0] != 0xFF:
        return None
    code = marker[1]
    # Segments without a length (0x01, 0xD0 to 0xD9) and the start of the scan end the header.
    if code in (0x00, 0x01, 0xDA, 0xFF) or 0xD0 <= code <= 0xD9:
        return None
    count = int.from_bytes(length, "big")
    return (code, count - 2) if count >= 2 else None


def parse_ricoh_note(exif: bytes) -> RicohNote | None:
    """Read the Theta directory in a Ricoh maker note, or return None for other or damaged bytes."""
    order = {b"MM\x00*": ">", b"II*\x00": "<"}.get(exif[:4])
    if order is None:
        return None
    tiff = _Tiff(exif, order)
    main = tiff.directory(tiff.long_at(4))
    camera = tiff.directory(tiff.pointer(main, _EXIF_IFD))
    note = camera.get(_MAKER_NOTE)
    if note is None or note.kind != _UNDEFINED or note.count < len(_RICOH):
        return None
    if exif[note.offset : note.offset + len(_RICOH)] != _RICOH:
        return None
    theta = tiff.directory(tiff.pointer(tiff.directory(note.offset + len(_RICOH)), _THETA_IFD))
    return _interpret(tiff, theta) if theta else None


@dataclass(frozen=True, slots=True)
class _Entry:
    """One entry in a directory. Its values start at `offset`."""

    kind: int
    count: int
    offset: int


@dataclass(frozen=True, slots=True)
class _Tiff:
    """Bounds-checked reading from the bytes of a TIFF structure (TIFF 6.0, section 2)."""

    data: bytes
    order: str

    def unpack(self, form: str, offset: int) -> tuple[int, ...]:
        """Return the integers at an offset, or an empty tuple if they are not within the data."""
        form = self.order + form
        if offset < 0 or offset + struct.calcsize(form) > len(self.data):
            return ()
        return struct.unpack_from(form, self.data, offset)

    def long_at(self, offset: int) -> int:
        """Return the offset stored at an offset, or 0 (no directory) if it is beyond the data."""
        return next(iter(self.unpack("I", offset)), 0)

    def directory(self, offset: int) -> dict[int, _Entry]:
        """Return the directory at an offset as entries by tag, or none if it is incomplete."""
        count = next(iter(self.unpack("H", offset)), 0)
        whole = offset + 2 + 12 * count <= len(self.data)
        if offset < 8 or not whole or count > _MAX_ENTRIES:
            return {}
        entries: dict[int, _Entry] = {}
        for start in range(offset + 2, offset + 2 + 12 * count, 12):
            tag, kind, number = self.unpack("HHI", start)
            place = start + 8 if _fits_inside(kind, number) else self.long_at(start + 8)
            entries.setdefault(tag, _Entry(kind, number, place))
        return entries

    def pointer(self, entries: dict[int, _Entry], tag: int) -> int:
        """Return the offset stored in an entry, or 0 if the entry contains none."""
        entry = entries.get(tag)
        if entry is None or (entry.kind, entry.count) != (_LONG, 1):
            return 0
        return self.long_at(entry.offset)

    def numbers(self, entry: _Entry | None) -> tuple[float, ...]:
        """Return up to four values of an entry, or none if there are more or any is invalid."""
        if entry is None or not 1 <= entry.count <= _MAX_VALUES:
            return ()
        if entry.kind in _INTEGERS:
            form = _INTEGERS[entry.kind] * entry.count
            return tuple(float(value) for value in self.unpack(form, entry.offset))
        if entry.kind in _FRACTIONS:
            flat = self.unpack(_FRACTIONS[entry.kind] * entry.count, entry.offset)
            return tuple(
                top / bottom if bottom else math.nan
                for top, bottom in zip(flat[::2], flat[1::2], strict=True)
            )
        return ()


def _fits_inside(kind: int, count: int) -> bool:
    """Return whether an entry's values fit in the entry itself, that is, in at most four bytes."""
    size = {1: 1, 2: 1, _SHORT: 2, _LONG: 4, 6: 1, _UNDEFINED: 1, 8: 2, 9: 4, 11: 4}.get(kind, 8)
    return size * count <= 4


def _interpret(tiff: _Tiff, theta: dict[int, _Entry]) -> RicohNote:
    zenith = _flag(tiff, theta, _ZENITH)
    picture = tiff.numbers(theta.get(_PICTURE))
    return RicohNote(
        lens_isos=_pair(tiff.numbers(theta.get(_LENS_ISO)), _ISO_LIMITS),
        lens_shutters_s=_pair(tiff.numbers(theta.get(_LENS_TIME)), _TIME_LIMITS),
        zenith_corrected=zenith,
        tone_mapped=any(_flag(tiff, theta, tag) for tag in _TONE),
        equirectangular=picture[0] == 1 if len(picture) == 1 and 1 <= picture[0] <= 6 else None,
    )


def _flag(tiff: _Tiff, theta: dict[int, _Entry], tag: int) -> bool | None:
    values = tiff.numbers(theta.get(tag))
    return bool(values[0]) if values in ((0.0,), (1.0,)) else None


def _pair(values: tuple[float, ...], limits: tuple[float, float]) -> tuple[float, ...]:
    """Return two plausible values, or an empty tuple if they are implausible."""
    if len(values) == 4 and values[1] == values[3] == 0.0:
        values = values[::2]
    plausible = len(values) == 2 and all(limits[0] <= value <= limits[1] for value in values)
    return values if plausible else ()
