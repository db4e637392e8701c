"""The probe's screen as a whole: light at the left, camera at the right."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QHBoxLayout, QWidget

from app.ui.screens.probe.presenter import BEAT_MS, SLOW_BEAT_MS
from app.ui.screens.probe.view.camera_column import CameraColumn
from app.ui.screens.probe.view.light_column import LightColumn
from app.ui.widgets.dialogs import ask_files, ask_folder
from app.ui.widgets.surfaces import Room

if TYPE_CHECKING:
    from PySide6.QtGui import QHideEvent, QResizeEvent, QShowEvent

    from app.ui.screens.probe.presenter import ProbePresenter
    from app.ui.screens.probe.state import ProbeState

_LEAST = (512, 480)  # of the left side

_FILES = "Panoramas and photographs (*.exr *.hdr *.jpg *.jpeg *.insp *.png *.tif *.tiff *.dng)"


class ProbeScreen(QWidget):
    """Shows a `ProbeState` and tells the presenter what the user does."""

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
        self._capturing = False
        self._beat = QTimer(self)
        self._beat.timeout.connect(presenter.tick)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give the camera's side what the panorama does not need."""
        super().resizeEvent(event)
        self.camera.take_width(self.width() - self.light.widest())

    def show_state(self, state: ProbeState) -> None:
        """Show it; what is the same as before is left alone."""
        self.light.show_state(state)
        self.camera.show_state(state)
        if self._capturing != (state.running is not None):
            self._capturing = not self._capturing
            self._keep_time()

    def _keep_time(self) -> None:
        """Ask often only for what a capture has to show; behind another screen only to be heard.

        Otherwise only the age of the light changes, and that where it can be seen.
        """
        seen = self.isVisible()
        if self._capturing or seen:
            self._beat.start(BEAT_MS if self._capturing and seen else SLOW_BEAT_MS)
        else:
            self._beat.stop()

    def showEvent(self, event: QShowEvent) -> None:
        """Take up the time again."""
        super().showEvent(event)
        self._presenter.tick()
        self._keep_time()

    def hideEvent(self, event: QHideEvent) -> None:
        """Let the time go by."""
        super().hideEvent(event)
        self._keep_time()

    def zoom_by(self, steps: float) -> None:
        """Zoom the panorama, positive is nearer."""
        self.light.panorama.zoom_by(steps)

    def take_marker(self) -> None:
        """Give the marker the keyboard."""
        self.light.panorama.take_marker()

    def ask_files(self) -> None:
        """Ask which files are to be opened."""
        paths = ask_files(self, "Open files", _FILES)
        if paths:
            self._presenter.open_files(paths)

    def ask_folder(self) -> None:
        """Ask which folder is to be watched."""
        folder = ask_folder(self, "Watch a folder")
        if folder is not None:
            self._presenter.watching.start(folder)
