"""The sheet for choosing which layer of a panorama contains the light."""

from __future__ import annotations

from functools import partial

from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.shell.commands import Commands
from app.ui.widgets.buttons import Button
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column
from app.ui.widgets.surfaces import Scroll


class LayersBody(QWidget):
    """A list of buttons, one per layer, each of which opens the panorama with its layer."""

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        self._commands = commands
        words = tr(
            "This file has several layers. The one with the light is often named “beauty” or "
            "“combined”."
        )
        self.buttons = [
            Button(name, do=partial(self._take, name)) for name in commands.place_controller.layers
        ]
        inside = QWidget()
        column(*self.buttons, ..., into=inside, gap=8, margins=(0, 0, 16, 0))
        column(Text(words, wrap=True), (Scroll(inside, 320, tr("Layers")), 1), into=self, gap=16)
        if self.buttons:
            self.setFocusProxy(self.buttons[0])

    def _take(self, name: str) -> None:
        self._commands.close_overlay()
        self._commands.place_controller.choose_layer(name)
