"""From the start to the light and on through every screen, as a new user would, by hand."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.alone,
    pytest.mark.skipif(sys.platform != "linux", reason="measures memory as Linux tells it"),
]


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Walk once, in a process of its own; what it found."""
    folder = tmp_path_factory.mktemp("walk")
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
        timeout=280,
        check=False,
    )
    assert report.exists(), done.stderr
    facts: dict[str, Any] = json.loads(report.read_text(encoding="utf-8"))
    assert "error" not in facts, facts["error"]
    return facts


def test_the_walk_ends_well_and_leaves_one_window(walked: dict[str, Any]) -> None:
    assert walked["code"] == 0
    assert walked["windows"] == ["Window"]


def test_four_clicks_and_a_minute_lead_to_the_turn(walked: dict[str, Any]) -> None:
    assert walked["clicks"] <= 4
    assert walked["to_guidance_s"] <= 60.0
    assert "to go" in walked["guidance"]


def test_arrow_keys_alone_lead_into_the_light(walked: dict[str, Any]) -> None:
    assert "You are in the light" in walked["arrived"] or "Hold it" in walked["arrived"]


def test_dragging_and_painting_stay_smooth(walked: dict[str, Any]) -> None:
    assert walked["circle_fps"] >= 30.0
    assert walked["paint_fps"] >= 30.0
    # By the screens' own thread alone: 30 a second need no more.
    assert walked["lamp_ms"] <= 33.0
    assert walked["mask_ms"] <= 33.0


def test_no_event_keeps_the_screens_waiting(walked: dict[str, Any]) -> None:
    """50 ms of CPU; first showings and changes of theme or layout 150 ms."""
    late = [
        f"{event['kind']}: {event['ms']} ms at {event['mark']!r}\n{event['stack']}"
        for event in walked["slow"]
        if event["ms"] > (150.0 if event["mark"].startswith("first: ") else 50.0)
    ]
    assert not late, "\n".join(late)


def test_memory_stays_within_bounds(walked: dict[str, Any]) -> None:
    assert walked["memory_mb"] <= 700.0
    # A captured lamp as large as the court outside comes on top.
    assert walked["memory_with_capture_mb"] <= 1000.0


def test_the_place_is_kept(walked: dict[str, Any]) -> None:
    assert walked["places"] >= 1
