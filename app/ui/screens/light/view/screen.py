"""View of the Light screen: the lamp at the left, where it goes in the middle, what it does."""

from __future__ import annotations

from functools import cached_property, partial
from typing import TYPE_CHECKING, Final, TypeVar

from PySide6.QtCore import QEvent, QSize, Qt, QTimer
from PySide6.QtWidgets import QApplication, QHBoxLayout, QStackedWidget, QWidget

from app.ui.screens.light.mask import RADII_DEG
from app.ui.screens.light.state import LightSizes
from app.ui.screens.light.view.asking import KeysSheet
from app.ui.screens.light.view.detail import DetailColumn, portrait_size
from app.ui.screens.light.view.lamp_column import LampColumn
from app.ui.screens.light.view.middle import Middle
from app.ui.screens.light.view.question import Brightness, Meter
from app.ui.screens.light.view.row import PICTURE
from app.ui.theme import theme
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.choices import LabelledSlider, Segmented
from app.ui.widgets.dialogs import ask_files
from app.ui.widgets.labels import Text
from app.ui.widgets.messages import Empty
from app.ui.widgets.plots.mask_canvas import MaskCanvas
from app.ui.widgets.surfaces import Room

if TYPE_CHECKING:
    from PySide6.QtGui import QHideEvent, QResizeEvent, QShowEvent

    from app.ui.screens.light.mask import MaskEdit, MaskState
    from app.ui.screens.light.presenter import LightPresenter
    from app.ui.screens.light.state import CaptureAsk, LightState, WordsAsk
    from app.ui.widgets.dialogs import Sheet


_WHAT: Final = (
    "Amber is lamp. Reflections, other lights and the lit wall are not: take them away, and add "
    "what is missing."
)
_TOOLS: Final = (("lamp", "+ Lamp"), ("not", "− Not the lamp"))


class MaskSheet(KeysSheet):
    """Shows a `MaskState` and tells the presenter what the user does."""

    def __init__(self, host: QWidget, edit: MaskEdit) -> None:
        super().__init__(host, "Where the lamp is", 840)
        self._edit = edit
        t = theme()
        self.canvas = MaskCanvas()
        self.tool = Segmented(_TOOLS, "Brush")
        self.radius = LabelledSlider(
            "Size", *RADII_DEG, 3.0, 0.5, lambda v: f"{v:.1f}°", inline=True
        )
        self.nearer = IconButton("plus", "Look closer", shortcut="+")
        self.farther = IconButton("minus", "See more", shortcut="−")
        self.back = IconButton("undo", "Undo the last stroke")
        self.search = Button("Find it again", "refresh")
        self.save = Button("Save", kind="primary")
        cancel = Button("Cancel")
        tools = QHBoxLayout()
        tools.setSpacing(t.px(8))
        tools.addWidget(self.tool)
        tools.addSpacing(t.px(8))
        tools.addWidget(self.radius, 1)
        tools.addSpacing(t.px(8))
        tools.addWidget(Text("Zoom", 14, role="dim"))
        for button in (self.farther, self.nearer, self.back):
            tools.addWidget(button)
        self._words = Text("", 12, role="dim", wrap=True)
        self.body.addLayout(tools)
        self.body.addWidget(self.canvas)
        self.body.addWidget(self._words)
        self.foot.insertWidget(0, self.search)
        self.add_button(cancel)
        self.add_button(self.save)
        self.canvas.pressed.connect(lambda a, e: edit.press((a, e)))
        self.canvas.drawn.connect(lambda a, e: edit.draw(((a, e),)))
        self.canvas.lifted.connect(edit.lift)
        self.tool.chosen.connect(lambda key: edit.set_lit(key == "lamp"))
        self.radius.changed.connect(edit.set_radius)
        self.nearer.clicked.connect(lambda: self.canvas.zoom(1))
        self.farther.clicked.connect(lambda: self.canvas.zoom(-1))
        self.back.clicked.connect(edit.undo)
        self.search.clicked.connect(edit.find_again)
        self.save.clicked.connect(edit.save)
        cancel.clicked.connect(self.shut)
        self.closed.connect(edit.detach)
        self.destroyed.connect(partial(_left, edit))
        edit.attach(self)

    def show_state(self, state: MaskState) -> None:
        """Show it."""
        self.set_title(f"Where “{state.title}” is")
        self.canvas.show_state(state)
        self.tool.choose("lamp" if state.lit else "not")
        self.radius.set_value(state.radius_deg)
        self.back.set_available(state.can_undo, "Nothing painted yet.")
        self.save.set_available(state.changed and not state.busy, "Nothing has changed yet.")
        self.search.set_available(not state.busy)
        self._words.set_role("err" if state.error else "dim")
        self._words.set_text(state.error or f"{_WHAT} {state.gives}".strip())


def _left(edit: MaskEdit, _sheet: object = None) -> None:
    edit.detach()


_Page = TypeVar("_Page", bound=QWidget)

_FULL: Final = (312, 376)
_COMPACT: Final = (272, 304)
_USUAL: Final = 1352
_WIDEST: Final = 560
_GROWTH: Final = 0.16  # of each column, for each pixel beyond the usual width
_LEAST: Final = (560, 560)  # of the middle
_LEAST_COMPACT: Final = (300, 520)
_PICTURES: Final = "Pictures (*.jpg *.jpeg *.png *.tif *.tiff *.dng *.exr *.hdr)"


def column_widths(width: int, compact: bool) -> tuple[int, int]:
    """Choose the widths of the left and the right column.

    Parameters
    ----------
    width : int
        Of the screen, logical pixels.

    Returns
    -------
    int, int
        312 and 376 in the usual window; from there on they grow with it.
    """
    t = theme()
    if compact:
        return t.px(_COMPACT[0]), t.px(_COMPACT[1])
    more = max(int((width - t.px(_USUAL)) * _GROWTH), 0)
    left, right = (min(t.px(each) + more, t.px(_WIDEST)) for each in _FULL)
    return left, right


class LightScreen(QWidget):
    """The view of `app.ui.screens.light.presenter.LightPresenter`."""

    def __init__(self, presenter: LightPresenter, compact: bool) -> None:
        super().__init__()
        self.presenter = presenter
        self._compact = compact
        self._state: LightState | None = None
        self._actions: tuple[tuple[str, str], ...] = ()
        self.setAccessibleName("Light")
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setProperty("noFocusRing", True)
        self.lamp = LampColumn(presenter, compact)
        self.middle = Middle(presenter, compact)
        self.detail = DetailColumn(presenter, compact)
        self._sheet: Sheet | None = None
        self.empty = Empty("", icon="bulb")
        self.empty.pressed.connect(self._pressed)
        self.stack = QStackedWidget()
        least = _LEAST_COMPACT if compact else _LEAST
        self._room = Room(self.middle, *least)
        for page in (self.empty, self._room):
            self.stack.addWidget(page)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(0)
        row.addWidget(self.lamp)
        row.addWidget(self.stack, 1)
        row.addWidget(self.detail)
        self._portrait = QSize()
        # Several sizes change with one resize; pictures are made once, after the last.
        self._later = QTimer(self, singleShot=True, interval=0)
        self._later.timeout.connect(self._tell_sizes)
        self.detail.laid.connect(self._laid)
        t = theme()
        width = column_widths(t.px(_USUAL), compact)[1]
        self._laid(portrait_size(width, compact))
        self._tell_sizes()

    # Pages that are seldom needed are made when they are.

    @cached_property
    def question(self) -> Brightness:
        """The page that asks how bright it is."""
        return self._added(Brightness(self.presenter))

    @cached_property
    def meter(self) -> Meter:
        """The page that asks what a light meter says of the lamp."""
        return self._added(Meter(self.presenter))

    def _added(self, page: _Page) -> _Page:
        self.stack.addWidget(page)
        return page

    # -- what the presenter calls --------------------------------------------------------------

    def show_state(self, state: LightState) -> None:
        """Show what changed."""
        before, self._state = self._state, state
        self.lamp.show_state(state)
        self._show_page(state)
        if before is None or state.detail is not before.detail:
            self.detail.show_state(state.detail)
        self.detail.own.set_busy("Reading…" if state.capturing.busy else None)
        self.detail.setVisible(bool(state.detail.key))

    def _show_page(self, state: LightState) -> None:
        """Show schematics, question or what is missing; the keyboard stays on the page."""
        page: QWidget = self._room
        if state.meter:
            self.meter.show_state(state.meter, state.meter_error)
            page = self.meter
        elif state.asks and not state.empty:
            self.question.show_state(state.bright)
            page = self.question
        elif state.empty or state.heads.shape is None:
            sentence = state.empty or "The lamp is being tried all around the head…"
            self._actions = state.actions if state.empty else ()
            self.empty.set(sentence, *(words for _, words in self._actions))
            page = self.empty
        else:
            self.middle.show_state(state)
        focus = QApplication.focusWidget()
        here = focus is self or (focus is not None and self.stack.isAncestorOf(focus))
        other = self.stack.currentWidget() is not page
        if here and other:
            # Else Qt gives it to whatever comes next in the window.
            self.setFocus(Qt.FocusReason.OtherFocusReason)
        self.stack.setCurrentWidget(page)
        if here and other:
            self._first_of(page).setFocus(Qt.FocusReason.OtherFocusReason)

    def _first_of(self, page: QWidget) -> QWidget:
        """Give the widget of a page that the keyboard comes to."""
        if page is self._room:
            return self.middle.map
        if isinstance(page, Brightness):
            return next(iter(page.answers.values()))
        if isinstance(page, Meter):
            return page.lux.edit
        return self.empty.button() if self._actions else self

    def take_lamp_focus(self) -> None:
        """Give the keyboard to the lamp."""
        self.middle.map.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def ask_pictures(self) -> None:
        """Ask for the pictures of a lamp and hand them to the presenter."""
        paths = ask_files(self, "Pictures of your lamp in a dark room", _PICTURES)
        if paths:
            self.presenter.take_pictures(paths)

    # -- over the screen -----------------------------------------------------------------------

    def ask_capture(self, ask: CaptureAsk) -> None:
        """Say how a lamp is captured."""
        from app.ui.screens.light.view.asking import CaptureSheet

        sheet = CaptureSheet(self.window(), self.presenter, ask)
        self._put_over(sheet, sheet.name.edit)

    def say_capture(self, sentence: str) -> None:
        """Say what is wrong with what was said of the new lamp."""
        self._say(sentence)

    def ask_words(self, ask: WordsAsk) -> None:
        """Ask for a line about the lamp."""
        from app.ui.screens.light.view.asking import WordsSheet

        self._put_over(WordsSheet(self.window(), self.presenter, ask))

    def say_words(self, sentence: str) -> None:
        """Say what is wrong with that line."""
        self._say(sentence)

    def ask_mask(self, edit: MaskEdit) -> None:
        """Let the user paint where the lamp is."""
        from app.ui.screens.light.view.screen import MaskSheet

        sheet = MaskSheet(self.window(), edit)
        self._put_over(sheet, sheet.canvas)

    @property
    def sheet(self) -> Sheet | None:
        """What lies over the screen."""
        return self._sheet

    def _say(self, sentence: str) -> None:
        say = getattr(self._sheet, "say", None)
        if say is not None:
            say(sentence)

    def _put_over(self, sheet: Sheet, focus: QWidget | None = None) -> None:
        if self._sheet is not None:
            self._sheet.shut()
        self._sheet = sheet
        sheet.closed.connect(self._sheet_closed)
        sheet.open(focus)

    def _sheet_closed(self) -> None:
        sheet, self._sheet = self._sheet, None
        if sheet is not None:
            sheet.deleteLater()

    def hideEvent(self, event: QHideEvent) -> None:
        """Take what lies over it away."""
        if self._sheet is not None:
            self._sheet.shut()
        super().hideEvent(event)

    def _pressed(self, number: int) -> None:
        if number < len(self._actions):
            self.presenter.press(self._actions[number][0])

    # -- sizes ---------------------------------------------------------------------------------

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Divide the room."""
        left, right = column_widths(self.width(), self._compact)
        self.lamp.setFixedWidth(left)
        self.detail.setFixedWidth(right)
        super().resizeEvent(event)

    def showEvent(self, event: QShowEvent) -> None:
        """Give the keyboard to the lamp, unless somebody else has it."""
        super().showEvent(event)
        QTimer.singleShot(0, self, self._take_keys)

    def _take_keys(self) -> None:
        focus = QApplication.focusWidget()
        if self.isVisible() and (focus is None or not focus.isVisible()):
            self.middle.map.setFocus(Qt.FocusReason.OtherFocusReason)

    def event(self, event: QEvent) -> bool:
        """Make sharper pictures on a screen with smaller pixels."""
        if event.type() == QEvent.Type.DevicePixelRatioChange:
            self._later.start()
        return super().event(event)

    def _laid(self, portrait: QSize) -> None:
        if portrait != self._portrait:
            self._portrait = portrait
            self._later.start()

    def _tell_sizes(self) -> None:
        dpr = self.devicePixelRatioF()
        side = round(theme().px(PICTURE) * dpr)
        self.presenter.sized(
            LightSizes(
                (side, side),
                (round(self._portrait.height() * dpr), round(self._portrait.width() * dpr)),
            )
        )
