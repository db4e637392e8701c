"""Live and Goal side by side: the camera's picture and its intended view."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np
from PySide6.QtCore import QRect, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFontMetrics, QImage, QPainter, QPainterPath
from PySide6.QtWidgets import QBoxLayout, QSizePolicy, QWidget

from app.core.base.arrays import Bytes
from app.core.base.visible_text import visible
from app.core.text import tr
from app.ui.screens.turn.live.live import CameraMenu, LiveWords
from app.ui.screens.turn.live.source import NO_WEBCAMS
from app.ui.theme import Theme, px, theme
from app.ui.widgets.buttons import IconButton
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column, row
from app.ui.widgets.paint import PaintedWidget, box, draw_tag
from app.ui.widgets.surfaces import Menu

if TYPE_CHECKING:
    from app.ui.screens.turn.pictures import Pictures
    from app.ui.screens.turn.screen import TurnPresenter

_ROOM_FOR_WORDS: Final = 160  # below this width only the heading is shown
_RADIUS: Final = 8
_INSET: Final = 12
_DIM: Final = 0.42

LOOKS_WORDS: Final = (
    ("sitter", tr("The camera faces the sitter")),
    ("me", tr("The camera faces me")),
)


class Well(PaintedWidget):
    """A framed picture, already rendered at the well's size in device pixels."""

    least = (96, 54)

    def __init__(self, name: str, edge: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._edge = edge
        self.picture: Bytes | None = None
        self._tag, self.message, self._brief, self.dim = "", "", "", False

    def set_picture(self, picture: Bytes | None) -> None:
        """Show a picture.

        Args:
            picture: The picture, (h, w, 3) uint8 sRGB, or None to clear the well. Do not modify the
                array afterwards.
        """
        if picture is not self.picture:
            self.picture = None if picture is None else np.ascontiguousarray(picture)
            self.update()

    def set_words(self, tag: str, message: str, brief: str, dim: bool) -> None:
        """Set the text on the picture. When space is short, `brief` replaces `message`."""
        if (tag, message, dim) != (self._tag, self.message, self.dim):
            self._tag, self.message, self._brief, self.dim = tag, message, brief, dim
            self.setAccessibleDescription(f"{tag} {message}".strip())
            self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the picture, its text and its border."""
        painter.fillRect(self.rect(), t.c.well)
        self._paint_picture(painter)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if self._tag:
            inset = px(_INSET)
            draw_tag(painter, inset, inset, self._tag, "tl", t.c.tag, t.c.ontag)
        if self.message:
            self._paint_message(painter)
        # Clipping to a rounded shape would leave jagged corners.
        corners, inner = QPainterPath(), QPainterPath()
        corners.addRect(QRectF(self.rect()))
        inner.addRoundedRect(QRectF(self.rect()), px(_RADIUS), px(_RADIUS))
        painter.fillPath(corners.subtracted(inner), t.c.bg)
        edge: QColor = getattr(t.c, self._edge)
        width = 3 if t.contrast else 2
        box(painter, self.rect(), px(_RADIUS), None, edge, width)

    def _paint_picture(self, painter: QPainter) -> None:
        picture = self.picture
        if picture is None:
            return
        rows, columns = picture.shape[:2]
        kind = QImage.Format.Format_RGB888
        image = QImage(picture.data, columns, rows, picture.strides[0], kind)
        ratio = self.devicePixelRatioF()
        whole = (round(self.width() * ratio), round(self.height() * ratio)) == (columns, rows)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, not whole)
        painter.setOpacity(_DIM if self.dim else 1.0)
        painter.drawImage(QRectF(self.rect()), image, QRectF(0, 0, columns, rows))
        painter.setOpacity(1.0)

    def _paint_message(self, painter: QPainter) -> None:
        t = theme()
        flags = int(Qt.TextFlag.TextWordWrap | Qt.AlignmentFlag.AlignLeft)
        message = self.message
        # A small picture gets smaller text first, then shorter text.
        for size, edge, text in (
            (14, _INSET, message),
            (12, 4, message),
            (12, 4, self._brief),
        ):
            inset, padding = px(edge), px(min(edge, 10))
            font = t.font(size, 500)
            room = QRect(0, 0, self.width() - 2 * inset - 2 * padding, self.height())
            words = QFontMetrics(font).boundingRect(room, flags, text)
            message = visible(text)
            if words.height() + 2 * (padding + inset) <= self.height():
                break
        high = min(words.height() + 2 * padding, self.height() - 2 * inset)
        wide = words.width() + 2 * padding
        plate = QRect(inset, self.height() - inset - high, wide, high)
        box(painter, plate, px(6), t.c.tag)
        painter.setFont(font)
        painter.setPen(t.c.ontag)
        inside = plate.adjusted(padding, padding, -padding, -padding)
        painter.drawText(inside.adjusted(0, 0, 2, 2), flags, message)


class LiveAndGoal:
    """Both pictures under their headings, with the camera menu.

    Attributes:
        layout: The layout to add to the column.
        heading: The heading of Goal.
    """

    def __init__(self, presenter: TurnPresenter) -> None:
        self._presenter = presenter
        self._menu: CameraMenu | None = None
        self._live_words = Text("", 14, role="dim", elide=True)
        self._goal_words = Text("", 14, role="dim", elide=True)
        self.live, self.goal = Well(tr("Live picture"), "text"), Well(tr("Goal"), "sel")
        self.more = IconButton("more", tr("Webcam"), kind="quiet", size="small")
        self.more.clicked.connect(self._open_menu)
        _, live = self._under_heading(tr("Live"), self._live_words, self.live, self.more)
        self.heading, goal = self._under_heading(tr("Goal"), self._goal_words, self.goal)
        self.layout = row(live, goal, ..., gap=16)

    @staticmethod
    def _under_heading(
        title: str, words: Text, well: Well, *buttons: QWidget
    ) -> tuple[QWidget, QBoxLayout]:
        heading = QWidget()
        heading.setFixedHeight(px(32))
        row(Text(title, 16, 600), (words, 1), *buttons, into=heading, gap=8)
        return heading, column(heading, well, ..., gap=6)

    def set_size(self, size: QSize) -> None:
        """Set the size of each picture, in logical pixels."""
        for words in (self._live_words, self._goal_words):
            words.setVisible(size.width() >= px(_ROOM_FOR_WORDS))
        self.live.setFixedSize(size)
        self.goal.setFixedSize(size)

    def show_words(self, words: LiveWords) -> None:
        """Show the text on the pictures and above them."""
        self._live_words.set_text(words.live)
        self._goal_words.set_text(words.goal)
        self.live.set_words(words.tag, words.message, words.brief, words.dim)
        self.goal.setAccessibleDescription(words.goal)
        self.more.set_tip(words.name or tr("Webcam"))

    def show_pictures(self, pictures: Pictures) -> None:
        """Show both pictures."""
        self.live.set_picture(pictures.live)
        self.goal.set_picture(pictures.goal)

    def set_menu(self, menu: CameraMenu) -> None:
        """Set the entries of the menu."""
        self._menu = menu

    def _open_menu(self) -> None:
        state = self._menu
        if state is None:
            return
        menu = Menu(self.more, tr("Webcam"))
        for index, name in state.webcams:
            icon = "check" if index == state.webcam else "webcam"
            menu.add(name, partial(self._presenter.choose_webcam, index), icon)
        if not state.webcams:
            words, why = NO_WEBCAMS
            menu.add(words, lambda: None, "webcam", why=why)
        menu.add(tr("Other camera, field of view…"), self._presenter.ask_source, "settings")
        menu.addSeparator()
        for looks, words in LOOKS_WORDS:
            icon = "check" if state.looks == looks else "eye"
            menu.add(words, partial(self._presenter.answer, looks), icon)
        menu.addSeparator()
        sound = tr("Sound off") if state.sounds else tr("Sound on")
        icon = "sound-off" if state.sounds else "sound"
        menu.add(sound, self._presenter.toggle_sounds, icon, "M")
        menu.drop(self.more)
