"""How bright the place is: asked, typed, corrected, kept with the place."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from app.core.base.errors import CoreError
from app.core.places.place import CaptureFacts, Place
from app.core.places.place_folder import create_place, read_place, write_place
from app.core.second_light.place_brightness import illuminance, read_lux
from app.ui.screens.light.brightness import STATED
from tests.helpers.light_rig import LightRig
from tests.helpers.styles_screen import scene_light


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> LightRig:
    return LightRig(tmp_path, monkeypatch)


def asks(rig: LightRig) -> bool:
    return rig.state.asks


def asked_lux(rig: LightRig) -> float:
    return rig.questions[-1].gain * illuminance(scene_light().searched, rig.model.front_deg)


@pytest.mark.parametrize(
    ("text", "lux"),
    [("450", 450.0), (" 450 lx", 450.0), ("8,000", 8e3), ("60 000 lux", 6e4), ("2,5", 2.5),
     ("0.5", 0.5), ("1’000", 1e3), ("12,000.5", None), ("", None), ("bright", None), ("-3", None),
     ("0", None), ("1e5", None), ("2000000", None), ("nan", None)],
)  # fmt: skip
def test_lux_as_they_are_typed(text: str, lux: float | None) -> None:
    if lux is None:
        with pytest.raises(CoreError):
            read_lux(text)
    else:
        assert read_lux(text) == lux


def test_what_a_meter_reads_counts(rig: LightRig) -> None:
    rig.start(bright="")
    assert asks(rig)
    assert rig.state.bright.keep == ""
    rig.presenter.scale.type("quite dark")
    assert rig.state.bright.error.startswith("This is not a valid lux value")
    assert rig.hands == []
    rig.presenter.scale.type("42 lx")
    assert not asks(rig)
    assert asked_lux(rig) == pytest.approx(42.0, rel=1e-6)
    assert rig.state.lamp.brightness == STATED.format(lux="42 lx")


def test_a_measured_place_can_be_corrected_and_set_back(rig: LightRig) -> None:
    place = Place("Here", rig.table.services.today(), capture=CaptureFacts(white_cd_m2=120.0))
    rig.start(bright="")
    rig.model.update(place=place)
    measured = asked_lux(rig)
    assert not asks(rig)
    rig.presenter.scale.ask()
    assert asks(rig)
    assert rig.state.bright.keep.startswith("Keep ")
    assert rig.state.bright.measured == ""
    rig.presenter.scale.keep()
    assert not asks(rig)
    rig.presenter.scale.ask()
    rig.presenter.scale.choose("office")
    assert asked_lux(rig) == pytest.approx(300.0, rel=1e-6)
    rig.presenter.scale.ask()
    assert rig.state.bright.key == "office"
    assert rig.state.bright.measured.startswith("Back to the measured ")
    rig.presenter.scale.measure()
    assert not asks(rig)
    assert asked_lux(rig) == pytest.approx(measured, rel=1e-6)


def test_the_answer_does_not_change_when_the_photographer_stands_elsewhere(rig: LightRig) -> None:
    rig.start(bright="cellar")
    before = rig.questions[-1].gain
    rig.model.update(front_deg=90.0)
    assert rig.questions[-1].gain == before


def test_the_answer_is_kept_with_the_place(rig: LightRig) -> None:
    now = rig.table.services.today()
    folder = create_place(rig.table.services.folders.places, "Here", now)
    write_place(folder, replace(read_place(folder), name="Here"))
    rig.runner.held.add("keep")  # a moment later, when the clock goes
    rig.start(bright="")
    rig.model.update(place_folder=folder, place=read_place(folder))
    rig.presenter.scale.type("42")
    rig.table.desk.keep_all()
    kept = read_place(folder).said_white_cd_m2
    assert kept == pytest.approx(rig.questions[-1].gain)
    # Open again: it is known.
    rig.model.update(place_folder=None, place=None)
    assert asks(rig)
    rig.model.update(place_folder=folder, place=read_place(folder))
    assert not asks(rig)
    assert asked_lux(rig) == pytest.approx(42.0, rel=1e-6)


def test_another_camera_is_said(rig: LightRig, tmp_path: Path) -> None:
    from tests.unit.test_presenter_light import own_lamp

    facts = CaptureFacts(camera="RICOH THETA X", white_cd_m2=120.0)
    place = Place("Here", rig.table.services.today(), capture=facts)
    rig.start(bright="")
    rig.model.update(place=place)
    rig.presenter.lamps.take([own_lamp(tmp_path / "mine.exr", known=True)])
    assert "different camera" not in rig.state.note, "nobody knows which took the lamp"
    own = rig.presenter.lamps.own
    assert own is not None
    rig.presenter.lamps.own = replace(own, camera="RICOH THETA Z1")
    assert "different camera (RICOH THETA Z1)" in rig.state.note
    # What the user says comes from no camera.
    rig.presenter.scale.type("100")
    assert "different camera" not in rig.state.note
