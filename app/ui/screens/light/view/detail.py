"""The right column: target, with and without the lamp, match, best place and numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QPointF, QSize, Qt, Signal
from PySide6.QtGui import QPainter, QPen, QResizeEvent
from PySide6.QtWidgets import QGridLayout, QWidget

from app.core.text import tr
from app.ui.screens.light.state import DetailState, LightState
from app.ui.theme import Theme, px, theme
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.choices import Segmented
from app.ui.widgets.dialogs import Term
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import column, grid, row, stacked
from app.ui.widgets.paint import MIDDLE, Painted, put_text
from app.ui.widgets.plots.head_views import AboveView, SideView
from app.ui.widgets.plots.lamps import LampPlot, SkyMap
from app.ui.widgets.surfaces import Frame, Scroll, Surface

if TYPE_CHECKING:
    from app.ui.screens.light.presenter import LightPresenter


_TABS: Final = (("above", tr("From above")), ("side", tr("From the side")))
_WIDEST: Final = 480
_HEIGHT_OF_VIEWS: Final = 404 / 300
_WIDEST_OF_ALL: Final = 1200
_MAP: Final = (164, 106)  # height of the map with the words below it, and in a small window
_MAP_SHARE: Final = 0.23  # of the width, where there is more room


class _Number(Painted):
    """The number of a step in a ring."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self._number = str(number)
        side = px(32)
        self.setFixedSize(side, side)
        self.setAccessibleName(tr("Step {number}", number=number))

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint ring and number."""
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(t.c.text, t.line_width + 0.5))
        radius = self.width() / 2.0 - 1.5
        painter.drawEllipse(QPointF(self.rect().toRectF().center()), radius, radius)
        put_text(painter, self.rect(), self._number, t.font(16, 600), t.c.text, MIDDLE)


class Middle(QWidget):
    """Steps, drawings and map."""

    def __init__(self, presenter: LightPresenter, compact: bool) -> None:
        super().__init__()
        self._compact = compact
        size = 16 if compact else 20
        self._turn = Text("", size, 600, wrap=True)
        self._turn_line = Text("", 14, role="dim", wrap=not compact, elide=compact)
        self._hold = Text("", size, 600, wrap=True)
        self._hold_line = Text("", 12 if compact else 14, role="dim", wrap=True)
        self.go = Button(
            tr("Turn first"), "turn", kind="primary", size="small" if compact else "normal"
        )
        self.go.set_tip(tr("Go to the turn, then hold the lamp"), "T")
        self.go.clicked.connect(presenter.turn)
        self.above, self.side, self.map = AboveView(), SideView(), SkyMap()
        for plot in self.plots:
            plot.moved.connect(presenter.hold_at)
            plot.home_asked.connect(presenter.go_best)
            plot.power_asked.connect(presenter.step_power)
        # One stop for Tab: the map is in sight in every layout.
        self.above.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.side.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self._map_title = Text(tr("Where this lamp works at this turn"), 12, 600, "dim", elide=True)
        self._map_words = Text("", 12, role="dim", elide=True)
        # Where there is no room for both, the tool tip has the second.
        self._map_words.setVisible(False)
        margin = 16 if compact else _MARGIN
        inside = QWidget()
        inside.setMaximumWidth(px(_WIDEST_OF_ALL))
        whole = (..., (inside, 1000), ...)
        row(*whole, into=self, gap=None, margins=(margin, 16, margin, 8))
        title = row((self._map_title, 1), 8, self._map_words, gap=None)
        column(self._steps(), 12, (self._views(), 1000), 12, title, 4, self.map, ..., into=inside)

    @property
    def plots(self) -> tuple[LampPlot, LampPlot, LampPlot]:
        """All three on which the lamp can be moved."""
        return self.above, self.side, self.map

    def _steps(self) -> QGridLayout:
        t = theme()
        grid = QGridLayout()
        grid.setHorizontalSpacing(px(12 if self._compact else 16))
        grid.setVerticalSpacing(0)
        grid.setColumnStretch(1, 1)
        top = Qt.AlignmentFlag.AlignTop
        grid.addWidget(_Number(1), 0, 0, 2, 1, top)
        grid.addWidget(self._turn, 0, 1, top)
        rows, columns = (1, 2) if self._compact else (2, 1)
        grid.addWidget(self.go, 0, 2, rows, 1, top)
        grid.addWidget(self._turn_line, 1, 1, 1, columns, top)
        grid.setRowMinimumHeight(2, px(12))
        grid.addWidget(_Number(2), 3, 0, top)
        hold = QWidget()
        column(self._hold, self._hold_line, ..., into=hold)
        # Words grow and shrink while the lamp is moved; the drawings must not jump.
        size, lines = (16, 3) if self._compact else (20, 2)
        rest = 2 * t.line_height(12) if self._compact else t.line_height(14)
        hold.setMinimumHeight(lines * t.line_height(size) + rest)
        grid.addWidget(hold, 3, 1, 1, 2)
        return grid

    def _views(self) -> QWidget:
        whole = QWidget()
        if not self._compact:
            for view in (self.above, self.side):
                view.setMaximumWidth(px(_WIDEST))
            row(..., (self.above, 100), (self.side, 100), ..., into=whole, gap=16)
            whole.setMaximumHeight(round(px(_WIDEST) * _HEIGHT_OF_VIEWS))
            return whole
        self.tabs = Segmented(_TABS, name=tr("Drawing"))
        stack = stacked(self.above, self.side)
        self.tabs.chosen.connect(lambda key: stack.setCurrentIndex(int(key == "side")))
        column(self.tabs, (stack, 1), into=whole, gap=8)
        return whole

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Let the map keep its proportions as it grows."""
        super().resizeEvent(event)
        wide = min(self.width() - 2 * px(_MARGIN), px(_WIDEST_OF_ALL))
        least = px(_MAP[1] if self._compact else _MAP[0])
        share = 0.0 if self._compact else _MAP_SHARE
        self.map.setFixedHeight(max(least, round(wide * share)))

    def show_state(self, state: LightState) -> None:
        """Show where to turn and where to hold the lamp."""
        hold = state.hold
        self._turn.set_text(hold.turn)
        self._turn_line.set_text(hold.turn_line)
        self._hold.set_text(hold.hold)
        self._hold_line.set_text(hold.hold_line)
        self.go.set_text(hold.go, hold.go_icon)
        self.go.set_available(hold.turn_works)
        for plot in self.plots:
            plot.show_heads(state.heads)
        self.map.show_sky(state.sky)
        self._map_title.set_text(hold.map_title)
        self._map_words.set_text(state.sky.words)
        self._map_words.setVisible(not self._compact)
        if self._compact:
            self._map_title.setToolTip(state.sky.words)


_MARGIN: Final = 24
_GAP: Final = 8
_SHAPE: Final = 176 / 160
_ROWS: Final = 4


def portrait_size(width: int, compact: bool) -> QSize:
    """Size of each portrait in a column of some width, logical pixels; 160 x 176 in 376."""
    margin = px(16 if compact else _MARGIN)
    inner = (width - 2 * margin - px(_GAP)) // 2
    return QSize(inner, round(inner * (1.0 if compact else _SHAPE)))


class _MatchTile(Frame):
    """Match without and with the lamp where it is held now."""

    def __init__(self, compact: bool) -> None:
        super().__init__("raised", "none")
        t = theme()
        self._before = Text("", 20 if compact else 28, role="dim")
        self._arrow = Icon("arrow-right", 16 if compact else 20, "dim")
        self._after = Text("", 28 if compact else 36, 700)
        self._icon = Icon("check", 16, "ok")
        self._verdict = Text("", 12, wrap=True)
        if compact:
            self._verdict.setMinimumHeight(2 * t.line_height(12))
        numbers = row(self._before, self._arrow, self._after, ..., gap=8)
        verdict = row((self._icon, 0, Qt.AlignmentFlag.AlignTop), (self._verdict, 1), gap=6)
        match = Term("match", tr("Match"), (14, 400, "dim"))
        column(..., match, numbers, verdict, ..., into=self, gap=4, margins=(12, 8, 8, 8))

    def show_state(self, state: DetailState) -> None:
        self._before.set_text(state.before)
        self._after.set_text(state.after)
        self._arrow.setVisible(bool(state.after))
        inside = state.verdict == "in"
        self._icon.setVisible(bool(state.verdict))
        self._icon.set("check" if inside else "not-possible", "ok" if inside else "text")
        self._verdict.set_role("ok" if inside else "text")
        self._verdict.set_text(state.verdict_words)
        told = {"before": state.before, "after": state.after, "verdict": state.verdict_words}
        self.setAccessibleName(
            tr("Match without the lamp {before}, with it {after}, {verdict}", **told)
            if state.after
            else tr("Match without the lamp {before}", **told)
        )


class DetailColumn(Surface):
    """Everything about the chosen style with the lamp."""

    laid = Signal(QSize)
    """Portraits have another size, logical pixels."""

    def __init__(self, presenter: LightPresenter, compact: bool) -> None:
        super().__init__("panel", ("left",), tr("Chosen style with the lamp"))
        t = theme()
        self._compact = compact
        margin = px(16 if compact else _MARGIN)
        self._title = Text("", 20, 600, elide=True)
        self._side = Text("", 14, role="dim", elide=True)
        self.target = Picture(tr("Target"))
        self.with_lamp = Picture(tr("Picture with the lamp"))
        self.without = Picture(tr("Picture without the lamp"))
        self.tile = _MatchTile(compact)
        pictures = (self.target, self.with_lamp, self.without, self.tile)
        self.own = Button(tr("Capture a lamp of your own"), "plus", do=presenter.lamps.begin)
        inside = QWidget()
        power, best = self._power_row(presenter), self._best_box(presenter)
        shown = grid(*pictures, across=2, gap=(_GAP, _GAP))
        lower = (power, best, 12, self._numbers(), ...)
        inner = column(
            *(self._title, self._side, 12, shown, 12, *lower),
            into=inside,
        )
        inner.setContentsMargins(margin - t.line_width, px(16), margin, px(8))
        foot = row((self.own, 1), gap=None)
        foot.setContentsMargins(margin - t.line_width, 0, margin, 0)
        scroll = Scroll(inside, name=tr("About the chosen style"))
        whole = column((scroll, 1), foot, into=self, gap=None)
        whole.setContentsMargins(t.line_width, 0, 0, px(16))

    def _power_row(self, presenter: LightPresenter) -> QWidget:
        self.power = QWidget()
        self._power_words = Text("", 14, elide=True)
        self.weaker = IconButton("minus", tr("Turn the lamp down"), size="small", shortcut="PgDn")
        self.stronger = IconButton("plus", tr("Turn the lamp up"), size="small", shortcut="PgUp")
        self.weaker.clicked.connect(lambda: presenter.step_power(-1))
        self.stronger.clicked.connect(lambda: presenter.step_power(1))
        power = Text(tr("Power"), 14, role="dim")
        words = (self._power_words, 1)
        line = (power, words, self.weaker, self.stronger)
        row(*line, into=self.power, gap=8, margins=(0, 0, 0, 12))
        return self.power

    def _best_box(self, presenter: LightPresenter) -> Frame:
        t = theme()
        frame = Frame("none", "ctl")
        self._best = Text("", 14, 600)
        self._best_line = Text("", 14, role="dim", wrap=True)
        self._best_line.setMinimumHeight(2 * t.line_height(14))
        self.back = Button(tr("Back to the best place"), size="small", do=presenter.go_best)
        self.back.set_tip(tr("Hold the lamp at its best place"), "Home")
        title = row(Icon("ring", 16), (self._best, 1), gap=8)
        back = row(self.back, ..., gap=None)
        column(title, self._best_line, 4, back, into=frame, gap=4, margins=12)
        return frame

    def _numbers(self) -> QGridLayout:
        self._rows = [(Text("", 14, role="dim"), Text("", 14, elide=True)) for _ in range(_ROWS)]
        cells = [text for line in self._rows for text in line]
        return grid(*cells, across=2, gap=(16, 4), stretched=1)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give pictures their proportions."""
        super().resizeEvent(event)
        size = portrait_size(self.width(), self._compact)
        for widget in (self.target, self.with_lamp, self.without, self.tile):
            widget.setFixedSize(size)
        self.laid.emit(size)

    def show_state(self, state: DetailState) -> None:
        """Show a style with the lamp somewhere."""
        self._title.set_text(state.title)
        self._side.set_text(state.side)
        shown = (
            (self.target, state.target, tr("Target")),
            (self.with_lamp, state.with_lamp, tr("With the lamp")),
            (self.without, state.without, state.without_tag),
        )
        for picture, array, tag in shown:
            picture.set_picture(array)
            picture.set_tag(tag if array is not None else "")
        self.tile.show_state(state)
        self.power.setVisible(bool(state.power))
        self._power_words.set_text(state.power)
        self.weaker.set_available(state.weaker, tr("It cannot be turned down any more."))
        self.stronger.set_available(state.stronger, tr("It is at full power."))
        self._best.set_text(state.best_title)
        self._best_line.set_text(state.best_line or tr("The lamp is there."))
        self.back.set_available(not state.at_best, tr("The lamp is there already."))
        for number, (label, value) in enumerate(self._rows):
            words = state.numbers[number] if number < len(state.numbers) else ("", "")
            label.set_text(words[0])
            value.set_text(words[1])
