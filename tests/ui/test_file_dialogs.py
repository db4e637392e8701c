"""File dialogs come and go over the window without taking the program down."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from PySide6.QtCore import QStandardPaths
from PySide6.QtWidgets import QFileDialog, QWidget
from pytestqt.qtbot import QtBot

from app.ui.widgets.dialogs import ask_file, ask_files, ask_folder, ask_target

# Everything in the window that follows the focus, and sixty of Qt's own dialogs over it. In a
# process of its own: what this finds ends the process.
CODE = """
from PySide6.QtCore import QStandardPaths, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog, QLineEdit, QWidget
from app.ui.shell.shortcuts import Shortcuts
from app.ui.theme import apply, set_theme
from app.ui.widgets.dialogs import Sheet
from app.ui.widgets.messages import Toasts
from app.ui.shell.window import Window

application = QApplication([])
set_theme("dark")
apply(application)

class Host(QWidget):
    _focus_moved = Window._focus_moved

    def __init__(self):
        super().__init__()
        self._global_shortcuts = Shortcuts(self)
        self._screen_shortcuts = Shortcuts(self)
        application.focusChanged.connect(self._focus_moved)

host = Host()
toasts = Toasts(host)
QLineEdit(host).setFocus()
host.show()
sheet = Sheet(host, "Live camera")

def shut():
    dialog = application.activeModalWidget()
    if dialog is None:
        QTimer.singleShot(1, shut)
    else:
        QTest.keyClick(dialog, Qt.Key.Key_Escape)

for number in range(60):
    if number == 30:
        sheet.open()
        toasts.tell("A message")
    QTimer.singleShot(0, shut)
    asked = QFileDialog.Option.DontUseNativeDialog
    QFileDialog.getOpenFileNames(host, "Open files", "", "*.exr", options=asked)
print("closed")
"""


@pytest.mark.slow
def test_sixty_dialogs_close() -> None:
    done = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "closed\n"


def test_a_dialog_belongs_to_the_window_and_not_to_a_screen_that_may_be_rebuilt(
    qtbot: QtBot, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    screen = QWidget(window)
    hosts: list[object] = []

    def answer(value: object) -> object:
        def ask(host: object, *_: object) -> object:
            hosts.append(host)
            return value

        return ask

    monkeypatch.setattr(QFileDialog, "getOpenFileNames", answer(([str(tmp_path / "a")], "")))
    monkeypatch.setattr(QFileDialog, "getOpenFileName", answer(("", "")))
    monkeypatch.setattr(QFileDialog, "getSaveFileName", answer((str(tmp_path / "b"), "")))
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", answer(""))
    assert ask_files(screen, "Open files", "*") == [tmp_path / "a"]
    assert ask_file(screen, "Open", "*") is None
    assert ask_target(screen, "Save", "b", "*") == tmp_path / "b"
    assert ask_folder(screen, "Folder") is None
    assert hosts == [window] * 4


def test_files_are_saved_among_the_pictures(
    qtbot: QtBot, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    window, started = QWidget(), []
    qtbot.addWidget(window)

    def ask(host: object, title: str, start: str, *_: object) -> tuple[str, str]:
        started.append(start)
        return "", ""

    monkeypatch.setattr(QFileDialog, "getSaveFileName", ask)
    for folder in (tmp_path, tmp_path / "none"):
        where = str(folder)
        monkeypatch.setattr(QStandardPaths, "writableLocation", lambda _, where=where: where)
        ask_target(window, "Save", "sheet.pdf", "*")
    assert started == [str(tmp_path / "sheet.pdf"), "sheet.pdf"]
