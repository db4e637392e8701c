"""Rows and columns of widgets in one call."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias, TypeVar

from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QVBoxLayout, QWidget

if TYPE_CHECKING:
    from collections.abc import Iterable

    from PySide6.QtWidgets import QLayout

    Part: TypeAlias = "QWidget | QLayout | tuple[QWidget | QLayout, int] | int | None"
    """What stands in a row: a widget or a layout, alone or with its stretch; a space of so many
    logical pixels; or None for whatever room is left."""

B = TypeVar("B", bound=QBoxLayout)
Margins: TypeAlias = tuple[int, int, int, int]


def hbox(
    *parts: Part, on: QWidget | None = None, gap: int | None = None, margins: Margins | None = None
) -> QHBoxLayout:
    """Put widgets beside each other; see `vbox`."""
    return _filled(QHBoxLayout(), parts, on, gap, margins)


def vbox(
    *parts: Part, on: QWidget | None = None, gap: int | None = None, margins: Margins | None = None
) -> QVBoxLayout:
    """Put widgets under each other.

    Parameters
    ----------
    on : QWidget, optional
        The widget that they fill, without margins; else the layout is to be added to another.
    gap : int, optional
        Between two of them, logical pixels; None is the style's.
    margins : tuple of int, optional
        Left, top, right and bottom, logical pixels.
    """
    return _filled(QVBoxLayout(), parts, on, gap, margins)


def boxed(layout: QLayout) -> QWidget:
    """Give a layout a widget of its own."""
    box = QWidget()
    box.setLayout(layout)
    layout.setContentsMargins(0, 0, 0, 0)
    return box


def _filled(
    layout: B, parts: Iterable[Part], on: QWidget | None, gap: int | None, margins: Margins | None
) -> B:
    if on is not None:
        on.setLayout(layout)
    if on is not None or margins is not None:
        layout.setContentsMargins(*(margins or (0, 0, 0, 0)))
    if gap is not None:
        layout.setSpacing(gap)
    for part in parts:
        stretch = 0
        if isinstance(part, tuple):
            part, stretch = part
        if part is None:
            layout.addStretch(1)
        elif isinstance(part, int):
            layout.addSpacing(part)
        elif isinstance(part, QWidget):
            layout.addWidget(part, stretch)
        else:
            layout.addLayout(part, stretch)
    return layout
