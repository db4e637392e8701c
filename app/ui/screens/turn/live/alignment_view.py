"""The tools below the pictures: the comparison with the goal and the quality of the heading."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtWidgets import QBoxLayout, QSizePolicy

from app.core.text import tr
from app.ui.screens.turn.live.alignment import AlignmentState
from app.ui.theme import px
from app.ui.widgets.buttons import Button, Size
from app.ui.widgets.choices import LabelledSlider, SegmentedChoice
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import fold, row

if TYPE_CHECKING:
    from app.ui.screens.turn.live.alignment import AlignmentPanel
    from app.ui.screens.turn.live.live import LiveWords

_QUALITY: Final = 180  # minimum width of the text about the heading
_MODES: Final = (("overlay", tr("Overlay")), ("split", tr("Split")), ("blink", tr("Blink")))


class AlignmentTools:
    """The tools, laid out on as many lines as they need.

    Attributes:
        layout: The layout to add to the column.
    """

    def __init__(self, panel: AlignmentPanel, compact: bool) -> None:
        size: Size = "normal" if compact else "main"
        self.align = Button(tr("Start alignment"), "layers", size=size, do=panel.toggle)
        self.align.set_tip(tr("Lay the live picture over the goal"), "Space")
        self.align.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.modes = SegmentedChoice(_MODES, tr("How to compare"), do=panel.set_mode)
        self.opacity = LabelledSlider(tr("Live"), 0, 100, 45, 1, lambda v: f"{v:.0f}%", inline=True)
        self.opacity.setMaximumWidth(px(288))
        self.opacity.changed.connect(panel.set_opacity)
        self.swap = Button(tr("Swap"), "sort", do=panel.swap)
        self.swap.set_tip(tr("Show the other picture"))
        self._buttons = row(self.align, self.modes, self.swap, ..., gap=16)
        self._first = row(self._buttons, (self.opacity, 100), ..., gap=16)
        self._icon = Icon("target", 20)
        self.quality = Text("", 14, elide=True)
        second = row(self._icon, (self.quality, 1), gap=8)
        self.layout: QBoxLayout = row((self._first, 1), second, gap=16)

    def fit(self, width: int) -> int:
        """Wrap the tools to the given width, and return their height."""
        parts = [self.align, self.modes, self.swap, self.opacity]
        wide = [0 if one.isHidden() else one.minimumSizeHint().width() + px(16) for one in parts]
        fold(self.layout, width >= sum(wide) + px(_QUALITY), 16)
        fold(self._first, width >= sum(wide), 16)
        fold(self._buttons, width >= sum(wide[:3]), 16)
        return self.layout.sizeHint().height()

    def show_state(self, state: AlignmentState) -> bool:
        """Show the state, and return whether any tools have appeared or disappeared."""
        self.align.set_text(tr("Stop alignment") if state.on else tr("Start alignment"))
        self.align.set_available(
            state.available, tr("There is no live picture to lay over the goal.")
        )
        self.modes.choose(state.mode)
        self.opacity.set_value(state.opacity)
        visible = {
            self.modes: state.on,
            self.opacity: state.on and state.mode != "blink",
            self.swap: state.on and state.swaps,
        }
        changed = any(tool.isHidden() == on for tool, on in visible.items())
        for tool, on in visible.items():
            tool.setVisible(on)
        return changed

    def show_quality(self, words: LiveWords) -> None:
        """Show how reliable the heading is."""
        self.quality.set_text(words.quality)
        self._icon.set(words.quality_icon)
