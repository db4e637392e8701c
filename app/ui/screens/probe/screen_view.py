"""The view of the Probe screen, with the light on the left and the camera on the right."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QTimer
from PySide6.QtGui import QHideEvent, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.screens.probe.capture.capture_view import CameraColumn
from app.ui.screens.probe.capture.distant_sign_view import CaptureSign
from app.ui.screens.probe.light_view import LightColumn
from app.ui.screens.probe.screen import BEAT_MS, SLOW_BEAT_MS, ProbePresenter, ProbeState
from app.ui.screens.probe.ways import WAYS
from app.ui.widgets.dialogs import ask_files, ask_folder
from app.ui.widgets.layouts import row, stacked
from app.ui.widgets.surfaces import Room

_LEAST = (512, 480)  # of the left-hand side


class ProbeScreen(QWidget):
    """Shows a `ProbeState` and passes the user's actions to the presenter."""

    def __init__(self, presenter: ProbePresenter, compact: bool) -> None:
        super().__init__()
        self._presenter = presenter
        ask_files = partial(self.ask_measured, "file")
        self.light = LightColumn(presenter, compact, ask_files, self.ask_folder)
        self.camera = CameraColumn(presenter, compact)
        self.sign = CaptureSign()
        self._left = stacked(Room(self.light, *_LEAST), self.sign)
        row((self._left, 1), self.camera, into=self)
        self._busy = False  # whether a capture or a preview is running
        self._beat = QTimer(self)
        self._beat.timeout.connect(presenter.tick)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Widen the right-hand column to use the space that the panorama leaves free."""
        super().resizeEvent(event)
        self.camera.take_width(self.width() - self.light.widest())

    def show_state(self, state: ProbeState) -> None:
        """Show the state, updating only the parts that have changed."""
        self.light.show_state(state)
        self.camera.show_state(state)
        self._left.setCurrentIndex(0 if state.running is None else 1)
        if state.running is not None:
            self.sign.show_sign(state.running.sign)
        if self._busy != (state.running is not None or state.live is not None):
            self._busy = not self._busy
            self._keep_time()

    def _keep_time(self) -> None:
        """Update often only while the camera is busy and the screen is visible.

        At other times only the age of the light measurement changes, so infrequent updates suffice.
        """
        visible = self.isVisible()
        if self._busy or visible:
            self._beat.start(BEAT_MS if self._busy and visible else SLOW_BEAT_MS)
        else:
            self._beat.stop()

    def showEvent(self, event: QShowEvent) -> None:
        """Update immediately and restart the timer."""
        super().showEvent(event)
        self._presenter.tick()
        self._keep_time()

    def hideEvent(self, event: QHideEvent) -> None:
        """Slow down the timer or stop it."""
        super().hideEvent(event)
        self._keep_time()

    def zoom_by(self, steps: float) -> None:
        """Zoom the panorama by a number of steps. A positive number zooms in."""
        self.light.panorama.zoom_by(steps)

    def take_marker(self) -> None:
        """Give the marker the keyboard focus."""
        self.light.panorama.take_marker()

    def ask_measured(self, way: str) -> None:
        """Ask for the files needed for one of the `WAYS`."""
        paths = ask_files(self, tr("Open files"), WAYS[way].files)
        if paths:
            self._presenter.open_files(paths)

    def ask_folder(self) -> None:
        """Ask for the folder to watch."""
        folder = ask_folder(self, tr("Watch a folder"))
        if folder is not None:
            self._presenter.watching.start(folder)
