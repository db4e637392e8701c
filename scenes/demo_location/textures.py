"""Surfaces as pictures: albedo maps painted by NumPy, each for an area of known size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from scenes.demo_location.noise import cells, fractal, linear, mix, smooth

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["SURFACES", "Surface"]

Floats = NDArray[np.float32]
Rng = np.random.Generator
_SIDE: Final = 2048


@dataclass(frozen=True, slots=True)
class Surface:
    """A paintable surface.

    Attributes:
        paint: Makes (H, W, 3) linear albedo from a random generator.
        size: Metres that the picture covers, across and up.
        gloss: Roughness of a clear coat, 0 for none.
    """

    paint: Callable[[Rng], Floats]
    size: tuple[float, float]
    gloss: float = 0.0


def _palette(rng: Rng, count: int, colours: tuple[str, ...], spread: float) -> Floats:
    base = np.stack([linear(c) for c in colours])
    chosen = base[rng.integers(0, len(base), count)]
    chosen = chosen * np.exp(rng.normal(0, spread, (count, 1)))
    return np.clip(chosen * np.exp(rng.normal(0, spread / 4, (count, 3))), 0.01, 0.9).astype(
        np.float32
    )


def _rows(
    shape: tuple[int, int], counts: tuple[int, int], shift: Floats, warp: Floats
) -> tuple[NDArray[np.int64], Floats, Floats]:
    """Return courses of equal blocks: block number, and distance to the joints in block units."""
    y, x = np.meshgrid(
        np.arange(shape[0], dtype=np.float32) / shape[0] * counts[0],
        np.arange(shape[1], dtype=np.float32) / shape[1] * counts[1],
        indexing="ij",
    )
    y = (y + warp) % counts[0]
    row = np.floor(y).astype(int) % counts[0]
    x = (x + shift[row] + 0.3 * np.roll(warp, 97, 1)) % counts[1]
    column = np.floor(x).astype(int) % counts[1]
    across, down = x - np.floor(x), y - np.floor(y)
    return (
        row * counts[1] + column,
        np.minimum(across, 1 - across).astype(np.float32),
        np.minimum(down, 1 - down).astype(np.float32),
    )


def _bricks(colours: tuple[str, ...], mortar: str, wash: float) -> Callable[[Rng], Floats]:
    def paint(rng: Rng) -> Floats:
        shape, counts = (_SIDE, _SIDE), (52, 16)
        warp = 0.05 * fractal(rng, shape, (64, 32))
        shift = np.where(np.arange(52) % 2 == 0, 0.0, 0.5) + rng.normal(0, 0.03, 52)
        number, across, down = _rows(shape, counts, shift.astype(np.float32), warp)
        colour = _palette(rng, 52 * 16, colours, 0.22)[number]
        fine = fractal(rng, shape, (128, 128), 0.7)
        colour = colour * np.exp(0.13 * fine)[..., None]
        joint = np.minimum(across * 3.2, down) + 0.012 * fine
        body = smooth(0.045, 0.1, joint)
        shade = 1 - 0.35 * smooth(0.16, 0.05, joint) * body
        grey = linear(mortar) * np.exp(0.12 * fine)[..., None]
        picture = mix(grey.astype(np.float32), colour * shade[..., None], body)
        stain = smooth(0.4, 2.2, fractal(rng, shape, (3, 5)))
        lime = smooth(1.0, 2.6, fractal(rng, shape, (6, 9), 0.75))
        picture = picture * (1 - 0.4 * stain)[..., None]
        return mix(picture, linear("#cfc5b6"), wash * lime)

    return paint


def _plaster(colour: str, worn: str, strength: float) -> Callable[[Rng], Floats]:
    def paint(rng: Rng) -> Floats:
        shape = (_SIDE, _SIDE)
        broad = fractal(rng, shape, (3, 3), 0.6)
        fine = fractal(rng, shape, (90, 90), 0.75)
        trowel = fractal(rng, shape, (20, 8), 0.6)
        base = (
            linear(colour)
            * np.exp(0.09 * strength * broad + 0.045 * fine + 0.04 * trowel)[..., None]
        )
        streak = smooth(0.9, 2.6, fractal(rng, shape, (2, 40), 0.6) + 0.4 * broad)
        patch = smooth(1.35, 1.6, fractal(rng, shape, (5, 5), 0.65))
        edge = smooth(1.2, 1.35, fractal(rng, shape, (5, 5), 0.65)) * (1 - patch)
        number, gap = cells(rng, shape, (9, 9), 0.95)
        del number
        crack = smooth(0.006, 0.0, np.abs(gap + 0.02 * trowel)) * smooth(0.3, 1.2, broad)
        picture = mix(base.astype(np.float32), linear(worn), 0.5 * strength * streak)
        picture = mix(picture, linear(worn) * 1.1, 0.5 * strength * patch)
        return np.asarray(
            picture * (1 - 0.5 * strength * crack - 0.12 * strength * edge)[..., None], np.float32
        )

    return paint


def _planks(
    colours: tuple[str, ...], counts: tuple[int, int], contrast: float
) -> Callable[[Rng], Floats]:
    """Return a painter of boards along u, with `counts` boards up and lengths across."""

    def paint(rng: Rng) -> Floats:
        shape = (_SIDE, _SIDE)
        shift = rng.uniform(0, 1, counts[0]).astype(np.float32)
        number, across, down = _rows(shape, counts, shift, np.zeros(shape, np.float32))
        colour = _palette(rng, counts[0] * counts[1], colours, 0.18)[number]
        rings = fractal(rng, shape, (counts[0] * 3, 3), 0.62)
        roll = np.roll(rings, 531, 1)
        grain = np.sin(9 * rings + 3 * (number % 7) + 2 * roll)
        fibre = fractal(rng, shape, (400, 12), 0.7)
        knots = smooth(2.5, 3.2, fractal(rng, shape, (counts[0] * 2, 14), 0.5))
        picture = colour * np.exp(contrast * (0.16 * grain + 0.12 * fibre + 0.1 * roll))[..., None]
        picture = picture * (1 - 0.65 * knots)[..., None]
        side = np.minimum(down * 1.0, across * counts[0] / counts[1] * 2.0)
        return np.asarray(picture * (0.18 + 0.82 * smooth(0.0, 0.035, side))[..., None], np.float32)

    return paint


def _floor(rng: Rng) -> Floats:
    """Paint worn cement tiles, 24 cm, with a star and border pattern in four muted colours."""
    shape, count = (_SIDE, _SIDE), 16
    y, x = np.meshgrid(np.arange(_SIDE), np.arange(_SIDE), indexing="ij")
    scale = count / _SIDE
    u, v = (x * scale) % 1 - 0.5, (y * scale) % 1 - 0.5
    number = np.floor(y * scale).astype(int) * count + np.floor(x * scale).astype(int)
    tone = np.exp(rng.normal(0, 0.13, count * count))[number]
    radius, angle = np.hypot(u, v), np.arctan2(v, u)
    star = radius < 0.25 + 0.13 * np.cos(8 * angle)
    ring = np.abs(radius - 0.43) < 0.022
    corner = np.hypot(np.abs(u) - 0.5, np.abs(v) - 0.5) < 0.2
    heart = radius < 0.08
    checker = (np.floor(y * scale) + np.floor(x * scale)).astype(int) % 2 == 0
    picture = np.broadcast_to(linear("#b9ad98"), (*shape, 3)).copy()
    picture[star & checker] = linear("#5c6f73")
    picture[star & ~checker] = linear("#8c5a45")
    picture[ring] = linear("#3d4244")
    picture[corner] = linear("#a3683f")
    picture[heart] = linear("#d8cfbb")
    fine, broad = fractal(rng, shape, (70, 70), 0.75), fractal(rng, shape, (3, 3), 0.6)
    picture = mix(picture, linear("#a89a86"), 0.28 * smooth(-0.2, 2.2, broad + 0.5 * fine))
    joint = np.minimum(0.5 - np.abs(u), 0.5 - np.abs(v)).astype(np.float32)
    picture = picture * (tone * np.exp(0.09 * fine))[..., None]
    return np.asarray(picture * (0.35 + 0.65 * smooth(0.006, 0.016, joint))[..., None], np.float32)


def _cobbles(rng: Rng) -> Floats:
    shape = (_SIDE, _SIDE)
    number, edge = cells(rng, shape, (36, 36), 0.42)
    edge = edge + 0.025 * fractal(rng, shape, (128, 128), 0.6)
    colours = ("#8b857c", "#9a9287", "#77736d", "#a3988a", "#8d8071", "#6d6f70", "#b0a799")
    colour = _palette(rng, 36 * 36, colours, 0.16)[number]
    fine = fractal(rng, shape, (200, 200), 0.75)
    body = smooth(0.05, 0.2, edge)
    dome = 0.72 + 0.28 * smooth(0.05, 0.6, edge)
    joint = linear("#5a5146") * np.exp(0.25 * fine)[..., None]
    moss = smooth(0.5, 1.8, fractal(rng, shape, (5, 5), 0.6))[..., None] * linear("#46512c")
    joint = np.where(moss > 0.004, 0.4 * joint + 0.6 * moss, joint)
    picture = mix(
        joint.astype(np.float32), colour * np.exp(0.12 * fine)[..., None] * dome[..., None], body
    )
    stain = smooth(0.5, 2.4, fractal(rng, shape, (4, 4), 0.65))
    return np.asarray(picture * (1 - 0.3 * stain)[..., None], np.float32)


def _flags(rng: Rng) -> Floats:
    """Paint the limestone slabs of the terrace."""
    shape, counts = (_SIDE, _SIDE), (6, 4)
    warp = 0.008 * fractal(rng, shape, (24, 24))
    number, across, down = _rows(shape, counts, rng.uniform(0, 1, 6).astype(np.float32), warp)
    colour = _palette(rng, 24, ("#c2b59d", "#b5a993", "#cbbfa9", "#a89d8b"), 0.1)[number]
    fine, broad = fractal(rng, shape, (60, 60), 0.78), fractal(rng, shape, (5, 7), 0.6)
    pits = smooth(1.9, 2.6, fractal(rng, shape, (220, 220), 0.6))
    picture = colour * np.exp(0.1 * fine + 0.08 * broad)[..., None] * (1 - 0.35 * pits)[..., None]
    joint = np.minimum(across * 1.5, down) + 0.002 * fine
    return np.asarray(picture * (0.3 + 0.7 * smooth(0.006, 0.022, joint))[..., None], np.float32)


def _roof(rng: Rng) -> Floats:
    shape, counts = (1024, 1024), (16, 20)
    number, across, down = _rows(
        shape, counts, np.zeros(16, np.float32), np.zeros(shape, np.float32)
    )
    colour = _palette(rng, 320, ("#a5583a", "#b86a45", "#8f4a34", "#96684f", "#7d4a3a"), 0.2)[
        number
    ]
    fine = fractal(rng, shape, (60, 60), 0.7)
    round_ = np.sqrt(np.clip(1 - (1 - 2 * across) ** 2, 0.02, 1))
    lichen = smooth(1.0, 2.2, fractal(rng, shape, (20, 20), 0.6))
    picture = (
        colour * (round_ * np.exp(0.15 * fine) * (0.35 + 0.65 * smooth(0, 0.12, down)))[..., None]
    )
    return mix(picture.astype(np.float32), linear("#9a9468"), 0.4 * lichen)


def _weave(colour: str, second: str, threads: int, stripes: int) -> Callable[[Rng], Floats]:
    def paint(rng: Rng) -> Floats:
        side = 1024
        y, x = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
        weft = np.sin(2 * np.pi * threads * y / side) * np.sin(2 * np.pi * threads * x / side)
        band = (
            (np.sin(2 * np.pi * stripes * x / side) > 0.75) if stripes else np.zeros((side, side))
        )
        fine, broad = fractal(rng, (side, side), (80, 80), 0.7), fractal(rng, (side, side), (3, 3))
        picture = mix(linear(colour), linear(second), np.asarray(band, np.float32) * 0.9)
        tone = np.exp(0.16 * weft + 0.1 * fine + 0.06 * broad).astype(np.float32)
        return np.asarray(picture * tone[..., None], np.float32)

    return paint


def _metal(colour: str, rust: str, amount: float) -> Callable[[Rng], Floats]:
    def paint(rng: Rng) -> Floats:
        shape = (512, 512)
        fine, broad = fractal(rng, shape, (40, 40), 0.7), fractal(rng, shape, (4, 4), 0.6)
        spots = smooth(0.8, 1.8, broad + 0.4 * fine)
        picture = linear(colour) * np.exp(0.12 * fine)[..., None]
        return mix(picture.astype(np.float32), linear(rust), amount * spots)

    return paint


SURFACES: Final[dict[str, Surface]] = {
    "brick": Surface(
        _bricks(("#a8654d", "#965543", "#b3745a", "#874d3e", "#bb876a", "#7a5044"), "#a79b8b", 0.5),
        (4.0, 4.0),
    ),
    "brick-pale": Surface(
        _bricks(("#b58a63", "#a87b57", "#c29a72", "#9a6c4e", "#8f6a52"), "#b3a995", 0.35),
        (4.0, 4.0),
    ),
    "plaster": Surface(_plaster("#e2d8c6", "#bcae98", 0.8), (5.3, 5.3)),
    "ochre": Surface(_plaster("#d0a062", "#b79a78", 1.6), (7.7, 7.7)),
    "rose": Surface(_plaster("#c58f78", "#b8a08c", 1.6), (7.1, 7.1)),
    "stone": Surface(_plaster("#b9ae9a", "#7f776a", 1.2), (3.1, 3.1)),
    "floor": Surface(_floor, (3.84, 3.84), 0.22),
    "cobbles": Surface(_cobbles, (4.6, 4.6)),
    "flags": Surface(_flags, (4.2, 3.4)),
    "roof": Surface(_roof, (4.4, 5.0)),
    "oak": Surface(
        _planks(("#8f6a45", "#7d5938", "#9c774f", "#6f4d31"), (8, 1), 1.0), (2.9, 1.3), 0.3
    ),
    "beam": Surface(_planks(("#7a5b42", "#6b4e38", "#8a6a4e"), (4, 1), 1.3), (3.3, 1.6)),
    "boards": Surface(
        _planks(("#cdbb9c", "#c2af8f", "#d6c6a9", "#b9a583"), (12, 2), 0.8), (4.4, 2.2)
    ),
    "green-wood": Surface(
        _planks(("#5d7a6a", "#577363", "#648171"), (8, 1), 0.45), (2.7, 1.2), 0.25
    ),
    "blue-wood": Surface(_planks(("#5f7f86", "#58777f", "#68888e"), (10, 1), 0.7), (2.1, 1.0)),
    "linen": Surface(_weave("#cdbb9c", "#7c3f35", 160, 0), (1.4, 1.4)),
    "rug": Surface(_weave("#7c3a32", "#c9a56a", 120, 9), (1.6, 1.6)),
    "knit": Surface(_weave("#49617a", "#d6d0c0", 44, 0), (0.55, 0.55)),
    "iron": Surface(_metal("#2c2d2d", "#5a4030", 0.5), (0.9, 0.9), 0.3),
    "brass": Surface(_metal("#a98144", "#6a4d28", 0.5), (0.7, 0.7), 0.2),
    "terracotta": Surface(_metal("#b0623f", "#cdb59a", 0.75), (0.8, 0.8)),
}
