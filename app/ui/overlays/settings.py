"""The sheet with the settings, which saves every change immediately."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QWidget
from shiboken6 import isValid

from app.core.base.errors import CoreError
from app.core.storage.settings import SECTIONS, TABLE, Setting, SettingValueError, Value
from app.core.text import tr
from app.ui.presenters.actions import score
from app.ui.presenters.services import NO_LOUDSPEAKER
from app.ui.shell.commands import Commands
from app.ui.widgets.buttons import Button
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.dialogs import ask_folder
from app.ui.widgets.fields import ListField, TextField, Toggle
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import boxed, column, row
from app.ui.widgets.surfaces import Scroll
from app.words import settings as words


class SettingsBody(QWidget):
    """All visible settings, grouped under headings."""

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        self._commands = commands
        self._controls: dict[str, QWidget] = {}
        self._lines: list[tuple[str, QWidget]] = []
        absent = () if commands.services.sounds.speaks else ("voice",)
        settings = [entry for entry in TABLE if entry.visible and entry.key not in absent]
        for section in SECTIONS:
            entries = [entry for entry in settings if entry.section == section]
            if entries:
                heading = " ".join(words.search_words(entry) for entry in entries)
                self._lines += [(heading, Text(words.SECTIONS[section], 16, 600))]
                self._lines += [(words.search_words(entry), self._line(entry)) for entry in entries]
        reset = Button(tr("Restore defaults"), size="small", do=self._reset)
        self.field = TextField(tr("Find a setting"), tr("Find a setting"), "search", False)
        self.field.changed.connect(self._filter)
        self.nothing = Text("", role="dim", wrap=True)
        self.nothing.hide()
        inside = QWidget()
        # The button resets all settings, so no search should match it.
        self._lines.append(("", boxed(row(reset, ..., gap=None))))
        lines = [line for _, line in self._lines]
        column(self.nothing, *lines, ..., into=inside, gap=16, margins=(0, 0, 16, 0))
        self._area = Scroll(inside, height=480)
        column(self.field, self._area, into=self, gap=16)
        self.setFocusProxy(self.field)

    def _filter(self, query: str) -> None:
        """Show the settings whose title, choices or synonyms match the query."""
        visible = [not query.strip() or score(query, about) > 0 for about, _ in self._lines]
        for (_, line), fits in zip(self._lines, visible, strict=True):
            line.setVisible(fits)
        nothing = tr("No settings match “{typed}”. Try another word.", typed=query.strip())
        self.nothing.say("" if any(visible) else nothing)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Clear the search on Esc, or close the sheet if the search is empty."""
        if event.key() == Qt.Key.Key_Escape and self.field.text():
            self.field.set_text("")
            self._filter("")
        else:
            super().keyPressEvent(event)

    def _line(self, entry: Setting) -> QWidget:
        makers: dict[str, Callable[[Setting, Value], QWidget]] = {
            "toggle": self._toggle,
            "choice": self._choice,
            "number": self._number,
            "text": self._text,
            "folder": self._folder,
        }
        value = self._commands.services.model.settings.value(entry.key)
        self._controls[entry.key] = control = makers[entry.kind](entry, value)
        parts = [control, Text(words.explanation(entry), 12, role="dim", wrap=True)]
        if entry.key == "sounds" and not self._commands.services.sounds.available:
            parts.append(Text(NO_LOUDSPEAKER, 12, role="dim", wrap=True))
        return boxed(column(*parts, gap=4))

    def reveal(self, key: str) -> None:
        """Scroll to a setting and focus it as soon as the layout is complete."""

        def show() -> None:
            control = self._controls[key]
            self._area.ensureWidgetVisible(control)
            stop = control.focusProxy() or control
            if stop.focusPolicy() == Qt.FocusPolicy.NoFocus:
                parts = (one for one in control.findChildren(QWidget) if one.focusPolicy())
                stop = next(parts, control)
            stop.setFocus(Qt.FocusReason.ShortcutFocusReason)

        QTimer.singleShot(0, self, show)

    def _toggle(self, entry: Setting, value: Value) -> QWidget:
        toggle = Toggle(words.title(entry))
        toggle.setChecked(bool(value))
        toggle.toggled.connect(lambda on: self._change(entry, on))
        return toggle

    def _choice(self, entry: Setting, value: Value) -> QWidget:
        heads = entry.offers == "heads"
        field = ListField(
            words.title(entry),
            self._commands.place_controller.heads.titles() if heads else words.choices(entry),
        )
        field.choose(str(value))
        field.chosen.connect(lambda key: self._change(entry, key))
        return field

    def _number(self, entry: Setting, value: Value) -> QWidget:
        slider = LabelledSlider(
            words.title(entry),
            entry.minimum,
            entry.maximum,
            float(value),
            entry.step,
            partial(words.value_words, entry),
            default=float(entry.default),
        )
        # If the text size changed during the drag, the slider would move away from the pointer.
        changed = slider.settled if entry.key == "text_scale" else slider.changed
        changed.connect(lambda number: self._change(entry, number))
        return slider

    def _text(self, entry: Setting, value: Value) -> TextField:
        field = TextField(words.title(entry), words.empty_means(entry))
        field.set_text(str(value))
        signal = field.entered if entry.kind == "folder" else field.changed
        signal.connect(lambda text: self._change(entry, text, field))
        return field

    def _folder(self, entry: Setting, value: Value) -> QWidget:
        field = self._text(entry, value)

        def ask() -> None:
            folder = ask_folder(self, words.title(entry), field.text())
            if folder is not None and isValid(field):
                field.set_text(str(folder))
                self._change(entry, str(folder), field)

        choose = Button(tr("Choose…"), do=ask)
        choose.setAccessibleName(tr("Choose: {title}", title=words.title(entry)))
        return boxed(row((field, 1), column(..., choose, gap=None), gap=8))

    def _change(self, entry: Setting, value: object, field: TextField | None = None) -> None:
        try:
            self._commands.change(entry.key, round(value) if entry.whole else value)  # type: ignore[call-overload]
        except CoreError as error:
            if field is None:
                raise
            wrong = isinstance(error, SettingValueError)
            field.set_error(words.takes(entry) if wrong else str(error))
            return
        if field is not None:
            field.set_error("")

    def _reset(self) -> None:
        model = self._commands.services.model
        model.update(settings=model.settings.reset())
        self._commands.ask("settings")
