"""Files on a camera: their names and addresses, made safe."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from app.devices.errors import BadReply
from app.devices.theta.untrusted import JsonValue, flag, table, whole, words

if TYPE_CHECKING:
    from collections.abc import Mapping

    from app.devices.theta.endpoint import Endpoint

_NAME: Final = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}")
_TAKEN: Final = re.compile(r"\d{4}:\d\d:\d\d \d\d:\d\d:\d\d(?:[+-]\d\d:\d\d)?", re.ASCII)
_LARGEST_FILE: Final = 2**40
_LARGEST_SIDE: Final = 100_000
# Windows takes these for devices, whatever follows the dot.
_RESERVED: Final = re.compile(r"(?i:con|prn|aux|nul|com\d|lpt\d)(?:\..*)?")


@dataclass(frozen=True, slots=True)
class FileEntry:
    """A file on the camera.

    Attributes
    ----------
    name : str
        1 to 64 of A-Z a-z 0-9 _ . - without a dot in front: safe as a part of a path.
    taken : str
        "2026:11:21 14:05:09+09:00", or without the offset; "" where the camera does not tell.
    width, height : int
        Pixels; 0 where the camera does not tell.
    projection : str
        "Equirectangular", "Dual-Fisheye" or "".
    """

    name: str
    url: str
    size: int = 0
    taken: str = ""
    width: int = 0
    height: int = 0
    group_id: str | None = None
    is_processed: bool = True
    projection: str = ""


def parse_entries(results: Mapping[str, JsonValue], endpoint: Endpoint) -> tuple[FileEntry, ...]:
    """Read the results of camera.listFiles.

    Returns
    -------
    tuple[FileEntry, ...]
        In the camera's order. Entries without a usable URL are left out; one with an unsafe name
        is called by the last part of its URL if that is safe, and left out if not.

    Raises
    ------
    BadReply
        When there is no list.
    """
    entries = results.get("entries")
    if not isinstance(entries, list):
        raise BadReply("The camera's list of files makes no sense.", "Try again.")
    found = (_entry(table(entry), endpoint) for entry in entries)
    return tuple(entry for entry in found if entry is not None)


def safe_name(text: object) -> str:
    """Give a camera's file name if it can be a part of a path on any system, else "".

    Examples
    --------
    >>> safe_name("R0010015.JPG"), safe_name("../R0010015.JPG")
    ('R0010015.JPG', '')
    """
    if not isinstance(text, str) or not _NAME.fullmatch(text) or text.endswith("."):
        return ""
    return "" if _RESERVED.fullmatch(text) else text


def _entry(fields: Mapping[str, JsonValue], endpoint: Endpoint) -> FileEntry | None:
    url = safe_url(fields.get("fileUrl"), endpoint)
    name = safe_name(fields.get("name")) or safe_name(url.partition("?")[0].rpartition("/")[2])
    if not url or not name:
        return None
    taken = next(
        (
            text
            for key in ("dateTimeZone", "dateTime", "_dateTimeZone")
            if _TAKEN.fullmatch(text := words(fields.get(key), 40))
        ),
        "",
    )
    return FileEntry(
        name=name,
        url=url,
        size=whole(fields.get("size"), _LARGEST_FILE) or 0,
        taken=taken,
        width=whole(fields.get("width"), _LARGEST_SIDE) or 0,
        height=whole(fields.get("height"), _LARGEST_SIDE) or 0,
        group_id=words(fields.get("_autoBracketGroupId"), 80) or None,
        is_processed=flag(fields.get("isProcessed")) is not False,
        projection=words(fields.get("_projectionType"), 40),
    )


def safe_url(value: object, endpoint: Endpoint) -> str:
    """Give a URL at an endpoint, or "" for anything that `Endpoint.rewrite` refuses."""
    if not isinstance(value, str) or not value:
        return ""
    try:
        return endpoint.rewrite(value)
    except BadReply:
        return ""
