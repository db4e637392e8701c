"""Keep the processes that run tests small: free what a file of tests leaves behind.

After each file: caches of the program and of the tests are emptied, forgotten windows are
destroyed, and freed memory goes back to the system. The end of a run names the peak of each
process; with TURNLIGHT_MEMORY_GUARD set, one of more than `WORKER_BYTES` fails the quick tests.
"""

from __future__ import annotations

import atexit
import functools
import gc
import os
import sys
from typing import Any, Final

import psutil
import pytest
import shiboken6
from PySide6.QtCore import QCoreApplication, QEvent, QObject
from PySide6.QtGui import QPixmapCache
from PySide6.QtWidgets import QApplication

from app.ui.shell.jobs import give_back, keep_little
from tests.plugins.workers import WORKER_BYTES

_OURS: Final = ("app.", "tests.", "benchmarks.", "scripts.")
_MUCH: Final = 450_000_000  # a test may take the rest
_MORE: Final = 620_000_000  # from here on what the tests themselves keep is freed as well
_LITTLE: Final = 30_000_000  # not worth a collection
_STEP: Final = 60_000_000  # what a file may add before it is freed once more
_PROCESS: Final = psutil.Process()
_freeze: Final = gc.freeze
_frozen: Final[list[Any]] = []  # caches of the modules that were read before the first test
_least: Final[list[int]] = [0]  # bytes in use before the first test, then after each release
_limit: Final[list[int]] = [_MUCH]  # bytes that a file may use before it is freed in the middle
_HERE: Final = "this process"
_PEAKS: Final = pytest.StashKey["Peaks"]()
# Registered once for the life of a process: emptying them would register fonts again.
_FOR_LIFE: Final = frozenset({"load_fonts", "_application", "_library"})


class Peaks:
    """The most memory that each process held, and after which test."""

    def __init__(self) -> None:
        self.by_process: dict[str, tuple[int, str]] = {}

    def add(self, process: str, used: int, test: str) -> None:
        """Note the present use; only a new peak counts."""
        if used > self.by_process.get(process, (0, ""))[0]:
            self.by_process[process] = used, test

    def lines(self) -> list[str]:
        """Describe each process's peak."""
        return [
            f"{process}: at most {used / 1e6:,.0f} MB, in {test}"
            for process, (used, test) in sorted(self.by_process.items())
        ]

    def over(self, limit: int = WORKER_BYTES) -> bool:
        """Whether any process held more than the limit."""
        return any(used > limit for used, _ in self.by_process.values())


def peak_bytes() -> int:
    """Return the most memory this process has held so far; the present use on Windows."""
    if sys.platform == "win32":
        return used_bytes()
    import resource

    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else most * 1024


def used_bytes() -> int:
    """Return the memory this process holds now."""
    return int(_PROCESS.memory_info().rss)


def release() -> None:
    """Free what the tests so far have left in memory, if it is more than a little."""
    if used_bytes() < _least[0] + _LITTLE:
        return
    # Twice: what the first collection frees may own widgets, which hold more.
    for _ in range(2):
        close_windows()
        empty_caches()
        gc.collect()
    empty_destroyed()
    gc.collect()
    QPixmapCache.clear()
    give_back()
    _least[0] = used_bytes()


def release_some() -> None:
    """Free memory in the middle of a file: not its windows, and its heads only if need be."""
    gc.collect()
    give_back()
    for owner, much in (("app.", _MUCH), ("", _MORE)):
        if used_bytes() > much:
            empty_caches(owner)
            gc.collect()
            give_back()


def close_windows() -> None:
    """Destroy the windows that no test closed, and the widgets that wait for an event loop."""
    if isinstance(QApplication.instance(), QApplication):
        for widget in QApplication.topLevelWidgets():
            widget.close()
            widget.deleteLater()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def empty_destroyed() -> None:
    """Empty destroyed widgets: a connected signal may keep one alive, and all that it holds."""
    for one in gc.get_objects():
        if issubclass(type(one), QObject) and not shiboken6.isValid(one):
            vars(one).clear()


def empty_caches(owner: str = "") -> None:
    """Empty every `functools` cache of the program and its tests, or of one of them."""
    for one in caches():
        if one.__module__.startswith(owner):
            one.cache_clear()


def caches() -> list[Any]:
    """List those caches. The garbage collector does not list those that are frozen."""
    kind: Any = functools._lru_cache_wrapper
    return _frozen + [
        one
        for one in gc.get_objects()
        if type(one) is kind and is_ours(one) and one.__name__ not in _FOR_LIFE
    ]


def is_ours(cache: Any) -> bool:
    """Whether a cached function belongs to the program or its tests."""
    return str(getattr(cache, "__module__", "")).startswith(_OURS)


def pytest_configure(config: pytest.Config) -> None:
    """Hand large arrays back as the program itself does, but keep windows from freezing objects.

    The program freezes them at its start. Here that would keep the garbage of earlier tests.
    """
    keep_little()
    pytest.MonkeyPatch().setattr(gc, "freeze", lambda: None)
    config.stash[_PEAKS] = Peaks()


def pytest_collection_finish() -> None:
    """Free what importing the tests took; later collections skip the modules."""
    gc.collect()
    _frozen.extend(caches())
    _freeze()
    atexit.register(gc.unfreeze)  # else some libraries complain of what is left at the end
    give_back()
    _least[0] = used_bytes()


@pytest.hookimpl(wrapper=True, tryfirst=True)  # outermost: what is inside still holds the test
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> Any:
    """Watch the peak of each test, and free what its file held after the last one."""
    result = yield
    peaks = item.config.stash[_PEAKS]
    peaks.add(_HERE, peak_bytes(), item.nodeid)
    if nextitem is None or nextitem.path != item.path:
        release()
        _limit[0] = _MUCH
    elif used_bytes() > _limit[0]:
        release_some()
        # What is left is in use: freeing it after each test only has it made again.
        _limit[0] = max(_MUCH, used_bytes() + _STEP)
    return result


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """Send a worker's peak to the process that reports, which fails where one is too high."""
    config = session.config
    output, peaks = getattr(config, "workeroutput", None), config.stash[_PEAKS]
    if output is not None:
        output["peak"] = peaks.by_process.get(_HERE)
    elif is_limited(config) and peaks.over() and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def is_limited(config: pytest.Config) -> bool:
    """Whether the limit fails a run: of the quick tests, where TURNLIGHT_MEMORY_GUARD is set."""
    return bool(config.option.markexpr == "not slow" and os.environ.get("TURNLIGHT_MEMORY_GUARD"))


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Collect a worker's peak."""
    peak = getattr(node, "workeroutput", {}).get("peak")
    if peak:
        node.config.stash[_PEAKS].add(node.gateway.id, *peak)


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Show every process's peak, and which of them was over the limit."""
    peaks = config.stash[_PEAKS]
    for line in peaks.lines():
        terminalreporter.write_line(line)
    if config.option.markexpr == "not slow" and peaks.over():
        terminalreporter.write_line(
            f"A process held more than {WORKER_BYTES / 1e6:,.0f} MB.", red=True
        )
