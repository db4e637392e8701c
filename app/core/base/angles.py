"""Angles about the vertical: wrapping, the turns of the search grid, and the names of directions.

All angles are in degrees. A turn is the sitter's rotation, positive clockwise as seen from above.
At turn 0 the sitter faces the panorama's centre column.
"""

from __future__ import annotations

import math
from typing import Final, Literal, TypeAlias

TURNS: Final = 64
"""Number of turns in the search grid, one for each column of a 64 x 32 environment."""

_NO_TURN_DEG = 0.05  # smaller turns appear as 0.0 in a table with one decimal


Direction: TypeAlias = Literal["clockwise", "counter-clockwise", "none"]
"""Direction of a turn, as seen from above."""


def wrap(angle_deg: float) -> float:
    """Wrap an angle to the range (-180, 180].

    The result is exact, without rounding, and ``wrap(-a) == -wrap(a)`` unless the result is 180.

    Args:
        angle_deg: Any finite angle, in degrees.

    Returns:
        The same direction in (-180, 180], in degrees.

    Examples:
        >>> wrap(190.0), wrap(-180.0), wrap(360.0)
        (-170.0, 180.0, 0.0)
    """
    inside = math.remainder(angle_deg, 360.0)
    return 180.0 if inside == -180.0 else inside + 0.0


def difference(a_deg: float, b_deg: float) -> float:
    """Return the clockwise angle from ``b`` to ``a``, in degrees within (-180, 180].

    Args:
        a_deg, b_deg: Two turns or azimuths, in degrees.

    Examples:
        >>> difference(-170.0, 170.0)
        20.0
    """
    return wrap(a_deg - b_deg)


def turn_of_index(index: float, count: int = TURNS) -> float:
    """Return the turn at an index of the search grid.

    Returns:
        The turn, 360 * index / count, in degrees within (-180, 180].

    Examples:
        >>> turn_of_index(1), turn_of_index(63), turn_of_index(32)
        (5.625, -5.625, 180.0)
    """
    return wrap(index * (360.0 / count))


def direction(turn_deg: float) -> str:
    """Return the direction of a turn, as seen from above.

    Args:
        turn_deg: Turn, in degrees.

    Returns:
        ``clockwise`` for a positive turn, ``counter-clockwise`` for a negative one, or ``none`` for
        a turn of less than 0.05 degrees either way.

    Examples:
        >>> direction(12.0), direction(-12.0), direction(0.0), direction(180.0)
        ('clockwise', 'counter-clockwise', 'none', 'clockwise')
    """
    inside = wrap(turn_deg)
    if abs(inside) < _NO_TURN_DEG:
        return "none"
    return "clockwise" if inside > 0 else "counter-clockwise"


def arc_width(arc_deg: tuple[float, float]) -> float:
    """Return the width, from 0 to 360 degrees, of an arc that runs clockwise between its ends.

    Examples:
        >>> arc_width((170.0, -170.0)), arc_width((-180.0, 180.0))
        (20.0, 360.0)
    """
    start, stop = arc_deg
    return 360.0 if stop - start >= 360.0 else (stop - start) % 360.0


def at_turn(centre: tuple[float, float], radius: float, turn_deg: float) -> tuple[float, float]:
    """Return the point that marks a turn on a circle seen from above, with turn 0 at the top.

    Args:
        centre: (x, y), with y pointing down.
        radius: Radius, in the same units as `centre`.
        turn_deg: Turn, in degrees, positive clockwise.

    Examples:
        >>> at_turn((10.0, 10.0), 5.0, 90.0)
        (15.0, 10.0)
    """
    angle = math.radians(turn_deg)
    return centre[0] + radius * math.sin(angle), centre[1] - radius * math.cos(angle)


def lies_on_arc(angle_deg: float, arc_deg: tuple[float, float]) -> bool:
    """Return whether an angle lies on an arc that runs clockwise from its start to its stop.

    Args:
        angle_deg: Angle, in degrees.
        arc_deg: (start, stop), in degrees. The arc may wrap, and (-180, 180) is the whole circle.

    Examples:
        >>> lies_on_arc(179.0, (170.0, -170.0)), lies_on_arc(0.0, (170.0, -170.0))
        (True, False)
    """
    start, stop = arc_deg
    if stop - start >= 360.0:
        return True
    return (angle_deg - start) % 360.0 <= (stop - start) % 360.0


def whole(turn_deg: float) -> int:
    """Round a turn to whole degrees, as shown on screen.

    Args:
        turn_deg: Any finite turn, in degrees, positive clockwise.

    Returns:
        Degrees in (-180, 180]. ``whole(-t) == -whole(t)`` unless the result is 180.

    Examples:
        >>> whole(96.2), whole(-179.7), whole(-0.3), whole(200.0)
        (96, 180, 0, -160)
    """
    return int(wrap(round(wrap(turn_deg))))


def direction_of(turn_deg: float) -> Direction:
    """Round a turn to whole degrees and return its direction.

    Args:
        turn_deg: Turn, in degrees, positive clockwise.

    Returns:
        ``clockwise``, ``counter-clockwise``, or ``none`` for a turn that rounds to 0°. A turn of
        180° counts as clockwise.

    Examples:
        >>> direction_of(12.0), direction_of(-12.0), direction_of(0.4), direction_of(-180.0)
        ('clockwise', 'counter-clockwise', 'none', 'clockwise')
    """
    number = whole(turn_deg)
    if number == 0:
        return "none"
    return "clockwise" if number > 0 else "counter-clockwise"


def ends_of(arc_deg: tuple[float, float]) -> tuple[int, int] | None:
    """Return the ends of an arc, rounded to whole degrees.

    Args:
        arc_deg: (start, stop), in degrees. The arc runs clockwise and may wrap, and (-180, 180) is
            the whole circle.

    Returns:
        The two ends, each in (-180, 180], or None if the arc is the whole circle.
    """
    start, stop = arc_deg
    if stop - start >= 360.0:
        return None
    return whole(start), whole(stop)
