"""A camera's response curve, recovered from the bracket itself.

Like Debevec and Malik ("Recovering high dynamic range radiance maps from photographs",
SIGGRAPH 1997) the logarithm of the exposure that each code stands for is found by least
squares from places seen in several frames, with a penalty on its bending. Unlike there

* the unknown is the logarithm of the *local gamma*, d log exposure / d log code, at 16 nodes, as
  a departure from that of sRGB. So the curve always rises, any plausible curve is smooth in the
  unknowns, and where the bracket says nothing the curve bends like sRGB;
* residuals are counted in codes of the darker frame, where their size is known (rounding, noise,
  compression), not in logarithms, where dark codes would weigh hundreds of times too much;
* the places are first condensed to matching codes (`app.core.hdr.brightness_transfer`), so that the
  solution takes a few milliseconds however many places there are;
* large residuals count less (Cauchy weights).

Steps of equal size leave a curve undetermined up to a ripple that repeats with the step
(Grossberg and Nayar 2003, "fractal ambiguity"); the penalty on bending takes the curve without it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.arrays import Float64
    from app.core.hdr.brightness_transfer import CodeMatches

_NODES: Final = 16
# Nodes lie evenly in log(1 + code / toe): near the toe curves bend over a few codes.
_TOE: Final = 0.05
# How much less likely than straight a bend of the log local gamma by 1 is, and a departure.
# Chosen on 12 curves and 20 scenes; half or twice as much changes no median error by 0.2 %.
_BENDING: Final = 20.0
_LEANING: Final = 0.4
_LEAVING: Final = 0.004
# Codes that are systematically off by less than this in compressed frames are no evidence.
_FLOOR_CODES: Final = 0.25
_CAUCHY: Final = 9.0
_ROUNDS: Final = 14
_LONGEST_STEP: Final = 0.7
_ENOUGH: Final = 3e-4

_LOG_CODES: Final = np.log2(np.arange(1, 256))


@dataclass(frozen=True, slots=True)
class Recovered:
    """A recovered curve.

    `table`, (256,) float64, is the linear exposure of each code, strictly rising, 0 -> 0, 255
    -> 1. `tag_stops` is what the free frame was exposed more than stated; 0 where none is free.
    `unknowns`, (16,) float64, are log local gamma at the nodes as a departure from sRGB's.
    """

    table: Float64
    cost: float
    tag_stops: float
    unknowns: Float64


def srgb_table() -> Float64:
    """Linear light, (256,) float64, of each sRGB code (IEC 61966-2-1), exact for smooth slopes."""
    codes = np.arange(256) / 255.0
    light: Float64 = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    return light


def recover_curve(
    matches: CodeMatches,
    stops: Sequence[float],
    *,
    free_frame: int | None = None,
    start: Float64 | None = None,
    hold: float = 0.0,
) -> Recovered:
    """Recover the curve that explains the matching codes, at stated exposures that fall.

    The exposure of `free_frame` is not believed but found along with the curve. `start`, (16,)
    float64, are `Recovered.unknowns` to start from. ValueError when there are no matches.
    """
    if len(matches) == 0:
        raise ValueError("frames that do not overlap tell nothing about the response")
    return _Problem(matches, stops, free_frame).solve(
        np.zeros(_NODES) if start is None else start, hold
    )


class _Problem:
    """Gauss-Newton on the log local gamma, and on one exposure where it is free."""

    def __init__(
        self, matches: CodeMatches, stops: Sequence[float], free_frame: int | None
    ) -> None:
        nodes = np.linspace(0.0, 1.0, _NODES)
        codes = np.arange(2, 256)
        # The curve between codes k - 1 and k is a power law, with the gamma of their middle.
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
        """Log2 exposure of codes 1 to 255, and its derivative by the unknowns."""
        rise = self.prior_rise * np.exp(self.hats @ gamma)
        log_exposure = np.zeros(255)
        log_exposure[:-1] = -np.cumsum(rise[::-1])[::-1]
        slope = np.zeros((255, _NODES))
        slope[:-1] = -np.cumsum((rise[:, np.newaxis] * self.hats)[::-1], axis=0)[::-1]
        return log_exposure, slope

    def residuals(self, unknowns: Float64) -> tuple[Float64, Float64]:
        """Darker code minus what the curve expects, and how the expectation changes."""
        curve, slope = self.curve(unknowns[:_NODES])
        target = curve[self.code - 1] - self.steps
        if self.sign is not None:
            target = target - self.sign * unknowns[_NODES]
        expected = 2.0 ** np.interp(target, curve, _LOG_CODES)
        whole = np.clip(expected.astype(np.int64), 1, 254)
        part = (expected - whole)[:, np.newaxis]
        per_code = (curve[whole] - curve[whole - 1])[:, np.newaxis]
        there = slope[whole - 1] * (1.0 - part) + slope[whole] * part
        change = slope[self.code - 1] - there
        if self.sign is not None:
            change = np.column_stack([change, -self.sign])
        return self.dark_code - expected, change / per_code

    def penalty(self, hold: float) -> tuple[Float64, Float64]:
        """Quadratic forms: of the unknowns, and of their distance from the start."""
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

    def solve(self, start: Float64, hold: float) -> Recovered:
        """Iterate until nothing moves."""
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
        return Recovered(
            _strictly_rising(table),
            cost + float(unknowns @ smooth @ unknowns),
            float(unknowns[_NODES]) if self.sign is not None else 0.0,
            gamma,
        )


def _strictly_rising(table: Float64) -> Float64:
    """Guard the darkest codes against underflow of very steep curves; (256,)."""
    floor = np.arange(256) * 1e-12
    guarded: Float64 = np.maximum(table, floor) / max(float(table[-1]), float(floor[-1]))
    return guarded
