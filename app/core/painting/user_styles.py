"""The user's styles: save, rename, copy, delete and restore.

Nothing is overwritten or lost: names are always new, changed and deleted styles are moved to the
subfolder ``trash``, and an unreadable file is left unchanged.

A style is exported as one file, a zip archive with exactly two members. An imported file is read
within size limits, validated like any style and saved under a new name. No name or path in the
archive is used.

Every function raises `StyleError` if a file cannot be read, moved or written. In that case, the
previous state remains valid and no half-written files are left.
"""

from __future__ import annotations

import contextlib
import io
import tempfile
import zipfile
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Final

from app.core.base.atomic_files import atomic_write_bytes, make_folder, open_file, os_errors_as
from app.core.base.errors import CoreError, StyleError
from app.core.painting.canvas import Canvas
from app.core.painting.user_style import (
    MAX_BYTES,
    MAX_TITLE,
    UserStyle,
    checksum,
    clean_text,
    layers_path,
    not_saved,
    read_user_style,
    style_text,
    text_path,
    write_layers,
    write_user_style,
)
from app.core.storage.data_lock import writing
from app.core.storage.item_library import (
    DamagedItem,
    Library,
    TrashedItem,
    files_in,
    unreadable_folder,
)
from app.core.styles.painted_style_file import is_painted, read_painted
from app.core.styles.style import Side
from app.core.styles.style_file import read_style
from app.core.styles.styles import NAMES
from app.core.text import tr

EXPORT_ENDING: Final = ".turnstyle"
"""Suffix of the files to which styles are exported."""

_TEXT: Final = "style.toml"
_LAYERS: Final = "weights.exr"
_MOST: Final = {_TEXT: 64_000, _LAYERS: MAX_BYTES}
_METHODS: Final = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_LONGEST: Final = sum(_MOST.values()) + 4096
_ENCRYPTED: Final = 0x1
_NAME: Final = "style"  # so that errors name the member


def export_style(style: UserStyle, file: Path, *, replace: bool = False) -> None:
    """Export a style to a file.

    Raises:
        CoreError: If the file cannot be written, or if it exists and must not be replaced.
    """
    if not replace and file.exists():
        raise StyleError(
            tr("A file named {name} already exists.", name=file.name), tr("Choose another name.")
        )
    with tempfile.TemporaryDirectory() as folder:
        layers = Path(folder) / _LAYERS
        try:
            write_layers(layers, style.weights, style.ignore)
        except CoreError as error:
            raise StyleError(
                tr(
                    "{name} was not exported: {folder} is not writable.",
                    name=file.name,
                    folder=tempfile.gettempdir(),
                ),
                tr("Choose another folder, or make this one writable."),
            ) from error
        parts = {_TEXT: style_text(style).encode(), _LAYERS: layers.read_bytes()}
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, data in parts.items():
            # A fixed date, so that the same style gives the same file.
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data)
    atomic_write_bytes(file, buffer.getvalue())


def import_style(folder: Path, file: Path) -> UserStyle:
    """Import an exported style.

    The style gets a new name, and a new title if the old one is taken. A failed import leaves no
    valid style behind.

    Raises:
        StyleError: If the file is not a complete style, has a newer format or is too large, or if
            the imported style cannot be written.
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
            raise StyleError(
                tr(
                    "{name} is not a readable style. {sentence}",
                    name=file.name,
                    sentence=error.message,
                ),
                error.hint,
            ) from error
    return add(folder, style)


def _members(file: Path) -> dict[str, bytes]:
    """Read the two members of an untrusted archive."""
    with os_errors_as(StyleError, tr("{name} cannot be read: {reason}."), name=file.name):
        if not file.is_file():
            raise StyleError(tr("There is no file {file}.", file=file), tr("Check the name."))
        with open_file(file) as stream:
            raw = stream.read(_LONGEST + 1)
    if len(raw) > _LONGEST:
        raise StyleError(tr("{name} is too large for a style.", name=file.name))
    try:
        return _unpacked(raw)
    except CoreError:
        raise
    # A damaged zip fails in many ways: bad sizes, bad flags, unknown methods.
    except Exception as error:
        raise StyleError(
            tr("{name} is damaged or not an exported style.", name=file.name),
            tr("Export the style again."),
        ) from error


def _unpacked(raw: bytes) -> dict[str, bytes]:
    parts = {}
    with zipfile.ZipFile(io.BytesIO(raw)) as archive:
        entries = archive.infolist()
        if sorted(entry.filename for entry in entries) != sorted(_MOST):
            raise ValueError("unexpected parts")
        for entry in entries:
            most = _MOST[entry.filename]
            plain = entry.compress_type in _METHODS and not entry.flag_bits & _ENCRYPTED
            # Check before unpacking, since a small file can claim to unpack to a huge file.
            if not plain or entry.file_size > most:
                raise ValueError("an unexpected part")
            with archive.open(entry) as member:
                data = member.read(most + 1)
            if len(data) != entry.file_size:
                raise ValueError("a part of the wrong size")
            parts[entry.filename] = data
    return parts


_MAX_STYLES: Final = 100  # their weights are kept in memory, 1.3 MB each

_LIBRARY: Final = Library(
    noun="style",
    error=StyleError,
    not_put_away=not_saved,
    longest=MAX_TITLE,
    reserved=NAMES,
    names=lambda folder: [file.stem for file in folder.glob("*.toml")],
    title_of=lambda folder, name: read_painted(text_path(folder, name)).title,
    is_taken=lambda folder, name: text_path(folder, name).exists(),
)


def list_user_styles(folder: Path) -> tuple[tuple[UserStyle, ...], tuple[DamagedItem, ...]]:
    """Read the painted styles in a folder.

    Returns:
        The styles and the unreadable files. Unreadable files are left unchanged.
    """
    styles: list[UserStyle] = []
    damaged: list[DamagedItem] = []
    try:
        files = files_in(folder, ".toml")
    except OSError as error:
        return (), (unreadable_folder(folder, error),)
    for file in files:
        if file.name.startswith(".") or _has_lamps(file):
            continue
        if len(styles) >= _MAX_STYLES:
            refusal = StyleError(
                tr("There are more than {most} styles. This one is not shown.", most=_MAX_STYLES)
            )
            damaged.append(DamagedItem(file, refusal))
            continue
        try:
            styles.append(read_user_style(file))
        except StyleError as error:
            damaged.append(DamagedItem(file, error))
    return tuple(styles), tuple(damaged)


def save_user_style(
    folder: Path,
    canvas: Canvas,
    title: str,
    *,
    side: Side = "none",
    place: str = "",
    note: str = "",
    head: str = "",
    origin: str = "",
) -> UserStyle:
    """Save a canvas as a new style."""
    draft = UserStyle(
        "",
        _LIBRARY.clean_title(title),
        side,
        clean_text(place, "place"),
        clean_text(note, "note"),
        clean_text(head, "head"),
        clean_text(origin, "origin"),
        canvas.weights,
        canvas.ignore,
        untouched=not canvas.touched,
    )
    return add(folder, draft)


def add(folder: Path, style: UserStyle) -> UserStyle:
    """Save a style under a free name and title.

    Raises:
        StyleError: If the style cannot be written.
    """
    with _alone_in(folder):
        name, title = _LIBRARY.names_for(folder, style.title)
        new_style = replace(style, name=name, title=title)
        write_user_style(folder, new_style)
    return new_style


def _alone_in(folder: Path) -> AbstractContextManager[bool]:
    """Keep other processes from writing styles, since two processes could choose the same name."""
    try:
        make_folder(folder)
    except OSError as error:
        raise not_saved(error) from error
    return writing(folder)


def update_user_style(
    folder: Path,
    style: UserStyle,
    canvas: Canvas,
    conflict: Callable[[UserStyle], None] = lambda other: None,
    *,
    untouched: bool = False,
) -> UserStyle:
    """Replace the weights of a style and move the old weights to the trash.

    Args:
        style: The style as this process last read or wrote it. If another process has changed the
            style since, the changed version becomes a separate style.
        conflict: Function called with that separate style.
        untouched: Whether the canvas equals the built-in style `origin` again.
    """
    new_style = replace(style, weights=canvas.weights, ignore=canvas.ignore, untouched=untouched)
    if checksum(new_style) == checksum(style):
        return style
    with _alone_in(folder):
        other = _other_version(folder, style, new_style)
        if other is not None:
            conflict(add(folder, other))
        return _replaced(folder, style, new_style)


def _other_version(folder: Path, style: UserStyle, new_style: UserStyle) -> UserStyle | None:
    """Return a version saved by another process as a new style, or None if there is none."""
    try:
        other = read_user_style(text_path(folder, style.name))
    except (StyleError, OSError):
        return None  # deleted or damaged: its weights stay where they are
    same = checksum(other) in (checksum(style), checksum(new_style)) and other.title == style.title
    return None if same else other


def _replaced(folder: Path, style: UserStyle, new_style: UserStyle) -> UserStyle:
    write_user_style(_LIBRARY.trash_folder(folder, style.name), style)
    write_user_style(folder, new_style)
    # No text file names these weights any more, and the trash has a copy.
    with contextlib.suppress(OSError):
        layers_path(folder, style.name, checksum(style)).unlink()
    return new_style


def rename(folder: Path, style: UserStyle, title: str) -> UserStyle:
    """Rename a style without changing its file name."""
    new_style = replace(style, title=_LIBRARY.new_title(folder, style.name, title))
    write_user_style(folder, new_style)
    return new_style


def duplicate(folder: Path, style: UserStyle, title: str = "") -> UserStyle:
    """Copy a style, by default under the title "… 2", with the same errors as `add`."""
    return add(folder, replace(style, title=_LIBRARY.clean_title(title or style.title)))


def delete(folder: Path, style: UserStyle) -> TrashedItem:
    """Move a style to the trash."""
    text, layers = text_path(folder, style.name), layers_path(folder, style.name, checksum(style))
    files = [text, layers] if layers.exists() else [text]
    return _LIBRARY.put_away(folder, style.name, style.title, files)


def restore(folder: Path, trashed: TrashedItem) -> UserStyle:
    """Restore a style from the trash.

    The style keeps its old name and title unless they have been taken.
    """
    style = read_user_style(text_path(trashed.folder, trashed.name))
    name, title = _LIBRARY.names_for(folder, style.title, style.name)
    back = replace(style, name=name, title=title)
    write_user_style(folder, back)
    return back


def _has_lamps(file: Path) -> bool:
    if is_painted(file):
        return False
    try:
        read_style(file)
    except StyleError:
        return False
    return True
