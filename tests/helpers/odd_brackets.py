"""Brackets as phones and hands make them, and how far a merge of them agrees with its frames.

A view of a known scene is seen through a hand that shakes, and each frame has a tone curve of its
own, as of a phone that brightens what it has exposed darker. The measures are those of the field
issue: spread within one code, and speckle.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.colour import luminance, srgb_encode

if TYPE_CHECKING:
    from collections.abc import Sequence

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]

MARGIN: Final = 40  # pixels around a frame that a hand can bring into it
WELL: Final = 12000.0
READ: Final = 0.0008
LOWEST, HIGHEST = 8, 247
FEWEST: Final = 100  # pixels of one code for a spread


@dataclass(frozen=True)
class Way:
    """How a bracket is shot."""

    stops: tuple[float, ...] = (1.0, 0.0, -1.0)
    steps: tuple[float, float] = (1.0, 1.0)
    """Least and largest step of the mid-tones that a tone curve leaves of a stated step of 1."""
    bend: float = 0.0
    """Strength of each frame's own contrast, drawn from -bend to bend."""
    local: float = 0.0
    """Exponent of the local tone mapping; 0 for none."""
    shake_px: float = 0.0
    shake_deg: float = 0.0
    walker: bool = False
    quality: int = 92
    seed: int = 1


@dataclass(frozen=True)
class Made:
    """Frames and the truth."""

    frames: list[Bytes] = field(repr=False)
    stops: tuple[float, ...]
    poses: list[Float64]
    """Of each frame: what takes its pixels to the truth's, (3, 3)."""
    truth: Float32 = field(repr=False)
    """With the margin; in units of what saturates stop 0."""
    still: NDArray[np.bool_] = field(repr=False)
    """Where nothing walks, of the truth's size."""

    def seen(self, frame: int) -> tuple[Float32, NDArray[np.bool_]]:
        """Truth, and where nothing moves, in one frame's geometry."""
        height, width = self.frames[frame].shape[:2]
        light = seen(self.truth, self.poses[frame], (height, width))
        still = seen(self.still.astype(np.float32), self.poses[frame], (height, width))
        return light, still > 0.999


def seen(picture: Float32, pose: Float64, shape: tuple[int, int]) -> Float32:
    """A picture as a frame of that pose sees it."""
    warped = cv2.warpPerspective(
        picture, pose, shape[::-1], flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    )
    return np.asarray(warped, np.float32)


def view(
    radiance: Float32, azimuth_deg: float, shape: tuple[int, int], *, fov_deg: float = 70.0
) -> Float32:
    """A perspective view of a panorama with a margin, and print on it as sharp as a lens is."""
    height, width = shape[0] + 2 * MARGIN, shape[1] + 2 * MARGIN
    focal = 0.5 * shape[1] / np.tan(np.radians(fov_deg) / 2.0)
    x = np.arange(width) - 0.5 * (width - 1)
    y = np.arange(height) - 0.5 * (height - 1)
    grid_x, grid_y = np.meshgrid(x, y)
    azimuth = np.arctan2(grid_x, focal) + np.radians(azimuth_deg)
    elevation = -np.arctan2(grid_y, np.hypot(grid_x, focal))
    rows, columns = radiance.shape[:2]
    place_x = ((azimuth / (2 * np.pi) + 0.5) * columns - 0.5) % columns
    place_y = (0.5 - elevation / np.pi) * rows - 0.5
    padded = np.concatenate([radiance, radiance[:, :8]], axis=1)
    light = cv2.remap(
        padded, place_x.astype(np.float32), place_y.astype(np.float32), cv2.INTER_LINEAR
    )
    # What is rendered has noise of its own, in colours that no camera sees.
    light = cv2.GaussianBlur(light, (0, 0), 3.0)
    return np.asarray(light * print_of((height, width))[..., None], np.float32)


def print_of(shape: tuple[int, int]) -> Float32:
    """Posters of text and grain: what is left of the light, (h, w)."""
    rng = np.random.default_rng(5)
    page = np.full(shape, 255, np.uint8)
    for _ in range(24):
        x, y = int(rng.integers(0, shape[1] - 160)), int(rng.integers(20, shape[0] - 20))
        ink = int(rng.uniform(40, 180))
        text = "".join(rng.choice(list("ABEHKLMNRSTXYZ acegkmnorsx"), 9))
        size = float(rng.uniform(0.4, 1.4))
        cv2.putText(page, text, (x, y), cv2.FONT_HERSHEY_SIMPLEX, size, ink, 2, cv2.LINE_AA)
    grain = cv2.GaussianBlur(rng.normal(0.0, 1.0, shape).astype(np.float32), (0, 0), 1.2)
    grain = grain * np.float32(0.04 / float(grain.std()))
    shade = cv2.GaussianBlur(page.astype(np.float32) / 255.0, (0, 0), 0.7)
    return np.asarray(shade * np.exp(grain), np.float32)


def make(light: Float32, way: Way, *, panorama: bool = False) -> Made:
    """Shoot a bracket of a view (with its margin), or of a panorama that stays in place."""
    rng = np.random.default_rng(way.seed)
    margin = 0 if panorama else MARGIN
    shape = (light.shape[0] - 2 * margin, light.shape[1] - 2 * margin)
    level = luminance(light)
    truth = light * np.float32(0.5 / max(float(np.quantile(level, 0.8)), 1e-9))
    middle = len(way.stops) // 2
    tone, still = _own_gains(way, rng), np.ones(light.shape[:2], bool)
    frames, poses = [], []
    for index, stop in enumerate(way.stops):
        pose = _pose(way, rng, shape, margin, index == middle)
        here = truth
        if way.walker:
            here = truth.copy()
            body = _body(truth.shape[:2], index / max(len(way.stops) - 1, 1))
            here[body] = (0.13, 0.05, 0.04)
            still &= ~body
        codes = _coded(seen(here, pose, shape), stop, tone[index], way, rng)
        frames.append(_jpeg(codes, way.quality))
        poses.append(pose)
    still = cv2.erode(still.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
    return Made(frames, way.stops, poses, np.asarray(truth, np.float32), still)


def _own_gains(way: Way, rng: np.random.Generator) -> Float64:
    """Stops by which each frame's curve lifts its dark half; the middle frame's are 0."""
    stated = -np.diff(way.stops)
    steps = stated * rng.uniform(*way.steps, stated.size)
    shown = np.concatenate([[0.0], -np.cumsum(steps)])
    lifted = shown - (np.asarray(way.stops) - way.stops[0])
    return np.asarray(lifted - lifted[len(lifted) // 2], np.float64)


def _pose(
    way: Way, rng: np.random.Generator, shape: tuple[int, int], margin: int, home: bool
) -> Float64:
    pose = np.array([[1.0, 0.0, margin], [0.0, 1.0, margin], [0.0, 0.0, 1.0]])
    if home or not (way.shake_px or way.shake_deg):
        return pose
    angle = np.radians(rng.uniform(-way.shake_deg, way.shake_deg))
    direction = rng.uniform(0.0, 2.0 * np.pi)
    far = way.shake_px * rng.uniform(0.5, 1.0)
    centre = np.array([0.5 * shape[1], 0.5 * shape[0]])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shift = far * np.array([np.cos(direction), np.sin(direction)]) + centre - turn @ centre
    hand = np.eye(3)
    hand[:2, :2], hand[:2, 2] = turn, shift
    hand[2, :2] = rng.uniform(-4e-6, 4e-6, 2)
    return np.asarray(pose @ hand)


def _body(shape: tuple[int, int], share: float) -> NDArray[np.bool_]:
    body = np.zeros(shape, np.uint8)
    height, width = shape
    x = int(width * (0.35 + 0.25 * share))
    size = (int(0.035 * width), int(0.22 * height))
    cv2.ellipse(body, (x, int(0.7 * height)), size, 0, 0, 360, 1, -1)
    cv2.circle(body, (x, int(0.43 * height)), int(0.03 * width), 1, -1)
    return body > 0


def _coded(light: Float32, stop: float, lift: float, way: Way, rng: np.random.Generator) -> Bytes:
    """Sensor, sRGB, the frame's own tone curve, and a mild local one."""
    exposed = np.asarray(light, np.float64) * 2.0**stop
    noise = np.sqrt(np.minimum(exposed, 2.0) / WELL + READ**2)
    linear = np.clip(exposed + noise * rng.standard_normal(exposed.shape), 0.0, 1.0)
    linear = _lifted(linear, lift)
    if way.local:
        around = cv2.GaussianBlur(luminance(linear).astype(np.float32), (0, 0), 60.0)
        linear = linear * (0.18 / (around + 0.05))[..., None] ** way.local
        linear = np.clip(linear, 0.0, 1.0)
    coded = srgb_encode(linear).astype(np.float64)
    bend = rng.uniform(-way.bend, way.bend)
    coded = coded + bend * (coded * coded * (3.0 - 2.0 * coded) - coded)
    return np.asarray(np.rint(255.0 * np.clip(coded, 0.0, 1.0)), np.uint8)


def _lifted(linear: Float64, stops: float) -> Float64:
    """Gain of so many stops in the dark that leaves white white: (1 - e^-ax) / (1 - e^-a)."""
    if abs(stops) < 1e-6:
        return linear
    wanted = 2.0**stops
    low, high = -60.0, 60.0
    for _ in range(60):
        a = 0.5 * (low + high)
        gain = a / -np.expm1(-a) if abs(a) > 1e-9 else 1.0
        low, high = (a, high) if gain < wanted else (low, a)
    return np.asarray(np.expm1(-a * linear) / np.expm1(-a))


def _jpeg(codes: Bytes, quality: int) -> Bytes:
    return decoded(jpeg_bytes(codes, quality))


def jpeg_bytes(codes: Bytes, quality: int) -> bytes:
    """A JPEG file of a picture, red first."""
    done, data = cv2.imencode(".jpg", codes[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert done
    return data.tobytes()


def decoded(data: bytes) -> Bytes:
    """Pixels of a picture file, red first."""
    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert pixels is not None
    return np.ascontiguousarray(pixels[..., ::-1], np.uint8)


def spreads(
    light: NDArray[np.floating], frames: Sequence[Bytes], where: NDArray[np.bool_] | None = None
) -> tuple[float, float]:
    """Median and 95th percentile of the spread of log2 light within one code of one channel.

    84th minus 16th percentile; the median of a code normalises the exposure.
    """
    found = []
    inside = np.ones(light.shape[:2], bool) if where is None else where
    for frame in frames:
        for channel in range(3):
            logs = np.log2(np.maximum(light[..., channel][inside], 1e-9))
            codes = frame[..., channel][inside]
            order = np.argsort(codes, kind="stable")
            logs, codes = logs[order], codes[order]
            edges = np.searchsorted(codes, np.arange(LOWEST, HIGHEST + 2))
            for start, stop in pairwise(edges):
                if stop - start >= FEWEST:
                    low, high = np.percentile(logs[start:stop], (16, 84))
                    found.append(high - low)
    return float(np.median(found)), float(np.percentile(found, 95))


def speckle(light: NDArray[np.floating], where: NDArray[np.bool_] | None = None) -> float:
    """Share of pixels whose chroma is more than 0.3 stop off the median of 5 x 5 around."""
    logs = np.log2(np.maximum(np.asarray(light, np.float32), 1e-6))
    odd = np.zeros(light.shape[:2], bool)
    for channel in (0, 2):
        chroma = np.ascontiguousarray(logs[..., channel] - logs[..., 1])
        odd |= np.abs(chroma - cv2.medianBlur(chroma, 5)) > 0.3
    return float(odd.mean() if where is None else odd[where].mean())


def error_of(
    light: NDArray[np.floating], truth: NDArray[np.floating], where: NDArray[np.bool_]
) -> tuple[float, float]:
    """Median and 95th percentile of the luminance's error after the best scale, in stops."""
    ratio = np.log2(np.maximum(luminance(light[where]), 1e-9))
    ratio = ratio - np.log2(np.maximum(luminance(truth[where]), 1e-9))
    off = np.abs(ratio - np.median(ratio))
    return float(np.median(off)), float(np.percentile(off, 95))
