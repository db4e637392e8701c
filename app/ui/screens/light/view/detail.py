"""The right column: target, with and without the lamp, match, best place and numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QVBoxLayout, QWidget

from app.ui.theme import theme
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.surfaces import Frame, Scroll, Surface

if TYPE_CHECKING:
    from PySide6.QtGui import QResizeEvent

    from app.ui.screens.light.presenter import LightPresenter
    from app.ui.screens.light.state import DetailState

_MARGIN: Final = 24
_GAP: Final = 8
_SHAPE: Final = 176 / 160
_ROWS: Final = 4


def portrait_size(width: int, compact: bool) -> QSize:
    """Size of each portrait in a column of some width, logical pixels; 160 x 176 in 376."""
    t = theme()
    margin = t.px(16 if compact else _MARGIN)
    inner = (width - 2 * margin - t.px(_GAP)) // 2
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
        column = QVBoxLayout(self)
        column.setContentsMargins(t.px(12), t.px(8), t.px(8), t.px(8))
        column.setSpacing(t.px(4))
        column.addStretch(1)
        column.addWidget(Text("Match", 14, role="dim"))
        row = QHBoxLayout()
        row.setSpacing(t.px(8))
        row.addWidget(self._before)
        row.addWidget(self._arrow)
        row.addWidget(self._after)
        row.addStretch(1)
        column.addLayout(row)
        line = QHBoxLayout()
        line.setSpacing(t.px(6))
        line.addWidget(self._icon, 0, Qt.AlignmentFlag.AlignTop)
        line.addWidget(self._verdict, 1)
        column.addLayout(line)
        column.addStretch(1)

    def show_state(self, state: DetailState) -> None:
        self._before.set_text(state.before)
        self._after.set_text(state.after)
        self._arrow.setVisible(bool(state.after))
        inside = state.verdict == "in"
        self._icon.setVisible(bool(state.verdict))
        self._icon.set("check" if inside else "not-possible", "ok" if inside else "text")
        self._verdict.set_role("ok" if inside else "text")
        self._verdict.set_text(state.verdict_words)
        after = f", with it {state.after}, {state.verdict_words}" if state.after else ""
        self.setAccessibleName(f"Match without the lamp {state.before}{after}")


class DetailColumn(Surface):
    """Everything about the chosen style with the lamp."""

    laid = Signal(QSize)
    """Portraits have another size, logical pixels."""

    def __init__(self, presenter: LightPresenter, compact: bool) -> None:
        super().__init__("panel", ("left",))
        t = theme()
        self._compact = compact
        self.setAccessibleName("Chosen style with the lamp")
        margin = t.px(16 if compact else _MARGIN)
        self._title = Text("", 20, 600, elide=True)
        self._side = Text("", 14, role="dim", elide=True)
        self.target = Picture("Target")
        self.with_lamp = Picture("Picture with the lamp")
        self.without = Picture("Picture without the lamp")
        self.tile = _MatchTile(compact)
        inside = QWidget()
        column = QVBoxLayout(inside)
        column.setContentsMargins(margin - t.line_width, t.px(16), margin, t.px(8))
        column.setSpacing(0)
        column.addWidget(self._title)
        column.addWidget(self._side)
        column.addSpacing(t.px(12))
        grid = QGridLayout()
        grid.setSpacing(t.px(_GAP))
        for number, widget in enumerate((self.target, self.with_lamp, self.without, self.tile)):
            grid.addWidget(widget, number // 2, number % 2)
        self._grid = grid
        column.addLayout(grid)
        column.addSpacing(t.px(12))
        column.addWidget(self._power_row(presenter))
        column.addWidget(self._best_box(presenter))
        column.addSpacing(t.px(12))
        column.addLayout(self._numbers())
        column.addStretch(1)
        self.own = Button("Capture a lamp of your own", "plus")
        self.own.clicked.connect(presenter.shelf.begin)
        foot = QHBoxLayout()
        foot.setContentsMargins(margin - t.line_width, 0, margin, 0)
        foot.addWidget(self.own, 1)
        scroll = Scroll(inside)
        scroll.setAccessibleName("About the chosen style")
        whole = QVBoxLayout(self)
        whole.setContentsMargins(t.line_width, 0, 0, t.px(16))
        whole.addWidget(scroll, 1)
        whole.addLayout(foot)

    def _power_row(self, presenter: LightPresenter) -> QWidget:
        t = theme()
        self.power = QWidget()
        self._power_words = Text("", 14, elide=True)
        self.weaker = IconButton("minus", "Turn the lamp down", size="small", shortcut="PgDn")
        self.stronger = IconButton("plus", "Turn the lamp up", size="small", shortcut="PgUp")
        self.weaker.clicked.connect(lambda: presenter.step_power(-1))
        self.stronger.clicked.connect(lambda: presenter.step_power(1))
        row = QHBoxLayout(self.power)
        row.setContentsMargins(0, 0, 0, t.px(12))
        row.setSpacing(t.px(8))
        row.addWidget(Text("Power", 14, role="dim"))
        row.addSpacing(t.px(8))
        row.addWidget(self._power_words, 1)
        row.addWidget(self.weaker)
        row.addWidget(self.stronger)
        return self.power

    def _best_box(self, presenter: LightPresenter) -> Frame:
        t = theme()
        frame = Frame("none", "ctl")
        self._best = Text("", 14, 600)
        self._best_line = Text("", 14, role="dim", wrap=True)
        self._best_line.setMinimumHeight(2 * t.line_height(14))
        self.back = Button("Back to the best place", size="small")
        self.back.set_tip("Hold the lamp at its best place", "Home")
        self.back.clicked.connect(presenter.go_best)
        column = QVBoxLayout(frame)
        column.setContentsMargins(t.px(12), t.px(12), t.px(12), t.px(12))
        column.setSpacing(t.px(4))
        row = QHBoxLayout()
        row.setSpacing(t.px(8))
        row.addWidget(Icon("ring", 16))
        row.addWidget(self._best, 1)
        column.addLayout(row)
        column.addWidget(self._best_line)
        column.addSpacing(t.px(4))
        foot = QHBoxLayout()
        foot.addWidget(self.back)
        foot.addStretch(1)
        column.addLayout(foot)
        return frame

    def _numbers(self) -> QGridLayout:
        t = theme()
        grid = QGridLayout()
        grid.setHorizontalSpacing(t.px(16))
        grid.setVerticalSpacing(t.px(4))
        grid.setColumnStretch(1, 1)
        self._rows = [(Text("", 14, role="dim"), Text("", 14, elide=True)) for _ in range(_ROWS)]
        for number, (label, value) in enumerate(self._rows):
            grid.addWidget(label, number, 0)
            grid.addWidget(value, number, 1)
        return grid

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
            (self.target, state.target, "Target"),
            (self.with_lamp, state.with_lamp, "With the lamp"),
            (self.without, state.without, state.without_tag),
        )
        for picture, array, tag in shown:
            picture.set_picture(array)
            picture.set_tag(tag if array is not None else "")
        self.tile.show_state(state)
        self.power.setVisible(bool(state.power))
        self._power_words.set_text(state.power)
        self.weaker.set_available(state.weaker, "It cannot be turned down any more.")
        self.stronger.set_available(state.stronger, "It is at full power.")
        self._best.set_text(state.best_title)
        self._best_line.set_text(state.best_line or "The lamp is there.")
        self.back.set_available(not state.at_best, "The lamp is there already.")
        for number, (label, value) in enumerate(self._rows):
            words = state.numbers[number] if number < len(state.numbers) else ("", "")
            label.set_text(words[0])
            value.set_text(words[1])
