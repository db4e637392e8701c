"""Fit the weights of `app/core/turning/confidence.py`, and say how they hold in rooms left out.

    python benchmarks/locate_photos.py FOLDER --make --draw 1000      (only for this)
    python benchmarks/confidence_fit.py FOLDER KEPT.pkl           (gathers evidence; resumes)
    python benchmarks/confidence_fit.py FOLDER KEPT.pkl --fit

Rows are every way in which `search_photo` looks for each photograph, where it was taken and in
another room, and the cases of `heading.py` from another draw. A row is right within 3 deg from the
line through the sitter; beside it, and elsewhere, none is.
"""

from __future__ import annotations

import argparse
import json
import math
import pickle
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heading_cases import (  # isort: skip
    LOCATION, Case, crop_cases, cut_out, demo_spots, demo_views, learnt, location, location_cases,
    nothing_cases, scenes,
)  # fmt: skip
from locate_cases import SPOTS_M  # isort: skip

from app.core.angles import difference
from app.core.turning import shot
from app.core.turning.confidence import CLOSE_DEG, LEAST_CONFIDENCE, SIGNS, deviation_deg, signs
from app.core.turning.heading import HeadingIndex, Sight, compare, see
from app.core.turning.shot import read_photo

if TYPE_CHECKING:
    from numpy.typing import NDArray

TRAIN: Final = 71  # seed of the live pictures
LIVE: Final = 40  # of each kind
FOLDS: Final = 5
LEAST: Final = {"share": 0.1, "strays": -1.0, "odd": -1.0}  # others say nearly as much: at least so
MORE_IS_BETTER: Final = ("points", "support", "spread", "share")
FALSE_COST: Final = 2.0  # a wrong heading is worse than none
PRIOR: Final = 0.02

Row = dict[str, Any]


def row(kind: str, room: str, found: Any, heading_deg: float | None) -> Row | None:
    """One answer, and whether it is right."""
    if found is None or found.evidence.points < 1 or found.evidence.zoom < 0.8:
        return None
    heading, pitch, roll = found.pose.angles_deg
    if abs(pitch) > 40.0 or abs(roll) > 25.0:
        return None
    off = 180.0 if heading_deg is None else abs(difference(heading, heading_deg))
    right = off <= CLOSE_DEG and kind not in ("beside", "elsewhere")
    return {"kind": kind, "room": room, "evidence": found.evidence, "off": off, "right": right}


def of_photo(path: Path, maps: dict[str, HeadingIndex]) -> list[Row]:
    """Every way in which a photograph is looked for."""
    told, photo = json.loads(path.read_text()), read_photo(path.with_suffix(".jpg"))
    kind, place, number = told["kind"], told["place"], int(path.stem[-3:])
    names = sorted(set(maps) - set(SPOTS_M) - {place})
    asked = [(place, kind, told["heading_deg"])]
    if kind == "beside" and number % 3 == 0:
        asked.append((names[7 * number % len(names)], "elsewhere", None))
    assumed = shot._assumed_fov(photo.picture)
    sitter = shot._sitter_in(photo.picture, photo.fov_deg or assumed)
    rows = []
    for who in dict.fromkeys((sitter, None)):
        sight = shot._sight_of(photo.picture, who)
        for name, what, heading in asked:
            # Cut, and looked for with the lens of the whole: right or not, it is no example.
            for fov in (None,) if kind == "cropped" else (photo.fov_deg, None):
                angle = shot._angle(who, fov or assumed)
                rows.append(row(what, place, compare(sight, maps[name], fov, None, angle), heading))
    return [one for one in rows if one is not None]


def live(maps: dict[str, HeadingIndex]) -> list[Row]:
    """Pictures of `heading.py` of another draw: right, hard, of other places, of nothing."""
    chance, views, rows = np.random.default_rng(TRAIN), demo_views(location()), []
    lights = scenes()

    def ask(case: Case, sight: Sight, index: HeadingIndex, *, known: bool, right: bool) -> None:
        noise = chance.normal(0.0, 1.0) if case.place == LOCATION else 0.0
        fov = case.fov_deg if known else None
        sitter = (case.sitter_deg if known else case.assumed_sitter_deg) + noise
        found = compare(sight, index, fov, None, sitter)
        rows.append(row("live", case.place, found, case.heading_deg if right else None))

    cases = [c for hard in (1.0, 2.5) for c in location_cases(views, chance, LIVE, hard)]
    cases += [c for hard in (1.0, 2.5) for c in crop_cases(lights, chance, LIVE, hard)]
    for case in [*cases, *nothing_cases(chance, LIVE)]:
        sight = see(case.picture)
        if case.place:
            for known in (True, False):
                ask(case, sight, maps[case.place], known=known, right=True)
            rest = cut_out(maps[case.place], case)
            ask(case, sight, rest, known=bool(chance.random() < 0.5), right=False)
        others = [n for n in maps if n not in (case.place, *SPOTS_M)]
        for name in chance.choice(others, 2, replace=False):
            ask(case, sight, maps[str(name)], known=bool(chance.random() < 0.5), right=False)
    return [one for one in rows if one is not None]


def greatest_likelihood(rows: list[Row]) -> tuple[NDArray[np.float64], float]:
    """Weights that make what happened likeliest, none of the wrong sign; and the error's factor."""
    from scipy.optimize import minimize
    from scipy.special import erf, expit

    told = np.array([signs(r["evidence"]) for r in rows])
    error = np.array([deviation_deg(r["evidence"]) for r in rows])
    right = np.array([r["right"] for r in rows])
    cost = np.where(right, 1.0, FALSE_COST)
    scale = np.maximum(told.std(axis=0), 0.05)
    scale[0] = 1.0

    def loss(x: NDArray[np.float64]) -> float:
        close = erf(CLOSE_DEG / (math.sqrt(2.0) * np.exp(x[-1]) * error))
        p = np.clip(close * expit(told / scale @ x[:-1]), 1e-5, 1.0 - 1e-5)
        likely = (cost * np.where(right, np.log(p), np.log(1.0 - p))).sum()
        small = PRIOR * len(rows) / 1000.0 * (x[1:-1] ** 2).sum()
        return float(-likely + small + 2.0 * x[-1] ** 2)

    bounds: list[tuple[float | None, float | None]] = [(None, None)]
    for number, name in enumerate(SIGNS[1:], start=1):
        least = LEAST.get(name, 0.0) * float(scale[number])
        bounds.append((least, None) if name in MORE_IS_BETTER else (None, least))
    start = np.array([0.0 if low is None else low for low, _ in bounds] + [0.0])
    best = minimize(loss, start, method="L-BFGS-B", bounds=[*bounds, (-1.0, 1.5)]).x
    return best[:-1] / scale, math.exp(float(best[-1]))


def trusted(one: Row, weights: NDArray[np.float64], factor: float) -> float:
    """As `app.core.turning.confidence.trust`, with other weights."""
    z = float(np.clip(np.dot(weights, signs(one["evidence"])), -50.0, 50.0))
    close = math.erf(CLOSE_DEG / (math.sqrt(2.0) * factor * deviation_deg(one["evidence"])))
    return close / (1.0 + math.exp(-z))


def fit(rows: list[Row]) -> dict[str, Any]:
    """Fit all, and each fifth of the rooms by the others."""
    rooms = sorted({r["room"] for r in rows})
    told: dict[str, list[tuple[float, bool]]] = {}
    for fold in range(FOLDS):
        left_out = set(rooms[fold::FOLDS])
        weights, factor = greatest_likelihood([r for r in rows if r["room"] not in left_out])
        for one in (r for r in rows if r["room"] in left_out):
            kind = one["kind"] + (", lens known" if one["evidence"].wide is None else "")
            told.setdefault(kind, []).append((trusted(one, weights, factor), one["right"]))
    weights, factor = greatest_likelihood(rows)
    sure = {k: [right for p, right in v if p >= LEAST_CONFIDENCE] for k, v in told.items()}
    return {
        "rows": len(rows),
        "weights": {name: round(float(w), 2) for name, w in zip(SIGNS, weights, strict=True)},
        "error_factor": round(factor, 2),
        "rooms_left_out": {
            kind: {"rows": len(told[kind]), "accepted": len(sure[kind]), "right": sum(sure[kind])}
            for kind in sorted(told)
        },
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("kept", type=Path)
    parser.add_argument("--fit", action="store_true")
    args = parser.parse_args()
    kept: dict[str, list[Row]] = pickle.loads(args.kept.read_bytes()) if args.kept.is_file() else {}
    if args.fit:
        print(json.dumps(fit([r for rows in kept.values() for r in rows]), indent=1))
        return
    maps = learnt({**scenes(), **demo_spots()})
    if "live" not in kept:
        kept["live"] = live(maps)
    for path in sorted(args.folder.glob("*.json"), key=lambda f: (f.stem[-3:], f.stem)):
        if path.stem not in kept:
            kept[path.stem] = of_photo(path, maps)
            args.kept.write_bytes(pickle.dumps(kept))


if __name__ == "__main__":
    main()
