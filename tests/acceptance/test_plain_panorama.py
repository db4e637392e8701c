"""One photograph of all directions held against its HDR panorama: a sample, and the last whole run.

The bars: over the pairs graded yes or soft at most 10 % of the match range is given up in 70 %;
of the rest 90 % are marked as doubtful, of the good ones at most 30 %.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from app.core.styles.style_pack_file import load_named_pack
from benchmarks.light.plain_panorama import FOLDERS, ROOT, judged, light_of, places, shares

RESULTS = ROOT / "benchmarks" / "results" / "plain-panorama.json"


@pytest.mark.parametrize(
    ("name", "least"),
    [
        ("scenes/sunrise", 14),
        ("scenes/sunset", 6),
        pytest.param("scenes/city", 6, marks=pytest.mark.slow),
        pytest.param("scenes/interior", 6, marks=pytest.mark.slow),
    ],
)
def test_a_place(name: str, least: int, tmp_path: Path) -> None:
    """Places whose light a photograph holds well enough are answered well, and not doubted."""
    light = light_of(places(FOLDERS)[name])
    rows = judged(light, load_named_pack("generic"), tmp_path, evs=(0,))
    found = shares([(s["given_up"], s["doubtful"]) for row in rows for s in row["styles"]])
    assert found["pairs"] >= least
    assert found["good"] >= 90
    assert found["good_marked"] <= 30


@pytest.mark.parametrize("title", ["as shipped", "place left out"])
@pytest.mark.parametrize("which", ["hdri", "all"])
def test_the_last_run(title: str, which: str) -> None:
    found = json.loads(RESULTS.read_text(encoding="utf-8"))
    assert sum(name.startswith("hdri/") for name in found["places"]) == 12
    assert len(found["places"]) >= 30
    for ev in ("0", "None"):
        values = found["summary"][f"{title}, {which}, both, {ev}"]
        assert values["good"] >= 70
        assert values["bad_marked"] >= 90
        assert values["good_marked"] <= 30
