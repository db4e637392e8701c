"""Walks through the app as a new user would, through the real main(), and says what it saw.

Run as a program of its own: ``python app_walk.py REPORT.json STARTED``. STARTED is the parent's
monotonic clock when it started this process.
"""

from __future__ import annotations

import json
import sys
import time
import traceback
from pathlib import Path
from typing import Any

from PySide6.QtCore import QPoint, QSize, Qt, QTimer
from PySide6.QtWidgets import QAbstractButton, QWidget

from app.cli import main
from app.ui.screens.light.screen_view import LightScreen
from benchmarks.ui.screenshots.command import Lost, Robot
from tests.helpers.watchdog import WatchedApplication

FULL = QSize(1440, 900)
PATIENCE_S = 600.0


class Walk:
    """The walk; every number that it finds goes into `facts`."""

    def __init__(self, application: WatchedApplication, started_s: float) -> None:
        self.application = application
        self.started_s = started_s
        self.facts: dict[str, Any] = {}
        self.clicks = 0
        self.robot: Robot | None = None
        QTimer.singleShot(0, self.look_for_window)

    def look_for_window(self) -> None:
        found = [w for w in self.application.topLevelWidgets() if w.objectName() == "window"]
        if not found or not found[0].isVisible():
            QTimer.singleShot(5, self.look_for_window)
            return
        self.robot = Robot(found[0])
        self.application.walk_from_here()
        try:
            self.walk(self.robot)
        except Exception:  # noqa: BLE001 - told to the parent
            self.facts["error"] = traceback.format_exc()
            self.robot.picture(Path(sys.argv[1]).with_suffix(".png"))
        finally:
            left = [type(w).__name__ for w in self.application.topLevelWidgets() if w.isVisible()]
            self.facts["windows"] = left
            found[0].close()

    # -- the story -----------------------------------------------------------------------------

    def walk(self, robot: Robot) -> None:
        # Events count from the first paint on; this is it.
        self.mark("first: window")
        robot.settle()
        self.facts["usable_s"] = time.monotonic() - self.started_s
        robot.window.resize(FULL)
        robot.settle()
        self.mark("resting")
        self.to_guidance(robot)
        self.turning(robot)
        self.around_the_circle(robot)
        self.painting(robot)
        self.holding_a_lamp(robot)
        self.looks(robot)
        self.places(robot)

    def to_guidance(self, robot: Robot) -> None:
        begun = time.monotonic()
        robot.wait(lambda: self.sees("Camera: THETA V"), "the demo camera", PATIENCE_S)
        self.click("Capture", "capture")
        robot.wait(lambda: self.sees("See the styles", enabled=True), "the light", PATIENCE_S)
        self.click("See the styles", "first: styles")
        robot.wait(lambda: self.sees("Turn to this", enabled=True), "the answers", PATIENCE_S)
        self.click("Turn to this", "first: turn")
        # The whole turn stands at once; what is to go follows when the background is learnt.
        robot.wait(lambda: "clockwise" in self.guidance(), "guidance")
        self.facts["clicks"] = self.clicks
        self.facts["to_guidance_s"] = time.monotonic() - begun
        self.facts["guidance"] = self.guidance()

    def turning(self, robot: Robot) -> None:
        """With the arrow keys alone to the light."""
        self.mark("turning")
        robot.wait(lambda: "° to go" in self.guidance(), "a heading", PATIENCE_S)
        self.facts["live"] = self.guidance()
        clockwise = "counter-clockwise" not in self.guidance()
        key = Qt.Key.Key_Right if clockwise else Qt.Key.Key_Left
        for _ in range(40):
            if "You are in the light" in self.guidance() or "Hold it" in self.guidance():
                break
            robot.press(key, Qt.KeyboardModifier.ShiftModifier)
            self.linger(0.6)
        self.facts["arrived"] = self.guidance()

    def around_the_circle(self, robot: Robot) -> None:
        self.mark("circle")
        robot.press(Qt.Key.Key_2, Qt.KeyboardModifier.ControlModifier)
        robot.wait(lambda: self.sees("Turn to this"), "the gallery")
        robot.click("Why?")
        plot = robot.find("Match by turn")
        centre, radius = plot.rect().center(), plot.height() * 0.35
        begun, frames = time.perf_counter(), 0
        from math import cos, radians, sin

        path = [
            centre + QPoint(round(radius * sin(radians(a))), -round(radius * cos(radians(a))))
            for a in range(0, 360, 4)
        ]
        robot.drag(plot, path)
        frames = len(path)
        self.facts["circle_fps"] = frames / (time.perf_counter() - begun)
        robot.press(Qt.Key.Key_Home)

    def painting(self, robot: Robot) -> None:
        self.click("Paint", "first: paint")
        canvas = None
        robot.wait(lambda: self.sees("Canvas"), "the canvas")
        canvas = robot.find("Canvas")
        self.linger(1.0)
        self.mark("paint")
        middle = canvas.rect().center()
        begun = time.perf_counter()
        path = [middle + QPoint(-80 + 2 * step, step) for step in range(60)]
        robot.drag(canvas, path)
        self.facts["paint_fps"] = len(path) / (time.perf_counter() - begun)
        self.linger(0.5)
        robot.press(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
        robot.press(Qt.Key.Key_Escape)
        robot.wait(lambda: self.sees("Turn to this"), "the gallery again")

    def holding_a_lamp(self, robot: Robot) -> None:
        self.mark("first: light")
        robot.press(Qt.Key.Key_4, Qt.KeyboardModifier.ControlModifier)
        self.mark("light")
        self.linger(0.3)
        robot.click("Use the phone")
        robot.wait(lambda: self.sees("Turn first", enabled=True), "where it belongs", PATIENCE_S)
        self.linger(0.5)
        self.mark("holding a lamp")
        plot = robot.find("Where the lamp works")
        begun = time.thread_time()
        wide, high = plot.width(), plot.height()
        path = [QPoint(wide * step // 80, high // 3 + step % 7) for step in range(10, 70)]
        robot.drag(plot, path)
        self.facts["lamp_ms"] = 1e3 * (time.thread_time() - begun) / len(path)
        self.linger(0.5)
        self.mark("lamp settings")
        for button in ("Turn the lamp down", "Turn the lamp up", "Within arm"):
            robot.click(button)
        self.linger(1.0)
        self.mark("first: question")
        robot.click("Correct the brightness of the place")
        self.mark("question")
        robot.click("Cellar, 30 lx")
        self.linger(1.0)
        self.facts["memory_mb"] = most_memory_mb()
        self.mark("first: capture of a lamp")
        robot.click("Capture your own lamp")
        robot.press(Qt.Key.Key_Escape)
        self.mark("capture of a lamp")
        robot.click("Capture your own lamp")
        robot.write("Sun")
        robot.click("Use the place")
        self.mark("a lamp of one's own")
        robot.wait(lambda: self.sees("More about this lamp"), "the lamp", PATIENCE_S)
        self.linger(1.0)
        self.mark("first: mask")
        presenter = robot.find("Light", LightScreen).presenter
        presenter.lamp_actions.ask_mask()
        robot.wait(lambda: self.sees("Where the lamp is"), "the mask", PATIENCE_S)
        robot.settle()
        self.mark("painting a mask")
        canvas = robot.find("Where the lamp is")
        middle = canvas.rect().center()
        begun = time.thread_time()
        path = [middle + QPoint(-60 + 2 * step, step) for step in range(60)]
        robot.drag(canvas, path)
        self.facts["mask_ms"] = 1e3 * (time.thread_time() - begun) / len(path)
        self.linger(0.3)
        robot.press(Qt.Key.Key_Escape)
        robot.press(Qt.Key.Key_2, Qt.KeyboardModifier.ControlModifier)
        self.linger(0.3)

    def looks(self, robot: Robot) -> None:
        for theme in ("light", "high contrast", "dark"):
            self.mark("first: overlay")
            robot.press(Qt.Key.Key_K, Qt.KeyboardModifier.ControlModifier)
            self.mark("typing")
            robot.write(theme)
            self.mark("first: theme")
            robot.press(Qt.Key.Key_Return)
            self.linger(0.4)
        for key in (Qt.Key.Key_1, Qt.Key.Key_2, Qt.Key.Key_3, Qt.Key.Key_4):
            self.mark("first: again in another theme")
            robot.press(key, Qt.KeyboardModifier.ControlModifier)
            self.mark("resting")
            self.linger(0.3)
        self.mark("first: narrow")
        robot.window.resize(QSize(1024, 700))
        self.linger(0.4)

    def places(self, robot: Robot) -> None:
        self.click("Places", "first: places")
        self.linger(0.5)
        self.facts["places"] = len(
            [
                b
                for b in robot.window.findChildren(QAbstractButton)
                if b.isVisible() and b.accessibleName().startswith("Open ")
            ]
        )
        robot.press(Qt.Key.Key_Escape)

    # -- hands and eyes ------------------------------------------------------------------------

    def mark(self, words: str) -> None:
        self.application.mark = words

    def click(self, name: str, mark: str) -> None:
        assert self.robot is not None
        self.clicks += 1
        self.mark(mark)
        self.robot.click(name)

    def sees(self, name: str, enabled: bool = False) -> bool:
        assert self.robot is not None
        try:
            widget: QWidget = self.robot.find(name, QAbstractButton if enabled else QWidget)
        except Lost:
            return False
        return widget.isVisible() and (widget.isEnabled() or not enabled)

    def guidance(self) -> str:
        assert self.robot is not None
        try:
            return self.robot.find("What to do").accessibleDescription()
        except Lost:
            return ""

    def linger(self, seconds: float) -> None:
        assert self.robot is not None
        end = time.monotonic() + seconds
        self.robot.wait(lambda: time.monotonic() >= end, "some time", seconds + 5)


def most_memory_mb() -> float:
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmHWM"):
            return int(line.split()[1]) / 1024
    raise AssertionError("no VmHWM")


def run(report: Path, started_s: float) -> int:
    application = WatchedApplication(["turnlight"])
    walk = Walk(application, started_s)
    code = main(["--demo"])
    application.stop_watching()
    walk.facts["code"] = code
    walk.facts["memory_with_capture_mb"] = most_memory_mb()
    walk.facts["slow"] = [
        {"kind": one.kind, "ms": round(1e3 * one.cpu_s, 1), "mark": one.mark, "stack": one.stack}
        for one in application.slow
    ]
    report.write_text(json.dumps(walk.facts, indent=1), encoding="utf-8")
    return code


if __name__ == "__main__":
    sys.exit(run(Path(sys.argv[1]), float(sys.argv[2])))
