"""The user's captured lamps in their folder: keep, name, correct, put away and get back.

    FOLDER/<name>.json           what is known of the lamp; only ever replaced as a whole
    FOLDER/<name>-<digits>.exr   its capture, and its mask as channel A; named by its checksum
    FOLDER/<name>.png            a small picture of it
    FOLDER/trash/                lamps that were put away, and captures that were corrected

The text makes a lamp count: the capture is whole before the text names it. Where the text is
damaged, the capture still holds the light, its unit and the mask.
"""

from __future__ import annotations

import contextlib
import os
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from app.core.base.errors import CoreError
from app.core.base.paths import user_data
from app.core.base.unique_names import names_like, title_key, titles_like
from app.core.second_light.comparable import with_lux
from app.core.second_light.lamp_file import read_lamp_file
from app.core.second_light.lamp_presets import KINDS
from app.core.second_light.lamp_store import (
    MAX_TITLE,
    capture_named,
    capture_path,
    captures,
    checksum,
    facts_of,
    names,
    write_lamp,
    write_text,
)
from app.core.storage.places.names import words_of

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from app.core.second_light.captured import CapturedLamp
    from app.core.storage.settings.json_file import Facts


def clean_title(title: str) -> str:
    """Return a title as it is kept: one line of letters that can be seen.

    Raises
    ------
    CoreError
        If nothing is left of it, or too much.
    """
    visible = "".join(letter if letter.isprintable() else " " for letter in title)
    value = " ".join(visible.split())
    if not value:
        raise CoreError("The lamp needs a name.", "Type one.")
    if len(value) > MAX_TITLE:
        raise CoreError(f"This name is longer than {MAX_TITLE} characters.", "Shorten it.")
    return value


def titles_of(folder: Path, without: str = "") -> dict[str, str]:
    """Return the names of the lamps of a folder by `title_key`."""
    titles = {}
    for name in names(folder):
        # A title that cannot be read cannot be met again either.
        with contextlib.suppress(CoreError):
            if name != without:
                titles[title_key(facts_of(folder, name)[0]["title"])] = name
    return titles


def free_title(folder: Path, title: str) -> str:
    """Return a title that no lamp bears, with a number where this one is taken.

    Raises
    ------
    CoreError
        If thousands bear it already.
    """
    taken = titles_of(folder)
    return _first(each for each in titles_like(title, MAX_TITLE) if title_key(each) not in taken)


def free_name(folder: Path, title: str) -> str:
    """Make a name for commands and files of a title: one that no lamp and no kind of lamp bears.

    Raises
    ------
    CoreError
        If thousands bear it already.
    """
    # A picture without its lamp is somebody's file all the same.
    taken = {*names(folder), *(file.stem for file in folder.glob("*.png"))}
    return _first(each for each in names_like(title, "lamp", KINDS) if each not in taken)


def _first(free: Iterator[str]) -> str:
    found = next(free, None)
    if found is None:
        raise CoreError("There are too many lamps of this name.", "Choose another name.")
    return found


CANNOT_READ: Final = "This lamp cannot be read. Its files are untouched."

_MOST_LAMPS: Final = 500
_TRASH: Final = "trash"
_HELD_M: Final = (0.05, 20.0)


@dataclass(frozen=True, slots=True)
class LampEntry:
    """A lamp of the library, without its light.

    Attributes
    ----------
    distance_m : float or None
        At which it was captured, metres.
    lux : float or None
        What it gives there; None where its exposure was not known.
    picture : Path or None
        Small sRGB picture.
    """

    name: str
    title: str
    distance_m: float | None
    lux: float | None
    camera: str
    picture: Path | None
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class DamagedLamp:
    """A lamp in the folder that cannot be read."""

    path: Path
    reason: str
    message: str = CANNOT_READ


@dataclass(frozen=True, slots=True)
class TrashedLamp:
    """A lamp that was put away."""

    folder: Path
    name: str
    title: str


def lamps_folder() -> Path:
    """Return the folder of the user's lamps; it need not exist."""
    return user_data() / "lamps"


def list_lamps(folder: Path) -> tuple[tuple[LampEntry, ...], tuple[DamagedLamp, ...]]:
    """List the lamps of a folder without reading their light."""
    entries: list[LampEntry] = []
    damaged: list[DamagedLamp] = []
    try:
        found = names(folder)
    except OSError as error:
        return (), (DamagedLamp(folder, f"The folder cannot be read: {words_of(error)}."),)
    for name in found[:_MOST_LAMPS]:
        try:
            entries.append(_entry(folder, name, *facts_of(folder, name)))
        except CoreError as error:
            damaged.append(DamagedLamp(folder / f"{name}.json", str(error)))
    return tuple(sorted(entries, key=lambda each: title_key(each.title))), tuple(damaged)


def read_lamp(folder: Path, name: str) -> CapturedLamp:
    """Read a lamp.

    Raises
    ------
    CoreError
        When there is none of that name, or it is damaged.
    """
    found = _find(folder, name)
    facts, _ = facts_of(folder, found)
    path = capture_path(folder, found, facts)
    lamp, _ = read_lamp_file(path)
    if facts.get("sha256", "") not in ("", checksum(lamp)):
        raise CoreError(
            f"The capture of “{facts['title']}” is damaged: its checksum does not fit.",
            "Capture the lamp again.",
        )
    white = lamp.white_cd_m2 if facts["white_cd_m2"] is None else facts["white_cd_m2"]
    return replace(
        lamp,
        name=found,
        title=facts["title"],
        white_cd_m2=white,
        distance_m=facts["distance_m"],
        camera=facts["camera"],
    )


def add_lamp(folder: Path, lamp: CapturedLamp, title: str = "") -> CapturedLamp:
    """Keep a lamp under a name and title of its own.

    Raises
    ------
    CoreError
        If it cannot be written, or the title is empty or too long. Nothing counts then.
    """
    wanted = free_title(folder, clean_title(title or lamp.title))
    named = replace(lamp, name=free_name(folder, wanted), title=wanted)
    write_lamp(folder, named)
    return named


def update_lamp(folder: Path, lamp: CapturedLamp) -> None:
    """Replace a lamp, its mask or brightness corrected; the old one goes to the trash.

    Raises
    ------
    CoreError
        When there is none of that name, or it cannot be written; the old one then still counts.
    """
    name = _find(folder, lamp.name)
    old = read_lamp(folder, name)
    write_lamp(_trash_folder(folder, name), old)
    write_lamp(folder, replace(lamp, title=clean_title(lamp.title)))
    if checksum(old) != checksum(lamp):
        with contextlib.suppress(OSError):
            capture_named(folder, name, checksum(old)).unlink()


def rename_lamp(folder: Path, name: str, title: str) -> CapturedLamp:
    """Give a lamp another title; its name in files stays.

    Raises
    ------
    CoreError
        If another lamp is called so, or it cannot be read or written.
    """
    lamp = read_lamp(folder, name)
    wanted = clean_title(title)
    if title_key(wanted) in titles_of(folder, without=lamp.name):
        raise CoreError(f"There is already a lamp called “{wanted}”.", "Choose another name.")
    renamed = replace(lamp, title=wanted)
    write_text(folder, renamed)
    return renamed


def restate_lamp(
    folder: Path, name: str, *, distance_m: float | None = None, lux: float | None = None
) -> CapturedLamp:
    """Correct what was said of a lamp; its capture stays.

    Parameters
    ----------
    distance_m : float, optional
        At which it was captured, metres; what is left out stays.

    Raises
    ------
    CoreError
        If these are no such numbers, or it cannot be read or written.
    """
    lamp = read_lamp(folder, name)
    if distance_m is not None:
        lamp = replace(lamp, distance_m=check_distance(distance_m))
    if lux is not None:
        lamp = with_lux(lamp, lux)
    write_text(folder, lamp)
    return lamp


def check_distance(distance_m: float) -> float:
    """Give a distance of a captured lamp back, unless none can be captured or held there.

    Raises
    ------
    CoreError
        Otherwise.
    """
    low, high = _HELD_M
    if not low <= distance_m <= high:
        raise CoreError(
            f"A lamp {distance_m:g} m away cannot be kept.",
            f"Measure from the camera to the lamp: between {100 * low:g} cm and {high:g} m.",
        )
    return distance_m


def delete_lamp(folder: Path, name: str) -> TrashedLamp:
    """Put a lamp away, so that `restore_lamp` can bring it back.

    Raises
    ------
    CoreError
        When there is none of that name, or its files cannot be moved.
    """
    found = _find(folder, name)
    facts, _ = facts_of(folder, found)
    away = _trash_folder(folder, found)
    files = [folder / f"{found}.json", *captures(folder, found), folder / f"{found}.png"]
    try:
        # First the text, without which the lamp does not count.
        for file in files:
            if file.exists():
                os.replace(file, away / file.name)
    except OSError as error:
        raise CoreError(f"“{facts['title']}” was not deleted: {words_of(error)}.") from error
    return TrashedLamp(away, found, facts["title"])


def restore_lamp(folder: Path, trashed: TrashedLamp) -> CapturedLamp:
    """Bring a lamp back; its files in the trash stay as they are.

    Returns
    -------
    CapturedLamp
        Under its old name and title, unless others bear them by now.

    Raises
    ------
    CoreError
        If it is no longer in the trash, damaged, or cannot be written.
    """
    lamp = read_lamp(trashed.folder, trashed.name)
    title = free_title(folder, lamp.title)
    taken = lamp.name in names(folder)
    back = replace(lamp, name=free_name(folder, title) if taken else lamp.name, title=title)
    write_lamp(folder, back)
    return back


def _entry(folder: Path, name: str, facts: Facts, remarks: tuple[str, ...]) -> LampEntry:
    capture_path(folder, name, facts)
    picture = folder / f"{name}.png"
    return LampEntry(
        name,
        facts["title"],
        facts["distance_m"],
        facts["lux"],
        facts["camera"],
        picture if picture.is_file() else None,
        remarks,
    )


def _find(folder: Path, wanted: str) -> str:
    there = names(folder)
    if wanted in there:
        return wanted
    titles = titles_of(folder)
    if title_key(wanted) in titles:
        return titles[title_key(wanted)]
    known = ", ".join(there) or "none yet"
    raise CoreError(f"There is no lamp {wanted!r} in the library.", f"There are: {known}.")


def _trash_folder(folder: Path, name: str) -> Path:
    trash = folder / _TRASH
    try:
        trash.mkdir(parents=True, exist_ok=True)
        for count in range(1, 100_000):
            away = trash / (name if count == 1 else f"{name}-{count}")
            if not away.exists():
                away.mkdir()
                return away
    except OSError as error:
        raise CoreError(f"The lamp cannot be put away: {words_of(error)}.") from error
    raise CoreError("The trash of lamps is full.", f"Empty {trash}.")
