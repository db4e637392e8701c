"""The list of saved places, grouped by day, with search, tags and selection for comparison."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import Final

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QGuiApplication, QPainter
from PySide6.QtWidgets import QPlainTextEdit, QWidget

from app.core.text import tr, tr_plural
from app.ui.overlays.spots import SpotsSheet
from app.ui.presenters.places_list import (
    DeletedRow,
    PlacesListPresenter,
    PlacesListRow,
    PlacesListState,
)
from app.ui.shell.commands import Commands
from app.ui.theme import Theme, px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.buttons import Button, IconButton, Pressable
from app.ui.widgets.dialogs import KeysSheet, Sheet, show_folder
from app.ui.widgets.fields import TextField
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import add, boxed, column, row
from app.ui.widgets.messages import Empty
from app.ui.widgets.paint import box, put_text, tag_size
from app.ui.widgets.surfaces import Menu, OutlineBox, PictureLine, Scroll

_PICTURE: Final = (176, 88)

_BAR: Final = 24  # room for the scroll bar at the right edge

_MOST_UNSEARCHED: Final = 4  # a shorter list needs no search

_AT_ONCE: Final = 3  # rows added or removed per event


class _Pick(Pressable):
    """A small checkbox that selects a place for comparison."""

    preferred_size = (24, 32)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        area = self.rect().adjusted(px(2), px(6), -px(2), -px(6))
        fill, edge = (t.c.amberfill, t.c.sel) if self.selected else (t.c.raised, t.c.ctl)
        box(painter, area, px(4), fill, edge if self.isEnabled() else t.c.line, t.line_width)
        if self.selected:
            draw_icon(painter, "check", area, px(16), t.c.onamber)


class _Tag(Pressable):
    """A tag of a place, sized to fit its text."""

    def __init__(self, words: str, find: Callable[[str], None]) -> None:
        super().__init__(tr("Search for {tag}", tag=words), do=lambda: find(words))
        self.setText(words)
        self.setFixedSize(*tag_size(words))

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        edge = t.c.ctl if self.hovered() else t.c.line
        box(painter, self.rect(), self.height() / 2, t.c.raised, edge, t.line_width)
        middle = Qt.AlignmentFlag.AlignCenter
        put_text(painter, self.rect(), self.text(), t.font(12), t.c.text, middle)


class _PlaceLine(PictureLine):
    """The row that shows one place."""

    def __init__(self, place: PlacesListRow, body: PlacesBody) -> None:
        super().__init__(place.name, place.thumbnail, _PICTURE, raised=place.current)
        self.place, self._body = place, body
        when = tr("{time}, open now", time=place.hour) if place.current else place.hour
        texts = [Text(place.name, 14, 600, elide=True), Text(when, 12, role="dim", elide=True)]
        add(self.words, ..., *texts)
        if place.detail:
            mark = (Icon("warning", 16, says=tr("warning")),) if place.trouble else ()
            detail = Text(place.detail, 12, role="dim", wrap=True, elide=True)
            self.words.addLayout(row(*mark, (detail, 1), gap=4))
        tags = [_Tag(tag, body.search) for tag in place.tags]
        notes = Text(" ".join(place.notes.split())[:200], 12, role="dim", elide=True)
        if tags or place.notes:
            self.words.addLayout(row(*tags, (notes, 1), gap=4))
        add(self.words, ...)
        self.pick = _Pick(tr("Compare {name}", name=place.name), "")
        self.pick.clicked.connect(lambda: body.presenter.pick(place.folder))
        lead = self.pick if place.can_compare else QWidget()
        lead.setFixedWidth(px(24))
        self.row.insertWidget(0, lead)
        more = IconButton("more", tr("More about {name}", name=place.name), kind="quiet",
                          size="small")  # fmt: skip
        more.clicked.connect(lambda: body.show_more(place, more))
        self.stops: list[QWidget] = [*([self.pick] if place.can_compare else []), *tags, more]
        self._add_opener()
        self.row.addWidget(more)

    def _add_opener(self) -> None:
        """Add a button that opens or finishes the place, unless the place has no frames yet."""
        place = self.place
        if place.unfinished is not None and not place.unfinished.can_finish:
            return
        words, name = tr("Open"), tr("Open {name}", name=place.name)
        if place.unfinished is not None:
            words, name = tr("Finish"), tr("Finish {name}", name=place.name)
        elif place.current:
            words = tr("Open again")
        opener = Button(words, size="small", do=lambda: self._body.open(place))
        opener.setAccessibleName(name)
        self.row.addWidget(opener)
        self.pressed.connect(lambda: self._body.pressed(place))
        self.set_can_press()
        self.stops.insert(-1, opener)


class _Edit(KeysSheet):
    """Edits the name, tags and notes of a place, and saves them however the sheet is closed."""

    def __init__(self, host: QWidget, place: PlacesListRow, keep: Callable[..., None]) -> None:
        super().__init__(host, tr("Name, tags and notes"), 560)
        name = TextField(tr("Name of the place"), place.name)
        tags = TextField(tr("Tags, separated by commas"), tr("north light, brick"))
        notes, frame, label = QPlainTextEdit(place.notes), OutlineBox("raised", "ctl"), tr("Notes")
        name.set_text(place.name)
        tags.set_text(", ".join(place.tags))
        notes.setFont(theme().font(14))
        notes.setFrameShape(QPlainTextEdit.Shape.NoFrame)
        notes.setTabChangesFocus(True)
        notes.setAccessibleName(label)
        notes.setFixedHeight(px(160))
        column(notes, into=frame, margins=8)
        add(self.body, name, tags, column(Text(label, 12, 600, "dim"), frame, gap=4))
        self.add_button(Button(tr("Done"), kind="primary", do=self.shut))
        self.closed.connect(lambda: keep(name.text(), tags.text(), notes.toPlainText()))


class EmptyTrash(KeysSheet):
    """Asks for confirmation before places are deleted permanently.

    Attributes:
        words: The number of places and their total size, as text.
    """

    def __init__(self, host: QWidget, words: str, empty: Callable[[], None]) -> None:
        super().__init__(host, tr("Delete these places for good?"), 440)
        message = tr("{places}, with their photos. This cannot be undone.", places=words)
        self.body.addWidget(Text(message, 14, wrap=True))

        def go() -> None:
            self.shut()
            empty()

        self.add_button(Button(tr("Cancel"), do=self.shut))
        self.add_button(Button(tr("Delete"), kind="primary", do=go))


class PlacesBody(QWidget):
    """The list of places."""

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        self._commands = commands
        self.presenter = PlacesListPresenter(commands.services, commands.place_controller)
        self._state: PlacesListState | None = None
        self._lines: dict[PlacesListRow, _PlaceLine] = {}
        self._last: tuple[object, object] = (None, None)
        self._heads: list[QWidget] = []
        self._deleted_rows: list[QWidget] = []
        self._stops: list[QWidget] = []
        self._rest: Iterator[bool] = iter(())
        self._making = QTimer(self)
        self._making.timeout.connect(self._lay_more)
        self._demo = Button(tr("Try the demo place"), "pin")
        self._files = Button(tr("Open files…"), "file", do=lambda: self.leave(commands.open_files))
        self._demo.clicked.connect(lambda: self.leave(commands.place_controller.open_demo))
        example = tr("Name, date, style, tag or notes")
        self._search = TextField(tr("Search places"), example, "search", False)
        self._search.changed.connect(self._show_found)
        self._search.hide()
        self._none = Empty("")
        self._none.hide()
        self._column = column(self._none, ..., gap=8, margins=(0, 0, _BAR, 0))
        self._scroll = Scroll(boxed(self._column), name=tr("Places"))
        self._scroll.lend(self._column, px(_BAR), px(12))
        self._roving = Roving(self)
        self._roving.moved.connect(self._scroll.keep_visible)
        edge = (0, 0, _BAR, 0)
        self._compare = Button("", "grid", do=lambda: self._compare_picked())
        foot = row(self._demo, self._files, ..., self._compare, gap=8, margins=edge)
        search = row(self._search, margins=edge)
        column(search, (self._scroll, 1), foot, into=self, gap=16)
        self.destroyed.connect(self.presenter.detach)
        self.presenter.attach(self)

    def show_state(self, state: PlacesListState) -> None:
        """Show the list."""
        if state != self._state:
            self._state = state
            self._search.setVisible(len(state.rows) >= _MOST_UNSEARCHED)
            self._show_picked()
            self._show_found()

    def _show_found(self) -> None:
        """Show the places that match the search, a few rows at a time."""
        self._rest = self._lay(self._state or PlacesListState(busy=True))
        self._making.start()
        self._lay_more()

    def _lay_more(self) -> None:
        if next(self._rest, True):
            self._making.stop()

    def _lay(self, state: PlacesListState) -> Iterator[bool]:
        """Create any missing rows, then show the matches, pausing after every few rows."""
        rows, step = (state.rows, state.deleted), 0
        if rows != self._last:
            self._last = (None, None)
            yield from self._fill(state)
            self._last = rows
            self._order_stops(state)
            self._show_picked()
        query = self._search.text() if len(state.rows) >= _MOST_UNSEARCHED else ""
        matches = {place for place in state.rows if place.has(query)}
        none = tr("No places measured yet. The demo place needs no camera.")
        self._none.set(tr("No places match.") if state.rows else none)
        self._none.setVisible(not (matches or state.busy))
        for head, (_, places) in zip(self._heads, state.days, strict=True):
            head.setVisible(not matches.isdisjoint(places))
            for place in places:
                line = self._lines[place]
                if line.isHidden() == (place in matches):
                    line.setVisible(place in matches)
                    step += 1
                    if step % _AT_ONCE == 0:
                        yield False
        self._find_stop()

    def _fill(self, state: PlacesListState) -> Iterator[bool]:
        """Put the places under their days, reusing rows and pausing after every few rows."""
        stale = [line for place, line in self._lines.items() if place not in set(state.rows)]
        for widget in (*self._heads, *self._deleted_rows, *stale):
            self._column.removeWidget(widget)
            widget.hide()
            widget.deleteLater()
        self._heads, self._deleted_rows, at = [], [], 1
        self._lines = {one.place: one for one in self._lines.values() if one not in stale}
        for day, places in state.days:
            self._heads.append(self._head(day, places))
            self._column.insertWidget(at, self._heads[-1])
            for place in places:
                at += 1
                old_line = self._lines.get(place)
                if old_line is None or self._column.indexOf(old_line) != at:
                    self._lines[place] = line = old_line or _PlaceLine(place, self)
                    self._column.insertWidget(at, line)
                if old_line is None and len(self._lines) % 2 == 0:
                    yield False
            at += 1
        if state.deleted:
            lines = (self._deleted_line(each) for each in state.deleted)
            self._deleted_rows = [self._deleted_head(), *lines]
        for widget in self._deleted_rows:
            self._column.insertWidget(self._column.count() - 1, widget)

    def _order_stops(self, state: PlacesListState) -> None:
        """Make the list of places a single Tab stop that precedes the buttons below the list."""
        parts: list[Sequence[QWidget]] = [self._lines[place].stops for place in state.rows]
        parts += [one.findChildren(Button) for one in (*self._heads, *self._deleted_rows)]
        self._stops = [stop for part in parts for stop in part]
        self._roving.set_members(self._stops)
        if self._stops and self._demo.hasFocus():
            self._stops[0].setFocus(Qt.FocusReason.OtherFocusReason)
        after = [self._search, *self._stops[-1:], self._demo, self._files, self._compare]
        for one, other in pairwise(after):
            QWidget.setTabOrder(one, other)

    def _find_stop(self) -> None:
        """Move the Tab stop to a visible row."""
        usable = [stop for stop in self._stops if stop.isVisibleTo(self) and stop.isEnabled()]
        if usable and self._roving.stop not in usable:
            self._roving.set_stop(usable[0])

    def _show_picked(self) -> None:
        state = self._state or PlacesListState()
        count = len(state.picks)
        for line in self._lines.values():
            is_picked = line.place.folder in state.picks
            line.pick.set_selected(is_picked)
            full = tr("You can compare at most {count} spots at once.", count=count)
            line.pick.set_available(is_picked or state.can_pick, full)
        words = tr_plural("Compare {count} spot", "Compare {count} spots", count)
        self._compare.set_text(words if count else tr("Compare spots"))
        self._compare.set_available(count > 1, tr("Tick 2 to 6 places to compare them."))

    def search(self, words: str) -> None:
        """Show only the places whose text contains these words."""
        self._search.set_text(words)
        self._show_found()

    def leave(self, call: Callable[[], None]) -> None:
        """Close the list, then call a function."""
        self._commands.close_overlay()
        call()

    def pressed(self, place: PlacesListRow) -> None:
        """Open a place, or select it for comparison if Ctrl is held."""
        modifiers = QGuiApplication.keyboardModifiers() & Qt.KeyboardModifier.ControlModifier
        if modifiers and place.can_compare:
            self.presenter.pick(place.folder)
        else:
            self.open(place)

    def open(self, place: PlacesListRow) -> None:
        """Open a place, or finish it first if it is unfinished."""
        self.leave(lambda: self.presenter.open(place.folder))

    def _compare_picked(self) -> None:
        folders = self._state.picks if self._state else ()
        self._over(SpotsSheet(self._commands, folders, self.leave))

    def _head(self, day: str, places: Sequence[PlacesListRow]) -> QWidget:
        """Create the heading for a day.

        If the day has several places, the heading has a button that compares them.
        """
        folders = [place.folder for place in places if place.can_compare]
        count = tr_plural("{count} place", "{count} places", len(places))
        words = [Text(day, 16, 600), Text(count, 12, role="dim")]

        def on_pick() -> None:
            self.presenter.pick(*folders)
            self._compare_picked()

        compare = Button(tr("Compare spots"), "grid", kind="quiet", size="small", do=on_pick)
        compare.setAccessibleName(tr("Compare spots from {day}", day=day))
        head = boxed(row(*words, ..., *([compare] if len(folders) > 1 else []), gap=8,
                         margins=(0, 8, 0, 0)))  # fmt: skip
        head.setAccessibleName(f"{day}, {count}")
        return head

    def _deleted_head(self) -> QWidget:
        empty = Button(tr("Empty trash…"), "trash", kind="quiet", size="small")
        empty.clicked.connect(self._ask_empty)
        return boxed(row(Text(tr("Deleted"), 16, 600), ..., empty, gap=8, margins=(0, 8, 0, 0)))

    def _ask_empty(self) -> None:
        words = self._state.trash if self._state else ""
        self._over(EmptyTrash(self.window(), words, self.presenter.empty_trash))

    def _deleted_line(self, deleted: DeletedRow) -> QWidget:
        frame = PictureLine(deleted.name, None, _PICTURE)
        frame.words.addWidget(Text(deleted.name, 14, role="dim", elide=True))
        frame.words.addWidget(Text(deleted.detail, 12, role="dim", elide=True))
        back = Button(tr("Restore"), "undo", size="small")
        back.setAccessibleName(tr("Restore {name}", name=deleted.name))
        back.clicked.connect(lambda: self.presenter.restore(deleted.folder))
        frame.row.addWidget(back)
        return frame

    def show_more(self, place: PlacesListRow, under: QWidget) -> None:
        """Open the menu for a place."""
        menu = Menu(self, tr("More about {name}", name=place.name))
        menu.add(tr("Name, tags and notes…"), lambda: self._edit(place), "edit")
        menu.add(tr("Show the folder"), lambda: show_folder(place.folder), "folder")
        menu.add(tr("Delete"), lambda: self.presenter.delete(place.folder), "trash")
        menu.drop(under)

    def _edit(self, place: PlacesListRow) -> None:
        self._over(_Edit(self.window(), place, partial(self.presenter.edit, place.folder)))

    def _over(self, sheet: Sheet) -> None:
        """Open a sheet over the list.

        The sheet is deleted when it closes or when the list is deleted.
        """
        sheet.closed.connect(sheet.deleteLater)
        self.destroyed.connect(sheet.deleteLater)
        sheet.open()
