"""Parts of the left column: wells, the question about the camera, and photos taken here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Literal

import numpy as np
from PySide6.QtCore import QPointF, QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QFontMetrics,
    QImage,
    QPainter,
    QPainterPath,
    QPen,
    QPolygonF,
    QResizeEvent,
)
from PySide6.QtWidgets import QLayout, QSizePolicy, QWidget

from app.core.base.arrays import Bytes
from app.core.base.visible_text import visible
from app.core.text import tr, tr_plural
from app.ui.screens.turn.state import ShotRow, ShotsState
from app.ui.theme import Theme, px, theme
from app.ui.widgets.buttons import Button, IconButton, Pressable
from app.ui.widgets.dialogs import Sheet
from app.ui.widgets.displays import Picture
from app.ui.widgets.fields import Toggle
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import add, clear, column, row
from app.ui.widgets.messages import Empty
from app.ui.widgets.paint import (
    MIDDLE,
    PaintedWidget,
    box,
    draw_tag,
    faint,
    hover_fill,
    put_text,
    selected_edge,
)
from app.ui.widgets.surfaces import PictureLine, Scroll

_ASK: Final = tr("Check my shot")
_ASK_AGAIN: Final = tr("Open")
_ASK_MORE: Final = tr("Another photo")
_HINT: Final = tr("After the shot, drop it here: how far off the light was it?")
_HINT_SHORT: Final = tr("After the shot, drop the photo here.")
_TITLE: Final = tr("Photos taken here")
_EMPTY: Final = tr("No photo of this place yet. Drop the one you took on the window.")
_SMALL: Final = (56, 40)
_PICTURE: Final = (112, 84)
_COMPARED: Final = 208
_WIDTH: Final = 560
_ROOM: Final = 640  # below this the button says less


class ShotsLine(QWidget):
    """Asks for the photo, says how it was, and leads back to the guidance."""

    listed = Signal()

    def __init__(self, ask: Callable[[], None], again: Callable[[], None]) -> None:
        super().__init__()
        self._state = ShotsState()
        self.opener = Button(_ASK, "camera", do=ask)
        self.opener.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.opener.set_tip(tr("Open the photo you took, or drop it on the window"), "P")
        self._picture = Picture(tr("The photo"), radius=4)
        self._picture.setFixedSize(px(_SMALL[0]), px(_SMALL[1]))
        self._icon = Icon("help", 20)
        self._words = Text("", 14, wrap=True)
        self._words.setMaximumHeight(px(_SMALL[1]))
        self.lister = Button(tr("All photos"), "list", size="small", do=self.listed)
        self.lister.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.again = Button(tr("Turn again"), "turn", "primary", do=again)
        self.again.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.again.set_tip(tr("Back to the guidance, with the same goal"))
        words = (self._words, 1, Qt.AlignmentFlag.AlignVCenter)
        parts = (self._picture, self._icon, words, self.again, self.lister)
        row(self.opener, *parts, into=self, gap=12)
        self.setFixedHeight(px(_SMALL[1]))
        self._fill()

    @property
    def words(self) -> str:
        """What it says."""
        return self._words.text()

    def set_main(self, main: bool) -> None:
        """Make the check the main button, as in the light."""
        self.opener.kind = "primary" if main else "outlined"
        self.again.kind = "outlined" if main else "primary"
        for button in (self.opener, self.again):
            button.update()

    def show_shots(self, state: ShotsState) -> None:
        """Say how the last photo was."""
        if state != self._state or _picture(state) is not _picture(self._state):
            self._state = state
            self._fill()

    def _fill(self) -> None:
        state = self._state
        new = bool(state.rows) and state.rows[0].new and not state.busy
        last = state.rows[0] if new else None
        self._picture.set_picture(None if last is None else last.thumbnail)
        roomy = self.width() >= px(_ROOM)
        self._picture.setVisible(last is not None and last.pictured and roomy)
        again = _ASK_AGAIN if state.rows else _ASK
        label = _ASK if last is None else _ASK_MORE
        self.opener.set_text(label if roomy else again)
        self.opener.setAccessibleName(_ASK)
        self._icon.setVisible(last is not None)
        self.again.setVisible(last is not None and last.again)
        if last is not None:
            self._icon.set(last.icon, "ok" if last.inside else "text")
            self._picture.setAccessibleName(last.name)
        self._words.set_text(self._sentence(last))
        self._words.set_role("text" if last is not None else "dim")
        lines = () if last is None else (last.sentence, last.face, last.detail)
        self._words.setToolTip("".join(f"{words}. " for words in lines if words).strip())
        count = len(state.rows)
        self.lister.setVisible(count > 0)
        self.lister.set_text(
            tr_plural("{count} photo", "All {count}", count) if roomy else f"{count}"
        )
        self.lister.setAccessibleName(tr("Photos taken here: {count}", count=count))

    def _sentence(self, last: ShotRow | None) -> str:
        if self._state.busy:
            return self._state.busy
        if last is not None:
            return ". ".join(words for words in (last.sentence, last.face, "") if words) + "."
        return _HINT if self.width() >= px(_ROOM) else _HINT_SHORT

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Say less where there is less room."""
        super().resizeEvent(event)
        self._fill()

    def minimumSizeHint(self) -> QSize:
        """Cut the sentence rather than be wider than there is room."""
        return QSize(0, self.height())


def _together(words: str) -> str:
    """Let no line end between a number and what it counts."""
    return words.replace(": ", ":\u00a0").replace(" %", "\u00a0%")


def _picture(state: ShotsState) -> object:
    return state.rows[0].thumbnail if state.rows else None


class ShotsSheet(Sheet):
    """All photos taken here, the last one first."""

    def __init__(
        self, host: QWidget, remove: Callable[[str], None], mirror: Callable[[bool], None]
    ) -> None:
        super().__init__(host, _TITLE, _WIDTH, "right")
        self._remove = remove
        self._state: ShotsState | None = None
        self._pictures: tuple[int, ...] = ()
        inside = QWidget()
        self._column = column(into=inside, gap=8, margins=(0, 0, 16, 0))
        self.mirrored = Toggle(tr("Mirrored"), do=mirror)
        self.mirrored.setToolTip(tr("For new photos whose background is not found here"))
        self.body.addWidget(self.mirrored)
        self.body.addWidget(Scroll(inside), 1)

    def show_shots(self, state: ShotsState) -> None:
        """Show the list."""
        self.mirrored.setChecked(state.mirrored)
        pictures = tuple(id(shot.thumbnail) for shot in state.rows)
        if state == self._state and pictures == self._pictures:
            return
        self._state, self._pictures = state, pictures
        clear(self._column)
        lines = [self._line(shot) for shot in state.rows] or [Empty(_EMPTY)]
        add(self._column, *_compared(state), *lines, ...)

    def _line(self, shot: ShotRow) -> QWidget:
        frame = PictureLine(shot.name, shot.thumbnail, _PICTURE, raised=shot.new)
        frame.setAccessibleName(f"{shot.sentence}. {shot.detail}")
        icon = Icon(shot.icon, 20, "ok" if shot.inside else "text")
        sentence = Text(shot.sentence, 14, 600, wrap=True)
        face = Text(_together(shot.face), 14, wrap=True)
        detail = Text(_together(shot.detail), 12, role="dim", wrap=True)
        add(frame.words, row((icon, 0, _TOP), (sentence, 1), gap=8), face, detail, ...)
        face.setVisible(bool(shot.face))
        remove = IconButton(
            "trash", tr("Remove {name}", name=shot.name), kind="quiet", size="small"
        )
        remove.clicked.connect(lambda: self._remove(shot.key))
        frame.row.addWidget(remove, 0, _TOP)
        return frame


def _compared(state: ShotsState) -> list[QLayout]:
    """The last two photos of a style, side by side."""
    pictures = []
    for tag, shot in ((tr("Before"), state.before), (tr("After"), state.after)):
        if shot is not None:
            picture = Picture(tag)
            picture.setFixedHeight(px(_COMPARED))
            picture.set_picture(shot.thumbnail)
            picture.set_tag(tag)
            pictures.append((picture, 1))
    return [row(*pictures, gap=8)] if pictures else []


_TOP: Final = Qt.AlignmentFlag.AlignTop


_RADIUS: Final = 8
_INSET: Final = 12
_DIM: Final = 0.42


class Well(PaintedWidget):
    """Shows an array that has its own size in device pixels already."""

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

        `picture`, (h, w, 3) uint8 or None: sRGB; not to be written to afterwards.
        """
        if picture is not self.picture:
            self.picture = None if picture is None else np.ascontiguousarray(picture)
            self.update()

    def set_words(self, tag: str, message: str, brief: str, dim: bool) -> None:
        """Write on the picture; `brief`: the message where there is little room."""
        if (tag, message, dim) != (self._tag, self.message, self.dim):
            self._tag, self.message, self._brief, self.dim = tag, message, brief, dim
            self.setAccessibleDescription(f"{tag} {message}".strip())
            self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint picture, words and edge."""
        painter.fillRect(self.rect(), t.c.well)
        self._paint_picture(painter)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if self._tag:
            inset = px(_INSET)
            draw_tag(painter, inset, inset, self._tag, "tl", t.c.tag, t.c.ontag)
        if self.message:
            self._paint_message(painter)
        # Covered: clipping to a round shape would leave the corners jagged.
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
        # Where the picture is small, smaller letters, and then fewer words.
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


LEAST_HEIGHT: Final = 136
"""In less the pictures cannot be read, logical pixels."""

_FLAT: Final = 1.9  # wider than this, the words stand beside the picture
_ROOMY: Final = 184  # from this height on there is room for a note
_NAMES: Final = {
    "sitter": (tr("At the sitter"), tr("The camera looks at the sitter")),
    "me": (tr("At me"), tr("The camera looks at me, the photographer")),
}


class _Answer(Pressable):
    """One of the two pictures: seen from above, who stands where and which way the camera looks."""

    def __init__(self, looks: Literal["sitter", "me"]) -> None:
        super().__init__(_NAMES[looks][1])
        self._looks = looks

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        down = self.isDown()
        edge = selected_edge(t) if down or self.hovered() else t.line_width
        fill = hover_fill(t) if down or self.hovered() else t.c.panel
        box(painter, self.rect(), px(8), fill, t.c.ctl, edge)
        line, gap = px(24), px(8)
        inside = QRectF(self.rect()).adjusted(gap, gap, -gap, -gap)
        if inside.width() > _FLAT * inside.height():
            words = QRectF(inside)
            words.setLeft(inside.left() + 0.6 * inside.width())
            inside.setRight(words.left())
        else:
            words = QRectF(inside.left(), inside.bottom() - line, inside.width(), line)
            inside.setBottom(words.top())
        put_text(painter, words, _NAMES[self._looks][0], t.font(14, 600), t.c.text, MIDDLE)
        self._paint_scene(painter, inside)

    def _paint_scene(self, painter: QPainter, area: QRectF) -> None:
        """From left to right: photographer, camera in their hands, sitter."""
        t = theme()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        unit = min(area.width() / 150.0, area.height() / 84.0)
        middle = area.center().y()
        left = area.center().x() - 75.0 * unit
        me, camera, sitter = (QPointF(left + x * unit, middle - 6 * unit) for x in (22, 66, 126))
        way = 1.0 if self._looks == "sitter" else -1.0
        self._paint_cone(painter, camera, way, (48.0 if way > 0 else 32.0) * unit, unit)
        _paint_head(painter, me, 1.0, unit, t.c.text)
        _paint_head(painter, sitter, -1.0, unit, t.c.text)
        _paint_camera(painter, camera, way, unit, t.c.text, t.c.panel)
        font, under = t.font(12), middle + 20 * unit
        for place, words in ((me, tr("you")), (sitter, tr("sitter"))):
            spot = QRectF(place.x() - 32 * unit, under, 64 * unit, px(16))
            put_text(painter, spot, words, font, t.c.dim, MIDDLE)

    @staticmethod
    def _paint_cone(painter: QPainter, tip: QPointF, way: float, reach: float, unit: float) -> None:
        wide = reach * 0.52
        start = tip + QPointF(6.0 * unit * way, 0.0)
        far = start + QPointF(reach * way, 0.0)
        cone = QPolygonF([start, far - QPointF(0.0, wide), far + QPointF(0.0, wide)])
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(faint(theme().c.text, 0.22))
        painter.drawPolygon(cone)


def _paint_head(painter: QPainter, at: QPointF, way: float, unit: float, ink: QColor) -> None:
    """Paint a head from above, its nose pointing the way it faces."""
    pen = QPen(ink, 1.75 * max(unit, 0.8))
    pen.setJoinStyle(Qt.PenJoinStyle.RoundJoin)
    painter.setPen(pen)
    painter.setBrush(theme().c.panel)
    radius = 13.0 * unit
    tip = at + QPointF((radius + 5.0 * unit) * way, 0.0)
    root = [at + QPointF(radius * 0.8 * way, side * 5.0 * unit) for side in (-1.0, 1.0)]
    painter.drawPolygon(QPolygonF([root[0], tip, root[1]]))
    painter.drawEllipse(at, radius, radius)


def _paint_camera(
    painter: QPainter, at: QPointF, way: float, unit: float, ink: QColor, ground: QColor
) -> None:
    """Paint a camera from above, its lens on the side it looks to."""
    painter.setPen(QPen(ink, 1.75 * max(unit, 0.8)))
    painter.setBrush(ground)
    lens = QRectF(0, 0, 6.0 * unit, 9.0 * unit)
    lens.moveCenter(at + QPointF(6.0 * unit * way, 0.0))
    painter.drawRect(lens)
    body = QRectF(0, 0, 9.0 * unit, 20.0 * unit)
    body.moveCenter(at)
    painter.setBrush(ink)
    painter.drawRoundedRect(body, 2.0 * unit, 2.0 * unit)


class StandQuestion(PaintedWidget):
    """The question with its two answers."""

    def __init__(self, parent: QWidget, take: Callable[[str], None]) -> None:
        super().__init__(parent)
        title = Text(tr("Which way does this camera look?"), 16, 600, elide=True)
        self._note = Text(
            tr("Asked only once. Change it later in Settings."), 12, role="dim", elide=True
        )
        grow = QSizePolicy.Policy.Expanding
        self.answers: dict[str, Pressable] = {"sitter": _Answer("sitter"), "me": _Answer("me")}
        for looks, answer in self.answers.items():
            answer.setSizePolicy(grow, grow)
            answer.clicked.connect(lambda _on=False, looks=looks: take(looks))
        answers = row(*((answer, 1) for answer in self.answers.values()), gap=8)
        column(*(title, self._note, 4, (answers, 1)), into=self, gap=2, margins=(16, 10, 16, 12))
        self.setAccessibleName(tr("Which way does this camera look?"))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave the note out where there is little room."""
        super().resizeEvent(event)
        self._note.setVisible(self.height() >= px(_ROOMY))

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Cover the picture underneath."""
        painter.fillRect(self.rect(), t.c.bg)
        box(painter, self.rect(), px(8), t.c.bg, t.c.ctl, t.line_width)
