"""Detection of the faces in a picture, with 468 landmarks on each.

Two MediaPipe networks (Apache-2.0) run in OpenCV. One detects faces in the whole picture and in
parts of it. The other locates landmarks on a face and on its mirror image. The confidence is high
if the two sets of landmarks agree.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, TypeAlias

import cv2
import numpy as np

from app.core.base.archive import read_arrays
from app.core.base.arrays import Bytes, Float32, Float64, Indices
from app.core.base.errors import CoreError
from app.core.base.imaging.networks import read_network
from app.core.base.paths import resources
from app.core.text import tr

_AGAIN: Final = tr("Reinstall Turnlight.")

Square: TypeAlias = tuple[float, float, float]  # left, top, side, in pixels

_LOOK: Final = 128  # side of the first network's input, in pixels
_CLOSE: Final = 192  # side of the second network's input
# the first network's output: cells per side and candidates per cell
_GRIDS: Final = ((16, 2), (8, 6))
_CORNERS: Final = (33, 263)  # outer corners of the eyes
_EYES: Final = slice(4, 8)  # entries of a candidate: centre, size, right eye, left eye, ...
_WORTH_A_LOOK: Final = 0.35
_SAME: Final = 0.5  # two candidates that share this fraction of the smaller box are one face
_MOST: Final = 12
_ROOM: Final = 1.5  # side of a close-up relative to that of the face
_LARGEST: Final = 1280  # longer side of the picture that is searched
_SMALLEST_PART: Final = 240  # six times the side of a face of 40 pixels
_STEP: Final = 2.4  # largest ratio between successive sizes of parts
# step as a fraction of a part's side: any face too small for larger parts fits into an overlap
_STRIDE: Final = 0.6
_APART: Final = 0.05  # fraction of the face's side beyond which the two passes disagree
_LEAST: Final = 0.37
_LEAST_CONFIDENCE: Final = 0.5  # below this, the whole picture is searched again
_LOOKS: Final = 5
# relative to the detail of the sharpest face; below this, a face is out of focus
_SHARP: Final = 0.35
_STAYS: Final = 0.06  # fraction of the face's side by which stable landmarks may move
_DARK: Final = 80.0  # mean of a well-exposed square
_MOST_GAIN: Final = 8.0


@dataclass(frozen=True, slots=True)
class Face:
    """A face in a picture.

    Attributes:
        landmarks: (468, 3) float32. Column and row of each landmark, in pixels from the upper left
            corner, and its depth away from the camera in the same unit.
        confidence: Confidence that this is a face, 0 to 1.
    """

    landmarks: Float32
    confidence: float

    @property
    def box(self) -> tuple[float, float, float, float]:
        """The left, top, right and bottom of the landmarks, from forehead to chin, in pixels."""
        low, high = self.landmarks[:, :2].min(axis=0), self.landmarks[:, :2].max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    def scaled(self, scale: float) -> Face:
        """Return the face as it appears in a resized picture."""
        return Face(self.landmarks * np.float32(scale), self.confidence)

    @property
    def side(self) -> float:
        """Longer side of the box, in pixels."""
        left, top, right, bottom = self.box
        return max(right - left, bottom - top)


@dataclass(frozen=True, slots=True)
class FaceMesh:
    """The canonical face model.

    Attributes:
        points: (468, 3) float32. Positions in cm: x towards the sitter's left, y up, z out of the
            face.
        triangles: (T, 3) intp. Indices of the triangles' points.
        mirrored: (468,) intp. Index of each point's mirror image.
        on_head: (468, 2) float32. Positions in the transport's picture of the generic head, as
            fractions from 0 to 1.
    """

    points: Float32
    triangles: Indices
    mirrored: Indices
    on_head: Float32


@lru_cache(maxsize=1)
def face_mesh() -> FaceMesh:
    """Load the canonical face model.

    Raises:
        CoreError: If the mesh is missing or damaged.
    """
    arrays = read_arrays(resources() / "faces" / "mesh.npz", tr("face mesh"), _AGAIN)
    points = arrays["points"].astype(np.float32)
    other = points * np.array([-1, 1, 1], np.float32)
    apart = np.linalg.norm(points[:, None] - other[None], axis=2)
    triangles, twins = arrays["triangles"].astype(np.intp), apart.argmin(axis=1)
    return FaceMesh(points, triangles, twins, arrays["on_head"].astype(np.float32))


def find_faces(picture: Bytes, near: Face | None = None, *, small: bool = True) -> tuple[Face, ...]:
    """Find the faces in a picture, sorted from largest to smallest, with out-of-focus faces last.

    Args:
        picture: (H, W, 3) uint8. Upright sRGB picture.
        near: A face in the previous frame. The area around it is searched first, at a tenth of the
            cost.
        small: Whether to search for faces smaller than a sixth of the picture as well.

    Raises:
        CoreError: If the program's own networks are missing or damaged.
    """
    networks = _networks()
    if near is not None:
        again = _looked_at(networks, picture, near.landmarks[:, :2], 1.0)
        if again is not None and again.confidence >= _LEAST_CONFIDENCE:
            return (again,)
    faces: list[Face] = []
    for score, answer in _distinct(_answers(networks, picture, small)):
        face = _looked_at(networks, picture, _box(answer), score, answer[_EYES].reshape(2, 2))
        if face is None or face.confidence < _LEAST:
            continue
        box = np.reshape(face.box, (2, 2))
        if all(_shared(box, np.reshape(other.box, (2, 2))) < _SAME for other in faces):
            faces.append(face)
    detail = [_detail(picture, face) for face in faces]
    sharp = [one >= _SHARP * max(detail, default=0.0) for one in detail]
    order = sorted(range(len(faces)), key=lambda k: (not sharp[k], -faces[k].side))
    return tuple(faces[k] for k in order)


def _detail(picture: Bytes, face: Face) -> float:
    """Return the amount of fine detail in a face, normalised for size and exposure."""
    left, top, right, bottom = face.box
    scale = _CLOSE / max(face.side, 1.0)
    way = np.array([[scale, 0, -left * scale], [0, scale, -top * scale]])
    grey = cv2.cvtColor(_cut(picture, way, _CLOSE), cv2.COLOR_RGB2GRAY)
    part = grey[: max(round((bottom - top) * scale), 1), : max(round((right - left) * scale), 1)]
    return float(cv2.Laplacian(part, cv2.CV_32F).std() / max(part.std(), 1.0))


class _Networks:
    """The two networks. Only one thread may use them at a time, since they store their input."""

    def __init__(self, first: Any, second: Any) -> None:
        self._first, self._second, self._lock = first, second, threading.Lock()

    def faces(self, square: Bytes) -> tuple[Float32, Float32]:
        """Return the candidates' log odds, (896,), and raw positions, (896, 16)."""
        with self._lock:
            self._first.setInput(cv2.dnn.blobFromImage(square, 1 / 127.5, mean=(127.5,) * 3))
            scores, places = self._first.forward(["classificators", "regressors"])
        return scores.ravel(), places[0]

    def landmarks(self, crop: Bytes) -> tuple[Float32, float]:
        """Return the landmarks, (468, 3), in a close-up, and the log odds of a face."""
        with self._lock:
            self._second.setInput(cv2.dnn.blobFromImage(crop, 1 / 255))
            places, likely = self._second.forward(["conv2d_21", "conv2d_31"])
        return places.reshape(468, 3).astype(np.float32), float(likely.ravel()[0])


@lru_cache(maxsize=1)
def _networks() -> _Networks:
    folder = resources() / "faces"
    names = ("face_detection_short_range.tflite", "face_landmark.tflite")
    try:
        first, second = (read_network(folder / name) for name in names)
    except (OSError, cv2.error) as error:
        message = tr("Turnlight’s face detector is missing or damaged.")
        raise CoreError(message, _AGAIN) from error
    return _Networks(first, second)


@lru_cache(maxsize=1)
def _anchors() -> Float64:
    """Return the centres of the first network's candidates, (896, 2), relative to the square."""
    parts = []
    for cells, count in _GRIDS:
        y, x = np.mgrid[:cells, :cells]
        middle = (np.stack([x, y], axis=2).reshape(-1, 2) + 0.5) / cells
        parts.append(middle.repeat(count, axis=0))
    return np.concatenate(parts)


def _squares(height: int, width: int, small: bool) -> Iterator[Square]:
    """Yield the whole picture, followed by its overlapping parts, from largest to smallest."""
    longer = max(height, width)
    yield (width - longer) / 2, (height - longer) / 2, float(longer)
    smaller = max(longer / _SMALLEST_PART, 1.0)
    steps = math.ceil(math.log(smaller, _STEP)) if small else 0
    for step in range(1, steps + 1):
        side = longer / smaller ** (step / steps)
        tops, lefts = (_starts(length, side) for length in (height, width))
        yield from ((left, top, side) for top in tops for left in lefts)


def _starts(length: int, side: float) -> list[float]:
    if length <= side:
        return [(length - side) / 2]
    count = math.ceil((length - side) / (_STRIDE * side)) + 1
    return [float(one) for one in np.linspace(0, length - side, count)]


def _answers(networks: _Networks, picture: Bytes, small: bool) -> list[tuple[float, Float64]]:
    """Return each candidate's likelihood, and its centre, size and six points, (16,), in pixels."""
    height, width = picture.shape[:2]
    scale = min(_LARGEST / max(height, width), 1.0)
    if scale < 1.0:
        size = round(width * scale), round(height * scale)
        picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    candidates = []
    for left, top, side in _squares(picture.shape[0], picture.shape[1], small):
        share = _LOOK / side
        square = _cut(
            picture, np.array([[share, 0, -left * share], [0, share, -top * share]]), _LOOK
        )
        scores, places = networks.faces(square)
        likely = 1 / (1 + np.exp(-np.clip(scores, -50, 50)))
        for number in np.flatnonzero(likely > _WORTH_A_LOOK):
            raw = places[number].astype(np.float64).reshape(8, 2) / _LOOK
            raw[[0, 2, 3, 4, 5, 6, 7]] += _anchors()[number]
            raw = raw * side
            raw[[0, 2, 3, 4, 5, 6, 7]] += (left, top)
            candidates.append((float(likely[number]), raw.ravel() / scale))
    return candidates


def _cut(picture: Bytes, way: Float64, side: int) -> Bytes:
    """Cut a square out of the picture, with black where it extends beyond the edges."""
    shrink = math.hypot(way[0, 0], way[0, 1])
    source = picture
    if shrink < 0.5:
        # Shrink first: undersampling would cause aliasing.
        half = 2 ** math.floor(math.log2(1 / shrink))
        size = max(picture.shape[1] // half, 1), max(picture.shape[0] // half, 1)
        source = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
        way = way @ np.diag([picture.shape[1] / size[0], picture.shape[0] / size[1], 1.0])
    cut = cv2.warpAffine(source, way, (side, side), flags=cv2.INTER_LINEAR)
    dark = float(cut.mean())
    if dark < _DARK:
        # Brighten the square to a normal exposure.
        cut = cv2.LUT(cut, _brightened(min(_DARK / max(dark, 1.0), _MOST_GAIN)))
    return np.asarray(cut, np.uint8)


def _brightened(gain: float) -> Bytes:
    """Return a curve for 8-bit values, (256,), that lifts the shadows and preserves white."""
    shares = np.arange(256) / 255
    return np.asarray(np.round(255 * gain * shares / (1 + (gain - 1) * shares)), np.uint8)


def _distinct(answers: list[tuple[float, Float64]]) -> list[tuple[float, Float64]]:
    """Keep only the most likely of the candidates for each face."""
    distinct: list[tuple[float, Float64]] = []
    for score, answer in sorted(answers, key=lambda one: -one[0]):
        if all(_shared(_box(answer), _box(other)) < _SAME for _, other in distinct):
            distinct.append((score, answer))
    return distinct[:_MOST]


def _box(answer: Float64) -> Float64:
    """Return the corners of a candidate's box, (2, 2)."""
    return np.asarray(answer[:2] + np.array([[-0.5], [0.5]]) * answer[2:4])


def _shared(one: Float64, other: Float64) -> float:
    """Return the overlap of two boxes, (2, 2), as a fraction of the smaller one's area."""
    sides = np.minimum(one[1], other[1]) - np.maximum(one[0], other[0])
    smaller = min(float(np.prod(box[1] - box[0])) for box in (one, other))
    return float(np.prod(np.maximum(sides, 0))) / max(smaller, 1e-9)


def _looked_at(
    networks: _Networks,
    picture: Bytes,
    points: Float32 | Float64,
    score: float,
    eyes: Float32 | Float64 | None = None,
) -> Face | None:
    """Find a candidate's landmarks in close-ups until they settle, then once in a mirror image."""
    eyes = points[list(_CORNERS)] if eyes is None else eyes
    for number in range(_LOOKS):
        transform = _close_look(points, eyes)
        if transform is None:
            return None
        way = transform
        crop = _cut(picture, way, _CLOSE)
        landmarks, likely = _landmarks(networks, crop)
        places = _back(landmarks, way)[:, :2]
        low, high = points.min(axis=0), points.max(axis=0)
        shift = np.abs(places.min(axis=0) - low) + np.abs(places.max(axis=0) - high)
        if number and shift.max() < _STAYS * (high - low).max():
            break
        points, eyes = places, places[list(_CORNERS)]
    other, also = _landmarks(networks, np.ascontiguousarray(crop[:, ::-1]))
    other = _mirrored(other[face_mesh().mirrored])
    apart = float(np.linalg.norm((landmarks - other)[:, :2], axis=1).mean()) * _ROOM / _CLOSE
    agreement = math.exp(-((apart / _APART) ** 2))
    confidence = (likely + also) / 2 * agreement * min(1.0, score / 0.7)
    both = np.asarray((landmarks + other) / 2, np.float32)
    return Face(_back(both, way), float(confidence))


def _mirrored(landmarks: Float32) -> Float32:
    """Mirror the landmarks of a close-up."""
    flipped = landmarks.copy()
    flipped[:, 0] = _CLOSE - flipped[:, 0]
    return flipped


def _close_look(points: Float32 | Float64, eyes: Float32 | Float64) -> Float64 | None:
    """Return the transform, (2, 3), from the picture to a close-up of a face with level eyes."""
    low, high = points.min(axis=0), points.max(axis=0)
    side = float((high - low).max()) * _ROOM
    if not (math.isfinite(side) and side > 4):
        return None
    across = eyes[1] - eyes[0]
    tilt = math.degrees(math.atan2(float(across[1]), float(across[0])))
    middle = (low + high) / 2
    way = cv2.getRotationMatrix2D((float(middle[0]), float(middle[1])), tilt, _CLOSE / side)
    way[:, 2] += _CLOSE / 2 - middle
    return np.asarray(way, np.float64)


def _landmarks(networks: _Networks, crop: Bytes) -> tuple[Float32, float]:
    """Return the landmarks in a close-up, (468, 3), and the likelihood that it shows a face."""
    places, odds = networks.landmarks(crop)
    return places, 1 / (1 + math.exp(-min(max(odds, -50.0), 50.0)))


def _back(landmarks: Float32, way: Float64) -> Float32:
    """Convert the landmarks of a close-up to pixel coordinates of the picture."""
    back = cv2.invertAffineTransform(way)
    flat = landmarks[:, :2] @ back[:, :2].T + back[:, 2]
    depth = landmarks[:, 2:] * math.hypot(back[0, 0], back[0, 1])
    return np.concatenate([flat, depth], axis=1).astype(np.float32)
