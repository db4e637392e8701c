"""Screen, set sheet and JSON state the same number and name for the same thing."""

from __future__ import annotations

import pytest

from app.core.base.paths import resources
from benchmarks.ui.same_numbers import compare
from tests.helpers.cases import sample_first
from tests.helpers.styles_screen import head

_STYLES = ("left-rembrandt", "right-loop", "silhouette", "clamshell", "left-kicker")
_CASES = [
    (scene, name)
    for name in ("generic", "generic-dark")
    for scene in ("studio", "interior", "city", "sunset", "courtyard", "night")
]


@pytest.mark.parametrize(("scene", "name"), sample_first(_CASES, 2))
def test_screen_sheet_and_json_state_the_same(scene: str, name: str) -> None:
    file = resources() / "demo" / "scenes" / f"{scene}.exr"
    values = list(compare(file, head(name), _STYLES))
    assert len(values) > 40
    differences = [one for one in values if any(each != one[2][0] for each in one[2])]
    assert differences == []
