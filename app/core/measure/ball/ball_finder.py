"""Find and measure a mirror ball in a picture.

Seen in perspective, a sphere fills a cone of rays. Its outline is the outermost of many edges,
beyond which the background is smooth, since a mirror compresses the scene behind it into rings
along its rim. A coarse-to-fine search finds the cone with the most such edges (as Daugman finds an
iris, "High confidence visual recognition of persons", PAMI 1993). The reflection inside the outline
proves that the sphere is a mirror: it contains all directions, so its contrast is high, and it is
compressed along the radius by 1 - r^2 at radius r.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Self

import cv2
import numpy as np

from app.core.base.arrays import Bools, Bytes, Float32, Float64, Floats
from app.core.base.colour import luminance, srgb_encode, srgb_light, to_bytes
from app.core.base.errors import ProbeError
from app.core.measure.read.resampling import log_light
from app.core.text import tr

_USUAL_MM: Final = 50.0  # first guess of the focal length on 24 x 36 mm, if none is stated
_DIAGONAL_MM: Final = math.hypot(24.0, 36.0)
_ANGLES: Final = 180  # positions around the outline
_TURN: Final = np.arange(_ANGLES) * (2.0 * math.pi / _ANGLES)
_WAYS: Final = np.stack([np.cos(_TURN), np.sin(_TURN)], axis=1)
_LOOKED_AT: Final = 1000  # pixels on the longer side, for circles of any size
_HOUGH: Final = (200.0, 0.6)  # strength and roundness of edges
_LEAST_PX: Final = 14  # minimum radius at that size
_BLURS: Final = ((1.0, 2.0), (1.5, 3.0))  # for logarithmic light, and for a developed picture
_MOST_CANDIDATES: Final = 10
_ALIKE: Final = 0.1  # fraction of the radius; circles this similar are checked once
# Fractions of the radius: search ranges for the outline.
_LEVELS: Final = (0.25, 0.06, 0.015, 0.006)
_FINE_LEVELS: Final = (0.02, 0.006, 0.002)
_STEPS: Final = 10
_EDGE: Final = 3.0  # ratio to the surroundings at which an edge counts half
_OUTSIDE: Final = 0.12  # width of these surroundings, as a fraction of the radius
_OUTSIDE_PX: Final = 7.0  # the same in pixels, for measuring a ball after detection
_LEAST_EDGES: Final = 0.42  # minimum before the fine search for the outline
_LEAST_RADIUS_PX: Final = 30.0
_LEAST_STOPS: Final = 0.65
_LEAST_RISE: Final = 1.4  # minimum compression of the rim relative to the middle, in stops
# Minimum visible fraction of the outline plus half the compression of the worst sectors.
_LEAST_BALL: Final = 1.3
_CLEAR: Final = (0.7, 1.6)  # outline and rise at which some sectors need no compression


@dataclass(frozen=True, slots=True)
class Ball:
    """A ball in a picture, described as a cone of rays.

    Attributes:
        axis: (3,) float64. Unit vector to the ball's centre in the camera's coordinate system,
            whose axes point right, up and forward.
        angle: Half the opening angle of the cone, in radians.
        focal: Focal length, in pixels of a picture of this `shape`.
        shape: Rows and columns of the picture, whose centre is on the camera's axis.
        edges: Visible fraction of the outline, 0 to 1.
    """

    axis: Float64 = field(repr=False)
    angle: float
    focal: float
    shape: tuple[int, int]
    edges: float = 0.0

    @classmethod
    def at(cls, x: float, y: float, radius: float, focal: float, shape: tuple[int, int]) -> Self:
        """Return the ball with a round outline whose column, row and radius are given in pixels."""
        axis = np.array([x - shape[1] / 2.0, shape[0] / 2.0 - y, focal]) / focal
        far = float(np.linalg.norm(axis))
        return cls(axis / far, math.atan(radius / focal / far), focal, shape)

    @property
    def radius_px(self) -> float:
        """The approximate radius of the ball, in pixels."""
        return self.focal * math.tan(self.angle) / float(self.axis[2])

    @property
    def across(self) -> Float64:
        """Two unit vectors perpendicular to the axis, (2, 3): the camera's right and up."""
        right = np.cross((0.0, 1.0, 0.0), self.axis)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(self.axis, right)])

    def seen_by(self, mm: float) -> Self:
        """Return the same outline for another focal length, given as a 35 mm equivalent in mm."""
        (x,), (y,) = (each.tolist() for each in self.project(self.axis[None]))
        focal = focal_px(mm, self.shape)
        return self.at(x + 0.5, y + 0.5, self.radius_px, focal, self.shape)

    def resized(self, shape: tuple[int, int]) -> Ball:
        """Return the same ball in a picture that has been resized to `shape`."""
        return replace(self, focal=self.focal * max(shape) / max(self.shape), shape=shape)

    def moved(self, right: float, up: float, larger: float) -> Ball:
        """Return the ball, moved and enlarged by the given fractions of its radius."""
        spread = math.tan(self.angle)
        axis = self.axis + spread * (np.array([right, up]) @ self.across)
        angle = math.atan(spread * (1.0 + larger))
        return replace(self, axis=axis / np.linalg.norm(axis), angle=angle)

    def project(self, rays: Float64) -> tuple[Float32, Float32]:
        """Project rays, (..., 3) in camera coordinates, to columns and rows.

        Whole numbers are pixel centres.
        """
        scale = self.focal / np.maximum(rays[..., 2], 1e-6)
        x = rays[..., 0] * scale + (self.shape[1] - 1) / 2.0
        y = (self.shape[0] - 1) / 2.0 - rays[..., 1] * scale
        return x.astype(np.float32), y.astype(np.float32)

    def around(self, picture: Float32, shares: Floats) -> Float32:
        """Sample a picture around the ball, (angles, shares), at fractions of the ball's radius."""
        out = math.tan(self.angle) * (_WAYS @ self.across)
        x, y = self.project(self.axis + shares[:, None] * out[:, None])
        border = cv2.BORDER_REPLICATE
        return np.asarray(cv2.remap(picture, x, y, cv2.INTER_LINEAR, borderMode=border), np.float32)


def focal_px(mm: float, shape: tuple[int, int]) -> float:
    """Convert a 35 mm equivalent focal length to pixels of a picture, matching the diagonals."""
    return mm * math.hypot(*shape) / _DIAGONAL_MM


def fused(pictures: Sequence[Bytes], stops: Sequence[float]) -> Float32:
    """Return the approximate luminance, (h, w), of small encoded frames, for use in detection."""
    total = weights = np.float32(0.0)
    for picture, stop in zip(pictures, stops, strict=True):
        # Only the darkest frame has information where all others clip.
        trust = np.clip(250.0 - picture.max(axis=-1), 1e-4, 60.0).astype(np.float32)
        total = total + trust * luminance(srgb_light(picture))
        weights = weights + trust * np.float32(2.0 ** (stop - stops[0]))
    return np.asarray(total / weights, np.float32)


def find_ball(light: Float32, focal_mm: float | None = None) -> Ball:
    """Find the only mirror ball in a picture's luminance, (h, w).

    Args:
        focal_mm: Focal length as a 35 mm equivalent in mm, or None if unknown.

    Raises:
        ProbeError: If there is no ball, or more than one.
    """
    focal = focal_px(focal_mm or _USUAL_MM, light.shape)
    root, tones = np.sqrt(light), log_light(light)
    noise = 4e-4 * float(np.subtract(*np.percentile(tones, (99.0, 1.0))))
    balls: list[Ball] = []
    for x, y, radius in _circles(light):
        ball = _refine(Ball.at(x, y, radius, focal, light.shape), root, _LEVELS, _OUTSIDE)
        if _mirrors(ball, tones, noise):
            balls.append(ball)
    balls.sort(key=lambda each: -each.angle)
    apart = [
        ball
        for number, ball in enumerate(balls)
        if all(ball.axis @ larger.axis <= math.cos(larger.angle) for larger in balls[:number])
    ]
    if not apart:
        raise ProbeError(
            tr("No mirror ball was found in these pictures, or too little of it is visible."),
            tr(
                "Photograph the whole ball in focus, filling at least a tenth of the picture, "
                "against a distant background."
            ),
        )
    if len(apart) > 1:
        raise ProbeError(
            tr("There are {count} mirror balls in these pictures.", count=len(apart)),
            tr("Leave only one, at the position of the sitter’s head, and photograph it alone."),
        )
    return apart[0]


def refined(ball: Ball, radiance: Float32) -> Ball:
    """Refine a ball that was found in a thumbnail, using the merged light, (H, W, 3)."""
    ball = ball.resized((radiance.shape[0], radiance.shape[1]))
    outside = min(_OUTSIDE, _OUTSIDE_PX / ball.radius_px)
    return _refine(ball, luminance(radiance), _FINE_LEVELS, outside)


def _circles(light: Float32) -> list[tuple[float, float, float]]:
    """Return approximate circular outlines, each as a column, a row and a radius in pixels."""
    share = min(1.0, _LOOKED_AT / max(light.shape))
    size = (round(light.shape[1] * share), round(light.shape[0] * share))
    small = np.asarray(cv2.resize(light, size, interpolation=cv2.INTER_AREA), np.float32)
    tones = log_light(small)
    low, high = np.percentile(tones, (1.0, 99.0))
    looks = (
        (tones - low) / max(high - low, 1e-3),
        srgb_encode(small / max(float(np.percentile(small, 90.0)), 1e-9)),
    )
    circles: list[tuple[float, float, float]] = []
    for look, blur in [(a, b) for a, some in zip(looks, _BLURS, strict=True) for b in some]:
        votes = cv2.HoughCircles(
            cv2.GaussianBlur(to_bytes(look), (0, 0), blur),
            cv2.HOUGH_GRADIENT_ALT,
            1.5,
            _LEAST_PX,
            param1=_HOUGH[0],
            param2=_HOUGH[1],
            minRadius=_LEAST_PX,
            maxRadius=min(size) // 2,
        )
        for x, y, r in [] if votes is None else votes[0, :_MOST_CANDIDATES, :3].tolist():
            if all(max(math.hypot(x - a, y - b), abs(r - c)) > _ALIKE * r for a, b, c in circles):
                circles.append((x, y, r))
    scale = max(light.shape) / max(size)
    return [((x + 0.5) * scale, (y + 0.5) * scale, r * scale) for x, y, r in circles]


def _refine(ball: Ball, root: Float32, levels: Sequence[float], outside: float) -> Ball:
    """Move a ball, coarse to fine, until most of its outline consists of outermost edges."""
    grid = np.arange(-_STEPS, _STEPS + 1)
    moves = np.stack(np.meshgrid(grid, grid, indexing="ij"), axis=-1).reshape(-1, 2)
    shift = np.rint(2.0 * (moves @ _WAYS.T)).astype(int)
    middle = 2 * (3 * _STEPS + 2)
    places = shift + np.arange(_ANGLES) * (2 * middle + 1) + middle
    for reach in levels:
        step = reach / _STEPS
        edges, ridges = _outermost(ball, root, step, middle, outside)
        scores = np.stack([ridges.take(places + 2 * size).mean(axis=1) for size in grid])
        size, place = np.unravel_index(int(scores.argmax()), scores.shape)
        contrast = float(edges.take(places[place] + 2 * grid[size]).mean())
        right, up = moves[place] * step
        ball = replace(ball.moved(right, up, grid[size] * step), edges=contrast)
        if contrast < _LEAST_EDGES:
            break
    return ball


def _outermost(
    ball: Ball, root: Float32, step: float, middle: int, outside: float
) -> tuple[Float32, Float32]:
    """Return how clearly each position is on an outermost edge, from 0 to 1.

    An edge is outermost if no equally strong edge lies outside it. The positions are half a step
    apart, in fractions of the radius, with the outline in the middle.

    Returns:
        Two arrays, (angles, 2 middle + 1) float32 each. The second is large only on ridges: in
        front of a flat background, the foot of an edge has no stronger edge outside it either.
    """
    blur = max(0.6 * step * ball.radius_px, 0.5)
    gap = max(round(4.0 * blur / ball.radius_px / step), 1)
    wide = round(2.0 * max(outside / step, 6.0))
    shares = 1.0 + (np.arange(2 * middle + 1 + gap + wide) - middle) * (0.5 * step)
    x, y = (int(each) for each in ball.project(ball.axis))
    far = int(1.2 * shares[-1] * ball.radius_px + 4.0 * blur) + 2
    box = slice(max(y - far, 0), y + far), slice(max(x - far, 0), x + far)
    soft = np.empty_like(root)  # only the box is used
    soft[box] = cv2.GaussianBlur(root[box], (0, 0), blur)
    slopes = np.abs(np.gradient(ball.around(soft, shares), axis=1))
    sums = np.cumsum(slopes, axis=1)
    count = 2 * middle + 1
    beyond = (sums[:, gap + wide :][:, :count] - sums[:, gap:][:, :count]) / wide
    peaks = np.asarray(cv2.dilate(slopes, np.ones((1, gap | 1), np.uint8)))[:, :count]
    slopes = slopes[:, :count]
    edges = slopes / (slopes + _EDGE * beyond + np.float32(1e-9))
    return edges, edges * slopes / (peaks + np.float32(1e-9))


def _mirrors(ball: Ball, tones: Float32, noise: float) -> bool:
    """Return whether a ball has a visible outline and a picture compressed towards the rim."""
    radius = ball.radius_px
    if ball.edges < _LEAST_EDGES or radius < _LEAST_RADIUS_PX:
        return False
    shares = np.arange(int(0.2 * radius), int(1.94 * radius)) / (2.0 * radius)
    band = ball.around(tones, shares)
    if float(band.std()) < _LEAST_STOPS:
        return False
    along = 2.0 * np.abs(np.gradient(band, axis=1))
    step = 2.0 * (2.0 * math.pi / _ANGLES) * shares * radius
    around = np.abs(np.roll(band, -1, axis=0) - np.roll(band, 1, axis=0)) / step

    def squeezed(part: Bools) -> Float64:
        """Return the stops by which light changes faster radially than tangentially, per sector."""
        one, two = (each[:, part].reshape(12, -1).mean(axis=1) for each in (along, around))
        return np.asarray(np.log2((one + noise) / (two + noise)), np.float64)

    rim = float(np.percentile(squeezed(shares >= 0.85), 10.0))
    rise = float(squeezed(shares >= 0.9).mean() - squeezed(shares < 0.6).mean())
    clear = ball.edges > _CLEAR[0] and rise > _CLEAR[1]
    return clear or (ball.edges + 0.5 * rim > _LEAST_BALL and rise > _LEAST_RISE)
