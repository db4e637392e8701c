"""Simple rooms and streets, ray-traced with stock Mitsuba, in which a probe can be moved.

Each place is made of boxes and rectangles, drawn at random from its kind and its seed: a small
room, a living room, a hall, a studio with softboxes, a room with a bulb on a stand, a street by
day, a street by night and an open field. Walls, floors and furniture have different colours, and
floors are tiled. A panorama is path-traced at the probe and at each place where the head may be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import mitsuba as mi  # noqa: TID253 - a module that only a rendering process imports
import numpy as np

from app.core.base.arrays import Float32, Float64
from app.core.base.sphere import directions

KINDS: Final = ("small", "living", "hall", "studio", "bulb", "street", "night", "field")
MARGIN: Final = 0.85  # metres of free floor around the probe
_DEPTH: Final = 6
_FINER: Final = 6  # rays along each side of a texel
_SKY_SHAPE: Final = (64, 128)
_ROOMS: Final = {  # metres: width, height, depth, smallest and largest
    "small": ((2.8, 2.4, 3.2), (3.8, 2.7, 4.5)),
    "living": ((4.0, 2.4, 4.5), (6.5, 3.2, 8.0)),
    "hall": ((9.0, 4.0, 10.0), (16.0, 8.0, 22.0)),
    "studio": ((5.0, 3.0, 6.0), (9.0, 4.5, 10.0)),
    "bulb": ((3.0, 2.4, 3.5), (6.0, 3.0, 7.0)),
}


@dataclass(frozen=True, slots=True)
class Room:
    """A scene and the position of the probe in it.

    Attributes:
        scene: Dictionary of a Mitsuba scene. Metres, Y up, floor at 0, azimuth 0 at +Z.
        probe: (3,) float64. Position of the camera, in metres.
    """

    name: str
    scene: dict[str, Any] = field(repr=False)
    probe: Float64


def build_room(kind: str, seed: int) -> Room:
    """Draw a place at random."""
    rng = np.random.default_rng([KINDS.index(kind), seed])
    probe = np.array([0.0, rng.uniform(1.4, 1.65), 0.0])
    scene: dict[str, Any] = {"type": "scene"}
    if kind in _ROOMS:
        low, high = (np.array(size) for size in _ROOMS[kind])
        size = rng.uniform(low, high)
        corner = -np.array([_inside(rng, size[0]), 0.0, _inside(rng, size[2])])
        _add_walls(scene, rng, corner, size, dark=kind == "studio" and rng.random() < 0.5)
        _add_furniture(scene, rng, corner, size)
        _LIGHTING[kind](scene, rng, corner, size)
    else:
        _add_outdoors(scene, rng, kind)
    turn = mi.ScalarTransform4f().rotate([0, 1, 0], float(rng.uniform(0.0, 90.0)))
    for value in scene.values():
        if isinstance(value, dict) and "to_world" in value:
            value["to_world"] = turn @ value["to_world"]
    return Room(f"{kind}-{seed}", scene, probe)


def panoramas(room: Room, offsets: Sequence[Float64], shape: tuple[int, int]) -> list[Float32]:
    """Render panoramas at positions relative to the probe, (H, W, 3) each.

    Args:
        offsets: (3,) float64 each, in metres.
        shape: Rows and columns of a panorama.
    """
    scene = mi.load_dict(room.scene)
    integrator = mi.load_dict({"type": "path", "max_depth": _DEPTH})
    rays = _rays(shape)
    sampler = mi.load_dict({"type": "independent"})
    found = []
    for number, offset in enumerate(offsets):
        sampler.seed(number, len(rays))
        at = mi.Point3f(*(float(x) for x in room.probe + offset))
        ray = mi.RayDifferential3f(at, mi.Vector3f(*rays.T))
        light = np.array(integrator.sample(scene, sampler, ray)[0]).T
        parts = light.reshape(shape[0], _FINER, shape[1], _FINER, 3)
        found.append(np.asarray(parts.mean(axis=(1, 3)), np.float32))
    return found


def _rays(shape: tuple[int, int]) -> Float32:
    """Return directions on a grid finer than a panorama's texels, (N, 3)."""
    return directions((_FINER * shape[0], _FINER * shape[1])).reshape(-1, 3)


def _inside(rng: np.random.Generator, extent: float) -> float:
    """Return the distance of the probe from one wall of a room."""
    return float(rng.uniform(MARGIN, extent - MARGIN))


def _colour(rng: np.random.Generator, low: float, high: float, tint: float = 0.15) -> list[float]:
    grey = rng.uniform(low, high)
    return [float(np.clip(grey * (1.0 + rng.uniform(-tint, tint)), 0.02, 0.9)) for _ in range(3)]


def _matt(colour: list[float]) -> dict[str, Any]:
    reflectance = {"type": "rgb", "value": colour}
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": reflectance}}


def _tiled(rng: np.random.Generator, metres: float, low: float, high: float) -> dict[str, Any]:
    """Return a floor of two colours that differ by up to a third."""
    one = _colour(rng, low, high)
    other = [value * float(rng.uniform(0.67, 1.0)) for value in one]
    tiles = metres / rng.uniform(0.3, 1.2) / 2.0
    texture = {
        "type": "checkerboard",
        "color0": {"type": "rgb", "value": one},
        "color1": {"type": "rgb", "value": other},
        "to_uv": mi.ScalarTransform4f().scale([float(tiles)] * 3),
    }
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": texture}}


def _rectangle(
    middle: Float64, normal: Float64, size: tuple[float, float], **more: Any
) -> dict[str, Any]:
    """Return a rectangle with a width and a height; a steep normal must be exactly vertical."""
    up = [0.0, 0.0, 1.0] if abs(normal[1]) > 0.99 else [0.0, 1.0, 0.0]
    look = mi.ScalarTransform4f().look_at(
        origin=middle.tolist(), target=(middle + normal).tolist(), up=up
    )
    stretch = mi.ScalarTransform4f().scale([size[0] / 2.0, size[1] / 2.0, 1.0])
    return {"type": "rectangle", "to_world": look @ stretch, **more}


def _box(low: Float64, high: Float64, bsdf: dict[str, Any]) -> dict[str, Any]:
    transform = mi.ScalarTransform4f().translate(((low + high) / 2.0).tolist())
    transform = transform @ mi.ScalarTransform4f().scale(((high - low) / 2.0).tolist())
    return {"type": "cube", "to_world": transform, "bsdf": bsdf}


def _glow(radiance: float, rng: np.random.Generator) -> dict[str, Any]:
    warm = float(rng.uniform(0.0, 0.35))
    colour = [radiance * (1.0 + warm), radiance, radiance * (1.0 - warm)]
    return {"type": "area", "radiance": {"type": "rgb", "value": colour}}


def _add_walls(
    scene: dict[str, Any],
    rng: np.random.Generator,
    corner: Float64,
    size: Float64,
    *,
    dark: bool,
) -> None:
    wall = (0.06, 0.2) if dark else (0.4, 0.8)
    far = corner + size
    middle = (corner + far) / 2.0
    longest = float(max(size[0], size[2]))
    floor = middle * [1, 0, 1]
    up = np.array([0.0, 1.0, 0.0])
    level = (float(size[0]), float(size[2]))
    scene["floor"] = _rectangle(floor, up, level, bsdf=_tiled(rng, longest, 0.12, 0.5))
    ceiling = _matt(_colour(rng, wall[0], min(wall[1] + 0.1, 0.85), 0.05))
    scene["ceiling"] = _rectangle(floor + up * size[1], -up, level, bsdf=ceiling)
    paint = _colour(rng, *wall)
    for number, (x, z) in enumerate(((1, 0), (-1, 0), (0, 1), (0, -1))):
        normal = np.array([-x, 0.0, -z], np.float64)
        at = middle - normal * size / 2.0
        width = float(size[2] if x else size[0])
        bsdf = _matt(paint if rng.random() < 0.7 else _colour(rng, *wall))
        scene[f"wall-{number}"] = _rectangle(at, normal, (width, float(size[1])), bsdf=bsdf)


def _add_furniture(
    scene: dict[str, Any], rng: np.random.Generator, corner: Float64, size: Float64
) -> None:
    """Add boxes that stand on the floor, outside the free floor around the probe."""
    for number in range(int(rng.integers(1, 6))):
        extent = rng.uniform([0.4, 0.4, 0.4], [1.2, 2.0, 0.9])
        low = corner + rng.uniform(0.0, 1.0, 3) * (size - extent)
        low[1] = 0.0
        high = low + extent
        if (low[0] < MARGIN and high[0] > -MARGIN) and (low[2] < MARGIN and high[2] > -MARGIN):
            continue
        scene[f"furniture-{number}"] = _box(low, high, _matt(_colour(rng, 0.1, 0.6, 0.3)))


def _add_windows(
    scene: dict[str, Any], rng: np.random.Generator, corner: Float64, size: Float64, count: int
) -> None:
    """Add bright rectangles just in front of the walls."""
    far = corner + size
    for number in range(count):
        side = int(rng.integers(4))
        axis = 0 if side < 2 else 2
        along = 2 - axis
        width = float(min(rng.uniform(0.8, 2.5), 0.8 * size[along]))
        height = float(min(rng.uniform(0.9, 1.8), size[1] - 1.0))
        at = np.zeros(3)
        at[axis] = corner[axis] + 0.02 if side % 2 else far[axis] - 0.02
        at[along] = rng.uniform(corner[along] + width / 2, far[along] - width / 2)
        at[1] = 0.85 + height / 2.0 + rng.uniform(0.0, 0.1)
        normal = np.zeros(3)
        normal[axis] = 1.0 if side % 2 else -1.0
        scene[f"window-{number}"] = _rectangle(
            at, normal, (width, height), emitter=_glow(float(rng.uniform(20.0, 60.0)), rng)
        )


def _add_ceiling_lamps(
    scene: dict[str, Any], rng: np.random.Generator, corner: Float64, size: Float64, count: int
) -> None:
    for number in range(count):
        at = corner + rng.uniform(0.1, 0.9, 3) * size
        at[1] = size[1] - rng.uniform(0.02, 0.4)
        side = float(rng.uniform(0.2, 0.7))
        down = np.array([0.0, -1.0, 0.0])
        scene[f"lamp-{number}"] = _rectangle(
            at, down, (side, side), emitter=_glow(float(rng.uniform(40.0, 200.0)), rng)
        )


def _light_room(
    scene: dict[str, Any], rng: np.random.Generator, corner: Float64, size: Float64
) -> None:
    windows = int(rng.integers(0, 4))
    _add_windows(scene, rng, corner, size, windows)
    _add_ceiling_lamps(scene, rng, corner, size, int(rng.integers(0 if windows else 1, 3)))


def _light_hall(
    scene: dict[str, Any], rng: np.random.Generator, corner: Float64, size: Float64
) -> None:
    _add_windows(scene, rng, corner, size, int(rng.integers(2, 7)))
    _add_ceiling_lamps(scene, rng, corner, size, int(rng.integers(2, 9)))


def _light_studio(
    scene: dict[str, Any], rng: np.random.Generator, corner: Float64, size: Float64
) -> None:
    """Add one to three softboxes that face the head, as far away as the room permits."""
    for number in range(int(rng.integers(1, 4))):
        at = _on_floor(rng, corner, size, 1.0, 3.0)
        at[1] = rng.uniform(1.3, min(2.6, size[1] - 0.5))
        normal = np.array([0.0, 1.5, 0.0]) - at
        normal /= np.linalg.norm(normal)
        side = float(rng.uniform(0.4, 1.0))
        glow = _glow(float(rng.uniform(20.0, 120.0)), rng)
        scene[f"softbox-{number}"] = _rectangle(at, normal, (side, side), emitter=glow)
    _add_ceiling_lamps(scene, rng, corner, size, int(rng.integers(0, 2)))


def _light_bulb(
    scene: dict[str, Any], rng: np.random.Generator, corner: Float64, size: Float64
) -> None:
    """Add a globe on a stand, and sometimes a window."""
    at = _on_floor(rng, corner, size, MARGIN + 0.1, 2.5)
    at[1] = rng.uniform(1.0, 2.0)
    scene["globe"] = {
        "type": "sphere",
        "to_world": mi.ScalarTransform4f()
        .translate(at.tolist())
        .scale(float(rng.uniform(0.06, 0.2))),
        "emitter": _glow(float(rng.uniform(60.0, 300.0)), rng),
    }
    _add_windows(scene, rng, corner, size, int(rng.integers(0, 2)))


def _on_floor(
    rng: np.random.Generator, corner: Float64, size: Float64, nearest: float, farthest: float
) -> Float64:
    """Return a position in the room at a distance from the probe, with its height still 0."""
    while True:
        angle, far = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(nearest, farthest)
        at = np.array([far * np.sin(angle), 0.0, far * np.cos(angle)])
        inner = (at > corner + 0.25)[[0, 2]] & (at < corner + size - 0.25)[[0, 2]]
        if inner.all():
            return at


def _add_outdoors(scene: dict[str, Any], rng: np.random.Generator, kind: str) -> None:
    up = np.array([0.0, 1.0, 0.0])
    ground = _tiled(rng, 300.0, 0.1, 0.35)
    scene["floor"] = _rectangle(np.zeros(3), up, (300.0, 300.0), bsdf=ground)
    scene["sky"] = {
        "type": "envmap",
        "bitmap": mi.Bitmap(_sky(rng, kind)),
        "scale": 1.0,
    }
    if kind == "field":
        return
    left, right = rng.uniform(2.0, 8.0, 2)
    for side, near in enumerate((-left, right)):
        start = -60.0
        number = 0
        while start < 60.0:
            width, tall = rng.uniform(6.0, 14.0), rng.uniform(5.0, 16.0)
            low = np.array([min(near, near * 3.0), 0.0, start])
            high = np.array([max(near, near * 3.0), tall, start + width])
            scene[f"house-{side}-{number}"] = _box(low, high, _matt(_colour(rng, 0.2, 0.6, 0.2)))
            start += width + (rng.uniform(1.0, 6.0) if rng.random() < 0.3 else 0.0)
            number += 1
    if kind == "night":
        _add_street_lamps(scene, rng, left, right)


def _add_street_lamps(
    scene: dict[str, Any], rng: np.random.Generator, left: float, right: float
) -> None:
    """Add globes on posts along the street, and lit shop windows."""
    start = rng.uniform(-25.0, -18.0)
    for number in range(4):
        side = -left + 0.6 if number % 2 else right - 0.6
        at = np.array([side, rng.uniform(3.0, 5.0), start + 12.0 * number])
        scene[f"post-{number}"] = {
            "type": "sphere",
            "to_world": mi.ScalarTransform4f().translate(at.tolist()).scale(0.2),
            "emitter": _glow(float(rng.uniform(150.0, 400.0)), rng),
        }
    for number in range(int(rng.integers(0, 4))):
        right_side = rng.random() < 0.5
        x = right - 0.03 if right_side else -left + 0.03
        at = np.array([x, 1.3, rng.uniform(-6.0, 6.0)])
        normal = np.array([-1.0 if right_side else 1.0, 0.0, 0.0])
        glow = _glow(float(rng.uniform(3.0, 15.0)), rng)
        scene[f"shop-{number}"] = _rectangle(at, normal, (2.5, 1.8), emitter=glow)


def _sky(rng: np.random.Generator, kind: str) -> Float32:
    """Return an overcast sky, a clear one with a sun, or a dark one, (64, 128, 3)."""
    ways = directions(_SKY_SHAPE).astype(np.float64)
    up = np.maximum(ways[..., 1], 0.0)
    if kind == "night":
        return np.full((*_SKY_SHAPE, 3), 0.01, np.float32)
    overcast = (1.0 + 2.0 * up) / 3.0
    light = np.repeat(overcast[..., None], 3, axis=2)
    if rng.random() < 0.6:
        light = (0.25 + 0.4 * (1.0 - up))[..., None] * np.array([0.7, 0.9, 1.3])
        row, column = rng.integers(8, 27), rng.integers(128)
        light[row, column] = float(rng.uniform(200.0, 2000.0))
    light[ways[..., 1] < 0.0] = 0.2
    return np.asarray(light, np.float32)


_LIGHTING: Final = {
    "small": _light_room,
    "living": _light_room,
    "hall": _light_hall,
    "studio": _light_studio,
    "bulb": _light_bulb,
}
