"""The tag by which the photographer's marker is held: a control of its own, with the keyboard."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QPoint, QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QFontMetricsF, QPainter
from PySide6.QtWidgets import QWidget

from app.ui.theme import theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.plots.base import draw_text

if TYPE_CHECKING:
    from PySide6.QtGui import QFocusEvent, QKeyEvent, QMouseEvent, QPaintEvent

_HEIGHT: Final = 36
_ICON: Final = 16
_PADDING: Final = 15
_GAP: Final = 8


class MarkerGrip(QWidget):
    """An amber pill with a person, words, and the sign that it can be dragged.

    Arrows step by 1°, with Shift by 10°; Enter keeps the new place, Esc takes the old one.
    """

    dragged = Signal(QPoint)
    """The pointer moved while it holds the grip; in the parent's coordinates."""

    dropped = Signal()
    """The pointer let go, or Enter was pressed."""

    stepped = Signal(float)
    """An arrow was pressed: by so many degrees, positive clockwise."""

    home = Signal()
    """Home or Esc was pressed: back to where it was."""

    left = Signal()
    """The keyboard went elsewhere."""

    def __init__(self, words: str, parent: QWidget) -> None:
        super().__init__(parent)
        self._words = words
        self._moving = ""
        self._held = False
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setCursor(Qt.CursorShape.SizeHorCursor)
        self.setToolTip("Drag it to where you stand (M). Arrows 1°, Shift 10°, Enter keeps it")
        self.set_words(words)

    def set_words(self, words: str) -> None:
        """Say something else while it does not move.

        Parameters
        ----------
        words : str
            "Photographer stands here" or "You face this way now".
        """
        self._words = words
        self.setAccessibleName(words)
        self.resize(self.sizeHint())
        self.update()

    def set_moving(self, words: str) -> None:
        """Say how far it has moved.

        Parameters
        ----------
        words : str
            "12° clockwise"; empty while it does not move.
        """
        if words != self._moving:
            self._moving = words
            self.setAccessibleDescription(words)
            self.update()

    @property
    def text(self) -> str:
        """What stands on the grip now."""
        return self._moving or self._words

    @property
    def held(self) -> bool:
        """Whether the mouse holds it."""
        return self._held

    def sizeHint(self) -> QSize:
        """Return the size for its words; it keeps it while it moves."""
        t = theme()
        text = QFontMetricsF(t.font(14, 600)).horizontalAdvance(self._words)
        parts = 2 * _PADDING + 2 * _ICON + 2 * _GAP
        return QSize(t.px(parts) + round(text), t.px(_HEIGHT))

    def focus_shape(self) -> tuple[QRect, int]:
        """Rectangle and corner radius that the focus ring goes around."""
        return self.rect(), self.height() // 2

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the pill."""
        t = theme()
        painter = QPainter(self)
        try:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            area = QRectF(self.rect())
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(t.c.amberfill)
            if t.contrast:
                painter.setPen(t.c.onamber)
                area.adjust(0.5, 0.5, -0.5, -0.5)
            painter.drawRoundedRect(area, area.height() / 2.0, area.height() / 2.0)
            side, pad = t.px(_ICON), t.px(_PADDING)
            top = (self.height() - side) / 2.0
            draw_icon(painter, "person", QRectF(pad, top, side, side), side, t.c.onamber)
            middle = (self.width() / 2.0, self.height() / 2.0)
            draw_text(painter, middle, self.text, t.font(14, 600), t.c.onamber)
            dots = QRectF(self.width() - pad - side, top, side, side)
            draw_icon(painter, "grip", dots, side, t.c.onamber)
        finally:
            painter.end()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take it."""
        if event.button() == Qt.MouseButton.LeftButton:
            self._held = True

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Lead it."""
        if self._held:
            self.dragged.emit(self.mapToParent(event.position().toPoint()))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go of it."""
        if self._held and event.button() == Qt.MouseButton.LeftButton:
            self._held = False
            self.dropped.emit()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Step, keep or take back."""
        key = Qt.Key(event.key())
        way = {Qt.Key.Key_Right: 1.0, Qt.Key.Key_Left: -1.0}.get(key)
        if way is not None:
            coarse = event.modifiers() & Qt.KeyboardModifier.ShiftModifier
            self.stepped.emit(way * (10.0 if coarse else 1.0))
        elif key in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and self._moving:
            self.dropped.emit()
        elif key == Qt.Key.Key_Home or (key == Qt.Key.Key_Escape and self._moving):
            self.home.emit()
        else:
            super().keyPressEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Report that the keyboard went elsewhere."""
        super().focusOutEvent(event)
        self.left.emit()
