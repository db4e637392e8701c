"""Messages that come and go at the lower right, and the list of those that were."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

import shiboken6
from PySide6.QtCore import QEvent, QObject, QRect, Qt, QTimer, Signal
from PySide6.QtGui import (
    QAccessible,
    QAccessibleEvent,
    QEnterEvent,
    QKeyEvent,
    QPainter,
    QPaintEvent,
)
from PySide6.QtWidgets import QAbstractButton, QApplication, QHBoxLayout, QVBoxLayout, QWidget

from app.ui.theme import theme
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.icons import Icon
from app.ui.widgets.labels import Role, Text
from app.ui.widgets.paint import box

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = ["Message", "Toasts"]

MessageKind: TypeAlias = Literal["info", "done", "warning", "error"]

_ICONS: Final[dict[str, tuple[str, Role]]] = {
    "info": ("info", "text"),
    "done": ("check", "ok"),
    "warning": ("warning", "text"),
    "error": ("error", "err"),
}
_WIDTH: Final = 360
_EDGE: Final = 16
_GAP: Final = 8
_MOST_ACTIONS: Final = 2
_MOST_SHOWN: Final = 3
_KEPT: Final = 200
_STAY_MS: Final = 6000


@dataclass(frozen=True, slots=True)
class Message:
    """A message of the past.

    Attributes
    ----------
    when : datetime
        Local time at which it was told.
    kind : {"info", "done", "warning", "error"}
        What sort of message.
    text : str
        The sentence.
    """

    when: datetime
    kind: MessageKind
    text: str


class _Toast(QWidget):
    """One message on screen."""

    gone = Signal(object)

    def __init__(
        self,
        parent: QWidget,
        text: str,
        kind: MessageKind,
        actions: Sequence[tuple[str, Callable[[], None]]],
        stay_ms: int,
    ) -> None:
        super().__init__(parent)
        t = theme()
        self.setAccessibleName(text)
        self.setFixedWidth(t.px(_WIDTH))
        row = QHBoxLayout(self)
        row.setContentsMargins(t.px(12), t.px(8), t.px(4), t.px(8))
        row.setSpacing(t.px(12))
        top = Qt.AlignmentFlag.AlignTop
        name, role = _ICONS[kind]
        mark = Icon(name, 20, role, says=kind)
        lead = QVBoxLayout()
        lead.setContentsMargins(0, t.px(6), 0, 0)
        lead.addWidget(mark)
        lead.addStretch(1)
        row.addLayout(lead)
        column = QVBoxLayout()
        column.setContentsMargins(0, t.px(6), 0, t.px(6))
        column.setSpacing(t.px(8))
        column.addWidget(Text(text, 14, wrap=True))
        if actions:
            column.addLayout(self._buttons(actions))
        row.addLayout(column, 1)
        close = IconButton("close", "Close this message", kind="quiet", size="small")
        close.clicked.connect(self.leave)
        row.addWidget(close, 0, top)
        self._timer = QTimer(self, singleShot=True, interval=stay_ms)
        self._timer.timeout.connect(self._maybe_leave)
        self._timer.start()

    def _buttons(self, actions: Sequence[tuple[str, Callable[[], None]]]) -> QHBoxLayout:
        line = QHBoxLayout()
        line.setSpacing(theme().px(8))
        for label, do in actions[:_MOST_ACTIONS]:
            button = Button(label, size="small")
            button.clicked.connect(lambda _on=False, do=do: self._act(do))
            line.addWidget(button)
        line.addStretch(1)
        return line

    def _act(self, do: Callable[[], None]) -> None:
        self.leave()
        do()

    def _held(self) -> bool:
        focus = QApplication.focusWidget()
        return self.underMouse() or (focus is not None and self.isAncestorOf(focus))

    def _maybe_leave(self) -> None:
        if self._held():
            self._timer.start()
        else:
            self.leave()

    def leave(self) -> None:
        self._timer.stop()
        self.gone.emit(self)

    def wait(self) -> None:
        """Start its time anew."""
        self._timer.start()

    def enterEvent(self, event: QEnterEvent) -> None:
        """Notice that the mouse came."""
        self._timer.stop()
        super().enterEvent(event)

    def leaveEvent(self, event: QEvent) -> None:
        """Notice that the mouse left."""
        self._timer.start()
        super().leaveEvent(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Take the keys that it understands."""
        if event.key() == Qt.Key.Key_Escape:
            self.leave()
        else:
            super().keyPressEvent(event)

    def wanted_height(self) -> int:
        layout = self.layout()
        return layout.totalHeightForWidth(self.width()) if layout is not None else 0

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        box(QPainter(self), self.rect(), t.px(8), t.c.raised, t.c.ctl, t.line_width)


class Toasts(QObject):
    """Tells messages: stacked at the lower right of a window, 360 wide, for six seconds.

    A message stays while the mouse or the keyboard is on it. It is read out, and kept in
    `messages`. It never lies over a button: it moves up until it is clear.

    Parameters
    ----------
    parent : QWidget
        Window that they lie over.
    bottom : int, optional
        What to keep free at the foot of the window, as designed: the job line.
    stay_ms : int, optional
        How long a message stays, milliseconds.

    Attributes
    ----------
    told : Signal(Message)
        Each message when it is told.
    """

    told = Signal(object)

    def __init__(self, parent: QWidget, bottom: int = 40, stay_ms: int = _STAY_MS) -> None:
        super().__init__(parent)
        self._parent, self._bottom, self._stay_ms = parent, theme().px(bottom), stay_ms
        self._shown: list[_Toast] = []
        self._past: deque[Message] = deque(maxlen=_KEPT)
        parent.installEventFilter(self)
        application = QApplication.instance()
        if isinstance(application, QApplication):
            application.focusChanged.connect(self._focus_moved)

    @property
    def messages(self) -> tuple[Message, ...]:
        """Past messages, the newest first; at most 200."""
        return tuple(reversed(self._past))

    @property
    def shown(self) -> int:
        """How many are on screen."""
        return len(self._shown)

    def tell(
        self,
        message: str,
        *,
        kind: MessageKind = "info",
        actions: Sequence[tuple[str, Callable[[], None]]] = (),
    ) -> None:
        """Show a message, read it out and keep it.

        Parameters
        ----------
        message : str
            One sentence.
        kind : {"info", "done", "warning", "error"}, optional
            Decides the icon.
        actions : sequence of (words, callable), optional
            At most two; pressing one closes the message.
        """
        past = Message(datetime.now(), kind, message)
        self._past.append(past)
        for same in [one for one in self._shown if one.accessibleName() == message]:
            # Said again, it is not stacked upon itself.
            self._drop(same)
        toast = _Toast(self._parent, message, kind, actions, self._stay_ms)
        toast.gone.connect(self._drop)
        self._shown.append(toast)
        while len(self._shown) > _MOST_SHOWN:
            self._drop(self._shown[0])
        self._lay()
        toast.show()
        toast.raise_()
        QAccessible.updateAccessibility(QAccessibleEvent(toast, QAccessible.Event.Alert))
        self.told.emit(past)

    def clear(self) -> None:
        """Take all messages off the screen; they stay in the list."""
        for toast in tuple(self._shown):
            self._drop(toast)

    def _focus_moved(self, old: QWidget | None, new: QWidget | None) -> None:
        """Give back a focus that fell here because whoever had it went away or was disabled."""
        if new is None or not any(toast.isAncestorOf(new) for toast in self._shown):
            return
        left = old is None or not shiboken6.isValid(old) or not old.isVisibleTo(self._parent)
        if left or (old is not None and not old.isEnabled()):
            self._parent.setFocus(Qt.FocusReason.OtherFocusReason)

    def _drop(self, toast: _Toast) -> None:
        if toast in self._shown:
            self._shown.remove(toast)
            toast.hide()
            toast.deleteLater()
            self._lay()

    def _lay(self) -> None:
        """Place them from the lower right upwards, the newest lowest."""
        t = theme()
        edge, gap = t.px(_EDGE), t.px(_GAP)
        floor = self._parent.height() - self._bottom - edge
        for toast in reversed(self._shown):
            high = toast.wanted_height()
            left = self._parent.width() - edge - toast.width()
            top = self._clear(QRect(left, floor - high, toast.width(), high), gap)
            toast.setGeometry(left, top, toast.width(), high)
            floor = top - gap

    def _clear(self, place: QRect, gap: int) -> int:
        """Move a place up until no button lies under it; give its top."""
        start = place.top()
        buttons = [
            QRect(button.mapTo(self._parent, button.rect().topLeft()), button.size())
            for button in self._parent.findChildren(QAbstractButton)
            if button.isVisible() and not any(t.isAncestorOf(button) for t in self._shown)
        ]
        while (under := [b for b in buttons if b.intersects(place)]) and place.top() > 0:
            place.moveTop(min(b.top() for b in under) - gap - place.height())
        # A window full of buttons has no free place: then rather over one than out of sight.
        return place.top() if place.top() >= 0 else start

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow the window's size."""
        if watched is self._parent and event.type() == QEvent.Type.Resize and self._shown:
            self._lay()
        return False
