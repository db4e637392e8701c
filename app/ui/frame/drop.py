"""Files dropped anywhere on the window."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

from app.ui.theme import theme
from app.ui.theme.icons import icon_pixmap

if TYPE_CHECKING:
    from PySide6.QtCore import QMimeData

_MOST_FILES: Final = 500
_WORDS: Final = "Drop a panorama, a bracket or a folder"


def dropped_paths(data: QMimeData) -> list[Path]:
    """Read which files of this computer are being dropped."""
    urls = data.urls()[:_MOST_FILES]
    return [Path(url.toLocalFile()) for url in urls if url.isLocalFile()]


class DropVeil(QWidget):
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

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw it."""
        t = theme()
        painter = QPainter(self)
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
