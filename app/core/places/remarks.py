"""Remarks about a place's folder and files, as data."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class LostPart:
    """An unreadable entry in a place. If it is a list, `count` of its `total` items were lost."""

    name: str
    count: int = 0
    total: int = 0


@dataclass(frozen=True, slots=True)
class LightChanged(Remark):
    """The file of the light is not the one from which the results were computed."""

    name: str


@dataclass(frozen=True, slots=True)
class LightFoundAgain(Remark):
    """The light was located, although the place's file no longer names it."""

    name: str


@dataclass(frozen=True, slots=True)
class JudgedAnew(Remark):
    """The results follow an earlier rule. They are recomputed, and the earlier ones are kept."""


@dataclass(frozen=True, slots=True)
class Unfinished(Remark):
    """A place that has no file of its own yet but can be resumed."""


@dataclass(frozen=True, slots=True)
class PartLost(Remark):
    """Parts of a place's file that could not be read.

    Attributes:
        why: Problem with the file, or "" if only individual entries are affected.
        empty: Whether only the files in the place's folder are left.
    """

    why: str
    parts: tuple[LostPart, ...]
    empty: bool


@dataclass(frozen=True, slots=True)
class FromNewer(Remark):
    """The place was saved by a newer version of Turnlight. Unknown data are kept."""


@dataclass(frozen=True, slots=True)
class CopyKept(Remark):
    """A damaged file of which a copy was kept. `name` is the name of the copy."""

    name: str


@dataclass(frozen=True, slots=True)
class CopyFailed(Remark):
    """A damaged file that could not be copied and was therefore left where it is."""

    name: str


@dataclass(frozen=True, slots=True)
class FolderUnreadable(Remark):
    """A folder of places that cannot be read, and the system's message."""

    folder: Path
    reason: str


@dataclass(frozen=True, slots=True)
class PlaceUnreadable(Remark):
    """A problem that makes a place's whole file unreadable."""

    why: str


@dataclass(frozen=True, slots=True)
class LightMissing(Remark):
    """A place without its light."""


@dataclass(frozen=True, slots=True)
class PhotosLost(Remark):
    """Photos whose data could not be read. `count` is their number, or 0 if it is unknown."""

    count: int
    folder: Path
