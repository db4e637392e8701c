"""Reasons why a picture misses a style, as data that `app.words` turns into sentences."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Literal, TypeAlias


class Aspect(StrEnum):
    """The aspect of a style that a relation between two areas of the face describes."""

    NOSE_SHADOW = "nose shadow"
    CHEEKS = "cheeks"
    OPEN_SHADOW = "open shadow"
    PATCH = "patch"
    DARK_PATCH = "dark patch"
    SHADOW_SIDE = "shadow side"
    EVENNESS = "evenness"
    HEIGHT = "height"
    DEPTH = "depth"
    ABOVE = "above"
    BELOW = "below"
    UNDER_THE_CHIN = "under the chin"
    THROAT = "throat"
    UNDER_THE_NOSE = "under the nose"
    TWO_LAMPS = "two lamps"
    FRONT = "front"
    SIDE = "side"
    RIM = "rim"
    ONE_RIM = "one rim"
    RIM_ONLY = "rim only"
    TWO_RIMS = "two rims"
    GRAZED_CHEEK = "grazed cheek"
    SOFT_SHADOW = "soft shadow"
    EYE_LEVEL = "eye level"
    HAIR = "hair"
    HAIR_ONLY = "hair only"
    HAIR_BEFORE_BACKGROUND = "hair before background"
    BACKGROUND = "background"
    DARK_EDGE = "dark edge"
    BRIGHT_BACKGROUND = "bright background"
    MIDDLE_LINE = "middle line"


class Cause(StrEnum):
    """The fault in a place's light that keeps a style out of reach."""

    EVEN = "even light"
    # no light at any turn from the direction of one of the style's lamps
    NO_LIGHT = "no light from there"
    ONE_SIDE = "light from one side"
    ONE_LAMP = "one of two lamps"
    APART = "lamps at different turns"
    FILLED = "filled shadows"
    SPOILED = "spoiled pattern"
    NO_TURN = "no turn"  # used for painted weights, which have no lamps
    WEAK_LAMP = "weak lamp"  # the second light, at its strongest


class Origin(StrEnum):
    """The direction from which a style's lamp lights the face."""

    BELOW = "below"
    ABOVE = "above"
    BEHIND = "behind"
    SIDE = "side"
    HIGH_IN_FRONT = "high in front"
    FRONT = "front"


class Obstacle(StrEnum):
    """The reason why no position of the lens is possible."""

    BACKGROUND = "background"  # no turn brings the requested background behind the sitter
    FACE_HIDDEN = "face hidden"
    NO_SHORT_LIGHT = "no short light"
    NO_BROAD_LIGHT = "no broad light"


@dataclass(frozen=True, slots=True)
class AreaShortfall:
    """The difference between two areas of the face is too small or too large.

    Attributes:
        style: Title of the style whose signature requires the difference.
        value_stops: Brightness of `bright` relative to `dark`, in stops.
        limit_stops: The lower limit if the value is below it, otherwise the upper limit.
    """

    aspect: Aspect
    style: str
    bright: str
    dark: str
    value_stops: float
    limit_stops: float
    kind: Literal["areas"] = field(default="areas", init=False)


@dataclass(frozen=True, slots=True)
class LightShortfall:
    """The match or the contrast of the picture as a whole is too low.

    Attributes:
        value, limit: The measured value and its limit, 0 to 100.
        origin: Direction of the missing light, for the causes `NO_LIGHT` and `ONE_LAMP`.
    """

    cause: Cause
    measure: Literal["match", "contrast"]
    value: float
    limit: float
    origin: Origin | None = None
    kind: Literal["light"] = field(default="light", init=False)


@dataclass(frozen=True, slots=True)
class LensShortfall:
    """No position of the lens meets the wish."""

    obstacle: Obstacle
    kind: Literal["lens"] = field(default="lens", init=False)


@dataclass(frozen=True, slots=True)
class SavedReason:
    """A sentence that an earlier version saved in place of data."""

    sentence: str
    kind: Literal["saved"] = field(default="saved", init=False)


Shortfall: TypeAlias = AreaShortfall | LightShortfall | LensShortfall | SavedReason
