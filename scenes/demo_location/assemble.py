"""Build a Mitsuba scene from shapes and surfaces."""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import mitsuba as mi  # noqa: TID253 - a module that only a rendering process imports
import numpy as np

from scenes.demo_location import court, furniture, hall, pictures
from scenes.demo_location.frame import SUN_AZIMUTH, SUN_ELEVATION, direction, to_world, world_matrix
from scenes.demo_location.guide import Portals
from scenes.demo_location.light import SUN_RADIUS_DEG, sky, sun_radiance
from scenes.demo_location.mesh import Geo, joined
from scenes.demo_location.noise import linear
from scenes.demo_location.place import Place
from scenes.demo_location.sitter import body, dressed_head
from scenes.demo_location.textures import SURFACES
from scenes.demo_location.tracer import LUMINANCE, Lights, Surfaces

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["World", "build_place", "build_portals", "sitter_parts"]

SEED: Final = 20_261
_PLAIN: Final = {
    "grass": "#66703f",
    "paint": "#d6cfbf",
    "canvas": "#e4dccb",
    "paper": "#ddd6c6",
    "trousers": "#2f3338",
    "glass": "#1b2226",
}
_LAMPS: Final = {  # cd/m2, colour
    "globe": (4_200.0, "#ffdcae"),
    "bulb": (26_000.0, "#ffd29a"),
    "shade": (1_800.0, "#ffc98c"),
}
_COLOURED: Final = ("leaf", "tint", "bark", "hands", "tint-gloss", "eyes", "skin")
_SHINY: Final = {"tint-gloss": 0.12, "eyes": 0.1, "skin": 0.42, "hands": 0.45, "glass": 0.05}
_THIN: Final = {"leaf": 0.35, "canvas": 0.35, "shade": 0.3}


def build_place() -> Place:
    """Model the whole place, in building coordinates."""
    place = Place(np.random.default_rng(SEED))
    hall.add_hall(place)
    furniture.add_furniture(place)
    court.add_court(place)
    return place


def build_portals() -> Portals:
    """Return the sources of the hall's daylight, in world coordinates."""
    matrix = world_matrix()
    rectangles, strength = [], []
    for corners, bright in hall.openings():
        moved = corners @ matrix[:3, :3].T
        moved[0] += matrix[:3, 3]
        rectangles.append(moved)
        strength.append(bright)
    room = np.array(
        [[-hall.SIDE - 0.2, -0.05, hall.BACK - 0.05], [hall.SIDE + 0.2, hall.HEIGHT + 0.01, -0.26]]
    )
    return Portals(np.asarray(np.linalg.inv(matrix), float), room, rectangles, strength)


def _painted(material: str) -> NDArray[np.float32]:
    """Paint a surface, or read the result of an earlier run with the same brushes."""
    folder = Path(__file__).parent
    brushes = b"".join((folder / f"{n}.py").read_bytes() for n in ("noise", "textures", "pictures"))
    key = hashlib.sha256(brushes + material.encode()).hexdigest()[:20]
    kept = Path(tempfile.gettempdir()) / "turnlight-demo-location" / f"{material}-{key}.npy"
    if kept.is_file():
        return np.asarray(np.load(kept))
    rng = np.random.default_rng([SEED, *material.encode()])
    if material in SURFACES:
        picture = SURFACES[material].paint(rng)
    else:
        picture = {"art": pictures.art, "spines": pictures.spines, "menu": pictures.menu}[material](
            rng
        )
    kept.parent.mkdir(parents=True, exist_ok=True)
    draft = kept.with_suffix(f".{os.getpid()}.part.npy")
    np.save(draft, picture.astype(np.float32))
    draft.replace(kept)
    return picture


def _tiles(material: str) -> tuple[NDArray[np.float32], tuple[float, float]]:
    """Return the picture of a material, and its size in metres."""
    if material in SURFACES:
        return _painted(material), SURFACES[material].size
    if material in ("art", "spines", "menu"):
        return _painted(material), (1.0, 1.0)
    colour = linear(_PLAIN[material]) if material in _PLAIN else np.ones(3)
    return np.broadcast_to(np.asarray(colour, np.float32), (1, 1, 3)), (1.0, 1.0)


def _gloss(material: str) -> float:
    return SURFACES[material].gloss if material in SURFACES else _SHINY.get(material, 0.0)


def _worldly(geo: Geo) -> Geo:
    matrix = world_matrix()
    v = geo.v @ matrix[:3, :3].T + matrix[:3, 3]
    return Geo(v, geo.n @ matrix[:3, :3].T, geo.uv, geo.f, geo.c)


def _glow(material: str) -> NDArray[np.float64]:
    if material not in _LAMPS:
        return np.zeros(3)
    luminance, colour = _LAMPS[material]
    tint = linear(colour).astype(float)
    return np.asarray(tint / (tint @ LUMINANCE) * luminance)


class World:
    """The place, ready for rendering: a Mitsuba scene of one mesh, tables, lights, openings.

    Args:
        sitter: A sitter in the place, from `sitter_parts`.
    """

    def __init__(self, place: Place, sitter: dict[str, Geo] | None = None):
        parts = [(name, _worldly(joined(shapes))) for name, shapes in place.parts.items()]
        worn = [] if sitter is None else list(sitter.items())
        self.start = sum(len(geo.v) for _, geo in parts)
        self.sitter = joined([geo for _, geo in worn]) if worn else None
        names, table, texels = self._materials([name for name, _ in parts + worn])
        whole = joined([geo for _, geo in parts + worn])
        material = np.concatenate([np.full(len(g.f), names.index(n)) for n, g in parts + worn])
        own = np.concatenate([np.full(len(g.v), n in _COLOURED) for n, g in parts + worn])
        self.v, self.n, self.f = whole.v.astype(np.float32), whole.n.astype(np.float32), whole.f
        self.mesh = _mesh(whole)
        self.scene = mi.load_dict({"type": "scene", "all": self.mesh})
        glow = np.stack([_glow(name) for name in names])
        mesh = {
            "normals": whole.n, "uv": whole.uv, "colours": np.where(own[:, None], whole.c, 1.0),
            "faces": whole.f, "material": material, "geometric": self._geometric(),
                "texels": texels,
        }  # fmt: skip
        self.surfaces = Surfaces(self.scene, mesh, table, glow)
        self.lights = self._lights()
        self.portals = build_portals()
        self.tables = (self.surfaces, self.lights, self.portals)

    def _materials(self, names: list[str]) -> tuple[list[str], NDArray[Any], NDArray[np.uint32]]:
        rows, pixels, first = [], [], 0
        for name in names:
            picture, size = _tiles(name)
            code = np.round(255 * np.sqrt(np.clip(picture, 0, 1))).astype(np.uint32)
            pixels.append((code[..., 0] | code[..., 1] << 8 | code[..., 2] << 16).ravel())
            f0 = 0.09 if name == "glass" else 0.04
            rows.append(
                [
                    first,
                    *picture.shape[1::-1],
                    *size,
                    _gloss(name),
                    _THIN.get(name, 0.0),
                    f0,
                    name in ("globe", "bulb"),
                ]
            )
            first += len(pixels[-1])
        return names, np.array(rows, float), np.concatenate(pixels)

    def _geometric(self) -> NDArray[np.float32]:
        a, b, c = (self.v[self.f[:, k]] for k in range(3))
        n = np.cross(b - a, c - a)
        return np.asarray(n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-20))

    def _lights(self) -> Lights:
        sun = (direction(SUN_AZIMUTH, SUN_ELEVATION), SUN_RADIUS_DEG, sun_radiance())
        lamps = [
            (to_world(*centre), radius, _glow(material))
            for material, centre, radius in furniture.BALLS
        ]
        return Lights(sky(SEED), sun, lamps)

    def turn(self, degrees: float, at: tuple[float, float] = (0.0, 0.0)) -> None:
        """Move the sitter to a position on the floor (world x and z), facing an azimuth."""
        if self.sitter is None:
            return
        moved = self.sitter.turned(-degrees).moved(at[0], 0.0, at[1])
        self.v[self.start :] = moved.v
        self.n[self.start :] = moved.n
        params = mi.traverse(self.scene)
        key = next(k for k in params.keys() if k.endswith("vertex_positions"))  # noqa: SIM118
        params[key] = self.v.ravel()
        params.update()
        self.surfaces.set_normals(self.n.astype(float))
        self.surfaces.corners = mi.Float(self._geometric().astype(np.float32).ravel())


def sitter_parts(heads: Path, hair: bool = True) -> dict[str, Geo]:
    """Return the sitter's surfaces by material, the head last, facing azimuth 0 at the origin."""
    skin, eyes = (_loaded(heads / name) for name in ("generic.ply", "generic-eyes.ply"))
    face, balls = dressed_head(skin, eyes, np.array([0.0, 7.34084, 1.1844]), hair)
    return {**body(), "skin": face, "eyes": balls}


def _mesh(geo: Geo) -> Any:
    made = mi.Mesh("all", len(geo.v), len(geo.f), mi.Properties(), False, False)
    params = mi.traverse(made)
    params["vertex_positions"] = geo.v.astype(np.float32).ravel()
    params["faces"] = geo.f.astype(np.uint32).ravel()
    params.update()
    return made


def _loaded(path: Path) -> Geo:
    params = mi.traverse(mi.load_dict({"type": "ply", "filename": str(path)}))
    v = np.array(params["vertex_positions"], np.float64).reshape(-1, 3)
    n = np.array(params["vertex_normals"], np.float64).reshape(-1, 3)
    c = np.full(v.shape, 0.5)
    if "vertex_color" in params:
        c = np.array(params["vertex_color"], np.float64).reshape(-1, 3)
    f = np.array(params["faces"], np.int64).reshape(-1, 3)
    return Geo(v, n, np.zeros((len(v), 2)), f, c)
