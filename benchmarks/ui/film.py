"""Make the film at the top of the README: from the first start to the light, in half a minute.

python -m benchmarks.ui.film        takes about a minute

The program is really used, by the same robot as in ``--screenshots``; only waiting is left out.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

ROOT: Final = Path(__file__).resolve().parents[2]
FILE: Final = ROOT / "docs" / "images" / "app" / "film.webp"
LARGEST: Final = 3_000_000  # bytes
SIZE: Final = (1120, 700)
WINDOW: Final = (1280, 800)
QUALITIES: Final = (80, 70, 60, 50, 40)
STEPS: Final = 8  # frames of a movement of the pointer
WALK: Final = 40  # frames of the walk around the sitter

Picture = NDArray[np.uint8]
POINTER: Final = np.array(
    [(0, 0), (0, 17), (4, 13), (7, 20), (10, 19), (7, 12), (12, 12)], np.int32
)


class Reel:
    """Frames with their durations, ms, and a pointer drawn on them."""

    def __init__(self) -> None:
        self.frames: list[Picture] = []
        self.ms: list[int] = []
        self.at = (SIZE[0] * 0.5, SIZE[1] * 0.9)

    def add(self, picture: Picture, ms: int, pressed: bool = False) -> None:
        """Add a frame of the window."""
        frame = cv2.resize(picture, SIZE, interpolation=cv2.INTER_AREA)
        x, y = (round(side) for side in self.at)
        if pressed:
            cv2.circle(frame, (x, y), 14, (75, 188, 242), 3, cv2.LINE_AA)
        shape = POINTER + np.array([x, y], np.int32)
        cv2.fillPoly(frame, [shape], (255, 255, 255), cv2.LINE_AA)
        cv2.polylines(frame, [shape], True, (0, 0, 0), 1, cv2.LINE_AA)
        if self.frames and np.array_equal(frame, self.frames[-1]):
            self.ms[-1] += ms
            return
        self.frames.append(np.asarray(frame, np.uint8))
        self.ms.append(ms)

    def point(self, picture: Picture, to: tuple[float, float]) -> None:
        """Move the pointer there and press."""
        start = self.at
        for step in range(1, STEPS + 1):
            share = 0.5 - 0.5 * np.cos(np.pi * step / STEPS)
            self.at = tuple(a + share * (b - a) for a, b in zip(start, to, strict=True))
            self.add(picture, 40)
        self.add(picture, 250, pressed=True)

    def write(self, file: Path) -> None:
        """Write it as animated WebP, in the best quality that is small enough."""
        film = cv2.Animation()
        film.frames, film.durations = self.frames, self.ms
        for quality in QUALITIES:
            cv2.imwriteanimation(str(file), film, [cv2.IMWRITE_WEBP_QUALITY, quality])
            if file.stat().st_size <= LARGEST:
                break
        seconds = sum(self.ms) / 1000
        size = file.stat().st_size / 1e6
        print(f"{file.name}: {len(self.frames)} frames, {seconds:.0f} s, {size:.1f} MB, {quality}")


def act(app: Any) -> Reel:
    """Use the program like a first-time user."""
    from app.core.text import tr
    from app.ui.presenters.window_model import Step
    from benchmarks.ui.screenshots.command import Robot

    robot, model, reel = Robot(app.window), app.model, Reel()
    # Once the window is on its screen, which is smaller than usual ones.
    robot.settle()
    app.window.resize(*WINDOW)

    def seen() -> Picture:
        robot.settle()
        image = app.window.grab().toImage().convertToFormat(_rgb())
        rows = np.frombuffer(image.constBits(), np.uint8)
        rows = rows.reshape(image.height(), image.bytesPerLine())[:, : 3 * image.width()]
        return np.ascontiguousarray(rows.reshape(image.height(), image.width(), 3)[..., ::-1])

    def hold(seconds: float) -> None:
        reel.add(seen(), round(1000 * seconds))

    def click(name: str) -> None:
        button = robot.find(name)
        middle = button.mapTo(app.window, button.rect().center())
        scale = SIZE[0] / app.window.width()
        reel.point(seen(), (middle.x() * scale, middle.y() * scale))
        robot.click(name)

    def wait(happened: Callable[[], object], what: str) -> None:
        robot.wait(lambda: bool(happened()), what, 60.0)

    wait(lambda: model.head is not None, "the head")
    wait(lambda: model.camera is not None, "the camera")
    app.window._notify.dismiss()
    hold(1.5)
    click(tr("Try it in 10 seconds"))
    wait(lambda: model.results, "the answers")
    wait(lambda: not app.runner.running("styles-pictures"), "the pictures")
    app.window._notify.dismiss()
    hold(2.5)
    click(tr("See the styles"))
    wait(lambda: model.step == Step.STYLES, "the gallery")
    pause(robot, app, 15.0)  # until the faces are at full size
    hold(3.0)
    click(tr("Turn to this"))
    wait(lambda: model.step == Step.TURN, "the turn")
    reel.at = (-50.0, -50.0)  # from here on, the sitter moves
    presenter, goal = app.window.front_presenter, model.target_turn_deg
    assert goal is not None
    presenter.demo_turn(0.0)
    wait(lambda: presenter.resolve().guidance.number is not None, "the heading")
    pause(robot, app, 3.0)
    hold(2.0)
    for step in range(1, WALK + 1):
        presenter.demo_turn(goal * step / WALK)
        pause(robot, app, 0.35)
        hold(0.12)
    pause(robot, app, 2.0)
    hold(3.5)
    return reel


def pause(robot: Any, app: Any, seconds: float) -> None:
    """Let the program work for a while, outside the film."""
    clock = app.services.clock
    end = clock.now() + seconds
    robot.wait(lambda: clock.now() >= end, "some time", seconds + 5.0)


def _rgb() -> Any:
    from PySide6.QtGui import QImage

    return QImage.Format.Format_RGB888


def main() -> None:
    """Make the film again."""
    os.environ["QT_QPA_PLATFORM"] = "offscreen"
    with tempfile.TemporaryDirectory() as home:
        os.environ["TURNLIGHT_HOME"] = home
        from PySide6.QtCore import QTimer

        from app.core.base.paths import resources
        from app.core.storage.settings import Settings
        from app.core.storage.settings_file import FILE as SETTINGS
        from app.core.storage.settings_file import write_settings
        from app.devices.clock import SystemClock
        from app.devices.device_sets import DemoDevices
        from app.ui.shell.launch_options import LaunchOptions
        from app.ui.shell.start import App, run

        write_settings(Path(home) / SETTINGS, Settings(tour_seen=True, sounds=False, theme="dark"))
        clock = SystemClock()
        devices = DemoDevices(clock, resources() / "demo" / "cafe")
        reels: list[Reel] = []

        def use(app: App) -> int:
            def begin() -> None:
                try:
                    reels.append(act(app))
                finally:
                    app.window.close()

            app.show()
            QTimer.singleShot(0, begin)
            return int(app.application.exec())

        try:
            run(LaunchOptions(demo=True), devices, clock, use)
        finally:
            devices.close()
        reels[0].write(FILE)


if __name__ == "__main__":
    main()
