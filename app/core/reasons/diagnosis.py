"""Explain the results of a place: the light in the way of each style, and what would help."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

from app.core.base.arrays import Floats
from app.core.reasons.light_in_the_way import LampLights, LightInTheWay, find_light_in_the_way
from app.core.reasons.mends import Mend, find_mends
from app.core.solver.lens.lens_search import solve_lens
from app.core.solver.lens.lens_wish import STRAIGHT, LensWish
from app.core.solver.lens.view_tables import ViewTables
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.solver.turn_choice import Objective
from app.core.styles.style_pack import StylePack

SolveStyles: TypeAlias = Callable[[Floats], Sequence[StyleResult]]
"""Solve built-in styles in other light, with the same wishes and front."""


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """The light in the way of a style, if there is one, and the changes that improve its grade."""

    way: LightInTheWay | None = None
    mends: tuple[Mend, ...] = ()


def solver_of(
    pack: StylePack,
    views: Sequence[ViewTables],
    wish: LensWish,
    objective: Objective,
    names: Sequence[str],
    front_deg: float,
) -> SolveStyles:
    """Return a function that solves styles in other light (see `solve_lens`)."""
    if wish == STRAIGHT:
        # This leaves out the gains from a turned face, which take most of the time.
        return lambda light: solve_all(pack, light, objective, styles=names, front_deg=front_deg)
    return lambda light: solve_lens(
        pack, views, light, wish, objective, styles=names, front_deg=front_deg
    )


def diagnose(
    pack: StylePack,
    lights: LampLights,
    results: Sequence[StyleResult],
    solve: SolveStyles,
    elsewhere: Mapping[str, StyleResult] | None = None,
) -> dict[str, Diagnosis]:
    """Explain the results of built-in styles, by name. Styles without one are left out.

    Args:
        results: Results in `lights`.
        solve: Function that solves at least these styles in other light.
        elsewhere: Results for a single style at other spots, by the name of the spot.
    """
    by_light: dict[bytes, dict[str, StyleResult]] = {}

    def answer_in(name: str, light: Floats) -> StyleResult:
        # Many styles have the same lamp in their way.
        key = light.tobytes()
        if key not in by_light:
            by_light[key] = {one.name: one for one in solve(light)}
        return by_light[key][name]

    diagnoses = {}
    for result in results:
        again = partial(answer_in, result.name)
        way = find_light_in_the_way(pack, lights, result.name, result, again)
        mends = find_mends(result, way, elsewhere)
        if way is not None or mends:
            diagnoses[result.name] = Diagnosis(way, mends)
    return diagnoses
