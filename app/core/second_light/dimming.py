"""What a lamp can be dimmed to.

A lamp at full power may drown the place's own light; a style with two lamps needs both. Whoever
holds a lamp turns it down until it fits, in steps that lamps have: whole stops.
"""

from __future__ import annotations

import math
from typing import Final

FULL: Final = (1.0,)
"""Powers of a lamp that cannot be dimmed, or was captured as it is."""

# Brightest and dimmest in stops from the power in `numbers`: screens and panels go down to less
# than a hundredth, a torch has a few steps; a flash is counted at 1/16 and goes from 1/1 to 1/128.
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
    """Return the powers that a kind of lamp from numbers can be set to, the strongest first.

    Examples
    --------
    >>> powers_of("torch"), powers_of("bulb")
    ((1.0, 0.5, 0.25, 0.125), (1.0,))
    """
    if kind not in _STOPS:
        return FULL
    most, least = _STOPS[kind]
    return tuple(2.0**stop for stop in range(most, least - 1, -1))


def power_words(power: float, kind: str = "") -> str:
    """Say at which power a lamp is held, as its own display does.

    Examples
    --------
    >>> power_words(1.0), power_words(0.5), power_words(0.25), power_words(1.0, "flash")
    ('at full power', 'at half power', 'at 1/4 power', 'at 1/16 power')
    """
    share = power_share(power, kind)
    return f"at {'half' if share == '1/2' else share} power"


def power_share(power: float, kind: str = "") -> str:
    """Write a power as a share of the lamp's greatest: "full" or "1/8".

    Examples
    --------
    >>> power_share(1.0), power_share(0.125), power_share(16.0, "flash")
    ('full', '1/8', 'full')
    """
    shown = _shown(power, kind)
    return "full" if shown >= _FULL_FROM else f"1/{round(1.0 / shown)}"


def stops_words(power: float, kind: str = "") -> str:
    """Say by how much a lamp is turned down; empty at full power.

    Examples
    --------
    >>> stops_words(0.125), stops_words(0.5), stops_words(1.0)
    ('3 stops down', '1 stop down', '')
    """
    stops = round(-math.log2(_shown(power, kind)))
    return f"{stops} stop{'' if stops == 1 else 's'} down" if stops > 0 else ""


def _shown(power: float, kind: str) -> float:
    """Share of the greatest power that the lamp itself has."""
    return power * _ALREADY.get(kind, 1.0)
