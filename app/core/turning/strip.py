"""The geometry of the panorama strip: where turns, frames and labels lie on it.

The strip is centred on the background at the goal and spans 150 deg; the scale underneath counts
the turn and has the same edges. Turns grow to the right, as the background's azimuth does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from app.core.angles import difference, wrap
from app.core.turning.headings import background_azimuth
from app.core.turning.views import Picture, strip_view
from app.core.turning.words import whole

__all__ = ["SIZE", "WIDE_DEG", "Frame", "Strip"]

SIZE: Final = (824, 220)
"""Columns and rows of the strip at the usual size of the window."""

WIDE_DEG: Final = 150.0
"""From edge to edge of the strip."""


@dataclass(frozen=True, slots=True)
class Frame:
    """What a camera sees, on the strip; pixels from its upper left corner.

    Attributes
    ----------
    left, right : float
        May lie outside of the strip.
    top, bottom : float
        Within the strip.
    """

    left: float
    top: float
    right: float
    bottom: float


@dataclass(frozen=True, slots=True)
class Strip:
    """A strip of the panorama around the background at a turn.

    Attributes
    ----------
    centre_deg : float
        Turn in the middle, deg.
    size : tuple[int, int]
        Columns and rows.
    wide_deg : float
        From edge to edge, deg.
    """

    centre_deg: float
    size: tuple[int, int] = SIZE
    wide_deg: float = WIDE_DEG

    def x_of(self, turn_deg: float) -> float:
        """Return where a turn's background lies, pixels from the left edge.

        Parameters
        ----------
        turn_deg : float
            Deg. Turns off the strip come out left of 0 or right of its width, on the side that
            is nearer.
        """
        return self.size[0] * (0.5 + difference(turn_deg, self.centre_deg) / self.wide_deg)

    def turn_at(self, x: float) -> float:
        """Return the turn at a place of the strip, in (-180, 180] deg.

        Parameters
        ----------
        x : float
            Pixels from the left edge.
        """
        return wrap(self.centre_deg + (x / self.size[0] - 0.5) * self.wide_deg)

    def shows(self, turn_deg: float) -> bool:
        """Tell whether a turn's background is on the strip.

        Parameters
        ----------
        turn_deg : float
            Deg.
        """
        return 0.0 <= self.x_of(turn_deg) <= self.size[0]

    def frame(self, turn_deg: float, fov_deg: float, aspect: float) -> Frame:
        """Return the frame around what a camera sees behind the sitter at a turn.

        Parameters
        ----------
        turn_deg : float
            Deg.
        fov_deg : float
            Horizontal field of view in the panorama, that is, widened by the camera's distance
            (`app.core.turning.headings.widened_fov`), deg.
        aspect : float
            Columns over rows of the camera's picture.

        Returns
        -------
        Frame
        """
        middle, width = self.x_of(turn_deg), self.size[0] * fov_deg / self.wide_deg
        radian = self.size[0] / math.radians(self.wide_deg)
        tall = math.tan(math.radians(fov_deg) / 2.0) / aspect * radian
        reach = min(tall, self.size[1] / 2.0)
        centre = self.size[1] / 2.0
        return Frame(middle - width / 2.0, centre - reach, middle + width / 2.0, centre + reach)

    def spans(self, arc_deg: tuple[float, float]) -> tuple[tuple[float, float], ...]:
        """Return the pieces of an arc that are on the strip.

        Parameters
        ----------
        arc_deg : tuple of float
            (from, to), deg, going clockwise; may wrap. (-180, 180) is the whole circle.

        Returns
        -------
        tuple of (left, right)
            Pixels; none, one, or two where an arc reaches around the circle.
        """
        start, stop = arc_deg
        length = 360.0 if stop - start >= 360.0 else (stop - start) % 360.0
        begin = difference(start, self.centre_deg)
        pieces = []
        for first in (begin - 360.0, begin, begin + 360.0):
            left = max(first, -self.wide_deg / 2.0)
            right = min(first + length, self.wide_deg / 2.0)
            if right > left:
                scale = self.size[0] / self.wide_deg
                middle = self.size[0] / 2.0
                pieces.append((middle + left * scale, middle + right * scale))
        return tuple(pieces)

    def ticks(
        self, step: int = 15, apart: tuple[float, ...] = (), room_deg: float = 14.0
    ) -> tuple[tuple[float, int, bool], ...]:
        """Return the ticks of the scale, from left to right.

        Parameters
        ----------
        step : int, optional
            Whole degrees from tick to tick; a divisor of 360.
        apart : tuple of float, optional
            Turns of markers (now, goal) that labels make way for, deg.
        room_deg : float, optional
            How near a label may come to a marker, deg.

        Returns
        -------
        tuple of (x, turn, labelled)
            Pixels from the left edge, whole degrees in (-180, 180], and whether its number fits.
        """
        ticks = []
        for number in range(-180 + step, 181, step):
            turn = whole(number)
            if self.shows(turn):
                free = all(abs(difference(turn, marker)) >= room_deg for marker in apart)
                ticks.append((self.x_of(turn), turn, free))
        return tuple(sorted(ticks))

    def picture(self, panorama: Picture, front_deg: float = 0.0) -> Picture:
        """Take the strip's picture of a panorama.

        Parameters
        ----------
        panorama : (H, W, C) uint8 or float32
            Equirectangular, 2:1.
        front_deg : float, optional
            Panorama azimuth at which the photographer stands at turn 0, deg.

        Returns
        -------
        Same type, (rows, columns, C)
        """
        azimuth = background_azimuth(self.centre_deg, front_deg)
        return strip_view(panorama, azimuth, self.size, self.wide_deg)
