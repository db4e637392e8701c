"""Answers while frames are still on their way.

`ArrivingFrames` reads each frame while the next is coming: when the last file is there only its own
decoding and the merge are left to do. The result equals `measure.bracket.pipeline.measure` of the
same files, bit for bit.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as StillWorking
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

from app.core.base.errors import Cancelled, ProbeError
from app.core.base.progress import Report, Token, silent
from app.core.measure.bracket.pipeline import Probe, measure, rehearse
from app.core.measure.finish.finish import MergeOptions
from app.core.measure.read.decoding import OpenedFrame, open_frame
from app.core.measure.read.frame import Frame
from app.core.measure.read.metadata import read_header
from app.core.measure.read.pixels import MEMORY_BYTES, workers
from app.core.styles.style_pack import StylePack

_LOOK_S: Final = 0.05  # a cancelled wait ends within this
# What a rehearsal warms belongs to the process, so once is enough.
_REHEARSED: Final = threading.Event()


@dataclass(frozen=True, slots=True)
class _Read:
    """A frame that was read, and what its file was like then."""

    opened: OpenedFrame
    frame: Frame
    hold: bool
    stamp: tuple[int, ...]


class ArrivingFrames:
    """Reads frames in worker threads as they come.

    Use it as a context manager, or call `close`. `expected` is how many frames will come, 0
    where not known: they are held in memory when so many of them fit.

    >>> with ArrivingFrames(3) as frames:
    ...     pass  # frames.add(path) for each file, then frames.measure(paths, pack)
    """

    def __init__(self, expected: int = 0, memory_bytes: int = MEMORY_BYTES) -> None:
        self._expected = expected
        self._memory_bytes = memory_bytes
        self._held = 0
        self._token = Token()
        self._pool = ThreadPoolExecutor(workers(max(expected, 2)))
        self._reading: dict[Path, Future[_Read]] = {}
        self._lock = threading.Lock()

    def expect(self, count: int) -> None:
        """Say how many frames will come, before the first is added."""
        self._expected = count

    def prepare(self, pack: StylePack) -> None:
        """Rehearse the merge in a worker, once in a process: call it while there is time."""
        with self._lock:
            if not self._token.cancelled and not _REHEARSED.is_set():
                _REHEARSED.set()
                self._pool.submit(rehearse, pack)

    def add(self, path: Path) -> None:
        """Start to read a file that is complete; a file that was added before is read again."""
        self.discard(path)
        with self._lock:
            if not self._token.cancelled:
                self._reading[path] = self._pool.submit(self._read, path)

    def discard(self, path: Path) -> None:
        """Forget a file, and close what was opened of it."""
        with self._lock:
            future = self._reading.pop(path, None)
        if future is not None and not future.cancel():
            future.add_done_callback(self._let_go)

    def problem(self, path: Path, token: Token | None = None) -> str:
        """Say in one sentence what is wrong with a file, once it has been read; "" if nothing."""
        try:
            self._of(path, token)
        except ProbeError as error:
            return error.message
        return ""

    def _of(self, path: Path, token: Token | None) -> _Read | None:
        """Wait for a file that was added; None for another one."""
        with self._lock:
            future = self._reading.get(path)
        return None if future is None else _wait(future, token or Token())

    def measure(
        self,
        paths: Sequence[Path],
        pack: StylePack,
        options: MergeOptions | None = None,
        *,
        token: Token | None = None,
        report: Report = silent,
    ) -> Probe:
        """Make an environment of the frames; see `app.core.measure.bracket.pipeline.measure`.

        Files that were not added, or have changed since, are read now. Every frame is handed over
        once: measuring a second time reads the files again.
        """
        return measure(paths, pack, options, opener=self.take, token=token, report=report)

    def take(self, frame: Frame, *, hold: bool, token: Token, half: bool = False) -> OpenedFrame:
        """Hand over a frame, or read it now: an `app.core.measure.read.decoding.Opener`."""
        with self._lock:
            future = self._reading.pop(frame.path, None)
        if future is None:
            return open_frame(frame, hold=hold, token=token, half=half)
        try:
            read = _wait(future, token)
        except (Cancelled, CancelledError):
            future.add_done_callback(self._let_go)
            token.check()
            return open_frame(frame, hold=hold, token=token, half=half)  # it was closed meanwhile
        with self._lock:
            self._held -= _bytes(read)
        fits = read.hold == hold and (read.frame.shape, read.frame.kind) == (
            frame.shape,
            frame.kind,
        )
        # Which frames come at half their size is known only when all are there.
        if fits and not half and read.stamp == _stamp(frame.path):
            return read.opened
        read.opened.source.close()
        return open_frame(frame, hold=hold, token=token, half=half)

    def close(self) -> None:
        """Stop reading and close everything that was not taken; more than once is fine."""
        self._token.cancel()
        with self._lock:
            left = list(self._reading.values())
            self._reading.clear()
        for future in left:
            if not future.cancel():
                future.add_done_callback(self._let_go)
        self._pool.shutdown(wait=True, cancel_futures=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *failure: object) -> None:
        self.close()

    def _read(self, path: Path) -> _Read:
        """Read one file; runs in a worker."""
        stamp = _stamp(path)
        frame = read_header(path).frame
        size = frame.decoded_bytes
        with self._lock:
            hold = self._held + size <= self._memory_bytes
            hold = hold and size * self._expected <= self._memory_bytes
            self._held += size if hold else 0
        try:
            opened = open_frame(frame, hold=hold, token=self._token)
        except BaseException:
            with self._lock:
                self._held -= size if hold else 0
            raise
        return _Read(opened, frame, hold, stamp)

    def _let_go(self, future: Future[_Read]) -> None:
        """Close what a worker has opened and is no longer wanted."""
        if future.cancelled() or future.exception() is not None:
            return
        read = future.result()
        read.opened.source.close()
        with self._lock:
            self._held -= _bytes(read)


def _bytes(read: _Read) -> int:
    """Bytes that a frame takes in memory."""
    return read.frame.decoded_bytes if read.hold else 0


def _wait(future: Future[_Read], token: Token) -> _Read:
    while True:
        token.check()
        try:
            return future.result(timeout=_LOOK_S)
        except StillWorking:
            continue


def _stamp(path: Path) -> tuple[int, ...]:
    """Return what changes when a file changes."""
    try:
        facts = path.stat()
    except OSError:
        return ()
    return facts.st_size, facts.st_mtime_ns, facts.st_ino
