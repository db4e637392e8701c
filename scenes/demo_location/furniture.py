"""The contents of the hall: bar, books, tables, pictures, lamps, plants."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Final

import numpy as np

from scenes.demo_location.hall import BACK, FRONT, HEIGHT, SIDE
from scenes.demo_location.mesh import box, grid, lathe, panel, quads, tube
from scenes.demo_location.noise import linear
from scenes.demo_location.pictures import SPINES, cell
from scenes.demo_location.plants import potted

if TYPE_CHECKING:
    from scenes.demo_location.place import Place

__all__ = ["BALLS", "add_furniture", "chair", "table"]

BALLS: Final = (  # material, centre and radius of every spherical lamp
    *(("globe", at, 0.16) for at in (
        (-4.6, 2.75, -3.0), (4.7, 2.75, -3.3), (-2.9, 2.6, -6.1), (3.1, 2.7, -5.9),
        (5.5, 2.6, -7.5),
    )),
    *(("bulb", (x, 2.21, -7.9), 0.045) for x in (-3.0, -1.0, 1.0)),
)  # fmt: skip
_GLAZES = ("#d8d2c4", "#c9b99a", "#8fa3a0", "#b5654a", "#5c7480", "#e2dccd")
_BOTTLES = ("#20301f", "#33401c", "#4a2a16", "#6d3b18", "#1d2a33", "#7a6a3a", "#3a1c1c")


def add_furniture(place: Place) -> None:
    """Furnish the hall, keeping 2.9 m around the first spot free."""
    _bar(place)
    _shelves(place)
    _seats(place)
    _pictures(place)
    _lamps(place)
    _corner(place)
    for at, r, h, kind in (
        ((-6.2, 0, -1.25), 0.27, 1.5, "olive"), ((6.2, 0, -1.3), 0.25, 1.1, "broad"),
        ((6.35, 0, -8.9), 0.24, 1.3, "broad"), ((-6.4, 0, -9.0), 0.22, 1.2, "olive"),
        ((6.3, 0, -4.85), 0.2, 0.7, "bush"), ((-2.9, 1.13, -7.75), 0.09, 0.3, "bush"),
    ):  # fmt: skip
        potted(place, at, r, h, kind)


def table(place: Place, x: float, z: float, y: float = 0.0) -> None:
    """Add a round café table with cups and a vase."""
    made = place.fresh()
    top = [
        (0.01, 0.715),
        (0.35, 0.715),
        (0.375, 0.722),
        (0.38, 0.735),
        (0.37, 0.75),
        (0.35, 0.755),
        (0.01, 0.755),
    ]
    made.add("oak", lathe(top, 48), shuffle=True)
    foot = [(0.27, 0), (0.27, 0.015), (0.2, 0.035), (0.06, 0.07), (0.032, 0.13), (0.028, 0.3),
        (0.04, 0.34),
            (0.028, 0.38), (0.028, 0.64), (0.06, 0.69), (0.14, 0.715)]  # fmt: skip
    made.add("iron", lathe(foot, 28))
    for _ in range(int(place.rng.integers(1, 4))):
        a, r = place.rng.uniform(0, 6.28), place.rng.uniform(0.12, 0.27)
        made.placed(_cup(place), 0, (r * np.cos(a), 0.756, r * np.sin(a)))
    vase = [
        (0.02, 0),
        (0.035, 0.005),
        (0.042, 0.05),
        (0.024, 0.1),
        (0.02, 0.13),
        (0.026, 0.145),
        (0.02, 0.14),
    ]
    glaze = linear(_GLAZES[int(place.rng.integers(len(_GLAZES)))])
    made.add("tint", lathe(vase, 20).coloured(glaze).moved(0.03, 0.756, 0.02))
    place.placed(made, float(place.rng.uniform(0, 360)), (x, y, z))


def _cup(place: Place) -> Place:
    made = place.fresh()
    saucer = [
        (0.005, 0.0),
        (0.04, 0.001),
        (0.075, 0.012),
        (0.076, 0.015),
        (0.04, 0.006),
        (0.005, 0.005),
    ]
    cup = [
        (0.02, 0.006),
        (0.03, 0.01),
        (0.04, 0.035),
        (0.043, 0.062),
        (0.04, 0.062),
        (0.036, 0.035),
        (0.005, 0.016),
    ]
    glaze = linear(_GLAZES[int(place.rng.integers(len(_GLAZES)))])
    made.add("tint", lathe(saucer, 24).coloured(glaze), lathe(cup, 24).coloured(glaze))
    a = np.linspace(-1.4, 1.4, 8)
    ear = np.stack([0.04 + 0.02 * np.cos(a), 0.036 + 0.018 * np.sin(a), 0 * a], axis=1)
    made.add("tint", tube(ear, 0.004, 6).coloured(glaze))
    return made


def chair(place: Place, x: float, z: float, turn: float, y: float = 0.0) -> None:
    """Add a bentwood chair, its back toward -z before turning."""
    made = place.fresh()
    seat = [(0.01, 0.43), (0.19, 0.43), (0.21, 0.44), (0.21, 0.458), (0.195, 0.468), (0.01, 0.46)]
    made.add("beam", lathe(seat, 32), shuffle=True)
    k = np.linspace(0, 1, 8)[:, None]
    for sx in (-1, 1):
        front = np.array([[sx * 0.15, 0.44, 0.14]]) * (1 - k) + np.array([[sx * 0.19, 0, 0.2]]) * k
        made.add("beam", tube(front, 0.017, 8))
    a = np.linspace(0, np.pi, 28)
    arch = np.stack(
        [0.19 * np.cos(a), 0.5 + 0.42 * np.sin(a) ** 0.6, -0.19 - 0.12 * np.sin(a)], axis=1
    )
    legs = [np.array([[s * 0.2, 0, -0.27], [s * 0.195, 0.25, -0.21]]) for s in (1, -1)]
    made.add("beam", tube(np.concatenate([legs[0], arch, legs[1][::-1]]), 0.015, 8))
    inner = arch * [0.62, 1, 1] - [0, 0.06, -0.005]
    made.add("beam", tube(inner, 0.011, 8))
    b = np.linspace(0, 2 * np.pi, 30)
    hoop = np.stack([0.17 * np.cos(b), np.full(30, 0.24), 0.17 * np.sin(b)], axis=1)
    made.add("beam", tube(hoop, 0.009, 6))
    place.placed(made, turn, (x, y, z))


def _seats(place: Place) -> None:
    spots = ((4.7, -2.3), (5.6, -4.0), (-4.3, -2.7), (-2.9, -6.0), (1.2, -6.25), (5.5, -7.6))
    for x, z in spots:
        table(place, x, z)
        start = place.rng.uniform(0, 360)
        for k in range(int(place.rng.integers(2, 4))):
            a = np.radians(start + 125 * k + place.rng.uniform(-15, 15))
            far = place.rng.uniform(0.5, 0.66)
            chair(
                place,
                x + far * np.sin(a),
                z + far * np.cos(a),
                np.degrees(a) + 180 + place.rng.uniform(-20, 20),
            )


def _bottle(place: Place, scale: float) -> Place:
    made = place.fresh()
    shoulder = place.rng.uniform(0.17, 0.23)
    shape = [(0.005, 0), (0.034, 0.002), (0.037, 0.02), (0.037, shoulder - 0.03), (0.03, shoulder),
             (0.014, shoulder + 0.03), (0.013, 0.29), (0.016, 0.292), (0.016, 0.31),
             (0.004, 0.312)]  # fmt: skip
    colour = linear(_BOTTLES[int(place.rng.integers(len(_BOTTLES)))])
    made.add("tint-gloss", lathe(np.array(shape) * scale, 20).coloured(colour))
    label = [(0.0376, 0.06), (0.0376, shoulder - 0.05)]
    paper = linear(("#d9cfb4", "#c7a25a", "#e6e0d0", "#8a3a32")[int(place.rng.integers(4))])
    made.add("tint", lathe(np.array(label) * scale, 20).coloured(paper))
    return made


def _bar(place: Place) -> None:
    x0, x1 = -3.9, 1.9
    place.block("green-wood", (x0, x1), (0.0, 1.06), (-8.35, -7.65), 0.01, "x")
    place.block("oak", (x0 - 0.1, x1 + 0.1), (1.06, 1.12), (-8.45, -7.5), 0.02, "x")
    place.block("green-wood", (x0, x1), (0.0, 0.14), (-8.4, -7.62), 0.015, "x")
    count = 8
    for k in range(count):
        a = x0 + (x1 - x0) * k / count
        place.block("green-wood", (a + 0.09, a + 0.63), (0.25, 0.95), (-7.66, -7.63), 0.02, "y")
    place.add("brass", tube([[x0, 0.2, -7.45], [x1, 0.2, -7.45]], 0.022))
    for y in (1.5, 2.0, 2.5, 3.0):
        place.block("oak", (-3.7, 0.9), (y - 0.035, y), (BACK, BACK + 0.3), 0.008, "x")
        x = -3.6
        while x < 0.8:
            roll = place.rng.random()
            z = BACK + place.rng.uniform(0.1, 0.2)
            if roll < 0.72:
                place.placed(_bottle(place, place.rng.uniform(0.9, 1.15)), 0, (x, y, z))
            elif roll < 0.9:
                place.placed(_cup(place), place.rng.uniform(0, 360), (x, y, z))
            x += place.rng.uniform(0.08, 0.16)
    for x in (-3.7, -1.4, 0.86):
        place.block("iron", (x, x + 0.04), (1.12, 3.2), (BACK, BACK + 0.05), 0.006)
    _board(place, (1.15, 2.75), (1.75, 2.95), BACK + 0.03)
    _machine(place, -1.2, -8.05)
    for x in (-2.9, -0.2, 0.4, 1.3):
        place.placed(_cup(place), float(place.rng.uniform(0, 360)), (x, 1.121, -7.75))
    for x in (-3.2, -2.2, 0.3, 1.2):
        made = place.fresh()
        seat = [(0.01, 0.72), (0.16, 0.72), (0.175, 0.735), (0.17, 0.76), (0.01, 0.768)]
        made.add("oak", lathe(seat, 28), shuffle=True)
        for s in range(4):
            a = np.radians(45 + 90 * s)
            foot = [0.2 * np.cos(a), 0, 0.2 * np.sin(a)]
            made.add("iron", tube([foot, [0.1 * np.cos(a), 0.72, 0.1 * np.sin(a)]], 0.013))
        place.placed(made, float(place.rng.uniform(0, 90)), (x, 0, -7.05))


def _board(place: Place, x: tuple[float, float], y: tuple[float, float], z: float) -> None:
    made = panel([[x[0], y[0], z], [x[1], y[0], z], [x[1], y[1], z], [x[0], y[1], z]])
    place.add("menu", made)
    _frame(place, x, y, z, 0.06, "oak")


def _frame(
    place: Place, x: tuple[float, float], y: tuple[float, float], z: float, w: float, wood: str
) -> None:
    for a, b in (
        ((x[0] - w, x[0]), (y[0] - w, y[1] + w)),
        ((x[1], x[1] + w), (y[0] - w, y[1] + w)),
    ):
        place.block(wood, a, b, (z - 0.03, z + 0.02), 0.012, "y")
    for b in ((y[0] - w, y[0]), (y[1], y[1] + w)):
        place.block(wood, x, b, (z - 0.03, z + 0.02), 0.012, "x")


def _machine(place: Place, x: float, z: float) -> None:
    place.block("brass", (x - 0.42, x + 0.42), (1.2, 1.62), (z - 0.22, z + 0.2), 0.05)
    place.block("iron", (x - 0.46, x + 0.46), (1.12, 1.2), (z - 0.25, z + 0.28), 0.02)
    for k in (-0.25, 0.0, 0.25):
        place.add(
            "iron",
            lathe([(0.03, 1.36), (0.045, 1.38), (0.045, 1.44)], 18).moved(x + k, 0, z + 0.25),
        )
        place.add("beam", tube([[x + k, 1.38, z + 0.28], [x + k, 1.36, z + 0.42]], 0.014))
    for k in np.linspace(-0.35, 0.35, 7):
        cup = [(0.02, 1.62), (0.035, 1.63), (0.04, 1.69), (0.036, 1.69), (0.01, 1.64)]
        place.add("tint", lathe(cup, 18).coloured(linear("#d8d2c4")).moved(x + k, 0, z))


def _shelves(place: Place) -> None:
    """Add a wall of books on the left."""
    z0, z1, depth, top = -8.75, -4.7, 0.34, 3.5
    back = -SIDE
    place.block("oak", (back, back + 0.03), (0, top), (z0, z1), 0.004, "y")
    for z in np.linspace(z0, z1 - 0.035, 5):
        place.block("oak", (back, back + depth), (0, top), (float(z), float(z) + 0.035), 0.006, "y")
    rows = np.linspace(0.12, top, 8)
    for y in rows:
        place.block("oak", (back, back + depth), (float(y) - 0.035, float(y)), (z0, z1), 0.006, "z")
    place.block(
        "oak", (back, back + depth + 0.06), (top, top + 0.09), (z0 - 0.06, z1 + 0.06), 0.03, "z"
    )
    for y, above in itertools.pairwise(rows):
        for bay in np.linspace(z0, z1 - 0.035, 5)[:-1]:
            _books(place, back, float(y), float(above) - 0.05, float(bay) + 0.045, float(bay) + 1.0)


def _books(place: Place, x: float, y: float, limit: float, z: float, end: float) -> None:
    rng = place.rng
    while z < end - 0.06:
        if rng.random() < 0.07:
            z += rng.uniform(0.08, 0.25)
            continue
        if rng.random() < 0.02:
            shape = [
                (0.03, 0),
                (0.07, 0.02),
                (0.085, 0.1),
                (0.05, 0.17),
                (0.035, 0.2),
                (0.045, 0.22),
            ]
            glaze = linear(_GLAZES[int(rng.integers(len(_GLAZES)))])
            place.add("tint", lathe(shape, 24).coloured(glaze).moved(x + 0.2, y, z + 0.1))
            z += 0.2
            continue
        thick, tall = rng.uniform(0.016, 0.05), min(limit - y, rng.uniform(0.19, 0.36))
        front = x + rng.uniform(0.2, 0.27)
        made = box((x + 0.04, front), (y, y + tall), (z, z + thick - 0.002), 0.003)
        lean = rng.uniform(-6, 0) if rng.random() < 0.12 else 0.0
        shift = rng.integers(0, SPINES) / SPINES
        uv = np.stack(
            [shift + (made.v[:, 2] - z) / thick / SPINES * 0.98, (made.v[:, 1] - y) / tall], axis=1
        )
        made = type(made)(made.v, made.n, uv, made.f, made.c)
        if lean:
            made = made.moved(0, -y, -z).turned(lean, "x").moved(0, y, z)
        place.add("spines", made)
        z += thick + rng.uniform(0, 0.002)


def _pictures(place: Place) -> None:
    """Add framed pictures; each wall has its own frame turn."""
    rng = place.rng
    left = [
        (-3.9, 1.75, 0.9, 1.2),
        (-2.55, 1.5, 0.75, 0.75),
        (-2.55, 2.45, 0.75, 0.9),
        (-1.5, 1.6, 0.85, 1.1),
    ]
    back = [(3.4, 1.6, 0.95, 1.25), (4.75, 1.5, 0.7, 0.7), (4.75, 2.4, 0.7, 0.95),
        (5.8, 1.7, 0.8, 1.1),
            (-5.9, 1.5, 1.2, 0.9), (-5.9, 2.65, 0.9, 0.7)]  # fmt: skip
    right = [
        (-1.5, 1.55, 0.75, 1.0),
        (-4.85, 1.5, 0.85, 1.15),
        (-8.5, 1.5, 1.0, 0.75),
        (-8.5, 2.5, 1.0, 1.1),
    ]
    front = [
        (-3.75, 1.3, 0.4, 0.55),
        (3.75, 1.4, 0.4, 0.5),
        (6.6, 1.4, 0.5, 0.7),
        (-6.6, 1.5, 0.5, 0.7),
    ]
    count = 0
    for walls, turn, at in (
        (left, 90, lambda c: (-SIDE + 0.035, 0, c)), (back, 0, lambda c: (c, 0, BACK + 0.035)),
        (right, -90, lambda c: (SIDE - 0.035, 0, c)), (front, 180, lambda c: (c, 0, FRONT - 0.035)),
    ):  # fmt: skip
        for centre, low, w, h in walls:
            made = place.fresh()
            x, y = (-w / 2, w / 2), (low, low + h)
            margin = 0.05 if rng.random() < 0.6 else 0.0
            for kind, inset, depth in (("paper", 0.0, 0.0), ("art", margin, 0.002)):
                corner = [(x[0] + inset, y[0] + inset), (x[1] - inset, y[0] + inset),
                          (x[1] - inset, y[1] - inset), (x[0] + inset, y[1] - inset)]  # fmt: skip
                lower, upper = cell(count) if kind == "art" else ((0, 0), (1, 1))
                made.add(kind, panel([[a, b, depth] for a, b in corner], lower, upper))
            wood = ("beam", "oak", "iron", "brass")[int(rng.integers(4))]
            _frame(made, x, y, 0.0, float(rng.uniform(0.03, 0.07)), wood)
            place.placed(made, turn, at(centre))
            count += 1


def _lamps(place: Place) -> None:
    """Add opal globes on rods, and bar pendants with iron shades."""
    for material, (x, y, z), r in BALLS:
        a = np.linspace(-np.pi / 2, np.pi / 2, 22)
        ball = np.stack([np.maximum(r * np.cos(a), 0.001), y + r * np.sin(a)], axis=1)
        place.add(material, lathe(ball, 40).moved(x, 0, z))
        if material == "globe":
            cap = [(0.062, y + 0.155), (0.055, y + 0.19), (0.02, y + 0.22), (0.008, y + 0.23)]
            place.add("brass", lathe(cap, 24).moved(x, 0, z))
            place.add("brass", tube([[x, y + 0.2, z], [x, HEIGHT, z]], 0.007))
            continue
        low = y - 0.06
        shade = [(0.17, 0), (0.165, 0.03), (0.12, 0.11), (0.05, 0.17), (0.03, 0.24), (0.01, 0.25)]
        place.add("iron", lathe(shade, 32).moved(x, low, z))
        place.add("iron", tube([[x, low + 0.24, z], [x, HEIGHT, z]], 0.005))


def _corner(place: Place) -> None:
    """Add an armchair, rug and standing lamp on the left, an easel on the right."""
    made = place.fresh()
    made.block("linen", (-0.42, 0.42), (0.16, 0.42), (-0.4, 0.4), 0.06)
    made.block("linen", (-0.36, 0.36), (0.4, 0.52), (-0.3, 0.42), 0.07)
    made.block("linen", (-0.42, 0.42), (0.3, 0.98), (-0.52, -0.34), 0.09)
    for s in (-1, 1):
        made.block("linen", (s * 0.45 - 0.1, s * 0.45 + 0.1), (0.16, 0.64), (-0.48, 0.4), 0.08)
        for z in (-0.4, 0.33):
            made.add("beam", lathe([(0.015, 0), (0.028, 0.16)], 14).moved(s * 0.4, 0, z))
    place.placed(made, 62, (-6.1, 0, -3.4))
    rug = np.array(
        [
            [[x, 0.012 + 0.003 * np.sin(5 * x), z] for x in np.linspace(-5.9, -3.4, 20)]
            for z in (-4.4, -1.9)
        ]
    )
    place.add("rug", grid(rug[::-1]))
    lamp = [(0.15, 0), (0.15, 0.02), (0.02, 0.05), (0.012, 0.1), (0.012, 1.5)]
    place.add("brass", lathe(lamp, 24).moved(-6.45, 0, -2.45))
    place.add("shade", lathe([(0.24, 1.42), (0.15, 1.74)], 36).moved(-6.45, 0, -2.45))
    for x, z in ((-0.42, 0.1), (0.42, 0.1), (0.0, -0.55)):
        top = [0.0, 1.85, -0.12]
        place.add("oak", tube(np.array([[x, 0, z], top]) + np.array([4.1, 0, -1.35]), 0.018))
    easel = place.fresh()
    low, high = cell(7)
    easel.add(
        "art",
        panel([[-0.4, 0.8, 0], [0.4, 0.8, 0], [0.4, 1.75, -0.14], [-0.4, 1.75, -0.14]], low, high),
    )
    easel.add(
        "oak",
        quads([[[0.4, 0.8, -0.02], [-0.4, 0.8, -0.02], [-0.4, 1.75, -0.16], [0.4, 1.75, -0.16]]]),
    )
    easel.block("oak", (-0.45, 0.45), (0.75, 0.8), (-0.05, 0.06), 0.01, "x")
    place.placed(easel, -118, (4.02, 0, -1.28))
