"""The middle column: the two steps, the drawings from above and from the side, and the map."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QPainter, QPen, QResizeEvent
from PySide6.QtWidgets import QGridLayout, QWidget

from app.core.text import tr
from app.ui.plots.head_views import AboveView, SideView
from app.ui.plots.lamps import LampPlot
from app.ui.plots.sky_map import SkyMap
from app.ui.screens.light.screen import LightPresenter, LightState
from app.ui.theme import Theme, px, theme
from app.ui.widgets.buttons import Button, Size
from app.ui.widgets.choices import SegmentedChoice
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column, row, stacked
from app.ui.widgets.paint import MIDDLE, PaintedWidget, put_text

_TABS: Final = (("above", tr("From above")), ("side", tr("From the side")))

_MARGIN: Final = 24
_WIDEST: Final = 480

_HEIGHT_OF_VIEWS: Final = 404 / 300

_WIDEST_OF_ALL: Final = 1200

_MAP: Final = (164, 106)  # height of the map and the text below it, normally and in a small window

_MAP_SHARE: Final = 0.23  # fraction of the width, if there is more space


class _Number(PaintedWidget):
    """The number of a step, drawn inside a ring."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self._number = str(number)
        side = px(32)
        self.setFixedSize(side, side)
        self.setAccessibleName(tr("Step {number}", number=number))

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(t.c.text, t.line_width + 0.5))
        radius = self.width() / 2.0 - 1.5
        painter.drawEllipse(QPointF(self.rect().toRectF().center()), radius, radius)
        put_text(painter, self.rect(), self._number, t.font(16, 600), t.c.text, MIDDLE)


class Middle(QWidget):
    """The two steps, the drawings and the map."""

    def __init__(self, presenter: LightPresenter, compact: bool) -> None:
        super().__init__()
        self._compact = compact
        size = 16 if compact else 20
        self._turn = Text("", size, 600, wrap=True)
        self._turn_line = Text("", 14, role="dim", wrap=not compact, elide=compact)
        self._hold = Text("", size, 600, wrap=True)
        self._hold_line = Text("", 12 if compact else 14, role="dim", wrap=True)
        tall: Size = "small" if compact else "normal"
        self.go = Button(tr("Turn first"), "turn", kind="primary", size=tall, do=presenter.turn)
        self.go.set_tip(tr("Go to the turn, then hold the lamp"), "T")
        self.above, self.side, self.map = AboveView(), SideView(), SkyMap()
        for plot in self.plots:
            plot.moved.connect(presenter.hold_at)
            plot.home_asked.connect(presenter.go_best)
            plot.power_asked.connect(presenter.step_power)
        # A single Tab stop is enough, because the map is visible in every layout.
        self.above.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.side.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self._map_title = Text(tr("Where this lamp works at this turn"), 12, 600, "dim", elide=True)
        self._map_words = Text("", 12, role="dim", elide=True)
        # If there is no room for both texts, the second moves to the tooltip.
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
        """The three plots in which the lamp can be moved."""
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
        # The text changes length while the lamp moves, but the drawings must not jump.
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
        self.tabs = SegmentedChoice(_TABS, name=tr("Drawing"))
        stack = stacked(self.above, self.side)
        self.tabs.chosen.connect(lambda key: stack.setCurrentIndex(int(key == "side")))
        column(self.tabs, (stack, 1), into=whole, gap=8)
        return whole

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the aspect ratio of the map."""
        super().resizeEvent(event)
        wide = min(self.width() - 2 * px(_MARGIN), px(_WIDEST_OF_ALL))
        least = px(_MAP[1] if self._compact else _MAP[0])
        share = 0.0 if self._compact else _MAP_SHARE
        self.map.setFixedHeight(max(least, round(wide * share)))

    def show_state(self, state: LightState) -> None:
        """Show how far to turn and where to hold the lamp."""
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
