"""What the window has to do with the desktop: files dropped on it, and its place on the screen."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from PySide6.QtCore import QMargins, QMimeData, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QWindow
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.theme import Theme
from app.ui.theme.icons import icon_pixmap
from app.ui.widgets.paint import Painted

_FRAME: Final = QMargins(4, 32, 4, 4)
"""Title bar and edges of the usual desktops; what they are is known once the window is shown."""


def fitted(wanted: QRect, room: QRect) -> QRect:
    """Make a rectangle as small as the room, then move it inside; both in the same pixels."""
    size = wanted.size().boundedTo(room.size())
    left = min(max(wanted.left(), room.left()), room.left() + room.width() - size.width())
    top = min(max(wanted.top(), room.top()), room.top() + room.height() - size.height())
    return QRect(left, top, size.width(), size.height())


def room_for(window: QWidget) -> QRect:
    """Give what a window's content can have on its screen, logical pixels; its frame is outside."""
    return window.screen().availableGeometry().marginsRemoved(_frame_of(window))


def fit_on_screen(window: QWidget, smallest: QSize) -> None:
    """Bring a window whole onto its screen; it may be smaller than `smallest` only there."""
    if window.isMaximized() or window.isFullScreen():
        return
    room = room_for(window)
    window.setMinimumSize(smallest.boundedTo(room.size()))
    wanted = fitted(window.geometry(), room)
    if wanted != window.geometry():
        window.setGeometry(wanted)


def _frame_of(window: QWidget) -> QMargins:
    handle: QWindow | None = window.windowHandle()
    known = QMargins() if handle is None else handle.frameMargins()
    return _FRAME if known.isNull() else known


_MOST_FILES: Final = 500
_WORDS: Final = tr("Drop a panorama, a bracket or a folder")


def dropped_paths(data: QMimeData) -> list[Path]:
    """Read which files of this computer are being dropped."""
    urls = data.urls()[:_MOST_FILES]
    return [Path(url.toLocalFile()) for url in urls if url.isLocalFile()]


class DropVeil(Painted):
    """Lies over the window while files are held over it."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self._words = _WORDS
        self.setAccessibleName(_WORDS)

    def set_words(self, words: str) -> None:
        """Say what may be dropped."""
        self._words = words or _WORDS
        self.setAccessibleName(self._words)
        self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Draw it."""
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        veil = QColor(t.c.bg)
        veil.setAlphaF(0.92)
        painter.fillRect(self.rect(), veil)
        inset = t.px(24)
        box = QRectF(self.rect()).adjusted(inset, inset, -inset, -inset)
        pen = QPen(t.c.sel, t.px(2))
        pen.setStyle(Qt.PenStyle.DashLine)
        painter.setPen(pen)
        painter.drawRoundedRect(box, t.px(8), t.px(8))
        size = t.px(24)
        icon = icon_pixmap("folder", size, t.c.text, self.devicePixelRatioF())
        painter.drawPixmap(
            round(box.center().x() - size / 2), round(box.center().y() - t.px(36)), icon
        )
        painter.setPen(t.c.text)
        painter.setFont(t.font(20, 600))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, self._words)
