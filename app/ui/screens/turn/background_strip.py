"""Positions of the goal, the camera and the light on the background strip."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.angles import difference, whole
from app.core.guidance.guide import Goal, Guide
from app.core.guidance.who_moves import Mode
from app.core.text import tr
from app.words.guidance import arc_words


@dataclass(frozen=True, slots=True)
class Scale:
    """The state of the strip and of the scale below it, in degrees of turn.

    Attributes:
        now_deg: Current turn, or None while it is unknown.
        camera_deg: Turn of the camera's axis, or None while it is unknown. It differs from
            `now_deg` if the sitter is off-centre.
        fov_deg: Width of the frames, as an angle of the panorama in degrees.
        arc_deg: Start and end of the arc that is in the light, in clockwise order, or None if there
            is no arc.
        goal_words, now_words, arc_words: Display text such as "goal", "now" and "green: in the
            light".
        mirrored: Whether clockwise turns run to the left, as they do in selfie mode.
    """

    goal_deg: float = 0.0
    now_deg: float | None = None
    camera_deg: float | None = None
    fov_deg: float = 60.0
    arc_deg: tuple[float, float] | None = None
    goal_words: str = ""
    now_words: str = ""
    arc_words: str = ""
    description: str = ""
    mirrored: bool = False

    @property
    def frame_deg(self) -> float | None:
        """Turn at the centre of the camera's frame, which is not always behind the sitter."""
        return self.now_deg if self.now_deg is None or self.camera_deg is None else self.camera_deg


def scale_of(
    guidance: Guide, goal: Goal, fov_deg: float, camera_deg: float | None, mode: Mode
) -> Scale:
    """Place the goal, the camera and the arc on the strip.

    Args:
        fov_deg: Horizontal angle of the panorama that fills the camera's picture, in degrees.
        camera_deg: Turn of the camera's axis, or None if it is unknown.
    """
    arc = goal.arc_deg
    if arc is not None and arc[1] - arc[0] < 360.0:
        arc = (float(whole(arc[0])), float(whole(arc[1])))
    mirrored = mode is Mode.SELFIE
    now, goal_text, now_text = guidance.now, tr("goal"), tr("now")
    where = tr("Heading unknown")
    if now == guidance.goal:
        # Two labels at the same place would push each other away.
        goal_text, now_text = tr("now at the goal"), ""
        where = tr("The camera is at the goal")
    elif now is not None:
        right = (difference(now, guidance.goal) > 0.0) != mirrored
        where = tr("The camera is to its right") if right else tr("The camera is to its left")
    return Scale(
        goal_deg=float(guidance.goal),
        now_deg=None if now is None else float(now),
        camera_deg=None if now is None else camera_deg,
        fov_deg=fov_deg,
        arc_deg=arc,
        goal_words=goal_text,
        now_words=now_text,
        arc_words=tr("green: {arc}", arc=arc_words(guidance)) if guidance.has_arc else "",
        description=tr("The goal is in the middle. {where}.", where=where),
        mirrored=mirrored,
    )
