"""The Probe screen as a whole: the light at the left, everything about the camera at the right."""

from __future__ import annotations

from functools import partial
from typing import Final

from PySide6.QtCore import QTimer
from PySide6.QtGui import QHideEvent, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.screens.probe.presenter import BEAT_MS, SLOW_BEAT_MS, ProbePresenter
from app.ui.screens.probe.state import CHECKS, Notice, ProbeState
from app.ui.screens.probe.view.camera_parts import CameraHead, CameraPanel, CheckTile, FramesGrid
from app.ui.screens.probe.view.light_column import LightColumn
from app.ui.screens.probe.view.stage import CaptureSign
from app.ui.theme import px
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.buttons import Button
from app.ui.widgets.choices import Segmented
from app.ui.widgets.dialogs import ask_files, ask_folder
from app.ui.widgets.labels import Role, Text
from app.ui.widgets.layouts import Item, boxed, column, grid, row, stacked
from app.ui.widgets.messages import Banner
from app.ui.widgets.surfaces import Room, Scroll, Surface

_PREVIEW: Final = tr("Live preview")
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
    """Everything about making a capture."""

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
        self.head = CameraHead(presenter.cameras, compact)
        self.panel = CameraPanel(presenter.cameras)
        self.plan = Segmented(_PLANS, tr("Plan"), equal=True, do=partial(presenter.set, "plan"))
        self.timer = Segmented(_TIMERS, tr("Self-timer"), equal=True, do=self._set_timer)
        self.checks = [CheckTile(check, compact) for check in CHECKS]
        self.frames = FramesGrid()
        self.rough = Text("", 14, wrap=True)
        self.banner = Banner("info", " ", actions=(" ",))
        head = self._inset(self.head)
        scroll = Scroll(self._middle(), name=tr("Capture"))
        scroll.lend(self._content, px(self._margin))
        edge, gap = (12, 8) if compact else (16, 12)
        parts = (head, gap, (scroll, 1), gap, self._inset(self._buttons()))
        column(*parts, into=self, margins=(0, edge, 0, edge))
        self.banner.pressed.connect(self._pressed)

    def take_width(self, free: int) -> None:
        """Grow into the room that is left, so many logical pixels."""
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
        """Put parts under their heading; the narrow layout has no room for it."""
        head = [] if self._compact else [Text(words, 12, 600, "dim")]
        return boxed(column(*head, *parts, gap=6))

    def _preview_row(self) -> QWidget:
        self.preview = Button(_PREVIEW, "eye", size="small", do=self._presenter.live.toggle)
        self.preview.set_tip(tr("Walk with the camera; the best styles are named on the way"), "L")
        self._preview_box = boxed(
            column(row(self.preview, ..., gap=None), 8 if self._compact else 12)
        )
        return self._preview_box

    def _plans(self) -> QWidget:
        line = row(Text(tr("Self-timer"), 12, 600, "dim"), (self.timer, 1), gap=16)
        return self._headed(tr("Plan"), self.plan, 2 if self._compact else 6, line)

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
        asked = self._presenter
        self.capture = Button(tr("Capture"), "camera", "primary", "main", do=asked.capture)
        self.capture.set_tip(tr("Meter, take the frames and merge them"), "Space")
        icon = "" if self._compact else "camera"
        self.again = Button(tr("Capture again"), icon, size="main", do=asked.capture)
        self.again.set_tip(tr("Measure this spot once more"), "Space")
        self.styles = Button(tr("See the styles"), "", "primary", "main", trailing="chevron-right")
        self.styles.set_tip(tr("Continue to the styles"), "Enter")
        self.styles.clicked.connect(asked.see_styles)
        self.stop = Button(tr("Cancel"), "cancel", size="main", do=asked.taking.cancel)
        self.stop.set_tip(tr("Stop; the camera gets its own settings back"), "Esc")
        parts = ((self.capture, 1), (self.again, 4), (self.styles, 5), (self.stop, 1))
        wide = self.again.sizeHint().width() + self.styles.sizeHint().width() + px(8)
        fits = wide <= self.width() - 2 * px(self._margin)
        return boxed((row if fits else column)(*parts, gap=8))

    def _set_timer(self, key: str) -> None:
        self._presenter.set_timer(int(key))

    def _pressed(self, number: int) -> None:
        self._presenter.press(self._keys[number])

    def show_state(self, state: ProbeState) -> None:
        """Show it; what is the same as before is left alone."""
        before, self._state = self._state, state
        if before is None or state.camera != before.camera:
            self.head.show_block(state.camera)
            self.panel.show_block(state.camera)
        if before is None or state.plans != before.plans:
            for part in state.plans:
                self.plan.set_text(part.key, part.title, part.second)
        self.plan.choose(state.plan)
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
        # When all exposures are made it is no longer needed.
        over = running is not None and (running.sign.kind == "move" or self._compact)
        self._checks_box.setVisible(not over)
        for widget in (self.plan, self.timer, self.head.change):
            widget.setEnabled(running is None)
        live = state.live is not None
        self._preview_box.setVisible(running is None)
        self.preview.set_text(tr("Stop the preview") if live else _PREVIEW)
        self.preview.set_available(live or state.can_capture, state.why_not)

    def _show_buttons(self, state: ProbeState) -> None:
        stopping = state.running is not None and state.running.stopping
        shown = (state.running is None, stopping, state.has_place, state.can_capture, state.why_not)
        if shown == self._buttons_shown:
            return
        self._buttons_shown = shown
        idle = state.running is None
        mine = (self, self.capture, self.again, self.styles, self.stop)
        held = any(widget.hasFocus() for widget in mine)
        if held:
            # Or the next control would get it, and the next key press would press that.
            self.setFocus()
        self.capture.setVisible(idle and not state.has_place)
        self.again.setVisible(idle and state.has_place)
        self.styles.setVisible(idle and state.has_place)
        self.stop.setVisible(not idle)
        self.stop.set_busy(tr("Stopping…") if stopping else None)
        for button in (self.capture, self.again):
            button.set_available(state.can_capture or not idle, state.why_not)
        if held and idle:
            (self.styles if state.has_place else self.capture).setFocus()


_LEAST = (512, 480)  # of the left side

_FILES = tr("Panoramas and photographs (*.exr *.hdr *.jpg *.jpeg *.insp *.png *.tif *.tiff *.dng)")


class ProbeScreen(QWidget):
    """Shows a `ProbeState` and tells the presenter what the user does."""

    def __init__(self, presenter: ProbePresenter, compact: bool) -> None:
        super().__init__()
        self._presenter = presenter
        self.light = LightColumn(presenter, compact, self.ask_files, self.ask_folder)
        self.camera = CameraColumn(presenter, compact)
        self.sign = CaptureSign()
        self._left = stacked(Room(self.light, *_LEAST), self.sign)
        row((self._left, 1), self.camera, into=self)
        self._busy = False  # capturing or previewing
        self._beat = QTimer(self)
        self._beat.timeout.connect(presenter.tick)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give the camera's side what the panorama does not need."""
        super().resizeEvent(event)
        self.camera.take_width(self.width() - self.light.widest())

    def show_state(self, state: ProbeState) -> None:
        """Show it; what is the same as before is left alone."""
        self.light.show_state(state)
        self.camera.show_state(state)
        self._left.setCurrentIndex(0 if state.running is None else 1)
        if state.running is not None:
            self.sign.show_sign(state.running.sign)
        if self._busy != (state.running is not None or state.live is not None):
            self._busy = not self._busy
            self._keep_time()

    def _keep_time(self) -> None:
        """Ask often only for what the camera has to show; behind another screen only to be heard.

        Otherwise only the age of the light changes, and that where it can be seen.
        """
        seen = self.isVisible()
        if self._busy or seen:
            self._beat.start(BEAT_MS if self._busy and seen else SLOW_BEAT_MS)
        else:
            self._beat.stop()

    def showEvent(self, event: QShowEvent) -> None:
        """Take up the time again."""
        super().showEvent(event)
        self._presenter.tick()
        self._keep_time()

    def hideEvent(self, event: QHideEvent) -> None:
        """Let the time go by."""
        super().hideEvent(event)
        self._keep_time()

    def zoom_by(self, steps: float) -> None:
        """Zoom the panorama, positive is nearer."""
        self.light.panorama.zoom_by(steps)

    def take_marker(self) -> None:
        """Give the marker the keyboard."""
        self.light.panorama.take_marker()

    def ask_files(self) -> None:
        """Ask which files are to be opened."""
        paths = ask_files(self, tr("Open files"), _FILES)
        if paths:
            self._presenter.open_files(paths)

    def ask_folder(self) -> None:
        """Ask which folder is to be watched."""
        folder = ask_folder(self, tr("Watch a folder"))
        if folder is not None:
            self._presenter.watching.start(folder)
