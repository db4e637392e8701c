"""The Light screen by mouse and keyboard."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QWidget
from pytestqt.qtbot import QtBot

from app.core.second_light.captured_lamps.captured_lamp import make_lamp
from app.ui.screens.light.brightness import STATED
from app.ui.screens.light.lamp import DISTANCES_M
from app.ui.screens.light.own_lamp.capture_view import CaptureSheet
from app.ui.screens.light.own_lamp.mask_view import MaskSheet
from app.ui.screens.light.screen_view import LightScreen, column_widths
from app.ui.screens.light.style_list import NOW_POSSIBLE
from app.ui.screens.light.style_list_view import SectionHeading
from app.ui.theme import set_theme, theme
from app.ui.widgets.buttons import Button
from app.ui.widgets.dialogs import LineSheet
from app.words.lamps import HARDLY_CHANGES
from app.words.phrases.quantities import lower_first
from tests.helpers.light_rig import BEST, LightRig
from tests.helpers.pace import units
from tests.helpers.styles_screen import scene_light
from tests.ui.test_window_reach import cut_off, overlapping
from tests.unit.test_presenter_light import own_lamp

KEY = Qt.Key


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> LightRig:
    return LightRig(tmp_path, monkeypatch)


def screen_of(
    qtbot: QtBot, rig: LightRig, lamp: str = "phone", bright: str = "living", compact: bool = False
) -> LightScreen:
    rig.table.open(scene_light())
    view = LightScreen(rig.presenter, compact)
    qtbot.addWidget(view)
    view.resize(*((952, 620) if compact else (1352, 804)))
    rig.presenter.attach(view)
    view.show()
    if lamp:
        rig.presenter.take_lamp(lamp)
    if bright:
        rig.presenter.scale.choose(bright)
    qtbot.wait(10)
    return view


def button(view: QWidget, words: str) -> QAbstractButton:
    found = [one for one in view.findChildren(QAbstractButton) if one.text() == words]
    return next(one for one in found if one.isVisible())


def test_from_nothing_to_a_lamp_and_a_brightness_by_two_clicks(qtbot: QtBot, rig: LightRig) -> None:
    view = screen_of(qtbot, rig, lamp="", bright="")
    button(view, "Use the phone").click()
    assert view.stack.currentWidget() is view.question
    assert len(view.question.answers) == 8
    button(view, "Cellar, 30 lx").click()
    assert view.middle.isVisible()
    assert [row.state.key for row in view.lamp.rows][:2] == ["badger", "below"]
    assert view.lamp.lamp.key == "phone"
    assert rig.state.lamp.brightness == STATED.format(lux="30 lx")


def test_a_light_meter_answers_too_and_can_be_corrected(qtbot: QtBot, rig: LightRig) -> None:
    view = screen_of(qtbot, rig, bright="")
    field = view.question.lux
    field.edit.setFocus()
    QTest.keyClicks(field.edit, "dark")
    QTest.keyClick(field.edit, KEY.Key_Return)
    assert "not a valid lux value" in field.edit.accessibleDescription()
    field.edit.selectAll()
    QTest.keyClicks(field.edit, "42")
    assert field.edit.accessibleDescription() == ""
    view.question.take.click()
    assert view.middle.isVisible()
    assert view.middle.map.hasFocus()
    button(view, "Correct…").click()
    assert view.stack.currentWidget() is view.question
    assert view.question.lux.text() == "42"
    assert button(view, "Keep 42 lx").isVisible()
    button(view, "Keep 42 lx").click()
    assert view.middle.isVisible()


def test_the_power_is_stepped_by_buttons_and_keys(qtbot: QtBot, rig: LightRig) -> None:
    rig.power = 1 / 8
    view = screen_of(qtbot, rig, lamp="panel")
    detail = view.detail
    detail.stronger.click()
    assert rig.state.detail.power == "1/4, 2 stops down"
    rig.presenter.focus_lamp()
    for key, power in (
        (KEY.Key_PageDown, "1/8"),
        (KEY.Key_PageDown, "1/16"),
        (KEY.Key_Home, "1/8"),
    ):
        QTest.keyClick(view.middle.map, key)
        assert rig.state.detail.power.startswith(f"{power}, ")
    rig.power = 1.0
    rig.presenter.take_lamp("bulb")
    assert not detail.power.isVisible()


def own_on(qtbot: QtBot, rig: LightRig, tmp_path: Path) -> LightScreen:
    view = screen_of(qtbot, rig)
    rig.presenter.lamps.take([own_lamp(tmp_path / "mine.exr", known=True)])
    qtbot.wait(10)
    assert view.lamp.more.isVisible()
    return view


def test_a_lamp_of_ones_own_is_renamed_in_a_sheet(
    qtbot: QtBot, rig: LightRig, tmp_path: Path
) -> None:
    view = own_on(qtbot, rig, tmp_path)
    rig.presenter.lamp_actions.ask("rename")
    sheet = view.sheet
    assert isinstance(sheet, LineSheet)
    assert sheet.field.edit.hasFocus()
    QTest.keyClicks(sheet.field.edit, " ")
    QTest.keyClick(sheet.field.edit, KEY.Key_Return)
    assert sheet.isVisible()
    assert sheet.field.edit.accessibleDescription().startswith("A name is missing.")
    QTest.keyClicks(sheet.field.edit, "Desk lamp")
    QTest.keyClick(sheet.field.edit, KEY.Key_Return)
    assert view.sheet is None
    assert rig.state.lamp.items[0][1] == "Desk lamp"


def test_capturing_shows_the_steps_and_a_wrong_distance_stays_open(
    qtbot: QtBot, rig: LightRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    view = screen_of(qtbot, rig)
    asked: list[int] = []
    monkeypatch.setattr(view, "ask_pictures", lambda: asked.append(1))
    view.detail.own.click()
    sheet = view.sheet
    assert isinstance(sheet, CaptureSheet)
    assert sheet.name.edit.hasFocus()
    assert not sheet.place.isVisible()
    QTest.keyClicks(sheet.name.edit, "Panel")
    QTest.keyClicks(sheet.distance.edit, "near")
    sheet.files.click()
    assert sheet.distance.edit.accessibleDescription().startswith("This is not a distance")
    assert not asked
    sheet.distance.set_text("40 cm")
    sheet.files.click()
    assert asked == [1]


def test_a_mask_is_painted_in_a_sheet(qtbot: QtBot, rig: LightRig, tmp_path: Path) -> None:
    view = own_on(qtbot, rig, tmp_path)
    rig.presenter.lamp_actions.ask_mask()
    sheet = view.sheet
    assert isinstance(sheet, MaskSheet)
    assert sheet.canvas.hasFocus()
    assert not sheet.save.isEnabled()
    for widget in sheet.findChildren(QWidget):
        if widget.isVisible() and widget.focusPolicy() & Qt.FocusPolicy.TabFocus:
            assert widget.accessibleName(), widget
    found = [*cut_off(sheet), *overlapping(sheet)]
    assert not found, found
    sheet.tool.part("not").click()
    QTest.keyClick(sheet.canvas, KEY.Key_Return)
    assert sheet.save.isEnabled()
    before = rig.presenter.lamps.own
    sheet.save.click()
    assert view.sheet is None
    after = rig.presenter.lamps.own
    assert before is not None
    assert after is not None
    assert after.alpha.sum() < before.alpha.sum()


@pytest.mark.slow
@pytest.mark.slow
@pytest.mark.alone
def test_painting_a_mask_takes_little_of_the_screens_thread(
    qtbot: QtBot, rig: LightRig, tmp_path: Path
) -> None:
    view = own_on(qtbot, rig, tmp_path)
    own = rig.presenter.lamps.own
    assert own is not None
    rig.presenter.lamps.own = make_lamp(
        own.name,
        np.repeat(np.repeat(own.radiance, 8, axis=0), 8, axis=1),
        np.repeat(np.repeat(own.alpha, 8, axis=0), 8, axis=1),
        white_cd_m2=1.0,
    )
    rig.presenter.lamp_actions.ask_mask()
    sheet = view.sheet
    assert isinstance(sheet, MaskSheet)
    plain, left = Qt.KeyboardModifier.NoModifier, Qt.MouseButton.LeftButton
    point = sheet.canvas.rect().center()
    QTest.mousePress(sheet.canvas, left, plain, point)

    def paint() -> None:
        point.setX(point.x() + 6)
        QTest.mouseMove(sheet.canvas, point)
        sheet.canvas.repaint()

    assert units(paint, 12) < 50


def test_the_dot_moves_in_all_three_drawings(qtbot: QtBot, rig: LightRig) -> None:
    view = screen_of(qtbot, rig)
    for plot in view.middle.plots:
        rig.presenter.go_best()
        before = [QPointF(*(one.lamp_place() or (0, 0))) for one in view.middle.plots]
        start = QPointF(*plot.place_of(*BEST["badger"])).toPoint()
        stop = QPointF(*plot.place_of(-50.0, BEST["badger"][1])).toPoint()
        plain = Qt.KeyboardModifier.NoModifier
        QTest.mousePress(plot, Qt.MouseButton.LeftButton, plain, start)
        QTest.mouseMove(plot, stop)
        QTest.mouseRelease(plot, Qt.MouseButton.LeftButton, plain, stop)
        after = [QPointF(*(one.lamp_place() or (0, 0))) for one in view.middle.plots]
        assert all(a != b for a, b in zip(after, before, strict=True))
        assert rig.state.heads.azimuth_deg == pytest.approx(-50.0, abs=3.0)


def test_the_keyboard_stays_on_the_page(qtbot: QtBot, rig: LightRig) -> None:
    view = screen_of(qtbot, rig, lamp="", bright="")
    phone = button(view, "Use the phone")
    phone.setFocus()
    QTest.keyClick(phone, KEY.Key_Return)
    first = view.question.answers["night"]
    assert first.hasFocus()
    QTest.keyClick(first, KEY.Key_Return)
    assert view.middle.map.hasFocus()


@pytest.mark.parametrize("compact", [False, True])
def test_everything_can_be_done_by_keyboard(qtbot: QtBot, rig: LightRig, compact: bool) -> None:
    view = screen_of(qtbot, rig, compact=compact)
    rig.presenter.focus_lamp()
    assert view.middle.map.hasFocus()
    QTest.keyClick(view.middle.map, KEY.Key_Right)
    assert rig.state.heads.azimuth_deg == BEST["badger"][0] + 1.0
    QTest.keyClick(view.middle.map, KEY.Key_Up, Qt.KeyboardModifier.ShiftModifier)
    assert rig.state.heads.altitude_deg == BEST["badger"][1] + 10.0
    QTest.keyClick(view.middle.map, KEY.Key_Home)
    assert rig.state.detail.at_best
    first = view.lamp.rows[0]
    first.setFocus()
    QTest.keyClick(first, KEY.Key_Down)
    assert rig.state.detail.key == "below"
    view.lamp.distance.setFocus()
    QTest.keyClick(view.lamp.distance, KEY.Key_Right)
    assert rig.state.lamp.distance == DISTANCES_M.index(0.35)
    # Drawings are one stop; the list is another.
    stops = [one for one in view.middle.plots if one.focusPolicy() & Qt.FocusPolicy.TabFocus]
    assert stops == [view.middle.map]


def test_everything_has_a_name(qtbot: QtBot, rig: LightRig) -> None:
    view = screen_of(qtbot, rig)
    for widget in view.findChildren(QWidget):
        if widget.isVisible() and widget.focusPolicy() & Qt.FocusPolicy.TabFocus:
            assert widget.accessibleName(), widget
    assert view.lamp.rows[0].accessibleName().startswith("Badger, ")
    assert view.middle.map.accessibleDescription().startswith("Lamp to the sitter’s right")
    assert re.findall("[0-9]+", view.detail.tile.accessibleName())[:2] == ["20", "62"]


def test_there_is_one_amber_button(qtbot: QtBot, rig: LightRig) -> None:
    view = screen_of(qtbot, rig)
    amber = [one for one in view.findChildren(Button) if one.kind == "primary" and one.isVisible()]
    assert [one.text() for one in amber] == ["Turn first"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dark", "light", "contrast"])
@pytest.mark.parametrize(
    ("scale", "size", "compact"),
    [
        (1.0, (1352, 804), False),
        (1.0, (952, 620), True),
        (1.0, (3752, 2064), False),
        (2.0, (1256, 690), True),
        (2.0, (2704, 1608), False),
    ],
)
def test_nothing_is_cut_off(
    qtbot: QtBot, rig: LightRig, name: str, scale: float, size: tuple[int, int], compact: bool
) -> None:
    set_theme(name, scale)  # type: ignore[arg-type]
    view = screen_of(qtbot, rig, compact=compact)
    view.resize(*size)
    qtbot.wait(10)
    left, right = column_widths(size[0], compact)
    assert left + right < size[0]
    assert max(left, right) <= theme().px(560)
    found = [*cut_off(view), *overlapping(view)]
    assert not found, "\n" + "\n".join(found)
    for column in (view.lamp, view.detail):
        for widget in column.findChildren(QWidget):
            parent = widget.parentWidget()
            if widget.isVisible() and parent is not None and parent.layout() is not None:
                assert widget.geometry().right() <= parent.width(), (widget, widget.geometry())
    for plot in view.middle.plots:
        place = plot.lamp_place()
        assert place is not None
        if plot.isVisible():
            assert plot.rect().contains(QPointF(*place).toPoint())


@pytest.mark.slow
@pytest.mark.alone
def test_following_the_hand_takes_little_of_the_screens_thread(qtbot: QtBot, rig: LightRig) -> None:
    view = screen_of(qtbot, rig)
    steps = iter(range(200))

    def move() -> None:
        step = next(steps)
        rig.presenter.hold_at(-74.0 + step, 0.5 * (step % 50))

    def paint() -> None:
        move()
        view.grab()

    # Painting the whole screen anew is in it, which no event does.
    assert units(paint, 20) < 200
    assert units(move, 50) < 12


@pytest.mark.parametrize("compact", [False, True])
def test_a_lamp_that_changes_nothing_is_said_where_it_is_chosen(
    qtbot: QtBot, rig: LightRig, compact: bool
) -> None:
    rig.same = {"badger", "left-split"}
    view = screen_of(qtbot, rig, compact=compact)
    titles = [one.title for one in view.lamp.findChildren(SectionHeading) if one.isVisible()]
    assert titles == [NOW_POSSIBLE, HARDLY_CHANGES]
    (row,) = (one for one in view.lamp.rows if one.state.key == "left-split")
    row.clicked.emit()
    assert rig.state.detail.key == "left-split"
    words = lower_first(HARDLY_CHANGES)
    assert words in view.detail.tile.accessibleName()
    assert words in row.accessibleName()
