"""The two questions of the Light screen: how bright the place is, and how bright the lamp."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QSizePolicy, QVBoxLayout, QWidget

from app.ui.screens.light.state import BRIGHTNESS
from app.ui.screens.light.words import lux_words
from app.ui.theme import theme
from app.ui.widgets.accessibility import OwnKeys
from app.ui.widgets.buttons import Button
from app.ui.widgets.fields import TextField
from app.ui.widgets.labels import Text

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.ui.screens.light.presenter import LightPresenter
    from app.ui.screens.light.state import BrightState

_WIDEST: Final = 520
_WHY: Final = (
    "What a lamp can do depends on how much light there is besides. Choose what comes nearest, "
    "or type what a light meter reads in front of the face while it looks at the camera."
)


class _Page(QWidget):
    """A column in the middle of the room that there is."""

    def __init__(self, title: str) -> None:
        super().__init__()
        t = theme()
        self.setAccessibleName(title)
        self.title = Text(title, 20, 600, wrap=True)
        self.words = Text("", 14, role="dim", wrap=True)
        self.column = QVBoxLayout()
        self.column.setSpacing(t.px(8))
        self.column.addStretch(1)
        self.column.addWidget(self.title)
        self.column.addWidget(self.words)
        self.column.addSpacing(t.px(8))
        inside = QWidget()
        inside.setMaximumWidth(t.px(_WIDEST))
        inside.setLayout(self.column)
        row = QHBoxLayout(self)
        row.setContentsMargins(t.px(24), t.px(24), t.px(24), t.px(24))
        row.addStretch(1)
        row.addWidget(inside, 100)
        row.addStretch(1)

    def add_field(self, field: TextField, button: Button, take: Callable[[str], None]) -> None:
        """Put a field and its button side by side."""
        t = theme()
        beside = QVBoxLayout()
        beside.setSpacing(0)
        beside.addSpacing(t.px(20))  # in line with the field, whose label stands above it
        beside.addWidget(button)
        beside.addStretch(1)
        row = QHBoxLayout()
        row.setSpacing(t.px(8))
        row.addWidget(field, 1)
        row.addLayout(beside)
        self.column.addLayout(row)
        OwnKeys(field.edit)
        field.entered.connect(take)
        field.changed.connect(lambda _text: field.set_error(""))
        button.clicked.connect(lambda: take(field.text()))


class Brightness(_Page):
    """The question how bright the place is, with its usual answers and a field for any other."""

    def __init__(self, presenter: LightPresenter) -> None:
        super().__init__("How bright is it here?")
        t, scale = theme(), presenter.scale
        self.words.set_text(_WHY)
        grid = QGridLayout()
        grid.setSpacing(t.px(8))
        self.answers: dict[str, Button] = {}
        for number, (key, name, lux) in enumerate(BRIGHTNESS):
            button = Button(f"{name}, {lux_words(lux)}")
            button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
            button.clicked.connect(lambda _on=False, key=key: scale.choose(key))
            self.answers[key] = button
            grid.addWidget(button, number // 2, number % 2)
        self.column.addLayout(grid)
        self.column.addSpacing(t.px(8))
        self.lux = TextField("Light meter at the face, lux", "450")
        self.take = Button("Set")
        self.add_field(self.lux, self.take, scale.type)
        self._shown: BrightState | None = None
        self.keep = Button("", size="small")
        self.keep.clicked.connect(scale.keep)
        self.measured = Button("", size="small")
        self.measured.clicked.connect(scale.measure)
        foot = QHBoxLayout()
        foot.setSpacing(t.px(8))
        foot.addWidget(self.keep)
        foot.addWidget(self.measured)
        foot.addStretch(1)
        self.column.addSpacing(t.px(8))
        self.column.addLayout(foot)
        self.column.addStretch(2)

    def show_state(self, state: BrightState) -> None:
        """Show which answer counts; what is being typed is left alone."""
        before, self._shown = self._shown, state
        if state == before:
            return
        if before is None or (state.key, state.text, state.keep) != (
            before.key,
            before.text,
            before.keep,
        ):
            self.lux.set_text(state.text)
        self.lux.set_error(state.error)
        for key, name, lux in BRIGHTNESS:
            icon = "check" if key == state.key else ""
            self.answers[key].set_text(f"{name}, {lux_words(lux)}", icon)
        for button, words in ((self.keep, state.keep), (self.measured, state.measured)):
            button.set_text(words)
            button.setVisible(bool(words))


class Meter(_Page):
    """The question how bright a captured lamp is whose files do not say so."""

    def __init__(self, presenter: LightPresenter) -> None:
        super().__init__("How bright is this lamp?")
        self.lux = TextField("Light meter where the camera stood, facing the lamp, lux", "640")
        self.take = Button("Set")
        self.add_field(self.lux, self.take, lambda text: presenter.keeping.answer("lux", text))
        self.again = Button("Capture it again")
        self.again.clicked.connect(presenter.shelf.begin)
        self.column.addSpacing(theme().px(8))
        self.column.addWidget(self.again, 0, Qt.AlignmentFlag.AlignLeft)
        self.column.addStretch(2)

    def show_state(self, sentence: str, error: str) -> None:
        """Show why the lamp cannot be compared, and what is wrong with what was typed."""
        self.words.set_text(sentence)
        self.lux.set_error(error)
