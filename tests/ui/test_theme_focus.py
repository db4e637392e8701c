"""The focus ring: where it lies, and when it shows."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import pytest
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot

from app.ui.theme import set_theme, theme
from app.ui.theme.style import FocusRing, install
from app.ui.widgets.buttons import Button
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.surfaces import Scroll, Surface
from tests.helpers.focus import rect_of

PictureOf: TypeAlias = Callable[[QWidget, float], QImage]


@pytest.fixture
def ring(qapp: QApplication) -> FocusRing:
    ring = install(qapp)
    # Whatever was clicked last in another test.
    ring._by_keyboard = True
    return ring


@pytest.fixture
def window(qtbot: QtBot) -> QWidget:
    window = Surface("bg")
    qtbot.addWidget(window)
    window.resize(300, 200)
    window.show()
    qtbot.waitExposed(window)
    return window


def put(button: QWidget, parent: QWidget, x: int = 20, y: int = 20) -> QWidget:
    button.setParent(parent)
    button.setGeometry(x, y, 100, 40)
    button.show()
    return button


def test_there_is_one_ring_for_the_application(qapp: QApplication) -> None:
    assert install(qapp) is install(qapp)


@pytest.mark.parametrize("dpr", [1, 2])
def test_two_pixels_wide_two_away(
    dpr: int, window: QWidget, ring: FocusRing, qtbot: QtBot, picture_of: PictureOf
) -> None:
    button = put(Button("Paint"), window)
    button.setFocus(Qt.FocusReason.TabFocusReason)
    qtbot.waitUntil(lambda: rect_of(ring) == QRect(16, 16, 108, 48))
    image = picture_of(window, dpr)
    colours = [image.pixelColor(x * dpr, 40 * dpr).name() for x in range(14, 22)]
    c = theme().c
    bg, white, ctl = c.bg.name(), c.focus.name(), c.ctl.name()
    assert colours == [bg, bg, white, white, bg, bg, ctl, bg]


def test_it_follows_the_control(window: QWidget, ring: FocusRing, qtbot: QtBot) -> None:
    button = put(Button("Paint"), window)
    button.setFocus(Qt.FocusReason.TabFocusReason)
    button.move(60, 90)
    qtbot.waitUntil(lambda: rect_of(ring) == QRect(56, 86, 108, 48))
    button.hide()
    qtbot.waitUntil(lambda: rect_of(ring) is None)


def test_a_click_hides_it_until_somebody_types(
    window: QWidget, ring: FocusRing, qtbot: QtBot
) -> None:
    button = put(Button("Paint"), window)
    button.setFocus(Qt.FocusReason.TabFocusReason)
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: rect_of(ring) is None)
    QTest.keyClick(button, Qt.Key.Key_Shift)
    qtbot.waitUntil(lambda: rect_of(ring) is not None)


def test_it_goes_around_the_knob_of_a_slider(
    window: QWidget, ring: FocusRing, qtbot: QtBot
) -> None:
    slider = LabelledSlider("Size", 0, 10, 0, 1, "{:.0f}".format)
    put(slider, window)
    slider.setFocus(Qt.FocusReason.TabFocusReason)
    qtbot.waitUntil(lambda: rect_of(ring) is not None)
    before = rect_of(ring)
    assert before is not None
    assert before.width() == before.height() == 24
    QTest.keyClick(slider, Qt.Key.Key_End)
    qtbot.waitUntil(lambda: rect_of(ring) == before.translated(84, 0))


def test_a_scrolled_area_cuts_it_off(window: QWidget, ring: FocusRing, qtbot: QtBot) -> None:
    content = QWidget()
    content.setFixedHeight(900)
    scroll = Scroll(content)
    scroll.setParent(window)
    scroll.setGeometry(0, 0, 300, 100)
    scroll.show()
    button = put(Button("Paint"), content, y=400)
    button.setFocus(Qt.FocusReason.TabFocusReason)
    qtbot.waitUntil(lambda: rect_of(ring) is not None)
    rings = [w for w in scroll.viewport().children() if type(w).__name__ == "_Ring"]
    assert len(rings) == 1
    scroll.verticalScrollBar().setValue(380)
    here = button.mapTo(scroll.viewport(), QPoint(0, 0))
    qtbot.waitUntil(
        lambda: (rect := rect_of(ring)) is not None and rect.topLeft() == here - QPoint(4, 4)
    )


def test_it_survives_the_window_that_held_it(ring: FocusRing, qtbot: QtBot) -> None:
    for _round in range(2):
        window = QWidget()
        window.resize(200, 100)
        window.show()
        button = put(Button("Paint"), window)
        button.setFocus(Qt.FocusReason.TabFocusReason)
        window.activateWindow()
        qtbot.waitUntil(lambda: rect_of(ring) is not None)
        window.close()
        window.deleteLater()
        qtbot.waitUntil(lambda: rect_of(ring) is None)


def test_a_widget_may_decline(window: QWidget, ring: FocusRing, qtbot: QtBot) -> None:
    button = put(Button("Paint"), window)
    button.setProperty("noFocusRing", True)
    button.setFocus(Qt.FocusReason.TabFocusReason)
    qtbot.wait(20)
    assert rect_of(ring) is None


def test_it_is_black_in_contrast() -> None:
    assert set_theme("contrast").c.focus.name() == "#000000"
