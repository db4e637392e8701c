"""The frames of a capture, with one tile per exposure."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from app.core.base.phrases import shutter_words
from app.core.places.place import Place
from app.core.text import tr
from app.ui.screens.probe.capture.plans import PLAN_TITLES
from app.words.phrases.quantities import ev_words


@dataclass(frozen=True, slots=True)
class FrameTile:
    """One exposure.

    Attributes:
        ev, shutter, clipped: Display text such as "+2 EV", "1/15 s" and "41% clipped". Each is an
            empty string if its value is unknown.
        picture: Thumbnail, (h, 2 h, 3) uint8 sRGB, or None if there is none. It is ignored in
            comparisons.
        arrived: Fraction of the file received, from 0 to 1.
    """

    ev: str = ""
    shutter: str = ""
    clipped: str = ""
    clipped_brief: str = ""
    picture: NDArray[np.uint8] | None = field(default=None, compare=False, repr=False)
    arrived: float = 1.0
    spoken: str = ""


def tile_of(
    ev: float, shutter_s: float, clipped: float | None, picture: object = None, arrived: float = 1.0
) -> FrameTile:
    """Describe an exposure. `clipped` is its clipped fraction, or None while that is unknown."""
    words = ev_words(ev), shutter_words(shutter_s) if shutter_s else ""
    clip, brief = ("", "") if clipped is None else _clip_words(clipped)
    return FrameTile(
        *words,
        clipped=clip,
        clipped_brief=brief,
        picture=picture,  # type: ignore[arg-type]
        arrived=arrived,
        spoken=", ".join(part for part in (*words, clip) if part),
    )


def _clip_words(share: float) -> tuple[str, str]:
    """Return the clipped fraction of a frame as text, in full and shortened for a narrow tile."""
    if share <= 0.0:
        return tr("nothing clipped"), tr("nothing")
    of_hundred = 100.0 * share
    number = f"{of_hundred:.1f}%" if of_hundred < 9.95 else f"{round(of_hundred)}%"
    brief = tr("under 0.1%") if of_hundred < 0.1 else number
    return tr("{share} clipped", share=brief), brief


def frames_note(place: Place, today: datetime) -> str:
    """Return a note on how the frames were taken, such as "ISO 100, f/2, taken 14:05"."""
    capture = place.capture
    if capture is None or not capture.frames:
        return ""
    isos = {frame.iso for frame in capture.frames}
    apertures = {frame.aperture for frame in capture.frames}
    parts = [f"ISO {iso:g}" for iso in isos if len(isos) == 1 and iso > 0]
    parts += [f"f/{stop:g}" for stop in apertures if len(apertures) == 1 and stop > 0]
    if place.measured_at is not None and capture.plan in PLAN_TITLES:
        moment = place.measured_at.astimezone(today.tzinfo)
        parts.append(tr("taken {time}", time=f"{moment:%H:%M}"))
    return ", ".join(parts)
