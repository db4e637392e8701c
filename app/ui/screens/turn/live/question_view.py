"""The question of which way the camera faces, with a drawing for each answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Literal

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.core.text import tr
from app.ui.theme import Theme, px, theme
from app.ui.widgets.buttons import Pressable
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column, row
from app.ui.widgets.paint import (
    MIDDLE,
    PaintedWidget,
    box,
    faint,
    hover_fill,
    put_text,
    selected_edge,
)

LEAST_HEIGHT: Final = 136
"""Minimum height, in logical pixels, at which the drawings are readable."""

_FLAT: Final = 1.9  # in a wider widget the text goes beside the picture
_ROOMY: Final = 184  # minimum height with room for the note
NAMES: Final = {
    "sitter": (tr("Towards the sitter"), tr("The camera faces the sitter")),
    "me": (tr("Towards me"), tr("The camera faces me, the photographer")),
}


class _Answer(Pressable):
    """A button for one answer, showing the photographer, the camera and the sitter from above."""

    def __init__(self, looks: Literal["sitter", "me"]) -> None:
        super().__init__(NAMES[looks][1])
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
        put_text(painter, words, NAMES[self._looks][0], t.font(14, 600), t.c.text, MIDDLE)
        self._paint_scene(painter, inside)

    def _paint_scene(self, painter: QPainter, area: QRectF) -> None:
        """Paint the photographer, the camera and the sitter from left to right."""
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
    """Paint a head seen from above, with its nose pointing in the direction that the head faces."""
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
    """Paint a camera seen from above, with its lens on the side that the camera faces."""
    painter.setPen(QPen(ink, 1.75 * max(unit, 0.8)))
    painter.setBrush(ground)
    lens = QRectF(0, 0, 6.0 * unit, 9.0 * unit)
    lens.moveCenter(at + QPointF(6.0 * unit * way, 0.0))
    painter.drawRect(lens)
    body = QRectF(0, 0, 9.0 * unit, 20.0 * unit)
    body.moveCenter(at)
    painter.setBrush(ink)
    painter.drawRoundedRect(body, 2.0 * unit, 2.0 * unit)


class CameraQuestion(PaintedWidget):
    """The question of which way the camera faces, placed over the live picture."""

    def __init__(self, parent: QWidget, answer: Callable[[str], None]) -> None:
        super().__init__(parent)
        title = Text(tr("Which way is this camera facing?"), 16, 600, elide=True)
        self._note = Text(
            tr("Asked only once. Change the answer in Settings."), 12, role="dim", elide=True
        )
        grow = QSizePolicy.Policy.Expanding
        self.answers: dict[str, Pressable] = {"sitter": _Answer("sitter"), "me": _Answer("me")}
        for looks, button in self.answers.items():
            button.setSizePolicy(grow, grow)
            button.clicked.connect(lambda _on=False, looks=looks: answer(looks))
        answers = row(*((button, 1) for button in self.answers.values()), gap=8)
        column(*(title, self._note, 4, (answers, 1)), into=self, gap=2, margins=(16, 10, 16, 12))
        self.setAccessibleName(tr("Which way is this camera facing?"))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Hide the note when space is short."""
        super().resizeEvent(event)
        self._note.setVisible(self.height() >= px(_ROOMY))

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint a background that covers the picture underneath."""
        painter.fillRect(self.rect(), t.c.bg)
        box(painter, self.rect(), px(8), t.c.bg, t.c.ctl, t.line_width)
