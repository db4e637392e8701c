"""Pipes among the user's things: a reader would wait for their writer for ever."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="POSIX only")

ROOT = Path(__file__).resolve().parents[2]

# In a process of its own: what waits for a pipe cannot be ended from within.
CODE = """
import sys
from pathlib import Path
from PySide6.QtWidgets import QApplication
from app.devices.clock import SystemClock
from app.ui.presenters.window_model import Step
from benchmarks.ui.screenshots.command import Robot
from app.ui.shell.start import App
from app.ui.shell.launch_options import LaunchOptions
from tests.helpers.whole_window import NoDevices

application = QApplication([])
home = Path(sys.argv[1])
app = App(application, LaunchOptions(), NoDevices(), SystemClock(), home)
app.show()
robot = Robot(app.window)
idle = lambda: not app.runner._jobs
robot.wait(lambda: app.model.head is not None, "the head")
app.place_controller.open_place(home / "places" / "one")
for step in Step:
    app.model.update(step=step)
    robot.settle()
    robot.wait(idle, "rest")
app.commands.ask("places")
robot.wait(idle, "rest")
app.window.close()
print("closed", app.runner.shutdown())
"""

NAMES = (
    "settings.json",
    "window.bin",
    "styles/mine.toml",
    "styles/mine-1889704b9e64.exr",
    "lamps/l.json",
    "lamps/l-9aa13de04f04.exr",
    "lamps/l.png",
    "drafts/paint-left-rembrandt.npz",
    "places/one/place.json",
    "places/one/thumbnail.png",
    "places/two/capture-1/session.json",
    "places/two/capture-1/originals/R0010001.JPG",
)


@pytest.mark.slow
def test_a_home_full_of_pipes_opens_and_closes(tmp_path: Path) -> None:
    for name in NAMES:
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        os.mkfifo(file)
    done = subprocess.run(
        [sys.executable, "-c", CODE, str(tmp_path)],
        env={**os.environ, "TURNLIGHT_HOME": str(tmp_path), "PYTHONPATH": str(ROOT)},
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "closed True\n"
