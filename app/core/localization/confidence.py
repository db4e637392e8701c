"""Estimate the probability that a heading is right, from the evidence for its pose.

A heading counts as right if it is within 3 degrees of the truth, for a camera on the sitter's line.
Three errors are possible. First, the picture may show another place. The evidence against this is
the number of points that agree, their spread, and how much better the whole picture fits there than
beside it (`app.core.localization.heading`). Second, the picture may show this place from beside the
line through the sitter. The evidence against this is that no camera elsewhere explains more points,
and that the slopes are those of a room. Third, the place may be right but the angle wrong. The
probability of this follows from the standard error of the fit. The three errors are independent:

    P = 1 / (1 + exp(-p)) * 1 / (1 + exp(-l)) * (1 - exp(-3 deg / (k error))).

Errors have longer tails than a normal distribution, because wrong matches agree with each other. If
a camera elsewhere, measured by enough points, has the same heading, the second error does no harm.
If it has another one, the heading is doubtful. The terms p and l are sums over the evidence in
`place_signs` and `line_signs`, weighted in that order. The weights and k maximise the likelihood
over photos and live pictures taken on the spot, beside it and in other places
(`benchmarks/heading/confidence_fit.py`). Results for other data are in `benchmarks/heading.md`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

CLOSE_DEG: Final = 3.0
"""Largest error of a heading that counts as right, in degrees."""

LEAST_CONFIDENCE: Final = 0.8
"""Minimum confidence at which a heading is shown."""

MEASURED_POINTS: Final = 20
"""Minimum number of points that measure where a camera stands."""

MEASURED_FLAT: Final = 0.9
"""Largest share of them in one plane, which two cameras can show alike."""

PLACE_SIGNS: Final = ("one", "points", "support", "spread", "share", "strays")
LINE_SIGNS: Final = (
    "one", "points", "gain", "aside", "tilt", "steep", "odd", "flat", "loose",
)  # fmt: skip
"""Names of the terms of `place_signs` and `line_signs`."""

_PLACE_WEIGHTS: Final = (3.75, 0.36, 0.24, 1.52, 4.37, -1.0)
_LINE_WEIGHTS: Final = (3.49, 0.22, -0.69, -0.78, -2.66, -6.57, -3.0, -9.58, -0.78)
# log odds added for a live picture: for the place, and for the line with an estimated lens
_GUIDED: Final = (1.5, 2.0)
_ERROR_FACTOR: Final = (0.82, 0.5)  # for photos, and for live pictures
_SPREAD: Final = (0.05, 0.5)
_SUPPORT: Final = (-2.0, 15.0)
_POINTS: Final = 100  # a larger number depends on the picture's detail, not on the pose
_SHARE: Final = (0.02, 0.4)  # a larger share depends on the camera
_TILT: Final = (0.55, 1.5)  # any wall may have less
_STEEP: Final = (0.9, 3.0)  # slope over enlargement: a room behind the sitter may have less
_GAIN_RANGE: Final = (0.7, 15.0)  # a smaller gain is due to chance
_ASIDE: Final = (1.0, 12.0)
_STRAYS: Final = 0.2  # this fraction occurs by chance
_FLAT: Final = 0.7
_ALL_NEAR: Final = 2.0  # enlargement from which a camera that looks away sees nothing far off
_LOOSE_DEG: Final = (0.3, 2.0)
_LEAST_ERROR_DEG: Final = 0.05
_SAME_HEADING_DEG: Final = 1.0
_OTHER_HEADING_DEG: Final = 5.0
_AMBIGUOUS: Final = 0.6  # that the line is right, if a camera elsewhere has another heading
_HARMLESS: Final = 0.97  # that the line is right, if a camera elsewhere has the same heading
_WIDE: Final = (0.315, 1.036)  # half angles of 17.5 and 46 degrees: tangents of usual lenses
_LEAST_ZOOM: Final = 0.8  # objects look larger from the probe, unless the field of view is wrong


@dataclass(frozen=True, slots=True)
class Evidence:
    """The evidence for a pose.

    Attributes:
        points: Number of points that agree.
        share: Fraction of agreeing points among those with only one match in the panorama, 0 to 1.
        spread: Smallest standard deviation of the agreeing points in any direction, in half widths
            of the picture. It is 0 for points on a line.
        support: How much better the pose fits all points than neighbouring poses do, in standard
            deviations.
        error_deg: Standard error of the heading, in degrees.
        tilt: Slope of the enlargement across the picture.
        zoom: Enlargement in the centre of the picture.
        wide: Tangent of half the field of view along the longer side if it was estimated, or None
            if it was given.
        strays: Fraction of disagreeing points among the certain matches near the pose's prediction,
            0 to 1.
        gain, aside, flat, agree: As in `app.core.localization.parallax.Line`.
        apart_deg: Angle between this rotation and `elsewhere` from the same class, in degrees.
        loose_deg: `loose_rad` from the same class, in degrees.
        away: Whether the camera looks away from the sitter.
        guided: Whether the picture is a live one, taken at this place by a photographer who is
            following the guidance, and recognised at first sight.
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
    gain: float = 0.0
    aside: float = 0.0
    loose_deg: float = 0.0
    flat: float = 0.0
    agree: float = 0.0
    apart_deg: float = math.inf
    away: bool = False
    guided: bool = False


def place_signs(evidence: Evidence) -> tuple[float, ...]:
    """Return the evidence that a picture shows this place, in the order of `PLACE_SIGNS`."""
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
    """Return the evidence that a camera is on the sitter's line, in the order of `LINE_SIGNS`."""
    steep = evidence.tilt / (max(evidence.zoom - 1.0, 0.0) + 0.2)
    free = evidence.wide is not None
    wide = max(evidence.wide or 0.0, 0.01)
    odd = max(math.log(_WIDE[0] / wide), math.log(wide / _WIDE[1]), 0.0) if free else 0.0
    all_near = evidence.away and evidence.zoom > _ALL_NEAR
    return (
        1.0,
        _points(evidence),
        _beyond(evidence.gain, _GAIN_RANGE),
        _beyond(evidence.aside, _ASIDE),
        _beyond(evidence.tilt, _TILT),
        _beyond(steep, _STEEP),
        odd,
        max(evidence.flat - _FLAT, 0.0) if free or all_near else 0.0,
        _within(evidence.loose_deg, _LOOSE_DEG) - _LOOSE_DEG[0] if free else 0.0,
    )


def deviation_deg(evidence: Evidence) -> float:
    """Return the unscaled standard error of the heading, in degrees."""
    return max(evidence.error_deg, _LEAST_ERROR_DEG)


def trust(evidence: Evidence) -> float:
    """Return the probability that a heading is right.

    Returns:
        The probability, 0 to 1. About nine in ten headings with a probability of 0.9 are within 3
        degrees of the truth.
    """
    if evidence.points < 1 or evidence.zoom < _LEAST_ZOOM:
        return 0.0
    here, aligned = _GUIDED if evidence.guided else (0.0, 0.0)
    place = _likely(_PLACE_WEIGHTS, place_signs(evidence), here)
    line = _likely(_LINE_WEIGHTS, line_signs(evidence), 0.0 if evidence.wide is None else aligned)
    if _same_from_elsewhere(evidence):
        line = max(line, _HARMLESS)
    # Two cameras can show a wall alike.
    if _OTHER_HEADING_DEG < evidence.apart_deg < math.inf:
        line = min(line, _AMBIGUOUS)
    factor = _ERROR_FACTOR[evidence.guided]
    close = -math.expm1(-CLOSE_DEG / (factor * deviation_deg(evidence)))
    return place * line * close


def _same_from_elsewhere(evidence: Evidence) -> bool:
    """Return whether a camera whose position is measured has the same heading.

    A photo may have been taken anywhere, where its heading would not be the sitter's turn.
    """
    return (
        evidence.guided
        and evidence.wide is None
        and evidence.points >= MEASURED_POINTS
        and evidence.flat <= MEASURED_FLAT
        and evidence.apart_deg <= _SAME_HEADING_DEG
    )


def _likely(weights: tuple[float, ...], signs: tuple[float, ...], before: float = 0.0) -> float:
    z = before + math.fsum(w * sign for w, sign in zip(weights, signs, strict=True))
    return 1.0 / (1.0 + math.exp(-_within(z, (-50.0, 50.0))))


def _points(evidence: Evidence) -> float:
    return math.log(min(evidence.points, _POINTS))


def _within(value: float, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0]), limits[1])


def _beyond(value: float, limits: tuple[float, float]) -> float:
    return _within(value, limits) - limits[0]
