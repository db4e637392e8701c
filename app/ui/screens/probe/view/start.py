"""What a newcomer sees: what the program does, three ways to begin, and the recent places."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QCoreApplication, QEvent, QRect, Qt
from PySide6.QtGui import QPainter, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.core.text import tr
from app.ui.theme import Theme, px, theme
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.buttons import Pressable, button_look
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import clear, column, row
from app.ui.widgets.paint import box, put_text
from app.ui.widgets.surfaces import Card

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from app.ui.presenters.places_list import PlacesListRow


class _Way(Pressable):
    """A way to begin: an icon, what it is, and what it needs."""

    def __init__(
        self, title: str, words: str, icon: str, do: Callable[[], None], compact: bool
    ) -> None:
        super().__init__(title, tip=words, do=do)
        self.setAccessibleDescription(words)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        middle = Qt.AlignmentFlag.AlignHCenter
        self.drawing = Icon(icon, 40 if compact else 56)
        self._name = Text(title, 14 if compact else 16, 600, wrap=True, align=middle)
        self.more = Text(words, 12, role="dim", wrap=True, align=middle)
        self._primary = False
        for text in (self._name, self.more):
            text.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        picture, edge = (self.drawing, 0, middle), 16 if compact else 20
        column(picture, edge // 2, self._name, self.more, ..., into=self, gap=4, margins=edge)

    def set_primary(self, primary: bool) -> None:
        """Mark it as the main button, or not."""
        if primary != self._primary:
            self._primary = primary
            self.drawing.set(self.drawing.name, "onamber" if primary else "text")
            self._name.set_role("onamber" if primary else "text")
            self.more.set_role("onamber" if primary else "dim")
            self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint it in the current theme."""
        look = button_look(self, "primary" if self._primary else "outlined")
        fill = look.fill or t.c.raised
        box(painter, self.rect(), px(8), fill, look.edge or t.c.line, look.width)


class Start(QWidget):
    """One sentence that says what the program does, and three ways to begin."""

    def __init__(
        self,
        demo: Callable[[], None],
        files: Callable[[], None],
        camera: Callable[[], None],
        compact: bool,
    ) -> None:
        super().__init__()
        middle = Qt.AlignmentFlag.AlignHCenter
        title = tr("How far to turn for Rembrandt light, here.")
        what = tr(
            "Turnlight measures the light of a place and tells how far to turn "
            "your sitter for each studio style."
        )
        self.ways = (
            _Way(tr("Try it in 10 seconds"), tr("A demo place, no camera needed"), "play", demo,
                 compact),
            _Way(tr("Open a panorama or photos"), tr("Or drop them anywhere in this window"),
                 "folder", files, compact),
            _Way(tr("Connect a camera"), tr("A Ricoh Theta, by its Wi-Fi"), "theta", camera,
                 compact),
        )  # fmt: skip
        sentence = Text(title, 20 if compact else 28, 700, wrap=True, align=middle)
        self._more = Text(what, 14, role="dim", wrap=True, align=middle)
        ways = row(*((way, 1) for way in self.ways), gap=12)
        side = 16 if compact else 32
        column(..., sentence, self._more, side // 2, ways, ..., into=self, gap=8, margins=side)
        self.setAccessibleName(title)
        self.setAccessibleDescription(what)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Say less where there is little room."""
        super().resizeEvent(event)
        beside = [part for way in self.ways for part in (way.drawing, way.more)]
        for part in (self._more, *beside):
            part.setVisible(self.height() >= px(330))

    def set_camera(self, ready: bool) -> None:
        """Make the demo the main button unless a camera is ready to capture."""
        self.ways[0].set_primary(not ready)


_HIGH: Final = 64
_PICTURE: Final = (80, 48)
_LEAST: Final = 240
_WIDEST_ROW: Final = 304


class _Tile(Card):
    """One place: small picture, name, and when it was made or what is missing."""

    wanted = (_WIDEST_ROW, _HIGH)

    def __init__(self, row: PlacesListRow) -> None:
        self._second = row.detail if row.left is not None else row.time
        told = {"name": row.name, "detail": self._second}
        super().__init__(
            tr("Finish {name}, {detail}", **told)
            if row.left
            else tr("Open {name}, {detail}", **told)
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
        """Paint the words beside the picture."""
        t = theme()
        left, middle = self._picture.geometry().right() + 1 + px(8), self.height() // 2
        name = QRect(left, middle - px(20), self.width() - left - px(8), px(20))
        put_text(painter, name, self.row.name, t.font(14, 600), t.c.text)
        put_text(painter, name.translated(0, px(20)), self._second, t.font(12), t.c.dim)


class RecentPlaces(QWidget):
    """Tiles of recent places under a heading, hidden when there are none.

    `open_place` takes the folder of the place that is chosen.
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
        """Show as many as there is room for."""
        clear(self._line)
        self.tiles = [_Tile(row) for row in rows]
        for tile in self.tiles:
            tile.clicked.connect(lambda _on=False, row=tile.row: self._open_place(row.folder))
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
        room = max((self.width() + px(8)) // px(_LEAST + 8), 1)
        for number, tile in enumerate(self.tiles):
            tile.setVisible(number < room)
        self._roving.set_members(self.tiles[:room])
