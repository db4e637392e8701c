"""What is kept of a measured light: facts, location, the light itself."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from app.core.base.remarks import PlainRemark
from app.core.measure.finish.corrections import finish
from app.core.measure.options import MeasureOptions
from app.core.measure.read.frame import Bracket, Exposure, Frame
from app.core.places.place_measurement import capture_facts, location_of, merged_light
from tests.helpers.cameras import Rig, pack
from tests.helpers.probes import clip, place, sunny_place


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Rig:
    return Rig(tmp_path_factory.mktemp("capture") / "session")


def probe_of(merged: Any) -> Any:
    """A probe without a bracket's own facts."""
    frames = tuple(Frame(Path(f"{n}.jpg"), (256, 512), exposure=Exposure(1.0)) for n in range(3))
    return SimpleNamespace(
        bracket=Bracket(frames, (2.0, 0.0, -2.0)),
        finished=finish(merged, pack(), MeasureOptions()),
        merged=merged,
    )


def test_facts_of_a_capture(rig: Rig) -> None:
    result = rig.shoot("paper")
    facts = capture_facts(result.probe, result.profile.title, result.plan.kind)
    assert facts.camera == "Ricoh Theta V"
    assert [round(frame.ev) for frame in facts.frames] == [2, 0, -2]
    assert [frame.file for frame in facts.frames] == [
        frame.path.name for frame in result.probe.bracket.frames
    ]
    assert facts.frames[0].clipped_share > facts.frames[2].clipped_share
    planned = result.plan.shots[0].exposure
    assert (facts.frames[1].shutter_s, facts.frames[1].iso) == (planned.shutter_s, planned.iso)
    assert facts.clipped_share == result.probe.finished.measured_clipped
    light = merged_light(result.probe, "Here")
    assert light.name == "Here"
    assert light.environment.radiance.shape == result.probe.merged.radiance.shape


def test_files_count_from_the_middle_frame(rig: Rig) -> None:
    merged = clip(place([(0.0, 0.0, 10.0, 1.0)]))
    one, two = PlainRemark("One."), PlainRemark("Two.")
    probe = SimpleNamespace(**vars(probe_of(merged)), warnings=(one, one, two), notes=(two,))
    facts = capture_facts(probe, "", "files")  # type: ignore[arg-type]
    assert [frame.ev for frame in facts.frames] == [2.0, 0.0, -2.0]
    assert facts.warnings == (one, two)


def test_the_sun_is_found_where_it_stands() -> None:
    merged = clip(sunny_place(40.0, 60.0), 30_000.0, 1.0)
    location = location_of(probe_of(merged))
    assert (location.kind, location.sun) == ("outdoor", True)
    assert location.sun_azimuth_deg == pytest.approx(60.0, abs=1.0)
    assert location.sun_elevation_deg == pytest.approx(40.0, abs=1.0)


@pytest.mark.parametrize(
    ("cd_m2", "kind", "sun"),
    [(100.0, "indoor", False), (6000.0, "outdoor", False), (600.0, "unknown", None)],
)
def test_indoors_or_out_by_the_level_of_light(cd_m2: float, kind: str, sun: bool | None) -> None:
    merged = clip(place([], fill=1.0), cd_m2=cd_m2)
    location = location_of(probe_of(merged))
    assert (location.kind, location.sun) == (kind, sun)


def test_nothing_is_said_where_the_level_is_not_known() -> None:
    location = location_of(probe_of(clip(place([(0.0, 30.0, 10.0, 9.0)]))))
    assert (location.kind, location.sun) == ("unknown", None)
