"""Determine the exposures of a bracket from its files and find contradictions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from app.core.base.errors import ProbeError
from app.core.base.phrases import listed
from app.core.base.remarks import Remark
from app.core.measure.bracket.remarks import (
    LensesApart,
    NoteContradiction,
    Tag,
    TagAssumed,
    TagIgnored,
    TagsUnstated,
    TimesAgainstExif,
)
from app.core.measure.read.frame import Exposure
from app.core.measure.read.metadata import Header
from app.core.text import tr, tr_plural

CONTRADICTION_STOPS: Final = 1.0 / 6.0
"""Difference beyond which two recorded exposures conflict: half of a third of a stop."""

LENS_STOPS: Final = 0.05
"""Difference in stops from which a camera's two lenses count as exposed differently."""

_SAME: Final = 1e-3
_GIVE_TIMES: Final = tr("Set the exposure times with --times, in seconds, one for each file.")


def settle_exposures(
    headers: Sequence[Header], times: Sequence[float] | None = None
) -> tuple[list[Exposure], list[Remark]]:
    """Determine the exposure of every frame.

    Exposure times come from `times` if given, otherwise from EXIF. ISO and f-number come from EXIF.
    If no frame records an ISO or an f-number, that value is assumed to be the same in all frames,
    and the absolute scale is unknown. If only some frames lack a value, they get the value that all
    others share. If the others differ, only the times in `times` count.

    Args:
        times: Exposure times in seconds, or None for those in EXIF.

    Raises:
        ProbeError: If a frame has no exposure time, or if it lacks a value that differs between the
            others and `times` is None.
    """
    shutters = _shutters(headers) if times is None else [float(time) for time in times]
    by_hand = times is not None
    isos, iso_doubts = _fill(headers, [header.iso for header in headers], "iso", by_hand)
    apertures, doubts = _fill(headers, [header.aperture for header in headers], "aperture", by_hand)
    exposures = [
        Exposure(
            shutter,
            100.0 if iso is None else iso,
            1.0 if aperture is None else aperture,
            known=iso is not None and aperture is not None,
        )
        for shutter, iso, aperture in zip(shutters, isos, apertures, strict=True)
    ]
    remarks: list[Remark] = [
        *_unstated(headers),
        *iso_doubts,
        *doubts,
        *(_times_doubts(headers, shutters) if by_hand else ()),
        *_lens_doubts(headers),
        *_note_doubts(headers),
        *(doubt for header in headers for doubt in header.doubts),
    ]
    return exposures, remarks


def metered_exposure(header: Header) -> Exposure | None:
    """Return the exposure metered by the camera, or None if the file records no exposure time.

    A Theta in its automatic program may set its lenses to different ISO values. EXIF then records
    either one of these values or a mean, so the geometric mean of the two lenses is used.
    """
    exposure, lenses = header.frame.exposure, header.frame.lenses
    if exposure is None or len(lenses) < 2:
        return exposure
    return replace(exposure, iso=math.exp(sum(math.log(lens.iso) for lens in lenses) / len(lenses)))


def _shutters(headers: Sequence[Header]) -> list[float]:
    missing = [header.frame.path.name for header in headers if header.shutter_s is None]
    if len(missing) == len(headers):
        raise ProbeError(tr("None of the pictures records its exposure time."), _GIVE_TIMES)
    if missing:
        raise ProbeError(
            tr_plural(
                "{names} does not record an exposure time.",
                "{names} do not record an exposure time.",
                len(missing),
                names=listed(missing),
            ),
            _GIVE_TIMES,
        )
    return [header.shutter_s or 0.0 for header in headers]


def _fill(
    headers: Sequence[Header], values: list[float | None], tag: Tag, by_hand: bool
) -> tuple[list[float | None], list[Remark]]:
    """Return a tag's values for all frames, or None for all, with remarks on doubtful values."""
    stated = [value for value in values if value is not None]
    if len(stated) == len(values) or not stated:
        return values, []
    pairs = zip(headers, values, strict=True)
    silent = tuple(header.frame.path.name for header, value in pairs if value is None)
    if max(stated) > min(stated) * (1.0 + _SAME):
        if by_hand:
            return [None] * len(values), [TagIgnored(tag, silent)]
        raise _differing(silent, stated, tag)
    return [stated[0]] * len(values), [TagAssumed(tag, silent, stated[0])]


def _differing(names: Sequence[str], stated: Sequence[float], tag: Tag) -> ProbeError:
    low, high = min(stated), max(stated)
    if tag == "iso":
        words = tr_plural(
            "{names} does not record the ISO, and the other frames differ (ISO {low:g} to "
            "ISO {high:g}).",
            "{names} do not record the ISO, and the other frames differ (ISO {low:g} to "
            "ISO {high:g}).",
            len(names),
            names=listed(names),
            low=low,
            high=high,
        )
    else:
        words = tr_plural(
            "{names} does not record the f-number, and the other frames differ (f/{low:g} "
            "to f/{high:g}).",
            "{names} do not record the f-number, and the other frames differ (f/{low:g} "
            "to f/{high:g}).",
            len(names),
            names=listed(names),
            low=low,
            high=high,
        )
    return ProbeError(words, tr("Leave such frames out, or shoot with a fixed ISO and aperture."))


def _unstated(headers: Sequence[Header]) -> list[Remark]:
    no_iso = all(header.iso is None for header in headers)
    no_aperture = all(header.aperture is None for header in headers)
    return [TagsUnstated(no_iso, no_aperture)] if no_iso or no_aperture else []


def _times_doubts(headers: Sequence[Header], times: Sequence[float]) -> list[Remark]:
    doubts = [
        (header.frame.path.name, time, header.shutter_s)
        for header, time in zip(headers, times, strict=True)
        if header.shutter_s and abs(math.log2(time / header.shutter_s)) > CONTRADICTION_STOPS
    ]
    return [TimesAgainstExif(*zip(*doubts, strict=True))] if doubts else []


def _lens_doubts(headers: Sequence[Header]) -> list[Remark]:
    """Name the frame whose two lenses were exposed most differently."""
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
    lenses = worst.frame.lenses
    isos, shutters = zip(*((lens.iso, lens.shutter_s) for lens in lenses), strict=True)
    return [LensesApart(worst.frame.path.name, gap, isos, shutters)]


def _note_doubts(headers: Sequence[Header]) -> list[Remark]:
    """Compare EXIF with the maker note if both lenses have the same exposure."""
    apart: dict[Tag, list[tuple[str, float, float]]] = {"shutter": [], "iso": []}
    for header in headers:
        name, note = header.frame.path.name, header.note
        if note is None:
            continue
        time, iso = _agreed(note.lens_shutters_s), _agreed(note.lens_isos)
        if header.shutter_s and time and _contradict(header.shutter_s, time):
            apart["shutter"].append((name, header.shutter_s, time))
        if header.iso and iso and _contradict(header.iso, iso):
            apart["iso"].append((name, header.iso, iso))
    return [NoteContradiction(tag, *zip(*rows, strict=True)) for tag, rows in apart.items() if rows]


def _agreed(pair: Sequence[float]) -> float | None:
    if not pair or abs(math.log2(max(pair) / min(pair))) > LENS_STOPS:
        return None
    return pair[0]


def _contradict(first: float, second: float) -> bool:
    return abs(math.log2(first / second)) > CONTRADICTION_STOPS
