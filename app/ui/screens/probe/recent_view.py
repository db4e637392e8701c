"""Tiles for recent places."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

from PySide6.QtCore import QCoreApplication, QEvent, QRect, Qt
from PySide6.QtGui import QPainter, QResizeEvent
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.presenters.places_list import PlacesListRow
from app.ui.theme import px, theme
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import clear, column, row
from app.ui.widgets.paint import put_text
from app.ui.widgets.surfaces import Card

_HIGH: Final = 64

_PICTURE: Final = (80, 48)

_LEAST: Final = 240

_WIDEST_ROW: Final = 304


class _Tile(Card):
    """A place, with its thumbnail, its name, and either its time or a list of its missing parts."""

    preferred_size = (_WIDEST_ROW, _HIGH)

    def __init__(self, row: PlacesListRow) -> None:
        self._second = row.detail if row.unfinished is not None else row.time
        values = {"name": row.name, "detail": self._second}
        super().__init__(
            tr("Finish {name}, {detail}", **values)
            if row.unfinished
            else tr("Open {name}, {detail}", **values)
        )
        self.row = row
        self.setToolTip(f"{row.name}\n{self._second}")
        self.setFixedHeight(px(_HIGH))
        self.setMinimumWidth(px(120))
        self.setMaximumWidth(px(_WIDEST_ROW))
        self._picture = picture = Picture(tr("Picture of {name}", name=row.name), 4)
        picture.setParent(self)
        picture.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        picture.set_picture(row.thumbnail)
        wide, high = (px(side) for side in _PICTURE)
        picture.setGeometry(px(8), (px(_HIGH) - high) // 2, wide, high)

    def paint_content(self, painter: QPainter) -> None:
        t = theme()
        left, middle = self._picture.geometry().right() + 1 + px(8), self.height() // 2
        name = QRect(left, middle - px(20), self.width() - left - px(8), px(20))
        put_text(painter, name, self.row.name, t.font(14, 600), t.c.text)
        put_text(painter, name.translated(0, px(20)), self._second, t.font(12), t.c.dim)


class RecentPlaces(QWidget):
    """Tiles for recent places under a heading. They are hidden when there are no recent places.

    Attributes:
        open_place: Called with the folder of the selected place.
    """

    def __init__(self, open_place: Callable[[Path], None]) -> None:
        super().__init__()
        self._open_place = open_place
        self.tiles: list[_Tile] = []
        self._title = Text(tr("Recent places"), 12, 600, "dim")
        self._line = row(gap=8)
        self._roving = Roving(self)
        column(self._title, self._line, ..., into=self, gap=6, margins=(0, 8, 0, 0))
        self._title.hide()

    def show_rows(self, rows: tuple[PlacesListRow, ...]) -> None:
        """Show as many places as fit."""
        clear(self._line)
        self.tiles = [_Tile(row) for row in rows]
        for tile in self.tiles:
            tile.clicked.connect(lambda _on=False, row=tile.row: self._open_place(row.folder))
            self._line.addWidget(tile, 1)
        self._line.addStretch()
        self._title.setVisible(bool(rows))
        self._fit()
        # Messages over the window move out of the way.
        QCoreApplication.postEvent(self.window(), QEvent(QEvent.Type.LayoutRequest))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Hide tiles that would be too narrow for their text."""
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        room = max((self.width() + px(8)) // px(_LEAST + 8), 1)
        for number, tile in enumerate(self.tiles):
            tile.setVisible(number < room)
        self._roving.set_members(self.tiles[:room])
