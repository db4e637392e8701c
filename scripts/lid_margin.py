"""Find the rim of the eyelids of a head mesh as the portrait camera sees it.

Units of 10 cm in the head frame unless a name or docstring says mm.
"""

from __future__ import annotations

import numpy as np
from eye_geometry import CAMERA_DISTANCE, MM_PER_UNIT, LidMargin
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


def camera_depth(vertices: Floats, faces: Ints, centre: Floats, half: float, size: int) -> Floats:
    """Depth map of the skin around one eye as the camera sees it (z-buffer).

    Args:
        vertices, faces: Skin, units of 10 cm.
        centre: (3,) float64. Centre of the left eyeball; the camera stands 1.8 m in front of the
            point midway between the eyes.
        half: Half the side of the window, measured in the plane of the eyeball's centre, units.
        size: Pixels along a side; row 0 at the bottom.

    Returns:
        (size, size) float64: z - centre z of the nearest surface, units; -inf where there is none.
    """
    camera = np.array([0.0, centre[1], centre[2] + CAMERA_DISTANCE])
    ray = vertices - camera
    scale = -CAMERA_DISTANCE / np.minimum(ray[:, 2], -1.0)
    flat = (ray[:, :2] * scale[:, None] + camera[:2] - centre[:2] + half) * (size / (2.0 * half))
    low, high = flat[faces].min(axis=1), flat[faces].max(axis=1)
    seen = np.all((high > 0) & (low < size), axis=1) & (vertices[faces, 2].min(axis=1) > 0.0)
    depth = np.full((size, size), -np.inf)
    for face in faces[seen]:
        p, inverse_z = flat[face], 1.0 / ray[face, 2]
        area = np.linalg.det(np.column_stack([p, np.ones(3)]))
        x0, y0 = np.maximum(np.ceil(p.min(axis=0) - 0.5), 0).astype(int)
        x1, y1 = np.minimum(np.floor(p.max(axis=0) - 0.5), size - 1).astype(int)
        if abs(area) < 1e-12 or x1 < x0 or y1 < y0:
            continue
        px, py = np.meshgrid(np.arange(x0, x1 + 1) + 0.5, np.arange(y0, y1 + 1) + 0.5)
        weights = []
        for k in range(3):
            (ax, ay), (bx, by) = p[(k + 1) % 3], p[(k + 2) % 3]
            weights.append(((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / area)
        inside = np.all(np.array(weights) >= -1e-9, axis=0)
        z = 1.0 / sum(w * i for w, i in zip(weights, inverse_z, strict=True))
        z = np.where(inside, z + CAMERA_DISTANCE, -np.inf)
        window = depth[y0 : y1 + 1, x0 : x1 + 1]
        np.maximum(window, z, out=window)
    return depth


def lid_margin(vertices: Floats, faces: Ints, centre: Floats, sectors: int = 128) -> LidMargin:
    """Follow the rim of the lids around the left eye: the edge of the view into the socket."""
    half, size = 0.16, 640
    depth = camera_depth(vertices, faces, centre, half, size)
    steps = np.arange(0.0, 0.155, 0.25 * half / size)
    reach, height = np.zeros(sectors), np.zeros(sectors)
    for k in range(sectors):
        angle = 2.0 * np.pi * k / sectors
        column = ((half + steps * np.cos(angle)) * size / (2.0 * half)).astype(int)
        row = ((half + steps * np.sin(angle)) * size / (2.0 * half)).astype(int)
        along = depth[row, column]
        rim = int(np.argmax(along > 0.0))  # the socket lies behind the eyeball's centre
        reach[k], height[k] = steps[rim], along[rim]
    return LidMargin(np.round(reach * MM_PER_UNIT, 2), np.round(height * MM_PER_UNIT, 2))
