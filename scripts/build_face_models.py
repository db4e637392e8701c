"""Rebuild ``resources/faces/``: the networks that find faces, and the mesh of their landmarks.

    npm pack @mediapipe/face_mesh@0.4.1657299874
    python scripts/build_face_models.py mediapipe-face_mesh-0.4.1657299874.tgz

Takes two networks and the canonical face out of the package's packed assets (Apache-2.0); nothing
is changed but the way the mesh is written down. Then finds the landmarks of the generic head, as
its transport shows it, in a portrait of it in even light (needs LLVM, see CONTRIBUTING).
"""

from __future__ import annotations

import argparse
import json
import re
import struct
import tarfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from app.core.baking.kernel_lanes import select_variant
from app.core.baking.scene import load_head
from app.core.base.archive import write_arrays
from app.core.base.colour import to_bytes
from app.core.base.paths import resources
from app.core.faces.finder import face_mesh, find_faces
from app.core.portrait.full_size_portrait import portrait_picture
from app.core.portrait.light import portrait_light
from app.core.portrait.portrait_file import load_portrait
from scenes.portraits.scene import portrait_frame

_ASSETS = "package/face_mesh_solution_packed_assets"
_NETWORKS = ("face_detection_short_range.tflite", "face_landmark.tflite")
_MESH = "geometry_pipeline_metadata_landmarks.binarypb"
_VARINT, _BYTES, _FOUR = 0, 2, 5


def main() -> None:
    """Unpack what is needed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("package", type=Path)
    parser.add_argument("-o", type=Path, default=resources() / "faces")
    args = parser.parse_args()
    args.o.mkdir(parents=True, exist_ok=True)
    files = _files(args.package)
    for name in _NETWORKS:
        (args.o / name).write_bytes(files[name])
    points, triangles = _mesh(files[_MESH])
    arrays = {"points": points, "triangles": triangles, "on_head": np.zeros((468, 2), np.float32)}
    write_arrays(args.o / "mesh.npz", arrays)
    write_arrays(args.o / "mesh.npz", arrays | {"on_head": _on_head()})


def _on_head() -> np.ndarray:
    """Landmarks of the generic head in its transport's picture, shares of width and height."""
    select_variant("llvm")
    files = (resources() / "heads" / f"generic{end}.ply" for end in ("", "-eyes"))
    frame, _ = portrait_frame(load_head("generic", *files))
    portrait = load_portrait("generic", "medium", "short")
    assert portrait is not None
    picture = portrait_picture(*portrait, portrait_light(np.ones((64, 128, 3), np.float32)), 0.0)
    shown = to_bytes(np.clip(picture * 0.8 / np.percentile(picture, 95), 0, 1))
    (face,) = find_faces(shown)
    column, row = (face.landmarks[:, axis].astype(np.float64) for axis in (0, 1))
    across, down = frame.film(row, column)
    twin = face_mesh().mirrored
    both = np.stack([across + 1 - across[twin], down + down[twin]], axis=1)
    return (both / 2).astype(np.float32)


def _files(package: Path) -> dict[str, bytes]:
    with tarfile.open(package) as tar:
        loader, data = (tar.extractfile(_ASSETS + end) for end in ("_loader.js", ".data"))
        assert loader is not None
        assert data is not None
        packed, script = data.read(), loader.read().decode()
    found = re.search(r'"files": (\[[^\]]*\])', script)
    assert found is not None
    return {
        Path(one["filename"]).name: packed[one["start"] : one["end"]]
        for one in json.loads(found[1])
    }


def _mesh(metadata: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Vertices, cm, and triangles of the canonical face: the first field of the metadata."""
    mesh = next(value for number, value in _fields(metadata) if number == 1)
    assert isinstance(mesh, bytes)
    numbers: list[float] = []
    corners: list[int] = []
    for number, value in _fields(mesh):
        if number == 3 and isinstance(value, bytes):
            numbers += struct.unpack("<f", value)
        elif number == 4 and isinstance(value, int):
            corners.append(value)
    points = np.array(numbers, np.float32).reshape(468, 5)[:, :3]
    return points, np.array(corners, np.uint16).reshape(-1, 3)


def _fields(message: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Numbers and values of a protocol buffer's fields."""
    at = 0
    while at < len(message):
        key, at = _varint(message, at)
        kind = key & 7
        if kind == _VARINT:
            value, at = _varint(message, at)
            yield key >> 3, value
            continue
        size = 4
        if kind == _BYTES:
            size, at = _varint(message, at)
        elif kind != _FOUR:
            raise ValueError(kind)
        yield key >> 3, message[at : at + size]
        at += size


def _varint(message: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = message[at]
        at += 1
        value |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            return value, at


if __name__ == "__main__":
    main()
