"""The sheet that compares spots side by side to find the best one for a style."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from PySide6.QtWidgets import QGridLayout, QWidget

from app.core.text import tr
from app.ui.presenters.spots import SpotCard, SpotsPresenter, SpotsState
from app.ui.shell.commands import Commands
from app.ui.theme import px, theme
from app.ui.widgets.buttons import Button
from app.ui.widgets.dialogs import Sheet
from app.ui.widgets.displays import Meter, Picture
from app.ui.widgets.fields import ListField
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import boxed, clear, column, row
from app.ui.widgets.surfaces import OutlineBox, Scroll

_WIDE: Final = 368  # width of each of up to three spots in a row

_HIGH: Final = {True: 304, False: 160}  # height of a picture in one row of spots, and in two

_ONE_ROW: Final = 4


class _Spot(OutlineBox):
    """A spot's picture and verdict, with a button that opens the spot.

    The best spot has a thicker border.
    """

    def __init__(self, card: SpotCard, high: int, open_it: Callable[[Path], None]) -> None:
        # In high contrast, all fills are white, so only the wider border marks the best spot.
        fill, edge, width = "panel", "line", 1
        if card.best:
            fill, edge, width = "raised", "sel", 4 if theme().contrast else 2
        super().__init__(fill, edge, width=width)
        self.setAccessibleName(". ".join(filter(None, (
            tr("Best spot") if card.best else "", card.name, card.turn, card.grade_words, card.why
        ))))  # fmt: skip
        picture = Picture(tr("Picture at {name}", name=card.name))
        picture.setFixedHeight(high)
        picture.set_picture(card.picture)
        when = Text(card.time, 12, role="dim", elide=True)
        mark = (Icon("check", 16, "amber"), Text(tr("Best spot"), 12, 700, "amber"))
        meter = Meter()
        meter.set(card.match, limit=None)
        opener = Button(tr("Open"), size="small", do=lambda: open_it(card.folder))
        opener.setAccessibleName(tr("Open {name}", name=card.name))
        parts: list[QWidget] = [Text(card.turn, 16, 600, elide=True)] if card.turn else []
        parts += [meter, Text(card.grade_words, 12, wrap=True)] if card.grade_words else []
        parts += [Text(card.why, 12, role="dim", wrap=True)] if card.why else []
        column(
            picture, 4, Text(card.name, 14, 600, elide=True),
            row((when, 1), *(mark if card.best else ()), gap=4),
            *parts, ...,
            row(..., opener), into=self, gap=4, margins=8,
        )  # fmt: skip


class SpotsSheet(Sheet):
    """A sheet that compares spots.

    Attributes:
        leave: Closes the list below this sheet, then calls the function passed to it.
    """

    def __init__(
        self,
        commands: Commands,
        folders: Sequence[Path],
        leave: Callable[[Callable[[], None]], None],
    ) -> None:
        super().__init__(commands.window, tr("Which spot is best?"), _WIDE * min(len(folders), 3))
        self._presenter = SpotsPresenter(commands.services, commands.place_controller, folders)
        self._leave, self._state = leave, SpotsState()
        self._style = ListField(tr("Style"), icon="styles")
        self._style.chosen.connect(self._presenter.choose)
        self._verdict, self._anywhere = Text("", 16, 600, wrap=True), Text("", 12, role="dim")
        words = column(..., self._verdict, self._anywhere, ..., gap=4)
        self._grid = QGridLayout()
        self._grid.setSpacing(px(8))
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._scroll = Scroll(
            boxed(self._grid), 504 if len(folders) <= _ONE_ROW else 720, tr("Spots")
        )
        self.body.addLayout(row((self._style, 2), (words, 3), gap=24))
        self.body.addWidget(self._scroll, 1)
        self.closed.connect(self._presenter.detach)
        self._presenter.attach(self)

    def show_state(self, state: SpotsState) -> None:
        """Show the spots and the verdict."""
        if state == self._state and self._grid.count():
            return
        self._state = state
        self._style.set_items(state.styles)
        if state.style:
            self._style.choose(state.style)
        self._verdict.set_text(state.verdict)
        self._anywhere.set_text(state.anywhere)
        clear(self._grid)
        flat = len(state.cards) <= _ONE_ROW
        across = len(state.cards) if flat else 3
        # In a small window, the text below matters more than the full height of the head.
        high = min(px(_HIGH[flat]), self.window().height() // (3 if flat else 5))
        for number, card in enumerate(state.cards):
            widget = _Spot(card, high, self._go_to)
            self._grid.addWidget(widget, *divmod(number, across))
            self._grid.setColumnStretch(number % across, 1)

    def _go_to(self, folder: Path) -> None:
        self.shut()
        self._leave(lambda: self._presenter.open(folder))
