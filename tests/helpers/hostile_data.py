"""Archives, texts and meshes that should not be: part of the corpus of `hostile_files`."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from app.core.base.archive import parse_header, read_arrays, write_sealed
from app.core.base.paths import resources
from app.core.solver.transport import _half_floats, load_named
from tests.helpers.meshes import sphere, write_obj

__all__ = ["Hostile", "hostile_archives", "hostile_meshes", "sealed_archives"]


_EDGES: Final = "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n"


@dataclass(frozen=True, slots=True)
class Hostile:
    """A file of the corpus: its path, what it pretends to be, and a sound sister to merge it with.

    `kind` is "light" (OpenEXR, Radiance), "picture", "mesh", "archive", "text" or "special".
    """

    path: Path
    kind: str
    sister: Path | None = None


def _npz(members: dict[str, bytes]) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return packed.getvalue()


def _npy(array: Any) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=True)
    return stream.getvalue()


def _head(text: str) -> bytes:
    return _npy(np.frombuffer(text.encode(), np.uint8))


def hostile_archives(folder: Path) -> list[Hostile]:
    """Transports, packs and what only looks so."""
    folder.mkdir()
    pack = (resources() / "transport" / "generic.styles.npz").read_bytes()
    shape = b"\x93NUMPY\1\0v\0{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999,), }"
    made: dict[str, bytes] = {
        "empty": b"",
        "no-zip": b"PK\3\4 and nothing else",
        "no-members": _npz({}),
        "raw": _npz({"header": b"raw bytes", "pixels": b"raw"}),
        "raw-header": _npz({"header.npy": b"not an array"}),
        "deep": _npz({"header.npy": _head("[" * 200_000)}),
        "deep-object": _npz({"header.npy": _head('{"a":' * 50_000)}),
        "list": _npz({"header.npy": _head("[1, 2]")}),
        "number": _npz({"header.npy": _head("1e999")}),
        "infinite": _npz({"header.npy": _head('{"format_version": 1e999, "sha256": ""}')}),
        "newer": _npz({"header.npy": _head('{"format_version": 99, "sha256": ""}')}),
        "long": _npz({"header.npy": _head('{"format_version": ' + "9" * 5000 + "}")}),
        "pickle": _npz({"header.npy": _npy(np.array([{"a": 1}], dtype=object))}),
        "claims": _npz({"header.npy": shape.ljust(128) + b"\n"}),
        "bomb": _npz({"header.npy": bytes(1 << 29)}),
        "cut": pack[: len(pack) // 2],
        "end": pack[-3000:],
    }
    changed = bytearray(pack)
    changed[len(pack) // 3] ^= 255
    made["flipped"] = bytes(changed)
    found = []
    for name, data in made.items():
        for ending in (".npz", ".styles.npz"):
            target = folder / f"{name}{ending}"
            target.write_bytes(data)
            if ending == ".npz":
                found.append(Hostile(target, "archive"))
    (folder / "deep.json").write_text("[" * 100_000)
    (folder / "facts.json").write_text(json.dumps({"title": "x" * 10**6}))
    (folder / "deep.toml").write_text("a = " + "[" * 20_000)
    (folder / "bytes.toml").write_bytes(b"title = '\xff\xfe'")
    found += [Hostile(each, "text") for each in sorted(folder.glob("*.[jt]*"))]
    return found


def sealed_archives(folder: Path) -> list[Hostile]:
    """A transport and its pack with the right checksum, and values of the wrong kind."""
    folder.mkdir()
    shipped = resources() / "transport"
    transport, pack = (
        read_arrays(shipped / name, "", "") for name in ("generic.npz", "generic.styles.npz")
    )
    head, styles = (parse_header(arrays.pop("header")) for arrays in (transport, pack))
    found = []
    for name, more in (
        ("none", {"pixel_kept": transport["pixel_kept"][:, :, :0]}),
        ("endless", {"pixel_kept": np.zeros((2, 10**9, 0, 10**9), np.uint8)}),
        ("flat", {"texel_rest": transport["texel_rest"][0]}),
        ("sign", {"sign": np.array(["x"])}),
        ("beyond", {"pixels": transport["pixels"] + 10**6}),
    ):
        file = folder / f"packed-{name}.npz"
        write_sealed(file, transport | more, head)
        write_sealed(folder / f"packed-{name}.styles.npz", pack, styles)
        found.append(Hostile(file, "archive"))
    # As an older version wrote it, so that what follows is met behind the checksum.
    transport, head = _half_floats(load_named("generic")), head | {"format_version": 1}
    for name, more, arrays in (
        ("text", {"picture": "\x1b[31m"}, {}),
        ("large", {"rank": 10**30}, {}),
        ("scalar", {}, {"pixels": np.array(1)}),
        ("short", {}, {"coverage": transport["coverage"][:1]}),
        ("no-basis", {}, {"basis_even": pack["basis_even"][:0]}),
    ):
        own = name == "no-basis"
        files = (folder / f"sealed-{name}.npz", folder / f"sealed-{name}.styles.npz")
        write_sealed(files[0], transport | ({} if own else arrays), head | more)
        write_sealed(files[1], pack | (arrays if own else {}), styles)
        found.append(Hostile(files[0], "archive"))
    return found


def hostile_meshes(folder: Path) -> list[Hostile]:
    folder.mkdir()
    vertices, faces = sphere(2)
    found = []

    def obj(name: str, points: Any, indices: Any) -> None:
        found.append(Hostile(write_obj(folder / f"{name}.obj", points, indices), "mesh"))

    obj("beyond", vertices, np.vstack([faces, [[0, 1, 4_000_000]]]))
    obj("nan", np.where(vertices > 0.9, np.nan, vertices), faces)
    obj("open", vertices, faces[1:])
    obj("huge", vertices * 1e30, faces)
    obj("flat", vertices * [1, 1, 0], faces)
    obj("none", vertices, faces[:0])
    ply = (
        "ply\nformat ascii 1.0\nelement vertex {v}\nproperty float x\nproperty float y\n"
        "property float z\nelement face {f}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    body = "".join(f"{x} {y} {z}\n" for x, y, z in vertices)
    lists = [f"3 {a} {b} {c}\n" for a, b, c in faces]
    for name, count, more in (
        ("beyond", len(faces), "3 0 1 999999\n"),
        ("negative", len(faces), "3 0 1 -5\n"),
        ("short", 10**9, ""),
        ("words", len(faces), "3 zero one two\n"),
    ):
        head = ply.format(v=len(vertices), f=count)
        (folder / f"{name}.ply").write_text(head + body + "".join(lists[:-1]) + more)
        found.append(Hostile(folder / f"{name}.ply", "mesh"))
    head = ply.format(v=len(vertices), f=len(faces)).replace("end_header\n", _EDGES)
    (folder / "edges.ply").write_text(head + body + "".join(lists) + "0 1\n")
    found.append(Hostile(folder / "edges.ply", "mesh"))
    more = "".join(f"element e{k} 0\nproperty float x\n" for k in range(100_000))
    head = ply.format(v=len(vertices), f=len(faces)).replace("end_header\n", more + "end_header\n")
    (folder / "elements.ply").write_text(head + body + "".join(lists))
    found.append(Hostile(folder / "elements.ply", "mesh"))
    text = ply.format(v=10**12, f=1).replace("ascii", "binary_little_endian")
    (folder / "claims.ply").write_text(text)
    found.append(Hostile(folder / "claims.ply", "mesh"))
    return found
