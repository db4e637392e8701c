"""What somebody dropped or chose: a place, a panorama, a film, or photographs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.core.base.errors import CoreError
from app.core.environment.environment_file import is_linear
from app.core.measure.ball.mirror_ball import BallOptions
from app.core.measure.film.movie_header import VIDEO_ENDINGS
from app.core.measure.options import WayOptions
from app.core.measure.read.metadata import FRAME_ENDINGS
from app.core.measure.ways import WAYS
from app.core.places.store import PLACE
from app.core.text import tr

if TYPE_CHECKING:
    from app.core.measure.film.film import Film

_HDR: Final = frozenset({".exr", ".hdr", ".pic"})
_MOST_LISTED: Final = 2000
_KINDS: Final = tr(
    "Drop an HDR panorama (.exr, .hdr), the photographs of a bracket, their folder, or one "
    "photograph of all directions."
)


@dataclass(frozen=True, slots=True)
class Intake:
    """One thing to open: a place, an environment, a film, or frames.

    Attributes:
        way: How the frames are measured: a key of `ways.WAYS`.
        layer: Of an environment that has several.
        own: Options of the way itself.
        read: What the film shows, where it was read while it was taken.
    """

    name: str
    place: Path | None = None
    environment: Path | None = None
    film: Path | None = None
    frames: tuple[Path, ...] = ()
    way: str = "bracket"
    layer: str = ""
    own: WayOptions | None = None
    read: Film | None = None

    @property
    def originals(self) -> tuple[Path, ...]:
        """What is copied into the place."""
        if self.film is not None:
            return (self.film,)
        return self.frames + (self.own.more_files if self.own is not None else ())


def sort_out(paths: Sequence[Path], way: str = "camera") -> Intake:
    """Sort files by their names, a single one by its content; nothing else is read.

    Args:
        way: What photographs are taken for, as in the setting `measure_with`.

    Raises:
        CoreError: When there is nothing of use, or more than one thing.
    """
    for path in paths:
        if path.is_dir() and (path / PLACE).is_file():
            return Intake(path.name, place=path)
        if path.name == PLACE and path.is_file():
            return Intake(path.parent.name, place=path.parent)
    if way == "ball" and len(paths) == 2 and all(path.is_dir() for path in paths):
        first, second = (sort_out([path], way) for path in sorted(paths))
        return replace(first, way="ball", own=BallOptions(second.frames))
    files = [file for path in paths for file in _files_of(path)]
    panoramas = _panoramas(files)
    films = [file for file in files if file.suffix.lower() in VIDEO_ENDINGS]
    frames = [file for file in files if file.suffix.lower() in FRAME_ENDINGS]
    if films and not panoramas and (way == "film" or not frames):
        return _film_of(paths, films)
    name = _name_of(paths, panoramas or frames)
    if len(panoramas) > 1:
        raise CoreError(
            tr("These are {number} panoramas, and a place has one.", number=len(panoramas)),
            tr("Open them one by one."),
        )
    if panoramas:
        return Intake(name, environment=panoramas[0])
    if not frames:
        raise CoreError(tr("There is nothing here that Turnlight can read."), _KINDS)
    chosen = WAYS.get(way) or WAYS["single" if len(frames) == 1 else "bracket"]
    if len(frames) > chosen.most:
        raise CoreError(
            tr(
                "These are {number} photographs; a bracket has at most {most}.",
                number=len(frames),
                most=chosen.most,
            ),
            tr("Drop the frames of one bracket only."),
        )
    return Intake(name, frames=tuple(frames), way=chosen.key)


def _panoramas(files: list[Path]) -> list[Path]:
    """Those by their name; a file alone by what is in it, as a TIFF of floating point."""
    if len(files) == 1 and is_linear(files[0]):
        return files
    return [file for file in files if file.suffix.lower() in _HDR]


def _film_of(paths: Sequence[Path], films: Sequence[Path]) -> Intake:
    if len(films) > 1:
        raise CoreError(
            tr("These are {number} films, and a place has one.", number=len(films)),
            tr("Choose the one that shows the whole turn."),
        )
    return Intake(_name_of(paths, films), film=films[0])


def _files_of(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    listed = []
    for file in path.iterdir():
        if not file.name.startswith(".") and file.is_file():
            listed.append(file)
        if len(listed) >= _MOST_LISTED:
            break
    return sorted(listed)


def _name_of(paths: Sequence[Path], used: Sequence[Path]) -> str:
    """Name a place after its file or folder, with spaces where file names have none."""
    name = used[0].parent.name if used else ""
    if len(paths) == 1:
        name = paths[0].name if paths[0].is_dir() else paths[0].stem
    return name.replace("_", " ").strip() or name
