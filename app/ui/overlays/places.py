"""The list of places that were kept, with small pictures."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Final

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.presenters.places_list import (
    DeletedRow,
    PlacesListPresenter,
    PlacesListRow,
    PlacesListState,
)
from app.ui.shell.commands import Commands
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.dialogs import LineSheet, show_folder
from app.ui.widgets.fields import TextField
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import add, clear, column, row
from app.ui.widgets.messages import Empty
from app.ui.widgets.surfaces import Menu, PictureLine, Scroll

_PICTURE: Final = (128, 64)
_SEARCHED: Final = 4  # a shorter list needs no search


class PlacesBody(QWidget):
    """The list."""

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        self._commands = commands
        self._presenter = PlacesListPresenter(commands.services, commands.desk)
        self._state: PlacesListState | None = None
        self._stops: list[QWidget] = []
        self._demo = Button(tr("Try the demo place"), "pin")
        self._files = Button(tr("Open files…"), "file", do=lambda: self._leave(commands.open_files))
        self._demo.clicked.connect(lambda: self._leave(commands.desk.open_demo))
        self._search = TextField(tr("Search places"), tr("Search places"), "search", False)
        self._search.changed.connect(self._show_found)
        self._search.hide()
        inside = QWidget()
        self._column = column(..., into=inside, gap=8, margins=(0, 0, 16, 0))
        foot = row(self._demo, self._files, ..., gap=8)
        column(self._search, (Scroll(inside), 1), foot, into=self, gap=16)
        self.destroyed.connect(self._presenter.detach)
        self._presenter.attach(self)

    def show_state(self, state: PlacesListState) -> None:
        """Show the list."""
        if state == self._state:
            return
        self._state = state
        self._search.setVisible(len(state.rows) >= _SEARCHED)
        self._show_found()

    def _show_found(self) -> None:
        """Show the places that have all words of the search in their name, time or answers."""
        state = self._state
        if state is None:
            return
        clear(self._column)
        self._stops = []
        wanted = self._search.text().casefold().split() if len(state.rows) >= _SEARCHED else []
        lines = [
            self._line(place)
            for place in state.rows
            if all(
                word in f"{place.name} {place.time} {place.detail}".casefold() for word in wanted
            )
        ]
        if not lines and not state.busy:
            none = tr("No place measured yet. The demo place needs no camera.")
            lines = [Empty(tr("No places match.") if state.rows else none)]
        if state.deleted:
            lines += [Text(tr("Deleted"), 12, 600, role="dim")]
            lines += [self._deleted_line(gone) for gone in state.deleted]
        add(self._column, *lines, ...)
        self._order_stops()

    def _order_stops(self) -> None:
        """Lead Tab through the places first: they stand above the buttons, but come later."""
        for before, after in pairwise([self._search, *self._stops, self._demo, self._files]):
            QWidget.setTabOrder(before, after)
        if self._stops and self._demo.hasFocus():
            self._stops[0].setFocus(Qt.FocusReason.OtherFocusReason)

    def _leave(self, call: Callable[[], None]) -> None:
        self._commands.close_overlay()
        call()

    def _line(self, place: PlacesListRow) -> QWidget:
        frame = PictureLine(place.name, place.thumbnail, _PICTURE, raised=place.current)
        when = tr("{time}, open now", time=place.time) if place.current else place.time
        add(frame.words, Text(place.name, 14, 600, elide=True))
        add(frame.words, Text(when, 12, role="dim", elide=True))
        if place.detail:
            mark = (Icon("warning", 16, says=tr("warning")),) if place.trouble else ()
            detail = Text(place.detail, 12, role="dim", wrap=True)
            frame.words.addLayout(row(*mark, (detail, 1), gap=None))
        self._add_opener(place, frame)
        name = tr("More about {name}", name=place.name)
        more = IconButton("more", name, kind="quiet", size="small")
        more.clicked.connect(lambda: self._more(place, more))
        frame.row.addWidget(more)
        self._stops.append(more)
        return frame

    def _add_opener(self, place: PlacesListRow, line: PictureLine) -> None:
        """Offer to open or to finish it; of one without any frame nothing can be made."""

        def opened() -> None:
            self._leave(lambda: self._presenter.open(place.folder))

        if place.left is not None and not place.left.can_finish:
            return
        words, name = tr("Open"), tr("Open {name}", name=place.name)
        if place.left is not None:
            words, name = tr("Finish"), tr("Finish {name}", name=place.name)
        elif place.current:
            words = tr("Open again")
        opener = Button(words, size="small")
        opener.setAccessibleName(name)
        opener.clicked.connect(opened)
        line.row.addWidget(opener)
        line.pressed.connect(opened)
        line.set_can_press()
        self._stops.append(opener)

    def _deleted_line(self, gone: DeletedRow) -> QWidget:
        frame = PictureLine(gone.name, None, _PICTURE)
        frame.words.addWidget(Text(gone.name, 14, role="dim", elide=True))
        frame.words.addWidget(Text(gone.detail, 12, role="dim", elide=True))
        back = Button(tr("Bring back"), "undo", size="small")
        back.setAccessibleName(tr("Bring back {name}", name=gone.name))
        back.clicked.connect(lambda: self._presenter.restore(gone.folder))
        frame.row.addWidget(back)
        self._stops.append(back)
        return frame

    def _more(self, place: PlacesListRow, under: QWidget) -> None:
        menu = Menu(self, tr("More about {name}", name=place.name))
        menu.add(tr("Rename…"), lambda: self._rename(place), "edit")
        menu.add(tr("Show the folder"), lambda: show_folder(place.folder), "folder")
        menu.add(tr("Delete"), lambda: self._presenter.delete(place.folder), "trash")
        menu.drop(under)

    def _rename(self, place: PlacesListRow) -> None:
        title, label, button = tr("Rename"), tr("Name of the place"), tr("Rename")
        sheet = LineSheet(self.window(), title, label, button, place.name, place.name)

        def taken(name: str) -> None:
            if name.strip():
                self._presenter.rename(place.folder, name)
                sheet.shut()
            else:
                sheet.say(tr("A place needs a name."))

        sheet.taken.connect(taken)
        sheet.closed.connect(sheet.deleteLater)
        self.destroyed.connect(sheet.deleteLater)
        sheet.open(sheet.field.edit)
