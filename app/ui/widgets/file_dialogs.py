"""The system's dialogs for files and folders; everyone who needs one asks here."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QFileDialog

if TYPE_CHECKING:
    from PySide6.QtWidgets import QWidget

# A dialog belongs to the window. A screen may be rebuilt while its dialog is open, and would take
# it down in the middle of its own event loop.


def ask_files(asker: QWidget, title: str, filters: str) -> list[Path]:
    """Ask for files that exist; none where the dialog is dismissed."""
    names, _ = QFileDialog.getOpenFileNames(asker.window(), title, "", filters)
    return [Path(name) for name in names]


def ask_file(asker: QWidget, title: str, filters: str) -> Path | None:
    """Ask for one file that exists."""
    name, _ = QFileDialog.getOpenFileName(asker.window(), title, "", filters)
    return Path(name) if name else None


def ask_folder(asker: QWidget, title: str, start: str = "") -> Path | None:
    """Ask for a folder that exists."""
    name = QFileDialog.getExistingDirectory(asker.window(), title, start)
    return Path(name) if name else None


def ask_target(asker: QWidget, title: str, suggested: str, filters: str) -> Path | None:
    """Ask for a file to write; the user has agreed that it is replaced."""
    name, _ = QFileDialog.getSaveFileName(asker.window(), title, suggested, filters)
    return Path(name) if name else None
