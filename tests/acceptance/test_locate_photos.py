"""Photographs through real lenses: found where they were taken, refused from metres away.

`benchmarks/heading/locate_photos.py` runs them all; results/locate-photos.json is what it
found. This is a sample, taken and located again: the demo place's views, and rooms made of
panoramas.
"""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOUND = 0.95
TAKEN = 0.01
NOT_HERE = (("box, beside", "traced, beside"), ("elsewhere",))
KNOWN = "EXIF"


def _benchmark(*words: str) -> str:
    done = subprocess.run(
        [sys.executable, "benchmarks/heading/locate_photos.py", *words],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
        timeout=1200,
    )
    return done.stdout


def _row(rows: list[dict[str, Any]], photographs: str, known: str = KNOWN) -> dict[str, Any]:
    (row,) = (r for r in rows if (r["photographs"], r["field_of_view"]) == (photographs, known))
    return row


def _counted(
    rows: list[dict[str, Any]], photographs: tuple[str, ...], known: str
) -> tuple[int, int]:
    """Photographs that were not taken here, and how many of them are accepted."""
    mine = [r for r in rows if r["field_of_view"] == known and r["photographs"] in photographs]
    return sum(r["number"] for r in mine), sum(r["accepted"] for r in mine)


@pytest.mark.sweep
@pytest.mark.timeout(2400)
def test_a_sample(tmp_path: Path) -> None:
    for world in ("views", "box"):
        _benchmark(str(tmp_path), "--make", "--only", world, "--share", "0.08")
    rows = json.loads(_benchmark(str(tmp_path)))["rows"]
    at = _row(rows, "views, at")
    assert at["number"] == 24
    # Of 24 one is 4 %: as much may be missing by chance.
    assert at["right"] >= 22
    assert at["right"] >= at["accepted"] - 1
    assert at["width_within"] == 1.0
    for photographs, known in itertools.product(NOT_HERE, (KNOWN, "none")):
        number, accepted = _counted(rows, photographs, known)
        assert number >= 20
        assert accepted <= 1


def test_what_was_measured_reaches_the_bar() -> None:
    rows = json.loads(
        (ROOT / "benchmarks" / "results" / "locate-photos.json").read_text(encoding="utf-8")
    )["rows"]
    at = _row(rows, "views, at")
    assert at["number"] >= 290
    assert at["right"] >= FOUND * at["number"]
    assert at["width_within"] >= 0.95
    for photographs, known in itertools.product(NOT_HERE, (KNOWN, "none")):
        number, accepted = _counted(rows, photographs, known)
        assert number >= 300
        assert accepted <= TAKEN * number
