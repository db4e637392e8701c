"""The sheet that explains how to capture a lamp."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.screens.light.lamp_list import Source
from app.ui.screens.light.own_lamp.sheets import CaptureAsk
from app.ui.screens.light.screen import LightPresenter
from app.ui.widgets.buttons import Button
from app.ui.widgets.dialogs import KeysSheet
from app.ui.widgets.fields import TextField
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import grid, row

_ALONE: Final = tr("Measure the distance if you can. Without it, the lamp can be held anywhere.")


class CaptureSheet(KeysSheet):
    """The instructions for capturing a lamp, with fields for its name and its distance."""

    def __init__(self, host: QWidget, presenter: LightPresenter, ask: CaptureAsk) -> None:
        super().__init__(host, tr("Capture your own lamp"), 600)
        self._presenter = presenter
        top = Qt.AlignmentFlag.AlignTop
        steps: list[Text | tuple[Text, Qt.AlignmentFlag]] = []
        for number, sentence in enumerate((*ask.guide, ask.other)):
            mark = Text(f"{number + 1}" if number < len(ask.guide) else tr("or"), 14, 600)
            steps += [(mark, top), Text(sentence, 14, role="dim", wrap=True)]
        self.body.addLayout(grid(*steps, across=2, gap=(12, 8), stretched=1))
        self.name = TextField(tr("Name"), tr("My panel"))
        self.name.set_text(ask.name)
        self.distance = TextField(tr("From the camera to the lamp"), "40 cm")
        for field in (self.name, self.distance):
            field.changed.connect(lambda _text: self.distance.set_error(""))
        self.body.addLayout(row((self.name, 1, top), (self.distance, 1, top), gap=16))
        self.body.addWidget(Text(_ALONE, 12, role="dim", wrap=True))
        self.place = Button(ask.place, do=lambda: self._take("place"))
        self.files = Button(tr("Add from files…"), "open", kind="primary")
        self.files.clicked.connect(lambda: self._take("files"))
        self.add_button(self.place)
        self.add_button(self.files)
        if not ask.place:
            # Hide the button only now: a widget that is shown without a parent opens as a window.
            self.place.hide()

    def say(self, sentence: str) -> None:
        """Show an error in the distance, or close the sheet if the sentence is empty."""
        self.distance.set_error(sentence)
        if not sentence:
            self.shut()

    def _take(self, source: Source) -> None:
        self._presenter.lamps.capture(source, self.name.text(), self.distance.text())
