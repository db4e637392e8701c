"""Test whether the turns offered are right on real people, and whether their faces show the style.

Each person of the Extended Yale Face Database B is relit by each place from 64 measured lamps, at
all 64 turns. The loss of a person at the program's turn is a share of that person's own range of
match. Light from beyond 110 deg, where there were no lamps, is removed from both prediction and
truth, and only styles with all lamps inside that range are judged.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.environment.environment import read_environment, reduce, solid_angles
from app.core.solver.face import AREAS, oval_areas
from app.core.solver.head_shape import load_shape_of
from app.core.solver.search import curves
from app.core.solver.solve import measure, solve_all
from app.core.solver.style_result import StyleResult
from app.core.solver.style_signature import Signature, Signatures, stops_of
from app.core.styles.style import Style
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_build import build_pack
from app.core.styles.style_pack_file import load_named_pack, load_transport_of, pack_names

Floats: TypeAlias = NDArray[np.float64]

ROOT: Final = Path(__file__).resolve().parents[2]
BEFORE: Final = ROOT / "benchmarks" / "results" / "people-before.json"
BEHIND_DEG: Final = 110.0
_STEP: Final = 4  # pixels of the pictures that are averaged to one
_EYES: Final = (45.0, 83.5, 48.5)  # row and column between the eyes, half their distance, pixels
_CHIN: Final = 2.165 / 0.623 * 48.5  # from eyes to chin: to the mouth as on the shipped heads
_HALF_BLACK: Final = 1 / 128  # of the brighter half: darker values are not read


@dataclass(frozen=True, slots=True, eq=False)
class Person:
    """Pictures of a face under single lamps.

    Attributes:
        pictures: (pixels, lamps) float64. Linear luminance.
        lamps_deg: (lamps, 2) azimuth towards the sitter's left and elevation.
        areas: (A, pixels) float64. Areas inside the crop; rows of others are nan.
    """

    name: str
    pictures: Floats
    lamps_deg: Floats
    areas: Floats


def load_people(folder: Path) -> tuple[Person, ...]:
    """Read all people of a folder."""
    return tuple(_person(path) for path in sorted(folder.glob("*.npz")))


def _person(path: Path) -> Person:
    with np.load(path, allow_pickle=False) as file:
        images, lamps = file["images"].astype(np.float64), file["lamps_deg"].astype(np.float64)
    count, height, width = images.shape
    small = images.reshape(count, height // _STEP, _STEP, width // _STEP, _STEP).mean(axis=(2, 4))
    row, column = np.indices(small.shape[1:]) * _STEP + _STEP / 2
    across, down = (column - _EYES[1]) / _EYES[2], (row - _EYES[0]) / _CHIN
    whole = np.ones(across.size)
    found = oval_areas(across.ravel(), down.ravel(), whole)
    outside = ("forehead", "throat", "temple", "lid", "lids")
    areas = np.full((len(AREAS), across.size), np.nan)
    for name, weights in found.items():
        if name.split()[-1] not in outside:
            areas[AREAS.index(name)] = weights
    return Person(path.stem, small.reshape(count, -1).T, lamps, areas)


def directions(azimuth_deg: Floats, elevation_deg: Floats) -> Floats:
    """Return unit vectors in the head frame, (..., 3)."""
    a, e = np.radians(azimuth_deg), np.radians(elevation_deg)
    return np.stack([np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)], axis=-1)


def lamp_shares(lamps_deg: Floats, toward: Floats) -> Floats:
    """Return the mix of the three nearest lamps for light from each direction, (n, lamps)."""
    away = np.degrees(
        np.arccos(np.clip(toward @ directions(lamps_deg[:, 0], lamps_deg[:, 1]).T, -1, 1))
    )
    nearest = np.argsort(away, axis=1)[:, :3]
    near = np.take_along_axis(away, nearest, axis=1)
    weights = 1.0 / (near + 2.0) ** 2
    weights /= weights.sum(axis=1, keepdims=True)
    weights[near[:, 0] > 30.0] = 0.0
    shares = np.zeros_like(away)
    np.put_along_axis(shares, nearest, weights, axis=1)
    return shares


def texel_grid(shape: tuple[int, int]) -> tuple[Floats, Floats]:
    """Return azimuth, towards the sitter's left, and elevation of texels at turn 0, (H, W) deg."""
    height, width = shape
    azimuth = -((np.arange(width) + 0.5) / width - 0.5) * 360.0
    elevation = 90.0 - (np.arange(height) + 0.5) / height * 180.0
    return np.meshgrid(azimuth, elevation)


def front_pack(pack: StylePack, head: str) -> StylePack:
    """Return the pack for light from within 110 deg only."""
    transport = load_transport_of(pack, head)
    azimuth, _ = texel_grid(transport.environment_shape)
    front = (np.abs(azimuth) <= BEHIND_DEG).ravel()
    pictures = pack.targets.reshape(len(pack.styles), -1, 3)[:, transport.pixels]
    cut = replace(transport, texel_basis=transport.texel_basis * front)
    shape = load_shape_of(transport, head)
    return build_pack(cut, pack.styles, pictures.astype(np.float64), shape)


def judged(styles: Sequence[Style]) -> tuple[int, ...]:
    """Return the indices of the styles whose lamps are all within 110 deg."""
    return tuple(
        row
        for row, style in enumerate(styles)
        if all(abs(lamp.azimuth_deg) <= BEHIND_DEG for lamp in style.lamps)
    )


def correlation(pictures: Floats, target: Floats) -> Floats:
    """Return the match of pictures (pixels, n), (n,)."""
    one, other = pictures - pictures.mean(axis=0), target - target.mean()
    size = np.linalg.norm(one, axis=0) * np.linalg.norm(other)
    return np.asarray(100.0 * (other @ one) / np.maximum(size, 1e-30))


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """A person's pictures in a place at all turns."""

    match: Floats  # (S, 64), with the person's own target
    areas: Floats  # (A, 64)


def relit(person: Person, light: Floats, styles: Sequence[Style], rows: Sequence[int]) -> Truth:
    """Relight a person by a place's luminance (H, W) at all turns."""
    shape = (light.shape[0], light.shape[1])
    azimuth, elevation = texel_grid(shape)
    front = np.abs(azimuth) <= BEHIND_DEG
    shares = lamp_shares(person.lamps_deg, directions(azimuth, elevation).reshape(-1, 3))
    turned = np.stack([np.roll(light, -k, axis=1) * front for k in range(light.shape[1])], axis=-1)
    turned *= solid_angles(shape)[:, None, None]
    lamps = shares.T @ turned.reshape(-1, light.shape[1])
    match, seen = [], person.pictures @ lamps
    for row in rows:
        target = np.zeros(len(person.pictures))
        for lamp in styles[row].lamps:
            at = np.array([[lamp.azimuth_deg, lamp.elevation_deg]])
            own = lamp_shares(person.lamps_deg, directions(at[:, 0], at[:, 1]))
            target += lamp.power * (person.pictures @ own[0])
        match.append(correlation(seen, target))
    return Truth(np.stack(match), (person.areas @ person.pictures) @ lamps)


def crop_signature(style: Style, areas: Floats) -> Signature:
    """Return the relations of a style whose areas are inside the crop."""
    seen = {name for name, row in zip(AREAS, areas, strict=True) if np.isfinite(row).all()}
    kept = tuple(r for r in style.signature.relations if {r.bright, r.dark} <= seen)
    return Signature(kept)


def shows(signature: Signature, areas: Floats) -> bool:
    """Return whether a picture's areas (A,) are at least near a signature."""
    names = list(AREAS)
    halves = max(areas[names.index("left half")], areas[names.index("right half")])
    known = np.where(np.isfinite(areas), np.maximum(areas, _HALF_BLACK * halves), 0.0)
    match = np.full((1, 1), 100.0)
    return bool(Signatures((signature,)).slack(stops_of(known[:, None]), match)[1][0, 0] >= 0)


def places(folders: Sequence[Path]) -> dict[str, Floats]:
    """Return the light, (32, 64, 3), of all panoramas in some folders, by unique names."""
    found: dict[str, Floats] = {}
    for folder in folders:
        for path in sorted([*folder.glob("*.hdr"), *folder.glob("*.exr")]):
            name = path.stem if path.stem not in found else f"{folder.name}-{path.stem}"
            found[name] = reduce(read_environment(path)).astype(np.float64)
    return found


def run(
    people: Sequence[Person],
    lights: Mapping[str, Floats],
    head: str,
    known: dict[str, list[Truth]] | None = None,
) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Judge all pairs; return rows of (place, style), and the agreement by style.

    Args:
        known: People's pictures in places, shared by all heads; filled here.
    """
    known = {} if known is None else known
    pack = front_pack(load_named_pack(head), head)
    rows = judged(pack.styles)
    pairs: list[dict[str, Any]] = []
    votes: dict[str, list[tuple[bool, list[bool]]]] = {}
    for place, light in lights.items():
        grey = light @ np.array([0.2126, 0.7152, 0.0722])
        results = solve_all(pack, light)
        found = curves(pack.tables, pack.project(light))
        predicted = measure(pack, found)
        if place not in known:
            known[place] = [relit(person, grey, pack.styles, rows) for person in people]
        truths = known[place]
        for at, row in enumerate(rows):
            result, style = results[row], pack.styles[row]
            pairs.append(_pair(place, result, predicted.match[row], [t.match[at] for t in truths]))
            signature = crop_signature(style, people[0].areas)
            if signature.relations:
                turn = result.turn_index
                own = [shows(signature, truth.areas[:, turn]) for truth in truths]
                model = np.where(
                    np.isfinite(people[0].areas[:, 0]), found.others[: len(AREAS), turn], np.nan
                )
                votes.setdefault(style.name, []).append((shows(signature, model), own))
    return pairs, {name: _agreement(each) for name, each in votes.items()}


def kept(pairs: Sequence[Mapping[str, Any]], head: str) -> dict[str, float]:
    """Return how many of the earlier attainable pairs are still yes or soft."""
    known = json.loads(BEFORE.read_text(encoding="utf-8"))["attainable"].get(head, {})
    before = [pair for pair in pairs if pair["style"] in known.get(pair["place"], [])]
    stay = sum(pair["grade"] != "no" for pair in before)
    return {"before": len(before), "stay": stay, "percent": 100.0 * stay / max(len(before), 1)}


def one_by_one(pairs: Sequence[Mapping[str, Any]], names: Sequence[str]) -> dict[str, Any]:
    """Return results per person, and the 95 % uncertainty of the mean over other places."""
    graded = [pair for pair in pairs if pair["grade"] != "no"]
    close = np.array([pair["given_up"] for pair in graded]) <= 3.0
    at = np.array([pair["place"] for pair in graded])
    parts = [close[at == place] for place in sorted({pair["place"] for pair in pairs})]
    rng = np.random.default_rng(0)
    drawn = [rng.integers(len(parts), size=len(parts)) for _ in range(1000)]
    shares = [np.concatenate([parts[k] for k in some]).mean() for some in drawn]
    return {
        "within_3_percent": dict(zip(names, (100.0 * close.mean(axis=0)).tolist(), strict=True)),
        "other_places": [100.0 * float(v) for v in np.percentile(shares, [2.5, 97.5])],
    }


def _pair(place: str, result: StyleResult, curve: Floats, truth: list[Floats]) -> dict[str, Any]:
    turn = result.turn_index
    lost = [100.0 * (t.max() - t[turn]) / np.ptp(t) for t in truth]
    return {
        "place": place,
        "style": result.name,
        "grade": result.grade,
        "predicted": float(curve[turn]),
        "real": [float(t[turn]) for t in truth],
        "given_up": [float(value) for value in lost],
    }


def _agreement(votes: list[tuple[bool, list[bool]]]) -> dict[str, float]:
    own = np.array([people for _, people in votes])
    head = np.array([model for model, _ in votes])
    share = own.mean(axis=1)
    count = own.shape[1]
    # How often two different people agree.
    alike = ((share * count) ** 2 + ((1 - share) * count) ** 2 - count) / (count * (count - 1))
    return {
        "agree": 100.0 * float((own == head[:, None]).mean()),
        "people_agree": 100.0 * float(alike.mean()),
        "head_says": 100.0 * float(head.mean()),
        "people_say": 100.0 * float(own.mean()),
    }


def summary(pairs: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Return the row of people, over pairs graded yes or soft; correlation and bias over all."""
    graded = [pair for pair in pairs if pair["grade"] in ("yes", "soft")]
    lost = np.concatenate([pair["given_up"] for pair in graded])
    real = np.concatenate([pair["real"] for pair in pairs])
    predicted = np.repeat([p["predicted"] for p in pairs], [len(p["real"]) for p in pairs])
    return {
        "pairs": len(pairs),
        "graded": len(graded),
        "mean_percent": float(lost.mean()),
        "within_3_percent": 100.0 * float((lost <= 3).mean()),
        "within_10_percent": 100.0 * float((lost <= 10).mean()),
        "correlation": float(np.corrcoef(predicted, real)[0, 1]),
        "bias": float((predicted - real).mean()),
    }


def _by_style(pairs: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    parts: dict[str, list[Mapping[str, Any]]] = {}
    for pair in pairs:
        parts.setdefault(str(pair["style"]), []).append(pair)
    return {
        name: summary(each)
        for name, each in parts.items()
        if any(pair["grade"] != "no" for pair in each)
    }


def measured(
    people: Sequence[Person],
    lights: Mapping[str, Floats],
    head: str,
    known: dict[str, list[Truth]],
) -> dict[str, Any]:
    """Return all results for one head."""
    pairs, agreement = run(people, lights, head, known)
    return {
        **summary(pairs),
        "kept": kept(pairs, head),
        "alone": one_by_one(pairs, [person.name for person in people]),
        "by_style": _by_style(pairs),
        "agreement": agreement,
    }


def main() -> None:
    """Measure, write and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    shared = Path(os.environ.get("TURNLIGHT_SHARED", ROOT.parent / "shared" / "data"))
    parser.add_argument("--people", type=Path, default=shared / "people")
    parser.add_argument("--places", type=Path, nargs="*", default=[])
    parser.add_argument("--head", nargs="*", default=pack_names())
    parser.add_argument("-o", type=Path)
    args = parser.parse_args()
    if not args.people.is_dir():
        print("People: not present.")
        return
    started = time.monotonic()
    people = load_people(args.people)
    lights = places([shared / "hdri", ROOT / "resources" / "demo" / "scenes", *args.places])
    known: dict[str, list[Truth]] = {}
    heads = {head: measured(people, lights, head, known) for head in args.head}
    took = round(time.monotonic() - started, 1)
    facts = {"people": len(people), "places": list(lights), "seconds": took, "heads": heads}
    print(json.dumps(facts, indent=1))
    if args.o:
        args.o.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
