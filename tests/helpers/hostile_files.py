"""A seeded corpus of files that should not be: damaged, lying, huge, odd in name or in kind."""

from __future__ import annotations

import os
import socket
import struct
import zlib
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np
import OpenImageIO as oiio

from tests.helpers.exif_bytes import exif, jpeg
from tests.helpers.hostile_data import (
    Hostile,
    hostile_archives,
    hostile_meshes,
    sealed_archives,
)
from tests.helpers.meshes import sphere, write_obj

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = ["make_corpus", "write_picture"]

_ROWS: Final = 64
_CUTS: Final = (1, 16, 100, 0.1, 0.5, 0.9, 0.999)
_FLIPS: Final = 5


def make_corpus(folder: Path, seed: int = 16, *, bombs: bool = True) -> list[Hostile]:
    """Make the corpus in a folder that is not there yet; the same seed gives the same.

    Without `bombs` it leaves out the few files that take seconds to make and gigabytes to read.
    """
    folder.mkdir(parents=True)
    random = np.random.default_rng(seed)
    found: list[Hostile] = []
    for kind, path, sister in _sound(folder / "sound", random):
        found.append(Hostile(path, kind, sister))
        found += [
            Hostile(each, kind, sister) for each in _damaged(path, folder / "damaged", random)
        ]
    found += _lies(folder / "lies", random)
    found += _values(folder / "values", random)
    found += _bombs(folder / "bombs") if bombs else []
    found += hostile_archives(folder / "archives")
    found += sealed_archives(folder / "sealed")
    found += hostile_meshes(folder / "meshes")
    found += _sparse(folder / "sparse")
    found += _names(folder / "names", next(h.path for h in found if h.path.suffix == ".exr"))
    return found


# -- sound files, and what becomes of them -----------------------------------------------------


def _room(random: np.random.Generator, rows: int = _ROWS) -> np.ndarray[Any, Any]:
    """Light of a made-up room, (rows, 2 rows, 3) float32: a gradient, a lamp and texture."""
    y, x = np.mgrid[:rows, : 2 * rows] / rows
    lamp = 40.0 * np.exp(-((x - 0.6) ** 2 + (y - 0.3) ** 2) / 0.004)
    room = 0.2 + 0.3 * y + lamp + 0.2 * random.random((rows, 2 * rows))
    return np.asarray(room[..., None] * np.array([1.0, 0.9, 0.8]), np.float32)


def write_picture(path: Path, pixels: Any, kind: str, **more: Any) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    for name, value in more.items():
        if hasattr(spec, name):
            setattr(spec, name, value)
        else:
            spec.attribute(name.replace("__", ":"), value)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None, oiio.geterror()
    assert output.open(str(path), spec), output.geterror()
    assert output.write_image(np.ascontiguousarray(pixels)), output.geterror()
    output.close()
    return path


def _sound(folder: Path, random: np.random.Generator) -> list[tuple[str, Path, Path | None]]:
    folder.mkdir(parents=True)
    light = _room(random)
    dark = light / 4
    found: list[tuple[str, Path, Path | None]] = []

    def both(kind: str, name: str, write: Callable[[Path, Any], object]) -> None:
        first, second = folder / name, folder / f"darker-{name}"
        write(first, light)
        write(second, dark)
        found.append((kind, first, second))

    def coded(picture: Any) -> Any:
        return np.rint(np.clip(picture, 0, 1) ** (1 / 2.2) * 255).astype(np.uint8)

    for compression in ("none", "zip", "piz", "dwaa", "b44"):
        both(
            "light",
            f"{compression}.exr",
            partial(write_picture, kind="half", compression=compression),
        )
    both(
        "light",
        "tiled.exr",
        lambda p, v: write_picture(p, v, "float", tile_width=32, tile_height=32),
    )
    both("light", "room.hdr", lambda p, v: write_picture(p, v, "float"))
    both("picture", "eight.png", lambda p, v: write_picture(p, coded(v), "uint8"))
    both("picture", "sixteen.png", lambda p, v: write_picture(p, v.clip(0, 1), "uint16"))
    both("picture", "grey.png", lambda p, v: write_picture(p, coded(v)[..., :1], "uint8"))
    both("picture", "alpha.png", lambda p, v: write_picture(p, _alpha(coded(v)), "uint8"))
    both("picture", "palette.png", lambda p, v: _palette(p, coded(v)))
    both("picture", "plain.jpg", lambda p, v: write_picture(p, coded(v), "uint8"))
    both("picture", "progressive.jpg", lambda p, v: _progressive(p, coded(v)))
    both("picture", "theta.jpg", lambda p, v: p.write_bytes(jpeg(exif())))
    both("picture", "eight.tif", lambda p, v: write_picture(p, coded(v), "uint8"))
    both(
        "picture",
        "tiled.tif",
        lambda p, v: write_picture(p, coded(v), "uint8", tile_width=16, tile_height=16),
    )
    both("picture", "float.tif", lambda p, v: write_picture(p, v, "float"))
    both("picture", "plain.webp", lambda p, v: write_picture(p, coded(v), "uint8"))
    both("picture", "plain.bmp", lambda p, v: write_picture(p, coded(v), "uint8"))
    both("picture", "animated.gif", lambda p, v: _gif(p))
    _several_parts(folder / "parts.exr", light)
    _deep(folder / "deep.exr")
    found += [("light", folder / "parts.exr", None), ("light", folder / "deep.exr", None)]
    vertices, faces = sphere(2)
    found.append(("mesh", write_obj(folder / "ball.obj", vertices, faces), None))
    return found


def _alpha(picture: Any) -> Any:
    return np.dstack([picture, np.full(picture.shape[:2], 128, np.uint8)])


def _progressive(path: Path, picture: Any) -> None:
    how = [cv2.IMWRITE_JPEG_PROGRESSIVE, 1]
    path.write_bytes(cv2.imencode(".jpg", picture[..., ::-1], how)[1].tobytes())


def _chunk(name: bytes, data: bytes) -> bytes:
    check = zlib.crc32(name + data)
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", check)


def _png(
    size: tuple[int, int], depth: int, colour: int, rows: bytes, *more: bytes, interlaced: int = 0
) -> bytes:
    head = struct.pack(">IIBBBBB", *size, depth, colour, 0, 0, interlaced)
    parts = [_chunk(b"IHDR", head), *more, _chunk(b"IDAT", rows), _chunk(b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def _palette(path: Path, picture: Any) -> None:
    height, width = picture.shape[:2]
    rows = b"".join(b"\0" + bytes(row) for row in picture[..., 1])
    colours = bytes(v for k in range(256) for v in (k, k, k))
    path.write_bytes(_png((width, height), 8, 3, zlib.compress(rows), _chunk(b"PLTE", colours)))


def _gif(path: Path) -> None:
    frame = b",\0\0\0\0\2\0\1\0\0\2\2D\n\0"
    head = b"GIF89a\2\0\1\0\x80\0\0\0\0\0\xff\xff\xff!\xff\x0bNETSCAPE2.0\3\1\0\0\0"
    path.write_bytes(head + frame * 3 + b";")


def _several_parts(path: Path, light: Any) -> None:
    specs = []
    for name in ("mist", "room"):
        spec = oiio.ImageSpec(light.shape[1], light.shape[0], 3, "half")
        spec.attribute("oiio:subimagename", name)
        specs.append(spec)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), tuple(specs)), output.geterror()
    assert output.write_image(light)
    assert output.open(str(path), specs[1], "AppendSubimage")
    assert output.write_image(light)
    output.close()


def _deep(path: Path) -> None:
    spec = oiio.ImageSpec(8, 4, 5, "float")
    spec.channelnames = ("R", "G", "B", "A", "Z")
    spec.deep = True
    data = oiio.DeepData()
    data.init(32, 5, [oiio.TypeDesc("float")] * 5, list(spec.channelnames))
    for pixel in range(32):
        data.set_samples(pixel, 1)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), spec), output.geterror()
    assert output.write_deep_image(data)
    output.close()


def _damaged(path: Path, folder: Path, random: np.random.Generator) -> list[Path]:
    """Cut a file short, flip bits in its head and body, add rubbish, and name it wrongly."""
    folder.mkdir(exist_ok=True)
    data = path.read_bytes()
    made: list[Path] = []

    def keep(what: str, content: bytes, ending: str = path.suffix) -> None:
        target = folder / f"{path.stem}-{path.suffix[1:]}-{what}{ending}"
        target.write_bytes(content)
        made.append(target)

    for cut in _CUTS:
        length = int(cut * len(data)) if isinstance(cut, float) else cut
        keep(f"cut{cut}", data[:length])
    for number in range(_FLIPS):
        changed = bytearray(data)
        span = min(len(data), 400) if number % 2 else len(data)
        for _ in range(1 + 3 * number):
            place = int(random.integers(4, span))
            changed[place] ^= 1 << int(random.integers(8))
        keep(f"flip{number}", bytes(changed))
    keep("more", data + bytes(random.integers(0, 256, 500, np.uint8)))
    other = {".exr": ".jpg", ".hdr": ".png", ".png": ".exr", ".jpg": ".tif", ".tif": ".hdr"}
    keep("named", data, other.get(path.suffix, ".png"))
    return made


# -- headers that lie, values that are not, small files with much in them ------------------------


def _lies(folder: Path, random: np.random.Generator) -> list[Hostile]:
    folder.mkdir()
    found = []
    rows = zlib.compress(b"\0" * 3000)
    sizes = ((0, 0), (1, 1), (2, 1), (2**31 - 1, 2**31 - 1), (60000, 30000), (2**31 + 5, 4))
    for width, height in sizes:
        target = folder / f"size-{width}-{height}.png"
        target.write_bytes(_png((width, height), 8, 2, rows))
        found.append(Hostile(target, "picture"))
        target = folder / f"size-{width}-{height}.hdr"
        words = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n"
        target.write_bytes(words.encode() + b"\x80" * 400)
        found.append(Hostile(target, "light"))
    for name, head in (
        ("no-size", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"),
        ("no-end", b"#?RADIANCE\n" + b"COMMENT=" + b"x" * 100_000),
        ("nan-exposure", b"#?RADIANCE\nEXPOSURE=nan\n\n-Y 4 +X 8\n" + b"\x80" * 128),
        ("negative", b"#?RADIANCE\n\n-Y -4 +X -8\n" + b"\x80" * 128),
        ("text-before", b"some words\n#?RADIANCE\n\n-Y 4 +X 8\n" + b"\x80" * 128),
        ("columns", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n+X 16 -Y 32\n" + b"\x80" * 2048),
    ):
        (folder / f"{name}.hdr").write_bytes(head)
        found.append(Hostile(folder / f"{name}.hdr", "light"))
    sound = folder.parent / "sound"
    exr = (sound / "none.exr").read_bytes()
    # Box of the data window: four 32-bit numbers behind the attribute's name, type and length.
    where = exr.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    for number, box in enumerate(
        ((0, 0, 2**30, 2**29), (0, 0, -1, -1), (-(2**31), 0, 2**31 - 1, 5), (5, 5, 132, 68))
    ):
        target = folder / f"window{number}.exr"
        target.write_bytes(exr[:where] + struct.pack("<4i", *box) + exr[where + 16 :])
        found.append(Hostile(target, "light", sound / "darker-none.exr"))
    for number in range(8):
        changed = bytearray((sound / "theta.jpg").read_bytes())
        for place in random.integers(20, 300, 12):
            changed[int(place)] = int(random.integers(256))
        target = folder / f"exif{number}.jpg"
        target.write_bytes(bytes(changed))
        found.append(Hostile(target, "picture", sound / "theta.jpg"))
    many = b"".join(b"a%d\0string\0\1\0\0\0x" % k for k in range(100_000))
    (folder / "attributes.exr").write_bytes(exr[:8] + many + exr[8:])
    found.append(Hostile(folder / "attributes.exr", "light", sound / "darker-none.exr"))
    picture = np.zeros((_ROWS, 2 * _ROWS, 4), np.uint8)
    write_picture(folder / "cmyk.tif", picture, "uint8", tiff__ColorSpace="CMYK")
    found.append(Hostile(folder / "cmyk.tif", "picture"))
    for name, content in (
        ("page.pdf", b"%PDF-1.4\n%nothing"),
        ("movie.mp4", b"\0\0\0\x18ftypmp42" + bytes(200)),
        ("phone.heic", b"\0\0\0\x18ftypheic" + bytes(200)),
        ("drawing.svg", b"<svg xmlns='http://www.w3.org/2000/svg'/>"),
        ("raw.dng", b"II*\0" + bytes(300)),
        ("empty.exr", b""),
        ("empty.jpg", b""),
        ("zeros.exr", bytes(5000)),
        ("text.png", b"This is a text.\n"),
    ):
        (folder / name).write_bytes(content)
        found.append(Hostile(folder / name, "picture"))
    return found


def _values(folder: Path, random: np.random.Generator) -> list[Hostile]:
    folder.mkdir()
    found = []
    sister = folder.parent / "sound" / "darker-tiled.exr"
    for name, value in (("nan", np.nan), ("inf", np.inf), ("minus", -5.0), ("huge", 3e38)):
        for share in (0.01, 0.5, 1.0):
            light = _room(random)
            light[random.random(light.shape[:2]) < share] = value
            path = folder / f"{name}-{share}.exr"
            found.append(Hostile(write_picture(path, light, "float"), "light", sister))
    for name, light in (
        ("black", np.zeros((_ROWS, 2 * _ROWS, 3), np.float32)),
        ("tiny", np.full((_ROWS, 2 * _ROWS, 3), 1e-42, np.float32)),
        ("one-texel", np.eye(1, _ROWS * 2 * _ROWS * 3, dtype=np.float32).reshape(_ROWS, -1, 3)),
        ("square", np.ones((_ROWS, _ROWS, 3), np.float32)),
        ("two-channels", np.ones((_ROWS, 2 * _ROWS, 2), np.float32)),
        ("many-channels", np.ones((_ROWS, 2 * _ROWS, 60), np.float32)),
        ("small", np.ones((2, 4, 3), np.float32)),
        ("odd", np.ones((33, 67, 3), np.float32)),
    ):
        path = folder / f"{name}.exr"
        found.append(Hostile(write_picture(path, light, "float"), "light", sister))
    return found


def _bombs(folder: Path) -> list[Hostile]:
    """Little on the disk, much when it is unpacked."""
    folder.mkdir()
    found = []
    for name, (width, height), depth, colour, interlaced in (
        ("wide", (16384, 8192), 8, 2, 0),
        ("deep", (16384, 8192), 16, 2, 0),
        ("interlaced", (12000, 6000), 8, 6, 1),
        ("grey", (16384, 8192), 1, 0, 0),
        ("square", (12600, 12600), 8, 2, 0),
    ):
        channels = {0: 1, 2: 3, 6: 4}[colour]
        packer = zlib.compressobj(9)
        row = b"\0" + bytes((width * channels * depth + 7) // 8)
        rows = b"".join(packer.compress(row) for _ in range(height + height // 2 * interlaced))
        target = folder / f"{name}.png"
        data = rows + packer.flush()
        target.write_bytes(_png((width, height), depth, colour, data, interlaced=interlaced))
        found.append(Hostile(target, "picture", target.with_name("wide.png")))
    black = np.zeros((4096, 8192, 3), np.uint8)
    black[0, 0] = 1
    for ending, kind in ((".jpg", "picture"), (".webp", "picture"), (".tif", "picture")):
        found.append(Hostile(write_picture(folder / f"large{ending}", black, "uint8"), kind))
    flat = np.full((8192, 16384, 1), 0.5, np.float16)
    target = write_picture(folder / "large.exr", flat, "half", compression="zip")
    found.append(Hostile(target, "light"))
    lamp = np.zeros((8192, 16384, 4), np.float16)
    lamp[3000:3600, 8000:9000] = (90, 90, 90, 1)
    target = write_picture(folder / "lamp.exr", lamp, "half", compression="zip")
    found.append(Hostile(target, "light"))
    one = {"tile_width": 16384, "tile_height": 8192, "compression": "zip"}
    target = write_picture(folder / "one-tile.exr", lamp[..., :3], "half", **one)
    found.append(Hostile(target, "light", target))
    tiles = {"tile_width": 4096, "tile_height": 4096, "compression": "zip"}
    target = write_picture(folder / "tiles.exr", flat[:4096, :8192], "half", **tiles)
    found.append(Hostile(target, "light", target))
    return found


def _sparse(folder: Path) -> list[Hostile]:
    """Three gigabytes of nothing behind a good beginning."""
    folder.mkdir()
    found = []
    for name, kind, start in (
        ("empty.exr", "light", b"\x76\x2f\x31\x01"),
        ("empty.hdr", "light", b"#?RADIANCE\n\n-Y 8192 +X 16384\n"),
        ("empty.webp", "picture", b"RIFF\xff\xff\xff\xffWEBPVP8 "),
        ("empty.npz", "archive", b"PK\3\4"),
        ("empty.obj", "mesh", b"v 0 0 0\n"),
    ):
        with (folder / name).open("wb") as stream:
            stream.write(start)
            stream.truncate(3 << 30)
        found.append(Hostile(folder / name, kind))
    return found


def _names(folder: Path, sound: Path) -> list[Hostile]:
    """Good light under odd names, and what is no file at all."""
    folder.mkdir()
    data = sound.read_bytes()
    names: Sequence[bytes] = (
        b"caf\xe9.exr",
        b"\xff\xfe.exr",
        b"red\x1b[31m.exr",
        b"two\nlines.exr",
        b"bell\x07\x9b.exr",
        "rtl\u202egnp.exr".encode(),
        b"-o.exr",
        b"%s%n.exr",
        b"<img src=x>.exr",
        b" .exr",
        b".exr",
        b"x" * 240 + b".exr",
        "𝓍\u0301.exr".encode(),
    )
    found = []
    for name in names:
        path = Path(os.fsdecode(os.fsencode(folder) + b"/" + name))
        path.write_bytes(data)
        found.append(Hostile(path, "light", sound))
    for pipe in ("pipe.exr", "pipe.png", "pipe.npz", "pipe.ply"):
        os.mkfifo(folder / pipe)
        found.append(Hostile(folder / pipe, "special"))
    server = socket.socket(socket.AF_UNIX)
    here = Path.cwd()
    os.chdir(folder)  # Names of sockets are short.
    server.bind("socket.exr")
    os.chdir(here)
    server.close()
    (folder / "loop.exr").symlink_to("loop.exr")
    (folder / "dangling.exr").symlink_to("nowhere.exr")
    (folder / "link.exr").symlink_to(sound)
    (folder / "folder.exr").mkdir()
    (folder / "self.exr").symlink_to(folder)
    others = ("socket", "loop", "dangling", "link", "folder", "self", "missing")
    found += [Hostile(folder / f"{name}.exr", "special") for name in others]
    found += [
        Hostile(Path(name), "special")
        for name in ("/dev/zero", "/dev/full", "/dev/stdin", "/proc/kmsg")
    ]
    return found
