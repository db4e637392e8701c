"""Find anything: actions, styles, places and heads by a few letters."""

from __future__ import annotations

from typing import TYPE_CHECKING

import shiboken6
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QVBoxLayout, QWidget

from app.core.places import list_places
from app.ui.overlays.things import ThingList
from app.ui.presenters.finding import Findable, best
from app.ui.presenters.frame import time_words
from app.ui.presenters.model import Step
from app.ui.shortcuts import written
from app.ui.theme import theme
from app.ui.widgets.fields import TextField

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.core.places import PlaceSummary
    from app.ui.commands import Commands

__all__ = ["FindBody"]


class FindBody(QWidget):
    """A field and what fits its letters.

    Parameters
    ----------
    commands : Commands
        What can be done.
    """

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        self._commands = commands
        self._things = [*_actions(commands), *_styles(commands), *_heads(commands)]
        self._places: list[Findable] = []
        self.field = TextField(
            "Find anything", "A style, a place, something to do …", "search", show_label=False
        )
        self.list = ThingList("What fits", self._take)
        self.list.follow(self.field.edit)
        self.list.setMinimumHeight(theme().px(8 * 40))
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme().px(8))
        column.addWidget(self.field)
        column.addWidget(self.list, 1)
        self.field.changed.connect(lambda _: self._show())
        self.setFocusProxy(self.field)
        self._show()
        services = commands.services
        folder = services.folders.places
        services.runner.submit(
            "find-places", lambda token, report: list_places(folder), done=self._found
        )

    def _found(self, places: tuple[PlaceSummary, ...]) -> None:
        commands = self._commands
        today = commands.services.today()
        self._places = [
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
        self.list.show_things(best(self.field.text(), [*self._things, *self._places]))

    def _take(self, thing: Findable) -> None:
        self._commands.close_overlay()
        # After the overlay is gone: what is done may open another.
        QTimer.singleShot(0, thing.run)


def _actions(commands: Commands) -> list[Findable]:
    return [
        Findable(one.words, "", one.icon or "chevron-right", written(one.shortcut), one.run)
        for one in commands.all_actions()
        if one.key != "find" and one.enabled()
    ]


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
