"""The sheets for the photographer's lamps and camera position."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.plots.panorama import PanoramaView
from app.ui.screens.styles.lamps_and_lens import LampsState, LensState
from app.ui.widgets.choices import SegmentedChoice
from app.ui.widgets.dialogs import KeysSheet
from app.ui.widgets.fields import ListField, Toggle
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column, row
from app.words.lamps import RATIO_CHOICES
from app.words.phrases.directions import LENS_CHOICES

_BACKGROUNDS: Final = (10.0, 20.0, 45.0)  # tolerance in degrees


class LampsSheet(KeysSheet):
    """The size and the ratio of the lamps, for all styles or for the current one."""

    chosen = Signal(str, str)
    """Emitted with the keys of the chosen size and ratio."""
    kept_to_style = Signal(bool)

    def __init__(self, host: QWidget, under: QWidget) -> None:
        super().__init__(host, tr("Lamps"), 392, under=under)
        self._size = ListField(tr("Lamp size"))
        ratios = SegmentedChoice(tuple(RATIO_CHOICES.items()), name=tr("Lighting ratio"))
        self._ratio, self._own = ratios, Toggle(tr("This style only"))
        self._size.chosen.connect(lambda key: self.chosen.emit(key, ratios.key))
        ratios.chosen.connect(lambda key: self.chosen.emit(self._size.key, key))
        self._own.switched.connect(self.kept_to_style)
        label = Text(tr("Lighting ratio"), 12, 600)
        self.body.addWidget(self._size)
        self.body.addLayout(column(label, row(ratios, ...), gap=6))
        self.body.addWidget(self._own)

    def show_state(self, state: LampsState) -> None:
        """Show the current lamps."""
        self._size.set_items(state.sizes)
        self._size.choose(state.size)
        if state.ratio in RATIO_CHOICES:
            self._ratio.choose(state.ratio)
        self._own.setChecked(state.only)
        self._own.set_available(state.own, tr("A painted style has no lamps."))


class LensSheet(KeysSheet):
    """The angle of the face to the lens, and the background behind the sitter."""

    chosen = Signal(str)
    """Emitted with a key from `LENS_CHOICES`."""
    background_chosen = Signal(object, float)
    """Emitted with a panorama azimuth (or None for any background) and a tolerance, in degrees."""

    def __init__(self, host: QWidget, under: QWidget, behind: Callable[[], float]) -> None:
        super().__init__(host, tr("Lens"), 480, under=under)
        self._face = ListField(tr("Face"), tuple(LENS_CHOICES.items()))
        self._face.chosen.connect(self.chosen)
        self._toggle, self._state = Toggle(tr("Choose the background")), LensState()
        self._panorama = PanoramaView(tr("Background behind the sitter"))
        self._panorama.set_marker_words(tr("Middle of the background"))
        self._panorama.marker_released.connect(lambda at: self._ask(at, self._state.width))
        widths = tuple((f"{width:g}", f"± {width:g}°") for width in _BACKGROUNDS)
        self._width = SegmentedChoice(widths, name=tr("Tolerance of the background"))
        self._width.chosen.connect(lambda key: self._ask(self._state.background, float(key)))
        self._toggle.switched.connect(
            lambda on: self._ask(behind() if on else None, self._state.width)
        )
        parts = (self._face, self._toggle, self._panorama, row(self._width, ...))
        self.body.addLayout(column(*parts, gap=12))

    def _ask(self, middle: float | None, width: float) -> None:
        self.background_chosen.emit(middle, width)

    def show_state(self, state: LensState) -> None:
        """Show the current camera position."""
        self._state, on = state, state.background is not None
        self._face.choose(state.key)
        self._toggle.setChecked(on)
        self._panorama.setVisible(on)
        self._width.setVisible(on)
        self._panorama.set_picture(state.panorama)
        if state.background is not None:
            self._panorama.set_front(state.background)
            self._width.choose(f"{state.width:g}")
