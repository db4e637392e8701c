"""Read a bracket's headers to determine its frames, their order and their exposures.

Pixels are not read here. If a merge is impossible, a `ProbeError` names the file and explains why.
Doubts are reported as remarks on the bracket.
"""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final, TypeAlias, TypeVar

from app.core.base.atomic_files import open_file, os_errors_as
from app.core.base.errors import ProbeError
from app.core.base.phrases import listed
from app.core.base.remarks import Remark
from app.core.measure.bracket.exposures import settle_exposures
from app.core.measure.bracket.remarks import (
    Copies,
    FileLeftOut,
    NotOfBracket,
    PicturesTaken,
    RenderedByCamera,
    SameExposure,
    TimeUnstated,
)
from app.core.measure.fisheye.circles import may_be_circles
from app.core.measure.read.frame import Bracket, Frame
from app.core.measure.read.metadata import (
    SHUTTER_LIMITS_S,
    Header,
    pictures_in,
    read_header,
)
from app.core.text import tr, tr_plural

MAX_FRAMES: Final = 40
"""Maximum number of files in a bracket. Cameras bracket up to 19 frames."""

EQUAL_STOPS: Final = 0.05
"""Exposures that differ by less than this, in stops, count as equal."""

_MOST_PIXELS: Final = 1_000_000_000
_START: Final = 1 << 16
_KIND_WORDS: Final = {
    "uint8": tr("8-bit integers"),
    "uint16": tr("16-bit integers"),
    "half": tr("16-bit floating point"),
    "float": tr("floating point"),
}

_Value = TypeVar("_Value", bound="Hashable")
_Listed: TypeAlias = tuple[Header, float | None]
"""A file in the bracket, and the exposure time in seconds that the user gave for it, or None."""


def read_bracket(
    paths: Sequence[Path],
    times: Sequence[float] | None = None,
    *,
    alone: bool = False,
    sort_out: bool = False,
) -> Bracket:
    """Read the headers of a bracket and sort its frames.

    Args:
        paths: The files in any order, or one folder. In a folder, the largest set of pictures that
            can form one bracket is used, and the others are reported. Only files with a suffix in
            `metadata.ENDINGS` are considered, sorted by name, without hidden files.
        times: Exposure times in seconds that replace those in EXIF, one for each file, in the order
            of `paths`. ISO and f-number still come from EXIF.
        alone: Whether a single photo of all directions is sufficient. Such a photo need not record
            its exposure.
        sort_out: Whether to leave out files that do not belong to the bracket, as is done in a
            folder.

    Raises:
        ProbeError: If there are fewer than two different frames or more than `MAX_FRAMES`; a file
            is not a picture, is tone-mapped, has no exposure time, or differs in size, kind,
            orientation or camera; all exposures are equal; or `times` has the wrong length.
    """
    inputs = [Path(path) for path in paths]
    sort_out = sort_out or (len(inputs) == 1 and _is_folder(inputs[0]))
    headers, left_out = _read_all(inputs, times, sort_out=sort_out)
    if sort_out and times is None:
        headers, mapped_out = _without_mapped(headers)
        left_out += mapped_out
    files = [header.frame.path for header in headers]
    times_s = _check_times(times, len(files))
    _check_pixels(headers)
    listed_files, warnings = _without_copies(list(zip(headers, times_s, strict=True)))
    headers = [header for header, _ in listed_files]
    if alone and len(files) == 1:
        return _lone(headers[0], (*left_out, *warnings), times)
    _check_count(headers, files)
    _check_alike(headers)
    if names := rendered_frames(headers):
        hint = tr(
            "Turn off the camera’s filters and effects and shoot again, or leave the picture out."
        )
        raise ProbeError(_rendered(names), hint)
    tag_times = None if times is None else [time or 0.0 for _, time in listed_files]
    exposures, doubts = settle_exposures(headers, tag_times)
    dressed = [
        replace(header.frame, exposure=exposure)
        for header, exposure in zip(headers, exposures, strict=True)
    ]
    bracket = Bracket(
        frames=tuple(dressed),
        stops=tuple(exposure.ev for exposure in exposures),
        warnings=(*left_out, *warnings, *doubts),
    )
    return _in_order(bracket)


def _without_mapped(headers: list[Header]) -> tuple[list[Header], list[Remark]]:
    """Leave out pictures that the camera has rendered, if the others form a bracket."""
    plain = [header for header in headers if not header.frame.tone_mapped]
    evs = [each.frame.exposure.ev for each in plain if each.frame.exposure is not None]
    if len(plain) == len(headers) or not evs or max(evs) - min(evs) < EQUAL_STOPS:
        return headers, []
    return plain, [RenderedByCamera(rendered_frames(headers), left_out=True)]


def _read_all(
    paths: list[Path], times: Sequence[float] | None, *, sort_out: bool
) -> tuple[list[Header], list[Remark]]:
    """Read the headers of the given files, or of the bracket in the given folder."""
    folders = [path for path in paths if _is_folder(path)]
    if not paths:
        raise ProbeError(
            tr("There are no pictures to merge."), tr("Choose at least two exposures.")
        )
    count = None if times is None else len(times)
    if not folders and sort_out and len(paths) > 1:
        return _bracket_of(paths, paths[0].parent.name, count)
    if not folders:
        _check_number(len(paths))
        return [read_header(path) for path in paths], []
    if len(paths) > 1:
        raise ProbeError(
            tr("{folder} is a folder, but other paths were chosen too.", folder=folders[0]),
            tr("Choose one folder, or only files."),
        )
    return _bracket_of(pictures_in(folders[0]), folders[0].name, count)


def _bracket_of(
    files: Sequence[Path], folder: str, count: int | None
) -> tuple[list[Header], list[Remark]]:
    """Choose the files of one size, kind and camera that cover the most exposures.

    If two sets are equally good, the files in both are returned, and the caller reports the odd one
    out as an error.
    """
    sets: dict[Hashable, list[Header]] = {}
    errors: list[ProbeError] = []
    for file in files:
        try:
            header = read_header(file)
        except ProbeError as error:
            errors.append(error)
            continue
        frame = header.frame
        sets.setdefault((frame.shape, frame.kind, frame.camera), []).append(header)

    def rank(headers: list[Header]) -> tuple[bool, int, int]:
        stated = sum(header.frame.exposure is not None for header in headers)
        return len(headers) == count, stated, len(headers)

    by_rank = sorted(sets.values(), key=rank, reverse=True)
    if len(by_rank) > 1 and rank(by_rank[0]) == rank(by_rank[1]):
        return [header for headers in sets.values() for header in headers], []
    if not by_rank or (len(by_rank[0]) < 2 and errors):
        raise errors[0]
    best = by_rank[0]
    _check_number(len(best))
    others = tuple(header.frame.path.name for headers in by_rank[1:] for header in headers)
    remarks: list[Remark] = [FileLeftOut(error.message) for error in errors]
    if others:
        remarks.append(NotOfBracket(others))
    if remarks:
        first, last = best[0].frame.path.name, best[-1].frame.path.name
        remarks.insert(0, PicturesTaken(len(best), folder, first, last))
    return best, remarks


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:
        return False  # Reading the path as a file will report why it is inaccessible.


def _check_times(times: Sequence[float] | None, count: int) -> list[float | None]:
    if times is None:
        return [None] * count
    if len(times) != count:
        raise ProbeError(
            tr(
                "{times} for {pictures}.",
                times=tr_plural("{count} exposure time", "{count} exposure times", len(times)),
                pictures=tr_plural("{count} picture", "{count} pictures", count),
            ),
            tr("Set one for each file, in the order of the files (in a folder, by name)."),
        )
    low, high = SHUTTER_LIMITS_S
    for time in times:
        if not low <= time <= high:
            raise ProbeError(
                tr("{time:g} s is not a valid exposure time.", time=time),
                tr("It must be between {low:g} and {high:g} s.", low=low, high=high),
            )
    return [float(time) for time in times]


def _check_number(count: int) -> None:
    if count > MAX_FRAMES:
        raise ProbeError(
            tr(
                "{count} pictures are too many for one bracket; the limit is {most}.",
                count=count,
                most=MAX_FRAMES,
            ),
            tr("Choose only the frames from one place and time."),
        )


def _check_pixels(headers: list[Header]) -> None:
    """Reject frames of a size that no camera has, which would take hours to merge."""
    pixels = sum(header.frame.shape[0] * header.frame.shape[1] for header in headers)
    if pixels > _MOST_PIXELS:
        raise ProbeError(
            tr(
                "{count} frames of this size are too large to merge: {pixels:.1f} gigapixels.",
                count=len(headers),
                pixels=pixels / 1e9,
            ),
            tr("Scale all of them down by the same factor; 4096 x 2048 is enough."),
        )


def _without_copies(files: list[_Listed]) -> tuple[list[_Listed], list[Remark]]:
    """Leave out files that are named twice and files with the same bytes."""
    unique: dict[tuple[str, ...], _Listed] = {}
    copy_names: dict[str, list[str]] = {}
    contents = _contents([header.frame.path for header, _ in files])
    for file, content in zip(files, contents, strict=True):
        first = unique.setdefault(content, file)
        if first is not file:
            name = first[0].frame.path.name
            copy_names.setdefault(name, []).append(file[0].frame.path.name)
    copies: list[Remark] = [Copies(name, tuple(names)) for name, names in copy_names.items()]
    return list(unique.values()), copies


def _contents(paths: list[Path]) -> list[tuple[str, ...]]:
    """Return equal values for equal files, reading no more of the files than is necessary.

    A file is read only if another has the same length, and read completely only if another starts
    with the same bytes.
    """
    contents: list[tuple[str, ...]] = [()] * len(paths)
    for limit in (0, _START, None):
        counts = Counter(contents)
        contents = [
            (*content, _content(path, limit)) if counts[content] > 1 or limit == 0 else content
            for path, content in zip(paths, contents, strict=True)
        ]
    return contents


def _content(path: Path, limit: int | None) -> str:
    """Return the digest of a file or of its first `limit` bytes, or its length if `limit` is 0."""
    with os_errors_as(ProbeError, tr("{path} cannot be read: {reason}."), path=path):
        if limit == 0:
            return str(path.stat().st_size)
        with open_file(path) as stream:
            if limit is None:
                return hashlib.file_digest(stream, "sha256").hexdigest()
            return hashlib.sha256(stream.read(limit)).hexdigest()


def _check_count(headers: list[Header], files: list[Path]) -> None:
    if len(headers) > 1:
        return
    name = headers[0].frame.path.name
    hint = tr("Use at least two exposures, preferably three: as metered, brighter and darker.")
    if len(files) > 1:
        raise ProbeError(
            tr("All files are copies of {name}, so they are not a bracket.", name=name), hint
        )
    raise ProbeError(tr("{name} is a single frame, not a bracket.", name=name), hint)


def not_all_around(frame: Frame) -> ProbeError:
    """Return the error for a single photo that is neither a panorama nor a fisheye pair."""
    return ProbeError(
        tr(
            "{name} is {width} x {height}. A single picture must be a full panorama, "
            "twice as wide as it is high (2:1).",
            name=frame.path.name,
            width=frame.shape[1],
            height=frame.shape[0],
        ),
        tr("Use a 360 camera’s picture, or at least two exposures of a bracket."),
    )


def _lone(header: Header, remarks: Sequence[Remark], times: Sequence[float] | None) -> Bracket:
    """Create a bracket of one photo, or raise an error that explains why this is impossible."""
    frame, name = header.frame, header.frame.path.name
    if frame.kind not in ("uint8", "uint16"):
        _check_count([header], [frame.path])
    if not may_be_circles(frame.shape):
        raise not_all_around(frame)
    if header.part:
        raise ProbeError(
            tr("{name} is only part of a panorama, according to its metadata.", name=name),
            tr("Export it as a full panorama (360 x 180 degrees)."),
        )
    stops, doubts = 0.0, list[Remark]([TimeUnstated(name)])
    if frame.exposure is not None or times is not None:
        exposures, doubts = settle_exposures([header], times)
        frame, stops = replace(frame, exposure=exposures[0]), exposures[0].ev
    rendered = [RenderedByCamera((name,))] if frame.tone_mapped else []
    return Bracket((frame,), (stops,), (*remarks, *doubts, *rendered))


def _check_alike(headers: list[Header]) -> None:
    _one_value(
        headers,
        lambda header: header.frame.shape,
        lambda shape: tr("{width} x {height} pixels", width=shape[1], height=shape[0]),
        tr("Leave it out, or export all frames at the same size."),
    )
    _one_value(
        [header for header in headers if header.frame.camera],
        lambda header: header.frame.camera,
        lambda camera: tr("from a {camera}", camera=camera),
        tr("All frames of a bracket must come from one camera. Leave out the others."),
    )
    _one_value(
        headers,
        lambda header: header.frame.kind,
        lambda kind: tr("stored as {kind}", kind=_KIND_WORDS[kind]),
        tr("Leave it out, or export all frames in the same format."),
    )
    _one_value(
        headers,
        lambda header: header.frame.primaries,
        lambda primaries: (
            tr("in another colour space") if primaries else tr("in the Rec. 709 colour space")
        ),
        tr("Leave it out, or export all frames in the same colour space."),
    )
    _one_value(
        headers,
        lambda header: header.orientation,
        lambda orientation: tr(
            "in another orientation (EXIF orientation {orientation})", orientation=orientation
        ),
        tr("Leave it out, or hold the camera the same way for all frames."),
    )


def _one_value(
    headers: list[Header],
    value: Callable[[Header], _Value],
    words: Callable[[_Value], str],
    hint: str,
) -> None:
    """Raise an error if the frames differ, naming those in the minority."""
    names: dict[_Value, list[str]] = {}
    for header in headers:
        names.setdefault(value(header), []).append(header.frame.path.name)
    if len(names) < 2:
        return
    ranked = sorted(names, key=lambda each: -len(names[each]))
    usual, odd = ranked[0], ranked[1]
    if len(names[usual]) > len(names[odd]):
        rest = tr("the other frames are {what}", what=words(usual))
    else:
        rest = _clause(names[usual], words(usual))
    raise ProbeError(tr("{odd}, but {rest}.", odd=_clause(names[odd], words(odd)), rest=rest), hint)


def _clause(names: list[str], what: str) -> str:
    return tr_plural(
        "{names} is {what}", "{names} are {what}", len(names), names=listed(names), what=what
    )


def rendered_frames(headers: Sequence[Header]) -> tuple[str, ...]:
    """Return the names of the pictures in which the camera has altered every pixel."""
    return tuple(header.frame.path.name for header in headers if header.frame.tone_mapped)


def _rendered(names: Sequence[str]) -> str:
    return tr_plural(
        "{names} was taken with the camera's HDR or range compensation on.",
        "{names} were taken with the camera's HDR or range compensation on.",
        len(names),
        names=listed(names),
    )


def _in_order(bracket: Bracket) -> Bracket:
    """Sort the frames from the brightest to the darkest and report duplicate exposures."""
    order = sorted(
        range(len(bracket.frames)),
        key=lambda index: (-bracket.stops[index], bracket.frames[index].path.name),
    )
    frames = tuple(bracket.frames[index] for index in order)
    stops = tuple(bracket.stops[index] for index in order)
    if stops[0] - stops[-1] < EQUAL_STOPS:
        raise ProbeError(
            tr(
                "All {count} frames have the same exposure: the camera did not bracket.",
                count=len(stops),
            ),
            tr(
                "Turn on bracketing and shoot again. If the files record wrong "
                "exposures, set the correct ones with --times."
            ),
        )
    warnings = bracket.warnings
    for first in range(len(stops)):
        same = [k for k in range(len(stops)) if math.fabs(stops[k] - stops[first]) < EQUAL_STOPS]
        if len(same) > 1 and same[0] == first:
            names = tuple(frames[k].path.name for k in same)
            warnings = (*warnings, SameExposure(names))
    return Bracket(frames, stops, warnings)
