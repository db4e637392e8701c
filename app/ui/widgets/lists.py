"""The list opened by a field or chip, and tables made of rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from PySide6.QtCore import (
    QEvent,
    QModelIndex,
    QObject,
    QPersistentModelIndex,
    QPoint,
    QRect,
    QRectF,
    QSize,
    Qt,
    Signal,
)
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPalette
from PySide6.QtWidgets import (
    QAbstractItemView,
    QFrame,
    QListWidget,
    QListWidgetItem,
    QSizePolicy,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QWidget,
)

from app.ui.theme import Theme, px, theme
from app.ui.theme.icons import draw_icon
from app.ui.theme.style import dress_bars, round_corners
from app.ui.widgets.buttons import Pressable
from app.ui.widgets.layouts import column
from app.ui.widgets.paint import (
    MIDDLE,
    PaintedWidget,
    Paints,
    box,
    hover_fill,
    put_text,
    selected_edge,
)

_ROW: Final = 44
_HEAD: Final = 28
_LETTER: Final = 24


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table.

    The column's title appears in the header, and names the cells for screen readers.
    """

    title: str
    width: int = 0


@dataclass(frozen=True, slots=True)
class Cell:
    """The content of one cell of a table."""

    text: str
    icon: str = ""
    letter: str = ""
    strong: bool = False


def places(columns: Sequence[Column], width: int) -> list[tuple[int, int]]:
    """Return the left edge and the width of each column in logical pixels."""
    fixed = sum(px(one.width) for one in columns)
    free = sum(1 for one in columns if not one.width)
    rest = max(width - fixed, 0) // max(free, 1)
    result, left = [], 0
    for one in columns:
        own = px(one.width) if one.width else rest
        result.append((left, own))
        left += own
    return result


def draw_letter(painter: QPainter, rect: QRect | QRectF, letter: str, on_picture: bool) -> None:
    """Paint a letter in a ring, as it appears in the table and on the panorama."""
    t = theme()
    area = QRectF(rect)
    fill, ink = (t.c.tag, t.c.ontag) if on_picture else (None, t.c.text)
    box(painter, area, area.width() / 2, fill, ink, max(1.5, t.line_width))
    put_text(painter, area, letter, t.font(12, 600), ink, MIDDLE)


class TableHead(PaintedWidget):
    """The titles of the columns, with a line below them."""

    def __init__(self, columns: Sequence[Column]) -> None:
        super().__init__()
        self._columns = tuple(columns)
        self.setFixedHeight(px(_HEAD))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName(", ".join(c.title for c in self._columns if c.title))

    def sizeHint(self) -> QSize:
        """Return the total size of the columns."""
        return QSize(sum(px(c.width or 120) for c in self._columns), px(_HEAD))

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the titles in the current theme."""
        for one, (left, width) in zip(
            self._columns, places(self._columns, self.width()), strict=True
        ):
            area = QRect(left, 0, width - px(8), self.height() - px(4))
            put_text(painter, area, one.title, t.font(12), t.c.dim)
        line = t.line_width
        painter.fillRect(0, self.height() - line, self.width(), line, t.c.line)


class TableRow(Pressable):
    """A selectable row, 44 pixels high."""

    def __init__(self, columns: Sequence[Column], cells: Sequence[Cell] = ()) -> None:
        super().__init__("", tip="")
        self._columns = tuple(columns)
        self._cells: tuple[Cell, ...] = ()
        self.setFixedHeight(px(_ROW))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.set(cells)

    def set(self, cells: Sequence[Cell]) -> None:
        """Change the cells, one per column."""
        if tuple(cells) == self._cells:
            return
        self._cells = tuple(cells)
        pairs = zip(self._columns, self._cells, strict=True)
        words = (" ".join(x for x in (c.title, cell.letter, cell.text) if x) for c, cell in pairs)
        self.setAccessibleName(", ".join(words))
        self.update()

    def sizeHint(self) -> QSize:
        """Return the design size of a row."""
        return QSize(sum(px(c.width or 120) for c in self._columns), px(_ROW))

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the row in the current theme."""
        line = t.line_width
        inner = self.rect().adjusted(0, 0, 0, -line)
        painter.fillRect(0, self.height() - line, self.width(), line, t.c.line)
        if self.isDown() or self.hovered():
            painter.fillRect(inner, hover_fill(t))
        if self.selected:
            box(painter, inner, px(4), t.c.raised, t.c.sel, selected_edge(t))
        if self.isDown():
            box(painter, inner, px(4), None, t.c.ctl, selected_edge(t))
        for cell, (left, width) in zip(
            self._cells, places(self._columns, self.width()), strict=True
        ):
            self._paint_cell(painter, cell, QRect(left, 0, width - px(8), inner.height()))

    def _paint_cell(self, painter: QPainter, cell: Cell, area: QRect) -> None:
        t = theme()
        ink = t.c.text if self.isEnabled() else t.c.dis
        if cell.letter:
            side = px(_LETTER)
            top = area.center().y() - side / 2 + 0.5
            draw_letter(painter, QRectF(area.left(), top, side, side), cell.letter, False)
            area.setLeft(area.left() + side + px(16))
        if cell.icon:
            side = px(16)
            spot = QRect(area.left(), area.top(), side, area.height())
            draw_icon(painter, cell.icon, spot, side, ink)
            area.setLeft(area.left() + side + px(6))
        put_text(painter, area, cell.text, t.font(14, 600 if cell.strong else 400), ink)


THING: Final = Qt.ItemDataRole.UserRole
"""Data role under which a list item stores the object that the item shows."""
Inks: TypeAlias = tuple[QColor, QColor]
"""Colours of an item's text and of the text beside or below it."""
_MOST_ROWS: Final = 8


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry in a list."""

    key: str
    text: str
    second: str = ""
    icon: str = ""


class Lines(QStyledItemDelegate):
    """The base class of delegates.

    This class paints the background of rows, and subclasses paint the content.
    """

    radius = 6

    def __init__(self, parent: QListWidget, height: int) -> None:
        super().__init__(parent)
        self._height = height

    def sizeHint(
        self, _option: QStyleOptionViewItem, _index: QModelIndex | QPersistentModelIndex
    ) -> QSize:
        """Return the design size of a row."""
        return QSize(0, self._height)

    def paint(
        self,
        painter: QPainter,
        option: QStyleOptionViewItem,
        index: QModelIndex | QPersistentModelIndex,
    ) -> None:
        """Paint the background, then the content."""
        t = theme()
        rect: QRect = option.rect
        state: QStyle.StateFlag = option.state
        ink, faint = t.c.text, t.c.dim
        if state & QStyle.StateFlag.State_Selected:
            fill = t.c.text if t.contrast else t.c.raised
            box(painter, rect, px(self.radius), fill, t.c.ctl, t.line_width)
            ink, faint = (t.c.panel, t.c.panel) if t.contrast else (ink, faint)
        elif state & QStyle.StateFlag.State_MouseOver:
            box(painter, rect, px(self.radius), hover_fill(t))
        inner = rect.adjusted(px(12), 0, -px(12), 0)
        self.paint_line(painter, inner, index.data(THING), (ink, faint))

    def paint_line(self, painter: QPainter, inner: QRect, thing: Any, inks: Inks) -> None:
        """Paint the content of a row. This base class paints nothing."""


class _Rows(Lines):
    """Paints entries, and a check mark beside the selected one."""

    radius = 5
    chosen = ""

    def paint_line(self, painter: QPainter, inner: QRect, thing: Any, inks: Inks) -> None:
        t, (ink, faint) = theme(), inks
        entry: Entry = thing
        if entry.icon:
            spot = QRect(inner.left(), inner.top(), px(20), inner.height())
            draw_icon(painter, entry.icon, spot, px(20), ink)
            inner.setLeft(inner.left() + px(32))
        if entry.key == self.chosen:
            spot = QRect(inner.right() - px(16), inner.top(), px(16), inner.height())
            draw_icon(painter, "check", spot, px(16), ink)
        inner.setRight(inner.right() - px(24))
        if entry.second:
            inner = QRect(inner.left(), inner.center().y() - px(18), inner.width(), px(20))
            below = QRect(inner.left(), inner.bottom() + 1, inner.width(), px(16))
            put_text(painter, below, entry.second, t.font(12), faint)
        put_text(painter, inner, entry.text, t.font(14, 600 if entry.second else 400), ink)


class BareList(QListWidget):
    """A list without a frame or background, whose rows are painted by a delegate."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setMouseTracking(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        dress_bars(self)
        self.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        see_through = self.palette()
        see_through.setColor(QPalette.ColorRole.Base, Qt.GlobalColor.transparent)
        self.setPalette(see_through)


class ListPopup(Paints, QFrame):
    """A list that closes as soon as the user makes a choice or presses Esc."""

    chosen = Signal(str)

    def __init__(self, parent: QWidget, name: str) -> None:
        flags = Qt.WindowType.Popup | Qt.WindowType.FramelessWindowHint
        super().__init__(parent, flags | Qt.WindowType.NoDropShadowWindowHint)
        self._radius = round_corners(self)
        self.setProperty("focusHost", True)
        self._list = BareList(name)
        self._list.setProperty("noFocusRing", True)
        self._list.itemClicked.connect(self._take)
        self._list.itemEntered.connect(self._list.setCurrentItem)
        margin = px(4) + theme().line_width
        column(self._list, into=self, gap=None).setContentsMargins(*4 * (margin,))
        self._list.installEventFilter(self)

    def drop(self, under: QWidget, entries: Sequence[Entry], key: str, width: int = 0) -> None:
        """Open the list below a widget, or above the widget if there is no room below.

        The list is at least `width` wide.
        """
        t = theme()
        height = px(56 if any(entry.second for entry in entries) else 40)
        rows = _Rows(self._list, height)
        rows.chosen = key
        self._list.setItemDelegate(rows)
        self._list.clear()
        for entry in entries:
            item = QListWidgetItem(entry.text)
            item.setData(THING, entry)
            words = f"{entry.text}, {entry.second}" if entry.second else entry.text
            item.setData(Qt.ItemDataRole.AccessibleTextRole, words)
            self._list.addItem(item)
            if entry.key == key:
                self._list.setCurrentItem(item)
        if self._list.currentRow() < 0:
            self._list.setCurrentRow(0)
        margin = 2 * (px(4) + t.line_width)
        tall = height * min(len(entries), _MOST_ROWS) + margin
        self.resize(max(under.width(), width), tall)
        self._place(under, tall)
        self.show()
        self._list.setFocus(Qt.FocusReason.PopupFocusReason)
        self._list.scrollToItem(self._list.currentItem())

    def _place(self, under: QWidget, tall: int) -> None:
        gap = px(4)
        below = under.mapToGlobal(QPoint(0, under.height() + gap))
        space = under.screen().availableGeometry()
        left = max(space.left(), min(below.x(), space.right() - self.width()))
        top = below.y()
        if top + tall > space.bottom():
            top = max(space.top(), under.mapToGlobal(QPoint(0, 0)).y() - gap - tall)
        self.move(left, top)

    def _take(self, item: QListWidgetItem) -> None:
        entry: Entry = item.data(THING)
        self.close()
        self.chosen.emit(entry.key)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Close the list on Esc."""
        if event.key() == Qt.Key.Key_Escape:
            self.close()
        else:
            super().keyPressEvent(event)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Select the current entry on Enter, Space or Tab."""
        if isinstance(event, QKeyEvent) and event.type() == QKeyEvent.Type.KeyPress:
            taking = (Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Space, Qt.Key.Key_Tab)
            item = self._list.currentItem()
            if event.key() in taking and item is not None:
                self._take(item)
                return True
        return False

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Close the list on a click outside it."""
        if not self.rect().contains(event.position().toPoint()):
            self.close()
        super().mousePressEvent(event)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the list's frame in the current theme."""
        box(painter, self.rect(), self._radius, t.c.panel, t.c.ctl, t.line_width)
