"""Handlers for uncaught exceptions: logged to a file, shown to the user, and the app continues."""

from __future__ import annotations

import contextlib
import logging
import logging.handlers
import sys
import threading
from typing import TYPE_CHECKING, Any, Final

from PySide6.QtCore import QObject, Qt, QtMsgType, Signal, qInstallMessageHandler

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from PySide6.QtCore import QMessageLogContext

_LOG_BYTES: Final = 1 << 20
_LEVELS: Final = {
    QtMsgType.QtDebugMsg: logging.DEBUG,
    QtMsgType.QtInfoMsg: logging.INFO,
    QtMsgType.QtWarningMsg: logging.WARNING,
    QtMsgType.QtCriticalMsg: logging.ERROR,
    QtMsgType.QtFatalMsg: logging.CRITICAL,
}
_log = logging.getLogger("turnlight")
_log.addHandler(logging.NullHandler())  # without a log nothing is printed in its place


class _Carrier(QObject):
    """Brings an error from any thread to the one of the screens."""

    came = Signal(object)


@contextlib.contextmanager
def caught_errors(tell: Callable[[Exception], None]) -> Iterator[None]:
    """Take every error that would else end a thread or be printed and lost.

    Yields
    ------
    None
        While the hooks are set; the former ones come back afterwards.
    """
    carrier = _Carrier()
    carrier.came.connect(tell, Qt.ConnectionType.QueuedConnection)

    def take(error: BaseException | None) -> None:
        if isinstance(error, Exception):
            _log.error("nobody took this", exc_info=error)
            carrier.came.emit(error)

    def on_main(kind: type[BaseException], error: BaseException, trace: Any) -> None:
        if isinstance(error, Exception):
            take(error)
        else:
            sys.__excepthook__(kind, error, trace)

    def from_qt(kind: QtMsgType, context: QMessageLogContext, message: str) -> None:
        del context
        _log.log(_LEVELS.get(kind, logging.INFO), "Qt: %s", message)

    before = (sys.excepthook, threading.excepthook, sys.unraisablehook)
    sys.excepthook = on_main
    threading.excepthook = lambda args: take(args.exc_value)
    sys.unraisablehook = lambda args: take(args.exc_value)
    qt_before = qInstallMessageHandler(from_qt)
    try:
        yield
    finally:
        sys.excepthook, threading.excepthook, sys.unraisablehook = before
        qInstallMessageHandler(qt_before)


def log_to(folder: Path) -> None:
    """Keep a log of at most two files of 1 MiB; where that is not possible there is none."""
    with contextlib.suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        handler = logging.handlers.RotatingFileHandler(
            folder / "turnlight.log", maxBytes=_LOG_BYTES, backupCount=1, encoding="utf-8"
        )
        handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s %(message)s"))
        root = logging.getLogger()
        root.addHandler(handler)
        root.setLevel(logging.INFO)
