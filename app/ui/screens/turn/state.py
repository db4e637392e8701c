"""What the Turn screen shows, as plain data; words are ready to print, pictures to be shown."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.guidance.guide import Phase

Bytes: TypeAlias = NDArray[np.uint8]
Size: TypeAlias = tuple[int, int]
"""Rows and columns, device pixels."""

Sign: TypeAlias = Literal["clockwise", "counter-clockwise", "check", "none"]
"""What stands in the place of the arrow."""

ASPECT: float = 1.5
"""Columns over rows of a picture that fills its well; a higher one is cut at top and bottom."""


@dataclass(frozen=True, slots=True)
class TurnSizes:
    """How large pictures are on the view's screen, rows and columns of device pixels."""

    well: Size = (269, 404)
    strip: Size = (220, 824)
    portrait: Size = (136, 132)


@dataclass(frozen=True, slots=True)
class Guidance:
    """The right column.

    Attributes
    ----------
    number : int or None
        Whole degrees; None where none may be shown.
    number_words : str
        "to go", "to the best", or nothing.
    direction : str
        In the largest words: "clockwise", "Hold it".
    clock, walk, company : str
        "toward 3 o'clock", "Walk to your left", "The sitter turns with you."; may be empty.
    pill, pill_icon : str
        "In the light in 6°"; empty for none.
    """

    phase: Phase = Phase.STARTING
    sign: Sign = "none"
    number: int | None = None
    number_words: str = ""
    direction: str = ""
    clock: str = ""
    walk: str = ""
    company: str = ""
    pill: str = ""
    pill_icon: str = "bulb"
    inside: bool = False
    sentence: str = ""
    sentence_icon: str = "webcam"
    advice: str = ""
    spoken: str = ""
    announced: str = ""


@dataclass(frozen=True, slots=True)
class StyleWords:
    """What stands beside target and picture.

    Attributes
    ----------
    match, match_at_goal : str
        "Match now 90", "96 at the goal"; may be empty.
    """

    title: str = ""
    side: str = ""
    match: str = ""
    match_at_goal: str = ""
    now_tag: str = "Now"


@dataclass(frozen=True, slots=True)
class LiveWords:
    """What is said about the two wells.

    Attributes
    ----------
    live, goal : str
        Behind their headings: "webcam, 60° wide".
    aspect : float
        Columns over rows of both wells.
    """

    live: str = ""
    goal: str = "what the camera should see"
    name: str = ""
    message: str = ""
    tag: str = ""
    dim: bool = False
    asking: bool = False
    aspect: float = ASPECT


@dataclass(frozen=True, slots=True)
class Scale:
    """Strip and scale; all of it in whole degrees of turn.

    Attributes
    ----------
    now_deg : float or None
        Now; None while it is not known.
    camera_deg : float or None
        Where the camera's axis points, as a turn: beside `now_deg` where the sitter is not in the
        middle of the picture; None for `now_deg`.
    fov_deg : float
        Width of the frames, degrees of the panorama.
    arc_deg : tuple of float or None
        In the light (from, to), clockwise.
    goal_words, now_words, arc_words : str
        "goal 96°", "now 73°", "in the light from 79° to 111°".
    """

    goal_deg: float = 0.0
    now_deg: float | None = None
    camera_deg: float | None = None
    fov_deg: float = 60.0
    arc_deg: tuple[float, float] | None = None
    goal_words: str = ""
    now_words: str = ""
    arc_words: str = ""
    description: str = ""


@dataclass(frozen=True, slots=True)
class Tools:
    """The row at the foot of the left column.

    Attributes
    ----------
    demo_deg : int or None
        Where the demo's camera is, whole degrees of turn; None for a real one.
    webcams : tuple of (index, name)
        Those there are.
    """

    aligning: bool = False
    can_align: bool = False
    opacity: int = 45
    quality: str = ""
    quality_icon: str = "target"
    quality_bad: bool = False
    demo_deg: int | None = None
    webcams: tuple[tuple[int, str], ...] = ()
    webcam: int = 0
    looks: str = "ask"
    sounds: bool = True


@dataclass(frozen=True, slots=True)
class ShotRow:
    """One photograph that was taken here.

    Attributes
    ----------
    sentence : str
        "Taken at 93°, in the light, 3° short of the best: match 81 of best 82".
    thumbnail : (h, w, 3) uint8 or None
        sRGB.
    """

    key: str
    name: str
    sentence: str
    detail: str
    icon: str = "target"
    inside: bool = False
    new: bool = False
    pictured: bool = False
    thumbnail: Bytes | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class ShotsState:
    """The photographs of the open place."""

    rows: tuple[ShotRow, ...] = ()
    busy: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Pictures:
    """Pictures, (h, w, 3) uint8 sRGB; another one is another object.

    Attributes
    ----------
    live, goal : uint8 or None
        For the wells; mirrored in selfie mode.
    strip : uint8 or None
        150° of background, never mirrored.
    target, now : uint8 or None
        Portraits.
    """

    live: Bytes | None = field(default=None, repr=False)
    goal: Bytes | None = field(default=None, repr=False)
    strip: Bytes | None = field(default=None, repr=False)
    target: Bytes | None = field(default=None, repr=False)
    now: Bytes | None = field(default=None, repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class TurnState:
    """Everything on the screen."""

    empty: str = ""
    empty_action: str = ""
    mode: str = "walk"
    guidance: Guidance = field(default_factory=Guidance)
    style: StyleWords = field(default_factory=StyleWords)
    live: LiveWords = field(default_factory=LiveWords)
    scale: Scale = field(default_factory=Scale)
    tools: Tools = field(default_factory=Tools)
    shots: ShotsState = field(default_factory=ShotsState)
    pictures: Pictures = field(default_factory=Pictures)


class TurnView(Protocol):
    """Shows a `TurnState`."""

    def show_state(self, state: TurnState) -> None:
        """Show it."""

    def ask_photos(self) -> None:
        """Ask which photographs were taken."""

    def ask_source(self) -> None:
        """Ask for another live camera."""
