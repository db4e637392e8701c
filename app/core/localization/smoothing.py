"""Numbers that stand still when nothing moves, and follow at once when something does.

An average that is long enough to still the jitter of a measurement lags behind a motion; one that
follows a motion jitters. So the shown value is held on a *leash* instead: wherever the measurement
goes, the shown value is never further behind than the leash is long, and within that it only creeps
after it. The leash, three times the jitter, shortens while the measurement keeps going one way.
It bounds the lag by construction, at any speed and with any pause between two measurements.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Float64: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Leash:
    """How values of one kind are held still; units are those of the value."""

    length: float
    slow_per_s: float
    creep_s: float = 1.4
    speed_s: float = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Steady:
    """Values as shown, and what the next step needs.

    Attributes:
        shown: (...) float64. The steadied values.
        measured: (...) float64. The last measurement.
        speed: (...) float64. Of the measurements, a second.
    """

    shown: Float64 = field(repr=False)
    measured: Float64 = field(repr=False)
    speed: Float64 = field(repr=False)
    time_s: float

    @classmethod
    def at(cls, measured: Float64, time_s: float) -> Steady:
        """Begin with a measurement.

        Args:
            measured: (...) float64. It is shown as it is.
        """
        value = np.array(measured, np.float64)
        return cls(value, value, np.zeros_like(value), time_s)


def steadied(before: Steady, measured: Float64, time_s: float, leash: Leash) -> Steady:
    """Take a measurement.

    Args:
        measured: (...) float64. Of the same shape; angles unwrapped, so that no step between two is
            a whole circle.
        time_s: When it was taken; one that is not later than the last changes the value and no
            speed.
    """
    value = np.array(measured, np.float64)
    pause = max(time_s - before.time_s, 0.0)
    # Share of the newest difference in the speed: exact for any pause between two measurements.
    share = 1.0 - math.exp(-pause / leash.speed_s)
    rate = (value - before.measured) / max(pause, 1e-3)
    speed = before.speed + share * (rate - before.speed)
    length = leash.length / (1.0 + (speed / leash.slow_per_s) ** 4)
    crept = value + (before.shown - value) * math.exp(-pause / leash.creep_s)
    shown = np.clip(crept, value - length, value + length)
    return Steady(shown, value, speed, max(time_s, before.time_s))
