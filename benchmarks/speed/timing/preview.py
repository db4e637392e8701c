"""Time the live preview: finding and decoding a camera's pictures in a stream."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.devices.clock import SystemClock
from app.devices.mjpeg import MjpegParser, decode
from app.devices.simulated.preview import LivePicture, preview_pieces
from benchmarks.speed.timing.runner.rows import Case

if TYPE_CHECKING:
    from numpy.typing import NDArray

_SHAPE: Final = (512, 1024)
_SCENE: Final = "courtyard"
_BOUNDARY: Final = "---osclivepreview---"
_PACKET: Final = 16384
_FPS: Final = 30.0


def preview_case() -> Case:
    """Return the case of one picture of 1,024 x 512 from a stream of packets, decoded.

    ``preview.decode``. Plain code collects bytes and searches for a picture's start and end; its
    limit is decoding alone.
    """
    scene = read_environment(resources() / "demo" / "scenes" / f"{_SCENE}.exr").radiance
    pieces = preview_pieces(LivePicture(scene, _SHAPE), _FPS, SystemClock())
    parts = (piece for piece in pieces if isinstance(piece, bytes))
    part = next(parts) + next(parts)
    packets = [part[at : at + _PACKET] for at in range(0, len(part), _PACKET)]
    # A picture is complete when the next part begins.
    parser = MjpegParser(_BOUNDARY)
    jpeg = np.frombuffer(_picture_in(part), np.uint8)
    kept: list[NDArray[np.uint8]] = []

    def keep(picture: object) -> None:
        # As on a screen: memory freed at once would be requested from the system again each time.
        kept[:] = [np.asarray(picture, np.uint8)]

    def fast() -> None:
        frames = [frame for packet in packets for frame in parser.feed(packet)]
        for frame in frames:
            keep(decode(frame))

    def plain() -> None:
        held = b""
        for packet in packets:
            held += packet
            start, stop = held.find(b"\xff\xd8"), held.find(b"\xff\xd9")
            if 0 <= start < stop:
                found = np.frombuffer(held[start : stop + 2], np.uint8)
                picture = np.asarray(cv2.imdecode(found, cv2.IMREAD_COLOR), np.uint8)
                keep(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))

    return Case(
        "preview.decode",
        fast,
        plain,
        "OpenCV: gather, find, imdecode, swap colours",
        lambda: keep(cv2.imdecode(jpeg, cv2.IMREAD_COLOR_RGB)),
        "imdecode alone",
        most=100,
    )


def _picture_in(part: bytes) -> bytes:
    return part[part.index(b"\xff\xd8") :]
