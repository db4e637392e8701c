"""One file to hand a painted style to a friend, and taking such a file in.

It is a zip archive with exactly two members. What comes from outside is read within bounds,
checked like any style, and written anew under a name of this program's choosing; no name or path
inside the archive is used.
"""

from __future__ import annotations

import io
import tempfile
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.core.base.errors import CoreError, StyleError
from app.core.base.files import atomic_write_bytes, open_file
from app.core.painting.layers_file import MAX_BYTES, write_layers
from app.core.painting.library import add
from app.core.painting.user_style import (
    layers_path,
    read_user_style,
    style_text,
    text_path,
)
from app.core.solver.style_file import read_painted

if TYPE_CHECKING:
    from app.core.painting.user_style import UserStyle

EXPORT_ENDING: Final = ".turnstyle"
"""Ending of the file."""

_TEXT: Final = "style.toml"
_LAYERS: Final = "weights.exr"
_MOST: Final = {_TEXT: 64_000, _LAYERS: MAX_BYTES}
_METHODS: Final = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_LONGEST: Final = sum(_MOST.values()) + 4096
_ENCRYPTED: Final = 0x1
_NAME: Final = "received"


def export_style(style: UserStyle, file: Path, *, replace: bool = False) -> None:
    """Write a style to one file.

    Raises
    ------
    CoreError
        If it cannot be written, or a file is there that must not be replaced.
    """
    if not replace and file.exists():
        raise StyleError(f"There is already a file {file.name}.", "Choose another name.")
    with tempfile.TemporaryDirectory() as folder:
        layers = Path(folder) / _LAYERS
        try:
            write_layers(layers, style.weights, style.ignore)
        except CoreError as error:
            raise StyleError(
                f"{file.name} was not exported: {tempfile.gettempdir()} takes no files.",
                "Make room there.",
            ) from error
        parts = {_TEXT: style_text(style).encode(), _LAYERS: layers.read_bytes()}
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_STORED) as archive:
        for name, data in parts.items():
            # A fixed date: the same style gives the same file.
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data)
    atomic_write_bytes(file, packed.getvalue())


def import_style(folder: Path, file: Path) -> UserStyle:
    """Take in a style that somebody exported.

    Returns
    -------
    UserStyle
        As it was written, under a new name, and a new title where the old one is taken.

    Raises
    ------
    StyleError
        If the file is not a whole style, of a newer form, or too large, or the style cannot
        be written. Then nothing is left behind that counts.
    """
    parts = _members(file)
    with tempfile.TemporaryDirectory() as place:
        text = text_path(Path(place), _NAME)
        text.write_bytes(parts[_TEXT])
        try:
            values = read_painted(text)
            layers_path(Path(place), _NAME, values.sha256).write_bytes(parts[_LAYERS])
            style = read_user_style(text)
        except StyleError as error:
            said = error.message.replace(text.name, "It")
            raise StyleError(
                f"{file.name} is not a style that can be read. {_sentence(said)}", error.hint
            ) from error
    return add(folder, style)


def _sentence(words: str) -> str:
    return words if words.endswith(".") else f"{words}."


def _members(file: Path) -> dict[str, bytes]:
    """Read the two members of an archive that may be anything."""
    try:
        if not file.is_file():
            raise StyleError(f"There is no file {file}.", "Check the name.")
        with open_file(file) as stream:
            raw = stream.read(_LONGEST + 1)
    except (OSError, ValueError) as error:
        words = (getattr(error, "strerror", None) or str(error)).lower()
        raise StyleError(f"{file.name} cannot be read: {words}.") from error
    if len(raw) > _LONGEST:
        raise StyleError(f"{file.name} is too large to be a style.")
    try:
        return _unpacked(raw)
    except CoreError:
        raise
    # A damaged zip fails in many ways: bad sizes, bad flags, methods that nobody knows.
    except Exception as error:
        raise StyleError(
            f"{file.name} is damaged or not an exported style.", "Ask for it again."
        ) from error


def _unpacked(raw: bytes) -> dict[str, bytes]:
    parts = {}
    with zipfile.ZipFile(io.BytesIO(raw)) as archive:
        entries = archive.infolist()
        if sorted(entry.filename for entry in entries) != sorted(_MOST):
            raise ValueError("other members than a style has")
        for entry in entries:
            most = _MOST[entry.filename]
            plain = entry.compress_type in _METHODS and not entry.flag_bits & _ENCRYPTED
            # Before anything is unpacked: a small file can claim to unpack to a huge one.
            if not plain or entry.file_size > most:
                raise ValueError("a member that is no part of a style")
            with archive.open(entry) as member:
                data = member.read(most + 1)
            if len(data) != entry.file_size:
                raise ValueError("a member of another size than stated")
            parts[entry.filename] = data
    return parts
