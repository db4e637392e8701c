"""From the start to the light and on through every screen, as a new user would, by hand.

What else a machine does can make an event slower and a picture later, never the other way round:
where a time is missed the walk is walked again, up to three times, and what is too slow in every
one of them counts. All other facts are those of the first. Events are counted at the usual pace
of a machine: beside a fixed piece of work, done right after each (`tests.helpers.pace`).
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

from app.words.guidance import HOLD, IN_LIGHT

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT = Path(__file__).resolve().parents[2]

_WALKS: Final = 3
_PATIENCE_S: Final = 600

pytestmark = [
    pytest.mark.slow,
    pytest.mark.alone,
    pytest.mark.timeout(_WALKS * (_PATIENCE_S + 20)),
    pytest.mark.skipif(sys.platform != "linux", reason="measures memory as Linux tells it"),
]


@cache
def _walk(lap: int) -> dict[str, Any]:
    """Walk in a process of its own; what it found."""
    with tempfile.TemporaryDirectory(prefix=f"walk-{lap}-") as name:
        folder = Path(name)
        report = folder / "walk.json"
        environment = {
            **os.environ,
            "QT_QPA_PLATFORM": "offscreen",
            "OPENBLAS_NUM_THREADS": "1",
            "TURNLIGHT_HOME": str(folder / "home"),
            "PYTHONPATH": str(ROOT),
        }
        script = Path(__file__).with_name("app_walk.py")
        done = subprocess.run(
            [sys.executable, str(script), str(report), str(time.monotonic())],
            cwd=ROOT,
            env=environment,
            capture_output=True,
            text=True,
            timeout=_PATIENCE_S,
            check=False,
        )
        assert report.exists(), done.stderr
        facts: dict[str, Any] = json.loads(report.read_text(encoding="utf-8"))
    assert "error" not in facts, facts["error"]
    return facts


@pytest.fixture(scope="module")
def walked() -> dict[str, Any]:
    """Facts of the first walk."""
    return _walk(0)


def _best(name: str, bar: float, better: Callable[[float, float], float]) -> float:
    """Give a measure of the first walk, or the best of up to three where the bar is missed."""
    best = float(_walk(0)[name])
    for lap in range(1, _WALKS):
        if better(best, bar) != best:
            best = better(best, float(_walk(lap)[name]))
    return best


def _late(facts: dict[str, Any]) -> dict[tuple[str, str], str]:
    """Events over their bars, in words, by kind and by what the walk was doing."""
    return {
        (event["kind"], event["mark"]): (
            f"{event['kind']}: {event['ms']} ms at {event['mark']!r}\n{event['stack']}"
        )
        for event in facts["slow"]
        if event["ms"] > (150.0 if event["mark"].startswith("first: ") else 50.0)
    }


def test_the_walk_ends_well_and_leaves_one_window(walked: dict[str, Any]) -> None:
    assert walked["code"] == 0
    assert walked["windows"] == ["Window"]


def test_four_clicks_and_a_minute_lead_to_the_turn(walked: dict[str, Any]) -> None:
    assert walked["clicks"] <= 4
    assert _best("to_guidance_s", 60.0, min) <= 60.0
    assert re.search(r"\d+° (counter-)?clockwise|\d+° to go", walked["guidance"])
    assert "° to go" in walked["live"]


def test_arrow_keys_alone_lead_into_the_light(walked: dict[str, Any]) -> None:
    assert IN_LIGHT.here in walked["arrived"] or HOLD in walked["arrived"]


def test_dragging_and_painting_stay_smooth() -> None:
    for name in ("circle_fps", "paint_fps"):
        assert _best(name, 30.0, max) >= 30.0, name
    # By the screens' own thread alone: 30 a second need no more.
    for name in ("lamp_ms", "mask_ms"):
        assert _best(name, 33.0, min) <= 33.0, name


def test_no_event_keeps_the_screens_waiting() -> None:
    """50 ms of CPU at the usual pace; first showings and changes of theme or layout 150 ms."""
    late = _late(_walk(0))
    for lap in range(1, _WALKS):
        if late:
            again = _late(_walk(lap))
            late = {event: words for event, words in late.items() if event in again}
    assert not late, "\n".join(late.values())


def test_memory_stays_within_bounds(walked: dict[str, Any]) -> None:
    # 676 were measured before faces were drawn at full size, which may take 150 more.
    assert walked["memory_mb"] <= 826.0
    # A captured lamp as large as the court outside comes on top.
    assert walked["memory_with_capture_mb"] <= 1000.0


def test_the_place_is_kept(walked: dict[str, Any]) -> None:
    assert walked["places"] >= 1
