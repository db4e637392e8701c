"""Catchlights reported by the app against those in path-traced eyes.

Traces both eyes of the generic head with short hair, at the portrait's own scale, in twelve places
at five turns each. The skin is a diffuse stand-in: it only reflects a little light onto the iris.
An interrupted run resumes.

    python -m benchmarks.truth.catchlights --places FOLDER [--work FOLDER]
"""

from __future__ import annotations

import argparse
import json
import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from app.core.baking.kernel_lanes import select_variant
from app.core.base.atomic_files import atomic_write_text
from app.core.base.colour import luminance
from app.core.environment.environment import read_environment
from app.core.measure.finish.findings import Findings, find
from app.core.portrait.catchlights import Catchlight, catchlights
from app.core.portrait.full_size_portrait import portrait_picture
from app.core.portrait.light import portrait_light
from app.core.portrait.portrait_file import load_portrait
from benchmarks.truth.stock import ROOT

Float32: TypeAlias = NDArray[np.float32]
Bools: TypeAlias = NDArray[np.bool_]
TURNS: Final = 5
SAMPLES: Final = 512
PASSES: Final = 8
"""With one alone, counts of two seeds agree in only 82 % of the pairs."""
FINE: Final = (1024, 2048)
KEPT: Final = ROOT / "benchmarks" / "results" / "catchlight-eyes.npz"
IRIS: Final = 0.0575
"""Radius of the iris in the mesh's colours, head units (10 cm)."""
BRIGHTER: Final = 3.0
LIMITS: Final = tuple(float(one) for one in np.linspace(2.6, 3.45, 12))
"""Limits of a catchlight: if the number changes within 15 %, the reference is unsure."""
CLOCKED_PX: Final = 5.0
HALF_AN_HOUR: Final = 0.5
SKIN: Final = (0.60, 0.36, 0.25)
ROWS: Final = (273, 305)
COLUMNS: Final = ((233, 265), (375, 407))
"""Traced parts of the portrait: both irises, the sitter's right one first."""


@dataclass(frozen=True, slots=True)
class Spot:
    """A catchlight: its eye ("right" or "left", the sitter's), offset from the pupil, and light."""

    eye: str
    down: float
    across: float
    light: float

    @property
    def away(self) -> float:
        """Distance from the pupil's middle, pixels."""
        return math.hypot(self.down, self.across)

    @property
    def clock(self) -> float:
        """Hours from 0 to 12."""
        return math.degrees(math.atan2(self.across, -self.down)) / 30 % 12


@dataclass(frozen=True, slots=True)
class Iris:
    """An iris in the crop: its visible pixels, and the middle of the pupil."""

    eye: str
    shown: Bools
    pupil: tuple[float, float]


def spots(grey: Float32, irises: tuple[Iris, ...], brighter: float = BRIGHTER) -> list[Spot]:
    """Return catchlights: areas of at least 2 px, 3 times as bright as the iris."""
    found, around = [], np.ones((3, 3))
    for iris in irises:
        bright = iris.shown & (grey >= brighter * np.median(grey[iris.shown]))
        joined = ndimage.binary_closing(np.pad(bright, 2), around)[2:-2, 2:-2]
        label, count = ndimage.label(joined, around)
        for number in range(1, count + 1):
            spot = bright & (label == number)
            if spot.sum() >= 2:
                row, column = (float(axis.mean()) + 0.5 for axis in np.nonzero(spot))
                light = float(grey[spot].sum())
                found.append(Spot(iris.eye, row - iris.pupil[0], column - iris.pupil[1], light))
    return sorted(found, key=lambda one: -one.light)


class Tracer:
    """Mitsuba with the head's eyes."""

    def __init__(self, work: Path) -> None:
        self.mi = select_variant("llvm")
        from app.core.baking.scene import mitsuba_mesh
        from app.core.baking.skin import EYE_COAT, eye_bsdf
        from benchmarks.truth.portrait_scene import Crop, cropped, details, framed_head

        load = self.mi.load_dict
        self.head, self.frame, camera = framed_head()
        skin = load({"type": "diffuse", "reflectance": {"type": "rgb", "value": list(SKIN)}})
        assert self.head.eyes is not None
        crops = (Crop(ROWS[0], left, ROWS[1] - ROWS[0], end - left) for left, end in COLUMNS)
        self.sensors = [load(cropped(camera, crop)) for crop in crops]
        self.bare = {
            "type": "scene",
            "skin": mitsuba_mesh("skin", self.head.skin, {"bsdf": skin}),
            "eyes": mitsuba_mesh("eyes", self.head.eyes, {"bsdf": load(eye_bsdf(EYE_COAT))}),
        }
        self.parts = {
            **self.bare,
            **{
                name: load(one) if isinstance(one, dict) else one
                for name, one in details(work / "strands").items()
            },
            "integrator": {"type": "path", "max_depth": 8},
        }

    def picture(self, panorama: Float32, turn_deg: float) -> Float32:
        """Return the luminance of both eyes, side by side."""
        from benchmarks.truth.portrait_scene import environment

        light = environment(panorama, turn_deg, FINE)
        scene, first = self.mi.load_dict({**self.parts, "light": light}), round(turn_deg) % 360

        def eyes(seed: int) -> Float32:
            both = [
                np.array(self.mi.render(scene, sensor=sensor, spp=SAMPLES, seed=seed), np.float32)
                for sensor in self.sensors
            ]
            return np.asarray(luminance(np.concatenate(both, axis=1)), np.float32)

        return np.asarray(np.mean([eyes(first + 7000 * n) for n in range(PASSES)], axis=0))

    def irises(self) -> tuple[Iris, ...]:
        """Return pixels that show only an eye near its foremost point; lashes do not count."""
        scene = self.mi.load_dict(self.bare)
        sub = (np.arange(4) + 0.5) / 4
        columns = np.concatenate([np.arange(*both) for both in COLUMNS])
        row, column, down, across = np.meshgrid(np.arange(*ROWS), columns, sub, sub, indexing="ij")
        si = scene.ray_intersect(self.frame.rays((row + down).ravel(), (column + across).ravel()))
        shape = next(one for one in scene.shapes() if one.id() == "eyes")
        seen, place = np.array(si.shape == self.mi.ShapePtr(shape)), np.array(si.p).T
        assert self.head.eyes is not None
        vertices, found, wide = self.head.eyes.vertices, [], COLUMNS[0][1] - COLUMNS[0][0]
        for number, (eye, side) in enumerate((("right", -1), ("left", 1))):
            own = vertices[vertices[:, 0] * side > 0]
            apex = own[own[:, 2].argmax()]
            near = seen & (np.linalg.norm((place - apex)[:, :2], axis=1) < IRIS)
            shown = near.reshape(row.shape).all(axis=(2, 3))
            at = [float(one[0]) for one in self.frame.place(apex[None])]
            middle = at[0] - ROWS[0], at[1] - COLUMNS[number][0] + number * wide
            found.append(Iris(eye, shown, middle))
        return tuple(found)


def pairs(places: Path) -> list[tuple[str, float]]:
    """Return twelve places at five turns each, with other turns in each place."""
    names = sorted(file.name for file in places.glob("*.hdr"))
    return [
        (name, round((72.0 * k + 17.0 * n + 180) % 360 - 180, 1))
        for n, name in enumerate(names)
        for k in range(TURNS)
    ]


def trace(work: Path, places: Path) -> dict[str, Any]:
    """Trace missing pictures; return all pictures and the irises."""
    file = work / "eyes.npz"
    kept = dict(np.load(file)) if file.exists() else {}
    tracer = None
    for name, turn in pairs(places):
        key = f"{name}:{turn:g}"
        if key in kept:
            continue
        tracer = tracer or Tracer(work)
        started = time.perf_counter()
        kept[key] = tracer.picture(read_environment(places / name).radiance, turn)
        print(f"{key}: {time.perf_counter() - started:.1f} s", flush=True)
        if "irises" not in kept:
            irises = tracer.irises()
            kept["irises"] = np.stack([iris.shown for iris in irises])
            kept["pupils"] = np.array([iris.pupil for iris in irises])
        np.savez_compressed(file, **kept)
    return kept


def drawn(places: Path) -> dict[str, tuple[Float32, tuple[Catchlight, ...]]]:
    """Return the app's own pictures of the same crops, and its catchlights."""
    known = load_portrait("generic", "medium", "short")
    assert known is not None
    out, light, lamps, last = {}, None, Findings(), ""
    for name, turn in pairs(places):
        if name != last:
            radiance, last = read_environment(places / name).radiance, name
            light, lamps = portrait_light(radiance), find(radiance)
        assert light is not None
        picture = portrait_picture(*known, light, turn)
        grey = luminance(picture)[ROWS[0] : ROWS[1]]
        crop = np.concatenate([grey[:, left:end] for left, end in COLUMNS], axis=1)
        told = catchlights(known[0], light, picture, turn, lamps)
        out[f"{name}:{turn:g}"] = np.asarray(crop, np.float32), told
    return out


def _matched(truth: list[Spot], ours: list[Spot]) -> list[tuple[Spot, Spot]]:
    """Match each true spot with the nearest remaining one of ours."""
    found, left = [], list(ours)
    for one in truth:
        same = [two for two in left if two.eye == one.eye]
        if same:
            nearest = min(same, key=lambda two: _apart(one, two))
            left.remove(nearest)
            found.append((one, nearest))
    return found


def _apart(one: Spot, two: Spot) -> float:
    return math.hypot(one.down - two.down, one.across - two.across)


def _hours(one: float, two: float) -> float:
    return abs((one - two + 6) % 12 - 6)


def counts(found: list[Spot] | tuple[Catchlight, ...]) -> tuple[int, int]:
    """Number of catchlights in the right and the left eye."""
    right, left = (sum(one.eye == eye for one in found) for eye in ("right", "left"))
    return right, left


def compare(traced: dict[str, Any], places: Path) -> dict[str, Any]:
    """Compare the app's pictures and catchlights with the traced eyes."""
    irises = tuple(
        Iris(eye, shown, (float(down), float(across)))
        for eye, shown, (down, across) in zip(
            ("right", "left"), traced["irises"], traced["pupils"], strict=True
        )
    )
    rows: list[dict[str, Any]] = []
    both: list[tuple[Spot, Spot]] = []
    for key, (crop, told) in drawn(places).items():
        truth, ours = spots(traced[key], irises), spots(crop, irises)
        both += _matched(truth, ours)
        near = [counts(spots(traced[key], irises, limit)) for limit in LIMITS]
        rows.append(
            {
                "pair": key,
                "truth": counts(truth),
                "told": counts(told),
                "drawn": counts(ours),
                "possible": [sorted({one[eye] for one in near}) for eye in (0, 1)],
                "spots": [_shown(one) for one in truth],
                "ours": [_shown(one) for one in ours],
            }
        )
    return {**_numbers(rows), **_places(both), "rows": rows}


def _numbers(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Return how often the number is right, overall and where the reference is sure."""
    eyes = [(row, eye) for row in rows for eye in (0, 1)]
    right = [row["truth"][eye] == row["told"][eye] for row, eye in eyes]
    sure = np.array([len(row["possible"][eye]) == 1 for row, eye in eyes])
    possible = [row["told"][eye] in row["possible"][eye] for row, eye in eyes]
    return {
        "pairs": len(rows),
        "pairs_right": float(np.mean([row["truth"] == row["told"] for row in rows])),
        "eyes_right": float(np.mean(right)),
        "eyes_sure": float(sure.mean()),
        "sure_eyes_right": float(np.array(right)[sure].mean()),
        "eyes_possible": float(np.mean(possible)),
    }


def _places(both: list[tuple[Spot, Spot]]) -> dict[str, Any]:
    apart = np.array([_apart(one, two) for one, two in both])
    hours = np.array([_hours(a.clock, b.clock) for a, b in both if a.away > CLOCKED_PX])
    return {
        "matched": len(apart),
        "within_1_px": float((apart <= 1).mean()),
        "apart_px": [round(float(np.percentile(apart, q)), 2) for q in (50, 90, 95, 100)],
        "clocked": len(hours),
        "within_half_an_hour": float((hours <= HALF_AN_HOUR).mean()),
    }


def _shown(spot: Spot) -> str:
    return f"{spot.eye} {spot.clock:.1f} h, {spot.away:.1f} px, {spot.light:.3g}"


def keep(traced: dict[str, Any]) -> None:
    """Write the traced eyes as 16-bit numbers."""
    small: dict[str, Any] = {
        key: np.asarray(v, np.float16) if ":" in key else v for key, v in traced.items()
    }
    np.savez_compressed(KEPT, **small)


def main() -> None:
    """Trace, save, compare, write; without a work folder, compare saved ones."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--places", type=Path, required=True, help="twelve panoramas of Poly Haven, 1k"
    )
    parser.add_argument("--work", type=Path)
    parser.add_argument("-o", type=Path, default=ROOT / "benchmarks/results/catchlights.json")
    args = parser.parse_args()
    if args.work is not None:
        args.work.mkdir(parents=True, exist_ok=True)
        keep(trace(args.work, args.places))
    kept = {key: np.asarray(v, np.float32) if ":" in key else v for key, v in np.load(KEPT).items()}
    result = compare(kept, args.places)
    atomic_write_text(args.o, json.dumps(result, indent=1) + "\n")
    print({key: value for key, value in result.items() if key != "rows"})


if __name__ == "__main__":
    main()
