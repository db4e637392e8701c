"""How upright a panorama is, measured on its straight edges alone.

Line segments are found in perspective views (LSD), and each becomes the normal of the great circle
it lies on. The normals of all vertical edges are level, so the direction that is most nearly at
right angles to them is the zenith.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.sphere import positions, rotation

_SIZE = 640
_FOV_DEG = 75.0
_LEAST_DEG = 5.0  # length of a segment
_CANDIDATE_DEG = 12.0  # an edge that leans more is not meant to be vertical


def edge_normals(panorama: NDArray[np.uint8]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Great-circle normals (N, 3) of straight edges in the panorama's axes, and lengths in deg."""
    grey = np.asarray(cv2.cvtColor(panorama, cv2.COLOR_RGB2GRAY), np.uint8)
    focal = _SIZE / 2 / np.tan(np.radians(_FOV_DEG / 2))
    normals, lengths = [], []
    for pitch in (-25.0, 20.0):
        for yaw in range(0, 360, 45):
            turn = rotation(float(yaw), pitch)
            lines = cv2.createLineSegmentDetector().detect(_view(grey, turn, focal))[0]
            ends = np.asarray(lines, np.float64).reshape(-1, 2, 2)
            rays = _rays(ends[..., 0], ends[..., 1], focal) @ turn.T
            rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
            normal = np.cross(rays[:, 0], rays[:, 1])
            sine = np.linalg.norm(normal, axis=1)
            long = sine > np.sin(np.radians(_LEAST_DEG))
            normals.append(normal[long] / sine[long, None])
            lengths.append(np.degrees(np.arcsin(np.minimum(sine[long], 1.0))))
    return np.concatenate(normals), np.concatenate(lengths)


def zenith(normals: NDArray[np.float64], lengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Direction within 12 deg of up that most of the nearly vertical edges point to."""
    up = np.array([0.0, 1.0, 0.0])
    for width_deg in (12.0, 6.0, 3.0, 2.0, 1.5, 1.5, 1.5, 1.5):
        width = np.sin(np.radians(width_deg))
        off = normals @ up
        weights = lengths**2 * np.clip(1.0 - (off / width) ** 2, 0.0, 1.0) ** 2
        up = np.linalg.svd(normals * np.sqrt(weights)[:, None])[2][-1]
        up *= np.sign(up[1])
    return up


def tilt_deg(panorama: NDArray[np.uint8]) -> float:
    """Angle between up and where the vertical edges say that up is, in degrees."""
    up = zenith(*edge_normals(panorama))
    return float(np.degrees(np.arccos(min(up[1], 1.0))))


def leans_deg(normals: NDArray[np.float64], lengths: NDArray[np.float64]) -> tuple[float, float]:
    """Median lean of the nearly vertical edges, weighted by length, and their length, in deg."""
    lean = np.degrees(np.arcsin(np.abs(normals[:, 1])))
    near = lean < _CANDIDATE_DEG
    order = np.argsort(lean[near])
    share = np.cumsum(lengths[near][order])
    return float(lean[near][order][np.searchsorted(share, share[-1] / 2)]), float(share[-1])


def _rays(
    column: NDArray[np.float64], row: NDArray[np.float64], focal: float
) -> NDArray[np.float64]:
    """Directions in a view's own axes: +Z ahead, +Y up, +X to the left."""
    middle = (_SIZE - 1) / 2
    return np.stack([middle - column, middle - row, np.full(np.shape(column), focal)], axis=-1)


def _view(grey: NDArray[np.uint8], turn: NDArray[np.float64], focal: float) -> NDArray[np.uint8]:
    column, row = np.meshgrid(np.arange(_SIZE, dtype=float), np.arange(_SIZE, dtype=float))
    rays = (_rays(column, row, focal) @ turn.T).astype(np.float32)
    columns, rows = positions(rays, grey.shape)
    seen = cv2.remap(grey, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return np.asarray(seen, np.uint8)
