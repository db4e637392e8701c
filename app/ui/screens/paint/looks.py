"""Pictures of the head for the canvas: in soft grey light, or as a style or place lights it."""

from __future__ import annotations

from typing import Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base import colour
from app.core.solver.transport import Transport, render, to_image
from app.ui.screens.paint.state import HeadLook

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]

_FACE: Final = 0.5  # from this share of the head on a pixel counts as face
_SOLID: Final = 0.9  # below this share its value is that of its neighbours: no fringe at the edge
_LEVEL: Final = 0.30  # linear grey of the median pixel: room for orange and blue on both sides
_SKY: Final = 0.8
_FRONT: Final = 0.7


def coverage_of(transport: Transport) -> Float32:
    """Share of each pixel that the head covers, (N, N) float32."""
    return to_image(transport, transport.coverage)


def head_look(transport: Transport) -> HeadLook:
    """Light a head softly, so that its form is seen and no side is favoured."""
    rows, columns = transport.environment_shape
    elevation = np.pi * (0.5 - (np.arange(rows) + 0.5) / rows)[:, None]
    azimuth = 2 * np.pi * ((np.arange(columns) + 0.5) / columns - 0.5)[None, :]
    ahead = np.clip(np.cos(elevation) * np.cos(azimuth), 0.0, None)
    light = _SKY * (0.5 + 0.5 * np.sin(elevation)) + _FRONT * ahead**2
    coverage = coverage_of(transport)
    flat = np.maximum(render(transport, light), 0.0)
    grey = _continued(to_image(transport, flat), coverage)
    face = coverage >= _FACE
    # Sorted: numpy's own median first loads masked arrays, 40 ms at a time that counts.
    middle = float(np.sort(grey[face])[int(face.sum()) // 2]) if face.any() else 1.0
    shown = colour.srgb_encode(np.clip(grey * (_LEVEL / max(middle, 1e-30)), 0.0, 1.0))
    return HeadLook(np.asarray(shown, np.float32), coverage)


def head_picture(linear: NDArray[np.floating[Any]], coverage: Float32) -> Bytes:
    """Develop a picture of the head for the canvas.

    Parameters
    ----------
    linear : (N, N, 3) float
        Linear Rec. 709 on black; pixels at the edge hold the head's share only.
    coverage : (N, N) float32
        That share.

    Returns
    -------
    (N, N, 3) uint8
        sRGB, exposed by the rule of `app.core.base.colour.face_exposure`, continued beyond the
        edge.
    """
    whole = _continued(np.asarray(linear, np.float32), coverage)
    face = coverage >= _FACE
    gain = colour.face_exposure(colour.luminance(whole[face])) if face.any() else 1.0
    return colour.to_bytes(colour.tone_map(np.maximum(whole, 0.0), gain))


def _continued(picture: Float32, coverage: Float32) -> Float32:
    """Take the black out of edge pixels and carry the edge outward by a few pixels."""
    share = np.where(coverage >= _SOLID, coverage, 0.0).astype(np.float32)
    known = np.where(share > 0, 1.0, 0.0).astype(np.float32)
    wide = picture[..., None] if picture.ndim == 2 else picture
    values = np.where(share[..., None] > 0, wide / np.maximum(share, _SOLID)[..., None], 0.0)
    values = np.ascontiguousarray(values, np.float32)
    for _ in range(4):
        around = cv2.blur(values, (3, 3), borderType=cv2.BORDER_REPLICATE)
        around = np.asarray(around, np.float32).reshape(values.shape)
        weight = np.asarray(cv2.blur(known, (3, 3), borderType=cv2.BORDER_REPLICATE), np.float32)
        grown = (known == 0) & (weight > 1e-6)
        values[grown] = around[grown] / weight[grown][:, None]
        known[grown] = 1.0
    return values.reshape(picture.shape)
