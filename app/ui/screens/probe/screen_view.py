"""The Probe screen as a whole: the light at the left, everything about the camera at the right."""

from __future__ import annotations

from functools import partial
from typing import Final

from PySide6.QtCore import QRect, Qt, QTimer
from PySide6.QtGui import QHideEvent, QPainter, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QLineEdit, QSizePolicy, QWidget

from app.core.text import tr
from app.ui.screens.probe.cameras import CameraFinder
from app.ui.screens.probe.light_view import CaptureSign, LightColumn
from app.ui.screens.probe.screen import BEAT_MS, SLOW_BEAT_MS, ProbePresenter
from app.ui.screens.probe.state import (
    CHECKS,
    WAYS,
    CameraBlock,
    ChoiceRow,
    FrameTile,
    Notice,
    ProbeState,
)
from app.ui.theme import Theme, px
from app.ui.theme.icons import draw_icon
from app.ui.widgets.accessibility import OwnKeys, Roving
from app.ui.widgets.buttons import Button, Pressable
from app.ui.widgets.choices import SegmentedChoice
from app.ui.widgets.dialogs import ask_files, ask_folder
from app.ui.widgets.displays import Bar, Picture, Spinner
from app.ui.widgets.fields import TextField, Toggle
from app.ui.widgets.labels import Icon, Role, Text
from app.ui.widgets.layouts import Item, boxed, clear, column, grid, row, stacked
from app.ui.widgets.lists import Cell, Column, TableRow
from app.ui.widgets.messages import Banner
from app.ui.widgets.paint import box, hover_fill, selected_edge
from app.ui.widgets.surfaces import OutlineBox, Room, Scroll, Surface

_COLUMNS = (Column("", 12), Column(""), Column("", 150))


class CameraHead(QWidget):
    """Name, how it is, and Change."""

    def __init__(self, cameras: CameraFinder, compact: bool) -> None:
        super().__init__()
        self._compact = compact
        self.setFixedHeight(px(48))
        self.title = Text("", 16, 600, elide=True)
        self.second = Text("", 14, role="dim", elide=True)
        self._warning = Icon("warning", 16, "err")
        self._spinner = Spinner(tr("Looking for cameras"))
        self.change = Button(tr("Change"), size="small", do=cameras.toggle_panel)
        line = row(self._spinner, self._warning, (self.second, 1), gap=6)
        words = column(..., self.title, line, ...)
        change = (self.change, 0, Qt.AlignmentFlag.AlignVCenter)
        badge = OutlineBox("raised", "none")
        row(Icon("theta", 24), into=badge, margins=12)
        row(badge, (words, 1), change, into=self, gap=16)

    def show_block(self, block: CameraBlock) -> None:
        """Show it."""
        self.title.set_text(block.title)
        words = block.short if self._compact and block.short else block.second
        second = f"{block.second}. {block.warning}" if block.warning else block.second
        # The panel has room for a whole sentence.
        words = tr("Not found") if block.missing and not block.busy and block.open else words
        self.second.set_text(block.warning or words)
        self._spinner.setVisible(bool(block.busy))
        self._warning.setVisible(bool(block.warning) and not block.busy)
        self.change.set_text(
            tr("Close") if block.open else tr("Choose") if block.missing else tr("Change")
        )
        self.setAccessibleName(tr("Camera: {title}, {second}", title=block.title, second=second))


class CameraPanel(QWidget):
    """Cameras found, an address, and a password where one is wanted."""

    def __init__(self, cameras: CameraFinder) -> None:
        super().__init__()
        self._cameras = cameras
        self._block: CameraBlock | None = None
        self.rows: list[TableRow] = []
        self.hide()

    def _build(self) -> None:
        """Make its controls, which a camera that is found at once never needs."""
        cameras = self._cameras
        self.trouble = Text("", 14, wrap=True)
        self.note = Text("", 12, role="dim", wrap=True)
        self.search = Button(tr("Search again"), "refresh", size="small", do=cameras.search)
        self.address = TextField(tr("Address"), "192.168.1.1", "wifi")
        self.ask = Button(tr("Connect"), size="small")
        self.ask.clicked.connect(lambda: cameras.look_at(self.address.text()))
        self.user = TextField(tr("User name"), "THETAYL00105377", "person")
        self.password = TextField(tr("Password"))
        self.password.edit.setEchoMode(QLineEdit.EchoMode.Password)
        self.hint = Text("", 12, role="dim", wrap=True)
        self.give = Button(tr("Use this password"), size="small", do=self._give)
        self._rows = column()
        give = (self.give, 0, Qt.AlignmentFlag.AlignLeft)
        self._secret = boxed(column(self.user, self.password, self.hint, give, gap=8))
        buttons = row(self.ask, self.search, ..., gap=8)
        parts = (self.trouble, self._rows, self.note, self.address, buttons, self._secret)
        column(*parts, into=self, gap=8, margins=(0, 0, 0, 16))
        OwnKeys(self.address.edit, self.user.edit, self.password.edit)
        self.address.entered.connect(cameras.look_at)
        self.password.entered.connect(lambda _text: self._give())
        self.user.entered.connect(lambda _text: self.password.setFocus())

    def _give(self) -> None:
        self._cameras.give_password(self.user.text(), self.password.text())

    def show_block(self, block: CameraBlock) -> None:
        """Show it; what is typed stays."""
        before, self._block = self._block, block
        if before == block or not (block.open or self.layout()):
            return
        if self.layout() is None:
            self._build()
        self.setVisible(block.open)
        self.trouble.say(block.second if block.missing and not block.busy else "")
        self.note.say(block.note)
        self.search.set_busy(tr("Searching…") if block.busy else None)
        self.address.set_error(block.address_error)
        self._show_rows(block.rows, block.chosen)
        self._secret.setVisible(block.asks_password)
        if block.asks_password and (before is None or not before.asks_password):
            self.user.set_text(block.user)
        if not block.asks_password:
            self.password.set_text("")
        self.password.set_error(block.password_error)
        hint = tr("It is kept in this computer's keyring only.")
        self.hint.set_text(f"{block.password_hint} {hint}")

    def _show_rows(self, rows: tuple[ChoiceRow, ...], key: str) -> None:
        keys = tuple(row.key for row in rows)
        if tuple(row.property("key") for row in self.rows) != keys:
            clear(self._rows)
            self.rows = [self._make_row(row) for row in rows]
        for view, one in zip(self.rows, rows, strict=True):
            view.set(_cells(one))
            view.setToolTip(f"{one.title}, {one.second}")
            view.setAccessibleName(f"{one.title}, {one.second}")
            view.set_selected(one.key == key)

    def _make_row(self, row: ChoiceRow) -> TableRow:
        view = TableRow(_COLUMNS, _cells(row))
        view.setProperty("key", row.key)
        view.clicked.connect(lambda _on=False, key=row.key: self._cameras.choose(key))
        self._rows.addWidget(view)
        return view


def _cells(row: ChoiceRow) -> tuple[Cell, ...]:
    return Cell(""), Cell(row.title, strong=True), Cell(row.second)


_TILE: Final = 48


class CheckTile(Pressable):
    """A line of the list before pressing, with its drawing; it can be ticked."""

    def __init__(self, check: ChoiceRow, compact: bool) -> None:
        super().__init__(check.title, tip=check.title if compact else "")
        self.key = check.key
        self._compact = compact
        self.preferred_size = (72 if compact else 192, _TILE)
        self.least = (56 if compact else 150, _TILE)
        self.setCheckable(True)
        self.setMinimumHeight(px(_TILE))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Minimum)
        if not compact:
            words = Text(check.title, 12, wrap=True)
            words.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
            # Three lines of a longer language make it higher.
            row(46, (words, 1, Qt.AlignmentFlag.AlignVCenter), 28, into=self, margins=(0, 6, 0, 6))

    def show_ticked(self, ticked: bool) -> None:
        """Tick it without telling anybody."""
        self.setChecked(ticked)
        self.setAccessibleDescription(tr("done") if ticked else tr("not yet done"))

    def nextCheckState(self) -> None:
        """Stay as the presenter says: a click asks, it does not tick."""

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint it in the current theme."""
        fill = hover_fill(t) if self.hovered() and t.contrast else t.c.raised
        edge, width = (t.c.line, t.line_width) if t.contrast else (None, 1)
        if self.isDown() or (self.hovered() and not t.contrast):
            edge, width = t.c.ctl, selected_edge(t) if self.isDown() else 1
        box(painter, self.rect(), px(8), fill, edge, width)
        side = px(28)
        spot = QRect(px(8 if self._compact else 10), 0, side, self.height())
        if self._compact and not self.isChecked():
            spot.moveLeft((self.width() - side) // 2)
        draw_icon(painter, self.key, spot, side, t.c.text)
        if self.isChecked():
            mark = px(16)
            spot = QRect(self.width() - mark - px(8), 0, mark, self.height())
            draw_icon(painter, "check", spot, mark, t.c.ok)


class _FrameView(QWidget):
    """One exposure: small picture, EV, shutter, clip share."""

    def __init__(self, narrow: bool) -> None:
        super().__init__()
        self._narrow = narrow
        self._tile: FrameTile | None = None
        self.picture = Picture(tr("Frame"), 4)
        self.ev = Text("", 14, 600)
        align = Qt.AlignmentFlag.AlignLeft if narrow else Qt.AlignmentFlag.AlignRight
        self.shutter = Text("", 12, role="dim", align=align)
        self._clip_icon = Icon("hatch", 16)
        self.clipped = Text("", 12, elide=True)
        self._bar = Bar(tr("Download"))
        self._bar.setMinimumWidth(0)
        self._bar.setMaximumWidth(px(400))
        self._bar.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        # Under the exposure, or where there is room at its right.
        first = [self.ev, self.shutter] if narrow else [row(self.ev, ..., self.shutter, gap=None)]
        second = row(self._clip_icon, (self.clipped, 1), gap=4)
        column(self.picture, 4, self._bar, *first, second, into=self)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)

    def show_tile(self, tile: FrameTile) -> None:
        before = self._tile
        if before is not None and tile == before and tile.picture is before.picture:
            return
        self._tile = tile
        self.picture.set_picture(tile.picture)
        self.picture.setAccessibleName(tr("Frame {spoken}", spoken=tile.spoken))
        self.setToolTip(tile.spoken)
        self.ev.set_text(tile.ev)
        self.shutter.set_text(tile.shutter)
        words = tile.clipped_brief if self._narrow else tile.clipped
        self.clipped.set_text(words)
        self._clip_icon.setVisible(bool(words))
        self._bar.setVisible(tile.arrived < 1.0)
        self._bar.set(tile.arrived)


class FramesGrid(QWidget):
    """The exposures side by side, three or four in a line."""

    def __init__(self) -> None:
        super().__init__()
        self._grid = grid(across=4, gap=(8, 8))
        self._grid.setContentsMargins(0, 0, 0, 0)
        self.setLayout(self._grid)
        self.views: list[_FrameView] = []
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def resizeEvent(self, event: object) -> None:
        """Keep all pictures at 2:1 and equally high."""
        self._fit()

    def _fit(self) -> None:
        columns = 3 if len(self.views) <= 3 else 4
        width = (self.width() - (columns - 1) * px(8)) // columns
        for view in self.views:
            view.picture.setFixedHeight(max(width // 2, 8))

    def show_tiles(self, tiles: tuple[FrameTile, ...]) -> None:
        """Show as many as there are."""
        columns = 3 if len(tiles) <= 3 else 4
        if len(tiles) != len(self.views):
            clear(self._grid)
            self.views = [_FrameView(columns > 3) for _ in tiles]
            for number, view in enumerate(self.views):
                self._grid.addWidget(view, number // columns, number % columns)
            for column in range(4):
                self._grid.setColumnStretch(column, 1 if column < columns else 0)
            self._fit()
        for view, tile in zip(self.views, tiles, strict=True):
            view.show_tile(tile)


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
    """Everything about measuring."""

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
        """Put parts under their heading; the narrow layout has no room for it."""
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
        self.again.set_tip(tr("Measure this spot once more"), "Space")
        self.styles = Button(tr("See the styles"), "", "primary", "main", trailing="chevron-right")
        self.styles.set_tip(tr("Continue to the styles"), "Enter")
        self.styles.clicked.connect(presenter.see_styles)
        self.stop = Button(tr("Cancel"), "cancel", size="main", do=presenter.taking.cancel)
        self.stop.set_tip(tr("Stop; the camera gets its own settings back"), "Esc")
        parts = ((self.capture, 1), (self.again, 4), (self.styles, 5), (self.stop, 1))
        wide = self.again.sizeHint().width() + self.styles.sizeHint().width() + px(8)
        fits = wide <= self.width() - 2 * px(self._margin)
        return boxed((row if fits else column)(*parts, gap=8))

    def show_state(self, state: ProbeState) -> None:
        """Show it; what is the same as before is left alone."""
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
        """Show what a way to measure needs, and nothing of the others."""
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
        # When all exposures are made it is no longer needed, and advice needs its room.
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
            # Or the next control would get it, and the next key press would press that.
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


_LEAST = (512, 480)  # of the left side


class ProbeScreen(QWidget):
    """Shows a `ProbeState` and tells the presenter what the user does."""

    def __init__(self, presenter: ProbePresenter, compact: bool) -> None:
        super().__init__()
        self._presenter = presenter
        ask_files = partial(self.ask_measured, "file")
        self.light = LightColumn(presenter, compact, ask_files, self.ask_folder)
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
        visible = self.isVisible()
        if self._busy or visible:
            self._beat.start(BEAT_MS if self._busy and visible else SLOW_BEAT_MS)
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

    def ask_measured(self, way: str) -> None:
        """Ask for the files of one of `WAYS`."""
        paths = ask_files(self, tr("Open files"), WAYS[way].files)
        if paths:
            self._presenter.open_files(paths)

    def ask_folder(self) -> None:
        """Ask which folder is to be watched."""
        folder = ask_folder(self, tr("Watch a folder"))
        if folder is not None:
            self._presenter.watching.start(folder)
