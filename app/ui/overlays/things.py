"""A list of things with icon, words, detail and keys; the arrows of a text field move in it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QEvent, QModelIndex, QObject, QPersistentModelIndex, QRect, QSize, Qt
from PySide6.QtGui import QKeyEvent, QPainter, QPalette
from PySide6.QtWidgets import (
    QAbstractItemView,
    QFrame,
    QListWidget,
    QListWidgetItem,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QWidget,
)

from app.ui.theme import theme
from app.ui.theme.icons import draw_icon
from app.ui.theme.style import dress_bars
from app.ui.widgets.paint import RIGHT, box, hover_fill, put_text, text_width
from app.ui.widgets.tips import describe

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from app.ui.presenters.finding import Findable

_THING: Final = Qt.ItemDataRole.UserRole
_HEIGHT: Final = 40
_MOVES: Final = frozenset({Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown})


class _Lines(QStyledItemDelegate):
    """Paints one thing per line."""

    def sizeHint(
        self, _option: QStyleOptionViewItem, _index: QModelIndex | QPersistentModelIndex
    ) -> QSize:
        return QSize(0, theme().px(_HEIGHT))

    def paint(
        self,
        painter: QPainter,
        option: QStyleOptionViewItem,
        index: QModelIndex | QPersistentModelIndex,
    ) -> None:
        t = theme()
        thing: Findable = index.data(_THING)
        rect: QRect = option.rect
        ink, faint = t.c.text, t.c.dim
        if option.state & QStyle.StateFlag.State_Selected:
            fill = t.c.text if t.contrast else t.c.raised
            box(painter, rect, t.px(6), fill, t.c.ctl, t.line_width)
            ink, faint = (t.c.panel, t.c.panel) if t.contrast else (ink, faint)
        elif option.state & QStyle.StateFlag.State_MouseOver:
            box(painter, rect, t.px(6), hover_fill(t))
        inner = rect.adjusted(t.px(12), 0, -t.px(12), 0)
        if thing.icon:
            spot = QRect(inner.left(), inner.top(), t.px(20), inner.height())
            draw_icon(painter, thing.icon, spot, t.px(20), ink)
        inner.setLeft(inner.left() + t.px(32))
        aside = "   ".join(part for part in (thing.detail, thing.keys) if part)
        small = t.font(12)
        put_text(painter, inner, aside, small, faint, RIGHT)
        inner.setRight(inner.right() - text_width(small, aside) - t.px(16))
        put_text(painter, inner, thing.words, t.font(14), ink)


class ThingList(QListWidget):
    """Things to choose from."""

    def __init__(self, name: str, take: Callable[[Findable], None]) -> None:
        super().__init__()
        describe(self, name, tip="")
        self._take = take
        self.setItemDelegate(_Lines(self))
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setMouseTracking(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        dress_bars(self)
        self.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        see_through = self.palette()
        see_through.setColor(QPalette.ColorRole.Base, Qt.GlobalColor.transparent)
        self.setPalette(see_through)
        self.itemClicked.connect(self._taken)

    def show_things(self, things: Sequence[Findable]) -> None:
        """Show other things; the first is selected."""
        self.clear()
        for thing in things:
            item = QListWidgetItem(thing.words)
            item.setData(_THING, thing)
            words = ", ".join(part for part in (thing.words, thing.detail, thing.keys) if part)
            item.setData(Qt.ItemDataRole.AccessibleTextRole, words)
            self.addItem(item)
        self.setCurrentRow(0)

    def follow(self, field: QWidget) -> None:
        """Let arrows and Enter of a text field act here while the field keeps the focus."""
        field.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take the keys that move or choose from the field that is followed."""
        del watched
        if isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress:
            if Qt.Key(event.key()) in _MOVES:
                self.keyPressEvent(event)
                return True
            if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
                self.take_current()
                return True
        return False

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Choose with Enter."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.take_current()
        else:
            super().keyPressEvent(event)

    def take_current(self) -> None:
        """Choose what is selected."""
        item = self.currentItem()
        if item is not None:
            self._taken(item)

    def _taken(self, item: QListWidgetItem) -> None:
        self._take(item.data(_THING))
