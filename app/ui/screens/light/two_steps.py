"""The two steps: how far to turn, and where to hold the lamp."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from app.core.base.angles import direction_of, whole, wrap
from app.core.second_light.lamp_answers import LampPosition, kind_of
from app.core.second_light.lamp_presets import part_of
from app.core.solver.head_shape import HeadShape
from app.core.text import tr
from app.ui.screens.light.lamp import lamp_name
from app.ui.screens.light.placement.result import LampResult
from app.words.lamps import power_share, power_words
from app.words.phrases.directions import lens_words
from app.words.phrases.turns import turn_words


@dataclass(frozen=True, slots=True)
class HoldState:
    """The text of the two steps.

    Attributes:
        turn, turn_line: A title such as "Turn 56° counter-clockwise", and a sentence on the effect
            of that turn.
    """

    turn: str = ""
    turn_line: str = ""
    turn_works: bool = False
    go: str = tr("Turn first")
    go_icon: str = "turn"
    hold: str = ""
    hold_line: str = ""
    map_title: str = tr("Where this lamp works at this turn")


@dataclass(frozen=True, slots=True, eq=False)
class HeadsState:
    """The lamp's position around the head.

    Attributes:
        shape: Outlines of the head, in metres, or None if there are none.
        best: Best azimuth and altitude, in degrees, or None while they are unknown.
        place_light_deg: Azimuth from which the place lights the face at this turn, in degrees
            relative to the face, or None if the light comes from all around.
    """

    shape: HeadShape | None = field(default=None, repr=False)
    distance_m: float = 0.3
    azimuth_deg: float = 0.0
    altitude_deg: float = 0.0
    best: tuple[float, float] | None = None
    place_light_deg: float | None = None
    spoken: str = ""


_FRONT_DEG: Final = 20.0

_SAME_DEG: Final = 1

# Keys: whether the lamp moves around the head, whether it rises (1) or sinks (-1), and whether its
# power changes.
_MOVES: Final = {
    (False, 0, False): tr("The lamp is in place."),
    (False, 1, False): tr("Raise the lamp by {up}."),
    (False, -1, False): tr("Lower the lamp by {up}."),
    (False, 0, True): tr("Set the lamp to {power}."),
    (False, 1, True): tr("Raise the lamp by {up} and set it to {power}."),
    (False, -1, True): tr("Lower the lamp by {up} and set it to {power}."),
    (True, 0, False): tr("Move the lamp {across} {way}."),
    (True, 1, False): tr("Move the lamp {across} {way} and raise it by {up}."),
    (True, -1, False): tr("Move the lamp {across} {way} and lower it by {up}."),
    (True, 0, True): tr("Move the lamp {across} {way} and set it to {power}."),
    (True, 1, True): tr("Move the lamp {across} {way}, raise it by {up} and set it to {power}."),
    (True, -1, True): tr("Move the lamp {across} {way}, lower it by {up} and set it to {power}."),
}


def turn_title(turn_deg: float) -> str:
    """Return the title of the first step, such as "Turn 56° counter-clockwise"."""
    if whole(turn_deg) == 0:
        return tr("No turn needed")
    return tr("Turn {turn}", turn=turn_words(turn_deg))


def go_words(turn_deg: float) -> str:
    """Return the label of the main button, which is different for a turn of 0."""
    return tr("Hold the lamp now") if whole(turn_deg) == 0 else tr("Turn first")


def way_icon(turn_deg: float) -> str:
    """Return the icon for the direction of a turn."""
    return {"clockwise": "clockwise", "counter-clockwise": "counterclockwise"}.get(
        direction_of(turn_deg), "bulb"
    )


def place_words(azimuth_deg: float | None) -> str:
    """Describe the direction from which the place lights the face after the turn.

    Args:
        azimuth_deg: Azimuth of the light in degrees, relative to the face and positive towards the
            sitter's left, or None for light from all around.
    """
    if azimuth_deg is None:
        return tr("The light of the place then comes from all around.")
    away = abs(azimuth_deg)
    if away < _FRONT_DEG:
        return tr("The place then lights the face from in front.")
    if away > 180.0 - _FRONT_DEG:
        return tr("The place then lights the sitter from behind.")
    if azimuth_deg > 0:
        return tr("The place then lights the sitter’s left side (camera right).")
    return tr("The place then lights the sitter’s right side (camera left).")


def move_words(now: LampPosition, best: LampPosition, kind: str = "") -> str:
    """Describe how to move the lamp to its best position and power.

    Args:
        now: Current position and power of the lamp.
        best: Best position and power of the lamp.
        kind: Kind of the lamp, which determines the names of its powers.

    Examples:
        >>> from app.core.second_light.lamp_answers import LampPosition
        >>> move_words(LampPosition(107.0, 20.0), LampPosition(107.2, 0.0))
        'Lower the lamp by 20°.'
        >>> move_words(LampPosition(107.0, 0.0, 1.0), LampPosition(80.0, 5.0, 0.5))
        'Move the lamp 27° towards the camera, raise it by 5° and set it to half power.'
    """
    across = whole(wrap(best.azimuth_deg - now.azimuth_deg))
    up = whole(best.altitude_deg) - whole(now.altitude_deg)
    power = tr("{share} power", share=power_share(best.power, kind))
    if part_of(best.power, kind) == 2:
        power = tr("half power")
    return _MOVES[across != 0, (up > 0) - (up < 0), now.power != best.power].format(
        across=f"{abs(across)}°",
        way=_way(now.azimuth_deg, best.azimuth_deg),
        up=f"{abs(up)}°",
        power=power,
    )


def _way(now_deg: float, best_deg: float) -> str:
    """Describe the way around the head, which is forward, back or to the other side."""
    if now_deg * best_deg < 0 or abs(now_deg) < _SAME_DEG:
        if best_deg > 0:
            return tr("to the sitter’s left (camera right)")
        return tr("to the sitter’s right (camera left)")
    return tr("towards the camera") if abs(best_deg) < abs(now_deg) else tr("towards the back")


def hold_of(result: LampResult, heads: HeadsState) -> HoldState:
    """Return the text of the two steps."""
    turn, kind = result.one.turn_refined_deg, kind_of(result.answers)
    name = lamp_name(result.answers.hand.lamp)
    where, far, skin = result.spot
    hold = tr("Hold {lamp} {where}", lamp=name, where=where)
    if result.dims:
        power = power_words(result.position.power, kind)
        hold = tr("Hold {lamp} {where}, {power}", lamp=name, where=where, power=power)
    map_title = tr("Where this lamp works at this turn")
    if result.position.power != result.one.power:
        # The map is for a different power from the current one.
        power = power_words(result.one.power, kind)
        map_title = tr("Where this lamp works at this turn {at_power}", at_power=power)
    line = tr(
        "{distance} from the middle of the head, about {skin} from the skin.",
        distance=far,
        skin=skin,
    )
    if result.lens is not None and result.lens.yaw_deg:
        line = f"{line} {lens_words(result.lens.yaw_deg)}."
    return HoldState(
        turn=turn_title(turn),
        turn_line=place_words(heads.place_light_deg),
        turn_works=True,
        go=go_words(turn),
        go_icon=way_icon(turn),
        hold=hold,
        hold_line=line,
        map_title=map_title,
    )
