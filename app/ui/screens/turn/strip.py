"""The background strip: where goal, camera and light are on it."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.angles import difference, whole
from app.core.guidance.guide import Goal, Guide
from app.core.guidance.mode import Mode
from app.core.text import tr
from app.words.guidance import arc_words


@dataclass(frozen=True, slots=True)
class Scale:
    """The strip and the scale under it, in degrees of turn; the scale counts from the goal.

    Attributes:
        now_deg: Turn now; None while unknown.
        camera_deg: The camera's axis as a turn, which differs from `now_deg` where the sitter is
            not in the middle of the picture; None where it does not.
        fov_deg: Width of the frames, degrees of the panorama.
        arc_deg: In the light (from, to), clockwise; None without an arc.
        goal_words, now_words, arc_words: "goal", "now", "green: in the light".
        mirrored: Clockwise runs to the left, as in the pictures of selfie mode.
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
        """Middle of the camera's frame, which is not always behind the sitter."""
        return self.now_deg if self.now_deg is None or self.camera_deg is None else self.camera_deg


def scale_of(
    guidance: Guide, goal: Goal, fov_deg: float, camera_deg: float | None, mode: Mode
) -> Scale:
    """Place goal, camera and arc on the strip.

    Args:
        fov_deg: Part of the panorama that fills the camera's picture, deg.
        camera_deg: The camera's axis as a turn; None where the sitter is in the middle.
    """
    arc = goal.arc_deg
    if arc is not None and arc[1] - arc[0] < 360.0:
        arc = (float(whole(arc[0])), float(whole(arc[1])))
    mirrored = mode is Mode.SELFIE
    now, goal_text, now_text = guidance.now, tr("goal"), tr("now")
    where = tr("heading unknown")
    if now == guidance.goal:
        # Two labels in one place would push each other away.
        goal_text = where = tr("now at the goal")
        now_text = ""
    elif now is not None:
        right = (difference(now, guidance.goal) > 0.0) != mirrored
        where = tr("now to the right of the goal") if right else tr("now to the left of the goal")
    return Scale(
        goal_deg=float(guidance.goal),
        now_deg=None if now is None else float(now),
        camera_deg=None if now is None else camera_deg,
        fov_deg=fov_deg,
        arc_deg=arc,
        goal_words=goal_text,
        now_words=now_text,
        arc_words=tr("green: {arc}", arc=arc_words(guidance)) if guidance.has_arc else "",
        description=tr("The goal is in the middle, {where}", where=where),
        mirrored=mirrored,
    )
