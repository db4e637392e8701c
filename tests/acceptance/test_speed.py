"""The speed bars, as `turnlight bench` and a whole process show them.

Ratios hold on any machine. The absolute times belong to a machine with two current cores; a
slower or busier one is allowed four times as much before it fails the test.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import fields
from functools import cache
from pathlib import Path

import pytest

from app.core.base.paths import resources
from benchmarks.speed.timing.runner.bars import BARS
from benchmarks.speed.timing.runner.rows import Row
from tests.helpers.pace import pace

ROOT = Path(__file__).resolve().parents[2]
SLACK = 4.0
_RUNS = 10

# The whole bench and several runs of one row on a busy machine.
pytestmark = [pytest.mark.slow, pytest.mark.alone, pytest.mark.timeout(2400)]


def _turnlight(*words: str) -> subprocess.CompletedProcess[str]:
    # As users start it: with the tests' large pages, plain code, which allocates most, is faster.
    environ = {name: text for name, text in os.environ.items() if name != "GLIBC_TUNABLES"}
    # One thread: threads that wait for each other on a busy machine measure the others' work.
    environ["OPENBLAS_NUM_THREADS"] = "1"
    return subprocess.run(
        [sys.executable, "-m", "app", *words],
        cwd=ROOT,
        env=environ,
        capture_output=True,
        text=True,
        timeout=800,
        check=True,
    )


@cache
def _rows() -> dict[str, Row]:
    return _measured()


def _measured(*words: str) -> dict[str, Row]:
    found = json.loads(_turnlight("bench", "--no-peers", "--brief", "--json", *words).stdout)
    names = {field.name for field in fields(Row)} - {"peers"}
    rows = [Row(**{name: row[name] for name in names}) for row in found["rows"]]
    return {row.name: row for row in rows}


@pytest.mark.parametrize("name", BARS)
def test_bars(name: str) -> None:
    """A missed bar is measured again: what else a machine does makes it slower, never faster."""
    words = BARS[name].missed(_rows()[name], SLACK)
    for _ in range(_RUNS):
        if not words:
            break
        words = BARS[name].missed(_measured("--only", name)[name], SLACK)
    assert not words


def test_every_row_has_its_limit() -> None:
    assert all(row.limit_seconds > 0 for row in _rows().values())


def test_solve_as_a_whole_process() -> None:
    scene = sorted((resources() / "demo" / "scenes").glob("*.exr"))[0]
    times = []
    for _ in range(3):
        start = time.perf_counter()
        _turnlight("solve", str(scene), "--json")
        times.append((time.perf_counter() - start) / pace())
    assert min(times) <= 1.5
