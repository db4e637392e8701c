"""The gallery, with its filter, its sort order and its cards in columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QHBoxLayout, QWidget

from app.core.styles.styles import mirror_name
from app.core.text import tr
from app.ui.presenters.window_model import NEEDS_LIGHT
from app.ui.screens.styles.cards import CardState
from app.ui.screens.styles.cards_view import (
    DamagedCard,
    PaintCard,
    StyleCard,
    card_size,
    picture_size,
)
from app.ui.screens.styles.screen import StylesState
from app.ui.theme import theme
from app.ui.widgets.accessibility import Roving, describe
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.choices import LabelledSlider, SegmentedChoice
from app.ui.widgets.dialogs import Term
from app.ui.widgets.fields import ListField
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column, row
from app.ui.widgets.surfaces import Scroll, Surface

_GAP: Final = 8
_TOP: Final = 16
_RING: Final = 4  # room for the focus ring above the first row
_FOOT: Final = 14
_HEADING: Final = 32
_FIVE_FROM: Final = 1264  # width of the gallery in a window 1920 pixels wide
_WIDTHS: Final = (180, 440)  # minimum and maximum width of a card
_HOW: Final = tr("Mark: Space or Ctrl+click")
_SORTS: Final = (
    ("match", tr("Best first")),
    ("name", tr("Name")),
    ("turn", tr("Turn (least to go)")),
)
_FILTERS: Final = (
    ("all", tr("All")),
    ("mine", tr("Mine")),
)


@dataclass(frozen=True, slots=True)
class Layout:
    """Layout of the cards, in logical pixels.

    Attributes:
        columns: Number of cards in a row.
        offered: Smallest and largest possible numbers of columns.
        room: Width of a row, including the gap after each card.
    """

    columns: int
    card: QSize
    margin: int
    offered: tuple[int, int]
    room: int

    @property
    def picture(self) -> QSize:
        """Size of each of the two pictures on a card, in logical pixels."""
        return picture_size(self.card.width())


def layout_for(width: int, compact: bool, card_width: int = 0) -> Layout:
    """Choose the number of columns and the size of the cards.

    Args:
        width: Width of the gallery, in logical pixels.
        compact: Whether to use the layout for small windows.
        card_width: Minimum width of a card at scale 1, or 0 for the usual number of columns.

    Returns:
        The layout, for example four columns in a window of 1440 x 900. The pictures on a card have
        the shape of a head.
    """
    t = theme()
    gap, margin = t.px(_GAP), t.px(16 if compact else 24)
    room = width - 2 * margin + gap
    most = max(room // (t.px(_WIDTHS[0]) + gap), 1)
    fewest = min(max(-(-room // (t.px(_WIDTHS[1]) + gap)), 1), most)
    usual = 3 if compact else 5 if width >= t.px(_FIVE_FROM) else 4
    columns = min(max(room // (t.px(card_width) + gap) if card_width else usual, fewest), most)
    return Layout(columns, card_size(room // columns - gap), margin, (fewest, most), room)


@dataclass(frozen=True, slots=True)
class _Section:
    """A heading, if there is one, and the cells below it in reading order."""

    heading: QWidget | None
    cells: tuple[QWidget, ...]


class _Grid(QWidget):
    """A grid that positions its cards directly, which is faster and more exact than a Qt layout."""

    def __init__(self) -> None:
        super().__init__()
        self._visible: list[QWidget] = []

    def fill(self, sections: Sequence[_Section], layout: Layout) -> None:
        """Place the widgets, each section on rows of its own."""
        widgets = [one for section in sections for one in (section.heading, *section.cells) if one]
        for old in self._visible:
            if old not in widgets:
                old.hide()
        self._visible = widgets
        t = theme()
        gap, card, top = t.px(_GAP), layout.card, t.px(_RING)
        for section in sections:
            if section.heading is not None:
                section.heading.setGeometry(layout.margin, top, layout.room - gap, t.px(_HEADING))
                top += t.px(_HEADING)
            for number, cell in enumerate(section.cells):
                row, column = divmod(number, layout.columns)
                x = layout.margin + column * (card.width() + gap)
                cell.setGeometry(x, top + row * (card.height() + gap), card.width(), card.height())
            top += -(-len(section.cells) // layout.columns) * (card.height() + gap)
        for widget in widgets:
            widget.show()
        self.setMinimumHeight(top - gap + t.px(_FOOT))


class _Heading(QWidget):
    """The title of a group of cards, and how many there are."""

    def __init__(self) -> None:
        super().__init__()
        self._title = Text("", 14, 600)
        self._count = Text("", 14, role="dim")
        row(self._title, self._count, ..., into=self, gap=8)

    def show_words(self, title: str, count: int | None) -> None:
        """Show the title and the count."""
        self._title.set_text(title)
        self._count.set_text("" if count is None else str(count))
        self.setAccessibleName(title)


def _outline(state: StylesState) -> tuple[object, ...]:
    """Return everything on which the layout of the cards depends."""
    groups = [
        (group.title, group.count, group.empty, [card.key for card in group.cards])
        for group in state.groups
    ]
    return groups, state.card_width


class SizeSlider(LabelledSlider):
    """A slider for the size of the cards, expressed as the number of cards per row."""

    most = 4

    def __init__(self) -> None:
        def words(position: float) -> str:
            return tr("{count} across", count=self.most - round(position))

        super().__init__(tr("Size"), 0, 1, 0, 1, words, inline=True)

    def offer(self, fewest: int, most: int, columns: int) -> None:
        """Set the range for the number of columns, and the current number."""
        self.most = most
        self.setRange(0, max(most - fewest, 1))
        self.set_value(most - columns)
        self.setVisible(most > fewest)


class _Cards(Scroll):
    """The scroll area for the cards. Turning the mouse wheel with Ctrl held resizes them."""

    def __init__(self, cards: QWidget, size: SizeSlider) -> None:
        super().__init__(cards)
        self._size = size

    def wheelEvent(self, event: QWheelEvent) -> None:
        if event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            self._size.wheelEvent(event)
        else:
            super().wheelEvent(event)


class Gallery(QWidget):
    """The filter, the order and the cards. The cards are one Tab stop with arrow keys inside."""

    chosen = Signal(str)
    """Emitted when a card is chosen."""
    opened = Signal(str)
    """Emitted when a card is double-clicked, or on Enter."""
    filtered = Signal(str)
    sorted = Signal(str)
    paint_asked = Signal()
    lamps_asked = Signal()
    lens_asked = Signal()
    exposed_alike = Signal()
    marked = Signal(str)
    """Emitted to mark or unmark a style for comparison, or with "" to remove all marks."""
    compare_asked = Signal()
    held = Signal(bool)
    """Emitted when the swap button is pressed (True) or released (False)."""
    resized = Signal(int)
    """Emitted with the new minimum width of a card, in logical pixels at scale 1."""
    laid = Signal(QSize)
    """Emitted with the new size of the pictures on the cards, in logical pixels."""

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
        self._headings: list[_Heading] = []
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
        # At least as wide as "Best first", because the filter's labels can have any length.
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
        self._unmark = IconButton("close", tr("Remove all marks"), kind="quiet", size="small")
        self._unmark.clicked.connect(lambda: self.marked.emit(""))
        self._how = Text("", 12, role="dim", elide=True)
        self.hold = Button(tr("Hold S to swap"), "mirror", kind="quiet", size="small")
        self.hold.set_tip(tr("Hold S to swap target and result"))
        self.hold.pressed.connect(lambda: self.held.emit(True))
        self.hold.released.connect(lambda: self.held.emit(False))
        self.zoom.setFixedWidth(theme().px(164))
        self.zoom.changed.connect(self._size_moved)
        foot, side = Surface("bg", ("top",), tr("Card view")), 16 if self._compact else 24
        self._says = Term("card", tr("How to read a card"))
        parts = (self.compare, self._unmark, (self._how, 1), self._says, self.hold, self.zoom)
        row(*parts, into=foot, gap=8, margins=(side, 4, side, 4))
        return foot

    def _size_moved(self, position: float) -> None:
        if self._layout is not None:
            wide = self._layout.room // (self.zoom.most - round(position)) - theme().px(_GAP)
            self.resized.emit(int(wide / theme().scale))

    def show_state(self, state: StylesState) -> None:
        """Show any changes to the cards, the filter and the order."""
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
            button.set_available(sheet_state.works, NEEDS_LIGHT)
        keys = [card.key for card in state.cards]
        had_focus = any(one.hasFocus() for one in self._cards.values())
        for card in state.cards:
            if card.damaged is None:
                self._card(card).show_state(card)
            elif card.key not in self._damaged:
                self._damaged[card.key] = DamagedCard(card)
                self._damaged[card.key].setParent(self._grid)
        if before is None or _outline(before) != _outline(state):
            self._lay()
            self._roving.set_members([self._cards[key] for key in keys if key in self._cards])
        self.compare.setVisible(state.marked > 0)
        self._unmark.setVisible(state.marked > 0)
        self._says.setVisible(not (self._compact and state.marked))
        self._how.set_text("" if state.marked > 1 else state.rules or _HOW)
        self.compare.set_text(tr("Compare {count}", count=state.marked))
        self.compare.set_available(state.marked > 1, tr("Mark one more style to compare."))
        self.hold.setDown(state.swapped)
        self._follow_choice(before, state, had_focus)

    def _card(self, state: CardState) -> StyleCard:
        card = self._cards.get(state.key)
        if card is None:
            card = StyleCard(state)
            card.setParent(self._grid)
            card.clicked.connect(lambda _on=False, key=state.key: self.chosen.emit(key))
            card.opened.connect(lambda key=state.key: self.opened.emit(key))
            card.marked.connect(lambda key=state.key: self.marked.emit(key))
            card.switched.connect(lambda key=state.key: self.chosen.emit(mirror_name(key)))
            self._cards[state.key] = card
            QWidget.setTabOrder(card, self._paint)
        return card

    def _follow_choice(
        self, before: StylesState | None, state: StylesState, had_focus: bool
    ) -> None:
        front, earlier = (
            next((card.key for card in one.cards if card.chosen), None) if one else None
            for one in (state, before)
        )
        if front is None or front == earlier:
            return
        card = self._cards[front]
        self._roving.set_stop(card)
        if had_focus and not card.hasFocus():
            card.setFocus(Qt.FocusReason.OtherFocusReason)
        self._scroll.keep_visible(card)

    def _lay(self) -> None:
        """Place all the cells."""
        state = self._state
        if state is None:
            return
        layout = layout_for(self.width(), self._compact, state.card_width)
        self.zoom.offer(*layout.offered, layout.columns)
        self._fill_headings(state)
        sections = []
        for number, group in enumerate(state.groups):
            cells: list[QWidget] = [
                self._damaged[card.key] if card.damaged is not None else self._cards[card.key]
                for card in group.cards
            ]
            if group.empty:
                self._empty.set_text(group.empty)
                cells.append(self._empty)
            if number == len(state.groups) - 1:
                cells.append(self._paint)
            heading = self._headings[number] if group.title else None
            sections.append(_Section(heading, tuple(cells)))
        self._grid.fill(sections or [_Section(None, (self._paint,))], layout)
        if layout != self._layout:
            self._layout = layout
            self.laid.emit(layout.picture)

    def _fill_headings(self, state: StylesState) -> None:
        while len(self._headings) < len(state.groups):
            self._headings.append(_Heading())
            self._headings[-1].setParent(self._grid)
        for heading, group in zip(self._headings, state.groups, strict=False):
            heading.show_words(group.title, group.count)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Update the layout of the cards."""
        super().resizeEvent(event)
        if (column := self.layout()) is not None:
            column.activate()
        wide = sum(one.sizeHint().width() for one in (self._filter, self.lamps, self._sort))
        room = self.width() - wide - theme().px(100)
        # Even without room beside the filter, both buttons remain available as actions.
        lens = self.lens.sizeHint().width()
        self.lens.setVisible(room >= lens - theme().px(40))
        self.alike.setVisible(room >= lens)
        self._lay()

    def focus_card(self) -> None:
        """Focus the chosen card."""
        stop = self._roving.stop
        if stop is not None:
            stop.setFocus(Qt.FocusReason.OtherFocusReason)

    def _on_move(self, card: QWidget) -> None:
        if isinstance(card, StyleCard):
            self.chosen.emit(card.state.key)
