"""The result for the selected style, with the lamp at its current position."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.core.base.angles import whole, wrap
from app.core.second_light.lamp_answers import Answers, LampPosition, best_held, powers_for
from app.core.second_light.placements import direction
from app.core.second_light.search import LampPlacement
from app.ui.screens.light.placement.pictures import LampView
from app.words.phrases.directions import placement_words
from app.words.phrases.quantities import metres

_AT_BEST_DEG: Final = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class LampResult:
    """The result for the selected style, with the lamp at its current position."""

    answers: Answers
    one: LampPlacement
    position: LampPosition
    distance_m: float
    newest: LampView | None = None
    lens: LampPlacement | None = None

    @property
    def at_best(self) -> bool:
        """Whether the lamp is at its best power and within half a degree of its best position."""
        best, position = best_held(self.one), self.position
        across = abs(wrap(position.azimuth_deg - best.azimuth_deg))
        near = (
            across < _AT_BEST_DEG and abs(position.altitude_deg - best.altitude_deg) < _AT_BEST_DEG
        )
        return near and position.power == best.power

    @property
    def view(self) -> LampView | None:
        """The newest pictures, if they belong to this style and these answers."""
        view = self.newest
        is_current = (
            view is not None and view.answers is self.answers and view.name == self.one.name
        )
        return view if is_current else None

    @property
    def match(self) -> float | None:
        """Match with the lamp at its current position, or None until the match is computed."""
        if self.at_best:
            return self.one.match
        view = self.view
        return view.match if view is not None and view.position == self.position else None

    @property
    def dims(self) -> bool:
        """Whether the lamp has more than one power."""
        return len(powers_for(self.answers)) > 1

    @property
    def spot(self) -> tuple[str, str, str]:
        """Position of the lamp as text: the direction and the distances from head and skin."""
        place = direction(*self.position[:2]) * self.distance_m
        skin = self.answers.hand.base.shape.distance_to_skin(place)
        azimuth, altitude = (float(whole(angle)) for angle in self.position[:2])
        where = placement_words(azimuth, altitude)
        return where, metres(self.distance_m), metres(skin, rough=True)
