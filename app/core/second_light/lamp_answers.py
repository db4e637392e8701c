"""The search for a lamp's best position, with its question and its results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.base.progress import Report, Token
from app.core.second_light.in_hand import InHand, Lamp, take_in_hand
from app.core.second_light.lamp_on_turned_head import seen_aside
from app.core.second_light.lamp_presets import FULL, NumbersLamp, powers_of
from app.core.second_light.placements import COUNT, above_floor, within_arm
from app.core.second_light.search import LampPlacement, place_all
from app.core.solver.lens.lens_wish import STRAIGHT, LensWish
from app.core.solver.place_light import PlaceLight
from app.core.solver.turn_choice import Objective


class LampPosition(NamedTuple):
    """The position and the power of a lamp."""

    azimuth_deg: float
    altitude_deg: float
    power: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class LampQuestion:
    """The question that a search answers.

    Attributes:
        gain: Luminance represented by a radiance of 1, in cd/m2.
    """

    light: PlaceLight
    gain: float
    front_deg: float = 0.0
    arm: bool = False
    floor: bool = True
    distance_m: float = 0.3
    objective: Objective = "picture"
    lens: LensWish = STRAIGHT

    @property
    def key(self) -> tuple[object, ...]:
        """Key for caching answers. Questions with equal keys have equal answers."""
        values = (self.gain, self.front_deg, self.arm, self.floor, self.distance_m)
        return (self.light, *values, self.objective, self.lens)


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """The best position of a lamp for each style.

    Attributes:
        is_open: (576,) bool. For each placement, whether the lamp can be held there.
    """

    hand: InHand
    question: LampQuestion
    placements: tuple[LampPlacement, ...] = field(repr=False)
    is_open: NDArray[np.bool_] = field(repr=False)

    def of(self, name: str | None) -> LampPlacement | None:
        """Return the placement for a style, or None if there is none."""
        return next((one for one in self.placements if one.name == name), None)


@dataclass(frozen=True, slots=True, eq=False)
class Nearer:
    """The effect of moving a lamp closer to the head.

    This effect is computed only if the lamp brings no style within reach at its current distance.
    """

    answers: Answers
    one: LampPlacement
    distance_m: float


def powers_for(answers: Answers) -> tuple[float, ...]:
    """Return the powers included in the search, from strongest to weakest."""
    return lamp_powers(answers.hand.lamp, answers.question.objective)


def lamp_powers(lamp: Lamp, objective: Objective) -> tuple[float, ...]:
    """Return the powers to include in a search. The paper's objective uses only full power."""
    if objective == "paper" or not isinstance(lamp, NumbersLamp):
        return FULL
    return powers_of(lamp.kind)


def best_held(placement: LampPlacement) -> LampPosition:
    """Return the best position and power, interpolated between the placements of the search."""
    return LampPosition(
        placement.lamp_azimuth_refined_deg, placement.lamp_altitude_refined_deg, placement.power
    )


def seen_from(answers: Answers, one: LampPlacement) -> LampPlacement:
    """Return the placement with the lens at the best position that the user's limits allow."""
    hand, head, question = answers.hand, answers.hand.head, answers.question
    if not head.views:
        return one
    light = question.light.searched * np.float32(question.gain)
    near = hand.lamp if isinstance(hand.lamp, NumbersLamp) else None
    wish = question.lens.moved(question.front_deg)
    return seen_aside(head.pack, head.aside, (one,), light, hand.lamp_light, near, wish)[0]


def kind_of(answers: Answers) -> str:
    """Return the kind of the lamp, or an empty string for a captured lamp."""
    lamp = answers.hand.lamp
    return lamp.kind if isinstance(lamp, NumbersLamp) else ""


def ask(hand: InHand, question: LampQuestion, styles: Sequence[str] | None = None) -> Answers:
    """Find the best position of a lamp for each of the given styles, or for all by default."""
    is_open = _open_spots(question)
    placements = place_all(
        hand.head.pack,
        hand.head.transport,
        question.light.searched_by(question.objective) * np.float32(question.gain),
        hand.lamp_light,
        question.objective,
        styles=styles,
        is_open=is_open,
        powers=lamp_powers(hand.lamp, question.objective),
        front_deg=question.front_deg,
        tables=hand.tables,
    )
    return Answers(hand, question, tuple(placements), is_open)


def _open_spots(question: LampQuestion) -> NDArray[np.bool_]:
    distance = question.distance_m
    is_open = np.ones(COUNT, bool)
    if question.arm:
        is_open &= within_arm(distance)
    if question.floor:
        is_open &= above_floor(distance)
    return is_open


def closer(
    answers: Answers, lamp: NumbersLamp, names: Sequence[str], token: Token, report: Report
) -> LampPlacement | None:
    """Return the placement for the style that the lamp suits best at a shorter distance.

    Returns:
        The best placement, preferably one that brings a style within reach, or None.
    """
    hand = take_in_hand(answers.hand.base, lamp, token, report)
    token.check()
    placements = ask(hand, answers.question, names).placements
    return max(
        placements, key=lambda one: (one.rescued, one.grade != "soft", one.match), default=None
    )
