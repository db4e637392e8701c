"""The walk from above as plain data: who stands where, from where the light comes, in words too.

Up in the drawing is where one looks at the start. Who walks around the sitter looks at them and
starts at the foot of it, so that their left is on the left. In a selfie the camera is ahead, at the
top: the one in the middle is oneself, and what goes around is the camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from app.core.base.angles import wrap
from app.core.guidance.guide import Goal, Guide
from app.core.text import tr
from app.core.text.directions import direction_words, lens_words
from app.core.text.turns import Mode, whole

Kind: TypeAlias = Literal["start", "now", "goal", "nose", "light", "lamp", "background"]
"""What a mark is; the first three lie on the ring that is walked on."""

_APART_DEG: Final = 5.0  # nearer marks would hide each other


@dataclass(frozen=True, slots=True)
class Mark:
    """Something around the sitter, with its word."""

    kind: Kind
    words: str
    turn_deg: float


@dataclass(frozen=True, slots=True)
class Plan:
    """What the drawing shows; all angles are turns, deg, positive clockwise.

    `up_deg` is at the top, the face in the middle points to `nose_deg` and is seen from the lens
    at `lens_deg`, `way` is the walk that is left, (from, signed degrees), and `arc_deg` what is in
    the light, (from, to) clockwise.
    """

    marks: tuple[Mark, ...] = ()
    up_deg: float = 180.0
    nose_deg: float = 0.0
    lens_deg: float = 0.0
    way: tuple[float, float] = (0.0, 0.0)
    arc_deg: tuple[float, float] | None = None
    title: str = tr("From above")
    description: str = ""


def plan_of(
    shown: Guide,
    goal: Goal,
    mode: Mode,
    start_deg: float = 0.0,
    lights: Sequence[tuple[Kind, str, float]] = (),
    step: str = "",
) -> Plan:
    """Draw up the walk that a guide asks for.

    `start_deg`: where one stands while no heading is known; `lights`: kind, word and turn of each;
    `step`: what to do, in words.
    """
    selfie = mode is Mode.SELFIE
    here = float(whole(start_deg) if shown.now is None else shown.now)
    to_go = wrap(shown.goal - here) if shown.to_go is None else float(shown.to_go)
    yaw = round(goal.yaw_deg)
    nose = wrap(here - yaw + (shown.nose or 0))
    marks: list[Mark] = []
    if shown.number is not None:  # without one the place on the ring is not known
        marks.append(Mark("now", tr("camera") if selfie else tr("you"), here))
    if here != shown.goal:
        marks.append(Mark("goal", tr("goal"), float(shown.goal)))
    if abs(here) > _APART_DEG or shown.number is None:
        marks.append(Mark("start", tr("start"), 0.0))
    marks.append(Mark("nose", tr("nose") if yaw else "", nose))
    marks += [Mark(*light) for light in lights]
    marks.append(Mark("background", tr("background"), wrap(shown.goal + 180.0)))
    said = [step]
    for _, words, turn in lights:
        where = direction_words(wrap(turn - shown.goal + yaw), 0.0, of_sitter=True)
        said.append(tr("At the goal, {what}: {where}", what=words, where=where))
    if yaw:
        said.insert(0, lens_words(yaw))
    return Plan(
        marks=tuple(marks),
        up_deg=0.0 if selfie else 180.0,
        nose_deg=nose,
        lens_deg=here,
        way=(here, to_go),
        arc_deg=goal.arc_deg,
        title=tr("You, from above") if selfie else tr("From above"),
        description=". ".join(part for part in said if part),
    )
