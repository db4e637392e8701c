"""Drafts, which are unfinished paintings kept as files in the data folder."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from app.core.base.archive import CONTRADICTIONS, parse_header, read_arrays, write_arrays
from app.core.base.atomic_files import make_folder, open_file
from app.core.base.errors import StyleError, TransportError
from app.core.painting.canvas import MAX_SIZE, Canvas, make_canvas
from app.core.text import tr

DRAFT_FORMAT: Final = 1
"""Version of the file format of drafts."""
_LAYERS: Final = ("weights", "ignore", "start_weights", "start_ignore")
_MAX_BYTES: Final = 4 * len(_LAYERS) * MAX_SIZE**2 + 65_536
_TEXTS: Final = ("title", "origin", "style", "head")
_LONGEST: Final = 400
_HINT: Final = tr("The draft file is unchanged. Painting starts from the style itself.")
_MOST_DRAFTS: Final = 20
_AWAY: Final = "draft.npz"


@dataclass(frozen=True, slots=True, eq=False)
class Draft:
    """A painting that has not been saved as a style."""

    canvas: Canvas
    title: str = ""
    origin: str = ""
    style: str = ""
    head: str = ""


def draft_version(path: Path) -> str:
    """Return the checksum of a draft on disk, or "" if there is none."""
    with contextlib.suppress(OSError), open_file(path) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
    return ""


def put_draft_aside(path: Path) -> Path:
    """Rename a draft that belongs to another process and return the new path."""
    for number in range(2, _MOST_DRAFTS + 1):
        aside = path.with_name(f"{path.name.partition('.')[0]}.{number}.npz")
        if not os.path.lexists(aside):
            path.rename(aside)
            return aside
    raise StyleError(tr("There are too many drafts in {folder}.", folder=path.parent))


def save_draft(path: Path, draft: Draft) -> None:
    """Save a draft atomically."""
    header = {"format": DRAFT_FORMAT, **{key: getattr(draft, key)[:_LONGEST] for key in _TEXTS}}
    arrays = {name: getattr(draft.canvas, name) for name in _LAYERS}
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    write_arrays(path, arrays)


def load_draft(path: Path) -> Draft:
    """Read a draft.

    Raises:
        StyleError: If the file is missing or damaged.
    """
    try:
        arrays = read_arrays(path, tr("draft"), _HINT, _MAX_BYTES)
    except (TransportError, OSError) as error:
        words = error.message if isinstance(error, TransportError) else f"{path.name}: {error}."
        raise StyleError(words, _HINT) from error
    try:
        header = parse_header(arrays["header"])
        version = int(header["format"])
        texts = {key: str(header[key])[:_LONGEST] for key in _TEXTS}
        layers = [np.asarray(arrays[name]) for name in _LAYERS]
    except CONTRADICTIONS as error:
        raise StyleError(tr("{name} is damaged or not a draft.", name=path.name), _HINT) from error
    if version > DRAFT_FORMAT:
        raise StyleError(
            tr(
                "{name} was made by a newer version of Turnlight (format {version}).",
                name=path.name,
                version=version,
            ),
            tr("Update Turnlight."),
        )
    if version < DRAFT_FORMAT or any(layer.dtype != np.float32 for layer in layers):
        raise StyleError(tr("{name} is damaged or not a draft.", name=path.name), _HINT)
    return Draft(make_canvas(*layers), **texts)


def find_draft(folder: Path, key: str) -> tuple[Path, Draft | None, tuple[str, ...]]:
    """Find the draft of a style.

    An unreadable file is left unchanged, and the next free name in the same folder is used.

    Returns:
        path: Path to which the draft will be saved from now on.
        draft: The draft, or None if the style has none.
        notes: Messages about unreadable files.
    """
    notes: list[str] = []
    stem = f"paint-{key}" if key else "paint"
    for number in range(1, _MOST_DRAFTS + 1):
        path = folder / (f"{stem}.npz" if number == 1 else f"{stem}.{number}.npz")
        if not path.exists():
            return path, None, tuple(notes)
        try:
            return path, load_draft(path), tuple(notes)
        except StyleError as error:
            notes.append(str(error))
    return folder / f"{stem}.{_MOST_DRAFTS + 1}.npz", None, tuple(notes)


def put_draft_away(folder: Path, key: str, trash: Path) -> None:
    """Move a deleted style's draft to the trash, so that a new style of that name has no draft."""
    path, draft, _ = find_draft(folder, key)
    if draft is not None:
        # A draft that cannot be moved stays where the style will look for it.
        with contextlib.suppress(OSError):
            os.replace(path, trash / _AWAY)


def bring_draft_back(folder: Path, key: str, trash: Path) -> None:
    """Move the draft of a restored style back, under the style's current name."""
    path, other, _ = find_draft(folder, key)
    if other is None and (trash / _AWAY).exists():
        make_folder(folder)
        os.replace(trash / _AWAY, path)
