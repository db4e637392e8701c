"""The job runner on a real event loop."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from typing import TYPE_CHECKING

import pytest

from app.core.base.errors import CoreError
from app.ui.shell.jobs import QtRunner
from tests.helpers.waiting import PATIENCE_S

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from pytestqt.qtbot import QtBot

    from app.core.base.progress import PhraseReport, Token


@pytest.fixture
def failures() -> list[Exception]:
    return []


@pytest.fixture
def runner(qtbot: QtBot, failures: list[Exception]) -> Iterator[QtRunner]:
    made = QtRunner(failures.append)
    yield made
    assert made.shutdown()


def until_stopped(token: Token, report: PhraseReport) -> None:
    while True:
        token.check()
        time.sleep(0.001)


def test_an_answer_comes_on_the_thread_of_the_screens(qtbot: QtBot, runner: QtRunner) -> None:
    threads = list[int]()

    def work(token: Token, report: PhraseReport) -> int:
        threads.append(threading.get_ident())
        return 7

    answers = list[tuple[int, int]]()
    runner.submit("a", work, done=lambda n: answers.append((n, threading.get_ident())))
    assert answers == []
    qtbot.waitUntil(lambda: bool(answers))
    assert answers == [(7, threading.get_ident())]
    assert threads[0] != threading.get_ident()


def test_a_newer_job_of_the_same_key_takes_the_place_of_the_older(
    qtbot: QtBot, runner: QtRunner
) -> None:
    ends = list[str]()
    started = threading.Event()

    def endless(token: Token, report: PhraseReport) -> None:
        started.set()
        until_stopped(token, report)

    runner.submit(
        "a", endless, done=lambda _: ends.append("old"), cancelled=lambda: ends.append("x")
    )
    started.wait(PATIENCE_S)
    runner.submit("a", lambda token, report: None, done=lambda _: ends.append("new"))
    qtbot.waitUntil(lambda: len(ends) == 2)
    assert sorted(ends) == ["new", "x"]
    assert not runner.running("a")


def test_an_answer_that_is_on_its_way_is_dropped_once_cancelled(
    qtbot: QtBot, runner: QtRunner
) -> None:
    finished, ends = threading.Event(), list[str]()

    def quick(token: Token, report: PhraseReport) -> None:
        finished.set()

    runner.submit(
        "a", quick, done=lambda _: ends.append("done"), cancelled=lambda: ends.append("x")
    )
    assert finished.wait(PATIENCE_S)
    runner.cancel("a")
    qtbot.waitUntil(lambda: bool(ends))
    assert ends == ["x"]


def test_a_failure_goes_to_whom_it_concerns(
    qtbot: QtBot, runner: QtRunner, failures: list[Exception]
) -> None:
    mine = list[Exception]()

    def failing(token: Token, report: PhraseReport) -> None:
        raise CoreError("No.")

    runner.submit("a", failing, failed=mine.append)
    runner.submit("b", failing)
    qtbot.waitUntil(lambda: bool(mine) and bool(failures))
    assert [str(error) for error in mine + failures] == ["No.", "No."]


def test_progress_is_shown_for_work_with_a_title_only(qtbot: QtBot, runner: QtRunner) -> None:
    lines = list[object]()
    runner.line_changed.connect(lines.append)
    go_on = threading.Event()

    def work(token: Token, report: PhraseReport) -> None:
        report(0.5, "half")
        go_on.wait(PATIENCE_S)

    runner.submit("quiet", lambda token, report: report(0.3, "unseen"))
    runner.submit("loud", work, title="Merging")
    qtbot.waitUntil(lambda: any(getattr(line, "message", "") == "half" for line in lines))
    go_on.set()
    qtbot.waitUntil(lambda: lines[-1] is None)
    assert {getattr(line, "key", "loud") for line in lines} == {"loud"}


def test_shutdown_ends_everything_and_tells_nobody(qtbot: QtBot) -> None:
    told = list[object]()
    runner = QtRunner(told.append)
    for key in "abcdef":
        runner.submit(key, until_stopped, done=told.append, cancelled=lambda: told.append("x"))
    assert runner.shutdown(5000)
    qtbot.wait(50)
    runner.submit("late", lambda token, report: told.append("late"))
    qtbot.wait(50)
    assert told == []


def test_many_jobs_leave_nothing_behind(qtbot: QtBot, runner: QtRunner) -> None:
    """Some hundred jobs in a row: what once crashed when job objects were deleted by Qt."""
    answers = list[int]()

    def work(number: int) -> Callable[[Token, PhraseReport], int]:
        return lambda token, report: number

    for number in range(300):
        runner.submit(f"k{number % 7}-{number}", work(number), done=answers.append)
    qtbot.waitUntil(lambda: len(answers) == 300)
    assert sorted(answers) == list(range(300))


# As `app.desktop.start` ends; the runner stands in a circle of references, as it does in the app.
ENDING = """
import sys, time
from PySide6.QtCore import QCoreApplication
from app.ui.shell.jobs import QtRunner, leave_if_stuck
application = QCoreApplication([])

def main():
    runner = QtRunner(print)
    runner.itself = runner
    runner.submit("solve", lambda token, report: time.sleep({work}))
    time.sleep(0.1)
    print(runner.shutdown({patience}), flush=True)

main()
leave_if_stuck(5)
time.sleep({after})
sys.exit(6)
"""


@pytest.mark.parametrize(
    ("work", "patience", "after", "said", "code"),
    [
        # A read that never returns does not hold the program.
        (3600.0, 200, 0.0, "False", 5),
        # Work that ends with the program has nobody to tell, and says nothing.
        (0.5, 1, 0.6, "False", 5),
        (0.0, 5000, 0.0, "True", 6),
    ],
)
def test_the_program_ends_whatever_is_still_at_work(
    work: float, patience: int, after: float, said: str, code: int
) -> None:
    ending = ENDING.format(work=work, patience=patience, after=after)
    done = subprocess.run(
        [sys.executable, "-c", ending], capture_output=True, text=True, timeout=600, check=False
    )
    assert (done.returncode, done.stdout.strip(), done.stderr) == (code, said, "")


def test_an_answer_after_the_end_of_the_runner_is_dropped() -> None:
    """Qt's objects are destroyed before the interpreter ends, and work may outlast them."""
    ending = ENDING.replace("leave_if_stuck(5)\n", "").format(work=0.5, patience=1, after=0)
    done = subprocess.run(
        [sys.executable, "-c", ending], capture_output=True, text=True, timeout=600, check=False
    )
    assert (done.returncode, done.stderr) == (6, "")
