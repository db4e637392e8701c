"""The probe's screen as a whole: light at the left, camera at the right."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QWidget

from app.ui.presenters.probe import BEAT_MS
from app.ui.screens.probe.camera_column import CameraColumn
from app.ui.screens.probe.light_column import LightColumn
from app.ui.widgets.surfaces import Room

if TYPE_CHECKING:
    from PySide6.QtGui import QResizeEvent

    from app.ui.presenters.probe import ProbePresenter
    from app.ui.presenters.probe_state import ProbeState

__all__ = ["ProbeScreen"]

_LEAST = (512, 480)  # of the left side

_FILES = "Panoramas and photographs (*.exr *.hdr *.jpg *.jpeg *.png *.tif *.tiff *.dng)"


class ProbeScreen(QWidget):
    """Shows a `ProbeState` and tells the presenter what the user does.

    Parameters
    ----------
    presenter : ProbePresenter
        Whose state it is.
    compact : bool
        Whether the window is too small for the full layout.
    """

    def __init__(self, presenter: ProbePresenter, compact: bool) -> None:
        super().__init__()
        self._presenter = presenter
        self.light = LightColumn(presenter, compact)
        self.camera = CameraColumn(presenter, compact)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(0)
        row.addWidget(Room(self.light, *_LEAST), 1)
        row.addWidget(self.camera)
        self.light.files_asked.connect(self.ask_files)
        self.light.folder_asked.connect(self.ask_folder)
        self._beat = QTimer(self, interval=BEAT_MS)
        self._beat.timeout.connect(presenter.tick)
        self._beat.start()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give the camera's side what the panorama does not need."""
        super().resizeEvent(event)
        self.camera.take_width(self.width() - self.light.widest())

    def show_state(self, state: ProbeState) -> None:
        """Show it; what is the same as before is left alone."""
        self.light.show_state(state)
        self.camera.show_state(state)

    def zoom_by(self, steps: float) -> None:
        """Zoom the panorama, positive is nearer."""
        self.light.panorama.zoom_by(steps)

    def take_marker(self) -> None:
        """Give the marker the keyboard."""
        self.light.panorama.take_marker()

    def ask_files(self) -> None:
        """Ask which files are to be opened."""
        names, _ = QFileDialog.getOpenFileNames(self.window(), "Open files", "", _FILES)
        if names:
            self._presenter.open_files([Path(name) for name in names])

    def ask_folder(self) -> None:
        """Ask which folder is to be watched."""
        name = QFileDialog.getExistingDirectory(self.window(), "Watch a folder")
        if name:
            self._presenter.watching.start(Path(name))
