"""A chrome ball in front of a panorama, as a camera sees it: rendered by stock Mitsuba.

The ball of 12 cm is in the middle of the panorama, 5 % of it covered with dirt. The camera is 1.5 m
away at azimuth 0, held by a person who hides the area behind them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mitsuba as mi  # noqa: TID253 - a module that only a rendering process imports
import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
BALL_M = 0.06
AWAY_M = 1.5
DIRT = 0.05
_SAMPLES = (16, 400)
_FINE = (2048, 4096)  # Mitsuba's own rows agree with ours within a hundredth of a degree


@dataclass(frozen=True, slots=True)
class Shot:
    """Position and direction of the camera: metres, degrees, pixels.

    Attributes:
        mm: Focal length on 24 x 36.
        azimuth_deg: Azimuth of the photographer.
        above_m: Height of the lens above the ball.
        pitch_deg, yaw_deg: Direction of the camera up, and to the right of the ball.
    """

    size: tuple[int, int] = (1600, 2400)
    mm: float = 85.0
    azimuth_deg: float = 0.0
    above_m: float = 0.0
    pitch_deg: float = 0.0
    yaw_deg: float = 0.0
    away_m: float = AWAY_M

    @property
    def focal_px(self) -> float:
        """Focal length in pixels, by the frame's diagonal."""
        return self.mm * math.hypot(*self.size) / math.hypot(24.0, 36.0)

    @property
    def lens(self) -> NDArray[np.float64]:
        """Lens position relative to the ball, (3,) metres; the photographer is at azimuth 0."""
        return np.array([0.0, self.above_m, self.away_m])

    def rays(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return unit vectors out of the lens for columns and rows of the picture, (N, 3)."""
        pitch, yaw = math.radians(self.pitch_deg), math.radians(self.yaw_deg)
        ahead = np.array(
            [math.sin(yaw) * math.cos(pitch), math.sin(pitch), -math.cos(yaw) * math.cos(pitch)]
        )
        right = np.array([math.cos(yaw), 0.0, math.sin(yaw)])
        u = (x - self.size[1] / 2) / self.focal_px
        v = (self.size[0] / 2 - y) / self.focal_px
        ray = ahead + u[:, None] * right + v[:, None] * np.cross(right, ahead)
        return np.asarray(ray / np.linalg.norm(ray, axis=1, keepdims=True))

    @property
    def axis(self) -> NDArray[np.float64]:
        """Unit vector to the ball in the camera's axes: right, up, ahead."""
        pitch, yaw = math.radians(self.pitch_deg), math.radians(self.yaw_deg)
        ahead = np.array(
            [math.sin(yaw) * math.cos(pitch), math.sin(pitch), -math.cos(yaw) * math.cos(pitch)]
        )
        right = np.array([math.cos(yaw), 0.0, math.sin(yaw)])
        toward = np.array([0.0, -self.above_m, -self.away_m])
        seen = np.stack([right, np.cross(right, ahead), ahead]) @ toward
        return np.asarray(seen / np.linalg.norm(seen))

    @property
    def outline_px(self) -> tuple[float, float, float]:
        """Return column and row of the ball's middle and its approximate radius, pixels."""
        x, y, z = (float(each) for each in self.axis)
        far = math.hypot(self.above_m, self.away_m)
        radius = self.focal_px * math.tan(math.asin(BALL_M / far)) / z
        rows, columns = self.size
        return columns / 2 + self.focal_px * x / z, rows / 2 - self.focal_px * y / z, radius


def dirt(seed: int, rows: int = 1024) -> Float32:
    """Return a mask of specks and scratches on a ball, (rows, 2 rows): 1 where there is dirt."""
    random = np.random.default_rng(seed)
    elevation = np.pi * (0.5 - (np.arange(rows) + 0.5) / rows)
    azimuth = 2 * np.pi * (np.arange(2 * rows) + 0.5) / (2 * rows)
    flat = np.cos(elevation)[:, None]
    where = np.stack(
        [flat * np.sin(azimuth), np.sin(elevation)[:, None] + 0 * azimuth, flat * np.cos(azimuth)],
        axis=-1,
    ).astype(np.float32)
    weight = np.broadcast_to(flat / flat.sum() / (2 * rows), where.shape[:2])
    made = np.zeros(where.shape[:2], np.float32)
    while float((made * weight).sum()) < DIRT:
        middle = random.standard_normal(3)
        middle /= np.linalg.norm(middle)
        if random.random() < 0.2:  # a scratch: a piece of a great circle, 0.2 mm wide
            other = np.cross(middle, random.standard_normal(3))
            other /= np.linalg.norm(other)
            near = np.abs(where @ other.astype(np.float32)) < 0.1 / 60
            made[
                near & (where @ middle.astype(np.float32) > math.cos(random.uniform(0.1, 0.4)))
            ] = 1
        else:
            radius = random.uniform(0.15, 1.5) / 60.0  # of 0.3 to 3 mm
            made[where @ middle.astype(np.float32) > math.cos(radius)] = 1
    return made


def render(panorama: Float32, shot: Shot, seed: int = 1) -> Float32:
    """Render the linear picture, (rows, columns, 3), in the panorama's unit.

    The ball has less noise.
    """
    whole = {"crop_offset_x": 0, "crop_offset_y": 0}
    picture = _rendered(panorama, shot, seed, whole, _SAMPLES[0])
    column, row, radius = shot.outline_px
    left, top, side = int(column - radius) - 8, int(row - radius) - 8, 2 * int(radius) + 18
    crop = {"crop_offset_x": left, "crop_offset_y": top, "crop_width": side, "crop_height": side}
    part = _rendered(panorama, shot, seed, crop, _SAMPLES[1])
    picture[top : top + side, left : left + side] = part
    return picture


def _rendered(
    panorama: Float32, shot: Shot, seed: int, crop: dict[str, int], samples: int
) -> Float32:
    described = _scene(panorama, shot, samples, seed)
    described["sensor"]["film"] |= crop
    return np.array(mi.render(mi.load_dict(described), seed=seed), np.float32)


def _scene(panorama: Float32, shot: Shot, samples: int, seed: int) -> dict[str, Any]:
    factor = _FINE[0] // panorama.shape[0]
    large = panorama.repeat(factor, 0).repeat(factor, 1)
    stands = mi.ScalarTransform4f().rotate([0, 1, 0], -shot.azimuth_deg)
    at = [0.0, shot.above_m, shot.away_m]
    tilt = math.radians(shot.pitch_deg)
    yaw = math.radians(shot.yaw_deg)
    ahead = [
        math.sin(yaw) * math.cos(tilt),
        math.sin(tilt),
        -math.cos(yaw) * math.cos(tilt),
    ]
    target = [a + b for a, b in zip(at, ahead, strict=True)]
    rows, columns = shot.size
    width_mm = math.hypot(24.0, 36.0) * columns / math.hypot(rows, columns)
    wide = math.degrees(2 * math.atan(width_mm / 2 / shot.mm))
    specks = dirt(seed)[..., None]
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 5},
        "place": {"type": "envmap", "bitmap": mi.Bitmap(np.ascontiguousarray(large))},
        "ball": {
            "type": "sphere",
            "radius": BALL_M,
            "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], -90),
            "bsdf": {
                "type": "blendbsdf",
                "weight": {
                    "type": "bitmap",
                    "bitmap": mi.Bitmap(np.ascontiguousarray(specks)),
                    "raw": True,
                },
                "mirror": {"type": "conductor", "material": "Cr"},
                "dirt": {
                    "type": "diffuse",
                    "reflectance": {"type": "rgb", "value": [0.25, 0.2, 0.15]},
                },
            },
        },
        **_photographer(stands, shot),
        "sensor": {
            "type": "perspective",
            "fov": wide,
            "fov_axis": "x",
            "near_clip": 0.01,
            "far_clip": 1000.0,
            "to_world": stands @ mi.ScalarTransform4f().look_at(at, target, [0, 1, 0]),
            "film": {
                "type": "hdrfilm",
                "width": columns,
                "height": rows,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
            },
            "sampler": {"type": "independent", "sample_count": samples},
        },
    }


def _photographer(stands: Any, shot: Shot) -> dict[str, Any]:
    """Return a person 1.75 m tall behind the camera, in dark clothes."""
    eyes, behind = shot.above_m, shot.away_m + 0.12

    def part(kind: str, colour: float, way: Any) -> dict[str, Any]:
        bsdf = {"type": "diffuse", "reflectance": {"type": "rgb", "value": colour}}
        return {"type": kind, "bsdf": bsdf, "to_world": stands @ way}

    def block(x: float, y: float, z: float, half: tuple[float, float, float]) -> Any:
        move = mi.ScalarTransform4f().translate([x, eyes + y, z])
        return move @ mi.ScalarTransform4f().scale(list(half))

    parts = {
        "torso": part("cube", 0.1, block(0, -0.55, behind, (0.2, 0.35, 0.11))),
        "camera": part("cube", 0.03, block(0, 0.0, shot.away_m + 0.05, (0.07, 0.05, 0.03))),
    }
    head = mi.ScalarTransform4f().translate([0, eyes, behind + 0.1])
    parts["head"] = part("sphere", 0.4, head @ mi.ScalarTransform4f().scale(0.11))
    for side, name in ((-1, "left"), (1, "right")):
        leg = block(side * 0.1, -1.25, behind, (0.08, 0.4, 0.09))
        arm = block(side * 0.22, -0.35, behind - 0.05, (0.05, 0.2, 0.12))
        parts[f"leg_{name}"], parts[f"arm_{name}"] = part("cube", 0.08, leg), part("cube", 0.1, arm)
    return parts
