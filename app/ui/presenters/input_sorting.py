"""Sorting out what was dropped or chosen: a place, a panorama, or the frames of a bracket."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from app.core.base.errors import CoreError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

_HDR: Final = frozenset({".exr", ".hdr", ".pic"})
FRAMES: Final = frozenset({".jpg", ".jpeg", ".insp", ".png", ".tif", ".tiff", ".dng"})
"""Endings of photographs that may be frames of a bracket."""
_PLACE_FILE: Final = "place.json"
_MOST_LISTED: Final = 2000
_MOST_FRAMES: Final = 64
_KINDS: Final = "Drop an HDR panorama (.exr, .hdr), the photographs of a bracket, or their folder."


@dataclass(frozen=True, slots=True)
class Intake:
    """What there is to be opened; exactly one of the three."""

    name: str
    place: Path | None = None
    environment: Path | None = None
    frames: tuple[Path, ...] = ()


def sort_out(paths: Sequence[Path]) -> Intake:
    """Look at names only; what is in the files is looked at by whoever reads them.

    Raises
    ------
    CoreError
        When there is nothing of use, or more than one thing.
    """
    for path in paths:
        if path.is_dir() and (path / _PLACE_FILE).is_file():
            return Intake(path.name, place=path)
        if path.name == _PLACE_FILE and path.is_file():
            return Intake(path.parent.name, place=path.parent)
    files = [file for path in paths for file in _files_of(path)]
    panoramas = [file for file in files if file.suffix.lower() in _HDR]
    frames = [file for file in files if file.suffix.lower() in FRAMES]
    name = _name_of(paths, panoramas or frames)
    if len(panoramas) > 1:
        raise CoreError(
            f"These are {len(panoramas)} panoramas, and a place has one.", "Open them one by one."
        )
    if panoramas:
        return Intake(name, environment=panoramas[0])
    if not frames:
        raise CoreError("There is nothing here that Turnlight can read.", _KINDS)
    if len(frames) > _MOST_FRAMES:
        raise CoreError(
            f"These are {len(frames)} photographs; a bracket has at most {_MOST_FRAMES}.",
            "Drop the frames of one bracket only.",
        )
    return Intake(name, frames=tuple(frames))


def _files_of(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    found = []
    for file in path.iterdir():
        if not file.name.startswith(".") and file.is_file():
            found.append(file)
        if len(found) >= _MOST_LISTED:
            break
    return sorted(found)


def _name_of(paths: Sequence[Path], used: Sequence[Path]) -> str:
    """Name a place after its file or folder, with spaces where file names have none."""
    name = used[0].parent.name if used else ""
    if len(paths) == 1:
        name = paths[0].name if paths[0].is_dir() else paths[0].stem
    return name.replace("_", " ").strip() or name
