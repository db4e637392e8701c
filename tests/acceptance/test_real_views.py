"""The heading on views of a real street, whose truth is an essential matrix checked by eye.

`benchmarks/heading/real_views.py` measures all of them (`benchmarks/heading.md`). This is the first
of its four pairs.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.heading.real_views import SHARED, measured

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not SHARED.is_dir(), reason="the street's panoramas are not at hand"),
]


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder: Path = tmp_path_factory.mktemp("street")
    pairs = json.loads((SHARED / "pairs.json").read_text(encoding="utf-8"))[:1]
    (folder / "pairs.json").write_text(json.dumps(pairs), encoding="utf-8")
    for name in (pairs[0]["panorama"], pairs[0]["view_from"]):
        (folder / name).symlink_to(SHARED / name)
    return measured([folder])


def test_views_towards_the_sitter(rows: dict[str, Any]) -> None:
    for name, least in (("toward, sitter found", 0.88), ("toward, sitter not found", 0.85)):
        row = rows[name]
        assert row["right"] >= least * row["views"], name
        assert row["wrong"] == 0, name
    assert rows["toward, sitter found"]["median_deg"] <= 0.4


def test_views_away_from_the_sitter(rows: dict[str, Any]) -> None:
    row = rows["away, `away` asked for"]
    assert row["right"] >= 0.88 * row["views"]
    assert row["wrong"] == 0


def test_a_pan_finds_more(rows: dict[str, Any]) -> None:
    for name, least in (("toward, sitter found", 0.92), ("away, `away` asked for", 0.88)):
        row = rows[f"{name}, after a pan"]
        assert row["right"] >= least * row["views"], name
        assert row["wrong"] == 0, name


def test_views_aside_are_not_taken_for_others(rows: dict[str, Any]) -> None:
    for name in ("aside", "aside, `away` asked for"):
        assert rows[name]["wrong"] == 0, name
