"""Films, pictures with odd EXIF and XMP, and style files that should not be."""

from __future__ import annotations

import io
import os
import struct
import warnings
import zipfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
import OpenImageIO as oiio

from app.core.painting.canvas import from_style
from app.core.painting.user_style import layers_path, text_path
from app.core.painting.user_styles import export_style, save_user_style
from tests.helpers.exif_bytes import (
    LONG,
    RATIONAL,
    SHORT,
    SRATIONAL,
    Entry,
    camera_tags,
    directory,
    exif,
    jpeg,
    pose_xmp,
    segment,
)
from tests.helpers.hostile_data import Hostile

__all__ = ["make_media", "sound_files"]

_SIZE: Final = (96, 64)
_FRAMES: Final = 12
_FLIPS: Final = 6
_CUTS: Final = (40, 0.3, 0.7, 0.98)
_CODECS: Final = (
    ("mp4", "mp4v"),
    ("mov", "mp4v"),
    ("mov", "png "),
    ("avi", "MJPG"),
    ("avi", "XVID"),
    ("avi", "FFV1"),
    ("mkv", "mp4v"),
    ("mkv", "HFYU"),
    ("webm", "VP80"),
    ("webm", "VP90"),
    ("mpg", "mp2v"),
    ("ts", "mp4v"),
)
_ODD_NAMES: Final = (
    *(b"caf\xe9", b"\xff\xfe\x80", b"red\x1b[31m", b"two\nlines", b"a?b=c&d", b"%04d%s%n"),
    *("rtl\u202egnp".encode(), "\u2066\u200f\u061c".encode(), b"-o", b"<b>&amp;", b"x" * 200),
)
_HUGE: Final = 0xFFFFFFFF
_MAXIMUM: Final = 0x7FFFFFFF


def make_media(folder: Path, seed: int = 41) -> list[Hostile]:
    """Make the files in a folder that is not there yet; the same seed gives the same."""
    folder.mkdir(parents=True)
    random = np.random.default_rng(seed)
    return [
        *_films(folder / "films", random),
        *_exif_pictures(folder / "exif"),
        *_xmp_pictures(folder / "xmp"),
        *_raw_files(folder / "raw"),
        *_light(folder / "light", random),
        *_styles(folder / "styles"),
    ]


def _keep(folder: Path, kind: str, files: Iterator[tuple[str, bytes]]) -> Iterator[Hostile]:
    folder.mkdir(parents=True, exist_ok=True)
    for name, data in files:
        path = folder / name
        path.write_bytes(data)
        yield Hostile(path, kind)


# -- films -------------------------------------------------------------------------------------


def _films(folder: Path, random: np.random.Generator) -> Iterator[Hostile]:
    folder.mkdir()
    sound = {}
    for ending, code in _CODECS:
        path = folder / f"sound-{code.strip().lower()}.{ending}"
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*code), 8.0, _SIZE)
        for number in range(_FRAMES):
            frame = random.integers(0, 80, (_SIZE[1], _SIZE[0], 3), dtype=np.uint8)
            frame[:, number * 8 : number * 8 + 8] += 100
            writer.write(frame)
        writer.release()
        if path.exists():
            sound[path.name] = path.read_bytes()
            yield Hostile(path, "film")
    damaged = _damaged_films(sound, random)
    yield from _keep(folder / "damaged", "film", damaged)
    whole = sound["sound-mp4v.mp4"]
    yield from _keep(folder / "atoms", "film", _odd_atoms(whole))
    yield from _keep(folder / "avi", "film", _odd_avi(sound["sound-mjpg.avi"]))
    yield from _keep(folder / "others", "film", _other_films(whole, sound["sound-mjpg.avi"]))
    named = folder / "named"
    named.mkdir()
    for name in _ODD_NAMES:
        path = named / os.fsdecode(name + b".mp4")
        path.write_bytes(whole)
        yield Hostile(path, "film")
    for size in ((2, 2), (16, 4096), (4096, 16), (640, 2)):
        path = named / f"size-{size[0]}-{size[1]}.avi"
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, size)
        for shade in range(4):
            writer.write(np.full((size[1], size[0], 3), 60 * shade, np.uint8))
        writer.release()
        if path.exists():
            yield Hostile(path, "film")


def _damaged_films(
    sound: dict[str, bytes], random: np.random.Generator
) -> Iterator[tuple[str, bytes]]:
    for name, data in sound.items():
        stem, ending = name.removeprefix("sound-").rsplit(".", 1)
        for cut in _CUTS:
            length = int(cut * len(data)) if isinstance(cut, float) else cut
            yield f"{stem}-{ending}-cut{cut}.{ending}", data[:length]
        for number in range(_FLIPS):
            changed = bytearray(data)
            # Also behind the pictures, where some containers have their tables.
            start = 4 if number % 2 else max(len(data) - 900, 4)
            for _ in range(2 + 6 * number):
                place = int(random.integers(start, min(start + 900, len(data))))
                changed[place] = int(random.integers(256))
            yield f"{stem}-{ending}-flip{number}.{ending}", bytes(changed)


def _patched(data: bytes, atom: bytes, offset: int, new: bytes) -> bytes:
    """Write over what is so far behind an atom's name."""
    at = data.find(atom)
    if at < 0:
        return data
    at += 4 + offset
    return data[:at] + new + data[at + len(new) :]


def _odd_atoms(data: bytes) -> Iterator[tuple[str, bytes]]:
    """Headers of an MP4 that lie; offsets as in ISO 14496-12."""
    four = struct.Struct(">I").pack
    patches: dict[str, tuple[bytes, int, bytes]] = {
        "duration-0": (b"mvhd", 16, four(0)),
        "duration-max": (b"mvhd", 16, four(_HUGE)),
        "media-duration-max": (b"mdhd", 16, four(_HUGE)),
        "scale-0": (b"mvhd", 12, four(0)),
        "media-scale-0": (b"mdhd", 12, four(0)),
        "media-scale-1": (b"mdhd", 12, four(1)),
        "media-scale-max": (b"mdhd", 12, four(_HUGE)),
        "audio": (b"hdlr", 8, b"soun"),
        "text": (b"hdlr", 8, b"text"),
        "no-handler": (b"hdlr", 8, b"\0\0\0\0"),
        "track-id-0": (b"tkhd", 12, four(0)),
        "track-huge": (b"tkhd", 76, four(0x7FFF0000) * 2),
        "rotated": (b"tkhd", 40, struct.pack(">9i", 0, 65536, 0, -65536, 0, 0, 0, 0, 1 << 30)),
        "skewed": (b"tkhd", 40, struct.pack(">9i", *[-(2**31)] * 9)),
        "matrix-0": (b"tkhd", 40, bytes(36)),
        "size-0": (b"mp4v", 24, bytes(4)),
        "size-max": (b"mp4v", 24, b"\xff\xff\xff\xff"),
        "size-8192": (b"mp4v", 24, struct.pack(">HH", 8192, 8192)),
        "times-count-max": (b"stts", 4, four(_HUGE)),
        "times-count-0": (b"stts", 4, four(0)),
        "times-step-0": (b"stts", 12, four(0)),
        "times-step-max": (b"stts", 12, four(_HUGE)),
        "times-frames-max": (b"stts", 8, four(_MAXIMUM)),
        "sizes-count-max": (b"stsz", 8, four(_HUGE)),
        "sizes-same-max": (b"stsz", 4, four(_HUGE)),
        "sizes-same-1": (b"stsz", 4, four(1)),
        "sizes-first-max": (b"stsz", 12, four(_HUGE)),
        "sizes-first-0": (b"stsz", 12, four(0)),
        "chunks-count-max": (b"stsc", 4, four(_HUGE)),
        "chunks-samples-max": (b"stsc", 12, four(_HUGE)),
        "offsets-count-max": (b"stco", 4, four(_HUGE)),
        "offset-behind": (b"stco", 8, four(0x7FFFFFF0)),
        "offset-0": (b"stco", 8, four(0)),
        "keys-max": (b"stss", 4, four(_HUGE)),
        "edit-negative": (b"elst", 12, four(_HUGE)),
        "edit-rate-0": (b"elst", 16, four(0)),
        "edit-count-max": (b"elst", 4, four(_HUGE)),
        "moov-size-0": (b"moov", -8, four(0)),
        "moov-size-1": (b"moov", -8, four(1)),
        "moov-size-max": (b"moov", -8, four(_HUGE)),
        "trak-size-8": (b"trak", -8, four(8)),
        "stbl-size-max": (b"stbl", -8, four(_HUGE)),
        "mdat-size-0": (b"mdat", -8, four(0)),
        "mdat-size-1": (b"mdat", -8, four(1)),
        "brand": (b"ftyp", 0, b"\0\xff\0\xff"),
        "esds-long": (b"esds", 4, b"\x03\xff\xff\xff\x7f"),
    }
    for name, (atom, offset, new) in patches.items():
        yield f"{name}.mp4", _patched(data, atom, offset, new)
    for code in (b"hvc1", b"avc1", b"av01", b"apcn", b"dvh1", b"raw ", b"xxxx", b"jpeg", b"rpza"):
        yield f"codec-{code.decode().strip()}.mp4", data.replace(b"mp4v", code)
    yield "no-moov.mp4", data[: data.find(b"moov") - 4]
    yield "two-moov.mp4", data + data[data.find(b"moov") - 4 :]
    deep = b""
    for _ in range(3000):
        deep = four(len(deep) + 8) + b"moov" + deep
    yield "deep.mp4", data[:32] + deep
    yield "deep-tracks.mp4", data[:32] + deep.replace(b"moov", b"trak")
    empty = four(8) + b"trak"
    yield "many-tracks.mp4", data[:32] + four(8 + 8 * 20_000) + b"moov" + empty * 20_000
    yield "many-atoms.mp4", data[:32] + (four(8) + b"free") * 200_000 + data[32:]


def _odd_avi(data: bytes) -> Iterator[tuple[str, bytes]]:
    two = struct.Struct("<I").pack
    head = data.find(b"avih") + 8
    stream = data.find(b"strh") + 8
    form = data.find(b"strf") + 8
    places = {
        "frame-time-0": (head, two(0)),
        "frame-time-max": (head, two(_HUGE)),
        "frames-0": (head + 16, two(0)),
        "frames-max": (head + 16, two(_HUGE)),
        "streams-0": (head + 24, two(0)),
        "streams-max": (head + 24, two(_HUGE)),
        "size-0": (form + 4, bytes(8)),
        "size-max": (form + 4, two(_MAXIMUM) * 2),
        "size-negative": (form + 4, struct.pack("<ii", -96, -64)),
        "size-9000": (form + 4, struct.pack("<ii", 9000, 9000)),
        "scale-0": (stream + 20, two(0)),
        "rate-0": (stream + 24, two(0)),
        "rate-max": (stream + 24, two(_HUGE)),
        "length-0": (stream + 32, two(0)),
        "length-max": (stream + 32, two(_HUGE)),
        "start-max": (stream + 28, two(_HUGE)),
        "audio": (stream, b"auds"),
        "handler": (stream + 4, b"\0\0\0\0"),
        "bits-0": (form + 14, b"\0\0"),
        "riff-size-0": (4, two(0)),
        "riff-size-max": (4, two(_HUGE)),
        "head-size-max": (16, two(_HUGE)),
    }
    for name, (at, new) in places.items():
        yield f"{name}.avi", data[:at] + new + data[at + len(new) :]
    index = data.find(b"idx1")
    yield "index-offsets.avi", data[: index + 8] + b"\xff" * (len(data) - index - 8)
    yield "no-index.avi", data[:index]
    yield "chunk-max.avi", data.replace(b"00dc", b"00dc\xff\xff\xff\x7f", 1)


def _other_films(mp4: bytes, avi: bytes) -> Iterator[tuple[str, bytes]]:
    """Lists of other files, other formats, and rubbish under the names of films."""
    packet = b"G" + bytes(187)
    yield "list.mp4", b"#EXTM3U\n#EXTINF:1,\nfile:///etc/passwd\n"
    yield "concat.mp4", b"ffconcat version 1.0\nfile /etc/passwd\n"
    yield "sdp.mp4", b"v=0\nm=video 5004 RTP/AVP 96\n"
    yield "url.mov", b"[InternetShortcut]\nURL=http://127.0.0.1:9/\n"
    yield "picture.mp4", jpeg(exif())
    yield "film.jpg", mp4
    yield "film.exr", mp4
    yield "film.avi", mp4
    yield "avi.mp4", avi
    yield "packets.ts", packet * 400
    yield "packets-long.ts", (bytes(4) + packet) * 400
    yield "zeros.mp4", bytes(20_000)
    yield "empty.mp4", b""
    yield "head-only.mkv", b"\x1a\x45\xdf\xa3" + b"\xff" * 2000
    yield "unknown-size.webm", b"\x1a\x45\xdf\xa3\x01\xff\xff\xff\xff\xff\xff\xff" + bytes(2000)
    yield "pack.mpg", b"\0\0\1\xba" + b"\xff" * 4000
    yield "gif.mp4", b"GIF89a" + bytes(100)
    yield "riff.avi", b"RIFF\xff\xff\xff\xffAVI " + b"LIST\xff\xff\xff\xff" * 500
    yield (
        "reference.mov",
        b"\0\0\0\x0cftypqt  " + b"\0\0\0\x30moov\0\0\0\x28rmra\0\0\0\x20rmda" * 200,
    )
    yield "archive.mp4", b"PK\3\4" + bytes(500)
    yield "twice.mp4", mp4 + mp4
    yield "behind-rubbish.mp4", b"\0\0\0\x10free" + bytes(8) + mp4


# -- pictures ----------------------------------------------------------------------------------


def _tiff(order: str, *parts: bytes) -> bytes:
    start = (b"MM\0*" if order == ">" else b"II*\0") + struct.pack(order + "I", 8)
    return start + b"".join(parts)


def _exif_pictures(folder: Path) -> Iterator[Hostile]:
    shape = (256, 512)
    yield from _keep(
        folder,
        "picture",
        ((f"{name}.jpg", jpeg(data, shape=shape)) for name, data in _odd_exif()),
    )
    yield from _keep(folder, "picture", _odd_segments())


def _raw_directory(order: str, rows: list[tuple[int, int, int, int]], after: int) -> bytes:
    """A directory of rows as they are: tag, type, count, value or offset; `after` is the next."""
    table = b"".join(struct.pack(order + "HHII", *row) for row in rows)
    return struct.pack(order + "H", len(rows)) + table + struct.pack(order + "I", after)


def _odd_exif() -> Iterator[tuple[str, bytes]]:
    for number in (0, 9, 65535):
        yield f"orientation-{number}", exif(None, main=[(0x0112, SHORT, (number,))])
    for name, pair in (
        ("by-0", (1, 0)),
        ("0-by-0", (0, 0)),
        ("0", (0, 1)),
        ("max", (_HUGE, 1)),
        ("least", (1, _HUGE)),
    ):
        yield f"time-{name}", exif(camera=camera_tags(pair))
        yield f"aperture-{name}", exif(camera=camera_tags(aperture=pair))
        focal: Entry = (0x920A, RATIONAL, pair)
        yield f"focal-{name}", exif(None, camera=[*camera_tags(), focal])
    bias: Entry = (0x9204, SRATIONAL, (-(2**31), 1))
    yield "bias-min", exif(camera=[*camera_tags(), bias])
    yield "bias-by-0", exif(camera=[*camera_tags(), (0x9204, SRATIONAL, (1, 0))])
    yield "iso-0", exif(camera=[(0x8827, SHORT, (0,))])
    yield "iso-list", exif(camera=[(0x8827, SHORT, tuple(range(3000)))])
    yield "focal-35-max", exif(None, camera=[(0xA405, SHORT, (65535,))])
    yield "size-max", exif(None, camera=[(0xA002, LONG, (_HUGE,)), (0xA003, LONG, (_HUGE,))])
    for when in (b"9999:99:99 99:99:99", b"0000:00:00 00:00:00", b"\xff" * 19, b"now", b""):
        stamp = (0x9003, 2, tuple(when + b"\0"))
        yield f"date-{when[:4].hex()}", exif(None, camera=[stamp])
    texts = {
        "bidi": "RICOH \u202eTHETA\u2066 V".encode(),
        "escape": b"\x1b[31mRICOH\x07",
        "bytes": b"\xff\xfe\x80",
        "long": b"R" * 20_000,
        "lines": b"a\nb\rc\0d",
    }
    for name, words in texts.items():
        text = tuple(words + b"\0")
        yield f"maker-{name}", exif(main=[(0x010F, 2, text), (0x0110, 2, text)])
        yield f"comment-{name}", exif(None, camera=[(0x9286, 7, text)], main=[(0x010E, 2, text)])
    for order in "<>":
        mark = "big" if order == ">" else "little"
        rows = [(0x010F, 2, 40, 60)]
        directories = {
            "loop": _raw_directory(order, rows, 8),
            "loop-exif": _raw_directory(order, [(0x8769, 4, 1, 8)], 0),
            "loop-gps": _raw_directory(order, [(0x8825, 4, 1, 8), (0x8769, 4, 1, 8)], 8),
            "count-max": _raw_directory(order, [(0x010F, 2, _HUGE, 60)], 0),
            "count-max-numbers": _raw_directory(order, [(0x0111, 12, _HUGE, 8)], 0),
            "offset-max": _raw_directory(order, [(0x010F, 2, 100, _HUGE - 8)], _HUGE),
            "offset-before": _raw_directory(order, [(0x829A, 5, 1, 0)], 0),
            "type-0": _raw_directory(order, [(0x829A, 0, 1, 5), (0x829A, 99, 1, 5)], 0),
            "type-wrong": _raw_directory(order, [(0x829A, 2, 4, 0), (0x0112, 5, 1, 8)], 0),
            "thumbnail-max": _raw_directory(order, [(0x0201, 4, 1, 8), (0x0202, 4, 1, _HUGE)], 0),
            "twice": _raw_directory(order, [(0x0112, 3, 1, 1), (0x0112, 3, 1, 6)] * 200, 0),
            "rows-max": struct.pack(order + "H", 65535) + bytes(200),
            "rows-0": bytes(6),
        }
        for name, data in directories.items():
            yield f"{name}-{mark}", _tiff(order, data, bytes(200))
    yield "start-max", b"II*\0" + struct.pack("<I", _HUGE)
    yield "start-0", b"II*\0" + bytes(4)
    yield "order", b"XX*\0" + bytes(40)
    yield "no-bytes", b""
    gps = directory([(0x0002, RATIONAL, (1, 0, 2, 0, 3, 0))], 8, "<")
    yield "gps", b"II*\0" + struct.pack("<I", 8) + gps
    theta: list[Entry] = [(tag, SRATIONAL, (_MAXIMUM, 0)) for tag in (3, 4, 5, 0x103)]
    yield "theta-by-0", exif(theta)
    yield "theta-many", exif([(tag, SHORT, (tag,)) for tag in range(1500)])


def _odd_segments() -> Iterator[tuple[str, bytes]]:
    whole = jpeg(exif(), shape=(256, 512))
    behind = whole[2:]
    profile = b"ICC_PROFILE\0\1\1" + struct.pack(">I", _HUGE) + bytes(124)
    yield "icc-max.jpg", whole[:2] + segment(0xE2, profile) + behind
    yield "icc-cut.jpg", whole[:2] + segment(0xE2, b"ICC_PROFILE\0\1\5" + bytes(8)) + behind
    loop = struct.pack(">IIII", 3144, 0, 0x02100000, 0) + b"RGB XYZ " + bytes(104)
    tags = struct.pack(">I", 2000) + b"rXYZ\xff\xff\xff\xf0\xff\xff\xff\xff" * 200
    yield "icc-tags.jpg", whole[:2] + segment(0xE2, b"ICC_PROFILE\0\1\1" + loop + tags) + behind
    mpf = b"MPF\0" + _tiff(
        "<", _raw_directory("<", [(0xB001, 4, 1, _HUGE), (0xB002, 7, _HUGE, 8)], 8)
    )
    yield "mpf-loop.jpg", whole[:2] + segment(0xE2, mpf) + behind
    entry = struct.pack("<IIIHH", 0, _HUGE, _HUGE, 0, 0)
    many = b"MPF\0" + _tiff("<", _raw_directory("<", [(0xB002, 7, 160, 50)], 0), entry * 10)
    yield "mpf-offsets.jpg", whole[:2] + segment(0xE2, many) + behind + behind
    yield "comments.jpg", whole[:2] + segment(0xFE, b"c" * 60_000) * 300 + behind
    yield "exif-twice.jpg", whole[:2] + segment(0xE1, b"Exif\0\0" + exif()) * 40 + behind
    thumb = b"Exif\0\0" + _tiff(
        "<",
        _raw_directory("<", [(0x0201, 4, 1, 60), (0x0202, 4, 1, 60_000)], 8),
        b"\xff\xd8" * 30_000,
    )
    yield "thumbnail.jpg", whole[:2] + segment(0xE1, thumb[:65_000]) + behind
    yield "short-segment.jpg", whole[:2] + b"\xff\xe1\0\0" + behind
    yield "segment-behind.jpg", whole[:2] + b"\xff\xe1\xff\xff" + behind[:300]
    yield "adobe.jpg", whole[:2] + segment(0xEE, b"Adobe\0d\0\0\0\0\2") + behind
    yield "no-scan.jpg", whole[: whole.find(b"\xff\xda")]
    yield "no-tables.jpg", whole.replace(b"\xff\xdb", b"\xff\xfe").replace(b"\xff\xc4", b"\xff\xfe")
    at = whole.find(b"\xff\xc0") + 5
    for name, high, wide in (("0", 0, 512), ("max", 65535, 65535), ("1", 1, 1), ("wide", 1, 65535)):
        size = struct.pack(">HH", high, wide)
        yield f"frame-{name}.jpg", whole[:at] + size + whole[at + 4 :]
    yield "components.jpg", whole[: at + 4] + b"\xff" + whole[at + 5 :]


def _xmp_pictures(folder: Path) -> Iterator[Hostile]:
    shape = (256, 512)
    yield from _keep(
        folder,
        "picture",
        ((f"{name}.jpg", jpeg(None, xmp, shape)) for name, xmp in _odd_xmp()),
    )


def _odd_xmp() -> Iterator[tuple[str, bytes]]:
    for number in ("nan", "inf", "-1e999", "1e308", "9" * 5000, "", "x", "0x10", "1,5", "٣", "１"):
        name = number[:6] or "none"
        pose: Any = {"PosePitchDegrees": number, "PoseRollDegrees": number}
        yield f"pose-{name.encode('ascii', 'replace').decode().replace('?', 'u')}", pose_xmp(**pose)
        crop: Any = {
            "FullPanoWidthPixels": number,
            "FullPanoHeightPixels": number,
            "CroppedAreaImageWidthPixels": number,
            "CroppedAreaLeftPixels": number,
            "CroppedAreaTopPixels": number,
        }
        yield f"crop-{name.encode('ascii', 'replace').decode().replace('?', 'u')}", pose_xmp(**crop)
    for wide, left in ((1, 0), (10**9, 0), (2048, -5000), (2048, 10**12), (-512, 0)):
        crop = {
            "FullPanoWidthPixels": wide,
            "FullPanoHeightPixels": wide // 2,
            "CroppedAreaImageWidthPixels": 512,
            "CroppedAreaImageHeightPixels": 256,
            "CroppedAreaLeftPixels": left,
            "CroppedAreaTopPixels": left,
        }
        yield f"crop-{wide}-{left}", pose_xmp(**crop)
    yield "kind", pose_xmp().replace(b"equirectangular", b"\xff\xfe cylindrical")
    entities = b"".join(
        b'<!ENTITY a%d "%s">' % (n, b"&a%d;" % (n - 1) * 10 if n else b"ha" * 10) for n in range(12)
    )
    bomb = b"<!DOCTYPE x [" + entities + b"]>" + pose_xmp() + b"<x>&a11;</x>"
    yield "entities", bomb
    reads = b'<!DOCTYPE x [<!ENTITY f SYSTEM "file:///etc/passwd">]><x>&f;</x>' + pose_xmp()
    yield "reads-file", reads
    yield "deep", b"<a>" * 15_000 + pose_xmp()
    yield (
        "attributes",
        pose_xmp().replace(
            b"rdf:about", b" ".join(b'a%d="1"' % n for n in range(4000)) + b" rdf:about"
        ),
    )
    yield "cut", pose_xmp()[:200]
    yield "bytes", b"\xff\xfe" + pose_xmp().decode().encode("utf-16-le")
    yield "zeros", bytes(2000)
    yield "bidi", pose_xmp().replace(b"equirectangular", "\u202eralugnatceriuqe".encode())


def _raw_files(folder: Path) -> Iterator[Hostile]:
    """TIFF and DNG as directories by hand."""
    yield from _keep(folder, "picture", _odd_tiff())


def _odd_tiff() -> Iterator[tuple[str, bytes]]:
    def rows(**changes: tuple[int, int, int]) -> list[tuple[int, int, int, int]]:
        usual = {
            "width": (0x0100, 4, 1, 256),
            "height": (0x0101, 4, 1, 128),
            "bits": (0x0102, 3, 1, 8),
            "packing": (0x0103, 3, 1, 1),
            "colours": (0x0106, 3, 1, 1),
            "strips": (0x0111, 4, 1, 600),
            "samples": (0x0115, 3, 1, 1),
            "tall": (0x0116, 4, 1, 128),
            "bytes": (0x0117, 4, 1, 256 * 128),
        }
        return [(usual[name][0], *changes.get(name, usual[name][1:])) for name in usual]

    def made(table: list[tuple[int, int, int, int]], after: int = 0) -> bytes:
        data = _tiff("<", _raw_directory("<", table, after))
        return data.ljust(600, b"\0") + bytes(range(256)) * 128

    yield "sound.tif", made(rows())
    for name, changes in {
        "width-0": {"width": (4, 1, 0)},
        "width-max": {"width": (4, 1, _HUGE)},
        "height-max": {"height": (4, 1, _HUGE), "tall": (4, 1, _HUGE)},
        "bits-0": {"bits": (3, 1, 0)},
        "bits-65535": {"bits": (3, 1, 65535)},
        "bits-12": {"bits": (3, 1, 12)},
        "samples-65535": {"samples": (3, 1, 65535)},
        "packing-7": {"packing": (3, 1, 7)},
        "packing-lzw": {"packing": (3, 1, 5)},
        "packing-deflate": {"packing": (3, 1, 8)},
        "packing-ccitt": {"packing": (3, 1, 4), "bits": (3, 1, 1)},
        "packing-unknown": {"packing": (3, 1, 65000)},
        "strip-behind": {"strips": (4, 1, _MAXIMUM)},
        "strips-max": {"strips": (4, _HUGE, 600)},
        "strip-long": {"bytes": (4, 1, _HUGE)},
        "rows-0": {"tall": (4, 1, 0)},
        "palette": {"colours": (3, 1, 3)},
        "cfa": {"colours": (3, 1, 32803)},
        "logluv": {"colours": (3, 1, 32845), "packing": (3, 1, 34676)},
        "ycbcr": {"colours": (3, 1, 6), "samples": (3, 1, 3)},
    }.items():
        yield f"{name}.tif", made(rows(**changes))
    yield "loop.tif", made(rows(), after=8)
    own = [*rows(), (0x014A, 4, 1, 8), (0xC612, 1, 4, 0x00000401)]
    yield "sub-loop.dng", made(own)
    preview = [(0x0201, 4, 1, 600), (0x0202, 4, 1, _HUGE), (0xC612, 1, 4, 0x00000401)]
    yield "preview-max.dng", made([*rows(), *preview])
    for ending in ("dng", "cr2", "nef", "arw"):
        yield f"sound.{ending}", made([*rows(), (0xC612, 1, 4, 0x00000401)])
        inside = jpeg(exif(), shape=(64, 96))
        yield f"picture.{ending}", made(rows()) + inside + b"\xff\xd8\xff" * 3000
    yield (
        "big.tif",
        b"II+\0\x08\0\0\0" + struct.pack("<Q", 16) + struct.pack("<Q", 2**63) + bytes(99),
    )


# -- light -------------------------------------------------------------------------------------


def _write(path: Path, pixels: Any, kind: str = "half", **more: Any) -> Path:
    high, wide, count = pixels.shape
    spec = oiio.ImageSpec(wide, high, count, kind)
    for name, value in more.items():
        if hasattr(spec, name):
            setattr(spec, name, value)
        else:
            spec.attribute(name.replace("__", ":"), value)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    if output.open(str(path), spec):
        output.write_image(np.ascontiguousarray(pixels))
        output.close()
    output.geterror()
    return path


def _light(folder: Path, random: np.random.Generator) -> Iterator[Hostile]:
    folder.mkdir()
    room = (0.2 + random.random((64, 128, 3))).astype(np.float32)
    room[20:24, 60:66] = 60.0
    make = partial(_write, pixels=room)
    windows: dict[str, dict[str, Any]] = {
        "smaller": {"full_width": 256, "full_height": 128, "x": 64, "y": 32},
        "outside": {"x": 5000, "y": -5000},
        "negative": {"x": -64, "y": -32, "full_x": -128, "full_width": 256},
        "none": {"full_width": 0, "full_height": 0},
        "far": {"full_width": 10**6, "full_height": 10**6},
        "names": {"channelnames": ("\u202eR", "G\x1b[31m", "B")},
        "layers": {"channelnames": ("ao.R", "ao.G", "ao.B")},
        "luminance": {"channelnames": ("RY", "Y", "BY")},
        "same": {"channelnames": ("R", "r", "red")},
        "orientation": {"Orientation": 77},
        "aspect": {"PixelAspectRatio": float("nan")},
        "primaries": {"chromaticities": (0.0,) * 8},
        "exposure": {"ExposureTime": float("inf"), "FNumber": -1.0},
        "view": {"worldtocamera": (float("nan"),) * 16},
        "text": {"Make": "\u202eRICOH\x1b[31m", "owner": "x" * 100_000},
        "tiles-1": {"tile_width": 16, "tile_height": 16, "compression": "piz"},
        "tiles-odd": {"tile_width": 17, "tile_height": 3},
    }
    for name, more in windows.items():
        path = folder / f"{name}.exr"
        try:
            make(path, **more)
        except (TypeError, ValueError, UnicodeError):
            continue
        if path.exists():
            yield Hostile(path, "light")
    for name, value in (
        ("sun-inf", np.inf),
        ("sun-nan", np.nan),
        ("hole", 0.0),
        ("half-max", 65504),
    ):
        light = room.copy()
        light[20:24, 60:66] = value
        yield Hostile(_write(folder / f"{name}.exr", light), "light")
    layers = np.dstack([room, np.zeros_like(room[..., :1])])
    yield Hostile(_write(folder / "alpha-0.exr", layers), "light")
    head = b"#?RADIANCE\n"
    lines = {
        "exposure-0": b"EXPOSURE=0\n",
        "exposure-max": b"EXPOSURE=1e38\n" * 40,
        "exposure-text": b"EXPOSURE=1,5\n",
        "colour": b"COLORCORR=0 nan -1\n",
        "primaries": b"PRIMARIES=0 0 0 0 0 0 0 0\n",
        "aspect": b"PIXASPECT=0\n",
        "view": b"VIEW= -vtv -vh 1e999\n",
        "bidi": "SOFTWARE=\u202e\x1b[31m\n".encode(),
        "long": b"X" * 70_000 + b"\n",
        "format": b"FORMAT=32-bit_rle_xyze\n",
    }
    for name, line in lines.items():
        path = folder / f"{name}.hdr"
        path.write_bytes(head + line + b"\n-Y 64 +X 128\n" + b"\x80\x80\x80\x81" * 8192)
        yield Hostile(path, "light")
    for way in (b"+Y 64 -X 128", b"-X 128 +Y 64", b"-Y 64 +X 128 9", b"-Y 6.4e1 +X 128", b"-Y 064"):
        path = folder / f"way-{way[:2].decode().replace('+', 'p')}{len(way)}.hdr"
        path.write_bytes(head + b"\n" + way + b"\n" + b"\x80\x80\x80\x81" * 8192)
        yield Hostile(path, "light")


# -- styles ------------------------------------------------------------------------------------


def _styles(folder: Path) -> Iterator[Hostile]:
    from tests.helpers.styles_screen import head
    from tests.unit.test_style_file_bombs import BOMBS

    folder.mkdir()
    one = head()
    canvas = from_style(one.pack, one.transport, "left-rembrandt")
    style = save_user_style(
        folder / "own", canvas, "Mine", side="left", head="generic", note="Made by hand"
    )
    sound = folder / "sound.turnstyle"
    export_style(style, sound)
    yield Hostile(sound, "style")
    text = text_path(folder / "own", style.name).read_bytes()
    layers = next((folder / "own").glob("*.exr")).read_bytes()
    assert layers_path is not None
    for number, (name, (words, _)) in enumerate(BOMBS.items()):
        path = folder / f"bomb{number}-{name.replace(' ', '-')[:20]}.toml"
        path.write_text(words, encoding="utf-8")
        yield Hostile(path, "style")
    packages = dict(_packages(text, layers))
    yield from _keep(folder / "packages", "style", iter(packages.items()))


def _zip(parts: list[tuple[str, bytes]], method: int = zipfile.ZIP_STORED) -> bytes:
    packed = io.BytesIO()
    with warnings.catch_warnings(), zipfile.ZipFile(packed, "w", method) as archive:
        warnings.simplefilter("ignore")  # two entries of one name are meant
        for name, data in parts:
            archive.writestr(zipfile.ZipInfo(name), data)
    return packed.getvalue()


def _painted(**how: Any) -> Iterator[tuple[str, Any]]:
    size = how.pop("size", 128)
    yield "nan", np.full((size, size, 2), np.nan, np.float32)
    yield "inf", np.full((size, size, 2), np.inf, np.float32)
    yield "huge", np.full((size, size, 2), 1e30, np.float32)
    yield "small", np.zeros((2, 2, 2), np.float32)
    yield "wide", np.zeros((4, 4096, 2), np.float32)
    yield "three", np.zeros((size, size, 3), np.float32)


def _packages(text: bytes, layers: bytes) -> Iterator[tuple[str, bytes]]:
    import hashlib
    import tempfile

    def package(words: bytes, data: bytes) -> bytes:
        return _zip([("style.toml", words), ("weights.exr", data)])

    yield "layers-cut.turnstyle", package(text, layers[: len(layers) // 2])
    yield "layers-none.turnstyle", package(text, b"")
    yield "text-none.turnstyle", package(b"", layers)
    yield "title-bidi.turnstyle", package(text.replace(b"Mine", "Mine\u202eexe".encode()), layers)
    yield "title-control.turnstyle", package(text.replace(b"Mine", b"Mi\\u001b[31mne"), layers)
    yield "title-long.turnstyle", package(text.replace(b"Mine", b"M" * 5000), layers)
    yield "digits.turnstyle", package(text + b"\nx = " + b"9" * 5000, layers)
    yield "two.turnstyle", _zip([("style.toml", text)] * 2 + [("weights.exr", layers)])
    yield "paths.turnstyle", _zip([("../style.toml", text), ("/etc/weights.exr", layers)])
    bomb = _zip([("style.toml", text), ("weights.exr", bytes(1 << 28))], zipfile.ZIP_DEFLATED)
    yield "bomb.turnstyle", bomb
    yield "many.turnstyle", _zip([(f"{n}.toml", b"") for n in range(20_000)])
    yield "cut.turnstyle", package(text, layers)[:-40]
    yield "no-zip.turnstyle", b"PK\3\4" + bytes(300)
    yield "empty.turnstyle", b""
    yield "toml.turnstyle", text
    mark = text.index(b'sha256 = "') + 10
    for name, pixels in _painted():
        with tempfile.TemporaryDirectory() as folder:
            data = _write(Path(folder) / "w.exr", pixels, "float").read_bytes()
        seal = hashlib.sha256(data).hexdigest().encode()
        words = text[:mark] + seal + text[mark + 64 :]
        yield f"layers-{name}.turnstyle", package(words, data)


def sound_files(folder: Path) -> Path:
    """Make the good files that commands take beside a bad one."""
    folder.mkdir(parents=True)
    random = np.random.default_rng(7)
    room = (0.2 + random.random((64, 128, 3))).astype(np.float32)
    room[20:24, 60:66] = 60.0
    _write(folder / "none.exr", room)
    picture = np.rint(np.clip(room, 0, 1) ** (1 / 2.2) * 255).astype(np.uint8)
    for name, share in (("eight", 1), ("darker-eight", 2)):
        _write(folder / f"{name}.png", picture // share, "uint8")
    return folder
