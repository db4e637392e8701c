"""Convert file names and numbers for C and C++ libraries.

OpenCV, OpenImageIO, FFmpeg, Qt and Mitsuba expect file names in UTF-8. On Linux a name may contain
any bytes, so a file whose name is not UTF-8 is opened through a link with a plain name. No other
module passes file names to these libraries.
"""

from __future__ import annotations

import atexit
import contextlib
import errno
import hashlib
import locale
import os
import shutil
import tempfile
import urllib.parse
from functools import cache
from pathlib import Path
from typing import Final

from app.core.text import tr

_UNREADABLE: Final = "\ufffd"
"""Qt's replacement for bytes that are not text."""


def native_path(path: Path | str) -> str:
    """Return a path that a C or C++ library can open.

    Returns:
        The path itself if it is UTF-8 text. Otherwise, a link to the file. The link lasts until the
        program ends, because some libraries reopen a file while reading it.

    Raises:
        OSError: If the name is not UTF-8 text and the system cannot create links.
    """
    name = os.fspath(path)
    if _is_plain(name):
        return name
    whole = os.path.abspath(name)
    folder, last = os.path.split(whole)
    try:
        # Link the whole folder, since a file that is about to be written does not exist yet.
        if _is_plain(last):
            return os.path.join(_link_to(folder), last)
        return _link_to(whole)
    except (OSError, NotImplementedError, ValueError):
        words = tr("its name is not UTF-8 text; rename it first")
        raise OSError(errno.EILSEQ, words, name) from None


def _is_plain(name: str) -> bool:
    """Return whether a name is stored on disk in its UTF-8 encoding."""
    try:
        return os.fsencode(name) == name.encode("utf-8")
    except UnicodeError:
        return False


def _link_to(target: str) -> str:
    data = os.fsencode(target)
    ending = os.path.splitext(target)[1]
    plain = ending if ending.isascii() and ending.isprintable() else ""
    link = os.path.join(_links(), hashlib.blake2b(data, digest_size=16).hexdigest() + plain)
    with contextlib.suppress(FileExistsError):
        os.symlink(target, link)
    return link


@cache
def _links() -> str:
    """Create the private folder for the links, which is deleted when the program ends."""
    usual = tempfile.gettempdir()
    folder = tempfile.mkdtemp(prefix="turnlight-names-", dir=usual if _is_plain(usual) else "/tmp")  # noqa: S108
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def path_in_url(url: bytes) -> Path:
    """Return the path in an encoded file URL, whatever bytes the file's name contains.

    Examples:
        >>> path_in_url(b"file:///tmp/caf%C3%A9.mp4").as_posix()
        '/tmp/café.mp4'
    """
    return Path(os.fsdecode(urllib.parse.unquote_to_bytes(urllib.parse.urlsplit(url).path)))


def url_of(path: Path) -> bytes:
    """Return the encoded file URL of a path, whatever bytes the file's name contains.

    Examples:
        >>> url_of(Path("/tmp/café.mp4"))
        b'file:///tmp/caf%C3%A9.mp4'
    """
    return path.absolute().as_uri().encode("ascii")


def path_from_library(name: str) -> Path:
    """Return the path for a name in which a library replaced undecodable bytes with U+FFFD.

    Returns:
        The path of the first matching file, or the path exactly as named if no file matches.
    """
    # Qt reads names as UTF-8 even if the system's locale has another encoding.
    path = Path(name if os.name == "nt" else os.fsdecode(name.encode("utf-8", "surrogateescape")))
    if _UNREADABLE not in name or path.exists():
        return path
    place = Path(path.anchor)
    for part in path.parts[1 if path.anchor else 0 :]:
        place = _entry(place, part) if _UNREADABLE in part else place / part
    return place


def _entry(folder: Path, stem: str) -> Path:
    with contextlib.suppress(OSError):
        for name in sorted(os.listdir(folder)):
            if os.fsencode(name).decode("utf-8", "replace") == stem:
                return folder / name
    return folder / stem


def plain_numbers() -> None:
    """Reset the C locale's decimal separator to a point, since Qt sets the user's separator."""
    locale.setlocale(locale.LC_NUMERIC, "C")
