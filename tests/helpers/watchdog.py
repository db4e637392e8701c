"""Watches the thread of the screens: no single event may keep it busy for long.

For tests and for hunting: an application that notes every event that took more than a given CPU
time, with the stack that a second thread saw while it ran.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import tempfile
import threading
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from PySide6.QtWidgets import QApplication

from tests.helpers.pace import pace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from PySide6.QtCore import QEvent, QObject

_PERIOD_S: Final = 0.01
_ANSWER_S: Final = 0.002  # within which the thread has written its stack down


@dataclass(frozen=True, slots=True)
class SlowEvent:
    """An event that took too long.

    Attributes:
        cpu_s: As it would have been on a machine of the usual pace.
    """

    kind: str
    cpu_s: float
    stack: str
    mark: str


@dataclass(slots=True)
class _Running:
    """The outermost event that is being handled."""

    started_s: float = 0.0
    depth: int = 0
    floor: int = 0
    stacks: list[str] = field(default_factory=list)


class WatchedApplication(QApplication):
    """An application that notes slow events."""

    def __init__(self, arguments: Sequence[str], limit_s: float = 0.05) -> None:
        super().__init__(list(arguments))
        self.slow: list[SlowEvent] = []
        self.mark = ""
        self._limit_s = limit_s
        self._running = _Running()
        self._thread = threading.get_ident()
        self._end = threading.Event()
        threading.Thread(target=self._look, name="watchdog", daemon=True).start()

    def notify(self, receiver: QObject, event: QEvent) -> bool:
        """Handle an event and note how long that took."""
        running = self._running
        if running.depth != running.floor:
            running.depth += 1
            try:
                return bool(super().notify(receiver, event))
            finally:
                running.depth -= 1
        kind = f"{event.type().name} to {type(receiver).__name__} {receiver.objectName()}".strip()
        running.depth += 1
        running.stacks = []
        running.started_s = time.perf_counter()
        before = time.thread_time()
        try:
            return bool(super().notify(receiver, event))
        finally:
            used = time.thread_time() - before
            running.depth -= 1
            # Not of the walk itself, which ends where it began.
            if used > self._limit_s and running.depth == running.floor:
                stack = running.stacks[-1] if running.stacks else ""
                self.slow.append(SlowEvent(kind, used / pace(), stack, self.mark))

    def walk_from_here(self) -> None:
        """Count what happens inside the present event one by one, and not this event itself."""
        self._running.floor = self._running.depth

    def stop_watching(self) -> None:
        """End the thread that looks at stacks."""
        self._end.set()

    def _look(self) -> None:
        running, stacks = self._running, _Stacks(self._thread)
        while not self._end.wait(_PERIOD_S):
            since = time.perf_counter() - running.started_s
            if running.depth > running.floor and since > self._limit_s / 2:
                running.stacks.append(stacks.look())
        stacks.close()


class _Stacks:
    """Writes down where the thread of the screens is.

    It does so itself, upon a signal: reading another thread's stack from outside fails when a
    third thread ends at that moment. And not by frame objects: holding one keeps what is local to
    it alive, and a painter that outlives its paint event ends the program.
    """

    def __init__(self, thread: int) -> None:
        self._thread = thread
        self._file = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115
        self._signal = getattr(signal, "SIGUSR1", None)  # not on every system
        if self._signal is not None:
            faulthandler.register(self._signal, file=self._file, all_threads=False)

    def look(self) -> str:
        """Give its stack, as words; empty where it cannot be had."""
        if self._signal is None:
            return ""
        begin = self._file.seek(0, os.SEEK_END)
        signal.pthread_kill(self._thread, self._signal)
        time.sleep(_ANSWER_S)
        self._file.seek(begin)
        return self._file.read()

    def close(self) -> None:
        """Look no more."""
        if self._signal is not None:
            faulthandler.unregister(self._signal)
        self._file.close()
