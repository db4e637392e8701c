"""The court: paving, three façades, a garden wall, trees, and the town beyond."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Final

import numpy as np

from scenes.demo_location.furniture import chair, table
from scenes.demo_location.hall import BACK, HEIGHT, SIDE
from scenes.demo_location.mesh import box, grid, lathe, quads, tube, wall
from scenes.demo_location.plants import climber, potted, tree

if TYPE_CHECKING:
    from scenes.demo_location.place import Place

__all__ = ["add_court"]

_LEFT: Final = -10.0
_FAR: Final = 14.0
_RIGHT: Final = 11.0
_Hole = tuple[float, float, float, float, float]


def add_court(place: Place) -> None:
    """Add everything outdoors."""
    _ground(place)
    _hall_outside(place)
    _far_house(place)
    _left_house(place)
    _garden_wall(place)
    _things(place)
    _town(place)


def _ground(place: Place) -> None:
    x0, x1 = _LEFT, _RIGHT
    u = np.linspace(x0, x1, 90)
    v = np.linspace(2.4, _FAR + 0.2, 60)
    x, z = np.meshgrid(u, v)
    dip = -0.05 + 0.03 * np.cos(0.9 * x + 0.4 * z) * np.cos(0.7 * z)
    place.add(
        "cobbles",
        grid(np.stack([x, np.where(z < 2.5, -0.02, dip), z], 2)[::-1], np.stack([x, z], 2)[::-1]),
    )
    place.add("flags", quads([[[x0, 0, 0], [x0, 0, 2.4], [x1, 0, 2.4], [x1, 0, 0]]]))
    for a in np.arange(x0, x1, 1.05):
        place.block("stone", (a, a + 1.045), (-0.12, 0.005), (2.3, 2.52), 0.015)
    place.add(
        "flags", quads([[[SIDE, 0, BACK - 4], [SIDE, 0, 0], [_RIGHT, 0, 0], [_RIGHT, 0, BACK - 4]]])
    )
    far = 160.0
    place.add(
        "grass",
        quads([[[-far, -0.15, -far], [-far, -0.15, far], [far, -0.15, far], [far, -0.15, -far]]]),
    )


def _window(place: Place, hole: _Hole, shutters: bool, thick: float, trim: str) -> Place:
    """Return a glazed window in a wall whose outside is z = `thick`."""
    x0, x1, y0, y1, rise = hole
    made = place.fresh()
    z = thick - 0.16
    top = y1 + rise
    made.add("glass", quads([[[x0, y0, z], [x1, y0, z], [x1, top, z], [x0, top, z]]]))
    wood = "paint"
    for a in (x0, (x0 + x1) / 2 - 0.03, x1 - 0.06):
        made.block(wood, (a, a + 0.06), (y0, top), (z, z + 0.05), 0.008, "y")
    for y in np.linspace(y0, y1, 4):
        made.block(wood, (x0, x1), (y - 0.02, y + 0.02), (z, z + 0.045), 0.006, "x")
    made.block(trim, (x0 - 0.14, x1 + 0.14), (y0 - 0.13, y0), (thick - 0.1, thick + 0.12), 0.02)
    for a in (x0 - 0.15, x1):
        made.block(trim, (a, a + 0.15), (y0, y1), (thick - 0.12, thick + 0.035), 0.012)
    if rise <= 0:
        made.block(trim, (x0 - 0.2, x1 + 0.2), (y1, y1 + 0.2), (thick - 0.12, thick + 0.06), 0.015)
    if shutters:
        half = (x1 - x0) / 2
        for s in (-1, 1):
            edge = x0 - 0.02 if s < 0 else x1 + 0.02
            swing = float(place.rng.uniform(4, 35))
            leaf = _shutter(place, half, y1 - y0)
            made.placed(leaf, 180 + swing if s < 0 else -swing, (edge, y0, thick + 0.05))
    return made


def _shutter(place: Place, width: float, height: float) -> Place:
    made = place.fresh()
    for a in (0.0, width - 0.06):
        made.block("blue-wood", (a, a + 0.06), (0, height), (-0.02, 0.02), 0.006, "y")
    for y in (0.0, height / 2 - 0.03, height - 0.06):
        made.block("blue-wood", (0.05, width - 0.05), (y, y + 0.06), (-0.018, 0.018), 0.006, "x")
    for y in np.arange(0.09, height - 0.08, 0.055):
        slat = box((0.05, width - 0.05), (-0.02, 0.02), (-0.005, 0.005), 0.002, "x").turned(35, "x")
        made.add("blue-wood", slat.moved(0, float(y), 0), shuffle=True)
    return made


def _house(
    place: Place,
    length: float,
    height: float,
    holes: list[_Hole],
    skin: str,
    shut: float,
    trim: str,
    depth: float = 4.35,
) -> Place:
    """Return a house front, outside at z = 0.4, with windows, plinth, string course and cornice."""
    made = place.fresh()
    floors = sorted({hole[2] for hole in holes})
    levels = [0.0, *[y - 0.75 for y in floors[1:]], height]
    for low, high in itertools.pairwise(levels):
        row = [(a, b, c - low, d - low, e) for a, b, c, d, e in holes if low <= c < high]
        _, outside, reveals = wall(length, high - low, 0.4, row)
        made.add(skin, outside.moved(0, low, 0).mapped((0, low)))
        made.add(trim, reveals.moved(0, low, 0))
        if low > 0:
            made.block(trim, (0, length), (low - 0.1, low + 0.08), (0.3, 0.47), 0.02)
    for hole in holes:
        made.placed(
            _window(place, hole, hole[2] > 2 and place.rng.random() < shut, 0.4, trim), 0, (0, 0, 0)
        )
    if holes[0][2] > 0.5:
        made.block(trim, (0, length), (0, 0.55), (0.3, 0.46), 0.025)
    for k, out in enumerate((0.08, 0.17, 0.28)):
        made.block(
            trim,
            (-0.1, length + 0.1),
            (height - 0.3 + 0.1 * k, height - 0.2 + 0.1 * k),
            (0.3, 0.4 + out),
            0.02,
        )
    for x in np.arange(0.4, length, 0.8):
        made.block(trim, (x, x + 0.13), (height - 0.38, height - 0.12), (0.35, 0.6), 0.015)
    low, high, back = height - 0.02, height + 0.6 * depth, 0.75 - depth
    a, b = -0.3, length + 0.3
    made.add("roof", quads([[[a, low, 0.75], [b, low, 0.75], [b, high, back], [a, high, back]]]))
    pipe = [
        [length - 0.5, 0.1, 0.5],
        [length - 0.5, height - 0.4, 0.5],
        [length - 0.5, height - 0.1, 0.7],
    ]
    made.add("iron", tube(pipe, 0.05, 12))
    made.add(
        "iron", tube([[-0.2, height + 0.02, 0.76], [length + 0.2, height + 0.02, 0.76]], 0.07, 12)
    )
    return made


def _far_house(place: Place) -> None:
    length = _RIGHT - _LEFT + 0.6
    holes: list[_Hole] = [(1.0 + 3.3 * k, 3.2 + 3.3 * k, 0.0, 2.3, 0.75) for k in range(6)]
    holes += [(1.5 + 3.3 * k, 2.7 + 3.3 * k, 4.4, 6.5, 0.0) for k in range(6)]
    made = _house(place, length, 8.2, holes, "ochre", 0.8, "stone")
    for k in (1, 2, 4):
        _flower_box(made, 1.5 + 3.3 * k, 4.3)
    for k in range(6):
        x = 0.55 + 3.3 * k
        made.block("stone", (x - 0.22, x + 0.22), (0, 4.0), (0.38, 0.5), 0.03)
    for x in (3.75, 13.65):
        _lantern(made, x, 2.7)
    place.placed(made, 180, (_RIGHT + 0.3, 0, _FAR + 0.4))


def _left_house(place: Place) -> None:
    length = _FAR + 0.2
    holes: list[_Hole] = [(1.1 + 2.7 * k, 2.3 + 2.7 * k, 1.0, 2.9, 0.0) for k in range(5)]
    holes[2] = (6.4, 7.9, 0.0, 2.6, 0.4)
    holes += [(1.15 + 2.7 * k, 2.25 + 2.7 * k, 4.4, 6.2, 0.0) for k in range(5)]
    made = _house(place, length, 7.4, holes, "rose", 0.75, "stone")
    for k in (0, 3):
        _flower_box(made, 1.15 + 2.7 * k, 4.3)
    made.placed(climber(place, 4.6, 6.6, 9000), 0, (8.9, 0, 0.4))
    _lantern(made, 5.6, 2.5)
    place.placed(made, 90, (_LEFT - 0.4, 0, length))


def _hall_outside(place: Place) -> None:
    rows: list[_Hole] = [(0.9 + 2.75 * k, 2.1 + 2.75 * k, 1.0, 2.7, 0.0) for k in range(5)]
    made = _house(place, 2 * SIDE, 3.7, rows, "brick", 0.6, "stone", 2.2)
    for k in (1, 3):
        _flower_box(made, 0.9 + 2.75 * k, 0.9)
    place.placed(made, 0, (-SIDE, HEIGHT, -0.4))
    x0, x1 = -3.1, 3.1
    for x in np.linspace(x0 + 0.15, x1 - 0.15, 15):
        tilt = -(x / 3.1) * 12
        stone = box((-0.19, 0.19), (0, 0.55), (-0.03, 0.07), 0.015).turned(float(tilt), "z")
        rise = 0.35 * (1 - (x / 3.1) ** 2)
        place.add("stone", stone.moved(float(x), 3.2 + float(rise), 0.0), shuffle=True)
    for x in (-3.7, 3.7):
        made = place.fresh()
        _lantern(made, 0, 2.6)
        place.placed(made, 0, (x, 0, -0.4))
    place.add("rose", quads([[[_LEFT, 0, 0], [-SIDE, 0, 0], [-SIDE, 6.0, 0], [_LEFT, 6.0, 0]]]))
    tops = [
        [
            [-SIDE - 0.4, HEIGHT + 0.1, BACK - 1],
            [-SIDE - 0.4, 5.7, BACK - 1],
            [SIDE + 0.4, 5.7, BACK - 1],
            [SIDE + 0.4, HEIGHT + 0.1, BACK - 1],
        ]
    ]
    place.add("brick", quads(tops))
    side = [
        [
            [SIDE + 0.5, HEIGHT, 0],
            [SIDE + 0.5, HEIGHT, BACK],
            [SIDE + 0.5, 8.3, BACK],
            [SIDE + 0.5, 8.3, 0],
        ]
    ]
    place.add("brick", quads(side))


def _flower_box(place: Place, x: float, y: float) -> None:
    place.block("terracotta", (x, x + 1.2), (y, y + 0.18), (0.42, 0.64), 0.02)
    made = place.fresh()
    for k in range(3):
        potted(made, (x + 0.2 + 0.4 * k, y - 0.1, 0.53), 0.13, 0.3, "flowers")
    for shape in made.parts["leaf"]:
        place.add("leaf", shape)


def _lantern(place: Place, x: float, y: float) -> None:
    place.add("iron", tube([[x, y + 0.35, 0.4], [x, y + 0.42, 0.6], [x, y + 0.3, 0.66]], 0.014))
    body = [(0.03, y), (0.06, y + 0.02), (0.1, y + 0.22), (0.11, y + 0.23), (0.02, y + 0.31)]
    place.add("iron", lathe(body, 6, 10).moved(x, 0, 0.66))


def _garden_wall(place: Place) -> None:
    z0, z1, top = BACK - 3.5, _FAR, 2.9
    face = [[[_RIGHT, 0, z0], [_RIGHT, 0, z1], [_RIGHT, top, z1], [_RIGHT, top, z0]]]
    place.add("brick-pale", quads(face))
    place.add(
        "brick-pale",
        quads(
            [
                [
                    [SIDE, 0, BACK - 3.4],
                    [_RIGHT, 0, BACK - 3.4],
                    [_RIGHT, top, BACK - 3.4],
                    [SIDE, top, BACK - 3.4],
                ]
            ]
        ),
    )
    for z in np.arange(z0, z1, 0.62):
        place.block("stone", (_RIGHT - 0.08, _RIGHT + 0.45), (top, top + 0.09), (z, z + 0.61), 0.02)
    for z in np.arange(-6.5, z1, 3.4):
        place.block(
            "brick-pale", (_RIGHT - 0.2, _RIGHT + 0.1), (0, top + 0.05), (z - 0.25, z + 0.25), 0.01
        )
        place.block(
            "stone",
            (_RIGHT - 0.28, _RIGHT + 0.5),
            (top + 0.05, top + 0.22),
            (z - 0.33, z + 0.33),
            0.03,
        )
    ivy = climber(place, 5.5, 2.8, 5200)
    place.placed(ivy, -90, (_RIGHT - 0.02, 0, 3.8))
    place.placed(climber(place, 4.0, 2.7, 3500), -90, (_RIGHT - 0.02, 0, -7.6))


def _things(place: Place) -> None:
    """Add the well, pots, parasol, tables and a bench."""
    well = [(0.95, 0), (1.0, 0.02), (0.92, 0.1), (0.9, 0.62), (0.98, 0.68), (1.0, 0.74),
        (0.96, 0.8), (0.74, 0.8),
            (0.7, 0.76), (0.7, 0.5), (0.01, 0.5)]  # fmt: skip
    place.add("stone", lathe(well, 56).moved(-5.6, -0.06, 8.6))
    for s in (-1, 1):
        place.add(
            "iron",
            tube(
                [[-5.6 + s * 0.85, 0.7, 8.6], [-5.6 + s * 0.8, 1.9, 8.6], [-5.6, 2.35, 8.6]], 0.025
            ),
        )
    for at, r, h, kind in (
        ((-3.9, 0, 0.55), 0.3, 1.3, "olive"), ((4.1, 0, 0.6), 0.32, 0.75, "flowers"),
        ((5.6, 0, 0.5), 0.24, 0.6, "bush"),
        ((-5.4, 0, 0.55), 0.26, 0.8, "grass"), ((-6.4, 0, 0.6), 0.2, 0.5, "flowers"),
        ((10.3, 0, 1.2), 0.4, 1.6, "olive"),
        ((10.4, -0.05, 4.4), 0.33, 0.9, "bush"), ((-9.2, -0.05, 4.6), 0.35, 1.2, "broad"),
        ((-9.3, -0.05, 6.4), 0.25, 0.6, "flowers"),
        ((-9.2, 0, 1.2), 0.3, 0.9, "grass"), ((1.9, -0.06, 12.9), 0.4, 1.5, "olive"),
        ((5.2, -0.06, 13.0), 0.35, 0.9, "bush"),
        ((-4.8, -0.06, 13.0), 0.4, 1.5, "olive"), ((9.9, 0, -2.4), 0.3, 0.9, "bush"),
        ((9.8, 0, -5.6), 0.3, 1.2, "grass"),
        ((8.4, -0.06, 12.6), 0.5, 1.2, "grass"), ((10.2, 0, -3.9), 0.25, 0.7, "flowers"),
    ):  # fmt: skip
        potted(place, at, r, h, kind)
    _parasol(place, 6.4, 4.2)
    for x, z, y in ((6.9, 4.7, -0.04), (-4.6, 3.6, -0.04), (8.4, 7.6, -0.05), (-7.2, 1.4, 0.0)):
        table(place, x, z, y)
        for k in range(3):
            a = np.radians(40 + 122 * k + place.rng.uniform(-20, 20))
            chair(place, x + 0.68 * np.sin(a), z + 0.68 * np.cos(a), np.degrees(a) + 180, y)
    for k in range(5):
        place.block(
            "oak", (0.2, 2.4), (0.43, 0.46), (12.5 + 0.09 * k, 12.57 + 0.09 * k), 0.006, "x"
        )
    for k in range(3):
        place.block(
            "oak", (0.2, 2.4), (0.58 + 0.12 * k, 0.66 + 0.12 * k), (12.98, 13.01), 0.006, "x"
        )
    for x in (0.4, 2.15):
        place.block("iron", (x, x + 0.05), (-0.08, 0.43), (12.55, 12.6), 0.01)
        place.block("iron", (x, x + 0.05), (-0.08, 0.95), (13.0, 13.05), 0.01)


def _parasol(place: Place, x: float, z: float) -> None:
    a = np.linspace(0, 2 * np.pi, 97)
    rows = []
    for r in np.linspace(0.02, 1.55, 14):
        sag = 0.09 * r**2 * np.abs(np.sin(4 * a)) ** 1.5
        rows.append(np.stack([x + r * np.cos(a), 2.75 - 0.36 * r - sag, z + r * np.sin(a)], axis=1))
    for out, drop in ((1.56, 0.04), (1.57, 0.2)):
        sag = 0.09 * 1.55**2 * np.abs(np.sin(4 * a)) ** 1.5
        rows.append(np.stack([x + out * np.cos(a), 2.19 - sag - drop, z + out * np.sin(a)], axis=1))
    place.add("canvas", grid(np.array(rows), closed=True))
    place.add("oak", tube([[x, 0, z], [x, 2.85, z]], 0.024))
    place.add(
        "stone", lathe([(0.3, -0.05), (0.3, 0.06), (0.25, 0.1), (0.04, 0.12)], 32).moved(x, 0, z)
    )


def _town(place: Place) -> None:
    for at, h, s, n in (
        ((14.6, 0, 3.0), 7.4, 3.0, 15000), ((15.5, 0, 10.5), 8.6, 3.4, 15000),
        ((14.4, 0, -4.8), 6.2, 2.6, 11000),
        ((20.0, 0, -1.0), 9.0, 3.6, 9000),
    ):  # fmt: skip
        tree(place, at, h, s, n)
    x, z = 27.0, 20.0
    place.block("ochre", (x - 2.2, x + 2.2), (0, 15), (z - 2.2, z + 2.2), 0.05)
    for y in (6.0, 11.4, 14.8):
        place.block("stone", (x - 2.4, x + 2.4), (y, y + 0.3), (z - 2.4, z + 2.4), 0.05)
    for s in (-0.9, 0.9):
        place.block("glass", (x - 2.25, x + 2.25), (12.2, 14.2), (z + s - 0.45, z + s + 0.45), 0.02)
        place.block("glass", (x + s - 0.45, x + s + 0.45), (12.2, 14.2), (z - 2.25, z + 2.25), 0.02)
    place.add(
        "roof",
        lathe([(3.1, 15), (2.9, 15.3), (1.6, 18.0), (0.05, 21.5)], 4, 10).turned(45).moved(x, 0, z),
    )
    for x0, length, low, h, skin in (
        (24.0, 14.0, -6.0, 7.5, "plaster"),
        (20.0, 11.0, 26.0, 9.0, "rose"),
        (-4.0, 13.0, 33.0, 12.0, "plaster"),
    ):
        place.block(skin, (x0, x0 + 8), (0, h), (low, low + length), 0.03)
        place.block(
            "roof", (x0 - 0.4, x0 + 8.4), (h, h + 0.35), (low - 0.4, low + length + 0.4), 0.1
        )
        for k in np.arange(low + 1.2, low + length - 1, 2.1):
            for y in np.arange(1.2, h - 1.5, 2.9):
                place.block("glass", (x0 - 0.02, x0 + 1), (y, y + 1.5), (k, k + 0.95), 0.01)
