"""How likely a heading is right: within 3 deg of the truth, of a camera on the sitter's line.

Three things can go wrong. The picture shows something else: against that speak how many points
agree, how widely they are spread, and how much better the whole picture fits there than beside
(`app.core.localization.heading`). It shows this place from beside the line through the
sitter: against that, that no camera which stands elsewhere explains more
(`app.core.localization.parallax`), and slopes that a room has. Or the place is right and the angle
is not: that is the standard error of the fit. The three are independent:

    P = 1 / (1 + exp(-p)) * 1 / (1 + exp(-l)) * (1 - exp(-3 deg / (k error))).

Errors have longer tails than a normal distribution's, as matches that are wrong are wrong together.

p and l are sums over the evidence, `place_signs` and `line_signs`, with weights in their order.
They and k are by greatest likelihood over photographs and live pictures, at the spot, beside it and
of other places (`benchmarks/confidence_fit.py`). `docs/heading.md` says how that holds elsewhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

CLOSE_DEG: Final = 3.0
"""A heading counts as right up to this error."""

LEAST_CONFIDENCE: Final = 0.8
"""With less a heading is not shown."""

PLACE_SIGNS: Final = ("one", "points", "support", "spread", "share", "strays")
LINE_SIGNS: Final = (
    "one", "points", "freed", "aside", "tilt", "steep", "odd", "flat", "loose",
)  # fmt: skip
"""What the numbers of `place_signs` and `line_signs` are of."""

_PLACE_WEIGHTS: Final = (3.75, 0.36, 0.24, 1.52, 4.37, -1.0)
_LINE_WEIGHTS: Final = (3.49, 0.22, -0.69, -0.78, -2.66, -6.57, -3.0, -9.58, -0.78)
_GUIDED: Final = (1.5, 2.0)  # odds for place, and for line with another lens, as logarithms
_ERROR_FACTOR: Final = (0.82, 0.5)  # of photographs, and of live pictures
_SPREAD: Final = (0.05, 0.5)
_SUPPORT: Final = (-2.0, 15.0)
_POINTS: Final = 100  # many more come from a picture of many, true or not
_SHARE: Final = (0.02, 0.4)  # more depends on the camera
_TILT: Final = (0.55, 1.5)  # less is that of any wall
_STEEP: Final = (0.9, 3.0)  # slope over enlargement: less is that of a room behind the sitter
_FREED: Final = (0.7, 15.0)  # less is by chance
_ASIDE: Final = (1.0, 12.0)
_STRAYS: Final = 0.2  # as many are there by chance
_FLAT: Final = 0.7
_LOOSE_DEG: Final = (0.3, 2.0)
_LEAST_ERROR_DEG: Final = 0.05
_WIDE: Final = (0.315, 1.036)  # half angles of 17.5 and 46 deg: tangents of usual lenses
_LEAST_ZOOM: Final = 0.8  # things look larger from the probe, unless the field of view is wrong


@dataclass(frozen=True, slots=True)
class Evidence:
    """What speaks for a pose.

    Attributes:
        share: Of the points that look like one thing in the panorama only, those that agree, 0 to
            1.
        spread: Standard deviation of the points that agree, in half widths of the picture, in the
            direction in which it is least: 0 on a line.
        error_deg: Standard error of the heading, deg.
        wide: Tangent of half the field of view along the longer side, where it is estimated; None
            where it is known.
        strays: Of the certain matches about where the pose says, those that do not agree, 0 to 1.
        loose_deg: Likewise, deg.
        guided: Whether it is a live picture: of this place, and by someone who follows the way
            shown.
    """

    points: int
    share: float
    spread: float
    support: float
    error_deg: float
    tilt: float = 0.0
    zoom: float = 1.0
    wide: float | None = None
    strays: float = 0.0
    freed: float = 0.0
    aside: float = 0.0
    loose_deg: float = 0.0
    flat: float = 0.0
    agree: float = 0.0
    guided: bool = False


def place_signs(evidence: Evidence) -> tuple[float, ...]:
    """Return what says that a picture shows this place, in the order of `PLACE_SIGNS`."""
    share = _within(evidence.share, _SHARE)
    return (
        1.0,
        _points(evidence),
        _within(evidence.support, _SUPPORT),
        math.log(_within(evidence.spread, _SPREAD)),
        math.log(share / (1.0 - share)),
        max(evidence.strays - _STRAYS, 0.0),
    )


def line_signs(evidence: Evidence) -> tuple[float, ...]:
    """Return what says that a camera is on the sitter's line, in the order of `LINE_SIGNS`."""
    steep = evidence.tilt / (max(evidence.zoom - 1.0, 0.0) + 0.2)
    free = evidence.wide is not None
    wide = max(evidence.wide or 0.0, 0.01)
    odd = max(math.log(_WIDE[0] / wide), math.log(wide / _WIDE[1]), 0.0) if free else 0.0
    return (
        1.0,
        _points(evidence),
        _beyond(evidence.freed, _FREED),
        _beyond(evidence.aside, _ASIDE),
        _beyond(evidence.tilt, _TILT),
        _beyond(steep, _STEEP),
        odd,
        max(evidence.flat - _FLAT, 0.0) if free else 0.0,
        _within(evidence.loose_deg, _LOOSE_DEG) - _LOOSE_DEG[0] if free else 0.0,
    )


def deviation_deg(evidence: Evidence) -> float:
    """Return the standard error of the heading before it is scaled, deg."""
    return max(evidence.error_deg, _LEAST_ERROR_DEG)


def trust(evidence: Evidence) -> float:
    """Return the probability that a heading is right.

    Returns:
        0 to 1; the heading of about nine in ten with 0.9 is within 3 deg.
    """
    if evidence.points < 1 or evidence.zoom < _LEAST_ZOOM:
        return 0.0
    here, aligned = _GUIDED if evidence.guided else (0.0, 0.0)
    place = _likely(_PLACE_WEIGHTS, place_signs(evidence), here)
    line = _likely(_LINE_WEIGHTS, line_signs(evidence), 0.0 if evidence.wide is None else aligned)
    factor = _ERROR_FACTOR[evidence.guided]
    close = -math.expm1(-CLOSE_DEG / (factor * deviation_deg(evidence)))
    return place * line * close


def _likely(weights: tuple[float, ...], signs: tuple[float, ...], before: float = 0.0) -> float:
    z = before + math.fsum(w * sign for w, sign in zip(weights, signs, strict=True))
    return 1.0 / (1.0 + math.exp(-_within(z, (-50.0, 50.0))))


def _points(evidence: Evidence) -> float:
    return math.log(min(evidence.points, _POINTS))


def _within(value: float, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0]), limits[1])


def _beyond(value: float, limits: tuple[float, float]) -> float:
    return _within(value, limits) - limits[0]
