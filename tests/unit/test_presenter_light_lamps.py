"""The user's own lamps on the Light screen: captured, renamed, corrected, deleted, painted."""

from __future__ import annotations

import errno
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.core.places.place import CaptureFacts
from app.core.places.place_folder import create_place, read_place
from app.core.second_light.captured_lamps.lamp_library import list_lamps, read_lamp
from app.ui.screens.light.own_lamp.mask import MaskEdit, MaskState
from tests.helpers.light_rig import LightRig
from tests.unit.test_presenter_light import own_lamp


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> LightRig:
    found = LightRig(tmp_path, monkeypatch).start(lamp="")
    found.presenter.lamps.take([own_lamp(tmp_path / "mine.exr", known=True)])
    assert found.presenter.lamps.own is not None
    return found


def titles(rig: LightRig) -> list[str]:
    return [entry.title for entry in list_lamps(rig.presenter.lamps.folder)[0]]


class Sheet:
    """A mask's view that remembers."""

    def __init__(self) -> None:
        self.states: list[MaskState] = []
        self.shuts = 0

    def show_state(self, state: MaskState) -> None:
        self.states.append(state)

    def shut(self) -> None:
        self.shuts += 1


def edit_of(rig: LightRig) -> tuple[MaskEdit, Sheet]:
    rig.presenter.lamp_actions.ask_mask()
    edit, sheet = rig.view.masks[-1], Sheet()
    edit.attach(sheet)
    return edit, sheet


def test_only_lamps_of_the_users_own_can_be_changed(rig: LightRig) -> None:
    own = [one for one in rig.presenter.lamp_actions.actions() if one.enabled()]
    assert [one.key for one in own] == [
        "lamp-rename", "lamp-distance", "lamp-lux", "lamp-mask", "lamp-delete",
    ]  # fmt: skip
    assert rig.state.lamp.own
    rig.presenter.take_lamp("panel")
    assert not any(one.enabled() for one in rig.presenter.lamp_actions.actions())
    assert not rig.state.lamp.own


def test_it_is_renamed(rig: LightRig) -> None:
    rig.presenter.lamp_actions.ask("rename")
    assert rig.view.words[-1].text == "mine"
    rig.presenter.lamp_actions.answer("rename", "  ")
    assert rig.view.said[-1].startswith("A name is missing.")
    rig.presenter.lamp_actions.answer("rename", "Desk lamp")
    assert rig.view.said[-1] == ""
    assert rig.state.lamp.items[0][1] == "Desk lamp"
    assert rig.state.hold.hold.startswith("Hold “Desk lamp” ")


def test_its_distance_is_corrected_and_counts(rig: LightRig) -> None:
    rig.presenter.lamp_actions.ask("distance")
    assert rig.view.words[-1].text == ""
    for text in ("far", "3 mm", "500 m"):
        rig.presenter.lamp_actions.answer("distance", text)
        assert rig.view.said[-1]
    rig.presenter.lamp_actions.answer("distance", "80 cm")
    assert rig.view.said[-1] == ""
    assert rig.state.lamp.distance_fixed
    assert rig.questions[-1].distance_m == 0.8
    assert rig.state.hold.hold_line.startswith("80 cm from the middle of the head")
    assert rig.state.lamp.items[0][2] == "captured, 80 cm away"


def test_it_is_deleted_and_comes_back(rig: LightRig) -> None:
    rig.presenter.lamp_actions.delete()
    assert titles(rig) == []
    assert rig.state.lamp.key == ""
    assert rig.state.empty.startswith("No lamp chosen.")
    assert rig.table.told.messages[-1] == "mine deleted."
    rig.table.told.buttons["Undo"]()
    assert titles(rig) == ["mine"]
    assert rig.state.lamp.key == "own:mine"


def test_its_mask_is_painted_saved_and_brought_back(rig: LightRig) -> None:
    before = rig.presenter.lamps.own
    assert before is not None
    edit, sheet = edit_of(rig)
    assert not sheet.states[-1].changed
    hands = len(rig.hands)
    edit.set_radius(6.0)
    edit.press((90.0, 0.0))
    edit.draw(((100.0, 0.0), (110.0, 5.0)))
    edit.lift()
    edit.set_lit(False)
    edit.press((-2.0, 0.0))
    edit.lift()
    state = sheet.states[-1]
    assert state.changed
    assert state.alpha[32, 96] == 1.0, "azimuth 90 is three quarters of the way across"
    assert state.alpha[32, 63] == 0.0
    edit.undo()
    assert sheet.states[-1].alpha[32, 63] == 1.0
    assert sheet.states[-1].gives.endswith(" at the camera.")
    edit.save()
    assert sheet.shuts == 1
    kept = read_lamp(rig.presenter.lamps.folder, "mine")
    assert kept.alpha[32, 96] == 1.0
    assert len(rig.hands) == hands + 1, "it is placed anew"
    rig.table.told.buttons["Undo"]()
    assert np.array_equal(read_lamp(rig.presenter.lamps.folder, "mine").alpha, before.alpha)


def test_the_lamp_is_found_again_and_nothing_is_lost_by_it(rig: LightRig) -> None:
    edit, sheet = edit_of(rig)
    edit.set_lit(False)
    edit.set_radius(12.0)
    for azimuth in (-8.0, 0.0, 8.0):
        edit.press((azimuth, 0.0))
        edit.lift()
    edit.press((0.0, 12.0))
    edit.draw(((0.0, -12.0),))
    edit.lift()
    assert not sheet.states[-1].alpha.any()
    edit.save()
    assert sheet.states[-1].error, "a lamp without light is no lamp"
    assert sheet.shuts == 0
    edit.find_again()
    found, own = sheet.states[-1].alpha, rig.presenter.lamps.own
    assert own is not None
    both = (found > 0.5) & (own.alpha > 0.5)
    assert both.sum() / ((found > 0.5) | (own.alpha > 0.5)).sum() > 0.9
    edit.undo()
    assert not sheet.states[-1].alpha.any()


def test_capturing_says_how_and_takes_name_and_distance(rig: LightRig, tmp_path: Path) -> None:
    rig.presenter.lamps.begin()
    ask = rig.view.captures[-1]
    assert len(ask.guide) >= 5
    assert ask.place == "", "the place of this test is not kept"
    rig.presenter.lamps.capture("files", "Panel", "around here")
    assert rig.view.said[-1].startswith("This is not a distance")
    assert rig.view.asked == 0
    rig.presenter.lamps.capture("files", "Panel", "60 cm")
    assert rig.view.asked == 1
    rig.presenter.lamps.take([own_lamp(tmp_path / "other.exr", known=True)])
    own = rig.presenter.lamps.own
    assert own is not None
    assert (own.title, own.distance_m) == ("Panel", 0.6)
    # The next one is asked anew.
    rig.presenter.lamps.take([own_lamp(tmp_path / "third.exr", known=True)])
    assert rig.presenter.lamps.own is not None
    assert rig.presenter.lamps.own.title == "third"


def test_the_open_place_is_made_a_lamp(rig: LightRig, tmp_path: Path) -> None:
    folder = create_place(tmp_path / "places", "Dark room", rig.table.services.today())
    own_lamp(folder / "environment-0123456789ab.exr", known=False)
    facts = CaptureFacts(camera="RICOH THETA V", white_cd_m2=850.0)
    place = replace(read_place(folder), environment="environment-0123456789ab.exr", capture=facts)
    rig.model.update(place_folder=folder, place=place)
    rig.presenter.lamps.begin()
    assert "“Dark room”" in rig.view.captures[-1].place
    rig.presenter.lamps.capture("place", "", "0.5")
    own = rig.presenter.lamps.own
    assert own is not None
    assert (own.title, own.distance_m, own.white_cd_m2) == ("Dark room", 0.5, 850.0)
    assert own.camera == "RICOH THETA V"


def test_a_lamp_that_cannot_be_kept_is_tried_again_with_one_button(
    rig: LightRig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = {path: path.read_bytes() for path in rig.presenter.lamps.folder.rglob("*.*")}

    def full(path: Path) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    picture = own_lamp(tmp_path / "second.exr", known=True)
    with monkeypatch.context() as patch:
        patch.setattr("app.core.base.atomic_files._flush", full)
        rig.presenter.lamps.take([picture])
    again = rig.table.told.buttons["Try again"]
    assert titles(rig) == ["mine"]
    assert {path: path.read_bytes() for path in rig.presenter.lamps.folder.rglob("*.*")} == before
    again()
    assert titles(rig) == ["mine", "second"]
