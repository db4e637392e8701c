"""Lamps that are described by numbers instead of a capture.

A lamp is a flat light source that faces the head. It is equally bright all over and from every
direction (Lambertian), and is described by its size and its illuminance at one metre.

A lamp at full power may overpower the place's own light, and a style with two lamps needs both. The
search may therefore dim a lamp in the usual steps of whole stops.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from app.core.base.errors import CoreError
from app.core.text import tr

FULL: Final = (1.0,)
"""The powers of a lamp that cannot be dimmed or that was captured."""

# Brightest and dimmest setting in stops from the power in `numbers`: screens and panels go down to
# less than a hundredth, a torch has a few steps; a flash is specified at 1/16 and goes from 1/1 to
# 1/128.
_STOPS: Final = {
    "phone": (0, -8),
    "torch": (0, -3),
    "tablet": (0, -8),
    "panel": (0, -8),
    "flash": (4, -3),
    "softbox": (0, -7),
}
_ALREADY: Final = {"flash": 1.0 / 16.0}
_FULL_FROM: Final = 0.995


def powers_of(kind: str) -> tuple[float, ...]:
    """Return the possible powers for a kind of lamp, strongest first.

    Examples:
        >>> powers_of("torch"), powers_of("bulb")
        ((1.0, 0.5, 0.25, 0.125), (1.0,))
    """
    if kind not in _STOPS:
        return FULL
    most, least = _STOPS[kind]
    return tuple(2.0**stop for stop in range(most, least - 1, -1))


def part_of(power: float, kind: str = "") -> int:
    """Return the denominator of a lamp's power, such as 1 for full power and 2 for half.

    Examples:
        >>> part_of(1.0), part_of(0.125), part_of(16.0, "flash")
        (1, 8, 1)
    """
    share = share_of(power, kind)
    return 1 if share >= _FULL_FROM else round(1.0 / share)


def share_of(power: float, kind: str = "") -> float:
    """Return a power as a fraction of the lamp's full power."""
    return power * _ALREADY.get(kind, 1.0)


NEAREST_M: Final = 0.2
FARTHEST_M: Final = 5.0

_WHITE: Final = (1.0, 1.0, 1.0)
# 3,000 K on the black-body curve, linear Rec. 709, luminance 1.
_WARM: Final = (1.77, 0.83, 0.30)

_EXPOSURE_CONSTANT: Final = 250.0  # lux seconds at ISO 100 and f/1, as for incident meters
_GUIDE_NUMBER_M: Final = 40.0  # guide number of a typical shoe-mount flash in metres at ISO 100
_FLASH_POWER: Final = 1.0 / 16.0
_SHUTTER_S: Final = 1.0 / 160.0
# Steady light that exposes like the flash: its lux seconds over the shutter time.
_FLASH_LUX: Final = _EXPOSURE_CONSTANT * _GUIDE_NUMBER_M**2 / 100.0 * _FLASH_POWER / _SHUTTER_S


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of handheld lamp."""

    name: str
    size_m: tuple[float, float]  # width and height, in metres
    round: bool
    lux_at_1m: float  # illuminance on axis at one metre, in lux
    distance_m: float
    colour: tuple[float, float, float]  # linear Rec. 709 of luminance 1


KINDS: Final = {
    kind.name: kind
    for kind in (
        # A white screen at full brightness, 600 cd/m2.
        Kind("phone", (0.07, 0.15), False, 6.3, 0.3, _WHITE),
        # The light on the back of a phone, 50 lm spread over half the room.
        Kind("torch", (0.006, 0.006), True, 16.0, 0.4, _WHITE),
        # A white screen at full brightness, 500 cd/m2.
        Kind("tablet", (0.25, 0.17), False, 21.0, 0.4, _WHITE),
        # A pocket panel at full power.
        Kind("panel", (0.17, 0.10), False, 400.0, 0.5, _WHITE),
        # A shaded warm-white bulb of 800 lm.
        Kind("bulb", (0.20, 0.15), True, 70.0, 0.6, _WARM),
        # Guide number 40 at 1/16 power; counted as steady light through 1/160 s.
        Kind("flash", (0.06, 0.04), False, _FLASH_LUX, 1.0, _WHITE),
        # A 60 cm softbox with a 100 W LED inside.
        Kind("softbox", (0.60, 0.60), False, 1500.0, 1.0, _WHITE),
    )
}
"""The kinds of lamp, by name."""


@dataclass(frozen=True, slots=True)
class NumbersLamp:
    """A lamp described by numbers, at a given distance.

    Raises:
        CoreError: If a number is out of range.
    """

    kind: str
    distance_m: float  # distance between the centres of head and lamp, in metres
    lux_at_1m: float  # illuminance on axis at one metre, in lux
    size_m: tuple[float, float]  # width and height, in metres
    round: bool = False
    colour: tuple[float, float, float] = _WHITE  # linear Rec. 709 of luminance 1

    def __post_init__(self) -> None:
        """Raise `CoreError` if a value is impossible."""
        if not NEAREST_M <= self.distance_m <= FARTHEST_M:
            raise CoreError(
                tr(
                    "A lamp {distance:g} m from the middle of the head cannot be used.",
                    distance=self.distance_m,
                ),
                tr(
                    "Hold the lamp {nearest:g} to {farthest:g} m from the head.",
                    nearest=NEAREST_M,
                    farthest=FARTHEST_M,
                ),
            )
        if not 0.0 < self.lux_at_1m <= 1e6 or not math.isfinite(self.lux_at_1m):
            raise CoreError(
                tr("No lamp gives {lux:g} lux at 1 m.", lux=self.lux_at_1m),
                tr("Look up the value in the lamp’s manual, or measure it with a light meter."),
            )
        if not all(0.001 <= side <= 3.0 for side in self.size_m):
            raise CoreError(
                tr(
                    "A lamp of {width:g} x {height:g} m cannot be used.",
                    width=self.size_m[0],
                    height=self.size_m[1],
                ),
                tr("Each side must be between 1 mm and 3 m."),
            )

    @property
    def luminance(self) -> float:
        """The luminance of the lamp's face, in cd/m2."""
        area = self.size_m[0] * self.size_m[1] * (math.pi / 4.0 if self.round else 1.0)
        return self.lux_at_1m / area


def at_distance(kind: Kind, distance_m: float | None = None) -> NumbersLamp:
    """Return a lamp of a given kind at a distance from the centre of the head."""
    distance = kind.distance_m if distance_m is None else distance_m
    return NumbersLamp(kind.name, distance, kind.lux_at_1m, kind.size_m, kind.round, kind.colour)


def parse(text: str) -> NumbersLamp:
    """Parse a lamp that is given as its kind and its distance in metres.

    Examples:
        >>> parse("phone@0.45").distance_m
        0.45
    """
    name, at, metres = text.strip().lower().partition("@")
    if name not in KINDS:
        raise CoreError(
            tr("There is no lamp “{name}”.", name=name),
            tr("Available: {names}.", names=", ".join(KINDS)),
        )
    if not at:
        return at_distance(KINDS[name])
    try:
        distance = float(metres.removesuffix("m"))
    except ValueError:
        distance = math.nan
    if not math.isfinite(distance):
        raise CoreError(
            tr("“{metres}” is not a distance.", metres=metres),
            tr("Enter the distance in metres, such as {name}@0.3.", name=name),
        )
    return at_distance(KINDS[name], distance)
