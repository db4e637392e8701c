"""The one live preview of a simulated camera: whether it is open, and when it ends."""

from __future__ import annotations

from random import Random
from typing import TYPE_CHECKING

from app.devices.simulated.exchange import Reply
from app.devices.simulated.live import PREVIEW_HEADERS, LivePicture, preview_pieces
from app.devices.simulated.replies import LATENCY_S

if TYPE_CHECKING:
    from collections.abc import Iterator

    from app.devices.simulated.camera import SimulatedCamera
    from app.devices.simulated.exchange import Piece


class PreviewBody:
    """The body of one preview; it ends when the camera wants it to."""

    def __init__(self, gate: PreviewGate, pieces: Iterator[Piece], most: int | None) -> None:
        self._gate = gate
        self._pieces = pieces
        self._most = most
        self._sent = 0

    def __iter__(self) -> Iterator[Piece]:
        return self

    def __next__(self) -> Piece:
        if self._gate.body is not self or (self._most is not None and self._sent >= self._most):
            self.close()
            raise StopIteration
        self._sent += 1
        return next(self._pieces)

    def close(self) -> None:
        """Give the preview back."""
        self._gate.closed(self)
        close = getattr(self._pieces, "close", None)
        if close is not None:
            close()

    def __del__(self) -> None:
        self._gate.closed(self)


class PreviewGate:
    """Keeps the preview of a camera to one at a time."""

    def __init__(self, camera: SimulatedCamera) -> None:
        self._camera = camera
        self._dice = Random(f"{camera.personality.name}/preview")  # noqa: S311
        self.body: PreviewBody | None = None
        self._pictures: dict[tuple[int, int], LivePicture] = {}
        self.closed_at = float("-inf")

    def open(self) -> Reply:
        """Begin a preview."""
        camera = self._camera
        size = camera.options["previewFormat"]
        assert isinstance(size, dict)
        width, height, rate = (_whole(size[key]) for key in ("width", "height", "framerate"))
        if not width:
            width, height, rate = 1024, 512, 30
        picture = self._pictures.get((height, width))
        if picture is None:
            picture = LivePicture(camera.scene.environment, (height, width))
            self._pictures[height, width] = picture
        pieces = preview_pieces(picture, rate, camera.clock)
        # An SC2 ends its preview when it likes.
        most = None if camera.personality.keeps_settings else self._dice.randint(300, 1500)
        self.body = PreviewBody(self, pieces, most)
        return Reply(200, PREVIEW_HEADERS, self.body, LATENCY_S)

    def close(self) -> None:
        """End the preview, if there is one."""
        if self.body is not None:
            self.closed(self.body)

    def closed(self, body: PreviewBody) -> None:
        """Note that a preview is over."""
        if self.body is body:
            self.body = None
            self.closed_at = self._camera.clock.now()


def _whole(value: object) -> int:
    return int(value) if isinstance(value, int | float) else 0
