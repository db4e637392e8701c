"""Hands for walking through the window: clicks, keys and waiting, as a user would."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final, TypeVar, overload

from PySide6.QtCore import QBuffer, QCoreApplication, QEventLoop, QPoint, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QWidget

from app.core.base.files import atomic_write_bytes

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

W = TypeVar("W", bound=QWidget)
_PATIENCE_S: Final = 30.0
_TICK_MS: Final = 10


class Lost(Exception):
    """Something that should be in the window is not there, or did not happen."""


class Robot:
    """Walks through a window."""

    def __init__(self, window: QWidget) -> None:
        self.window = window

    @overload
    def find(self, name: str) -> QWidget: ...

    @overload
    def find(self, name: str, kind: type[W]) -> W: ...

    def find(self, name: str, kind: type[QWidget] = QWidget) -> QWidget:
        """Find the widget in sight whose accessible name begins so.

        Raises
        ------
        Lost
            When there is none; the message lists what is in sight.
        """
        seen = [one for one in self.window.findChildren(kind) if one.isVisibleTo(self.window)]
        names = {one.accessibleName(): one for one in reversed(seen) if one.accessibleName()}
        if name in names:
            return names[name]
        begins = [one for text, one in names.items() if text.startswith(name)]
        if not begins:
            raise Lost(f"There is no {name!r} among: {', '.join(sorted(names))}")
        return begins[0]

    def click(self, name: str, kind: type[QWidget] = QAbstractButton) -> None:
        """Click the middle of a button with the left button of the mouse."""
        self.click_at(self.find(name, kind))

    def click_at(self, widget: QWidget, at: QPoint | None = None) -> None:
        """Click a point of a widget; its middle by default."""
        point = widget.rect().center() if at is None else at
        QTest.mouseClick(widget, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, point)
        self.settle()

    def drag(self, widget: QWidget, points: list[QPoint]) -> None:
        """Press at the first point, move over the others, let go at the last."""
        left, none = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
        QTest.mousePress(widget, left, none, points[0])
        for point in points[1:]:
            QTest.mouseMove(widget, point)
            self.settle()
        QTest.mouseRelease(widget, left, none, points[-1])
        self.settle()

    def press(self, key: Qt.Key, modifier: Qt.KeyboardModifier | None = None) -> None:
        """Press a key where the focus is."""
        target = QApplication.focusWidget() or self.window
        QTest.keyClick(target, key, modifier or Qt.KeyboardModifier.NoModifier)
        self.settle()

    def write(self, text: str) -> None:
        """Type text where the focus is."""
        QTest.keyClicks(QApplication.focusWidget() or self.window, text)
        self.settle()

    def settle(self) -> None:
        """Let everything that is waiting happen."""
        for _ in range(3):
            QCoreApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents)

    def wait(self, happened: Callable[[], bool], what: str, seconds: float = _PATIENCE_S) -> float:
        """Wait until something has happened.

        Raises
        ------
        Lost
            When it did not happen in time.
        """
        begun = time.perf_counter()
        while not happened():
            if time.perf_counter() - begun > seconds:
                raise Lost(f"Not within {seconds:g} s: {what}")
            _let_pass(_TICK_MS)
        self.settle()
        return time.perf_counter() - begun

    def picture(self, path: Path) -> None:
        """Save what the window looks like as PNG.

        Raises
        ------
        OSError
            When it cannot be written.
        """
        self.settle()
        # In memory first: Qt does not say whether the disk took all of it.
        encoded = QBuffer()
        encoded.open(QBuffer.OpenModeFlag.WriteOnly)
        if not self.window.grab().save(encoded, "PNG"):
            raise OSError(f"{path} cannot be written.")
        atomic_write_bytes(path, bytes(encoded.data().data()))


def _let_pass(milliseconds: int) -> None:
    """Let events happen for a while; unlike `QTest.qWait` other threads run meanwhile."""
    loop = QEventLoop()
    QTimer.singleShot(milliseconds, loop.quit)
    loop.exec()
