"""The right-hand column, which shows the selected style with the lamp."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QGridLayout, QWidget

from app.core.text import tr
from app.ui.screens.light.detail import LampDetailState
from app.ui.screens.light.screen import LightPresenter
from app.ui.theme import px, theme
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.dialogs import Term
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import column, grid, row
from app.ui.widgets.surfaces import OutlineBox, Scroll, Surface

_MARGIN: Final = 24

_GAP: Final = 8

_SHAPE: Final = 176 / 160

_ROWS: Final = 4


def portrait_size(width: int, compact: bool) -> QSize:
    """Return the size of each portrait in logical pixels, such as 160 x 176 for a width of 376."""
    margin = px(16 if compact else _MARGIN)
    inner = (width - 2 * margin - px(_GAP)) // 2
    return QSize(inner, round(inner * (1.0 if compact else _SHAPE)))


class _MatchTile(OutlineBox):
    """The match without the lamp, and the match with the lamp at its current position."""

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

    def show_state(self, state: LampDetailState) -> None:
        self._before.set_text(state.before)
        self._after.set_text(state.after)
        self._arrow.setVisible(bool(state.after))
        inside = state.verdict == "in"
        self._icon.setVisible(bool(state.verdict))
        self._icon.set("check" if inside else "not-possible", "ok" if inside else "text")
        self._verdict.set_role("ok" if inside else "text")
        self._verdict.set_text(state.verdict_words)
        values = {"before": state.before, "after": state.after, "verdict": state.verdict_words}
        self.setAccessibleName(
            tr("Match without the lamp {before}, with it {after}, {verdict}", **values)
            if state.after
            else tr("Match without the lamp {before}", **values)
        )


class DetailColumn(Surface):
    """All details of the selected style with the lamp."""

    laid = Signal(QSize)
    """Emitted with the new size of the portraits, in logical pixels."""

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
        self.own = Button(tr("Capture your own lamp"), "plus", do=presenter.lamps.begin)
        inside = QWidget()
        power, best = self._power_row(presenter), self._best_box(presenter)
        picture_grid = grid(*pictures, across=2, gap=(_GAP, _GAP))
        lower = (power, best, 12, self._numbers(), ...)
        inner = column(self._title, self._side, 12, picture_grid, 12, *lower, into=inside)
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
        line = (power, (self._power_words, 1), self.weaker, self.stronger)
        row(*line, into=self.power, gap=8, margins=(0, 0, 0, 12))
        return self.power

    def _best_box(self, presenter: LightPresenter) -> OutlineBox:
        t = theme()
        frame = OutlineBox("none", "ctl")
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
        """Keep the aspect ratio of the portraits."""
        super().resizeEvent(event)
        size = portrait_size(self.width(), self._compact)
        for widget in (self.target, self.with_lamp, self.without, self.tile):
            widget.setFixedSize(size)
        self.laid.emit(size)

    def show_state(self, state: LampDetailState) -> None:
        """Show the style with the lamp at its current position."""
        self._title.set_text(state.title)
        self._side.set_text(state.side)
        rows = (
            (self.target, state.target, tr("Target")),
            (self.with_lamp, state.with_lamp, tr("With the lamp")),
            (self.without, state.without, state.without_tag),
        )
        for picture, array, tag in rows:
            picture.set_picture(array)
            picture.set_tag(tag if array is not None else "")
        self.tile.show_state(state)
        self.power.setVisible(bool(state.power))
        self._power_words.set_text(state.power)
        self.weaker.set_available(state.weaker, tr("The lamp is at its lowest power."))
        self.stronger.set_available(state.stronger, tr("The lamp is at full power."))
        self._best.set_text(state.best_title)
        self._best_line.set_text(state.best_line or tr("The lamp is in place."))
        self.back.set_available(not state.at_best, tr("The lamp is already there."))
        for number, (label, value) in enumerate(self._rows):
            words = state.numbers[number] if number < len(state.numbers) else ("", "")
            label.set_text(words[0])
            value.set_text(words[1])
