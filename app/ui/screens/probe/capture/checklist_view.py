"""Tiles for the items on the checklist."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QRect, Qt
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import QSizePolicy

from app.core.text import tr
from app.ui.screens.probe.capture.checklist import ChoiceRow
from app.ui.theme import Theme, px
from app.ui.theme.icons import draw_icon
from app.ui.widgets.buttons import Pressable
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import row
from app.ui.widgets.paint import box, hover_fill, selected_edge

_TILE: Final = 48


class CheckTile(Pressable):
    """A checklist item that the user can tick, illustrated by a drawing."""

    def __init__(self, check: ChoiceRow, compact: bool) -> None:
        super().__init__(check.title, tip=check.title if compact else "")
        self.key = check.key
        self._compact = compact
        self.preferred_size = (72 if compact else 192, _TILE)
        self.least = (56 if compact else 150, _TILE)
        self.setCheckable(True)
        self.setMinimumHeight(px(_TILE))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Minimum)
        if not compact:
            words = Text(check.title, 12, wrap=True)
            words.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
            # In a language with longer words, three lines of text make the tile taller.
            row(46, (words, 1, Qt.AlignmentFlag.AlignVCenter), 28, into=self, margins=(0, 6, 0, 6))

    def show_ticked(self, ticked: bool) -> None:
        """Set the tick without emitting a signal."""
        self.setChecked(ticked)
        self.setAccessibleDescription(tr("done") if ticked else tr("not yet done"))

    def nextCheckState(self) -> None:
        """Do nothing, because the presenter sets the tick."""

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the tile in the current theme."""
        fill = hover_fill(t) if self.hovered() and t.contrast else t.c.raised
        edge, width = (t.c.line, t.line_width) if t.contrast else (None, 1)
        if self.isDown() or (self.hovered() and not t.contrast):
            edge, width = t.c.ctl, selected_edge(t) if self.isDown() else 1
        box(painter, self.rect(), px(8), fill, edge, width)
        side = px(28)
        spot = QRect(px(8 if self._compact else 10), 0, side, self.height())
        if self._compact and not self.isChecked():
            spot.moveLeft((self.width() - side) // 2)
        draw_icon(painter, self.key, spot, side, t.c.text)
        if self.isChecked():
            mark = px(16)
            spot = QRect(self.width() - mark - px(8), 0, mark, self.height())
            draw_icon(painter, "check", spot, mark, t.c.ok)
