"""The right-hand column, from the ways to measure at the top to the buttons at the bottom."""

from __future__ import annotations

from functools import partial
from typing import Final

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.screens.probe.capture.camera_view import CameraHead, CameraPanel
from app.ui.screens.probe.capture.checklist import CHECKS
from app.ui.screens.probe.capture.checklist_view import CheckTile
from app.ui.screens.probe.capture.frames_view import FramesGrid
from app.ui.screens.probe.capture.notice import Notice
from app.ui.screens.probe.screen import ProbePresenter, ProbeState
from app.ui.screens.probe.ways import WAYS
from app.ui.theme import px
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.buttons import Button
from app.ui.widgets.choices import SegmentedChoice
from app.ui.widgets.fields import Toggle
from app.ui.widgets.labels import Role, Text
from app.ui.widgets.layouts import Item, boxed, clear, column, grid, row
from app.ui.widgets.messages import Banner
from app.ui.widgets.surfaces import Scroll, Surface

_WIDTH: Final = 440

_COMPACT_WIDTH: Final = 360

_WIDEST: Final = 560

_ICONS: Final[dict[str, tuple[str, Role]]] = {
    "advice": ("warning", "text"),
    "error": ("error", "err"),
    "offer": ("refresh", "text"),
    "note": ("info", "text"),
}

_PLANS: Final = (("paper", tr("Quick"), " "), ("full", tr("Full range"), " "))

_TIMERS: Final = (("0", tr("Off")), ("2", "2 s"), ("5", "5 s"), ("10", "10 s"))


class CameraColumn(Surface):
    """The controls for measuring light."""

    def __init__(self, presenter: ProbePresenter, compact: bool) -> None:
        super().__init__("panel", ("left",))
        self._presenter = presenter
        self._compact = compact
        self._state: ProbeState | None = None
        self._keys: tuple[str, ...] = ()
        self._buttons_shown: tuple[object, ...] = ()
        self.setProperty("noFocusRing", True)
        self._margin = 16 if compact else 24
        self.setFixedWidth(px(_COMPACT_WIDTH if compact else _WIDTH))
        titles = [(key, way.title) for key, way in WAYS.items()]
        self.way = SegmentedChoice(
            titles, tr("Measure with"), equal=True, do=partial(presenter.set, "measure_with")
        )
        self._steps = column(gap=12, margins=(0, 0, 0, 16))
        self.steps = boxed(self._steps)
        self.mirrored = Toggle(tr("Mirrored"))
        self.mirrored.switched.connect(lambda on: presenter.set("mirrored", on))
        self.mirrored.setToolTip(tr("Some phones save selfies as mirror images"))
        self.head = CameraHead(presenter.cameras, compact)
        self.panel = CameraPanel(presenter.cameras)
        self.plan = SegmentedChoice(
            _PLANS, tr("Plan"), equal=True, do=partial(presenter.set, "plan")
        )
        self.timer = SegmentedChoice(_TIMERS, tr("Self-timer"), equal=True)
        self.timer.chosen.connect(lambda key: presenter.set_timer(int(key)))
        self.checks = [CheckTile(check, compact) for check in CHECKS]
        self.frames = FramesGrid()
        self.rough = Text("", 14, wrap=True)
        self.banner = Banner("info", " ", actions=(" ",))
        ways = self._inset(self._headed(tr("Measure with"), self.way))
        head = self._inset(self.head)
        scroll = Scroll(self._middle(), name=tr("Capture"))
        scroll.lend(self._content, px(self._margin))
        edge, gap = (12, 8) if compact else (16, 12)
        parts = (ways, gap, head, gap, (scroll, 1), gap, self._inset(self._buttons()))
        column(*parts, into=self, margins=(0, edge, 0, edge))
        self.banner.pressed.connect(lambda number: presenter.press(self._keys[number]))

    def take_width(self, free: int) -> None:
        """Grow to fill the free width, which is given in logical pixels."""
        least = px(_COMPACT_WIDTH if self._compact else _WIDTH)
        most = least if self._compact else px(_WIDEST)
        self.setFixedWidth(min(max(free, least), most))

    def _inset(self, widget: QWidget) -> QWidget:
        box = QWidget()
        row(widget, into=box, margins=(self._margin, 0, self._margin, 0))
        return box

    def _middle(self) -> QWidget:
        gap = 8 if self._compact else 12
        content = QWidget()
        self._content = column(
            self.steps,
            self.mirrored,
            self.panel,
            self._preview_row(),
            self._plans(),
            gap,
            self._checklist(),
            gap,
            self._frames(),
            gap,
            self.rough,
            self.banner,
            ...,
            into=content,
            margins=(self._margin, 4, self._margin, 4),
        )
        return content

    def _headed(self, words: str, *parts: Item) -> QWidget:
        """Put widgets under a heading. The narrow layout omits the heading."""
        head = [] if self._compact else [Text(words, 12, 600, "dim")]
        return boxed(column(*head, *parts, gap=6))

    def _preview_row(self) -> QWidget:
        self.preview = Button(" ", "eye", size="small", do=self._presenter.preview)
        self._preview_box = boxed(
            column(row(self.preview, ..., gap=None), 8 if self._compact else 12)
        )
        return self._preview_box

    def _plans(self) -> QWidget:
        line = row(Text(tr("Self-timer"), 12, 600, "dim"), (self.timer, 1), gap=16)
        self._plans_box = self._headed(tr("Plan"), self.plan, 2 if self._compact else 6, line)
        return self._plans_box

    def _checklist(self) -> QWidget:
        for tile in self.checks:
            tile.clicked.connect(lambda _on=False, key=tile.key: self._presenter.tick_off(key))
        tiles = grid(*self.checks, across=4 if self._compact else 2, gap=(8, 8))
        self._checks_box = self._headed(tr("Before you press"), tiles)
        Roving(self._checks_box).set_members(self.checks)
        return self._checks_box

    def _frames(self) -> QWidget:
        self._frames_note = Text("", 12, role="dim")
        line = row(Text(tr("Frames"), 12, 600, "dim"), ..., self._frames_note, gap=None)
        self._frames_box = boxed(column(line, self.frames, gap=6))
        return self._frames_box

    def _buttons(self) -> QWidget:
        presenter = self._presenter
        self.capture = Button(tr("Capture"), "camera", "primary", "main", do=presenter.capture)
        self.capture.set_tip(tr("Meter, take the frames and merge them"), "Space")
        icon = "" if self._compact else "camera"
        self.again = Button(tr("Capture again"), icon, size="main", do=presenter.capture)
        self.again.set_tip(tr("Measure this spot again"), "Space")
        self.styles = Button(tr("See the styles"), "", "primary", "main", trailing="chevron-right")
        self.styles.set_tip(tr("Continue to the styles"), "Enter")
        self.styles.clicked.connect(presenter.see_styles)
        self.stop = Button(tr("Cancel"), "cancel", size="main", do=presenter.taking.cancel)
        self.stop.set_tip(tr("Stop, and restore the camera’s settings"), "Esc")
        parts = ((self.capture, 1), (self.again, 4), (self.styles, 5), (self.stop, 1))
        wide = self.again.sizeHint().width() + self.styles.sizeHint().width() + px(8)
        fits = wide <= self.width() - 2 * px(self._margin)
        return boxed((row if fits else column)(*parts, gap=8))

    def show_state(self, state: ProbeState) -> None:
        """Show the state, updating only the parts that have changed."""
        before, self._state = self._state, state
        if before is None or state.way != before.way:
            self._show_way(state.way)
        if before is None or state.camera != before.camera:
            self.head.show_block(state.camera)
            self.panel.show_block(state.camera)
        for part in state.plans:
            self.plan.set_text(part.key, part.title, part.second)
        self.plan.choose(state.plan)
        self.mirrored.setChecked(state.mirrored)
        self.timer.choose(str(state.timer_s))
        for tile in self.checks:
            tile.show_ticked(tile.key in state.ticked)
        self._frames_box.setVisible(bool(state.frames))
        self.frames.show_tiles(state.frames)
        self._frames_note.set_text(state.frames_note)
        if before is None or state.notice != before.notice:
            self._show_notice(state.notice)
        self._show_running(state)
        self._show_buttons(state)

    def _show_way(self, key: str) -> None:
        """Show only the controls that this way of measuring needs."""
        way, camera = WAYS[key], key == "camera"
        self.way.choose(key)
        clear(self._steps)
        for number, words in enumerate(way.steps, 1):
            badge = Text(str(number), 14, 600, "dim")
            line = (badge, 0, Qt.AlignmentFlag.AlignTop), (Text(words, 14, wrap=True), 1)
            self._steps.addWidget(boxed(row(*line, gap=12)))
        self.steps.setVisible(bool(way.steps))
        self.mirrored.setVisible(key == "film")
        for part in (self.head, self._plans_box):
            part.setVisible(camera)
        icon = "" if self._compact else "camera"
        self.capture.set_text(*((tr("Capture"), "camera") if camera else (way.button, "folder")))
        self.again.set_text(tr("Capture again") if camera else way.button, icon if camera else "")

    def _show_notice(self, notice: Notice | None) -> None:
        self.banner.setVisible(notice is not None)
        if notice is not None:
            icon, role = _ICONS[notice.tone]
            self._keys = tuple(key for key, _ in notice.buttons)
            words = [words for _, words in notice.buttons]
            self.banner.set(icon, notice.title, notice.body, words, role)

    def _show_running(self, state: ProbeState) -> None:
        running = state.running
        self.rough.say("" if running is None else running.rough)
        # Once all exposures are taken, the checklist makes room for the advice.
        advised = running is None and bool(state.frames) and state.notice is not None
        over = advised or (running is not None and (running.sign.kind == "move" or self._compact))
        camera = state.way == "camera"
        self.panel.setVisible(camera and state.camera.open)
        self._checks_box.setVisible(camera and not over)
        for widget in (self.way, self.plan, self.timer, self.mirrored, self.head.change):
            widget.setEnabled(running is None)
        live, is_live = WAYS[state.way].live, state.live is not None
        self._preview_box.setVisible(bool(live) and running is None)
        if live:
            begin, end, tip = live
            self.preview.set_text(end if is_live else begin)
            self.preview.set_tip(tip, "L")
        self.preview.set_available(is_live or state.can_capture, state.why_not)

    def _show_buttons(self, state: ProbeState) -> None:
        stopping = state.running is not None and state.running.stopping
        state_key = (
            state.running is None,
            stopping,
            state.has_place,
            state.can_capture,
            state.why_not,
        )
        if state_key == self._buttons_shown:
            return
        self._buttons_shown = state_key
        idle = state.running is None
        mine = (self, self.capture, self.again, self.styles, self.stop)
        had_focus = any(widget.hasFocus() for widget in mine)
        if had_focus:
            # Otherwise the next control would get the focus and react to the next key press.
            self.setFocus()
        self.capture.setVisible(idle and not state.has_place)
        self.again.setVisible(idle and state.has_place)
        self.styles.setVisible(idle and state.has_place)
        self.stop.setVisible(not idle)
        self.stop.set_busy(tr("Stopping…") if stopping else None)
        for button in (self.capture, self.again):
            button.set_available(state.can_capture or not idle, state.why_not)
        if had_focus and idle:
            (self.styles if state.has_place else self.capture).setFocus()
