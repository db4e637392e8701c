"""What the live preview names, held against the bracket: a sample, and the last whole run.

The bars: of the best three named, at most 10 % of what the place could give is given up in 70 % or
they say that they need the bracket, and in 85 % where the preview clips under 1 % of the light; at
least five answers a second, at most 0.3 s late.
"""

from __future__ import annotations

import json
from typing import Any

import pytest

from app.core.styles.style_pack_file import load_named_pack
from benchmarks.light.live_probe import BAD, FOLDERS, ROOT, measured, places

RESULTS = ROOT / "benchmarks" / "results" / "live-probe.json"
SAMPLE = (("forest", False), ("interior", True))
MORE = (("interior", False), ("courtyard", False), ("sunset", True))
_GRADE_FIRST = pytest.mark.xfail(
    strict=True,
    reason="below: both are yes, and the bracket's best match is far from the preview's",
)


def right(row: dict[str, Any]) -> float:
    """Share of the styles named that give up little, or say that they may."""
    good = [one["given_up"] <= BAD or one["unsure"] for one in row["named"]]
    assert good
    return float(sum(good) / len(good))


@pytest.mark.parametrize(
    ("name", "soft"),
    [
        *SAMPLE,
        *(pytest.param(*one, marks=pytest.mark.slow) for one in MORE),
        pytest.param("studio", False, marks=[pytest.mark.slow, _GRADE_FIRST]),
    ],
)
def test_a_place(name: str, soft: bool) -> None:
    """Each place is held to the bar of all; where nothing is clipped all must be right."""
    row = measured(places(FOLDERS)[name], "S", load_named_pack("generic"), soft=soft)
    assert right(row) >= (1.0 if soft else 0.7)
    assert row["lost"] < 0.01 if soft else row["lost"] > 0.05


def test_the_last_run() -> None:
    found = json.loads(RESULTS.read_text(encoding="utf-8"))
    hard, soft = found["summary"]["all"], found["summary"]["clips_under_1_percent"]
    assert hard["places"] >= 12
    assert hard["within_or_marked"] >= 0.70
    # Marking everything would be no answer.
    assert hard["good_marked"] <= 0.30
    assert hard["bad_marked"] >= 0.90
    assert soft["places"] >= 12
    assert soft["within"] >= 0.85
    for pace in found["pace"].values():
        assert pace["answers_per_s"] >= 5.0
        assert pace["late_s_95"] <= 0.3
