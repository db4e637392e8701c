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
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from app.core.paths import resources

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT = Path(__file__).resolve().parents[2]
SLACK = 4.0
_RUNS = 3
RATIOS = {
    "solve.quality": 100.0,
    "solve.match": 100.0,
    "solve.match.product": 20.0,
    "paint.segment": 20.0,
    "merge.three": 3.5,
}
SECONDS = {
    "solve.quality": 0.05e-3,
    "solve.match": 0.5e-3,
    "preintegrate.full": 1e-3,
    "preintegrate.stroke": 0.1e-3,
    "render.rgb": 3e-3,
    "paint.segment": 6e-3,
}

# Three runs of the bench on a busy machine.
pytestmark = [pytest.mark.slow, pytest.mark.alone, pytest.mark.timeout(1000)]


def _turnlight(*words: str) -> subprocess.CompletedProcess[str]:
    # One thread: threads that wait for each other on a busy machine measure the others' work.
    environ = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    return subprocess.run(
        [sys.executable, "-m", "app", *words],
        cwd=ROOT,
        env=environ,
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )


@cache
def _rows(lap: int) -> dict[str, dict[str, float]]:
    found = json.loads(_turnlight("bench", "--json").stdout)
    return {row["name"]: row for row in found["rows"]}


def _least(name: str, cost: Callable[[dict[str, float]], float], bar: float) -> float:
    """Least cost of a row in one run of the bench, or in up to three where a bar is missed.

    What else a machine does can make a measurement slower, never faster.
    """
    least = cost(_rows(0)[name])
    for lap in range(1, _RUNS):
        if least > bar:
            least = min(least, cost(_rows(lap)[name]))
    return least


@pytest.mark.parametrize("name", RATIOS)
def test_ratios(name: str) -> None:
    bar = RATIOS[name]
    assert -_least(name, lambda row: -row["ratio"], -bar) >= bar


@pytest.mark.parametrize("name", SECONDS)
def test_seconds(name: str) -> None:
    bar = SLACK * SECONDS[name]
    assert _least(name, lambda row: row["seconds"], bar) <= bar
    assert _rows(0)[name]["limit_seconds"] > 0


def test_merging_three_frames_takes_no_longer_than_decoding_them_three_times() -> None:
    assert _least("merge.three", lambda row: row["seconds"] / row["limit_seconds"], 3.0) <= 3.0


def test_solve_as_a_whole_process() -> None:
    scene = sorted((resources() / "demo" / "scenes").glob("*.exr"))[0]
    times = []
    for _ in range(3):
        start = time.perf_counter()
        _turnlight("solve", str(scene), "--json")
        times.append(time.perf_counter() - start)
    assert min(times) <= 1.5
