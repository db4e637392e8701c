"""Sentences about merged light: clipping, the answers that depend on it, and corrections."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from app.core.base.phrases import percent
from app.core.measure.finish.remarks import (
    BlindMatters,
    ClippingMatters,
    ClippingSafe,
    CostlyChange,
    Effect,
    LampClipped,
    LampGained,
    LampMetered,
    MaskingChanges,
    MaybeSun,
    MoreLampsClipped,
    NoClutter,
    Remedy,
    RestoredRange,
    RoughLight,
    RoughTurns,
    SunRestored,
)
from app.core.text import tr, tr_plural
from app.words.lights import CLIPPED
from app.words.phrases.directions import direction_words
from app.words.sentences import Sentences

_SHOOT: Final = (
    tr("Shoot one darker frame."),
    tr("Shoot two darker frames."),
    tr("Shoot three darker frames."),
    tr("Shoot four darker frames."),
)
_SOON: Final[dict[Effect, str]] = {
    "turn": tr("If clipped light were up to 3 stops brighter, the turn would change for {names}."),
    "into reach": tr(
        "If clipped light were up to 3 stops brighter, {names} would come within reach."
    ),
    "out of reach": tr(
        "If clipped light were up to 3 stops brighter, {names} would be out of reach."
    ),
}
_LATE: Final[dict[Effect, str]] = {
    "turn": tr(
        "If clipped light were 6 or more stops brighter, the turn would change for {names}."
    ),
    "into reach": tr(
        "If clipped light were 6 or more stops brighter, {names} would come within reach."
    ),
    "out of reach": tr(
        "If clipped light were 6 or more stops brighter, {names} would be out of reach."
    ),
}
_SKIES: Final = {"clear": tr("a clear sky"), "hazy": tr("haze"), "thin cloud": tr("thin cloud")}
_SAME_DEG: Final = 0.5
_MOVED_DEG: Final = 10.0


def clipped_brief(remark: LampClipped) -> str:
    """Describe a clipped lamp, without advice."""
    where = direction_words(remark.azimuth_deg, remark.elevation_deg)
    return CLIPPED[remark.source].format(where=where, id=remark.lamp)


def _clipped(remark: LampClipped) -> str:
    start = clipped_brief(remark)
    if remark.remedy is Remedy.SKY:
        return tr("{start} No camera can record it. Choose a sky to restore it.", start=start)
    if remark.remedy is Remedy.GAIN:
        return tr(
            "{start} The camera cannot expose darker. Give lamp {id} a gain, or measure "
            "it with a light meter.",
            start=start,
            id=remark.lamp,
        )
    if remark.room_stops is not None:
        start = tr(
            "{start} The camera can expose {room_stops:.0f} EV darker.",
            start=start,
            room_stops=remark.room_stops,
        )
    return f"{start} {_SHOOT[remark.frames - 1]}"


def _maybe_sun(remark: MaybeSun) -> str:
    return tr(
        "The lamp {where} ({id}) is clipped and may be the sun. Use frames that record "
        "ISO and f-number, so that its light can be restored.",
        where=direction_words(remark.azimuth_deg, remark.elevation_deg),
        id=remark.lamp,
    )


def _more_clipped(remark: MoreLampsClipped) -> str:
    return tr_plural(
        "{count} smaller lamp is clipped too.",
        "{count} smaller lamps are clipped too.",
        remark.count,
    )


def _matters(remark: ClippingMatters) -> str:
    names = ", ".join(remark.names)
    if remark.effect == "turn":
        names = _all(remark.names, remark.others)
    return (_SOON if remark.soon else _LATE)[remark.effect].format(names=names)


def _safe(remark: ClippingSafe) -> str:
    if remark.every:
        return tr("None of the turns or grades depend on clipped light.")
    return tr_plural(
        "The other style does not depend on it.",
        "The other {count} styles do not depend on it.",
        remark.count,
    )


def _restored_range(remark: RestoredRange) -> str:
    return tr(
        "Within the likely range of lamp {id}, the answer would change for {names}.",
        id=remark.lamp,
        names=_all(remark.names, remark.others),
    )


def _blind(remark: BlindMatters) -> str:
    names = _all(remark.names, remark.others) if remark.names else tr("no style")
    return tr("If the gaps were twice as bright, the answer would change for {names}.", names=names)


def _all(names: Sequence[str], others: Sequence[str]) -> str:
    """List styles by name, or name only the styles that are left out if that is shorter."""
    if not others:
        return tr("every style")
    if len(others) < len(names) / 2:
        return tr("every style except {names}", names=", ".join(others))
    return ", ".join(names)


def _rough(remark: RoughLight) -> str:
    if remark.share <= 0.0:
        return tr("Rough answer from one photo, although nothing in the photo is clipped.")
    return tr(
        "Rough answer from one photo: {share} of the light is clipped and estimated.",
        share=percent(remark.share),
    )


def _rough_turns(remark: RoughTurns) -> str:
    return tr("The turn depends on clipped light: {names}.", names=", ".join(remark.names))


def _sun(remark: SunRestored) -> str:
    return tr(
        "The sun (lamp {id}, {height:.0f}° high) is clipped in every frame. It was "
        "restored to {klx} klx, the value at that height under {sky} (IES RP-21); {low} "
        "to {high} klx are likely.",
        id=remark.lamp,
        height=remark.elevation_deg,
        klx=_klx(remark.lux),
        sky=_SKIES[remark.sky],
        low=_klx(remark.low_lux),
        high=_klx(remark.high_lux),
    )


def _klx(lux: float) -> str:
    return f"{lux / 1000.0:.0f}" if lux >= 10_000 else f"{lux / 1000.0:.2g}"


def _gained(remark: LampGained) -> str:
    id_, stops = remark.lamp, remark.stops
    if stops >= 0:
        return tr("Lamp {id} was made {stops:g} stops brighter, as requested.", id=id_, stops=stops)
    return tr("Lamp {id} was made {stops:g} stops darker, as requested.", id=id_, stops=-stops)


def _masking(remark: MaskingChanges) -> str:
    if not remark.styles:
        return tr("No style is within reach, with or without the mask.")
    if remark.worst is not None:
        parts = [_costly(remark, remark.worst)]
    elif remark.moved_deg > _MOVED_DEG:
        parts = [
            tr("Masking makes no turn worse."),
            tr(
                "Turns move by up to {most:.0f} degrees, but the old turns are equally good to "
                "within 1%.",
                most=remark.moved_deg,
            ),
        ]
    elif remark.moved_deg < _SAME_DEG:
        parts = [tr("Masking changes no turn.")]
    else:
        parts = [
            tr_plural(
                "Masking changes no turn by more than {count} degree.",
                "Masking changes no turn by more than {count} degrees.",
                math.ceil(remark.moved_deg),
            )
        ]
    if remark.gained:
        parts.append(tr("Now within reach: {names}.", names=", ".join(remark.gained)))
    if remark.lost:
        parts.append(tr("No longer within reach: {names}.", names=", ".join(remark.lost)))
    return " ".join(parts)


def _costly(remark: MaskingChanges, worst: CostlyChange) -> str:
    return tr_plural(
        "Masking changes {count} of {all} turns, {name} the most: from {before:.0f}° to "
        "{after:.0f}°. The old turn would lose {lost:.0f}% of its range.",
        "Masking changes {count} of {all} turns, {name} the most: from {before:.0f}° to "
        "{after:.0f}°. The old turn would lose {lost:.0f}% of its range.",
        remark.changed,
        all=remark.styles,
        name=worst.title,
        before=worst.before_deg,
        after=worst.after_deg,
        lost=100.0 * worst.given_up,
    )


SENTENCES: Final[Sentences] = {
    LampClipped: _clipped,
    MaybeSun: _maybe_sun,
    MoreLampsClipped: _more_clipped,
    ClippingMatters: _matters,
    ClippingSafe: _safe,
    RestoredRange: _restored_range,
    BlindMatters: _blind,
    RoughLight: _rough,
    RoughTurns: _rough_turns,
    SunRestored: _sun,
    LampMetered: tr(
        "Lamp {lamp} was set to the measured {lux:.0f} lux; the frames show {held_lux:.0f}."
    ),
    LampGained: _gained,
    NoClutter: tr("No tripod or photographer found below the camera."),
    MaskingChanges: _masking,
}
"""Sentence for each type of remark: text with field names, or a function that returns it."""
