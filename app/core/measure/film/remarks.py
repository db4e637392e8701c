"""Remarks on a video."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class FilmPart(Remark):
    """A face is visible in only part of the turn."""

    seen_deg: int


@dataclass(frozen=True, slots=True)
class FilmStill(Remark):
    """The camera did not move."""


@dataclass(frozen=True, slots=True)
class FilmOpen(Remark):
    """The video does not return to the view with which it began."""


@dataclass(frozen=True, slots=True)
class FilmBlank(Remark):
    """Part of the video, a fraction `share` from 0 to 1, has a featureless background."""

    share: float


@dataclass(frozen=True, slots=True)
class FilmRough(Remark):
    """The face changed more than the light can explain."""


@dataclass(frozen=True, slots=True)
class FrontCamera(Remark):
    """The video may be mirrored, since a front camera recorded it."""
