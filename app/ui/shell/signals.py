"""Delivers the signals that end the process (SIGTERM, SIGHUP and Ctrl-C) to the main thread.

Python runs a signal handler only between two bytecode instructions, but Qt's event loop executes no
bytecode. The interpreter therefore writes the signal's number to a socket, which wakes the loop.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from typing import Final

from PySide6.QtCore import QSocketNotifier

SIGNALS: Final = tuple(
    getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGINT") if hasattr(signal, name)
)

_PATIENCE_S: Final = 30.0


@contextlib.contextmanager
def ending_by_signal(end: Callable[[int], None]) -> Iterator[None]:
    """Call `end` with the number of any signal that asks the process to end.

    A second signal ends the process immediately. So does a timeout of half a minute, because a
    missing disk may never respond. A signal that is ignored, such as SIGHUP under nohup, stays
    ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread can handle signals
        return
    reader, writer = socket.socketpair()
    for each in (reader, writer):
        each.setblocking(False)
    came: list[int] = []

    def handle(number: int, _frame: object) -> None:
        if came:
            os._exit(128 + number)
        came.append(number)

    def wake() -> None:
        numbers = reader.recv(64)
        if came and came[0] in numbers:
            notifier.setEnabled(False)
            late = threading.Timer(_PATIENCE_S, lambda: os._exit(128 + came[0]))
            late.daemon = True
            late.start()
            end(came[0])

    notifier = QSocketNotifier(reader.fileno(), QSocketNotifier.Type.Read)
    notifier.activated.connect(wake)
    signals = [each for each in SIGNALS if signal.getsignal(each) is not signal.SIG_IGN]
    before = {each: signal.signal(each, handle) for each in signals}
    wakeup = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    try:
        yield
    finally:
        signal.set_wakeup_fd(wakeup)
        for number, handler in before.items():
            signal.signal(number, handler)
        notifier.setEnabled(False)
        reader.close()
        writer.close()
