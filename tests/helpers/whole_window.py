"""The whole window with real presenters and jobs, on devices that a test decides on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from PySide6.QtWidgets import QApplication

from app.core.base.paths import resources
from app.core.base.progress import Token
from app.core.storage.settings import Settings
from app.core.storage.settings_file import FILE, write_settings
from app.devices.clock import Clock, SystemClock
from app.devices.theta.discovery import Discovery
from app.ui.shell.launch_options import LaunchOptions
from app.ui.shell.start import App
from app.ui.shell.window import DESIGNED
from app.ui.widgets.labels import Text
from benchmarks.ui.screenshots.command import Lost, Robot
from tests.helpers.waiting import PATIENCE_S

__all__ = ["NoDevices", "OneWebcam", "opened", "say", "sees", "told"]

SCENE = resources() / "demo" / "scenes" / "studio.exr"


class NoDevices:
    """A computer without cameras."""

    def discover(self, token: Token) -> Discovery:
        del token
        return Discovery()

    def webcams(self) -> Sequence[tuple[int, str]]:
        return ()


class OneWebcam(NoDevices):
    """A computer with a webcam."""

    def __init__(self, webcam: Any) -> None:
        self.one = webcam

    def webcams(self) -> Sequence[tuple[int, str]]:
        return ((0, self.one.name),)

    def webcam(self, index: int) -> Any:
        assert index == 0
        return self.one


@contextmanager
def opened(
    home: Path, devices: Any = None, clock: Clock | None = None, **settings: Any
) -> Iterator[tuple[App, Robot]]:
    """Start the app on a folder of the user's, and end it as the user would.

    Args:
        home: Everything is kept there.
        devices: None for a computer without any.
        clock: For waiting and polling.
        **settings: Written before the start; the tour is over unless it says otherwise.
    """
    application = QApplication.instance()
    assert isinstance(application, QApplication)
    if not (home / FILE).exists():
        write_settings(home / FILE, Settings(**{"tour_seen": True, **settings}))
    at_hand: Any = devices or NoDevices()
    app = App(application, LaunchOptions(), at_hand, clock or SystemClock(), home)
    app.show()
    robot = Robot(app.window)
    robot.settle()
    # The screen that is drawn in memory is smaller than any that people have.
    app.window.resize(DESIGNED)
    try:
        robot.wait(lambda: app.model.head is not None, "the head")
        robot.settle()
        yield app, robot
    finally:
        app.window.close()
        app.window.deleteLater()
        application.processEvents()


def open_light(app: App, robot: Robot, path: Path = SCENE) -> None:
    """Open a panorama and wait for its answers."""
    before = app.model.light
    app.place_controller.open_paths([path])
    robot.wait(lambda: app.model.light is not before and bool(app.model.results), "the answers")
    robot.wait(lambda: not app.runner.running("solve"), "solving")


def told(app: App) -> list[str]:
    """What was told so far."""
    return [message.text for message in app.notify.messages]


def say(app: App, robot: Robot, words: str, seconds: float = PATIENCE_S) -> str:
    """Wait until something with these words is told, and give all of it."""
    said = f"{words!r} among {told(app)}"
    robot.wait(lambda: any(words in text for text in told(app)), said, seconds)
    return next(text for text in told(app) if words in text)


def sees(robot: Robot, name: str) -> bool:
    """Whether something of this name is in sight."""
    try:
        robot.find(name)
    except Lost:
        return False
    return True


def says(robot: Robot, words: str) -> bool:
    """Whether a text in sight is, or an accessible name in sight begins with, these words."""
    seen = [text.text() for text in robot.window.findChildren(Text) if text.isVisible()]
    return words in seen or sees(robot, words)


def until(robot: Robot, call: Callable[[], object], what: str, seconds: float = PATIENCE_S) -> None:
    """Wait until a call gives something true; not finding anything is false."""

    def happened() -> bool:
        try:
            return bool(call())
        except Lost:
            return False

    robot.wait(happened, what, seconds)
