"""The walk from above as plain data: where everybody stands and where the light comes from.

Up in the drawing is where one looks at the start. Who walks around the sitter looks at them and
starts at the foot of it, so that their left is on the left. In a selfie the camera is ahead, at the
top: the one in the middle is oneself, and what goes around is the camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from app.core.base.angles import whole, wrap
from app.core.guidance.guide import Goal, Guide
from app.core.guidance.mode import Mode

Kind: TypeAlias = Literal["start", "now", "goal", "nose", "light", "lamp", "background"]
"""What a mark is; the first three lie on the ring that is walked on."""

_APART_DEG: Final = 5.0  # nearer marks would hide each other


@dataclass(frozen=True, slots=True)
class PlanMark:
    """Something around the sitter; a lamp has its name."""

    kind: Kind
    turn_deg: float
    lamp: str = ""


@dataclass(frozen=True, slots=True)
class PlanDrawing:
    """What the drawing shows; all angles are turns, deg, positive clockwise.

    `up_deg` is at the top, the face in the middle points to `nose_deg` and is seen from the lens
    at `lens_deg`, `way` is the walk that is left, (from, signed degrees), and `arc_deg` what is in
    the light, (from, to) clockwise. At the goal the nose is `yaw_deg` to the sitter's left of the
    lens.
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
    """Draw up the walk that a guide asks for.

    `start_deg`: where one stands while no heading is known; `lights`: what lights the sitter.
    """
    selfie = mode is Mode.SELFIE
    here = float(whole(start_deg) if guidance.now is None else guidance.now)
    to_go = wrap(guidance.goal - here) if guidance.to_go is None else float(guidance.to_go)
    yaw = round(goal.yaw_deg)
    nose = wrap(here - yaw + (guidance.nose or 0))
    marks: list[PlanMark] = []
    if guidance.number is not None:  # without one the place on the ring is not known
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
