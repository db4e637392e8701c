"""View of the Light screen: the lamp at the left, where it goes in the middle, what it does.

The two questions of the Light screen: how bright the place is, and how bright the lamp.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from typing import Final, TypeVar

from PySide6.QtCore import QEvent, QSize, Qt, QTimer
from PySide6.QtGui import QResizeEvent, QShowEvent
from PySide6.QtWidgets import QApplication, QSizePolicy, QWidget

from app.core.text import tr
from app.ui.plots.mask_canvas import MaskCanvas
from app.ui.presenters.model import COMPUTING
from app.ui.screens.light.columns_view import (
    PICTURE,
    DetailColumn,
    LampColumn,
    Middle,
    portrait_size,
)
from app.ui.screens.light.lamps import Source
from app.ui.screens.light.mask import RADII_DEG, MaskEdit, MaskState
from app.ui.screens.light.screen import LightPresenter
from app.ui.screens.light.state import (
    BRIGHTNESS,
    BrightState,
    CaptureAsk,
    LightSizes,
    LightState,
    WordsAsk,
)
from app.ui.theme import px
from app.ui.widgets.accessibility import OwnKeys
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.choices import LabelledSlider, SegmentedChoice
from app.ui.widgets.dialogs import KeysSheet, LineSheet, SheetHost, ask_files
from app.ui.widgets.fields import TextField
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import add, column, grid, row, stacked
from app.ui.widgets.messages import Empty, StaleVeil
from app.ui.widgets.surfaces import Room
from app.words.phrases.quantities import lux_words

_ALONE: Final = tr("Without a distance the lamp can be held anywhere; measure it if you can.")


class CaptureSheet(KeysSheet):
    """How a lamp is captured, and what is made one now."""

    def __init__(self, host: QWidget, presenter: LightPresenter, ask: CaptureAsk) -> None:
        super().__init__(host, tr("Capture a lamp of your own"), 600)
        self._presenter = presenter
        top = Qt.AlignmentFlag.AlignTop
        steps: list[Text | tuple[Text, Qt.AlignmentFlag]] = []
        for number, sentence in enumerate((*ask.guide, ask.other)):
            mark = Text(f"{number + 1}" if number < len(ask.guide) else tr("or"), 14, 600)
            steps += [(mark, top), Text(sentence, 14, role="dim", wrap=True)]
        self.body.addLayout(grid(*steps, across=2, gap=(12, 8), stretched=1))
        self.name = TextField(tr("Name"), tr("My panel"))
        self.name.set_text(ask.name)
        self.distance = TextField(tr("From the camera to the lamp"), "40 cm")
        for field in (self.name, self.distance):
            field.changed.connect(lambda _text: self.distance.set_error(""))
        self.body.addLayout(row((self.name, 1, top), (self.distance, 1, top), gap=16))
        self.body.addWidget(Text(_ALONE, 12, role="dim", wrap=True))
        self.place = Button(ask.place, do=lambda: self._take("place"))
        self.files = Button(tr("Add from files…"), "open", kind="primary")
        self.files.clicked.connect(lambda: self._take("files"))
        self.add_button(self.place)
        self.add_button(self.files)
        if not ask.place:
            # Hidden only: what is shown before it has a parent opens as a window.
            self.place.hide()

    def say(self, sentence: str) -> None:
        """Say what is wrong with the distance; nothing to say closes the sheet."""
        self.distance.set_error(sentence)
        if not sentence:
            self.shut()

    def _take(self, source: Source) -> None:
        self._presenter.lamps.capture(source, self.name.text(), self.distance.text())


_WHAT: Final = tr(
    "The lamp is amber. Reflections, other lights and the lit wall are not part of it: "
    "remove them, and add what is missing."
)
_TOOLS: Final = (("lamp", tr("+ Lamp")), ("not", tr("− Not the lamp")))
_WIDEST_SHEET: Final = 520
_WHY: Final = tr(
    "What a lamp can do depends on how much light there is besides. Choose "
    "what comes nearest, or type what a light meter reads in front of the "
    "face while it looks at the camera."
)


class _SheetPage(QWidget):
    """A column in the middle of the room that there is."""

    def __init__(self, title: str) -> None:
        super().__init__()
        self.setAccessibleName(title)
        self.words = Text("", 14, role="dim", wrap=True)
        title_text = Text(title, 20, 600, wrap=True)
        self.column = column(..., title_text, self.words, 8, gap=8, margins=None)
        inside = QWidget()
        inside.setMaximumWidth(px(_WIDEST_SHEET))
        inside.setLayout(self.column)
        row(..., (inside, 100), ..., into=self, gap=None, margins=24)

    def add_field(self, field: TextField, button: Button, take: Callable[[str], None]) -> None:
        """Put a field and its button side by side."""
        # In line with the field, whose label stands above it.
        self.column.addLayout(row((field, 1), column(20, button, ...), gap=8))
        OwnKeys(field.edit)
        field.entered.connect(take)
        field.changed.connect(lambda _text: field.set_error(""))
        button.clicked.connect(lambda: take(field.text()))


class Brightness(_SheetPage):
    """The question how bright the place is, with its usual answers and a field for any other."""

    def __init__(self, presenter: LightPresenter) -> None:
        super().__init__(tr("How bright is it here?"))
        scale = presenter.scale
        self.words.set_text(_WHY)
        self.answers: dict[str, Button] = {}
        for key, name, lux in BRIGHTNESS:
            button = Button(f"{name}, {lux_words(lux)}")
            button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
            button.clicked.connect(lambda _on=False, key=key: scale.choose(key))
            self.answers[key] = button
        add(self.column, grid(*self.answers.values(), across=2, gap=(8, 8)), 8)
        self.lux = TextField(tr("Light meter at the face, lux"), "450")
        self.take = Button(tr("Set"))
        self.add_field(self.lux, self.take, scale.type)
        self._last: BrightState | None = None
        self._last_input: tuple[str, ...] = ()
        self.keep = Button("", size="small", do=scale.keep)
        self.measured = Button("", size="small", do=scale.measure)
        add(self.column, 8, row(self.keep, self.measured, ..., gap=8))
        self.column.addStretch(2)

    def show_state(self, state: BrightState) -> None:
        """Show which answer counts; what is being typed is left alone."""
        if state == self._last:
            return
        self._last = state
        before, self._last_input = self._last_input, (state.key, state.text, state.keep)
        if self._last_input != before:
            self.lux.set_text(state.text)
        self.lux.set_error(state.error)
        for key, name, lux in BRIGHTNESS:
            icon = "check" if key == state.key else ""
            self.answers[key].set_text(f"{name}, {lux_words(lux)}", icon)
        for button, words in ((self.keep, state.keep), (self.measured, state.measured)):
            button.set_text(words)
            button.setVisible(bool(words))


class MeterPage(_SheetPage):
    """The question how bright a captured lamp is whose files do not say so."""

    def __init__(self, presenter: LightPresenter) -> None:
        super().__init__(tr("How bright is this lamp?"))
        self.lux = TextField(tr("Light meter where the camera stood, facing the lamp, lux"), "640")
        self.take = Button(tr("Set"))
        self.add_field(self.lux, self.take, lambda text: presenter.lamp_actions.answer("lux", text))
        self.again = Button(tr("Capture it again"), do=presenter.lamps.begin)
        add(self.column, 8, (self.again, 0, Qt.AlignmentFlag.AlignLeft))
        self.column.addStretch(2)

    def show_state(self, sentence: str, error: str) -> None:
        """Show why the lamp cannot be compared, and what is wrong with what was typed."""
        self.words.set_text(sentence)
        self.lux.set_error(error)


class MaskSheet(KeysSheet):
    """Shows a `MaskState` and tells the presenter what the user does."""

    def __init__(self, host: QWidget, edit: MaskEdit) -> None:
        super().__init__(host, tr("Where the lamp is"), 840)
        self._edit = edit
        self.canvas = MaskCanvas()
        self.tool = SegmentedChoice(_TOOLS, tr("Brush"), do=lambda key: edit.set_lit(key == "lamp"))
        self.radius = LabelledSlider(
            tr("Size"), *RADII_DEG, 3.0, 0.5, lambda v: f"{v:.1f}°", inline=True
        )
        self.nearer = IconButton("plus", tr("Look closer"), shortcut="+")
        self.farther = IconButton("minus", tr("See more"), shortcut="−")
        self.back = IconButton("undo", tr("Undo the last stroke"), do=edit.undo)
        self.search = Button(tr("Find it again"), "refresh", do=edit.find_again)
        self.save = Button(tr("Save"), kind="primary", do=edit.save)
        cancel = Button(tr("Cancel"), do=self.shut)
        self._words = Text("", 12, role="dim", wrap=True)
        brush = (self.tool, 8, (self.radius, 1), 8, Text(tr("Zoom"), 14, role="dim"))
        tools = row(*brush, self.farther, self.nearer, self.back, gap=8)
        add(self.body, tools, self.canvas, self._words)
        self.foot.insertWidget(0, self.search)
        self.add_button(cancel)
        self.add_button(self.save)
        self.canvas.pressed.connect(lambda a, e: edit.press((a, e)))
        self.canvas.drawn.connect(lambda a, e: edit.draw(((a, e),)))
        self.canvas.lifted.connect(edit.lift)
        self.radius.changed.connect(edit.set_radius)
        self.nearer.clicked.connect(lambda: self.canvas.zoom(1))
        self.farther.clicked.connect(lambda: self.canvas.zoom(-1))
        self.closed.connect(edit.detach)
        self.destroyed.connect(partial(_leave, edit))
        edit.attach(self)

    def show_state(self, state: MaskState) -> None:
        """Show it."""
        self.set_title(tr("Where “{title}” is", title=state.title))
        self.canvas.show_state(state)
        self.tool.choose("lamp" if state.adds_lamp else "not")
        self.radius.set_value(state.radius_deg)
        self.back.set_available(state.can_undo, tr("Nothing painted yet."))
        self.save.set_available(state.changed and not state.busy, tr("Nothing has changed yet."))
        self.search.set_available(not state.busy)
        self._words.set_role("err" if state.error else "dim")
        self._words.set_text(state.error or f"{_WHAT} {state.gives}".strip())


def _leave(edit: MaskEdit, _sheet: object = None) -> None:
    edit.detach()


_Page = TypeVar("_Page", bound=QWidget)

_FULL: Final = (312, 376)
_COMPACT: Final = (272, 304)
_USUAL: Final = (1352, 952)  # width of the whole screen, in the compact layout the second
_WIDEST: Final = 560
_GROWTH: Final = 0.16  # of each column, for each pixel beyond the usual width
_LEAST: Final = (560, 560)  # of the middle
_LEAST_COMPACT: Final = (300, 520)
_PICTURES: Final = tr("Pictures (*.jpg *.jpeg *.png *.tif *.tiff *.dng *.exr *.hdr)")


def column_widths(width: int, compact: bool) -> tuple[int, int]:
    """Choose the widths of the left and the right column.

    They grow with the window; a compact right one does not: larger pictures would hide numbers.
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
        # Several sizes change with one resize; pictures are made once, after the last.
        self._later = QTimer(self)
        self._later.setSingleShot(True)
        self._later.timeout.connect(self._tell_sizes)
        self.detail.laid.connect(self._on_layout)
        width = column_widths(px(_USUAL[compact]), compact)[1]
        self._on_layout(portrait_size(width, compact))
        self._tell_sizes()

    # Pages that are seldom needed are made when they are.

    @cached_property
    def question(self) -> Brightness:
        """The page that asks how bright it is."""
        return self._added(Brightness(self.presenter))

    @cached_property
    def meter(self) -> MeterPage:
        """The page that asks what a light meter says of the lamp."""
        return self._added(MeterPage(self.presenter))

    def _added(self, page: _Page) -> _Page:
        self.stack.addWidget(page)
        return page

    # -- what the presenter calls --------------------------------------------------------------

    def show_state(self, state: LightState) -> None:
        """Show what changed."""
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
        """Show schematics, question or what is missing; the keyboard stays on the page."""
        page: QWidget = self._room
        if state.meter:
            self.meter.show_state(state.meter, state.meter_error)
            page = self.meter
        elif state.asks and not state.empty:
            self.question.show_state(state.bright)
            page = self.question
        elif state.empty or state.heads.shape is None:
            sentence = state.empty or tr("The lamp is being tried all around the head…")
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
        if isinstance(page, MeterPage):
            return page.lux.edit
        return self.empty.button() if self._actions else self

    def take_lamp_focus(self) -> None:
        """Give the keyboard to the lamp."""
        self.middle.map.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def ask_pictures(self) -> None:
        """Ask for the pictures of a lamp and hand them to the presenter."""
        paths = ask_files(self, tr("Pictures of your lamp in a dark room"), _PICTURES)
        if paths:
            self.presenter.lamps.take(paths)

    # -- over the screen -----------------------------------------------------------------------

    def ask_capture(self, ask: CaptureAsk) -> None:
        """Say how a lamp is captured."""
        sheet = CaptureSheet(self.window(), self.presenter, ask)
        self.put_over(sheet, sheet.name.edit)

    def ask_words(self, ask: WordsAsk) -> None:
        """Ask for a line about the lamp."""
        words = (ask.title, ask.label, ask.button, ask.text, ask.example)
        sheet = LineSheet(self.window(), *words)

        def on_text(text: str) -> None:
            sheet.show_busy(True)
            self.presenter.lamp_actions.answer(ask.wish, text)

        sheet.taken.connect(on_text)
        self.put_over(sheet)

    def ask_mask(self, edit: MaskEdit) -> None:
        """Let the user paint where the lamp is."""
        sheet = MaskSheet(self.window(), edit)
        self.put_over(sheet, sheet.canvas)

    def say(self, sentence: str) -> None:
        """Say in the sheet what is wrong with its answer."""
        say = getattr(self.sheet, "say", None)
        if say is not None:
            say(sentence)

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
