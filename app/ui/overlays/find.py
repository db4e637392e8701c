"""Find anything: actions, styles, places, lamps, heads and settings by a few letters."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import shiboken6
from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QStackedWidget, QVBoxLayout, QWidget

from app.core.second_light.lamp_presets import KINDS
from app.core.second_light.library import list_lamps
from app.core.storage.places import list_places
from app.core.storage.settings import TABLE
from app.ui.overlays.things import ThingList
from app.ui.presenters.finding import Findable, best, nothing_words
from app.ui.presenters.frame import time_words
from app.ui.presenters.light_lamps import lamps_of, own_key
from app.ui.presenters.model import Step
from app.ui.shortcuts import written
from app.ui.theme import theme
from app.ui.widgets.fields import TextField
from app.ui.widgets.labels import Text

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.core.second_light.library import LampEntry
    from app.core.storage.places import PlaceSummary
    from app.ui.commands import Commands


class FindBody(QWidget):
    """A field and what fits its letters."""

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        self._commands = commands
        self._things = [
            *_actions(commands),
            *_styles(commands),
            *(_lamp(commands, kind.name, kind.title) for kind in KINDS.values()),
            *_heads(commands),
            *_settings(commands),
        ]
        self._kept: list[Findable] = []
        self.field = TextField(
            "Find anything",
            "A style, a place, a lamp, a setting, something to do …",
            "search",
            show_label=False,
        )
        self.list = ThingList("What fits", self._take)
        self.list.follow(self.field.edit)
        self.nothing = Text("", role="dim", wrap=True, align=Qt.AlignmentFlag.AlignTop)
        self._pages = QStackedWidget()
        self._pages.setMinimumHeight(theme().px(8 * 40))
        for page in (self.list, self.nothing):
            self._pages.addWidget(page)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme().px(8))
        column.addWidget(self.field)
        column.addWidget(self._pages, 1)
        self.field.changed.connect(lambda _: self._show())
        self.setFocusProxy(self.field)
        self._show()
        services = commands.services
        folders = services.folders
        services.runner.submit(
            "find-kept",
            lambda token, report: (list_places(folders.places), list_lamps(lamps_of(folders))[0]),
            done=self._found,
        )

    def _found(self, kept: tuple[tuple[PlaceSummary, ...], tuple[LampEntry, ...]]) -> None:
        commands = self._commands
        today = commands.services.today()
        places, lamps = kept
        self._kept = [
            *(_lamp(commands, own_key(one.name), one.title) for one in lamps),
        ]
        self._kept += [
            Findable(
                one.name,
                f"place of {time_words(one.made_at, today)}",
                "places",
                "",
                lambda folder=one.folder: commands.desk.open_place(folder),  # type: ignore[misc]
            )
            for one in places
        ]
        # By now it may be closed, and something else be open in its place.
        if shiboken6.isValid(self):
            self._show()

    def _show(self) -> None:
        found = best(self.field.text(), [*self._things, *self._kept])
        self.list.show_things(found)
        self.nothing.set_text("" if found else nothing_words(self.field.text()))
        self._pages.setCurrentWidget(self.list if found else self.nothing)

    def _take(self, thing: Findable) -> None:
        self._commands.close_overlay()
        # After the overlay is gone: what is done may open another.
        QTimer.singleShot(0, thing.run)


def _actions(commands: Commands) -> list[Findable]:
    # What a screen offers of the window's own is in the list once.
    offered = {
        f"{one.words} {one.about}".strip(): one
        for one in commands.all_actions()
        if one.key != "find" and one.enabled()
    }
    return [
        Findable(words, "", one.icon or "chevron-right", written(one.shortcut), one.run)
        for words, one in offered.items()
    ]


def _settings(commands: Commands) -> list[Findable]:
    return [
        Findable(
            entry.title,
            f"setting, {entry.section}",
            "settings",
            "",
            partial(commands.show_setting, entry.key),
        )
        for entry in TABLE
        if entry.shown
    ]


def _lamp(commands: Commands, key: str, title: str) -> Findable:
    def go() -> None:
        commands.go(Step.LIGHT)
        take = getattr(commands.window.front_presenter, "take_lamp", None)
        if take is not None:
            take(key)

    return Findable(title, "lamp", "bulb", "", go)


def _styles(commands: Commands) -> list[Findable]:
    model = commands.services.model
    if model.head is None:
        return []

    def goto(name: str) -> Callable[[], None]:
        def go() -> None:
            model.choose(name)
            model.update(step=Step.STYLES, painting=None)

        return go

    built_in = [(style.name, style.full_title) for style in model.head.pack.styles]
    own = [(style.name, style.title) for style in model.user_styles]
    return [Findable(title, "style", "styles", "", goto(name)) for name, title in built_in + own]


def _heads(commands: Commands) -> list[Findable]:
    desk = commands.desk

    def light(name: str) -> Callable[[], None]:
        return lambda: desk.load_head(name)

    return [Findable(title, "head", "person", "", light(name)) for name, title in desk.heads()]
