"""Ctrl-C as a wish that work can follow in its own time."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from app.core.progress import Token

__all__ = ["stopping"]


@contextlib.contextmanager
def stopping(token: Token, words: str = "Stopping.") -> Iterator[None]:
    """Let Ctrl-C ask for a stop; the second one ends the program at once.

    Parameters
    ----------
    token : Token
        Is cancelled by the first.
    words : str, optional
        Said on stderr then.
    """
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
