"""Save, rename, correct, delete and restore the user's captured lamps.

Deleted lamps and earlier captures are kept in ``FOLDER/trash``. Every function raises `CoreError`
if no lamp has the given name, or if a file cannot be read, moved or written. In that case, the lamp
remains unchanged.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from app.core.base.atomic_files import make_folder, os_errors_as, words_of
from app.core.base.errors import CoreError
from app.core.base.paths import user_data
from app.core.second_light.captured_lamps.captured_lamp import CapturedLamp
from app.core.second_light.captured_lamps.lamp_capture import read_lamp_file
from app.core.second_light.captured_lamps.lamp_file import (
    AGAIN,
    MAX_TITLE,
    LampDamage,
    capture_named,
    capture_path,
    captures,
    checksum,
    facts_of,
    names,
    write_lamp,
    write_text,
)
from app.core.second_light.lamp_presets import KINDS
from app.core.second_light.place_brightness import with_lux
from app.core.storage.data_lock import writing
from app.core.storage.item_library import (
    DamagedItem,
    Library,
    TrashedItem,
    title_key,
    unreadable_folder,
)
from app.core.storage.json_file import Facts
from app.core.text import tr

_MOST_LAMPS: Final = 500
_HELD_M: Final = (0.05, 20.0)


@dataclass(frozen=True, slots=True)
class LampEntry:
    """A lamp in the library, without its light."""

    name: str
    title: str
    distance_m: float | None  # distance from the lamp in the capture, in metres
    lux: float | None  # illuminance at that distance, or None if the exposure is unknown
    camera: str
    picture: Path | None  # small sRGB picture
    damage: LampDamage | None = None


_LIBRARY: Final = Library(
    noun="lamp",
    error=CoreError,
    not_put_away=lambda error: CoreError(
        tr("The lamp cannot be deleted: {reason}.", reason=words_of(error))
    ),
    longest=MAX_TITLE,
    reserved=KINDS,
    names=names,
    title_of=lambda folder, name: str(facts_of(folder, name)[0]["title"]),
    # Never overwrite a picture, even if it has no lamp.
    is_taken=lambda folder, name: name in names(folder) or (folder / f"{name}.png").exists(),
)


def lamps_folder() -> Path:
    """Return the folder of the user's lamps, which may not exist yet."""
    return user_data() / "lamps"


def list_lamps(folder: Path) -> tuple[tuple[LampEntry, ...], tuple[DamagedItem, ...]]:
    """List the lamps in a folder without reading their light."""
    entries: list[LampEntry] = []
    damaged: list[DamagedItem] = []
    try:
        lamp_names = names(folder)
    except OSError as error:
        return (), (unreadable_folder(folder, error),)
    for name in lamp_names[:_MOST_LAMPS]:
        try:
            entries.append(_entry(folder, name, *facts_of(folder, name)))
        except CoreError as error:
            damaged.append(DamagedItem(folder / f"{name}.json", error))
    return tuple(sorted(entries, key=lambda each: title_key(each.title))), tuple(damaged)


def read_lamp(folder: Path, name: str) -> CapturedLamp:
    """Read a lamp by name or title.

    Raises:
        CoreError: If there is no such lamp, or if the lamp is damaged.
    """
    stem = _find(folder, name)
    facts, _ = facts_of(folder, stem)
    lamp = read_lamp_file(capture_path(folder, stem, facts)).lamp
    if facts.get("sha256", "") not in ("", checksum(lamp)):
        raise CoreError(
            tr(
                "The capture of “{title}” is damaged: its checksum does not match.",
                title=facts["title"],
            ),
            tr("Capture the lamp again."),
        )
    white = lamp.white_cd_m2 if facts["white_cd_m2"] is None else facts["white_cd_m2"]
    return replace(
        lamp,
        name=stem,
        title=facts["title"],
        white_cd_m2=white,
        distance_m=facts["distance_m"],
        camera=facts["camera"],
    )


def add_lamp(folder: Path, lamp: CapturedLamp, title: str = "") -> CapturedLamp:
    """Save a lamp under a name and title that are not yet in use.

    Raises:
        CoreError: If the lamp cannot be written, or if the title is empty or too long.
    """
    with os_errors_as(
        CoreError, tr("The lamp was not saved in {folder}: {reason}."), AGAIN, folder=folder
    ):
        make_folder(folder)
    with writing(folder):
        name, lamp_title = _LIBRARY.names_for(folder, _LIBRARY.clean_title(title or lamp.title))
        new_lamp = replace(lamp, name=name, title=lamp_title)
        write_lamp(folder, new_lamp)
    return new_lamp


def update_lamp(folder: Path, lamp: CapturedLamp) -> None:
    """Replace a lamp with a corrected version and move the old version to the trash."""
    name = _find(folder, lamp.name)
    old = read_lamp(folder, name)
    write_lamp(_LIBRARY.trash_folder(folder, name), old)
    write_lamp(folder, replace(lamp, title=_LIBRARY.clean_title(lamp.title)))
    if checksum(old) != checksum(lamp):
        with contextlib.suppress(OSError):
            capture_named(folder, name, checksum(old)).unlink()


def rename_lamp(folder: Path, name: str, title: str) -> CapturedLamp:
    """Change the title of a lamp without changing its file names.

    Raises:
        CoreError: If another lamp has the title, or if the lamp cannot be read or written.
    """
    lamp = read_lamp(folder, name)
    new_lamp = replace(lamp, title=_LIBRARY.new_title(folder, lamp.name, title))
    write_text(folder, new_lamp)
    return new_lamp


def restate_lamp(
    folder: Path, name: str, *, distance_m: float | None = None, lux: float | None = None
) -> CapturedLamp:
    """Correct the distance or the illuminance of a lamp.

    Args:
        distance_m: Distance from the probe to the lamp in the capture, in metres, or None to keep
            the old distance.
        lux: Illuminance at that distance, in lux, or None to keep the old illuminance.

    Raises:
        CoreError: If a number is out of range, or if the lamp cannot be read or written.
    """
    lamp = read_lamp(folder, name)
    if distance_m is not None:
        lamp = replace(lamp, distance_m=check_distance(distance_m))
    if lux is not None:
        lamp = with_lux(lamp, lux)
    write_text(folder, lamp)
    return lamp


def check_distance(distance_m: float) -> float:
    """Check that a lamp can be captured and used at a distance, in metres, and return the distance.

    Raises:
        CoreError: If the distance is out of range.
    """
    low, high = _HELD_M
    if not low <= distance_m <= high:
        raise CoreError(
            tr("A lamp {distance:g} m away cannot be used.", distance=distance_m),
            tr(
                "Enter the distance from the camera to the lamp, from {low:g} cm to {high:g} m.",
                low=100 * low,
                high=high,
            ),
        )
    return distance_m


def delete_lamp(folder: Path, name: str) -> TrashedItem:
    """Move a lamp to the trash."""
    stem = _find(folder, name)
    facts, _ = facts_of(folder, stem)
    files = [folder / f"{stem}.json", *captures(folder, stem), folder / f"{stem}.png"]
    there = [file for file in files if file.exists()]
    return _LIBRARY.put_away(folder, stem, facts["title"], there)


def restore_lamp(folder: Path, trashed: TrashedItem) -> CapturedLamp:
    """Restore a lamp from the trash under its old name and title, if these are still free."""
    lamp = read_lamp(trashed.folder, trashed.name)
    name, title = _LIBRARY.names_for(folder, lamp.title, lamp.name)
    back = replace(lamp, name=name, title=title)
    write_lamp(folder, back)
    return back


def _entry(folder: Path, name: str, facts: Facts, damage: LampDamage | None) -> LampEntry:
    capture_path(folder, name, facts)
    picture = folder / f"{name}.png"
    return LampEntry(
        name,
        facts["title"],
        facts["distance_m"],
        facts["lux"],
        facts["camera"],
        picture if picture.is_file() else None,
        damage,
    )


def _find(folder: Path, name: str) -> str:
    there = names(folder)
    if name in there:
        return name
    titles = _LIBRARY.titles(folder)
    if title_key(name) in titles:
        return titles[title_key(name)]
    raise CoreError(
        tr("There is no lamp {name!r} in the library.", name=name),
        tr("Available: {names}.", names=", ".join(there)) if there else tr("The library is empty."),
    )
