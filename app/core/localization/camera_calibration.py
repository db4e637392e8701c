"""What pictures tell little by little: how wide the camera's lens is, and where the sitter is.

Both are read from single pictures that may be wrong. The width of the lens is the median of the
last estimates, once these agree. The sitter stays where they were for a moment when a picture does
not show them. From time to time the whole picture is searched for them again, and they are believed
to be where most of the last searches found them: a lamp or a pot that once looked like a head is
not followed for long.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from statistics import median
from typing import TYPE_CHECKING, Final

from app.core.localization.field_of_view import ASSUMED_DEG

if TYPE_CHECKING:
    from app.core.localization.sitter import Sitter

_ESTIMATES: Final = 9
_TRUSTED: Final = 3
_SPREAD: Final = 0.08  # median deviation over the median, of estimates that agree
_AGAIN_S: Final = 4.0  # a zoom may have been turned, or another lens taken

_STEP_DEG: Final = 12.0  # a sitter who moves no more between two pictures is the same
_STAYS_S: Final = 1.5
_LOOK_AGAIN_S: Final = 0.3
_SEARCH_AGAIN_S: Final = 0.7
_SEARCHES: Final = 5


@dataclass(frozen=True, slots=True)
class Width:
    """How wide a lens seems to be.

    Attributes:
        estimates: The last ones, horizontal fields of view in deg.
    """

    estimates: tuple[float, ...] = ()
    time_s: float = -math.inf

    @property
    def likely_deg(self) -> float | None:
        """Best guess, deg; None before the first estimate."""
        return median(self.estimates) if self.estimates else None

    @property
    def known_deg(self) -> float | None:
        """What several estimates agree on, deg; None where they do not."""
        middle = self.likely_deg
        if middle is None or len(self.estimates) < _TRUSTED:
            return None
        spread = median(abs(one - middle) for one in self.estimates)
        return middle if spread <= _SPREAD * middle else None

    def due(self, now_s: float) -> bool:
        """Tell whether another estimate would be good."""
        return self.known_deg is None or now_s - self.time_s >= _AGAIN_S


def read(width: Width, fov_deg: float, now_s: float) -> Width:
    """Take an estimate of the field of view.

    Args:
        fov_deg: Horizontal, deg.
    """
    return Width((*width.estimates, fov_deg)[-_ESTIMATES:], now_s)


def assumed_fov(shape: tuple[int, ...]) -> float:
    """Return the horizontal field of view that a camera is taken to have while it is unknown, deg.

    Args:
        shape: Rows and columns of its pictures.
    """
    half = math.tan(math.radians(ASSUMED_DEG) / 2.0) * shape[1] / max(shape[:2])
    return 2.0 * math.degrees(math.atan(half))


@dataclass(frozen=True, slots=True)
class Company:
    """Who is in the picture."""

    sitter: Sitter | None = None
    seen_s: float = -math.inf
    looked_s: float = -math.inf
    seen: Sitter | None = None
    searches: tuple[Sitter, ...] = ()
    searched_s: float = -math.inf

    def due(self, now_s: float) -> bool:
        """Tell whether to look again: always for who is there, now and then for who is not."""
        return self.sitter is not None or now_s - self.looked_s >= _LOOK_AGAIN_S

    def near(self, now_s: float) -> Sitter | None:
        """Return whom to look around first; None when it is time to search the whole picture."""
        return None if now_s - self.searched_s >= _SEARCH_AGAIN_S else self.sitter


def kept(company: Company, found: Sitter | None, now_s: float) -> Company:
    """Take what was seen of the sitter in a picture."""
    before = company.sitter
    around = company.near(now_s)
    # Somebody who is not where they were looked for first was found by a search of everything.
    if around is None or (found is not None and not _near(found, around)):
        searches = company.searches if found is None else (*company.searches, found)[-_SEARCHES:]
        company = replace(company, searches=searches, searched_s=now_s)
    if found is None:
        stays = now_s - company.seen_s <= _STAYS_S
        return replace(company, sitter=before if stays else None, looked_s=now_s, seen=None)
    chosen = found if before is None else _likelier(before, found, company.searches)
    if chosen is None:
        return replace(company, looked_s=now_s, seen=found)
    return replace(company, sitter=chosen, seen_s=now_s, looked_s=now_s, seen=found)


def _likelier(before: Sitter, found: Sitter, searches: tuple[Sitter, ...]) -> Sitter | None:
    """Go on with the one who is followed, or take another whom more searches found; None: wait."""
    if _near(found, before):
        return found
    here, there = (sum(_near(one, each) for each in searches) for one in (before, found))
    return found if there > here else None


def _near(first: Sitter, second: Sitter) -> bool:
    return abs(first.angle_deg - second.angle_deg) <= _STEP_DEG
