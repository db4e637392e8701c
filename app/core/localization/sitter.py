"""Find the sitter's head in a picture.

If a face is visible, its landmarks locate the head (`app.core.faces.finder`). Otherwise, for
example if the sitter is far away, a small network searches the picture at three sizes for heads
that roughly face the camera. Each candidate is checked again in a close-up and in the mirror image
of the close-up. Errors to one side cancel out, so the result is the *centre of the head*, between
the ears, and not the centre of the lit half of a face.

The network is `resources/sitter/heads.onnx`, trained by `scripts/train_sitter.py` on rendered
people (see CREDITS.md beside it). Its input is grey values minus their local mean, divided by their
local deviation, which removes most effects of exposure, white balance and shadow. It consists of
seven convolutions with rectifiers between them. For each cell of 8 x 8 pixels, it outputs the
likelihood that the cell contains the centre of a head, the offset from the centre of the cell, and
the height of the head.
"""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Final, Literal, TypeAlias

import cv2
import numpy as np

from app.core.base.arrays import Bools, Bytes, Float32
from app.core.base.errors import CoreError
from app.core.base.imaging.networks import read_network
from app.core.base.paths import resources
from app.core.faces.finder import Face, find_faces
from app.core.localization.heading_conversion import offset_angle
from app.core.text import tr

Kind: TypeAlias = Literal["face", "person"]

_CELL: Final = 8  # pixels between two outputs of the network
_USUAL_PX: Final = 26.0  # height of a head for which the network outputs 0
_CLOSE: Final = ((96, 28.0), (112, 36.0))  # side of the close-ups, and height of the head in them
_NEAR_SIDE: Final = 160
# longer side of the picture, in pixels, for heads that are 4 to 60% of it
_SIDES: Final = (320, 160, 80)
_WINDOW: Final = 31  # pixels, for the local mean and deviation
_FLOOR: Final = 6.0  # grey levels: keeps noise on an even wall from becoming a pattern

_WORTH_A_LOOK: Final = 0.3
_SURE: Final = 0.85
_BELIEVED_NEAR: Final = 0.55
_BELIEVED_KEEN: Final = 0.75
_LIKELY_TALL: Final = (0.075, 0.27)  # height over distance: 23 cm from 3 m to 85 cm
_MOST_LOOKS: Final = 3
# of the picture's longer side: a smaller person is 4 m away and not the sitter
_LEAST_TALL: Final = 0.05
_UNSEEN: Final = 1e-4  # likelihood if a close-up shows nothing
_LEAST_SIDE: Final = 32
_LIVE_SIDE: Final = 640
_BELIEVED_FACE: Final = 0.5
_HEAD_MARKS: Final = (234, 454, 10, 152)  # landmarks beside the ears, at the hairline and chin
_CROWN: Final = 1.3  # from chin to crown, over chin to hairline
_ALONE: Final = threading.Lock()  # because a network stores its input
_WIDE: Final = 0.74  # width of a head over its height, crown to chin


@dataclass(frozen=True, slots=True)
class Sitter:
    """The sitter's head in a picture.

    Attributes:
        column: Centre of the head as a fraction of the width, 0 at the left edge.
        angle_deg: Horizontal angle from the camera's axis to the centre of the head, in degrees,
            positive to the right in the unmirrored picture.
        box: Left, top, right and bottom of the head, from crown to chin and cheek to cheek, as
            fractions of the width and height. The box may extend beyond the picture.
        kind: "face" for a visible head, "person" for a body without a visible head.
        confidence: Confidence that this is a head, 0 to 1.
        face: The face and its landmarks, or None if no face was found.
    """

    column: float
    angle_deg: float
    box: tuple[float, float, float, float]
    kind: Kind = "face"
    confidence: float = 1.0
    face: Face | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class _HeadBox:
    """A head in the picture: its centre and height (crown to chin), in pixels, and likelihood."""

    x: float
    y: float
    tall: float
    score: float


def find_sitter(
    frame: Bytes, fov_deg: float, near: Sitter | None = None, *, keen: bool = False
) -> Sitter | None:
    """Find the head of the sitter, or of the person in view.

    If several people are visible, the largest and most certain head is chosen.

    Args:
        frame: (H, W, 3) uint8. sRGB, not mirrored.
        fov_deg: Horizontal field of view, in degrees within (0, 180).
        near: The previous result. The search starts at that head, at a quarter of the cost, and
            continues everywhere if the head is gone.
        keen: Whether this is a single photo of somebody. If so, a head of the size expected at a
            distance of 1 to 3 m requires less certainty.

    Raises:
        CoreError: If the program's own network is missing or damaged.
    """
    height, width = frame.shape[:2]
    if min(height, width) < _LEAST_SIDE:
        return None
    face = _largest_face(frame, near, keen)
    if face is not None:
        return _sitter(_head_of(face), (height, width), fov_deg, face)
    grey = np.asarray(cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY), np.uint8)
    head = None if near is None else _found_near(grey, near)
    if head is None:
        focal = width / 2.0 / math.tan(math.radians(fov_deg) / 2.0)
        likely = (_LIKELY_TALL[0] * focal, _LIKELY_TALL[1] * focal) if keen else None
        head = _found_anywhere(grey, likely)
    return None if head is None else _sitter(head, (height, width), fov_deg)


def _largest_face(frame: Bytes, near: Sitter | None, keen: bool) -> Face | None:
    """Return the previous face if it is still there, otherwise the largest face.

    Live pictures are searched at half size or less, since the next picture follows soon.
    """
    scale = 1.0 if keen else min(_LIVE_SIDE / max(frame.shape[:2]), 1.0)
    size = round(frame.shape[1] * scale), round(frame.shape[0] * scale)
    small = frame
    if scale < 1.0:
        small = np.asarray(cv2.resize(frame, size, interpolation=cv2.INTER_AREA), np.uint8)
    before = None if near is None or near.face is None else near.face.scaled(scale)
    faces = [f for f in find_faces(small, before) if f.confidence >= _BELIEVED_FACE]
    return faces[0].scaled(1 / scale) if faces else None


def _head_of(face: Face) -> _HeadBox:
    """Return the head around a face, with its centre midway between the ears."""
    right, left, forehead, chin = face.landmarks[list(_HEAD_MARKS)].astype(np.float64)
    up = forehead - chin
    tall = _CROWN * float(np.linalg.norm(up))
    y = chin[1] + up[1] / max(math.hypot(up[0], up[1]), 1e-9) * tall / 2.0
    return _HeadBox(float(right[0] + left[0]) / 2.0, float(y), tall, face.confidence)


def _sitter(
    head: _HeadBox, size: tuple[int, int], fov_deg: float, face: Face | None = None
) -> Sitter:
    height, width = size
    wide = _WIDE * head.tall / 2.0
    box = (
        (head.x - wide) / width,
        (head.y - head.tall / 2.0) / height,
        (head.x + wide) / width,
        (head.y + head.tall / 2.0) / height,
    )
    angle = offset_angle(head.x, width, fov_deg)
    return Sitter(head.x / width, angle, box, "face", min(max(head.score, 0.0), 1.0), face)


def background_mask(sitter: Sitter, shape: tuple[int, int]) -> Bools:
    """Return a mask of the background, which excludes a rough outline of head, hair and body.

    Args:
        shape: Number of rows and columns of the mask. Any size is permitted.

    Returns:
        (H, W) bool. True for background.
    """
    rows, columns = shape
    left, top, right, bottom = sitter.box
    x0, x1 = left * columns, right * columns
    y0, y1 = top * rows, bottom * rows
    middle, tall, wide = (x0 + x1) / 2.0, y1 - y0, x1 - x0
    mask = np.ones((rows, columns), np.uint8)
    centre = _point(middle, (y0 + y1) / 2.0 - 0.04 * tall)
    axes = (max(round(0.72 * wide), 1), max(round(0.68 * tall), 1))
    cv2.ellipse(mask, centre, axes, 0.0, 0.0, 360.0, 0, -1)
    half = 1.0 / _WIDE * wide  # the head's height, in columns
    outline = [(0.35, 0.1), (0.95, 0.38), (1.25, 0.75), (1.5, 2.0), (1.5, 9.0)]
    sides = [[_point(middle + s * x * half, y1 + y * tall) for x, y in outline] for s in (-1, 1)]
    cv2.fillPoly(mask, [np.array(sides[0] + sides[1][::-1], np.int32)], 0)
    return mask.astype(bool)


def _point(x: float, y: float) -> tuple[int, int]:
    far = 1 << 15
    return round(min(max(x, -far), far)), round(min(max(y, -far), far))


# -- searching -------------------------------------------------------------------------------------


def _found_anywhere(grey: Bytes, likely: tuple[float, float] | None = None) -> _HeadBox | None:
    """Find the largest and most certain head in a picture.

    Args:
        likely: Range of heights, in pixels, within which a head requires less certainty.
    """
    heads: list[_HeadBox] = []
    longer = max(grey.shape)
    for side in _SIDES:
        scale = side / longer
        size = (max(round(grey.shape[1] * scale), 8), max(round(grey.shape[0] * scale), 8))
        how = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_LINEAR
        small = np.asarray(cv2.resize(grey, size, interpolation=how), np.uint8)
        ratio = (grey.shape[1] / size[0], grey.shape[0] / size[1])
        heads += [
            _HeadBox(h.x * ratio[0], h.y * ratio[1], h.tall * ratio[1], h.score)
            for h in heads_in(small, _network())
        ]
    large = [head for head in _apart(heads) if head.tall >= _LEAST_TALL * longer]
    close_looks = [_looked_again(grey, head) for head in large[:_MOST_LOOKS]]
    low, high = likely or (math.inf, 0.0)
    sure = [
        head
        for head in close_looks
        if head is not None and head.score >= (_BELIEVED_KEEN if low < head.tall < high else _SURE)
    ]
    return max(sure, key=lambda head: head.score * math.sqrt(head.tall), default=None)


def _found_near(grey: Bytes, near: Sitter) -> _HeadBox | None:
    rows, columns = grey.shape
    tall = max((near.box[3] - near.box[1]) * rows, 8.0)
    before = _HeadBox(near.column * columns, (near.box[1] + near.box[3]) / 2.0 * rows, tall, 1.0)
    heads = _heads_around(grey, before, _NEAR_SIDE, _USUAL_PX)
    if not heads:
        return None
    again = _looked_again(grey, heads[0])
    return again if again is not None and again.score >= _BELIEVED_NEAR else None


def _looked_again(grey: Bytes, head: _HeadBox) -> _HeadBox | None:
    """Check a head in close-ups at two sizes, plain and mirrored, and combine all results."""
    width = grey.shape[1]
    mirrored = _HeadBox(width - head.x, head.y, head.tall, head.score)
    pairs: list[tuple[_HeadBox, _HeadBox]] = []
    scores = [head.score] * len(_CLOSE)
    for side, tall_px in _CLOSE:
        plain = _nearest(_heads_around(grey, head, side, tall_px), head)
        other = _nearest(_heads_around(grey[:, ::-1], mirrored, side, tall_px), mirrored)
        scores += [_UNSEEN if one is None else one.score for one in (plain, other)]
        if plain is not None and other is not None:
            pairs.append((plain, _HeadBox(width - other.x, other.y, other.tall, other.score)))
    if not pairs:
        return None
    heads = [one for pair in pairs for one in pair]
    return _HeadBox(
        sum(one.x for one in heads) / len(heads),
        sum(one.y for one in heads) / len(heads),
        math.exp(sum(math.log(one.tall) for one in heads) / len(heads)),
        _together(scores),
    )


def _together(scores: list[float]) -> float:
    """Return the likelihood whose log odds are the mean of the log odds of several likelihoods."""
    likely = [min(max(one, _UNSEEN), 1.0 - _UNSEEN) for one in scores]
    odds = sum(math.log(one / (1.0 - one)) for one in likely) / len(likely)
    return 1.0 / (1.0 + math.exp(-odds))


def _nearest(heads: list[_HeadBox], target: _HeadBox) -> _HeadBox | None:
    close = [h for h in heads if math.hypot(h.x - target.x, h.y - target.y) < 0.6 * target.tall]
    return max(close, key=lambda head: head.score, default=None)


def _heads_around(grey: Bytes, head: _HeadBox, side: int, tall_px: float) -> list[_HeadBox]:
    """Find heads in a square around a head, scaled so that this head is `tall_px` high."""
    cut = max(round(side * head.tall / tall_px), 8)
    left, top = round(head.x - cut / 2.0), round(head.y - cut / 2.0)
    rows, columns = grey.shape
    x0, x1 = max(left, 0), min(left + cut, columns)
    y0, y1 = max(top, 0), min(top + cut, rows)
    if x1 - x0 < 2 or y1 - y0 < 2:
        return []
    edges = (y0 - top, top + cut - y1, x0 - left, left + cut - x1)
    # The area outside the picture is blank, as in the network's training pictures.
    how = cv2.INTER_AREA if cut > side else cv2.INTER_LINEAR
    square = cv2.copyMakeBorder(grey[y0:y1, x0:x1], *edges, borderType=cv2.BORDER_REPLICATE)
    small = np.asarray(cv2.resize(square, (side, side), interpolation=how), np.uint8)
    ratio = cut / side
    return [
        _HeadBox(left + h.x * ratio, top + h.y * ratio, h.tall * ratio, h.score)
        for h in heads_in(small, _network())
    ]


def _apart(heads: list[_HeadBox]) -> list[_HeadBox]:
    """Keep the most certain of any overlapping heads, in descending order of certainty."""
    distinct: list[_HeadBox] = []
    for head in sorted(heads, key=lambda h: -h.score):
        if all(
            math.hypot(head.x - h.x, head.y - h.y) > 0.6 * max(head.tall, h.tall) for h in distinct
        ):
            distinct.append(head)
    return distinct


# -- the network -----------------------------------------------------------------------------------


def heads_in(grey: Bytes, network: Any) -> list[_HeadBox]:
    """Return the heads that are 14 to 46 pixels high, most confident detection first.

    Positions and sizes are in pixel coordinates of the given picture.

    Args:
        grey: (H, W) uint8. Greyscale picture.
        network: The head detector, as loaded by OpenCV.
    """
    answers = _answers(grey, network)
    likely = 1.0 / (1.0 + np.exp(-np.clip(answers[..., 0], -30.0, 30.0)))
    rows, columns = np.nonzero(likely >= _WORTH_A_LOOK)
    if not len(rows):
        return []
    score = likely[rows, columns].astype(np.float64)
    place = answers[rows, columns].astype(np.float64)
    x = (columns + 0.5 + place[:, 1]) * _CELL
    y = (rows + 0.5 + place[:, 2]) * _CELL
    tall = _USUAL_PX * np.exp(np.clip(place[:, 3], -1.5, 1.5))
    heads: list[_HeadBox] = []
    rest = np.ones(len(rows), bool)
    for k in np.argsort(-score):
        if not rest[k]:
            continue
        same = rest & (np.hypot(x - x[k], y - y[k]) < 0.5 * tall[k])
        rest &= ~same
        share = score[same] ** 2 / (score[same] ** 2).sum()
        heads.append(
            _HeadBox(
                float(x[same] @ share),
                float(y[same] @ share),
                float(np.exp(np.log(tall[same]) @ share)),
                float(score[k]),
            )
        )
    return heads


def _answers(grey: Bytes, network: Any) -> Float32:
    """Return the outputs of a network, (h, w, 4), for the cells of a greyscale picture."""
    with _ALONE:
        network.setInput(cv2.dnn.blobFromImage(prepared(grey)))
        return np.moveaxis(network.forward()[0], 0, -1)


def prepared(grey: Bytes) -> Float32:
    """Subtract the local mean from a picture and divide by the local deviation.

    Args:
        grey: (H, W) uint8. Greyscale picture in sRGB.

    Returns:
        (H, W) float32. The network's input.
    """
    values = grey.astype(np.float32)
    mean = cv2.blur(values, (_WINDOW, _WINDOW))
    square = cv2.blur(values * values, (_WINDOW, _WINDOW))
    deviation = np.sqrt(np.maximum(square - mean * mean, 0.0)) + np.float32(_FLOOR)
    return np.asarray((values - mean) / deviation, np.float32)


@lru_cache(maxsize=1)
def _network() -> Any:
    file = resources() / "sitter" / "heads.onnx"
    try:
        return read_network(file)
    except (OSError, cv2.error) as error:
        message = tr("Turnlight’s head detector is missing or damaged.")
        raise CoreError(message, tr("Reinstall Turnlight.")) from error
