"""Decode frames, and read their rows from memory, from the file or from a temporary file.

All formats are read with OpenImageIO. It reads a JPEG as fast as OpenCV does, keeps the stored
orientation and the channel order red, green, blue, and reads rows without loading the whole
picture. Unlike OpenCV, it reports truncated files (libjpeg fills the missing part with grey).

`open_frame` makes the first pass. A frame that may be kept in memory is decoded once. Any other
frame is read by rows, and then again for the merge. Either way, the first pass produces a thumbnail
and samples.
"""

from __future__ import annotations

import contextlib
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools
from app.core.base.atomic_files import open_file
from app.core.base.errors import ProbeError
from app.core.base.imaging.image_input import as_stored, clear_error, open_image, read_rows, upright
from app.core.base.progress import Token
from app.core.measure.read.frame import Frame
from app.core.text import tr

if TYPE_CHECKING:
    from OpenImageIO import ImageInput

Pixels: TypeAlias = NDArray[Any]
"""Rows of a frame as stored, (rows, W, 3), either encoded uint8 or uint16, or linear float32."""

READ_ROWS: Final = 64
"""Number of rows read at a time, a multiple of a JPEG's block size that still fits in the cache."""

_TYPES: Final = {"uint8": np.uint8, "uint16": np.uint16, "half": np.float32, "float": np.float32}
_LAST_ROWS: Final = 16
_HALF: Final = 0.5  # visible fraction below which a texel is transparent
_COPY_AGAIN: Final = tr("Copy it from the camera again.")


class MemoryRows:
    """A decoded frame in memory, (H, W, 3)."""

    __slots__ = ("pixels",)

    def __init__(self, pixels: Pixels) -> None:
        self.pixels = pixels

    def rows(self, start: int, stop: int) -> Pixels:
        """Return a view of rows ``start..stop``."""
        return self.pixels[start:stop]

    def close(self) -> None:
        """Do nothing, since memory needs no closing."""


class RawRows:
    """A copy, in a temporary file, of a frame that cannot be read by rows.

    The file has no name, and it is deleted together with the object.

    Raises:
        ProbeError: If the disk is full.
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
                tr(
                    "A frame cannot be stored in {gettempdir}: {strerror}.",
                    gettempdir=tempfile.gettempdir(),
                    strerror=error.strerror,
                ),
                tr("Free some space on the disk."),
            ) from error

    def rows(self, start: int, stop: int) -> Pixels:
        """Read rows ``start..stop`` back from the file."""
        result = np.empty((stop - start, self._width, 3), self._dtype)
        self._file.seek(start * self._width * 3 * self._dtype.itemsize)
        view = memoryview(result.data).cast("B")
        while view:
            count = self._file.readinto(view)
            if not count:
                raise ProbeError(tr("A temporary file is incomplete."))
            view = view[count:]
        return result

    def close(self) -> None:
        """Close the temporary file, which deletes it."""
        self._file.close()


class FileRows:
    """A frame that is read from its file by rows, from top to bottom, repeatedly if necessary.

    The frame's size and kind must match the file. Rows are returned as stored.
    """

    __slots__ = ("_frame", "_next", "_source", "_tiles")

    def __init__(self, frame: Frame) -> None:
        self._frame = frame
        self._source: ImageInput | None = None
        self._next = 0
        self._tiles: tuple[int, Pixels] | None = None

    def rows(self, start: int, stop: int) -> Pixels:
        """Read rows ``start..stop``.

        Raises:
            ProbeError: If the file is missing or damaged.
        """
        if self._source is None or start < self._next:
            self.close()
            self._source = _open(self._frame)
        self._next = stop
        # Read the last rows separately, since only there is a missing end harmless.
        end = max(self._frame.shape[0] - _LAST_ROWS, start)
        if stop <= end or start == end:
            return self._rows_at(start, stop)
        return np.concatenate([self._rows_at(start, end), self._rows_at(end, stop)])

    def _rows_at(self, start: int, stop: int) -> Pixels:
        assert self._source is not None
        tall = self._source.spec().tile_height
        pixels, error = (
            self._from_tiles(self._source, start, stop, tall)
            if tall
            else _read(self._source, self._frame, start, stop)
        )
        at_end = start >= self._frame.shape[0] - _LAST_ROWS
        if pixels is None or (error and not _harmless(error, at_end)):
            raise damaged(self._frame.path)
        return pixels

    def _from_tiles(
        self, source: ImageInput, start: int, stop: int, tall: int
    ) -> tuple[Pixels | None, str]:
        """Read whole rows of tiles and keep them, since the tiles also contain the next rows."""
        tiles = self._tiles
        if tiles is None or not tiles[0] <= start <= stop <= tiles[0] + len(tiles[1]):
            first = start - start % tall
            last = min(-(-stop // tall) * tall, self._frame.shape[0])
            pixels, error = _read(source, self._frame, first, last)
            if pixels is None or error:
                return None, error
            tiles = self._tiles = (first, pixels)
        return tiles[1][start - tiles[0] : stop - tiles[0]], ""

    def close(self) -> None:
        """Close the file. The next call to `rows` reopens it."""
        self._tiles = None
        if self._source is not None:
            self._source.close()
            self._source = None
            self._next = 0


RowSource: TypeAlias = MemoryRows | RawRows | FileRows
"""The read-only rows of one frame, which are read from top to bottom."""


def decode(frame: Frame, token: Token) -> Pixels:
    """Decode a whole frame, (H, W, 3), and rotate it upright according to `Frame.orientation`.

    Returns:
        Encoded uint8 or uint16 pixels, or linear float32 pixels. Greyscale is repeated in three
        channels, and alpha is dropped.

    Raises:
        ProbeError: If the file is missing, damaged or truncated, or contradicts `Frame`.
    """
    if frame.orientation != 1:
        return upright(decode(frame.as_stored, token), frame.orientation)
    # Decode into one array, for which NumPy requests huge pages, unlike the decoders' own buffers.
    # On some machines that saves a third of the time.
    pixels: Pixels = np.empty((*frame.shape, 3), _TYPES[frame.kind])
    source = FileRows(frame)
    with contextlib.closing(source):
        for start, stop in row_bands(frame.shape[0], READ_ROWS):
            token.check()
            pixels[start:stop] = source.rows(start, stop)
    return pixels


def transparent(frame: Frame, shape: tuple[int, int]) -> Bools | None:
    """Return the transparent area of a frame, (rows, columns) bool, or None if it is opaque.

    Args:
        shape: Rows and columns of the result.

    Raises:
        ProbeError: If the file is missing or damaged.
    """
    source = _open(frame.as_stored)
    with contextlib.closing(source):
        spec = source.spec()
        if spec.alpha_channel < 0:
            return None
        channels = (int(spec.alpha_channel), int(spec.alpha_channel) + 1)
        alpha = read_rows(source, (0, int(spec.height)), channels, "float")
        clear_error(source)
    if alpha is None:
        raise damaged(frame.path)
    if not alpha.max() > 0.0 or alpha.min() >= 1.0:
        return None  # The channel is unused, or nothing is transparent.
    whole = upright(alpha, frame.orientation)[..., 0]
    small = cv2.resize(whole, shape[::-1], interpolation=cv2.INTER_AREA)
    marks = np.asarray(small < _HALF)
    return marks if marks.any() else None


def decode_half(frame: Frame, token: Token) -> Pixels:
    """Decode a JPEG at half size, (H / 2, W / 2, 3) codes, with little more than half the work.

    Every pixel is the mean code of four pixels, which the decoder computes from the lower
    frequencies of a block. OpenCV does not report damaged files, so check `halvable` first, and
    `is_whole` if in doubt.

    Raises:
        ProbeError: If the file cannot be read or the picture's size has changed.
    """
    token.check()
    # Decode in RGB order, since reordering afterwards takes a fifth of the time.
    half = cv2.IMREAD_REDUCED_COLOR_2 & ~cv2.IMREAD_COLOR_BGR
    flags = half | cv2.IMREAD_COLOR_RGB | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        pixels = cv2.imdecode(np.fromfile(frame.path, np.uint8), flags)
    except (OSError, cv2.error):
        raise damaged(frame.path) from None
    if pixels is None or pixels.shape != (frame.shape[0] // 2, frame.shape[1] // 2, 3):
        raise damaged(frame.path)
    return np.asarray(pixels, np.uint8)


def row_bands(height: int, rows: int) -> list[tuple[int, int]]:
    """Divide rows into bands ``(start, stop)``, from top to bottom. The last band may be shorter.

    >>> row_bands(10, 4)
    [(0, 4), (4, 8), (8, 10)]
    """
    return [(start, min(start + rows, height)) for start in range(0, height, rows)]


def needs_whole_decode(path: Path) -> bool:
    """Return whether a reader must decode the whole picture to get its first row.

    This is the case for progressive JPEGs, whose decoder keeps all coefficients (three times the
    picture's size), and for interlaced PNGs. All other files are read row by row.
    """
    with contextlib.suppress(OSError), open_file(path) as stream:
        head = stream.read(29)
        if head[:3] == b"\xff\xd8\xff":
            return _progressive(stream)
        if head[:4] == b"\x89PNG" and len(head) == 29:
            return head[28] != 0
    return False


def damaged(path: Path) -> ProbeError:
    """Return the error for a damaged frame."""
    return ProbeError(tr("{name} is damaged or incomplete.", name=path.name), _COPY_AGAIN)


def _progressive(stream: BinaryIO) -> bool:
    """Return whether the first frame header in a JPEG marks the file as progressive."""
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
    # Alpha is not colour, so the colours are read as stored, opaque or not.
    source = open_image(frame.path, as_stored())
    if source is None:
        raise ProbeError(tr("Cannot read {name}.", name=frame.path.name), _COPY_AGAIN)
    spec = source.spec()
    if (spec.height, spec.width) != frame.shape:
        source.close()
        raise ProbeError(tr("{name} changed while it was being read.", name=frame.path.name))
    return source


def _read(source: ImageInput, frame: Frame, start: int, stop: int) -> tuple[Pixels | None, str]:
    """Read rows and return them together with the error, which is "" on success."""
    kind = "float" if frame.kind == "half" else frame.kind
    channels = 3 if source.spec().nchannels >= 3 else 1
    pixels: Any = read_rows(source, (start, stop), (0, channels), kind)
    error = clear_error(source) if source.has_error else ""
    if pixels is None:
        return None, error
    if channels == 1:
        pixels = np.repeat(pixels, 3, axis=2)
    return pixels, error


def _harmless(error: str, at_end: bool) -> bool:
    """Return whether a JPEG is complete apart from its end marker or stray bytes."""
    lowered = error.lower()
    if "premature end" in lowered:
        return at_end
    return "jpeg" in lowered and "extraneous" in lowered
