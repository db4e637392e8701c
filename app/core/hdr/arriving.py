"""Answers while frames are still on their way.

`ArrivingFrames` reads each frame while the next is coming: when the last file is there only its own
decoding and the merge are left to do. What comes out is what `app.core.hdr.pipeline.measure` makes
of the same files, bit for bit.

`rough_environment` makes a first answer of the camera's thumbnails. They are means of coded values,
sharpened and compressed hard: small lamps come out far too dim. That is good enough to say roughly
where the light comes from, and for nothing else.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as StillWorking
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final, Self

import numpy as np

from app.core.base.arrays import Bytes, Float32
from app.core.base.colour import srgb_decode
from app.core.base.errors import Cancelled, EnvironmentFileError, ProbeError
from app.core.base.progress import Report, Token, silent
from app.core.base.sphere import bounded
from app.core.hdr.decoding import OpenedFrame, Pixels, decode, open_frame
from app.core.hdr.dual_fisheye import find_circles
from app.core.hdr.finish import MergeOptions
from app.core.hdr.frame import Exposure, Frame
from app.core.hdr.metadata import read_header
from app.core.hdr.pipeline import Probe, measure, rehearse
from app.core.hdr.pixels import MEMORY_BYTES, workers
from app.core.solver.environment import Environment, from_radiance, solid_angles

if TYPE_CHECKING:
    from app.core.solver.style_pack import StylePack

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

    def proxy(self, path: Path, token: Token | None = None) -> Pixels | None:
        """Show a small picture of a file that was added, once it has been read; else None."""
        try:
            read = self._of(path, token)
        except ProbeError:
            return None
        return None if read is None else read.opened.proxy

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
        """Make an environment of the frames; see `app.core.hdr.pipeline.measure`.

        Files that were not added, or have changed since, are read now. Every frame is handed over
        once: measuring a second time reads the files again.
        """
        return measure(paths, pack, options, opener=self.take, token=token, report=report)

    def take(self, frame: Frame, *, hold: bool, token: Token, half: bool = False) -> OpenedFrame:
        """Hand over a frame, or read it now: an `app.core.hdr.decoding.Opener`."""
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


_LEAST_WIDTH: Final = 128
_MOST_WIDTH: Final = 2048
_LEAST_FRAMES: Final = 2
_LEAST_STOPS: Final = 1.0
# Means over a block that is partly clipped are too dark well below the highest code.
_CLIPPED_CODE: Final = 240
_DARK_CODE: Final = 8
_MOST_CLIPPED: Final = 0.25
_MOST_DARK: Final = 0.9
_STEP_TOLERANCE: Final = 1.0  # stops; only equal or swapped exposures are further off
_FEWEST_PLACES: Final = 100


@dataclass(frozen=True, slots=True)
class Rough:
    """Light as thumbnails tell it. To be replaced as soon as there is a merge.

    `radiance`, (h, 2 h, 3) float32, is linear Rec. 709, relative, its mean 1. `clipped_share`
    of the sphere is clipped even in the darkest thumbnail, 0 to 1.
    """

    radiance: Float32 = field(repr=False)
    frames: int
    clipped_share: float

    def environment(self, name: str) -> Environment:
        """Return it as an environment that can be solved, called rough in its name."""
        return from_radiance(self.radiance.copy(), f"{name} (rough)")


def rough_environment(
    thumbnails: Sequence[Path | None], exposures: Sequence[Exposure | None]
) -> Rough | None:
    """Make a rough environment of thumbnails and their planned exposures, None where not known.

    Thumbnails are small sRGB panoramas (320 x 160). Returns None where they do not carry
    enough: fewer than two that can be read, narrower than 128 pixels, exposures unknown or less
    than a stop apart or not those of the pictures, more than a quarter of the sphere clipped in
    all or nearly everything black in all.
    """
    pairs = zip(thumbnails, exposures, strict=True)
    known = [(path, exposure) for path, exposure in pairs if path and exposure]
    read = [(_picture(path), exposure.ev) for path, exposure in known]
    frames = [(codes, ev) for codes, ev in read if codes is not None]
    frames.sort(key=lambda frame: -frame[1])
    if len(frames) < _LEAST_FRAMES or frames[0][1] - frames[-1][1] < _LEAST_STOPS:
        return None
    columns = min(codes.shape[1] for codes, _ in frames)
    pictures = [bounded(codes, columns) for codes, _ in frames]
    stops = [ev for _, ev in frames]
    if not _steps_fit(pictures, stops):
        return None
    return _merged(pictures, stops)


def _picture(path: Path) -> Bytes | None:
    """Codes of a small panorama, None for everything else, unstitched ones among it."""
    try:
        frame = read_header(path).frame
        height, width = frame.shape
        panorama = width == 2 * height and _LEAST_WIDTH <= width <= _MOST_WIDTH
        if not panorama or frame.kind != "uint8":
            return None
        codes = np.asarray(decode(frame, Token()), np.uint8)
        return None if find_circles(codes) is not None else codes
    except ProbeError:
        return None


def _steps_fit(pictures: Sequence[Bytes], stops: Sequence[float]) -> bool:
    """Whether neighbouring pictures differ about as much as their exposures, where both see."""
    for index in range(len(pictures) - 1):
        bright, dark = pictures[index][..., 1], pictures[index + 1][..., 1]
        both = (bright < _CLIPPED_CODE) & (dark > _DARK_CODE)
        if np.count_nonzero(both) < _FEWEST_PLACES:
            continue
        ratio = np.median(srgb_decode(bright[both] / 255.0) / srgb_decode(dark[both] / 255.0))
        if abs(np.log2(ratio) - (stops[index] - stops[index + 1])) > _STEP_TOLERANCE:
            return False
    return True


def _merged(pictures: Sequence[Bytes], stops: Sequence[float]) -> Rough | None:
    """Mean of what the pictures say, each weighed by how well it sees a place."""
    rows, columns = pictures[0].shape[:2]
    total, weight = np.zeros((rows, columns, 3)), np.zeros((rows, columns))
    for index, codes in enumerate(pictures):
        largest = codes.max(axis=-1).astype(np.float64)
        # Brighter frames are less noisy; where they near the clip the darker ones take over.
        seen = np.clip((_CLIPPED_CODE - largest) / 40.0, 0.0, 1.0) * largest
        if index == len(pictures) - 1:
            seen = np.maximum(seen, 1e-3)  # where all are clipped: the lower bound
        total += seen[..., None] * srgb_decode(codes / 255.0) * 2.0 ** -stops[index]
        weight += seen
    areas = solid_angles((rows, columns))[:, None] / (4.0 * np.pi)
    clipped = float((areas * (pictures[-1].max(axis=-1) >= _CLIPPED_CODE)).sum())
    dark = float((areas * (pictures[0].max(axis=-1) <= _DARK_CODE)).sum())
    if clipped > _MOST_CLIPPED or dark > _MOST_DARK:
        return None
    radiance = total / weight[..., None]
    mean = float((areas[..., None] * radiance).sum() / 3.0)
    relative: Float32 = (radiance / mean).astype(np.float32)
    try:
        from_radiance(relative.copy(), "thumbnails")
    except EnvironmentFileError:
        return None
    return Rough(relative, len(pictures), clipped)
