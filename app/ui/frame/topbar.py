"""The head line: which place, who is lit, which camera; undo, redo and "find anything"."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QPoint, QRect, Signal
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import QSizePolicy

from app.core.text import tr
from app.ui.theme import Theme, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.buttons import Chip, IconButton, Pressable, name_step
from app.ui.widgets.layouts import row
from app.ui.widgets.paint import put_text, text_width
from app.ui.widgets.surfaces import Surface

if TYPE_CHECKING:
    from app.ui.presenters.frame import FrameState


class _PlaceButton(Pressable):
    """Name and time of the place, with a chevron; opens the list of places."""

    def __init__(self) -> None:
        super().__init__(tr("Places you have measured"))
        self._place = ""
        self._time = ""
        self.set_tip(tr("Places you have measured"), "Ctrl P")
        self.setFixedHeight(theme().px(32))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def show_place(self, place: str, time: str) -> None:
        self._place, self._time = place, time
        self.setAccessibleName(
            tr("Place: {place}, {time}", place=place, time=time)
            if time
            else tr("Place: {place}", place=place)
        )
        self.update()

    def _parts(self) -> tuple[QRect, QRect, QRect]:
        """Where name, time and chevron go; a long name gives way."""
        t = theme()
        high, gap, mark = self.height(), t.px(16), t.px(16)
        time = text_width(t.font(14), self._time)
        behind = (gap + time if self._time else 0) + t.px(8) + mark
        name = min(text_width(t.font(16, 600), self._place), max(self.width() - behind, 0))
        after = name + (gap + time if self._time else 0)
        return (
            QRect(0, 0, name, high),
            QRect(name + gap, 0, time, high),
            QRect(after + t.px(8), (high - mark) // 2, mark, mark),
        )

    def focus_shape(self) -> tuple[QRect, int]:
        """Give the words only, not the free room behind them."""
        last = self._parts()[2]
        return QRect(0, 0, last.right() + 1, self.height()), theme().px(6)

    def hitButton(self, pos: QPoint) -> bool:
        """Take clicks on the words only."""
        return self.focus_shape()[0].contains(pos)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Draw it."""
        name, time, mark = self._parts()
        put_text(painter, name, self._place, t.font(16, 600), t.c.text)
        put_text(painter, time, self._time, t.font(14), t.c.dim)
        draw_icon(painter, "chevron-down", mark, t.px(16), t.c.text if self.hovered() else t.c.dim)


class TopBar(Surface):
    """The head line."""

    places_asked = Signal()
    sitter_asked = Signal(QPoint)
    """Global point under the chip, where its menu opens."""
    camera_asked = Signal()

    def __init__(self, compact: bool) -> None:
        super().__init__("panel", ("bottom",))
        t = theme()
        self._compact = compact
        self.setFixedHeight(t.px(48 if compact else 56))
        self._place = _PlaceButton()
        self.undo_button = IconButton("undo", tr("Undo"), kind="quiet")
        self.redo_button = IconButton("redo", tr("Redo"), kind="quiet")
        self.search_button = IconButton(
            "search", tr("Find anything"), kind="quiet", shortcut="Ctrl K"
        )
        self._sitter = Chip("person", "", menu=not compact)
        self._camera = Chip("theta", "")
        buttons = (self.undo_button, self.redo_button, self.search_button)
        row(
            *((self._place, 1), *buttons, 8, self._sitter, self._camera),
            into=self,
            gap=8,
            margins=(24, 0, 24, 0),
        )
        self._place.clicked.connect(self.places_asked)
        self._camera.clicked.connect(self.camera_asked)
        self._sitter.clicked.connect(self._ask_sitter)

    def show_state(self, state: FrameState) -> None:
        """Show place, sitter, camera, and what can be undone."""
        self._place.show_place(state.place, state.time)
        self._sitter.set("person", "" if self._compact else state.sitter)
        self._sitter.setAccessibleName(
            tr("Who is lit: {sitter}", sitter=state.sitter or tr("loading"))
        )
        self._sitter.setToolTip(tr("Who is lit: {sitter}", sitter=state.sitter))
        words = state.camera_short if self._compact else state.camera
        self._camera.set("theta", words, warning=state.camera_warning)
        self._camera.setAccessibleName(tr("Camera: {camera}", camera=state.camera))
        self._camera.setToolTip(tr("Camera: {camera}", camera=state.camera))
        name_step(self.undo_button, "undo", state.undo)
        name_step(self.redo_button, "redo", state.redo)

    def _ask_sitter(self) -> None:
        self.sitter_asked.emit(self._sitter.mapToGlobal(QPoint(0, self._sitter.height())))
