r"""Metadata in the files of a 360 camera: EXIF, Ricoh's maker note and the XMP pose.

The layout is that of files from a Theta S, V and X: big-endian EXIF 2.3 in one APP1 segment. Its
maker note consists of the bytes ``Ricoh\0\0\0`` and an ordinary TIFF directory, in which tag 0x4001
points to the directory of the 360 camera. All offsets are relative to the TIFF header.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Final, TypeAlias

from app.core.measure.read.frame import LensExposure, XmpPose

_ASCII, _SHORT, _LONG, _RATIONAL, _BLOB, _SRATIONAL = 2, 3, 4, 5, 7, 10
_IFD_HEAD: Final = 8
_EXIF_IFD: Final = 0x8769
_MAKER_NOTE: Final = 0x927C
_MAKER_HEAD: Final = b"Ricoh\0\0\0"
_THETA_IFD: Final = 0x4001

_Entry: TypeAlias = tuple[int, int, int, bytes]
"""The tag, TIFF type, count and value of a directory entry."""


@dataclass(frozen=True, slots=True)
class Tags:
    """The metadata of a file. Values of None and empty strings are omitted.

    Attributes:
        shutter_s, aperture, iso: float or None. The exposure to record.
        program: EXIF exposure program: 1 manual, 2 automatic.
        shape: Rows and columns to record.
        pose: GPano pose, or None to write GPano without one.
        lens_words: Number of 16-bit words for each lens in tag 0x0101: 2 up to the V, 1 in the X,
            which also uses signed times.
    """

    make: str = ""
    model: str = ""
    software: str = ""
    date_time: str = ""
    shutter_s: float | None = None
    aperture: float | None = None
    iso: float | None = None
    program: int = 1
    shape: tuple[int, int] = (0, 0)
    pose: XmpPose | None = None
    panorama: bool = True
    maker_note: bool = False
    zenith_corrected: bool | None = None
    hdr_rendering: bool = False
    lenses: tuple[LensExposure, ...] = ()
    lens_words: int = 2


def exif_segment(tags: Tags) -> bytes:
    """Return the APP1 segment that contains EXIF and, if requested, the maker note.

    Raises:
        ValueError: If the data does not fit into one segment (64 KiB).

    Examples:
        >>> exif_segment(Tags(iso=100))[10:12]
        b'MM'
    """
    main = [
        _text(0x010F, tags.make),
        _text(0x0110, tags.model),
        (0x0112, _SHORT, 1, _shorts([1])),
        _text(0x0131, tags.software),
        _text(0x0132, tags.date_time),
    ]
    main = [entry for entry in main if entry[2]]
    # The value of the pointer depends on the size of the first directory.
    after = _IFD_HEAD + _size([*main, _pointer(_EXIF_IFD, 0)])
    first = _directory(sorted([*main, _pointer(_EXIF_IFD, after)]), _IFD_HEAD)
    tiff = b"MM\0*" + struct.pack(">I", _IFD_HEAD) + first + _exif_directory(tags, after)
    return _segment(b"Exif\0\0" + tiff)


def pose_segment(tags: Tags) -> bytes:
    """Return the APP1 segment with XMP: the GPano projection, sizes and pose."""
    height, width = tags.shape
    values: dict[str, object] = {
        "ProjectionType": "equirectangular",
        "UsePanoramaViewer": "True",
        "CroppedAreaImageWidthPixels": width,
        "CroppedAreaImageHeightPixels": height,
        "FullPanoWidthPixels": width,
        "FullPanoHeightPixels": height,
        "CroppedAreaLeftPixels": 0,
        "CroppedAreaTopPixels": 0,
    }
    if tags.pose is not None:
        if tags.pose.heading_deg is not None:
            values["PoseHeadingDegrees"] = f"{tags.pose.heading_deg:.1f}"
        values["PosePitchDegrees"] = f"{tags.pose.pitch_deg:.1f}"
        values["PoseRollDegrees"] = f"{tags.pose.roll_deg:.1f}"
    lines = "".join(f"      <GPano:{key}>{v}</GPano:{key}>\n" for key, v in values.items())
    packet = (
        '<?xpacket begin="\ufeff" id="W5M0MpCehiHzreSzNTczkc9d"?>\n'
        f'<x:xmpmeta xmlns:x="adobe:ns:meta/" x:xmptk="{tags.software.strip()}">\n'
        '  <rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">\n'
        '    <rdf:Description rdf:about=""'
        ' xmlns:GPano="http://ns.google.com/photos/1.0/panorama/">\n'
        f"{lines}    </rdf:Description>\n  </rdf:RDF>\n</x:xmpmeta>\n"
        '<?xpacket end="r"?>'
    )
    return _segment(b"http://ns.adobe.com/xap/1.0/\0" + packet.encode())


def with_segments(jpeg: bytes, segments: Sequence[bytes]) -> bytes:
    """Insert segments at the start of a JPEG file in place of its JFIF segment."""
    if not segments:
        return jpeg
    start = 2
    # EXIF and JFIF both require the first position; cameras write only EXIF.
    if jpeg[2:4] == b"\xff\xe0":
        start = 4 + int.from_bytes(jpeg[4:6], "big")
    return b"".join([jpeg[:2], *segments, jpeg[start:]])


def _exif_directory(tags: Tags, offset: int) -> bytes:
    height, width = tags.shape
    entries = [
        (0x8822, _SHORT, 1, _shorts([tags.program])),
        (0x9000, _BLOB, 4, b"0230"),
        _text(0x9003, tags.date_time),
        _text(0x9004, tags.date_time),
        (0xA001, _SHORT, 1, _shorts([1])),
        (0xA002, _LONG, 1, struct.pack(">I", width)),
        (0xA003, _LONG, 1, struct.pack(">I", height)),
    ]
    if tags.shutter_s is not None:
        entries.append((0x829A, _RATIONAL, 1, _rationals([tags.shutter_s])))
    if tags.aperture is not None:
        entries.append((0x829D, _RATIONAL, 1, _rationals([tags.aperture])))
    if tags.iso is not None:
        entries += [
            (0x8827, _SHORT, 1, _shorts([min(round(tags.iso), 0xFFFF)])),
            (0x8830, _SHORT, 1, _shorts([1])),
        ]
    entries = [entry for entry in entries if entry[2]]
    if tags.maker_note:
        # Last in the data area, because its own offsets depend on the rest.
        at = offset + _size(entries) + 12
        note = _maker_note(tags, at)
        body = _directory(sorted([*entries, (_MAKER_NOTE, _BLOB, len(note), b"")]), offset, at)
        return body + note
    return _directory(sorted(entries), offset)


def _maker_note(tags: Tags, offset: int) -> bytes:
    offset += len(_MAKER_HEAD)
    entries = [
        (0x0001, _ASCII, 4, b"Rdc\0"),
        (0x0002, _ASCII, 8, b"Rev0100\0"),
        (0x0005, _BLOB, 16, b"0000000000100001"),
        (0x1000, _SHORT, 1, _shorts([2])),
    ]
    theta = offset + _size([*entries, _pointer(_THETA_IFD, 0)])
    head = _directory([*entries, _pointer(_THETA_IFD, theta)], offset)
    return _MAKER_HEAD + head + _directory(_theta_entries(tags), theta)


def _theta_entries(tags: Tags) -> list[_Entry]:
    entries = [
        (0x0001, _SHORT, 1, _shorts([1])),
        (0x0002, _SHORT, 1, _shorts([int(tags.hdr_rendering)])),
    ]
    if tags.pose is not None:
        # Roll comes first and ranges from 0 to 360 degrees.
        angles = [tags.pose.roll_deg % 360.0, tags.pose.pitch_deg]
        entries.append((0x0003, _SRATIONAL, 2, _tenths(angles)))
    if tags.zenith_corrected is not None:
        entries.append((0x0007, _SHORT, 1, _shorts([int(tags.zenith_corrected)])))
    if tags.lenses:
        words = [
            word for lens in tags.lenses for word in [round(lens.iso), *[0] * (tags.lens_words - 1)]
        ]
        times = _rationals([lens.shutter_s for lens in tags.lenses])
        entries.append((0x0101, _SHORT, len(words), _shorts(words)))
        if tags.aperture is not None:
            stops = _rationals([tags.aperture] * len(tags.lenses))
            entries.append((0x0102, _SRATIONAL, len(tags.lenses), stops))
        kind = _RATIONAL if tags.lens_words > 1 else _SRATIONAL
        entries.append((0x0103, kind, len(tags.lenses), times))
    return entries


def _directory(entries: Sequence[_Entry], offset: int, note_at: int = 0) -> bytes:
    """Return a TIFF directory starting at `offset`: its entries, followed by their long values."""
    table = [struct.pack(">H", len(entries))]
    data = b""
    at = offset + 2 + 12 * len(entries) + 4
    for tag, kind, count, value in entries:
        if tag == _MAKER_NOTE:
            field = struct.pack(">I", note_at)
        elif len(value) <= 4:
            field = value.ljust(4, b"\0")
        else:
            field = struct.pack(">I", at + len(data))
            data += value + b"\0" * (len(value) % 2)
        table.append(struct.pack(">HHI", tag, kind, count) + field)
    return b"".join([*table, b"\0\0\0\0", data])


def _size(entries: Sequence[_Entry]) -> int:
    """Return the size of a directory with its long values, in bytes."""
    values = (len(value) + len(value) % 2 for *_, value in entries if len(value) > 4)
    return 2 + 12 * len(entries) + 4 + sum(values)


def _pointer(tag: int, offset: int) -> _Entry:
    return tag, _LONG, 1, struct.pack(">I", offset)


def _text(tag: int, text: str) -> _Entry:
    data = text.encode("ascii", "replace") + b"\0" if text else b""
    return tag, _ASCII, len(data), data


def _shorts(values: Sequence[int]) -> bytes:
    return struct.pack(f">{len(values)}H", *values)


def _rationals(values: Sequence[float]) -> bytes:
    return b"".join(struct.pack(">II", *_ratio(value)) for value in values)


def _tenths(values: Sequence[float]) -> bytes:
    return b"".join(struct.pack(">ii", round(10.0 * value), 10) for value in values)


def _ratio(value: float) -> tuple[int, int]:
    """Return a fraction in the form that cameras write, such as 1/60 for 0.01666666."""
    if 0.0 < value < 0.4:
        below = round(1.0 / value)
        if abs(value * below - 1.0) < 1e-4:
            return 1, below
    fraction = Fraction(value).limit_denominator(1_000_000)
    return fraction.numerator, fraction.denominator


def _segment(payload: bytes) -> bytes:
    if len(payload) + 2 > 0xFFFF:
        raise ValueError(f"{len(payload)} bytes do not fit into one JPEG segment")
    return b"\xff\xe1" + struct.pack(">H", len(payload) + 2) + payload
