"""Check a heading against those of earlier pictures.

A heading that the photographer can trust repeats itself when the camera turns: between two
pictures, it changes by the turn that the pictures themselves show
(`app.core.localization.live.background_texture`). A wrong one, from a detail that occurs twice or
from a room seen from an unexpected side, does not. Headings that are too doubtful to show are
therefore kept as well, and one of them counts if a picture at least 10 degrees away agrees.

If a picture has no heading, for example of a bare wall, the last certain ones are carried on by the
turn that the pictures show.

The turn of a camera that is carried around the sitter is larger than the turn that its pictures
show, by the enlargement of the background behind the sitter: seen from a distance d in front of the
sitter, a background at a distance D behind them moves by D / (D + d) of the turn. If the sitter is
visible, their movement in the picture shows which part of the turn was on the spot.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from app.core.base.angles import difference, wrap
from app.core.localization.confidence import LEAST_CONFIDENCE
from app.core.localization.live.background_texture import BackgroundTexture, turn_between

_APART_DEG: Final = 10.0  # closer pictures show the same details, and make the same errors
_ALIKE_DEG: Final = 3.0
_UNLIKE_DEG: Final = 4.0
_ENLARGEMENT: Final = (0.5, 2.0)  # of the background, seen from the probe
_CLUES: Final = 8
_SAME_DEG: Final = 4.0
_REPLACED_DEG: Final = 1.5  # less than _SAME_DEG, so that a slow turn leaves clues behind
_REFRESH_S: Final = 3.0
_KEEP_S: Final = 20.0
_CARRIED_DEG: Final = 20.0
_CARRIED_S: Final = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class Clue:
    """The heading of a picture, certain or doubtful.

    Attributes:
        heading_deg: Panorama azimuth of the camera's axis, in degrees.
        confidence: Probability that the heading is right, 0 to 1.
        zoom: Enlargement of the background, as in `app.core.localization.heading.Heading`.
        sitter_deg: Angle of the sitter from the axis, in degrees, or None if not visible.
        time_s: Time of the picture, in seconds.
    """

    heading_deg: float
    confidence: float
    zoom: float
    sitter_deg: float | None
    background: BackgroundTexture = field(repr=False)
    time_s: float


@dataclass(frozen=True, slots=True)
class Agreement:
    """How a heading compares with those of earlier pictures.

    Attributes:
        confirmed: Whether a picture at least 10 degrees away agrees.
        doubted: Whether more of the certain headings disagree than agree.
    """

    confirmed: bool = False
    doubted: bool = False


def remember(clues: tuple[Clue, ...], clue: Clue) -> tuple[Clue, ...]:
    """Add the newest heading, unless a recent one of the same direction is at least as certain."""
    recent = [one for one in clues if clue.time_s - one.time_s <= _KEEP_S]
    for one in recent:
        is_new = clue.time_s - one.time_s <= _REFRESH_S
        if _apart(one, clue) < _SAME_DEG and is_new and one.confidence >= clue.confidence:
            return tuple(recent)
    others = [one for one in recent if _apart(one, clue) >= _REPLACED_DEG]
    return (*others, clue)[-_CLUES:]


def agreement(clue: Clue, others: tuple[Clue, ...]) -> Agreement:
    """Compare the heading of the newest picture with those of earlier pictures."""
    confirmed, votes = False, 0
    for other in others:
        turn = turn_between(other.background, clue.background)
        if turn is None:
            continue
        change = difference(clue.heading_deg, other.heading_deg)
        zoom = 0.5 * (other.zoom + clue.zoom)
        likely = _expected(turn, other.sitter_deg, clue.sitter_deg, zoom)
        certain = other.confidence >= LEAST_CONFIDENCE
        if min(abs(change - one) for one in likely) <= _ALIKE_DEG:
            confirmed = confirmed or abs(turn) >= _APART_DEG
            votes += certain
        # The sitter may have moved, or may be somebody else.
        elif min(abs(change - one) for one in (*likely, turn)) > _UNLIKE_DEG:
            votes -= certain
    return Agreement(confirmed and votes >= 0, votes < 0)


def carried_on(
    background: BackgroundTexture, sitter_deg: float | None, now_s: float, clues: tuple[Clue, ...]
) -> float | None:
    """Return the heading of a picture from those of earlier pictures that it overlaps.

    Args:
        background: Background of the picture.
        sitter_deg: As in `Clue`.
        now_s: Time of the picture, in seconds.

    Returns:
        The heading, in degrees, or None if no certain heading is near enough or two of them
        disagree.
    """
    headings: list[float] = []
    for clue in clues:
        if clue.confidence < LEAST_CONFIDENCE or now_s - clue.time_s > _CARRIED_S:
            continue
        turn = turn_between(clue.background, background)
        if turn is None or abs(turn) > _CARRIED_DEG:
            continue
        headings += [
            clue.heading_deg + change
            for change in _expected(turn, clue.sitter_deg, sitter_deg, clue.zoom)
        ]
    if not headings:
        return None
    if max(abs(difference(one, headings[-1])) for one in headings) > _ALIKE_DEG:
        return None
    return wrap(headings[-1])


def _apart(first: Clue, second: Clue) -> float:
    return abs(difference(first.heading_deg, second.heading_deg))


def _expected(
    turn_deg: float, before_deg: float | None, now_deg: float | None, zoom: float
) -> tuple[float, ...]:
    """Return how far the heading may have changed, in degrees, if the pictures show this turn."""
    enlargement = min(max(zoom, _ENLARGEMENT[0]), _ENLARGEMENT[1])
    if before_deg is None or now_deg is None:
        return turn_deg, turn_deg * enlargement
    on_the_spot = before_deg - now_deg
    return (on_the_spot + (turn_deg - on_the_spot) * enlargement,)
