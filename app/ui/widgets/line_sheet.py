"""A sheet that asks for one line, and says beside it what is wrong with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, Signal

from app.ui.widgets.buttons import Button
from app.ui.widgets.dialogs import Sheet
from app.ui.widgets.fields import TextField

if TYPE_CHECKING:
    from PySide6.QtWidgets import QWidget


class KeysSheet(Sheet):
    """A sheet in which no key is a shortcut of the screen behind it."""

    def event(self, event: QEvent) -> bool:
        """Keep all keys here."""
        if event.type() == QEvent.Type.ShortcutOverride:
            event.accept()
            return True
        return super().event(event)


class LineSheet(KeysSheet):
    """A field, and a button that takes what is in it.

    Attributes:
        taken: Signal(str). The line, by the button or Enter; not while it is busy.
    """

    taken = Signal(str)

    def __init__(
        self, host: QWidget, title: str, label: str, button: str, text: str, example: str
    ) -> None:
        super().__init__(host, title, 440)
        self.field = TextField(label, example)
        self.field.set_text(text)
        self.field.edit.selectAll()
        self.take = Button(button, kind="primary")
        cancel = Button("Cancel")
        self.body.addWidget(self.field)
        self.add_button(cancel)
        self.add_button(self.take)
        cancel.clicked.connect(self.shut)
        self.field.entered.connect(lambda _text: self._answer())
        self.field.changed.connect(lambda _text: self.field.set_error(""))
        self.take.clicked.connect(self._answer)

    def say(self, sentence: str) -> None:
        """Say what is wrong with the line; nothing to say closes the sheet."""
        self.show_busy(False)
        self.field.set_error(sentence)
        if not sentence:
            self.shut()

    def show_busy(self, saving: bool) -> None:
        """Show that what was typed is being written."""
        if saving != self.take.busy:
            self.take.set_busy("Saving…" if saving else None)

    def _answer(self) -> None:
        if not self.take.busy:
            self.taken.emit(self.field.text())
