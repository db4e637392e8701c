"""What lies over the screens for a moment, because it was asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.ui.widgets.dialogs import Sheet

if TYPE_CHECKING:
    from collections.abc import Callable

    from PySide6.QtWidgets import QWidget

    from app.ui.shell.commands import Commands

__all__ = ["open_overlay"]


def _find(commands: Commands) -> QWidget:
    from app.ui.overlays.find import FindBody

    return FindBody(commands)


def _help(commands: Commands) -> QWidget:
    from app.ui.overlays.help import HelpBody

    return HelpBody(commands)


def _messages(commands: Commands) -> QWidget:
    from app.ui.overlays.messages import MessagesBody

    return MessagesBody(commands)


def _places(commands: Commands) -> QWidget:
    from app.ui.overlays.places import PlacesBody

    return PlacesBody(commands)


def _settings(commands: Commands) -> QWidget:
    from app.ui.overlays.settings import SettingsBody

    return SettingsBody(commands)


def _tour(commands: Commands) -> QWidget:
    from app.ui.overlays.tour import TourBody

    return TourBody(commands)


_KINDS: Final[dict[str, tuple[str, int, str, Callable[[Commands], QWidget]]]] = {
    "find": ("Find anything", 640, "top", _find),
    "help": ("Help and shortcuts", 720, "centre", _help),
    "messages": ("Messages", 560, "right", _messages),
    "places": ("Places", 560, "right", _places),
    "settings": ("Settings", 640, "centre", _settings),
    "tour": ("How it works", 640, "centre", _tour),
}


def open_overlay(what: str, commands: Commands) -> Sheet:
    """Open something over the screen in front."""
    title, width, side, make = _KINDS[what]
    sheet = Sheet(commands.window, title, width, side)  # type: ignore[arg-type]
    body = make(commands)
    sheet.body.addWidget(body, 1)
    sheet.open(body.focusProxy())
    return sheet
