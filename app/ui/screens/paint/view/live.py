"""The live column: what the strokes come to in this place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from app.ui.screens.paint.state import LiveState
from app.ui.theme import theme
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.displays import Meter, Picture
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.plots.polar import PolarPlot
from app.ui.widgets.plots.weights import WeightLegend, WeightPanorama
from app.ui.widgets.surfaces import Menu, Scroll, Surface

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from PySide6.QtGui import QResizeEvent

    from app.ui.presenters.actions import Action
    from app.ui.screens.paint.state import PaintState

_ICONS: Final = {"clockwise": "clockwise", "counter-clockwise": "counterclockwise"}
_OF_THE_PLOT: Final = " The dashed ring"
_PORTRAIT: Final = (200, 232)
_SMALL_PORTRAIT: Final = (120, 140)
_PLOT: Final = (176, 120)  # as designed, and in a low window


class _Numbers(QWidget):
    """Turn and match in figures, or a sentence why there are none."""

    probe_asked = Signal()

    def __init__(self, compact: bool) -> None:
        super().__init__()
        t = theme()
        self._turn = Text("", 48, 700, "amber")
        self._icon = Icon("clockwise", 20)
        self._direction = Text("", 14 if compact else 16, 600)
        self._match = Text("", 28, 600)
        self._meter = Meter()
        self._origin = Text("", 12, role="dim", wrap=True)
        self._sentence = Text("", 14, wrap=True)
        self._probe = Button("Go to Probe", size="small")
        self._probe.clicked.connect(self.probe_asked)
        self._figures = QWidget()
        column = QVBoxLayout(self._figures)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addWidget(Text("Turn", 14, role="dim"))
        column.addWidget(self._turn)
        # On the first line of a direction that takes two.
        beside = QVBoxLayout()
        beside.addSpacing((t.line_height(14 if compact else 16) - t.px(20)) // 2)
        beside.addWidget(self._icon)
        beside.addStretch(1)
        way = _row(t.px(4))
        way.addLayout(beside)
        way.addWidget(self._direction)
        way.addStretch(1)
        column.addLayout(way)
        column.addStretch(1)
        self._apart = compact
        self._score = QWidget()
        below = column if not compact else QVBoxLayout(self._score)
        below.setContentsMargins(0, 0, 0, 0)
        below.setSpacing(0)
        below.addWidget(Text("Match", 14, role="dim"))
        number = _row(t.px(8), self._match, Text("of 100", 14, role="dim"))
        number.addStretch(1)
        below.addLayout(number)
        below.addWidget(self._meter)
        below.addSpacing(t.px(4))
        below.addWidget(self._origin)
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, 0, 0, 0)
        whole.setSpacing(t.px(8))
        whole.addWidget(self._figures, 1)
        whole.addWidget(self._sentence)
        whole.addWidget(self._probe, 0, Qt.AlignmentFlag.AlignLeft)
        self._filler = QWidget()
        whole.addWidget(self._filler, 1)

    @property
    def score(self) -> QWidget:
        """Match with its meter, where it stands elsewhere than below the turn."""
        return self._score

    def show_state(self, state: LiveState) -> None:
        told = bool(state.sentence)
        self._figures.setVisible(not told)
        # Without a place of its own it would open as a window.
        if self._apart:
            self._score.setVisible(not told)
        self._sentence.setVisible(told)
        self._filler.setVisible(told)
        self._probe.setVisible(state.offers_probe)
        self._sentence.set_text(state.sentence)
        self._turn.set_text(state.turn)
        self._icon.setVisible(state.way in _ICONS)
        self._icon.set(_ICONS.get(state.way, "clockwise"))
        # The longer word has no room on one line beside the picture.
        self._direction.set_text(state.direction.replace("r-c", "r-\nc"))
        self._match.set_text(state.match)
        self._meter.set(state.match_value, state.limit)
        self._origin.set_text(state.origin)


class LiveColumn(Surface):
    """Picture, turn, match, panorama, plot, and saving.

    Attributes
    ----------
    laid : Signal(QSize)
        Size of the portrait, logical pixels.
    """

    save_asked = Signal()
    probe_asked = Signal()
    laid = Signal(QSize)

    def __init__(self, compact: bool, actions: Callable[[], Sequence[Action]]) -> None:
        super().__init__("panel", ("left",))
        t = theme()
        self._compact = compact
        self._actions = actions
        self._state: LiveState | None = None
        self._save_shown: tuple[str, bool, str] | None = None
        self._margin = t.px(16 if compact else 24)
        self.setFixedWidth(t.px(296 if compact else 392))
        self.setAccessibleName("Here, live")
        self._picture = Picture("The sitter at the best turn")
        self._picture.setFixedSize(*(t.px(n) for n in (_SMALL_PORTRAIT if compact else _PORTRAIT)))
        self._numbers = _Numbers(compact)
        self._numbers.probe_asked.connect(self.probe_asked)
        wide = 264 if compact else 344
        self._panorama = WeightPanorama(size=(wide, wide // 2), sitter="Sitter faces", behind="")
        self._panorama.setFixedSize(self._panorama.sizeHint())
        # It shows where the best turn leads; there is nothing to drag here.
        self._panorama.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self._panorama.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._place = QWidget()
        self._plot: PolarPlot | None = None
        self._good = Text("", 12, role="dim", wrap=True)
        self._save = Button("Save as my style", "save", "primary", "main")
        self._save.clicked.connect(self.save_asked)
        self._more = IconButton("more", "More", size="main")
        self._more.clicked.connect(self._open_menu)
        self._lay()

    def _lay(self) -> None:
        t, margin = theme(), self._margin
        self._upper = upper = QWidget()
        column = QVBoxLayout(upper)
        column.setContentsMargins(margin - t.line_width, t.px(16), margin, 0)
        column.setSpacing(0)
        head = _row(t.px(8), Text("Here, live", 20, 600))
        head.addStretch(1)
        head.addWidget(Text("follows every stroke", 12, role="dim"))
        column.addLayout(head)
        column.addSpacing(t.px(8))
        column.addLayout(_row(t.px(12 if self._compact else 16), self._picture, self._numbers))
        if self._compact:
            column.addSpacing(t.px(8))
            column.addWidget(self._numbers.score)
        column.addSpacing(t.px(16))
        self._fill_place()
        column.addWidget(self._place)
        column.addStretch(1)
        self._outer = outer = QVBoxLayout(self)
        outer.setContentsMargins(t.line_width, 0, 0, t.px(16 if self._compact else 24))
        outer.setSpacing(t.px(8))
        outer.addWidget(Scroll(upper), 1)
        foot = _row(t.px(8), self._save, self._more)
        foot.setContentsMargins(margin - t.line_width, 0, margin, 0)
        foot.setStretchFactor(self._save, 1)
        outer.addLayout(foot)

    def _fill_place(self) -> None:
        """Lay out what there is only with light."""
        t = theme()
        column = QVBoxLayout(self._place)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addWidget(Text("What it asks of this place", 12, 600, "dim"))
        column.addSpacing(t.px(6))
        column.addWidget(self._panorama)
        column.addSpacing(t.px(8))
        column.addWidget(WeightLegend())
        column.addSpacing(t.px(8))
        if self._compact:
            column.addWidget(self._good)
            return
        plot = PolarPlot(size=_PLOT[0])
        plot.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        plot.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        words = QVBoxLayout()
        words.setSpacing(t.px(8))
        words.addStretch(1)
        words.addWidget(Text("Match by turn", 14, role="dim"))
        words.addWidget(self._good)
        words.addStretch(1)
        row = _row(t.px(16), plot)
        row.addLayout(words, 1)
        column.addLayout(row)
        self._plot = plot

    def show_state(self, state: PaintState) -> None:
        """Show what the strokes come to, and whether they can be saved."""
        self._show_save(state)
        live = state.live
        if live is self._state:
            return
        before, self._state = self._state or LiveState(), live
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
        # Without the plot there is no ring to speak of.
        self._good.set_text(live.good if self._plot else live.good.partition(_OF_THE_PLOT)[0])
        if self._plot is not None and live.curve is not before.curve:
            best = live.turn_deg if live.curve else None
            self._plot.set_data(live.curve, live.limit, live.arc, best, live.peaks)

    def _show_save(self, state: PaintState) -> None:
        now = (state.save_words, state.saving, state.save_why)
        if now == self._save_shown:
            return
        self._save_shown = now
        self._save.set_text(state.save_words)
        if state.saving != self._save.busy:
            self._save.set_busy("Saving…" if state.saving else None)
        self._save.set_available(state.saving or not state.save_why, state.save_why)

    def _open_menu(self) -> None:
        menu = Menu(self._more, "More")
        for action in self._actions():
            why = "" if action.enabled() else "Save it first"
            keys = action.shortcut.split(";")[0].replace("+", " ")
            menu.add(action.words, action.run, action.icon, keys, why)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.drop(self._more)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Tell how large the portrait is."""
        super().resizeEvent(event)
        self._fit_plot()
        self.laid.emit(self._picture.size())

    def _fit_plot(self) -> None:
        """Let the plot give way in a low window, so that nothing scrolls."""
        if self._plot is None:
            return
        most, least = (theme().px(side) for side in _PLOT)
        self._plot.take_side(most)
        around = self._outer.contentsMargins()
        room = self.height() - around.bottom() - self._outer.spacing() - self._save.height()
        self._plot.take_side(max(most - max(self._upper.sizeHint().height() - room, 0), least))


def _row(spacing: int, *widgets: QWidget) -> QHBoxLayout:
    row = QHBoxLayout()
    row.setContentsMargins(0, 0, 0, 0)
    row.setSpacing(spacing)
    for widget in widgets:
        row.addWidget(widget)
    return row
