"""The text of a `Guide`: written and spoken instructions for a person who is turning."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, NamedTuple

from app.core.base.angles import Direction, whole
from app.core.guidance.guide import NOSE_DEG, Guide, Phase
from app.core.guidance.who_moves import Mode
from app.core.text import tr
from app.words.phrases import turns
from app.words.phrases.directions import lens_words, nose_words, sitter_words


class PillWords(NamedTuple):
    """Texts of the status pill for a turn that is on target, nearly on target or not there yet.

    The texts contain no number, since the distance is already shown in large type.
    """

    here: str
    near: str
    before: str


IN_LIGHT: Final = PillWords(
    tr("You are in the light"),
    tr("Nearly in the light"),
    tr("Not in the light yet"),
)
AT_GOAL: Final = PillWords(
    tr("You are at the goal"),
    tr("Nearly at the goal"),
    tr("Not at the goal yet"),
)
FOR_LAMP: Final = PillWords(
    tr("Right for the lamp"),
    tr("Almost in position for the lamp"),
    tr("Not right for the lamp yet"),
)
_NEARLY_DEG: Final = 10
DIRECTIONS: Final[dict[Direction, str]] = {
    "clockwise": turns.direction_words(1.0),
    "counter-clockwise": turns.direction_words(-1.0),
    "none": "",
}
"""The direction shown beside a number. It is an empty string if no turn is needed."""
NOSE_TO: Final = {
    Mode.WALK: (tr("nose to their left"), tr("nose to their right")),
    Mode.SELFIE: (tr("nose to your left"), tr("nose to your right")),
}
TOO_FAR: Final = tr("Too far")
HOLD: Final = tr("Hold it")
ARC_IN_LIGHT: Final = tr("in the light")
ARC_FOR_LAMP: Final = tr("right for the lamp")
STILL: Final = tr("Hold still")
MEASURING: Final = tr("Measuring the nose")
TROUBLE: Final = {
    Phase.LOST: tr("Point the camera past the sitter at the background."),
    Phase.FEW_DETAILS: tr("Few details here. Turn until you see furniture, a window or a corner."),
    Phase.LEFT: tr("The camera has not moved. Carry it with you, pointed past the sitter."),
    Phase.AWAY: tr("Webcam disconnected. Plug it back in to continue."),
}
_TROUBLE_LINES: Final = {
    **TROUBLE,
    Phase.LEFT: tr("The camera has not moved."),
    Phase.FEW_DETAILS: tr("Few details here."),
}


@dataclass(frozen=True, slots=True)
class GuideWords:
    """The text of the guidance, ready to show.

    Attributes:
        number_words: Text beside the large number ("to go" or "back"), or an empty string if the
            number is the whole turn.
        headline: The direction in large type, "You are in the light", "Hold it", or the problem.
        walk, company: Instructions such as "Walk to your left" and "The sitter turns with you.",
            or empty strings if there is nothing to do.
        light: Text of the status pill, such as "Not in the light yet", "You are in the light" or
            "Too far".
        spoken: The instruction to be spoken.
        sitter: Instruction about the nose, or an empty string if the nose should point at the lens.
    """

    number_words: str = ""
    headline: str = ""
    walk: str = ""
    company: str = ""
    light: str = ""
    spoken: str = ""
    sitter: str = ""


def guide_words(guidance: Guide, mode: Mode = Mode.WALK, missing: str = "") -> GuideWords:
    """Return the instructions for a guidance state.

    Args:
        mode: Whether the photographer walks around the sitter or a single person turns on the spot.
        missing: Reason why there is no heading. An empty string means "No webcam".
    """
    if guidance.phase in TROUBLE:
        sentence = TROUBLE[guidance.phase]
        return GuideWords(headline=sentence, spoken=sentence)
    if guidance.now is None:
        return _by_eye(guidance, mode, missing or tr("No webcam"))
    return _turning(guidance, mode)


def trouble_line(phase: Phase) -> str:
    """Return one sentence that explains why the heading was lost, or "" if it is not lost."""
    return _TROUBLE_LINES.get(phase, "")


def arc_words(guidance: Guide) -> str:
    """Name the arc around the goal, or return "" if the goal has no arc."""
    if not guidance.has_arc:
        return ""
    return ARC_FOR_LAMP if guidance.lamp else ARC_IN_LIGHT


def _turning(guidance: Guide, mode: Mode) -> GuideWords:
    walk, company = ("", "") if guidance.hold else turns.walking_words(guidance.direction, mode)
    direction, number_words = DIRECTIONS[guidance.direction], tr("to go")
    # A goal without an arc, such as a style out of reach or a custom turn, has no light to be in.
    here, near, before = IN_LIGHT if guidance.has_arc else AT_GOAL
    if guidance.lamp:
        here, near, before = FOR_LAMP
    headline, light = here if guidance.inside else direction, here
    numbers = {"left": guidance.number, "direction": direction, "walk": walk, "here": here}
    if guidance.hold and guidance.lamp:
        headline = tr("Now {lamp}. Then take the picture", lamp=guidance.lamp)
        spoken = f"{headline}."
    elif guidance.hold:
        headline = HOLD
        spoken = tr("Take the picture. {here}. Hold it.", here=here)
    elif guidance.inside and guidance.lamp:
        spoken = tr("{here}. {left}° to the best turn, {direction}. {walk}.", **numbers)
    elif guidance.inside:
        spoken = tr("Take the picture. {here}. {left}° to the best turn, {direction}.", **numbers)
    elif guidance.phase is Phase.NOSE:
        off, light, walk, company = guidance.further, near, "", ""
        headline = NOSE_TO[mode][off < 0] if off else MEASURING
        spoken = f"{nose_words(off, mode) if off else STILL}."
    elif guidance.beyond:
        light, number_words = TOO_FAR, tr("back")
        spoken = tr("Too far. {left}° back, {direction}. {walk}.", **numbers)
    else:
        light = near if (guidance.until_light or 0) <= _NEARLY_DEG else before
        spoken = tr("{left}° to go, {direction}. {walk}. {light}.", **numbers, light=light)
    words = GuideWords(number_words, headline, walk, company, light, spoken)
    return _with_sitter(words, guidance, mode)


def _by_eye(guidance: Guide, mode: Mode, missing: str) -> GuideWords:
    """Return an instruction for the whole turn at once, since there is no heading."""
    to_go = whole(guidance.goal - guidance.start)
    walk, company = turns.walking_words(guidance.direction, mode)
    goal = turns.goal_words(to_go, guidance.start)
    sentence = tr("{missing}. {goal}", missing=missing, goal=goal)
    then = tr("Then {lamp}", lamp=guidance.lamp) if guidance.lamp else ""
    spoken = " ".join(f"{part}." for part in (sentence, walk, then) if part)
    words = GuideWords(headline=sentence, walk=walk, company=company, spoken=spoken)
    return _with_sitter(words, guidance, mode)


def _with_sitter(words: GuideWords, guidance: Guide, mode: Mode) -> GuideWords:
    """Add the instructions for the sitter's nose."""
    yaw, sitter, company = guidance.yaw, _for_sitter(guidance, mode), words.company
    if company and yaw and mode is Mode.WALK:
        company = f"{lens_words(yaw)}."
    company = "\n".join(part for part in (company, sitter) if part)
    spoken = [words.spoken]
    if yaw and guidance.nose is None and (guidance.inside or guidance.now is None):
        # Inside the arc, the sitter's instruction comes before the one to take the picture.
        spoken.insert(0 if guidance.inside else 1, sitter)
    return replace(words, company=company, sitter=sitter, spoken=" ".join(spoken))


def _for_sitter(guidance: Guide, mode: Mode) -> str:
    """Describe what the sitter should do with the nose, or how far off the nose is."""
    if not guidance.yaw:
        return ""
    off, wrong = guidance.nose, guidance.phase is Phase.NOSE
    if off is not None and not wrong:
        return f"{nose_words(off if abs(off) > NOSE_DEG else 0, mode)}."
    # Large type already shows the distance.
    words = sitter_words(guidance.further if wrong else guidance.yaw, mode, further=wrong)
    words = STILL if wrong and not guidance.further else words
    return f"“{words}.”" if mode is Mode.WALK else f"{words}."
