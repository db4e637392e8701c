"""Show how far a long run is: "  52 %  4,410 of 8,560  about 3 min left".

One line that is rewritten on a terminal, a line every half minute elsewhere. Short runs keep
pytest's own dots.
"""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING, Any, Final

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterable

LONG_RUN: Final = 300  # tests; below, pytest's dots are enough
_CACHE: Final = "turnlight/seconds"  # what each file took last time
_TERMINAL_S, _LOG_S, _CI_S = 0.5, 30.0, 120.0


class Progress:
    """How many tests are done, and the time that the others will take.

    Args:
        tests: Their ids.
        seconds: What each file took in an earlier run; empty if there was none.
    """

    def __init__(self, tests: Iterable[str], seconds: dict[str, float]) -> None:
        counts: dict[str, int] = {}
        for test in tests:
            counts[file_of(test)] = counts.get(file_of(test), 0) + 1
        self.total, self.done = sum(counts.values()), 0
        known = [(seconds[file], count) for file, count in counts.items() if file in seconds]
        # A file that is new weighs as much for each test as the others.
        usual = sum(each for each, _ in known) / max(sum(count for _, count in known), 1)
        self._weights = {
            file: seconds.get(file, usual * count) / count if known else 1.0
            for file, count in counts.items()
        }
        self._all = sum(self._weights[file] * count for file, count in counts.items())
        self._finished = 0.0

    def finish(self, test: str) -> None:
        """Count a test that has ended."""
        self.done += 1
        self._finished += self._weights.get(file_of(test), 0.0)

    def line(self, elapsed_s: float) -> str:
        """Describe where the run is.

        Args:
            elapsed_s: Since the first test began.
        """
        share = self._finished / self._all if self._all else 1.0
        words = f"{100 * self.done // max(self.total, 1):4d} %  {self.done:,} of {self.total:,}"
        if not 0.02 <= share < 1.0:
            return words
        return f"{words}  about {duration(elapsed_s * (1.0 - share) / share)} left"


def file_of(test: str) -> str:
    """Return the file of a test's id."""
    return test.partition("::")[0]


def duration(seconds: float) -> str:
    """Round a time to what a person wants to know.

    Examples:
        >>> duration(170), duration(41)
        ('3 min', '50 s')
    """
    return f"{round(seconds / 60)} min" if seconds >= 90 else f"{10 * int(1 + seconds // 10)} s"


class ProgressLine:
    """Writes the line in place of pytest's dots; failures are named at once.

    Args:
        config: Of the process that reports.
    """

    def __init__(self, config: pytest.Config) -> None:
        self._cache: Any = getattr(config, "cache", None)  # none with -p no:cacheprovider
        self._reporter: Any = config.pluginmanager.get_plugin("terminalreporter")
        self._seconds: dict[str, float] = {}
        self._progress: Progress | None = None
        self._began = self._shown = 0.0
        self._is_terminal = bool(self._reporter and self._reporter.isatty)
        self._every_s = _TERMINAL_S if self._is_terminal else _LOG_S
        if os.environ.get("CI") and not self._is_terminal:
            self._every_s = _CI_S

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Begin, where one process does all."""
        if session.items:
            self._begin([item.nodeid for item in session.items])

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_node_collection_finished(self, node: Any, ids: list[str]) -> None:
        """Begin, where several share the tests: each has all of them."""
        del node
        if self._progress is None:
            self._begin(ids)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Add up what each file takes."""
        file = file_of(report.nodeid)
        self._seconds[file] = self._seconds.get(file, 0.0) + report.duration

    def pytest_runtest_logfinish(self, nodeid: str) -> None:
        """Count a test, and show the line if it is time."""
        if self._progress is not None:
            self._progress.finish(nodeid)
            self._show()

    @pytest.hookimpl(tryfirst=True)
    def pytest_report_teststatus(self, report: object) -> tuple[str, str, str] | None:
        """Print no dots; a failure is named when it happens."""
        if self._progress is None or not isinstance(report, pytest.TestReport):
            return None
        if report.passed:
            return ("passed" if report.when == "call" else "", "", "")
        if report.failed and report.when == "call":
            self._write(f"FAILED {report.nodeid}")
            return "failed", "", "FAILED"
        if report.failed:
            self._write(f"ERROR {report.nodeid}")
            return "error", "", "ERROR"
        return None if hasattr(report, "wasxfail") else ("skipped", "", "SKIPPED")

    def pytest_sessionfinish(self) -> None:
        """Leave the line, and keep the times for the next run's estimate."""
        if self._progress is None:
            return
        self._write(self._progress.line(time.monotonic() - self._began))
        if self._progress.done == self._progress.total and self._cache is not None:
            self._cache.set(_CACHE, {**self._cache.get(_CACHE, {}), **self._seconds})

    def _begin(self, tests: list[str]) -> None:
        if len(tests) < LONG_RUN:
            return
        known = {} if self._cache is None else self._cache.get(_CACHE, {})
        self._progress = Progress(tests, known)
        self._began = self._shown = time.monotonic()

    def _show(self) -> None:
        assert self._progress is not None
        now = time.monotonic()
        if now - self._shown < self._every_s:
            return
        self._shown = now
        line = self._progress.line(now - self._began)
        if self._is_terminal:
            self._reporter.rewrite(line, erase=True)
        else:
            self._write(line)

    def _write(self, line: str) -> None:
        self._reporter.ensure_newline()
        self._reporter.write_line(line)
        self._reporter.flush()


@pytest.hookimpl(trylast=True)
def pytest_configure(config: pytest.Config) -> None:
    """Take the place of the dots, where this process reports and nobody asked for names."""
    if not hasattr(config, "workerinput") and config.option.verbose <= 0:
        config.pluginmanager.register(ProgressLine(config), "progress-line")
