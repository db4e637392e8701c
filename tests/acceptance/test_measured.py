"""What the long benchmarks found, as committed in docs, keeps what this program promises.

Run the benchmark again (its first lines say how) after a change of what it measures.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from app.core.base.angles import difference
from app.core.environment.environment import read_environment, reduce
from app.core.solver.solve import solve_all
from app.core.solver.transport import load_named
from app.core.solver.turn_choice import Limits, Objective
from app.core.styles.style_pack_file import load_named_pack
from tests.helpers.shared import SHARED, needs_shared

PEERS = (
    "debevec",
    "debevec-calibrated",
    "robertson",
    "robertson-calibrated",
    "colour-hdri",
)
BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"


def _read(name: str) -> Any:
    return json.loads((BENCHMARKS / "results" / name).read_text(encoding="utf-8"))


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
    """Luminance at the frames' own size, on every scene and bracket: no peer is better."""
    rows = _read("merge-accuracy.json")["scenes"]
    assert len(rows) == 8 * 2
    for row in rows:
        methods = row["methods"]
        peers = [methods[name] for name in PEERS]
        for measure in ("median", "p95"):
            ours = methods["noise"][measure]
            theirs = [peer[measure] for peer in peers if peer[measure] is not None]
            assert ours <= min(theirs), row["scene"]


def test_merged_light_is_right() -> None:
    """Percent, from the camera's whole frames to 2048 columns as the program does it."""
    for row in _read("merge-accuracy.json")["scenes"]:
        ours = row["methods"]["noise from 5376"]
        assert ours["median"] <= 1.0
        assert ours["p95"] <= 4.0


def test_the_memorial_church_is_no_worse_than_by_any_peer() -> None:
    """Log-RMSE against the published radiance map."""
    found = _read("merge-accuracy.json")["memorial"]
    assert found["noise, auto"] <= min(found[peer] for peer in PEERS if found[peer] is not None)


AGAIN = "light is reduced otherwise now, and match is over the face: to be judged again"


def _brute_force_pairs() -> list[Any]:
    """Every (scene, style, measure) of the committed benchmark."""
    return [
        pytest.param(row, measure, id=f"{row['scene']}-{row['style']}-{measure}")
        for row in _read("brute-force.json")["rows"]
        for measure in ("quality", "match")
    ]


def test_brute_force_is_of_this_transport() -> None:
    found = _read("brute-force.json")
    assert found["transport_sha256"] == load_named("generic").digest
    assert len(found["rows"]) == 5 * 18


@needs_shared
@pytest.mark.xfail(strict=True, reason=AGAIN)
@pytest.mark.parametrize(("measure", "objective"), [("quality", "paper"), ("match", "picture")])
def test_brute_force_is_of_the_turns_that_are_chosen_now(
    measure: str, objective: Objective
) -> None:
    pack = load_named_pack("generic")
    rows = _read("brute-force.json")["rows"]
    for scene in {row["scene"] for row in rows}:
        environment = read_environment(SHARED / "hdri" / f"{scene}.hdr")
        light = reduce(environment, (32, 64))
        found = solve_all(pack, light, objective, limits=Limits(0.0, 0.0))
        chosen = {one.name: one.turn_deg for one in found}
        for row in (row for row in rows if row["scene"] == scene):
            apart = abs(difference(chosen[row["style"]], row[f"{measure}_turn_deg"]))
            assert apart < 1.0, (scene, row["style"])


@pytest.mark.parametrize(("row", "measure"), _brute_force_pairs())
def test_turns_against_brute_force(row: dict[str, Any], measure: str) -> None:
    """At most 1 % of the range is given up; what the first look left open, the second decides."""
    settled = row.get(f"{measure}_settled")
    if settled is None:
        assert row[f"{measure}_given_up"] <= 0.01
    else:
        assert settled["paths_per_pixel"] >= 10_000
        assert settled["given_up"] <= 0.01


def test_pictures_against_stock_mitsuba() -> None:
    """Five indoor scenes, all turns: colour within 1 %, error beyond noise within 3 %."""
    rows = _read("brute-force.json")["pictures"]
    assert len(rows) == 5
    for row in rows:
        assert row["colour"] <= 0.01, row["scene"]
        assert row["rmse"] <= 0.03, row["scene"]
