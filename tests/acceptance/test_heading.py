"""A sample of every row of the table in benchmarks/heading.md, measured again, and the record."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
LOCATION_MOST = (1.0, 3.0, 0.90)  # median, 95th percentile, accepted
CROPS_MOST = (0.2, 1.0, 0.96)


@pytest.fixture(scope="module")
def sample() -> dict[str, Any]:
    """The benchmark with few pictures."""
    words = ["--count", "45", "--wrong", "300"]
    done = subprocess.run(
        [sys.executable, "benchmarks/heading/live.py", *words],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
        timeout=1500,
    )
    values: dict[str, Any] = json.loads(done.stdout)
    return values


def check(values: dict[str, Any], slack: float) -> None:
    for kind, row in values["right"].items():
        median, p95, accepted = LOCATION_MOST if kind.startswith("location") else CROPS_MOST
        assert row["median_deg"] <= median, kind
        assert row["p95_deg"] <= p95, kind
        assert row["accepted"] >= accepted - slack, kind
        assert row["turn_median_deg"] <= median, kind
        assert row["turn_p95_deg"] <= p95, kind
    check_turn(values["turn"])
    pairs = sum(row["pairs"] for row in values["wrong"].values())
    accepted = sum(row["accepted"] for row in values["wrong"].values())
    assert accepted <= 0.01 * pairs


def check_turn(rows: list[dict[str, Any]]) -> None:
    """With the sitter found by the program, at -15, 0 and +15 deg, for both ways of looking."""
    median, p95, _ = LOCATION_MOST
    assert {(row["looks"], row["person_deg"]) for row in rows} == {
        (looks, angle) for looks in ("sitter", "photographer") for angle in (-15.0, 0.0, 15.0)
    }
    for row in rows:
        assert row["median_deg"] <= median, row
    for looks in ("sitter", "photographer"):
        # Of a few pictures the 95th percentile is the worst.
        mine = [row for row in rows if row["looks"] == looks]
        most = p95 if sum(row["pictures"] for row in mine) > 100 else 2.0 * p95
        assert sorted(row["p95_deg"] for row in mine)[1] <= p95, looks
        assert max(row["p95_deg"] for row in mine) <= most, looks


def turns_accepted(rows: list[dict[str, Any]], looks: str) -> float:
    mine = [row for row in rows if row["looks"] == looks]
    pictures = sum(row["pictures"] for row in mine)
    return float(sum(row["accepted"] * row["pictures"] for row in mine) / pictures)


def check_speed(values: dict[str, Any]) -> None:
    """By the clock, or, on a machine with other work, by the processor, which is never less."""
    for name, most in (("tracking", 60.0), ("searching", 700.0)):
        assert min(values[f"{name}_ms"], values[f"{name}_processor_ms"]) <= most


@pytest.mark.sweep
@pytest.mark.timeout(1800)
def test_a_sample_of_every_row(sample: dict[str, Any]) -> None:
    # Of 45 pictures one is 2 %: as much may be missing by chance.
    check(sample, 0.03)
    assert sum(row["pairs"] for row in sample["wrong"].values()) >= 250


@pytest.mark.sweep
@pytest.mark.timeout(1800)
def test_the_time_of_a_frame(sample: dict[str, Any]) -> None:
    check_speed(sample)


def test_what_was_measured_reaches_the_table() -> None:
    values = json.loads(
        (ROOT / "benchmarks" / "results" / "heading.json").read_text(encoding="utf-8")
    )
    assert values["panoramas"] == 20
    check(values, 0.0)
    assert sum(row["pairs"] for row in values["wrong"].values()) >= 2000
    check_speed(values)
    about = [row for row in values["reliability"] if row["from"] <= 0.9 < row["to"]]
    assert about
    for row in about:
        assert row["answers"] >= 30
        assert 0.85 <= row["right"] <= 0.95


@pytest.mark.parametrize("looks", ["sitter", "photographer"])
def test_the_turn_is_accepted_as_often_as_the_heading(looks: str) -> None:
    values = json.loads(
        (ROOT / "benchmarks" / "results" / "heading.json").read_text(encoding="utf-8")
    )
    assert turns_accepted(values["turn"], looks) >= LOCATION_MOST[2]
