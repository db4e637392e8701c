"""What there is to report of a film."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class FilmPart(Remark):
    """Over how much of the turn the face was seen."""

    seen_deg: int


@dataclass(frozen=True, slots=True)
class FilmStill(Remark):
    """The camera stood still."""


@dataclass(frozen=True, slots=True)
class FilmOpen(Remark):
    """The film does not come back to where it began."""


@dataclass(frozen=True, slots=True)
class FilmBlank(Remark):
    """The share of the film, 0 to 1, whose background was blank."""

    share: float


@dataclass(frozen=True, slots=True)
class FilmRough(Remark):
    """The face changed more than light explains."""


@dataclass(frozen=True, slots=True)
class FrontCamera(Remark):
    """The film may be mirrored."""
