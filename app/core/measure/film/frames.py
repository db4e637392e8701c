"""Read the frames of a video file, with their times."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bytes
from app.core.base.imaging.video import (
    LARGEST,
    VideoError,
    as_rgb,
    check_video,
    fitted,
    not_a_video,
    open_url,
)
from app.core.base.native import native_path
from app.core.measure.film.movie_header import read_movie_header
from app.core.text import tr

_USUAL_FPS: Final = 25.0
_MOST_FPS: Final = 240.0
_LONGEST_FILM_S: Final = 300.0


def film_frames(path: Path, most: int, width: int) -> Iterator[tuple[float, float, Bytes]]:
    """Yield about `most` evenly spaced frames of a video, reduced to at most `width` columns.

    Each item consists of the time since the first frame in seconds, from the file's timestamps; the
    fraction of the video played so far; and the picture, (H, W, 3) uint8.

    Raises:
        VideoError: If the file is not a video ("bad-file"), does not exist ("no-file"), or is too
            long.
    """
    check_video(path)
    capture = open_url(native_path(path.resolve()))
    try:
        rate, count = (capture.get(p) for p in (cv2.CAP_PROP_FPS, cv2.CAP_PROP_FRAME_COUNT))
        sides = [capture.get(p) for p in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)]
        if not (capture.isOpened() and all(0 < side <= LARGEST for side in sides)):
            raise not_a_video(path)
        rate = rate if math.isfinite(rate) and 1.0 <= rate <= _MOST_FPS else _USUAL_FPS
        if not 0 < count <= _LONGEST_FILM_S * rate:
            raise VideoError(
                tr("{name} is longer than five minutes or does not record its length.",
                   name=path.name),
                tr("Film a single turn of 20 to 60 seconds."),
            )  # fmt: skip
        upright = read_movie_header(path).upright
        for time_s, share, picture in _evenly(capture, rate, max(round(count), 1), most, width):
            yield time_s, share, upright(picture)
    finally:
        capture.release()


def _evenly(
    capture: cv2.VideoCapture, rate: float, count: int, most: int, width: int
) -> Iterator[tuple[float, float, Bytes]]:
    indices = set(np.unique(np.linspace(0, count - 1, min(most, count)).astype(int)).tolist())
    clock = FrameClock(rate)
    for number in range(count):
        # An unused frame does not have to be converted to RGB.
        if not capture.grab():
            return
        time_s = clock.time_of(capture.get(cv2.CAP_PROP_POS_MSEC) / 1000.0)
        if number not in indices:
            continue
        done, picture = capture.retrieve()
        image = as_rgb(picture) if done and picture is not None else None
        if image is not None:
            yield time_s, (number + 1) / count, fitted(image, width)


class FrameClock:
    """The times of a video's frames, in seconds since the first, from the file's timestamps.

    If a timestamp is missing, not later than the previous one, or later by more than the longest
    possible video, the frame counts as one frame later at the mean rate. The times therefore always
    increase.
    """

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._stamp_s: float | None = None
        self._time_s = 0.0

    def time_of(self, stamp_s: float) -> float:
        """Return the time of the next frame, given its timestamp."""
        if self._stamp_s is not None:
            step = stamp_s - self._stamp_s
            self._time_s += step if 0.0 < step <= _LONGEST_FILM_S else 1.0 / self._rate
        self._stamp_s = stamp_s
        return self._time_s
