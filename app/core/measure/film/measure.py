"""Measure the light from a video of a turning sitter, using the face and the surroundings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from app.core.base.progress import Report, Token, silent
from app.core.measure.film.film import MOST_FRAMES, WIDTH, Film, flipped, read_film
from app.core.measure.film.frames import film_frames
from app.core.measure.film.movie_header import read_movie_header
from app.core.measure.film.remarks import FrontCamera
from app.core.measure.finish.corrections import FinishedLight
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions, WayOptions
from app.core.measure.read.frame import Bracket, MergedLight


@dataclass(frozen=True, slots=True)
class FilmOptions(WayOptions):
    """Options for a video.

    Attributes:
        film: The result of a video that was read during recording, or None if there is none.
    """

    film: Film | None = None


def measure(
    files: Sequence[Path],
    options: MeasureOptions | None = None,
    token: Token | None = None,
    report: Report = silent,
) -> Measurement:
    """Measure the light from one video, with azimuth 0 at the lens's position in the first frame.

    The errors are those of `measurement.Entry`, plus a `ProbeError` if no face is visible or
    nothing turns.
    """
    options, token = options or MeasureOptions(), token or Token()
    (video,) = files
    film = options.of(FilmOptions).film
    if film is None:
        frames = film_frames(video, MOST_FRAMES, WIDTH)
        film = read_film(flipped(frames) if options.mirrored else frames, token, report)
    none = np.zeros(film.radiance.shape[:2], np.float32)
    light = MergedLight(film.radiance, none, none, reference_ev=0.0, clip_level=1.0)
    front = not options.mirrored and read_movie_header(video).front_camera
    return Measurement(
        way="film",
        bracket=Bracket((), (), unstitched=True),
        finished=FinishedLight(light, light),
        warnings=(*film.notes, *[FrontCamera()] * front),
        own=film,
    )
