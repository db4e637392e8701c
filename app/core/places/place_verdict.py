"""The verdict about a place: the flow of its light, and the styles within reach."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from app.core.base.arrays import Floats
from app.core.places.offers import offers
from app.core.portrait.ratio_and_glare import Flow, light_flow
from app.core.solver.style_result import StyleAnswer
from app.core.styles.styles import DEEP, NAMES


@dataclass(frozen=True, slots=True)
class PlaceVerdict:
    """What a place offers.

    Attributes:
        flow: Flow of the light past a sitter who faces the photographer, or None if it is unknown.
        yes, soft: Names of the styles with these grades, best match first and rare styles last. Of
            the two sides of a style, and of styles with the same picture, only the better one is
            included.
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
    by_name = {one.name: one for one in every}
    best = [by_name[offer.name] for offer in offers(every, lambda one: one.attainable)]
    return PlaceVerdict(
        flow=flow,
        yes=tuple(one.name for one in best if one.attainable and one.grade != "soft"),
        soft=tuple(one.name for one in best if one.attainable and one.grade == "soft"),
        deep_shadows=any(one.name in DEEP for one in every if one.attainable),
    )
