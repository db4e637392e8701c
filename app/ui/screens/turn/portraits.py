"""The Target and Now portraits side by side, and the text about the style."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from app.core.base.angles import difference, whole
from app.core.base.arrays import Bytes
from app.core.portrait.head import Head
from app.core.solver.peaks import value_at
from app.core.solver.place_light import Expose, Facing, PlaceLight, picture_at
from app.core.text import tr
from app.ui.presenters.window_model import COMPUTING, LampPlan, Model
from app.words.phrases.directions import SIDE_LINES
from app.words.styles import side_words
from app.words.why_out_of_reach import grade_words

if TYPE_CHECKING:
    from app.core.faces.shot_against_goal import Check
    from app.core.painting.user_style import UserStyle
    from app.core.solver.style_result import StyleResult

_AWAY_DEG: Final = 20.0  # of yaw; up to here the guidance reports a sitter looking into the lens


@dataclass(frozen=True, slots=True)
class StyleWords:
    """The text beside the portraits.

    Attributes:
        match, match_at_goal: Display text such as "Match now 90" and "96 at the goal". Either may
            be empty.
        face: Text on how well the sitter's own face shows the style.
        now_tag: Tag on the second portrait.
    """

    title: str = ""
    side: str = ""
    match: str = ""
    match_at_goal: str = ""
    face: str = ""
    now_tag: str = tr("Now")


def style_words(model: Model, now: int | None, check: Check | None = None) -> StyleWords:
    """Return the text beside the portraits.

    Args:
        now: Turn in whole degrees, or None while it is unknown.
        check: Result of checking the sitter's face in the live picture.
    """
    result, own, plan = model.goal_result, model.own_style, model.lamp_plan
    computing = model.goal_computing
    if result is None:
        return StyleWords(match=COMPUTING) if computing else StyleWords(face=face_words(check))
    built_in = model.head.pack.styles if model.head is not None else ()
    style = next((one for one in built_in if one.name == model.pack_style), None)
    title = own.title if own is not None else result.title
    shape = style or (own.style if own is not None else None)
    side = "" if shape is None else SIDE_LINES.get(shape.side, side_words(shape))
    side, tag = side or tr("painted"), tr("Now") if now is not None else tr("At the goal")
    if plan is not None:
        side, tag = tr("with {lamp}", lamp=plan.lamp), tr("With the lamp")
    if computing:
        return StyleWords(title, side, COMPUTING, now_tag=tag)
    match, at_goal = match_words(result, model.goal_deg, now)
    return StyleWords(title, side, match, at_goal, face_words(check, result.yaw_deg), tag)


def match_words(result: StyleResult, goal_deg: float | None, now: int | None) -> tuple[str, str]:
    """Return the text for the match now and for the match at the goal.

    Args:
        goal_deg: Goal set by the user, in degrees, or None for the best turn.
        now: Turn in whole degrees, or None while it is unknown.

    Returns:
        "Match now 90" and "96 at the goal", rounded down, or "Match 96" and "at the goal" if there
        is no heading.
    """
    best = goal_deg is None or abs(difference(goal_deg, result.turn_refined_deg)) < 1e-6
    # At the best turn, show the same number as the style's card.
    goal = result.match if best else value_at(result.match_curve, goal_deg or 0.0)
    if now is None:
        return tr("Match {match}", match=_floored(goal)), tr("at the goal")
    turn = result.turn_refined_deg if goal_deg is None else goal_deg
    here = goal if now == whole(turn) else value_at(result.match_curve, float(now))
    if best and float(result.match_curve.max()) <= result.match + 1e-6:
        # Between grid turns the interpolated curve may slightly exceed its best value.
        here = min(here, goal)
    return tr("Match now {match}", match=_floored(here)), tr(
        "{match} at the goal", match=_floored(goal)
    )


def face_words(check: Check | None, goal_yaw_deg: float = 0.0) -> str:
    """Describe how well the sitter's face shows the style, or report that the face is turned away.

    Args:
        goal_yaw_deg: Yaw at the goal, in degrees. Unless this is 0, the guidance itself reports the
            yaw of the face.
    """
    if check is None:
        return ""
    yaw = check.light.pose.yaw_deg
    if not goal_yaw_deg and abs(yaw) >= _AWAY_DEG:
        return tr("Head turned {size}° away", size=round(abs(yaw)))
    if check.grade is None or check.match is None:
        return ""
    grade, match = grade_words(check.grade, attainable=True), _floored(check.match)
    return tr("Live face {match}: {grade}", grade=grade, match=match)


def _floored(match: float) -> int:
    return max(math.floor(match), 0)


def target_portrait(head: Head, own: UserStyle | None, name: str, size: tuple[int, int]) -> Bytes:
    """Render the target of a style as (rows, columns, 3) uint8 sRGB on the well's grey."""
    if own is not None:
        return head.portrait(head.target_of(own), size)
    style = head.pack.styles[head.pack.index(name)]
    return head.portrait(head.pack.target(name), size, style)


def now_portrait(
    head: Head,
    light: PlaceLight,
    facing_deg: float,
    size: tuple[int, int],
    expose: Expose = "face",
    plan: LampPlan | None = None,
) -> Bytes:
    """Render the head as this place lights it.

    Args:
        facing_deg: Panorama azimuth of the nose, in degrees.

    Returns:
        The portrait, (rows, columns, 3) uint8 sRGB, in front of the place or on the well's grey.
    """
    if plan is not None:
        return plan.portrait(facing_deg, size)
    picture = picture_at(head.transport, light, facing_deg)
    return head.portrait(picture, size, Facing(light, facing_deg, expose))
