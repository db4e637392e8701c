"""The words of merged light: what is clipped, which answers depend on it, what was put right."""

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
    "turn": tr("Up to 3 stops more light would change the turn of {names}."),
    "into reach": tr("Up to 3 stops more light would bring {names} into reach."),
    "out of reach": tr("Up to 3 stops more light would put {names} out of reach."),
}
_LATE: Final[dict[Effect, str]] = {
    "turn": tr("6 stops or more would change the turn of {names}."),
    "into reach": tr("6 stops or more would bring {names} into reach."),
    "out of reach": tr("6 stops or more would put {names} out of reach."),
}
_SKIES: Final = {"clear": tr("a clear sky"), "hazy": tr("haze"), "thin cloud": tr("thin cloud")}
_SAME_DEG: Final = 0.5
_MOVED_DEG: Final = 10.0


def clipped_brief(remark: LampClipped) -> str:
    """Name a clipped lamp, without what to do about it."""
    where = direction_words(remark.azimuth_deg, remark.elevation_deg)
    return CLIPPED[remark.source].format(where=where, id=remark.lamp)


def _clipped(remark: LampClipped) -> str:
    start = clipped_brief(remark)
    if remark.remedy is Remedy.SKY:
        return tr(
            "{start} No camera holds it: set how clear the sky is to restore it.", start=start
        )
    if remark.remedy is Remedy.GAIN:
        return tr(
            "{start} The camera cannot go darker: give lamp {id} a gain, or measure it with a "
            "light meter.",
            start=start,
            id=remark.lamp,
        )
    if remark.room_stops is not None:
        start = tr(
            "{start} The camera can go {room_stops:.0f} EV darker.",
            start=start,
            room_stops=remark.room_stops,
        )
    return f"{start} {_SHOOT[remark.frames - 1]}"


def _maybe_sun(remark: MaybeSun) -> str:
    return tr(
        "The lamp {where} ({id}) is clipped and may be the sun. Use frames that "
        "state their ISO and f-number: then its light is restored.",
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
        return tr("No style's turn depends on what is clipped, nor whether it is in reach.")
    return tr_plural(
        "The other one does not depend on it.",
        "The other {count} do not depend on it.",
        remark.count,
    )


def _restored_range(remark: RestoredRange) -> str:
    return tr(
        "The likely range of lamp {id} would change {names}.",
        id=remark.lamp,
        names=_all(remark.names, remark.others),
    )


def _blind(remark: BlindMatters) -> str:
    names = _all(remark.names, remark.others) if remark.names else tr("no style")
    return tr("Twice as much light where nothing was seen would change {names}.", names=names)


def _all(names: Sequence[str], others: Sequence[str]) -> str:
    """Name styles by what they are, or by what they are not when that is shorter."""
    if not others:
        return tr("every style")
    if len(others) < len(names) / 2:
        return tr("every style but {names}", names=", ".join(others))
    return ", ".join(names)


def _rough(remark: RoughLight) -> str:
    if remark.share <= 0.0:
        return tr("A rough answer: one photo, though nothing in it is clipped.")
    return tr(
        "A rough answer: in one photo, {share} of the light is clipped and a guess.",
        share=percent(remark.share),
    )


def _rough_turns(remark: RoughTurns) -> str:
    return tr("The turn depends on what is clipped: {names}.", names=", ".join(remark.names))


def _sun(remark: SunRestored) -> str:
    return tr(
        "The sun (lamp {id}, {height:.0f}° high) is clipped in every "
        "frame. It was given the {klx} klx that it has at that height under "
        "{sky} (IES RP-21); {low} to {high} klx are likely.",
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
        return tr("Lamp {id} was made {stops:g} stops brighter, as asked.", id=id_, stops=stops)
    return tr("Lamp {id} was made {stops:g} stops darker, as asked.", id=id_, stops=-stops)


def _masking(remark: MaskingChanges) -> str:
    if not remark.styles:
        return tr("Without what is masked, as with it, no style is within reach.")
    if remark.worst is not None:
        parts = [_costly(remark, remark.worst)]
    elif remark.moved_deg > _MOVED_DEG:
        parts = [
            tr("Without what is masked no turn gets worse."),
            tr(
                "Turns move by up to {most:.0f} degrees, but the old ones are as good within 1 %.",
                most=remark.moved_deg,
            ),
        ]
    elif remark.moved_deg < _SAME_DEG:
        parts = [tr("Without what is masked no turn changes.")]
    else:
        parts = [
            tr_plural(
                "Without what is masked no turn changes by more than {count} degree.",
                "Without what is masked no turn changes by more than {count} degrees.",
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
        "Without what is masked {count} of {all} turns changes, most of all {name}: from "
        "{before:.0f}° to {after:.0f}°; the old turn would give up {lost:.0f} % of its range.",
        "Without what is masked {count} of {all} turns change, most of all {name}: from "
        "{before:.0f}° to {after:.0f}°; the old turn would give up {lost:.0f} % of its range.",
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
        "Lamp {lamp} was given the {lux:.0f} lux measured; the frames hold {held_lux:.0f}."
    ),
    LampGained: _gained,
    NoClutter: tr("No tripod or photographer found below the camera."),
    MaskingChanges: _masking,
}
"""By remark: its sentence with the names of its fields, or what writes it."""
