"""A control with a few options side by side, and a slider that shows its value as text."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final, TypeAlias

from PySide6.QtCore import QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPainter, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QButtonGroup, QSizePolicy, QSlider

from app.ui.theme import Theme, px, theme
from app.ui.widgets.accessibility import describe
from app.ui.widgets.buttons import Do, Pressable
from app.ui.widgets.layouts import row
from app.ui.widgets.paint import (
    MIDDLE,
    RIGHT,
    PaintedWidget,
    Paints,
    box,
    hover_fill,
    put_text,
    selected_edge,
    text_width,
)

_RAIL: Final = 4
_KNOB: Final = 16
_HIT: Final = 32
_LABEL: Final = 20
_CENTRE: Final = 30
_GAP: Final = 8
_WHEEL_STEP: Final = 120
_DOWN: Final = frozenset({Qt.Key.Key_Left, Qt.Key.Key_Down})
_UP: Final = frozenset({Qt.Key.Key_Right, Qt.Key.Key_Up})
_FAST: Final = 10


class LabelledSlider(Paints, QSlider):
    """A slider whose label and value are above the track or beside it.

    The wheel and the arrow keys move the knob by one step, and Page Up and Page Down by ten. Home
    and End move it to the ends, and a double click restores the default.

    Raises:
        ValueError: If the limits and the step leave no values to choose from.
    """

    changed = Signal(float)
    settled = Signal(float)

    def __init__(
        self,
        name: str,
        minimum: float,
        maximum: float,
        value: float,
        step: float,
        words: Callable[[float], str],
        default: float | None = None,
        inline: bool = False,
    ) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        if not (minimum < maximum and 0 < step <= maximum - minimum):
            raise ValueError(f"no values between {minimum} and {maximum} in steps of {step}")
        self._low, self._step, self._words = minimum, step, words
        self._default = value if default is None else default
        self._inline = inline
        self._wheel = 0
        self.setRange(0, round((maximum - minimum) / step))
        self.setAccessibleName(name)
        self.setAttribute(Qt.WidgetAttribute.WA_Hover)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        t = theme()
        self._value_width = max(text_width(t.font(14), words(v)) for v in (minimum, maximum, value))
        self.set_value(value)

    @property
    def amount(self) -> float:
        """The current value of the slider."""
        return self._low + self.value() * self._step

    def set_value(self, value: float) -> None:
        """Move the knob without emitting any signals."""
        if not self.isSliderDown() and math.isfinite(value):
            self._put(round((value - self._low) / self._step))

    def _put(self, position: int) -> bool:
        before = self.value()
        self.setValue(position)
        words = self._words(self.amount)
        self.setAccessibleDescription(words)
        self._value_width = max(self._value_width, text_width(theme().font(14), words))
        return self.value() != before

    def _move(self, position: int, settle: bool = True) -> None:
        """Move the knob on behalf of the user, and emit the signals."""
        if self._put(position):
            self.changed.emit(self.amount)
            if settle:
                self.settled.emit(self.amount)

    def reset(self) -> None:
        """Restore the default and emit `changed`."""
        self._move(round((self._default - self._low) / self._step))

    def sizeHint(self) -> QSize:
        """Return the size required by the label, the track and the value."""
        label = text_width(theme().font(14), self.accessibleName())
        if self._inline:
            return QSize(label + self._value_width + px(168), px(_HIT))
        return QSize(max(label + self._value_width + px(_GAP), px(120)), px(44))

    def minimumSizeHint(self) -> QSize:
        """Return the smallest useful size. A label above the track may be cut off at that size."""
        hint = self.sizeHint()
        return QSize(hint.width() - px(88) if self._inline else px(120), hint.height())

    def _rail(self) -> QRectF:
        """Return the rectangle of the track along which the knob moves."""
        t = theme()
        left, right = 0.0, float(self.width())
        if self._inline:
            left = text_width(t.font(14), self.accessibleName()) + px(_GAP)
            right -= self._value_width + px(_GAP)
        middle = self.height() / 2 if self._inline else px(_CENTRE)
        return QRectF(left, middle - px(_RAIL) / 2, max(right - left, 1.0), px(_RAIL))

    def _knob(self) -> QRectF:
        rail, side = self._rail(), float(px(_KNOB))
        share = self.value() / self.maximum()
        left = rail.left() + share * (rail.width() - side)
        return QRectF(left, rail.center().y() - side / 2, side, side)

    def focus_shape(self) -> tuple[QRect, int]:
        """Return the rectangle of the knob, because the keys move the knob."""
        knob = self._knob().toAlignedRect()
        return knob, knob.height() // 2

    def _position_at(self, x: float) -> int:
        rail, side = self._rail(), px(_KNOB)
        share = (x - rail.left() - side / 2) / max(rail.width() - side, 1.0)
        return round(min(max(share, 0.0), 1.0) * self.maximum())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Grab the knob, or move it to the point on the track that was pressed."""
        rail, reach = self._rail(), px(_HIT) / 2
        here = event.position()
        outside = abs(here.y() - rail.center().y()) > reach
        if event.button() != Qt.MouseButton.LeftButton or outside:
            event.ignore()
            return
        self.setSliderDown(True)
        if not self._knob().contains(here):
            self._move(self._position_at(here.x()), settle=False)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Move the knob with the mouse."""
        if self.isSliderDown():
            self._move(self._position_at(event.position().x()), settle=False)

    def mouseReleaseEvent(self, _event: QMouseEvent) -> None:
        """End the click or the drag."""
        if self.isSliderDown():
            self.setSliderDown(False)
            self.settled.emit(self.amount)

    def mouseDoubleClickEvent(self, _event: QMouseEvent) -> None:
        """Restore the default."""
        self.reset()

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Move the knob by one step per notch, adding up the partial notches of finer wheels."""
        self._wheel += event.angleDelta().y() or event.angleDelta().x()
        steps = int(self._wheel / _WHEEL_STEP)
        self._wheel -= steps * _WHEEL_STEP
        if steps:
            self._move(self.value() + steps)
        event.accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move the knob with the arrow keys, page keys, Home and End."""
        key = Qt.Key(event.key())
        fast = max(1, min(_FAST, self.maximum() // 4))
        jumps = {Qt.Key.Key_PageDown: -fast, Qt.Key.Key_PageUp: fast}
        if key in _DOWN or key in _UP:
            step = fast if event.modifiers() & Qt.KeyboardModifier.ShiftModifier else 1
            self._move(self.value() + (step if key in _UP else -step))
        elif key in jumps:
            self._move(self.value() + jumps[key])
        elif key in (Qt.Key.Key_Home, Qt.Key.Key_End):
            self._move(0 if key == Qt.Key.Key_Home else self.maximum())
        else:
            event.ignore()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the slider in the current theme."""
        on = self.isEnabled()
        top = QRectF(0, 0, self.width(), self.height() if self._inline else px(_LABEL))
        ink = t.c.text if on else t.c.dis
        label = top.adjusted(0, 0, -self._value_width - px(_GAP), 0)
        put_text(painter, label, self.accessibleName(), t.font(14), t.c.dim if on else t.c.dis)
        put_text(painter, top, self._words(self.amount), t.font(14), ink, RIGHT)
        rail, knob = self._rail(), self._knob()
        radius = rail.height() / 2
        box(painter, rail, radius, t.c.track)
        rail.setRight(knob.center().x())
        box(painter, rail, radius, ink)
        if on and (self.underMouse() or self.isSliderDown()):
            grow = px(1) * (2 if self.isSliderDown() else 1)
            knob.adjust(-grow, -grow, grow, grow)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(ink)
        painter.drawEllipse(knob)


Item: TypeAlias = "tuple[str, str] | tuple[str, str, str]"

_INSET: Final = 3
_PADDING: Final = 12
_BACK: Final = frozenset({Qt.Key.Key_Left, Qt.Key.Key_Up})
_ON: Final = frozenset({Qt.Key.Key_Right, Qt.Key.Key_Down})


class _Part(Pressable):
    """The button of one option."""

    def __init__(self, text: str, second: str) -> None:
        super().__init__(text, tip="")
        self.second = second
        self.setCheckable(True)
        self.setText(text)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Expanding)
        self._describe()

    def set_words(self, text: str, second: str) -> None:
        self.second = second
        self.setText(text)
        self._describe()
        self.updateGeometry()
        self.update()

    def _describe(self) -> None:
        describe(self, f"{self.text()}, {self.second}" if self.second else self.text(), tip="")

    def sizeHint(self) -> QSize:
        t = theme()
        # The selected option is bolder, which must not change its width.
        width = max(text_width(t.font(14, 600), self.text()), text_width(t.font(12), self.second))
        height = 48 if self.second else 32
        return QSize(width + 2 * px(_PADDING), px(height))

    def minimumSizeHint(self) -> QSize:
        """Return the size of the full text with reduced margins."""
        t, full = theme(), self.sizeHint()
        # subtract half of the padding and the extra width of the border
        return full - QSize(px(_PADDING), 2 * (t.line_width - 1))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show the full text in the tooltip if the text is cut off."""
        super().resizeEvent(event)
        cut = self.width() < self.minimumSizeHint().width()
        describe(self, self.accessibleName(), tip=None if cut else "")

    def focus_shape(self) -> tuple[QRect, int]:
        return self.rect(), px(5)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        ink, second_ink = t.c.dim, t.c.dim
        if self.isChecked():
            ink = t.c.panel if t.contrast else t.c.text
            second_ink = ink if t.contrast else t.c.dim
            fill = t.c.text if t.contrast else t.c.raised
            width = selected_edge(t) if self.isDown() else t.line_width
            edge = t.c.ctl if self.isEnabled() else t.c.line
            box(painter, self.rect(), px(5), fill, edge, width)
        elif self.isDown():
            box(painter, self.rect(), px(5), hover_fill(t), t.c.ctl, selected_edge(t))
        elif self.hovered():
            box(painter, self.rect(), px(5), hover_fill(t))
        if not self.isEnabled():
            ink = second_ink = t.c.dis
        font = t.font(14, 600 if self.isChecked() else 400)
        area = QRectF(self.rect())
        if not self.second:
            put_text(painter, area, self.text(), font, ink, MIDDLE)
            return
        first = QRectF(0, area.height() / 2 - px(19), area.width(), px(20))
        below = QRectF(0, first.bottom(), area.width(), px(16))
        put_text(painter, first, self.text(), font, ink, MIDDLE)
        put_text(painter, below, self.second, t.font(12), second_ink, MIDDLE)


class SegmentedChoice(PaintedWidget):
    """A choice of one option among a few.

    The control is a single Tab stop, and the arrow keys move the selection within it. The first
    option is selected initially.

    Args:
        items: The options, each given as (key, text) or (key, text, second line).
        equal: Whether the options all have the same width and together fill the available width.
        do: Called with the key of the selected option.
    """

    chosen = Signal(str)

    def __init__(
        self, items: Sequence[Item], name: str = "", equal: bool = False, do: Do = None
    ) -> None:
        super().__init__()
        t = theme()
        self.setAccessibleName(name)
        self._group = QButtonGroup(self)
        self._parts: dict[str, _Part] = {}
        inset = px(_INSET) + t.line_width
        parts = row(into=self)
        parts.setContentsMargins(inset, inset, inset, inset)
        for key, text, *rest in items:
            part = _Part(text, rest[0] if rest else "")
            part.clicked.connect(lambda _on=False, key=key: self.chosen.emit(key))
            self._parts[key] = part
            self._group.addButton(part)
            parts.addWidget(part, 1 if equal else 0)
        across = QSizePolicy.Policy.Expanding if equal else QSizePolicy.Policy.Fixed
        self.setSizePolicy(across, QSizePolicy.Policy.Fixed)
        self.setFixedHeight(px(56 if any(p.second for p in self._parts.values()) else 40))
        self.choose(next(iter(self._parts)))
        if do is not None:
            self.chosen.connect(do)

    @property
    def key(self) -> str:
        """Key of the selected option."""
        return next(key for key, part in self._parts.items() if part.isChecked())

    def choose(self, key: str) -> None:
        """Select an option without emitting a signal.

        Raises:
            KeyError: If there is no such option.
        """
        self._parts[key].setChecked(True)
        for other, part in self._parts.items():
            alone = other == key
            part.setFocusPolicy(Qt.FocusPolicy.StrongFocus if alone else Qt.FocusPolicy.ClickFocus)

    def set_text(self, key: str, text: str, second: str | None = None) -> None:
        """Change the text of an option. Its second line also changes unless `second` is None."""
        part = self._parts[key]
        words = part.second if second is None else second
        if (part.text(), part.second) != (text, words):
            part.set_words(text, words)

    def part(self, key: str) -> Pressable:
        """Return the button of an option, for example to disable it."""
        return self._parts[key]

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Select a neighbouring option with an arrow key, or the first or last with Home or End."""
        keys = [key for key, part in self._parts.items() if part.isEnabled()]
        here = keys.index(self.key) if self.key in keys else 0
        there = self._target(Qt.Key(event.key()), here, len(keys))
        if there is None or not keys:
            event.ignore()
            return
        if there != here:
            self.choose(keys[there])
            self._parts[keys[there]].setFocus(Qt.FocusReason.OtherFocusReason)
            self.chosen.emit(keys[there])

    @staticmethod
    def _target(key: Qt.Key, here: int, count: int) -> int | None:
        if key in _BACK:
            return max(here - 1, 0)
        if key in _ON:
            return min(here + 1, count - 1)
        return {Qt.Key.Key_Home: 0, Qt.Key.Key_End: count - 1}.get(key)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the options in the current theme."""
        edge = t.c.ctl if self.isEnabled() else t.c.line
        box(painter, self.rect(), px(8), t.c.panel, edge, t.line_width)
