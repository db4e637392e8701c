"""Run every command on the whole hostile corpus, and with the worst values of every option.

    .venv/bin/python benchmarks/ui/hostile_files.py [--seconds 3000] [--seed 16] [-o FILE.json]

Each case runs in a separate process (tests/helpers/hostile_runs.py). All must run with no
traceback, no hang, no changed input, no truncated output, at most 2.5 GB. If there is not enough
time for all cases, a seeded selection runs, and the count reports it.
"""

from __future__ import annotations

import argparse
import collections
import json
import platform
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from app.core.base.atomic_files import atomic_write_text
from tests.helpers.hostile_files import make_corpus
from tests.helpers.hostile_runs import (
    MOST_RSS,
    Case,
    Outcome,
    Zygote,
    file_cases,
    option_cases,
)

ROOT = Path(__file__).resolve().parents[2]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=3000.0, help="for all cases together")
    parser.add_argument("--seed", type=int, default=16)
    parser.add_argument("--only", default="", help="only cases with this in their words")
    parser.add_argument("-o", type=Path, help="where the result is kept")
    given = parser.parse_args()
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as place:
        found = run_all(Path(place), given.seed, given.seconds, given.only)
    found |= {
        "commit": commit(),
        "machine": f"{platform.machine()}, {platform.system()}, Python {platform.python_version()}",
        "seconds": round(time.monotonic() - begun),
    }
    print(json.dumps(found, indent=1))
    if given.o is not None:
        atomic_write_text(given.o, json.dumps(found, indent=1) + "\n")
    if found["faults"]:
        sys.exit(1)


def run_all(place: Path, seed: int, seconds: float, only: str) -> dict[str, Any]:
    """Make the corpus and run as many cases as time allows, files and options in turn."""
    corpus = make_corpus(place / "corpus", seed)
    sound = place / "corpus" / "sound"
    calls = [file_cases(each, sound) for each in corpus]
    kinds = {"files": [case for each in calls for case in each], "options": option_cases(sound)}
    order = [
        (kind, case)
        for kind, case in in_turn(calls, kinds["options"], random.Random(seed))
        if only in " ".join(case.words)
    ]
    ran: collections.Counter[str] = collections.Counter()
    codes: collections.Counter[int] = collections.Counter()
    faults: list[dict[str, Any]] = []
    most = longest = Outcome(Case(()), 0, 0.0, 0, "", "", ())
    end = time.monotonic() + seconds
    with Zygote(place / "runs") as zygote:
        for kind, case in order:
            if time.monotonic() > end:
                break
            done = zygote.run(case)
            shutil.rmtree(place / "runs")
            ran[kind] += 1
            codes[done.code] += 1
            most, longest = max(most, done, key=_rss), max(longest, done, key=_seconds)
            if done.faults:
                words = [word.replace(str(place), "") for word in case.words]
                said = done.err.strip().splitlines()[-1:]
                faults.append({"words": words, "faults": done.faults, "said": said})
                print(json.dumps(faults[-1]), file=sys.stderr, flush=True)
    return {
        "seed": seed,
        "files": len(corpus),
        "cases": {kind: {"all": len(cases), "ran": ran[kind]} for kind, cases in kinds.items()},
        "commands": len({case.words[0] for _, case in order}),
        "exit_codes": {str(code): count for code, count in sorted(codes.items())},
        "most_memory_gb": round(most.rss / 1e9, 2),
        "most_memory_case": _short(most, place),
        "memory_limit_gb": MOST_RSS / 1e9,
        "longest_s": round(longest.seconds, 1),
        "longest_case": _short(longest, place),
        "faults": faults,
    }


def in_turn(
    calls: list[list[Case]], options: list[Case], chance: random.Random
) -> list[tuple[str, Case]]:
    """Yield every file through one command, then every file through another, mixed with options."""
    ranked: list[tuple[float, str, Case]] = []
    for cases in calls:
        shuffled = chance.sample(cases, len(cases))
        ranked += [(k + chance.random(), "files", case) for k, case in enumerate(shuffled)]
    ranked += [(3.0 * chance.random(), "options", case) for case in options]
    return [(kind, case) for _, kind, case in sorted(ranked, key=lambda each: each[0])]


def _rss(done: Outcome) -> int:
    return done.rss


def _seconds(done: Outcome) -> float:
    return done.seconds


def _short(done: Outcome, place: Path) -> str:
    return " ".join(done.case.words).replace(str(place), "").replace("/corpus/", "")


def commit() -> str:
    done = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout.strip()


if __name__ == "__main__":
    main()
