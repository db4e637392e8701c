"""Advice with its own button, and the sentence of an empty place."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QSizePolicy, QVBoxLayout, QWidget

from app.ui.theme import theme
from app.ui.widgets.buttons import Button
from app.ui.widgets.cards import Frame
from app.ui.widgets.icons import Icon
from app.ui.widgets.labels import Role, Text

if TYPE_CHECKING:
    from collections.abc import Sequence


class Banner(Frame):
    """A framed box: icon, bold sentence, text, and buttons."""

    pressed = Signal(int)

    def __init__(
        self,
        icon: str,
        title: str,
        text: str = "",
        actions: Sequence[str] = (),
        role: Role = "text",
    ) -> None:
        super().__init__("none", "ctl")
        t = theme()
        self._icon = Icon(icon, 24, role)
        self._title = Text(title, 14, 600, wrap=True)
        self._text = Text(text, 14, role="dim", wrap=True)
        row = QHBoxLayout(self)
        row.setContentsMargins(t.px(12), t.px(12), t.px(16), t.px(12))
        row.setSpacing(t.px(12))
        row.addWidget(self._icon, 0, Qt.AlignmentFlag.AlignTop)
        column = QVBoxLayout()
        column.setSpacing(0)
        column.addWidget(self._title)
        column.addWidget(self._text)
        self._buttons = QHBoxLayout()
        self._buttons.setContentsMargins(0, t.px(8), 0, 0)
        self._buttons.setSpacing(t.px(8))
        column.addLayout(self._buttons)
        row.addLayout(column, 1)
        self._words: tuple[str, ...] = ()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self.set(icon, title, text, actions, role)

    def set(
        self,
        icon: str,
        title: str,
        text: str = "",
        actions: Sequence[str] = (),
        role: Role = "text",
    ) -> None:
        """Change what it says; parameters as of the class."""
        self._icon.set(icon, role)
        self._title.set_text(title)
        self._text.set_text(text)
        self._text.setVisible(bool(text))
        self.setAccessibleName(f"{title} {text}".strip())
        if tuple(actions) != self._words:
            self._words = tuple(actions)
            _refill(self._buttons, self._words, self.pressed)
        self._buttons.setContentsMargins(0, theme().px(8) if actions else 0, 0, 0)

    def button(self, number: int = 0) -> Button:
        """Give one of its buttons, for example to show that it is busy.

        Raises
        ------
        IndexError
            When there are not so many.
        """
        return _buttons_in(self._buttons)[number]


class Empty(QWidget):
    """One sentence in an empty place, and the action that fills it.

    Parameters
    ----------
    second : str, optional
        Words on a second button.
    """

    pressed = Signal(int)

    def __init__(self, sentence: str, action: str = "", icon: str = "", second: str = "") -> None:
        super().__init__()
        t = theme()
        self._words: tuple[str, ...] = ()
        middle = Qt.AlignmentFlag.AlignHCenter
        self._icon = Icon(icon or "info", 28, "dim")
        # Hidden only: what is shown before it has a parent opens as a window.
        if not icon:
            self._icon.hide()
        self._sentence = Text(sentence, 14, role="dim", wrap=True, align=middle)
        self._sentence.setMaximumWidth(t.px(440))
        column = QVBoxLayout(self)
        column.setContentsMargins(t.px(24), t.px(24), t.px(24), t.px(24))
        column.setSpacing(t.px(12))
        column.addStretch(1)
        column.addWidget(self._icon, 0, middle)
        line = QHBoxLayout()
        line.addStretch(1)
        line.addWidget(self._sentence, 100)
        line.addStretch(1)
        column.addLayout(line)
        self._buttons = QHBoxLayout()
        self._buttons.setSpacing(t.px(8))
        column.addLayout(self._buttons)
        column.addStretch(1)
        self.set(sentence, action, second)

    def set(self, sentence: str, action: str = "", second: str = "") -> None:
        """Change what it says."""
        self._sentence.set_text(sentence)
        self.setAccessibleName(sentence)
        words = tuple(each for each in (action, second) if each)
        if words != self._words:
            self._words = words
            _refill(self._buttons, words, self.pressed, centred=True, small=False)

    def button(self, number: int = 0) -> Button:
        """Give one of its buttons.

        Raises
        ------
        IndexError
            When there are not so many.
        """
        return _buttons_in(self._buttons)[number]


def _buttons_in(row: QBoxLayout) -> list[Button]:
    items = (row.itemAt(place) for place in range(row.count()))
    widgets = (item.widget() for item in items if item is not None)
    return [widget for widget in widgets if isinstance(widget, Button)]


def _refill(
    row: QBoxLayout,
    words: tuple[str, ...],
    pressed: object,
    centred: bool = False,
    small: bool = True,
) -> None:
    """Replace the buttons of a row."""
    while (item := row.takeAt(0)) is not None:
        if (old := item.widget()) is not None:
            old.hide()
            old.deleteLater()
    if centred:
        row.addStretch(1)
    for number, label in enumerate(words):
        button = Button(label, size="small" if small else "normal")
        button.clicked.connect(lambda _on=False, n=number: pressed.emit(n))  # type: ignore[attr-defined]
        row.addWidget(button)
    row.addStretch(1)
