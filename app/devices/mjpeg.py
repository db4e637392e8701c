"""Motion JPEG: frames from a camera's endless multipart reply, decoded defensively.

Ricoh's cameras omit the "--" that the standard requires before the boundary, whereas other cameras
and simulators send it. After any damage (lost packets, garbage, missing or wrong lengths, truncated
frames) the parser continues at the next boundary. It never holds more than one frame.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

MAX_FRAME_BYTES: Final = 8 << 20
"""Size limit for a frame, in bytes. Larger frames are dropped."""

MAX_SHAPE: Final = (2048, 4096)
"""Maximum number of rows and columns in a frame. Larger frames are not decoded."""

_SOI: Final = b"\xff\xd8\xff"
_EOI: Final = b"\xff\xd9"
_STEP: Final = 64 << 10  # bytes processed at once, so that a huge packet cannot fill the memory
_MAX_LINE: Final = 1024
_MAX_HEADER: Final = 8192
_MAX_DASHES: Final = 64
_DISTINCT: Final = 8  # characters; a boundary at least this long is recognized anywhere
# bytes without the announced boundary before the parser gives up on it
_PATIENCE: Final = 256 << 10
_FUTILE: Final = 16  # false starts of frames before the parser searches in larger steps
_LEAP: Final = 4096
_MAX_SEGMENTS: Final = 256
_MAX_FILL: Final = 16
_MAX_SCANS: Final = 8
_BOUNDARY: Final = re.compile(r'boundary\s*=\s*(?:"([^"]{1,70})"|([^\s;,"]{1,70}))', re.IGNORECASE)
# Within compressed data 0xFF is followed by 0, a restart marker or a fill byte 0xFF.
_MARKER: Final = re.compile(rb"\xff[^\x00\xff\xd0-\xd7]")
_LENGTH: Final = re.compile(rb"content-length[ \t]*:[ \t]*(\d{1,10})[ \t]*\Z", re.IGNORECASE)


def boundary_of(content_type: str) -> str:
    """Return the boundary from a Content-Type header.

    Examples:
        >>> boundary_of('multipart/x-mixed-replace; boundary="---osclivepreview---"')
        '---osclivepreview---'
    """
    match = _BOUNDARY.search(content_type[:1000])
    return (match[1] or match[2]).strip() if match else ""


class MjpegParser:
    """Extracts frames from a stream of bytes in packets of any size.

    A part consists of a boundary line, header lines, an empty line and the frame. With a correct
    Content-Length, the frame has that length. Otherwise, the parser walks through the frame's
    segments to find its end, so that the end of an embedded thumbnail is not mistaken for it. A
    frame cut off by the next boundary is dropped. Without a boundary, frames are found by their
    first bytes.
    """

    def __init__(self, boundary: str = "") -> None:
        whole = boundary.encode("latin-1", "replace")
        self._mark = whole.strip(b"- ") or whole
        anywhere = len(self._mark) >= _DISTINCT
        self._line = re.compile(
            (b"" if anywhere else rb"(?<![^\n-])")
            + re.escape(self._mark)
            + rb"-{0,%d}[ \t]{0,%d}\r?\n" % (_MAX_DASHES, _MAX_DASHES)
        )
        self._tail = len(self._mark) + 2 * _MAX_DASHES + 3
        self._buffer = bytearray()
        self._search_from = 0  # no boundary starts before this position in the buffer
        self._skip_bytes = 0
        self._futile = 0
        self._header = 0
        self._length = 0
        self._walk: _SegmentWalk | None = None
        # Use a method of the class, since a bound method would keep the object alive.
        self._state: Callable[[MjpegParser, list[bytes]], bool] = MjpegParser._seek
        self.dropped = 0

    @property
    def _blind(self) -> bool:
        """Whether to find frames without a boundary."""
        return not self._mark or self._skip_bytes > _PATIENCE

    def feed(self, data: bytes) -> list[bytes]:
        """Add received bytes, and return the JPEG frames that are now complete, oldest first."""
        frames: list[bytes] = []
        view = memoryview(data)
        for start in range(0, len(view), _STEP):
            self._buffer += view[start : start + _STEP]
            while self._state(self, frames):
                pass
        return frames

    def _seek(self, frames: list[bytes]) -> bool:
        """Skip to the next boundary, or to a frame if there is no boundary."""
        del frames
        span = self._next_boundary()
        if span:
            self._take(span[1])
            self._skip_bytes = self._header = self._length = self._futile = 0
            self._state = MjpegParser._head
            return True
        if self._blind:
            start = self._buffer.find(_SOI)
            if start >= 0:
                self._take(start)
                self._state = MjpegParser._scan
                return True
        self._trim()
        return False

    def _head(self, frames: list[bytes]) -> bool:
        """Parse the header of a part line by line."""
        del frames
        if self._buffer.startswith(_SOI[:2]):
            self._begin()
            return True
        end = self._buffer.find(b"\n", 0, _MAX_LINE)
        if end < 0 and len(self._buffer) < _MAX_LINE:
            return False
        self._header += end + 1
        if end < 0 or self._header > _MAX_HEADER:
            self._state = MjpegParser._seek
            return True
        line = bytes(self._buffer[: end + 1])
        self._take(end + 1)
        if self._mark and self._line.search(line):
            self._length = 0
        elif not line.strip():
            self._begin()
        elif match := _LENGTH.match(line.strip()):
            self._length = int(match[1])
        return True

    def _begin(self) -> None:
        """Start reading a frame at its first byte."""
        has_length = 0 < self._length <= MAX_FRAME_BYTES
        self._state = MjpegParser._body if has_length else MjpegParser._scan

    def _body(self, frames: list[bytes]) -> bool:
        """Read a frame of known length."""
        length = self._length
        span = self._next_boundary()
        if span and span[0] < length:
            self._state = MjpegParser._scan
            return True
        if len(self._buffer) < length:
            return False
        if self._buffer.startswith(_SOI) and self._buffer.endswith(_EOI, 0, length):
            self._deliver(frames, length)
        else:
            self._state = MjpegParser._scan
        return True

    def _scan(self, frames: list[bytes]) -> bool:
        """Search for a frame, or read a frame of unknown length."""
        span = self._next_boundary()
        limit = span[0] if span else len(self._buffer)
        if self._walk is None:
            return self._scan_start(limit, bounded=span is not None)
        end = self._walk.advance(self._buffer, limit)
        if end > 0:
            self._deliver(frames, end)
        elif end < 0:
            # The next picture may start after the damage.
            place = max(self._walk.place, _LEAP if self._futile > _FUTILE else 2)
            self._futile += self._blind
            self._drop(place, limit, whole=span is not None)
        elif span or limit > MAX_FRAME_BYTES:
            self._drop(limit, limit, whole=span is not None)
        else:
            return False
        return True

    def _scan_start(self, limit: int, *, bounded: bool) -> bool:
        start = self._buffer.find(_SOI, 0, limit)
        if start >= 0:
            self._take(start)
            self._walk = _SegmentWalk()
            return True
        if bounded:
            self._state = MjpegParser._seek
            return True
        self._trim()
        return False

    def _deliver(self, frames: list[bytes], end: int) -> None:
        if end > MAX_FRAME_BYTES:
            self._drop(end, end, whole=True)
            return
        with memoryview(self._buffer) as view:
            frames.append(bytes(view[:end]))
        self._futile = 0
        self._leave(end)

    def _drop(self, end: int, limit: int, *, whole: bool) -> None:
        """Drop a frame, keeping the start of a boundary unless `whole` is set."""
        self.dropped += 1
        keep = self._tail if self._mark and not whole else 0
        self._leave(max(min(end, limit - keep), 2))

    def _leave(self, end: int) -> None:
        self._take(end)
        self._walk = None
        self._state = MjpegParser._seek

    def _next_boundary(self) -> tuple[int, int] | None:
        """Return the start and end of the next boundary line, or None if there is none."""
        if not self._mark:
            return None
        # The plain search is several times faster and almost always finds nothing.
        place = self._buffer.find(self._mark, self._search_from)
        match = self._line.search(self._buffer, place) if place >= 0 else None
        if match:
            return match.span()
        self._search_from = max(self._search_from, len(self._buffer) - self._tail)
        return None

    def _take(self, count: int) -> None:
        del self._buffer[:count]
        self._search_from = max(self._search_from - count, 0)

    def _trim(self) -> None:
        """Remove bytes that cannot be the start of a boundary or a frame."""
        spare = len(self._buffer) - self._tail - 1
        if spare > 0:
            self._skip_bytes += spare
            self._take(spare)


class _SegmentWalk:
    """Walks through the segments of a JPEG at the start of a growing buffer."""

    __slots__ = ("_fill", "_packed", "_segments", "place")

    def __init__(self) -> None:
        self.place = 2
        self._packed = False  # whether the position is within compressed data
        self._segments = 0
        self._fill = 0

    def advance(self, data: bytearray, limit: int) -> int:
        """Return the length of the frame, 0 if more bytes are needed, or -1 if it is invalid.

        Args:
            data: Buffer that starts with the first byte of the frame.
            limit: Number of bytes in the buffer to examine.
        """
        while self.place + 2 <= limit:
            if self._packed:
                match = _MARKER.search(data, self.place, limit)
                self.place = match.start() if match else limit - 1
                del match  # a match holds the buffer, which then could not grow
                self._packed = self.place == limit - 1
                continue
            if data[self.place] != 0xFF:
                return -1
            kind = data[self.place + 1]
            if kind == 0xD9:
                return self.place + 2
            if kind == 0xFF and self._fill < _MAX_FILL:
                self._fill += 1
                self.place += 1
            elif self.place + 4 > limit:
                return 0
            elif not self._segment(kind, int.from_bytes(data[self.place + 2 : self.place + 4])):
                return -1
        return 0

    def _segment(self, kind: int, length: int) -> bool:
        """Skip a segment, and return False if it is invalid."""
        self._segments += 1
        if kind < 0xC0 or 0xD0 <= kind <= 0xD8 or kind == 0xFF:
            return False
        if length < 2 or self._segments > _MAX_SEGMENTS:
            return False
        self.place += 2 + length
        self._packed = kind == 0xDA
        return True


def jpeg_size(jpeg: bytes) -> tuple[int, int] | None:
    """Return the number of rows and columns in a frame without decoding it.

    Returns:
        Rows and columns, or None for anything but a sequential Huffman-coded JPEG with 8 bits and
        one or three channels, the only kind that cameras stream. A progressive JPEG with many scans
        could take minutes to decode.
    """
    place = 2 if jpeg.count(b"\xff\xda") <= _MAX_SCANS else len(jpeg)
    for _ in range(_MAX_SEGMENTS):
        head = jpeg[place : place + 10]
        if len(head) < 10 or head[0] != 0xFF:
            return None
        kind, length = head[1], int.from_bytes(head[2:4])
        if 0xC0 <= kind <= 0xCF and kind not in (0xC4, 0xC8, 0xCC):
            rows, columns = int.from_bytes(head[5:7]), int.from_bytes(head[7:9])
            valid = kind <= 0xC1 and head[4] == 8 and head[9] in (1, 3) and rows and columns
            return (rows, columns) if valid else None
        place += 1 if kind == 0xFF else 2 + length
    return None


def decode(jpeg: bytes) -> NDArray[np.uint8] | None:
    """Decode an untrusted frame in the caller's thread.

    Keep the array until the next frame is decoded, because allocating memory for every frame can
    take as long as decoding it.

    Returns:
        (H, W, 3) uint8 sRGB in RGB order, or None if the frame is larger than `MAX_SHAPE` or not a
        valid JPEG. The orientation in the file is ignored.
    """
    shape = jpeg_size(jpeg)
    if shape is None or shape[0] > MAX_SHAPE[0] or shape[1] > MAX_SHAPE[1]:
        return None
    try:
        picture = cv2.imdecode(
            np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR_RGB | cv2.IMREAD_IGNORE_ORIENTATION
        )
    except cv2.error:
        return None
    whole = picture is not None and picture.shape == (*shape, 3)
    return np.asarray(picture, np.uint8) if whole else None
