"""The search for actions, styles, places, lamps, heads and settings ("Find anything")."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

import shiboken6
from PySide6.QtCore import QEvent, QObject, QRect, Qt, QTimer
from PySide6.QtGui import QKeyEvent, QPainter
from PySide6.QtWidgets import QListWidgetItem, QWidget

from app.core.places.place_folder import PlaceSummary
from app.core.places.place_list import list_places
from app.core.second_light.captured_lamps.lamp_library import LampEntry, list_lamps
from app.core.second_light.lamp_presets import KINDS
from app.core.storage.settings import TABLE
from app.core.text import tr
from app.ui.presenters.actions import Findable, best, nothing_words
from app.ui.presenters.window_model import Step
from app.ui.screens.light.lamp_list import lamps_of, own_key
from app.ui.shell.commands import Commands
from app.ui.shell.shortcuts import key_text
from app.ui.theme import px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.fields import TextField
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column, stacked
from app.ui.widgets.lists import THING, BareList, Inks, Lines
from app.ui.widgets.paint import RIGHT, put_text, text_width
from app.words.lamps import lamp_title
from app.words.phrases.quantities import time_words
from app.words.settings import SECTIONS, title
from app.words.styles import full_title

_HEIGHT: Final = 40
_ENTER: Final = frozenset({Qt.Key.Key_Return, Qt.Key.Key_Enter})
_LIST_KEYS: Final = _ENTER | {
    Qt.Key.Key_Up,
    Qt.Key.Key_Down,
    Qt.Key.Key_PageUp,
    Qt.Key.Key_PageDown,
}


class _Things(Lines):
    """Paints each entry in its own row."""

    def paint_line(self, painter: QPainter, inner: QRect, thing: Any, inks: Inks) -> None:
        t, (ink, faint) = theme(), inks
        if thing.icon:
            spot = QRect(inner.left(), inner.top(), px(20), inner.height())
            draw_icon(painter, thing.icon, spot, px(20), ink)
        inner.setLeft(inner.left() + px(32))
        aside = "   ".join(part for part in (thing.detail, thing.keys) if part)
        small = t.font(12)
        put_text(painter, inner, aside, small, faint, RIGHT)
        inner.setRight(inner.right() - text_width(small, aside) - px(16))
        put_text(painter, inner, thing.words, t.font(14), ink)


class ThingList(BareList):
    """A list of entries to choose from."""

    def __init__(self, name: str, take: Callable[[Findable], None]) -> None:
        super().__init__(name)
        self._take = take
        self.setItemDelegate(_Things(self, px(_HEIGHT)))
        self.itemClicked.connect(self._on_pick)

    def show_things(self, things: Sequence[Findable]) -> None:
        """Replace the entries in the list, and select the first one."""
        self.clear()
        for thing in things:
            item = QListWidgetItem(thing.words)
            item.setData(THING, thing)
            words = ", ".join(part for part in (thing.words, thing.detail, thing.keys) if part)
            item.setData(Qt.ItemDataRole.AccessibleTextRole, words)
            self.addItem(item)
        self.setCurrentRow(0)

    def follow(self, field: QWidget) -> None:
        """Let the arrow keys and Enter operate the list while a text field keeps the focus."""
        field.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Handle key presses in the field that move the selection or run an entry."""
        del watched
        if not isinstance(event, QKeyEvent) or event.type() != QEvent.Type.KeyPress:
            return False
        handled = Qt.Key(event.key()) in _LIST_KEYS
        if handled:
            self.keyPressEvent(event)
        return handled

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Run the selected entry on Enter."""
        if Qt.Key(event.key()) in _ENTER:
            self.take_current()
        else:
            super().keyPressEvent(event)

    def take_current(self) -> None:
        """Run the selected entry."""
        item = self.currentItem()
        if item is not None:
            self._on_pick(item)

    def _on_pick(self, item: QListWidgetItem) -> None:
        self._take(item.data(THING))


class FindBody(QWidget):
    """A search field with the matches below it."""

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        self._commands = commands
        self._things = [
            *_actions(commands),
            *_styles(commands),
            *(_lamp(commands, kind, lamp_title(kind)) for kind in KINDS),
            *_heads(commands),
            *_settings(commands),
        ]
        self._items: list[Findable] = []
        self.field = TextField(
            tr("Find anything"),
            tr("A style, a place, a lamp, a setting, something to do…"),
            "search",
            show_label=False,
        )
        self.list = ThingList(tr("Matches"), self._take)
        self.list.follow(self.field.edit)
        self.nothing = Text("", role="dim", wrap=True, align=Qt.AlignmentFlag.AlignTop)
        self._pages = stacked(self.list, self.nothing)
        self._pages.setMinimumHeight(px(8 * 40))
        column(self.field, (self._pages, 1), into=self, gap=8)
        self.field.changed.connect(lambda _: self._show())
        self.setFocusProxy(self.field)
        self._show()
        services = commands.services
        folders = services.folders
        services.runner.submit(
            "find-kept",
            lambda *_: (list_places(folders.places), list_lamps(lamps_of(folders))[0]),
            done=self._on_entries,
        )

    def _on_entries(self, entries: tuple[tuple[PlaceSummary, ...], tuple[LampEntry, ...]]) -> None:
        commands = self._commands
        today = commands.services.today()
        places, lamps = entries
        self._items = [_lamp(commands, own_key(one.name), one.title) for one in lamps]
        self._items += [
            Findable(
                one.name,
                tr("place, {time}", time=time_words(one.made_at, today)),
                "places",
                "",
                partial(commands.place_controller.open_place, one.folder),
            )
            for one in places
        ]
        # By now, the sheet may have closed, and another one may have opened in its place.
        if shiboken6.isValid(self):
            self._show()

    def _show(self) -> None:
        matches = best(self.field.text(), [*self._things, *self._items])
        self.list.show_things(matches)
        self.nothing.set_text("" if matches else nothing_words(self.field.text()))
        self._pages.setCurrentWidget(self.list if matches else self.nothing)

    def _take(self, thing: Findable) -> None:
        self._commands.close_overlay()
        # Wait until the sheet has closed, because the action may open another one.
        QTimer.singleShot(0, thing.run)


def _actions(commands: Commands) -> list[Findable]:
    # List an action only once if both the screen and the window offer it.
    actions = {
        f"{one.words} {one.about}".strip(): one
        for one in commands.all_actions()
        if one.key != "find" and one.enabled()
    }
    return [
        Findable(words, "", one.icon or "chevron-right", key_text(one.shortcut), one.run)
        for words, one in actions.items()
    ]


def _settings(commands: Commands) -> list[Findable]:
    return [
        Findable(
            title(entry),
            tr("setting, {section}", section=SECTIONS[entry.section]),
            "settings",
            "",
            partial(commands.show_setting, entry.key),
        )
        for entry in TABLE
        if entry.visible
    ]


def _lamp(commands: Commands, key: str, title: str) -> Findable:
    def go() -> None:
        commands.go(Step.LIGHT)
        take = getattr(commands.window.front_presenter, "take_lamp", None)
        if take is not None:
            take(key)

    return Findable(title, tr("lamp"), "bulb", "", go)


def _styles(commands: Commands) -> list[Findable]:
    model = commands.services.model
    if model.head is None:
        return []

    def go(name: str) -> None:
        model.choose(name)
        model.update(step=Step.STYLES, painting=None)

    built_in = [(style.name, full_title(style)) for style in model.head.pack.styles]
    own = [(style.name, style.title) for style in model.user_styles]
    return [
        Findable(title, tr("style"), "styles", "", partial(go, name))
        for name, title in built_in + own
    ]


def _heads(commands: Commands) -> list[Findable]:
    place_controller = commands.place_controller
    return [
        Findable(title, tr("head"), "person", "", partial(place_controller.heads.load, name))
        for name, title in place_controller.heads.titles()
    ]
