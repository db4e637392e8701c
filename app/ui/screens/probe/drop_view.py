"""The file row: a drop area, and buttons for opening files and watching a folder."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.presenters.window_frame import WHAT_TO_DROP
from app.ui.theme import px
from app.ui.widgets.buttons import Button
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import row
from app.ui.widgets.surfaces import OutlineBox

_DROP_SHORT: Final = tr("Drop files here")


class DropRow(QWidget):
    """Shows where to drop files, or which folder is being watched."""

    def __init__(
        self,
        ask_files: Callable[[], None],
        ask_folder: Callable[[], None],
        stop_watching: Callable[[], None],
        compact: bool,
    ) -> None:
        super().__init__()
        height = px(40 if compact else 56)
        self._ask_folder, self._stop_watching = ask_folder, stop_watching
        self._idle = _DROP_SHORT if compact else WHAT_TO_DROP
        self._watching = False
        self._zone = OutlineBox("none", "ctl", dashed=True)
        self._words = Text("", 14, role="dim", elide=True)
        self._icon = Icon("folder", 20, "dim")
        row(self._icon, (self._words, 1), into=self._zone, gap=12, margins=(20, 0, 16, 0))
        self.open_button = Button(tr("Open files…"), do=ask_files)
        self.open_button.set_tip(tr("Open panoramas, brackets or photos"), "Ctrl+O")
        self.watch_button = Button(tr("Watch a folder…"), do=self._watch)
        self.watch_button.set_tip(tr("Turn each bracket that arrives in a folder into a place"))
        row((self._zone, 1), self.open_button, self.watch_button, into=self, gap=8)
        for widget in (self, self.open_button, self.watch_button):
            widget.setFixedHeight(height)

    def show_watching(self, folder: str) -> None:
        """Show the name of the watched folder, or the drop area if `folder` is empty."""
        self._watching = bool(folder)
        watching = tr("Watching {folder}: new brackets open here", folder=folder)
        self._words.set_text(watching if folder else self._idle)
        self._icon.set("eye" if folder else "folder")
        self.watch_button.set_text(tr("Stop watching") if folder else tr("Watch a folder…"))

    def _watch(self) -> None:
        if self._watching:
            self._stop_watching()
        else:
            self._ask_folder()
