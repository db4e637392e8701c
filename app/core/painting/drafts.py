"""A canvas kept as it is, so that painting goes on after the app was closed or killed."""

from __future__ import annotations

import json
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
