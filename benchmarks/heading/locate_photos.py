"""Measure how often `locate` finds photos in their own place, and how often in another one.

    python benchmarks/heading/locate_photos.py FOLDER --make [--only views|traced|box|crop]
                                               [--share S]
    python benchmarks/heading/locate_photos.py FOLDER [--most N] [--minutes M] [-o FILE.json]

The first takes the photos (the traced ones need mitsuba-oidn, LLVM and an hour), the second
searches for each like `turnlight locate`: with its EXIF, and without. At the spot, cropped
afterwards, beside it by 1 to 3 m, and in the panorama of another room.
"""

from __future__ import annotations

import argparse
import json
import platform
import subprocess
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.core.base.angles import difference
from app.core.base.atomic_files import atomic_write_text
from app.core.localization.photo_location import read_photo, search_photo
from benchmarks.heading.heading_cases import LOCATION, ROOT, demo_spots, learnt, scenes
from benchmarks.heading.locate_cases import (
    SPOTS_M,
    People,
    Views,
    World,
    boxes,
    developed,
    drawn_shots,
    filed,
    traced,
)  # fmt: skip

if TYPE_CHECKING:
    from app.core.localization.features import HeadingIndex
    from app.core.localization.picture_file import PictureFile

SETS: Final = (  # world, kind, photos, seed
    ("views", "at", 300, 16),
    ("crop", "at", 69, 11),
    ("box", "at", 161, 12),
    ("box", "beside", 322, 13),
    ("traced", "at", 150, 14),
    ("traced", "beside", 330, 15),
)
WITHIN_DEG: Final = 2.0
LEAST_SIDE: Final = 210  # of a picture that is not a thumbnail
WIDTH: Final = 0.05


def make(folder: Path, only: str | None, share: float, draw: int) -> None:
    """Take all missing photos."""
    folder.mkdir(parents=True, exist_ok=True)
    people = People()
    for world, kind, count, seed in SETS:
        if only not in (None, world):
            continue
        rooms: dict[str, World] = {**boxes()} if world in ("box", "crop") else {}
        if world == "traced":
            rooms = dict.fromkeys(SPOTS_M, traced())
        if world == "views":
            rooms = {LOCATION: Views()}
        for number, shot in enumerate(
            drawn_shots(world, rooms, kind, round(count * share), seed + draw)
        ):
            path = folder / f"{world}-{kind}-{number:03d}.jpg"
            if path.with_suffix(".json").is_file():
                continue
            picture = developed(rooms[shot.place].light(shot), shot, people)
            filed(shot, picture, path)
            if kind == "at":
                kept = float(np.random.default_rng([shot.seed, 5]).uniform(0.45, 0.8))
                kept = max(kept, LEAST_SIDE / min(shot.size))
                cut = replace(shot, kept=kept, kind="cropped")
                beside = folder / f"{world}-cropped-{number:03d}.jpg"
                filed(cut, picture, beside)
                beside.with_suffix(".json").write_text(json.dumps(cut.told()))
            path.with_suffix(".json").write_text(json.dumps(shot.told()))


def asked(folder: Path, most: int, minutes: float) -> list[dict[str, Any]]:
    """Search for the photos, some of each kind in turn, until the time is up."""
    maps = learnt({**scenes(), **demo_spots()})
    end, rows = time.monotonic() + 60.0 * minutes, []
    files = sorted(folder.glob("*.json"), key=lambda f: (f.stem[-3:], f.stem))
    for path in files:
        number = int(path.stem[-3:])
        if number >= most or time.monotonic() > end:
            continue
        told = json.loads(path.read_text())
        photo = read_photo(path.with_suffix(".jpg"))
        bare = replace(photo, focal_mm=None)
        kind = f"{told['world']}, {told['kind']}"
        for way, picture in (("EXIF", photo), ("none", bare)):
            if told["kind"] == "cropped" and way == "none":
                continue
            rows.append(answer(kind, way, told, picture, maps[told["place"]], photo))
            if told["kind"] != "cropped" and number % 2 == (way == "none"):
                names = sorted(set(maps) - {told["place"]} - set(SPOTS_M))
                other = names[(7 * number + len(kind)) % len(names)]
                row = answer("elsewhere", way, told, picture, maps[other], photo)
                rows.append(row | {"off": 180.0})
    return rows


def answer(
    kind: str,
    way: str,
    told: dict[str, Any],
    picture: PictureFile,
    index: HeadingIndex,
    photo: PictureFile,
) -> dict[str, Any]:
    """Search once, and compare the answer with the truth."""
    sought = search_photo(picture, index)
    found = sought.heading
    off = 180.0 if found.heading_deg is None else difference(found.heading_deg, told["heading_deg"])
    return {
        "kind": kind,
        "way": way,
        "name": f"{told['seed']}",
        "found": found.heading_deg is not None,
        "confidence": round(found.confidence, 3),
        "off": round(abs(off), 3),
        "width": round(found.fov_deg / told["fov_deg"] - 1.0, 4),
        "cropped": sought.stated_deg is not None,
        "probe_deg": round(told["probe_deg"], 1),
    }


def table(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the shares of each kind."""
    result = []
    for kind, way in sorted(Counter((r["kind"], r["way"]) for r in rows)):
        mine = [r for r in rows if (r["kind"], r["way"]) == (kind, way)]
        found = [r for r in mine if r["found"]]
        right = [r for r in found if r["off"] <= WITHIN_DEG]
        width = np.abs([r["width"] for r in right])
        result.append(
            {
                "photographs": kind,
                "field_of_view": way,
                "number": len(mine),
                "accepted": len(found),
                "right": len(right),
                "width_median": round(float(np.median(width)), 4) if len(right) else None,
                "width_within": round(float((width <= WIDTH).mean()), 3) if len(right) else None,
                "told_cropped": sum(r["cropped"] for r in found),
            }
        )
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--make", action="store_true")
    parser.add_argument("--only", choices=["views", "traced", "box", "crop"])
    parser.add_argument("--share", type=float, default=1.0)
    parser.add_argument("--draw", type=int, default=0, help="another gives other photographs")
    parser.add_argument("--most", type=int, default=1000)
    parser.add_argument("--minutes", type=float, default=600.0)
    parser.add_argument("-o", dest="output", type=Path)
    args = parser.parse_args()
    if args.make:
        make(args.folder, args.only, args.share, args.draw)
        return
    started = time.process_time()
    rows = asked(args.folder, args.most, args.minutes)
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()
    result = {
        "commit": commit,
        "machine": f"{platform.machine()}, 2 cores shared with others",
        "processor_seconds": round(time.process_time() - started),
        "rows": table(rows),
        "wrong": [r for r in rows if r["found"] and r["off"] > WITHIN_DEG],
    }
    text = json.dumps(result, indent=1) + "\n"
    if args.output:
        atomic_write_text(args.output, text)
    else:
        print(text)


if __name__ == "__main__":
    main()
