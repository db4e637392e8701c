"""The mapping between angles and pixels, for a moving panorama and for a strip of a panorama.

Azimuths and turns are in degrees and increase clockwise as seen from above, which is to the right
in the picture. Elevations increase upward. Pixels are logical pixels, with y downward. This module
does not use Qt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from app.core.base.angles import arc_width, difference, wrap
from app.words.phrases.turns import signed

ZOOMS: Final = (1.0, 8.0)
"""Minimum and maximum zoom. A zoom of 1 shows the whole panorama."""

SPAN_DEG: Final = 150.0
"""Width of the background strip in degrees."""


@dataclass(frozen=True, slots=True)
class Tick:
    """A tick on a scale, with its label and its distance from the left end in logical pixels."""

    x: float
    label: str


def scale_label(value_deg: float) -> str:
    """Format a value in degrees for a scale, keeping −180° as the label of the left end.

    Examples:
        >>> scale_label(-45.2), scale_label(-180.0), scale_label(180.0)
        ('−45°', '−180°', '180°')
    """
    return "−180°" if value_deg == -180.0 else signed(value_deg)


def label_step(pixels_per_degree: float, room: float) -> int:
    """Return the spacing of the labels on a scale: 1, 5, 15, 45 or 90 degrees.

    `room` is the width that a label needs, in logical pixels.
    """
    steps = (1, 5, 15, 45)
    return next((step for step in steps if step * pixels_per_degree >= room), 90)


@dataclass(frozen=True, slots=True)
class Viewport:
    """The visible part of a panorama, which is set on a ViewBox.

    This class handles wrapping and the poles, which pyqtgraph's ViewBox does not support. The
    azimuth, in (-180, 180], and the elevation are those of the centre, in degrees. `shape` is the
    height of the window divided by its width.
    """

    width: float
    zoom: float = 1.0
    azimuth_deg: float = 0.0
    elevation_deg: float = 0.0
    shape: float = 0.5

    @property
    def height(self) -> float:
        """Height of the window in logical pixels."""
        return self.width * self.shape

    @property
    def scale(self) -> float:
        """Logical pixels per degree, in both directions."""
        return self.width * self.zoom / 360.0

    def x_of(self, azimuth_deg: float) -> float:
        """Return the x coordinate of an azimuth, which may be outside the window.

        An azimuth recurs after every full turn. This method returns the position nearest to the
        centre.
        """
        return self.width / 2.0 + difference(azimuth_deg, self.azimuth_deg) * self.scale

    def xs_of(self, azimuth_deg: float, margin: float = 0.0) -> list[float]:
        """Return the x coordinates of an azimuth inside the window or at most `margin` outside it.

        At zoom 1, the azimuth opposite the centre is at both edges.
        """
        nearest, turn = self.x_of(azimuth_deg), 360.0 * self.scale
        places = (nearest - turn, nearest, nearest + turn)
        return [x for x in places if -margin - 1e-9 <= x <= self.width + margin + 1e-9]

    def azimuth_at(self, x: float) -> float:
        """Return the azimuth at an x coordinate, in (-180, 180] degrees.

        This is the inverse of `x_of`.
        """
        return wrap(self.azimuth_deg + (x - self.width / 2.0) / self.scale)

    def y_of(self, elevation_deg: float) -> float:
        """Return the y coordinate of an elevation, which may be outside the window."""
        return self.height / 2.0 - (elevation_deg - self.elevation_deg) * self.scale

    def elevation_at(self, y: float) -> float:
        """Return the elevation at a y coordinate, in degrees. This is the inverse of `y_of`."""
        return self.elevation_deg - (y - self.height / 2.0) / self.scale

    def moved_to(self, azimuth_deg: float, elevation_deg: float) -> Viewport:
        """Return the view centred on a direction, or as close to it as the poles allow."""
        limit = max(90.0 - self.height / 2.0 / self.scale, 0.0)
        elevation = min(max(elevation_deg, -limit), limit)
        return replace(self, azimuth_deg=wrap(azimuth_deg), elevation_deg=elevation)

    def panned(self, dx: float, dy: float) -> Viewport:
        """Return the view after the picture has moved by (dx, dy) logical pixels."""
        azimuth = self.azimuth_deg - dx / self.scale
        return self.moved_to(azimuth, self.elevation_deg + dy / self.scale)

    def zoomed(self, zoom: float, x: float, y: float) -> Viewport:
        """Return the view zoomed around (x, y), which stays in place as far as the poles allow."""
        new_zoom = min(max(zoom, ZOOMS[0]), ZOOMS[1])
        azimuth, elevation = self.azimuth_at(x), self.elevation_at(y)
        new = replace(self, zoom=new_zoom)
        across, up = (x - self.width / 2.0) / new.scale, (self.height / 2.0 - y) / new.scale
        return new.moved_to(azimuth - across, elevation - up)

    def ticks(self, front_deg: float, step: int, labelled: int) -> list[Tick]:
        """Return the ticks of the scale below the window, numbered from the azimuth `front_deg`."""
        middle = difference(self.azimuth_deg, front_deg)
        half = self.width / 2.0 / self.scale + 1e-9
        first = math.ceil((middle - half) / step)
        last = math.floor((middle + half) / step)
        result = []
        for value in range(first * step, last * step + 1, step):
            label_deg = float(value) if abs(value) <= 180 else wrap(float(value))
            label = scale_label(label_deg) if value % labelled == 0 else ""
            x = self.width / 2.0 + (value - middle) * self.scale
            result.append(Tick(x, label))
        return result


@dataclass(frozen=True, slots=True)
class StripScale:
    """A strip of background of a given width in degrees, centred on the goal.

    The background at turn t is at the azimuth t + 180. Turns therefore increase to the right, or to
    the left if the strip is mirrored.
    """

    width: float
    goal_deg: float
    span_deg: float = SPAN_DEG
    mirrored: bool = False

    @property
    def scale(self) -> float:
        """Logical pixels per degree."""
        return self.width / self.span_deg

    def x_of(self, turn_deg: float) -> float:
        """Return the x coordinate of a turn, which may be off the strip.

        The turn is measured the shorter way from the goal.
        """
        return self._x(difference(turn_deg, self.goal_deg))

    def _x(self, beside_deg: float) -> float:
        """Return the x coordinate of an angle that is measured clockwise from the goal."""
        way = -self.scale if self.mirrored else self.scale
        return self.width / 2.0 + beside_deg * way

    def frame(self, turn_deg: float, fov_deg: float) -> tuple[float, float]:
        """Return the left and right edges of the camera's field of view at a turn, in pixels."""
        x, half = self.x_of(turn_deg), fov_deg * self.scale / 2.0
        return x - half, x + half

    def beyond(self, turn_deg: float) -> int:
        """Return -1 for a turn past the strip's left edge, 1 past its right edge, otherwise 0."""
        x = self.x_of(turn_deg)
        return -1 if x < 0.0 else 1 if x > self.width else 0

    def bands(self, arc_deg: tuple[float, float]) -> list[tuple[float, float]]:
        """Return the edges of each piece of a clockwise arc (from, to) on the strip.

        A wide arc can enter the strip from both sides. The result then has two pieces.
        """
        extent = arc_width(arc_deg)
        if extent >= 360.0:
            return [(0.0, self.width)]
        start = difference(arc_deg[0], self.goal_deg)
        half = self.span_deg / 2.0
        result = []
        for lap in (-360.0, 0.0):
            low, high = max(start + lap, -half), min(start + lap + extent, half)
            if high > low:
                left, right = sorted((self._x(low), self._x(high)))
                result.append((left, right))
        return result

    def ticks(self, step: int, avoid_deg: tuple[float, ...], room_deg: float) -> list[Tick]:
        """Return the ticks, numbered from the goal in both directions without signs.

        Labels closer than `room_deg` to one of the turns in `avoid_deg` are left out.
        """
        last = math.ceil(self.span_deg / 2.0 / step) - 1
        beside = [difference(other, self.goal_deg) for other in avoid_deg]
        return [
            Tick(
                self._x(value),
                f"{abs(value)}°" if all(abs(value - one) >= room_deg for one in beside) else "",
            )
            for value in range(-last * step, last * step + 1, step)
        ]
