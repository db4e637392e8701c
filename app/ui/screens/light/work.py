"""What the Light screen has worked out in the background: a lamp, its places, its pictures."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias

import numpy as np

from app.core.base.angles import wrap
from app.core.base.colour import luminance
from app.core.base.progress import span
from app.core.second_light import added as added_lights
from app.core.second_light.captured import CapturedLamp, placed
from app.core.second_light.contrast import FaceBasis, prepare_face
from app.core.second_light.lamp_presets import FULL, NumbersLamp, powers_of
from app.core.second_light.near import NearField, prepare_near
from app.core.second_light.placements import COUNT, above_floor, within_arm
from app.core.second_light.search import place_all
from app.core.second_light.search_kernel import LampTables, lamp_tables
from app.core.solver.environment import solid_angles
from app.core.solver.head_shape import load_shape_of
from app.core.solver.reach import LIMITS, Limits

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from app.core.base.progress import Report, Token
    from app.core.second_light.added import AddedLight
    from app.core.second_light.search import Placed
    from app.core.solver.head_shape import HeadShape
    from app.core.solver.place_light import PlaceLight
    from app.core.solver.reach import Objective
    from app.ui.presenters.model import Head

Lamp: TypeAlias = "NumbersLamp | CapturedLamp"

_ONE_SIDED: Final = 0.2  # share of the light that comes from one side, for it to have a side


class Held(NamedTuple):
    """Where and how a lamp is held."""

    azimuth_deg: float
    altitude_deg: float
    power: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class InHand:
    """A lamp, ready to be placed around a head."""

    head: Head
    shape: HeadShape = field(repr=False)
    near: NearField = field(repr=False)
    face: FaceBasis = field(repr=False)
    lamp: Lamp
    added: AddedLight = field(repr=False)
    tables: LampTables = field(repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class Question:
    """What places are asked for.

    Attributes
    ----------
    gain : float
        Luminance of radiance 1, cd/m2.
    objective : str
        "picture" or "paper".
    """

    light: PlaceLight
    gain: float
    front_deg: float = 0.0
    arm: bool = False
    floor: bool = True
    distance_m: float = 0.3
    objective: Objective = "picture"
    limits: Limits = LIMITS

    @property
    def key(self) -> tuple[object, ...]:
        """Equal keys have equal answers."""
        values = (self.gain, self.front_deg, self.arm, self.floor, self.distance_m)
        return (self.light, *values, self.objective, self.limits)


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """Where a lamp belongs for every style.

    Attributes
    ----------
    allowed : (576,) bool
        Placements that can be reached.
    """

    hand: InHand
    question: Question
    placed: tuple[Placed, ...] = field(repr=False)
    allowed: NDArray[np.bool_] = field(repr=False)

    def of(self, name: str | None) -> Placed | None:
        """Give the answer for a style."""
        return next((one for one in self.placed if one.name == name), None)


def main_light(light: PlaceLight, facing_deg: float) -> float | None:
    """From where a place lights the face.

    Parameters
    ----------
    facing_deg : float
        Azimuth in the panorama that the sitter faces, deg.

    Returns
    -------
    float or None
        Azimuth relative to the face, positive toward the sitter's left, deg; None where light
        comes from all around alike.
    """
    rows, columns = light.searched.shape[:2]
    elevation = np.pi * (0.5 - (np.arange(rows) + 0.5) / rows)
    azimuth = 2.0 * np.pi * ((np.arange(columns) + 0.5) / columns - 0.5)
    amount = luminance(light.searched) * solid_angles((rows, columns))[:, None]
    level = (amount * np.cos(elevation)[:, None]).sum(axis=0)
    east, north = float(level @ np.sin(azimuth)), float(level @ np.cos(azimuth))
    if math.hypot(east, north) < _ONE_SIDED * float(amount.sum()):
        return None
    # The panorama's azimuth grows toward the sitter's right.
    return wrap(facing_deg - math.degrees(math.atan2(east, north)))


def take_in_hand(
    head: Head, lamp: Lamp, known: InHand | None, token: Token, report: Report
) -> InHand:
    """Get a lamp ready; the head's part is taken over where it is known.

    Parameters
    ----------
    token, report : Token, Report
        To stop, and to say how far it is.

    Raises
    ------
    CoreError
        If the head's shape is missing, or the lamp cannot be used.
    Cancelled
        When the token says so.
    """
    if known is not None and known.head is head:
        shape, near, face = known.shape, known.near, known.face
    else:
        shape = load_shape_of(head.transport, head.name)
        token.check()
        near = prepare_near(head.transport, shape)
        token.check()
        face = prepare_face(head.transport)
    token.check()
    if isinstance(lamp, NumbersLamp):
        added = added_lights.from_numbers(
            head.transport, shape, lamp, token, report, near=near, face=face
        )
    else:
        around = placed(lamp, token=token, report=span(report, 0.0, 0.3))
        added = added_lights.from_captured(head.transport, around, token, report, face=face)
    tables = lamp_tables(head.pack, head.transport, added)
    return InHand(head, shape, near, face, lamp, added, tables)


def ask(hand: InHand, question: Question, styles: Sequence[str] | None = None) -> Answers:
    """Place a lamp for every style, or for some."""
    allowed = _allowed(question)
    found = place_all(
        hand.head.pack,
        hand.head.transport,
        question.light.searched * np.float32(question.gain),
        hand.added,
        question.objective,
        styles=styles,
        allowed=allowed,
        powers=_powers(hand.lamp, question.objective),
        limits=question.limits,
        front_deg=question.front_deg,
        tables=hand.tables,
    )
    return Answers(hand, question, tuple(found), allowed)


def _allowed(question: Question) -> NDArray[np.bool_]:
    distance = question.distance_m
    allowed = np.ones(COUNT, bool)
    if question.arm:
        allowed &= within_arm(distance)
    if question.floor:
        allowed &= above_floor(distance)
    return allowed


def powers_for(answers: Answers) -> tuple[float, ...]:
    """Return the powers that the lamp of some answers was tried at, the strongest first."""
    return _powers(answers.hand.lamp, answers.question.objective)


def _powers(lamp: Lamp, objective: Objective) -> tuple[float, ...]:
    """As the ``light`` command: the paper's objective takes lamps as their numbers say."""
    if objective == "paper" or not isinstance(lamp, NumbersLamp):
        return FULL
    return powers_of(lamp.kind)


def best_held(placed: Placed) -> Held:
    """Give the best place of a lamp, between the placements of the search, and its power."""
    return Held(placed.lamp_azimuth_refined_deg, placed.lamp_altitude_refined_deg, placed.power)


def closer(
    answers: Answers, lamp: NumbersLamp, names: Sequence[str], token: Token, report: Report
) -> Placed | None:
    """Find what a lamp would rescue from nearer by.

    Returns
    -------
    Placed or None
        The style that comes out best; None without any.
    """
    hand = take_in_hand(answers.hand.head, lamp, answers.hand, token, report)
    found = ask(hand, answers.question, names).placed
    return max(found, key=lambda one: (one.attainable, one.match), default=None)
