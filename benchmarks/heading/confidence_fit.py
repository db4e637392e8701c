"""Fit the weights of `app/core/localization/confidence.py`, and test them in rooms left out.

    python benchmarks/heading/locate_photos.py FOLDER --make --draw 1000      (only for this)
    python benchmarks/heading/confidence_fit.py FOLDER KEPT.pkl         (gathers evidence; resumes)
    python benchmarks/heading/confidence_fit.py FOLDER KEPT.pkl --fit

Rows are all the ways in which `search_photo` searches for each photo, in its own room and in
another one, and the cases of `heading.py` from another draw. On the line through the sitter, a row
is right within 3 deg; beside it, and elsewhere, none is.
"""

from __future__ import annotations

import argparse
import json
import math
import pickle
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.core.base.angles import difference
from app.core.localization import photo_location as photo_check
from app.core.localization.confidence import (
    CLOSE_DEG,
    LEAST_CONFIDENCE,
    LINE_SIGNS,
    PLACE_SIGNS,
    deviation_deg,
    line_signs,
    place_signs,
)  # fmt: skip
from app.core.localization.heading import FINE, Sight, compare, see
from app.core.localization.heading_conversion import assumed_fov
from app.core.localization.photo_location import read_photo
from app.core.localization.sitter import background_mask
from benchmarks.heading.heading_cases import (
    LOCATION,
    Case,
    crop_cases,
    cut_out,
    demo_spots,
    demo_views,
    learnt,
    location,
    location_cases,
    nothing_cases,
    scenes,
)  # fmt: skip
from benchmarks.heading.locate_cases import SPOTS_M

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from app.core.localization.features import HeadingIndex

TRAIN: Final = 71  # seed of the live pictures
LIVE: Final = 40  # of each kind
FOLDS: Final = 5
MORE_IS_BETTER: Final = ("points", "support", "spread", "share")
# limits of weights that others can nearly replace
WITHIN: Final = {"strays": (-1.0, -0.5), "odd": (-3.0, -1.0)}
FALSE_COST: Final = (1.5, 3.0)  # a wrong heading is worse than none; lens known, or not
PRIOR: Final = 0.02

Row = dict[str, Any]


def row(kind: str, room: str, found: Any, heading_deg: float | None) -> Row | None:
    """Return one answer, and whether it is right."""
    if found is None or found.evidence.points < 1 or found.evidence.zoom < 0.8:
        return None
    heading, pitch, roll = found.pose.angles_deg
    if abs(pitch) > 40.0 or abs(roll) > 25.0:
        return None
    off = 180.0 if heading_deg is None else abs(difference(heading, heading_deg))
    right = off <= CLOSE_DEG and kind not in ("beside", "elsewhere")
    return {"kind": kind, "room": room, "evidence": found.evidence, "off": off, "right": right}


def of_photo(path: Path, maps: dict[str, HeadingIndex]) -> list[Row]:
    """Return all the ways of searching for a photo."""
    told, photo = json.loads(path.read_text()), read_photo(path.with_suffix(".jpg"))
    kind, place, number = told["kind"], told["place"], int(path.stem[-3:])
    names = sorted(set(maps) - set(SPOTS_M) - {place})
    asked = [(place, kind, told["heading_deg"])]
    if kind == "beside" and number % 3 == 0:
        asked.append((names[7 * number % len(names)], "elsewhere", None))
    assumed = assumed_fov((photo.picture.shape[1], photo.picture.shape[0]))
    sitter = photo_check._sitter_in(photo.picture, photo.fov_deg or assumed)
    rows = []
    for who in dict.fromkeys((sitter, None)):
        mask = None if who is None else background_mask(who, photo.picture.shape[:2])
        sight = see(photo.picture, mask, FINE)
        for name, what, heading in asked:
            # A cropped photo searched with the lens of the whole is not an example, right or not.
            for fov in (None,) if kind == "cropped" else (photo.fov_deg, None):
                angle = photo_check._angle(who, fov or assumed)
                rows.append(row(what, place, compare(sight, maps[name], fov, None, angle), heading))
    return [one for one in rows if one is not None]


def live(maps: dict[str, HeadingIndex]) -> list[Row]:
    """Return pictures of `heading.py` from another draw: right, hard, wrong, and empty."""
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


@dataclass(frozen=True, slots=True, eq=False)
class Weights:
    """The fitted values, as in `app.core.localization.confidence`."""

    place: NDArray[np.float64]
    line: NDArray[np.float64]
    factor: float

    def trusted(self, one: Row) -> float:
        """Return the same as `app.core.localization.confidence.trust`."""
        evidence, result = one["evidence"], 1.0
        for weights, told in ((self.place, place_signs), (self.line, line_signs)):
            z = float(np.clip(np.dot(weights, told(evidence)), -50.0, 50.0))
            result /= 1.0 + math.exp(-z)
        return -result * math.expm1(-CLOSE_DEG / (self.factor * deviation_deg(evidence)))


def greatest_likelihood(rows: list[Row]) -> Weights:
    """Return the maximum likelihood weights, none with the wrong sign, and the error's factor."""
    from scipy.optimize import minimize
    from scipy.special import expit

    place, line = (
        np.array([told(r["evidence"]) for r in rows]) for told in (place_signs, line_signs)
    )
    error = np.array([deviation_deg(r["evidence"]) for r in rows])
    right = np.array([r["right"] for r in rows])
    known = np.array([r["evidence"].wide is None for r in rows])
    cost = np.where(right, 1.0, np.where(known, *FALSE_COST))
    scales = [np.maximum(told.std(axis=0), 0.05) for told in (place, line)]
    scales[0][0] = scales[1][0] = 1.0
    split, signs = place.shape[1], (*PLACE_SIGNS, *LINE_SIGNS)

    def loss(x: NDArray[np.float64]) -> float:
        close = -np.expm1(-CLOSE_DEG / (np.exp(x[-1]) * error))
        there, on_line = (
            expit(told / scale @ part)
            for told, scale, part in zip(
                (place, line), scales, (x[:split], x[split:-1]), strict=True
            )
        )
        p = np.clip(there * on_line * close, 1e-6, 1.0 - 1e-6)
        likely = (cost * np.where(right, np.log(p), np.log(1.0 - p))).sum()
        return float(-likely + PRIOR * len(rows) / 1000.0 * (x[:-1] ** 2).sum() + 2.0 * x[-1] ** 2)

    bounds: list[tuple[float, float]] = []
    for name, scale in zip(signs, np.concatenate(scales), strict=True):
        if name in MORE_IS_BETTER:
            bounds.append((0.0, math.inf))
        else:
            least, most = WITHIN.get(name, (-math.inf, math.inf if name == "one" else 0.0))
            bounds.append((least * float(scale), most * float(scale)))
    bounds.append((math.log(0.82), 1.5))
    start = np.clip(np.zeros(len(bounds)), *np.array(bounds, float).T)
    x = minimize(loss, start, method="L-BFGS-B", bounds=bounds).x
    return Weights(x[:split] / scales[0], x[split:-1] / scales[1], math.exp(float(x[-1])))


def fit(rows: list[Row]) -> dict[str, Any]:
    """Fit all, and cross-validate over fifths of the rooms."""
    rooms = sorted({r["room"] for r in rows})
    told: dict[str, list[tuple[float, bool]]] = {}
    for fold in range(FOLDS):
        left_out = set(rooms[fold::FOLDS])
        weights = greatest_likelihood([r for r in rows if r["room"] not in left_out])
        for one in (r for r in rows if r["room"] in left_out):
            kind = one["kind"] + (", lens known" if one["evidence"].wide is None else "")
            told.setdefault(kind, []).append((weights.trusted(one), one["right"]))
    weights = greatest_likelihood(rows)
    sure = {k: [right for p, right in v if p >= LEAST_CONFIDENCE] for k, v in told.items()}
    return {
        "rows": len(rows),
        "place": named(PLACE_SIGNS, weights.place),
        "line": named(LINE_SIGNS, weights.line),
        "error_factor": round(weights.factor, 2),
        "rooms_left_out": {
            kind: {"rows": len(told[kind]), "accepted": len(sure[kind]), "right": sum(sure[kind])}
            for kind in sorted(told)
        },
    }


def named(names: tuple[str, ...], weights: NDArray[np.float64]) -> dict[str, float]:
    """Return weights by name."""
    return {name: round(float(w), 2) for name, w in zip(names, weights, strict=True)}


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
