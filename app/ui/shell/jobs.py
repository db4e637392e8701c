"""The job runner, which runs jobs on a thread pool and delivers the results to the UI thread.

Long tasks use a lot of memory. This module returns that memory to the system.
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

_MMAP_THRESHOLD, _ARENA_MAX = -3, -8  # constants from malloc.h
_LARGE = 1 << 20  # bytes


def keep_little() -> None:
    """Make the allocator return large arrays to the system as soon as they are freed.

    The GNU C library would otherwise keep freed memory for reuse, separately for every thread. On
    other systems, this function does nothing.
    """
    library = _library()
    if library is not None:
        library.mallopt(_MMAP_THRESHOLD, _LARGE)
        library.mallopt(_ARENA_MAX, 2)


def give_back() -> None:
    """Return freed memory to the system.

    The GNU C library keeps the memory that a thread has freed for use by that thread. With several
    threads working on large pictures, this adds up to several times the memory in use. On other
    systems, this function does nothing.
    """
    library = _library()
    if library is not None:
        library.malloc_trim(ctypes.c_size_t(0))


@contextlib.contextmanager
def reading_in() -> Iterator[None]:
    """Exclude the modules imported in this context from garbage collection.

    The modules live until the app ends. A full collection would otherwise visit every function in
    every library, which would block the UI for about 50 ms.

    Yields:
        None, while garbage collection is off. Objects that exist when the context ends are never
        scanned.
    """
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        # Unfreeze at exit, because some libraries complain about leftover objects.
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

_THREADS: Final = 6  # some jobs only wait for a folder, a camera or a delay
_HEAVY_S: Final = 0.2  # longer work leaves freed memory behind
_log = logging.getLogger(__name__)
_stuck: Final[list[QtRunner]] = []
"""Runners whose jobs ignored cancellation, kept alive because destroying them would block."""


@dataclass(frozen=True, slots=True)
class JobLine:
    """The progress of a visible job, where `fraction` runs from 0 to 1."""

    key: str
    title: str
    fraction: float = 0.0
    message: str = ""


@dataclass(slots=True, eq=False)
class _Job:
    """A job. Its identity distinguishes its result from the result of an older job."""

    key: str
    work: Callable[[Token, PhraseReport], Any]
    title: str = ""
    done: Callable[[Any], None] | None = None
    failed: Callable[[Exception], None] | None = None
    cancelled: Callable[[], None] | None = None
    token: Token = field(default_factory=Token)


class _Bridge(QObject):
    """Carries the results of all jobs from any thread to the UI thread.

    This object is never deleted.
    """

    progressed = Signal(object, float, str)
    finished = Signal(object, object, object)


def _report(bridge: _Bridge, job: _Job, fraction: float, step: Progress | str) -> None:
    bridge.progressed.emit(job, fraction, progress_words(step))


def _work(job: _Job, bridge: _Bridge) -> None:
    """Run a job on the pool, and report the outcome, whatever it is, with a single signal."""
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
    # A job that outlives the program has no receiver.
    with contextlib.suppress(RuntimeError):
        bridge.finished.emit(job, answer, error)


class QtRunner(QObject):
    """Runs jobs, each of which has a key. A new job replaces an older one with the same key."""

    line_changed = Signal(object)
    """Emitted with the visible `JobLine`, or with None when no visible job is running."""
    ended = Signal(str, str)
    """Emitted when a visible job ends, with its title and its outcome.

    The outcome is ``done``, ``failed`` or ``cancelled``.
    """

    def __init__(self, on_failure: Callable[[Exception], None]) -> None:
        super().__init__()
        self._on_failure = on_failure
        self._pool = QThreadPool()
        self._pool.setMaxThreadCount(_THREADS)
        self._bridge = _Bridge()
        # Queued even on one thread, so that no result arrives inside the call that requested it.
        queued = Qt.ConnectionType.QueuedConnection
        self._bridge.progressed.connect(self._progressed, queued)
        self._bridge.finished.connect(self._finished, queued)
        self._jobs: dict[str, _Job] = {}
        self._lines: dict[str, JobLine] = {}
        self._closed = False

    def submit(
        self, key: str, work: Callable[[Token, PhraseReport], T], **how: Unpack[Handlers[T]]
    ) -> None:
        """Start a job (see `app.ui.presenters.services.Runner.submit`)."""
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
        """Cancel the job with this key. Its ``cancelled`` is called once the job has stopped."""
        job = self._jobs.get(key)
        if job is not None:
            job.token.cancel()

    def running(self, key: str) -> bool:
        """Return whether a job with this key is still running."""
        return key in self._jobs

    def shutdown(self, milliseconds: int = 5000) -> bool:
        """Cancel all jobs, drop their results, and return whether the threads ended in time."""
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
        """Whether any jobs are still running."""
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
        # A job cancelled just as it ended counts as cancelled, because its result is unwanted.
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
    """End the process if any jobs are still running after their runner has been shut down.

    A read from a missing drive may never return, and Python would wait for it. By this time,
    everything worth saving has been written.

    Args:
        code: Exit code of the process.
    """
    if any(runner.at_work for runner in _stuck):
        logging.shutdown()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
