"""Remarks about a video."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class FilmPart(Remark):
    """Part of the turn with a visible face."""

    seen_deg: int


@dataclass(frozen=True, slots=True)
class FilmStill(Remark):
    """The camera was still."""


@dataclass(frozen=True, slots=True)
class FilmOpen(Remark):
    """The video does not return to where it began."""


@dataclass(frozen=True, slots=True)
class FilmBlank(Remark):
    """Fraction of the video, 0 to 1, with a featureless background."""

    share: float


@dataclass(frozen=True, slots=True)
class FilmRough(Remark):
    """The face changed more than light explains."""


@dataclass(frozen=True, slots=True)
class FrontCamera(Remark):
    """The video may be mirrored."""
