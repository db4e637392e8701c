"""The places that were open before, offered while none is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QCoreApplication, QEvent, QRect, QSize, Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from app.ui.theme import theme
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Text
from app.ui.widgets.paint import put_text
from app.ui.widgets.surfaces import Card

if TYPE_CHECKING:
    from PySide6.QtGui import QPainter, QResizeEvent

    from app.ui.presenters.places_list import PlacesListRow

_HIGH: Final = 64
_PICTURE: Final = (80, 48)
_LEAST: Final = 240
_WIDEST: Final = 304


class _Tile(Card):
    """One place: small picture, name, and when it was made or what is missing."""

    def __init__(self, row: PlacesListRow) -> None:
        self._second = row.detail if row.left is not None else row.time
        super().__init__(f"{'Finish' if row.left else 'Open'} {row.name}, {self._second}")
        self.row = row
        self.setToolTip(f"{row.name}\n{self._second}")
        t = theme()
        self.setFixedHeight(t.px(_HIGH))
        self.setMinimumWidth(t.px(120))
        self.setMaximumWidth(t.px(_WIDEST))
        self._picture = picture = Picture(f"Picture of {row.name}", 4)
        picture.setParent(self)
        picture.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        picture.set_picture(row.thumbnail)
        wide, high = (t.px(side) for side in _PICTURE)
        picture.setGeometry(t.px(8), (t.px(_HIGH) - high) // 2, wide, high)

    def sizeHint(self) -> QSize:
        """Give a small card."""
        return QSize(theme().px(_WIDEST), theme().px(_HIGH))

    def paint_content(self, painter: QPainter) -> None:
        """Paint the words beside the picture."""
        t = theme()
        left, middle = self._picture.geometry().right() + 1 + t.px(8), self.height() // 2
        name = QRect(left, middle - t.px(20), self.width() - left - t.px(8), t.px(20))
        put_text(painter, name, self.row.name, t.font(14, 600), t.c.text)
        put_text(painter, name.translated(0, t.px(20)), self._second, t.font(12), t.c.dim)


class RecentPlaces(QWidget):
    """A line of tiles under their heading; nothing at all where there are none."""

    chosen = Signal(object)
    """Folder of the place."""

    def __init__(self) -> None:
        super().__init__()
        t = theme()
        self.tiles: list[_Tile] = []
        self._title = Text("Recent places", 12, 600, "dim")
        self._line = QHBoxLayout()
        self._line.setSpacing(t.px(8))
        self._roving = Roving(self)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, t.px(8), 0, 0)
        column.setSpacing(t.px(6))
        column.addWidget(self._title)
        column.addLayout(self._line)
        column.addStretch(1)
        self._title.hide()

    def show_rows(self, rows: tuple[PlacesListRow, ...]) -> None:
        """Show as many as there is room for."""
        while (item := self._line.takeAt(0)) is not None:
            if (old := item.widget()) is not None:
                old.hide()
                old.deleteLater()
        self.tiles = [_Tile(row) for row in rows]
        for tile in self.tiles:
            tile.clicked.connect(lambda _on=False, row=tile.row: self.chosen.emit(row.folder))
            self._line.addWidget(tile, 1)
        self._line.addStretch()
        self._title.setVisible(bool(rows))
        self._fit()
        # Messages that lie over the window make way.
        QCoreApplication.postEvent(self.window(), QEvent(QEvent.Type.LayoutRequest))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave out what would have too little room for its words."""
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        t = theme()
        room = max((self.width() + t.px(8)) // t.px(_LEAST + 8), 1)
        for number, tile in enumerate(self.tiles):
            tile.setVisible(number < room)
        self._roving.set_members(self.tiles[:room])
