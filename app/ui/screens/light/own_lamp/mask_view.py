"""The sheet for editing the mask of a captured lamp."""

from __future__ import annotations

from functools import partial
from typing import Final

from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.plots.mask_canvas import MaskCanvas
from app.ui.screens.light.own_lamp.mask import RADII_DEG, MaskEdit, MaskState
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.choices import LabelledSlider, SegmentedChoice
from app.ui.widgets.dialogs import KeysSheet
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import add, row

_WHAT: Final = tr(
    "The lamp is marked in amber. Remove reflections, other lights and the lit wall from the "
    "mask, and add any missing parts of the lamp."
)

_TOOLS: Final = (("lamp", tr("+ Lamp")), ("not", tr("− Not the lamp")))


class MaskSheet(KeysSheet):
    """Shows a `MaskState` and passes the user's actions to the presenter."""

    def __init__(self, host: QWidget, edit: MaskEdit) -> None:
        super().__init__(host, tr("Where the lamp is"), 840)
        self._edit = edit
        self.canvas = MaskCanvas()
        self.tool = SegmentedChoice(_TOOLS, tr("Brush"), do=lambda key: edit.set_lit(key == "lamp"))
        self.radius = LabelledSlider(
            tr("Size"), *RADII_DEG, 3.0, 0.5, lambda v: f"{v:.1f}°", inline=True
        )
        self.nearer = IconButton("plus", tr("Zoom in"), shortcut="+")
        self.farther = IconButton("minus", tr("Zoom out"), shortcut="−")
        self.back = IconButton("undo", tr("Undo the last stroke"), do=edit.undo)
        self.search = Button(tr("Find the lamp again"), "refresh", do=edit.find_again)
        self.save = Button(tr("Save"), kind="primary", do=edit.save)
        cancel = Button(tr("Cancel"), do=self.shut)
        self._words = Text("", 12, role="dim", wrap=True)
        brush = (self.tool, 8, (self.radius, 1), 8, Text(tr("Zoom"), 14, role="dim"))
        tools = row(*brush, self.farther, self.nearer, self.back, gap=8)
        add(self.body, tools, self.canvas, self._words)
        self.foot.insertWidget(0, self.search)
        self.add_button(cancel)
        self.add_button(self.save)
        self.canvas.pressed.connect(lambda a, e: edit.press((a, e)))
        self.canvas.drawn.connect(lambda a, e: edit.draw(((a, e),)))
        self.canvas.lifted.connect(edit.lift)
        self.radius.changed.connect(edit.set_radius)
        self.nearer.clicked.connect(lambda: self.canvas.zoom(1))
        self.farther.clicked.connect(lambda: self.canvas.zoom(-1))
        self.closed.connect(edit.detach)
        self.destroyed.connect(partial(_leave, edit))
        edit.attach(self)

    def show_state(self, state: MaskState) -> None:
        """Show the state."""
        self.set_title(tr("Where “{title}” is", title=state.title))
        self.canvas.show_state(state)
        self.tool.choose("lamp" if state.adds_lamp else "not")
        self.radius.set_value(state.radius_deg)
        self.back.set_available(state.can_undo, tr("Nothing painted yet."))
        self.save.set_available(state.changed and not state.busy, tr("Nothing has changed yet."))
        self.search.set_available(not state.busy)
        self._words.set_role("err" if state.error else "dim")
        self._words.set_text(state.error or f"{_WHAT} {state.gives}".strip())


def _leave(edit: MaskEdit, _sheet: object = None) -> None:
    edit.detach()
