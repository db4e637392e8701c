"""Which exposure each frame of a bracket had, by the user, EXIF and maker note, with doubts."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from app.core.base.errors import ProbeError
from app.core.hdr.frame import Exposure, listed, verb

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.hdr.metadata import Header

CONTRADICTION_STOPS: Final = 1.0 / 6.0
"""Two statements of one exposure contradict each other when further apart; half of a third."""

LENS_STOPS: Final = 0.05
"""The two lenses of a camera count as differently exposed when further apart, in stops."""

_SAME: Final = 1e-3
_GIVE_TIMES: Final = "Give the exposure times with --times, in seconds, one for each file."


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
    isos, iso_doubts = _fill(headers, [header.iso for header in headers], "ISO value", given)
    apertures, doubts = _fill(headers, [header.aperture for header in headers], "f-number", given)
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
        raise ProbeError("None of the pictures states its exposure time.", _GIVE_TIMES)
    if missing:
        raise ProbeError(
            f"{listed(missing)} {verb(missing, 'states', 'state')} no exposure time.",
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
    start = f"{listed(silent)} {verb(silent, 'states', 'state')} no {tag}"
    sign = "f/" if tag == "f-number" else "ISO "
    if max(stated) > min(stated) * (1.0 + _SAME):
        if given:
            doubt = f"{start} and the others differ in theirs: only the given exposure times count."
            return [None] * len(values), [doubt]
        low, high = f"{sign}{min(stated):g}", f"{sign}{max(stated):g}"
        raise ProbeError(
            f"{start}, and the other frames differ in theirs ({low} to {high}).",
            "Leave it out, or shoot with fixed ISO and aperture.",
        )
    doubt = f"{start}; {sign}{stated[0]:g} is assumed, as in the other frames."
    return [stated[0]] * len(values), [doubt]


def _unstated(headers: Sequence[Header]) -> list[str]:
    words = []
    if all(header.iso is None for header in headers):
        words.append("ISO value")
    if all(header.aperture is None for header in headers):
        words.append("f-number")
    if not words:
        return []
    each = "the same one is" if len(words) == 1 else "the same ones are"
    return [
        f"No frame states its {' or '.join(words)}: {each} assumed for all,"
        " and the brightness of the place in cd/m2 stays unknown."
    ]


def _times_doubts(headers: Sequence[Header], times: Sequence[float]) -> list[str]:
    doubts = []
    for header, time in zip(headers, times, strict=True):
        stated = header.shutter_s
        if stated and abs(math.log2(time / stated)) > CONTRADICTION_STOPS:
            doubts.append(f"{header.frame.path.name} ({time:.4g} s, not {stated:.4g} s)")
    if not doubts:
        return []
    return [f"The given exposure times are used against EXIF: {listed(doubts)}."]


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
    both = f"ISO {one.iso:g} and {two.iso:g}"
    if one.shutter_s != two.shutter_s:
        both += f", {one.shutter_s:.4g} s and {two.shutter_s:.4g} s"
    return [
        f"{worst.frame.path.name}: the two lenses were exposed {gap:.1f} stops apart ({both}), so"
        " that the halves of the panorama do not agree. Shoot the bracket in manual mode."
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
            shutters.append(f"{name} ({header.shutter_s:.4g} s in EXIF, {time:.4g} s)")
        iso = _agreed(note.lens_isos)
        if _contradict(header.iso, iso):
            isos.append(f"{name} (ISO {header.iso:g} in EXIF, {iso:g})")
    doubts = []
    if shutters:
        doubts.append(f"EXIF and maker note differ in the exposure time: {listed(shutters)}.")
    if isos:
        doubts.append(f"EXIF and maker note differ in ISO: {listed(isos)}.")
    return doubts


def _agreed(pair: Sequence[float]) -> float | None:
    if not pair or abs(math.log2(max(pair) / min(pair))) > LENS_STOPS:
        return None
    return pair[0]


def _contradict(first: float | None, second: float | None) -> bool:
    if not first or not second:
        return False
    return abs(math.log2(first / second)) > CONTRADICTION_STOPS
