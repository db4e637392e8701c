"""The view of the Turn screen, with pictures on the left, guidance on the right and a timer."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QSize, Qt, QTimer
from PySide6.QtGui import QHideEvent, QKeyEvent, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QApplication, QWidget

from app.core.text import tr
from app.ui.presenters.window_model import COMPUTING
from app.ui.screens.turn.guidance_view import DESIGNED, GuideColumn
from app.ui.screens.turn.live_column_view import LeftColumn
from app.ui.screens.turn.photos.photos_view import ShotsSheet
from app.ui.screens.turn.screen import TurnPresenter
from app.ui.screens.turn.state import TurnSizes, TurnState
from app.ui.theme import px, theme
from app.ui.widgets.dialogs import SheetHost, ask_files, ask_folder
from app.ui.widgets.layouts import column, row, stacked
from app.ui.widgets.messages import Empty, StaleVeil
from app.ui.widgets.surfaces import Scroll, Surface
from app.words.photos import PHOTO_FILTER

_TICK_MS: Final = 40
_OPEN_PHOTO: Final = tr("Open the photo you took")
_COLUMN: Final = 480
_COMPACT_COLUMN: Final = 400
_WIDEST_SIDE: Final = 560
_VERY_WIDE: Final = 2400
_FACTORS: Final = (0.45, 3.0)
_STEPS: Final = 20  # steps per unit of scale, so that the column is not rebuilt for every pixel


class TurnScreen(SheetHost):
    """The two-column view of a `TurnState`."""

    def __init__(self, presenter: TurnPresenter, compact: bool) -> None:
        super().__init__()
        self.presenter = presenter
        self._compact = compact
        self._state: TurnState | None = None
        self._factor = 0.0
        self.setAccessibleName(tr("Turn"))
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setProperty("noFocusRing", True)
        self._empty = Empty("")
        self._empty.pressed.connect(lambda _number: presenter.fill())
        self._body = QWidget()
        self._stack = stacked(self._empty, self._body)
        self.veil = StaleVeil(self._body, COMPUTING, "bg")
        self.left = LeftColumn(presenter, compact)
        self.left.arranged.connect(self._measure)
        self.left.shots.listed.connect(self._list_shots)
        self._left_scroll = Scroll(self.left)
        self._right = Surface(lines=("left",))
        self._right_scroll = Scroll()
        inside = column(self._right_scroll, into=self._right, gap=None)
        inside.setContentsMargins(theme().line_width, 0, 0, 0)
        row((self._left_scroll, 1), self._right, into=self._body)
        column(self._stack, into=self, gap=None)
        self.column: GuideColumn
        self._clock = QTimer(self)
        self._clock.setInterval(_TICK_MS)
        self._clock.setTimerType(Qt.TimerType.PreciseTimer)
        self._clock.timeout.connect(presenter.tick)
        self._make_column(1.0)

    def show_state(self, state: TurnState) -> None:
        """Show the state, updating only the parts that have changed."""
        before, self._state = self._state, state
        if state.empty:
            self._empty.set(state.empty, state.empty_action)
            self._stack.setCurrentWidget(self._empty)
            return
        self._stack.setCurrentWidget(self._body)
        self.veil.cover(state.stale)
        if before is not None and before.empty:
            before = None
        self._show_left(state, before)
        self._show_right(state, before)

    def _show_left(self, state: TurnState, before: TurnState | None) -> None:
        if before is None or state.live != before.live:
            self.left.show_live(state.live)
        self.left.show_pictures(state.pictures)
        strip = None if before is None else before.pictures.strip
        if before is None or state.scale != before.scale or state.pictures.strip is not strip:
            self.left.show_scale(state.scale, state.pictures)
        self.left.plan.set_plan(state.plan, state.plan_words)
        if before is None or state.alignment != before.alignment:
            self.left.show_alignment(state.alignment)
        self.left.show_menu(state.menu)
        if before is None or state.demo_deg != before.demo_deg:
            self.left.show_demo(state.demo_deg)
        self.left.shots.show_shots(state.shots)
        if isinstance(self.sheet, ShotsSheet):
            self.sheet.show_shots(state.shots)

    def _show_right(self, state: TurnState, before: TurnState | None) -> None:
        if before is None or state.mode != before.mode:
            self.column.set_mode(state.mode)
        # An outdated goal is not announced.
        if not state.stale and (
            before is None or before.stale or state.guidance != before.guidance
        ):
            self.column.show_guidance(state.guidance)
            plain = "amberfill" if theme().contrast else "panel"
            self._right.set_fill("okfill" if state.guidance.inside else plain)
            self.left.shots.set_main(state.guidance.inside)
        self.column.portraits.show_style(state.style, state.pictures)

    def ask_photos(self) -> None:
        """Let the user choose photos, then check them."""
        paths = ask_files(self, _OPEN_PHOTO, PHOTO_FILTER)
        if paths:
            self.presenter.open_photos(paths)

    def ask_folder(self) -> None:
        """Let the user choose a folder, then watch it for photos."""
        folder = ask_folder(self, tr("Watch a folder for photos"))
        if folder is not None:
            self.presenter.shots.watch(folder)

    def _list_shots(self) -> None:
        presenter = self.presenter
        sheet = ShotsSheet(self.window(), presenter.shots.remove, presenter.set_mirrored)
        if self._state is not None:
            sheet.show_shots(self._state.shots)
        self.put_over(sheet)

    def ask_source(self) -> None:
        """Let the user choose another live camera and its field of view."""
        from app.ui.screens.turn.live.source_view import SourceSheet

        self.put_over(SourceSheet(self.window(), self.presenter.sources))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Divide the space between the columns. The large text grows with the window."""
        super().resizeEvent(event)
        self._arrange()

    def _arrange(self) -> None:
        t, room = theme(), self.size()
        width = self._column_width()
        self._right.setFixedWidth(width)
        scale = min(width / px(DESIGNED.width()), room.height() / px(DESIGNED.height()))
        scale = min(max(int(scale * _STEPS + 1e-6) / _STEPS, _FACTORS[0]), _FACTORS[1])
        if scale != self._factor:
            self._make_column(scale)
        self.column.fit(width - t.line_width)
        bar = self._left_scroll.verticalScrollBar().sizeHint().width()
        self.left.fit(QSize(room.width() - width, room.height()), bar)

    def _column_width(self) -> int:
        width = self.width()
        third = width // 3
        if width >= px(_VERY_WIDE):
            return third
        designed = px(_COMPACT_COLUMN if self._compact else _COLUMN)
        # Larger text must not take space away from the pictures.
        return min(max(designed, min(third, px(_WIDEST_SIDE))), round(width * 0.45))

    def _make_column(self, factor: float) -> None:
        self._factor = factor
        self.column = GuideColumn(factor, self.presenter.set_mode)
        self._right_scroll.setWidget(self.column)
        if self._state is not None and not self._state.empty:
            self._show_right(self._state, None)

    def _measure(self) -> None:
        """Report the sizes of the pictures to the presenter."""
        ratio = self.devicePixelRatioF()

        def pixels(size: QSize) -> tuple[int, int]:
            high, wide = round(size.height() * ratio), round(size.width() * ratio)
            return max(high, 1), max(wide, 1)

        self.presenter.measure(
            TurnSizes(
                pixels(self.left.well_size),
                pixels(self.left.strip_size),
                pixels(self.column.portraits.size),
            )
        )

    def showEvent(self, event: QShowEvent) -> None:
        """Start the timer, and take the keyboard focus unless a control already has it."""
        super().showEvent(event)
        self._clock.start()
        self._arrange()
        # Wait one event loop, because showing the screen still moves the focus.
        QTimer.singleShot(0, self, self._take_keys)

    def _take_keys(self) -> None:
        focus = QApplication.focusWidget()
        if self.isVisible() and (focus is None or not self.isAncestorOf(focus)):
            self.setFocus(Qt.FocusReason.OtherFocusReason)

    def hideEvent(self, event: QHideEvent) -> None:
        """Stop the timer."""
        super().hideEvent(event)
        self._clock.stop()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move the demo's camera with the arrow keys if no control uses them."""
        steps = {Qt.Key.Key_Right: 1.0, Qt.Key.Key_Left: -1.0}
        step = steps.get(Qt.Key(event.key()))
        if step is None or self.left.demo is None:
            super().keyPressEvent(event)
            return
        coarse = event.modifiers() & Qt.KeyboardModifier.ShiftModifier
        self.presenter.demo_step(step * (10.0 if coarse else 1.0))
