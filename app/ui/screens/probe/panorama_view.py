"""The tools above the panorama: zoom, exposure and layers."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.plots.panorama import PanoramaView
from app.ui.screens.probe.screen import ProbePresenter, ProbeState
from app.ui.theme import px, theme
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import row
from app.ui.widgets.paint import text_width
from app.words.phrases.quantities import ev_words

_ROOMY = 800  # minimum width for icons beside the labels

_LAYERS = (
    ("clipped", tr("Clipped"), "hatch", tr("Hatch the areas too bright for every frame")),
    ("lamps", tr("Lamps"), "bulb", tr("Label the lamps with letters")),
    ("grid", tr("Grid"), "grid", tr("Draw a grid of directions")),
)


class PanoramaTools(QWidget):
    """The tools on a single line, 32 pixels high."""

    def __init__(self, presenter: ProbePresenter, panorama: PanoramaView, compact: bool) -> None:
        super().__init__()
        t = theme()
        self.setFixedHeight(px(32))
        self.whole = IconButton("hand", tr("Show the whole panorama"), size="small")
        self.whole.set_tip(tr("Drag to look around; click to show the whole panorama"), "0")
        self.out = IconButton("minus", tr("Zoom out"), size="small", shortcut="−")
        self.near = IconButton("plus", tr("Zoom in"), size="small", shortcut="+")
        self.percent = Text("100%", align=Qt.AlignmentFlag.AlignHCenter)
        self.percent.setFixedWidth(text_width(t.font(14), "800%") + px(8))
        self.exposure = LabelledSlider(
            tr("Exposure"), -6.0, 6.0, 0.0, 0.1, partial(ev_words, tenths=True), inline=True
        )
        self.exposure.setToolTip(tr("Brightness of the picture; double-click to reset it"))
        self.exposure.setMaximumWidth(px(296))
        if not compact:
            self.exposure.setMinimumWidth(px(200))
        self.layers: dict[str, Button | IconButton] = {}
        self._there: bool | None = None
        near = (self.whole, self.out, self.percent, self.near, 8, Icon("sun", 20, "dim"))
        line = row(*near, (self.exposure, 1), into=self, gap=8)
        line.addStretch(0 if compact else 1)
        for key, words, icon, tip in _LAYERS:
            kind, first = (IconButton, (icon, words)) if compact else (Button, (words, icon))
            self.layers[key] = button = kind(*first, checkable=True, size="small")
            button.set_tip(tip)
            button.clicked.connect(lambda on, key=key: presenter.panorama.show_layer(key, on))
            line.addWidget(button)
        self.whole.clicked.connect(panorama.fit)
        self.out.clicked.connect(lambda: panorama.zoom_by(-1.0))
        self.near.clicked.connect(lambda: panorama.zoom_by(1.0))
        self.exposure.changed.connect(presenter.panorama.expose)
        panorama.zoom_changed.connect(lambda z: self.percent.set_text(f"{round(100 * z)}%"))
        Roving(self).set_members([self.whole, self.out, self.near])
        Roving(self).set_members(list(self.layers.values()))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Hide the icons beside the labels when space is short."""
        super().resizeEvent(event)
        roomy = self.width() >= px(_ROOMY)
        for key, words, icon, _ in _LAYERS:
            button = self.layers[key]
            if isinstance(button, Button):
                button.set_text(words, icon if roomy else "")

    def show_state(self, state: ProbeState) -> None:
        """Show the exposure and the layers."""
        self.exposure.set_value(state.exposure_ev)
        for key, button in self.layers.items():
            button.setChecked(key in state.layers)
        there = state.picture is not None and state.live is None
        if there == self._there:
            return
        self._there = there
        for widget in (self.whole, self.out, self.near, *self.layers.values()):
            widget.set_available(there, tr("There is no panorama yet."))
        self.exposure.setEnabled(there)
