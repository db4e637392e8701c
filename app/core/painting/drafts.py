"""A canvas kept as it is, so that painting goes on after the app was closed or killed."""

from __future__ import annotations

import contextlib
import json
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.archive import CONTRADICTIONS, parse_header, read_arrays, write_arrays
from app.core.base.errors import StyleError, TransportError
from app.core.painting.canvas import MAX_SIZE, Canvas, make_canvas

if TYPE_CHECKING:
    from pathlib import Path

DRAFT_FORMAT: Final = 1
"""Version of the file's layout."""

_LAYERS: Final = ("weights", "ignore", "start_weights", "start_ignore")
_MAX_BYTES: Final = 4 * len(_LAYERS) * MAX_SIZE**2 + 65_536
_TEXTS: Final = ("title", "origin", "style", "head")
_LONGEST: Final = 400
_MOST: Final = 20
_AWAY: Final = "draft.npz"
_HINT: Final = "The draft's file is untouched; painting starts from the style itself."


@dataclass(frozen=True, slots=True, eq=False)
class Draft:
    """Unsaved painting."""

    canvas: Canvas
    title: str = ""
    origin: str = ""
    style: str = ""
    head: str = ""


def save_draft(path: Path, draft: Draft) -> None:
    """Write a draft whole or not at all; the one before is replaced.

    Raises
    ------
    CoreError
        If it cannot be written.
    """
    header = {"format": DRAFT_FORMAT, **{key: getattr(draft, key)[:_LONGEST] for key in _TEXTS}}
    arrays = {name: getattr(draft.canvas, name) for name in _LAYERS}
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    write_arrays(path, arrays)


def load_draft(path: Path) -> Draft:
    """Read a draft.

    Raises
    ------
    StyleError
        If it is missing, damaged, too large, or made by a newer version.
    """
    try:
        arrays = read_arrays(path, "draft", _HINT, _MAX_BYTES)
    except (TransportError, OSError) as error:
        words = error.message if isinstance(error, TransportError) else f"{path.name}: {error}."
        raise StyleError(words, _HINT) from error
    try:
        header = parse_header(arrays["header"])
        version = int(header["format"])
        texts = {key: str(header[key])[:_LONGEST] for key in _TEXTS}
        layers = [np.asarray(arrays[name]) for name in _LAYERS]
    except CONTRADICTIONS as error:
        raise StyleError(f"{path.name} is damaged or not a draft.", _HINT) from error
    if version > DRAFT_FORMAT:
        raise StyleError(
            f"{path.name} was made by a newer Turnlight (format {version}).", "Update Turnlight."
        )
    if version < DRAFT_FORMAT or any(layer.dtype != np.float32 for layer in layers):
        raise StyleError(f"{path.name} is damaged or not a draft.", _HINT)
    return Draft(make_canvas(*layers), **texts)


def find_draft(folder: Path, key: str) -> tuple[Path, Draft | None, tuple[str, ...]]:
    """Look for the draft that was begun from a style.

    A file that cannot be read is left as it is; the next free name is taken beside it.

    Returns
    -------
    path : Path
        Where the draft is to be kept from now on.
    notes : tuple of str
        What was wrong with files that are left as they are.
    """
    notes: list[str] = []
    stem = f"paint-{key}" if key else "paint"
    for number in range(1, _MOST + 1):
        path = folder / (f"{stem}.npz" if number == 1 else f"{stem}.{number}.npz")
        if not path.exists():
            return path, None, tuple(notes)
        try:
            return path, load_draft(path), tuple(notes)
        except StyleError as error:
            notes.append(str(error))
    return folder / f"{stem}.{_MOST + 1}.npz", None, tuple(notes)


def put_draft_away(folder: Path, key: str, trash: Path) -> None:
    """Move the draft of a deleted style to it: a new one of that name is not to begin with it."""
    path, draft, _ = find_draft(folder, key)
    if draft is not None:
        # Where it cannot be moved it stays where the style will look for it.
        with contextlib.suppress(OSError):
            os.replace(path, trash / _AWAY)


def bring_draft_back(folder: Path, key: str, trash: Path) -> None:
    """Bring the draft of a restored style back, under the name that the style has now."""
    path, other, _ = find_draft(folder, key)
    if other is None and (trash / _AWAY).exists():
        folder.mkdir(parents=True, exist_ok=True)
        os.replace(trash / _AWAY, path)
