"""The lamp in use: its name, its distance and its limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.core.second_light.captured_lamps.captured_lamp import CapturedLamp
from app.core.second_light.in_hand import Lamp
from app.core.second_light.lamp_answers import LampQuestion
from app.core.second_light.lamp_presets import KINDS, at_distance
from app.core.second_light.place_brightness import Comparison, compare
from app.core.text import tr
from app.ui.presenters.services import Services
from app.ui.screens.light.brightness import PlaceScale
from app.ui.screens.light.lamp_list import LampList
from app.words.lamps import lamp_title

_USUAL_M: Final = 0.3

DISTANCES_M: tuple[float, ...] = (
    *(round(0.2 + 0.05 * step, 2) for step in range(16)),
    *(round(1.0 + 0.1 * step, 1) for step in range(10)),
    *(2.0 + 0.5 * step for step in range(7)),
)
"""Stops on the distance slider, in metres from the centre of the head."""


@dataclass(frozen=True, slots=True)
class LampState:
    """The lamp in use, its limits and the brightness of the place.

    Attributes:
        items: Key, title, description and icon for each available lamp.
        brightness: Text such as "460 lx at the face, as measured", or an empty string while the
            brightness of the place is unknown.
    """

    items: tuple[tuple[str, str, str, str], ...] = ()
    key: str = ""
    distance: int = 0
    distance_fixed: str = ""
    arm: bool = False
    floor: bool = True
    brightness: str = ""
    own: bool = False


def nearest_stop(distance_m: float) -> int:
    """Return the index of the distance slider's stop that is nearest to a distance.

    Examples:
        >>> DISTANCES_M[nearest_stop(0.31)]
        0.3
    """
    return min(range(len(DISTANCES_M)), key=lambda stop: abs(DISTANCES_M[stop] - distance_m))


def lamp_words(title: str) -> str:
    """Return the name of a lamp as it should appear within a sentence.

    Examples:
        >>> lamp_words("Phone screen"), lamp_words("LED panel")
        ('phone screen', 'LED panel')
    """
    return title if title[1:2].isupper() else title[:1].lower() + title[1:]


def lamp_name(lamp: Lamp) -> str:
    """Return the lamp's name, with its article, for use in a sentence, such as "the LED panel"."""
    if isinstance(lamp, CapturedLamp):
        return f"“{lamp.title}”"
    return tr("the {lamp}", lamp=lamp_words(lamp_title(lamp.kind)))


class LampHold:
    """The lamp in use, its distance from the head and its limits.

    Attributes:
        stop: Index into `DISTANCES_M`.
        arm: Whether the lamp must stay within arm's reach.
        floor: Whether the lamp must stay above floor level.
    """

    def __init__(self, services: Services, lamps: LampList, scale: PlaceScale) -> None:
        self._services, self._lamps, self._scale = services, lamps, scale
        self.stop = nearest_stop(_USUAL_M)
        self.arm, self.floor = False, True

    def state(self) -> LampState:
        """Return the state of the left-hand column."""
        lamps = self._lamps
        return LampState(
            items=lamps.items,
            key=lamps.key,
            distance=self.stop,
            distance_fixed=lamps.fixed,
            arm=self.arm,
            floor=self.floor,
            brightness="" if self._services.model.light is None else self._scale.words,
            own=lamps.own is not None,
        )

    def lamp(self) -> Lamp | None:
        """Return the lamp in use, or None if that lamp cannot be compared with the place."""
        key = self._lamps.key
        if key in KINDS:
            return at_distance(KINDS[key], DISTANCES_M[self.stop])
        return self._lamps.own if self.comparison().possible else None

    def comparison(self) -> Comparison:
        """Return how the exposure of the captured lamp compares with that of the place."""
        own = self._lamps.own
        if own is None:
            return Comparison()
        return compare(self._scale.white, own, place_camera=self._scale.camera)

    @property
    def distance_m(self) -> float:
        """Distance of the lamp from the centre of the head, in metres."""
        own = self._lamps.own
        if own is not None and own.distance_m is not None:
            return own.distance_m
        return DISTANCES_M[self.stop]

    def question(self) -> LampQuestion | None:
        """Return the question for the search, or None if the brightness of the place is unknown."""
        model, gain = self._services.model, self._scale.white
        if model.light is None or gain is None:
            return None
        return LampQuestion(
            light=model.light,
            gain=gain,
            front_deg=model.front_deg,
            arm=self.arm,
            floor=self.floor,
            distance_m=self.distance_m,
            objective=model.settings.objective,
            lens=model.lens,
        )
