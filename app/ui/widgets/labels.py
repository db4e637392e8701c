"""Icons, signs, key hints, and text set with the line heights of the design."""

from __future__ import annotations

from typing import Final, Literal, TypeAlias

from PySide6.QtCore import QEvent, QPointF, QRect, QRectF, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QFontMetricsF,
    QPainter,
    QPaintEvent,
    QResizeEvent,
    QTextLayout,
    QTextOption,
)
from PySide6.QtWidgets import QLabel, QSizePolicy

from app.core.base.visible_text import visible
from app.core.text import tr
from app.ui.theme import Theme, px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.paint import MIDDLE, PaintedWidget, box, pen, put_text, text_width

_HEIGHT: Final = 20
_PADDING: Final = 7
_GAP: Final = 8


class KeyHint(PaintedWidget):
    """A key in a frame, followed by a description of its effect."""

    def __init__(self, keys: str, words: str) -> None:
        super().__init__()
        self._keys, self._words = keys, words
        self._column = 0
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._describe()

    def set(self, keys: str, words: str) -> None:
        """Change the key and the text."""
        if (keys, words) != (self._keys, self._words):
            self._keys, self._words = keys, words
            self._describe()
            self.updateGeometry()
            self.update()

    def _describe(self) -> None:
        self.setAccessibleName(f"{self._keys}: {self._words}")

    def align(self, column: int) -> None:
        """Align the text with the text of the hints above and below."""
        self._column = column
        self.updateGeometry()
        self.update()

    def cap(self) -> int:
        """Return the width of the framed key in logical pixels."""
        t = theme()
        return max(text_width(t.font(12, 600), self._keys) + 2 * px(_PADDING), px(_HEIGHT))

    def sizeHint(self) -> QSize:
        """Return the size required by the key and the text."""
        t = theme()
        words = text_width(t.font(12), self._words) + px(_GAP) if self._words else 0
        return QSize(max(self.cap(), self._column) + words, px(_HEIGHT))

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the hint in the current theme."""
        cap = QRectF(0, 0, self.cap(), self.height())
        box(painter, cap, px(4), None, t.c.ctl, t.line_width)
        put_text(painter, cap, self._keys, t.font(12, 600), t.c.text, MIDDLE)
        left = max(cap.right(), self._column) + px(_GAP)
        rest = QRectF(left, 0, self.width() - left, self.height())
        put_text(painter, rest, self._words, t.font(12), t.c.dim)


class Icon(PaintedWidget):
    """A decorative icon beside text that has the same meaning."""

    def __init__(self, name: str, size: int = 20, role: Role = "text", says: str = "") -> None:
        super().__init__()
        self.name = name
        self._role: Role = role
        self._side = px(size)
        self.setAccessibleName(says)
        self.setToolTip(says)
        self.setFixedSize(self._side, self._side)

    def set(self, name: str, role: Role | None = None) -> None:
        """Change the icon. Its colour role also changes unless `role` is None."""
        if (name, role or self._role) != (self.name, self._role):
            self.name, self._role = name, role or self._role
            self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the icon in the current theme."""
        c = t.c
        own: QColor = getattr(c, self._role)
        colour = own if self.isEnabled() else c.dis
        draw_icon(painter, self.name, self.rect(), self._side, colour)


def draw_sign(painter: QPainter, rect: QRect | QRectF, sign: Literal["plus", "minus"]) -> None:
    """Paint a black plus sign on orange, or a black minus sign on blue."""
    area = QRectF(rect)
    box(painter, area, area.width() / 5, getattr(theme().c, sign))
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(pen(Qt.GlobalColor.black, area.width() / 9, ends="round"))
    middle, arm = area.center(), area.width() / 5
    painter.drawLine(middle - QPointF(arm, 0), middle + QPointF(arm, 0))
    if sign == "plus":
        painter.drawLine(middle - QPointF(0, arm), middle + QPointF(0, arm))
    painter.restore()


_SIGNS: Final = {"plus": tr("plus"), "minus": tr("minus")}


class Sign(PaintedWidget):
    """The plus or minus sign of a weight, shown before an explanation of the weight."""

    def __init__(self, sign: Literal["plus", "minus"], size: int = 16) -> None:
        super().__init__()
        self._sign: Literal["plus", "minus"] = sign
        side = px(size)
        self.setFixedSize(side, side)
        self.setAccessibleName(_SIGNS[sign])

    def paint_on(self, painter: QPainter, _t: Theme) -> None:
        """Paint the sign."""
        draw_sign(painter, self.rect(), self._sign)


Role: TypeAlias = Literal["text", "dim", "amber", "onamber", "ok", "err"]
"""Roles that text can have, each with its own colour."""

_SHORTEST_WRAP: Final = 96
_WIDTHS: Final = 6  # number of widths whose line breaks are cached
_FLUSH_FROM: Final = 28  # font size from which the first figure's own margin is visible


_RIGHT: Final = Qt.TextElideMode.ElideRight


class Text(QLabel):
    """A text of one or more lines, in the colour of a role.

    With `elide`, the text may be given less space than it needs. The text is then cut off with "…",
    and the tooltip shows it in full.
    """

    def __init__(
        self,
        text: str = "",
        size: int = 14,
        weight: int = 400,
        role: Role = "text",
        wrap: bool = False,
        elide: bool = False,
        align: Qt.AlignmentFlag = Qt.AlignmentFlag.AlignLeft,
    ) -> None:
        super().__init__(visible(text))
        t = theme()
        self._line = t.line_height(size)
        self._flush = size >= _FLUSH_FROM and align == Qt.AlignmentFlag.AlignLeft
        self._role: Role = role
        self._elide = elide
        self._cut = False
        self._align = align
        self._lines: dict[int, list[str]] = {}
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setFont(t.font(size, weight))
        self.setWordWrap(wrap)
        across = QSizePolicy.Policy.Preferred
        self.setSizePolicy(across, QSizePolicy.Policy.Preferred if wrap else across.Fixed)
        if wrap:
            policy = self.sizePolicy()
            policy.setHeightForWidth(True)
            self.setSizePolicy(policy)

    def set_text(self, text: str) -> None:
        """Change the text."""
        text = visible(text)
        if text != self.text():
            self._lines.clear()
            self.setText(text)
            self._show_whole()
            self.updateGeometry()

    def say(self, text: str) -> None:
        """Change the text, and hide the label if the text is empty."""
        self.set_text(text)
        self.setVisible(bool(text))

    def set_role(self, role: Role) -> None:
        """Change the colour role."""
        if role != self._role:
            self._role = role
            self.update()

    def colour(self) -> QColor:
        """Return the current colour."""
        c = theme().c
        own: QColor = getattr(c, self._role)
        return own if self.isEnabled() else c.dis

    def _broken(self, width: int) -> list[str]:
        """Break the text into lines that fit a width."""
        # Layouts try several widths repeatedly.
        if width not in self._lines:
            if len(self._lines) == _WIDTHS:
                self._lines.clear()
            parts = self.text().split("\n")
            self._lines[width] = [line for part in parts for line in self._fit(part, width)]
        return self._lines[width]

    def _fit(self, part: str, width: int) -> list[str]:
        if not self.wordWrap() or not part:
            return [part]
        layout = QTextLayout(part, self.font())
        option = QTextOption()
        option.setWrapMode(QTextOption.WrapMode.WrapAtWordBoundaryOrAnywhere)
        layout.setTextOption(option)
        layout.beginLayout()
        lines = []
        while (line := layout.createLine()).isValid():
            line.setLineWidth(max(1, width))
            start = line.textStart()
            lines.append(part[start : start + line.textLength()].rstrip())
        layout.endLayout()
        return lines

    def sizeHint(self) -> QSize:
        """Return the size that the text would have without wrapping."""
        parts = self.text().split("\n")
        width = max(text_width(self.font(), part) for part in parts)
        return QSize(width, self._line * len(parts))

    def minimumSizeHint(self) -> QSize:
        """Return the smallest size that wrapping or eliding the text allows."""
        full = self.sizeHint()
        if self.wordWrap():
            return QSize(min(full.width(), px(_SHORTEST_WRAP)), self._line)
        return QSize(min(full.width(), px(24)), full.height()) if self._elide else full

    def hasHeightForWidth(self) -> bool:
        """Return whether the height depends on the width, as is the case for wrapped text."""
        return self.wordWrap()

    def heightForWidth(self, width: int) -> int:
        """Return the height of all lines at a given width."""
        return self._line * len(self._broken(width)) if self.wordWrap() else -1

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Break the text into lines again for the new size."""
        super().resizeEvent(event)
        self._show_whole()

    def _show_whole(self) -> None:
        cut = self._elide and self.width() < self.sizeHint().width()
        if self.wordWrap():
            cut = self._line <= self.height() < self.heightForWidth(self.width())
        if cut or self._cut:
            self.setToolTip(self.text() if cut else "")
        self._cut = cut

    def changeEvent(self, event: QEvent) -> None:
        """Update the text after a change of state or font."""
        if event.type() == QEvent.Type.FontChange:
            self._lines.clear()
        super().changeEvent(event)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint the text in the current theme."""
        painter = QPainter(self)
        painter.setFont(self.font())
        painter.setPen(self.colour())
        metrics = QFontMetricsF(self.font())
        lines = self._broken(self.width())
        if self._cut and self.wordWrap():
            # The rest of the text is appended to the last visible line and cut there.
            last = self.height() // self._line - 1
            rest = metrics.elidedText(" ".join(lines[last:]), _RIGHT, self.width() + 0.5)
            lines = [*lines[:last], rest]
        top = (self.height() - self._line * len(lines)) / 2
        if self.wordWrap() or self.alignment() & Qt.AlignmentFlag.AlignTop:
            top = 0.0
        flags = int(self._align | Qt.AlignmentFlag.AlignVCenter | Qt.TextFlag.TextSingleLine)
        width = self.width()
        for number, line in enumerate(lines):
            elided = line
            if self._elide:
                elided = metrics.elidedText(line, _RIGHT, width + 0.5)
            left = -metrics.tightBoundingRect(line[:1]).left() if self._flush and line else 0.0
            area = QRectF(left, top + number * self._line, width, self._line)
            painter.drawText(area, flags, elided)
