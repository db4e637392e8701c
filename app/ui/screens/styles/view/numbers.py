"""The turn in large figures, its direction, and the numbers that go with it."""

from __future__ import annotations

from typing import Final

from PySide6.QtWidgets import QGridLayout, QWidget

from app.core.text import tr
from app.core.text.turns import turn_words
from app.ui.screens.styles.state import DetailState
from app.ui.theme import theme
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import column, row

_ICONS: Final = {"clockwise": "clockwise", "counter-clockwise": "counterclockwise"}
_MISSING: Final = tr("No light measured yet.")
_LABEL: Final = 60
_BESIDE: Final = 52  # height where the words stand beside the number: two lines of a reason
_FACTS: Final = (
    ("good_from", tr("Good")),
    ("match", tr("Match")),
    ("strength", tr("Strength")),
    ("ratio", tr("Ratio")),
)


class TurnWords(QWidget):
    """How far, which way, toward which hour; or that it is out of reach."""

    def __init__(self, compact: bool) -> None:
        super().__init__()
        t = theme()
        self._compact = compact
        self._turn = Text("", 36 if compact else 48, 700, "amber")
        self._icon = Icon("clockwise", 20 if compact else 28, "text" if compact else "amber")
        self._direction = Text("", 14 if compact else 16, 600, elide=True)
        self._clock = Text("", 12 if compact else 14, role="dim", elide=True)
        self._out = Icon("not-possible", 20)
        self._verdict = Text("", 12 if compact else 14, wrap=True)
        self._reason = Text("", 12, role="dim", wrap=True)
        icon = [self._icon] if compact else []
        way = row(*icon, self._out, (self._direction, 1), gap=6)
        self._missing = Text(_MISSING, 16, 600, wrap=True)
        self._missing.hide()
        words = (self._missing, way, self._clock, self._verdict, self._reason)
        if compact:
            number = row(self._turn, gap=8)
            row(number, (column(..., *words, ...), 1), into=self, gap=12)
            self.setFixedHeight(t.px(_BESIDE))
        else:
            # The icon beside the number: the longest direction fills the line below.
            number = row(self._turn, self._icon, ..., gap=8)
            column(number, (column(*words), 1), into=self)

    def show_state(self, state: DetailState) -> None:
        """Show the turn of the needle, or why there is none."""
        out, probe = bool(state.verdict), state.main == "probe"
        self._turn.say("" if out else state.turn)
        self._icon.setVisible(state.way in _ICONS and not out)
        self._icon.set(_ICONS.get(state.way, "clockwise"))
        self._out.setVisible(out)
        direction = tr("Out of reach") if out else state.direction
        self._direction.set_text(_MISSING if probe else direction)
        self._missing.setVisible(probe and not self._compact)
        self._direction.setVisible(self._compact or not probe)
        aside = out and not state.at_best
        self._clock.say(turn_words(state.needle) if aside else "" if out else state.clock)
        self._verdict.set_text(
            tr("Turns come with the light of a place.") if probe else state.verdict
        )
        self._verdict.setVisible(probe or (out and not (aside and self._compact)))
        self._reason.set_text(state.reason)
        self._reason.setVisible(out and not aside and not self._compact)


class Facts(QWidget):
    """Arc, match, strength and lighting ratio."""

    def __init__(self, compact: bool) -> None:
        super().__init__()
        t = theme()
        self._compact = compact
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(t.px(8) if compact else 0)
        grid.setVerticalSpacing(t.px(2) if compact else t.px(4))
        grid.setColumnStretch(1, 1)
        if not compact:
            grid.setColumnMinimumWidth(0, t.px(_LABEL))
        self._rows: dict[str, tuple[Text, Text]] = {}
        place = 0
        for key, label in _FACTS:
            place = self._add(grid, place, key, label)
        self._short = Text("", 12, role="dim", elide=True)
        if compact:
            self._short.hide()
        grid.addWidget(self._short, place, 0, 1, 2)
        grid.setRowStretch(place + 1, 1)

    def _add(self, grid: QGridLayout, place: int, key: str, label: str) -> int:
        long = key in ("good_from", "ratio")
        name = Text(label, 12, role="dim")
        value = Text("", 14, 400 if long else 600, elide=True)
        self._rows[key] = (name, value)
        if self._compact:
            grid.addWidget(name, place, 0, 1, 2)
            grid.addWidget(value, place + 1, 0, 1, 2)
            return place + 2
        grid.addWidget(name, place, 0)
        grid.addWidget(value, place, 1)
        return place + 1

    def show_state(self, state: DetailState) -> None:
        """Show the numbers of the needle's turn; what there is none of is left out."""
        for key, (name, value) in self._rows.items():
            words = str(getattr(state, key))
            value.say(words)
            name.setVisible(bool(words))
        self._short.set_text(state.ratio_short)
        # What is out of reach needs the room for its reason.
        short = bool(state.ratio_short) and not (self._compact or state.verdict)
        self._short.setVisible(short)
        for widget in (*self._rows["ratio"], self._short):
            _describe(widget, state.ratio_tip)
        for widget in self._rows["good_from"]:
            _describe(widget, state.caution)


def _describe(widget: QWidget, words: str) -> None:
    """Give a widget its tool tip, for ears as well."""
    if widget.accessibleDescription() != words:
        widget.setToolTip(words)
        widget.setAccessibleDescription(words)
