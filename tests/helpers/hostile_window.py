"""Every door of the window with hostile files, in a process of its own with a watchdog.

The process reports what it begins and what it ended with, line by line, so that a signal or a
hang is put down to one file at one door; the rest is then begun again.
"""

from __future__ import annotations

import json
import logging
import os
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

__all__ = ["DOORS", "Visit", "run_doors"]

DOORS: Final = (
    *("drop on Probe", "drop on Styles", "drop on Turn", "drop on Light"),
    *("measured by Probe", "like this photo", "photo of Turn", "video of Turn"),
    *("lamp of Light", "style into Styles", "style into Paint", "head", "library of styles"),
)

_ROOT: Final = Path(__file__).resolve().parents[2]
_PATIENCE_S: Final = 6.0
"""Wall time after which work is cancelled; much of it is honest."""

_HANG_S: Final = 200.0
_BATCH: Final = 60


@dataclass(frozen=True, slots=True)
class Visit:
    """A file at a door, and what was wrong."""

    file: str
    door: str
    faults: tuple[str, ...]


def run_doors(
    visits: Sequence[tuple[Path, str]], place: Path, seconds: float
) -> tuple[list[Visit], int, float]:
    """Take files through doors, a batch in a process.

    Returns:
        What was visited, the most memory of a process, bytes, and the longest visit, s.
    """
    done: list[Visit] = []
    most, longest, left, number = 0, 0.0, list(visits), 0
    end = time.monotonic() + seconds
    while left and time.monotonic() < end:
        batch, number = left[:_BATCH], number + 1
        found, rss, slowest = _batch(batch, place / f"batch{number}")
        done += found
        most, longest = max(most, rss), max(longest, slowest)
        left = left[max(len(found), 1) :]
    return done, most, longest


def _batch(batch: list[tuple[Path, str]], place: Path) -> tuple[list[Visit], int, float]:
    place.mkdir(parents=True)
    orders, report = place / "orders.json", place / "report"
    orders.write_text(json.dumps([[os.fspath(path), door] for path, door in batch]))
    report.touch()
    code = (
        f"import sys; sys.path.insert(0, {str(_ROOT)!r}); "
        "from tests.helpers.hostile_window import serve; serve(*sys.argv[1:])"
    )
    environment = {
        **os.environ,
        "QT_QPA_PLATFORM": "offscreen",
        "TURNLIGHT_HOME": str(place / "home"),
        "OPENBLAS_NUM_THREADS": "1",
        "OPENCV_LOG_LEVEL": "SILENT",
    }
    with (place / "err").open("wb") as err:
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", code, str(orders), str(report)],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=err,
        )
        hung = _watched(process, report)
    lines = [json.loads(line) for line in report.read_text().splitlines()]
    ended = [line for line in lines if "faults" in line]
    visits = [Visit(line["file"], line["door"], tuple(line["faults"])) for line in ended]
    begun = [line for line in lines if "faults" not in line and "file" in line]
    whole = any("rss" in line for line in lines)
    if not whole and process.returncode != 0:
        fault = "hang" if hung else f"ended with {process.returncode}"
        last = begun[-1] if len(begun) > len(ended) else {"file": "", "door": "the end"}
        words = (place / "err").read_text(errors="replace")[-400:]
        visits.append(Visit(last["file"], last["door"], (fault, words)))
    rss = max((line.get("rss", 0) for line in lines), default=0)
    return visits, rss, max((line.get("seconds", 0.0) for line in lines), default=0.0)


def _watched(process: subprocess.Popen[bytes], report: Path) -> bool:
    """Wait for the process; one that reports nothing for long is killed."""
    size, since = 0, time.monotonic()
    while process.poll() is None:
        time.sleep(0.1)
        if report.stat().st_size != size:
            size, since = report.stat().st_size, time.monotonic()
        if time.monotonic() - since > _HANG_S:
            process.send_signal(signal.SIGABRT)
            process.wait()
            return True
    return False


# -- in the process of the window ----------------------------------------------------------------


class _Errors(logging.Handler):
    """Errors that the program did not expect."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.found: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        kind, error, trace = record.exc_info or (None, None, None)
        words = "".join(traceback.format_exception(kind, error, trace))[-900:] if error else ""
        self.found.append(f"{record.getMessage()} {words}")


def serve(orders: str, report: str) -> None:
    from PySide6.QtWidgets import QApplication

    from app.core.base.native import plain_numbers
    from app.ui.shell.start import caught_errors
    from tests.helpers.whole_window import open_light, opened

    QApplication(["turnlight"])
    plain_numbers()
    errors = _Errors()
    logging.getLogger().addHandler(errors)
    home = Path(os.environ["TURNLIGHT_HOME"])
    home.mkdir()
    visits = [(Path(name), door) for name, door in json.loads(Path(orders).read_text())]
    with Path(report).open("a", buffering=1) as stream:

        def say(**facts: Any) -> None:
            stream.write(json.dumps(facts) + "\n")

        with opened(home) as (app, robot), caught_errors(app.notify.tell_error):
            open_light(app, robot)
            for path, door in visits:
                say(file=os.fspath(path), door=door)
                begun, before = time.monotonic(), _state(path)
                errors.found.clear()
                try:
                    if not _visit(app, robot, path, door):
                        errors.found.append("work that does not end")
                except Exception:  # noqa: BLE001 - reported
                    errors.found.append(traceback.format_exc()[-900:])
                faults = list(errors.found)
                if _state(path) != before:
                    faults.append("an input was changed")
                seconds = round(time.monotonic() - begun, 2)
                say(file=os.fspath(path), door=door, faults=faults, seconds=seconds)
        say(rss=_most_memory())


def _state(path: Path) -> object:
    about = path.lstat()
    return about.st_ino, about.st_size, about.st_mtime_ns


def _most_memory() -> int:
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmHWM"):
            return int(line.split()[1]) * 1024
    return 0


def _visit(app: Any, robot: Any, path: Path, door: str) -> bool:
    """Take a file through a door; whether all work that it began has ended."""
    from app.ui.presenters.window_model import Step

    steps = {"Styles": Step.STYLES, "Turn": Step.TURN, "Light": Step.LIGHT, "photo": Step.STYLES}
    app.model.update(step=steps.get(door.split()[-1], Step.PROBE))
    if door == "style into Paint":
        # There may be no answers: the visit before broke off what it began.
        app.model.update(step=Step.STYLES, painting=app.model.head.pack.styles[0].name)
    robot.settle()
    presenter = app.window.front_presenter
    _WAYS[door](app, presenter, path)
    end = time.monotonic() + _PATIENCE_S
    while app.runner.at_work and time.monotonic() < end:
        robot.wait(lambda: True, "a moment")
        time.sleep(0.005)
    for key in tuple(app.runner._jobs):
        app.runner.cancel(key)
    # What was begun last is not broken off everywhere at once.
    end = time.monotonic() + 20 * _PATIENCE_S
    while app.runner.at_work and time.monotonic() < end:
        robot.settle()
        time.sleep(0.01)
    ended = not app.runner.at_work
    robot.settle()
    app.window.grab()
    if door == "style into Paint":
        app.model.update(painting=None)
    app.commands.close_overlay()
    robot.settle()
    return ended


def _drop(app: Any, _presenter: Any, path: Path) -> None:
    from PySide6.QtCore import QMimeData, QUrl

    from app.core.base.native import url_of
    from app.ui.shell.window_frame import dropped_paths

    data = QMimeData()
    data.setUrls([QUrl.fromEncoded(url_of(path))])
    paths = dropped_paths(data)
    assert paths == [path], (paths, path)
    app.window.paths_dropped.emit(paths)


def _library(app: Any, _presenter: Any, path: Path) -> None:
    folder = app.services.folders.styles
    folder.mkdir(parents=True, exist_ok=True)
    for former in folder.iterdir():
        former.unlink()
    (folder / "mine.toml").write_bytes(path.read_bytes())
    app.place_controller.refresh_user_styles()


_WAYS: Final[dict[str, Callable[[Any, Any, Path], object]]] = {
    **dict.fromkeys(DOORS[:4], _drop),
    "measured by Probe": lambda app, presenter, path: presenter.open_files([path]),
    "like this photo": lambda app, presenter, path: presenter.like.take([path]),
    "photo of Turn": lambda app, presenter, path: presenter.shots.take([path]),
    "video of Turn": lambda app, presenter, path: presenter.sources.choose_video(path),
    "lamp of Light": lambda app, presenter, path: presenter.lamps.take([path]),
    "style into Styles": lambda app, presenter, path: presenter.files.import_style(path),
    "style into Paint": lambda app, presenter, path: presenter.files.import_style(path),
    "head": lambda app, presenter, path: app.place_controller.heads.choose(path),
    "library of styles": _library,
}
