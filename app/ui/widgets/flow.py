"""Layouts that break: cards in as many columns as fit, and chips that wrap."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QPoint, QRect, QSize, Qt
from PySide6.QtWidgets import QLayout, QLayoutItem, QWidget

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["FlowLayout", "GridLayout"]


class _Breaking(QLayout):
    """What both layouts share: a list of items and a gap."""

    def __init__(self, parent: QWidget | None = None, gap: int = 8) -> None:
        super().__init__(parent)
        self._items: list[QLayoutItem] = []
        self.setContentsMargins(0, 0, 0, 0)
        self.setSpacing(gap)

    def addItem(self, item: QLayoutItem) -> None:
        """Take an item at the end."""
        self._items.append(item)

    def count(self) -> int:
        """Count the items."""
        return len(self._items)

    def itemAt(self, index: int) -> QLayoutItem | None:
        """Give an item, or None beyond the last one."""
        return self._items[index] if 0 <= index < len(self._items) else None

    def takeAt(self, index: int) -> QLayoutItem | None:
        """Hand an item back, or None beyond the last one."""
        return self._items.pop(index) if 0 <= index < len(self._items) else None

    def expandingDirections(self) -> Qt.Orientation:
        """Never ask for more than is needed."""
        return Qt.Orientation(0)

    def hasHeightForWidth(self) -> bool:
        """Narrower is higher."""
        return True

    def heightForWidth(self, width: int) -> int:
        """Give the height of all rows at a width."""
        return self._arrange(QRect(0, 0, width, 0), move=False)

    def setGeometry(self, rect: QRect) -> None:
        """Move the items to their places."""
        super().setGeometry(rect)
        self._arrange(rect, move=True)

    def sizeHint(self) -> QSize:
        """Give the size as designed."""
        return self.minimumSize()

    def minimumSize(self) -> QSize:
        """Give the size of the largest item."""
        size = QSize()
        for item in self._shown():
            size = size.expandedTo(item.minimumSize())
        return size

    def _shown(self) -> Iterator[QLayoutItem]:
        return (item for item in self._items if not item.isEmpty())

    def _arrange(self, rect: QRect, move: bool) -> int:
        raise NotImplementedError


class FlowLayout(_Breaking):
    """Items beside each other at their own widths, in as many rows as they need.

    Parameters
    ----------
    parent : QWidget, optional
        What it lays out.
    gap : int, optional
        Distance between items and between rows, logical pixels.
    """

    def _arrange(self, rect: QRect, move: bool) -> int:
        x, y, high = rect.x(), rect.y(), 0
        for item in self._shown():
            size = item.sizeHint()
            if x > rect.x() and x + size.width() > rect.x() + rect.width():
                x, y, high = rect.x(), y + high + self.spacing(), 0
            if move:
                item.setGeometry(QRect(QPoint(x, y), size))
            x += size.width() + self.spacing()
            high = max(high, size.height())
        return y + high - rect.y()


class GridLayout(_Breaking):
    """Items of one size in equal columns, as many as fit.

    Parameters
    ----------
    parent : QWidget, optional
        What it lays out.
    least : int, optional
        Least width of a column, logical pixels.
    ratio : float, optional
        Height of an item over its width at `least`; 0 takes the heights that they ask for.
    gap : int, optional
        Distance between columns and between rows, logical pixels.
    most : int, optional
        Most columns; 0 for as many as fit.
    height : int, optional
        Fixed height of every item; 0 for none.
    """

    def __init__(
        self,
        parent: QWidget | None = None,
        least: int = 186,
        ratio: float = 0.0,
        gap: int = 8,
        most: int = 0,
        height: int = 0,
    ) -> None:
        super().__init__(parent, gap)
        self._least, self._ratio, self._most, self._height = least, ratio, most, height

    def columns(self, width: int) -> int:
        """Give the number of columns at a width.

        Parameters
        ----------
        width : int
            Logical pixels.

        Returns
        -------
        int
            At least 1.
        """
        fit = max(1, (width + self.spacing()) // (self._least + self.spacing()))
        return min(fit, self._most) if self._most else fit

    def _arrange(self, rect: QRect, move: bool) -> int:
        items = list(self._shown())
        if not items:
            return 0
        columns, gap = self.columns(rect.width()), self.spacing()
        inner = rect.width() - gap * (columns - 1)
        high = self._row_height(items, inner // columns)
        for number, item in enumerate(items if move else ()):
            row, column = divmod(number, columns)
            # Rests of the division are spread, so that the last column ends with the edge.
            left = column * inner // columns
            right = (column + 1) * inner // columns
            place = QRect(rect.x() + left + column * gap, rect.y() + row * (high + gap), 0, high)
            place.setWidth(right - left)
            item.setGeometry(place)
        rows = -(-len(items) // columns)
        return rows * high + (rows - 1) * gap

    def minimumSize(self) -> QSize:
        """Give the size of one column with one item."""
        return super().minimumSize().expandedTo(QSize(self._least, self._height))

    def _row_height(self, items: list[QLayoutItem], width: int) -> int:
        if self._height:
            return self._height
        if self._ratio:
            return round(width * self._ratio)
        return max(item.sizeHint().height() for item in items)
