"""Asking for the name of a style."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QEvent, Signal

from app.ui.widgets.buttons import Button
from app.ui.widgets.dialogs import Sheet
from app.ui.widgets.fields import TextField

if TYPE_CHECKING:
    from PySide6.QtWidgets import QWidget

    from app.ui.presenters.paint_state import NameWish

_TITLES: Final[dict[NameWish, tuple[str, str]]] = {
    "save": ("Save as my style", "Save"),
    "save-as": ("Save as a new style", "Save"),
    "rename": ("Rename the style", "Rename"),
}


class NameSheet(Sheet):
    """A line for the name, and a button that takes it.

    Attributes
    ----------
    named : Signal(str, str)
        What the name was asked for, and the name.
    """

    named = Signal(str, str)

    def __init__(self, host: QWidget) -> None:
        super().__init__(host, "Save as my style", 440)
        self._wish: NameWish = "save"
        self._field = TextField("Name", "My Rembrandt")
        self._take = Button("Save", kind="primary")
        cancel = Button("Cancel")
        self.body.addWidget(self._field)
        self.add_button(cancel)
        self.add_button(self._take)
        cancel.clicked.connect(self.shut)
        self._field.entered.connect(lambda _text: self._answer())
        self._field.changed.connect(lambda _text: self._field.set_error(""))
        self._take.clicked.connect(self._answer)

    def ask(self, wish: NameWish, title: str) -> None:
        """Open it."""
        self._wish = wish
        words, button = _TITLES[wish]
        self.set_title(words)
        self._take.set_text(button)
        self._take.set_busy(None)
        self._field.set_error("")
        self._field.set_text(title)
        self._field.edit.selectAll()
        self.open(self._field.edit)

    def say(self, sentence: str) -> None:
        """Say why the name cannot be taken; nothing to say closes the sheet."""
        self._field.set_error(sentence)
        if not sentence:
            self.shut()

    def show_busy(self, saving: bool) -> None:
        """Show that the style is being written."""
        if saving != self._take.busy:
            self._take.set_busy("Saving…" if saving else None)

    def _answer(self) -> None:
        if not self._take.busy:
            self.named.emit(self._wish, self._field.text())

    def event(self, event: QEvent) -> bool:
        """Keep all keys here: none is a shortcut of the screen behind it."""
        if event.type() == QEvent.Type.ShortcutOverride:
            event.accept()
            return True
        return super().event(event)
