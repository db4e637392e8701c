"""Reading ``.npz`` files that may be anything: bounded, without pickles, errors in sentences."""

from __future__ import annotations

import hashlib
import io
import zipfile
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.core.errors import TransportError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["digest", "read_arrays"]

MAX_BYTES: Final = 1 << 28


def read_arrays(path: Path, noun: str, hint: str, most: int = MAX_BYTES) -> dict[str, NDArray[Any]]:
    """Read all arrays of a file.

    Parameters
    ----------
    path : Path
        The file.
    noun : str
        What it should be, for messages.
    hint : str
        What to do when it is not.
    most : int, optional
        Largest size, packed and unpacked, bytes.

    Returns
    -------
    dict
        Arrays by name.

    Raises
    ------
    TransportError
        If the file is missing, too large, damaged, or not such a file.
    """
    if not path.is_file():
        raise TransportError(f"There is no {noun} at {path}.", hint)
    try:
        fits = path.stat().st_size <= most
        raw = path.read_bytes() if fits else b""
        if fits:
            with zipfile.ZipFile(io.BytesIO(raw)) as archive:
                # Before anything is unpacked: a small file can claim to unpack to a huge one.
                fits = sum(entry.file_size for entry in archive.infolist()) <= most
        if fits:
            with np.load(io.BytesIO(raw), allow_pickle=False) as stored:
                return {name: stored[name] for name in stored.files}
    # A damaged zip fails in many ways: bad sizes, bad flags, methods that nobody knows.
    except Exception as error:
        raise TransportError(f"{path.name} is damaged or not a {noun}.", hint) from error
    raise TransportError(f"{path.name} is too large to be a {noun}.", hint)


def digest(arrays: Mapping[str, NDArray[Any]]) -> str:
    """Return the SHA-256 of arrays: names, types, shapes and values."""
    total = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        total.update(f"{name}{array.dtype.str}{array.shape}".encode())
        total.update(array.data)
    return total.hexdigest()
