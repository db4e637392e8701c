"""What is told of real faces in even light, by a flash, from behind, and how far off it may be.

`benchmarks/faces/photos.py` asks all people; this is a sample of them.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.faces.photos import lamps, outcomes
from tests.helpers.shared import SHARED, needs_shared

pytestmark = [pytest.mark.slow, needs_shared]


@pytest.fixture(scope="module")
def people(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("people")
    for file in sorted((SHARED / "people").glob("*.npz"))[1::5]:
        (folder / file.name).symlink_to(file)
    return folder


def test_light_without_a_direction_is_told_apart(people: Path) -> None:
    found = outcomes(people)
    for name in ("even: all around", "even: a little brighter at one side"):
        assert found[name]["told"].get("flat", 0.0) >= 0.9, name
    assert found["flash at the lens"]["told"] == {"front": 1.0}
    assert found["backlight beside a fill"]["told"].get("behind", 0.0) >= 0.9
    assert found["backlight beside a fill"]["told"].get("front", 0.0) <= 0.02
    for ratio in (8, 4, 2):
        assert found[f"key beside a fill of {ratio}:1"]["told"].get("front", 0.0) >= 0.8


def test_stated_error_holds(people: Path) -> None:
    found = lamps(people, step=3)
    assert 0.6 <= found["within_error"] <= 0.85
    assert found["read"] >= 0.9
    assert found["front_told_behind"] == 0
