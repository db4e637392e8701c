"""Where the pixels of a frame come from: memory, the file row by row, or a temporary file.

All formats go through OpenImageIO, which reads a JPEG as fast as OpenCV does, keeps the stored
orientation and the order red, green, blue, reads rows without holding the whole picture, and,
unlike OpenCV, says when a file ends too early (libjpeg fills what is missing with grey).
"""

from __future__ import annotations

import contextlib
import os
import tempfile
from typing import TYPE_CHECKING, Any, BinaryIO, Final, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.errors import ProbeError

if TYPE_CHECKING:
    from pathlib import Path

    from OpenImageIO import ImageInput

    from app.core.probe.frame import Frame
    from app.core.progress import Token

__all__ = [
    "READ_ROWS",
    "FileRows",
    "MemoryRows",
    "Pixels",
    "RawRows",
    "RowSource",
    "bytes_per_frame",
    "decode",
    "needs_whole_decode",
    "row_bands",
]

Pixels: TypeAlias = NDArray[Any]
"""Rows of a frame as stored, (rows, W, 3): coded uint8 or uint16, or linear float32."""

READ_ROWS: Final = 64
"""Rows read at a time: a multiple of a JPEG's blocks, small enough to stay in the cache."""

_TYPES: Final[dict[str, type[np.generic]]] = {
    "uint8": np.uint8,
    "uint16": np.uint16,
    "half": np.float32,
    "float": np.float32,
}
_LAST_ROWS: Final = 16
_COPY_AGAIN: Final = "Copy it from the camera again."


class RowSource(Protocol):
    """Rows of one frame, asked for from top to bottom."""

    def rows(self, start: int, stop: int) -> Pixels:
        """Return rows ``start..stop`` as (stop - start, W, 3), not to be written to."""

    def close(self) -> None:
        """Let go of files; reading after that is an error."""


class MemoryRows:
    """A frame that is held in memory.

    Parameters
    ----------
    pixels : Pixels, (H, W, 3)
        The decoded frame.
    """

    __slots__ = ("pixels",)

    def __init__(self, pixels: Pixels) -> None:
        self.pixels = pixels

    def rows(self, start: int, stop: int) -> Pixels:
        """Return a view of rows ``start..stop``."""
        return self.pixels[start:stop]

    def close(self) -> None:
        """Do nothing: memory needs no closing."""


class RawRows:
    """A frame spooled to a temporary file, for formats and frames that cannot be read by rows.

    Parameters
    ----------
    pixels : Pixels, (H, W, 3)
        The decoded frame; written to the temporary file, which has no name and goes with it.

    Raises
    ------
    ProbeError
        When the disk is full.
    """

    __slots__ = ("_dtype", "_file", "_width")

    def __init__(self, pixels: Pixels) -> None:
        self._dtype = pixels.dtype
        self._width = pixels.shape[1]
        self._file: Any = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115
        try:
            view = memoryview(np.ascontiguousarray(pixels).data).cast("B")
            while view:
                view = view[self._file.write(view) :]
        except OSError as error:
            self._file.close()
            raise ProbeError(
                f"Cannot keep a frame in {tempfile.gettempdir()}: {error.strerror}.",
                "Make room on the disk.",
            ) from error

    def rows(self, start: int, stop: int) -> Pixels:
        """Read rows ``start..stop`` back."""
        wanted = np.empty((stop - start, self._width, 3), self._dtype)
        self._file.seek(start * self._width * 3 * self._dtype.itemsize)
        view = memoryview(wanted.data).cast("B")
        while view:
            count = self._file.readinto(view)
            if not count:
                raise ProbeError("A temporary file has lost its end.")
            view = view[count:]
        return wanted

    def close(self) -> None:
        """Close, and with it remove, the temporary file."""
        self._file.close()


class FileRows:
    """A frame read from its file by rows, from top to bottom, again and again if need be.

    Parameters
    ----------
    frame : Frame
        The frame; its size and kind must be what the file has.
    """

    __slots__ = ("_frame", "_next", "_source")

    def __init__(self, frame: Frame) -> None:
        self._frame = frame
        self._source: ImageInput | None = None
        self._next = 0

    def rows(self, start: int, stop: int) -> Pixels:
        """Read rows ``start..stop``.

        Raises
        ------
        ProbeError
            When the file is missing or damaged.
        """
        if self._source is None or start < self._next:
            self.close()
            self._source = _open(self._frame)
        self._next = stop
        # The last rows by themselves: only there is a missing end no loss.
        end = max(self._frame.shape[0] - _LAST_ROWS, start)
        if stop <= end or start == end:
            return self._checked(start, stop)
        return np.concatenate([self._checked(start, end), self._checked(end, stop)])

    def _checked(self, start: int, stop: int) -> Pixels:
        assert self._source is not None
        pixels, error = _read(self._source, self._frame, start, stop)
        at_end = start >= self._frame.shape[0] - _LAST_ROWS
        if pixels is None or (error and not _harmless(error, at_end)):
            raise damaged(self._frame.path)
        return pixels

    def close(self) -> None:
        """Close the file; the next call of `rows` opens it again."""
        if self._source is not None:
            self._source.close()
            self._source = None
            self._next = 0


def decode(frame: Frame, token: Token) -> Pixels:
    """Decode a whole frame.

    Parameters
    ----------
    frame : Frame
        The frame.
    token : Token
        Checked every `READ_ROWS` rows.

    Returns
    -------
    Pixels, (H, W, 3)
        uint8 or uint16 as coded, or linear float32; grey files are repeated into three channels,
        alpha is left out, orientation tags are not applied.

    Raises
    ------
    ProbeError
        When the file is missing, damaged, cut off, or not of the size and kind that
        `Frame` states.
    """
    # Into one array: numpy asks for huge pages, which the decoders' own buffers do not; on some
    # machines that saves a third of the time.
    pixels: Pixels = np.empty((*frame.shape, 3), _TYPES[frame.kind])
    source = FileRows(frame)
    with contextlib.closing(source):
        for start, stop in row_bands(frame.shape[0], READ_ROWS):
            token.check()
            pixels[start:stop] = source.rows(start, stop)
    return pixels


def row_bands(height: int, rows: int) -> list[tuple[int, int]]:
    """Divide rows into bands ``(start, stop)`` from top to bottom, the last may be shorter.

    Examples
    --------
    >>> row_bands(10, 4)
    [(0, 4), (4, 8), (8, 10)]
    """
    return [(start, min(start + rows, height)) for start in range(0, height, rows)]


def bytes_per_frame(frame: Frame) -> int:
    """Bytes that the decoded frame takes in memory."""
    return frame.shape[0] * frame.shape[1] * 3 * np.dtype(_TYPES[frame.kind]).itemsize


def needs_whole_decode(path: Path) -> bool:
    """Whether a reader must hold the whole picture to give its first row.

    Progressive JPEG (its decoder keeps all coefficients, three times the picture's size) and
    interlaced PNG. Everything else is read row by row.

    Parameters
    ----------
    path : Path
        The file; one that cannot be read gives False.
    """
    with contextlib.suppress(OSError), path.open("rb") as stream:
        head = stream.read(29)
        if head[:3] == b"\xff\xd8\xff":
            return _progressive(stream)
        if head[:4] == b"\x89PNG" and len(head) == 29:
            return head[28] != 0
    return False


def damaged(path: Path) -> ProbeError:
    """Say that a frame's file is damaged."""
    return ProbeError(f"{path.name} is damaged or cut off.", _COPY_AGAIN)


def _progressive(stream: BinaryIO) -> bool:
    """Whether the first frame header of a JPEG is one of the progressive ones."""
    place = 2
    while True:
        stream.seek(place)
        head = stream.read(4)
        if len(head) < 4 or head[0] != 0xFF or head[1] == 0xDA:
            return False
        if 0xC0 <= head[1] <= 0xCF and head[1] not in (0xC4, 0xC8, 0xCC):
            return head[1] in (0xC2, 0xC6, 0xCA, 0xCE)
        if head[1] == 0xFF:  # padding before a marker
            place += 1
            continue
        place += 2 + int.from_bytes(head[2:4], "big")


def _open(frame: Frame) -> ImageInput:
    import OpenImageIO as oiio

    # Alpha is not colour: as stored, so that opaque or not the colours are the file's own.
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(os.fspath(frame.path), config)
    if source is None:
        oiio.geterror()
        raise ProbeError(f"Cannot read {frame.path.name}.", _COPY_AGAIN)
    spec = source.spec()
    if (spec.height, spec.width) != frame.shape:
        source.close()
        raise ProbeError(f"{frame.path.name} has changed its size while it was being read.")
    return source


def _read(source: ImageInput, frame: Frame, start: int, stop: int) -> tuple[Pixels | None, str]:
    """Read rows; the error is "" when all went well."""
    spec = source.spec()
    kind = "float" if frame.kind == "half" else frame.kind
    channels = 3 if spec.nchannels >= 3 else 1
    top = spec.y
    pixels: Any = source.read_scanlines(top + start, top + stop, 0, 0, channels, kind)
    error = str(source.geterror()) if source.has_error else ""
    if pixels is None:
        return None, error
    pixels = np.asarray(pixels).reshape(stop - start, frame.shape[1], channels)
    if channels == 1:
        pixels = np.repeat(pixels, 3, axis=2)
    return pixels, error


def _harmless(error: str, at_end: bool) -> bool:
    """Whether a JPEG's picture is whole: only its end marker is missing, or bytes are stray."""
    lowered = error.lower()
    if "premature end" in lowered:
        return at_end
    return "jpeg" in lowered and "extraneous" in lowered
