"""Panoramas that were clipped, or have a gap: the program's reports on them and on whole ones.

    python -m benchmarks.light.marred_panoramas [--places DIR ...] [-o FILE.json]

Each HDR panorama is clipped at eight times its median, and at two stops below its brightest value,
in files of floats and of half floats; and 5 to 50 % of the sphere is removed: a cap below or above,
a wedge, a round patch, a ragged area, by alpha or as black canvas in turn. The file is read as in
`solve`. Reported: whether the environment counts as clipped, and whether its gap is found; the
styles in doubt are compared with those whose grade differs from the whole panorama's, or whose turn
is 11 degrees off or more.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS
from app.core.base.arrays import Bools, Float32
from app.core.base.atomic_files import atomic_write_text
from app.core.base.imaging.images import write_image
from app.core.environment.environment import (
    Environment,
    read_environment,
    reduce,
    solid_angles,
)
from app.core.measure.finish.clip_audit import choices
from app.core.measure.finish.doubtful_answers import doubt_of
from app.core.solver.turn_choice import grade_at
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.light.plain_panorama import FOLDERS, ROOT, light_of, places, same_places

_WIDTHS: Final = {"clip": 1024, "gap": 256}
_SHARES: Final = (0.05, 0.1, 0.2, 0.35, 0.5)
_OFF: Final = 2  # turns of the grid
_EXR: Final = {"compression": "zip", "oiio:ColorSpace": "lin_rec709_scene"}


def whole(path: Path, width: int) -> Float32:
    """Return a panorama of at most that width."""
    light = light_of(path)
    if light.shape[1] <= width:
        return light
    small = cv2.resize(light, (width, width // 2), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float32)


def answers(environment: Environment, pack: StylePack) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the grid turn and grade of each style."""
    found = choices(pack, [reduce(environment, pack.header.environment)])[0]
    return found.turns, grade_at(found.measured, found.limits, found.turns)


def compared(light: Float32, marred: Environment, pack: StylePack) -> list[dict[str, Any]]:
    """Return the value of each style's answer, and whether its doubt is reported."""
    truth, answer = answers(Environment(light, ""), pack), answers(marred, pack)
    doubt = doubt_of(marred, pack)
    told = frozenset[str]() if doubt is None else doubt.styles
    away = np.abs((truth[0] - answer[0] + TURNS // 2) % TURNS - TURNS // 2)
    reach = (truth[1] > 0) | (answer[1] > 0)
    return [
        {
            "style": style.name,
            "in_reach": bool(reach[k]),
            "other_grade": bool(truth[1][k] != answer[1][k]),
            "off": bool(away[k] >= _OFF),
            "doubtful": style.name in told,
        }
        for k, style in enumerate(pack.styles)
    ]


def saved(folder: Path, pixels: Float32, kind: str = "float") -> Environment:
    """Return the environment of a file with these pixels."""
    file = folder / "marred.exr"
    names = ("R", "G", "B", "A")[: pixels.shape[2]]
    file.unlink(missing_ok=True)
    if kind == "half":
        pixels = (pixels * min(1.0, 6e4 / float(pixels.max()))).astype(np.float16).astype("f4")
    write_image(file, np.ascontiguousarray(pixels, np.float32), "float", _EXR, names)
    return read_environment(file)


def clipped(light: Float32, pack: StylePack, folder: Path) -> list[dict[str, Any]]:
    """Return results for the whole panorama and its clipped copies."""
    largest = light.max(axis=-1)
    levels = {
        "none": float("inf"),
        "8 x median": 8.0 * float(np.median(largest)),
        "2 stops": float(largest.max()) / 4.0,
    }
    rows = []
    for name, level in levels.items():
        for kind in ("float", "half"):
            environment = saved(folder, np.minimum(light, np.float32(level)), kind)
            row: dict[str, Any] = {"level": name, "kind": kind}
            row |= {"told": environment.clipped is not None, "blind": environment.blind}
            if kind == "float" and name != "none":
                row["styles"] = compared(light, environment, pack)
            rows.append(row)
    return rows


def gaps(shape: tuple[int, int], seed: int) -> Iterator[tuple[str, float, Bools]]:
    """Yield gaps of every kind and size."""
    rng = np.random.default_rng(seed)
    height, width = shape
    elevation = np.radians(90.0 - (np.arange(height) + 0.5) * 180.0 / height)[:, None]
    azimuth = np.radians((np.arange(width) + 0.5) * 360.0 / width - 180.0)[None]
    up = np.sin(elevation) + 0.0 * azimuth
    areas = np.repeat(solid_angles(shape), width)
    for share in _SHARES:
        middle, height_of = rng.uniform(-np.pi, np.pi), rng.uniform(-0.5, 0.7)
        around = np.cos(elevation) * np.cos(height_of) * np.cos(azimuth - middle)
        toward = np.sin(elevation) * np.sin(height_of) + around
        noise = cv2.GaussianBlur(rng.standard_normal(shape), (0, 0), height / 12)
        ragged = noise / noise.std() + rng.choice([-1.0, 1.0]) * up
        order = np.argsort(-ragged.ravel())
        torn = np.zeros(areas.size, np.bool_)
        torn[order[np.cumsum(areas[order]) < share * 4.0 * np.pi]] = True
        yield "below", share, up < 2.0 * share - 1.0
        yield "above", share, up > 1.0 - 2.0 * share
        yield "wedge", share, np.cos(azimuth - middle) + 0.0 * up > np.cos(np.pi * share)
        yield "patch", share, toward > 1.0 - 2.0 * share
        yield "ragged", share, torn.reshape(shape)


def with_gaps(
    light: Float32, pack: StylePack, folder: Path, seed: int, every: int
) -> list[dict[str, Any]]:
    """Return results for copies of a panorama with gaps."""
    rows = []
    shape = (light.shape[0], light.shape[1])
    for number, (kind, share, gap) in enumerate(gaps(shape, seed)):
        if (number + seed) % every:
            continue
        seen = np.where(gap, 0.0, 1.0).astype(np.float32)[..., None]
        by_alpha = (number + seed) // every % 2 == 0
        pixels = np.dstack([light * seen, seen]) if by_alpha else light * seen
        environment = saved(folder, pixels)
        row = {"kind": kind, "share": share, "by": "alpha" if by_alpha else "canvas"}
        row["reported"] = abs(environment.blind - share) < 0.03
        row["blind"] = round(environment.blind, 4)
        rows.append(row | {"styles": compared(light, environment, pack)})
    return rows


def rates(styles: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the percentages of the styles in doubt."""
    differ = [s for s in styles if s["other_grade"] or (s["off"] and s["in_reach"])]
    any_turn = [s for s in styles if s["other_grade"] or s["off"]]
    same = [s for s in styles if s["in_reach"] and s not in differ]
    return {
        "styles": len(styles),
        "differ": len(differ),
        "differ_doubtful": _percent(differ, "doubtful"),
        "differ_or_turned_out_of_reach": len(any_turn),
        "differ_or_turned_out_of_reach_doubtful": _percent(any_turn, "doubtful"),
        "same_in_reach": len(same),
        "same_in_reach_doubtful": _percent(same, "doubtful"),
    }


def _percent(rows: list[dict[str, Any]], key: str) -> float | None:
    return round(100.0 * sum(row[key] for row in rows) / len(rows), 1) if rows else None


def summary(found: dict[str, dict[str, list[dict[str, Any]]]]) -> dict[str, Any]:
    """Return the table of both kinds of damage."""
    clips = [row for one in found.values() for row in one["clip"]]
    holes = [row for one in found.values() for row in one["gap"]]
    facts: dict[str, Any] = {"places": len(found)}
    for level in ("none", "8 x median", "2 stops"):
        some = [row for row in clips if row["level"] == level]
        styles = [s for row in some for s in row.get("styles", ())]
        facts[f"clipped, {level}"] = {"told": _percent(some, "told")} | (
            rates(styles) if styles else {}
        )
    untouched = [{"told": row["blind"] > 0.0} for row in clips if row["level"] == "none"]
    facts["whole, gap told"] = _percent(untouched, "told")
    for key, values in (("share", _SHARES), ("kind", sorted({row["kind"] for row in holes}))):
        for value in values:
            some = [row for row in holes if row[key] == value]
            facts[f"gap, {value}"] = _gap_rates(some)
    facts["gap, all"] = _gap_rates(holes)
    return facts


def _gap_rates(rows: list[dict[str, Any]]) -> dict[str, Any]:
    styles = [style for row in rows for style in row["styles"]]
    return {"gaps": len(rows), "reported": _percent(rows, "reported")} | rates(styles)


def main() -> None:
    """Judge every place, write and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--places", type=Path, nargs="*", default=[])
    parser.add_argument("--every", type=int, default=2, help="of the 25 gaps of a place")
    name = ROOT / "benchmarks" / "results" / "marred-panoramas.json"
    parser.add_argument("-o", type=Path, default=name)
    args = parser.parse_args()
    started = time.perf_counter()
    pack = load_named_pack("generic")
    files = places((*FOLDERS, *args.places))
    twins = same_places({n: whole(path, 256) for n, path in files.items()})
    found: dict[str, dict[str, list[dict[str, Any]]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for seed, (place, file) in enumerate(files.items()):
            if place in twins:
                continue
            fine, coarse = (whole(file, width) for width in _WIDTHS.values())
            found[place] = {
                "clip": clipped(fine, pack, Path(folder)),
                "gap": with_gaps(coarse, pack, Path(folder), seed, args.every),
            }
            print(place, round(time.perf_counter() - started), "s", flush=True)
    told = summary(found)
    facts = {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": subprocess.check_output(
            ("git", "rev-parse", "--short", "HEAD"), cwd=ROOT, text=True
        ).strip(),
        "seconds": round(time.perf_counter() - started),
        "summary": told,
        "missed": [
            {"place": n} | {k: row[k] for k in ("level", "kind", "told")}
            for n, one in found.items()
            for row in one["clip"]
            if row["told"] == (row["level"] == "none")
        ]
        + [
            {"place": n} | {k: row[k] for k in ("kind", "share", "by", "blind")}
            for n, one in found.items()
            for row in one["gap"]
            if not row["reported"]
        ],
    }
    atomic_write_text(args.o, json.dumps(facts, indent=1) + "\n")
    for title, values in told.items():
        print(f"{title:24}", values)


if __name__ == "__main__":
    main()
