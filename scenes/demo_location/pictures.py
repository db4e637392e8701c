"""Decoration: an atlas of pictures for the walls, an atlas of book spines, a menu board."""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.demo_location.noise import fractal, linear, mix, smooth

__all__ = ["ART_GRID", "SPINES", "art", "cell", "menu", "spines"]

Floats = NDArray[np.float32]
Rng = np.random.Generator
ART_GRID: Final = (3, 5)  # rows, columns
SPINES: Final = 96
_CELL: Final = 512
_INKS: Final = (
    "#b5452f",
    "#d99a3a",
    "#2f5d73",
    "#e6d8b8",
    "#1f2a33",
    "#6f8f6a",
    "#8f3d54",
    "#c9c0ae",
    "#47402f",
)


def cell(index: int) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the lower left and upper right texture coordinates of a picture."""
    row, column = divmod(index % (ART_GRID[0] * ART_GRID[1]), ART_GRID[1])
    low = (column / ART_GRID[1], 1 - (row + 1) / ART_GRID[0])
    return low, (low[0] + 1 / ART_GRID[1], low[1] + 1 / ART_GRID[0])


def _ink(rng: Rng) -> tuple[float, float, float]:
    r, g, b = (float(x) for x in linear(_INKS[int(rng.integers(len(_INKS)))]))
    return r, g, b


def _write(
    picture: Floats, words: str, at: tuple[int, int], font: int, size: float, ink: Floats
) -> None:
    """Write text on a picture; OpenCV writes on bytes only."""
    mask = np.zeros(picture.shape[:2], np.uint8)
    cv2.putText(mask, words, at, font, size, 255, 4, cv2.LINE_AA)
    picture[:] = mix(picture, ink, np.asarray(mask / 255, np.float32))


def _landscape(rng: Rng) -> Floats:
    side = _CELL
    height = np.asarray(np.linspace(0, 1, side)[:, None], np.float32)
    warm, cold = np.array(_ink(rng)), linear("#b9c9cf")
    fade = np.repeat(height, side, axis=1).astype(np.float32)
    picture = mix(cold, (0.5 * warm + 0.5).astype(np.float32), fade)
    for layer in range(6):
        ridge = fractal(rng, (1, side), (1, 2 + layer), 0.6)[0] * 0.045 + 0.35 + 0.1 * layer
        below = smooth(-0.004, 0.004, height - ridge[None])
        shade = np.array(_ink(rng)) * (0.9 - 0.1 * layer)
        picture = mix(picture, (0.5 * shade + 0.05).astype(np.float32), below)
    return np.asarray(
        picture * np.exp(0.08 * fractal(rng, (side, side), (60, 20)))[..., None], np.float32
    )


def _blocks(rng: Rng) -> Floats:
    picture = np.full((_CELL, _CELL, 3), linear("#ded3bb"))
    for _ in range(26):
        x, y = rng.integers(0, _CELL, 2)
        w, h = rng.integers(20, 190, 2)
        cv2.rectangle(picture, (int(x), int(y)), (int(x + w), int(y + h)), _ink(rng), -1)
        if rng.random() < 0.5:
            cv2.rectangle(picture, (int(x), int(y)), (int(x + w), int(y + h)), (0.02,) * 3, 5)
    return np.asarray(
        picture * np.exp(0.06 * fractal(rng, (_CELL, _CELL), (40, 40)))[..., None], np.float32
    )


def _circles(rng: Rng) -> Floats:
    picture = np.full((_CELL, _CELL, 3), np.array(_ink(rng), np.float32) * 0.6 + 0.25, np.float32)
    for _ in range(22):
        x, y = rng.integers(0, _CELL, 2)
        r = int(rng.integers(10, 110))
        width = -1 if rng.random() < 0.5 else int(rng.integers(3, 16))
        cv2.circle(picture, (int(x), int(y)), r, _ink(rng), width, cv2.LINE_AA)
    for _ in range(9):
        a, b = rng.integers(0, _CELL, 2), rng.integers(0, _CELL, 2)
        cv2.line(
            picture, (int(a[0]), int(a[1])), (int(b[0]), int(b[1])), (0.03,) * 3, 3, cv2.LINE_AA
        )
    return np.asarray(
        picture * np.exp(0.07 * fractal(rng, (_CELL, _CELL), (40, 40)))[..., None], np.float32
    )


def _still_life(rng: Rng) -> Floats:
    picture = (
        np.array(linear("#3a3028")) * np.exp(0.35 * fractal(rng, (_CELL, _CELL), (5, 5)))[..., None]
    )
    picture = np.ascontiguousarray(picture, np.float32)
    cv2.rectangle(picture, (0, 350), (_CELL, _CELL), tuple(float(x) for x in linear("#7a5a3c")), -1)
    for _ in range(11):
        x, y, r = int(rng.integers(60, 450)), int(rng.integers(290, 390)), int(rng.integers(24, 62))
        colour = np.array(_ink(rng))
        for step in range(10):
            tone = colour * (0.35 + 0.9 * step / 9)
            away = step * r // 28
            cv2.circle(
                picture, (x - away, y - away), max(2, r - step * r // 10),
                tuple(float(t) for t in tone), -1, cv2.LINE_AA,
            )  # fmt: skip
    return np.asarray(
        picture * np.exp(0.1 * fractal(rng, (_CELL, _CELL), (30, 60)))[..., None], np.float32
    )


def _poster(rng: Rng, words: tuple[str, ...]) -> Floats:
    paper = np.array(linear("#e3d9c2"), np.float32)
    picture = np.full((_CELL, _CELL, 3), paper, np.float32)
    ink = _ink(rng)
    cv2.circle(picture, (256, 170), 120, ink, -1, cv2.LINE_AA)
    cv2.ellipse(
        picture,
        (256, 170),
        (170, 60),
        float(rng.uniform(0, 180)),
        0,
        360,
        _ink(rng),
        14,
        cv2.LINE_AA,
    )
    for row, word in enumerate(words):
        size = cv2.getTextSize(word, cv2.FONT_HERSHEY_TRIPLEX, 1.9, 4)[0][0]
        at = ((_CELL - size) // 2, 350 + 62 * row)
        _write(picture, word, at, cv2.FONT_HERSHEY_TRIPLEX, 1.9, linear("#202226"))
    return np.asarray(
        picture * np.exp(0.05 * fractal(rng, (_CELL, _CELL), (10, 10)))[..., None], np.float32
    )


def art(rng: Rng) -> Floats:
    """Return fifteen invented pictures in one map."""
    made = [
        _landscape(rng), _blocks(rng), _poster(rng, ("GALLERY", "IN THE", "COURT")), _circles(rng),
        _still_life(rng), _landscape(rng), _poster(rng, ("LIGHT", "STUDIES")), _blocks(rng),
        _still_life(rng), _circles(rng), _landscape(rng), _circles(rng),
        _poster(rng, ("COFFEE", "& PRINTS")), _landscape(rng), _blocks(rng),
    ]  # fmt: skip
    rows = [np.concatenate(made[i : i + 5], axis=1) for i in (0, 5, 10)]
    return np.asarray(np.clip(np.concatenate(rows), 0.01, 0.9), np.float32)


def spines(rng: Rng) -> Floats:
    """Return backs of books, side by side, each 16 pixels wide and 256 high."""
    width, height = 24, 256
    picture = np.zeros((height, width * SPINES, 3), np.float32)
    for index in range(SPINES):
        spine = np.full((height, width, 3), np.array(_ink(rng)) * rng.uniform(0.5, 1.1), np.float32)
        light = tuple(float(x) for x in linear("#d9c79a") * rng.uniform(0.5, 1.0))
        for y in sorted(rng.integers(10, 246, int(rng.integers(2, 6)))):
            cv2.line(spine, (0, int(y)), (width, int(y)), light, int(rng.integers(1, 5)))
        for y in range(60, int(rng.integers(100, 200)), 9):
            if rng.random() < 0.8:
                cv2.line(spine, (7, y), (16, y + int(rng.integers(0, 4))), light, 3)
        across = np.linspace(-1, 1, width, dtype=np.float32)
        spine *= (0.6 + 0.4 * np.sqrt(1 - 0.9 * across**2))[None, :, None]
        picture[:, index * width : (index + 1) * width] = spine
    worn = picture * np.exp(0.1 * fractal(rng, picture.shape[:2], (20, 160)))[..., None]
    return np.asarray(np.clip(worn, 0.01, 0.9), np.float32)


def menu(rng: Rng) -> Floats:
    """Return a slate with the day's menu in chalk."""
    height, width = 768, 1024
    slate = linear("#23282a") * np.exp(0.25 * fractal(rng, (height, width), (4, 4), 0.6))[..., None]
    picture = np.ascontiguousarray(slate, np.float32)
    chalk = (0.62, 0.6, 0.55)
    lines = (
        "TODAY", "espresso .......... 2.4", "flat white ........ 3.6", "lemon tart ........ 4.8",
        "soup & bread ...... 7.5", "plum cake ......... 4.2", "open until the light goes",
    )  # fmt: skip
    for row, line in enumerate(lines):
        at = (60 + 8 * (row % 2), 120 + 96 * row)
        font = cv2.FONT_HERSHEY_SCRIPT_COMPLEX
        _write(picture, line, at, font, 2.6 if row == 0 else 1.55, np.array(chalk, np.float32))
    cv2.line(picture, (60, 150), (420, 142), chalk, 4, cv2.LINE_AA)
    grain = fractal(rng, (height, width), (200, 200), 0.8)
    worn = picture * np.exp(0.2 * grain)[..., None]
    return np.asarray(np.clip(worn, 0.01, 0.8), np.float32)
