"""Rows and columns of widgets in one call."""

from __future__ import annotations

from types import EllipsisType
from typing import TypeAlias, TypeVar

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QBoxLayout,
    QGridLayout,
    QHBoxLayout,
    QLayout,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from app.ui.theme import px

Part: TypeAlias = "QWidget | QLayout"
Item: TypeAlias = (
    "Part | float | EllipsisType | tuple[Part, int] | tuple[Part, int, Qt.AlignmentFlag]"
)
"""A widget or layout, maybe with its stretch and alignment; a gap in pixels at scale 1; or
`...` for room that stretches."""

Margins: TypeAlias = "float | tuple[float, float, float, float] | None"
_Box = TypeVar("_Box", bound=QBoxLayout)


def column(
    *items: Item, into: QWidget | None = None, gap: float | None = 0, margins: Margins = 0
) -> QVBoxLayout:
    """Stack items, the uppermost first.

    Args:
        into: Gets the layout.
        gap: Between two items, pixels at scale 1; None leaves it to the layout around or the style.
        margins: Left, top, right and bottom, pixels at scale 1; None leaves them to the style.
    """
    return _filled(QVBoxLayout(), items, into, gap, margins)


def row(
    *items: Item, into: QWidget | None = None, gap: float | None = 0, margins: Margins = 0
) -> QHBoxLayout:
    """Put items side by side, the leftmost first; see `column`."""
    return _filled(QHBoxLayout(), items, into, gap, margins)


def grid(
    *parts: QWidget | tuple[QWidget, Qt.AlignmentFlag],
    across: int,
    gap: tuple[float, float] = (0, 0),
    stretched: int | None = None,
) -> QGridLayout:
    """Put widgets into rows of `across`, in reading order.

    Args:
        gap: Between columns and between rows, pixels at scale 1.
        stretched: The column that takes the room left over.
    """
    layout = QGridLayout()
    layout.setHorizontalSpacing(px(gap[0]))
    layout.setVerticalSpacing(px(gap[1]))
    if stretched is not None:
        layout.setColumnStretch(stretched, 1)
    for number, part in enumerate(parts):
        widget, *where = part if isinstance(part, tuple) else (part,)
        layout.addWidget(widget, *divmod(number, across), *where)
    return layout


def boxed(layout: QLayout) -> QWidget:
    """Give a row or column a widget of its own."""
    box = QWidget()
    box.setLayout(layout)
    return box


def stacked(*pages: QWidget) -> QStackedWidget:
    """Stack pages; the first is in front."""
    stack = QStackedWidget()
    for page in pages:
        stack.addWidget(page)
    return stack


def clear(layout: QLayout) -> None:
    """Take everything out of a row or column; widgets are deleted."""
    while (item := layout.takeAt(0)) is not None:
        if (widget := item.widget()) is not None:
            widget.hide()
            widget.deleteLater()


def add(layout: QBoxLayout, *items: Item) -> None:
    """Add items to the end of a row or column."""
    for item in items:
        if item is ...:
            layout.addStretch(1)
        elif isinstance(item, (int, float)):
            layout.addSpacing(px(item))
        else:
            part, stretch, *where = item if isinstance(item, tuple) else (item, 0)
            if isinstance(part, QLayout):
                layout.addLayout(part, stretch)
            elif where:
                layout.addWidget(part, stretch, where[0])
            else:
                layout.addWidget(part, stretch)


def fold(line: QBoxLayout, beside: bool, gap: int = 0) -> None:
    """Put the items of a line side by side, or below each other; a gap of 0 stays as it is."""
    way = QBoxLayout.Direction
    line.setDirection(way.LeftToRight if beside else way.TopToBottom)
    if gap:
        line.setSpacing(px(gap if beside else 8))


def _filled(
    layout: _Box, items: tuple[Item, ...], into: QWidget | None, gap: float | None, margins: Margins
) -> _Box:
    if into is not None:
        into.setLayout(layout)
    if margins is not None:
        around = margins if isinstance(margins, tuple) else (margins,) * 4
        layout.setContentsMargins(*(px(side) for side in around))
    if gap is not None:
        layout.setSpacing(px(gap))
    add(layout, *items)
    return layout
