"""What the Turn screen shows, as plain data; words are ready to print, pictures to be shown."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol, TypeAlias

from app.core.base.angles import difference, whole
from app.core.base.arrays import Bytes
from app.core.guidance.guide import Goal, Guide, Phase
from app.core.guidance.mode import Mode
from app.core.guidance.plan import PlanDrawing
from app.core.portrait.gallery_portraits import value_at
from app.core.text import tr
from app.ui.presenters.model import Model
from app.words.guidance import arc_words
from app.words.phrases.directions import SIDE_LINES
from app.words.phrases.quantities import lower_first
from app.words.plan import PlanWords
from app.words.shortfall import grade_words
from app.words.styles import side_words

if TYPE_CHECKING:
    from app.core.faces.shot_check import Check
    from app.core.painting.user_style import UserStyle
    from app.core.solver.solve import StyleResult

Size: TypeAlias = tuple[int, int]
"""Rows and columns, device pixels."""

Sign: TypeAlias = Literal["clockwise", "counter-clockwise", "check", "none"]
"""What stands in the place of the arrow."""

ASPECT: float = 1.5
"""Columns over rows of a picture that fills its well; a higher one is cut at top and bottom."""


_AWAY_DEG: float = 20.0  # of yaw: a sitter who looks into the lens is told at less


@dataclass(frozen=True, slots=True)
class TurnSizes:
    """How large pictures are on the view's screen, rows and columns of device pixels."""

    well: Size = (269, 404)
    strip: Size = (220, 824)
    portrait: Size = (136, 132)


@dataclass(frozen=True, slots=True)
class Guidance:
    """The right column.

    Attributes:
        number: Whole degrees; None where none may be shown.
        number_words: "to go", "to the best", or nothing.
        walk, company: "Walk to your left", "The sitter turns with you."; may be empty.
        pill, pill_icon: "Not in the light yet"; empty for none.
        inside: In the light: the whole column turns green.
    """

    phase: Phase = Phase.STARTING
    sign: Sign = "none"
    number: int | None = None
    number_words: str = ""
    direction: str = ""
    walk: str = ""
    company: str = ""
    pill: str = ""
    pill_icon: str = "bulb"
    inside: bool = False
    sentence: str = ""
    sentence_icon: str = "webcam"
    advice: str = ""
    spoken: str = ""
    announced: str = ""


@dataclass(frozen=True, slots=True)
class StyleWords:
    """What stands beside target and picture.

    `match`, `match_at_goal`: "Match now 90", "96 at the goal"; may be empty. `face`: what the
    sitter's own face shows.
    """

    title: str = ""
    side: str = ""
    match: str = ""
    match_at_goal: str = ""
    face: str = ""
    now_tag: str = tr("Now")


@dataclass(frozen=True, slots=True)
class LiveWords:
    """What is said about the two wells.

    Attributes:
        live, goal: Behind their headings: "webcam".
        message, brief: What is wrong and what to do, and what is wrong alone.
        aspect: Columns over rows of both wells.
    """

    live: str = ""
    goal: str = tr("what the camera should see")
    name: str = ""
    message: str = ""
    brief: str = ""
    tag: str = ""
    dim: bool = False
    asking: bool = False
    aspect: float = ASPECT


@dataclass(frozen=True, slots=True)
class Scale:
    """Strip and scale; all of it in whole degrees of turn. The scale counts from the goal.

    Attributes:
        now_deg: Now; None while it is not known.
        camera_deg: Where the camera's axis points, as a turn: beside `now_deg` where the sitter is
            not in the middle of the picture; None for `now_deg`.
        fov_deg: Width of the frames, degrees of the panorama.
        arc_deg: tuple of float or None. In the light (from, to), clockwise.
        goal_words, now_words, arc_words: "goal", "now", "green: in the light".
        mirrored: As the pictures in selfie mode: clockwise goes to the left.
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
        """Where the frame of the camera is: what is behind the sitter may be beside its middle."""
        return self.now_deg if self.now_deg is None or self.camera_deg is None else self.camera_deg


@dataclass(frozen=True, slots=True)
class Tools:
    """The row at the foot of the left column.

    Attributes:
        align_mode: ``overlay``, ``split`` or ``blink``: how live and goal are compared.
        swaps: Live and goal take turns by a button: they do not blink where motion is reduced.
        opacity: Of live over the goal, or how much of it stands beside the goal, per cent.
        demo_deg: Where the demo's camera is, whole degrees of turn; None for a real one.
    """

    aligning: bool = False
    can_align: bool = False
    align_mode: str = "overlay"
    swaps: bool = False
    opacity: int = 45
    quality: str = ""
    quality_icon: str = "target"
    demo_deg: int | None = None
    webcams: tuple[tuple[int, str], ...] = ()
    webcam: int = 0
    looks: str = "ask"
    sounds: bool = True


@dataclass(frozen=True, slots=True)
class ShotRow:
    """One photograph that was taken here.

    Attributes:
        sentence: "In the light, 3° short of the best".
        face: What the face shows beside what was promised; may be empty.
        again: It was not in the best light: one may turn again.
        thumbnail: (h, w, 3) uint8 or None. sRGB.
    """

    key: str
    name: str
    sentence: str
    detail: str
    face: str = ""
    icon: str = "target"
    inside: bool = False
    new: bool = False
    again: bool = False
    pictured: bool = False
    thumbnail: Bytes | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class ShotsState:
    """The photographs of the open place; `before` and `after`: the last two of one style.

    `mirrored`: whether photos are read as mirror images where the place does not decide.
    """

    rows: tuple[ShotRow, ...] = ()
    busy: str = ""
    before: ShotRow | None = None
    after: ShotRow | None = None
    mirrored: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Pictures:
    """Pictures, (h, w, 3) uint8 sRGB; another one is another object.

    Attributes:
        live, goal: uint8 or None. For the wells; mirrored in selfie mode.
        strip: uint8 or None. 150° of background; mirrored in selfie mode.
        target, now: uint8 or None. Portraits.
    """

    live: Bytes | None = field(default=None, repr=False)
    goal: Bytes | None = field(default=None, repr=False)
    strip: Bytes | None = field(default=None, repr=False)
    target: Bytes | None = field(default=None, repr=False)
    now: Bytes | None = field(default=None, repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class TurnState:
    """Everything on the screen.

    `stale`: goal and match are not of what is selected; dimmed under "Computing…".
    """

    empty: str = ""
    empty_action: str = ""
    mode: str = "walk"
    stale: bool = False
    guidance: Guidance = field(default_factory=Guidance)
    style: StyleWords = field(default_factory=StyleWords)
    live: LiveWords = field(default_factory=LiveWords)
    scale: Scale = field(default_factory=Scale)
    plan: PlanDrawing = field(default_factory=PlanDrawing)
    plan_words: PlanWords = field(default_factory=PlanWords)
    tools: Tools = field(default_factory=Tools)
    shots: ShotsState = field(default_factory=ShotsState)
    pictures: Pictures = field(default_factory=Pictures)


class TurnView(Protocol):
    """Shows a `TurnState`."""

    def show_state(self, state: TurnState) -> None:
        """Show it."""

    def ask_photos(self) -> None:
        """Ask which photographs were taken."""

    def ask_folder(self) -> None:
        """Ask into which folder photographs come."""

    def ask_source(self) -> None:
        """Ask for another live camera."""


def arc_of(result: StyleResult | None, goal_deg: float) -> tuple[float, float] | None:
    """Choose the tolerance arc of a goal: that of the peak nearest to it.

    Returns (from, to), clockwise, deg; None where the goal is on none.
    """
    if result is None or not result.attainable:
        return None
    return result.arc_at(goal_deg)


def goal_of(model: Model) -> Goal | None:
    """Give the goal with its arc and its lamp; None where there is nothing to turn to."""
    turn, plan = model.target_turn_deg, model.lamp_plan
    if turn is None:
        return None
    lamp = "" if plan is None else lower_first(plan.hold)
    result = model.goal_result
    return Goal(turn, arc_of(result, turn), lamp, 0.0 if result is None else result.yaw_deg)


def scale_of(
    guidance: Guide, goal: Goal, fov_deg: float, camera_deg: float | None, mode: Mode
) -> Scale:
    """Say where goal, camera and arc are on the strip.

    Args:
        fov_deg: How much of the panorama fills the camera's picture, deg.
        camera_deg: Where the camera's axis points, as a turn; None where the sitter is in the
            middle.
    """
    arc = goal.arc_deg
    if arc is not None and arc[1] - arc[0] < 360.0:
        arc = (float(whole(arc[0])), float(whole(arc[1])))
    mirrored = mode is Mode.SELFIE
    now, goal_text, now_text = guidance.now, tr("goal"), tr("now")
    where = tr("where the camera points is not known")
    if now == guidance.goal:
        # Two labels at one place would push each other away from it.
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


def match_words(result: StyleResult, goal_deg: float | None, now: int | None) -> tuple[str, str]:
    """Write how much the picture is like the target, now and at the goal.

    Args:
        goal_deg: A goal of one's own, deg; None for the best turn.
        now: Whole degrees of turn; None while it is not known.

    Returns:
        "Match now 90" and "96 at the goal", rounded down as everywhere; without a heading "Match
        96" and "at the goal".
    """
    best = goal_deg is None or abs(difference(goal_deg, result.turn_refined_deg)) < 1e-6
    # At the best turn it is the number on the style's card.
    goal = result.match if best else value_at(result.match_curve, goal_deg or 0.0)
    if now is None:
        return tr("Match {match}", match=_floored(goal)), tr("at the goal")
    turn = result.turn_refined_deg if goal_deg is None else goal_deg
    here = goal if now == whole(turn) else value_at(result.match_curve, float(now))
    if best and float(result.match_curve.max()) <= result.match + 1e-6:
        # Between the turns of the grid the curve may rise a little above its best.
        here = min(here, goal)
    return tr("Match now {match}", match=_floored(here)), tr(
        "{match} at the goal", match=_floored(goal)
    )


def own_style(model: Model) -> UserStyle | None:
    """Give the chosen style where it is one of the user's own."""
    return next((one for one in model.user_styles if one.name == model.chosen), None)


def style_words(model: Model, guidance: Guide) -> StyleWords:
    """Write what stands beside target and picture."""
    result, own, plan = model.goal_result, own_style(model), model.lamp_plan
    if result is None:
        return StyleWords()
    built_in = model.head.pack.styles if model.head is not None else ()
    style = next((one for one in built_in if one.name == model.pack_style), None)
    title = own.title if own is not None else result.title
    shape = style or (own.style if own is not None else None)
    side = "" if shape is None else SIDE_LINES.get(shape.side, side_words(shape))
    match, at_goal = match_words(result, model.goal_deg, guidance.now)
    tag = tr("Now") if guidance.now is not None else tr("At the goal")
    side = side or tr("painted")
    if plan is not None:
        side, tag = tr("with {lamp}", lamp=plan.lamp), tr("With the lamp")
    return StyleWords(title, side, match, at_goal, now_tag=tag)


def face_words(check: Check | None, asked_deg: float = 0.0) -> str:
    """Write how far the sitter's own face shows the style, or that it looks elsewhere.

    `asked_deg`: the yaw that is asked for; the guidance itself tells of one that is not 0.
    """
    if check is None:
        return ""
    yaw = check.light.pose.yaw_deg
    if not asked_deg and abs(yaw) >= _AWAY_DEG:
        return tr("Head turned {size}° away", size=round(abs(yaw)))
    if check.grade is None or check.match is None:
        return ""
    grade, match = grade_words(check.grade, attainable=True), _floored(check.match)
    return tr("Live face {match}: {grade}", grade=grade, match=match)


def _floored(match: float) -> int:
    return max(math.floor(match), 0)
