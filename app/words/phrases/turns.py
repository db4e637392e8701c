"""Numbers and words for turns.

Every turn on screen is shown in whole degrees, as computed by `whole`. Values derived from a turn,
such as the distance to go or the distance to the edge of the light, are computed from these whole
degrees. The numbers on screen therefore always add up.

When walking, the photographer stands in front of the sitter and looks at them. Seen from above,
with the sitter in the middle, a photographer in the north looks south and has east on their left.
Clockwise runs from north to east, so clockwise is *to the photographer's left*. Someone turning on
the spot turns clockwise by turning *to their right*. A mirrored preview changes neither of these.
"""

from __future__ import annotations

from typing import Final, Literal, TypeAlias

from app.core.base.angles import Direction, direction_of, ends_of, whole, wrap
from app.core.base.catalogue import tr
from app.core.guidance.who_moves import Mode

_FAR_DEG: Final = 90  # degrees; beyond this, a turn is neither short nor too far
_SURENESS: Final = ((0.9, tr("certain")), (0.7, tr("likely")), (0.0, tr("doubtful")))


_WALKING: Final = {
    Mode.WALK: (
        tr("Walk to your left"),
        tr("Walk to your right"),
        tr("The sitter turns with you."),
    ),
    Mode.SELFIE: (
        tr("Turn to your right"),
        tr("Turn to your left"),
        tr("The camera turns with you."),
    ),
}


_DIRECTIONS: Final[dict[Direction, str]] = {
    "clockwise": tr("clockwise"),
    "counter-clockwise": tr("counter-clockwise"),
    "none": tr("no turn needed"),
}
_DIRECTION_LINES: Final[dict[Direction, str]] = {
    **_DIRECTIONS,
    "counter-clockwise": tr("counter-\nclockwise"),
}
_TURNS: Final[dict[Direction, str]] = {
    "clockwise": tr("{size} clockwise"),
    "counter-clockwise": tr("{size} counter-clockwise"),
    "none": tr("no turn needed"),
}
_Beside: TypeAlias = Literal["short", "past", "clockwise", "counter-clockwise"]
_BESIDE_LIGHT: Final[dict[_Beside, str]] = {
    "short": tr("{off} short of the light"),
    "past": tr("{off} too far"),
    "clockwise": tr("{off} clockwise of the light"),
    "counter-clockwise": tr("{off} counter-clockwise of the light"),
}
_BESIDE_BEST: Final[dict[_Beside, str]] = {
    "short": tr("In the light, {off} short of the best turn"),
    "past": tr("In the light, {off} past the best turn"),
    "clockwise": tr("In the light, {off} clockwise of the best turn"),
    "counter-clockwise": tr("In the light, {off} counter-clockwise of the best turn"),
}


def signed(turn_deg: float) -> str:
    """Format a turn in whole degrees, using a typographic minus sign.

    Examples:
        >>> signed(-12.4), signed(96.0), signed(-179.8)
        ('−12°', '96°', '180°')
    """
    number = whole(turn_deg)
    return f"−{-number}°" if number < 0 else f"{number}°"


def size_words(turn_deg: float) -> str:
    """Format the size of a turn, without its direction.

    Examples:
        >>> size_words(-12.4)
        '12°'
    """
    return f"{abs(whole(turn_deg))}°"


def direction_words(turn_deg: float) -> str:
    """Name the direction of a turn, or "no turn needed" if it is shown as 0°.

    Args:
        turn_deg: Turn in degrees, positive clockwise.
    """
    return _DIRECTIONS[direction_of(turn_deg)]


def direction_lines(turn_deg: float) -> str:
    """Name the direction of a turn, breaking the longer word across two lines."""
    return _DIRECTION_LINES[direction_of(turn_deg)]


def turn_words(turn_deg: float) -> str:
    """Format the size and direction of a turn.

    Args:
        turn_deg: Turn in degrees, positive clockwise.

    Examples:
        >>> turn_words(96.2), turn_words(-45.0), turn_words(0.3)
        ('96° clockwise', '45° counter-clockwise', 'no turn needed')
    """
    return _TURNS[direction_of(turn_deg)].format(size=size_words(turn_deg))


def clock_words(turn_deg: float) -> str:
    """Format a turn as an hour on a clock face lying on the floor.

    The sitter faces 12 o’clock at turn 0, and the hours run clockwise as seen from above.

    Args:
        turn_deg: Turn in degrees, positive clockwise. A turn halfway between two hours is rounded
            to the even hour.

    Examples:
        >>> clock_words(96.0), clock_words(-30.0), clock_words(7.0), clock_words(180.0)
        ('towards 3 o’clock', 'towards 11 o’clock', 'towards 12 o’clock', 'towards 6 o’clock')
    """
    hour = round(whole(turn_deg) / 30.0) % 12
    return tr("towards {hour} o’clock", hour=hour or 12)


def goal_words(turn_deg: float, start_deg: float = 0.0) -> str:
    """Return a complete instruction, such as "Turn 96° clockwise, towards 3 o’clock".

    Args:
        turn_deg: Turn in degrees, positive clockwise.
        start_deg: Turn from which the instruction starts, in degrees.

    Examples:
        >>> goal_words(-45.0), goal_words(0.0)
        ('Turn 45° counter-clockwise, towards 10 o’clock', 'No turn needed')
    """
    if direction_of(turn_deg) == "none":
        return tr("No turn needed")
    clock = clock_words(start_deg + turn_deg)
    return tr("Turn {turn}, {clock}", turn=turn_words(turn_deg), clock=clock)


def arc_words(arc_deg: tuple[float, float]) -> str:
    """Format an arc, which may run past 180° into negative turns.

    Args:
        arc_deg: Arc (from, to) in degrees, clockwise. (-180, 180) is the whole circle.

    Examples:
        >>> arc_words((79.2, 110.6)), arc_words((170.0, -170.0)), arc_words((-180.0, 180.0))
        ('79° to 111°', '170° to −170°', 'any turn')
    """
    ends = ends_of(arc_deg)
    if ends is None:
        return tr("any turn")
    return tr("{first} to {last}", first=signed(ends[0]), last=signed(ends[1]))


def leeway_words(arc_deg: tuple[float, float]) -> str:
    """Format the width of an arc as the total leeway for a turn.

    Args:
        arc_deg: Arc (from, to) in degrees, clockwise.

    Examples:
        >>> leeway_words((79.2, 110.6)), leeway_words((-180.0, 180.0))
        ('32° of leeway', 'any turn')
    """
    ends = ends_of(arc_deg)
    if ends is None:
        return tr("any turn")
    return tr("{size}° of leeway", size=str((ends[1] - ends[0]) % 360))


def walking_words(direction: Direction, mode: Mode) -> tuple[str, str]:
    """Return the instruction for walking in a direction.

    Returns:
        The instruction, and a note on who or what else turns. Both are empty strings if the
        direction is ``none``.

    Examples:
        >>> walking_words("clockwise", Mode.WALK)[0], walking_words("clockwise", Mode.SELFIE)[0]
        ('Walk to your left', 'Turn to your right')
    """
    if direction == "none":
        return "", ""
    clockwise, back, company = _WALKING[mode]
    return (clockwise if direction == "clockwise" else back), company


def taken_words(turn: int, goal: int, outside: int, *, rough: bool = False) -> str:
    """Describe how far from the light a photo was taken.

    Args:
        turn, goal: Turns in whole degrees.
        outside: Distance to the light in whole degrees, or 0 if the photo was taken in the light.
        rough: Whether the turn is uncertain by more than a degree.

    Examples:
        >>> taken_words(93, 96, 0), taken_words(96, 96, 0)
        ('In the light, 3° short of the best turn', 'In the best light')
        >>> taken_words(73, 96, 6), taken_words(123, 96, 12, rough=True)
        ('6° short of the light', 'About 12° too far')
    """
    to_go = int(wrap(goal - turn))
    if to_go == 0:
        return tr("In the best light")
    beside, off = _beside(to_go, goal), outside or abs(to_go)
    words = (_BESIDE_LIGHT if outside else _BESIDE_BEST)[beside].format(off=f"{off}°")
    if not rough:
        return words
    return tr("About {where}", where=words) if outside else tr("{where}, roughly", where=words)


def likeness_words(match: int, best: int) -> str:
    """Compare how well a photo matches the target with the best match possible.

    Examples:
        >>> likeness_words(81, 82), likeness_words(84, 82)
        ('match 81 of a possible 82', 'match 84, best possible 82')
    """
    if match > best:
        # Another turn matches better than the best one, but its light is too flat.
        return tr("match {match}, best possible {best}", match=match, best=best)
    return tr("match {match} of a possible {best}", match=match, best=best)


def sureness_words(confidence: float, *, confirmed: bool = True) -> str:
    """Describe the confidence in a heading, which is given from 0 to 1.

    Args:
        confirmed: Whether several pictures agree. Until they do, no heading is certain.

    Examples:
        >>> sureness_words(0.999), sureness_words(0.84), sureness_words(0.4)
        ('certain', 'likely', 'doubtful')
        >>> sureness_words(0.999, confirmed=False)
        'likely'
    """
    levels = _SURENESS if confirmed else _SURENESS[1:]
    return next(words for least, words in levels if confidence >= least)


def _beside(to_go: int, goal: int) -> _Beside:
    """Return whether a turn is short of or past the goal, or its direction if the goal is far."""
    if goal == 0 or abs(to_go) > _FAR_DEG:
        return "counter-clockwise" if to_go > 0 else "clockwise"
    return "short" if (to_go > 0) == (goal > 0) else "past"
