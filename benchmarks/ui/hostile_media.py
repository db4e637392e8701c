"""Every command and every entry of the window with films, odd EXIF and XMP, and style files.

    .venv/bin/python benchmarks/ui/hostile_media.py [--seconds 1200] [--part all] [-o FILE.json]

The files are made by tests/helpers/hostile_media.py. Each command runs in a separate process, the
window in one for 60 visits. Required of all: no signal, no traceback, no hang, no changed input, at
most 2.5 GB. If there is not enough time, a seeded selection runs, and the counts report it.
"""

from __future__ import annotations

import argparse
import collections
import json
import os
import platform
import random
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from app.core.base.atomic_files import atomic_write_text
from benchmarks.ui.hostile_files import commit, in_turn
from tests.helpers.hostile_data import Hostile
from tests.helpers.hostile_media import make_media, sound_files
from tests.helpers.hostile_runs import MOST_RSS, Case, Zygote, file_cases
from tests.helpers.hostile_window import DOORS, run_doors

PARTS = ("readers", "commands", "window")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=1200.0, help="for each part")
    parser.add_argument("--part", choices=("all", *PARTS), default="all")
    parser.add_argument("--only", default="", help="only files or doors with this in their words")
    parser.add_argument("--seed", type=int, default=41)
    parser.add_argument("-o", type=Path, help="where the result is kept")
    given = parser.parse_args()
    result: dict[str, Any] = {"commit": commit(), "seed": given.seed}
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        corpus = make_media(place / "media", given.seed)
        result["files"] = dict(collections.Counter(each.kind for each in corpus))
        for part, measure in zip(PARTS, (readers, commands, window), strict=True):
            if given.part in ("all", part):
                result[part] = measure(corpus, place, given)
    result["memory_limit_gb"] = MOST_RSS / 1e9
    result["machine"] = f"{platform.machine()}, {platform.system()}, {platform.python_version()}"
    print(json.dumps(result, indent=1))
    if given.o is not None:
        atomic_write_text(given.o, json.dumps(result, indent=1) + "\n")
    if any(result.get(part, {}).get("faults") for part in PARTS):
        sys.exit(1)


def readers(corpus: list[Hostile], place: Path, given: argparse.Namespace) -> dict[str, Any]:
    """Run every reader with every file, in one process for each file."""
    call = ("call", "tests.helpers.hostile_readers", "read_all")
    return run([Case((*call, str(each.path)), (each.path,)) for each in corpus], place, given)


def commands(corpus: list[Hostile], place: Path, given: argparse.Namespace) -> dict[str, Any]:
    """Run every file through one command, then every file through another."""
    sound = sound_files(place / "sound")
    calls = [file_cases(each, sound) for each in corpus]
    order = in_turn(calls, [], random.Random(given.seed))
    return run([case for _, case in order], place, given)


def run(cases: list[Case], place: Path, given: argparse.Namespace) -> dict[str, Any]:
    cases = [case for case in cases if given.only in " ".join(case.words)]
    codes: collections.Counter[int] = collections.Counter()
    faults: list[dict[str, Any]] = []
    most, longest, begun = 0, 0.0, time.monotonic()
    with Zygote(place / "runs") as zygote:
        for case in cases:
            if time.monotonic() - begun > given.seconds:
                break
            done = zygote.run(case)
            shutil.rmtree(place / "runs")
            codes[done.code] += 1
            most, longest = max(most, done.rss), max(longest, done.seconds)
            if done.faults:
                said = done.err.strip().splitlines()[-1:]
                faults.append({"words": case.words, "faults": done.faults, "said": said})
                print(json.dumps(faults[-1]), file=sys.stderr, flush=True)
    return {
        "cases": len(cases),
        "ran": codes.total(),
        "exit_codes": {str(code): count for code, count in sorted(codes.items())},
        "most_memory_gb": round(most / 1e9, 2),
        "longest_s": round(longest, 1),
        "faults": faults,
        "seconds": round(time.monotonic() - begun),
    }


def window(corpus: list[Hostile], folder: Path, given: argparse.Namespace) -> dict[str, Any]:
    chance = random.Random(given.seed)
    ranked = [
        (place + chance.random(), each.path, door)
        for each in corpus
        for place, door in enumerate(chance.sample(doors_of(each), len(doors_of(each))))
    ]
    # Every file through one entry, then every file through another.
    visits = [(path, door) for _, path, door in sorted(ranked)]
    visits = [visit for visit in visits if given.only in f"{visit[0]} {visit[1]}"]
    begun = time.monotonic()
    done, most, longest = run_doors(visits, folder / "window", given.seconds)
    bad = [each for each in done if each.faults]
    for each in bad:
        print(json.dumps([each.file, each.door, each.faults]), file=sys.stderr, flush=True)
    return {
        "visits": len(visits),
        "ran": len(done),
        "doors": dict(collections.Counter(each.door for each in done)),
        "most_memory_gb": round(most / 1e9, 2),
        "longest_s": longest,
        "faults": [[os.path.basename(each.file), each.door, each.faults] for each in bad],
        "seconds": round(time.monotonic() - begun),
    }


def doors_of(hostile: Hostile) -> tuple[str, ...]:
    """Return all entries; a style's text is also put where the window finds it by itself."""
    text = hostile.path.suffix == ".toml"
    return tuple(door for door in DOORS if text or door != "library of styles")


if __name__ == "__main__":
    main()
