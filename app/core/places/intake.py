"""Sort dropped files into a place, a panorama, a video or photos."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from app.core.base.errors import CoreError
from app.core.environment.environment_file import is_linear
from app.core.measure.ball.mirror_ball import BallOptions
from app.core.measure.options import WayOptions
from app.core.measure.ways import MeasuringWay, way_of
from app.core.places.place_folder import PLACE
from app.core.text import tr

_HDR: Final = frozenset({".exr", ".hdr", ".pic"})
_MOST_LISTED: Final = 2000
_KINDS: Final = tr(
    "Drop an HDR panorama (.exr, .hdr), the photos of a bracket or their folder, or one 360 photo."
)


@dataclass(frozen=True, slots=True)
class Intake:
    """One item to open: a place, an environment or files to measure.

    Attributes:
        layer: Layer to read from an environment that has several layers.
        way: Key in `ways.WAYS` that determines how the files are measured.
        own: Options specific to that way of measuring.
    """

    name: str
    place: Path | None = None
    environment: Path | None = None
    layer: str = ""
    files: tuple[Path, ...] = ()
    way: str = "bracket"
    own: WayOptions | None = None

    @property
    def originals(self) -> tuple[Path, ...]:
        """Files to copy into the place's folder."""
        return self.files + (() if self.own is None else self.own.more_files)


def sort_out(paths: Sequence[Path], way: str = "camera") -> Intake:
    """Sort files by name, or a single file by its content.

    Args:
        way: How to measure photos, as in the setting `measure_with`.

    Raises:
        CoreError: If there is nothing usable or more than one item to open.
    """
    for path in paths:
        if path.is_dir() and (path / PLACE).is_file():
            return Intake(path.name, place=path)
        if path.name == PLACE and path.is_file():
            return Intake(path.parent.name, place=path.parent)
    if way == "ball" and len(paths) == 2 and all(path.is_dir() for path in paths):
        first, second = (sort_out([path], way) for path in sorted(paths))
        return replace(first, way="ball", own=BallOptions(second.files))
    files = [file for path in paths for file in _files_of(path)]
    panoramas = _panoramas(files)
    chosen = None if panoramas else way_of(files, way)
    used = panoramas if chosen is None else [file for file in files if chosen.takes(file)]
    name = _name_of(paths, used)
    if len(panoramas) > 1:
        raise CoreError(
            tr(
                "These are {number} panoramas, but a place can have only one.",
                number=len(panoramas),
            ),
            tr("Open them one at a time."),
        )
    if panoramas:
        return Intake(name, environment=panoramas[0])
    if chosen is None:
        raise CoreError(tr("Turnlight cannot read any of these files."), _KINDS)
    _check_count(len(used), chosen)
    return Intake(name, files=tuple(used), way=chosen.key)


def _check_count(number: int, way: MeasuringWay) -> None:
    if number <= way.most:
        return
    if way.most == 1:
        raise CoreError(
            tr("These are {number} films, but a place can have only one.", number=number),
            tr("Choose the one that shows the whole turn."),
        )
    raise CoreError(
        tr(
            "These are {number} photos, but a bracket has at most {most}.",
            number=number,
            most=way.most,
        ),
        tr("Drop the frames of one bracket only."),
    )


def _panoramas(files: list[Path]) -> list[Path]:
    """Return the panoramas among files, recognised by name or, for a single file, by content."""
    if len(files) == 1 and is_linear(files[0]):
        return files
    return [file for file in files if file.suffix.lower() in _HDR]


def _files_of(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    files = []
    for file in path.iterdir():
        if not file.name.startswith(".") and file.is_file():
            files.append(file)
        if len(files) >= _MOST_LISTED:
            break
    return sorted(files)


def _name_of(paths: Sequence[Path], used: Sequence[Path]) -> str:
    """Name a place after its file or folder, with spaces in place of separators."""
    name = used[0].parent.name if used else ""
    if len(paths) == 1:
        name = paths[0].name if paths[0].is_dir() else paths[0].stem
    return name.replace("_", " ").strip() or name
