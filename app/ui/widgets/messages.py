"""Toasts at the lower right of the window, banners with buttons, and empty states."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, Literal, TypeAlias

import shiboken6
from PySide6.QtCore import QEvent, QObject, QRect, Qt, QTimer, Signal
from PySide6.QtGui import (
    QAccessible,
    QAccessibleEvent,
    QColor,
    QEnterEvent,
    QKeyEvent,
    QPainter,
)
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QBoxLayout,
    QHBoxLayout,
    QSizePolicy,
    QWidget,
)

from app.core.text import tr
from app.ui.theme import Theme, px
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.labels import Icon, Role, Text
from app.ui.widgets.layouts import clear, column, row
from app.ui.widgets.paint import STALE, PaintedWidget, draw_tag, faint
from app.ui.widgets.surfaces import OutlineBox


class Banner(OutlineBox):
    """A framed box that contains an icon, a bold sentence, text and buttons."""

    pressed = Signal(int)

    def __init__(self, icon: str, title: str, text: str = "", actions: Sequence[str] = ()) -> None:
        super().__init__("none", "ctl")
        self._icon = Icon(icon, 24)
        self._title = Text(title, 14, 600, wrap=True)
        self._text = Text(text, 14, role="dim", wrap=True)
        self._buttons = row(gap=8)
        words = column(self._title, self._text, self._buttons)
        icon_place = (self._icon, 0, Qt.AlignmentFlag.AlignTop)
        row(icon_place, (words, 1), into=self, gap=12, margins=(12, 12, 16, 12))
        self._words: tuple[str, ...] = ()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self.set(icon, title, text, actions)

    def set(
        self,
        icon: str,
        title: str,
        text: str = "",
        actions: Sequence[str] = (),
        role: Role = "text",
    ) -> None:
        """Change the content. The parameters are the same as for the class."""
        self._icon.set(icon, role)
        self._title.set_text(title)
        self._text.say(text)
        self.setAccessibleName(f"{title} {text}".strip())
        if tuple(actions) != self._words:
            self._words = tuple(actions)
            _refill(self._buttons, self._words, self.pressed, centred=False)
        self._buttons.setContentsMargins(0, px(8) if actions else 0, 0, 0)

    def button(self, number: int = 0) -> Button:
        """Return one of the buttons, for example to mark it as busy."""
        return _buttons_in(self._buttons)[number]


class Empty(QWidget):
    """An empty state, which consists of a sentence and one or two buttons for the next step."""

    pressed = Signal(int)

    def __init__(self, sentence: str, action: str = "", icon: str = "", second: str = "") -> None:
        super().__init__()
        self._words: tuple[str, ...] = ()
        middle = Qt.AlignmentFlag.AlignHCenter
        self._icon = Icon(icon or "info", 28, "dim")
        # Hide the icon only now, because a widget that is shown without a parent opens as a window.
        if not icon:
            self._icon.hide()
        self._sentence = Text(sentence, 14, role="dim", wrap=True, align=middle)
        self._sentence.setMaximumWidth(px(440))
        line = row(..., (self._sentence, 100), ..., gap=None)
        self._buttons = row(gap=8)
        whole = (..., (self._icon, 0, middle), line, self._buttons, ...)
        column(*whole, into=self, gap=12, margins=24)
        self.set(sentence, action, second)

    def set(self, sentence: str, action: str = "", second: str = "") -> None:
        """Change the sentence and the buttons."""
        self._sentence.set_text(sentence)
        self.setAccessibleName(sentence)
        words = tuple(each for each in (action, second) if each)
        if words != self._words:
            self._words = words
            _refill(self._buttons, words, self.pressed, centred=True)

    def button(self, number: int = 0) -> Button:
        """Return one of the buttons."""
        return _buttons_in(self._buttons)[number]


class StaleVeil(PaintedWidget):
    """Dims part of a screen while its answer is being computed.

    Attributes:
        fill: Colour token of the background behind the dimmed part.
    """

    def __init__(self, over: QWidget, words: str, fill: str = "panel") -> None:
        super().__init__(over)
        self._over, self._words, self._fill = over, words, fill
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setAccessibleName(words)
        over.installEventFilter(self)
        self.hide()

    def cover(self, stale: bool) -> None:
        """Dim the part below, or stop dimming it."""
        if stale == self.isHidden():
            self.setGeometry(self._over.rect())
            self.setVisible(stale)
        if stale:
            self.raise_()

    def eventFilter(self, _over: QObject, event: QEvent) -> bool:
        """Match the size of the part that the veil covers."""
        if event.type() == QEvent.Type.Resize:
            self.setGeometry(self._over.rect())
        return False

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the veil in the current theme."""
        ground: QColor = getattr(t.c, self._fill)
        painter.fillRect(self.rect(), faint(ground, 1.0 - STALE))
        draw_tag(painter, self.width() / 2, self.height() / 5, self._words, "c", weight=600)


def _buttons_in(layout: QBoxLayout) -> list[Button]:
    items = (layout.itemAt(place) for place in range(layout.count()))
    widgets = (item.widget() for item in items if item is not None)
    return [widget for widget in widgets if isinstance(widget, Button)]


def _refill(layout: QBoxLayout, words: tuple[str, ...], pressed: object, centred: bool) -> None:
    """Replace the buttons in a row."""
    clear(layout)
    if centred:
        layout.addStretch(1)
    for number, label in enumerate(words):
        button = Button(label, size="normal" if centred else "small")
        button.clicked.connect(lambda _on=False, n=number: pressed.emit(n))  # type: ignore[attr-defined]
        layout.addWidget(button)
    layout.addStretch(1)


MessageKind: TypeAlias = Literal["info", "done", "warning", "error"]

KINDS: Final[dict[str, tuple[str, Role, str]]] = {
    "info": ("info", "text", tr("info")),
    "done": ("check", "ok", tr("done")),
    "warning": ("warning", "text", tr("warning")),
    "error": ("error", "err", tr("error")),
}
"""The icon, colour and name of each kind of message."""
_WIDTH: Final = 360
_EDGE: Final = 16
_GAP: Final = 8
_MOST_ACTIONS: Final = 2
_MOST_SHOWN: Final = 3
_PICTURE: Final = 160  # widgets of at least this height count as pictures and may be covered
_COLUMNS: Final = 3  # number of columns to search for free space, from the right
_STAY_MS: Final = 6000


class _Toast(OutlineBox):
    """A message that is visible on screen."""

    gone = Signal(object)
    closed = Signal()
    """Emitted when the user closes the message or chooses one of its actions."""

    def __init__(
        self,
        parent: QWidget,
        text: str,
        kind: MessageKind,
        actions: Sequence[tuple[str, Callable[[], None]]],
        stay_ms: int | None,
    ) -> None:
        super().__init__("raised", "ctl", parent=parent)
        self.stays = stay_ms is None
        self.setAccessibleName(text)
        self.setFixedWidth(px(_WIDTH))
        name, role, says = KINDS[kind]
        lead = column(Icon(name, 20, role, says=says), ..., gap=None, margins=(0, 6, 0, 0))
        buttons = (self._buttons(actions),) if actions else ()
        texts = column(Text(text, 14, wrap=True), *buttons, gap=8, margins=(0, 6, 0, 6))
        close = IconButton("close", tr("Close this message"), kind="quiet", size="small")
        close.clicked.connect(self._close)
        aside = (close, 0, Qt.AlignmentFlag.AlignTop)
        row(lead, (texts, 1), aside, into=self, gap=12, margins=(12, 8, 4, 8))
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(stay_ms or 0)
        self._timer.timeout.connect(self._maybe_leave)
        self.wait()

    def _buttons(self, actions: Sequence[tuple[str, Callable[[], None]]]) -> QHBoxLayout:
        buttons = []
        for label, do in actions[:_MOST_ACTIONS]:
            button = Button(label, size="small", do=lambda _on=False, do=do: self._act(do))
            buttons.append(button)
        return row(*buttons, ..., gap=8)

    def _act(self, do: Callable[[], None]) -> None:
        self._close()
        do()

    def _close(self) -> None:
        self.leave()
        self.closed.emit()

    def _in_use(self) -> bool:
        focus = QApplication.focusWidget()
        return self.underMouse() or (focus is not None and self.isAncestorOf(focus))

    def _maybe_leave(self) -> None:
        if self._in_use():
            self.wait()
        else:
            self.leave()

    def leave(self) -> None:
        self._timer.stop()
        self.gone.emit(self)

    def wait(self) -> None:
        """Restart the timer, unless the message stays until it is closed."""
        if not self.stays:
            self._timer.start()

    def enterEvent(self, event: QEnterEvent) -> None:
        self._timer.stop()
        super().enterEvent(event)

    def leaveEvent(self, event: QEvent) -> None:
        self.wait()
        super().leaveEvent(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self._close()
        else:
            super().keyPressEvent(event)

    def wanted_height(self) -> int:
        layout = self.layout()
        return layout.totalHeightForWidth(self.width()) if layout is not None else 0


class Toasts(QObject):
    """Shows messages for six seconds at the lower right of a window.

    The messages are stacked and are 360 pixels wide. A message stays while the mouse or the focus
    is on it, and an error stays until it is closed. Every message is announced to screen readers.
    Messages move up until they no longer cover any button.
    """

    def __init__(self, parent: QWidget, bottom: int = 40, stay_ms: int = _STAY_MS) -> None:
        super().__init__(parent)
        self._parent, self._bottom, self._stay_ms = parent, px(bottom), stay_ms
        self._toasts: list[_Toast] = []
        parent.installEventFilter(self)
        application = QApplication.instance()
        self._had = QApplication.focusWidget()
        if isinstance(application, QApplication):
            application.focusChanged.connect(self._focus_moved)

    @property
    def count(self) -> int:
        """Number of messages on screen."""
        return len(self._toasts)

    def tell(
        self,
        message: str,
        *,
        kind: MessageKind = "info",
        actions: Sequence[tuple[str, Callable[[], None]]] = (),
        stay: bool = False,
        closed: Callable[[], None] | None = None,
    ) -> None:
        """Show and announce a message that has at most two actions.

        Each action also closes the message.
        """
        # A repeated message replaces the earlier one.
        self.drop(message)
        toast = _Toast(self._parent, message, kind, actions, None if stay else self._stay_ms)
        toast.gone.connect(self._drop)
        if closed is not None:
            toast.closed.connect(closed)
        self._toasts.append(toast)
        while len(self._toasts) > _MOST_SHOWN:
            # Remove messages with a timer first.
            passing = [one for one in self._toasts[:-1] if not one.stays]
            self._drop((passing or self._toasts)[0])
        self.lay()
        toast.show()
        toast.raise_()
        QAccessible.updateAccessibility(QAccessibleEvent(toast, QAccessible.Event.Alert))

    def drop(self, message: str) -> None:
        """Close one message."""
        for same in [one for one in self._toasts if one.accessibleName() == message]:
            self._drop(same)

    def clear(self) -> None:
        """Remove all messages from the screen, but keep them in the list of messages."""
        for toast in tuple(self._toasts):
            self._drop(toast)

    def _focus_moved(self) -> None:
        """Move the focus away if it is here only because its previous owner was hidden or disabled.

        The previous owner that Qt reports may be half destroyed, so this class tracks the owner
        itself.
        """
        old, new = self._had, QApplication.focusWidget()
        self._had = new
        if new is None or not any(toast.isAncestorOf(new) for toast in self._toasts):
            return
        is_gone = old is None or not shiboken6.isValid(old) or not old.isVisibleTo(self._parent)
        if is_gone or (old is not None and not old.isEnabled()):
            self._parent.setFocus(Qt.FocusReason.OtherFocusReason)

    def _drop(self, toast: _Toast) -> None:
        if toast in self._toasts:
            self._toasts.remove(toast)
            toast.hide()
            toast.deleteLater()
            self.lay()

    def lay(self) -> None:
        """Position the messages upward from the lower right, with the newest at the bottom."""
        edge, gap = px(_EDGE), px(_GAP)
        floor = self._parent.height() - self._bottom - edge
        blocks = self._controls() if self._toasts else []
        for toast in reversed(self._toasts):
            high = toast.wanted_height()
            left = self._parent.width() - edge - toast.width()
            place = self._clear(QRect(left, floor - high, toast.width(), high), blocks, gap)
            toast.setGeometry(place)
            blocks.append(place)

    def _controls(self) -> list[QRect]:
        """Return the areas of all controls other than pictures, in the window's pixels."""
        tab, high = Qt.FocusPolicy.TabFocus, px(_PICTURE)
        return [
            QRect(one.mapTo(self._parent, one.rect().topLeft()), one.size())
            for one in self._parent.findChildren(QWidget)
            if (isinstance(one, QAbstractButton) or one.focusPolicy() & tab)
            and one.height() < high
            and not one.testAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
            and one.isVisible()
            and not any(toast.isAncestorOf(one) for toast in self._toasts)
        ]

    def _clear(self, place: QRect, blocks: list[QRect], gap: int) -> QRect:
        """Move a toast up until it covers no control, or to the left if that way is shorter."""
        spots: list[tuple[int, QRect]] = []
        for steps in range(_COLUMNS):
            here = place.translated(-steps * (place.width() + gap), 0)
            while (under := [b for b in blocks if b.intersects(here)]) and here.top() > 0:
                here.moveTop(min(b.top() for b in under) - gap - here.height())
            if here.top() >= 0 and here.left() >= 0:
                up = place.top() - here.top()
                spots.append((up + steps * place.width() // 2, here))
        # In a window full of controls, covering one is better than being out of sight.
        return min(spots, key=lambda each: each[0])[1] if spots else place

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow changes to the window's size and layout."""
        relayout = event.type() in (QEvent.Type.Resize, QEvent.Type.LayoutRequest)
        if relayout and self._toasts and watched is self._parent:
            self.lay()
        return False
