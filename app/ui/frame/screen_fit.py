"""Where a window goes on its screen: whole in what the desktop leaves free, with its frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QMargins, QRect, QSize

if TYPE_CHECKING:
    from PySide6.QtGui import QWindow
    from PySide6.QtWidgets import QWidget

_FRAME: Final = QMargins(4, 32, 4, 4)
"""Title bar and edges of the usual desktops; what they are is known once the window is shown."""


def fitted(wanted: QRect, room: QRect) -> QRect:
    """Make a rectangle as small as the room, then move it inside; both in the same pixels."""
    size = wanted.size().boundedTo(room.size())
    left = min(max(wanted.left(), room.left()), room.left() + room.width() - size.width())
    top = min(max(wanted.top(), room.top()), room.top() + room.height() - size.height())
    return QRect(left, top, size.width(), size.height())


def room_for(window: QWidget) -> QRect:
    """Give what a window's content can have on its screen, logical pixels; its frame is outside."""
    return window.screen().availableGeometry().marginsRemoved(_frame_of(window))


def fit_on_screen(window: QWidget, smallest: QSize) -> None:
    """Bring a window whole onto its screen; it may be smaller than `smallest` only there."""
    if window.isMaximized() or window.isFullScreen():
        return
    room = room_for(window)
    window.setMinimumSize(smallest.boundedTo(room.size()))
    wanted = fitted(window.geometry(), room)
    if wanted != window.geometry():
        window.setGeometry(wanted)


def _frame_of(window: QWidget) -> QMargins:
    handle: QWindow | None = window.windowHandle()
    known = QMargins() if handle is None else handle.frameMargins()
    return _FRAME if known.isNull() else known
