"""The job runner: long work on a pool of threads, its answer on the thread of the screens.

Long work takes much memory, which is handed back to the system here.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import gc
import logging
import os
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any, Final, TypeVar, Unpack

from PySide6.QtCore import QObject, Qt, QThreadPool, Signal, Slot

from app.core.base.errors import Cancelled
from app.core.base.progress import Handlers, PhraseReport, Progress, Token
from app.words.progress import progress_words

_MMAP_THRESHOLD, _ARENA_MAX = -3, -8  # numbers of malloc.h
_LARGE = 1 << 20  # bytes


def keep_little() -> None:
    """Make the allocator return large arrays to the system when they are freed.

    GNU's C library would keep more and more of them for the next one, and for each thread apart.
    Elsewhere nothing is done.
    """
    library = _library()
    if library is not None:
        library.mallopt(_MMAP_THRESHOLD, _LARGE)
        library.mallopt(_ARENA_MAX, 2)


def give_back() -> None:
    """Return freed memory to the system.

    GNU's C library keeps what a thread has freed for that thread; with several threads at work on
    large pictures that is several times what is in use. Elsewhere nothing is done.
    """
    library = _library()
    if library is not None:
        library.malloc_trim(ctypes.c_size_t(0))


@contextlib.contextmanager
def reading_in() -> Iterator[None]:
    """Read modules in: they stay to the end, so they are left out of garbage collection.

    Else a full collection goes through every function of every library, and whatever is being
    done on the screens waits for it, for some 50 ms.

    Yields:
        None. While no garbage is collected; what there is in the end is never looked at again.
    """
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        # At the end all of it goes: some libraries complain of what is left.
        atexit.register(gc.unfreeze)
        if was:
            gc.enable()


@cache
def _library() -> ctypes.CDLL | None:
    if not sys.platform.startswith("linux"):
        return None
    library = ctypes.CDLL(None)
    ours = hasattr(library, "malloc_trim") and hasattr(library, "mallopt")
    return library if ours else None


T = TypeVar("T")

_THREADS: Final = 6  # some of them wait: for a folder, a camera, a moment to pass
_HEAVY_S: Final = 0.2  # work that takes longer leaves memory behind
_log = logging.getLogger(__name__)
_stuck: Final[list[QtRunner]] = []
"""Those whose work did not end when it was asked to; to destroy one would wait for its threads."""


@dataclass(frozen=True, slots=True)
class JobLine:
    """How far a visible job is: `fraction` is 0 to 1."""

    key: str
    title: str
    fraction: float = 0.0
    message: str = ""


@dataclass(slots=True, eq=False)
class _Job:
    """A job; its identity tells its result from that of an older one."""

    key: str
    work: Callable[[Token, PhraseReport], Any]
    title: str = ""
    done: Callable[[Any], None] | None = None
    failed: Callable[[Exception], None] | None = None
    cancelled: Callable[[], None] | None = None
    token: Token = field(default_factory=Token)


class _Bridge(QObject):
    """Carries answers from any thread to the one it lives in; one for all jobs, never deleted."""

    progressed = Signal(object, float, str)
    finished = Signal(object, object, object)


def _report(bridge: _Bridge, job: _Job, fraction: float, step: Progress | str) -> None:
    bridge.progressed.emit(job, fraction, progress_words(step))


def _work(job: _Job, bridge: _Bridge) -> None:
    """Do the work of a job on the pool; every way it can end becomes one signal."""
    answer: Any = None
    error: BaseException | None = None
    began = time.thread_time()
    try:
        job.token.check()
        answer = job.work(job.token, partial(_report, bridge, job))
    except Exception as problem:  # noqa: BLE001 - carried over to the screens
        error = problem
    if time.thread_time() - began > _HEAVY_S:
        give_back()
    # Work that outlives the program has no one to answer.
    with contextlib.suppress(RuntimeError):
        bridge.finished.emit(job, answer, error)


class QtRunner(QObject):
    """Runs jobs by purpose: a newer job replaces an older one of the same key."""

    line_changed = Signal(object)
    """The visible job as `JobLine`, or None when none runs."""
    ended = Signal(str, str)
    """Title of a visible job and how it ended: ``done``, ``failed`` or ``cancelled``."""

    def __init__(self, on_failure: Callable[[Exception], None]) -> None:
        super().__init__()
        self._on_failure = on_failure
        self._pool = QThreadPool()
        self._pool.setMaxThreadCount(_THREADS)
        self._bridge = _Bridge()
        # Queued even on one thread: an answer never arrives inside the call that asked for it.
        queued = Qt.ConnectionType.QueuedConnection
        self._bridge.progressed.connect(self._progressed, queued)
        self._bridge.finished.connect(self._finished, queued)
        self._jobs: dict[str, _Job] = {}
        self._lines: dict[str, JobLine] = {}
        self._closed = False

    def submit(
        self, key: str, work: Callable[[Token, PhraseReport], T], **how: Unpack[Handlers[T]]
    ) -> None:
        """Start work; see `app.ui.presenters.services.Runner.submit`."""
        if self._closed:
            return
        self.cancel(key)
        job = _Job(key, work, **how)
        self._jobs[key] = job
        if job.title:
            self._lines[key] = JobLine(key, job.title)
            self._show_line()
        self._pool.start(partial(_work, job, self._bridge))

    def cancel(self, key: str) -> None:
        """Cancel the job of this key; its ``cancelled`` is called once it has stopped."""
        job = self._jobs.get(key)
        if job is not None:
            job.token.cancel()

    def running(self, key: str) -> bool:
        """Whether work of this key has not yet answered."""
        return key in self._jobs

    def shutdown(self, milliseconds: int = 5000) -> bool:
        """Cancel everything and wait for the threads; no more results are reported."""
        self._closed = True
        for job in self._jobs.values():
            job.token.cancel()
        self._pool.clear()
        ended = self._pool.waitForDone(milliseconds)
        if not ended:
            _log.info("still at work: %s", ", ".join(self._jobs))
            _stuck.append(self)
        return ended

    @property
    def at_work(self) -> bool:
        """Whether any work has not ended."""
        return not self._pool.waitForDone(0)

    @Slot(object, float, str)
    def _progressed(self, job: _Job, fraction: float, message: str) -> None:
        if self._jobs.get(job.key) is job and job.title and not job.token.cancelled:
            self._lines[job.key] = JobLine(job.key, job.title, fraction, message)
            self._show_line()

    @Slot(object, object, object)
    def _finished(self, job: _Job, answer: Any, error: Exception | None) -> None:
        if self._jobs.get(job.key) is job:
            del self._jobs[job.key]
            if self._lines.pop(job.key, None) is not None:
                self._show_line()
        if self._closed:
            return
        # Cancelled in the very moment of its end: the caller no longer wants the answer.
        if job.token.cancelled or isinstance(error, Cancelled):
            self._say_end(job, "cancelled")
            if job.cancelled is not None:
                job.cancelled()
        elif error is not None:
            _log.info("job %s failed", job.key, exc_info=error)
            self._say_end(job, "failed")
            (job.failed or self._on_failure)(error)
        else:
            self._say_end(job, "done")
            if job.done is not None:
                job.done(answer)

    def _say_end(self, job: _Job, how: str) -> None:
        if job.title:
            self.ended.emit(job.title, how)

    def _show_line(self) -> None:
        lines = list(self._lines.values())
        self.line_changed.emit(lines[-1] if lines else None)


def leave_if_stuck(code: int) -> None:
    """End the process where work continues although its runner was shut down.

    A read from a drive that is gone may never return, and Python would wait for it. Everything
    worth keeping has been written by then.

    `code`: Exit code of the process.
    """
    if any(runner.at_work for runner in _stuck):
        logging.shutdown()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
