"""Sheets of the Light screen: a line about a lamp, and how a lamp is captured."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QEvent, Qt
from PySide6.QtWidgets import QGridLayout, QHBoxLayout

from app.ui.theme import theme
from app.ui.widgets.buttons import Button
from app.ui.widgets.dialogs import Sheet
from app.ui.widgets.fields import TextField
from app.ui.widgets.labels import Text

if TYPE_CHECKING:
    from PySide6.QtWidgets import QWidget

    from app.ui.screens.light.lamps import Source
    from app.ui.screens.light.presenter import LightPresenter
    from app.ui.screens.light.state import CaptureAsk, WordsAsk

_ALONE: Final = "Without a distance the lamp can be held anywhere; measure it if you can."


class KeysSheet(Sheet):
    """A sheet in which no key is a shortcut of the screen behind it."""

    def event(self, event: QEvent) -> bool:
        """Keep all keys here."""
        if event.type() == QEvent.Type.ShortcutOverride:
            event.accept()
            return True
        return super().event(event)


class WordsSheet(KeysSheet):
    """A line about a captured lamp."""

    def __init__(self, host: QWidget, presenter: LightPresenter, ask: WordsAsk) -> None:
        super().__init__(host, ask.title, 440)
        self._presenter, self._ask = presenter, ask
        self.field = TextField(ask.label, ask.example)
        self.field.set_text(ask.text)
        self.field.edit.selectAll()
        self.take = Button(ask.button, kind="primary")
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
        self.take.set_busy(None)
        self.field.set_error(sentence)
        if not sentence:
            self.shut()

    def _answer(self) -> None:
        if not self.take.busy:
            self.take.set_busy("Saving…")
            self._presenter.keeping.answer(self._ask.wish, self.field.text())


class CaptureSheet(KeysSheet):
    """How a lamp is captured, and what is made one now."""

    def __init__(self, host: QWidget, presenter: LightPresenter, ask: CaptureAsk) -> None:
        super().__init__(host, "Capture a lamp of your own", 600)
        self._presenter = presenter
        t = theme()
        steps = QGridLayout()
        steps.setHorizontalSpacing(t.px(12))
        steps.setVerticalSpacing(t.px(8))
        steps.setColumnStretch(1, 1)
        for number, sentence in enumerate((*ask.guide, ask.other)):
            mark = Text(f"{number + 1}" if number < len(ask.guide) else "or", 14, 600)
            steps.addWidget(mark, number, 0, Qt.AlignmentFlag.AlignTop)
            steps.addWidget(Text(sentence, 14, role="dim", wrap=True), number, 1)
        self.body.addLayout(steps)
        self.name = TextField("Name", "My panel")
        self.name.set_text(ask.name)
        self.distance = TextField("From the camera to the lamp", "40 cm")
        fields = QHBoxLayout()
        fields.setSpacing(t.px(16))
        for field in (self.name, self.distance):
            field.changed.connect(lambda _text: self.distance.set_error(""))
            fields.addWidget(field, 1, Qt.AlignmentFlag.AlignTop)
        self.body.addLayout(fields)
        self.body.addWidget(Text(_ALONE, 12, role="dim", wrap=True))
        self.place = Button(ask.place)
        self.place.clicked.connect(lambda: self._take("place"))
        self.files = Button("Add from files…", "open", kind="primary")
        self.files.clicked.connect(lambda: self._take("files"))
        self.add_button(self.place)
        self.add_button(self.files)
        if not ask.place:
            # Hidden only: what is shown before it has a parent opens as a window.
            self.place.hide()

    def say(self, sentence: str) -> None:
        """Say what is wrong with the distance; nothing to say closes the sheet."""
        self.distance.set_error(sentence)
        if not sentence:
            self.shut()

    def _take(self, source: Source) -> None:
        self._presenter.capture(source, self.name.text(), self.distance.text())
