"""The questions about the brightness of the place and of the lamp."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.core.text import tr
from app.ui.screens.light.brightness import BRIGHTNESS, BrightState
from app.ui.screens.light.screen import LightPresenter
from app.ui.theme import px
from app.ui.widgets.accessibility import OwnKeys
from app.ui.widgets.buttons import Button
from app.ui.widgets.fields import TextField
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import add, column, grid, row
from app.words.phrases.quantities import lux_words

_WIDEST_SHEET: Final = 520

_WHY: Final = tr(
    "What a lamp can do depends on the light in this place. Choose the closest answer, or enter "
    "the reading of a light meter held at the face and pointed at the camera."
)


class _SheetPage(QWidget):
    """A column centred in the available space."""

    def __init__(self, title: str) -> None:
        super().__init__()
        self.setAccessibleName(title)
        self.words = Text("", 14, role="dim", wrap=True)
        title_text = Text(title, 20, 600, wrap=True)
        self.column = column(..., title_text, self.words, 8, gap=8, margins=None)
        inside = QWidget()
        inside.setMaximumWidth(px(_WIDEST_SHEET))
        inside.setLayout(self.column)
        row(..., (inside, 100), ..., into=self, gap=None, margins=24)

    def add_field(self, field: TextField, button: Button, take: Callable[[str], None]) -> None:
        """Add a field and its button side by side."""
        # Align the button with the field, whose label is above it.
        self.column.addLayout(row((field, 1), column(20, button, ...), gap=8))
        OwnKeys(field.edit)
        field.entered.connect(take)
        field.changed.connect(lambda _text: field.set_error(""))
        button.clicked.connect(lambda: take(field.text()))


class Brightness(_SheetPage):
    """The question about the place's brightness, with common answers and a field for a reading."""

    def __init__(self, presenter: LightPresenter) -> None:
        super().__init__(tr("How bright is it here?"))
        scale = presenter.scale
        self.words.set_text(_WHY)
        self.answers: dict[str, Button] = {}
        for key, name, lux in BRIGHTNESS:
            button = Button(f"{name}, {lux_words(lux)}")
            button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
            button.clicked.connect(lambda _on=False, key=key: scale.choose(key))
            self.answers[key] = button
        add(self.column, grid(*self.answers.values(), across=2, gap=(8, 8)), 8)
        self.lux = TextField(tr("Light meter at the face, in lux"), "450")
        self.take = Button(tr("Set"))
        self.add_field(self.lux, self.take, scale.type)
        self._last: BrightState | None = None
        self._last_input: tuple[str, ...] = ()
        self.keep = Button("", size="small", do=scale.keep)
        self.measured = Button("", size="small", do=scale.measure)
        add(self.column, 8, row(self.keep, self.measured, ..., gap=8))
        self.column.addStretch(2)

    def show_state(self, state: BrightState) -> None:
        """Show the current answer without disturbing any text that is being typed."""
        if state == self._last:
            return
        self._last = state
        before, self._last_input = self._last_input, (state.key, state.text, state.keep)
        if self._last_input != before:
            self.lux.set_text(state.text)
        self.lux.set_error(state.error)
        for key, name, lux in BRIGHTNESS:
            icon = "check" if key == state.key else ""
            self.answers[key].set_text(f"{name}, {lux_words(lux)}", icon)
        for button, words in ((self.keep, state.keep), (self.measured, state.measured)):
            button.set_text(words)
            button.setVisible(bool(words))


class MeterPage(_SheetPage):
    """A page that asks for the brightness of a captured lamp whose files do not record it."""

    def __init__(self, presenter: LightPresenter) -> None:
        super().__init__(tr("How bright is this lamp?"))
        words = tr("Light meter at the camera’s position, facing the lamp, in lux")
        self.lux = TextField(words, "640")
        self.take = Button(tr("Set"))
        self.add_field(self.lux, self.take, lambda text: presenter.lamp_actions.answer("lux", text))
        self.again = Button(tr("Capture the lamp again"), do=presenter.lamps.begin)
        add(self.column, 8, (self.again, 0, Qt.AlignmentFlag.AlignLeft))
        self.column.addStretch(2)

    def show_state(self, sentence: str, error: str) -> None:
        """Show why the lamp cannot be compared with the place, and any error in the typed value."""
        self.words.set_text(sentence)
        self.lux.set_error(error)
