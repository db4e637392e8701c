"""Nose and lens apart: answers for a head turned aside, compared with brute force.

Pictures at several yaws and the best turn and yaw of a place are compared with renders by stock
Mitsuba (`lens_against_stock.py`; two hours on two cores, resumable), short and broad light with
plain geometry, and backgrounds with a loop over all turns and yaws.

    python -m benchmarks.answers.nose_and_lens pictures|search --scenes FOLDER --work FOLDER
    python -m benchmarks.answers.nose_and_lens short-broad|background --scenes FOLDER
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import platform
import subprocess
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS, turn_of_index, wrap
from app.core.base.atomic_files import atomic_write_text
from app.core.base.paths import resources
from app.core.environment.environment import read_environment, reduce
from app.core.portrait.head_views import views_path
from app.core.solver.face import AREAS
from app.core.solver.lens.lens_search import solve_lens
from app.core.solver.lens.lens_wish import LensWish, YawWord
from app.core.solver.lens.view_tables import ViewTables
from app.core.solver.light_map import LightMap
from app.core.solver.search import curves, luminance_of
from app.core.solver.solve import PlaceSearch
from app.core.solver.style_result import StyleResult
from app.core.solver.style_signature import GRADES
from app.core.solver.turn_choice import LIMITS
from app.core.styles.lamps import far_lamp
from app.core.styles.style import StyleLamp
from app.core.styles.style_pack import StylePack
from benchmarks.truth.lens_against_stock import (
    HEAD,
    compare_pictures,
    compare_search,
    load_head,
    render_search,
    seen_styles,
    tables_of,
)
from benchmarks.truth.stock import ROOT

Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]
Bools: TypeAlias = NDArray[np.bool_]

RESULT: Final = ROOT / "benchmarks" / "results" / "nose-and-lens.json"
ASKED: Final[tuple[YawWord, ...]] = ("auto", "short", "broad")
OFFSETS: Final = (30.0, 60.0, 90.0, 120.0, 150.0, 180.0, -150.0, -120.0, -90.0, -60.0, -30.0)
WINDOW_DEG: Final = 40.0
SEED: Final = 22
LIT_STOPS: Final = 0.1
"""Sides of a face with a smaller difference count as equally lit."""
DARK: Final = 0.02
"""Of the brightest value of a half at any turn: below it, the half counts as dark."""


@dataclass(frozen=True, slots=True, eq=False)
class Asker:
    """The program's search for the position of the lens."""

    pack: StylePack
    tables: list[ViewTables] = field(repr=False)
    yaws: tuple[float, ...]

    def __call__(self, light: Float32, wish: LensWish) -> tuple[StyleResult, ...]:
        return solve_lens(self.pack, self.tables, light, wish)


def asker() -> Asker:
    """Load the generic head with its views, for the search."""
    head = load_head()
    return Asker(head.pack, tables_of(head), head.yaws)


def panoramas(scenes: Path) -> Iterator[tuple[str, Float32]]:
    """Yield twenty places: the shared panoramas, and the scenes that ship with the app."""
    demo = resources() / "demo" / "scenes"
    for file in [*sorted(scenes.glob("*.hdr")), *sorted(demo.glob("*.exr"))]:
        yield file.stem.removesuffix("_1k"), reduce(read_environment(file))


# Short and broad


def left_of_nose(azimuth_deg: float, nose_deg: float) -> bool:
    """Return whether an azimuth is to the sitter's left of the nose's direction.

    Seen from above azimuths grow clockwise; left is counter-clockwise of the nose.
    """
    (nx, ny), (x, y) = (
        (np.sin(np.radians(a)), np.cos(np.radians(a))) for a in (nose_deg, azimuth_deg)
    )
    return bool(nx * y - ny * x > 0)


def is_swapped(result: StyleResult, lamp_deg: float) -> bool:
    """Return whether an answer is labelled short or broad against plain geometry.

    Short: the lamp and the lens are on different sides of the nose.
    """
    nose, lens = result.nose_deg, result.turn_refined_deg
    same = left_of_nose(lamp_deg, nose) == left_of_nose(lens, nose)
    return result.lighting != "front" and same != (result.lighting == "broad")


def one_lamp_cases(count: int) -> Iterator[tuple[float, Float32]]:
    """Yield places with one lamp, of any size, anywhere, some with a little light all around."""
    rng = np.random.default_rng(SEED)
    for number in range(count):
        azimuth, elevation = rng.uniform(-180.0, 180.0), rng.uniform(-30.0, 75.0)
        lamp = StyleLamp(-azimuth, elevation, float(np.exp(rng.uniform(0.7, 4.1))), 1.0, 2.0)
        light = far_lamp(lamp, (32, 64))
        if number % 2:
            light = light + light.mean() * rng.uniform(0.0, 0.3)
        yield azimuth, np.repeat(light[..., None], 3, axis=2).astype(np.float32)


def lit_halves(pack: StylePack, light: Float32) -> Float64:
    """Return how many stops brighter the left half of the face is, by azimuth of the nose, (64,).

    0 where the face is almost dark, lit from behind.
    """
    areas = curves(pack.tables, pack.project(light)).others[: len(AREAS)]
    halves = np.stack([areas[AREAS.index(f"{side} half")] for side in ("left", "right")])
    least = DARK * float(halves.max())
    left, right = np.maximum(halves, least)
    return np.asarray(np.log2(left / right))


def lit_otherwise(result: StyleResult, halves: Float64) -> bool:
    """Return whether the label is short or broad and the other half of the face is brighter."""
    stops = float(halves[result.turn_index])
    if result.lighting == "front" or abs(stops) < LIT_STOPS:
        return False
    # A face turned towards its own left shows more of its right half.
    far_is_brighter = (stops > 0) == (result.yaw_deg > 0)
    return far_is_brighter != (result.lighting == "short")


def short_broad(scenes: Path, count: int) -> dict[str, Any]:
    """Compare short and broad with geometry for one lamp, and with lit halves in real places."""
    ask = asker()
    told: Counter[str] = Counter()
    swapped: list[dict[str, Any]] = []
    cases = 0
    for lamp, light in one_lamp_cases(count):
        halves, wrong = lit_halves(ask.pack, light), []
        for yaw in ASKED:
            for one in ask(light, LensWish(yaw)):
                told[f"{yaw}: {one.lighting}"] += 1
                told["other half brighter"] += one.attainable and lit_otherwise(one, halves)
                if is_swapped(one, lamp) or _not_as_asked(one, yaw):
                    about = {"asked": yaw, "style": one.name, "lamp_deg": round(lamp, 2)}
                    about |= {"nose_deg": round(one.nose_deg, 2), "yaw_deg": one.yaw_deg}
                    wrong.append(about | {"lighting": one.lighting, "grade": one.grade})
        cases += bool(wrong)
        swapped += wrong
    return {
        "cases": count,
        "cases_swapped": cases,
        "answers_swapped": len(swapped),
        "answers": dict(sorted(told.items())),
        "swapped": swapped[:100],
        "real_places": _real_places(ask, scenes),
    }


def _not_as_asked(one: StyleResult, yaw: str) -> bool:
    """Return whether short was requested and broad is offered, or the other way round."""
    return yaw in ("short", "broad") and one.attainable and one.lighting != yaw


def _real_places(ask: Asker, scenes: Path) -> dict[str, Any]:
    """Return the answers of real places that are in reach, and those lit the other way."""
    found: dict[str, Any] = {"answers": 0, "not_as_asked": 0, "other_half_brighter": []}
    for place, light in panoramas(scenes):
        halves = lit_halves(ask.pack, light)
        for yaw in ASKED:
            for one in ask(light, LensWish(yaw)):
                if not one.attainable or one.lighting == "front":
                    continue
                found["answers"] += 1
                found["not_as_asked"] += _not_as_asked(one, yaw)
                if lit_otherwise(one, halves):
                    stops = round(abs(float(halves[one.turn_index])), 2)
                    about = {"place": place, "asked": yaw, "style": one.name, "stops": stops}
                    found["other_half_brighter"].append(about)
    return found


# Backgrounds


def background(scenes: Path) -> dict[str, Any]:
    """Return how often another background is possible with the same pattern, by style."""
    ask = asker()
    rows = [row for place, light in panoramas(scenes) for row in background_rows(ask, place, light)]
    styles = [style.name for style in ask.pack.styles]
    by_style = {name: _kept([row for row in rows if row["style"] == name]) for name in styles}
    by_offset = {
        f"{off:g}": _kept([row for row in rows if abs(row["offset_deg"]) == off])
        for off in sorted({abs(off) for off in OFFSETS})
    }
    lost = [row for row in rows if row["can_be_had"] and not row["kept"]]
    return {
        "places": len({row["place"] for row in rows}),
        "window_deg": WINDOW_DEG,
        "all": _kept(rows),
        "by_offset": by_offset,
        "by_style": {name: found for name, found in by_style.items() if found["windows"]},
        "lost": lost,
    }


def background_rows(ask: Asker, place: str, light: Float32) -> Iterator[dict[str, Any]]:
    """Yield the styles attainable straight on, each with windows at several offsets.

    The windows limit what may be behind the sitter; each offset is counted from the background of
    the answer straight on.
    """
    straight = ask(light, LensWish())
    answers = {}
    grades = grades_of(ask.pack, light)
    seen = seen_styles(ask.pack, ask.tables, ask.yaws)
    for row, one in enumerate(straight):
        if not one.attainable:
            continue
        for offset in OFFSETS:
            middle = one.background_deg + offset
            window = (wrap(middle - WINDOW_DEG / 2), wrap(middle + WINDOW_DEG / 2))
            if window not in answers:
                answers[window] = ask(light, LensWish("auto", window))
            held, least = answers[window][row], GRADES.index(one.grade or "no")
            best = best_grade(grades[row], seen[:, row], ask.yaws, window)
            yield {
                "place": place,
                "style": one.name,
                "offset_deg": offset,
                "can_be_had": best >= least,
                "kept": held.attainable and GRADES.index(held.grade or "no") >= least,
                "in_window": not held.attainable or inside(held.background_deg, window),
                "grades": [one.grade, held.grade],
                "matches": [round(one.match, 1), round(held.match, 1)],
                "yaw_deg": held.yaw_deg,
            }


def grades_of(pack: StylePack, light: Float32) -> NDArray[np.int64]:
    """Return the grade of the answer at each azimuth of the nose, evaluated one by one, (S, 64)."""
    light = light / np.float32(light.mean())
    found = curves(pack.tables, pack.project(light))
    here = PlaceSearch(pack, LIMITS, LightMap(luminance_of(light)), found)
    return np.array(
        [
            [GRADES.index(here.verdict(row, at).grade or "no") for at in range(TURNS)]
            for row in range(len(pack.styles))
        ]
    )


def inside(azimuth_deg: float, window: tuple[float, float]) -> bool:
    """Return whether an azimuth is inside a clockwise window, by its distance from the middle."""
    middle = window[0] + ((window[1] - window[0]) % 360.0) / 2
    return abs(wrap(azimuth_deg - middle)) <= WINDOW_DEG / 2 + 1e-6


def best_grade(
    grades: NDArray[np.int64], seen: Bools, yaws: tuple[float, ...], window: tuple[float, float]
) -> int:
    """Return the best grade of all turns and yaws with a background in a window; -1 if none."""
    best = -1
    for yaw, is_seen in zip(yaws, seen.tolist(), strict=True):
        for nose in range(TURNS):
            lens = turn_of_index(nose) + yaw
            if is_seen and inside(lens + 180.0, window):
                best = max(best, int(grades[nose]))
    return best


def _kept(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return shares of windows: possible at all, and found by the program."""
    had = [row for row in rows if row["can_be_had"]]
    return {
        "windows": len(rows),
        "can_be_had": len(had),
        "kept": sum(row["kept"] for row in had),
        "share_had": round(len(had) / max(len(rows), 1), 4),
        "share_kept": round(sum(row["kept"] for row in had) / max(len(had), 1), 4),
        "outside_window": sum(not row["in_window"] for row in rows),
    }


def keep(name: str, found: dict[str, Any], seconds: float, path: Path) -> None:
    """Add the result of one command to those of the others."""
    asked = ["git", "rev-parse", "--short", "HEAD"]
    views = views_path(resources() / "transport" / f"{HEAD}.npz")
    about = {
        "commit": subprocess.check_output(asked, cwd=ROOT, text=True).strip(),
        "machine": f"{platform.machine()}, {os.cpu_count()} processors",
        "seconds": round(seconds),
        "views_sha256": hashlib.sha256(views.read_bytes()).hexdigest(),
    }
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    atomic_write_text(path, json.dumps(known | {name: about | found}, indent=1) + "\n")


def main() -> None:
    """Measure one thing and save it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("what", choices=("pictures", "search", "short-broad", "background"))
    parser.add_argument("--scenes", type=Path, required=True, help="folder of shared panoramas")
    parser.add_argument("--work", type=Path, help="folder for renders, which are used again")
    parser.add_argument("--paths", type=int, help="samples a pixel of each of two seeds")
    parser.add_argument("--noses", type=int, default=2, help="of each place, for the pictures")
    parser.add_argument("--cases", type=int, default=1000, help="of one lamp")
    parser.add_argument("--render-only", action="store_true", help="compare nothing yet")
    parser.add_argument("--compare-only", action="store_true", help="render nothing more")
    parser.add_argument("-o", type=Path, default=RESULT)
    args = parser.parse_args()
    started = time.perf_counter()
    if args.what in ("pictures", "search") and args.work is None:
        parser.error("--work is needed for renders")
    if args.what == "pictures":
        found = compare_pictures(args.scenes, args.work, args.paths or 512, args.noses)
    elif args.what == "search":
        if not args.compare_only:
            render_search(args.scenes, args.work, args.paths or 128)
        if args.render_only:
            return
        found = compare_search(args.scenes, args.work, args.paths or 128)
    elif args.what == "short-broad":
        found = short_broad(args.scenes, args.cases)
    else:
        found = background(args.scenes)
    keep(args.what, found, time.perf_counter() - started, args.o)
    print(json.dumps({k: v for k, v in found.items() if k not in ("rows", "lost", "swapped")}))


if __name__ == "__main__":
    main()
