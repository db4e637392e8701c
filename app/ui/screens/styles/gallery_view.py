"""The gallery: which cards, in which order, in how many columns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QHBoxLayout, QWidget

from app.core.text import tr
from app.ui.plots.panorama import PanoramaView
from app.ui.screens.styles.cards_view import (
    DamagedCard,
    PaintCard,
    StyleCard,
    card_size,
    picture_size,
)
from app.ui.screens.styles.state import CardState, LampsState, LensState, StylesState
from app.ui.theme import theme
from app.ui.widgets.accessibility import Roving, describe
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.choices import LabelledSlider, SegmentedChoice
from app.ui.widgets.dialogs import KeysSheet, Term
from app.ui.widgets.fields import ListField, Toggle
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column, row
from app.ui.widgets.surfaces import Scroll, Surface
from app.words.lamps import RATIO_CHOICES
from app.words.phrases.directions import LENS_CHOICES

_GAP: Final = 8
_TOP: Final = 16
_RING: Final = 4  # room for the focus ring above the first row
_FOOT: Final = 14
_FIVE_FROM: Final = 1264  # gallery of a window 1920 wide
_WIDTHS: Final = (180, 440)  # of a card, least and most
_HOW: Final = tr("Mark: Space or Ctrl click")
_BACKGROUNDS: Final = (10.0, 20.0, 45.0)  # how far off what is asked for may be, deg
_SORTS: Final = (
    ("match", tr("Best match")),
    ("name", tr("Name")),
    ("turn", tr("Turn (least to go)")),
    ("side", tr("Side")),
)
_FILTERS: Final = (
    ("all", tr("All")),
    ("in", tr("In reach")),
    ("out", tr("Out of reach")),
    ("mine", tr("Mine")),
)


@dataclass(frozen=True, slots=True)
class Layout:
    """Places of the cards, logical pixels.

    Attributes:
        columns: Cards in a row.
        offered: The fewest and the most there can be.
        room: For all of them, each with the gap after it.
    """

    columns: int
    card: QSize
    margin: int
    offered: tuple[int, int]
    room: int

    @property
    def picture(self) -> QSize:
        """Size of each of the two pictures on a card."""
        return picture_size(self.card.width())


def layout_for(width: int, compact: bool, card_width: int = 0) -> Layout:
    """Choose columns and the size of cards.

    Args:
        width: Of the gallery, logical pixels.
        compact: Whether this is the layout for small windows.
        card_width: Least width of a card at scale 1; 0 for the usual columns.

    Returns:
        Four columns in a window of 1440 x 900; the pictures on a card have the shape of a head.
    """
    t = theme()
    gap, margin = t.px(_GAP), t.px(16 if compact else 24)
    room = width - 2 * margin + gap
    most = max(room // (t.px(_WIDTHS[0]) + gap), 1)
    fewest = min(max(-(-room // (t.px(_WIDTHS[1]) + gap)), 1), most)
    usual = 3 if compact else 5 if width >= t.px(_FIVE_FROM) else 4
    columns = min(max(room // (t.px(card_width) + gap) if card_width else usual, fewest), most)
    return Layout(columns, card_size(room // columns - gap), margin, (fewest, most), room)


class _Grid(QWidget):
    """Lays its cards out itself: faster than a layout of Qt, and exact."""

    def __init__(self) -> None:
        super().__init__()
        self._cells: list[QWidget] = []
        self._layout: Layout | None = None

    def fill(self, cells: list[QWidget], layout: Layout) -> None:
        """Place these widgets in reading order."""
        for old in self._cells:
            if old not in cells:
                old.hide()
        self._cells, self._layout = cells, layout
        t = theme()
        gap, card = t.px(_GAP), layout.card
        for number, cell in enumerate(cells):
            row, column = divmod(number, layout.columns)
            x = layout.margin + column * (card.width() + gap)
            y = t.px(_RING) + row * (card.height() + gap)
            cell.setGeometry(x, y, card.width(), card.height())
            cell.show()
        rows = -(-len(cells) // layout.columns)
        self.setMinimumHeight(t.px(_RING) + rows * (card.height() + gap) - gap + t.px(_FOOT))


class LampsSheet(KeysSheet):
    """Size and ratio of the lamps that light the targets, for all styles or the one in front."""

    chosen = Signal(str, str)
    """Keys of size and ratio."""
    kept_to_style = Signal(bool)

    def __init__(self, host: QWidget, under: QWidget) -> None:
        super().__init__(host, tr("Lamps"), 392, under=under)
        self._size = ListField(tr("Lamp size"))
        ratios = SegmentedChoice(tuple(RATIO_CHOICES.items()), name=tr("Lighting ratio"))
        self._ratio, self._own = ratios, Toggle(tr("This style only"))
        self._size.chosen.connect(lambda key: self.chosen.emit(key, ratios.key))
        ratios.chosen.connect(lambda key: self.chosen.emit(self._size.key, key))
        self._own.switched.connect(self.kept_to_style)
        label = Text(tr("Lighting ratio"), 12, 600)
        self.body.addWidget(self._size)
        self.body.addLayout(column(label, row(ratios, ...), gap=6))
        self.body.addWidget(self._own)

    def show_state(self, state: LampsState) -> None:
        """Show what is chosen."""
        self._size.set_items(state.sizes)
        self._size.choose(state.size)
        if state.ratio in RATIO_CHOICES:
            self._ratio.choose(state.ratio)
        self._own.setChecked(state.only)
        self._own.set_available(state.own, tr("A painted style has no lamps."))


class LensSheet(KeysSheet):
    """How the face is turned to the lens, and what is to be behind the sitter."""

    chosen = Signal(str)
    """Key of how the face is turned."""
    background_chosen = Signal(object, float)
    """Azimuth in the panorama, deg, and how far off it may be; None for any."""

    def __init__(self, host: QWidget, under: QWidget, behind: Callable[[], float]) -> None:
        super().__init__(host, tr("Lens"), 480, under=under)
        self._face = ListField(tr("Face"), tuple(LENS_CHOICES.items()))
        self._face.chosen.connect(self.chosen)
        self._toggle, self._state = Toggle(tr("Choose what is behind the sitter")), LensState()
        self._panorama = PanoramaView(tr("What is behind the sitter"))
        self._panorama.set_marker_words(tr("Middle of the background"))
        self._panorama.marker_released.connect(lambda at: self._ask(at, self._state.width))
        widths = tuple((f"{width:g}", f"± {width:g}°") for width in _BACKGROUNDS)
        self._width = SegmentedChoice(widths, name=tr("How far off it may be"))
        self._width.chosen.connect(lambda key: self._ask(self._state.background, float(key)))
        self._toggle.switched.connect(
            lambda on: self._ask(behind() if on else None, self._state.width)
        )
        parts = (self._face, self._toggle, self._panorama, row(self._width, ...))
        self.body.addLayout(column(*parts, gap=12))

    def _ask(self, middle: float | None, width: float) -> None:
        self.background_chosen.emit(middle, width)

    def show_state(self, state: LensState) -> None:
        """Show what is chosen."""
        self._state, on = state, state.background is not None
        self._face.choose(state.key)
        self._toggle.setChecked(on)
        self._panorama.setVisible(on)
        self._width.setVisible(on)
        self._panorama.set_picture(state.panorama)
        if state.background is not None:
            self._panorama.set_front(state.background)
            self._width.choose(f"{state.width:g}")


class SizeSlider(LabelledSlider):
    """How large cards are, by how many stand in a row."""

    most = 4

    def __init__(self) -> None:
        def words(position: float) -> str:
            return tr("{count} across", count=self.most - round(position))

        super().__init__(tr("Size"), 0, 1, 0, 1, words, inline=True)

    def offer(self, fewest: int, most: int, columns: int) -> None:
        """Offer so many columns, and show how many there are."""
        self.most = most
        self.setRange(0, max(most - fewest, 1))
        self.set_value(most - columns)
        self.setVisible(most > fewest)


class _Cards(Scroll):
    """The area of the cards; Ctrl and the wheel change their size."""

    def __init__(self, cards: QWidget, size: SizeSlider) -> None:
        super().__init__(cards)
        self._size = size

    def wheelEvent(self, event: QWheelEvent) -> None:
        if event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            self._size.wheelEvent(event)
        else:
            super().wheelEvent(event)


class Gallery(QWidget):
    """Filter, order, and cards that are one stop for Tab; arrows move the choice."""

    chosen = Signal(str)
    """A card was chosen."""
    opened = Signal(str)
    """A card was double-clicked, or Enter was pressed on it."""
    filtered = Signal(str)
    sorted = Signal(str)
    paint_asked = Signal()
    lamps_asked = Signal()
    lens_asked = Signal()
    exposed_alike = Signal()
    marked = Signal(str)
    """A style is to be compared, or no longer; "" for none any more."""
    compare_asked = Signal()
    held = Signal(bool)
    """Targets and pictures here are to change places for as long as a button is held."""
    resized = Signal(int)
    """Cards are to be at least so wide, logical pixels at scale 1."""
    laid = Signal(QSize)
    """The pictures on the cards have another size, logical pixels."""

    def __init__(self, compact: bool) -> None:
        super().__init__()
        self._compact = compact
        self._state: StylesState | None = None
        self._cards: dict[str, StyleCard] = {}
        self._damaged: dict[str, DamagedCard] = {}
        self._layout: Layout | None = None
        self.setAccessibleName(tr("Styles"))
        self._grid = _Grid()
        self._grid.setAccessibleName(tr("Cards"))
        self.zoom = SizeSlider()
        self._scroll = _Cards(self._grid, self.zoom)
        self._roving = Roving(self)
        self._roving.moved.connect(self._on_move)
        self._empty = Text("", 14, role="dim", wrap=True)
        tools = self._made_tools()
        cards = column((self._scroll, 1), self._made_foot())
        column(tools, (cards, 1), into=self, gap=_GAP, margins=(0, _TOP, 0, 0))
        self._paint = PaintCard()
        self._paint.setParent(self._grid)
        self._paint.clicked.connect(self.paint_asked)
        self._empty.setParent(self._grid)
        self._empty.hide()

    def _made_tools(self) -> QHBoxLayout:
        t = theme()
        self._filter = SegmentedChoice(_FILTERS, name=tr("Show"))
        self._filter.chosen.connect(self.filtered)
        self._sort = ListField(tr("Sort by"), _SORTS, show_label=False)
        self._sort.chosen.connect(self.sorted)
        # As narrow as "Best match" allows: the filter has words of any length.
        width, margin, gap = (126, 16, 6) if self._compact else (152, 24, 8)
        self._sort.setFixedWidth(t.px(width))
        self.lamps = IconButton("lamp", "") if self._compact else Button("")
        self.lamps.clicked.connect(self.lamps_asked)
        self.lens = IconButton("camera", "") if self._compact else Button("")
        self.lens.clicked.connect(self.lens_asked)
        self.alike = IconButton("exposure", tr("Same exposure"), True, shortcut="E")
        self.alike.clicked.connect(self.exposed_alike)
        margins = (margin, 0, margin, 0)
        parts = (self._filter, ..., self.alike, self.lens, self.lamps, self._sort)
        return row(*parts, gap=gap, margins=margins)

    def _made_foot(self) -> Surface:
        self.compare = Button("", "grid", size="small", do=self.compare_asked)
        self._unmark = IconButton("close", tr("Take all marks away"), kind="quiet", size="small")
        self._unmark.clicked.connect(lambda: self.marked.emit(""))
        self._how = Text("", 12, role="dim", elide=True)
        self.hold = Button(tr("Hold S to swap"), "mirror", kind="quiet", size="small")
        self.hold.set_tip(tr("Hold S to swap target and result"))
        self.hold.pressed.connect(lambda: self.held.emit(True))
        self.hold.released.connect(lambda: self.held.emit(False))
        self.zoom.setFixedWidth(theme().px(164))
        self.zoom.changed.connect(self._size_moved)
        foot, side = Surface("bg", ("top",), tr("Look at the cards")), 16 if self._compact else 24
        self._says = Term("card", tr("What a card says"))
        parts = (self.compare, self._unmark, (self._how, 1), self._says, self.hold, self.zoom)
        row(*parts, into=foot, gap=8, margins=(side, 4, side, 4))
        return foot

    def _size_moved(self, position: float) -> None:
        if self._layout is not None:
            wide = self._layout.room // (self.zoom.most - round(position)) - theme().px(_GAP)
            self.resized.emit(int(wide / theme().scale))

    def show_state(self, state: StylesState) -> None:
        """Show cards, filter and order; only what differs is touched."""
        before, self._state = self._state, state
        for key, words in state.filters:
            self._filter.set_text(key, words)
        self._filter.choose(state.filter.value)
        self._sort.choose(state.sort.value)
        self.alike.setChecked(state.same_exposure)
        lamps, lens = state.lamps, state.lens
        for button, words, sheet_state in (
            (self.lamps, lamps.words, lamps),
            (self.lens, lens.short, lens),
        ):
            if isinstance(button, Button):
                button.set_text(words)
            describe(button, sheet_state.words)
            button.set_available(sheet_state.works, tr("Needs the light of a place."))
        keys = [card.key for card in state.cards]
        same = before is not None and keys == [card.key for card in before.cards]
        for card in state.cards:
            if card.damaged is None:
                self._card(card).show_state(card)
            elif card.key not in self._damaged:
                self._damaged[card.key] = DamagedCard(card)
                self._damaged[card.key].setParent(self._grid)
        if (
            not same
            or before is None
            or (before.empty, before.card_width) != (state.empty, state.card_width)
        ):
            self._lay()
            self._roving.set_members([self._cards[key] for key in keys if key in self._cards])
        self.compare.setVisible(state.marked > 0)
        self._unmark.setVisible(state.marked > 0)
        self._says.setVisible(not (self._compact and state.marked))
        self._how.set_text("" if state.marked > 1 else state.rules or _HOW)
        self.compare.set_text(tr("Compare {count}", count=state.marked))
        self.compare.set_available(state.marked > 1, tr("Mark one more to compare."))
        self.hold.setDown(state.swapped)
        self._follow_choice(before, state)

    def _card(self, state: CardState) -> StyleCard:
        card = self._cards.get(state.key)
        if card is None:
            card = StyleCard(state)
            card.setParent(self._grid)
            card.clicked.connect(lambda _on=False, key=state.key: self.chosen.emit(key))
            card.opened.connect(lambda key=state.key: self.opened.emit(key))
            card.marked.connect(lambda key=state.key: self.marked.emit(key))
            self._cards[state.key] = card
            QWidget.setTabOrder(card, self._paint)
        return card

    def _follow_choice(self, before: StylesState | None, state: StylesState) -> None:
        front, earlier = (
            next((card.key for card in one.cards if card.chosen), None) if one else None
            for one in (state, before)
        )
        if front is None or front == earlier:
            return
        card = self._cards[front]
        had_focus = any(one.hasFocus() for one in self._cards.values())
        self._roving.set_stop(card)
        if had_focus and not card.hasFocus():
            card.setFocus(Qt.FocusReason.OtherFocusReason)
        self._scroll.keep_visible(card)

    def _lay(self) -> None:
        """Place all cells."""
        state = self._state
        if state is None:
            return
        layout = layout_for(self.width(), self._compact, state.card_width)
        self.zoom.offer(*layout.offered, layout.columns)
        cells: list[QWidget] = []
        for card in state.cards:
            widget = self._damaged[card.key] if card.damaged is not None else self._cards[card.key]
            cells.append(widget)
        if state.empty:
            self._empty.set_text(state.empty)
            cells.append(self._empty)
        elif self._empty.isVisible():
            self._empty.hide()
        self._grid.fill([*cells, self._paint], layout)
        if layout != self._layout:
            self._layout = layout
            self.laid.emit(layout.picture)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Lay the cards out again."""
        super().resizeEvent(event)
        if (column := self.layout()) is not None:
            column.activate()
        wide = sum(one.sizeHint().width() for one in (self._filter, self.lamps, self._sort))
        room = self.width() - wide - theme().px(100)
        # Where there is no room beside the filter they are left to the list of actions.
        lens = self.lens.sizeHint().width()
        self.lens.setVisible(room >= lens - theme().px(40))
        self.alike.setVisible(room >= lens)
        self._lay()

    def focus_card(self) -> None:
        """Give the keyboard to the chosen card."""
        stop = self._roving.stop
        if stop is not None:
            stop.setFocus(Qt.FocusReason.OtherFocusReason)

    def _on_move(self, card: QWidget) -> None:
        if isinstance(card, StyleCard):
            self.chosen.emit(card.state.key)
