"""What the long benchmarks found, as committed in docs, keeps what this program promises.

Run the benchmark again (its command is in docs/light-probe.md) after a change of what it measures.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"


def _read(name: str) -> Any:
    return json.loads((DOCS / name).read_text(encoding="utf-8"))


@pytest.mark.parametrize("objective", ["picture", "paper"])
def test_full_brackets_choose_good_turns(objective: str) -> None:
    """At most 4 % of the (scene, style) pairs give up more than a tenth of their range."""
    found = _read("probe-regret.json")
    assert found["summary"][f"full.{objective}"]["pairs"] == 8 * 18
    assert found["summary"][f"full.{objective}"]["bad"] <= 0.04


@pytest.mark.parametrize("objective", ["picture", "paper"])
def test_every_bad_pair_is_flagged(objective: str) -> None:
    for row in _read("probe-regret.json")["rows"]:
        assert row[objective]["bad_not_flagged"] == [], (row["scene"], row["plan"])


def test_a_sun_that_was_put_back_gives_the_turns_of_the_true_one() -> None:
    found = _read("sun-restored.json")["summary"]
    assert found["within_2_percent_picture"] >= 0.95
    assert found["within_2_percent_paper"] >= 0.95
    assert found["false_restorations"] == {}


def test_merged_light_is_at_least_as_right_as_any_peers() -> None:
    """Luminance, on every scene and bracket: within the bars, and no peer is better."""
    scenes = _read("merge-accuracy.json")["scenes"]
    assert len(scenes) == 8
    for scene in scenes:
        for plan in scene["plans"]:
            ours = plan["methods"]["ours"]
            peers = [value for name, value in plan["methods"].items() if name != "ours"]
            for measure in ("median", "p95"):
                assert ours[measure] <= min(peer[measure] for peer in peers)
