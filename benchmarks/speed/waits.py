"""Measure what a photographer waits for, from the press of a button to what can be acted on.

    QT_QPA_PLATFORM=offscreen python -m benchmarks.speed.waits [--page benchmarks/speed.md]

Opens the whole window without a screen, and runs commands as processes of their own. Each wait is
given in seconds, in CPU seconds of all threads, and as a multiple of a fixed piece of work: one
product of the head's full matrix with the light at 64 turns (`solve.match.product`, plain), so that
a slow machine is not a slow program. Writes ``results/waits.json``.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from PySide6.QtGui import QImage

from app.core.base.atomic_files import atomic_write_text
from app.core.base.paths import resources
from app.core.localization.views import Lens, look
from app.core.styles.style_pack_file import load_named_pack, load_transport_of
from app.devices.webcam import SimulatedWebcam
from app.ui.presenters.window_model import Step
from app.ui.screens.light.screen import LightPresenter
from app.ui.screens.turn.screen_view import TurnScreen
from app.ui.shell.start import App
from benchmarks.speed.timing.search import search_cases
from benchmarks.ui.screenshots.command import Robot
from tests.helpers.demo_place import demo_panorama
from tests.helpers.watchdog import WatchedApplication
from tests.helpers.whole_window import OneWebcam, open_light, opened, until

RESULT: Final = Path(__file__).resolve().parents[1] / "results" / "waits.json"
MARKS: Final = ("<!-- waits -->", "<!-- end of waits -->")
_LOCATION: Final = resources() / "demo" / "location"
_PANORAMA: Final = _LOCATION / "probe-1.exr"
_LUX: Final = "300"
_PATIENCE_S: Final = 90.0
_ROUNDS: Final = 3


@dataclass(slots=True)
class Wait:
    """A wait.

    Attributes:
        seconds, cpu_s: Wall time, and CPU time of all threads.
        longest_event_s: Longest event of the window's thread, or 0 if none took 50 ms.
    """

    name: str
    what: str
    seconds: float = 0.0
    cpu_s: float = 0.0
    longest_event_s: float = field(default=0.0)


class Waits:
    """Measures the waits in one window after another."""

    def __init__(self) -> None:
        self._application = WatchedApplication(["waits"])
        self.found: list[Wait] = []

    @contextmanager
    def _measured(self, name: str, what: str) -> Iterator[None]:
        wait, before = Wait(name, what), len(self._application.slow)
        begun, used = time.perf_counter(), time.process_time()
        yield
        wait.seconds = time.perf_counter() - begun
        wait.cpu_s = time.process_time() - used
        slow = [event.cpu_s for event in self._application.slow[before:]]
        wait.longest_event_s = max(slow, default=0.0)
        self.found.append(wait)

    def styles_and_lamp(self, home: Path) -> None:
        """Open a panorama until Turn can be pressed, then take a lamp."""
        with opened(home, sounds=False) as (app, robot):
            # The tour of the program has read in the screens by then.
            robot.wait(lambda: not app.runner.running("steps-ready"), "the screens", _PATIENCE_S)
            begun = time.perf_counter()
            open_light(app, robot, _PANORAMA)
            app.model.update(step=Step.STYLES, chosen="right-below-side")
            with self._measured("wait.styles", "from the answers until *Turn to this*"):
                _until_enabled(robot, "Turn to this")
            with self._measured("wait.gallery", "from then until all pictures are drawn"):
                robot.wait(lambda: not _busy(app, "styles-pictures"), "the pictures", _PATIENCE_S)
            whole = Wait("wait.open", "from a panorama's file until then")
            whole.seconds = time.perf_counter() - begun
            self.found.append(whole)
            app.model.update(step=Step.LIGHT)
            robot.wait(lambda: not _busy(app, "light-"), "the head", _PATIENCE_S)
            light = app.window.front_presenter
            assert isinstance(light, LightPresenter)
            light.scale.type(_LUX)
            for kind in ("panel", "softbox"):
                with self._measured(f"wait.lamp.{kind}", "from the lamp until *Turn first*"):
                    light.take_lamp(kind)
                    robot.wait(lambda: not light.work.busy, "the lamp", _PATIENCE_S)
                    _until_enabled(robot, "Turn first")
                with self._measured(f"wait.lamp.{kind}.pictures", "from then until its pictures"):
                    robot.wait(lambda: not light.work.looking, "the pictures", _PATIENCE_S)

    def live(self, home: Path, name: str, *, fresh: bool, looks: bool = False) -> None:
        """Go to Turn, until it shows a live heading.

        Args:
            fresh: Whether the place is new. Otherwise, the program is started on it again.
            looks: Whether to look at the gallery until the background is learnt.
        """
        webcam = SimulatedWebcam(_LOCATION / "views")
        with opened(home, OneWebcam(webcam), camera_looks="sitter", sounds=False) as (app, robot):
            if fresh:
                open_light(app, robot, _PANORAMA)
                robot.wait(lambda: app.model.place_folder is not None, "the place", 120)
            else:
                robot.wait(lambda: bool(app.model.results), "the last place", 120)
            app.model.update(step=Step.STYLES, chosen="right-below-side")
            robot.settle()
            _until_enabled(robot, "Turn to this")
            light = app.model.light
            assert light is not None
            if looks:
                learnt = app.services.backgrounds.at_hand
                robot.wait(lambda: learnt(light) is not None, "the background", _PATIENCE_S)
            with self._measured(f"wait.live.{name}", "from *Turn to this* until a live heading"):
                with self._measured(f"wait.number.{name}", "from *Turn to this* until the number"):
                    robot.click("Turn to this")
                    robot.wait(lambda: _turn(app) is not None, "the screen", _PATIENCE_S)
                    screen = _turn(app)
                    assert screen is not None
                    column = screen.column
                    robot.wait(lambda: column._degrees._number is not None, "the number", 60)
                    screen.grab()
                presenter = screen.presenter
                robot.wait(lambda: presenter.resolve().scale.now_deg is not None, "live", 60)
            robot.wait(lambda: not app.runner.running("turn-index-keep"), "keeping", 60)

    def command(self, name: str, what: str, *words: str) -> None:
        """Run a command, the best of several times."""
        best = Wait(name, what, float("inf"))
        for _ in range(_ROUNDS):
            before, begun = _used_by_children(), time.perf_counter()
            subprocess.run([sys.executable, "-m", "app", *words], check=True, capture_output=True)
            seconds = time.perf_counter() - begun
            if seconds < best.seconds:
                best.seconds, best.cpu_s = seconds, _used_by_children() - before
        self.found.append(best)


def _busy(app: App, keys: str) -> bool:
    """Return whether any job is running whose key begins like this."""
    return any(key.startswith(keys) for key in app.runner._jobs)


def _until_enabled(robot: Robot, name: str) -> None:
    until(robot, lambda: robot.find(name).isEnabled(), name, _PATIENCE_S)


def _turn(app: App) -> TurnScreen | None:
    return app.window.findChild(TurnScreen)


def _used_by_children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def piece_of_work_s() -> float:
    """Return how long one plain product of the full matrix with 64 turns takes, in seconds."""
    pack = load_named_pack("generic")
    cases = search_cases(load_transport_of(pack, "generic"), pack)
    case = next(one for one in cases if one.name == "solve.match.product")
    return min(_timed(case.plain) for _ in range(30))


def _timed(call: Callable[[], Any]) -> float:
    begun = time.perf_counter()
    call()
    return time.perf_counter() - begun


def table_of(waits: list[Wait], work_s: float) -> str:
    """Return the table of benchmarks/speed.md."""
    lines = ["| wait | s | CPU s | pieces of work | |", "|---|---|---|---|---|"]
    for wait in waits:
        cpu = f"{wait.cpu_s:.2f}" if wait.cpu_s else ""
        pieces = f"{wait.seconds / work_s:,.0f}"
        lines.append(f"| `{wait.name}` | {wait.seconds:.2f} | {cpu} | {pieces} | {wait.what} |")
    longest = max(wait.longest_event_s for wait in waits)
    words = "none took 50 ms" if longest == 0.0 else f"{1e3 * longest:.0f} ms"
    return "\n".join(
        (
            *lines,
            "",
            f"One piece of work: {1e3 * work_s:.1f} ms. Longest event of the window's thread: "
            f"{words}. {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}.",
        )
    )


def main() -> None:
    """Measure, print and save."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--page", type=Path, help="benchmarks/speed.md, to replace its table")
    args = parser.parse_args()
    waits, work_s = Waits(), piece_of_work_s()
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        waits.styles_and_lamp(home / "styles")
        waits.live(home / "turn", "first", fresh=True)
        waits.live(home / "turn", "restarted", fresh=False)
        waits.live(home / "look", "after-gallery", fresh=True, looks=True)
        photo, sheet = str(home / "photo.png"), str(home / "sheet.png")
        picture = np.ascontiguousarray(look(demo_panorama(), 40.0, Lens(64.0, (6000, 4000))))
        QImage(
            picture.data, 6000, 4000, 3 * 6000, QImage.Format.Format_RGB888
        ).save(photo)  # fmt: skip
        scene = str(resources() / "demo" / "scenes" / "courtyard.exr")
        waits.command("wait.solve", "`solve --json`", "solve", scene, "--json")
        waits.command("wait.sheet", "`solve --sheet`", "solve", scene, "--sheet", sheet)
        waits.command(
            "wait.locate", "`locate`, 24 megapixels", "locate", str(_PANORAMA), photo,
            "--fov", "64",
        )  # fmt: skip
    table = table_of(waits.found, work_s)
    print(table)
    found = {"piece_of_work_s": work_s, "waits": [asdict(wait) for wait in waits.found]}
    atomic_write_text(RESULT, json.dumps(found, indent=2) + "\n")
    if args.page:
        before, rest = args.page.read_text(encoding="utf-8").split(MARKS[0])
        after = rest.split(MARKS[1])[1]
        atomic_write_text(args.page, f"{before}{MARKS[0]}\n{table}\n{MARKS[1]}{after}")


if __name__ == "__main__":
    main()
