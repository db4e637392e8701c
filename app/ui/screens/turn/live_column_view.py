"""The left-hand column: Live and Goal, the background strip, the walk and the photos taken."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QSize, Signal
from PySide6.QtGui import QMoveEvent, QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QWidget

from app.core.text import tr
from app.ui.plots.walk_plan import PlanView
from app.ui.screens.turn.background_strip import Scale
from app.ui.screens.turn.background_strip_view import BackgroundStrip
from app.ui.screens.turn.live.alignment import AlignmentState
from app.ui.screens.turn.live.alignment_view import AlignmentTools
from app.ui.screens.turn.live.live import ASPECT, CameraMenu, LiveWords
from app.ui.screens.turn.live.live_view import LiveAndGoal
from app.ui.screens.turn.live.question_view import LEAST_HEIGHT, CameraQuestion
from app.ui.screens.turn.photos.photos_view import ShotsLine
from app.ui.screens.turn.pictures import Pictures
from app.ui.theme import px
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column, fold, row
from app.words.phrases.turns import direction_words

if TYPE_CHECKING:
    from app.ui.screens.turn.screen import TurnPresenter

DEMO_CAMERA: Final = tr("Demo: camera position")
_STRIP: Final = (536, 220)
_SCROLLED: Final = 0.7  # fraction of the width; below this, the column scrolls
_WIDER: Final = 1.2
_LEAST_STRIP: Final = 320
_LEAST_PLAN: Final = 160
_LOW_PLAN: Final = 208  # height of the scale below the strip
_SCALE: Final = 64
_LOWEST_STRIP: Final = 96
_LOWEST_WELL: Final = 84
_ROOM_FOR_QUESTION: Final = 320


class LeftColumn(QWidget):
    """The left-hand column, which sizes its pictures to fit the available space."""

    arranged = Signal()
    """Emitted after the sizes of the pictures have changed."""

    def __init__(self, presenter: TurnPresenter, compact: bool) -> None:
        super().__init__()
        self._presenter = presenter
        self._compact = compact
        self._aspect = 0.0
        self._room, self._bar = QSize(), 0
        self._side = px(24)
        self.wells = LiveAndGoal(presenter)
        self.strip = BackgroundStrip()
        self.strip.stepped.connect(presenter.demo_step)
        self.plan = PlanView()
        self.shots = ShotsLine(presenter.ask_photos, presenter.turn_again)
        self.demo: LabelledSlider | None = None
        self._aligning, self._plan_width, self.strip_size = False, 0, QSize(*_STRIP)
        above, below, last = (16, 8, 8) if compact else (28, 20, 12)
        pictures = (self.wells.layout, above, self._walk_row())
        self.tools = AlignmentTools(presenter.alignment, compact)
        tools = (below, self.tools.layout, last, self.shots, ...)
        self._column = column(*pictures, *tools, into=self, margins=(24, 16, 24, 16))
        self.question: CameraQuestion | None = None

    def _walk_row(self) -> QWidget:
        """Lay out the strip and the plan. Both are hidden during the alignment."""
        self._walk = QWidget()
        strip = column(self._strip_row(), self.strip, gap=8)
        self._walks = row((strip, 1), self.plan, into=self._walk, gap=16)
        return self._walk

    def _strip_row(self) -> QHBoxLayout:
        title = Text(tr("Background"), 16, 600)
        self._arc = Text("", 14, 600, role="ok", elide=True)
        return row(title, ..., self._arc, gap=8)

    def _with_demo(self) -> LabelledSlider:
        """Return the slider for the demo's camera, creating it on first use."""
        if self.demo is None:
            self.demo = LabelledSlider(DEMO_CAMERA, -179, 180, 0, 1, _side_words)
            self.demo.changed.connect(self._presenter.demo_turn)
            self._column.insertSpacing(self._column.count() - 1, px(8))
            self._column.insertWidget(self._column.count() - 1, self.demo)
            QWidget.setTabOrder(self.shots.lister, self.demo)
            self._fit()
        return self.demo

    def fit(self, room: QSize, bar: int) -> None:
        """Fit the column into `room`, with a scroll bar `bar` wide, both in logical pixels."""
        self._room, self._bar = room, bar
        self._fit()

    def _fit(self) -> None:
        if self._room.isEmpty():
            return
        width, height = self._room.width(), self._room.height()
        well, strip, need = self._shared_out(width)
        if need > height:
            # The content is too tall, so leave room for the scroll bar.
            well, strip, _ = self._shared_out(width - self._bar)
        self.wells.set_size(well)
        self.strip_size = strip
        self.strip.setFixedHeight(strip.height() + px(_SCALE))
        stacked = self._walks.direction() is QBoxLayout.Direction.TopToBottom
        high = px(_LOW_PLAN) if stacked else strip.height() + px(_SCALE + 8 + 24)
        self.plan.setFixedSize(self._plan_width, high)
        self._column.activate()
        self._place_question()
        self.arranged.emit()

    def _shared_out(self, width: int) -> tuple[QSize, QSize, int]:
        """Return the well size, the strip size and the total height for a given width."""
        aspect = self._aspect or ASPECT
        inner = width - 2 * self._side
        fixed = self._fixed_height(self.tools.fit(inner))
        if self._aligning:
            # The single picture fills the remaining height. If it is too small, the column scrolls.
            fixed -= px(_SCALE + 24 + 8)
            fits = round((self._room.height() - fixed) * aspect)
            well_w = inner if fits < _SCROLLED * inner else min(inner, fits)
            well_h = round(well_w / aspect)
            return QSize(well_w, well_h), self.strip_size, fixed + well_h
        # The plan goes beside the strip, or below it if the strip would become too narrow.
        self._plan_width = max(inner // 3, px(_LEAST_PLAN))
        strip_w = inner - px(16) - self._plan_width
        beside = strip_w >= _LEAST_STRIP
        fold(self._walks, beside)
        if not beside:
            self._plan_width, strip_w = inner, inner
            fixed += px(16 + _LOW_PLAN)
        rest = self._room.height() - fixed
        natural = round(_STRIP[1] * strip_w / _STRIP[0])
        least = min(natural, px(_LOWEST_STRIP))
        well_w = (inner - px(16)) // 2
        well_h = min(round(well_w / aspect), max(rest - least, px(_LOWEST_WELL)))
        # In a short window the pictures are cropped slightly more to fill the width.
        well_w = min(well_w, round(well_h * aspect * _WIDER))
        tallest = max(natural, min(_STRIP[1], rest - well_h))
        strip_h = max(min(tallest, rest - well_h), least)
        return QSize(well_w, well_h), QSize(strip_w, strip_h), fixed + well_h + strip_h

    def _fixed_height(self, tools: int) -> int:
        """Return the height of everything except the pictures."""
        gaps = (16 + 8 + 8) if self._compact else (28 + 8 + 20)
        tools += px(8 if self._compact else 12) + self.shots.height()
        demo = px(8) + self.demo.sizeHint().height() if self.demo is not None else 0
        return px(2 * 16 + 32 + 6 + gaps + 24 + _SCALE) + tools + demo

    @property
    def well_size(self) -> QSize:
        """Size of each well, in logical pixels."""
        return self.wells.live.size()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the question on top of the picture when the column is resized."""
        super().resizeEvent(event)
        self._place_question()

    def moveEvent(self, event: QMoveEvent) -> None:
        """Keep the question on top of the picture when the column moves."""
        super().moveEvent(event)
        self._place_question()

    def _place_question(self) -> None:
        if self.question is None:
            return
        area = self.wells.live.geometry()
        if area.width() < px(_ROOM_FOR_QUESTION):
            area = area.united(self.wells.goal.geometry())
        # The question may overlap the controls below slightly.
        area.setHeight(max(area.height(), px(LEAST_HEIGHT)))
        self.question.setGeometry(area)

    def show_live(self, words: LiveWords) -> None:
        """Show the text on the pictures, and the camera question if it is open."""
        self.wells.show_words(words)
        self.tools.show_quality(words)
        if words.aspect != self._aspect:
            self._aspect = words.aspect
            self._fit()
        if words.asking and self.question is None:
            self.question = CameraQuestion(self, self._presenter.answer)
            self._place_question()
            self.question.show()
            before: QWidget = self.wells.more
            for answer in self.question.answers.values():
                QWidget.setTabOrder(before, answer)
                before = answer
        elif not words.asking and self.question is not None:
            self.question.hide()
            self.question.deleteLater()
            self.question = None

    def show_menu(self, menu: CameraMenu) -> None:
        """Set the entries of the live picture's menu."""
        self.wells.set_menu(menu)

    def show_pictures(self, pictures: Pictures) -> None:
        """Show the Live and Goal pictures."""
        self.wells.show_pictures(pictures)

    def show_scale(self, scale: Scale, pictures: Pictures) -> None:
        """Show the goal and the camera on the strip."""
        self.strip.set_state(scale, pictures.strip)
        self._arc.set_text(scale.arc_words)

    def show_alignment(self, state: AlignmentState) -> None:
        """Show the alignment tools. During a comparison, one picture fills the space."""
        changed = self.tools.show_state(state)
        if not changed and state.on == self._aligning:
            return
        self._aligning = state.on
        for beside in (self.wells.heading, self.wells.goal, self._walk):
            beside.setVisible(not state.on)
        self._fit()

    def show_demo(self, turn_deg: int | None) -> None:
        """Show the direction of the demo's camera."""
        if turn_deg is not None:
            self._with_demo().set_value(turn_deg)


def _side_words(turn_deg: float) -> str:
    """Describe in words the direction of the demo's camera relative to the start."""
    return direction_words(turn_deg) if round(turn_deg) else tr("at the start")
