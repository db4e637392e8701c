"""The light at the skin in the place, checked once against stock Mitsuba.

Under an overcast sky of radiance 1, with all surfaces matt and of one colour each, random paths are
enough to find the light, so that ``volpathmis`` can render the sitter with scattering skin inside
the place, with all bounces between walls, clothes and skin. Ours is made as in `truth_in_place.py`.

    python benchmarks/truth/place_check.py --work FOLDER [-o FILE.json]
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from app.core.baking.kernel_lanes import select_variant
from app.core.baking.scene import build_scene
from app.core.baking.skin import find_skin
from app.core.base.atomic_files import atomic_write_text
from app.core.solver.transport import Transport, load_named
from benchmarks.truth.stock import ROOT, generic_head

if TYPE_CHECKING:
    from benchmarks.truth.place_light import Portrait, Sitting

SPOTS_AND_TURNS: Final = ((2, 0.0), (0, 180.0))  # in the court; inside the doors, facing out
SEEDS: Final = 2
SAMPLES: Final = 64
GLINTS: Final = 128
PATHS: Final = 4096
STOCK_PATHS: Final = 512
Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]


def overcast() -> Any:
    """Return a matt world of plain colours, under a sky of radiance 1."""
    from scenes.demo_location.assemble import World
    from scenes.demo_location.tracer import Lights

    class Overcast(World):
        def _materials(self, names: list[str]) -> Any:
            names, table, texels = super()._materials(names)
            means = []
            for first, wide, high in table[:, :3].astype(int):
                code = texels[first : first + wide * high]
                roots = [((code >> shift) & 255) / 255 for shift in (0, 8, 16)]
                means.append([np.round(255 * np.sqrt(np.mean(r * r))) for r in roots])
            self.means = np.square(np.array(means) / 255)
            red, green, blue = np.array(means, np.uint32).T
            plain = np.zeros_like(table)
            plain[:, 0] = np.arange(len(table))
            plain[:, 1:5] = 1.0
            return names, plain, red | green << 8 | blue << 16

        def _lights(self) -> Lights:
            self.surfaces.glow[:] = 0.0
            none = (np.array([0.0, 1.0, 0.0]), 1.0, np.zeros(3))
            # A practically dark lamp: there must be one to sample.
            return Lights(
                np.ones((64, 128, 3), np.float32), none, [(np.zeros(3), 0.01, np.full(3, 1e-12))]
            )

    return Overcast


def stock_world(sitting: Sitting) -> dict[str, Any]:
    """Return everything but the head for stock Mitsuba, in the head's frame, and the sky."""
    import drjit as dr
    import mitsuba as mi

    world: Any = sitting.world
    vertices, faces = sitting.surroundings
    material = np.asarray(world.surfaces.material.numpy())[: len(faces)]
    own = np.asarray(world.surfaces.colours.numpy()).reshape(-1, 3)
    colours = np.ones_like(own)
    colours[faces.ravel()] = np.repeat(world.means[material], 3, axis=0)
    properties = mi.Properties()
    matt = {
        "type": "twosided",
        "matt": {
            "type": "diffuse",
            "reflectance": {"type": "mesh_attribute", "name": "vertex_colour"},
        },
    }
    properties["bsdf"] = mi.load_dict(matt)
    mesh = mi.Mesh("place", len(vertices), len(faces), properties, True, False)
    mesh.add_attribute("vertex_colour", 3, (own * colours).astype(np.float32).ravel())
    normals = np.asarray(world.surfaces.normals.numpy()).reshape(-1, 3) @ sitting.rotation
    params = mi.traverse(mesh)
    params["vertex_positions"] = mi.Float(vertices.astype(np.float32).ravel())
    params["vertex_normals"] = mi.Float(normals.astype(np.float32).ravel())
    params["faces"] = mi.UInt32(faces.astype(np.uint32).ravel())
    params.update()
    dr.eval()
    return {"place": mesh, "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}}}


def theirs(sitting: Sitting, seed: int) -> Float32:
    """Return the sitter in the place by ``volpathmis``, (100, 100, 3)."""
    import mitsuba as mi

    head, camera = generic_head()
    scene = build_scene(head, find_skin("medium"), camera, stock_world(sitting))
    parts = [
        np.array(mi.render(scene, spp=128, seed=seed * 1000 + part), np.float32)
        for part in range(STOCK_PATHS // 128)
    ]
    return np.asarray(np.mean(parts, axis=0), np.float32)


def ours(sitting: Sitting, head: Portrait, seed: int) -> Float32:
    """Return the same by the method of the truth in the place, (P, 3)."""
    from benchmarks.truth.place_light import through_skin

    front = np.flatnonzero(head.points.normals[:, 2] > -0.3)
    entering = np.zeros((head.points.count, 3, 4, 1), np.float32)
    entering[front, :, :, 0] = sitting.entering(head, front, SAMPLES, seed << 20)
    below = through_skin(head, entering, PATHS, 5 + seed)
    return np.asarray(below[..., 0] + sitting.reflected(head, GLINTS, seed << 20), np.float32)


def compared(first: tuple[Float64, Float64], second: tuple[Float64, Float64]) -> dict[str, float]:
    """Compare ours and theirs, two pictures of the face each, (F, 3)."""
    a, b = np.mean(first, axis=0), np.mean(second, axis=0)
    power = float(np.sqrt((b * b).mean()))
    noise = [float(np.sqrt(np.square(x - y).mean()) / 2) for x, y in (first, second)]
    seen = float(np.sqrt(np.square(a - b).mean()))
    beyond = max(0.0, seen**2 - noise[0] ** 2 - noise[1] ** 2) ** 0.5
    colour = a.mean(axis=0) / b.mean(axis=0) - 1
    return {
        "colour": float(np.abs(colour).max()),
        "brightness": float(a.mean() / b.mean() - 1),
        "rmse_with_noise": seen / power,
        "rmse": beyond / power,
        "noise_of_ours": noise[0] / power,
        "noise_of_theirs": noise[1] / power,
    }


def check(work: Path, number: int, turn: float, transport: Transport) -> dict[str, Any]:
    """Compare at one spot and turn."""
    from benchmarks.truth.place_light import SPOTS, Sitting, portrait

    head, started = portrait(transport.pixels), time.perf_counter()
    sitting = Sitting(SPOTS[number], overcast())
    sitting.turn(turn)
    here, stock = [], []
    whole = transport.face & (transport.coverage > 0.999)
    for seed in range(SEEDS):
        here.append(ours(sitting, head, seed)[whole].astype(np.float64))
        stock.append(theirs(sitting, seed).reshape(-1, 3)[transport.pixels][whole].astype(float))
        print(f"{(time.perf_counter() - started) / 60:.1f} min", flush=True)
    np.savez(work / f"check-{number}.npz", ours=here, theirs=stock, whole=whole)
    found = compared((here[0], here[1]), (stock[0], stock[1]))
    return {"spot": SPOTS[number].name, "turn_deg": turn, **found}


def main() -> None:
    """Compare, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument(
        "-o", type=Path, default=ROOT / "benchmarks" / "results" / "place-check.json"
    )
    args = parser.parse_args()
    select_variant("llvm")
    import benchmarks.truth.place_light  # noqa: F401 - makes the location's modules known

    args.work.mkdir(parents=True, exist_ok=True)
    transport = load_named("generic")
    rows = []
    for number, turn in SPOTS_AND_TURNS:
        rows.append(check(args.work, number, turn, transport))
        print(json.dumps(rows[-1], indent=1), flush=True)
    atomic_write_text(args.o, json.dumps({"paths": STOCK_PATHS, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
