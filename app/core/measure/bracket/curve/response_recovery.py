"""Recover response curves from a bracket, either one for the camera or one per frame.

As in Debevec and Malik ("Recovering high dynamic range radiance maps from photographs", SIGGRAPH
1997), the logarithm of each code's exposure is found by least squares from positions visible in
several frames, with a penalty on curvature. The differences are:

* the unknown is the logarithm of the *local gamma*, d log exposure / d log code, at 16 nodes, as a
  deviation from that of sRGB. As a result, the curve always rises, any plausible curve is smooth in
  the unknowns, and where the bracket has no data, the curve bends as sRGB does;
* residuals are measured in codes of the darker frame, where their size is known (rounding, noise,
  compression), not in logarithms, where dark codes would weigh hundreds of times too much;
* the positions are first condensed to matching codes (`brightness_transfer`), so the solution takes
  a few milliseconds whatever their number;
* large residuals count less (Cauchy weights).

Steps of equal size leave a curve undetermined up to a ripple that repeats with the step (Grossberg
and Nayar 2003, "fractal ambiguity"). The penalty on curvature selects the curve without the ripple.

Phones choose a tone curve for each frame by its appearance. For such frames, `recover_own_curves`
fits a separate curve for each frame k, log2 radiance = sRGB(z) - stops_k + d_k(z), all in one
linear least-squares problem. The frames agree only up to a monotonic function of the radiance, and
a flatter function always makes them agree better. Each frame's saturation is therefore kept near
its nominal exposure, and the mean of all d_k is kept near 0, because a camera that brightens one
frame and darkens another does so around sRGB. Curves that vary across the picture also darken
clipped areas to codes well under 255, which then count as clipped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from app.core.base.arrays import Float64, Int64
from app.core.measure.bracket.curve.brightness_transfer import CodeMatches

_NODES: Final = 16
# Nodes are evenly spaced in log(1 + code / toe), since near the toe curves bend over a few codes.
_TOE: Final = 0.05
# Penalties for a change in the log local gamma by 1, and for a deviation from sRGB, chosen on 12
# curves and 20 scenes. Halving or doubling them changes no median error by as much as 0.2%.
_BENDING: Final = 20.0
_LEANING: Final = 0.4
_LEAVING: Final = 0.004
# Systematic error of codes in compressed frames. Smaller differences are not evidence.
_FLOOR_CODES: Final = 0.25
_CAUCHY: Final = 9.0
_ROUNDS: Final = 14
_LONGEST_STEP: Final = 0.7
_ENOUGH: Final = 3e-4

_LOG_CODES: Final = np.log2(np.arange(1, 256))


@dataclass(frozen=True, slots=True)
class RecoveredCurve:
    """A recovered curve.

    Attributes:
        table: (256,) float64. Linear exposure of each code, which increases strictly from 0 at code
            0 to 1 at code 255.
        tag_stops: True minus nominal exposure of the free frame in stops, or 0 if no frame is free.
        unknowns: (16,) float64. Logarithm of the local gamma at the nodes, minus that of sRGB.
    """

    table: Float64
    cost: float
    tag_stops: float
    unknowns: Float64


def srgb_table() -> Float64:
    """Return the linear light, (256,) float64, of each sRGB code, with smooth slopes.

    The curve is that of IEC 61966-2-1.
    """
    codes = np.arange(256) / 255.0
    return np.asarray(np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4))


def recover_curve(
    matches: CodeMatches,
    stops: Sequence[float],
    *,
    free_frame: int | None = None,
    start: Float64 | None = None,
    hold: float = 0.0,
) -> RecoveredCurve:
    """Recover the response curve from matching codes in frames of decreasing exposure.

    Args:
        free_frame: Index of a frame whose exposure is also unknown, or None.
        start: (16,) float64. `RecoveredCurve.unknowns` to start from, or None for sRGB.
        hold: Strength with which the unknowns are kept near the start.

    Raises:
        ValueError: If there are no matches.
    """
    if len(matches) == 0:
        raise ValueError("frames that do not overlap reveal nothing about the response")
    return _Problem(matches, stops, free_frame).solve(
        np.zeros(_NODES) if start is None else start, hold
    )


class _Problem:
    """A Gauss-Newton fit of the log local gamma, and of one exposure if a frame is free."""

    def __init__(
        self, matches: CodeMatches, stops: Sequence[float], free_frame: int | None
    ) -> None:
        nodes = np.linspace(0.0, 1.0, _NODES)
        codes = np.arange(2, 256)
        # Between codes k - 1 and k, the curve is a power law with the gamma of their middle.
        middle = np.sqrt(codes * (codes - 1.0)) / 255.0
        place = np.log1p(middle / _TOE) / np.log1p(1.0 / _TOE)
        self.hats = np.column_stack([np.interp(place, nodes, row) for row in np.eye(_NODES)])
        self.prior_rise = np.diff(np.log2(srgb_table()[1:]))
        self.code = matches.code
        self.dark_code = matches.dark_code
        self.steps = matches.steps(stops)
        self.variance = np.maximum(matches.scatter, 0.5) ** 2 / matches.places + _FLOOR_CODES**2
        self.sign: Float64 | None = None
        if free_frame is not None:
            self.sign = (matches.bright == free_frame) * 1.0 - (matches.dark == free_frame)

    def curve(self, gamma: Float64) -> tuple[Float64, Float64]:
        """Return the log2 exposure of codes 1 to 255 and its derivatives.

        The derivatives are with respect to the unknowns.
        """
        rise = self.prior_rise * np.exp(self.hats @ gamma)
        log_exposure = np.zeros(255)
        log_exposure[:-1] = -np.cumsum(rise[::-1])[::-1]
        slope = np.zeros((255, _NODES))
        slope[:-1] = -np.cumsum((rise[:, np.newaxis] * self.hats)[::-1], axis=0)[::-1]
        return log_exposure, slope

    def residuals(self, unknowns: Float64) -> tuple[Float64, Float64]:
        """Return the darker code minus its prediction, and the derivatives of the prediction."""
        curve, slope = self.curve(unknowns[:_NODES])
        target = curve[self.code - 1] - self.steps
        if self.sign is not None:
            target = target - self.sign * unknowns[_NODES]
        prediction = 2.0 ** np.interp(target, curve, _LOG_CODES)
        whole = np.clip(prediction.astype(np.int64), 1, 254)
        part = (prediction - whole)[:, np.newaxis]
        per_code = (curve[whole] - curve[whole - 1])[:, np.newaxis]
        there = slope[whole - 1] * (1.0 - part) + slope[whole] * part
        change = slope[self.code - 1] - there
        if self.sign is not None:
            change = np.column_stack([change, -self.sign])
        return self.dark_code - prediction, change / per_code

    def penalty(self, hold: float) -> tuple[Float64, Float64]:
        """Return the quadratic forms of the unknowns and of their distance from the start."""
        size = _NODES + (self.sign is not None)
        bend = np.diff(np.eye(_NODES), 2, axis=0)
        lean = np.diff(np.eye(_NODES), 1, axis=0)
        smooth = np.zeros((size, size))
        smooth[:_NODES, :_NODES] = (
            _BENDING * bend.T @ bend + _LEANING * lean.T @ lean + _LEAVING * np.eye(_NODES)
        )
        near = np.zeros((size, size))
        near[:_NODES, :_NODES] = hold * 1e3 * np.eye(_NODES)
        return smooth, near

    def solve(self, start: Float64, hold: float) -> RecoveredCurve:
        """Iterate until the unknowns converge."""
        smooth, near = self.penalty(hold)
        home = np.zeros(len(smooth))
        home[:_NODES] = start
        unknowns = home.copy()
        for _ in range(_ROUNDS):
            residual, change = self.residuals(unknowns)
            weight = 1.0 / (self.variance + residual**2 / _CAUCHY)
            weighted = change.T * weight
            gradient = weighted @ residual - smooth @ unknowns - near @ (unknowns - home)
            hessian = weighted @ change + smooth + near
            move = np.linalg.solve(hessian + 1e-9 * np.eye(len(home)), gradient)
            size = float(np.abs(move).max())
            unknowns = unknowns + move * min(1.0, _LONGEST_STEP / max(size, 1e-12))
            if size < _ENOUGH:
                break
        residual, _ = self.residuals(unknowns)
        cost = float(np.sum(_CAUCHY * np.log1p(residual**2 / self.variance / _CAUCHY)))
        gamma = unknowns[:_NODES]
        table = np.concatenate([[0.0], 2.0 ** self.curve(gamma)[0]])
        return RecoveredCurve(
            _strictly_rising(table),
            cost + float(unknowns @ smooth @ unknowns),
            float(unknowns[_NODES]) if self.sign is not None else 0.0,
            gamma,
        )


def _strictly_rising(table: Float64) -> Float64:
    """Guard the darkest codes of a table, (256,), against underflow in very steep curves."""
    floor = np.arange(256) * 1e-12
    return np.asarray(np.maximum(table, floor) / max(float(table[-1]), float(floor[-1])))


_OWN_NODES: Final = 14
# Stops by which curves deviate from sRGB at a node, and by which they bend between three nodes.
_DEPARTS: Final = 1.0
_BENDS: Final = 0.25
# Stops by which white deviates from the stated exposure, and the mean curve from sRGB.
_WHITE: Final = 0.1
_MEAN: Final = 0.3
# Systematic errors of compressed frames, in stops and in codes. Neighbouring codes share them, so
# only one in this number of rows counts.
_FLOOR_STOPS: Final = 0.03
_OWN_FLOOR_CODES: Final = 0.3
_ALIKE: Final = 16.0
_OWN_CAUCHY: Final = 3.0
_OWN_ROUNDS: Final = 8
_LEAST_RISE: Final = 0.2  # minimum rise between two codes, as a fraction of sRGB's


def recover_own_curves(
    matches: CodeMatches, stops: Sequence[float]
) -> tuple[Float64, tuple[float, ...]]:
    """Recover a response curve for each frame, given in order of decreasing exposure.

    Returns:
        The linear light of each code in each frame, (K, 3, 256) float64, and the corresponding
        exposure at which each frame saturates. The light increases from 0 to 1, is the same for all
        channels, and is 1 from the code in `CodeMatches.whites` upwards.
    """
    frames = len(stops)
    white = np.minimum(matches.whites or [255] * frames, 255)
    base = np.log2(srgb_table()[1:])
    design, targets, variance = _equations(
        matches.where(matches.code < white[matches.bright]), stops
    )
    prior, home = _prior(white, base)
    unknowns = np.zeros(frames * _OWN_NODES)
    for _ in range(_OWN_ROUNDS):
        off = targets - design @ unknowns
        weighted = design.T / (variance * _ALIKE * (1.0 + off**2 / variance / _OWN_CAUCHY**2))
        pull = weighted @ targets + home
        unknowns = np.asarray(np.linalg.solve(weighted @ design + prior, pull), np.float64)
    departs = unknowns.reshape(frames, _OWN_NODES) @ _hats().T
    logs = _rising(base + departs, base) - np.asarray(stops)[:, None]
    ends = logs[np.arange(frames), white - 1]
    tables = np.zeros((frames, 3, 256))
    tables[:, :, 1:] = np.exp2(np.minimum(logs - ends[:, None], 0.0))[:, None]
    return tables, tuple(float(-end) for end in ends)


def _equations(matches: CodeMatches, stops: Sequence[float]) -> tuple[Float64, Float64, Float64]:
    """Return the design matrix, (R, unknowns), the right-hand side and the variances, (R,) each."""
    hats, base = _hats(), np.log2(srgb_table()[1:])
    bright = matches.code - 1
    dark = np.clip(matches.dark_code, 1.0, 255.0)
    below = np.minimum(dark.astype(np.int64), 254) - 1
    part = np.log2(dark / (below + 1)) / np.log2((below + 2) / (below + 1.0))
    hat_dark = hats[below] * (1.0 - part)[:, None] + hats[below + 1] * part[:, None]
    base_dark = base[below] * (1.0 - part) + base[below + 1] * part
    rows = np.zeros((len(matches), len(stops), _OWN_NODES))
    index = np.arange(len(matches))
    rows[index, matches.bright] += hats[bright]
    rows[index, matches.dark] -= hat_dark
    targets = matches.steps(stops) - (base[bright] - base_dark)
    slope = base[below + 1] - base[below]
    codes = np.maximum(matches.scatter, 0.5) ** 2 / matches.places + _OWN_FLOOR_CODES**2
    return rows.reshape(len(matches), -1), targets, slope**2 * codes + _FLOOR_STOPS**2


def _hats() -> Float64:
    """Return the weight of each node at each code from 1 upwards, (255, nodes)."""
    codes = np.arange(1, 256) / 255.0
    place = np.log1p(codes / _TOE) / np.log1p(1.0 / _TOE)
    nodes = np.linspace(0.0, 1.0, _OWN_NODES)
    return np.column_stack([np.interp(place, nodes, row) for row in np.eye(_OWN_NODES)])


def _prior(white: Int64, base: Float64) -> tuple[Float64, Float64]:
    """Return the prior's quadratic form and pull, given the code at which each frame clips."""
    frames = len(white)
    bend = np.diff(np.eye(_OWN_NODES), 2, axis=0)
    form = np.kron(np.eye(frames), bend.T @ bend / _BENDS**2 + np.eye(_OWN_NODES) / _DEPARTS**2)
    form += np.kron(np.full((frames, frames), (1.0 / frames / _MEAN) ** 2), np.eye(_OWN_NODES))
    ends = np.kron(np.eye(frames), np.ones(_OWN_NODES)) * np.tile(_hats()[white - 1], frames)
    return form + ends.T @ ends / _WHITE**2, ends.T @ -base[white - 1] / _WHITE**2


def _rising(logs: Float64, base: Float64) -> Float64:
    """Force every curve to rise, working from the middle towards both ends."""
    least = _LEAST_RISE * np.diff(base)
    rise = np.maximum(np.diff(logs, axis=1), least)
    middle = logs.shape[1] // 2
    run = np.concatenate([np.zeros((len(logs), 1)), np.cumsum(rise, axis=1)], axis=1)
    return np.asarray(run - run[:, middle : middle + 1] + logs[:, middle : middle + 1])
