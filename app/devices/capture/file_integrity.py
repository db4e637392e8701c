"""Whether a file from a camera has come over whole."""

from __future__ import annotations

import hashlib
import re
from typing import TYPE_CHECKING, Final

from app.core.base.errors import ProbeError
from app.core.base.files import open_file
from app.core.base.progress import Token
from app.core.hdr.decoding import READ_ROWS, FileRows, row_bands
from app.core.hdr.metadata import read_header

if TYPE_CHECKING:
    from pathlib import Path

_CHUNK: Final = 1 << 20
_START: Final = b"\xff\xd8\xff"
# A marker that ends a stretch of coded picture: neither a stuffed 0, a restart, nor padding.
_MARKER: Final = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]")
_STANDALONE: Final = frozenset({0x01, *range(0xD0, 0xD8)})


def jpeg_end(data: bytes) -> int | None:
    """Find where a JPEG ends, by its structure.

    Returns
    -------
    int or None
        Number of bytes up to and with the end marker; None where the data is not a JPEG or stops
        before it. That the picture in between can be decoded is not looked at.

    Examples
    --------
    >>> jpeg_end(bytes.fromhex("ffd8 ffe00004abcd ffda0002 1234ff00 ffd9 99"))
    18
    """
    if data[:3] != _START:
        return None
    place = 2
    while place + 4 <= len(data) or data[place : place + 2] == b"\xff\xd9":
        if data[place] != 0xFF:
            return None
        marker = data[place + 1]
        if marker == 0xD9:
            return place + 2
        if marker == 0xFF or marker in _STANDALONE:
            place += 1 if marker == 0xFF else 2
            continue
        place += 2 + int.from_bytes(data[place + 2 : place + 4], "big")
        if marker == 0xDA:
            found = _MARKER.search(data, place)
            if found is None:
                return None
            place = found.start()
    return None


def whole_file(path: Path) -> bool:
    """Whether a file has the structure of a whole JPEG, from its first to its last byte.

    Parameters
    ----------
    path : Path
        The file. Trailing bytes after the picture (a second, smaller picture, padding) are
        allowed.
    """
    try:
        with open_file(path) as stream:
            return jpeg_end(stream.read()) is not None
    except OSError:
        return False


def whole_picture(path: Path, token: Token | None = None) -> bool:
    """Whether a JPEG can be decoded to its last row.

    Parameters
    ----------
    token : Token, optional
        Checked every few rows.

    Returns
    -------
    bool
        False for everything that is not a JPEG, is cut off or damaged.

    Raises
    ------
    Cancelled
        When the token was cancelled.
    """
    if not whole_file(path):
        return False
    token = token or Token()
    try:
        frame = read_header(path).frame
        rows = FileRows(frame)
        try:
            for start, stop in row_bands(frame.shape[0], READ_ROWS):
                token.check()
                rows.rows(start, stop)
        finally:
            rows.close()
    except ProbeError:
        return False
    return True


def sha256_of(path: Path) -> str:
    """Checksum of a file in hexadecimal digits."""
    digest = hashlib.sha256()
    with open_file(path) as stream:
        while block := stream.read(_CHUNK):
            digest.update(block)
    return digest.hexdigest()
