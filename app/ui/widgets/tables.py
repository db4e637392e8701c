"""Tables as lists of rows: a head, cells at common columns, a line under each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QRect, QRectF, QSize
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.ui.theme import theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.buttons import Pressable
from app.ui.widgets.paint import MIDDLE, box, hover_fill, put_text, selected_edge

if TYPE_CHECKING:
    from collections.abc import Sequence

_ROW: Final = 44
_HEAD: Final = 28
_LETTER: Final = 24


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table.

    Attributes
    ----------
    title : str
        Printed in the head; also names the cell when a row is read out.
    """

    title: str
    width: int = 0


@dataclass(frozen=True, slots=True)
class Cell:
    """What stands in one place of a row."""

    text: str
    icon: str = ""
    letter: str = ""
    strong: bool = False


def places(columns: Sequence[Column], width: int) -> list[tuple[int, int]]:
    """Give left edge and width of each column.

    Parameters
    ----------
    width : int
        Width of the table, logical pixels.

    Returns
    -------
    list of tuple of int
        (left, width) in logical pixels at the theme's scale.
    """
    t = theme()
    fixed = sum(t.px(column.width) for column in columns)
    free = sum(1 for column in columns if not column.width)
    rest = max(width - fixed, 0) // max(free, 1)
    result, left = [], 0
    for column in columns:
        own = t.px(column.width) if column.width else rest
        result.append((left, own))
        left += own
    return result


def draw_letter(painter: QPainter, rect: QRect | QRectF, letter: str, on_picture: bool) -> None:
    """Paint a letter in a ring, as it stands in the table and on the panorama."""
    t = theme()
    area = QRectF(rect)
    fill, ink = (t.c.tag, t.c.ontag) if on_picture else (None, t.c.text)
    box(painter, area, area.width() / 2, fill, ink, max(1.5, t.line_width))
    put_text(painter, area, letter, t.font(12, 600), ink, MIDDLE)


class TableHead(QWidget):
    """The titles of the columns, over a line."""

    def __init__(self, columns: Sequence[Column]) -> None:
        super().__init__()
        self._columns = tuple(columns)
        self.setFixedHeight(theme().px(_HEAD))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName(", ".join(c.title for c in self._columns if c.title))

    def sizeHint(self) -> QSize:
        """Give room for all columns."""
        t = theme()
        return QSize(sum(t.px(c.width or 120) for c in self._columns), t.px(_HEAD))

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        painter = QPainter(self)
        for column, (left, width) in zip(
            self._columns, places(self._columns, self.width()), strict=True
        ):
            area = QRect(left, 0, width - t.px(8), self.height() - t.px(4))
            put_text(painter, area, column.title, t.font(12), t.c.dim)
        line = t.line_width
        painter.fillRect(0, self.height() - line, self.width(), line, t.c.line)


class TableRow(Pressable):
    """A row of 44 that can be chosen."""

    def __init__(self, columns: Sequence[Column], cells: Sequence[Cell] = ()) -> None:
        super().__init__("", tip="")
        self._columns = tuple(columns)
        self._cells: tuple[Cell, ...] = ()
        self._selected = False
        self.setFixedHeight(theme().px(_ROW))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.set(cells)

    def set(self, cells: Sequence[Cell]) -> None:
        """Change what it says.

        Parameters
        ----------
        cells : sequence of Cell
            As many as there are columns.
        """
        if tuple(cells) == self._cells:
            return
        self._cells = tuple(cells)
        pairs = zip(self._columns, self._cells, strict=True)
        words = (" ".join(x for x in (c.title, cell.letter, cell.text) if x) for c, cell in pairs)
        self.setAccessibleName(", ".join(words))
        self.update()

    def set_selected(self, selected: bool) -> None:
        """Show whether it is the chosen one."""
        if selected != self._selected:
            self._selected = selected
            self.setAccessibleDescription("chosen" if selected else "")
            self.update()

    def sizeHint(self) -> QSize:
        """Give the size as designed."""
        t = theme()
        return QSize(sum(t.px(c.width or 120) for c in self._columns), t.px(_ROW))

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        painter = QPainter(self)
        line = t.line_width
        inner = self.rect().adjusted(0, 0, 0, -line)
        painter.fillRect(0, self.height() - line, self.width(), line, t.c.line)
        if self.isDown() or self.hovered():
            painter.fillRect(inner, hover_fill(t))
        if self._selected:
            box(painter, inner, t.px(4), t.c.raised, t.c.sel, selected_edge(t))
        if self.isDown():
            box(painter, inner, t.px(4), None, t.c.ctl, selected_edge(t))
        for cell, (left, width) in zip(
            self._cells, places(self._columns, self.width()), strict=True
        ):
            self._paint_cell(painter, cell, QRect(left, 0, width - t.px(8), inner.height()))

    def _paint_cell(self, painter: QPainter, cell: Cell, area: QRect) -> None:
        t = theme()
        ink = t.c.text if self.isEnabled() else t.c.dis
        if cell.letter:
            side = t.px(_LETTER)
            top = area.center().y() - side / 2 + 0.5
            draw_letter(painter, QRectF(area.left(), top, side, side), cell.letter, False)
            area.setLeft(area.left() + side + t.px(16))
        if cell.icon:
            side = t.px(16)
            spot = QRect(area.left(), area.top(), side, area.height())
            draw_icon(painter, cell.icon, spot, side, ink)
            area.setLeft(area.left() + side + t.px(6))
        put_text(painter, area, cell.text, t.font(14, 600 if cell.strong else 400), ink)
