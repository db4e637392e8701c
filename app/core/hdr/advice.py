"""What to do about clipped lamps, in a photographer's words.

Directions are those of the panorama, as the sitter sees them who faces the photographer's place
(azimuth 0): in front is the photographer's side, right is the sitter's right.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from app.core.base.angles import wrap

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.hdr.frame import Merged
    from app.core.hdr.lights import Light

_STEP_EV: Final = 2.0
_MOST_FRAMES: Final = 4
_WORTH_SAYING: Final = 3
# What such things reach at most, cd/m2: cloud lit by the sun through a window; a bare bulb.
_WINDOW_CD_M2: Final = 50_000.0
_LAMP_CD_M2: Final = 2_000_000.0
_USUAL_FRAMES: Final = {"window": 2, "lamp": 3}


def direction_words(azimuth_deg: float, elevation_deg: float) -> str:
    """Say where a light is.

    >>> direction_words(3.0, 40.0), direction_words(90.0, 5.0), direction_words(-140.0, 0.0)
    ('in front, high', 'on the right', 'behind on the left')
    """
    if elevation_deg >= 70.0:
        return "overhead"
    if elevation_deg <= -70.0:
        return "underfoot"
    azimuth = wrap(azimuth_deg)
    side = "right" if azimuth > 0 else "left"
    away = abs(azimuth)
    if away <= 25.0:
        words = "in front"
    elif away < 65.0:
        words = f"in front on the {side}"
    elif away <= 115.0:
        words = f"on the {side}"
    elif away < 155.0:
        words = f"behind on the {side}"
    else:
        words = "behind"
    if elevation_deg >= 30.0:
        return f"{words}, high"
    return f"{words}, low" if elevation_deg <= -20.0 else words


def kind_words(light: Light, sun: Light | None = None) -> str:
    """Name what a light most likely is.

    "sun", "lamp" (small and compact), "window" (upright, of middling size, at the height of
    windows) or "bright area".
    """
    if sun is not None and light.id == sun.id:
        return "sun"
    if light.diameter_deg <= 3.0 or (light.diameter_deg <= 12.0 and light.roundness >= 0.5):
        return "lamp"
    low, high = -25.0, 45.0
    if 6.0 <= light.diameter_deg <= 60.0 and low <= light.elevation_deg <= high:
        return "window" if light.roundness >= 0.4 else "bright area"
    return "bright area"


def darker_frames(light: Light, merged: Merged, kind: str) -> int:
    """How many frames, each 2 EV darker than the last, would plausibly hold a clipped light.

    With absolute luminance that follows from what such lights reach, else from experience.
    """
    lamp = kind == "lamp" or light.diameter_deg <= 12.0
    if merged.cd_m2 is None:
        return _USUAL_FRAMES["lamp" if lamp else "window"]
    reach = (_LAMP_CD_M2 if lamp else _WINDOW_CD_M2) / (merged.clip_level * merged.cd_m2)
    return min(max(math.ceil(math.log2(max(reach, 1.0)) / _STEP_EV), 1), _MOST_FRAMES)


def advise(
    merged: Merged,
    lights: Sequence[Light],
    sun: Light | None,
    room_stops: float | None,
    maybe: str = "",
) -> tuple[str, ...]:
    """Write the advice of a clip audit, in whole sentences; empty when nothing is clipped.

    `room_stops` is how many stops darker the camera can go, None where unknown; `maybe` the id
    of the lamp that is the sun, if the exposure of the frames were known, "" for none.
    """
    clipped = [light for light in lights if light.clipped]
    if not clipped:
        return ()
    lines = [
        _may_be_sun(light) if light.id == maybe else _about(light, merged, sun, room_stops)
        for light in clipped[:_WORTH_SAYING]
    ]
    if sun is not None and sun not in clipped[:_WORTH_SAYING]:
        lines.append(_about(sun, merged, sun, room_stops))
    rest = len(clipped) - len(lines)
    if rest > 0:
        lines.append(f"{rest} smaller {'lamp is' if rest == 1 else 'lamps are'} clipped too.")
    return tuple(lines)


def _may_be_sun(light: Light) -> str:
    where = direction_words(light.azimuth_deg, light.elevation_deg)
    return (
        f"The lamp {where} ({light.id}) is clipped and may be the sun. "
        "Use frames that state their ISO and f-number: then its light is put back."
    )


def _about(light: Light, merged: Merged, sun: Light | None, room_stops: float | None) -> str:
    kind = kind_words(light, sun)
    where = direction_words(light.azimuth_deg, light.elevation_deg)
    start = f"The {kind} {where} ({light.id}) is clipped."
    if kind == "sun":
        return f"{start} No camera holds it: say how clear the sky is, and it is put back."
    count = darker_frames(light, merged, kind)
    if room_stops is not None and room_stops < 0.5:
        return (
            f"{start} The camera is at its darkest: "
            f"give lamp {light.id} a gain, or measure it with a light meter."
        )
    if room_stops is not None and room_stops < _STEP_EV * count - 1.0:
        count = max(round(room_stops / _STEP_EV), 1)
        start = f"{start} The camera can go {room_stops:.0f} EV darker."
    number = ("one", "two", "three", "four")[count - 1]
    return f"{start} Shoot {number} darker {'frame' if count == 1 else 'frames'}."
