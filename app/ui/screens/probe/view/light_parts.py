"""The parts of the left side: the tools over the panorama, and the recent places."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QCoreApplication, QEvent, QRect, QSize, Qt, Signal
from PySide6.QtGui import QPainter, QResizeEvent
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.core.text.quantities import ev_words
from app.ui.screens.probe.state import ProbeState
from app.ui.theme import theme
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.buttons import Button, IconButton, Pressable
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import clear, column, row
from app.ui.widgets.paint import put_text, text_width
from app.ui.widgets.surfaces import Card

if TYPE_CHECKING:
    from app.ui.presenters.places_list import PlacesListRow


_HIGH: Final = 64
_PICTURE: Final = (80, 48)
_LEAST: Final = 240
_WIDEST: Final = 304


class _Tile(Card):
    """One place: small picture, name, and when it was made or what is missing."""

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
        t = theme()
        self.setFixedHeight(t.px(_HIGH))
        self.setMinimumWidth(t.px(120))
        self.setMaximumWidth(t.px(_WIDEST))
        self._picture = picture = Picture(tr("Picture of {name}", name=row.name), 4)
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


_ROOMY = 800  # wide enough for icons beside the words
_LAYERS = (
    ("clipped", tr("Clipped"), "hatch", tr("Hatch what was too bright for every frame")),
    ("lamps", tr("Lamps"), "bulb", tr("Letter the lamps")),
    ("grid", tr("Grid"), "grid", tr("Draw a grid of directions")),
)


class Tools(QWidget):
    """One line of 32."""

    zoom_asked = Signal(float)
    """Steps, positive is nearer."""
    whole_asked = Signal()
    exposed = Signal(float)
    layer_asked = Signal(str, bool)

    def __init__(self, compact: bool) -> None:
        super().__init__()
        t = theme()
        self.setFixedHeight(t.px(32))
        self.whole = IconButton("hand", tr("Show the whole panorama"), size="small", shortcut="0")
        self.whole.set_tip(tr("Drag to look around; press to show it whole"), "0")
        self.out = IconButton("minus", tr("Zoom out"), size="small", shortcut="−")
        self.near = IconButton("plus", tr("Zoom in"), size="small", shortcut="+")
        self.percent = Text("100 %", align=Qt.AlignmentFlag.AlignHCenter)
        self.percent.setFixedWidth(text_width(t.font(14), "800 %") + t.px(8))
        self.exposure = LabelledSlider(
            tr("Exposure"),
            -6.0,
            6.0,
            0.0,
            0.1,
            partial(ev_words, tenths=True),
            default=0.0,
            inline=True,
        )
        self.exposure.setToolTip(tr("How bright it is shown; a double click resets it"))
        self.exposure.setMaximumWidth(t.px(296))
        if not compact:
            self.exposure.setMinimumWidth(t.px(200))
        self.layers: dict[str, Pressable] = {}
        self._there: bool | None = None
        near = (self.whole, self.out, self.percent, self.near, 8, Icon("sun", 20, "dim"))
        line = row(*near, (self.exposure, 1), into=self, gap=8)
        line.addStretch(0 if compact else 1)
        for key, words, icon, tip in _LAYERS:
            line.addWidget(self._layer(key, words, icon, tip, compact))
        self.whole.clicked.connect(self.whole_asked)
        self.out.clicked.connect(lambda: self.zoom_asked.emit(-1.0))
        self.near.clicked.connect(lambda: self.zoom_asked.emit(1.0))
        self.exposure.changed.connect(self.exposed)
        Roving(self).set_members([self.whole, self.out, self.near])
        Roving(self).set_members(list(self.layers.values()))

    def _layer(self, key: str, words: str, icon: str, tip: str, compact: bool) -> Pressable:
        button: Pressable
        if compact:
            button = IconButton(icon, words, checkable=True, size="small")
        else:
            button = Button(words, icon, size="small", checkable=True)
        button.set_tip(tip)
        button.clicked.connect(lambda on, key=key: self.layer_asked.emit(key, on))
        self.layers[key] = button
        return button

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave out the icons beside words where there is little room."""
        super().resizeEvent(event)
        roomy = self.width() >= theme().px(_ROOMY)
        for key, words, icon, _ in _LAYERS:
            button = self.layers[key]
            if isinstance(button, Button):
                button.set_text(words, icon if roomy else "")

    def show_zoom(self, zoom: float) -> None:
        """Say how near it is shown."""
        self.percent.set_text(f"{round(100 * zoom)} %")

    def show_state(self, state: ProbeState) -> None:
        """Show exposure and layers."""
        self.exposure.set_value(state.exposure_ev)
        for key, button in self.layers.items():
            button.setChecked(key in state.layers)
        there = state.picture is not None
        if there == self._there:
            return
        self._there = there
        for widget in (self.whole, self.out, self.near, *self.layers.values()):
            widget.set_available(there, tr("There is no panorama yet."))
        self.exposure.setEnabled(there)
