"""What lies over the window, and what is arranged in it: sheets, toasts, scrolling, groups."""

from __future__ import annotations

import gc
import weakref
from itertools import pairwise

import pytest
from PySide6.QtCore import QCoreApplication, QEvent, QPoint, QRect, Qt
from PySide6.QtGui import QPaintEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QGridLayout, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from app.ui.theme import theme
from app.ui.theme.style import install
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.dialogs import Sheet
from app.ui.widgets.fields import TextField
from app.ui.widgets.messages import Toasts
from app.ui.widgets.surfaces import Card, Menu, Scroll, Surface
from tests.helpers.focus import rect_of


@pytest.fixture
def window(qtbot: QtBot) -> QWidget:
    window = Surface("bg")
    qtbot.addWidget(window)
    window.resize(1024, 700)
    window.show()
    qtbot.waitExposed(window)
    window.activateWindow()
    return window


def focused() -> QWidget:
    widget = QApplication.focusWidget()
    assert widget is not None
    return widget


def toast_places(window: QWidget) -> list[QRect]:
    found = [w for w in window.children() if type(w).__name__ == "_Toast"]
    return [w.geometry() for w in found if isinstance(w, QWidget) and w.isVisible()]


def button_named(window: QWidget, name: str) -> QWidget:
    for kind in (Button, IconButton):
        for button in window.findChildren(kind):
            if button.accessibleName() == name and button.isVisible():
                assert isinstance(button, QWidget)
                return button
    raise AssertionError(name)


def test_a_closed_sheet_lets_go_of_the_keyboard_though_its_opener_is_gone(window: QWidget) -> None:
    opener = Button("Photos")
    opener.setParent(window)
    opener.show()
    opener.setFocus()
    sheet = Sheet(window, "Photos")
    sheet.open()
    opener.hide()
    sheet.shut()
    assert QApplication.focusWidget() is None
    assert Sheet.over(window) == []


def test_a_toast_stands_at_the_lower_right_above_the_job_line(window: QWidget) -> None:
    toasts = Toasts(window, bottom=40)
    toasts.tell("Draft kept")
    (place,) = toast_places(window)
    assert place.width() == 360
    assert (place.right() + 1, place.bottom() + 1) == (1024 - 16, 700 - 40 - 16)
    window.resize(1200, 800)
    (place,) = toast_places(window)
    assert (place.right() + 1, place.bottom() + 1) == (1200 - 16, 800 - 40 - 16)


def test_the_newest_is_lowest_and_none_overlap(window: QWidget) -> None:
    toasts = Toasts(window)
    for number in range(5):
        toasts.tell(f"Message {number}, long enough to need a second line of its own here")
    places = toast_places(window)
    assert toasts.count == len(places) == 3
    assert [p.bottom() for p in places] == sorted(p.bottom() for p in places)
    assert not any(a.intersects(b) for a in places for b in places if a is not b)


def test_a_toast_is_never_over_a_button(window: QWidget) -> None:
    main = Button("Turn to this", kind="primary", size="main")
    main.setParent(window)
    main.setGeometry(700, 590, 200, 48)
    main.show()
    toasts = Toasts(window)
    toasts.tell("Draft kept")
    (place,) = toast_places(window)
    assert not place.intersects(main.geometry())
    assert place.bottom() + 1 == 590 - 8


def test_it_goes_after_its_time(window: QWidget, qtbot: QtBot) -> None:
    toasts = Toasts(window, stay_ms=30)
    toasts.tell("Draft kept")
    qtbot.waitUntil(lambda: toasts.count == 0)


def test_the_same_said_again_is_not_stacked(window: QWidget) -> None:
    toasts = Toasts(window)
    for text in ("Disk full", "Draft kept", "Disk full"):
        toasts.tell(text)
    assert toasts.count == 2


def test_it_stays_while_it_has_the_keyboard(window: QWidget, qtbot: QtBot) -> None:
    toasts = Toasts(window, stay_ms=40)
    window.setFocus()
    toasts.tell("My Rembrandt deleted.", actions=[("Undo", lambda: None)])
    button_named(window, "Undo").setFocus()
    qtbot.wait(150)
    assert toasts.count == 1
    window.setFocus()
    focused().clearFocus()
    qtbot.waitUntil(lambda: toasts.count == 0)


def test_actions_act_once_and_close(window: QWidget) -> None:
    done: list[str] = []
    toasts = Toasts(window)
    toasts.tell(
        "My Rembrandt deleted.",
        actions=[("Undo", lambda: done.append("undo")), ("Show", lambda: done.append("show"))],
    )
    QTest.mouseClick(button_named(window, "Undo"), Qt.MouseButton.LeftButton)
    assert (done, toasts.count) == (["undo"], 0)


def test_what_stays_is_closed_by_hand_and_gives_way_last(window: QWidget, qtbot: QtBot) -> None:
    closed: list[str] = []
    toasts = Toasts(window, stay_ms=30)
    toasts.tell("Not saved", kind="error", stay=True, closed=lambda: closed.append("Not saved"))
    for number in range(4):
        toasts.tell(f"Message {number}")
    assert toasts.count == 3
    qtbot.waitUntil(lambda: toasts.count == 1)
    qtbot.wait(100)
    assert (toasts.count, closed) == (1, [])
    QTest.mouseClick(button_named(window, "Close this message"), Qt.MouseButton.LeftButton)
    assert (toasts.count, closed) == (0, ["Not saved"])


@pytest.fixture
def sheet(window: QWidget) -> Sheet:
    sheet = Sheet(window, "Rename the style")
    sheet.body.addWidget(TextField("Name"))
    sheet.add_button(Button("Cancel"))
    sheet.add_button(Button("Rename", kind="primary"))
    return sheet


def test_a_sheet_covers_the_window_and_follows_it(window: QWidget, sheet: Sheet) -> None:
    assert not sheet.isVisible()
    sheet.open()
    assert sheet.geometry() == window.rect()
    window.resize(900, 650)
    assert sheet.geometry() == window.rect()
    assert sheet.accessibleName() == "Rename the style"


def test_a_sheet_left_open_goes_with_its_window() -> None:
    host = QWidget()
    sheet = Sheet(host, "Lens")
    sheet.open()
    assert Sheet.over(host) == [sheet]
    alive = weakref.ref(sheet)
    host.deleteLater()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    del sheet, host
    gc.collect()
    assert alive() is None


def test_tab_stays_inside_and_escape_gives_the_keyboard_back(
    window: QWidget, sheet: Sheet, qtbot: QtBot
) -> None:
    outside = Button("Outside")
    outside.setParent(window)
    outside.show()
    outside.setFocus()
    sheet.open()
    seen: list[str] = []
    for _press in range(6):
        here = focused()
        seen.append(here.accessibleName())
        QTest.keyClick(here, Qt.Key.Key_Tab)
    assert seen == ["Name", "Cancel", "Rename", "Close", "Name", "Cancel"]
    QTest.keyClick(focused(), Qt.Key.Key_Backtab)
    assert focused().accessibleName() == "Cancel"
    with qtbot.waitSignal(sheet.closed):
        QTest.keyClick(focused(), Qt.Key.Key_Escape)
    assert focused() is outside
    assert not sheet.isVisible()


def test_a_click_beside_it_closes_and_one_on_it_does_not(sheet: Sheet) -> None:
    sheet.open()
    QTest.mouseClick(sheet, Qt.MouseButton.LeftButton, pos=sheet.rect().center())
    assert sheet.isVisible()
    QTest.mouseClick(sheet, Qt.MouseButton.LeftButton, pos=QPoint(5, 5))
    assert not sheet.isVisible()


def test_the_focus_ring_is_inside_the_sheet(sheet: Sheet, qapp: QApplication, qtbot: QtBot) -> None:
    ring = install(qapp)
    sheet.open()
    QTest.keyClick(focused(), Qt.Key.Key_Tab)
    qtbot.waitUntil(lambda: rect_of(ring) is not None)
    assert any(type(child).__name__ == "_Ring" for child in sheet.children())


@pytest.mark.parametrize("side", ["centre", "right", "top"])
def test_a_small_window_still_shows_all_of_a_sheet(side: str, window: QWidget) -> None:
    window.resize(400, 300)
    sheet = Sheet(window, "Settings", width=560, side=side)  # type: ignore[arg-type]
    for number in range(3):
        sheet.body.addWidget(TextField(f"Field {number}"))
    sheet.open()
    panel = next(c for c in sheet.children() if type(c).__name__ == "OutlineBox")
    assert isinstance(panel, QWidget)
    assert sheet.rect().contains(panel.geometry())


def test_the_scroll_bar_is_slim_and_only_upright(window: QWidget) -> None:
    content = QWidget()
    content.setFixedHeight(2000)
    scroll = Scroll(content)
    scroll.setParent(window)
    scroll.setGeometry(0, 0, 300, 200)
    scroll.show()
    assert scroll.verticalScrollBar().sizeHint().width() == 10
    inside = QWidget(content)
    inside.setGeometry(0, 1500, 100, 40)
    scroll.keep_visible(inside)
    assert 1500 + 40 + 8 - 200 <= scroll.verticalScrollBar().value() <= 1500


def test_new_content_is_never_painted_squeezed(window: QWidget) -> None:
    heights: list[int] = []

    class Row(QWidget):
        def paintEvent(self, _event: QPaintEvent) -> None:
            heights.append(self.mapTo(content, QPoint()).y())

    content = QWidget()
    lines = QVBoxLayout(content)
    scroll = Scroll(content)
    scroll.setParent(window)
    scroll.setGeometry(0, 0, 300, 200)
    scroll.show()
    window.show()
    QApplication.processEvents()
    rows = [Row() for _ in range(20)]
    for row in rows:
        row.setFixedHeight(76)
        lines.addWidget(row)
    scroll.settle(lines, rows)
    QApplication.processEvents()
    assert heights
    assert len(heights) <= 3, "what is seen of 20 rows, once"
    assert min(b - a for a, b in pairwise(sorted(heights))) >= 76


@pytest.fixture
def cards(window: QWidget) -> list[Card]:
    holder = QWidget(window)
    grid = QGridLayout(holder)
    made = [Card(name) for name in "abcdefg"]
    for number, card in enumerate(made):
        grid.addWidget(card, *divmod(number, 3))
    holder.setGeometry(0, 0, 620, 600)
    holder.show()
    roving = Roving(holder)
    roving.set_members(made)
    return made


@pytest.mark.parametrize(
    ("keys", "end"),
    [
        ([Qt.Key.Key_Right], "b"),
        ([Qt.Key.Key_Down], "d"),
        ([Qt.Key.Key_Right, Qt.Key.Key_Down, Qt.Key.Key_Left], "d"),
        ([Qt.Key.Key_Right] * 3, "d"),
        ([Qt.Key.Key_End, Qt.Key.Key_Up], "d"),
        ([Qt.Key.Key_End, Qt.Key.Key_Right], "g"),
        ([Qt.Key.Key_Up], "a"),
        ([Qt.Key.Key_Right, Qt.Key.Key_Right, Qt.Key.Key_Down, Qt.Key.Key_Down], "g"),
        ([Qt.Key.Key_End, Qt.Key.Key_Home], "a"),
    ],
)
def test_arrows_go_where_the_cards_lie(keys: list[Qt.Key], end: str, cards: list[Card]) -> None:
    """Three columns: a b c / d e f / g."""
    cards[0].setFocus()
    for key in keys:
        QTest.keyClick(focused(), key)
    assert focused().accessibleName() == end


def test_a_group_is_one_stop_for_tab(cards: list[Card]) -> None:
    tabbed = Qt.FocusPolicy.TabFocus
    assert [bool(card.focusPolicy() & tabbed) for card in cards] == [True] + [False] * 6
    cards[0].setFocus()
    QTest.keyClick(cards[0], Qt.Key.Key_Right)
    assert [bool(card.focusPolicy() & tabbed) for card in cards][:3] == [False, True, False]


def test_a_card_is_chosen_by_a_click_and_opened_by_two(cards: list[Card], qtbot: QtBot) -> None:
    with qtbot.waitSignal(cards[0].clicked):
        QTest.mouseClick(cards[0], Qt.MouseButton.LeftButton)
    with qtbot.waitSignal(cards[0].opened):
        QTest.mouseDClick(cards[0], Qt.MouseButton.LeftButton)
    with qtbot.waitSignal(cards[0].opened):
        QTest.keyClick(cards[0], Qt.Key.Key_Return)
    cards[0].set_selected(True)
    assert cards[0].selected
    assert cards[0].accessibleDescription() == "selected"


def test_a_menu_acts_and_says_why_it_cannot(window: QWidget) -> None:
    done: list[str] = []
    menu = Menu(window, "More")
    menu.add("Duplicate", lambda: done.append("copy"), "duplicate", "Ctrl D")
    stuck = menu.add("Delete", lambda: done.append("gone"), "trash", why="It came with the app.")
    under = Button("More")
    under.setParent(window)
    under.show()
    menu.drop(under)
    assert menu.isVisible()
    QTest.keyClick(menu, Qt.Key.Key_Down)
    QTest.keyClick(menu, Qt.Key.Key_Return)
    assert done == ["copy"]
    assert (stuck.isEnabled(), stuck.toolTip()) == (False, "It came with the app.")
    assert menu.accessibleName() == "More"


def test_surfaces_have_lines_where_they_touch(qtbot: QtBot) -> None:
    surface = Surface("panel", ("left", "bottom"))
    qtbot.addWidget(surface)
    QVBoxLayout(surface)
    surface.resize(40, 40)
    surface.show()
    image = surface.grab().toImage()
    c = theme().c
    assert image.pixelColor(0, 20) == c.line
    assert image.pixelColor(20, 39) == c.line
    assert image.pixelColor(39, 20) == image.pixelColor(20, 0) == c.panel
