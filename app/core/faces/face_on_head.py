"""Mapping of a face in a photo onto the transport's picture of the generic head.

Triangles between shared landmarks determine which pixels show the same point of the skin.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bools, Bytes, Float32, Floats, Indices
from app.core.base.colour import luminance, srgb_light
from app.core.faces.finder import Face, face_mesh
from app.core.solver.transport import Transport, load_named

_HOLES: Final = (
    (33, 133, 159, 145, 160, 144, 158, 153, 157, 154, 161, 163, 7, 246, 173, 155),  # right eye
    (70, 63, 105, 66, 107, 55, 65, 52, 53, 46),  # brow
    (61, 291, 0, 17, 37, 267, 84, 314, 39, 269, 181, 405, 40, 270, 91, 321),  # lips
)
_NOSTRIL: Final = (79, 166, 75, 60, 20, 238, 239, 240, 59, 99, 97, 242, 141)
_RIGHT_CHEEK: Final = (117, 118, 101, 36, 205, 187, 123)
_CORNER, _BROWS, _CHIN = 263, 8, 200  # left eye's outer corner, between the brows, above the chin
_GROWN: Final = 3  # pixels by which the holes are enlarged
_BLUR: Final = 1.0  # in pixels of the head's picture


@dataclass(frozen=True, slots=True, eq=False)
class HeadMap:
    """The pixels of the head's picture, N x N, expressed in terms of landmarks.

    Attributes:
        transport: Transport of the generic head.
        coverage: (N * N,) bool. True for the pixels between landmarks.
        corners, weights, triangle: (N * N, 3) intp, (N * N, 3) float32 and (N * N,) intp. The
            landmarks around each pixel, their weights, and the index of their triangle.
        skin: (N * N,) bool. Every second pixel of `whole`.
        whole: (N * N,) bool. Skin that is free of hair, beards and hats on most faces: from the
            brows to the chin and between the outer corners of the eyes, but without the eyes, brows
            and lips.
        cheeks: (2, N * N) bool. The sitter's right cheek, followed by the left cheek.
        halves: (2, M) intp. Pixels of `whole` on the sitter's right side, and their mirror images
            on the left. The nostrils and a margin around the eyelids and lips are excluded, because
            all of these are darker on real faces.
    """

    transport: Transport
    coverage: Bools
    corners: Indices
    weights: Float32
    triangle: Indices
    skin: Bools
    whole: Bools
    cheeks: Bools
    halves: Indices

    @property
    def side(self) -> int:
        """Side of the head's picture, N, in pixels."""
        return self.transport.size

    def blurred(self, pictures: Floats, where: Bools | Indices | None = None) -> Float32:
        """Return pictures of the head, (n, Q), blurred within the skin and limited to skin pixels.

        Args:
            pictures: (n, P) float. The pictures on the transport's pixels.
            where: Pixels of `whole` to return, as a mask or as indices. The default is `skin`.
        """
        where = self.skin if where is None else where
        inside, shape = self.whole[self.transport.pixels], (self.side, self.side)
        spread = cv2.GaussianBlur(self.whole.reshape(shape).astype(np.float32), (0, 0), _BLUR)
        spread = spread.ravel()[where]
        result = np.empty((len(pictures), len(spread)), np.float32)
        for row, picture in zip(result, pictures, strict=True):
            whole = np.zeros(self.side**2, np.float32)
            whole[self.transport.pixels[inside]] = picture[inside]
            row[:] = cv2.GaussianBlur(whole.reshape(shape), (0, 0), _BLUR).ravel()[where]
        result /= spread
        return result


@lru_cache(maxsize=1)
def head_map() -> HeadMap:
    """Build the map for the generic head."""
    transport, mesh = load_named("generic"), face_mesh()
    side = transport.size
    rows, columns = np.mgrid[:side, :side] + 0.5
    pixels = np.stack([columns.ravel(), rows.ravel()], axis=1)
    weights, triangle = np.zeros((side**2, 3), np.float32), np.full(side**2, -1, np.intp)
    for number, corners in enumerate(mesh.triangles):
        a, b, c = mesh.on_head[corners].astype(np.float64) * side
        across = np.stack([b - a, c - a], axis=1)
        if abs(np.linalg.det(across)) < 1e-9:
            continue
        two = (pixels - a) @ np.linalg.inv(across).T
        three = np.concatenate([1 - two.sum(axis=1, keepdims=True), two], axis=1)
        within = (three >= -1e-6).all(axis=1) & (triangle < 0)
        weights[within], triangle[within] = three[within], number
    right, whole = _filled(_RIGHT_CHEEK, side), _skin(transport, triangle >= 0)
    other = pixels.sum(axis=1) % 2 == 0
    return HeadMap(
        transport,
        triangle >= 0,
        mesh.triangles[triangle],
        weights,
        triangle,
        whole & other,
        whole,
        np.stack([right, _mirrored(right, side)]),
        _halves(whole, side),
    )


def _skin(transport: Transport, coverage: Bools) -> Bools:
    side, places = transport.size, face_mesh().on_head
    rows, columns = (np.mgrid[:side, :side] + 0.5) / side
    within = np.abs(columns - 0.5) <= places[_CORNER, 0] - 0.5
    within &= (rows >= places[_BROWS, 1]) & (rows <= places[_CHIN, 1])
    head = np.zeros(side**2, bool)
    head[transport.pixels] = True
    skin: Bools = coverage & head & within.ravel()
    for hole in _HOLES:
        out = _filled(hole, side, _GROWN)
        skin &= ~(out | _mirrored(out, side))
    return skin


def _halves(whole: Bools, side: int) -> Indices:
    clear = whole & _mirrored(whole, side)
    for hole, grown in ((_NOSTRIL, _GROWN), *((hole, _GROWN + 1) for hole in _HOLES)):
        out = _filled(hole, side, grown)
        clear &= ~(out | _mirrored(out, side))
    rows, columns = np.nonzero(clear.reshape(side, side)[:, : side // 2])
    return np.stack([rows * side + columns, rows * side + side - 1 - columns])


def _filled(marks: tuple[int, ...], side: int, grown: int = 1) -> Bools:
    """Return a mask, (N * N,), of the picture's pixels inside an outline of landmarks."""
    area = np.zeros((side, side), np.uint8)
    places = np.round(face_mesh().on_head[list(marks)] * side - 0.5).astype(np.int32)
    cv2.fillConvexPoly(area, cv2.convexHull(places), 1)
    return np.asarray(cv2.dilate(area, np.ones((grown, grown))) > 0).ravel()


def _mirrored(area: Bools, side: int) -> Bools:
    return area.reshape(side, side)[:, ::-1].ravel()


def on_head(picture: Bytes, face: Face) -> tuple[Float32, Bools]:
    """Sample the light on a face in a picture, (H, W, 3) uint8 sRGB, at the head's pixels.

    Returns:
        The linear luminance, (N * N,) float32, blurred as in `HeadMap.blurred`, and a mask, (N *
        N,) bool, of the head's pixels that are visible in the picture.
    """
    head = head_map()
    coverage = head.coverage
    blur = max(face.side / head.side * 0.5, 0.5)
    room = math.ceil(3 * blur) + 2
    left, top, right, bottom = (round(edge) for edge in face.box)
    top, left = max(top - room, 0), max(left - room, 0)
    part = picture[top : max(bottom + room, top + 1), left : max(right + room, left + 1)]
    linear = luminance(srgb_light(part))
    linear = np.asarray(cv2.GaussianBlur(linear, (0, 0), blur), np.float32)
    corners = face.landmarks[head.corners[coverage], :2]
    place = (corners * head.weights[coverage, :, None]).sum(axis=1) - (left + 0.5, top + 0.5)
    x, y = np.ascontiguousarray(place.T, np.float32)
    grey, visible = np.zeros(head.side**2, np.float32), np.zeros(head.side**2, bool)
    grey[coverage] = cv2.remap(linear, x, y, cv2.INTER_LINEAR).ravel()
    inside = (x >= 0) & (y >= 0) & (x < part.shape[1] - 1) & (y < part.shape[0] - 1)
    visible[coverage] = inside & _facing(face)[head.triangle[coverage]]
    return grey, visible


def _facing(face: Face) -> Bools:
    """Return a mask of the mesh's triangles that face the camera, (T,)."""
    a, b, c = (face.landmarks[face_mesh().triangles[:, corner], :2] for corner in range(3))
    first, second = b - a, c - a
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    return np.asarray(np.sign(area) == np.sign(np.median(area)))
