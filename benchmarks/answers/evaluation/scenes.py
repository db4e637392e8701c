"""The environments of the evaluation: any folder of panoramas."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.core.base.errors import EnvironmentFileError
from app.core.base.paths import resources
from app.core.base.progress import PhraseReport, Token, silent
from app.core.environment.environment import read_environment, reduce
from app.words.remarks import sentences

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.colour import FloatImage

LARGEST: Final = (64, 128)
"""Rows and columns of the largest evaluated environment."""

_FINE: Final = (256, 512)
_ENDINGS: Final = (".exr", ".hdr")
_MOST: Final = 200
_SHARED: Final = ("shared", "data", "hdri")


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """One environment in the sizes of the evaluation.

    Attributes:
        light: (64, 128, 3) float32. Linear Rec. 709 radiance at turn 0.
        fine: (256, 512, 3) float32. The same, fine enough for turns by any angle.
    """

    name: str
    light: FloatImage = field(repr=False)
    fine: FloatImage = field(repr=False)


def default_scenes(root: Path | None = None) -> Path:
    """Return the default folder.

    Returns:
        ``shared/data/hdri`` beside the checkout (or in TURNLIGHT_SHARED), otherwise the scenes that
        ship with the app.
    """
    named = os.environ.get("TURNLIGHT_SHARED")
    base = Path(__file__).resolve().parents[3] if root is None else root
    beside = base.parent.joinpath(*_SHARED)
    folder = Path(named) / _SHARED[-1] if named else beside
    return folder if folder.is_dir() else resources() / "demo" / "scenes"


def find_scenes(folder: Path) -> tuple[Path, ...]:
    """List the panoramas of a folder, by name.

    Raises:
        EnvironmentFileError: If there is no such folder, or it has no panoramas, or too many.
    """
    if not folder.is_dir():
        raise EnvironmentFileError(f"There is no folder {folder}.", "Name one with --scenes.")
    files = sorted(
        file
        for file in folder.iterdir()
        if file.suffix.lower() in _ENDINGS and file.is_file() and not file.name.startswith(".")
    )
    if not files:
        raise EnvironmentFileError(
            f"There is no panorama in {folder}.", "Put OpenEXR or Radiance files there."
        )
    if len(files) > _MOST:
        raise EnvironmentFileError(
            f"There are {len(files)} panoramas in {folder}; at most {_MOST} can be evaluated."
        )
    return tuple(files)


def read_scenes(
    files: Sequence[Path], report: PhraseReport = silent, token: Token | None = None
) -> tuple[tuple[Scene, ...], tuple[str, ...]]:
    """Read and reduce panoramas.

    Raises:
        EnvironmentFileError: If none can be read.
        Cancelled: If the token was cancelled.
    """
    scenes: list[Scene] = []
    said: list[str] = []
    for number, file in enumerate(files):
        if token is not None:
            token.check()
        report(number / len(files), f"Reading {file.name}")
        try:
            environment = read_environment(file)
        except EnvironmentFileError as error:
            said.append(f"Left out: {error.message}")
            continue
        said += sentences(environment.warnings)
        name = file.stem.removesuffix("_1k").removesuffix("_2k").replace("_", " ")
        scenes.append(Scene(name, reduce(environment, LARGEST), reduce(environment, _FINE)))
    if not scenes:
        raise EnvironmentFileError(f"None of {len(files)} panoramas can be read. {said[0]}")
    return tuple(scenes), tuple(said)
