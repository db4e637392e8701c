"""What was measured of mirror balls keeps its promises; a traced one gives its place's turns."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.core.base.angles import difference
from app.core.base.paths import resources
from app.core.environment.environment import enlarge, read_environment, reduce_radiance
from app.core.measure.ball.measure import measure
from app.core.measure.ball.mirror_ball import BallOptions
from app.core.measure.options import MeasureOptions
from app.core.solver.solve import solve_all
from app.core.styles.style_pack_file import load_named_pack
from tests.helpers.mirror_ball import traced, write_bracket

RESULTS = Path(__file__).resolve().parents[2] / "benchmarks" / "results"


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    text = (RESULTS / "mirror-ball.json").read_text(encoding="utf-8")
    loaded: dict[str, Any] = json.loads(text)
    return loaded


def test_every_ball_was_found_and_none_where_there_is_none(found: dict[str, Any]) -> None:
    assert found["summary"]["found"] == len(found["places"]) >= 8
    assert found["summary"]["not_found"] == []
    assert found["without"]["pictures"] >= 50
    assert found["without"]["found_in"] == []


@pytest.mark.parametrize("sides", ["one", "two"])
def test_turns_are_the_panoramas_own(found: dict[str, Any], sides: str) -> None:
    measured = found["summary"][sides]
    assert measured["places"] == 8
    assert measured["within_3_deg"] >= 0.9
    near = found["summary"][f"location_{sides}"]
    assert near["places"] == 4
    pairs = [part["pairs"] for part in (measured, near)]
    assert np.average([part["within_3_deg"] for part in (measured, near)], weights=pairs) >= 0.9


def test_a_traced_ball_gives_the_turns_of_its_place(tmp_path: Path) -> None:
    scene = read_environment(resources() / "demo" / "scenes" / "forest.exr").radiance
    # Nothing as small as the sun, which a few rays a pixel would miss or hit by chance.
    panorama = enlarge(reduce_radiance(scene), (256, 512))
    light = traced(panorama, (640, 960), 85.0, samples=2)
    level = np.float32(4.0 * np.median(light))
    write_bracket(tmp_path, light / level, stops=(2.0, -1.0, -4.0, -7.0))
    pack = load_named_pack("generic")
    probe = measure([tmp_path], MeasureOptions(own=BallOptions()))
    own, other = (
        solve_all(pack, reduce_radiance(each)) for each in (panorama, probe.merged.radiance)
    )
    off = [
        abs(difference(one.turn_refined_deg, two.turn_refined_deg))
        for one, two in zip(own, other, strict=True)
        if one.attainable
    ]
    assert len(off) >= 5
    assert np.mean(np.array(off) <= 3.0) >= 0.9
