"""How likely a heading is right: within 3 deg of the truth.

Two things can go wrong. The picture shows something else, and a few points agree by chance or
because things stand twice; against that speak how many points agree, and how much better the whole
picture fits there than beside (`app.core.turning.support`). Or the place is right and the angle is
not, because the points do not tell a turn from a step aside; that is the standard error of the fit.
The two are independent:

    P = 1 / (1 + exp(-z)) * erf(3 deg / (sqrt(2) k error)).

z is a sum over the evidence, `signs`, with weights by greatest likelihood over pictures with known
headings, over pictures of what is not in the panorama, and over pictures taken metres away, where
some things can still be seen but nothing is where it should be (`benchmarks/heading.py`,
`docs/heading.md`). They are tested on other places and other pictures.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

__all__ = [
    "CLOSE_DEG",
    "LEAST_CONFIDENCE",
    "SET_WEIGHTS",
    "Evidence",
    "deviation_deg",
    "objections",
    "signs",
    "trust",
]

CLOSE_DEG: Final = 3.0
"""A heading counts as right up to this error."""

LEAST_CONFIDENCE: Final = 0.8
"""With less a heading is not shown."""

SET_WEIGHTS: Final = (0.3, 0.25)
"""Of points and support: set by hand, since patterns that deceive the matching are too rare in the
pictures for a fit, which would give them next to no weight and be hardly any better."""

_WEIGHTS: Final = (-0.33, *SET_WEIGHTS, 0.5, 1.57, -15.26)  # in the order of `signs`
_ERROR_FACTOR: Final = 1.11
_SPREAD: Final = (0.01, 0.5)
_SUPPORT: Final = (-2.0, 10.0)
_POINTS: Final = 25
_SHARE: Final = (0.02, 0.98)
_TILT: Final = (0.6, 1.5)  # less is that of any wall
_LEAST_ERROR_DEG: Final = 0.05
_WIDE: Final = (0.315, 1.036)  # half angles of 17.5 and 46 deg: tangents of usual lenses
_ODD: Final = 10.0
_STRAYS: Final = 0.12  # as many are there by chance
_STRAY: Final = 8.0
_LEAST_ZOOM: Final = 0.8  # things look larger from the probe, unless the field of view is wrong


@dataclass(frozen=True, slots=True)
class Evidence:
    """What speaks for a pose.

    Attributes
    ----------
    points : int
        Things in the panorama that points of the picture agree with.
    share : float
        Of the points that look like one thing in the panorama only, those that agree, 0 to 1.
    spread : float
        Standard deviation of the points that agree, in half widths of the picture, in the
        direction in which it is least: 0 on a line.
    support : float
        By `app.core.turning.support.support`.
    error_deg : float
        Standard error of the heading, deg.
    tilt : float
        How much the enlargement changes over the picture, per unit of its plane.
    zoom : float
        The enlargement in its middle; its inverse for a camera that looks away from the sitter.
    wide : float or None
        Tangent of half the field of view along the longer side, where it is estimated; None where
        it is known.
    strays : float
        Of the certain matches about where the pose says, those that do not agree, 0 to 1.
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


def signs(evidence: Evidence) -> tuple[float, ...]:
    """Return the evidence as numbers that weights are for, the first of them 1.

    Parameters
    ----------
    evidence : Evidence
        With at least one point.
    """
    share = _within(evidence.share, _SHARE)
    return (
        1.0,
        math.log(min(evidence.points, _POINTS)),
        _within(evidence.support, _SUPPORT),
        math.log(_within(evidence.spread, _SPREAD)),
        math.log(share / (1.0 - share)),
        _within(evidence.tilt, _TILT) - _TILT[0],
    )


def objections(evidence: Evidence) -> float:
    """Return what is taken off z for what a wrong place shows more often than a right one.

    Seen from metres away, or of another wall like it, some things agree and those beside them are
    not quite where they should be: strays. And a picture taken nearer to a wall than the probe was,
    or further from it, shows it like another lens would: where the field of view is estimated, one
    that hardly any camera has (beyond 35 to 92 deg along the longer side) needs the more evidence
    the odder it is. Both are set by hand, from pictures of the bundled building.

    Parameters
    ----------
    evidence : Evidence
        Of the pose.
    """
    taken = _STRAY * max(evidence.strays - _STRAYS, 0.0)
    if evidence.wide is None:
        return taken
    wide = max(evidence.wide, 0.01)
    return taken + _ODD * max(math.log(_WIDE[0] / wide), math.log(wide / _WIDE[1]), 0.0)


def deviation_deg(evidence: Evidence) -> float:
    """Return the standard error of the heading before it is scaled, deg.

    Parameters
    ----------
    evidence : Evidence
        Of the pose.
    """
    return max(evidence.error_deg, _LEAST_ERROR_DEG)


def trust(evidence: Evidence) -> float:
    """Return the probability that a heading is right.

    Parameters
    ----------
    evidence : Evidence
        For it.

    Returns
    -------
    float
        0 to 1; the heading of about nine in ten with 0.9 is within 3 deg.
    """
    if evidence.points < 1 or evidence.zoom < _LEAST_ZOOM:
        return 0.0
    z = math.fsum(w * sign for w, sign in zip(_WEIGHTS, signs(evidence), strict=True))
    z -= objections(evidence)
    close = math.erf(CLOSE_DEG / (math.sqrt(2.0) * _ERROR_FACTOR * deviation_deg(evidence)))
    return close / (1.0 + math.exp(-_within(z, (-50.0, 50.0))))


def _within(value: float, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0]), limits[1])
