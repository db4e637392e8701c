"""One of a few: parts side by side, of which exactly one is chosen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

from PySide6.QtCore import QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QButtonGroup, QHBoxLayout, QSizePolicy, QWidget

from app.ui.theme import theme
from app.ui.widgets.buttons import Pressable
from app.ui.widgets.paint import MIDDLE, box, hover_fill, put_text, selected_edge, text_width
from app.ui.widgets.tips import describe

if TYPE_CHECKING:
    from collections.abc import Sequence

Item: TypeAlias = "tuple[str, str] | tuple[str, str, str]"

_INSET: Final = 3
_PADDING: Final = 12
_BACK: Final = frozenset({Qt.Key.Key_Left, Qt.Key.Key_Up})
_ON: Final = frozenset({Qt.Key.Key_Right, Qt.Key.Key_Down})


class _Part(Pressable):
    """One of the parts."""

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
        """Give the size as designed."""
        t = theme()
        # The chosen part is bolder; none may change its width when it is chosen.
        width = max(text_width(t.font(14, 600), self.text()), text_width(t.font(12), self.second))
        height = 48 if self.second else 32
        return QSize(width + 2 * t.px(_PADDING), t.px(height))

    def minimumSizeHint(self) -> QSize:
        """Give the smallest useful size: the words whole, with less around them."""
        t, full = theme(), self.sizeHint()
        # Half of the padding, and what a wider edge takes.
        return full - QSize(t.px(_PADDING), 2 * (t.line_width - 1))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Say in a tool tip what is cut off."""
        super().resizeEvent(event)
        cut = self.width() < self.minimumSizeHint().width()
        describe(self, self.accessibleName(), tip=None if cut else "")

    def focus_shape(self) -> tuple[QRect, int]:
        """Give what the focus ring goes around."""
        return self.rect(), theme().px(5)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        painter = QPainter(self)
        ink, second_ink = t.c.dim, t.c.dim
        if self.isChecked():
            ink = t.c.panel if t.contrast else t.c.text
            second_ink = ink if t.contrast else t.c.dim
            fill = t.c.text if t.contrast else t.c.raised
            width = selected_edge(t) if self.isDown() else t.line_width
            edge = t.c.ctl if self.isEnabled() else t.c.line
            box(painter, self.rect(), t.px(5), fill, edge, width)
        elif self.isDown():
            box(painter, self.rect(), t.px(5), hover_fill(t), t.c.ctl, selected_edge(t))
        elif self.hovered():
            box(painter, self.rect(), t.px(5), hover_fill(t))
        if not self.isEnabled():
            ink = second_ink = t.c.dis
        font = t.font(14, 600 if self.isChecked() else 400)
        area = QRectF(self.rect())
        if not self.second:
            put_text(painter, area, self.text(), font, ink, MIDDLE)
            return
        first = QRectF(0, area.height() / 2 - t.px(19), area.width(), t.px(20))
        below = QRectF(0, first.bottom(), area.width(), t.px(16))
        put_text(painter, first, self.text(), font, ink, MIDDLE)
        put_text(painter, below, self.second, t.font(12), second_ink, MIDDLE)


class Segmented(QWidget):
    """A choice of one among a few, one stop for Tab; arrows move inside it.

    Parameters
    ----------
    items : sequence of (key, text) or (key, text, second line)
        The parts, from left to right; the first one is chosen.
    equal : bool, optional
        Whether all parts are equally wide and fill the width there is; otherwise each is as
        wide as its words.
    """

    chosen = Signal(str)

    def __init__(self, items: Sequence[Item], name: str = "", equal: bool = False) -> None:
        super().__init__()
        t = theme()
        self.setAccessibleName(name)
        self._group = QButtonGroup(self)
        self._parts: dict[str, _Part] = {}
        inset = t.px(_INSET) + t.line_width
        row = QHBoxLayout(self)
        row.setContentsMargins(inset, inset, inset, inset)
        row.setSpacing(0)
        for key, text, *rest in items:
            part = _Part(text, rest[0] if rest else "")
            part.clicked.connect(lambda _on=False, key=key: self.chosen.emit(key))
            self._parts[key] = part
            self._group.addButton(part)
            row.addWidget(part, 1 if equal else 0)
        across = QSizePolicy.Policy.Expanding if equal else QSizePolicy.Policy.Fixed
        self.setSizePolicy(across, QSizePolicy.Policy.Fixed)
        self.setFixedHeight(t.px(56 if any(p.second for p in self._parts.values()) else 40))
        self.choose(next(iter(self._parts)))

    @property
    def key(self) -> str:
        """Key of the part that is chosen."""
        return next(key for key, part in self._parts.items() if part.isChecked())

    def choose(self, key: str) -> None:
        """Choose a part without telling anybody.

        Raises
        ------
        KeyError
            When there is no such part.
        """
        self._parts[key].setChecked(True)
        for other, part in self._parts.items():
            alone = other == key
            part.setFocusPolicy(Qt.FocusPolicy.StrongFocus if alone else Qt.FocusPolicy.ClickFocus)

    def set_text(self, key: str, text: str, second: str | None = None) -> None:
        """Change the words of a part.

        Parameters
        ----------
        second : str, optional
            New second line; None keeps the old one.
        """
        part = self._parts[key]
        words = part.second if second is None else second
        if (part.text(), part.second) != (text, words):
            part.set_words(text, words)

    def part(self, key: str) -> Pressable:
        """Give the button of a part, for example to disable it."""
        return self._parts[key]

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Arrows choose the neighbour, Home and End the first and the last."""
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

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        fill = t.c.panel if t.contrast else None
        edge = t.c.ctl if self.isEnabled() else t.c.line
        box(QPainter(self), self.rect(), t.px(8), fill, edge, t.line_width)
