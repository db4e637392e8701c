"""Where the lens may stand, chosen on the Styles screen; and what the screen shows of it."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from app.core.base.angles import wrap
from app.core.places.place import Place
from app.core.solver.lens.lens_search import solve_lens
from app.core.solver.lens.lens_wish import STRAIGHT, LensWish
from app.ui.screens.styles.lamps_and_lens_view import LensSheet
from app.words.phrases.directions import LENS_CHOICES, aside_words
from tests.helpers.styles_screen import Table, head, scene_light
from tests.ui.test_screen_styles import Shown

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture(params=[False, True], ids=["wide", "compact"])
def shown(qtbot: QtBot, tmp_path: Path, request: pytest.FixtureRequest) -> Shown:
    table = Table(tmp_path)
    place = Place("Court", datetime(2026, 11, 21, 14, 5, tzinfo=UTC))
    table.model.update(place=place, head=head(), light=scene_light("courtyard"))
    return Shown(qtbot, table, compact=request.param)


def opened(shown: Shown) -> LensSheet:
    QTest.mouseClick(shown.view.gallery.lens, LEFT)
    shown.settle()
    sheet = shown.view.sheet
    assert isinstance(sheet, LensSheet)
    return sheet


def asked(shown: Shown) -> LensWish:
    return shown.table.model.lens


def test_short_light_is_one_choice_away(shown: Shown) -> None:
    before = {one.name: one for one in shown.table.model.results}
    sheet = opened(shown)
    sheet._face.chosen.emit("short")
    shown.settle()
    assert asked(shown) == LensWish("short")
    after = {one.name: one for one in shown.table.model.results}
    assert all(one.yaw_deg == 0.0 for one in before.values())
    turned = [one for one in after.values() if one.attainable]
    assert turned
    assert all(one.lighting == "short" for one in turned)
    cards = [card for card in shown.table.presenter.resolve().cards if card.in_reach]
    assert all("short, nose " in card.tip for card in cards)
    shown.table.presenter.choose(cards[0].key)
    assert shown.table.presenter.resolve().detail.side.startswith("Short, nose ")


def test_the_window_answers_as_the_command_does(shown: Shown) -> None:
    shown.table.presenter.lens.choose("auto")
    shown.settle()
    pack, light = head().pack, scene_light("courtyard").searched
    wanted = solve_lens(pack, head().views, light, LensWish("auto"))
    found = shown.table.model.results
    assert [(a.name, a.turn_deg, a.yaw_deg, a.match) for a in found] == [
        (b.name, b.turn_deg, b.yaw_deg, b.match) for b in wanted
    ]


def test_a_background_is_asked_for_on_the_panorama(shown: Shown) -> None:
    sheet = opened(shown)
    now = shown.table.presenter.lens.background_now()
    sheet._toggle.click()
    shown.settle()
    assert asked(shown).yaw == "auto"
    assert asked(shown).background == pytest.approx((wrap(now - 20), wrap(now + 20)))
    assert sheet._panorama.isVisible()
    sheet._panorama.marker_released.emit(wrap(now + 40))
    sheet._width.chosen.emit("10")
    shown.settle()
    assert asked(shown).background == pytest.approx((wrap(now + 30), wrap(now + 50)))
    for one in shown.table.model.results:
        if one.attainable:
            assert asked(shown).met_by(one.turn_refined_deg + shown.table.model.front_deg)
    sheet._toggle.click()
    shown.settle()
    assert asked(shown).background is None


def test_the_choice_can_be_undone(shown: Shown) -> None:
    shown.table.presenter.lens.choose("30")
    shown.settle()
    assert {one.yaw_deg for one in shown.table.model.results if one.attainable} == {30.0}
    shown.table.services.undo.undo()
    shown.settle()
    assert asked(shown) == STRAIGHT


def test_pictures_are_of_the_face_turned_aside(shown: Shown) -> None:
    shown.table.presenter.choose("left-loop")
    shown.settle()
    straight = shown.table.presenter.resolve().detail.here
    shown.table.presenter.lens.choose("30")
    shown.settle()
    aside = shown.table.presenter.resolve().detail
    shown.table.presenter.lens.choose("-30")
    shown.settle()
    other = shown.table.presenter.resolve().detail
    assert straight is not None
    assert aside.here is not None
    assert other.here is not None
    assert aside.target is not None
    assert np.abs(aside.here.astype(int) - other.here.astype(int)).mean() > 5
    assert aside_words(30.0) in aside.side.lower()


def test_a_gain_is_named(shown: Shown) -> None:
    shown.table.model.update(light=scene_light("studio"))
    shown.settle()
    named = [one for one in shown.table.model.results if one.gains and one.attainable]
    assert named
    shown.table.presenter.choose(named[0].name)
    shown.settle()
    gain = named[0].gains[0]
    words = f"{LENS_CHOICES[gain.lighting]}, nose"
    assert words in shown.table.presenter.resolve().detail.reason
    assert (
        f"match {int(gain.match)} instead of {int(named[0].match)}"
        in shown.table.presenter.resolve().detail.reason
    )
