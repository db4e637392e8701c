"""The details of the chosen style: its pictures, plot, numbers, panorama and next steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from PySide6.QtCore import QRect, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent, QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QStackedWidget, QWidget

from app.core.text import tr
from app.ui.plots.match_circle import PolarPlot
from app.ui.plots.weights import WeightPanorama
from app.ui.presenters.actions import Action
from app.ui.presenters.window_model import COMPUTING, NEEDS_LIGHT
from app.ui.screens.styles.cards_view import Facts, TurnWords
from app.ui.screens.styles.detail import DetailState
from app.ui.screens.styles.reason.reason import NO_REASON
from app.ui.screens.styles.reason.reason_view import MarkedPicture, ReasonBlock
from app.ui.theme import theme
from app.ui.widgets.buttons import Button, IconButton, Size
from app.ui.widgets.choices import SegmentedChoice
from app.ui.widgets.displays import Picture
from app.ui.widgets.fields import TextField
from app.ui.widgets.labels import Icon, Sign, Text
from app.ui.widgets.layouts import Item, boxed, column, row
from app.ui.widgets.messages import StaleVeil
from app.ui.widgets.surfaces import Menu, Scroll, Surface

_MARGIN: Final = 24
_GAP: Final = 8
_TAB: Final = 176  # height of a tab in the narrow layout
_PLOT: Final = 224
_BEHIND: Final = 184  # height of the background when it has the whole width
_DIAL, _SMALL_DIAL = 216, 164
_SHAPE: Final = 208 / 200
_NARROW: Final = 1.4  # height divided by width of four portraits in a row
_LOWEST: Final = 136  # height of the portraits in a short window
_PANORAMA: Final = 272 / 400  # fraction of the width, without the gap
_TABS: Final = (("plot", tr("Match")), ("weights", tr("Weights")), ("background", tr("Background")))


def panorama_size(width: int) -> QSize:
    """Return the size of the panorama for a given width of the column, in logical pixels."""
    wide = round(_inner(width) * _PANORAMA)
    return QSize(wide, wide // 2)


def picture_sizes(
    width: int, compact: bool, marks: int = 0, *, numbers: bool = True
) -> tuple[QSize, QSize]:
    """Return the sizes of the portraits and of the background for a given width of the column.

    Args:
        numbers: Whether the numbers are shown, with the weights beside the background.
        marks: Number of portraits shown in addition to the target and the picture here.

    Returns:
        Two sizes in logical pixels, such as 200 x 208 and 128 x 136 for a width of 456.
    """
    t = theme()
    inner = _inner(width)
    portrait = QSize(inner // 2, round(inner // 2 * _SHAPE))
    if marks:
        wide = (inner - marks * t.px(_GAP)) // (2 + marks)
        portrait = QSize(wide, round(wide * _NARROW))
    if compact:
        return portrait, QSize(inner + t.px(_GAP), t.px(_TAB))
    if not numbers:
        return portrait, QSize(inner + t.px(_GAP), t.px(_BEHIND))
    panorama = panorama_size(width)
    return portrait, QSize(inner - panorama.width(), panorama.height())


def _inner(width: int) -> int:
    """Return the width without the margins and the gap between two pictures."""
    t = theme()
    return width - 2 * t.px(_MARGIN) - t.px(_GAP)


class _Title(QWidget):
    """The name of the style, which can be edited in place if the style is the user's own."""

    renamed = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self._text = Text("", 20, 600, elide=True)
        self._side = Text("", 14, role="dim", elide=True)
        self._close = Text("", 12, role="dim", elide=True)
        self._field = TextField(tr("Name of the style"), show_label=False)
        self._field.entered.connect(self.renamed)
        self._field.hide()
        column(row((self._text, 1), self._close, gap=8), self._side, self._field, into=self)

    def show_words(self, title: str, side: str, close: str) -> None:
        if title != self._text.text():
            self.close_field()
        self._text.set_text(title)
        self._side.set_text(side)
        self._close.say(close)

    def ask(self, title: str) -> None:
        """Replace the text with a field containing `title`."""
        self._text.hide()
        self._side.hide()
        self._close.hide()
        self._field.set_text(title)
        self._field.set_error("")
        self._field.show()
        self._field.edit.selectAll()
        self._field.edit.setFocus(Qt.FocusReason.TabFocusReason)

    def say(self, sentence: str) -> None:
        """Show why the name is invalid, or close the field if the sentence is empty."""
        self._field.set_error(sentence)
        if not sentence:
            self.close_field()

    def close_field(self) -> None:
        self._field.hide()
        self._text.show()
        self._side.show()
        self._close.say(self._close.text())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Cancel the edit on Esc."""
        if event.key() == Qt.Key.Key_Escape and self._field.isVisible():
            self.close_field()
        else:
            super().keyPressEvent(event)


class _Legend(QWidget):
    """The legend that explains the colours orange and blue."""

    def __init__(self) -> None:
        super().__init__()
        helps, harms = (
            Text(words, 12, role="dim") for words in (tr("light helps"), tr("light hurts"))
        )
        row(Sign("plus"), helps, 8, Sign("minus"), harms, ..., into=self, gap=8)


class _Warning(QWidget):
    """A line of text with an icon. It keeps its height while empty, so nothing below it jumps."""

    def __init__(self) -> None:
        super().__init__()
        t = theme()
        self._icon = Icon("warning", 16)
        self._text = Text("", 12, wrap=True)
        top = Qt.AlignmentFlag.AlignTop
        row((self._icon, 0, top), (self._text, 1, top), into=self, gap=8)
        self.setFixedHeight(t.px(32))
        self.say("", "", strong=False)

    def say(self, words: str, tip: str, *, strong: bool) -> None:
        self._icon.setVisible(bool(words))
        self._icon.set("warning" if strong else "sun")
        self._text.say(words)
        self.setToolTip(tip)
        self.setAccessibleName(tip)


class StyleDetail(Surface):
    """The column with all details of the chosen style."""

    looked = Signal(float)
    """Emitted with the needle's latest turn, in degrees, at most once per event loop iteration."""
    peak_taken = Signal(int)
    best_asked = Signal()
    main_asked = Signal()
    turn_asked = Signal()
    paint_asked = Signal()
    renamed = Signal(str)
    numbers_asked = Signal(bool)
    """Emitted to show or hide the numbers."""
    laid = Signal(QSize, QSize)
    """Emitted with the new sizes of the portraits and the background, in logical pixels."""

    def __init__(self, compact: bool, actions: Callable[[], Sequence[Action]]) -> None:
        super().__init__("panel", ("left",))
        self._compact = compact
        self._actions = actions
        self._state = DetailState()
        self._last: DetailState | None = None
        self._marked = False
        self._turn = 0.0
        self._later = QTimer(self)
        self._later.setSingleShot(True)
        self._later.timeout.connect(lambda: self.looked.emit(self._turn))
        self.setAccessibleName(tr("Chosen style"))
        self._make_parts()
        if compact:
            self._lay_compact()
        else:
            self._lay_full()
        self.show_numbers(False)

    def _make_parts(self) -> None:
        compact = self._compact
        self._title = _Title()
        self._title.renamed.connect(self.renamed)
        self.target = MarkedPicture(tr("Target"))
        self.here = MarkedPicture(tr("Picture here"))
        self._note = Text("", 12, role="dim", wrap=True)
        self._note.hide()
        self.why = ReasonBlock()
        self.why.marked.connect(self._mark_areas)
        self.marks = (Picture(tr("Median")), Picture(tr("Minimum")))
        for mark in self.marks:
            mark.hide()
        self.plot = PolarPlot(tr("Match by turn"), _SMALL_DIAL if compact else _DIAL)
        self.plot.turned.connect(self._on_move)
        self.plot.released.connect(self._released)
        self.plot.peak_chosen.connect(self.peak_taken)
        best = tr("Back to the best turn")
        self._back = IconButton("target", best, size="small", shortcut="Home", do=self.best_asked)
        self._back.setParent(self.plot)
        self._back.hide()
        self.words, self.facts = TurnWords(compact), Facts(compact)
        self.more_words = Button(tr("Why?"), size="small", trailing="chevron-down", checkable=True)
        self.more_words.set_tip(tr("Show the numbers, the curve and where light helps"), "W")
        self.more_words.clicked.connect(self.numbers_asked)
        self.weights = WeightPanorama()
        self.weights.turned.connect(self._on_move)
        self.weights.released.connect(self._released)
        self.background = Picture(tr("Background behind the sitter"))
        self._legend, self._warning = _Legend(), _Warning()
        size: Size = "normal" if compact else "main"
        clipped = tr("Still clipped: capture the full range")
        self.recapture = IconButton("camera", clipped, size=size)
        self.recapture.hide()
        self.main = Button(tr("Turn to this"), kind="primary", size=size, do=self.main_asked)
        self.main.set_available(False)
        self.paint = Button(tr("Paint"), "brush", size=size, do=self.paint_asked)
        self.paint.set_tip(tr("Paint on this style"), "P")
        self.more = IconButton("more", tr("More"), size=size, do=self._open_menu)

    # -- layout --------------------------------------------------------------------------------

    def _lay(self, *parts: Item) -> None:
        """Let everything except the bottom buttons scroll when there is too little height."""
        t = theme()
        inside = QWidget()
        gap = 8 if self._compact else 12
        self._content = column(
            self._title,
            gap,
            column(row(*self._portraits, gap=8), self._note, gap=4),
            gap,
            *parts,
            4,
            self._warning,
            ...,
            into=inside,
        )
        left, right = t.px(_MARGIN) - t.line_width, t.px(_MARGIN)
        self._content.setContentsMargins(left, t.px(16), right, 0)
        scroll = Scroll(inside)
        scroll.setAccessibleName(tr("About the chosen style"))
        self.veil = StaleVeil(scroll, COMPUTING)
        scroll.lend(self._content, t.px(_MARGIN))
        buttons = row((self.main, 1), self.paint, self.recapture, self.more, gap=8)
        buttons.setContentsMargins(left, 0, right, 0)
        self._whole = column((scroll, 1), buttons, into=self, gap=4)
        self._whole.setContentsMargins(t.line_width, 0, 0, t.px(16 if self._compact else 24))

    def _lay_full(self) -> None:
        t = theme()
        facts = boxed(column(self.facts, ..., margins=(0, 4, 0, 0)))
        # Text changes with the needle, but nothing below it may move.
        facts.setFixedHeight(t.px(_PLOT))
        top = Qt.AlignmentFlag.AlignTop
        self._numbers = boxed(row((self.plot, 0, top), (facts, 1), gap=8))
        place = row(self.weights, self.background, gap=8)
        answer = column(self.words, self.why, self._more_row(), gap=8)
        self._lay(answer, 8, self._numbers, 8, place, 8, self._legend)

    def _lay_compact(self) -> None:
        gap = 8
        self._numbers = SegmentedChoice(_TABS, name=tr("Show"), equal=False)
        self._pages = QStackedWidget()
        for page in (
            boxed(row(self.plot, (self.facts, 1), gap=gap)),
            boxed(column(self.weights, self._legend, ..., gap=gap)),
            self.background,
        ):
            self._pages.addWidget(page)
        self._pages.setFixedHeight(theme().px(_TAB))
        keys = [key for key, _ in _TABS]
        self._numbers.chosen.connect(lambda key: self._pages.setCurrentIndex(keys.index(key)))
        answer = column(self.words, self.why, self._more_row(), gap=gap)
        self._lay(answer, self._numbers, gap, self._pages)

    def _more_row(self) -> QHBoxLayout:
        return row(self.more_words, self.why.eye, ..., gap=8)

    def show_numbers(self, numbers: bool) -> None:
        """Show or hide everything behind *Why?*. The background is always there."""
        if numbers == self.more_words.isChecked() and self._numbers.isHidden() != numbers:
            return
        self.more_words.setChecked(numbers)
        self._numbers.setVisible(numbers)
        if isinstance(self._numbers, SegmentedChoice):
            key = "plot" if numbers else "background"
            self._numbers.choose(key)
            self._pages.setCurrentIndex([name for name, _ in _TABS].index(key))
        else:
            self.weights.setVisible(numbers)
            self._legend.setVisible(numbers)
        self._fit()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Update the sizes of the pictures."""
        super().resizeEvent(event)
        self._fit()

    @property
    def _portraits(self) -> tuple[Picture, ...]:
        return self.target, self.here, *self.marks

    def _fit(self) -> None:
        """Set the sizes of the pictures for the current width."""
        marks = 0 if self.marks[0].isHidden() else len(self.marks)
        portrait, background = picture_sizes(
            self.width(), self._compact, marks, numbers=self.more_words.isChecked()
        )
        for picture in self._portraits:
            picture.setFixedSize(portrait)
        if self._compact:
            self.weights.setFixedHeight(background.width() // 2)
        else:
            self.weights.setFixedSize(panorama_size(self.width()))
            self.background.setFixedSize(background)
            self._lower(portrait)
        side = self._back.sizeHint().width()
        edge = self.plot.sizeHint().width() - side
        self._back.setGeometry(QRect(edge, edge, side, side))
        self.laid.emit(portrait, background)

    def _lower(self, portrait: QSize) -> None:
        """Shrink the portraits in a short window to keep the content from scrolling."""
        around = self._whole.contentsMargins()
        room = self.height() - around.bottom() - self._whole.spacing() - self.main.height()
        self._content.activate()  # Inner layouts do not know the new sizes yet.
        # Wrapped text is higher than its hint.
        high = self._content.totalHeightForWidth(self.width())
        short = max(high, self._content.totalSizeHint().height()) - room
        lowest = min(portrait.height(), theme().px(_LOWEST))
        portrait.setHeight(max(portrait.height() - max(short, 0), lowest))
        for picture in self._portraits:
            picture.setFixedSize(portrait)

    # -- showing -------------------------------------------------------------------------------

    def show_clipped(self, clipped: bool) -> None:
        """Offer to capture the full range. In a small window, Paint is then reduced to its icon."""
        self.recapture.setVisible(clipped)
        self.paint.setText("" if clipped and self._compact else tr("Paint"))

    def show_state(self, state: DetailState) -> None:
        """Show a style at a turn, updating only the widgets that have changed."""
        before, self._last = self._last, state
        if state is before:
            return
        self.veil.cover(state.stale)
        self._title.show_words(state.title, state.side, state.close)
        self.target.set_picture(state.target)
        self.target.set_tag(state.target_tag if state.target is not None else "")
        note = state.lamps_note != self._note.text()
        self._note.say(state.lamps_note)
        if self.why.show_state(state.why) or note:
            self._fit()
        self.here.set_picture(state.here)
        self._show_areas(state)
        exposed = state.target_exposed, state.here_exposed
        for picture, words in zip((self.target, self.here), exposed, strict=True):
            picture.set_tag(words, "tr")
            picture.setToolTip(state.exposed_tip if words else "")
            picture.setAccessibleDescription(picture.toolTip())
        self._show_marks(before, state)
        self._show_plot(before, state)
        self.words.show_state(state)
        self.facts.show_state(state)
        self._show_place(before, state)
        self._warning.say(state.glare, state.glare_tip, strong=state.glare_strong)
        icon = {"turn": "", "lamp": "bulb", "probe": ""}[state.main]
        self.main.set_text(state.main_words, icon)
        self.main.set_tip(state.main_words, "Enter")
        self.main.set_available(state.main_works)
        self.paint.set_available(bool(state.key))

    def _mark_areas(self, marked: bool) -> None:
        """Show on the face the areas that the reason compares, or hide them."""
        self._marked = marked
        if self._last is not None:
            self._show_areas(self._last)

    def _show_areas(self, state: DetailState) -> None:
        why = state.why if self._marked else NO_REASON
        self.target.set_marks(why.marks)
        self.here.set_marks(why.marks, labelled=bool(why.needs))
        self.here.set_tag(why.needs or state.here_tag)

    def _show_marks(self, before: DetailState | None, state: DetailState) -> None:
        """In paper mode, show the median and minimum C beside the target and the picture here."""
        for picture, mark in zip(self.marks, state.marks, strict=False):
            picture.set_picture(mark.picture)
            picture.set_tag(mark.tag)
            picture.setAccessibleName(mark.words)
            picture.setToolTip(mark.words)
        for picture in self.marks:
            picture.setVisible(bool(state.marks))
        if bool(state.marks) != bool(before is not None and before.marks):
            self._fit()

    def _show_plot(self, before: DetailState | None, state: DetailState) -> None:
        same = before is not None and all(
            getattr(before, name) == getattr(state, name)
            for name in ("curve", "limit", "arc", "best", "peaks", "marks")
        )
        if not same:
            self.plot.setAccessibleName(state.curve_name)
            marks = [(mark.tag, mark.turn_deg) for mark in state.marks]
            self.plot.set_data(
                state.curve, state.limit, state.arc, state.best, state.peaks, state.needle, marks
            )
        elif abs(self.plot.needle - state.needle) > 1e-9:
            self.plot.set_needle(state.needle)
        self.plot.tell(state.numbers, state.limit_words, [mark.words for mark in state.marks])
        self._back.setVisible(not state.at_best)

    def _show_place(self, before: DetailState | None, state: DetailState) -> None:
        self.weights.set_picture(state.panorama, state.front)
        if before is None or before.weights is not state.weights:
            self.weights.set_target(state.weights)
        self.weights.set_turn(state.needle, state.best)
        self.background.set_picture(state.background)
        self.background.set_tag(tr("Background") if state.background is not None else "", "tl")

    # -- user actions --------------------------------------------------------------------------

    def _on_move(self, turn_deg: float) -> None:
        """Store the latest turn, skipping the turns in between."""
        self._turn = turn_deg
        if not self._later.isActive():
            self._later.start()

    def _released(self, turn_deg: float) -> None:
        self._turn = turn_deg
        if self._later.isActive():
            self._later.stop()
            self.looked.emit(turn_deg)

    def ask_name(self, title: str) -> None:
        """Let the user edit the name."""
        self._title.ask(title)

    def show_trouble(self, sentence: str) -> None:
        """Show why the name is invalid, or close the field if the sentence is empty."""
        self._title.say(sentence)

    def _open_menu(self) -> None:
        menu = Menu(self, tr("More about this style"))
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        state = self._last
        stale = state is not None and state.stale
        why_not = COMPUTING if stale else NEEDS_LIGHT
        if state is not None and state.verdict:
            menu.add(tr("Turn there anyway"), self.turn_asked.emit, "turn")
        for action in self._actions():
            works = action.enabled()
            if works or not action.key.endswith("-style") or action.key == "import-style":
                why = "" if works else why_not
                keys = action.shortcut.split(";")[0].replace("+", " ")
                menu.add(action.words, action.run, action.icon, keys, why)
        menu.drop(self.more)
