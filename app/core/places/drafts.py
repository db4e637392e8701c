"""Drafts: unsaved painting, kept every few seconds so that a crash costs no stroke.

One file each, ``ROOT/<key>.npz``, without pickles: arrays, and one JSON object in ``header``.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.core.archive import read_arrays
from app.core.errors import CoreError
from app.core.files import atomic_write_bytes
from app.core.places.names import words_of
from app.core.places.place import PlaceError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = [
    "Draft",
    "DraftSummary",
    "discard_draft",
    "list_drafts",
    "read_draft",
    "save_draft",
    "undo_discard",
]

_VERSION: Final = 1
_ENDING: Final = ".npz"
_DISCARDED: Final = ".discarded"
_HEADER: Final = "header"
_KEY: Final = re.compile(r"[a-z0-9][a-z0-9_-]{0,79}")
_ARRAY: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
_MOST_BYTES: Final = 1 << 27
_KINDS: Final = "biuf"


@dataclass(frozen=True, slots=True, eq=False)
class Draft:
    """Something unsaved.

    Attributes
    ----------
    facts : Mapping[str, Any]
        What JSON can hold.
    arrays : Mapping[str, NDArray]
        Numbers and truth values of any shape, by name.
    """

    facts: Mapping[str, Any]
    arrays: Mapping[str, NDArray[Any]]


@dataclass(frozen=True, slots=True)
class DraftSummary:
    """What a list shows of a draft.

    Attributes
    ----------
    key : str
        For `read_draft` and `discard_draft`.
    saved_at : datetime
        With its offset from UTC.
    path : Path
        Its file.
    """

    key: str
    saved_at: datetime
    path: Path


def save_draft(
    root: Path, key: str, facts: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]
) -> Path:
    """Keep a draft, whole or not at all; one with the same key is replaced.

    Parameters
    ----------
    root : Path
        Folder of the drafts; it is made.
    key : str
        Small letters, digits, "-" and "_", at most 80.
    facts : Mapping[str, Any]
        What JSON can hold.
    arrays : Mapping[str, NDArray]
        Numbers and truth values, by names of letters, digits and "_".

    Returns
    -------
    Path
        The file.

    Raises
    ------
    PlaceError
        When the disk refuses; the draft before it is untouched.
    ValueError
        When the key or an array is not of that kind.
    """
    path = _path(root, key)
    for name, array in arrays.items():
        if _ARRAY.fullmatch(name) is None or name == _HEADER or array.dtype.kind not in _KINDS:
            raise ValueError(f"a draft cannot hold the array {name!r}")
    header = json.dumps({"version": _VERSION, "facts": dict(facts)}, allow_nan=False).encode()
    stream = io.BytesIO()
    # Not compressed: a draft is written while somebody paints.
    entries: dict[str, Any] = {_HEADER: np.frombuffer(header, np.uint8), **arrays}
    np.savez(stream, **entries)
    try:
        if stream.tell() > _MOST_BYTES:
            raise _too_large(stream.tell())
        root.mkdir(parents=True, exist_ok=True)
        atomic_write_bytes(path, stream.getvalue())
    except OSError as error:
        raise PlaceError(
            f"The draft was not kept: {words_of(error)}.", "What you painted is still here."
        ) from error
    except PlaceError:
        raise
    except CoreError as error:
        raise PlaceError(
            f"The draft was not kept. {error.message}", "What you painted is still here."
        ) from error
    return path


def _too_large(size: int) -> PlaceError:
    return PlaceError(
        f"The draft is too large to be kept ({size >> 20} MB).", "Save it as a style."
    )


def list_drafts(root: Path) -> tuple[DraftSummary, ...]:
    """List the drafts, the newest first. They are not opened, so a damaged one is there as well.

    Parameters
    ----------
    root : Path
        Folder of the drafts; it may be missing.
    """
    found = []
    with contextlib.suppress(OSError), os.scandir(root) as entries:
        for entry in entries:
            key = entry.name.removesuffix(_ENDING)
            if key == entry.name or _KEY.fullmatch(key) is None or not entry.is_file():
                continue
            with contextlib.suppress(OSError, ValueError, OverflowError):
                saved = datetime.fromtimestamp(entry.stat().st_mtime, UTC)
                found.append(DraftSummary(key, saved.astimezone(), root / entry.name))
    return tuple(sorted(found, key=lambda each: (each.saved_at, each.key), reverse=True))


def read_draft(root: Path, key: str) -> Draft:
    """Read a draft.

    Parameters
    ----------
    root : Path
        Folder of the drafts.
    key : str
        As in `save_draft`.

    Returns
    -------
    Draft
        With the arrays to the last bit; read-only.

    Raises
    ------
    PlaceError
        When there is none, or it is damaged, too large or newer; the file stays.
    """
    path = _path(root, key)
    hint = f"The file is untouched: {path}."
    try:
        arrays = read_arrays(path, "draft", hint, _MOST_BYTES)
    except CoreError as error:
        raise PlaceError(error.message, error.hint) from error
    except OSError as error:
        raise PlaceError(f"{path.name} cannot be read: {words_of(error)}.", hint) from error
    facts = _facts(arrays.pop(_HEADER, None), path, hint)
    for array in arrays.values():
        array.flags.writeable = False
    return Draft(facts, arrays)


def _facts(raw: NDArray[Any] | None, path: Path, hint: str) -> Mapping[str, Any]:
    try:
        header = json.loads((b"" if raw is None else raw.tobytes()).decode())
        version, facts = header["version"], header["facts"]
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise PlaceError(f"{path.name} is not a draft.", hint) from error
    if not isinstance(version, int) or not isinstance(facts, dict):
        raise PlaceError(f"{path.name} is not a draft.", hint)
    if version > _VERSION:
        raise PlaceError(f"{path.name} was kept by a newer Turnlight.", "Update this one.")
    return facts


def discard_draft(root: Path, key: str) -> None:
    """Take a draft off the list. The last discarded one of a key can be brought back.

    Raises
    ------
    PlaceError
        When it cannot be moved.
    """
    path = _path(root, key)
    try:
        (root / _DISCARDED).mkdir(parents=True, exist_ok=True)
        os.replace(path, root / _DISCARDED / path.name)
    except FileNotFoundError:
        return
    except OSError as error:
        raise PlaceError(f"The draft was not discarded: {words_of(error)}.") from error


def undo_discard(root: Path, key: str) -> bool:
    """Bring the last discarded draft of a key back.

    Returns
    -------
    bool
        False when there is none, or a new draft has its key by now.
    """
    path = _path(root, key)
    aside = root / _DISCARDED / path.name
    if path.exists() or not aside.is_file():
        return False
    try:
        os.replace(aside, path)
    except OSError as error:
        raise PlaceError(f"The draft was not brought back: {words_of(error)}.") from error
    return True


def _path(root: Path, key: str) -> Path:
    if _KEY.fullmatch(key) is None:
        raise ValueError(f"{key!r} is not the key of a draft")
    return root / f"{key}{_ENDING}"
