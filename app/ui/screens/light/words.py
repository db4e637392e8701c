"""The words of the Light screen."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from app.core.base.angles import wrap
from app.core.second_light.captured import CapturedLamp
from app.core.second_light.lamp_presets import power_words
from app.core.second_light.placements import metres
from app.core.text.turns import direction_of, signed, turn_words, whole
from app.ui.screens.light.state import RowState, Section
from app.ui.screens.styles.gallery import side_line, whole_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from app.core.second_light.search import Placed
    from app.core.solver.reach import Limits
    from app.core.solver.styles import Style
    from app.ui.screens.light.state import Bytes, Verdict
    from app.ui.screens.light.work import Held, Lamp

GAIN: Final = 10
"""By so much a style in reach has to gain for the lamp to be worth while."""

_FRONT_DEG: Final = 20.0
_SAME_DEG: Final = 1
_SAID_ABOVE: Final = "The lamp is too weak"  # once for all styles
_LEFT: Final = "the sitter’s left (camera right)"
_RIGHT: Final = "the sitter’s right (camera left)"


def lux_words(lux: float) -> str:
    """Write an illuminance with two figures.

    Examples
    --------
    >>> lux_words(213.4), lux_words(61234.0), lux_words(4.87)
    ('210 lx', '61,000 lx', '4.9 lx')
    """
    digits = 1 - math.floor(math.log10(max(lux, 1e-3)))
    value = round(lux, digits)
    return f"{value:,.0f} lx" if value == round(value) else f"{value:.{digits}f} lx"


def lamp_words(title: str) -> str:
    """Name a lamp within a sentence.

    Examples
    --------
    >>> lamp_words("Phone screen"), lamp_words("LED panel")
    ('phone screen', 'LED panel')
    """
    return title if title[1:2].isupper() else title[:1].lower() + title[1:]


def lamp_name(lamp: Lamp) -> str:
    """Name the lamp in hand within a sentence: "the LED panel", or its own name."""
    if isinstance(lamp, CapturedLamp):
        return f"“{lamp.title}”"
    return f"the {lamp_words(lamp.title)}"


def turn_title(turn_deg: float) -> str:
    """Write the first step: "Turn 56° counter-clockwise"."""
    return "No turn needed" if whole(turn_deg) == 0 else f"Turn {turn_words(turn_deg)}"


def go_words(turn_deg: float) -> str:
    """Write what the button does that leads on: there may be no turn to make."""
    return "Hold it now" if whole(turn_deg) == 0 else "Turn first"


def way_icon(turn_deg: float) -> str:
    """Give the icon that shows which way round a turn goes."""
    return {"clockwise": "clockwise", "counter-clockwise": "counterclockwise"}.get(
        direction_of(turn_deg), "bulb"
    )


def place_words(azimuth_deg: float | None) -> str:
    """Say from where the place lights the face after the turn.

    Parameters
    ----------
    azimuth_deg : float or None
        Relative to the face, positive toward the sitter's left; None for all around.
    """
    if azimuth_deg is None:
        return "The light of the place then comes from all around."
    away = abs(azimuth_deg)
    if away < _FRONT_DEG:
        return "The place then lights the face from in front."
    if away > 180.0 - _FRONT_DEG:
        return "The place then lights the sitter from behind."
    return f"The place then lights {_LEFT if azimuth_deg > 0 else _RIGHT}."


def move_words(now: Held, best: Held, kind: str = "") -> str:
    """Say how the lamp gets from where it is held to its best place and power.

    Parameters
    ----------
    now, best : Held
        Azimuth toward the sitter's left and altitude, deg, and power.

    Examples
    --------
    >>> from app.ui.screens.light.work import Held, Lamp
    >>> move_words(Held(107.0, 20.0), Held(107.2, 0.0))
    'Lower the lamp by 20°.'
    >>> move_words(Held(107.0, 0.0, 1.0), Held(80.0, 5.0, 0.5))
    'Move the lamp 27° toward the camera, raise it by 5° and set it to half power.'
    """
    across = whole(wrap(best.azimuth_deg - now.azimuth_deg))
    up = whole(best.altitude_deg) - whole(now.altitude_deg)
    moves = []
    if across:
        way = _way(now.azimuth_deg, best.azimuth_deg)
        moves.append(f"move the lamp {abs(across)}° {way}")
    if up:
        which = "it" if moves else "the lamp"
        moves.append(f"{'raise' if up > 0 else 'lower'} {which} by {abs(up)}°")
    if now.power != best.power:
        which = "it" if moves else "the lamp"
        moves.append(f"set {which} to {power_words(best.power, kind).removeprefix('at ')}")
    if not moves:
        return "The lamp is there."
    said = " and ".join((", ".join(moves[:-1]), moves[-1])) if moves[1:] else moves[0]
    return f"{said[:1].upper()}{said[1:]}."


def _way(now_deg: float, best_deg: float) -> str:
    """Name the way around the head: forward or back, or to the other side."""
    if now_deg * best_deg < 0 or abs(now_deg) < _SAME_DEG:
        return f"to {_LEFT if best_deg > 0 else _RIGHT}"
    return "toward the camera" if abs(best_deg) < abs(now_deg) else "toward the back"


def verdict_at(match: float, strength: float, limits: Limits) -> tuple[Verdict, str]:
    """Say whether a style is in reach at a match and a strength."""
    if match < limits.match:
        return "out", f"out of reach, under {limits.match:.0f}"
    if strength < limits.strength:
        return "out", f"too soft: strength {whole_of(strength)}, needs {limits.strength:.0f}"
    return "in", f"in reach, over {limits.match:.0f}"


def rescued(placed: Sequence[Placed]) -> tuple[Placed, ...]:
    """Give the styles that only the lamp brings within reach, the best first."""
    found = [one for one in placed if one.attainable and not one.before.attainable]
    return tuple(sorted(found, key=lambda one: -one.match))


def better(placed: Sequence[Placed]) -> tuple[Placed, ...]:
    """Give the styles in reach that the lamp makes clearly better, the best gain first."""
    found = [one for one in placed if one.before.attainable and _gain(one) >= GAIN]
    return tuple(sorted(found, key=lambda one: (-_gain(one), -one.match)))


def sections_of(
    placed: Sequence[Placed],
    styles: Mapping[str, Style],
    pictures: Mapping[str, Bytes],
    limits: Limits,
    chosen: str | None,
    version: int,
    power_of: Callable[[Placed], str] = lambda one: "",
) -> tuple[Section, ...]:
    """Make the list.

    Parameters
    ----------
    power_of : callable, optional
        Writes the power of a row.

    Returns
    -------
    tuple of Section
        Parts without any style are left out, but for the first.
    """
    out = [one for one in placed if not one.before.attainable]
    saved, gained = rescued(placed), better(placed)
    lost = sorted((one for one in out if not one.attainable), key=lambda one: -one.match)

    def rows(found: Sequence[Placed], how: str) -> tuple[RowState, ...]:
        return tuple(
            replace(
                _row(one, styles[one.name], how, limits, version, pictures, power_of(one)),
                chosen=one.name == chosen,
            )
            for one in found
        )

    parts = []
    if out:
        title, count = "Rescued by this lamp", f"{len(saved)} of {len(out)}"
        parts.append(Section(title, count, rows(saved, "rescued by this lamp")))
    if gained:
        count = f"{len(gained)} of {len(placed) - len(out)}"
        parts.append(Section("Better with it", count, rows(gained, "better with this lamp")))
    if lost:
        count = f"{len(lost)} of {len(out)}"
        parts.append(Section("Still out of reach", count, rows(lost, "still out of reach")))
    return tuple(parts)


def weak_words(distance_m: float, nearer: Placed | None, nearer_m: float) -> tuple[str, str]:
    """Say that a lamp rescues nothing, and what it does from nearer by.

    Parameters
    ----------
    nearer : Placed or None
        What comes out best from nearer by; None where it cannot come nearer.

    Returns
    -------
    str, str
        Sentences, and the words of a button; the latter empty where nothing helps.
    """
    weak = f"This lamp is too weak at {metres(distance_m)}."
    near = metres(nearer_m)
    if nearer is None:
        return f"{weak} Try a stronger one.", ""
    name, match = lamp_words(nearer.title), whole_of(nearer.match)
    if nearer.attainable:
        return f"{weak} At {near} it brings {name} to {match}.", f"Hold it at {near}"
    return f"{weak} Even at {near} {name} comes to {match} only.", ""


def without_tag(turn_deg: float) -> str:
    """Label the picture without the lamp by the turn that it is of."""
    return f"Without it, at {signed(turn_deg)}"


def _gain(one: Placed) -> int:
    return whole_of(one.match) - whole_of(one.before.match)


def _row(
    one: Placed,
    style: Style,
    how: str,
    limits: Limits,
    version: int,
    pictures: Mapping[str, Bytes],
    power: str,
) -> RowState:
    before, after = whole_of(one.before.match), whole_of(one.match)
    side = side_line(style)
    why = "" if one.attainable else (one.reason or "").partition(":")[0]
    if why.startswith(_SAID_ABOVE):
        # Said once for all; but a match that is enough must not stand here without a word.
        soft = f"Too soft: strength {whole_of(one.strength)}, needs {limits.strength:.0f}"
        why = soft if one.match >= limits.match else ""
    at = f" at {power}" if power else ""
    return RowState(
        key=one.name,
        title=style.title,
        line=why or side,
        before=before,
        after=after,
        limit=limits.match,
        power=power,
        spoken=f"{style.title}, {side}, match {before} without the lamp, {after} with it{at}, "
        f"{how}",
        version=version,
        picture=pictures.get(one.name),
    )
