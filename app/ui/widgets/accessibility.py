"""Accessible names and roles for controls, and keyboard navigation between controls."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Final

import shiboken6
from PySide6.QtCore import QEvent, QObject, QPoint, QRect, Qt, Signal
from PySide6.QtGui import QAccessible, QKeyEvent
from PySide6.QtWidgets import QAccessibleWidget, QWidget

from app.core.base.visible_text import visible

_KEYS: Final = frozenset({Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Escape})


_ROLE: Final = "spokenAs"


def give_role(widget: QWidget, role: QAccessible.Role) -> None:
    """Set an accessible role that Qt does not assign by itself, such as slider, graphic or pane."""
    if not _installed:
        QAccessible.installFactory(_interface)
        _installed.append(True)
    widget.setProperty(_ROLE, role.value)


_installed: Final[list[bool]] = []


def _interface(_kind: str, thing: QObject) -> QAccessibleWidget | None:
    role = thing.property(_ROLE) if isinstance(thing, QWidget) else None
    if role is None:
        return None
    assert isinstance(thing, QWidget)
    return QAccessibleWidget(thing, QAccessible.Role(role))


class OwnKeys(QObject):
    """Passes Enter and Esc to the focused control before either key acts as a shortcut."""

    def __init__(self, *widgets: QWidget) -> None:
        super().__init__(widgets[0])
        for widget in widgets:
            widget.installEventFilter(self)

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Claim Enter and Esc before either key triggers a shortcut."""
        claimed = (
            event.type() is QEvent.Type.ShortcutOverride
            and isinstance(event, QKeyEvent)
            and Qt.Key(event.key()) in _KEYS
        )
        if claimed:
            event.accept()
        return claimed


_WAYS = {
    Qt.Key.Key_Left: (-1, 0),
    Qt.Key.Key_Right: (1, 0),
    Qt.Key.Key_Up: (0, -1),
    Qt.Key.Key_Down: (0, 1),
}


class Roving(QObject):
    """Makes a group of widgets a single Tab stop.

    The arrow keys, Home and End move the focus within the group. An arrow key moves the focus to
    the nearest widget in that direction on screen. A grid may therefore have any number of columns.
    """

    moved = Signal(QWidget)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._members: list[QWidget] = []

    def set_members(self, members: Sequence[QWidget]) -> None:
        """Set the group's widgets in reading order, keeping the current Tab stop."""
        stop = self.stop
        for old in self._members:
            if shiboken6.isValid(old):
                old.removeEventFilter(self)
        self._members = list(members)
        for member in self._members:
            member.installEventFilter(self)
        if self._members:
            self.set_stop(stop if stop in self._members else self._members[0])

    @property
    def stop(self) -> QWidget | None:
        """The group's Tab stop, or None if the group has none."""
        tabbed = Qt.FocusPolicy.TabFocus
        living = [member for member in self._members if shiboken6.isValid(member)]
        return next((m for m in living if m.focusPolicy() & tabbed), None)

    def set_stop(self, stop: QWidget | None) -> None:
        """Set the Tab stop, or keep the current one if `stop` is None."""
        if stop is None:
            return
        for member in self._members:
            here = member is stop
            member.setFocusPolicy(Qt.FocusPolicy.StrongFocus if here else Qt.FocusPolicy.ClickFocus)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Handle the arrow keys, Home and End, and make any member that is focused the Tab stop."""
        if event.type() == QEvent.Type.FocusIn and isinstance(watched, QWidget):
            self.set_stop(watched)
        if isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress:
            modifiers = event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
            if modifiers == Qt.KeyboardModifier.NoModifier and isinstance(watched, QWidget):
                return self._step(watched, Qt.Key(event.key()))
        return False

    def _step(self, here: QWidget, key: Qt.Key) -> bool:
        usable = [m for m in self._members if m.isVisible() and m.isEnabled()]
        if not usable or (key not in _WAYS and key not in (Qt.Key.Key_Home, Qt.Key.Key_End)):
            return False
        if key in _WAYS:
            there = self._neighbour(here, usable, _WAYS[key])
        else:
            there = usable[0 if key == Qt.Key.Key_Home else -1]
        if there is not None and there is not here:
            there.setFocus(Qt.FocusReason.TabFocusReason)
            self.moved.emit(there)
        return True

    @staticmethod
    def _neighbour(here: QWidget, usable: list[QWidget], way: tuple[int, int]) -> QWidget | None:
        """Return the nearest usable widget in a direction, or None if there is none."""
        start = _place(here)
        straight: list[tuple[int, QWidget]] = []
        slanted: list[tuple[int, QWidget]] = []
        for other in usable:
            place = _place(other)
            off = place.center() - start.center()
            ahead = off.x() * way[0] + off.y() * way[1]
            aside = abs(off.x() * way[1] + off.y() * way[0])
            # Members in the same row or column overlap across the direction of movement.
            span = (start.height() + place.height()) if way[0] else (start.width() + place.width())
            if ahead > 0 and other is not here:
                (straight if 2 * aside < span else slanted).append((2 * ahead + aside, other))
        if straight:
            return min(straight, key=lambda pair: pair[0])[1]
        if way[0]:
            # At the end of a row, continue with the next row, as in reading.
            number = usable.index(here) + way[0] if here in usable else 0
            return usable[min(max(number, 0), len(usable) - 1)]
        # If a shorter row has nothing straight below, use its nearest member.
        return min(slanted, key=lambda pair: pair[0])[1] if slanted else None


def _place(widget: QWidget) -> QRect:
    return QRect(widget.mapTo(widget.window(), QPoint(0, 0)), widget.size())


_LINE: Final = 52


def _wrapped(text: str) -> str:
    """Break a long sentence into lines, because a plain tooltip would show only one."""
    lines = visible(text).splitlines()
    return "\n".join(line if len(line) <= _LINE else textwrap.fill(line, _LINE) for line in lines)


def describe(widget: QWidget, name: str, shortcut: str = "", tip: str | None = None) -> None:
    """Set the accessible name and the tooltip of a widget."""
    widget.setAccessibleName(visible(name))
    text = name if tip is None else tip
    text = f"{text} ({shortcut})" if shortcut and text else text
    wrapped = _wrapped(text)
    widget.setProperty("tip", wrapped)
    if widget.isEnabled():
        widget.setToolTip(wrapped)


def set_available(widget: QWidget, available: bool, why: str = "") -> None:
    """Enable a control, or disable it and state the reason in its tooltip."""
    widget.setEnabled(available)
    tip = str(widget.property("tip") or "")
    widget.setToolTip(tip if available or not why else _wrapped(why))
    widget.setAccessibleDescription("" if available else why)
