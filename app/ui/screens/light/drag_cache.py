"""Caches the parts of the screen's state that do not change while the lamp is moved."""

from __future__ import annotations

from collections.abc import Mapping

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.second_light.lamp_answers import best_held
from app.core.solver.place_light import main_light
from app.core.solver.turn_choice import LIMITS
from app.core.text import tr
from app.ui.screens.light.placement.result import LampResult
from app.ui.screens.light.placement.sky import SkyState, sky_of
from app.ui.screens.light.style_list import Section, sections_of
from app.ui.screens.light.two_steps import HeadsState
from app.ui.screens.styles.gallery import ValueCache


class Resolver:
    """Builds parts of the state, and caches those that do not depend on the lamp's position."""

    def __init__(self) -> None:
        self._cache = ValueCache()

    def sections(
        self, result: LampResult, pictures: Mapping[str, Bytes], version: int
    ) -> tuple[Section, ...]:
        """Build the list, omitting all empty sections other than the first."""
        answers, front = result.answers, result.one.name
        return self._cache.once(
            "sections",
            (front, version),
            answers,
            lambda: sections_of(answers, front, pictures, version),
        )

    def sky(self, result: LampResult) -> SkyState:
        """Build the map for the selected style."""
        question = result.answers.question
        limit = LIMITS.match if question.objective == "picture" else None
        one = result.one
        return self._cache.once(
            "sky", one.name, result.answers, lambda: sky_of(one.map, limit, result.answers.is_open)
        )

    def heads(self, result: LampResult) -> HeadsState:
        """Build the drawing of the lamp around the head."""
        question, one = result.answers.question, result.one
        facing = wrap(one.turn_refined_deg + question.front_deg)
        coming = self._cache.once(
            "coming", facing, question.light, lambda: main_light(question.light, facing)
        )
        where, far, skin = result.spot
        return HeadsState(
            shape=result.answers.hand.base.shape,
            distance_m=result.distance_m,
            azimuth_deg=result.position.azimuth_deg,
            altitude_deg=result.position.altitude_deg,
            best=best_held(one)[:2],
            place_light_deg=coming,
            spoken=tr(
                "{where}, {distance} from the middle of the head, about {skin} from the skin",
                where=where,
                distance=far,
                skin=skin,
            ),
        )
