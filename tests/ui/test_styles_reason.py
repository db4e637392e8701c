"""The reason below the portraits, and its areas on the face, by mouse and keyboard."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QEnterEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot

from app.core.base.arrays import Float64
from app.ui.screens.styles.detail_view import StyleDetail
from app.ui.screens.styles.reason.reason import AreaMark, ReasonState
from app.ui.screens.styles.reason.reason_view import MarkedPicture, ReasonBlock
from app.ui.screens.styles.screen_view import StylesScreen
from app.ui.theme import theme
from tests.helpers.styles_screen import Table, scene_light


def settle() -> None:
    for _ in range(4):
        QApplication.processEvents()


@pytest.fixture
def table(tmp_path: Path) -> Table:
    return Table(tmp_path).open(scene_light("studio"))


@pytest.fixture
def detail(qtbot: QtBot, table: Table) -> StyleDetail:
    view = StylesScreen(table.presenter, compact=False)
    qtbot.addWidget(view)
    view.resize(1352, 804)
    table.presenter.attach(view)
    view.show()
    view.activateWindow()
    settle()
    return view.detail


def pixels(widget: QWidget) -> np.ndarray:
    image = widget.grab().toImage().convertToFormat(widget.grab().toImage().Format.Format_RGB888)
    rows = np.frombuffer(bytes(image.constBits()), np.uint8).reshape(image.height(), -1)
    whole: np.ndarray = rows[:, : 3 * image.width()].reshape(image.height(), -1, 3)
    return whole


def is_marked(picture: MarkedPicture) -> bool:
    """Whether the colour of an area where light helps is in a portrait, which has none like it."""
    return bool((away_from_ink(picture) < 8).sum() > 10)


def away_from_ink(picture: MarkedPicture) -> np.ndarray:
    """Distance of each pixel from the colour of an area where light helps."""
    plus = theme().c.plus
    ink = np.array([plus.red(), plus.green(), plus.blue()])
    away: np.ndarray = np.abs(pixels(picture).astype(int) - ink).max(axis=2)
    return away


def test_a_style_out_of_reach_shows_its_reason(table: Table, detail: StyleDetail) -> None:
    table.presenter.choose("left-loop")
    settle()
    state = table.presenter.resolve().detail
    assert detail.why.isVisible()
    assert detail.why.eye.isVisible()
    assert detail.why._text.text() == state.why.words != ""


def test_a_style_in_reach_needs_none(table: Table, detail: StyleDetail) -> None:
    table.presenter.choose("flat")
    settle()
    assert table.presenter.resolve().detail.in_reach
    assert not detail.why.isVisible()


def test_space_shows_the_areas_on_both_portraits(table: Table, detail: StyleDetail) -> None:
    table.presenter.choose("left-split")
    settle()
    assert not is_marked(detail.here)
    detail.why.eye.setFocus(Qt.FocusReason.TabFocusReason)
    QTest.keyClick(detail.why.eye, Qt.Key.Key_Space)
    settle()
    assert is_marked(detail.here)
    assert is_marked(detail.target)
    QTest.keyClick(detail.why.eye, Qt.Key.Key_Space)
    settle()
    assert not is_marked(detail.here)


def test_the_areas_appear_while_the_mouse_is_over_the_reason(
    table: Table, detail: StyleDetail
) -> None:
    table.presenter.choose("left-split")
    settle()
    where = QPointF(2, 2)
    block = detail.why
    block.setAttribute(Qt.WidgetAttribute.WA_UnderMouse, True)
    QApplication.sendEvent(block, QEnterEvent(where, where, where))
    assert is_marked(detail.here)
    block.setAttribute(Qt.WidgetAttribute.WA_UnderMouse, False)
    QApplication.sendEvent(block, QEvent(QEvent.Type.Leave))
    assert not is_marked(detail.here)


def test_the_areas_stay_on_for_the_next_style(table: Table, detail: StyleDetail) -> None:
    table.presenter.choose("left-split")
    settle()
    detail.why.eye.click()
    table.presenter.choose("flat")
    settle()
    assert not is_marked(detail.here)
    table.presenter.choose("right-kicker")
    settle()
    assert is_marked(detail.here)


def test_nothing_scrolls_for_a_reason(table: Table, detail: StyleDetail) -> None:
    """There is room for it, as long as the numbers are hidden."""
    for style in ("right-kicker", "left-loop", "right-kicker"):
        table.presenter.choose(style)
        settle()
        bottom = detail._warning.mapTo(detail, detail._warning.rect().bottomLeft()).y()
        assert bottom <= detail.main.y()


def square(left: float, top: float, side: float = 0.1) -> Float64:
    return np.array(
        [[left, top], [left + side, top], [left + side, top + side], [left, top + side]]
    )


@pytest.mark.parametrize("shape", [(100, 100), (100, 200), (200, 100)])
def test_outlines_follow_the_crop_of_the_picture(qtbot: QtBot, shape: tuple[int, int]) -> None:
    """A picture of other proportions fills the widget, and loses its sides."""
    picture = MarkedPicture("test")
    qtbot.addWidget(picture)
    picture.resize(100, 100)
    grey = np.full((*shape, 3), 60, np.uint8)
    rows, columns = shape
    # The marked square is also painted into the picture, in white.
    top, left, high, wide = (round(0.4 * rows), round(0.4 * columns), rows // 5, columns // 5)
    grey[top : top + high, left : left + wide] = 255
    corners = np.array([[0.4, 0.4], [0.6, 0.4], [0.6, 0.6], [0.4, 0.6]])
    picture.set_picture(grey)
    white = np.argwhere(pixels(picture).min(axis=2) > 200)
    picture.set_marks((AreaMark((corners,), "0", True),))
    marked = np.argwhere(away_from_ink(picture) < 40)
    assert np.abs(white.min(axis=0) - marked.min(axis=0)).max() <= 2
    assert np.abs(white.max(axis=0) - marked.max(axis=0)).max() <= 2


def test_labels_of_neighbours_do_not_cover_each_other(qtbot: QtBot) -> None:
    picture = MarkedPicture("test")
    qtbot.addWidget(picture)
    picture.resize(200, 200)
    areas = [square(0.2, 0.5), square(0.25, 0.52)]
    picture.set_marks(
        tuple(AreaMark((area,), label, True) for area, label in zip(areas, "12", strict=True))
    )
    picture.set_picture(np.zeros((200, 200, 3), np.uint8))
    boxes = [picture._polygon(area).boundingRect() for area in areas]
    one, other = picture._label_places(boxes)
    assert not one.intersects(other)
    assert picture.rect().contains(one.toRect())


def test_a_block_without_words_is_hidden(qtbot: QtBot) -> None:
    block = ReasonBlock()
    qtbot.addWidget(block)
    assert block.show_state(ReasonState("Words."))
    assert not block.isHidden()
    assert not block.eye.isVisibleTo(block)
    block.show_state(ReasonState())
    assert block.isHidden()
