"""Starts the window as the language of the computer has it, and reports what worked.

Run as a program of its own: ``python locale_walk.py REPORT.json [--demo]``. With ``--demo`` it
takes a bracket with the simulated camera and waits for the answers; the place is saved.
"""

from __future__ import annotations

import json
import locale
import sys
import traceback
from pathlib import Path
from typing import Any

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QAbstractButton, QApplication

from app.cli import main
from benchmarks.ui.screenshots.command import Lost, Robot

PATIENCE_S = 200.0


class Walk:
    """Waits for the window, uses it, and closes it."""

    def __init__(self, application: QApplication, demo: bool) -> None:
        self.application = application
        self.demo = demo
        self.facts: dict[str, Any] = {"error": "the window was never seen"}
        QTimer.singleShot(0, self.look_for_window)

    def look_for_window(self) -> None:
        windows = [w for w in self.application.topLevelWidgets() if w.objectName() == "window"]
        if not windows or not windows[0].isVisible():
            QTimer.singleShot(5, self.look_for_window)
            return
        try:
            self.walk(Robot(windows[0]))
        except Exception:  # noqa: BLE001 - reported to the parent
            self.facts["error"] = traceback.format_exc()
        finally:
            windows[0].close()

    def walk(self, robot: Robot) -> None:
        robot.settle()
        if self.demo:
            robot.wait(lambda: sees(robot, "Camera: THETA V"), "the demo camera", PATIENCE_S)
            robot.click("Capture")
            robot.wait(lambda: sees(robot, "See the styles"), "the light", PATIENCE_S)
            robot.click("See the styles")
            robot.wait(lambda: sees(robot, "Turn to this"), "the answers", PATIENCE_S)
        self.facts["error"] = ""
        self.facts["language"] = locale.setlocale(locale.LC_CTYPE)
        self.facts["number"] = locale.str(0.5)


def sees(robot: Robot, name: str) -> bool:
    try:
        return robot.find(name, QAbstractButton).isEnabled()
    except Lost:
        return False


def run(report: Path, demo: bool) -> int:
    application = QApplication(["turnlight"])
    walk = Walk(application, demo)
    walk.facts["code"] = main(["--demo"] if demo else [])
    report.write_text(json.dumps(walk.facts, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(run(Path(sys.argv[1]), "--demo" in sys.argv))
