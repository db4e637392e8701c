"""The left column: live beside goal, the background as a strip, alignment, the demo's camera."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QSize, Signal
from PySide6.QtGui import QMoveEvent, QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QSizePolicy, QWidget

from app.core.text import tr
from app.core.text.turns import signed
from app.ui.screens.turn.sources import NO_WEBCAMS
from app.ui.screens.turn.state import ASPECT, LiveWords, Pictures, Scale, Tools
from app.ui.screens.turn.view.parts import LEAST_HEIGHT, Question, ShotsLine, Well
from app.ui.screens.turn.view.strip import BackgroundStrip
from app.ui.theme import px, theme
from app.ui.widgets.accessibility import set_available
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import column, row
from app.ui.widgets.surfaces import Menu

if TYPE_CHECKING:
    from app.ui.screens.turn.presenter import TurnPresenter

_STRIP: Final = (824, 220)
_SCALE: Final = 64
_LOWEST_STRIP: Final = 96
_LOWEST_WELL: Final = 84
_WIDE: Final = 720  # from this width on the tools have one row
_ROOM_FOR_QUESTION: Final = 320
_ROOM_FOR_WORDS: Final = 160
_LARGE_TEXT: Final = 1.1


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
        self._arc_words = ""
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
        self.shots = ShotsLine(presenter.ask_photos)
        self.demo: LabelledSlider | None = None
        self._demo_needs = 0
        above, below, last = (16, 8, 8) if compact else (28, 20, 12)
        pictures = (self._wells_row(), above, self._strip_row(), 8, self.strip)
        tools = (below, self._tools_row(), last, self.shots, ...)
        self._column = column(*pictures, *tools, into=self, margins=(24, 16, 24, 16))
        self.question: Question | None = None

    # -- building ------------------------------------------------------------------------------

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
        return row(*parts, ..., gap=16)

    def _strip_row(self) -> QHBoxLayout:
        short = self._compact and theme().scale > _LARGE_TEXT
        title = tr("Background") if short else tr("Background of this place")
        self._strip_title = Text(title, 16, 600, elide=True)
        scale = Text(tr("the scale counts the turn"), 14, role="dim", elide=True)
        self._check = Icon("check", 16, "ok")
        self._arc = Text("", 14, 600, role="ok", elide=True)
        beside = () if self._compact else (scale,)
        return row(self._strip_title, *beside, ..., self._check, self._arc, gap=8)

    def _tools_row(self) -> QBoxLayout:
        self._align = Button(
            tr("Start alignment"), "layers", size="normal" if self._compact else "main"
        )
        self._align.set_tip(tr("Lay the live picture over the goal"), "Space")
        self._align.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._align.clicked.connect(self._presenter.toggle_align)
        self._overlay = LabelledSlider(
            tr("Overlay"), 0, 100, 45, 1, lambda v: f"{v:.0f} %", inline=True
        )
        self._overlay.setMaximumWidth(px(288))
        self._overlay.changed.connect(self._presenter.set_opacity)
        self._first = row(self._align, (self._overlay, 100), ..., gap=24)
        self._quality_icon = Icon("target", 20)
        self._quality = Text("", 14, elide=True)
        second = row(self._quality_icon, (self._quality, 1), gap=8)
        self._rows = row((self._first, 1), second, gap=8 if self._compact else 16)
        return self._rows

    def _with_demo(self) -> LabelledSlider:
        """Make the slider of the demo's camera when there is one."""
        if self.demo is None:
            self.demo = self._make_demo(short=False)
            self._column.insertSpacing(self._column.count() - 1, px(8))
            self._column.insertWidget(self._column.count() - 1, self.demo)
            QWidget.setTabOrder(self.shots.lister, self.demo)
            self._fit()
        return self.demo

    def _make_demo(self, short: bool) -> LabelledSlider:
        name = tr("Demo camera") if short else tr("Demo: where the camera is")
        demo = LabelledSlider(name, -179, 180, 0, 1, signed, inline=not short)
        demo.changed.connect(self._presenter.demo_turn)
        return demo

    def _fit_demo(self, inner: int) -> None:
        """Put the label above the rail, and shorten it, where a line is too short for both."""
        if self.demo is None:
            return
        long = self.demo.accessibleName() != tr("Demo camera")
        needs = self.demo.minimumSizeHint().width() if long else self._demo_needs
        if long:
            self._demo_needs = needs
        if long == (needs <= inner):
            return
        old, self.demo = self.demo, self._make_demo(short=long)
        self.demo.set_value(old.amount)
        self._column.replaceWidget(old, self.demo)
        self.demo.show()
        QWidget.setTabOrder(self.shots.lister, self.demo)
        old.hide()
        old.deleteLater()

    # -- size ----------------------------------------------------------------------------------

    def fit(self, room: QSize, bar: int) -> None:
        """Give every picture the size that it has in so much room, logical pixels."""
        self._room, self._bar = room, bar
        self._fit()

    def _fit(self) -> None:
        if self._room.isEmpty():
            return
        width, height = self._room.width(), self._room.height()
        well, strip_h, needed = self._shared_out(width)
        if needed > height:
            # What does not fit is scrolled to, with a bar at the side.
            well, strip_h, _ = self._shared_out(width - self._bar)
        for words in (self._live_words, self._goal_words):
            words.setVisible(well.width() >= px(_ROOM_FOR_WORDS))
        self.live.setFixedSize(well)
        self.goal.setFixedSize(well)
        self.strip.setFixedHeight(strip_h + px(_SCALE))
        self._fit_title()
        self._column.activate()
        self._place_question()
        self.arranged.emit()

    def _fit_title(self) -> None:
        """Leave the title out where the arc would be cut: its numbers count."""
        needed = sum(words.sizeHint().width() for words in (self._strip_title, self._arc))
        room = self._room.width() - 2 * self._side - self._bar - px(16 + 4 * 8)
        self._strip_title.setVisible(not self._arc.text() or needed <= room)

    def _shared_out(self, width: int) -> tuple[QSize, int, int]:
        """Share the room among the pictures: size of a well, height of the strip, height of all."""
        aspect = self._aspect or ASPECT
        inner = width - 2 * self._side
        one_row = inner >= px(_WIDE)
        way = QBoxLayout.Direction
        self._rows.setDirection(way.LeftToRight if one_row else way.TopToBottom)
        sliders = self._align.sizeHint().width() + px(24) + self._overlay.minimumSizeHint().width()
        beside = inner >= sliders
        self._first.setDirection(way.LeftToRight if beside else way.TopToBottom)
        self._first.setSpacing(px(24 if beside else 8))
        self._fit_demo(inner)
        fixed = self._fixed_height(one_row)
        if not beside:
            fixed += px(8) + self._overlay.sizeHint().height()
        rest = self._room.height() - fixed
        natural = round(_STRIP[1] * inner / _STRIP[0])
        least = min(natural, px(_LOWEST_STRIP))
        well_w = (inner - px(16)) // 2
        well_h = min(round(well_w / aspect), max(rest - least, px(_LOWEST_WELL)))
        well_w = min(well_w, round(well_h * aspect))
        tallest = max(natural, min(_STRIP[1], rest - well_h))
        strip_h = max(min(tallest, rest - well_h), least)
        return QSize(well_w, well_h), strip_h, fixed + well_h + strip_h

    def _fixed_height(self, one_row: bool) -> int:
        """Height of everything that is no picture."""
        gaps = (16 + 8 + 8) if self._compact else (28 + 8 + 20)
        tools = self._align.sizeHint().height()
        if not one_row:
            tools += px(8 if self._compact else 16) + px(20)
        tools += px(8 if self._compact else 12) + self.shots.height()
        demo = px(8) + self.demo.sizeHint().height() if self.demo is not None else 0
        return px(2 * 16 + 32 + 6 + gaps + 24 + _SCALE) + tools + demo

    @property
    def well_size(self) -> QSize:
        """Of both wells, logical pixels."""
        return self.live.size()

    @property
    def strip_size(self) -> QSize:
        """Of the strip's picture, logical pixels."""
        return self.strip.picture_rect.size().toSize()

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

    # -- showing -------------------------------------------------------------------------------

    def show_live(self, words: LiveWords) -> None:
        """Say what the wells show; ask what has to be known."""
        self._live_words.set_text(words.live)
        self._goal_words.set_text(words.goal)
        # The question lies over the words.
        self.live.set_words(words.tag, words.message, words.dim)
        self.goal.setAccessibleDescription(words.goal)
        self._more.set_tip(words.name or tr("Webcam"))
        if words.aspect != self._aspect:
            self._aspect = words.aspect
            self._fit()
        if words.asking and self.question is None:
            self.question = Question(self, self._presenter.answer)
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
        self._check.setVisible(bool(scale.arc_words))
        if self._arc.text() != scale.arc_words:
            self._arc.set_text(scale.arc_words)
            self._fit_title()

    def show_tools(self, tools: Tools) -> None:
        """Show alignment, quality of the heading, and the demo's camera."""
        self._tools = tools
        words = tr("Stop alignment") if tools.aligning else tr("Start alignment")
        self._align.set_text(words)
        self._align.set_available(
            tools.can_align, tr("There is no live picture to lay over the goal.")
        )
        set_available(self._overlay, tools.can_align, tr("There is no live picture."))
        self._overlay.set_value(tools.opacity)
        self._quality.set_text(tools.quality)
        self._quality_icon.set(tools.quality_icon)
        if tools.demo_deg is not None:
            self._with_demo().set_value(tools.demo_deg)

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
