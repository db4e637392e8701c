"""The rail at the left: the four steps, and at its foot places and settings."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QRect, Signal
from PySide6.QtGui import QPainter

from app.core.text import tr
from app.ui.theme import Theme, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.buttons import Pressable
from app.ui.widgets.layouts import column
from app.ui.widgets.paint import MIDDLE, box, hover_fill, put_text
from app.ui.widgets.surfaces import Surface

if TYPE_CHECKING:
    from app.ui.screens.registry import ScreenSpec

PLACES: Final = "places"
SETTINGS: Final = "settings"

_WIDTH: Final = 88
_COMPACT_WIDTH: Final = 72
_STEP_HEIGHT: Final = 64
_BAR: Final = 4
_FOOT: Final = (
    (PLACES, tr("Places"), tr("Places you have measured"), PLACES),
    (SETTINGS, tr("Settings"), tr("Settings"), SETTINGS),
)


class _RailButton(Pressable):
    """One entry: icon over label, a bar at the left edge when it is the screen in front."""

    def __init__(self, title: str, tip: str, icon: str, shortcut: str, compact: bool) -> None:
        super().__init__(title)
        self._icon = icon
        self._done = False
        t = theme()
        self._margin = t.px(4 if compact else 8)
        self.setText(title)
        self.setCheckable(True)
        self.setFixedSize(t.px(_COMPACT_WIDTH if compact else _WIDTH), t.px(_STEP_HEIGHT))
        self.set_tip(tip, shortcut)

    def set_done(self, done: bool) -> None:
        """Mark the step as done; said in its name as well."""
        self._done = done
        self.setAccessibleName(tr("{step}, done", step=self.text()) if done else self.text())
        self.update()

    def nextCheckState(self) -> None:
        """Stay as the window says: a click asks, it does not switch."""

    def focus_shape(self) -> tuple[QRect, int]:
        """Give the rectangle behind icon and label."""
        return self._box(), theme().px(8)

    def _box(self) -> QRect:
        return self.rect().adjusted(self._margin, 0, -self._margin, 0)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Draw it."""
        inverted = t.contrast and self.isChecked()
        if self.isChecked():
            fill = t.c.text if inverted else t.c.raised
            box(painter, self._box(), t.px(8), fill)
            bar = QRect(0, t.px(8), t.px(_BAR), self.height() - t.px(16))
            painter.fillRect(bar, t.c.sel)
        elif self.hovered():
            box(painter, self._box(), t.px(8), hover_fill(t))
        ink = t.c.panel if inverted else (t.c.text if self.isChecked() else t.c.dim)
        side = t.px(24)
        middle = self.rect().center().x()
        face = QRect(middle - side // 2, t.px(9), side, side)
        draw_icon(painter, self._icon, face, side, ink)
        label = QRect(0, t.px(38), self.width(), t.px(16))
        put_text(painter, label, self.text(), t.font(12, 500), ink, MIDDLE)
        if self._done:
            small = t.px(14)
            mark = QRect(face.right() + t.px(3), t.px(5), small, small)
            draw_icon(painter, "check", mark, small, t.c.panel if inverted else t.c.ok)


class Rail(Surface):
    """Steps and, at the foot, places and settings; one stop for Tab, arrows move inside."""

    chosen = Signal(str)
    """Key of what was chosen: a screen's, `PLACES` or `SETTINGS`."""

    def __init__(self, compact: bool, screens: Sequence[ScreenSpec]) -> None:
        super().__init__("panel", ("right",))
        t = theme()
        self.setAccessibleName(tr("Steps"))
        self.setFixedWidth(t.px(_COMPACT_WIDTH if compact else _WIDTH))
        self._buttons: dict[str, _RailButton] = {}
        lines = column(into=self, gap=8, margins=(0, 64 if compact else 72, 0, 8))
        steps = [(spec.key, spec.title, spec.tip, spec.icon) for spec in screens]
        for number, (key, title, tip, icon) in enumerate([*steps, *_FOOT], start=1):
            if key == PLACES:
                lines.addStretch(1)
            shortcut = f"Ctrl {number}" if number <= len(steps) else ""
            button = _RailButton(title, tip, icon, shortcut, compact)
            button.clicked.connect(lambda _=False, key=key: self.chosen.emit(key))
            lines.addWidget(button)
            self._buttons[key] = button
        self._roving = Roving(self)
        self._roving.set_members(list(self._buttons.values()))

    def show_steps(self, current: str, done: Collection[str]) -> None:
        """Mark the screen in front and those that are done, by their keys."""
        for key, button in self._buttons.items():
            button.setChecked(key == current)
            button.set_done(key in done)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Draw it."""
        super().paint_on(painter, t)
        size = t.px(40)
        spot = QRect((self.width() - t.line_width - size) // 2, t.px(12), size, size)
        draw_icon(painter, "logo", spot, size, t.c.text)
