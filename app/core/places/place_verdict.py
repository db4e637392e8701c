"""The verdict about a place: the flow of its light, and the styles within reach."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from app.core.base.arrays import Floats
from app.core.portrait.ratio_and_glare import Flow, light_flow
from app.core.solver.style_result import StyleResult
from app.core.styles.styles import DEEP, NAMES, RARE, mirror_name


@dataclass(frozen=True, slots=True)
class PlaceVerdict:
    """What a place offers.

    Attributes:
        flow: Flow of the light past a sitter who faces the photographer.
        yes, soft: Names of the styles with these grades, best match first and rare styles last. Of
            a left and a right style, only the better one is included.
        deep_shadows: Whether a style with deep shadows is within reach.
    """

    flow: Flow
    yes: tuple[str, ...]
    soft: tuple[str, ...]
    deep_shadows: bool


def place_verdict(
    results: Iterable[StyleResult], radiance: Floats, front_deg: float
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
    reach = sorted((one for one in every if one.attainable), key=_order)
    better: dict[str, StyleResult] = {}
    for one in reach:
        better.setdefault(min(one.name, mirror_name(one.name)), one)
    return PlaceVerdict(
        flow=light_flow(radiance, front_deg),
        yes=tuple(one.name for one in better.values() if not _is_soft(one)),
        soft=tuple(one.name for one in better.values() if _is_soft(one)),
        deep_shadows=any(one.name in DEEP for one in reach),
    )


def _is_soft(result: StyleResult) -> bool:
    """Return whether a style within reach is soft. Styles without a grade are not."""
    return result.grade == "soft"


def _order(result: StyleResult) -> tuple[bool, bool, float]:
    return result.name in RARE, _is_soft(result), -result.match
