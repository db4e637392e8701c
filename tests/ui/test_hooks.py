"""Uncaught exceptions: shown, logged, and the program continues."""

from __future__ import annotations

import logging
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import QTimer, qInstallMessageHandler, qWarning

from app.core.base.errors import CoreError
from app.ui.shell.log import log_to
from app.ui.shell.start import caught_errors

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pytestqt.qtbot import QtBot


@pytest.fixture
def root_logger() -> Iterator[logging.Logger]:
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    yield root
    for handler in root.handlers[:]:
        if handler not in handlers:
            root.removeHandler(handler)
            handler.close()
    root.setLevel(level)


def test_an_error_of_a_thread_is_told_on_the_thread_of_the_screens(qtbot: QtBot) -> None:
    told: list[tuple[str, int]] = []

    def fail() -> None:
        raise CoreError("No light.")

    with caught_errors(lambda error: told.append((str(error), threading.get_ident()))):
        thread = threading.Thread(target=fail)
        thread.start()
        thread.join()
        qtbot.waitUntil(lambda: bool(told))
    assert told == [("No light.", threading.get_ident())]


def test_an_error_of_an_event_is_told_and_events_go_on(qtbot: QtBot) -> None:
    told: list[str] = []
    went_on: list[int] = []

    def fail() -> None:
        raise ValueError("in an event")

    with qtbot.captureExceptions() as captured, caught_errors(lambda e: told.append(str(e))):
        QTimer.singleShot(0, fail)
        QTimer.singleShot(1, lambda: went_on.append(1))
        qtbot.waitUntil(lambda: bool(told) and bool(went_on))
    assert told == ["in an event"]
    assert not captured


def test_the_former_hooks_come_back(qtbot: QtBot) -> None:
    before = (sys.excepthook, threading.excepthook, sys.unraisablehook)
    with caught_errors(lambda error: None):
        assert (sys.excepthook, threading.excepthook, sys.unraisablehook) != before
    assert (sys.excepthook, threading.excepthook, sys.unraisablehook) == before


def test_what_qt_says_goes_into_the_log(
    qtbot: QtBot, tmp_path: Path, root_logger: logging.Logger
) -> None:
    log_to(tmp_path / "logs")
    with caught_errors(lambda error: None):
        qWarning("a wire came loose")
    for handler in root_logger.handlers:
        handler.flush()
    assert "Qt: a wire came loose" in (tmp_path / "logs" / "turnlight.log").read_text("utf-8")


def test_without_a_place_for_a_log_there_is_none(
    tmp_path: Path, root_logger: logging.Logger
) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    before = root_logger.handlers[:]
    log_to(tmp_path / "file" / "logs")
    assert root_logger.handlers == before


def test_leaving_the_hooks_gives_qt_its_own_handler_back(qtbot: QtBot) -> None:
    def mine(kind: object, context: object, message: str) -> None:
        heard.append(message)

    heard: list[str] = []
    former = qInstallMessageHandler(mine)
    try:
        with caught_errors(lambda error: None):
            pass
        qWarning("for me")
    finally:
        qInstallMessageHandler(former)
    assert heard == ["for me"]
