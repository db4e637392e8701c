"""Cooperative Ctrl-C handling."""

from __future__ import annotations

import _thread
import contextlib
import os
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType
from typing import Final

from app.core.base.progress import Token
from app.core.text import tr

_IMPORTING: Final = "<frozen importlib._bootstrap>"
_LATER_S: Final = 0.02


@contextlib.contextmanager
def imports_whole() -> Iterator[None]:
    """Let Ctrl-C wait until the import under way is over.

    A library in C that is interrupted while it starts turns that into an error of its own, or ends
    the program with the interpreter's last words; no caller can tell what it was.
    """
    usual = signal.default_int_handler
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGINT) is not usual:
        yield
        return
    waiting: list[threading.Timer] = []

    def handle(number: int, frame: FrameType | None) -> None:
        if not _is_importing(frame):
            usual(number, frame)
        again = threading.Timer(_LATER_S, _interrupt_main)
        again.daemon = True
        waiting.append(again)
        again.start()

    signal.signal(signal.SIGINT, handle)
    try:
        yield
    finally:
        for each in waiting:
            each.cancel()
        signal.signal(signal.SIGINT, usual)


def _interrupt_main() -> None:
    if sys.platform == "win32":
        _thread.interrupt_main()
    elif (main := threading.main_thread().ident) is not None:
        signal.pthread_kill(main, signal.SIGINT)  # It also ends what the main thread waits for.


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None and frame.f_code.co_filename != _IMPORTING:
        frame = frame.f_back
    return frame is not None


@contextlib.contextmanager
def stopping(token: Token, words: str = "") -> Iterator[None]:
    """Let Ctrl-C ask for a stop; the second one ends the program at once."""
    words = words or tr("Stopping.")
    if threading.current_thread() is not threading.main_thread():
        yield  # signals are the main thread's
        return

    def handle(number: int, frame: object) -> None:
        del frame
        if token.cancelled:
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)
            return
        token.cancel()
        with contextlib.suppress(OSError, ValueError):
            # Print is not safe inside a signal handler.
            os.write(sys.stderr.fileno(), f"{words}\n".encode())

    before = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
