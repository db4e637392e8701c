"""How likely a heading is right: within 3 deg of the truth, of a camera on the sitter's line.

Two things can go wrong. The picture shows something else, or this place from beside the line
through the sitter; against that speak how many points agree, how much better the whole picture fits
there than beside (`app.core.turning.support`), that no camera which stands elsewhere explains more
(`app.core.turning.parallax`), and slopes that a room has. Or the place is right and the angle
is not; that is the standard error of the fit. The two are independent:

    P = 1 / (1 + exp(-z)) * erf(3 deg / (sqrt(2) k error)).

z is a sum over the evidence, `signs`, with weights in the order of `signs`. They and k are by
greatest likelihood over photographs and live pictures, at the spot, beside it and of other places
(`benchmarks/confidence_fit.py`). `docs/heading.md` says how that holds elsewhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

__all__ = [
    "CLOSE_DEG",
    "LEAST_CONFIDENCE",
    "SIGNS",
    "Evidence",
    "deviation_deg",
    "signs",
    "trust",
]

CLOSE_DEG: Final = 3.0
"""A heading counts as right up to this error."""

LEAST_CONFIDENCE: Final = 0.8
"""With less a heading is not shown."""

SIGNS: Final = (
    "one", "points", "support", "spread", "share", "strays", "freed", "freed share", "aside",
    "tilt", "steep", "odd", "under", "flat",
)  # fmt: skip
"""What the numbers of `signs` are of."""

_WEIGHTS: Final = (
    0.79, 1.69, 0.01, 2.29, 0.97, -1.0, -0.43, 0.0, -1.97, -0.46, -5.16, -1.0, -7.1, -23.17,
)  # fmt: skip
_ERROR_FACTOR: Final = 1.05
_SPREAD: Final = (0.05, 0.5)
_SUPPORT: Final = (-2.0, 15.0)
_POINTS: Final = 80  # many more come from a picture of many, true or not
_SHARE: Final = (0.02, 0.98)
_TILT: Final = (0.55, 1.5)  # less is that of any wall
_STEEP: Final = (0.9, 3.0)  # slope over enlargement: less is that of a room behind the sitter
_FREED: Final = (0.7, 15.0)  # less is by chance
_FEW: Final = 3.0  # as if so many more points agreed
_ASIDE: Final = (1.0, 12.0)
_STRAYS: Final = 0.2  # as many are there by chance
_FLAT: Final = 0.75
_LEAST_ERROR_DEG: Final = 0.05
_WIDE: Final = (0.315, 1.036)  # half angles of 17.5 and 46 deg: tangents of usual lenses
_UNDER: Final = 0.95
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
    freed, aside, flat, agree : float
        As in `app.core.turning.parallax.Line`; 0 where that was not asked.
    loose_deg : float
        Likewise, deg.
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


def signs(evidence: Evidence) -> tuple[float, ...]:
    """Return the evidence as numbers that weights are for, in the order of `SIGNS`.

    Parameters
    ----------
    evidence : Evidence
        With at least one point.
    """
    share = _within(evidence.share, _SHARE)
    steep = evidence.tilt / (max(evidence.zoom - 1.0, 0.0) + 0.2)
    wide = None if evidence.wide is None else max(evidence.wide, 0.01)
    odd = max(math.log(_WIDE[0] / wide), math.log(wide / _WIDE[1]), 0.0) if wide else 0.0
    return (
        1.0,
        math.log(min(evidence.points, _POINTS)),
        _within(evidence.support, _SUPPORT),
        math.log(_within(evidence.spread, _SPREAD)),
        math.log(share / (1.0 - share)),
        max(evidence.strays - _STRAYS, 0.0),
        _beyond(evidence.freed, _FREED),
        math.log1p(max(evidence.freed - _FREED[0], 0.0) / (evidence.points + _FEW)),
        _beyond(evidence.aside, _ASIDE),
        _beyond(evidence.tilt, _TILT),
        _beyond(steep, _STEEP),
        odd,
        max(_UNDER - evidence.zoom, 0.0) if wide is None else 0.0,
        max(evidence.flat - _FLAT, 0.0) if wide is not None else 0.0,
    )


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
    close = math.erf(CLOSE_DEG / (math.sqrt(2.0) * _ERROR_FACTOR * deviation_deg(evidence)))
    return close / (1.0 + math.exp(-_within(z, (-50.0, 50.0))))


def _within(value: float, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0]), limits[1])


def _beyond(value: float, limits: tuple[float, float]) -> float:
    return _within(value, limits) - limits[0]
