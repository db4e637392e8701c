"""The live preview of a simulated camera: a loop of frames showing its scene, for one client.

The exposure is that of the automatic program, in which lamps, windows and the sun clip. A row of
dark and light blocks at the bottom encodes the number of each frame, and a small dot moves along
the horizon to make the age of a frame visible. Neither is bright enough to count as a lamp. Each
frame is encoded only once.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.colour import FloatImage
from app.devices.clock import Clock
from app.devices.simulated.cameras import GENERIC, CameraModel, Personality
from app.devices.simulated.exchange import LATENCY_S, JsonValue, Pause, Piece, Reply
from app.devices.simulated.exposure_maker import ShotOptions, develop, jpeg
from app.devices.simulated.optics import meter
from app.devices.simulated.options import whole

LOOP: Final = 32
"""Number of different frames. Their numbers run from 0 to 31 and repeat."""

PREVIEW_HEADERS: Final = (
    ("Content-Type", 'multipart/x-mixed-replace; boundary="---osclivepreview---"'),
    ("X-Content-Type-Options", "nosniff"),
)
"""Headers of the reply, which is sent in chunks because its length is unknown."""

# The boundary omits the two dashes that the standard requires before it.
_PART: Final = b"---osclivepreview---\r\nContent-type: image/jpeg\r\nContent-Length: %d\r\n\r\n"
BLOCKS: Final = 16
_LARGE: Final = 256
_DARK, _LIGHT = 16, 208  # byte values of the blocks
BITS: Final = 6
_QUALITY: Final = 80
_LATE_S: Final = 0.5  # seconds; a sender later than this skips frames


class LivePicture:
    """The loop of frames at one size. Each frame is encoded when it is first used.

    Args:
        environment: (H, 2 H, 3) float32. Linear light in any unit, to be metered and clipped.
        shape: Rows and columns, at least 32 by 64. A square frame shows the front lens's view.
    """

    def __init__(
        self, environment: FloatImage, shape: tuple[int, int], camera: CameraModel = GENERIC
    ) -> None:
        if shape[0] < 32 or shape[1] < 64:
            raise ValueError("a preview has at least 32 rows and 64 columns")
        rows, columns = shape
        whole = ShotOptions(shape=(rows, 2 * rows))
        still = develop(environment, camera, meter(environment, camera), whole)
        self._still = still if columns == 2 * rows else still[:, rows // 2 : rows // 2 + columns]
        self._frames: dict[int, bytes] = {}
        self._lock = threading.Lock()

    def frame(self, number: int) -> bytes:
        """Return one frame as a JPEG."""
        number %= LOOP
        with self._lock:
            if number not in self._frames:
                self._frames[number] = jpeg(self._with_mark(number), _QUALITY)
            return self._frames[number]

    def _with_mark(self, number: int) -> NDArray[np.uint8]:
        picture = self._still.copy()
        rows, columns = picture.shape[:2]
        centre = (round(columns * (number + 0.5) / LOOP), rows // 2)
        cv2.circle(picture, centre, rows // 96 + 2, (_LIGHT,) * 3, -1, cv2.LINE_AA)
        cv2.circle(picture, centre, rows // 96 + 2, (_DARK,) * 3, max(rows // 200, 1), cv2.LINE_AA)
        for index, bit in enumerate(pattern(number)):
            box = np.s_[-mark_rows(rows) :, edge(index, columns) : edge(index + 1, columns)]
            picture[box] = _LIGHT if bit else _DARK
        return picture


def preview_pieces(picture: LivePicture, fps: float, clock: Clock) -> Iterator[Piece]:
    """Yield the endless body of a preview: for each part, its header, its frame and a pause.

    Args:
        fps: Frames per second, greater than 0.
        clock: Clock that times each frame. A late frame does not delay the next one.
    """
    number = 0
    due = clock.now()
    while True:
        data = picture.frame(number)
        yield _PART % len(data)
        yield data + b"\r\n"
        number += 1
        due += 1.0 / fps
        late = clock.now() - due
        if late > _LATE_S:
            # A camera does not keep frames that it cannot send in time.
            misses = int(late * fps)
            number, due = number + misses, due + misses / fps
        yield Pause(max(due - clock.now(), 0.0))


def pattern(number: int) -> list[int]:
    """Return the blocks in order: white, black, the number, its complement, black, white."""
    bits = [number >> place & 1 for place in range(BITS)]
    return [1, 0, *bits, *(1 - bit for bit in bits), 0, 1]


def mark_rows(rows: int) -> int:
    """Return the height of the blocks, in rows."""
    # High enough to be read, but inconspicuous in full screen.
    return max(rows // (32 if rows < _LARGE else 96), 2)


def edge(index: int, columns: int) -> int:
    """Return the first column of a block."""
    return index * columns // BLOCKS


class PreviewBody:
    """The body of one preview, which ends when the camera closes it."""

    def __init__(self, gate: PreviewGate, pieces: Iterator[Piece]) -> None:
        self._gate = gate
        self._pieces = pieces

    def __iter__(self) -> Iterator[Piece]:
        return self

    def __next__(self) -> Piece:
        if self._gate.body is not self:
            self.close()
            raise StopIteration
        return next(self._pieces)

    def close(self) -> None:
        """Release the preview."""
        self._gate.closed(self)
        close = getattr(self._pieces, "close", None)
        if close is not None:
            close()

    def __del__(self) -> None:
        self._gate.closed(self)


class PreviewGate:
    """Allows one preview at a time."""

    def __init__(
        self,
        environment: FloatImage,
        person: Personality,
        clock: Clock,
        options: Mapping[str, JsonValue],
    ) -> None:
        self._environment = environment
        self._person = person
        self._clock = clock
        self._options = options
        self.body: PreviewBody | None = None
        self._pictures: dict[tuple[int, int], LivePicture] = {}

    def open(self) -> Reply:
        """Start a preview and return its reply."""
        size = self._options["previewFormat"]
        assert isinstance(size, dict)
        width, height, rate = (whole(size[key]) for key in ("width", "height", "framerate"))
        if not width:
            width, height, rate = 1024, 512, 30
        picture = self._pictures.get((height, width))
        if picture is None:
            picture = LivePicture(self._environment, (height, width), self._person.camera)
            self._pictures[height, width] = picture
        pieces = preview_pieces(picture, rate, self._clock)
        self.body = self.make_body(pieces)
        return Reply(200, PREVIEW_HEADERS, self.body, LATENCY_S)

    def make_body(self, pieces: Iterator[Piece]) -> PreviewBody:
        """Return the body of a new preview."""
        return PreviewBody(self, pieces)

    def close(self) -> None:
        """End the preview if one is open."""
        if self.body is not None:
            self.closed(self.body)

    def closed(self, body: PreviewBody) -> None:
        """Record the end of a preview."""
        if self.body is body:
            self.body = None
