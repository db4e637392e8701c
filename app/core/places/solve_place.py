"""Solve a place for all styles, both built-in and painted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from app.core.base.arrays import Floats
from app.core.painting.paint_on_turned_head import solve_painted
from app.core.painting.user_style import UserStyle, results_of_copies, solve_user_styles
from app.core.portrait.head import Head
from app.core.solver.lens.lens_search import solve_lens
from app.core.solver.lens.lens_wish import STRAIGHT, LensWish
from app.core.solver.lens.view_tables import ViewTables
from app.core.solver.place_light import PlaceLight
from app.core.solver.style_result import StyleResult
from app.core.solver.turn_choice import Objective
from app.core.storage.settings import Settings
from app.core.styles.style_pack import StylePack


def solve_place(
    head: Head,
    light: PlaceLight,
    own: Sequence[UserStyle],
    settings: Settings,
    front_deg: float,
    lens: LensWish = STRAIGHT,
) -> tuple[StyleResult, ...]:
    """Solve a place for all styles with the current settings.

    A head that has no views is seen straight from the front.

    Args:
        own: The painted styles.
        lens: Permitted positions of the lens, with azimuths measured in the panorama.
    """
    wish = lens.moved(front_deg) if head.views else STRAIGHT
    return solve_styles(
        head.pack,
        head.views,
        light.searched_by(settings.objective),
        wish,
        settings.objective,
        own=own,
        head=head,
        front_deg=front_deg,
    )


def solve_styles(
    pack: StylePack,
    views: Sequence[ViewTables],
    light: Floats,
    wish: LensWish,
    objective: Objective = "picture",
    *,
    names: Sequence[str] | None = None,
    own: Sequence[UserStyle] = (),
    head: Head | None = None,
    front_deg: float = 0.0,
) -> tuple[StyleResult, ...]:
    """Solve built-in styles in the order of the pack, then painted styles.

    Args:
        light: As in `solve_all`.
        wish: Permitted positions of the lens. Its background, like turns, is measured from
            `front_deg`.
        names: Built-in styles to solve, or None to solve all of them.
        own: The painted styles. A copy without strokes gets the result of its origin.
        head: Head with which to search for painted styles, or None if no style has strokes.

    Raises:
        EnvironmentFileError: If the environment is black, is not finite or has the wrong size.
    """
    where: dict[str, Any] = {"front_deg": front_deg}
    built_in = solve_lens(pack, views, light, wish, objective, **where)
    answers = results_of_copies(own, built_in)
    strokes = [style for style in own if style.name not in answers]
    if strokes:
        assert head is not None
        if wish == STRAIGHT:
            painted = solve_user_styles(head.transport, strokes, light, objective, **where)
        else:
            painted = solve_painted(head.painted(), strokes, light, wish, objective, **where)
        answers |= {one.name: one for one in painted}
    results = [one for one in built_in if names is None or one.name in names]
    return (*results, *(answers[style.name] for style in own))
