"""The sheet in which is painted where a captured lamp is."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

from PySide6.QtWidgets import QHBoxLayout

from app.ui.presenters.light_mask import RADII_DEG
from app.ui.screens.light.asking import KeysSheet
from app.ui.theme import theme
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.labels import Text
from app.ui.widgets.plots.mask_canvas import MaskCanvas
from app.ui.widgets.segmented import Segmented
from app.ui.widgets.sliders import LabelledSlider

if TYPE_CHECKING:
    from PySide6.QtWidgets import QWidget

    from app.ui.presenters.light_mask import MaskEdit, MaskState

_WHAT: Final = (
    "Amber is lamp. Reflections, other lights and the lit wall are not: take them away, and add "
    "what is missing."
)
_TOOLS: Final = (("lamp", "+ Lamp"), ("not", "− Not the lamp"))


class MaskSheet(KeysSheet):
    """Shows a `MaskState` and tells the presenter what the user does."""

    def __init__(self, host: QWidget, edit: MaskEdit) -> None:
        super().__init__(host, "Where the lamp is", 840)
        self._edit = edit
        t = theme()
        self.canvas = MaskCanvas()
        self.tool = Segmented(_TOOLS, "Brush")
        self.radius = LabelledSlider(
            "Size", *RADII_DEG, 3.0, 0.5, lambda v: f"{v:.1f}°", inline=True
        )
        self.nearer = IconButton("plus", "Look closer", shortcut="+")
        self.farther = IconButton("minus", "See more", shortcut="−")
        self.back = IconButton("undo", "Undo the last stroke")
        self.search = Button("Find it again", "refresh")
        self.save = Button("Save", kind="primary")
        cancel = Button("Cancel")
        tools = QHBoxLayout()
        tools.setSpacing(t.px(8))
        tools.addWidget(self.tool)
        tools.addSpacing(t.px(8))
        tools.addWidget(self.radius, 1)
        tools.addSpacing(t.px(8))
        tools.addWidget(Text("Zoom", 14, role="dim"))
        for button in (self.farther, self.nearer, self.back):
            tools.addWidget(button)
        self._words = Text("", 12, role="dim", wrap=True)
        self.body.addLayout(tools)
        self.body.addWidget(self.canvas)
        self.body.addWidget(self._words)
        self.foot.insertWidget(0, self.search)
        self.add_button(cancel)
        self.add_button(self.save)
        self.canvas.pressed.connect(lambda a, e: edit.press((a, e)))
        self.canvas.drawn.connect(lambda a, e: edit.draw(((a, e),)))
        self.canvas.lifted.connect(edit.lift)
        self.tool.chosen.connect(lambda key: edit.set_lit(key == "lamp"))
        self.radius.changed.connect(edit.set_radius)
        self.nearer.clicked.connect(lambda: self.canvas.zoom(1))
        self.farther.clicked.connect(lambda: self.canvas.zoom(-1))
        self.back.clicked.connect(edit.undo)
        self.search.clicked.connect(edit.find_again)
        self.save.clicked.connect(edit.save)
        cancel.clicked.connect(self.shut)
        self.closed.connect(edit.detach)
        self.destroyed.connect(partial(_left, edit))
        edit.attach(self)

    def show_state(self, state: MaskState) -> None:
        """Show it."""
        self.set_title(f"Where “{state.title}” is")
        self.canvas.show_state(state)
        self.tool.choose("lamp" if state.lit else "not")
        self.radius.set_value(state.radius_deg)
        self.back.set_available(state.can_undo, "Nothing painted yet.")
        self.save.set_available(state.changed and not state.busy, "Nothing has changed yet.")
        self.search.set_available(not state.busy)
        self._words.set_role("err" if state.error else "dim")
        self._words.set_text(state.error or f"{_WHAT} {state.gives}".strip())


def _left(edit: MaskEdit, _sheet: object = None) -> None:
    edit.detach()
