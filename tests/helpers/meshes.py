"""Meshes made by formula, to bake in tests."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np


def write_ply(path: Path, vertices: np.ndarray, faces: np.ndarray, extra: str = "") -> Path:
    """Write a PLY of text; `extra` is an element that heads do not have, with one line of it."""
    head, _, line = extra.partition("|")
    with path.open("w", encoding="ascii") as file:
        file.write(f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\n")
        file.writelines(f"property float {axis}\n" for axis in "xyz")
        file.write(f"element face {len(faces)}\nproperty list uchar int vertex_indices\n")
        file.write(f"{head}end_header\n")
        file.writelines(f"{x} {y} {z}\n" for x, y, z in vertices)
        file.writelines(f"3 {a} {b} {c}\n" for a, b, c in faces)
        file.write(line)
    return path


def sphere(levels: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """An icosphere of radius 10 cm."""
    golden = (1 + math.sqrt(5)) / 2
    v: list[tuple[float, float, float]]
    v = [(-1, golden, 0), (1, golden, 0), (-1, -golden, 0), (1, -golden, 0)]
    v += [(0, -1, golden), (0, 1, golden), (0, -1, -golden), (0, 1, -golden)]
    v += [(golden, 0, -1), (golden, 0, 1), (-golden, 0, -1), (-golden, 0, 1)]
    f = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4)]
    f += [(11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8)]
    f += [(3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    points = [np.array(p, float) / np.linalg.norm(p) for p in v]
    faces = f
    for _ in range(levels):
        middle: dict[tuple[int, int], int] = {}

        def halve(a: int, b: int, middle: dict[tuple[int, int], int] = middle) -> int:
            key = (min(a, b), max(a, b))
            if key not in middle:
                p = points[a] + points[b]
                middle[key] = len(points)
                points.append(p / np.linalg.norm(p))
            return middle[key]

        finer = []
        for a, b, c in faces:
            ab, bc, ca = halve(a, b), halve(b, c), halve(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = finer
    return np.array(points, np.float32), np.array(faces, np.uint32)


def write_obj(path: Path, vertices: np.ndarray, faces: np.ndarray) -> Path:
    """Write a mesh as OBJ."""
    lines = [f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    path.write_text("\n".join(lines) + "\n")
    return path
