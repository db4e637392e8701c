"""Read and write ``.npz`` files, without pickles and with errors that users understand.

A *sealed* file also holds a JSON header with a version and the checksum of the arrays.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import zipfile
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.atomic_files import atomic_write_bytes, open_file, os_errors_as
from app.core.base.errors import TransportError
from app.core.text import tr

CONTRADICTIONS: Final = (
    AttributeError,
    IndexError,
    KeyError,
    OverflowError,
    RecursionError,
    TypeError,
    ValueError,
)
"""Exceptions that an untrusted header may cause, since JSON can nest deeply and hold any types."""

MAX_BYTES: Final = 1 << 28
Store: TypeAlias = "Callable[[dict[str, NDArray[Any]]], dict[str, NDArray[Any]]]"
Restore: TypeAlias = "Callable[[dict[str, Any], dict[str, NDArray[Any]]], dict[str, NDArray[Any]]]"


def read_arrays(path: Path, noun: str, hint: str, most: int = MAX_BYTES) -> dict[str, NDArray[Any]]:
    """Read all arrays in an ``.npz`` file.

    Args:
        noun, hint: Name for this kind of file, and advice to the user, as used in error messages.
        most: Maximum size in bytes, whether compressed or decompressed.

    Raises:
        TransportError: If the file is missing, too large, damaged or of another kind.
    """
    missing = os_errors_as(
        TransportError, tr("There is no {noun} at {path}."), hint, noun=noun, path=path
    )
    with missing, open_file(path) as stream:
        # System files, such as those in /proc, may hold more than their stated size.
        raw = stream.read(min(os.fstat(stream.fileno()).st_size, most) + 1)
        fits = len(raw) <= most
    try:
        if fits:
            with zipfile.ZipFile(io.BytesIO(raw)) as archive:
                # Check before unpacking, since a small file can unpack to a huge one.
                fits = sum(entry.file_size for entry in archive.infolist()) <= most
        if fits:
            with np.load(io.BytesIO(raw), allow_pickle=False) as file_arrays:
                # NumPy returns entries that are not arrays as raw bytes.
                return {name: _array(file_arrays[name]) for name in file_arrays.files}
    # A damaged zip fails in many ways: bad sizes, bad flags, unknown methods.
    except Exception as error:
        raise TransportError(
            tr("{name} is damaged or not a {noun}.", name=path.name, noun=noun), hint
        ) from error
    raise TransportError(tr("{name} is too large to be a {noun}.", name=path.name, noun=noun), hint)


def write_sealed(
    path: Path,
    arrays: Mapping[str, NDArray[Any]],
    header: Mapping[str, Any],
    *,
    packing: int = zipfile.ZIP_DEFLATED,
    store: Store = dict,
) -> str:
    """Atomically write arrays and a header that contains their checksum, and return the checksum.

    Args:
        arrays: Arrays by name. No array may be named "header".
        packing: Compression method, as in `write_arrays`.
        store: Function that converts the arrays for storage. The checksum is that of the original
            arrays.
    """
    checksum = digest(arrays)
    words = json.dumps({**header, "sha256": checksum}).encode()
    contents = {**store(dict(arrays)), "header": np.frombuffer(words, np.uint8)}
    write_arrays(path, contents, packing)
    return checksum


def write_arrays(
    path: Path, arrays: Mapping[str, NDArray[Any]], packing: int = zipfile.ZIP_STORED
) -> None:
    """Atomically write arrays to an ``.npz`` file.

    Args:
        packing: Compression method from `zipfile`. ``ZIP_LZMA`` makes the smallest files but is
            slow.

    Raises:
        CoreError: If the file cannot be written (see `atomic_write`).
    """
    # Built in memory, since a zip file on a full disk would fail again when garbage-collected.
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", packing) as archive:
        for name, values in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(values), allow_pickle=False)
    atomic_write_bytes(path, stream.getvalue())


def read_sealed(
    path: Path,
    noun: str,
    hint: str,
    version: int,
    *,
    oldest: int = 0,
    names: Collection[str] | None = None,
    most: int = MAX_BYTES,
    restore: Restore | None = None,
) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Read a sealed file.

    Args:
        noun, hint: Name for this kind of file, and advice to the user, as used in error messages.
        version, oldest: The newest and the oldest version that can be read.
        names: Names of the arrays to read, or None for all.
        most: Maximum size in bytes, whether compressed or decompressed.
        restore: Inverse of the `store` function passed to `write_sealed`. This function also
            receives the header.

    Returns:
        header: The header. Only its version and its checksum have been checked.
        arrays: The arrays, by name. Their types and shapes have not been checked.

    Raises:
        TransportError: If the file is missing, too large, damaged or of another kind, or if its
            version is outside the readable range.
    """
    arrays = read_arrays(path, noun, hint, most)
    try:
        header = parse_header(arrays.pop("header"))
        file_version = int(header["format_version"])
        if file_version > version:
            raise TransportError(
                tr(
                    "{name} was made by a newer version of Turnlight (format {made}).",
                    name=path.name,
                    made=file_version,
                ),
                tr("Update Turnlight."),
            )
        if file_version < oldest:
            raise TransportError(
                tr("{name} was made by an older version of Turnlight.", name=path.name), hint
            )
        arrays = arrays if restore is None else restore(header, arrays)
        selection = arrays if names is None else {name: arrays[name] for name in names}
        whole = digest(selection) == header["sha256"]
    except CONTRADICTIONS as error:
        raise TransportError(
            tr("{name} is not a {noun}.", name=path.name, noun=noun), hint
        ) from error
    if not whole:
        raise TransportError(
            tr("{name} is damaged: its checksum does not match.", name=path.name), hint
        )
    return header, selection


def parse_header(raw: NDArray[Any]) -> dict[str, Any]:
    """Parse an untrusted JSON header, or raise one of `CONTRADICTIONS` if it is invalid."""
    header = json.loads(raw.tobytes().decode())
    if not isinstance(header, dict):
        raise TypeError("the header is not a JSON object")
    return header


def _array(value: object) -> NDArray[Any]:
    if isinstance(value, np.ndarray):
        return value
    raise TypeError("a member is not an array")


def digest(arrays: Mapping[str, NDArray[Any]]) -> str:
    """Return a SHA-256 checksum that covers the names, types, shapes and values of the arrays."""
    total = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        total.update(f"{name}{array.dtype.str}{array.shape}".encode())
        total.update(array.data)
    return total.hexdigest()
