"""From a guide to the words of the Turn screen; every number in them is one of the guide's."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from app.core.base.angles import difference, lies_on_arc
from app.core.guidance.guide import Goal, Guide, Phase, Source
from app.core.localization.sitter import background_mask
from app.core.solver.portraits import value_at
from app.core.text.turns import arc_words, goal_words, signed, turn_words, whole
from app.ui.screens.turn.state import Guidance, LiveWords, Scale, Sign, StyleWords

if TYPE_CHECKING:
    from app.core.base.errors import CoreError
    from app.core.localization.tracking import Track
    from app.core.painting.user_style import UserStyle
    from app.core.solver.solve import StyleResult
    from app.devices.errors import DeviceError
    from app.ui.presenters.model import Model

LEARNING: Final = "Learning the background of this place"
"""While no heading can be found yet."""

ASKED: Final = "Say which way the camera looks"
"""While the answer is awaited: without it left and right could be mistaken."""

Hindrance: TypeAlias = Literal["none", "learning", "looking", "asking", "blank"]
"""Why there is no heading: the panorama is being learnt, no picture was looked at yet, it is not
known which way the camera looks, or there is nothing in the panorama to find it by."""

_WAITING: Final[dict[Hindrance, str]] = {
    "learning": f"{LEARNING}.",
    "looking": "Looking for the background.",
}
_PILLS: Final[dict[Hindrance, tuple[str, str]]] = {
    "asking": (ASKED, "help"),
    "blank": ("No heading here", "warning"),
}
_ICONS: Final = {
    Phase.LOST: "target",
    Phase.LEFT: "walk",
    Phase.AWAY: "warning",
    Phase.STARTING: "webcam",
}
_SOURCES: Final[dict[str, tuple[str, str, str, str]]] = {
    "webcam": (
        "webcam",
        "Starting the webcam",
        "Webcam disconnected. Plug it back in to continue.",
        "No webcam",
    ),
    "network": (
        "network camera",
        "Connecting to the network camera",
        "Network camera lost. Turnlight connects again by itself.",
        "No network camera",
    ),
    "video": ("video", "Opening the video", "The video stopped. Choose it again.", "No video"),
    "stills": (
        "folder of pictures",
        "Opening the folder of pictures",
        "The pictures stopped. Choose the folder again.",
        "No pictures",
    ),
    "panorama": ("panorama", "Opening the panorama", "The panorama is gone.", "No panorama"),
}
"""What each kind of live source is called: in a sentence, while it starts, when it stops, and
where there is none."""
_SURENESS: Final = ((0.9, "certain"), (0.7, "likely"), (0.0, "doubtful"))
_COARSE: Final = (36, 48)
_MOST_SURE: Final = 99  # per cent; nobody is surer than that
_HIDING: Final = 0.55  # of the picture: a sitter who is larger leaves too little of the background


def arc_of(result: StyleResult | None, goal_deg: float) -> tuple[float, float] | None:
    """Choose the tolerance arc of a goal: that of the peak nearest to it.

    Returns
    -------
    tuple of float or None
        (from, to), clockwise, deg; None where the goal is on none.
    """
    if result is None or not result.attainable:
        return None
    peaks = [(result.turn_refined_deg, result.arc_deg)]
    peaks += [(peak.turn_refined_deg, peak.arc_deg) for peak in result.peaks]
    _, arc = min(peaks, key=lambda peak: abs(difference(peak[0], goal_deg)))
    ends = (float(whole(arc[0])), float(whole(arc[1])))
    if arc[1] - arc[0] >= 360.0 or lies_on_arc(float(whole(goal_deg)), ends):
        return arc
    return None


def goal_of(model: Model) -> Goal | None:
    """Give the goal with its arc and its lamp; None where there is nothing to turn to."""
    turn, plan = model.target_turn_deg, model.lamp_plan
    if turn is None:
        return None
    lamp = "" if plan is None else f"{plan.hold[:1].lower()}{plan.hold[1:]}"
    return Goal(turn, arc_of(model.goal_result, turn), lamp)


def guidance_of(
    shown: Guide,
    hindrance: Hindrance,
    error: CoreError | DeviceError | None = None,
    kind: str = "webcam",
) -> Guidance:
    """Write the right column, without what is announced.

    An `error` is what is wrong with the live picture of a source of that `kind`: then that is why
    nothing is found in it.
    """
    if shown.phase is Phase.NO_WEBCAM:
        return _whole_turn(shown, hindrance, kind)
    if shown.number == "":
        _, starting, away, _ = _SOURCES[kind]
        sentence = {Phase.AWAY: away, Phase.STARTING: f"{starting}."}.get(
            shown.phase, shown.headline
        )
        waiting = hindrance in _WAITING and shown.phase is Phase.STARTING
        if waiting:
            sentence = _WAITING[hindrance]
        if error is not None and shown.phase is Phase.LOST:
            return Guidance(
                shown.phase, sentence=str(error), sentence_icon="warning", spoken=str(error)
            )
        icon = "target" if waiting else _ICONS.get(shown.phase, "webcam")
        return Guidance(shown.phase, sentence=sentence, sentence_icon=icon, spoken=sentence)
    base = Guidance(
        phase=shown.phase,
        sign=_sign(shown),
        number=int(shown.number),
        number_words=shown.number_words,
        direction=shown.direction,
        clock=shown.clock,
        walk=shown.walk,
        company=shown.company,
        pill=shown.light,
        spoken=shown.spoken,
    )
    if shown.hold and shown.lamp:
        # The lamp is what counts now, in words that can be read from afar.
        return Guidance(
            phase=shown.phase,
            inside=True,
            sentence=f"{shown.headline}.",
            sentence_icon="bulb",
            spoken=shown.spoken,
        )
    if shown.hold:
        return replace(
            base,
            number_words="to the best",
            direction=shown.headline,
            clock="",
            pill_icon="check",
            inside=True,
        )
    if shown.inside:
        # "4° to the best": the number itself is drawn large.
        return replace(base, number_words="to the best", pill_icon="check", inside=True)
    return replace(base, pill_icon="warning") if shown.beyond else base


def advice_of(shown: Guide, track: Track | None) -> str:
    """Say what can be done while the heading is not known: the pictures are there to go by."""
    if shown.phase is Phase.LEFT:
        return "This camera isn't moving with you, so the turn can't be measured."
    if shown.phase is not Phase.LOST:
        return ""
    turn = turn_words(float(shown.goal))
    by_eye = f"Or go by eye until Live looks like Goal: {turn} from the start, {shown.clock}."
    sitter = None if track is None else track.sitter
    if sitter is not None and background_mask(sitter, _COARSE).mean() <= 1.0 - _HIDING:
        return f"The sitter hides it: step back, or aim a little beside them. {by_eye}"
    return by_eye


def confidence_words(confidence: float) -> str:
    """Write how sure a heading is, in a word and in per cent.

    Parameters
    ----------
    confidence : float
        0 to 1.

    Examples
    --------
    >>> confidence_words(0.999), confidence_words(0.84), confidence_words(0.4)
    ('certain: 99 %', 'likely: 84 %', 'doubtful: 40 %')
    """
    word = next(word for least, word in _SURENESS if confidence >= least)
    return f"{word}: {min(math.floor(100.0 * confidence + 1e-9), _MOST_SURE)} %"


def _whole_turn(shown: Guide, hindrance: Hindrance, kind: str) -> Guidance:
    """Without a heading the whole turn is shown, to be made by eye."""
    words, icon = _PILLS.get(hindrance, (_SOURCES[kind][3], "webcam"))
    spoken = shown.spoken.replace("No webcam", words, 1)
    return Guidance(
        phase=shown.phase,
        sign=_sign(shown),
        number=int(shown.number or 0),
        direction=shown.direction if shown.direction != "none" else "No turn needed",
        clock=shown.clock if shown.direction != "none" else "",
        walk=shown.walk,
        company=f"Then {shown.lamp}." if shown.lamp else shown.company,
        pill=words,
        pill_icon=icon,
        spoken=spoken,
    )


def _sign(shown: Guide) -> Sign:
    return "check" if shown.inside else shown.direction


def scale_of(shown: Guide, goal: Goal, fov_deg: float, camera_deg: float | None = None) -> Scale:
    """Say where goal, camera and arc are on the strip.

    Parameters
    ----------
    fov_deg : float
        How much of the panorama fills the camera's picture, deg.
    camera_deg : float, optional
        Where the camera's axis points, as a turn; None where the sitter is in the middle.
    """
    arc = goal.arc_deg
    if arc is not None and arc[1] - arc[0] < 360.0:
        arc = (float(whole(arc[0])), float(whole(arc[1])))
    now = shown.now
    goal_text = f"goal {signed(shown.goal)}"
    now_text = "" if now is None else f"now {signed(now)}"
    parts = [goal_text, now_text or "where the camera points is not known"]
    if goal.arc_deg is not None:
        parts.append(f"in the light: {arc_words(goal.arc_deg)}")
    if now == shown.goal:
        # Two labels at one place would push each other away from it.
        goal_text, now_text = f"now at the goal, {signed(shown.goal)}", ""
    return Scale(
        goal_deg=float(shown.goal),
        now_deg=None if now is None else float(now),
        camera_deg=None if now is None else camera_deg,
        fov_deg=fov_deg,
        arc_deg=arc,
        goal_words=goal_text,
        now_words=now_text,
        arc_words=shown.arc,
        description=", ".join(parts),
    )


def live_words(
    source: Source,
    error: CoreError | DeviceError | None,
    goal: int,
    fov_deg: float,
    selfie: bool,
    kind: str = "webcam",
) -> LiveWords:
    """Say what the two wells show; in a selfie both are mirrored.

    `source` is how the live source of that `kind` is, `error` what is wrong with it.
    """
    noun, starting, away, none = _SOURCES[kind]
    mirror = ", mirrored" if selfie else ""
    seen = f"what the camera should see{mirror}"
    if source is Source.LIVE:
        message = "" if error is None else str(error)
        return LiveWords(f"{noun}, {round(fov_deg)}° wide{mirror}", seen, message=message)
    if source is Source.AWAY:
        return LiveWords("last picture", seen, message=away, dim=True)
    if source is Source.STARTING:
        return LiveWords(f"{starting[:1].lower()}{starting[1:]}", seen)
    message = f"{none}. {goal_words(float(goal))}"
    if error is not None and getattr(error, "code", "") != "no-webcam":
        message = f"{error} {goal_words(float(goal))}."
    return LiveWords(f"{none[:1].lower()}{none[1:]}: the goal", seen, message=message)


def quality_words(
    source: Source,
    error: CoreError | DeviceError | None,
    learning: bool,
    lost: str,
    track: Track | None,
    sees_sitter: bool = True,
    kind: str = "webcam",
) -> tuple[str, str, bool]:
    """Say how well the heading is known.

    Returns
    -------
    tuple
        Words, icon, and whether something is to be done about it.
    """
    _, starting, away, none = _SOURCES[kind]
    if source is Source.AWAY:
        return away.partition(".")[0], "warning", True
    if source is Source.NONE:
        return none, "webcam", False
    if source is Source.STARTING:
        return starting, "webcam", False
    if error is not None:
        return str(error), "warning", True
    if learning:
        return f"{LEARNING}…", "refresh", False
    if lost:
        return lost.partition(". ")[0].rstrip(".") + ".", "target", True
    if track is None or track.heading_deg is None:
        return "Looking for the background", "target", False
    sure = confidence_words(track.confidence)
    if sees_sitter and track.sitter is None:
        return f"Heading {sure}, no sitter seen", "target", False
    return f"Heading {sure}", "target", False


def match_words(result: StyleResult, goal_deg: float | None, now: int | None) -> tuple[str, str]:
    """Write how much the picture is like the target, now and at the goal.

    Parameters
    ----------
    goal_deg : float or None
        A goal of one's own, deg; None for the best turn.
    now : int or None
        Whole degrees of turn; None while it is not known.

    Returns
    -------
    tuple of str
        "Match now 90" and "96 at the goal", rounded down as everywhere; without a heading
        "Match 96" and "at the goal".
    """
    best = goal_deg is None or abs(difference(goal_deg, result.turn_refined_deg)) < 1e-6
    # At the best turn it is the number on the style's card.
    goal = result.match if best else value_at(result.match_curve, goal_deg or 0.0)
    if now is None:
        return f"Match {_floored(goal)}", "at the goal"
    turn = result.turn_refined_deg if goal_deg is None else goal_deg
    here = goal if now == whole(turn) else value_at(result.match_curve, float(now))
    if best and float(result.match_curve.max()) <= result.match + 1e-6:
        # Between the turns of the grid the curve may rise a little above its best.
        here = min(here, goal)
    return f"Match now {_floored(here)}", f"{_floored(goal)} at the goal"


def own_style(model: Model) -> UserStyle | None:
    """Give the chosen style where it is one of the user's own."""
    return next((one for one in model.user_styles if one.name == model.chosen), None)


def style_words(model: Model, shown: Guide) -> StyleWords:
    """Write what stands beside target and picture."""
    result, own, plan = model.goal_result, own_style(model), model.lamp_plan
    if result is None:
        return StyleWords()
    built_in = model.head.pack.styles if model.head is not None else ()
    style = next((one for one in built_in if one.name == result.name), None)
    title = own.title if own is not None else result.title
    side = own.side_words if own is not None else style.side_words if style else ""
    match, at_goal = match_words(result, model.goal_deg, shown.now)
    tag = "Now" if shown.now is not None else "At the goal"
    side = side.replace(" (", "\n(") or "painted"
    if plan is not None:
        side, tag = f"with {plan.lamp}", "With the lamp"
    return StyleWords(title, side, match, at_goal, tag)


def _floored(match: float) -> int:
    return max(math.floor(match), 0)
