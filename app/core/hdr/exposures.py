"""Which exposure each frame of a bracket had, by the user, EXIF and maker note, with doubts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from app.core.base.errors import ProbeError
from app.core.hdr.frame import Exposure
from app.core.text import tr, tr_plural
from app.core.text.quantities import listed

if TYPE_CHECKING:
    from app.core.hdr.metadata import Header

CONTRADICTION_STOPS: Final = 1.0 / 6.0
"""Two statements of one exposure contradict each other when further apart; half of a third."""

LENS_STOPS: Final = 0.05
"""The two lenses of a camera count as differently exposed when further apart, in stops."""

_SAME: Final = 1e-3
_GIVE_TIMES: Final = tr("Give the exposure times with --times, in seconds, one for each file.")


def settle_exposures(
    headers: Sequence[Header], times: Sequence[float] | None = None
) -> tuple[list[Exposure], list[str]]:
    """Decide the exposure of every frame.

    Exposure times in seconds come from `times`, else from EXIF. ISO and f-number come from
    EXIF; where no frame states one, it is taken to be the same in all and nothing is known
    absolutely; where some frames do not state it, the value that all others share is assumed.
    Where the others differ, given times alone count; without them it is a ProbeError, as is a
    frame without an exposure time.
    """
    shutters = _shutters(headers) if times is None else [float(time) for time in times]
    given = times is not None
    isos, iso_doubts = _fill(headers, [header.iso for header in headers], "iso", given)
    apertures, doubts = _fill(headers, [header.aperture for header in headers], "aperture", given)
    exposures = [
        Exposure(
            shutter,
            100.0 if iso is None else iso,
            1.0 if aperture is None else aperture,
            known=iso is not None and aperture is not None,
        )
        for shutter, iso, aperture in zip(shutters, isos, apertures, strict=True)
    ]
    doubts = [
        *_unstated(headers),
        *iso_doubts,
        *doubts,
        *(_times_doubts(headers, shutters) if given else ()),
        *_lens_doubts(headers),
        *_note_doubts(headers),
        *(f"{h.frame.path.name} {doubt}." for h in headers for doubt in h.doubts),
    ]
    return exposures, doubts


def metered_exposure(header: Header) -> Exposure | None:
    """Exposure of a picture that the camera metered by itself; None where no time is stated.

    A Theta on automatic may set its lenses to different ISO, and its EXIF then states either
    one of them or a mean. The geometric mean lies in the middle of both halves.
    """
    exposure, lenses = header.frame.exposure, header.frame.lenses
    if exposure is None or len(lenses) < 2:
        return exposure
    return replace(exposure, iso=math.exp(sum(math.log(lens.iso) for lens in lenses) / len(lenses)))


def _shutters(headers: Sequence[Header]) -> list[float]:
    missing = [header.frame.path.name for header in headers if header.shutter_s is None]
    if len(missing) == len(headers):
        raise ProbeError(tr("None of the pictures states its exposure time."), _GIVE_TIMES)
    if missing:
        raise ProbeError(
            tr_plural(
                "{names} states no exposure time.",
                "{names} state no exposure time.",
                len(missing),
                names=listed(missing),
            ),
            _GIVE_TIMES,
        )
    return [header.shutter_s or 0.0 for header in headers]


def _fill(
    headers: Sequence[Header], values: list[float | None], tag: str, given: bool
) -> tuple[list[float | None], list[str]]:
    """Values of a tag for all frames, all None where no frame states it, and what is in doubt."""
    stated = [value for value in values if value is not None]
    if len(stated) == len(values) or not stated:
        return values, []
    silent = [h.frame.path.name for h, value in zip(headers, values, strict=True) if value is None]
    start = (
        tr_plural(
            "{names} states no ISO value",
            "{names} state no ISO value",
            len(silent),
            names=listed(silent),
        )
        if tag == "iso"
        else tr_plural(
            "{names} states no f-number",
            "{names} state no f-number",
            len(silent),
            names=listed(silent),
        )
    )
    sign = "f/" if tag == "aperture" else "ISO "
    if max(stated) > min(stated) * (1.0 + _SAME):
        if given:
            doubt = tr(
                "{start} and the others differ in theirs: only the given exposure times count.",
                start=start,
            )
            return [None] * len(values), [doubt]
        low, high = f"{sign}{min(stated):g}", f"{sign}{max(stated):g}"
        raise ProbeError(
            tr(
                "{start}, and the other frames differ in theirs ({low} to {high}).",
                start=start,
                low=low,
                high=high,
            ),
            tr("Leave it out, or shoot with fixed ISO and aperture."),
        )
    doubt = tr(
        "{start}; {sign}{stated:g} is assumed, as in the other frames.",
        start=start,
        sign=sign,
        stated=stated[0],
    )
    return [stated[0]] * len(values), [doubt]


def _unstated(headers: Sequence[Header]) -> list[str]:
    no_iso = all(header.iso is None for header in headers)
    no_aperture = all(header.aperture is None for header in headers)
    if no_iso and no_aperture:
        start = tr("No frame states its ISO value or f-number: the same ones are assumed for all")
    elif no_iso:
        start = tr("No frame states its ISO value: the same one is assumed for all")
    elif no_aperture:
        start = tr("No frame states its f-number: the same one is assumed for all")
    else:
        return []
    return [tr("{start}, and the brightness of the place in cd/m2 stays unknown.", start=start)]


def _times_doubts(headers: Sequence[Header], times: Sequence[float]) -> list[str]:
    doubts = []
    for header, time in zip(headers, times, strict=True):
        stated = header.shutter_s
        if stated and abs(math.log2(time / stated)) > CONTRADICTION_STOPS:
            doubts.append(
                tr(
                    "{name} ({time:.4g} s, not {stated:.4g} s)",
                    name=header.frame.path.name,
                    time=time,
                    stated=stated,
                )
            )
    if not doubts:
        return []
    return [tr("The given exposure times are used against EXIF: {listed}.", listed=listed(doubts))]


def _lens_doubts(headers: Sequence[Header]) -> list[str]:
    """Name the frame whose two halves lie furthest apart (theta-api: auto exposure per lens)."""
    worst, gap = None, LENS_STOPS
    for header in headers:
        lenses = header.frame.lenses
        if len(lenses) != 2:
            continue
        first, second = (lens.shutter_s * lens.iso for lens in lenses)
        if abs(math.log2(first / second)) > gap:
            worst, gap = header, abs(math.log2(first / second))
    if worst is None:
        return []
    one, two = worst.frame.lenses
    both = tr("ISO {first:g} and {second:g}", first=one.iso, second=two.iso)
    if one.shutter_s != two.shutter_s:
        both = tr(
            "{isos}, {first:.4g} s and {second:.4g} s",
            isos=both,
            first=one.shutter_s,
            second=two.shutter_s,
        )
    return [
        tr(
            "{name}: the two lenses were exposed {gap:.1f} stops apart ({both}), so "
            "that the halves of the panorama do not agree. Shoot the bracket in "
            "manual mode.",
            name=worst.frame.path.name,
            gap=gap,
            both=both,
        )
    ]


def _note_doubts(headers: Sequence[Header]) -> list[str]:
    """Compare EXIF with the maker note where both lenses agree with each other."""
    shutters, isos = [], []
    for header in headers:
        name, note = header.frame.path.name, header.note
        if note is None:
            continue
        time = _agreed(note.lens_shutters_s)
        if _contradict(header.shutter_s, time):
            shutters.append(
                tr(
                    "{name} ({stated:.4g} s in EXIF, {noted:.4g} s)",
                    name=name,
                    stated=header.shutter_s,
                    noted=time,
                )
            )
        iso = _agreed(note.lens_isos)
        if _contradict(header.iso, iso):
            isos.append(
                tr(
                    "{name} (ISO {stated:g} in EXIF, {noted:g})",
                    name=name,
                    stated=header.iso,
                    noted=iso,
                )
            )
    doubts = []
    if shutters:
        doubts.append(
            tr(
                "EXIF and maker note differ in the exposure time: {listed}.",
                listed=listed(shutters),
            )
        )
    if isos:
        doubts.append(tr("EXIF and maker note differ in ISO: {listed}.", listed=listed(isos)))
    return doubts


def _agreed(pair: Sequence[float]) -> float | None:
    if not pair or abs(math.log2(max(pair) / min(pair))) > LENS_STOPS:
        return None
    return pair[0]


def _contradict(first: float | None, second: float | None) -> bool:
    if not first or not second:
        return False
    return abs(math.log2(first / second)) > CONTRADICTION_STOPS
