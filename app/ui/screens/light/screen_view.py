"""The view of the Light screen, which shows the lamp, its best position and its effect.

Two further pages ask how bright the place and the lamp are.
"""

from __future__ import annotations

from functools import cached_property
from typing import Final, TypeVar

from PySide6.QtCore import QEvent, QSize, Qt, QTimer
from PySide6.QtGui import QResizeEvent, QShowEvent
from PySide6.QtWidgets import QApplication, QWidget

from app.core.text import tr
from app.ui.presenters.window_model import COMPUTING
from app.ui.screens.light.brightness_view import Brightness, MeterPage
from app.ui.screens.light.detail_view import DetailColumn, portrait_size
from app.ui.screens.light.lamp_view import LampColumn
from app.ui.screens.light.own_lamp.capture_view import CaptureSheet
from app.ui.screens.light.own_lamp.mask import MaskEdit
from app.ui.screens.light.own_lamp.mask_view import MaskSheet
from app.ui.screens.light.own_lamp.sheets import CaptureAsk, WordsAsk
from app.ui.screens.light.screen import LightPresenter, LightSizes, LightState
from app.ui.screens.light.style_list_view import PICTURE
from app.ui.screens.light.two_steps_view import Middle
from app.ui.theme import px
from app.ui.widgets.dialogs import LineSheet, SheetHost, ask_files
from app.ui.widgets.layouts import row, stacked
from app.ui.widgets.messages import Empty, StaleVeil
from app.ui.widgets.surfaces import Room

_Page = TypeVar("_Page", bound=QWidget)

_FULL: Final = (312, 376)

_COMPACT: Final = (272, 304)

_USUAL: Final = (1352, 952)  # width of the whole screen; the second is for the compact layout

_WIDEST: Final = 560

_GROWTH: Final = 0.16  # growth of each column per pixel beyond the usual width

_LEAST: Final = (560, 560)  # of the middle column

_LEAST_COMPACT: Final = (300, 520)

_PICTURES: Final = tr("Pictures (*.jpg *.jpeg *.png *.tif *.tiff *.dng *.exr *.hdr)")


def column_widths(width: int, compact: bool) -> tuple[int, int]:
    """Return the widths of the left-hand and right-hand columns.

    Both columns grow with the window. The exception is the right-hand column of the compact layout,
    where larger pictures would hide numbers.
    """
    more = max(int((width - px(_USUAL[compact])) * _GROWTH), 0)
    if compact:
        return min(px(_COMPACT[0]) + more, px(_FULL[0])), px(_COMPACT[1])
    left, right = (min(px(each) + more, px(_WIDEST)) for each in _FULL)
    return left, right


class LightScreen(SheetHost):
    """The view of `app.ui.screens.light.screen.LightPresenter`."""

    def __init__(self, presenter: LightPresenter, compact: bool) -> None:
        super().__init__()
        self.presenter = presenter
        self._compact = compact
        self._state: LightState | None = None
        self._actions: tuple[tuple[str, str], ...] = ()
        self.setAccessibleName(tr("Light"))
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setProperty("noFocusRing", True)
        self.lamp = LampColumn(presenter, compact)
        self.middle = Middle(presenter, compact)
        self.detail = DetailColumn(presenter, compact)
        self.empty = Empty("", icon="bulb")
        self.empty.pressed.connect(self._pressed)
        least = _LEAST_COMPACT if compact else _LEAST
        self._room = Room(self.middle, *least)
        self.stack = stacked(self.empty, self._room)
        row(self.lamp, (self.stack, 1), self.detail, into=self)
        self.veils = (
            StaleVeil(self.middle, COMPUTING, "bg"),
            StaleVeil(self.detail, COMPUTING),
        )
        self._portrait = QSize()
        # One resize changes several sizes, so render the pictures only after the last change.
        self._later = QTimer(self)
        self._later.setSingleShot(True)
        self._later.timeout.connect(self._tell_sizes)
        self.detail.laid.connect(self._on_layout)
        width = column_widths(px(_USUAL[compact]), compact)[1]
        self._on_layout(portrait_size(width, compact))
        self._tell_sizes()

    # Rarely needed pages are created on demand.

    @cached_property
    def question(self) -> Brightness:
        """The page that asks for the brightness of the place."""
        return self._added(Brightness(self.presenter))

    @cached_property
    def meter(self) -> MeterPage:
        """The page that asks for a light meter reading of the lamp."""
        return self._added(MeterPage(self.presenter))

    def _added(self, page: _Page) -> _Page:
        self.stack.addWidget(page)
        return page

    # -- what the presenter calls --------------------------------------------------------------

    def show_state(self, state: LightState) -> None:
        """Show the state, updating only the parts that have changed."""
        before, self._state = self._state, state
        self.lamp.show_state(state)
        self._show_page(state)
        for veil in self.veils:
            veil.cover(state.stale)
        if before is None or state.detail is not before.detail:
            self.detail.show_state(state.detail)
        self.detail.own.set_busy(tr("Reading…") if state.capturing else None)
        self.detail.setVisible(bool(state.detail.key))

    def _show_page(self, state: LightState) -> None:
        """Show the drawings, a question or the empty state, and keep the focus on that page."""
        page: QWidget = self._room
        if state.meter:
            self.meter.show_state(state.meter, state.meter_error)
            page = self.meter
        elif state.asks and not state.empty:
            self.question.show_state(state.bright)
            page = self.question
        elif state.empty or state.heads.shape is None:
            sentence = state.empty or tr("Trying the lamp all around the head…")
            self._actions = state.actions if state.empty else ()
            self.empty.set(sentence, *(words for _, words in self._actions))
            page = self.empty
        else:
            self.middle.show_state(state)
        focus = QApplication.focusWidget()
        here = focus is self or (focus is not None and self.stack.isAncestorOf(focus))
        other = self.stack.currentWidget() is not page
        if here and other:
            # Otherwise Qt moves the focus to the next widget in the window.
            self.setFocus(Qt.FocusReason.OtherFocusReason)
        self.stack.setCurrentWidget(page)
        if here and other:
            self._first_of(page).setFocus(Qt.FocusReason.OtherFocusReason)

    def _first_of(self, page: QWidget) -> QWidget:
        """Return the first widget on a page that can take the focus."""
        if page is self._room:
            return self.middle.map
        if isinstance(page, Brightness):
            return next(iter(page.answers.values()))
        if isinstance(page, MeterPage):
            return page.lux.edit
        return self.empty.button() if self._actions else self

    def take_lamp_focus(self) -> None:
        """Focus the map of lamp positions."""
        self.middle.map.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def ask_pictures(self) -> None:
        """Ask for photos of a lamp."""
        paths = ask_files(self, tr("Photos of your lamp in a dark room"), _PICTURES)
        if paths:
            self.presenter.lamps.take(paths)

    # -- sheets --------------------------------------------------------------------------------

    def ask_capture(self, ask: CaptureAsk) -> None:
        """Open the sheet that explains how to capture a lamp."""
        sheet = CaptureSheet(self.window(), self.presenter, ask)
        self.put_over(sheet, sheet.name.edit)

    def ask_words(self, ask: WordsAsk) -> None:
        """Open the sheet that asks for one of the lamp's values as text."""
        words = (ask.title, ask.label, ask.button, ask.text, ask.example)
        sheet = LineSheet(self.window(), *words)

        def on_text(text: str) -> None:
            sheet.show_busy(True)
            self.presenter.lamp_actions.answer(ask.wish, text)

        sheet.taken.connect(on_text)
        self.put_over(sheet)

    def ask_mask(self, edit: MaskEdit) -> None:
        """Open the sheet for painting the mask."""
        sheet = MaskSheet(self.window(), edit)
        self.put_over(sheet, sheet.canvas)

    def say(self, sentence: str) -> None:
        """Show an error in the open sheet."""
        say = getattr(self.sheet, "say", None)
        if say is not None:
            say(sentence)

    def _pressed(self, number: int) -> None:
        if number < len(self._actions):
            self.presenter.press(self._actions[number][0])

    # -- sizes ---------------------------------------------------------------------------------

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Divide the space between the columns."""
        left, right = column_widths(self.width(), self._compact)
        self.lamp.setFixedWidth(left)
        self.detail.setFixedWidth(right)
        super().resizeEvent(event)

    def showEvent(self, event: QShowEvent) -> None:
        """Focus the map of lamp positions, unless another widget has the focus."""
        super().showEvent(event)
        QTimer.singleShot(0, self, self._take_keys)

    def _take_keys(self) -> None:
        focus = QApplication.focusWidget()
        if self.isVisible() and (focus is None or not focus.isVisible()):
            self.middle.map.setFocus(Qt.FocusReason.OtherFocusReason)

    def event(self, event: QEvent) -> bool:
        """Render the pictures again when the screen's pixel density changes."""
        if event.type() == QEvent.Type.DevicePixelRatioChange:
            self._later.start()
        return super().event(event)

    def _on_layout(self, portrait: QSize) -> None:
        if portrait != self._portrait:
            self._portrait = portrait
            self._later.start()

    def _tell_sizes(self) -> None:
        dpr = self.devicePixelRatioF()
        side = round(px(PICTURE) * dpr)
        self.presenter.sized(
            LightSizes(
                (side, side),
                (round(self._portrait.height() * dpr), round(self._portrait.width() * dpr)),
            )
        )
