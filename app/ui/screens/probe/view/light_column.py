"""The left side: tools, panorama, lamps or recent places, age of the light, and where to drop."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.core.text.quantities import ev_words
from app.ui.screens.probe.state import LAYERS, LampRow, ProbeState
from app.ui.screens.probe.view.stage import RoughCards
from app.ui.screens.probe.view.start import RecentPlaces, Start
from app.ui.theme import px, theme
from app.ui.widgets.accessibility import OwnKeys, Roving
from app.ui.widgets.buttons import Button, IconButton, Pressable
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import boxed, column, row, stacked
from app.ui.widgets.lists import Cell, Column, TableHead, TableRow
from app.ui.widgets.messages import Empty
from app.ui.widgets.paint import text_width
from app.ui.widgets.plots.panorama import PanoramaView, SceneLamp
from app.ui.widgets.surfaces import Frame, Scroll

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.ui.screens.probe.presenter import ProbePresenter

_ROOMY = 800  # wide enough for icons beside the words
_LAYERS = (
    ("clipped", tr("Clipped"), "hatch", tr("Hatch what was too bright for every frame")),
    ("lamps", tr("Lamps"), "bulb", tr("Letter the lamps")),
    ("grid", tr("Grid"), "grid", tr("Draw a grid of directions")),
)


class Tools(QWidget):
    """One line of 32."""

    def __init__(self, presenter: ProbePresenter, panorama: PanoramaView, compact: bool) -> None:
        super().__init__()
        self._presenter = presenter
        t = theme()
        self.setFixedHeight(px(32))
        self.whole = IconButton("hand", tr("Show the whole panorama"), size="small")
        self.whole.set_tip(tr("Drag to look around; press to show it whole"), "0")
        self.out = IconButton("minus", tr("Zoom out"), size="small", shortcut="−")
        self.near = IconButton("plus", tr("Zoom in"), size="small", shortcut="+")
        self.percent = Text("100 %", align=Qt.AlignmentFlag.AlignHCenter)
        self.percent.setFixedWidth(text_width(t.font(14), "800 %") + px(8))
        self.exposure = LabelledSlider(
            tr("Exposure"), -6.0, 6.0, 0.0, 0.1, partial(ev_words, tenths=True), inline=True
        )
        self.exposure.setToolTip(tr("How bright it is shown; a double click resets it"))
        self.exposure.setMaximumWidth(px(296))
        if not compact:
            self.exposure.setMinimumWidth(px(200))
        self.layers: dict[str, Pressable] = {}
        self._there: bool | None = None
        near = (self.whole, self.out, self.percent, self.near, 8, Icon("sun", 20, "dim"))
        line = row(*near, (self.exposure, 1), into=self, gap=8)
        line.addStretch(0 if compact else 1)
        for key, words, icon, tip in _LAYERS:
            line.addWidget(self._layer(key, words, icon, tip, compact))
        self.whole.clicked.connect(panorama.fit)
        self.out.clicked.connect(lambda: panorama.zoom_by(-1.0))
        self.near.clicked.connect(lambda: panorama.zoom_by(1.0))
        self.exposure.changed.connect(presenter.expose)
        panorama.zoom_changed.connect(self.show_zoom)
        Roving(self).set_members([self.whole, self.out, self.near])
        Roving(self).set_members(list(self.layers.values()))

    def _layer(self, key: str, words: str, icon: str, tip: str, compact: bool) -> Pressable:
        button: Pressable
        if compact:
            button = IconButton(icon, words, checkable=True, size="small")
        else:
            button = Button(words, icon, size="small", checkable=True)
        button.set_tip(tip)
        button.clicked.connect(lambda on, key=key: self._presenter.show_layer(key, on))
        self.layers[key] = button
        return button

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave out the icons beside words where there is little room."""
        super().resizeEvent(event)
        roomy = self.width() >= px(_ROOMY)
        for key, words, icon, _ in _LAYERS:
            button = self.layers[key]
            if isinstance(button, Button):
                button.set_text(words, icon if roomy else "")

    def show_zoom(self, zoom: float) -> None:
        """Say how near it is shown."""
        self.percent.set_text(f"{round(100 * zoom)} %")

    def show_state(self, state: ProbeState) -> None:
        """Show exposure and layers."""
        self.exposure.set_value(state.exposure_ev)
        for key, button in self.layers.items():
            button.setChecked(key in state.layers)
        there = state.picture is not None and state.live is None
        if there == self._there:
            return
        self._there = there
        for widget in (self.whole, self.out, self.near, *self.layers.values()):
            widget.set_available(there, tr("There is no panorama yet."))
        self.exposure.setEnabled(there)


_WIDEST: Final = 1200
_ROW: Final = 44
_DROP: Final = tr("Drop a panorama, a bracket or a folder")
_DROP_SHORT: Final = tr("Drop files here")
_FULL: Final = (
    Column(tr("Lamps found"), 160),
    Column(tr("Where")),
    Column(tr("Azimuth"), 84),
    Column(tr("Elevation"), 88),
    Column(tr("Share of the light"), 120),
    Column("", 92),
)
_COMPACT: Final = (
    Column(tr("Lamps found")),
    Column(tr("Azimuth"), 68),
    Column(tr("Elevation"), 80),
    Column(tr("Share"), 128),
    Column("", 96),
)


class _Rows(Scroll):
    """Shows whole rows only."""

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave out what would be part of a row."""
        high = px(_ROW)
        self.setViewportMargins(0, 0, 0, self.height() % high if self.height() > high else 0)
        super().resizeEvent(event)


class LightColumn(QWidget):
    """Everything about the light that is there."""

    def __init__(
        self,
        presenter: ProbePresenter,
        compact: bool,
        ask_files: Callable[[], None],
        ask_folder: Callable[[], None],
    ) -> None:
        super().__init__()
        self._presenter = presenter
        self._ask_files, self._ask_folder = ask_files, ask_folder
        self._compact = compact
        self._state: ProbeState | None = None
        self._front: float | None = None
        self._columns = _COMPACT if compact else _FULL
        self.panorama = PanoramaView()
        self.panorama.marker_released.connect(presenter.move_marker)
        self.tools = Tools(presenter, self.panorama, compact)
        OwnKeys(self.panorama.grip)
        self.empty = Empty("", icon="probe")
        self.start = Start(presenter.open_demo, ask_files, presenter.cameras.connect, compact)
        side, top, gap = (16, 12, 8) if compact else (24, 16, 12)
        self._side = px(side)
        self._body = column(
            self.tools,
            gap,
            (self._well(), 1),
            8,
            (self._below(), 0 if compact else 1),
            gap,
            self._age_line(),
            gap,
            self._drop_row(),
            into=self,
            margins=(side, top, side, top),
        )

    def _well(self) -> QWidget:
        frame = Frame("panel", "line")
        column(self.empty, into=frame, gap=None)
        begin = Frame("panel", "line")
        column(self.start, into=begin, gap=None)
        self.preview = Picture(tr("Live preview"))
        self._stack = stacked(frame, self.panorama, begin, self.preview)
        self._stack.setMaximumWidth(px(_WIDEST))
        return self._stack

    def resizeEvent(self, event: object) -> None:
        """Give the panorama as much height as its width asks for."""
        self._give_height()

    def _give_height(self) -> None:
        self._keep_to_panorama()
        margins = self._body.contentsMargins()
        width = min(self.width() - margins.left() - margins.right(), px(_WIDEST))
        most = self._most_height()
        # The ways to begin have all the room to themselves.
        wanted = most if self._stack.currentIndex() == 2 else self.panorama.heightForWidth(width)
        self._stack.setFixedHeight(max(min(wanted, most), px(120)))

    def _keep_to_panorama(self) -> None:
        """Let nothing here become wider than the panorama may; all keep one left and right edge."""
        free = max(self.width() - self.widest(), 0)
        left = free // 2 if free > 2 * self._side else 0
        margins = self._body.contentsMargins()
        margins.setLeft(self._side + left)
        margins.setRight(self._side + free - left)
        self._body.setContentsMargins(margins)

    def widest(self) -> int:
        """Width beyond which nothing here grows."""
        return px(_WIDEST) + 2 * self._side

    def _most_height(self) -> int:
        """Leave room for the rest, with two rows of lamps."""
        margins = self._body.contentsMargins()
        lower = 88 if self._lower.currentIndex() < 2 else 160
        lower = -28 if self._lower.isHidden() else lower  # nor a scale
        rest = 32 + 12 + 8 + 28 + lower + 12 + 20 + 12 + (40 if self._compact else 56)
        return self.height() - margins.top() - margins.bottom() - px(rest)

    def _below(self) -> QWidget:
        """Stack the table of lamps, the recent places, and what the live preview tells."""
        self.recent = RecentPlaces(self._presenter.places.open)
        self.rough = RoughCards(self._compact)
        self._lower = stacked(self._table(), self.recent, self.rough)
        return self._lower

    def _table(self) -> QWidget:
        self._rows_box = QWidget()
        self._note = Text("", role="dim")
        self._note.setFixedHeight(px(_ROW))
        self._rows = column(self._note, ..., into=self._rows_box)
        self.lamps: list[TableRow] = []
        head = row(TableHead(self._columns), gap=None)
        scroll = _Rows(self._rows_box, name=tr("Lamps found"))
        # The head keeps its columns over those of the rows, which make way for the bar.
        scroll.bar_changed.connect(lambda width: head.setContentsMargins(0, 0, width, 0))
        return boxed(column(head, (scroll, 1)))

    def _age_line(self) -> QWidget:
        self._age_icon = Icon("clock", 16, "dim")
        self._age = Text("", 14, role="dim", elide=True)
        line = boxed(row(self._age_icon, (self._age, 1), gap=8))
        line.setFixedHeight(px(20))
        return line

    def _drop_row(self) -> QWidget:
        height = px(40 if self._compact else 56)
        self._zone = Frame("none", "ctl", dashed=True)
        self._drop = Text(self._drop_words(""), 14, role="dim", elide=True)
        self._drop_icon = Icon("folder", 20, "dim")
        margins = (20, 0, 16, 0)
        row(self._drop_icon, (self._drop, 1), into=self._zone, gap=12, margins=margins)
        self.open_button = Button(tr("Open files…"), do=self._ask_files)
        self.open_button.set_tip(tr("Open panoramas, brackets or photographs"), "Ctrl O")
        self.watch_button = Button(tr("Watch a folder…"), do=self._watch)
        self.watch_button.set_tip(tr("Brackets that arrive in a folder become places"))
        line = boxed(row((self._zone, 1), self.open_button, self.watch_button, gap=8))
        for widget in (line, self.open_button, self.watch_button):
            widget.setFixedHeight(height)
        return line

    def _watch(self) -> None:
        if self._state is not None and self._state.watching:
            self._presenter.watching.stop()
        else:
            self._ask_folder()

    def show_state(self, state: ProbeState) -> None:
        """Show it; what is the same as before is left alone."""
        before, self._state = self._state, state
        self.tools.show_state(state)
        self._show_panorama(state, before)
        if before is None or state.lamps != before.lamps or state.lamps_note != before.lamps_note:
            self._show_lamps(state.lamps, state.lamps_note)
        self._age.set_text(state.age)
        self._age.set_role("text" if state.age_old else "dim")
        self._age_icon.set(*(("warning", "text") if state.age_old else ("clock", "dim")))
        self._age_icon.setVisible(bool(state.age))
        if before is None or state.watching != before.watching:
            self._show_watching(state.watching)

    def _show_panorama(self, state: ProbeState, before: ProbeState | None) -> None:
        panorama = self.panorama
        live = state.live
        page = 1 if state.picture is not None else 0 if state.opening else 2
        self._stack.setCurrentIndex(page if live is None else 3)
        if live is not None:
            self.preview.set_picture(live.picture)
            self.rough.show_live(live)
        self.start.set_camera(state.can_capture)
        self.empty.set(tr("Opening {name}…", name=state.opening))
        if before is None or state.recent != before.recent:
            self.recent.show_rows(state.recent)
        lower = 2 if live is not None else 0 if state.picture is not None else 1
        nothing = lower == 1 and not state.recent
        if (lower, nothing) != (self._lower.currentIndex(), self._lower.isHidden()):
            self._lower.setCurrentIndex(lower)
            self._lower.setVisible(not nothing)
            self._give_height()
        # The front first: a new picture of the same spot must not be seen at the old one.
        if self._front != state.front_deg or before is None:
            known = before is not None and before.picture is not None
            panorama.set_front(state.front_deg, glide=known)
            self._front = state.front_deg
        if before is None or state.picture is not before.picture:
            panorama.set_picture(state.picture)
        if before is None or state.findings is not before.findings:
            found = state.findings
            panorama.set_clipped(None if found is None else found.clipped)
            panorama.set_lamps(
                [SceneLamp(row.letter, row.azimuth_deg, row.elevation_deg) for row in state.lamps]
            )
        if before is None or state.layers != before.layers:
            panorama.set_shown(**{layer: layer in state.layers for layer in LAYERS})
        if before is None or state.marker_words != before.marker_words:
            panorama.set_marker_words(state.marker_words)

    def _show_lamps(self, lamps: tuple[LampRow, ...], note: str) -> None:
        while len(self.lamps) > len(lamps):
            row = self.lamps.pop()
            self._rows.removeWidget(row)
            row.hide()
            row.deleteLater()
        while len(self.lamps) < len(lamps):
            row = TableRow(self._columns, self._cells(lamps[len(self.lamps)]))
            # It only tells: nothing is chosen by it.
            row.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            row.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
            self.lamps.append(row)
            self._rows.insertWidget(self._rows.count() - 1, row)
        for row, lamp in zip(self.lamps, lamps, strict=True):
            row.set(self._cells(lamp))
            row.setAccessibleName(lamp.spoken)
        self._note.say(note)

    def _cells(self, lamp: LampRow) -> tuple[Cell, ...]:
        where = () if self._compact else (Cell(lamp.where),)
        return (
            Cell(lamp.name, letter=lamp.letter, strong=True),
            *where,
            Cell(lamp.azimuth),
            Cell(lamp.elevation),
            Cell(lamp.share),
            Cell(tr("clipped"), "hatch") if lamp.clipped else Cell(""),
        )

    def _drop_words(self, folder: str) -> str:
        if folder:
            return tr("Watching {folder}: a bracket that arrives opens here", folder=folder)
        return _DROP_SHORT if self._compact else _DROP

    def _show_watching(self, folder: str) -> None:
        self._drop.set_text(self._drop_words(folder))
        self._drop_icon.set("eye" if folder else "folder")
        self.watch_button.set_text(tr("Stop watching") if folder else tr("Watch a folder…"))
