"""Sliders, text fields and list fields: values, keyboard, errors."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QImage, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QListWidget, QWidget
from pytestqt.qtbot import QtBot

from app.ui.theme import set_theme, theme
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.fields import ListField, TextField
from app.ui.widgets.lists import ListPopup

PictureOf: TypeAlias = Callable[[QWidget, float], QImage]
STYLES = [
    ("rembrandt", "Rembrandt", "sitter’s left (camera right)"),
    ("split", "Split", "sitter’s right (camera left)"),
    ("flat", "Flat", "in front, eye level"),
]


@pytest.fixture
def size(qtbot: QtBot) -> LabelledSlider:
    slider = LabelledSlider("Size", 8, 120, 64, 1, lambda v: f"{v:.0f} px")
    qtbot.addWidget(slider)
    slider.resize(192, slider.sizeHint().height())
    slider.show()
    qtbot.waitExposed(slider)
    return slider


def turn_wheel(widget: QWidget, angle: int) -> None:
    event = QWheelEvent(
        QPointF(5, 5),
        QPointF(widget.mapToGlobal(QPoint(5, 5))),
        QPoint(),
        QPoint(0, angle),
        Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )
    QApplication.sendEvent(widget, event)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        (Qt.Key.Key_Right, 65),
        (Qt.Key.Key_Up, 65),
        (Qt.Key.Key_Left, 63),
        (Qt.Key.Key_Down, 63),
        (Qt.Key.Key_PageUp, 74),
        (Qt.Key.Key_PageDown, 54),
        (Qt.Key.Key_Home, 8),
        (Qt.Key.Key_End, 120),
    ],
)
def test_keys_step(key: Qt.Key, value: float, size: LabelledSlider) -> None:
    sent: list[float] = []
    settled: list[float] = []
    size.changed.connect(sent.append)
    size.settled.connect(settled.append)
    QTest.keyClick(size, key)
    assert sent == settled == [value]
    assert size.amount == value
    assert size.accessibleDescription() == f"{value} px"


def test_shift_steps_further(size: LabelledSlider) -> None:
    QTest.keyClick(size, Qt.Key.Key_Right, Qt.KeyboardModifier.ShiftModifier)
    assert size.amount == 74


def test_other_keys_go_on_to_the_window(qtbot: QtBot) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    slider = LabelledSlider("Size", 0, 10, 5, 1, str)
    slider.setParent(window)
    taken: list[int] = []
    window.keyPressEvent = lambda event: taken.append(event.key())  # type: ignore[method-assign]
    QTest.keyClick(slider, Qt.Key.Key_B)
    assert taken == [Qt.Key.Key_B]


def test_the_wheel_steps_once_per_notch(size: LabelledSlider) -> None:
    for angle in (120, 60, 60, -120, -240):
        turn_wheel(size, angle)
    assert size.amount == 63


def test_a_double_click_goes_back(size: LabelledSlider) -> None:
    sent: list[float] = []
    QTest.keyClick(size, Qt.Key.Key_End)
    size.changed.connect(sent.append)
    QTest.mouseDClick(size, Qt.MouseButton.LeftButton, pos=QPoint(180, 30))
    assert (size.amount, sent[-1]) == (64, 64)


def test_dragging_sends_each_value_and_settles_once(size: LabelledSlider) -> None:
    sent: list[float] = []
    settled: list[float] = []
    size.changed.connect(sent.append)
    size.settled.connect(settled.append)
    QTest.mousePress(size, Qt.MouseButton.LeftButton, pos=QPoint(8, 30))
    assert sent == [8]
    size.set_value(100)
    assert size.amount == 8
    QTest.mouseMove(size, QPoint(100, 30))
    QTest.mouseMove(size, QPoint(184, 30))
    QTest.mouseRelease(size, Qt.MouseButton.LeftButton, pos=QPoint(184, 30))
    assert (sent[-1], settled) == (120, [120])


def test_the_label_is_no_part_of_the_rail(size: LabelledSlider) -> None:
    QTest.mouseClick(size, Qt.MouseButton.LeftButton, pos=QPoint(8, 4))
    assert size.amount == 64


def test_setting_from_outside_tells_nobody_and_stays_within_the_ends(
    size: LabelledSlider,
) -> None:
    sent: list[float] = []
    size.changed.connect(sent.append)
    for value, expected in ((500, 120), (-3, 8), (33.4, 33), (float("nan"), 33)):
        size.set_value(value)
        assert size.amount == expected
    assert sent == []


def test_steps_of_a_tenth_come_out_exact(qtbot: QtBot) -> None:
    slider = LabelledSlider("Exposure", -4, 4, 0, 0.1, lambda v: f"{v:.1f} EV", inline=True)
    qtbot.addWidget(slider)
    for _step in range(7):
        QTest.keyClick(slider, Qt.Key.Key_Right)
    assert slider.amount == pytest.approx(0.7, abs=1e-12)
    assert slider.accessibleName() == "Exposure"


@pytest.mark.parametrize(("low", "high", "step"), [(1, 1, 1), (2, 1, 1), (0, 1, 0), (0, 1, 2)])
def test_a_slider_without_values_is_refused(low: float, high: float, step: float) -> None:
    with pytest.raises(ValueError, match="no values"):
        LabelledSlider("Size", low, high, low, step, str)


@pytest.mark.parametrize("dpr", [1, 2])
def test_rail_and_knob_are_exact(dpr: int, size: LabelledSlider, picture_of: PictureOf) -> None:
    image = picture_of(size, dpr)
    c = theme().c
    column = [image.pixelColor(4 * dpr, y * dpr).name() for y in range(20, 44)]
    assert [y + 20 for y, colour in enumerate(column) if colour == c.text.name()] == [
        *range(28, 32)
    ]
    right = [image.pixelColor(180 * dpr, y * dpr).name() for y in range(20, 44)]
    assert [y + 20 for y, colour in enumerate(right) if colour == c.track.name()] == [
        *range(28, 32)
    ]
    knob = [x for x in range(192) if image.pixelColor(x * dpr, 24 * dpr).name() == c.text.name()]
    assert 80 <= knob[0] <= knob[-1] <= 112
    assert size.focus_shape()[0].size().width() == 16


def test_an_error_stands_under_the_field_in_words(qtbot: QtBot, picture_of: PictureOf) -> None:
    field = TextField("Name", "North studio")
    qtbot.addWidget(field)
    field.resize(240, 90)
    field.show()
    low = field.sizeHint().height()
    field.set_error("A name cannot be empty.")
    assert field.edit.accessibleDescription() == "A name cannot be empty."
    assert field.sizeHint().height() > low
    edge = picture_of(field.edit, 1).pixelColor(120, 0).name()
    assert edge == theme().c.err.name()
    field.set_error("")
    assert field.sizeHint().height() == low
    assert field.edit.accessibleName() == "Name"


def test_typing_is_told_and_setting_is_not(qtbot: QtBot) -> None:
    field = TextField("Name")
    qtbot.addWidget(field)
    changed: list[str] = []
    entered: list[str] = []
    field.changed.connect(changed.append)
    field.entered.connect(entered.append)
    field.set_text("A")
    QTest.keyClicks(field.edit, "bc")
    QTest.keyClick(field.edit, Qt.Key.Key_Return)
    assert (changed, entered, field.text()) == (["Ab", "Abc"], ["Abc"], "Abc")


@pytest.fixture
def start(qtbot: QtBot) -> ListField:
    field = ListField("Start from", STYLES)
    qtbot.addWidget(field)
    field.resize(240, field.sizeHint().height())
    field.show()
    qtbot.waitExposed(field)
    return field


def test_two_lines_make_a_list_field_higher(start: ListField, qtbot: QtBot) -> None:
    one = ListField("Sort by", [("match", "Best match")])
    qtbot.addWidget(one)
    assert (one.box.sizeHint().height(), start.box.sizeHint().height()) == (40, 56)
    assert start.box.accessibleName() == "Start from: Rembrandt, sitter’s left (camera right)"


def test_arrows_step_through_a_closed_list(start: ListField) -> None:
    sent: list[str] = []
    start.chosen.connect(sent.append)
    for key in (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Down, Qt.Key.Key_Down):
        QTest.keyClick(start.box, key)
    assert sent == ["split", "flat"]


def test_the_wheel_does_not_change_a_closed_list(start: ListField) -> None:
    turn_wheel(start.box, -120)
    assert start.key == "rembrandt"


def opened(field: ListField) -> tuple[ListPopup, QListWidget]:
    popup = field.findChild(ListPopup)
    assert isinstance(popup, ListPopup)
    inner = popup.findChild(QListWidget)
    assert isinstance(inner, QListWidget)
    return popup, inner


@pytest.mark.parametrize("key", [Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_F4])
def test_keys_open_choose_and_close(key: Qt.Key, start: ListField, qtbot: QtBot) -> None:
    sent: list[str] = []
    start.chosen.connect(sent.append)
    QTest.keyClick(start.box, key)
    popup, inner = opened(start)
    assert popup.isVisible()
    assert inner.accessibleName() == "Start from"
    QTest.keyClick(inner, Qt.Key.Key_Down)
    QTest.keyClick(inner, Qt.Key.Key_Return)
    assert not popup.isVisible()
    assert sent == ["split"]


def test_escape_closes_without_choosing(start: ListField) -> None:
    QTest.keyClick(start.box, Qt.Key.Key_Down, Qt.KeyboardModifier.AltModifier)
    popup, inner = opened(start)
    QTest.keyClick(inner, Qt.Key.Key_Down)
    QTest.keyClick(inner, Qt.Key.Key_Escape)
    assert not popup.isVisible()
    assert start.key == "rembrandt"


def test_a_click_chooses(start: ListField) -> None:
    QTest.mouseClick(start.box, Qt.MouseButton.LeftButton)
    popup, inner = opened(start)
    place = inner.visualItemRect(inner.item(2)).center()
    QTest.mouseClick(inner.viewport(), Qt.MouseButton.LeftButton, pos=place)
    assert (start.key, popup.isVisible()) == ("flat", False)


@pytest.mark.parametrize("name", ["dark", "light", "contrast"])
def test_the_open_list_is_painted_in_the_theme(
    name: str, qtbot: QtBot, picture_of: PictureOf
) -> None:
    c = set_theme(name).c  # type: ignore[arg-type]
    field = ListField("Start from", STYLES)
    qtbot.addWidget(field)
    field.show()
    field.open_list()
    popup, _inner = opened(field)
    image = picture_of(popup, 1)
    chosen = c.text if name == "contrast" else c.raised
    assert image.pixelColor(60, 12).name() == chosen.name()
    assert image.pixelColor(60, 120).name() == c.panel.name()
    popup.close()


def test_new_items_keep_the_choice_where_they_can(start: ListField) -> None:
    start.choose("flat")
    start.set_items(list(reversed(STYLES)))
    assert start.key == "flat"
    start.set_items(STYLES[:2])
    assert start.key == "rembrandt"
    start.set_items([])
    assert start.key == ""
    start.open_list()
    assert not opened(start)[0].isVisible()
    with pytest.raises(KeyError):
        start.choose("flat")
