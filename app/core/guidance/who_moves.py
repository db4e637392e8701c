"""Who moves during a turn."""

from __future__ import annotations

from enum import StrEnum


class Mode(StrEnum):
    """The person who moves: the photographer around the sitter, or a single person on the spot."""

    WALK = "walk"
    SELFIE = "selfie"
