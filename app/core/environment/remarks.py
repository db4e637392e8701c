"""Remarks about a panorama file."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class Repaired(Remark):
    """Texels without valid light; infinite ones were replaced with `level`."""

    name: str
    nan: int
    infinite: int
    negative: int
    level: float


@dataclass(frozen=True, slots=True)
class LayerChosen(Remark):
    """One of several layers was read."""

    name: str
    layer: str
    others: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FromOnePhoto(Remark):
    """The file states that it was created from one photo; its clipped light is an estimate."""

    name: str


@dataclass(frozen=True, slots=True)
class ClippedFile(Remark):
    """The brightest areas may be brighter than the file states."""

    name: str


@dataclass(frozen=True, slots=True)
class PartUnseen(Remark):
    """A fraction of the sphere, 0 to 1, that was filled because the picture does not show it."""

    name: str
    share: float
