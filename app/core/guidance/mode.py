"""Who moves while one turns to the light."""

from __future__ import annotations

from enum import StrEnum


class Mode(StrEnum):
    """Who moves: the photographer around the sitter, or one person on the spot."""

    WALK = "walk"
    SELFIE = "selfie"
