"""The Light screen by mouse and keyboard."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QWidget
from pytestqt.qtbot import QtBot

from app.ui.presenters.light_state import DISTANCES_M
from app.ui.screens.light import LightScreen
from app.ui.screens.light.screen import column_widths
from app.ui.theme import set_theme, theme
from app.ui.widgets.buttons import Button
from tests.helpers.light_rig import BEST, LightRig
from tests.helpers.styles_screen import scene_light
from tests.ui.test_window_reach import cut_off, overlapping

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
        rig.presenter.set_brightness(bright)
    qtbot.wait(10)
    return view


def button(view: QWidget, words: str) -> QAbstractButton:
    found = [one for one in view.findChildren(QAbstractButton) if one.text() == words]
    return next(one for one in found if one.isVisible())


def test_from_nothing_to_a_lamp_and_a_brightness_by_two_clicks(qtbot: QtBot, rig: LightRig) -> None:
    view = screen_of(qtbot, rig, lamp="", bright="")
    button(view, "Take the phone").click()
    assert view.stack.currentWidget() is view.question
    assert len(view.question.answers) == 7
    button(view, "Cellar, 30 lx").click()
    assert view.middle.isVisible()
    assert [row.state.key for row in view.lamp.rows][:2] == ["badger", "below"]
    assert view.lamp.lamp.key == "phone"
    assert view.lamp.bright.key == "cellar"


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
    phone = button(view, "Take the phone")
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
    assert "Match without the lamp 20, with it 62" in view.detail.tile.accessibleName()


def test_there_is_one_amber_button(qtbot: QtBot, rig: LightRig) -> None:
    view = screen_of(qtbot, rig)
    amber = [one for one in view.findChildren(Button) if one.kind == "primary" and one.isVisible()]
    assert [one.text() for one in amber] == ["Turn first"]


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


def test_following_the_hand_takes_little_of_the_screens_thread(qtbot: QtBot, rig: LightRig) -> None:
    view = screen_of(qtbot, rig)
    longest = 0.0
    for step in range(20):
        start = time.thread_time()
        rig.presenter.hold_at(-74.0 + step, 0.5 * step)
        view.grab()
        longest = max(longest, time.thread_time() - start)
    # Painting the whole screen anew is in it, which no event does.
    assert longest < 0.2
    start = time.thread_time()
    for step in range(50):
        rig.presenter.hold_at(float(step), 0.5 * step)
    assert (time.thread_time() - start) / 50 < 0.012
