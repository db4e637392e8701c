"""Track how far the camera has moved around the sitter, from the background of a video.

Background points that two frames share determine the camera's rotation between them. On a wall
without such points, the shift of the shading from the previous frame determines it instead. Frame
by frame, these rotations form a chain. Where the chain returns to an earlier view, both ends face
in the same direction. This determines the focal length, which few videos record, and removes the
drift. Distances are ignored, so a turn appears slightly smaller if the background is near.

The camera's axes point right, down and forward.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import cv2
import numpy as np

from app.core.base import sphere
from app.core.base.arrays import Bools, Bytes, Float32, Float64
from app.core.faces.finder import Face
from app.core.localization.features import Features, describe, pair, shrunk
from app.core.localization.recapture_registration import fit_rotation
from app.core.localization.rotation import unit_rays

USUAL_FOCAL: Final = 0.8
"""Default focal length divided by the picture's longer side, as for a phone's main camera."""

_LONGER: Final = 480  # longer side, in pixels, of the picture in which points are described
_POINTS: Final = 300
_APART: Final = 0.01  # fraction of the longer side; closer rivals are the same point
_ALIKE: Final = 0.75
_MISFIT_PX: Final = 2.0
_LEAST: Final = 12  # minimum number of points that agree
_LEAST_RETURN: Final = 16
_THUMB: Final = 96  # longer side of the shading, in pixels
_ROOM: Final = 0.25  # largest shift, as a fraction of the thumbnail
_OVERLAP: Final = 0.25
_SURE: Final = 0.85  # correlation of a reliable shift
_SMOOTH: Final = 3  # frames on each side, since a hand trembles but the path does not
_RETURN_DEG: Final = (200.0, 560.0)  # range of the chain for a return, while the lens is unknown
_LOOKS_BACK: Final = 10  # number of early frames that later ones are compared with
_FOCALS: Final = (0.35, 3.0)
_UPRIGHT_DEG: Final = 60.0  # minimum turn whose axis reveals the vertical


@dataclass(frozen=True, slots=True, eq=False)
class Background:
    """The feature points in a frame's background.

    Attributes:
        places: (N, 2) float32. Positions of the points, measured right and down from the centre, as
            fractions of the picture's longer side.
        picture, beside: (h, w, 3) uint8 and (h, w) bool. The frame, scaled down, and a mask of the
            area without the sitter.
        shading, mask: (h, w) float32 and bool. The same two, smaller and in greyscale.
        face: Position of the face, in the same units as `places`, or None if there is no face.
    """

    features: Features = field(repr=False)
    places: Float32 = field(repr=False)
    picture: Bytes = field(repr=False)
    beside: Bools = field(repr=False)
    shading: Float32 = field(repr=False)
    mask: Bools = field(repr=False)
    face: tuple[float, float] | None


@dataclass(frozen=True, slots=True, eq=False)
class FramePair:
    """Positions of the same points in two frames, (N, 2) float64, as in `Background`.

    Attributes:
        assumed: Whether the previous turn is assumed to continue because no background could be
            followed.
    """

    before: Float64 = field(repr=False)
    after: Float64 = field(repr=False)
    assumed: bool = False

    def rotation(self, focal: float) -> Float64:
        """Return the rotation, (3, 3), from the camera's axes before the step to those after it."""
        return fit_rotation(*(unit_rays(each, 1 / focal) for each in (self.after, self.before)))


@dataclass(frozen=True, slots=True, eq=False)
class Headings:
    """The azimuths of the lens in the frames of a video.

    Attributes:
        turns_deg: (n,) float64. Turn of the lens around the sitter since the first frame, in
            degrees clockwise as seen from above. The value exceeds 360 after a full turn.
        rotations: (n, 3, 3) float64. Rotations from the camera's axes in each frame to the axes of
            a level camera that looks at the sitter from the lens's position in the first frame.
        focal: Focal length divided by the picture's longer side.
        closed: Whether the video returned to an earlier view.
        error_deg: Gap between the two ends of the video, in degrees, before the drift was removed.
        assumed: Fraction of the steps during which no background could be followed.
    """

    turns_deg: Float64
    rotations: Float64 = field(repr=False)
    focal: float
    closed: bool
    error_deg: float
    assumed: float


def background(picture: Bytes, face: Face | None) -> Background:
    """Return the feature points of the background.

    Args:
        picture: (H, W, 3) uint8. Upright, unmirrored frame in sRGB.
        face: The sitter's face, which is excluded together with the body, or None if there is none.
    """
    longer = max(picture.shape[:2])
    small, _ = shrunk(picture, _LONGER / longer)
    scale = max(small.shape[:2])
    mask = np.ones(small.shape[:2], np.uint8)
    place = None
    middle = np.array([small.shape[1], small.shape[0]]) / 2
    if face is not None:
        left, top, right, bottom = (edge * scale / longer for edge in face.box)
        across, down = (left + right) / 2, (top + bottom) / 2
        place = (float(across - middle[0]) / scale, float(down - middle[1]) / scale)
        side = max(right - left, bottom - top)
        # Exclude hair and neck, and the shoulders down to the edge.
        for half, *ends in ((0.9, top - 0.7 * side, bottom), (1.9, bottom, scale)):
            sides = across - half * side, across + half * side
            rows, columns = (slice(*(max(round(x), 0) for x in pair)) for pair in (ends, sides))
            mask[rows, columns] = 0
    features = describe(small, _POINTS, mask > 0)
    places = ((features.places - middle) / scale).astype(np.float32)
    thumb, thumb_mask = shrunk(small, _THUMB / scale, mask > 0)
    grey = cv2.cvtColor(thumb, cv2.COLOR_RGB2GRAY).astype(np.float32)
    shading = np.asarray(cv2.GaussianBlur(grey - grey.mean(), (0, 0), 0.8), np.float32)
    assert thumb_mask is not None
    return Background(features, places, small, mask > 0, shading, thumb_mask, place)


def link(before: Background, after: Background) -> FramePair | None:
    """Match two frames, or return None if too few points agree."""
    pairs = pair(
        before.features.descriptors, after.features.descriptors, after.places, _APART, _ALIKE
    )
    if len(pairs.first) < _LEAST:
        return None
    one, other = before.places[pairs.first], after.places[pairs.second]
    # A homography describes a turn in front of a distant background without knowing the lens.
    pixels = one * _LONGER, other * _LONGER
    matrix, inside = cv2.findHomography(*pixels, cv2.USAC_MAGSAC, _MISFIT_PX, maxIters=1000)
    # The matrix is None if nothing fits, despite the type stubs.
    agree = np.asarray(inside).ravel() > 0 if np.ndim(matrix) == 2 else np.zeros(len(one), bool)
    if agree.sum() < _LEAST:
        return None
    return FramePair(one[agree].astype(np.float64), other[agree].astype(np.float64))


def step(
    before: Background, after: Background, last: FramePair | None, pace: float = 1.0
) -> FramePair:
    """Return the camera's rotation from one frame to the next.

    Args:
        last: The previous step, whose rotation continues if no background can be followed.
        pace: Duration of this step divided by that of the last.
    """
    pair_link = link(before, after)
    slid = None if pair_link is not None else _slid(before, after)
    if pair_link is None and slid is None:
        slid = np.zeros(2) if last is None else pace * (last.after - last.before).mean(axis=0)
        return FramePair(_GRID, _GRID + slid, assumed=True)
    return FramePair(_GRID, _GRID + slid) if pair_link is None else pair_link


_GRID: Final = np.stack(np.meshgrid([-0.3, 0.3], [-0.2, 0.2]), axis=-1).reshape(-1, 2)


def _slid(before: Background, after: Background) -> Float64 | None:
    """Return the shift of the shading, (2,), or None if no shift fits well.

    The shift is a fraction of the picture's longer side. It maximises the correlation over the
    pixels visible in both frames (D. Padfield, Masked object registration in the Fourier domain,
    IEEE TIP 2012, eq. 20).
    """
    rows, columns = before.shading.shape
    size = 2 * rows, 2 * columns

    def shift(one: Float32 | Bools, other: Float32 | Bools) -> Float64:
        first, second = np.fft.rfft2(one, size), np.fft.rfft2(other, size)
        return np.asarray(np.fft.irfft2(np.conj(first) * second, size))

    masks = before.mask, after.mask
    light = [
        shade * mask for shade, mask in zip((before.shading, after.shading), masks, strict=True)
    ]
    count = np.maximum(shift(*masks), 1.0)
    sums = shift(light[0], masks[1]), shift(masks[0], light[1])
    spread = [
        np.maximum(shift(light[0] ** 2, masks[1]) - sums[0] ** 2 / count, 1e-3),
        np.maximum(shift(masks[0], light[1] ** 2) - sums[1] ** 2 / count, 1e-3),
    ]
    score = (shift(*light) - sums[0] * sums[1] / count) / np.sqrt(spread[0] * spread[1])
    score[count < _OVERLAP * rows * columns] = -1.0
    score = np.fft.fftshift(score)
    across, down = round(_ROOM * columns), round(_ROOM * rows)
    near = score[rows - down : rows + down + 1, columns - across : columns + across + 1]
    y, x = np.unravel_index(int(near.argmax()), near.shape)
    if near[y, x] < _SURE:
        return None
    place = x + _between(near[y], int(x)) - across, y + _between(near[:, x], int(y)) - down
    return np.asarray(np.array(place) / max(rows, columns), np.float64)


def _between(scores: Float64, best: int) -> float:
    """Return how far the peak of the parabola through three scores is from the middle score."""
    if not 0 < best < len(scores) - 1:
        return 0.0
    low, top, high = (float(one) for one in scores[best - 1 : best + 2])
    return 0.5 * (low - high) / min(low - 2 * top + high, -1e-9)


def find_headings(
    frames: Sequence[Background], steps: Sequence[FramePair], focal: float | None = None
) -> Headings:
    """Return the azimuth of the lens in each frame.

    Args:
        steps: Results of `step`, from each frame to the next.
        focal: Focal length divided by the picture's longer side, or None if unknown.
    """
    lens = focal or USUAL_FOCAL
    chain = _chain(steps, lens)
    ends = _returns(frames, chain)
    if ends and focal is None:
        lens = _closing_focal(steps, ends)
        chain = _chain(steps, lens)
    error = _without_drift(chain, ends, lens) if ends else 0.0
    level = _upright(chain) @ chain
    # Directions towards the sitter, in the camera's axes.
    ahead = np.array([[one.face[0] / lens if one.face else 0.0, 0.0, 1.0] for one in frames])
    toward = np.einsum("nij,nj->ni", level, ahead)
    turns = _smooth(np.degrees(np.unwrap(np.arctan2(toward[:, 0], toward[:, 2]))))
    first = sphere.from_vector(np.array([0.0, -math.radians(turns[0]), 0.0]))
    assumed_share = sum(one.assumed for one in steps) / max(len(steps), 1)
    return Headings(turns - turns[0], first @ level, lens, bool(ends), error, assumed_share)


def _smooth(turns: Float64) -> Float64:
    """Fit a line to each value and its neighbours, and return the smoothed values."""
    near = [slice(max(k - _SMOOTH, 0), k + _SMOOTH + 1) for k in range(len(turns))]
    numbers = np.arange(len(turns))
    lines = [
        np.polyfit(numbers[n] - k, turns[n], min(len(turns[n]) - 1, 1)) for k, n in enumerate(near)
    ]
    return np.array([line[-1] for line in lines])


def _chain(steps: Sequence[FramePair], focal: float) -> Float64:
    """Return the rotations, (n, 3, 3), from each frame's axes to those of the first frame."""
    chain = [np.eye(3)]
    for one in steps:
        chain.append(chain[-1] @ one.rotation(focal).T)
    return np.stack(chain)


def _axis(chain: Float64) -> Float64:
    """Return the downward direction, (3,), in the first camera's axes: the axis of a long turn."""
    steps = np.array([_vector(*pair) for pair in itertools.pairwise(chain)]).reshape(-1, 3)
    axis = (np.sign(steps[:, 1:2]) * steps).sum(axis=0)
    if math.degrees(float(np.linalg.norm(axis))) < _UPRIGHT_DEG:
        axis = chain[:, :, 1].mean(axis=0)
    return np.asarray(axis / max(float(np.linalg.norm(axis)), 1e-12))


def _vector(before: Float64, after: Float64) -> Float64:
    """Return the rotation vector, in radians, from one camera to another in the chain's axes."""
    return sphere.to_vector(after @ before.T)


def _walk(chain: Float64) -> Float64:
    """Return the clockwise turn of the chain at each frame, in unwrapped degrees."""
    axis = _axis(chain)
    steps = [math.degrees(float(_vector(*pair) @ axis)) for pair in itertools.pairwise(chain)]
    return np.concatenate([[0.0], np.cumsum(steps)])


def _returns(frames: Sequence[Background], chain: Float64) -> dict[tuple[int, int], FramePair]:
    """Return matches between early frames and late ones that show the same view after a turn."""
    walk = _walk(chain)
    links: dict[tuple[int, int], FramePair] = {}
    early = np.unique(np.linspace(0, len(frames) // 3, _LOOKS_BACK).astype(int))
    for one in early.tolist():
        distance = np.abs(walk - walk[one])
        late = np.flatnonzero((distance > _RETURN_DEG[0]) & (distance < _RETURN_DEG[1]))
        candidates = [
            (link(frames[one], frames[other]), other) for other in late[late > one].tolist()
        ]
        sure = [(len(each.before), other, each) for each, other in candidates if each is not None]
        if sure:
            count, other, best = max(sure, key=lambda each: each[0])
            if count >= _LEAST_RETURN:
                links[one, other] = best
    return links


def _closing_focal(steps: Sequence[FramePair], ends: Mapping[tuple[int, int], FramePair]) -> float:
    """Return the focal length at which the chain between matching ends is a full turn."""
    low, high = _FOCALS
    for _ in range(14):
        middle = math.sqrt(low * high)
        chain = _chain(steps, middle)
        walk, axis = _walk(chain), _axis(chain)
        excess = []
        for (before, after), pair_link in ends.items():
            end_pose = chain[before] @ pair_link.rotation(middle).T
            beside = math.degrees(float(_vector(chain[before], end_pose) @ axis))
            way = walk[after] - walk[before]
            excess.append(abs(way) - np.sign(way) * beside - 360.0)
        # A longer lens makes each step smaller.
        low, high = (middle, high) if np.median(excess) > 0 else (low, middle)
    return math.sqrt(low * high)


def _without_drift(
    chain: Float64, ends: Mapping[tuple[int, int], FramePair], focal: float
) -> float:
    """Rotate the chain evenly until its ends meet, and return the original gap in degrees."""
    drifts = []
    for (before, after), pair_link in ends.items():
        end_pose = chain[before] @ pair_link.rotation(focal).T
        drifts.append(_vector(chain[after], end_pose) / max(after - before, 1))
    drift = np.median(drifts, axis=0)
    for number in range(len(chain)):
        chain[number] = sphere.from_vector(drift * number) @ chain[number]
    span = max(after - before for before, after in ends)
    return math.degrees(float(np.linalg.norm(drift)) * span)


def _upright(chain: Float64) -> Float64:
    """Return the rotation from the chain's axes to those of a level camera, (3, 3)."""
    down = _axis(chain)
    front = np.array([0.0, 0.0, 1.0]) - down[2] * down
    front /= np.linalg.norm(front)
    return np.stack([np.cross(down, front), down, front])
