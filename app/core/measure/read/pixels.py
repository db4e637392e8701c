"""Read the pixels of a bracket, along with thumbnails and samples for the analyses.

A bracket that fits in memory is decoded once and kept there. A larger one is read again, row by
row, for the merge, so the size of the pictures hardly matters. Either way, the analyses (response,
alignment and motion) use the same thumbnails and the same samples.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Final, Self

import numpy as np

from app.core.base.arrays import Bools, Bytes, Float32, Indices
from app.core.base.colour import srgb_encode
from app.core.base.errors import ProbeError
from app.core.base.progress import Progress, Report, Task, Token, silent
from app.core.base.remarks import Remark
from app.core.measure.read.decoding import (
    READ_ROWS,
    MemoryRows,
    Pixels,
    RawRows,
    RowSource,
    row_bands,
)
from app.core.measure.read.frame import Bracket, Frame
from app.core.measure.read.opened_frame import (
    OpenedFrame,
    Opener,
    open_frame,
    proxy_shape,
    sample_codes,
    sample_places,
    shrunk,
)
from app.core.measure.read.remarks import FrameUnread
from app.core.text import tr

MEMORY_BYTES: Final = 640 << 20
"""Total size, in bytes, up to which decoded frames are kept in memory."""

_DECODERS: Final = 4
_LEAST_FRAMES: Final = 2
_MOST_UNKNOWN: Final = 0.03


@dataclass(frozen=True, slots=True)
class FrameStack:
    """The readable frames of a bracket, with thumbnails and samples for analysis.

    Use the stack as a context manager or call `close`, since large brackets keep files open.

    Attributes:
        stops: Nominal exposures, in stops.
        proxies: One thumbnail per frame, (h, w, 3) uint8, of size `proxy_shape`. It consists of
            area means of the encoded values, with 16-bit codes rounded to 8 bits, and linear frames
            encoded by the sRGB curve below `top` or below 1.
        samples: (K, N, 3) uint8. The same N pixels from every frame, encoded in the same way but
            not averaged.
        sample_places: (N, 2). Row and column of each sample in the full frames.
        visibility: One mask per frame, (h, w) float32 at the size of the proxies, which is 1 where
            a moved frame has pixels and 0 elsewhere, or None for a frame that fills the picture.
            The tuple is empty if no frame was moved.
    """

    frames: tuple[Frame, ...]
    stops: tuple[float, ...]
    proxies: tuple[Bytes, ...] = field(repr=False)
    samples: Bytes = field(repr=False)
    sample_places: Indices = field(repr=False)
    top: float
    sources: tuple[RowSource, ...] = field(repr=False)
    visibility: tuple[Float32 | None, ...] = ()
    warnings: tuple[Remark, ...] = ()

    @property
    def shape(self) -> tuple[int, int]:
        """The numbers of rows and columns of every frame."""
        return self.frames[0].shape

    @property
    def whole(self) -> tuple[bool, ...]:
        """Whether each frame is at full size rather than at half size."""
        return tuple(
            not isinstance(source, MemoryRows) or source.pixels.shape[:2] == self.shape
            for source in self.sources
        )

    @property
    def in_memory(self) -> bool:
        """Whether all frames are in memory."""
        return all(isinstance(source, MemoryRows) for source in self.sources)

    def close(self) -> None:
        """Close the open files. This method may be called more than once."""
        for source in self.sources:
            source.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *failure: object) -> None:
        self.close()


def workers(tasks: int) -> int:
    """Return the number of threads for independent tasks, at most four and at most one per core."""
    return max(1, min(4, os.cpu_count() or 1, tasks))


def open_frames(
    bracket: Bracket,
    *,
    memory_bytes: int = MEMORY_BYTES,
    opener: Opener = open_frame,
    token: Token | None = None,
    report: Report = silent,
    halves: Sequence[bool] = (),
) -> FrameStack:
    """Read the pixels of a bracket once.

    Frames are kept in memory if together they take up no more than `memory_bytes`. Otherwise, they
    are read again by rows. Damaged frames are left out, and each one is named in a warning.

    Raises:
        ProbeError: If fewer than two frames can be read.
        Cancelled: If the token is cancelled.
    """
    token = token or Token()
    hold = sum(frame.decoded_bytes for frame in bracket.frames) <= memory_bytes
    small = {f.path for f, half in zip(bracket.frames, halves, strict=False) if half and hold}

    def first_pass(frame: Frame) -> OpenedFrame | ProbeError:
        try:
            opened_frame = opener(frame, hold=hold, token=token, half=frame.path in small)
        except ProbeError as error:
            return error
        return _unsound(frame, opened_frame) or opened_frame

    # Use one thread per frame even on two cores, so that three frames finish together. Frames at
    # half size are decoded one after another, in parallel with the one in full.
    threads = workers(len(bracket.frames)) if small else min(_DECODERS, len(bracket.frames))
    results = _in_threads(first_pass, bracket.frames, threads, report)
    if small and not all(isinstance(result, OpenedFrame) for result in results):
        # The remaining frames must provide what the lost frame would have provided.
        small.clear()
        results = _in_threads(first_pass, bracket.frames, threads, report)
    good = [index for index, result in enumerate(results) if isinstance(result, OpenedFrame)]
    frames = [result for result in results if isinstance(result, OpenedFrame)]
    warnings = tuple(
        FrameUnread(result.message) for result in results if isinstance(result, ProbeError)
    )
    top = max((one.top for one in frames if one.top > 0.0), default=math.inf)
    stack = FrameStack(
        frames=tuple(bracket.frames[index] for index in good),
        stops=tuple(bracket.stops[index] for index in good),
        proxies=tuple(_coded(one.proxy, top) for one in frames),
        samples=np.array([_coded(one.samples, top) for one in frames], np.uint8),
        sample_places=sample_places(bracket.shape),
        top=top,
        sources=tuple(one.source for one in frames),
        warnings=warnings,
    )
    if len(frames) < min(_LEAST_FRAMES, len(bracket.frames)):
        stack.close()
        errors = [result for result in results if isinstance(result, ProbeError)]
        raise _too_few(errors, len(frames))
    return stack


def relaid(
    stack: FrameStack,
    ways: Sequence[Callable[[Pixels], Pixels] | None],
    *,
    visibility: Sequence[Float32 | None] = (),
    token: Token | None = None,
    report: Report = silent,
) -> FrameStack:
    """Align the frames of a stack by `ways`, leaving frames whose entry is None unchanged.

    Proxies and samples are recomputed for moved frames only. If the stack is not in memory, a moved
    frame is kept in a temporary file.

    Args:
        visibility: As in `FrameStack`.

    Raises:
        ProbeError: If a file has become damaged in the meantime, or the disk is full.
        Cancelled: If the token is cancelled.
    """
    token = token or Token()
    proxies, sources = list(stack.proxies), list(stack.sources)
    samples = stack.samples.copy()
    hold = stack.in_memory
    for index, way in enumerate(ways):
        token.check()
        if way is None:
            continue
        pixels = way(_whole(sources[index], stack.frames[index], token))
        sources[index].close()
        proxies[index] = _coded(shrunk(pixels, proxy_shape(stack.shape)), stack.top)
        places = stack.sample_places // (stack.shape[0] // pixels.shape[0])
        samples[index] = _coded(sample_codes(pixels, places), stack.top)
        sources[index] = MemoryRows(pixels) if hold else RawRows(pixels)
        report((index + 1) / len(ways), Progress(Task.ALIGNING_FRAMES))
    usable = _seen_by_all(stack, visibility)
    return replace(
        stack,
        proxies=tuple(proxies),
        samples=samples[:, usable],
        sample_places=stack.sample_places[usable],
        sources=tuple(sources),
        visibility=tuple(visibility),
    )


def _seen_by_all(stack: FrameStack, visibility: Sequence[Float32 | None]) -> Bools:
    """Return a mask, (N,), of the samples that all frames show."""
    usable = np.ones(len(stack.sample_places), bool)
    for mask in visibility:
        if mask is not None:
            small = stack.sample_places * mask.shape // stack.shape
            usable &= mask[small[:, 0], small[:, 1]] > 0.0
    return usable


def reduced(stack: FrameStack, longest: int, token: Token) -> list[Bytes]:
    """Return all frames, (h, w, 3) encoded uint8, scaled to a given longer side in pixels."""
    share = min(1.0, longest / max(stack.shape))
    size = (max(1, round(share * stack.shape[0])), max(1, round(share * stack.shape[1])))
    return [
        _coded(shrunk(_whole(source, frame, token), size), stack.top)
        for source, frame in zip(stack.sources, stack.frames, strict=True)
    ]


def _in_threads(
    work: Callable[[Frame], OpenedFrame | ProbeError],
    frames: Sequence[Frame],
    threads: int,
    report: Report,
) -> list[OpenedFrame | ProbeError]:
    """Run one task per frame. If any task fails, close the frames from the others."""
    results: list[OpenedFrame | ProbeError] = []
    with ThreadPoolExecutor(threads) as pool:
        # The darkest frame, which is decoded in full, takes longest and starts first.
        futures = [pool.submit(work, frame) for frame in reversed(frames)][::-1]
        try:
            for index, future in enumerate(futures):
                results.append(future.result())
                report((index + 1) / len(frames), Progress(Task.READING_FRAMES))
        except BaseException:
            for future in futures:
                future.cancel()
            for future in futures:
                _let_go(future)
            raise
    return results


def _too_few(errors: Sequence[ProbeError], count: int) -> ProbeError:
    rest = (
        tr("There is nothing to merge: only one frame is left.")
        if count
        else tr("There is nothing to merge: no frame is left.")
    )
    return ProbeError(" ".join([*(error.message for error in errors), rest]), errors[0].hint)


def _unsound(frame: Frame, frame_data: OpenedFrame) -> ProbeError | None:
    """Return an error if too many samples in a floating-point frame are not numbers."""
    share = 1.0 - float(np.isfinite(frame_data.samples).all(axis=1).mean())
    if share <= _MOST_UNKNOWN:
        return None
    frame_data.source.close()
    return ProbeError(
        tr(
            "{name} is damaged: {share:.0f}% of it is NaN or infinite.",
            name=frame.path.name,
            share=100.0 * share,
        ),
        tr("Export it again."),
    )


def _let_go(future: Future[OpenedFrame | ProbeError]) -> None:
    """Close the frame of a task after another task has failed."""
    if future.cancelled():
        return
    try:
        result = future.result()
    except Exception:  # noqa: BLE001
        return  # Only the first failure is reported.
    if isinstance(result, OpenedFrame):
        result.source.close()


def _whole(source: RowSource, frame: Frame, token: Token) -> Pixels:
    """Return all pixels of a frame in one array."""
    if isinstance(source, MemoryRows):
        return source.pixels
    first = source.rows(0, 1)
    pixels: Pixels = np.empty((*frame.shape, 3), first.dtype)
    for start, stop in row_bands(frame.shape[0], READ_ROWS):
        token.check()
        pixels[start:stop] = source.rows(start, stop)
    return pixels


def _coded(pixels: Pixels, top: float) -> Bytes:
    """Convert pixels of any kind to 8-bit codes."""
    if pixels.dtype == np.uint8:
        return pixels
    if pixels.dtype == np.uint16:
        # 65535 / 257 = 255, which is exact for 8-bit pictures stored as 16 bits.
        return ((pixels.astype(np.uint32) + 128) // 257).astype(np.uint8)
    white = np.float32(top if math.isfinite(top) else 1.0)
    share = np.clip(np.nan_to_num(pixels, posinf=float(white)), np.float32(0.0), white) / white
    return np.asarray(np.rint(srgb_encode(share) * np.float32(255.0)).astype(np.uint8))
