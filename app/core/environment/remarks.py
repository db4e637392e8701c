"""Remarks about a panorama file."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class Repaired(Remark):
    """Some texels had no valid light. Infinite values were replaced with `level`."""

    name: str
    nan: int
    infinite: int
    negative: int
    level: float


@dataclass(frozen=True, slots=True)
class LayerChosen(Remark):
    """Only one of several layers was read."""

    name: str
    layer: str
    others: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FromOnePhoto(Remark):
    """The file states that it comes from one photo, so its clipped light is an estimate."""

    name: str


@dataclass(frozen=True, slots=True)
class ClippedFile(Remark):
    """The brightest areas may be brighter than the file states."""

    name: str


@dataclass(frozen=True, slots=True)
class PartUnseen(Remark):
    """Part of the sphere is not in the picture and was filled. `share` is its fraction, 0 to 1."""

    name: str
    share: float
