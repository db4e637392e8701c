"""Buttons, chips, toggles and segmented choices: names, keyboard, states, exact pixels."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QHBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from app.ui.theme import ThemeName, set_theme, theme
from app.ui.widgets.buttons import Button, Chip, IconButton, Kind, Size, button_look
from app.ui.widgets.choices import SegmentedChoice
from app.ui.widgets.fields import Toggle

PictureOf: TypeAlias = Callable[[QWidget, float], QImage]
Show: TypeAlias = Callable[[QWidget], QWidget]

PLANS = [("paper", "Quick", "3 frames, 9 s"), ("full", "Full range", "7 frames, 21 s")]
SIDES = [("all", "All 18"), ("in", "In reach 16"), ("out", "Out of reach 2")]


@pytest.fixture
def shown(qtbot: QtBot) -> Show:
    def show(widget: QWidget) -> QWidget:
        qtbot.addWidget(widget)
        widget.show()
        qtbot.waitExposed(widget)
        return widget

    return show


def colour(image: QImage, x: float, y: float, dpr: float = 1) -> str:
    return image.pixelColor(int(x * dpr), int(y * dpr)).name()


@pytest.mark.parametrize(("size", "height"), [("normal", 40), ("main", 48), ("small", 32)])
@pytest.mark.parametrize("scale", [1.0, 1.5, 2.0])
def test_heights_are_those_of_the_design(
    size: Size, height: int, scale: float, qtbot: QtBot
) -> None:
    set_theme("dark", scale)
    button, square = Button("Paint", "brush", size=size), IconButton("plus", "More", size=size)
    qtbot.addWidget(button)
    qtbot.addWidget(square)
    assert button.sizeHint().height() == round(height * scale)
    assert square.sizeHint().width() == square.sizeHint().height() == round(height * scale)


@pytest.mark.parametrize("dpr", [1, 2])
@pytest.mark.parametrize("name", ["dark", "light", "contrast"])
def test_edges_are_exact(dpr: int, name: ThemeName, shown: Show, picture_of: PictureOf) -> None:
    c, width = set_theme(name).c, theme().line_width
    button = Button("Change")
    image = picture_of(shown(button), dpr)
    middle = button.height() / 2
    assert colour(image, 0, middle, dpr) == c.ctl.name()
    assert colour(image, width - 1 / dpr, middle, dpr) == c.ctl.name()
    assert colour(image, width, middle, dpr) != c.ctl.name()
    assert colour(image, 20, 0, dpr) == c.ctl.name()


def test_the_main_button_is_amber(shown: Show, picture_of: PictureOf) -> None:
    image = picture_of(shown(Button("Turn to this", kind="primary", size="main")), 1)
    assert colour(image, 6, 24) == "#f2bc4b"


@pytest.mark.parametrize("kind", ["outlined", "primary", "quiet"])
def test_states_differ_by_more_than_colour(kind: Kind, shown: Show) -> None:
    """Pressed is a wider edge, in every theme."""
    for name in ("dark", "light", "contrast"):
        set_theme(name)
        button = Button("Paint", kind=kind)
        shown(button)
        plain = button_look(button, kind)
        button.setDown(True)
        pressed = button_look(button, kind)
        assert pressed.edge is not None
        assert pressed.width > (plain.width if plain.edge is not None else 0)
        button.setDown(False)
        button.setEnabled(False)
        assert button_look(button, kind).ink == theme().c.dis


def test_what_stays_pressed_is_white_on_black_in_contrast(shown: Show) -> None:
    c = set_theme("contrast").c
    button = Button("Lamps", checkable=True)
    shown(button)
    button.setChecked(True)
    look = button_look(button)
    assert look.fill is not None
    assert (look.fill.name(), look.ink.name()) == (c.text.name(), "#ffffff")


@pytest.mark.parametrize("key", [Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Enter])
def test_keys_press_it(key: Qt.Key, shown: Show, qtbot: QtBot) -> None:
    button = Button("Capture")
    shown(button)
    with qtbot.waitSignal(button.clicked):
        QTest.keyClick(button, key)


def test_arrows_are_left_to_the_group(qtbot: QtBot) -> None:
    """Qt's own buttons hand the focus to a neighbour."""
    window = QWidget()
    qtbot.addWidget(window)
    row = QHBoxLayout(window)
    first, second = Button("First"), Button("Second")
    row.addWidget(first)
    row.addWidget(second)
    window.show()
    first.setFocus()
    QTest.keyClick(first, Qt.Key.Key_Right)
    assert window.focusWidget() is first


def test_a_busy_button_keeps_its_size_and_cannot_be_pressed(shown: Show, qtbot: QtBot) -> None:
    button = Button("Save as my style", "save")
    shown(button)
    before, presses = button.size(), []
    button.clicked.connect(lambda: presses.append(1))
    button.set_busy("Saving the whole long thing…")
    button.adjustSize()
    assert button.size() == before
    assert button.accessibleDescription() == "Saving the whole long thing…"
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)
    QTest.keyClick(button, Qt.Key.Key_Space)
    QTest.keyClick(button, Qt.Key.Key_Return)
    assert presses == []
    button.set_busy(None)
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)
    assert presses == [1]


def test_the_ring_of_a_busy_button_turns(shown: Show, qtbot: QtBot, picture_of: PictureOf) -> None:
    button = Button("Save")
    shown(button)
    button.set_busy("Saving…")
    first = picture_of(button, 1)
    qtbot.waitUntil(lambda: picture_of(button, 1) != first)


def test_a_disabled_button_says_why(qtbot: QtBot) -> None:
    button = IconButton("redo", "Redo", shortcut="Ctrl+Shift+Z")
    qtbot.addWidget(button)
    assert (button.accessibleName(), button.toolTip()) == ("Redo", "Redo (Ctrl+Shift+Z)")
    button.set_available(False, "Nothing was undone.")
    assert not button.isEnabled()
    assert button.toolTip() == button.accessibleDescription() == "Nothing was undone."
    button.set_available(True)
    assert (button.toolTip(), button.accessibleDescription()) == ("Redo (Ctrl+Shift+Z)", "")


def test_long_reasons_are_broken_into_lines(qtbot: QtBot) -> None:
    button = Button("Turn")
    qtbot.addWidget(button)
    button.set_available(False, "There is no light yet. " * 6)
    assert max(map(len, button.toolTip().splitlines())) <= 52


def test_words_and_icon_change_together(qtbot: QtBot) -> None:
    button = Button("Capture", "camera")
    qtbot.addWidget(button)
    narrow = button.sizeHint().width()
    button.set_text("Capture again")
    assert button.accessibleName() == "Capture again"
    assert button.sizeHint().width() > narrow


def test_a_chip_gains_a_warning_in_words(qtbot: QtBot) -> None:
    chip = Chip("theta", "THETA V, 82 %")
    qtbot.addWidget(chip)
    assert chip.sizeHint().height() == 32
    narrow = chip.sizeHint().width()
    chip.set("theta", "THETA V", "12 % battery")
    assert chip.accessibleName() == "THETA V. 12 % battery"
    assert chip.sizeHint().width() > narrow


def test_a_toggle_switches_by_mouse_and_keys(shown: Show) -> None:
    toggle = Toggle("Mirror", "mirror")
    shown(toggle)
    states: list[bool] = []
    toggle.switched.connect(states.append)
    QTest.mouseClick(toggle, Qt.MouseButton.LeftButton)
    QTest.keyClick(toggle, Qt.Key.Key_Space)
    QTest.keyClick(toggle, Qt.Key.Key_Return)
    toggle.setChecked(False)
    assert states == [True, False, True]
    assert toggle.accessibleName() == "Mirror"


@pytest.mark.parametrize("dpr", [1, 2])
def test_the_knob_of_a_toggle_changes_sides(dpr: int, shown: Show, picture_of: PictureOf) -> None:
    toggle = Toggle("Mirror")
    shown(toggle)
    c = theme().c
    left = toggle.width() - 36
    off = picture_of(toggle, dpr)
    toggle.setChecked(True)
    on = picture_of(toggle, dpr)
    middle = toggle.height() / 2
    assert colour(off, left + 10, middle, dpr) == c.ctl.name()
    assert colour(on, left + 10, middle, dpr) == c.text.name()
    assert colour(on, left + 26, middle, dpr) == c.panel.name()


@pytest.mark.parametrize(("items", "height"), [(SIDES, 40), (PLANS, 56)])
def test_a_segmented_choice_has_the_height_of_its_lines(
    items: list[tuple[str, str]], height: int, qtbot: QtBot
) -> None:
    choice = SegmentedChoice(items, "Plan", equal=True)
    qtbot.addWidget(choice)
    assert choice.height() == height
    assert (choice.key, choice.accessibleName()) == (items[0][0], "Plan")


def test_arrows_move_inside_and_tab_leaves(qtbot: QtBot) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    row = QHBoxLayout(window)
    before, choice, after = (
        Button("Before"),
        SegmentedChoice(SIDES, "Which styles"),
        Button("After"),
    )
    for widget in (before, choice, after):
        row.addWidget(widget)
    window.show()
    qtbot.waitExposed(window)
    window.activateWindow()
    sent: list[str] = []
    choice.chosen.connect(sent.append)
    before.setFocus()

    def press(key: Qt.Key) -> QWidget | None:
        target = window.focusWidget()
        assert target is not None
        QTest.keyClick(target, key)
        return window.focusWidget()

    assert press(Qt.Key.Key_Tab) is choice.part("all")
    assert press(Qt.Key.Key_Left) is choice.part("all")
    assert press(Qt.Key.Key_Right) is choice.part("in")
    assert press(Qt.Key.Key_End) is choice.part("out")
    assert press(Qt.Key.Key_Tab) is after
    assert press(Qt.Key.Key_Backtab) is choice.part("out")
    assert press(Qt.Key.Key_Home) is choice.part("all")
    assert sent == ["in", "out", "all"]


def test_choosing_from_outside_tells_nobody(shown: Show) -> None:
    choice = SegmentedChoice(SIDES)
    shown(choice)
    sent: list[str] = []
    choice.chosen.connect(sent.append)
    choice.choose("out")
    assert (choice.key, sent) == ("out", [])
    QTest.mouseClick(choice.part("in"), Qt.MouseButton.LeftButton)
    assert (choice.key, sent) == ("in", ["in"])
    with pytest.raises(KeyError):
        choice.choose("nowhere")


def test_no_part_changes_its_width_when_it_is_chosen(shown: Show) -> None:
    choice = SegmentedChoice(SIDES)
    shown(choice)
    widths = [choice.part(key).width() for key, _text in SIDES]
    choice.choose("out")
    assert [choice.part(key).width() for key, _text in SIDES] == widths


def test_words_of_a_part_may_change(shown: Show) -> None:
    choice = SegmentedChoice(PLANS)
    shown(choice)
    choice.set_text("paper", "Quick", "5 frames, 15 s")
    assert choice.part("paper").accessibleName() == "Quick, 5 frames, 15 s"


@pytest.mark.parametrize("dpr", [1, 2])
def test_the_chosen_part_is_inset_by_three(dpr: int, shown: Show, picture_of: PictureOf) -> None:
    choice = SegmentedChoice(SIDES)
    image = picture_of(shown(choice), dpr)
    c = theme().c
    column = [colour(image, 20, y, dpr) for y in range(6)]
    assert (column[0], column[4], column[5]) == (c.ctl.name(), c.ctl.name(), c.raised.name())
    assert c.ctl.name() not in column[1:4]


def test_the_chosen_part_is_white_on_black_in_contrast(shown: Show, picture_of: PictureOf) -> None:
    set_theme("contrast")
    choice = SegmentedChoice(SIDES)
    image = picture_of(shown(choice), 2)
    assert colour(image, 9, 20, 2) == "#000000"
    whites = sum(colour(image, x, y, 2) == "#ffffff" for x in range(10, 60) for y in range(12, 28))
    assert whites > 20
