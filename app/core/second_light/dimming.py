"""What a lamp can be dimmed to.

A lamp at full power may drown the place's own light; a style with two lamps needs both. Whoever
holds a lamp turns it down until it fits, in steps that lamps have: whole stops.
"""

from __future__ import annotations

from typing import Final

__all__ = ["FULL", "power_words", "powers_of"]

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


def powers_of(kind: str) -> tuple[float, ...]:
    """Return the powers that a kind of lamp from numbers can be set to, the strongest first.

    Parameters
    ----------
    kind : str
        Its name, see `app.core.second_light.numbers.KINDS`.

    Returns
    -------
    tuple of float
        As shares of the power in its numbers.

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
    """Say how far a lamp is turned down, as its own display does.

    Parameters
    ----------
    power : float
        Share of the power in its numbers.
    kind : str, optional
        Its name.

    Examples
    --------
    >>> power_words(1.0), power_words(0.25), power_words(1.0, "flash")
    ('at full power', 'at 1/4 of its power', 'at 1/16 of its power')
    """
    shown = power * _ALREADY.get(kind, 1.0)
    if shown >= 0.995:
        return "at full power"
    return f"at 1/{round(1.0 / shown)} of its power"
