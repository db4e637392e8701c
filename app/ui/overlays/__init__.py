"""Sheets that open over the screens: search, help, places, settings and others."""

from __future__ import annotations

from importlib import import_module
from typing import Final

from app.core.text import tr
from app.ui.shell.commands import Commands
from app.ui.widgets.dialogs import Sheet

__all__ = ["OVERLAYS", "open_overlay"]


OVERLAYS: Final = {
    "find": (tr("Find anything"), 640, "top", "find", "FindBody"),
    "help": (tr("Help and shortcuts"), 720, "centre", "help", "HelpBody"),
    "manual": (tr("Manual"), 800, "centre", "help", "ManualBody"),
    "messages": (tr("Messages"), 560, "right", "help", "MessagesBody"),
    "layers": (tr("Which layer contains the light?"), 480, "centre", "layers", "LayersBody"),
    "places": (tr("Places"), 720, "right", "places", "PlacesBody"),
    "settings": (tr("Settings"), 640, "centre", "settings", "SettingsBody"),
    "tour": (tr("How it works"), 688, "centre", "help", "TourBody"),
}
"""For each sheet: its title, width in pixels, side of the window, module and class."""


def open_overlay(what: str, commands: Commands) -> Sheet:
    """Open a sheet over the current screen.

    `what` is the sheet's key, which may be followed by a section: "manual#Match" opens the manual
    at the section "Match".
    """
    what, _, part = what.partition("#")
    title, width, side, module, body_class = OVERLAYS[what]
    sheet = Sheet(commands.window, title, width, side)  # type: ignore[arg-type]
    body = getattr(import_module(f"app.ui.overlays.{module}"), body_class)(commands)
    sheet.body.addWidget(body, 1)
    sheet.open(body.focusProxy())
    if part:
        body.show_section(part)
    return sheet
