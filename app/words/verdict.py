"""What a place offers for a style: the verdict, similar styles, doubts and the spoken card."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

from app.core.base.angles import whole
from app.core.cautions.caution import Hazard
from app.core.solver.style_result import Gain, StyleResult
from app.core.solver.turn_choice import LIMITS
from app.core.styles.lamps import Studio
from app.core.styles.style import Style
from app.core.text import tr, tr_plural
from app.words.lamps import studio_words
from app.words.phrases.directions import BARE_SIDES, LENS_CHOICES, aside_words, light_words
from app.words.phrases.place_verdict import title_within_sentence
from app.words.phrases.quantities import contrast_words, lower_first
from app.words.phrases.turns import turn_words
from app.words.why_out_of_reach import (
    grade_words,
    out_of_reach_spoken,
    reason_card,
    reason_line,
    soft_card,
    soft_sentence,
    too_soft_card,
)

_UNLIKE: Final = 10  # match, out of 100, below which a picture does not count as similar
_SPOKEN_SIDES: Final = {
    "left": tr("light from the sitter’s left, camera right"),
    "right": tr("light from the sitter’s right, camera left"),
}
_GRADES: Final = {"yes": tr("Yes"), "soft": tr("Soft"), "no": tr("–")}


def whole_of(value: float) -> int:
    """Round a match or a contrast down so that a value below a limit never reads as the limit."""
    return max(math.floor(value), 0)


def quality_words(value: float) -> str:
    """Format C, rounded down so that a value below the limit never reads as the limit."""
    return f"{math.floor(value)}".replace("-", "−")


def numbers_words(match: float, quality: float | None) -> str:
    """Format the match as it appears on cards and plots.

    The match is preceded by C if the paper's rule applies.
    """
    if quality is None:
        return tr("match {match}", match=str(whole_of(match)))
    return tr(
        "C {quality}, match {match}",
        match=str(whole_of(match)),
        quality=quality_words(quality),
    )


def verdict_sentence(result: StyleResult) -> str:
    """Describe the best match that a place allows for a style that is out of reach.

    Returns:
        Text such as "The best match here is 29 at 62° counter-clockwise. The limit is 45."
    """
    turn = result.turn_refined_deg
    values = {"turn": turn_words(turn)}
    if result.grade is not None:
        values["best"] = str(whole_of(result.match))
        if whole(turn) == 0:
            return tr("The best match here is {best} without a turn.", **values)
        return tr("The best match here is {best} at {turn}.", **values)
    if result.match >= LIMITS.match:
        values |= {"best": contrast_words(result.strength), "limit": f"{LIMITS.strength:.0f}%"}
        if whole(turn) == 0:
            return tr(
                "The best contrast here is {best} without a turn. The limit is {limit}.", **values
            )
        return tr("The best contrast here is {best} at {turn}. The limit is {limit}.", **values)
    match = whole_of(result.match)
    values |= {"best": str(match), "limit": f"{LIMITS.match:.0f}"}
    if match < _UNLIKE:
        return tr(
            "No turn here comes close: the best match is {best}, but the limit is {limit}.",
            **values,
        )
    if whole(turn) == 0:
        return tr("The best match here is {best} without a turn. The limit is {limit}.", **values)
    return tr("The best match here is {best} at {turn}. The limit is {limit}.", **values)


def paper_verdict(quality: float) -> str:
    """Describe the best result that a place allows under the paper's rule."""
    return tr(
        "The largest C here is {best}. The limit is {limit}.",
        best=quality_words(quality),
        limit=f"{LIMITS.quality:.0f}",
    )


def paper_quality(quality: float) -> str:
    """Format the largest value of C, together with its limit."""
    return tr(
        "Largest C {quality}, limit {limit:.0f}",
        quality=quality_words(quality),
        limit=LIMITS.quality,
    )


def ours_words(result: StyleResult) -> str:
    """Format Turnlight's own grade, to be shown beside the paper's rule."""
    return tr("Ours: {grade}", grade=grade_words(result.grade, result.attainable))


def grade_on_card(grade: str | None, *, within: bool) -> str:
    """Return the grade as a card shows it: Yes, Soft or a dash."""
    return _GRADES[grade or "yes"] if within else _GRADES["no"]


def paper_card(quality: float, result: StyleResult, *, within: bool) -> str:
    """Format C for a card, with Turnlight's own grade if the paper's rule disagrees."""
    number = tr("C {quality}", quality=quality_words(quality))
    if within == result.attainable:
        return number
    grade = grade_words(result.grade, result.attainable)
    return tr("{number}; ours: {grade}", number=number, grade=grade)


def reason_on_card(result: StyleResult, titles: Mapping[str, str]) -> str:
    """Return at most five words on a result, for use after its grade.

    Args:
        titles: Titles of all styles by name.

    Returns:
        For a soft style what is softer than in the studio, for a style out of reach what is
        missing, and otherwise a style that the picture gives as well, or "".
    """
    if not result.attainable:
        soft = result.match >= LIMITS.match and result.strength < LIMITS.strength
        if result.grade is None and soft:
            return too_soft_card(result.strength, LIMITS.strength)
        return lower_first(reason_card(result.shortfall))
    like = result.looks_more_like
    if like is not None and like in titles:
        return reads_as(like, titles[like])
    if result.shortfall is not None:
        return soft_card(result.shortfall)
    same = next((name for name in result.same_picture if name in titles), None)
    if same is not None:
        return tr("also reads as {style}", style=title_within_sentence(same, titles[same]))
    return ""


def other_side_words(style: Style, result: StyleResult | None) -> str:
    """Describe what the other side of a style gives.

    Returns:
        Text such as "Show the sitter’s right: soft, 40° clockwise".
    """
    side = BARE_SIDES[style.side]
    if result is None:
        return tr("Show the {side}", side=side)
    grade = grade_words(result.grade, result.attainable)
    if not result.attainable:
        return tr("Show the {side}: {grade}", side=side, grade=grade)
    turn = turn_words(result.turn_refined_deg)
    return tr("Show the {side}: {grade}, {turn}", side=side, grade=grade, turn=turn)


def rules_words(disagreements: int, count: int) -> str:
    """State for how many styles the paper's rule and Turnlight's own rule disagree."""
    return tr(
        "The paper’s rule and ours disagree on {count} of {all} styles.",
        count=disagreements,
        all=count,
    )


def close_to(title: str) -> str:
    """Name the style that a picture is close to."""
    return tr("Close to {style}", style=title)


def near_words(
    result: StyleResult, title: str, more_like: str = "", same: Sequence[str] = ()
) -> list[str]:
    """Describe in what respects a style within reach falls short of its target.

    Args:
        title: Title of the style.
        more_like: Title of another style that the picture resembles more, or "" if there is none.
        same: Titles of other styles that have the same picture.
    """
    lines = []
    if more_like:
        lines.append(tr("Reads as {other}, not {style}", other=more_like, style=title))
    elif result.attainable and result.shortfall is not None:
        lines.append(soft_sentence(result.shortfall))
    if same:
        lines.append(same_picture(same))
    return lines


def reads_as(name: str, title: str) -> str:
    """Name the style that a picture resembles more, for use on another style's card."""
    return tr("reads as {style}", style=title_within_sentence(name, title))


def same_picture(titles: Sequence[str]) -> str:
    """Name the other styles that have the same picture."""
    return tr("Same picture as {styles}", styles=", ".join(titles))


def gain_words(gain: Gain, match: float) -> str:
    """Describe how much the match gains from turning the face away from the lens."""
    return tr(
        "{light}, {aside}: match {match} instead of {now}",
        light=LENS_CHOICES[gain.lighting],
        aside=aside_words(gain.yaw_deg),
        match=whole_of(gain.match),
        now=whole_of(match),
    )


_DOUBTS: Final = {
    Hazard.CLIPPED: tr("Doubtful: depends on clipped light."),
    Hazard.ROUGH: tr("Doubtful: depends on clipped light."),
    Hazard.UNSEEN: tr("Doubtful: depends on gaps."),
    Hazard.LENS_STEP: tr("Doubtful: the two lenses differ in brightness."),
    Hazard.NEAR_LIGHT: tr("Doubtful: depends on the camera’s exact position."),
    Hazard.TILT: tr("Doubtful: the camera was tilted."),
}


def doubt_words(hazards: Sequence[Hazard], *, rough: bool) -> str:
    """Explain why an answer is doubtful or rough, or return "" if it is neither of the two."""
    if not hazards:
        return tr("Rough: from one photo; its clipped light is an estimate.") if rough else ""
    missing = [each for each in hazards if each in (Hazard.CLIPPED, Hazard.ROUGH)]
    if missing and Hazard.UNSEEN in hazards:
        others = [each for each in hazards if each not in (*missing, Hazard.UNSEEN)]
        both = tr("Doubtful: affected by clipped light and gaps.")
        return " ".join((both, *(_DOUBTS[each] for each in others)))
    return " ".join(_DOUBTS[each] for each in hazards)


def own_lamps_words(studio: Studio) -> str:
    """State that a style keeps its own lamps, because the studio's lamps would not produce it."""
    return tr(
        "Shown with its own lamps: studio lamps of {lamps} would not show this style.",
        lamps=studio_words(studio),
    )


def spoken_words(
    style: Style,
    result: StyleResult | None,
    close: str = "",
    quality: float | None = None,
    *,
    within: bool = False,
) -> str:
    """Return the text of a whole card for a screen reader.

    Args:
        close: Title of the style that the picture is close to, or "" if there is none.
        quality: C if the paper's rule applies, or None if Turnlight's own rule does.
        within: Whether the style is within reach by the rule that applies.
    """
    light = _SPOKEN_SIDES.get(style.side) or (
        lower_first(light_words(style.side, style.place)) if style.place else tr("painted")
    )
    if result is None:
        return tr("{title}, {light}, not measured yet", title=style.title, light=light)
    turn = whole(result.turn_refined_deg)
    way = tr("no turn needed")
    if turn > 0:
        way = tr_plural("turn {count} degree clockwise", "turn {count} degrees clockwise", turn)
    elif turn < 0:
        way = tr_plural(
            "turn {count} degree counter-clockwise", "turn {count} degrees counter-clockwise", -turn
        )
    reach = _spoken_grade(result)
    if close:
        reach = tr("{reach}. {close}", reach=reach, close=close_to(close))
    if quality is None:
        return tr(
            "{title}, {light}, {way}, {reach}", title=style.title, light=light, way=way, reach=reach
        )
    rule = tr("within reach") if within else tr("out of reach")
    return tr(
        "{title}, {light}, {way}, {numbers}, {rule} by the paper’s rule, ours: {grade}",
        title=style.title,
        light=light,
        way=way,
        numbers=numbers_words(result.match, quality),
        rule=rule,
        grade=grade_words(result.grade, result.attainable),
    )


def _spoken_grade(result: StyleResult) -> str:
    if not result.attainable:
        return out_of_reach_spoken(result.shortfall)
    if result.grade != "soft":
        return tr("yes")
    if result.shortfall is None:
        return tr("soft")
    return tr("soft: {reason}", reason=lower_first(reason_line(result.shortfall)))
