"""Detect the two fisheye circles in unstitched 360 pictures.

A full 2:1 panorama and an unstitched picture have the same size, and merging an unstitched picture
as a panorama gives a completely wrong result. An unstitched picture is recognised by two circles of
equal size, with darkness all around them, in every frame of a bracket, regardless of brightness.
The first row of a panorama is a single point in the sky, so it cannot be dark at the corners and in
the middle but bright in between.

A fisheye maps the angle t from its axis to a distance from the circle's centre, r = f (t + b3 t^3 +
b5 t^5 ...), and is equidistant without the distortion terms. `MODELS` contains the cameras for
which makers or users have published data. By default, a model is assumed to be equidistant, 200
degrees wide and upright in the file, and it is calibrated from the frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, TypeAlias

import cv2
import numpy as np

from app.core.base.arrays import Bools, Bytes, Float32, Float64, Indices
from app.core.base.colour import srgb_decode, srgb_encode
from app.core.base.errors import EnvironmentFileError, ProbeError
from app.core.base.phrases import listed
from app.core.measure.bracket.contradiction import worst
from app.core.text import tr


@dataclass(frozen=True, slots=True)
class FisheyeLens:
    """One fisheye lens.

    Attributes:
        centre: Centre of the circle, (x, y) in pixels, where whole numbers are pixel centres.
        focal: Focal length, in pixels per radian on the axis.
        axes: (3, 3) float64. The right, up and forward vectors of the lens's picture as rows, in
            the panorama's coordinate system (see `app.core.base.sphere`).
        bends: Distortion terms b3, b5, ...
    """

    centre: tuple[float, float]
    focal: float
    axes: Float64 = field(repr=False)
    bends: tuple[float, ...] = ()

    def radius(self, angles: Float64) -> Float64:
        """Return the distances from the centre, in pixels, for angles from the axis, in radians."""
        return self.focal * bent(angles, self.bends)

    def project(self, vectors: Float32) -> tuple[Float32, Float32, Float32]:
        """Return columns and rows in pixels, and angles in radians, for directions, (..., 3)."""
        local = vectors @ self.axes.T.astype(vectors.dtype)
        across = np.hypot(local[..., 0], local[..., 1])
        angle = np.arctan2(across, local[..., 2])
        scale = self.radius(angle) / np.maximum(across, 1e-12)
        x, y = self.centre[0] + scale * local[..., 0], self.centre[1] - scale * local[..., 1]
        return np.asarray(x, np.float32), np.asarray(y, np.float32), angle


def bent(angles: Float64, bends: tuple[float, ...]) -> Float64:
    """Return t + b3 t^3 + b5 t^5 ... for angles t in radians."""
    square, factor = angles * angles, np.zeros_like(angles)
    for bend in reversed(bends):
        factor = (factor + bend) * square
    return angles * (1.0 + factor)


@dataclass(frozen=True, slots=True)
class FisheyeModel:
    """The default lens data for a camera model.

    Attributes:
        field_deg: Angle that the image circle spans, in degrees. It is not used if `focal` is
            known.
        focal: Focal length divided by the side of one half of the picture, which contains one
            circle.
        turns_deg: Clockwise rotation of each of the two stored circles, in degrees, or None if
            unknown.
        front: Index of the circle that faces forward, which is the left or upper one by default.
    """

    names: tuple[str, ...]
    field_deg: float = 200.0
    focal: float | None = None
    bends: tuple[float, ...] = ()
    turns_deg: tuple[float, float] | None = None
    front: int = 0


# Theta: Ricoh's design tables (theta-api-specs, "THETA Lens Spec"), fitted to 0.16 degrees or
# better. The size of an unstitched picture from the X is assumed. Insta360: the curve of an X3's
# lenses that a user calibrated (hilti-trimble-slam-challenge-2026, issue 29), fitted to 0.03
# degrees. The circles are rotated by 90 degrees in opposite directions, with the front lens on the
# right, as in streams from the X2, X3 and X5 (ai4ce/insta360_ros_driver) and, according to users,
# in files from the X2 (rekliner/insta360x2toMP4). The X4 and the ONE series are assumed to be the
# same. Samsung: 195 degrees according to the data sheet. All other fields are assumed.
MODELS: Final = (
    FisheyeModel(("THETA X", "THETA A1"), focal=0.3132, bends=(0.05478, -0.03131, 0.00153)),
    FisheyeModel(("THETA Z1",), focal=0.3000, bends=(0.17716, -0.16902, 0.05716, -0.00735)),
    FisheyeModel(
        ("THETA V", "THETA S", "THETA SC", "THETA SC2"),
        focal=0.2925,
        bends=(-0.01312, 0.00638, -0.00379),
    ),
    FisheyeModel(
        ("INSTA360",),
        bends=(0.08037, -0.00465, -0.00617, 0.00054),
        turns_deg=(270.0, 90.0),
        front=1,
    ),
    FisheyeModel(("OSMO 360",)),
    FisheyeModel(("SM-C200", "SM-R210", "GEAR 360"), field_deg=195.0),
)

_UNKNOWN: Final = FisheyeModel(())


def model_of(camera: str) -> FisheyeModel:
    """Return the lens data for the camera model recorded in a file."""
    name = camera.upper()
    matches = (model for model in MODELS if any(part in name for part in model.names))
    return next(matches, _UNKNOWN)


_ASPECT: Final = (1.3, 2.6)  # ratio of the sides of the area with both circles
_WIDEST: Final = 2.6  # maximum ratio of a picture's sides
_LOOKED_AT: Final = 672  # columns of the small copy in which circles are searched for
_BRIGHTEST: Final = 1e6
_WHITE, _BRIGHTER = 0.85, 8.0  # fraction of unclipped pixels; gain of the second exposure
_CONTENT: Final = 0.02  # lit fraction at and above which a row or column counts as content
_ANGLES: Final = 240
# Range of the rims, out to the far corners, as fractions of half the side of one half.
_REACH: Final = (0.55, 1.42)
# Range of the radii, down to cut-off circles, as fractions of half the side of one half.
_RADII: Final = (0.72, 1.17)
_CORNER: Final = 1.2
_DARKEST: Final = 48  # maximum code of stray light around a circle
_STEP: Final = 10  # minimum difference in codes from there to the lowest code inside
_ON_RIM: Final = 0.015  # fraction of the radius within which a point is on the rim
_LEAST_SHARE: Final = 0.3  # minimum fraction of the angles at which the rim must be visible
# Minimum number, out of eight, of sectors in which the rim must be visible.
_LEAST_SECTORS: Final = 5
_MOST_OUTSIDE: Final = 0.004  # maximum fraction of the pixels outside that may be bright
_MOST_APART: Final = 0.04  # maximum difference as a fraction of the circles' radii
_LEAST_PIXELS: Final = 32  # minimum length of a box's shorter side in pixels
_AROUND: Final = 1.05  # radii
_PICTURE: Final = 0.02  # minimum linear light; darker areas may be anything


@dataclass(frozen=True, slots=True)
class Circles:
    """The positions of the two image circles, as fractions of the picture's shorter side.

    Attributes:
        centres: Centres (x, y) from the picture's upper left corner, measured to pixel corners. The
            first circle is the left one, or the upper one if the circles are stacked.
    """

    centres: tuple[tuple[float, float], tuple[float, float]]
    radius: float
    stacked: bool
    strength: float

    @property
    def names(self) -> tuple[str, str]:
        """The names of the two circles."""
        return ("upper", "lower") if self.stacked else ("left", "right")


def recognise(frames: Sequence[Bytes], names: Sequence[str]) -> Circles | None:
    """Return the circles in a bracket's small encoded frames, or None if they are stitched.

    Raises:
        ProbeError: If some frames are unstitched and others are not.
    """
    all_circles = [find_circles(frame) for frame in frames]
    clear = [circles for circles in all_circles if circles is not None]
    if not clear:
        return None
    best = max(clear, key=lambda circles: circles.strength)
    odd = [
        names[k] for k, one in enumerate(all_circles) if one is None and _filled(frames[k], best)
    ]
    if odd:
        circled = [names[k] for k, one in enumerate(all_circles) if one is not None]
        raise ProbeError(
            tr(
                "Some frames show unstitched fisheye circles: {circled}. Others do not: {odd}.",
                circled=listed(circled),
                odd=listed(odd),
            ),
            tr("Leave out one kind, or shoot again with either all frames stitched or none."),
        )
    return best


def may_be_circles(shape: tuple[int, int]) -> bool:
    """Return whether a picture has the proportions of two fisheye circles."""
    return max(shape) / min(shape) <= _WIDEST


def find_circles(frame: Bytes) -> Circles | None:
    """Return the two image circles in a frame, (h, w, 3) uint8, or None if there are none.

    The circles may be side by side or stacked, anywhere in a frame of any proportions up to 2.6:1,
    and whole or slightly cut off. The result is also None if the frame is too dark to show enough
    of the rim.
    """
    if not may_be_circles(frame.shape[:2]):
        return None
    bright = np.asarray(cv2.GaussianBlur(worst(frame), (3, 3), 0), np.uint8)
    for box in _boxes(bright):
        for stacked in _layouts(box):
            circles = _in_box(bright, box, stacked)
            if circles is not None and _fits(frame, circles):
                return circles
    return None


def check_stitched(radiance: Float32, name: str) -> None:
    """Check that linear light, (h, w, 3), does not show two fisheye circles instead of a panorama.

    Raises:
        EnvironmentFileError: If the light shows two fisheye circles.
    """
    shape = (_LOOKED_AT, max(round(_LOOKED_AT * radiance.shape[0] / radiance.shape[1]), 1))
    small = cv2.resize(np.minimum(radiance, _BRIGHTEST), shape, interpolation=cv2.INTER_AREA)
    white = float(np.quantile(small.max(axis=-1), _WHITE))
    if white <= 0.0:
        return
    for scale in (1.0 / white, _BRIGHTER / white):
        codes = np.rint(255.0 * srgb_encode(np.clip(small * scale, 0.0, 1.0))).astype(np.uint8)
        if find_circles(codes) is not None:
            raise unstitched(name)


def unstitched(name: str) -> EnvironmentFileError:
    """Return the error for a file that shows two circles instead of a panorama."""
    return EnvironmentFileError(
        tr("{name} shows two fisheye circles instead of a stitched panorama.", name=name),
        tr("Merge its bracket with Turnlight, or stitch it with the camera maker’s software."),
    )


_Box: TypeAlias = tuple[int, int, int, int]  # left, top, right, bottom; in pixels


def _boxes(bright: Bytes) -> list[_Box]:
    """Return the box of the whole picture and, if smaller, that of the part that is not dark."""
    height, width = bright.shape
    whole = (0, 0, width, height)
    bright_mask = bright > min(float(np.quantile(bright, 0.02)), _DARKEST) + 2 * _STEP
    rows = np.flatnonzero(bright_mask.mean(axis=1) > _CONTENT)
    columns = np.flatnonzero(bright_mask.mean(axis=0) > _CONTENT)
    if not rows.size or not columns.size:
        return [whole]
    box = (int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1)
    return [whole] if box == whole else [whole, box]


def _layouts(box: _Box) -> list[bool]:
    """Return the arrangements that a box may contain: False for side by side, True for stacked."""
    ratio = (box[2] - box[0]) / max(box[3] - box[1], 1)
    fits = (_ASPECT[0] <= ratio <= _ASPECT[1], _ASPECT[0] <= 1.0 / max(ratio, 1e-9) <= _ASPECT[1])
    return [stacked for stacked, one in zip((False, True), fits, strict=True) if one]


def _in_box(bright: Bytes, box: _Box, stacked: bool) -> Circles | None:
    """Fit a circle to each half of a box."""
    left, top, right, bottom = box
    part = bright[top:bottom, left:right]
    halves = np.array_split(part, 2, axis=0 if stacked else 1)
    if min(part.shape) < _LEAST_PIXELS:
        return None
    first = _rim(np.ascontiguousarray(halves[0]))
    second = None if first is None else _rim(np.ascontiguousarray(halves[1]))
    if first is None or second is None:
        return None
    if abs(first.radius / second.radius - 1.0) > _MOST_APART:
        return None
    side = min(bright.shape)
    shift = halves[0].shape[0 if stacked else 1]
    x, y = left + 0.5, top + 0.5
    return Circles(
        centres=(
            ((first.x + x) / side, (first.y + y) / side),
            (
                (second.x + x + (0 if stacked else shift)) / side,
                (second.y + y + (shift if stacked else 0)) / side,
            ),
        ),
        radius=(first.radius + second.radius) / 2.0 / side,
        stacked=stacked,
        strength=first.share + second.share,
    )


@dataclass(frozen=True, slots=True)
class _Rim:
    """A circle in one half of a picture, in pixels of that half.

    Attributes:
        share: Fraction of the angles at which the rim is visible, 0 to 1.
    """

    x: float
    y: float
    radius: float
    share: float


def _rim(half: Bytes) -> _Rim | None:
    """Fit the circle outside which one half of a picture is dark."""
    height, width = half.shape
    size, centre = min(height, width) / 2.0, ((width - 1) / 2.0, (height - 1) / 2.0)
    angles: Float64 = np.arange(_ANGLES, dtype=np.float64) * (2.0 * math.pi / _ANGLES)
    radii = np.arange(_REACH[0] * size, _REACH[1] * size, 0.5, dtype=np.float64)
    x = centre[0] + radii * np.cos(angles)[:, None]
    y = centre[1] + radii * np.sin(angles)[:, None]
    inside = (x >= 0) & (y >= 0) & (x <= width - 1) & (y <= height - 1)
    maps = x.astype(np.float32), y.astype(np.float32)
    codes = np.asarray(cv2.remap(half, *maps, cv2.INTER_LINEAR), np.uint8)
    far = inside & (radii > _CORNER * size)
    if not far.any():
        return None
    dark = float(np.quantile(codes[far], 0.98))
    if dark > _DARKEST:
        return None
    limit = dark + _STEP
    above = inside & (codes > limit)
    last = above.shape[1] - 1 - np.argmax(above[:, ::-1], axis=1)
    border = inside.sum(axis=1) - 1
    # At the picture's border, the position of the rim is unknown.
    usable = above.any(axis=1) & (last < border - 1)
    distance = _crossings(codes, last, limit, radii)
    points = np.stack(
        [centre[0] + distance * np.cos(angles), centre[1] + distance * np.sin(angles)], axis=1
    )
    return _fitted(points.astype(np.float64), usable, angles, size, centre)


def _crossings(codes: Bytes, last: Indices, limit: float, radii: Float64) -> Float64:
    """Move the outermost bright point at each angle to where the brightness drops by half."""
    rows = np.arange(len(codes))
    back = codes[rows[:, None], np.clip(last[:, None] - np.arange(2, 10), 0, None)]
    half = np.maximum(np.median(back, axis=1) / 2.0, limit)
    rim = np.clip(last[:, None] - np.arange(-3, 10), 0, codes.shape[1] - 1)
    first = np.argmax(codes[rows[:, None], rim] >= half[:, None], axis=1)
    at = rim[rows, first]
    after = np.minimum(at + 1, codes.shape[1] - 1)
    step = np.maximum(codes[rows, at].astype(float) - codes[rows, after], 1.0)
    share = np.clip((codes[rows, at] - half) / step, 0.0, 1.0)
    return np.asarray(radii[at] + share * (radii[1] - radii[0]))


def _fitted(
    points: Float64,
    usable: Bools,
    angles: Float64,
    size: float,
    centre: tuple[float, float],
) -> _Rim | None:
    """Fit a circle to the outermost points, which dark content can only move inwards."""
    x, y = centre
    if usable.sum() < _LEAST_SHARE * _ANGLES:
        return None
    distance = np.hypot(points[:, 0] - x, points[:, 1] - y)
    radius = float(np.quantile(distance[usable], 0.8))
    on_rim = usable
    for width in (0.08, 0.05, 0.03, _ON_RIM, _ON_RIM, _ON_RIM):
        distance = np.hypot(points[:, 0] - x, points[:, 1] - y)
        on_rim = usable & (np.abs(distance / radius - 1.0) < width)
        if on_rim.sum() < _LEAST_SHARE * _ANGLES:
            return None
        matrix = np.column_stack([points[on_rim], np.ones(on_rim.sum())])
        right = (points[on_rim] ** 2).sum(axis=1)
        a, b, c = np.linalg.lstsq(matrix, right, rcond=None)[0]
        x, y = a / 2.0, b / 2.0
        radius = math.sqrt(max(c + x * x + y * y, 1.0))
    sectors = len(set((angles[on_rim] // (math.pi / 4.0)).astype(int).tolist()))
    off = math.hypot(x - centre[0], y - centre[1])
    if sectors < _LEAST_SECTORS or off > 0.1 * size:
        return None
    if not _RADII[0] * size <= radius <= _RADII[1] * size:
        return None
    # Most of the points with an edge must be on the rim, and almost none beyond it.
    beyond = usable & (
        np.hypot(points[:, 0] - x, points[:, 1] - y) > (1.0 + 2.0 * _ON_RIM) * radius
    )
    if beyond.sum() > 0.05 * usable.sum():
        return None
    return _Rim(float(x), float(y), float(radius), float(on_rim.mean()))


def _fits(frame: Bytes, circles: Circles) -> bool:
    """Return whether a frame is dark around the circles, however dark it is inside them."""
    codes = worst(frame)[_away(frame, circles) > _AROUND]
    if codes.size < 0.02 * frame.shape[0] * frame.shape[1]:
        return False
    limit = min(float(np.median(codes)) + 2 * _STEP, _DARKEST + _STEP)
    return bool(np.mean(codes > limit) < _MOST_OUTSIDE)


def _filled(frame: Bytes, circles: Circles) -> bool:
    """Return whether the area around the given circles has content rather than just stray light."""
    away, light = _away(frame, circles), srgb_decode(worst(frame) / 255.0)
    outside, inside = light[away > _AROUND], light[(away > 0.8) & (away < 0.97)]
    return float(np.quantile(outside, 0.9)) > _PICTURE and outside.mean() > 0.3 * inside.mean()


def _away(frame: Bytes, circles: Circles) -> Float64:
    """Return each pixel's distance from the nearer circle's centre, in radii."""
    side = min(frame.shape[:2])
    y, x = np.mgrid[: frame.shape[0], : frame.shape[1]]
    away = [
        np.hypot(x + 0.5 - centre[0] * side, y + 0.5 - centre[1] * side)
        for centre in circles.centres
    ]
    return np.asarray(np.minimum(*away) / (circles.radius * side))
