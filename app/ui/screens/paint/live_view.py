"""The live column: the portrait, turn, match, panorama, plot and save button."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QVBoxLayout, QWidget

from app.core.text import tr
from app.ui.plots.match_circle import PolarPlot
from app.ui.plots.weights import WeightLegend, WeightPanorama
from app.ui.presenters.window_model import COMPUTING
from app.ui.screens.paint.files import SaveState
from app.ui.screens.paint.live import LiveState
from app.ui.screens.paint.screen import PaintPresenter
from app.ui.theme import px, theme
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.displays import Meter, Picture
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import add, column, row
from app.ui.widgets.messages import StaleVeil
from app.ui.widgets.surfaces import Menu, Scroll, Surface

_ICONS: Final = {"clockwise": "clockwise", "counter-clockwise": "counterclockwise"}
_PORTRAIT: Final = (200, 232)
_SMALL_PORTRAIT: Final = (120, 140)
_PLOT: Final = (176, 120)  # side in a tall and in a short window


class _Numbers(QWidget):
    """The turn and the match, or a sentence that replaces them.

    Attributes:
        score: Match and its meter, which a compact window shows separately from the turn.
    """

    def __init__(self, compact: bool, presenter: PaintPresenter) -> None:
        super().__init__()
        t = theme()
        self._turn = Text("", 48, 700, "amber")
        self._icon = Icon("clockwise", 20)
        self._direction = Text("", 14 if compact else 16, 600, elide=True)
        self._match = Text("", 28, 600)
        self._meter = Meter()
        self._origin = Text("", 12, role="dim", wrap=True)
        self._sentence = Text("", 14, wrap=True)
        self._probe = Button(tr("Go to Probe"), size="small", do=presenter.measure)
        # Centre the icon on the first line of a two-line direction.
        beside = QVBoxLayout()
        beside.addSpacing((t.line_height(14 if compact else 16) - px(20)) // 2)
        add(beside, self._icon, ...)
        way = row(beside, self._direction, ..., gap=4)
        number = row(self._match, Text(tr("of 100"), 14, role="dim"), ..., gap=8)
        turn = (Text(tr("Turn"), 14, role="dim"), self._turn, way, ...)
        match = (Text(tr("Match"), 14, role="dim"), number, self._meter, 4, self._origin)
        self._apart = compact
        self._figures, self.score = QWidget(), QWidget()
        column(*turn, *(() if compact else match), into=self._figures)
        if compact:
            column(*match, into=self.score)
        self._filler = QWidget()
        probe = (self._probe, 0, Qt.AlignmentFlag.AlignLeft)
        whole = ((self._figures, 1), self._sentence, probe, (self._filler, 1))
        column(*whole, into=self, gap=8)

    def show_state(self, state: LiveState) -> None:
        has_words = bool(state.sentence)
        self._figures.setVisible(not has_words)
        # Without a parent, the score would open as a window.
        if self._apart:
            self.score.setVisible(not has_words)
        self._sentence.setVisible(has_words)
        self._filler.setVisible(has_words)
        self._probe.setVisible(state.offers_probe)
        self._sentence.set_text(state.sentence)
        self._turn.set_text(state.turn)
        self._icon.setVisible(state.way in _ICONS)
        self._icon.set(_ICONS.get(state.way, "clockwise"))
        self._direction.set_text(state.direction)
        self._match.set_text(state.match)
        self._meter.set(state.match_value, state.limit)
        self._origin.set_text(state.origin)


class LiveColumn(Surface):
    """The portrait, turn, match, panorama, plot and save button.

    Attributes:
        laid: Signal(QSize). Size of the portrait, in logical pixels.
    """

    laid = Signal(QSize)

    def __init__(self, compact: bool, presenter: PaintPresenter) -> None:
        super().__init__("panel", ("left",), tr("Here, live"))
        t = theme()
        self._compact = compact
        self._actions = presenter.files.actions
        self._state: LiveState | None = None
        self._save_state: SaveState | None = None
        self._margin = px(16 if compact else 24)
        self.setFixedWidth(px(296 if compact else 392))
        self._picture = Picture(tr("The sitter at the best turn"))
        self._picture.setFixedSize(*(px(n) for n in (_SMALL_PORTRAIT if compact else _PORTRAIT)))
        self._numbers = _Numbers(compact, presenter)
        wide = 264 if compact else 344
        self._panorama = WeightPanorama(
            size=(wide, wide // 2), sitter=tr("Sitter faces"), behind=""
        )
        self._panorama.setFixedSize(self._panorama.sizeHint())
        # The panorama only shows the best turn, so there is nothing to drag.
        self._panorama.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self._panorama.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._place = QWidget()
        self._plot: PolarPlot | None = None
        self._good = Text("", 12, role="dim", wrap=True)
        self._save = Button(tr("Save as my style"), "save", "primary", "main")
        self._save.clicked.connect(presenter.files.ask_save)
        self._more = IconButton("more", tr("More"), size="main", do=self._open_menu)
        self._upper = QWidget()
        head = row(
            Text(tr("Here, live"), 20, 600),
            ...,
            Text(tr("follows every stroke"), 12, role="dim", elide=True),
            gap=8,
        )
        inner = column(
            *(head, 8, row(self._picture, self._numbers, gap=12 if compact else 16)),
            *((8, self._numbers.score) if compact else ()),
            *(16, self._place, ...),
            into=self._upper,
        )
        inner.setContentsMargins(self._margin - t.line_width, px(16), self._margin, 0)
        self._fill_place()
        foot = row((self._save, 1), self._more, gap=8)
        foot.setContentsMargins(self._margin - t.line_width, 0, self._margin, 0)
        scroll = Scroll(self._upper)
        self.veil = StaleVeil(scroll, COMPUTING)
        self._outer = column((scroll, 1), foot, into=self, gap=8)
        self._outer.setContentsMargins(t.line_width, 0, 0, px(16 if compact else 24))

    def _fill_place(self) -> None:
        """Lay out the part of the column that needs light."""
        title = Text(tr("What the style needs here"), 12, 600, "dim")
        whole = column(title, 6, self._panorama, 8, WeightLegend(), 8, into=self._place)
        if self._compact:
            whole.addWidget(self._good)
            return
        plot = PolarPlot(size=_PLOT[0])
        plot.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        plot.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        words = column(..., Text(tr("Match by turn"), 14, role="dim"), self._good, ..., gap=8)
        whole.addLayout(row(plot, (words, 1), gap=16))
        self._plot = plot

    def show_state(self, live: LiveState, save: SaveState) -> None:
        """Show the answer, and whether the painting can be saved."""
        self._show_save(save)
        if live is self._state:
            return
        before, self._state = self._state or LiveState(), live
        self.veil.cover(live.stale)
        self._picture.set_picture(live.picture)
        self._picture.set_tag(live.picture_tag if live.picture is not None else "")
        self._numbers.show_state(live)
        if self._place.isHidden() == (live.panorama is not None):
            self._place.setVisible(live.panorama is not None)
            self._fit_plot()
        self._panorama.set_picture(live.panorama, live.front)
        if live.weights is not before.weights:
            self._panorama.set_target(live.weights)
        self._panorama.set_turn(live.turn_deg, live.turn_deg)
        good = live.good
        # Without the plot there is no ring to explain.
        self._good.set_text(f"{good} {live.dashed}".strip() if self._plot else good)
        if self._plot is not None and live.result is not before.result:
            best = None if live.result is None else live.turn_deg
            self._plot.set_data(live.curve, live.limit, live.arc, best, live.peaks)

    def _show_save(self, save: SaveState) -> None:
        if save == self._save_state:
            return
        self._save_state = save
        self._save.set_text(save.words)
        if save.busy != self._save.busy:
            self._save.set_busy(tr("Saving…") if save.busy else None)
        self._save.set_available(save.busy or not save.why, save.why)

    def _open_menu(self) -> None:
        menu = Menu(self._more, tr("More"))
        for action in self._actions():
            why = "" if action.enabled() else tr("Save the style first")
            keys = action.shortcut.split(";")[0].replace("+", " ")
            menu.add(action.words, action.run, action.icon, keys, why)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.drop(self._more)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Emit the size of the portrait."""
        super().resizeEvent(event)
        self._fit_plot()
        self.laid.emit(self._picture.size())

    def _fit_plot(self) -> None:
        """Shrink the plot in a short window to keep the column from scrolling."""
        if self._plot is None:
            return
        most, least = (px(side) for side in _PLOT)
        self._plot.take_side(most)
        around = self._outer.contentsMargins()
        room = self.height() - around.bottom() - self._outer.spacing() - self._save.height()
        self._plot.take_side(max(most - max(self._upper.sizeHint().height() - room, 0), least))
