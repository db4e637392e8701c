"""Losses of the turns from a single plain photo of all directions, and whether they are reported.

    python -m benchmarks.light.plain_panorama [--places DIR ...] [-o FILE.json]

Each HDR panorama is exposed like an automatic camera (its mean code is a middle grey, or 1.5 % of
it is white; also a stop more and less), and saved as an 8-bit sRGB JPEG without EXIF. The file goes
through the pipeline of `merge` alone. The turn of every style that the HDR panorama grades yes or
soft is compared with the best turn there: the lost share of the match range. The gain of white
and the limit of doubt are also chosen for each place from all others.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import tempfile
import time
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT: Final = Path(__file__).resolve().parents[2]
SHARED: Final = ROOT.parent / "shared"

import cv2  # noqa: E402
import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from app.core.base.arrays import Bytes, Float32  # noqa: E402
from app.core.base.atomic_files import atomic_write_text  # noqa: E402
from app.core.base.colour import srgb_encode  # noqa: E402
from app.core.environment.environment import (  # noqa: E402
    energy,
    reduce_light,
    solid_angles,
)
from app.core.environment.environment_file import read_panorama  # noqa: E402
from app.core.measure.bracket.measure import measure  # noqa: E402
from app.core.measure.finish.clip_audit import choices, given_up  # noqa: E402
from app.core.measure.finish.clipped_light import STOPS, brightened, doubts, guesses  # noqa: E402
from app.core.measure.options import MeasureOptions  # noqa: E402
from app.core.solver.solve import solve_all  # noqa: E402
from app.core.styles.style_pack import StylePack  # noqa: E402
from app.core.styles.style_pack_file import load_named_pack  # noqa: E402

FOLDERS: Final = (
    SHARED / "data" / "hdri",
    ROOT / "resources" / "demo" / "scenes",
    ROOT / "resources" / "demo" / "location",
    ROOT / "resources" / "demo" / "cafe",
)
METERINGS: Final = ("grey", "clip")
EVS: Final = (-1, 0, 1)
BAD: Final = 0.10
_GREY: Final = 118.0 / 255.0
_WHITE_SHARE: Final = 0.015
_TRIED_STOPS: Final = (3.0, STOPS, 5.0)
_FOUND: Final = 0.92  # of the bad turns of the other places, for the limit of doubt
_SAME_PLACE: Final = 0.97


def places(folders: tuple[Path, ...]) -> dict[str, Path]:
    """Return all panoramas in some folders by folder and name."""
    files = [file for folder in folders for file in sorted(folder.glob("*")) if file.is_file()]
    return {f"{f.parent.name}/{f.stem}": f for f in files if f.suffix in (".hdr", ".exr")}


def light_of(path: Path) -> Float32:
    """Read a panorama, at most 1,024 columns wide; negative texels become black."""
    light = np.maximum(np.nan_to_num(read_panorama(path).radiance, posinf=65504.0), 0.0)
    if light.shape[1] > 1024:
        light = cv2.resize(light, (1024, 512), interpolation=cv2.INTER_AREA)
    return np.asarray(light, np.float32)


def automatic(light: Float32, metering: str) -> float:
    """Return a camera's automatic exposure factor for a light."""
    if metering == "clip":
        largest = light.max(axis=-1)
        areas = np.repeat(solid_angles(largest.shape), largest.shape[1])
        order = np.argsort(-largest, axis=None)
        place = np.searchsorted(np.cumsum(areas[order]), _WHITE_SHARE * 4.0 * np.pi)
        return 1.0 / float(largest.ravel()[order[place]])
    low, high = -30.0, 30.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        coded = srgb_encode(np.minimum(light * np.float32(2.0**middle), 1.0)).mean(axis=-1)
        bright = float(energy(np.asarray(coded, np.float32))) / (4.0 * np.pi) > _GREY
        low, high = (low, middle) if bright else (middle, high)
    return float(2.0 ** (0.5 * (low + high)))


def photograph(light: Float32, factor: float) -> Bytes:
    """Return codes of a light, (h, w, 3) sRGB."""
    coded = srgb_encode(np.minimum(light * np.float32(factor), 1.0))
    return np.asarray(np.rint(255.0 * coded), np.uint8)


def same_places(lights: dict[str, Float32]) -> dict[str, str]:
    """Return panoramas of the same place as an earlier one, which would test light with itself."""
    small = {}
    for name, light in lights.items():
        mean = cv2.resize(light, (64, 32), interpolation=cv2.INTER_AREA).mean(axis=-1)
        logs = np.log(mean + 1e-3 * mean.mean())
        small[name] = (logs - logs.mean()) / logs.std()
    found: dict[str, str] = {}
    names = list(small)
    for k, name in enumerate(names):
        for other in names[:k]:
            if float((small[name] * small[other]).mean()) > _SAME_PLACE:
                found.setdefault(name, other)
    return found


def judged(
    light: Float32, pack: StylePack, folder: Path, evs: tuple[int, ...] = EVS
) -> list[dict[str, Any]]:
    """Judge every photo of one place: losses of the turns, and doubts."""
    shape = pack.header.environment
    seen = reduce_light(light, shape)
    truth = choices(pack, [seen])[0]
    graded = np.array([one.grade != "no" for one in solve_all(pack, seen)])
    rows = []
    for metering in METERINGS:
        middle = automatic(light, metering)
        for ev in evs:
            file = folder / "photograph.jpg"
            codes = photograph(light, middle * 2.0**ev)
            assert cv2.imwrite(str(file), codes[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 92])
            started = time.perf_counter()
            probe = measure([file], MeasureOptions(alone=True))
            seconds = time.perf_counter() - started
            assert probe.finished.audit is not None
            given = reduce_light(probe.merged.radiance, shape)
            turns = np.array([one.turn_index for one in solve_all(pack, given)])
            lost = given_up(truth, turns)
            marked = [change.in_doubt for change in probe.finished.audit.style_changes]
            low, share = probe.finished.audit.clipped_energy_range
            row: dict[str, Any] = {"metering": metering, "ev": ev, "clipped": round(share, 3)}
            row |= {"clipped_as_it_looks": round(low, 3), "seconds": round(seconds, 2)}
            row["styles"] = [
                {"style": style.name, "given_up": round(float(lost[k]), 4), "doubtful": marked[k]}
                for k, style in enumerate(pack.styles)
                if graded[k]
            ]
            row["tried"] = {}
            looks = probe.finished.measured
            for stops in _TRIED_STOPS:
                each = guesses(looks, brightened(looks, stops))
                found = choices(pack, [reduce_light(one, shape) for one in each])
                told = given_up(truth, found[0].turns)[graded], doubts(found)[graded]
                row["tried"][stops] = told
            rows.append(row)
    return rows


def left_out(rows: dict[str, list[dict[str, Any]]]) -> dict[str, list[tuple[float, bool]]]:
    """Return each place's losses and marks, with values chosen from all other places."""

    def pairs(names: list[str], stops: float, which: int) -> NDArray[Any]:
        return np.concatenate([r["tried"][stops][which] for n in names for r in rows[n]])

    found = {}
    for name in rows:
        others = [other for other in rows if other != name]
        good = {stops: (pairs(others, stops, 0) <= BAD).mean() for stops in _TRIED_STOPS}
        stops = max(_TRIED_STOPS, key=lambda each: good[each])
        lost, doubt = pairs(others, stops, 0), pairs(others, stops, 1)
        limit = float(np.quantile(doubt[lost > BAD], 1.0 - _FOUND))
        found[name] = [
            (float(a), bool(b > limit))
            for row in rows[name]
            for a, b in zip(*row["tried"][stops], strict=True)
        ]
        print(f"{name}: {stops:g} stops, limit {limit:.3f}", flush=True)
    return found


def shares(pairs: list[tuple[float, bool]]) -> dict[str, float | int]:
    """Return the three target shares, in percent."""
    good = [marked for lost, marked in pairs if lost <= BAD]
    bad = [marked for lost, marked in pairs if lost > BAD]
    return {
        "pairs": len(pairs),
        "good": round(100.0 * len(good) / max(len(pairs), 1), 1),
        "bad": len(bad),
        "bad_marked": round(100.0 * sum(bad) / max(len(bad), 1), 1),
        "good_marked": round(100.0 * sum(good) / max(len(good), 1), 1),
    }


def summary(rows: dict[str, list[dict[str, Any]]]) -> dict[str, Any]:
    """Summarise by set of places and exposure, as shipped and with each place left out."""
    chosen = left_out(rows)
    shipped = {
        name: [(s["given_up"], s["doubtful"]) for row in some for s in row["styles"]]
        for name, some in rows.items()
    }
    keys = {
        name: [(row["metering"], row["ev"]) for row in some for _ in row["styles"]]
        for name, some in rows.items()
    }
    found: dict[str, Any] = {}
    for title, pairs in (("as shipped", shipped), ("place left out", chosen)):
        for which in ("hdri", "others", "all"):
            names = [
                n for n in rows if which == "all" or n.startswith("hdri/") == (which == "hdri")
            ]
            for metering in (*METERINGS, ""):
                for ev in (*EVS, None):
                    some = [
                        pair
                        for n in names
                        for pair, key in zip(pairs[n], keys[n], strict=True)
                        if key[0].startswith(metering) and ev in (None, key[1])
                    ]
                    found[f"{title}, {which}, {metering or 'both'}, {ev}"] = shares(some)
    return found


def report(
    places: Iterable[str],
    seconds: float,
    table: Sequence[Mapping[str, float | str]],
    searches: Sequence[Mapping[str, Any]],
    output: Path | None,
) -> None:
    """Print a table, and write it to a file with every search that it sums up."""
    names = sorted(places)
    print(f"{len(names)} places, {seconds:.0f} s")
    print("| " + " | ".join(table[-1]) + " |")
    for row in table:
        values = (f"{v:.3g}" if isinstance(v, float) else str(v) for v in row.values())
        print("| " + " | ".join(values) + " |")
    if output:
        facts = {"places": names, "table": table, "searches": searches}
        atomic_write_text(output, json.dumps(facts, indent=1) + "\n")


def main() -> None:
    """Judge every place, write and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--places", type=Path, nargs="*", default=[])
    name = ROOT / "benchmarks" / "results" / "plain-panorama.json"
    parser.add_argument("-o", type=Path, default=name)
    args = parser.parse_args()
    started = time.perf_counter()
    pack = load_named_pack("generic")
    lights = {n: light_of(path) for n, path in places((*FOLDERS, *args.places)).items()}
    twins = same_places(lights)
    rows: dict[str, list[dict[str, Any]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for place, light in lights.items():
            if place not in twins:
                rows[place] = judged(light, pack, Path(folder))
                own = [
                    (s["given_up"], s["doubtful"])
                    for row in rows[place]
                    if row["ev"] == 0
                    for s in row["styles"]
                ]
                told = shares(own)
                print("|", " | ".join(map(str, [place, *told.values()])), "|", flush=True)
    found = summary(rows)
    for row in (row for some in rows.values() for row in some):
        del row["tried"]
    facts = {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": subprocess.check_output(
            ("git", "rev-parse", "--short", "HEAD"), cwd=ROOT, text=True
        ).strip(),
        "machine": f"{platform.machine()}, {os.cpu_count()} processors",
        "seconds": round(time.perf_counter() - started),
        "same_places": twins,
        "summary": found,
        "places": rows,
    }
    atomic_write_text(args.o, json.dumps(facts, indent=1) + "\n")
    for title, values in found.items():
        print(f"{title:42}", values)


if __name__ == "__main__":
    main()
