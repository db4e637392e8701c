"""The turn as seen from above, as plain data: the positions of the people and the light.

Up in the drawing is the direction in which the photographer looks at the start. A photographer who
walks around the sitter starts at the bottom, facing the sitter, so the photographer's left is on
the left. In a selfie, the photographer is in the middle. The camera starts in front of the
photographer, at the top, and moves around them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from app.core.base.angles import whole, wrap
from app.core.guidance.guide import Goal, Guide
from app.core.guidance.who_moves import Mode

Kind: TypeAlias = Literal["start", "now", "goal", "nose", "light", "lamp", "background"]
"""Kinds of mark. The first three are placed on the ring that is the photographer's path."""

_APART_DEG: Final = 5.0  # closer marks would hide each other


@dataclass(frozen=True, slots=True)
class PlanMark:
    """A mark for an object around the sitter. If the object is a lamp, `lamp` is its name."""

    kind: Kind
    turn_deg: float
    lamp: str = ""


@dataclass(frozen=True, slots=True)
class PlanDrawing:
    """Contents of the drawing. All angles are turns in degrees, positive clockwise.

    Attributes:
        up_deg: Turn at the top of the drawing.
        nose_deg: Direction of the face in the middle.
        lens_deg: Turn of the lens.
        way: The remaining walk, as the turn at which it starts and its signed angle.
        arc_deg: Range of turns that are in the light, (from, to) clockwise.
        yaw_deg: Turn of the nose at the goal, from the lens towards the sitter's left.
    """

    marks: tuple[PlanMark, ...] = ()
    up_deg: float = 180.0
    nose_deg: float = 0.0
    lens_deg: float = 0.0
    way: tuple[float, float] = (0.0, 0.0)
    arc_deg: tuple[float, float] | None = None
    goal_deg: float = 0.0
    yaw_deg: int = 0
    mode: Mode = Mode.WALK


def plan_of(
    guidance: Guide,
    goal: Goal,
    mode: Mode,
    start_deg: float = 0.0,
    lights: Sequence[PlanMark] = (),
) -> PlanDrawing:
    """Return a drawing of the walk that a guide asks for.

    Args:
        start_deg: Turn to start from while there is no heading.
        lights: Marks for the light sources that light the sitter.
    """
    selfie = mode is Mode.SELFIE
    here = float(whole(start_deg) if guidance.now is None else guidance.now)
    to_go = wrap(guidance.goal - here) if guidance.to_go is None else float(guidance.to_go)
    yaw = round(goal.yaw_deg)
    nose = wrap(here - yaw + (guidance.nose or 0))
    marks: list[PlanMark] = []
    if guidance.number is not None:  # otherwise the position on the ring is unknown
        marks.append(PlanMark("now", here))
    if here != guidance.goal:
        marks.append(PlanMark("goal", float(guidance.goal)))
    if abs(here) > _APART_DEG or guidance.number is None:
        marks.append(PlanMark("start", 0.0))
    marks.append(PlanMark("nose", nose))
    marks += lights
    marks.append(PlanMark("background", wrap(guidance.goal + 180.0)))
    return PlanDrawing(
        marks=tuple(marks),
        up_deg=0.0 if selfie else 180.0,
        nose_deg=nose,
        lens_deg=here,
        way=(here, to_go),
        arc_deg=goal.arc_deg,
        goal_deg=float(guidance.goal),
        yaw_deg=yaw,
        mode=mode,
    )
