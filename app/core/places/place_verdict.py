"""The verdict about a place: the flow of its light, and the styles within reach."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

from app.core.base.arrays import Floats
from app.core.portrait.ratio_and_glare import Flow, light_flow
from app.core.solver.style_signature import Grade
from app.core.styles.styles import DEEP, NAMES, RARE, mirror_name


class StyleAnswer(Protocol):
    """The part of a style's result on which a verdict depends, as in `StyleResult`."""

    @property
    def name(self) -> str:
        """Name of the style."""

    @property
    def title(self) -> str:
        """Title of the style."""

    @property
    def attainable(self) -> bool:
        """Whether the style is within reach."""

    @property
    def match(self) -> float:
        """Match at the offered turn."""

    @property
    def grade(self) -> Grade | None:
        """Grade, or None if the style has no signature."""


@dataclass(frozen=True, slots=True)
class PlaceVerdict:
    """What a place offers.

    Attributes:
        flow: Flow of the light past a sitter who faces the photographer, or None if it is unknown.
        yes, soft: Names of the styles with these grades, best match first and rare styles last. Of
            a left and a right style, only the better one is included.
        deep_shadows: Whether a style with deep shadows is within reach.
    """

    flow: Flow | None
    yes: tuple[str, ...]
    soft: tuple[str, ...]
    deep_shadows: bool


def place_verdict(
    results: Iterable[StyleAnswer], radiance: Floats, front_deg: float
) -> PlaceVerdict | None:
    """Sum up the results at a place, or return None if a built-in style has no result.

    Args:
        radiance: (H, 2 H, 3) or (H, 2 H) float. The environment in panorama coordinates, linear
            Rec. 709 radiance or luminance at any exposure. 32 rows suffice.
        front_deg: Panorama azimuth of the photographer, in degrees.
    """
    every = tuple(results)
    if not {one.name for one in every}.issuperset(NAMES):
        return None
    return verdict_of(every, light_flow(radiance, front_deg))


def verdict_of(results: Iterable[StyleAnswer], flow: Flow | None) -> PlaceVerdict | None:
    """Sum up the results at a place, or return None if no built-in style has a result.

    Args:
        results: Results of any version, possibly without some built-in styles.
        flow: As in `PlaceVerdict`.
    """
    every = tuple(results)
    if {one.name for one in every}.isdisjoint(NAMES):
        return None
    reach = sorted((one for one in every if one.attainable), key=_order)
    better: dict[str, StyleAnswer] = {}
    for one in reach:
        better.setdefault(min(one.name, mirror_name(one.name)), one)
    return PlaceVerdict(
        flow=flow,
        yes=tuple(one.name for one in better.values() if not _is_soft(one)),
        soft=tuple(one.name for one in better.values() if _is_soft(one)),
        deep_shadows=any(one.name in DEEP for one in reach),
    )


def _is_soft(result: StyleAnswer) -> bool:
    """Return whether a style within reach is soft. Styles without a grade are not."""
    return result.grade == "soft"


def _order(result: StyleAnswer) -> tuple[bool, bool, float]:
    return result.name in RARE, _is_soft(result), -result.match
