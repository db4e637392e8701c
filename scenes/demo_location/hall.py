"""The hall: walls, floor, beams, panelling, windows and the wide doors to the court."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Final

import numpy as np

from scenes.demo_location.mesh import box, grid, quads, tube, wall

if TYPE_CHECKING:
    from scenes.demo_location.place import Place, Span

__all__ = ["BACK", "DOOR", "HEIGHT", "SIDE", "SKYLIGHT", "add_hall", "openings"]

SIDE: Final = 7.0
BACK: Final = -9.5
FRONT: Final = -0.5
HEIGHT: Final = 4.6
DOOR: Final = (-3.1, 3.1, 0.0, 3.2, 0.35)
_FRONT_WINDOWS: Final = ((-6.1, -4.3, 0.95, 3.0, 0.45), (4.3, 6.1, 0.95, 3.0, 0.45))
SKYLIGHT: Final = (-2.6, 2.6, -8.4, -5.7)  # x and z
_SIDE_WINDOWS: Final = ((2.0, 3.7, 0.85, 3.2, 0.4), (5.5, 7.2, 0.85, 3.2, 0.4))


def openings() -> list[tuple[np.ndarray, float]]:
    """Return rectangles that emit light (corner and two edges, building), and their brightness.

    They are the openings, and the two sunlit patches on floor and back wall.
    """
    found = []
    for x0, x1, y0, y1, rise in (DOOR, *_FRONT_WINDOWS):
        corner = [x0, y0, -0.25]
        found.append((np.array([corner, [x1 - x0, 0, 0], [0, y1 + rise - y0, 0]]), 5.0))
    for x0, x1, y0, y1, rise in _SIDE_WINDOWS:
        corner = [SIDE + 0.25, y0, FRONT - x1]
        found.append((np.array([corner, [0, 0, x1 - x0], [0, y1 + rise - y0, 0]]), 4.0))
    x0, x1, z0, z1 = SKYLIGHT
    corner = [x0, HEIGHT + 0.02, z0]
    found.append((np.array([corner, [x1 - x0, 0, 0], [0, 0, z1 - z0]]), 4.0))
    found.append((np.array([[-4.6, 0.02, -2.5], [7.4, 0, 0], [0, 0, 2.3]]), 9.0))
    found.append((np.array([[-5.8, 0.3, BACK + 0.15], [6.6, 0, 0], [0, 2.7, 0]]), 2.5))
    return found


def add_hall(place: Place) -> None:
    """Add the hall without its furniture."""
    _floor_and_ceiling(place)
    _walls(place)
    _beams(place)
    _panelling(place)
    _doors(place)
    _curtains(place)


def _floor_and_ceiling(place: Place) -> None:
    s, b = SIDE, BACK
    place.add("floor", quads([[[-s, 0, b], [-s, 0, -0.5], [s, 0, -0.5], [s, 0, b]]]))
    place.block("stone", (DOOR[0], DOOR[1]), (-0.1, 0.012), (-0.52, 0.04), 0.01)
    h = HEIGHT
    x0, x1, z0, z1 = SKYLIGHT
    for left, right, near, far in (
        (-s, s, z1, 0), (-s, s, b, z0), (-s, x0, z0, z1), (x1, s, z0, z1)
    ):  # fmt: skip
        piece = [[left, h, near], [right, h, near], [right, h, far], [left, h, far]]
        place.add("boards", quads([piece], grain="z"))
    for x in (x0 - 0.06, x1):
        place.block("plaster", (x, x + 0.06), (h - 0.03, h + 0.45), (z0 - 0.06, z1 + 0.06), 0.008)
    for z in (z0 - 0.06, z1):
        place.block("plaster", (x0, x1), (h - 0.03, h + 0.45), (z, z + 0.06), 0.008)
    for x in np.linspace(x0, x1, 7)[1:-1]:
        place.block("iron", (x - 0.02, x + 0.02), (h + 0.38, h + 0.44), (z0, z1), 0.005, "z")
    for z in np.linspace(z0, z1, 4)[1:-1]:
        place.block("iron", (x0, x1), (h + 0.39, h + 0.43), (z - 0.015, z + 0.015), 0.005, "x")


def _walls(place: Place) -> None:
    depth = FRONT - BACK
    shifted = [(a + SIDE, b + SIDE, c, d, e) for a, b, c, d, e in (DOOR, *_FRONT_WINDOWS)]
    inside, outside, reveals = wall(2 * SIDE, HEIGHT, 0.5, shifted)
    place.add("plaster", inside.moved(-SIDE, 0, FRONT))
    place.add("brick", outside.moved(-SIDE, 0, FRONT))
    place.add("stone", reveals.moved(-SIDE, 0, FRONT))
    inside, outside, reveals = wall(depth, HEIGHT, 0.5, list(_SIDE_WINDOWS))
    place.add("plaster", inside.turned(90).moved(SIDE, 0, FRONT).mapped((1.7, 0.3)))
    place.add("brick", outside.turned(90).moved(SIDE, 0, FRONT))
    place.add("stone", reveals.turned(90).moved(SIDE, 0, FRONT))
    inside, _, _ = wall(depth, HEIGHT, 0.5, [])
    place.add("plaster", inside.turned(-90).moved(-SIDE, 0, BACK).mapped((3.1, 2.2)))
    inside, _, _ = wall(2 * SIDE, HEIGHT, 0.5, [])
    place.add("brick", inside.turned(180).moved(SIDE, 0, BACK).mapped((0.4, 0.0)))
    for x0, x1, y0, y1, rise in _FRONT_WINDOWS:
        _casement(place, "front", (x0, x1), y0, y1, rise)
    for x0, x1, y0, y1, rise in _SIDE_WINDOWS:
        _casement(place, "side", (x0, x1), y0, y1, rise)


def _casement(place: Place, where: str, x: Span, y0: float, y1: float, rise: float) -> None:
    """Add a window without glass: frame, glazing bars, board inside and sill outside."""
    made = place.fresh()
    width = x[1] - x[0]
    for a in (0.0, width - 0.07):
        made.block("green-wood", (a, a + 0.07), (y0, y1 + 0.02), (0.2, 0.28), 0.008, "y")
    made.block("green-wood", (0, width), (y0, y0 + 0.09), (0.19, 0.29), 0.008, "x")
    made.block(
        "green-wood",
        (width / 2 - 0.045, width / 2 + 0.045),
        (y0, y1 + rise),
        (0.2, 0.28),
        0.01,
        "y",
    )
    for a in (width / 4, 3 * width / 4):
        made.block(
            "green-wood", (a - 0.014, a + 0.014), (y0, y1 + 0.8 * rise), (0.22, 0.26), 0.005, "y"
        )
    for k in range(1, 5):
        y = y0 + (y1 - y0) * k / 4
        thick = 0.05 if k == 4 else 0.014
        made.block("green-wood", (0, width), (y - thick, y + thick), (0.22, 0.26), 0.005, "x")
    made.block("oak", (-0.09, width + 0.09), (y0 - 0.05, y0), (-0.12, 0.2), 0.012, "x")
    made.block("stone", (-0.1, width + 0.1), (y0 - 0.12, y0), (0.3, 0.6), 0.015)
    if where == "front":
        place.placed(made, 0, (x[0], 0, FRONT))
    else:
        place.placed(made, 90, (SIDE, 0, FRONT - x[0]))


def _beams(place: Place) -> None:
    for x in np.arange(-6.3, 6.4, 1.4):
        drop = float(place.rng.uniform(-0.01, 0.01))
        place.block(
            "beam", (x - 0.1, x + 0.1), (HEIGHT - 0.26 + drop, HEIGHT), (BACK, FRONT), 0.018, "z"
        )
    low = HEIGHT - 0.62
    place.block("beam", (-SIDE, SIDE), (low, HEIGHT - 0.26), (-5.17, -4.83), 0.025, "x")
    for x in (-3.9, 3.9):
        place.block("beam", (x - 0.13, x + 0.13), (0.24, low), (-5.13, -4.87), 0.022, "y")
        place.block("stone", (x - 0.2, x + 0.2), (0.0, 0.25), (-5.2, -4.8), 0.03)
        for side in (-1, 1):
            brace = box((-0.07, 0.07), (0, 1.15), (-0.07, 0.07), 0.012, "y").turned(
                -side * 45.0, "z"
            )
            place.add("beam", brace.moved(x + side * 0.1, low - 0.85, -5.0), shuffle=True)


def _run(place: Place, length: float, height: float, gaps: list[Span]) -> Place:
    """Return panelling along x on a wall with its inside at z = 0, facing -z; `gaps` stay open."""
    made = place.fresh()
    edges = sorted({0.0, length, *(g for gap in gaps for g in gap)})
    for a, b in itertools.pairwise(edges):
        if any(g[0] <= (a + b) / 2 <= g[1] for g in gaps) or b - a < 0.1:
            continue
        made.block("green-wood", (a, b), (0, height), (-0.022, 0.0), 0.003, "x")
        made.block("green-wood", (a, b), (0, 0.17), (-0.045, 0.0), 0.012, "x")
        made.block("green-wood", (a, b), (height - 0.03, height + 0.03), (-0.065, 0.0), 0.014, "x")
        count = max(1, round((b - a) / 0.75))
        step = (b - a) / count
        for k in range(count):
            left, right = a + k * step + 0.09, a + (k + 1) * step - 0.09
            if right - left > 0.1:
                made.block(
                    "green-wood", (left, right), (0.27, height - 0.13), (-0.04, 0), 0.018, "y"
                )
    return made


def _panelling(place: Place) -> None:
    depth = FRONT - BACK
    gaps = [(d[0] + SIDE, d[1] + SIDE) for d in (DOOR,)]
    place.placed(_run(place, 2 * SIDE, 0.9, gaps), 0, (-SIDE, 0, FRONT))
    place.placed(_run(place, depth, 0.8, []), 90, (SIDE, 0, FRONT))
    place.placed(_run(place, depth, 1.15, [(0.7, 4.9)]), -90, (-SIDE, 0, BACK))
    place.placed(_run(place, 2 * SIDE, 1.15, [(4.2, 11.0)]), 180, (SIDE, 0, BACK))
    for y, out in ((HEIGHT - 0.3, 0.06), (HEIGHT - 0.12, 0.13)):
        for a, b in (((-SIDE, -SIDE + out), (BACK, FRONT)), ((SIDE - out, SIDE), (BACK, FRONT))):
            place.block("plaster", a, (y, y + 0.09), b, 0.02)
        for z in ((BACK, BACK + out), (FRONT - out, FRONT)):
            place.block("plaster", (-SIDE, SIDE), (y, y + 0.09), z, 0.02)


def _leaf(place: Place, width: float, height: float) -> Place:
    """Return a glazed door leaf along x."""
    made = place.fresh()
    for a in (0.0, width - 0.09):
        made.block("green-wood", (a, a + 0.09), (0.02, height), (-0.025, 0.025), 0.008, "y")
    for y0, y1 in ((0.02, 0.2), (0.78, 0.9), (height - 0.11, height)):
        made.block("green-wood", (0.08, width - 0.08), (y0, y1), (-0.024, 0.024), 0.008, "x")
    made.block("green-wood", (0.08, width - 0.08), (0.18, 0.8), (-0.012, 0.012), 0.004, "y")
    for y in np.linspace(0.9, height - 0.11, 5)[1:-1]:
        made.block(
            "green-wood", (0.08, width - 0.08), (y - 0.013, y + 0.013), (-0.016, 0.016), 0.005, "x"
        )
    made.block(
        "green-wood", (width / 2 - 0.013, width / 2 + 0.013), (0.88, height), (-0.016, 0.016), 0.005
    )
    made.add("brass", tube([[width - 0.045, 1.0, 0.06], [width - 0.045, 1.18, 0.06]], 0.011))
    return made


def _doors(place: Place) -> None:
    for side in (-1, 1):
        x = side * 3.02
        place.placed(_leaf(place, 0.78, 3.1), -86 if side > 0 else -94, (x, 0, 0.02))
        place.placed(_leaf(place, 0.78, 3.1), -60 if side > 0 else -120, (x - side * 0.07, 0, 0.06))
        place.block(
            "stone", (x - 0.28 + side * 0.36, x + 0.28 + side * 0.36), (0, 0.3), (-0.02, 0.1), 0.03
        )


def _curtains(place: Place) -> None:
    for x0, x1 in ((-4.15, -3.25), (3.25, 4.15)):
        u = np.linspace(0, 1, 160)
        v = np.linspace(0, 1, 30)
        tie = 1 - 0.25 * np.exp(-(((v - 0.68) / 0.16) ** 2))
        x = (x0 + x1) / 2 + (u[None] - 0.5) * (x1 - x0) * tie[:, None]
        fold = 0.055 * np.sin(
            2 * np.pi * 7 * u[None] + 0.8 * np.sin(9 * u[None]) + 0.5 * v[:, None]
        )
        y = 3.95 - 3.9 * v[:, None] + 0 * x
        place.add("linen", grid(np.stack([x, y, -0.66 + fold * (0.6 + 0.5 * v[:, None])], axis=2)))
    place.add("iron", tube([[-4.5, 4.0, -0.66], [4.5, 4.0, -0.66]], 0.016))
    for end in (-4.5, 4.5):
        place.block("iron", (end - 0.03, end + 0.03), (3.97, 4.03), (-0.69, -0.63), 0.02)
