"""Rows and columns of widgets, each created with a single call."""

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
"""An item in a row or column.

It is one of the following: a widget or layout; a tuple of a widget or layout, its stretch and
optionally its alignment; a gap in pixels at scale 1; or `...` for stretchable space.
"""

Margins: TypeAlias = "float | tuple[float, float, float, float] | None"
_Box = TypeVar("_Box", bound=QBoxLayout)


def column(
    *items: Item, into: QWidget | None = None, gap: float | None = 0, margins: Margins = 0
) -> QVBoxLayout:
    """Stack items from top to bottom.

    Args:
        into: Widget that receives the layout.
        gap: Spacing in pixels at scale 1, or None to inherit it.
        margins: Left, top, right and bottom margins in pixels at scale 1, or None for the style's
            margins.
    """
    return _filled(QVBoxLayout(), items, into, gap, margins)


def row(
    *items: Item, into: QWidget | None = None, gap: float | None = 0, margins: Margins = 0
) -> QHBoxLayout:
    """Arrange items side by side, from left to right (see `column`)."""
    return _filled(QHBoxLayout(), items, into, gap, margins)


def grid(
    *parts: QWidget | tuple[QWidget, Qt.AlignmentFlag],
    across: int,
    gap: tuple[float, float] = (0, 0),
    stretched: int | None = None,
) -> QGridLayout:
    """Arrange widgets in reading order, with `across` widgets in each row.

    Args:
        gap: Spacing between columns and between rows, in pixels at scale 1.
        stretched: Column that takes the remaining space.
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
    """Wrap a row or column in a widget."""
    box = QWidget()
    box.setLayout(layout)
    return box


def stacked(*pages: QWidget) -> QStackedWidget:
    """Stack pages on top of one another, with the first one visible."""
    stack = QStackedWidget()
    for page in pages:
        stack.addWidget(page)
    return stack


def clear(layout: QLayout) -> None:
    """Remove all items from a row or column, and delete their widgets."""
    while (item := layout.takeAt(0)) is not None:
        if (widget := item.widget()) is not None:
            widget.hide()
            widget.deleteLater()


def add(layout: QBoxLayout, *items: Item) -> None:
    """Append items to a row or column."""
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
    """Arrange the items of a line in a row if `beside` is true, or else in a column.

    `gap` is the spacing of a row in pixels at scale 1. A column has a spacing of 8 pixels. If `gap`
    is 0, the spacing is left unchanged.
    """
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
