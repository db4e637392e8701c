"""Text of the plan from above: labels for the marks, and a description for screen readers."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.angles import wrap
from app.core.guidance.walk_plan import PlanDrawing, PlanMark
from app.core.guidance.who_moves import Mode
from app.core.text import tr
from app.words.phrases.directions import direction_words, lens_words


@dataclass(frozen=True, slots=True)
class PlanWords:
    """Text of a plan.

    Attributes:
        labels: Labels, in the same order as the marks. The label is an empty string for a mark that
            has none.
        description: Description for a screen reader.
    """

    title: str = ""
    labels: tuple[str, ...] = ()
    description: str = ""


def plan_words(plan: PlanDrawing, step: str = "") -> PlanWords:
    """Return the text of a plan.

    Args:
        step: Current instruction of the guidance.
    """
    labels = tuple(_label(mark, plan) for mark in plan.marks)
    parts = [lens_words(plan.yaw_deg) if plan.yaw_deg else "", step]
    for mark, label in zip(plan.marks, labels, strict=True):
        if mark.kind in ("light", "lamp"):
            turn = wrap(mark.turn_deg - plan.goal_deg + plan.yaw_deg)
            where = direction_words(turn, 0.0, of_sitter=True)
            parts.append(tr("At the goal, {what}: {where}", what=label, where=where))
    selfie = plan.mode is Mode.SELFIE
    return PlanWords(
        title=tr("You, from above") if selfie else tr("From above"),
        labels=labels,
        description=". ".join(part for part in parts if part),
    )


def _label(mark: PlanMark, plan: PlanDrawing) -> str:
    if mark.kind == "lamp":
        return mark.lamp
    if mark.kind == "now":
        return tr("camera") if plan.mode is Mode.SELFIE else tr("you")
    if mark.kind == "nose":
        return tr("nose") if plan.yaw_deg else ""
    return {
        "goal": tr("goal"),
        "start": tr("start"),
        "light": tr("light"),
        "background": tr("background"),
    }[mark.kind]
