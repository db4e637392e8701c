"""What there is to report of a panorama's file."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class Repaired(Remark):
    """Texels that held no light; `level` is what infinite ones became."""

    name: str
    nan: int
    infinite: int
    negative: int
    level: float


@dataclass(frozen=True, slots=True)
class LayerChosen(Remark):
    """One of several layers is read."""

    name: str
    layer: str
    others: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FromOnePhoto(Remark):
    """A file that says that it was made from one photo; what was clipped there is a guess."""

    name: str


@dataclass(frozen=True, slots=True)
class ClippedFile(Remark):
    """The brightest areas may be brighter than the file says."""

    name: str


@dataclass(frozen=True, slots=True)
class PartUnseen(Remark):
    """A share of the sphere, 0 to 1, that the picture does not show and that was filled."""

    name: str
    share: float
