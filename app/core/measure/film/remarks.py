"""Remarks about a video."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class FilmPart(Remark):
    """Only part of the turn shows a face."""

    seen_deg: int


@dataclass(frozen=True, slots=True)
class FilmStill(Remark):
    """The camera was still."""


@dataclass(frozen=True, slots=True)
class FilmOpen(Remark):
    """The video does not return to where it began."""


@dataclass(frozen=True, slots=True)
class FilmBlank(Remark):
    """Part of the video, `share` from 0 to 1, has a featureless background."""

    share: float


@dataclass(frozen=True, slots=True)
class FilmRough(Remark):
    """The face changed more than the light can explain."""


@dataclass(frozen=True, slots=True)
class FrontCamera(Remark):
    """The video may be mirrored."""
