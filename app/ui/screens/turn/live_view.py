"""The left column: live beside goal, the background as a strip, alignment, the demo's camera."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QSize, Signal
from PySide6.QtGui import QMoveEvent, QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QSizePolicy, QWidget

from app.core.text import tr
from app.ui.plots.plan import PlanView
from app.ui.screens.turn.parts_view import LEAST_HEIGHT, ShotsLine, StandQuestion, Well
from app.ui.screens.turn.source import NO_WEBCAMS
from app.ui.screens.turn.state import ASPECT, LiveWords, Pictures, Scale, Tools
from app.ui.screens.turn.strip_view import BackgroundStrip
from app.ui.theme import px
from app.ui.widgets.buttons import Button, IconButton, Size
from app.ui.widgets.choices import LabelledSlider, SegmentedChoice
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import column, row
from app.ui.widgets.surfaces import Menu
from app.words.phrases.turns import direction_words

if TYPE_CHECKING:
    from app.ui.screens.turn.screen import TurnPresenter

_STRIP: Final = (536, 220)
_SCROLLED: Final = 0.7  # of the width: below this a larger picture is worth scrolling
_WIDER: Final = 1.2
_LEAST_STRIP: Final = 320
_LEAST_PLAN: Final = 160
_LOW_PLAN: Final = 208  # where it stands below the strip
_SCALE: Final = 64
_LOWEST_STRIP: Final = 96
_LOWEST_WELL: Final = 84
_QUALITY: Final = 180  # least room for the words about the heading
_ROOM_FOR_QUESTION: Final = 320
_ROOM_FOR_WORDS: Final = 160
_MODES: Final = (("overlay", tr("Overlay")), ("split", tr("Split")), ("blink", tr("Blink")))


class LeftColumn(QWidget):
    """Shows what the camera sees and what it should see."""

    arranged = Signal()
    """Pictures have another size now."""

    def __init__(self, presenter: TurnPresenter, compact: bool) -> None:
        super().__init__()
        self._presenter = presenter
        self._compact = compact
        self._aspect = 0.0
        self._room, self._bar = QSize(), 0
        self._side = px(24)
        self._live_words, self._goal_words = (
            Text("", 14, role="dim", elide=True),
            Text("", 14, role="dim", elide=True),
        )
        self.live, self.goal = Well(tr("Live picture"), "text"), Well(tr("Goal"), "sel")
        self._more = IconButton("more", tr("Webcam"), kind="quiet", size="small")
        self._more.clicked.connect(self._open_menu)
        self._tools: Tools | None = None
        self.strip = BackgroundStrip()
        self.strip.stepped.connect(presenter.demo_step)
        self.plan = PlanView()
        self.shots = ShotsLine(presenter.ask_photos, presenter.turn_again)
        self.demo: LabelledSlider | None = None
        self._aligning, self._plan_width, self.strip_size = False, 0, QSize(*_STRIP)
        above, below, last = (16, 8, 8) if compact else (28, 20, 12)
        pictures = (self._wells_row(), above, self._walk_row())
        tools = (below, self._tools_row(), last, self.shots, ...)
        self._column = column(*pictures, *tools, into=self, margins=(24, 16, 24, 16))
        self.question: StandQuestion | None = None

    def _wells_row(self) -> QHBoxLayout:
        parts = []
        for title, words, well in (
            (tr("Live"), self._live_words, self.live),
            (tr("Goal"), self._goal_words, self.goal),
        ):
            line = QWidget()
            line.setFixedHeight(px(32))
            more = (self._more,) if well is self.live else ()
            row(Text(title, 16, 600), (words, 1), *more, into=line, gap=8)
            parts.append(column(line, well, ..., gap=6))
        self._goal_line = line
        return row(*parts, ..., gap=16)

    def _walk_row(self) -> QWidget:
        """Make what is not needed for the alignment: the strip, and the walk from above."""
        self._walk = QWidget()
        strip = column(self._strip_row(), self.strip, gap=8)
        self._walks = row((strip, 1), self.plan, into=self._walk, gap=16)
        return self._walk

    def _strip_row(self) -> QHBoxLayout:
        title = Text(tr("Background"), 16, 600)
        self._arc = Text("", 14, 600, role="ok", elide=True)
        return row(title, ..., self._arc, gap=8)

    def _tools_row(self) -> QBoxLayout:
        size: Size = "normal" if self._compact else "main"
        align = self._presenter.toggle_align
        self._align = Button(tr("Start alignment"), "layers", size=size, do=align)
        self._align.set_tip(tr("Lay the live picture over the goal"), "Space")
        self._align.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._modes = SegmentedChoice(
            _MODES, tr("How to compare"), do=self._presenter.set_align_mode
        )
        self._overlay = LabelledSlider(
            tr("Live"), 0, 100, 45, 1, lambda v: f"{v:.0f} %", inline=True
        )
        self._overlay.setMaximumWidth(px(288))
        self._overlay.changed.connect(self._presenter.set_opacity)
        self._swap = Button(tr("Swap"), "sort", do=self._presenter.swap)
        self._swap.set_tip(tr("Show the other picture"))
        self._buttons = row(self._align, self._modes, self._swap, ..., gap=16)
        self._first = row(self._buttons, (self._overlay, 100), ..., gap=16)
        self._quality_icon = Icon("target", 20)
        self._quality = Text("", 14, elide=True)
        second = row(self._quality_icon, (self._quality, 1), gap=8)
        self._rows = row((self._first, 1), second, gap=16)
        return self._rows

    def _with_demo(self) -> LabelledSlider:
        """Make the slider of the demo's camera when there is one."""
        if self.demo is None:
            self.demo = LabelledSlider(
                tr("Demo: where the camera is"), -179, 180, 0, 1, _side_words
            )
            self.demo.changed.connect(self._presenter.demo_turn)
            self._column.insertSpacing(self._column.count() - 1, px(8))
            self._column.insertWidget(self._column.count() - 1, self.demo)
            QWidget.setTabOrder(self.shots.lister, self.demo)
            self._fit()
        return self.demo

    def fit(self, room: QSize, bar: int) -> None:
        """Give every picture the size that it has in so much room, logical pixels."""
        self._room, self._bar = room, bar
        self._fit()

    def _fit(self) -> None:
        if self._room.isEmpty():
            return
        width, height = self._room.width(), self._room.height()
        well, strip, need = self._shared_out(width)
        if need > height:
            # What does not fit is scrolled to, with a bar at the side.
            well, strip, _ = self._shared_out(width - self._bar)
        for words in (self._live_words, self._goal_words):
            words.setVisible(well.width() >= px(_ROOM_FOR_WORDS))
        self.live.setFixedSize(well)
        self.goal.setFixedSize(well)
        self.strip_size = strip
        self.strip.setFixedHeight(strip.height() + px(_SCALE))
        stacked = self._walks.direction() is QBoxLayout.Direction.TopToBottom
        high = px(_LOW_PLAN) if stacked else strip.height() + px(_SCALE + 8 + 24)
        self.plan.setFixedSize(self._plan_width, high)
        self._column.activate()
        self._place_question()
        self.arranged.emit()

    def _shared_out(self, width: int) -> tuple[QSize, QSize, int]:
        """Share the room among the pictures: sizes of a well and of the strip, height of all."""
        aspect = self._aspect or ASPECT
        inner = width - 2 * self._side
        fixed = self._fixed_height(self._fold_tools(inner))
        if self._aligning:
            # One picture fills what is left; where that is little, it is scrolled.
            fixed -= px(_SCALE + 24 + 8)
            fits = round((self._room.height() - fixed) * aspect)
            well_w = inner if fits < _SCROLLED * inner else min(inner, fits)
            well_h = round(well_w / aspect)
            return QSize(well_w, well_h), self.strip_size, fixed + well_h
        # The walk from above stands beside the strip; below it where that would get too short.
        self._plan_width = max(inner // 3, px(_LEAST_PLAN))
        strip_w = inner - px(16) - self._plan_width
        beside = strip_w >= _LEAST_STRIP
        _fold(self._walks, beside)
        if not beside:
            self._plan_width, strip_w = inner, inner
            fixed += px(16 + _LOW_PLAN)
        rest = self._room.height() - fixed
        natural = round(_STRIP[1] * strip_w / _STRIP[0])
        least = min(natural, px(_LOWEST_STRIP))
        well_w = (inner - px(16)) // 2
        well_h = min(round(well_w / aspect), max(rest - least, px(_LOWEST_WELL)))
        # Where there is little height a little more is cut at top and bottom, to fill the width.
        well_w = min(well_w, round(well_h * aspect * _WIDER))
        tallest = max(natural, min(_STRIP[1], rest - well_h))
        strip_h = max(min(tallest, rest - well_h), least)
        return QSize(well_w, well_h), QSize(strip_w, strip_h), fixed + well_h + strip_h

    def _fold_tools(self, inner: int) -> int:
        """Put the tools on as many lines as they need, and give their height."""
        parts = [self._align, self._modes, self._swap, self._overlay]
        wide = [0 if one.isHidden() else one.minimumSizeHint().width() + px(16) for one in parts]
        _fold(self._rows, inner >= sum(wide) + px(_QUALITY), 16)
        _fold(self._first, inner >= sum(wide), 16)
        _fold(self._buttons, inner >= sum(wide[:3]), 16)
        return self._rows.sizeHint().height()

    def _fixed_height(self, tools: int) -> int:
        """Height of everything that is no picture."""
        gaps = (16 + 8 + 8) if self._compact else (28 + 8 + 20)
        tools += px(8 if self._compact else 12) + self.shots.height()
        demo = px(8) + self.demo.sizeHint().height() if self.demo is not None else 0
        return px(2 * 16 + 32 + 6 + gaps + 24 + _SCALE) + tools + demo

    @property
    def well_size(self) -> QSize:
        """Of both wells, logical pixels."""
        return self.live.size()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the question over the picture."""
        super().resizeEvent(event)
        self._place_question()

    def moveEvent(self, event: QMoveEvent) -> None:
        """Keep the question over the picture."""
        super().moveEvent(event)
        self._place_question()

    def _place_question(self) -> None:
        if self.question is None:
            return
        area = self.live.geometry()
        if area.width() < px(_ROOM_FOR_QUESTION):
            area = area.united(self.goal.geometry())
        # Until it is answered it may cover a little of what is below.
        area.setHeight(max(area.height(), px(LEAST_HEIGHT)))
        self.question.setGeometry(area)

    def show_live(self, words: LiveWords) -> None:
        """Say what the wells show; ask what has to be known."""
        self._live_words.set_text(words.live)
        self._goal_words.set_text(words.goal)
        # The question lies over the words.
        self.live.set_words(words.tag, words.message, words.brief, words.dim)
        self.goal.setAccessibleDescription(words.goal)
        self._more.set_tip(words.name or tr("Webcam"))
        if words.aspect != self._aspect:
            self._aspect = words.aspect
            self._fit()
        if words.asking and self.question is None:
            self.question = StandQuestion(self, self._presenter.answer)
            self._place_question()
            self.question.show()
            before: QWidget = self._more
            for answer in self.question.answers.values():
                QWidget.setTabOrder(before, answer)
                before = answer
        elif not words.asking and self.question is not None:
            self.question.hide()
            self.question.deleteLater()
            self.question = None

    def show_pictures(self, pictures: Pictures) -> None:
        """Show live and goal."""
        self.live.set_picture(pictures.live)
        self.goal.set_picture(pictures.goal)

    def show_scale(self, scale: Scale, pictures: Pictures) -> None:
        """Show where goal and camera are."""
        self.strip.set_state(scale, pictures.strip)
        self._arc.set_text(scale.arc_words)

    def show_tools(self, tools: Tools) -> None:
        """Show alignment, quality of the heading, and the demo's camera."""
        self._tools = tools
        words = tr("Stop alignment") if tools.aligning else tr("Start alignment")
        self._align.set_text(words)
        self._align.set_available(
            tools.can_align, tr("There is no live picture to lay over the goal.")
        )
        self._modes.choose(tools.align_mode)
        self._overlay.set_value(tools.opacity)
        self._show_aligning(tools)
        self._quality.set_text(tools.quality)
        self._quality_icon.set(tools.quality_icon)
        if tools.demo_deg is not None:
            self._with_demo().set_value(tools.demo_deg)

    def _show_aligning(self, tools: Tools) -> None:
        """Give the whole room to the comparison, and back."""
        slides = tools.aligning and tools.align_mode != "blink"
        visible = {
            self._modes: tools.aligning,
            self._overlay: slides,
            self._swap: tools.aligning and tools.swaps,
            self._goal_line: not tools.aligning,
            self.goal: not tools.aligning,
            self._walk: not tools.aligning,
        }
        if all(one.isHidden() != on for one, on in visible.items()):
            return
        self._aligning = tools.aligning
        for one, on in visible.items():
            one.setVisible(on)
        self._fit()

    @property
    def quality(self) -> str:
        """Words about the heading."""
        return self._quality.text()

    def _open_menu(self) -> None:
        tools = self._tools
        if tools is None:
            return
        menu = Menu(self, tr("Webcam"))
        for index, name in tools.webcams:
            here = index == tools.webcam
            menu.add(
                name,
                partial(self._presenter.choose_webcam, index),
                "check" if here else "webcam",
            )
        if not tools.webcams:
            words, why = NO_WEBCAMS
            menu.add(words, lambda: None, "webcam", why=why)
        menu.add(tr("Other camera, field of view…"), self._presenter.ask_source, "settings")
        menu.addSeparator()
        for looks, words in (
            ("sitter", tr("It looks at the sitter")),
            ("me", tr("It looks at me")),
        ):
            menu.add(
                words,
                partial(self._presenter.answer, looks),
                "check" if tools.looks == looks else "eye",
            )
        menu.addSeparator()
        sound = tr("Sound off") if tools.sounds else tr("Sound on")
        icon = "sound-off" if tools.sounds else "sound"
        menu.add(sound, self._presenter.toggle_sounds, icon, "M")
        menu.drop(self._more)


def _fold(line: QBoxLayout, beside: bool, gap: int = 0) -> None:
    """Lay parts beside each other, or below where there is no room."""
    way = QBoxLayout.Direction
    line.setDirection(way.LeftToRight if beside else way.TopToBottom)
    if gap:
        line.setSpacing(px(gap if beside else 8))


def _side_words(turn_deg: float) -> str:
    """Say on which side of the start the demo's camera is: the degrees stand in large type."""
    return direction_words(turn_deg) if round(turn_deg) else tr("at the start")
