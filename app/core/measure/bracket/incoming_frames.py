"""Read frames while others are still downloading.

`ArrivingFrames` reads each frame while the next one is downloading. Once the last file has arrived,
only decoding it and merging the frames remain to be done. The result is identical, bit for bit, to
that of `measure.bracket.measure.measure` for the same files.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as StillWorking
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

import numpy as np

from app.core.base.colour import srgb_encode
from app.core.base.errors import Cancelled, ProbeError
from app.core.base.progress import Report, Token, silent
from app.core.measure.bracket.align_and_merge import merge_bracket
from app.core.measure.bracket.measure import finished, measure
from app.core.measure.finish.display import display_panorama
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions
from app.core.measure.read.decoding import MemoryRows
from app.core.measure.read.frame import Bracket, Exposure, Frame
from app.core.measure.read.metadata import read_header
from app.core.measure.read.opened_frame import (
    OpenedFrame,
    open_frame,
    proxy_shape,
    sample_codes,
    sample_places,
    shrunk,
)
from app.core.measure.read.pixels import MEMORY_BYTES, workers
from app.core.styles.style_pack import StylePack

_LOOK_S: Final = 0.05  # seconds within which a cancelled wait ends
_REHEARSAL: Final = (128, 256)
# A rehearsal warms up the whole process, so once is enough.
_REHEARSED: Final = threading.Event()


@dataclass(frozen=True, slots=True)
class _ReadFrame:
    """A frame that has been read, and the state of its file at that time."""

    opened: OpenedFrame
    frame: Frame
    hold: bool
    stamp: tuple[int, ...]


class ArrivingFrames:
    """Reads frames on worker threads as they arrive.

    Use an instance as a context manager, or call `close`.

    Args:
        count: Number of frames to expect, or 0 if unknown. Frames are kept in memory if that many
            of them fit.

    >>> with ArrivingFrames(3) as frames:
    ...     pass  # frames.add(path) for each file, then frames.measure(paths)
    """

    def __init__(self, count: int = 0, memory_bytes: int = MEMORY_BYTES) -> None:
        self._count = count
        self._memory_bytes = memory_bytes
        self._cache_bytes = 0
        self._token = Token()
        self._pool = ThreadPoolExecutor(workers(max(count, 2)))
        self._reading: dict[Path, Future[_ReadFrame]] = {}
        self._lock = threading.Lock()

    def expect(self, count: int) -> None:
        """Set the number of frames to expect, before the first one is added."""
        self._count = count

    def prepare(self, pack: StylePack) -> None:
        """Rehearse the merge on a worker thread, once per process, while there is time."""
        with self._lock:
            if not self._token.cancelled and not _REHEARSED.is_set():
                _REHEARSED.set()
                self._pool.submit(rehearse, pack)

    def add(self, path: Path) -> None:
        """Start reading a complete file, or reread it if it was added before."""
        self.discard(path)
        with self._lock:
            if not self._token.cancelled:
                self._reading[path] = self._pool.submit(self._read, path)

    def discard(self, path: Path) -> None:
        """Drop a file and close its frame."""
        with self._lock:
            future = self._reading.pop(path, None)
        if future is not None and not future.cancel():
            future.add_done_callback(self._let_go)

    def problem(self, path: Path, token: Token | None = None) -> str:
        """Wait until a file has been read, and return its problem in a sentence, or "" if none."""
        try:
            self._of(path, token)
        except ProbeError as error:
            return error.message
        return ""

    def _of(self, path: Path, token: Token | None) -> _ReadFrame | None:
        """Wait for a file that was added, or return None for any other file."""
        with self._lock:
            future = self._reading.get(path)
        return None if future is None else _wait(future, token or Token())

    def measure(
        self,
        paths: Sequence[Path],
        options: MeasureOptions | None = None,
        token: Token | None = None,
        report: Report = silent,
    ) -> Measurement:
        """Measure the light from the frames, as `app.core.measure.bracket.measure` does.

        Files that were not added, or that have changed since, are read now. Each frame can be used
        only once, so a second measurement reads the files again.
        """
        return measure(paths, options, token, report, opener=self.take)

    def take(self, frame: Frame, *, hold: bool, token: Token, half: bool = False) -> OpenedFrame:
        """Return a frame, reading it now if necessary.

        This method is an `app.core.measure.read.opened_frame.Opener`.
        """
        with self._lock:
            future = self._reading.pop(frame.path, None)
        if future is None:
            return open_frame(frame, hold=hold, token=token, half=half)
        try:
            read = _wait(future, token)
        except (Cancelled, CancelledError):
            future.add_done_callback(self._let_go)
            token.check()
            # The frame was closed in the meantime.
            return open_frame(frame, hold=hold, token=token, half=half)
        with self._lock:
            self._cache_bytes -= _bytes(read)
        fits = read.hold == hold and (read.frame.shape, read.frame.kind) == (
            frame.shape,
            frame.kind,
        )
        # Which frames to decode at half size is known only once all have arrived.
        if fits and not half and read.stamp == _stamp(frame.path):
            return read.opened
        read.opened.source.close()
        return open_frame(frame, hold=hold, token=token, half=half)

    def close(self) -> None:
        """Stop reading and close all unused frames. This method may be called more than once."""
        self._token.cancel()
        with self._lock:
            pending = list(self._reading.values())
            self._reading.clear()
        for future in pending:
            if not future.cancel():
                future.add_done_callback(self._let_go)
        self._pool.shutdown(wait=True, cancel_futures=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *failure: object) -> None:
        self.close()

    def _read(self, path: Path) -> _ReadFrame:
        """Read one file on a worker thread."""
        stamp = _stamp(path)
        frame = read_header(path).frame
        size = frame.decoded_bytes
        with self._lock:
            hold = self._cache_bytes + size <= self._memory_bytes
            hold = hold and size * self._count <= self._memory_bytes
            self._cache_bytes += size if hold else 0
        try:
            opened = open_frame(frame, hold=hold, token=self._token)
        except BaseException:
            with self._lock:
                self._cache_bytes -= size if hold else 0
            raise
        return _ReadFrame(opened, frame, hold, stamp)

    def _let_go(self, future: Future[_ReadFrame]) -> None:
        """Close a frame that a worker has opened but that is no longer needed."""
        if future.cancelled() or future.exception() is not None:
            return
        read = future.result()
        read.opened.source.close()
        with self._lock:
            self._cache_bytes -= _bytes(read)


def _bytes(read: _ReadFrame) -> int:
    """Return the number of bytes of memory that a frame occupies."""
    return read.frame.decoded_bytes if read.hold else 0


def _wait(future: Future[_ReadFrame], token: Token) -> _ReadFrame:
    while True:
        token.check()
        try:
            return future.result(timeout=_LOOK_S)
        except StillWorking:
            continue


def _stamp(path: Path) -> tuple[int, ...]:
    """Return the change stamp of a file."""
    try:
        facts = path.stat()
    except OSError:
        return ()
    return facts.st_size, facts.st_mtime_ns, facts.st_ino


def rehearse(pack: StylePack) -> None:
    """Run the whole merge once on a small synthetic bracket.

    This loads libraries, computes tables and allocates memory. Running it while a camera is
    exposing saves a third of the time that a process's first `measure` takes.
    """
    frames = tuple(
        Frame(Path(f"rehearsal {stop}"), _REHEARSAL, exposure=Exposure(4.0**-stop))
        for stop in range(3)
    )
    bracket = Bracket(frames, tuple(float(-2 * stop) for stop in range(3)))
    light = merge_bracket(bracket, MeasureOptions(), _made_up, Token(), silent)
    finished(light, MeasureOptions(pack=pack))
    display_panorama(light.merged.radiance)


def _made_up(frame: Frame, *, hold: bool, token: Token, half: bool = False) -> OpenedFrame:
    """Open a frame that has no file by drawing squares of light at its exposure."""
    del hold, token, half
    assert frame.exposure is not None
    squares = np.random.default_rng(0).random((frame.shape[0] // 8, frame.shape[1] // 8, 3))
    light = 2.0 * frame.exposure.factor * squares.repeat(8, axis=0).repeat(8, axis=1)
    codes = np.rint(255.0 * srgb_encode(np.minimum(light, 1.0))).astype(np.uint8)
    places = sample_places(frame.shape)
    small = shrunk(codes, proxy_shape(frame.shape))
    return OpenedFrame(MemoryRows(codes), small, sample_codes(codes, places), 0.0)
