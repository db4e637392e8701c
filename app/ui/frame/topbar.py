"""The head line: which place, who is lit, which camera; undo, redo and "find anything"."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QPoint, QRect, Signal
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QHBoxLayout, QSizePolicy, QWidget

from app.ui.theme import theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.buttons import Chip, IconButton, Pressable, name_step
from app.ui.widgets.paint import put_text, text_width

if TYPE_CHECKING:
    from app.ui.presenters.frame import FrameState


class _PlaceButton(Pressable):
    """Name and time of the place, with a chevron; opens the list of places."""

    def __init__(self) -> None:
        super().__init__("Places you have measured")
        self._place = ""
        self._time = ""
        self.set_tip("Places you have measured", "Ctrl P")
        self.setFixedHeight(theme().px(32))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def show_place(self, place: str, time: str) -> None:
        self._place, self._time = place, time
        self.setAccessibleName(f"Place: {place}, {time}" if time else f"Place: {place}")
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

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Draw it."""
        t = theme()
        painter = QPainter(self)
        name, time, mark = self._parts()
        put_text(painter, name, self._place, t.font(16, 600), t.c.text)
        put_text(painter, time, self._time, t.font(14), t.c.dim)
        draw_icon(painter, "chevron-down", mark, t.px(16), t.c.text if self.hovered() else t.c.dim)


class TopBar(QWidget):
    """The head line."""

    places_asked = Signal()
    sitter_asked = Signal(QPoint)
    """Global point under the chip, where its menu opens."""
    camera_asked = Signal()
    undo_asked = Signal()
    redo_asked = Signal()
    search_asked = Signal()

    def __init__(self, compact: bool, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        t = theme()
        self._compact = compact
        self.setFixedHeight(t.px(48 if compact else 56))
        self._place = _PlaceButton()
        self.undo_button = IconButton("undo", "Undo", kind="quiet")
        self.redo_button = IconButton("redo", "Redo", kind="quiet")
        self.search_button = IconButton("search", "Find anything", kind="quiet", shortcut="Ctrl K")
        self._sitter = Chip("person", "", menu=not compact)
        self._camera = Chip("theta", "")
        row = QHBoxLayout(self)
        row.setContentsMargins(t.px(24), 0, t.px(24), 0)
        row.setSpacing(t.px(8))
        row.addWidget(self._place, 1)
        for button in (self.undo_button, self.redo_button, self.search_button):
            row.addWidget(button)
        row.addSpacing(t.px(8))
        row.addWidget(self._sitter)
        row.addWidget(self._camera)
        self._place.clicked.connect(self.places_asked)
        self.undo_button.clicked.connect(self.undo_asked)
        self.redo_button.clicked.connect(self.redo_asked)
        self.search_button.clicked.connect(self.search_asked)
        self._camera.clicked.connect(self.camera_asked)
        self._sitter.clicked.connect(self._ask_sitter)

    def show_state(self, state: FrameState) -> None:
        """Show place, sitter, camera, and what can be undone."""
        self._place.show_place(state.place, state.time)
        self._sitter.set("person", "" if self._compact else state.sitter)
        self._sitter.setAccessibleName(f"Who is lit: {state.sitter or 'loading'}")
        self._sitter.setToolTip(f"Who is lit: {state.sitter}")
        words = state.camera_short if self._compact else state.camera
        self._camera.set("theta", words, warning=state.camera_warning)
        self._camera.setAccessibleName(f"Camera: {state.camera}")
        self._camera.setToolTip(f"Camera: {state.camera}")
        name_step(self.undo_button, "Undo", state.undo, "Ctrl Z")
        name_step(self.redo_button, "Redo", state.redo, "Ctrl Shift Z")

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw it."""
        t = theme()
        painter = QPainter(self)
        painter.fillRect(self.rect(), t.c.panel)
        edge = t.line_width
        painter.fillRect(0, self.height() - edge, self.width(), edge, t.c.line)

    def _ask_sitter(self) -> None:
        self.sitter_asked.emit(self._sitter.mapToGlobal(QPoint(0, self._sitter.height())))
