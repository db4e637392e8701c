"""The walk seen from above: the sitter, the photographer, the goal and the light on the face."""

from __future__ import annotations

from app.core.base.angles import wrap
from app.core.guidance.guide import Goal, Guide
from app.core.guidance.walk_plan import PlanDrawing, PlanMark, plan_of
from app.core.guidance.who_moves import Mode
from app.core.solver.place_light import main_light
from app.ui.presenters.window_model import Model
from app.words.guidance import guide_words
from app.words.plan import PlanWords, plan_words


def walk_plan(
    model: Model, guide: Guide, goal: Goal, mode: Mode, from_deg: float
) -> tuple[PlanDrawing, PlanWords]:
    """Draw the walk with the place's main light and the lamp to hold.

    Args:
        from_deg: Turn at which the walk starts, in degrees.
    """
    lamp, light = model.lamp_plan, model.light
    main = None if light is None else main_light(light, model.front_deg)
    lights: list[PlanMark] = []
    if main is not None:
        # Azimuths are positive towards the face's left, but turns are positive clockwise.
        lights.append(PlanMark("light", wrap(-main)))
    if lamp is not None:
        nose = guide.goal - goal.yaw_deg
        lights.append(PlanMark("lamp", wrap(nose - lamp.azimuth_deg), lamp.lamp))
    words = guide_words(guide, mode)
    plan = plan_of(guide, goal, mode, from_deg, lights)
    return plan, plan_words(plan, words.light if guide.inside else words.walk)
