"""The start page, which offers three ways to begin before any light has been measured."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtGui import QPainter, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.core.text import tr
from app.ui.theme import Theme, px
from app.ui.widgets.buttons import Pressable, button_look
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import column, row
from app.ui.widgets.paint import box


class _WayButton(Pressable):
    """A button for one way to begin, showing its icon, its name and its requirements."""

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
        """Set whether this is the main button."""
        if primary != self._primary:
            self._primary = primary
            self.drawing.set(self.drawing.name, "onamber" if primary else "text")
            self._name.set_role("onamber" if primary else "text")
            self.more.set_role("onamber" if primary else "dim")
            self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        look = button_look(self, "primary" if self._primary else "outlined")
        fill = look.fill or t.c.raised
        box(painter, self.rect(), px(8), fill, look.edge or t.c.line, look.width)


class Start(QWidget):
    """The program's purpose in one sentence, followed by three ways to begin."""

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
            "Turnlight measures the light of a place and shows how far to turn "
            "your sitter for each studio style."
        )
        self.ways = (
            _WayButton(tr("Try it in 10 seconds"), tr("A demo place, no camera needed"), "play",
            demo,
                 compact),
            _WayButton(tr("Open a panorama or photos"), tr("Or drop them anywhere in this window"),
                 "folder", files, compact),
            _WayButton(tr("Connect a camera"), tr("A Ricoh Theta over Wi-Fi"), "theta", camera,
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
        """Hide the details when space is short."""
        super().resizeEvent(event)
        for part in (self._more, *(part for way in self.ways for part in (way.drawing, way.more))):
            part.setVisible(self.height() >= px(330))
