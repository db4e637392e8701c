"""A head for the detail scripts: its mesh, its landmarks, and a frame that fits all heads."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

HEADS = Path(__file__).resolve().parents[2] / "resources" / "heads"
MM = 0.01
"""One millimetre in head units (10 cm)."""
_GENERIC_CROWN = 1.066


@dataclass(frozen=True, slots=True, eq=False)
class Head:
    """A head with its landmarks.

    Attributes:
        vertices, normals: (V, 3) float64. Skin, head units; normals have unit length.
        faces: (F, 3) int64. Counter-clockwise from outside.
        eye: (3,) float64. Centre of the left eyeball.
        scale: This head's size relative to the generic one, from the eyes to the crown.
        lips: (L, 3). Border of the lips, left half, from the upper middle via the corner to the
            lower middle.
        mouth, nostril, nose: (3,). Middle of the slit between the lips; inside of the left nostril;
            tip of the nose.
        upper_lashes, lower_lashes: (N, 3). Lash lines of the left eye from the inner corner out.
        ear: (E, 3). Points on the left ear.
    """

    name: str
    vertices: Floats
    normals: Floats
    faces: Ints
    crown: float
    cut: float
    eye: Floats
    eye_radius: float
    scale: float
    lips: Floats
    mouth: Floats
    nostril: Floats
    nose: Floats
    upper_lashes: Floats
    lower_lashes: Floats
    ear: Floats

    def local(self, points: Floats) -> Floats:
        """Return points as (|x|, y, z) relative to the eyes, scaled to the generic head.

        Rules in this frame fit every head and are the same on both sides.
        """
        moved = points - np.array([0.0, self.eye[1], self.eye[2]])
        moved[:, 0] = np.abs(moved[:, 0])
        fitted: Floats = moved / self.scale
        return fitted

    def place(self, local: Floats) -> Floats:
        """Invert `local` on the sitter's left."""
        back: Floats = local * self.scale + np.array([0.0, self.eye[1], self.eye[2]])
        return back


@cache
def load(name: str) -> Head:
    """Read one of the shipped heads with its landmarks."""
    vertices, normals, faces = _read_ply(HEADS / f"{name}.ply")
    measures = json.loads((HEADS / "manifest.json").read_text(encoding="utf-8"))["heads"][name]
    marks = json.loads((Path(__file__).parent / "landmarks.json").read_text(encoding="utf-8"))
    points = {key: np.array(value) for key, value in marks[name].items()}
    eye = np.array(measures["left_eye"])
    middle = vertices[np.abs(vertices[:, 0]) < 0.02]
    middle = middle[(middle[:, 1] < eye[1]) & (middle[:, 1] > points["mouth"][1])]
    return Head(
        name=name,
        vertices=vertices,
        normals=normals,
        faces=faces,
        crown=measures["crown_y"],
        cut=measures["cut_y"],
        eye=eye,
        eye_radius=measures["sclera_radius_mm"] * MM,
        scale=(measures["crown_y"] - eye[1]) / _GENERIC_CROWN,
        nose=middle[middle[:, 2].argmax()],
        **points,
    )


def _read_ply(path: Path) -> tuple[Floats, Floats, Ints]:
    """Return vertices, normals and faces of a binary PLY written by `mesh_tools.write_ply`."""
    header, _, body = path.read_bytes().partition(b"end_header\n")
    counts = {}
    names: list[str] = []
    for line in header.decode("ascii").splitlines():
        words = line.split()
        if words[0] == "element":
            counts[words[1]] = int(words[2])
        elif words[0] == "property" and words[1] != "list":
            names.append(words[2])
    rows = np.frombuffer(body, np.dtype([(name, "<f4") for name in names]), counts["vertex"])
    rest = body[rows.nbytes :]
    kind = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
    faces = np.frombuffer(rest, kind, counts["face"])["corners"].astype(np.int64)

    def columns(wanted: tuple[str, str, str]) -> Floats:
        return np.stack([rows[name].astype(np.float64) for name in wanted], axis=1)

    return columns(("x", "y", "z")), columns(("nx", "ny", "nz")), faces
