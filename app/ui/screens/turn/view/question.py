"""Which way does the camera look? Asked once, with two drawn pictures over the live well."""

from __future__ import annotations

from typing import Final, Literal

from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF, QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QSizePolicy, QVBoxLayout, QWidget

from app.ui.theme import theme
from app.ui.widgets.buttons import Pressable
from app.ui.widgets.labels import Text
from app.ui.widgets.paint import MIDDLE, box, hover_fill, put_text, selected_edge

LEAST_HEIGHT: Final = 136
"""In less the pictures cannot be read, logical pixels."""

_FLAT: Final = 1.9  # wider than this, the words stand beside the picture
_ROOMY: Final = 184  # from this height on there is room for a note
_NAMES: Final = {
    "sitter": ("At the sitter", "The camera looks at the sitter"),
    "me": ("At me", "The camera looks at me, the photographer"),
}


class _Answer(Pressable):
    """One of the two pictures: seen from above, who stands where and which way the camera looks."""

    def __init__(self, looks: Literal["sitter", "me"]) -> None:
        super().__init__(_NAMES[looks][1])
        self._looks = looks

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        painter = QPainter(self)
        down = self.isDown()
        edge = selected_edge(t) if down or self.hovered() else t.line_width
        fill = hover_fill(t) if down or self.hovered() else t.c.panel
        box(painter, self.rect(), t.px(8), fill, t.c.ctl, edge)
        line, gap = t.px(24), t.px(8)
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
        for place, words in ((me, "you"), (sitter, "sitter")):
            spot = QRectF(place.x() - 32 * unit, under, 64 * unit, t.px(16))
            put_text(painter, spot, words, font, t.c.dim, MIDDLE)

    @staticmethod
    def _paint_cone(painter: QPainter, tip: QPointF, way: float, reach: float, unit: float) -> None:
        shade = QColor(theme().c.text)
        shade.setAlphaF(0.22)
        wide = reach * 0.52
        start = tip + QPointF(6.0 * unit * way, 0.0)
        far = start + QPointF(reach * way, 0.0)
        cone = QPolygonF([start, far - QPointF(0.0, wide), far + QPointF(0.0, wide)])
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(shade)
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


class Question(QWidget):
    """The question with its two answers."""

    answered = Signal(str)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        t = theme()
        title = Text("Which way does this camera look?", 16, 600, elide=True)
        self._note = Text("Asked once. The settings change it.", 12, role="dim", elide=True)
        column = QVBoxLayout(self)
        column.setContentsMargins(t.px(16), t.px(10), t.px(16), t.px(12))
        column.setSpacing(t.px(2))
        column.addWidget(title)
        column.addWidget(self._note)
        column.addSpacing(t.px(4))
        row = QHBoxLayout()
        row.setSpacing(t.px(8))
        grow = QSizePolicy.Policy.Expanding
        self.answers: dict[str, Pressable] = {}
        for looks in ("sitter", "me"):
            answer = _Answer(looks)
            answer.setSizePolicy(grow, grow)
            answer.clicked.connect(lambda _on=False, looks=looks: self.answered.emit(looks))
            self.answers[looks] = answer
            row.addWidget(answer, 1)
        column.addLayout(row, 1)
        self.setAccessibleName("Which way does this camera look?")

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave the note out where there is little room."""
        super().resizeEvent(event)
        self._note.setVisible(self.height() >= theme().px(_ROOMY))

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Cover the picture underneath."""
        t = theme()
        painter = QPainter(self)
        painter.fillRect(self.rect(), t.c.bg)
        box(painter, self.rect(), t.px(8), t.c.bg, t.c.ctl, t.line_width)
