"""The left-hand side of the Probe screen, from the panorama's tools down to the drop area."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.plots.panorama import PanoramaView, SceneLamp
from app.ui.screens.probe.drop_view import DropRow
from app.ui.screens.probe.lamps_view import LampTable
from app.ui.screens.probe.live_view import RoughCards
from app.ui.screens.probe.panorama import LAYERS
from app.ui.screens.probe.panorama_view import PanoramaTools
from app.ui.screens.probe.recent_view import RecentPlaces
from app.ui.screens.probe.screen import ProbePresenter, ProbeState
from app.ui.screens.probe.start_view import Start
from app.ui.theme import px
from app.ui.widgets.accessibility import OwnKeys
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import boxed, column, row, stacked
from app.ui.widgets.messages import Empty
from app.ui.widgets.surfaces import OutlineBox

_WIDEST: Final = 1200


class LightColumn(QWidget):
    """The panorama and everything about its light."""

    def __init__(
        self,
        presenter: ProbePresenter,
        compact: bool,
        ask_files: Callable[[], None],
        ask_folder: Callable[[], None],
    ) -> None:
        super().__init__()
        self._presenter = presenter
        self._compact = compact
        self._state: ProbeState | None = None
        self.panorama = PanoramaView()
        self.panorama.marker_released.connect(presenter.move_marker)
        self.tools = PanoramaTools(presenter, self.panorama, compact)
        OwnKeys(self.panorama.grip)
        self.empty = Empty("", icon="probe")
        self.drop = DropRow(ask_files, ask_folder, presenter.watching.stop, compact)
        self.start = Start(presenter.open_demo, ask_files, presenter.cameras.connect, compact)
        side, top, gap = (16, 12, 8) if compact else (24, 16, 12)
        self._side = px(side)
        self._body = column(
            self.tools,
            gap,
            (self._well(), 1),
            8,
            self._verdict_line(),
            (self._below(), 0 if compact else 1),
            gap,
            self._age_line(),
            gap,
            self.drop,
            into=self,
            margins=(side, top, side, top),
        )

    def _well(self) -> QWidget:
        frame = OutlineBox("panel", "line")
        column(self.empty, into=frame, gap=None)
        begin = OutlineBox("panel", "line")
        column(self.start, into=begin, gap=None)
        self.preview = Picture(tr("Live preview"))
        self._stack = stacked(frame, self.panorama, begin, self.preview)
        self._stack.setMaximumWidth(px(_WIDEST))
        return self._stack

    def resizeEvent(self, event: object) -> None:
        """Keep the panorama's aspect ratio at 2:1."""
        self._give_height()

    def _give_height(self) -> None:
        self._keep_to_panorama()
        margins = self._body.contentsMargins()
        width = min(self.width() - margins.left() - margins.right(), px(_WIDEST))
        most = self._most_height()
        # The start page uses the whole column.
        height = most if self._stack.currentIndex() == 2 else self.panorama.heightForWidth(width)
        self._stack.setFixedHeight(max(min(height, most), px(120)))

    def _keep_to_panorama(self) -> None:
        """Align everything with the left and right edges of the panorama."""
        free = max(self.width() - self.widest(), 0)
        left = free // 2 if free > 2 * self._side else 0
        margins = self._body.contentsMargins()
        margins.setLeft(self._side + left)
        margins.setRight(self._side + free - left)
        self._body.setContentsMargins(margins)

    def widest(self) -> int:
        """Return the maximum useful width, beyond which nothing in the column grows."""
        return px(_WIDEST) + 2 * self._side

    def _most_height(self) -> int:
        """Return the maximum height of the panorama that leaves room for two rows of lamps."""
        margins = self._body.contentsMargins()
        lower = 88 if self._lower.currentIndex() < 2 else 160
        lower = -28 if self._lower.isHidden() else lower  # the scale is hidden too
        verdict = 0 if self._verdict_box.isHidden() else 28
        rest = verdict + 32 + 12 + 8 + 28 + lower + 12 + 20 + 12 + (40 if self._compact else 56)
        return self.height() - margins.top() - margins.bottom() - px(rest)

    def _below(self) -> QWidget:
        """Stack the lamp table, the recent places and the live preview's cards."""
        self.lamps = LampTable(self._compact)
        self.recent = RecentPlaces(self._presenter.places.open)
        self.rough = RoughCards(self._compact)
        self._lower = stacked(self.lamps, self.recent, self.rough)
        return self._lower

    def _verdict_line(self) -> QWidget:
        self.verdict = Text("", 14, elide=True)
        line = boxed(column(self.verdict, 8))
        line.setFixedHeight(px(28))
        line.hide()
        self._verdict_box = line
        return line

    def _age_line(self) -> QWidget:
        self._age_icon = Icon("clock", 16, "dim")
        self._age = Text("", 14, role="dim", elide=True)
        line = boxed(row(self._age_icon, (self._age, 1), gap=8))
        line.setFixedHeight(px(20))
        return line

    def show_state(self, state: ProbeState) -> None:
        """Show the state, updating only the parts that have changed."""
        before, self._state = self._state, state
        self.tools.show_state(state)
        self._show_panorama(state, before)
        self._show_verdict(state)
        if before is None or state.lamps != before.lamps or state.lamps_note != before.lamps_note:
            self.lamps.show_lamps(state.lamps, state.lamps_note)
        self._age.set_text(state.age)
        self._age.set_role("text" if state.age_old else "dim")
        self._age_icon.set(*(("warning", "text") if state.age_old else ("clock", "dim")))
        self._age_icon.setVisible(bool(state.age))
        if before is None or state.watching != before.watching:
            self.drop.show_watching(state.watching)

    def _show_verdict(self, state: ProbeState) -> None:
        """Show the verdict in a line that stays while a place is open."""
        self.verdict.set_text(state.verdict)
        hidden = state.picture is None or state.live is not None
        if hidden != self._verdict_box.isHidden():
            self._verdict_box.setHidden(hidden)
            self._give_height()

    def _show_panorama(self, state: ProbeState, before: ProbeState | None) -> None:
        panorama = self.panorama
        live = state.live
        page = 1 if state.picture is not None else 0 if state.opening else 2
        self._stack.setCurrentIndex(page if live is None else 3)
        if live is not None:
            self.preview.set_picture(live.picture)
            self.rough.show_live(live)
        if state.running is not None and (before is None or before.running is None):
            # Prepare this while the camera exposes, so that the picture appears at once.
            QTimer.singleShot(0, panorama, panorama.make_ready)
        self.start.ways[0].set_primary(not state.can_capture)
        self.empty.set(tr("Opening {name}…", name=state.opening))
        if before is None or state.recent != before.recent:
            self.recent.show_rows(state.recent)
        lower = 2 if live is not None else 0 if state.picture is not None else 1
        nothing = lower == 1 and not state.recent
        if (lower, nothing) != (self._lower.currentIndex(), self._lower.isHidden()):
            self._lower.setCurrentIndex(lower)
            self._lower.setVisible(not nothing)
            self._give_height()
        # Set the front first, so that a new picture of the spot never appears with the old front.
        if before is None or state.front_deg != before.front_deg:
            had_picture = before is not None and before.picture is not None
            panorama.set_front(state.front_deg, glide=had_picture)
        panorama.set_picture(state.picture)
        if before is None or state.findings is not before.findings:
            findings = state.findings
            panorama.set_clipped(None if findings is None else findings.clipped)
            panorama.set_lamps(
                [SceneLamp(row.letter, row.azimuth_deg, row.elevation_deg) for row in state.lamps]
            )
        if before is None or state.layers != before.layers:
            panorama.set_shown(**{layer: layer in state.layers for layer in LAYERS})
        if before is None or state.marker_words != before.marker_words:
            panorama.set_marker_words(state.marker_words)
