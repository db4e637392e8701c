"""JPEG files with EXIF, Ricoh maker note and XMP pose, byte by byte and in either byte order."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import cv2
import numpy as np

Entry = tuple[int, int, Sequence[float]]
"""Tag, TIFF type and values; fractions as numerators and denominators in turn."""

ASCII, SHORT, LONG, RATIONAL, BLOB, SRATIONAL = 2, 3, 4, 5, 7, 10
_FORMS = {ASCII: "B", SHORT: "H", LONG: "I", RATIONAL: "I", BLOB: "B", SRATIONAL: "i"}

THETA_V: tuple[Entry, ...] = (
    (0x0001, SHORT, (1,)),
    (0x0002, SHORT, (0,)),
    (0x0007, SHORT, (1,)),
    (0x0008, SHORT, (0,)),
    (0x0101, SHORT, (64, 0, 80, 0)),
    (0x0103, RATIONAL, (1, 1000, 1, 1000)),
)
"""Theta directory in the manner of a V; its lenses differ by 0.32 stops."""


def text(value: bytes) -> Entry:
    """Entry without tag of a text; give the tag by `tagged`."""
    return (0, ASCII, tuple(value + b"\0"))


def tagged(tag: int, entry: Entry) -> Entry:
    return (tag, entry[1], entry[2])


def directory(entries: Sequence[Entry], at: int, order: str) -> bytes:
    """One TIFF directory at an offset, its values behind it."""
    table, values = b"", b""
    behind = at + 2 + 12 * len(entries) + 4
    for tag, kind, numbers in entries:
        data = struct.pack(order + _FORMS[kind] * len(numbers), *map(int, numbers))
        count = len(numbers) // 2 if kind in (RATIONAL, SRATIONAL) else len(numbers)
        if len(data) > 4:
            place = struct.pack(order + "I", behind + len(values))
            values += data
        else:
            place = data.ljust(4, b"\0")
        table += struct.pack(order + "HHI", tag, kind, count) + place
    return struct.pack(order + "H", len(entries)) + table + b"\0\0\0\0" + values


def exif(
    theta: Sequence[Entry] | None = THETA_V,
    camera: Sequence[Entry] = (),
    main: Sequence[Entry] = (),
    order: str = ">",
) -> bytes:
    """EXIF from the TIFF header on: main directory, camera directory, maker note, Theta's own."""
    start = (b"MM\0*" if order == ">" else b"II*\0") + struct.pack(order + "I", 8)

    def main_at(pointer: int) -> bytes:
        return directory([*main, (0x8769, LONG, (pointer,))], 8, order)

    camera_at = 8 + len(main_at(0))
    if theta is None:
        return start + main_at(camera_at) + directory(camera, camera_at, order)
    head = b"Ricoh\0\0\0"

    def note(at: int, pointer: int) -> bytes:
        entries: list[Entry] = [
            (0x0001, ASCII, tuple(b"Rdc\0")),
            (0x0005, BLOB, tuple(b"0000000000012345")),
            (0x4001, LONG, (pointer,)),
        ]
        return head + directory(entries, at + len(head), order)

    size = len(note(0, 0))
    with_note = [*camera, (0x927C, BLOB, (0,) * size)]
    note_at = camera_at + len(directory(with_note, camera_at, order)) - size
    with_note[-1] = (0x927C, BLOB, tuple(note(note_at, note_at + size)))
    body = main_at(camera_at) + directory(with_note, camera_at, order)
    return start + body + directory(theta, note_at + size, order)


def camera_tags(
    shutter: tuple[int, int] | None = (1, 1000),
    iso: int | None = 64,
    aperture: tuple[int, int] | None = (20, 10),
) -> list[Entry]:
    """Exposure as EXIF states it, in the order of the tags' numbers."""
    entries: list[Entry] = []
    if shutter:
        entries.append((0x829A, RATIONAL, shutter))
    if aperture:
        entries.append((0x829D, RATIONAL, aperture))
    if iso:
        entries.append((0x8827, SHORT, (iso,)))
    return entries


def pose_xmp(**degrees: float) -> bytes:
    """Photo Sphere XMP in attributes, as a Theta writes it: ``pose_xmp(PosePitchDegrees=-29)``."""
    said = " ".join(f'GPano:{name}="{value}"' for name, value in degrees.items())
    return (
        '<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF'
        ' xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"><rdf:Description rdf:about=""'
        ' xmlns:GPano="http://ns.google.com/photos/1.0/panorama/"'
        f' GPano:ProjectionType="equirectangular" {said}/></rdf:RDF></x:xmpmeta>'
    ).encode()


XMP = b"http://ns.adobe.com/xap/1.0/\0"
"""Start of the data of an APP1 segment with XMP."""


def segment(code: int, data: bytes) -> bytes:
    return bytes((0xFF, code)) + struct.pack(">H", len(data) + 2) + data


def jpeg(
    exif_data: bytes | None,
    xmp: bytes | None = None,
    shape: tuple[int, int] = (32, 64),
    seed: int = 0,
) -> bytes:
    """JPEG of random pixels with the given segments."""
    pixels = np.random.default_rng(seed).integers(0, 255, (*shape, 3), dtype=np.uint8)
    plain = cv2.imencode(".jpg", pixels)[1].tobytes()
    added = b"" if exif_data is None else segment(0xE1, b"Exif\0\0" + exif_data)
    if xmp is not None:
        added += segment(0xE1, XMP + xmp)
    return plain[:2] + added + plain[2:]
