"""What can be said of a place's lamps in words, and from its light alone.

Directions are those of the panorama, as the sitter sees them who faces the photographer's place
(azimuth 0): in front is the photographer's side, right is the sitter's right.

A place that is opened again, or a panorama from elsewhere, comes without the clip mask of its
merge. Where its bracket is known, the level at which the darkest frame clipped is known too, and
that is all it takes: what is at that level may have been brighter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from app.core.base.arrays import Float32
from app.core.base.colour import FloatImage
from app.core.base.errors import ProbeError
from app.core.base.sphere import bounded
from app.core.hdr.frame import Merged
from app.core.hdr.lights import Light, find_lights, light_grid
from app.core.hdr.merge import reference_exposure
from app.core.hdr.sun import find_sun
from app.core.text import tr, tr_plural
from app.core.text.directions import direction_words

_STEP_EV: Final = 2.0
_MOST_FRAMES: Final = 4
_WORTH_SAYING: Final = 3
_SHAPES: Final = 0.15  # of a place's light: less does not shape a face
# What such things reach at most, cd/m2: cloud lit by the sun through a window; a bare bulb.
_WINDOW_CD_M2: Final = 50_000.0
_LAMP_CD_M2: Final = 2_000_000.0
_USUAL_FRAMES: Final = {"window": 2, "lamp": 3}
_CLIPPED: Final = {
    "sun": tr("The sun {where} ({id}) is clipped."),
    "lamp": tr("The lamp {where} ({id}) is clipped."),
    "window": tr("The window {where} ({id}) is clipped."),
    "bright area": tr("The bright area {where} ({id}) is clipped."),
}
_SHOOT: Final = (
    tr("Shoot one darker frame."),
    tr("Shoot two darker frames."),
    tr("Shoot three darker frames."),
    tr("Shoot four darker frames."),
)


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
        lines.append(
            tr_plural(
                "{count} smaller lamp is clipped too.",
                "{count} smaller lamps are clipped too.",
                rest,
            )
        )
    return tuple(lines)


def _may_be_sun(light: Light) -> str:
    where = direction_words(light.azimuth_deg, light.elevation_deg)
    return tr(
        "The lamp {where} ({id}) is clipped and may be the sun. Use frames that "
        "state their ISO and f-number: then its light is put back.",
        where=where,
        id=light.id,
    )


def _about(light: Light, merged: Merged, sun: Light | None, room_stops: float | None) -> str:
    kind = kind_words(light, sun)
    where = direction_words(light.azimuth_deg, light.elevation_deg)
    start = _CLIPPED[kind].format(where=where, id=light.id)
    if kind == "sun":
        return tr(
            "{start} No camera holds it: say how clear the sky is, and it is put back.", start=start
        )
    count = darker_frames(light, merged, kind)
    if room_stops is not None and room_stops < 0.5:
        return tr(
            "{start} The camera is at its darkest: give lamp {id} a gain, or measure "
            "it with a light meter.",
            start=start,
            id=light.id,
        )
    if room_stops is not None and room_stops < _STEP_EV * count - 1.0:
        count = max(round(room_stops / _STEP_EV), 1)
        start = tr(
            "{start} The camera can go {room_stops:.0f} EV darker.",
            start=start,
            room_stops=room_stops,
        )
    return f"{start} {_SHOOT[count - 1]}"


_NEAR: Final = 0.985  # of the clip level: the last code before the highest, and rounding in files
_SHOWN: Final = 1024  # columns of the mask; what covers a part of a texel stays seen
_LEAST_SHARE: Final = 0.0005


@dataclass(frozen=True, slots=True)
class Lamp:
    """A lamp, a window, the sun, as it is listed.

    `kind` is of `kind_words`. Azimuth and elevation are of the centre of its light, the
    diameter of the disc with the same solid angle, degrees. `share` of the place's light, 0 to
    1, is a lower bound where it is clipped.
    """

    letter: str
    kind: str
    azimuth_deg: float
    elevation_deg: float
    diameter_deg: float
    share: float
    clipped: bool


@dataclass(frozen=True, slots=True, eq=False)
class Findings:
    """What was found in a place's light.

    `clipped`, (512, 1024) float32, is the share of each texel that is clipped; None if nothing
    is known to be clipped.
    """

    lamps: tuple[Lamp, ...] = ()
    clipped: Float32 | None = field(default=None, repr=False)

    @property
    def clipped_lamps(self) -> tuple[Lamp, ...]:
        """Those that are clipped, the largest share first."""
        return tuple(lamp for lamp in self.lamps if lamp.clipped)

    @property
    def light(self) -> str:
        """What most shapes a face here: "sun", "lamp", "lamps", "window" or "soft"."""
        shares = dict.fromkeys(("sun", "lamp", "window"), 0.0)
        for lamp in self.lamps:
            if lamp.kind in shares:
                shares[lamp.kind] += lamp.share
        kind = max(shares, key=lambda name: shares[name])
        if shares[kind] < _SHAPES:
            return "soft"
        main = max(lamp.share for lamp in self.lamps if lamp.kind == kind)
        return "lamps" if kind == "lamp" and main < 0.5 * shares[kind] else kind


def clip_level(stops: Sequence[float]) -> float | None:
    """Radiance at which the darkest frame of a bracket clips, in the unit of its merge.

    `stops` are true exposures above any common one; None without any.

    >>> clip_level([2.0, 0.0, -2.0])
    4.0
    """
    if not stops:
        return None
    return float(2.0 ** (reference_exposure(stops) - min(stops)))


def clipped_share(radiance: FloatImage, level: float | None) -> Float32:
    """Mark where a panorama, (H, W, 3), is only known from below: (H, W), 1 or 0.

    1 where the largest channel reaches the `level` of `clip_level`; None where nothing is
    clipped.
    """
    if level is None:
        return np.zeros(radiance.shape[:2], np.float32)
    return np.asarray(radiance.max(axis=2) >= _NEAR * level, np.float32)


def find(radiance: FloatImage, level: float | None = None, cd_m2: float | None = None) -> Findings:
    """Look for the lamps of a place, (H, 2 H, 3) linear Rec. 709, and for what is clipped.

    `level` is the radiance at which it clips (`clip_level`), `cd_m2` the luminance of radiance
    1; None where not known.
    """
    lost = clipped_share(radiance, level)
    merged = Merged(
        radiance=radiance,
        clipped=lost,
        dark=np.zeros_like(lost),
        reference_ev=0.0,
        clip_level=level or 2.0 * float(radiance.max()),
        cd_m2=cd_m2,
    )
    try:
        grid = light_grid(merged)
        lights = find_lights(merged, grid)
    except ProbeError:
        return Findings()
    sun = find_sun(merged, lights, grid)
    lamps = tuple(
        Lamp(
            light.id,
            kind_words(light, sun),
            light.azimuth_deg,
            light.elevation_deg,
            light.diameter_deg,
            light.share,
            light.clipped,
        )
        for light in lights
        if light.share >= _LEAST_SHARE
    )
    return Findings(lamps, bounded(lost, _SHOWN) if lost.any() else None)
