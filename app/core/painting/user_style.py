"""A style that somebody painted, and its two files: a TOML text, and its weights as OpenEXR.

The weights' file bears the first digits of their checksum in its name, so that a change is
written beside what was there and counts only when the text that names it is in place.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.archive import digest
from app.core.base.errors import CoreError, StyleError
from app.core.base.files import atomic_write_text
from app.core.painting.layers_file import read_layers, write_layers
from app.core.solver.style_file import PAINTED_FORMAT, read_painted
from app.core.solver.styles import Side, Style

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

Float32: TypeAlias = NDArray[np.float32]

MAX_TITLE: Final = 80
"""Longest title, characters."""

_LENGTHS: Final = {"title": MAX_TITLE, "place": 40, "note": 400, "head": 80, "origin": 80}


@dataclass(frozen=True, slots=True, eq=False)
class UserStyle:
    """A painted style.

    Attributes
    ----------
    weights, ignore : (S, S) float32
        Canvas layers, see `app.core.painting.canvas.Canvas`. Not to be written to.
    """

    name: str
    title: str
    side: Side
    place: str
    note: str
    head: str
    origin: str
    weights: Float32 = field(repr=False)
    ignore: Float32 = field(repr=False)

    @property
    def style(self) -> Style:
        """The same without its weights, for what shows styles of either kind; it has no lamps."""
        return Style(self.name, self.title, self.side, self.place, self.note, lamps=())

    @property
    def side_words(self) -> str:
        """The side named twice, or the place in words."""
        return self.style.side_words

    @property
    def full_title(self) -> str:
        """Title that tells left from right on its own."""
        return self.style.full_title


def clean_text(text: str, key: str) -> str:
    """Make a text fit for one line on screen and in a file.

    Raises
    ------
    StyleError
        If it is too long, or an empty title.
    """
    visible = "".join(letter if letter.isprintable() else " " for letter in text)
    value = " ".join(visible.split())
    if key == "title" and not value:
        raise StyleError("The style needs a name.", "Type one.")
    if len(value) > _LENGTHS[key]:
        what = "name" if key == "title" else key
        raise StyleError(f"This {what} is longer than {_LENGTHS[key]} characters.", "Shorten it.")
    return value


def checksum(style: UserStyle) -> str:
    """SHA-256 of a style's weights."""
    return digest({"weights": style.weights, "ignore": style.ignore})


def text_path(folder: Path, name: str) -> Path:
    """Where the text of a style lies."""
    return folder / f"{name}.toml"


def layers_path(folder: Path, name: str, sha256: str) -> Path:
    """Where the weights of a style lie."""
    return folder / f"{name}-{sha256[:12]}.exr"


def style_text(style: UserStyle) -> str:
    """Write down a style as TOML, without its weights."""
    head = {"title": style.title, "side": style.side, "place": style.place, "note": style.note}
    painted = {
        "format": PAINTED_FORMAT,
        "from": style.origin,
        "head": style.head,
        "size": len(style.weights),
        "sha256": checksum(style),
    }
    return f"{_lines(head)}\n[painted]\n{_lines(painted)}"


def write_user_style(folder: Path, style: UserStyle) -> None:
    """Write a style's two files; the text comes last and makes it count.

    Raises
    ------
    StyleError
        If it cannot be written. Then what was there is as it was.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        target = layers_path(folder, style.name, checksum(style))
        write_layers(target, style.weights, style.ignore)
        atomic_write_text(text_path(folder, style.name), style_text(style))
    except (OSError, CoreError) as error:
        raise not_saved(error) from error


def not_saved(error: OSError | CoreError) -> StyleError:
    """Say why something was not saved."""
    words = str(error).lower()
    if "no space" in words or "disk is full" in words or "quota" in words:
        return StyleError(
            "Not saved: the disk is full.", "Your strokes are kept: make room, then save again."
        )
    said = error.message if isinstance(error, CoreError) else f"{error.strerror or error}".lower()
    if "read-only" in words or "not writable" in words or "permission denied" in words:
        return StyleError(
            "Not saved: the folder of your styles cannot be written to.",
            "Your strokes are kept: allow writing there, then save again.",
        )
    said = f"{said[:1].upper()}{said[1:].rstrip('.')}"
    return StyleError(f"Not saved. {said}.", "Your strokes are kept.")


def read_user_style(path: Path) -> UserStyle:
    """Read a painted style.

    Raises
    ------
    StyleError
        If the text or the weights cannot be read, or do not belong together.
    """
    values = read_painted(path)
    weights, ignore = read_layers(layers_path(path.parent, values.name, values.sha256))
    style = UserStyle(
        values.name,
        values.title,
        values.side,
        values.place,
        values.note,
        values.head,
        values.origin,
        weights,
        ignore,
    )
    if checksum(style) != values.sha256 or len(weights) != values.size:
        raise StyleError(f"The weights of {path.name} are damaged: their checksum does not fit.")
    return style


def _lines(values: Mapping[str, object]) -> str:
    # A JSON text in quotes is a TOML text in quotes: the same escapes, and UTF-8 as it is.
    return "".join(f"{key} = {json.dumps(v, ensure_ascii=False)}\n" for key, v in values.items())
