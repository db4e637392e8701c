"""The reason below the portraits, and the outlines of the areas in the portraits."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QEvent, QPointF, QRectF, Signal
from PySide6.QtGui import QColor, QEnterEvent, QPainter, QPolygonF
from PySide6.QtWidgets import QWidget

from app.core.base.arrays import Float64
from app.core.text import tr
from app.ui.screens.styles.reason.reason import NO_REASON, AreaMark, ReasonState
from app.ui.theme import Theme, px
from app.ui.widgets.buttons import IconButton
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column
from app.ui.widgets.paint import draw_tag, faint, pen, tag_size

_LINE: Final = 1.5
_CASING: Final = 3.5
_OPACITY: Final = 0.75
_GAP: Final = 4


class MarkedPicture(Picture):
    """A portrait that can show the areas of the face that a style compares."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._marks: tuple[AreaMark, ...] = ()
        self._labelled = False

    def set_marks(self, marks: tuple[AreaMark, ...], *, labelled: bool = False) -> None:
        """Show the outlines of areas, with or without their labels."""
        if marks is not self._marks or labelled != self._labelled:
            self._marks, self._labelled = marks, labelled
            self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the portrait, and the outlines over it."""
        super().paint_on(painter, t)
        if self._array is None or not self._marks:
            return
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        shapes = [[self._polygon(loop) for loop in mark.loops] for mark in self._marks]
        casing = pen(faint(t.c.tag, _OPACITY), px(_CASING), ends="round")
        for mark, polygons in zip(self._marks, shapes, strict=True):
            for line in (casing, pen(_ink(mark, t), px(_LINE), ends="round")):
                painter.setPen(line)
                for polygon in polygons:
                    painter.drawPolygon(polygon)
        painter.restore()
        if self._labelled:
            self._paint_labels(painter, t, [polygons[0].boundingRect() for polygons in shapes])

    def _paint_labels(self, painter: QPainter, t: Theme, areas: list[QRectF]) -> None:
        for mark, label in zip(self._marks, self._label_places(areas), strict=True):
            draw_tag(painter, label.left(), label.top(), mark.label, ink=_ink(mark, t))

    def _label_places(self, areas: list[QRectF]) -> list[QRectF]:
        """Place the label of each area beside it, towards the nearer edge of the portrait."""
        pairs = zip(self._marks, areas, strict=True)
        labels = [self._beside(mark.label, area) for mark, area in pairs]
        if len(labels) > 1 and labels[0].intersects(labels[1]):
            upper, lower = sorted(labels, key=lambda label: label.center().y())
            overlap = upper.bottom() - lower.top() + px(_GAP)
            upper.translate(0, -overlap / 2)
            lower.translate(0, overlap / 2)
        return labels

    def _beside(self, label: str, area: QRectF) -> QRectF:
        wide, high = tag_size(label)
        # The exposure is in the upper right corner.
        left = area.center().x() <= self.width() / 2 + px(1)
        x = area.left() - px(_GAP) - wide if left else area.right() + px(_GAP)
        x = min(max(x, 0.0), float(self.width() - wide))
        return QRectF(x, area.center().y() - high / 2, wide, high)

    def _polygon(self, loop: Float64) -> QPolygonF:
        """Convert fractions of the picture, which is cropped to fill the widget, to its pixels."""
        assert self._array is not None
        rows, columns = self._array.shape[:2]
        scale = max(self.width() / columns, self.height() / rows)
        left, top = (self.width() - scale * columns) / 2, (self.height() - scale * rows) / 2
        corners = loop * [scale * columns, scale * rows] + [left, top]
        return QPolygonF([QPointF(x, y) for x, y in corners.tolist()])


def _ink(mark: AreaMark, t: Theme) -> QColor:
    """Return the colour for an area where more light helps, or for one where it hurts."""
    return t.c.plus if mark.helps else t.c.minus


class ReasonBlock(QWidget):
    """The sentences of a reason.

    Attributes:
        eye: Button that shows the areas on the face. It is placed by the owner.
    """

    marked = Signal(bool)
    """Emitted when the areas should appear in the portraits, or disappear."""

    def __init__(self) -> None:
        super().__init__()
        self._text = Text("", 12, wrap=True)
        self._state = NO_REASON
        self.eye = IconButton("eye", tr("Show on face"), checkable=True, size="small")
        self.eye.toggled.connect(self._tell)
        self.eye.hide()
        column(self._text, into=self)
        self.hide()

    def show_state(self, state: ReasonState) -> bool:
        """Show a reason, and return whether the block may need another height."""
        if state is self._state:
            return False
        before, self._state = self._text.text(), state
        self._text.set_text(state.words)
        self.eye.setVisible(bool(state.marks))
        self.setVisible(bool(state.words))
        self._tell()
        return before != self._text.text()

    def enterEvent(self, event: QEnterEvent) -> None:
        """Show the areas while the mouse is over the reason."""
        super().enterEvent(event)
        self._tell()

    def leaveEvent(self, event: QEvent) -> None:
        """Hide the areas again, unless the button keeps them."""
        super().leaveEvent(event)
        self._tell()

    def _tell(self) -> None:
        self.marked.emit(self.eye.isChecked() or self.underMouse())
