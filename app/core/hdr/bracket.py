"""From files in any order to a bracket: which frames, in which order, at which exposures.

Nothing here looks at pixels. What makes a merge impossible is a `ProbeError` that names the file;
what makes it doubtful is a warning that travels with the bracket.
"""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeAlias, TypeVar

from app.core.base.errors import ProbeError
from app.core.base.files import open_file
from app.core.hdr.exposures import settle_exposures
from app.core.hdr.frame import Bracket, listed, plural, verb
from app.core.hdr.metadata import ENDINGS, SHUTTER_LIMITS_S, Header, read_header

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Sequence

MAX_FRAMES: Final = 40
"""Most files of a bracket; cameras bracket up to 19 frames."""

EQUAL_STOPS: Final = 0.05
"""Exposures that differ by less than this, in stops, count as equal."""

_MOST_LISTED: Final = 500
_MOST_PIXELS: Final = 1_000_000_000
_CHUNK: Final = 1 << 20
_START: Final = 1 << 16
_KIND_WORDS: Final = {
    "uint8": "8 bits",
    "uint16": "16 bits",
    "half": "16-bit floating point",
    "float": "floating point",
}

_Value = TypeVar("_Value", bound="Hashable")
_Listed: TypeAlias = tuple[Header, float | None]
"""A file of the bracket with the exposure time in seconds that the user gave for it."""


def read_bracket(paths: Sequence[Path], times: Sequence[float] | None = None) -> Bracket:
    """Read the headers of a bracket's files and put its frames in order.

    `paths` are the files in any order, or one folder: then of the pictures in it
    (`metadata.ENDINGS`, hidden ones left out), sorted by name, the largest set that can be one
    bracket. What is left out is said. `times` in seconds, one a file in that order, win over
    EXIF; ISO and f-number are still EXIF's.

    Raises ProbeError with fewer than two different frames or more than `MAX_FRAMES`; for a file
    that is not a picture, tone-mapped, without an exposure time, or of another size, kind,
    orientation or camera; when all exposures are equal, or `times` do not fit.
    """
    headers, left_out = _read_all([Path(path) for path in paths], times)
    files = [header.frame.path for header in headers]
    given = _check_times(times, len(files))
    _check_pixels(headers)
    listed_files, warnings = _without_copies(list(zip(headers, given, strict=True)))
    headers = [header for header, _ in listed_files]
    _check_count(headers, files)
    _check_alike(headers)
    _check_tone(headers)
    stated = None if times is None else [time or 0.0 for _, time in listed_files]
    exposures, doubts = settle_exposures(headers, stated)
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


def _read_all(paths: list[Path], times: Sequence[float] | None) -> tuple[list[Header], list[str]]:
    """Read the headers of the files named, or of the bracket in the folder named."""
    folders = [path for path in paths if _is_folder(path)]
    if not paths:
        raise ProbeError("There are no pictures to merge.", "Name at least two exposures.")
    if not folders:
        _check_number(len(paths))
        return [read_header(path) for path in paths], []
    if len(paths) > 1:
        raise ProbeError(
            f"{folders[0]} is a folder among other names.",
            "Name one folder, or name the files themselves.",
        )
    return _bracket_in(folders[0], None if times is None else len(times))


def _bracket_in(folder: Path, count: int | None) -> tuple[list[Header], list[str]]:
    """Choose what belongs together: one size, one kind, one camera; most stated exposures first.

    Where two sets are as good, all of them are given back: then it is an error to name the odd one.
    """
    sets: dict[Hashable, list[Header]] = {}
    errors: list[ProbeError] = []
    for file in _pictures_in(folder):
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

    ranked = sorted(sets.values(), key=rank, reverse=True)
    if len(ranked) > 1 and rank(ranked[0]) == rank(ranked[1]):
        return [header for headers in sets.values() for header in headers], []
    if not ranked or (len(ranked[0]) < 2 and errors):
        raise errors[0]
    taken = ranked[0]
    _check_number(len(taken))
    others = [header.frame.path.name for headers in ranked[1:] for header in headers]
    said = [f"Left out: {error.message}" for error in errors]
    if others:
        said.append(
            f"Left out: {listed(others)} {verb(others, 'does', 'do')} not belong to the bracket."
        )
    if said:
        first, last = taken[0].frame.path.name, taken[-1].frame.path.name
        said.insert(0, f"Took {plural(len(taken), 'picture')} of {folder.name}: {first} to {last}.")
    return taken, said


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:
        return False  # Reading it as a file says why it cannot be reached.


def _pictures_in(folder: Path) -> list[Path]:
    try:
        files = [
            entry
            for entry in folder.iterdir()
            if entry.suffix.lower() in ENDINGS and not entry.name.startswith(".")
        ]
        files = [file for file in files if file.is_file()]
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise ProbeError(f"The folder {folder} cannot be read: {reason}.") from None
    if not files:
        raise ProbeError(
            f"The folder {folder} holds no pictures.",
            f"Files ending in {', '.join(ENDINGS)} are read.",
        )
    if len(files) > _MOST_LISTED:
        raise ProbeError(
            f"{folder} holds {len(files)} pictures, too many to look for a bracket in.",
            "Move the frames of one place into a folder of their own.",
        )
    return sorted(files, key=lambda file: file.name)


def _check_times(times: Sequence[float] | None, count: int) -> list[float | None]:
    if times is None:
        return [None] * count
    if len(times) != count:
        raise ProbeError(
            f"{plural(len(times), 'exposure time')} for {plural(count, 'picture')}.",
            "Give one for each, in the order of the files (of a folder: sorted by name).",
        )
    low, high = SHUTTER_LIMITS_S
    for time in times:
        if not low <= time <= high:
            raise ProbeError(
                f"{time:g} is not an exposure time in seconds.",
                f"Between {low:g} and {high:g} s are possible.",
            )
    return [float(time) for time in times]


def _check_number(count: int) -> None:
    if count > MAX_FRAMES:
        raise ProbeError(
            f"{count} pictures are too many for one bracket: at most {MAX_FRAMES} are merged.",
            "Name only the frames of one place and time.",
        )


def _check_pixels(headers: list[Header]) -> None:
    """Refuse what would take hours: a few frames of a size that no camera has."""
    pixels = sum(header.frame.shape[0] * header.frame.shape[1] for header in headers)
    if pixels > _MOST_PIXELS:
        raise ProbeError(
            f"{len(headers)} frames of this size are too many: {pixels / 1e9:.1f} gigapixels.",
            "Scale all of them down by the same factor; 4096 x 2048 holds all that is needed.",
        )


def _without_copies(files: list[_Listed]) -> tuple[list[_Listed], list[str]]:
    """Leave out files that are named twice and files of the same bytes."""
    kept: dict[tuple[str, ...], _Listed] = {}
    dropped: dict[str, list[str]] = {}
    contents = _contents([header.frame.path for header, _ in files])
    for file, content in zip(files, contents, strict=True):
        first = kept.setdefault(content, file)
        if first is not file:
            name = first[0].frame.path.name
            dropped.setdefault(name, []).append(file[0].frame.path.name)
    return list(kept.values()), [
        f"{listed(copies)} {verb(copies, 'is a copy', 'are copies')} of {name} and left out."
        if set(copies) != {name}
        else f"{name} is there more than once and used once."
        for name, copies in dropped.items()
    ]


def _contents(paths: list[Path]) -> list[tuple[str, ...]]:
    """Return equal values for equal files, reading no more of them than that takes.

    Nothing where no other has their length, the whole only where another starts with the same
    bytes.
    """
    contents: list[tuple[str, ...]] = [(str(_size(path)),) for path in paths]
    for limit in (_START, None):
        counts = Counter(contents)
        contents = [
            (*content, _digest(path, limit)) if counts[content] > 1 else content
            for path, content in zip(paths, contents, strict=True)
        ]
    return contents


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise ProbeError(f"{path} cannot be read: {reason}.") from None


def _digest(path: Path, limit: int | None) -> str:
    """Digest of a file, or of its first bytes."""
    digest = hashlib.blake2b(digest_size=16)
    try:
        with open_file(path) as stream:
            while block := stream.read(_CHUNK if limit is None else limit):
                digest.update(block)
                if limit is not None:
                    break
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise ProbeError(f"{path} cannot be read: {reason}.") from None
    return digest.hexdigest()


def _check_count(headers: list[Header], files: list[Path]) -> None:
    if len(headers) > 1:
        return
    name = headers[0].frame.path.name
    hint = "Use at least two exposures, better three: the metered one, brighter and darker."
    if len(files) > 1:
        raise ProbeError(f"All files are copies of {name}: that is no bracket.", hint)
    raise ProbeError(f"{name} is alone: one frame is no bracket.", hint)


def _check_alike(headers: list[Header]) -> None:
    _one_value(
        headers,
        lambda header: header.frame.shape,
        lambda shape: f"{shape[1]} x {shape[0]} pixels",
        "Leave it out, or export all frames at one size.",
    )
    _one_value(
        [header for header in headers if header.frame.camera],
        lambda header: header.frame.camera,
        lambda camera: f"from a {camera}",
        "All frames of a bracket come from one camera; leave out what does not belong to it.",
    )
    _one_value(
        headers,
        lambda header: header.frame.kind,
        lambda kind: f"stored as {_KIND_WORDS[kind]}",
        "Leave it out, or export all frames in one format.",
    )
    _one_value(
        headers,
        lambda header: header.frame.primaries,
        lambda primaries: f"in {'colours of other primaries' if primaries else 'Rec. 709 colours'}",
        "Leave it out, or export all frames in one colour space.",
    )
    _one_value(
        headers,
        lambda header: header.orientation,
        lambda orientation: f"held another way (EXIF orientation {orientation})",
        "Leave it out, or shoot all frames with the camera held the same way.",
    )


def _one_value(
    headers: list[Header],
    value: Callable[[Header], _Value],
    words: Callable[[_Value], str],
    hint: str,
) -> None:
    """Refuse frames that differ, and name those in the minority."""
    names: dict[_Value, list[str]] = {}
    for header in headers:
        names.setdefault(value(header), []).append(header.frame.path.name)
    if len(names) < 2:
        return
    ranked = sorted(names, key=lambda each: -len(names[each]))
    usual, odd = ranked[0], ranked[1]
    if len(names[usual]) > len(names[odd]):
        rest = f"the other frames are {words(usual)}"
    else:
        rest = f"{listed(names[usual])} {verb(names[usual], 'is', 'are')} {words(usual)}"
    odd_words = f"{listed(names[odd])} {verb(names[odd], 'is', 'are')} {words(odd)}"
    raise ProbeError(f"{odd_words}, but {rest}.", hint)


def _check_tone(headers: list[Header]) -> None:
    mapped = [header.frame.path.name for header in headers if header.frame.tone_mapped]
    if mapped:
        raise ProbeError(
            f"{listed(mapped)} {verb(mapped, 'was', 'were')} taken with HDR rendering or"
            " range compensation on, which changes every pixel in its own way.",
            "Switch the camera's filter and options off and shoot again, or leave it out.",
        )


def _in_order(bracket: Bracket) -> Bracket:
    """Sort, brightest first, and look for exposures that are there twice."""
    order = sorted(
        range(len(bracket.frames)),
        key=lambda index: (-bracket.stops[index], bracket.frames[index].path.name),
    )
    frames = tuple(bracket.frames[index] for index in order)
    stops = tuple(bracket.stops[index] for index in order)
    if stops[0] - stops[-1] < EQUAL_STOPS:
        raise ProbeError(
            f"All {len(stops)} frames have the same exposure: the camera did not bracket.",
            "Shoot again with bracketing on. If the files state a wrong exposure, give the real"
            " ones with --times.",
        )
    warnings = bracket.warnings
    for first in range(len(stops)):
        same = [k for k in range(len(stops)) if math.fabs(stops[k] - stops[first]) < EQUAL_STOPS]
        if len(same) > 1 and same[0] == first:
            names = listed([frames[k].path.name for k in same])
            warnings = (*warnings, f"{names} have the same exposure; all of them are used.")
    return Bracket(frames, stops, warnings)
