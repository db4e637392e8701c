"""What the sheet says: turns, arcs, heads and sides in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Mapping


class SheetStyle(Protocol):
    """What the sheet shows of a style's result, out of `app.core.solver.solve.StyleResult`."""

    @property
    def name(self) -> str:
        """Name of the style, the key of its pictures."""

    @property
    def title(self) -> str:
        """Name on screen."""

    @property
    def side(self) -> str:
        """The sitter's own side of the key lamp: left, right or none."""

    @property
    def turn_refined_deg(self) -> float:
        """The best turn, degrees, positive clockwise."""

    @property
    def match_curve(self) -> object:
        """(64,) match of 100 at turns of 5.625 k degrees."""

    @property
    def match(self) -> float:
        """Match of 100 at the best turn."""

    @property
    def strength(self) -> float:
        """Strength of 100 at the best turn."""

    @property
    def attainable(self) -> bool:
        """Whether the style is in reach."""

    @property
    def reason(self) -> str | None:
        """Why it is not."""

    @property
    def arc_deg(self) -> tuple[float, float]:
        """Tolerance arc, clockwise from first to second, degrees."""


def signed(angle_deg: float) -> str:
    """Write an angle in whole degrees with a typographic minus.

    Examples
    --------
    >>> signed(-12.4), signed(-0.2), signed(96.0)
    ('−12°', '0°', '96°')
    """
    whole = round(angle_deg)
    return f"−{-whole}°" if whole < 0 else f"{whole}°"


def turn_words(turn_deg: float) -> tuple[str, str]:
    """Write a turn as its size and its direction, both from the same whole degrees.

    Parameters
    ----------
    turn_deg : float
        Degrees in (-180, 180], positive clockwise.

    Returns
    -------
    tuple[str, str]
        Whole degrees, and the direction; "no turn needed" at 0.

    Examples
    --------
    >>> turn_words(96.2), turn_words(-45.0), turn_words(0.3)
    (('96°', 'clockwise'), ('45°', 'counter-clockwise'), ('0°', 'no turn needed'))
    """
    whole = round(turn_deg)
    if whole == 0:
        return "0°", "no turn needed"
    return f"{abs(whole)}°", "clockwise" if whole > 0 else "counter-clockwise"


def arc_words(arc_deg: tuple[float, float]) -> str:
    """Write a tolerance arc.

    Examples
    --------
    >>> arc_words((79.2, 110.6)), arc_words((-180.0, 180.0))
    ('79° to 111°', 'any turn')
    """
    start, stop = arc_deg
    return "any turn" if stop - start >= 360.0 else f"{signed(start)} to {signed(stop)}"


def head_words(head: str) -> str:
    """Write a head's name, with the skin's tone where the name has one.

    Examples
    --------
    >>> head_words("generic"), head_words("generic-dark"), head_words("anna.npz")
    ('Generic head', 'Generic head, dark skin', 'Head anna.npz')
    """
    base, _, tone = head.partition("-")
    if not base.isalpha() or tone not in ("", "light", "medium", "dark"):
        return f"Head {head}"
    return f"{base.capitalize()} head" + (f", {tone} skin" if tone else "")


def side_words(style: SheetStyle, places: Mapping[str, str]) -> str:
    """Name the side twice, or say where the light comes from."""
    sides = {"left": "sitter’s left (camera right)", "right": "sitter’s right (camera left)"}
    return sides.get(style.side) or places.get(style.name, "")
