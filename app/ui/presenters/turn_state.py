"""What the Turn screen shows, as plain data; words are ready to print, pictures to be shown."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.turning.guidance import Phase

__all__ = [
    "ASPECT",
    "Guidance",
    "LiveWords",
    "Pictures",
    "Scale",
    "ShotRow",
    "ShotsState",
    "Sign",
    "StyleWords",
    "Tools",
    "TurnSizes",
    "TurnState",
    "TurnView",
]

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
    phase : Phase
        What it is about.
    sign : Sign
        Arrow, check, or nothing.
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
    inside : bool
        In the light: green, with a check.
    sentence, sentence_icon : str
        In place of all of that, where there is no number to show.
    advice : str
        Under that sentence: what can be done all the same; may be empty.
    spoken : str
        All of it in one sentence.
    announced : str
        The sentence that a screen reader is told; it changes less often.
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
    title, side : str
        The style.
    match, match_at_goal : str
        "Match now 90", "96 at the goal"; may be empty.
    now_tag : str
        On the picture.
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
    name : str
        Of the webcam.
    message : str
        Over the live picture; empty for none.
    tag : str
        In its corner, while live lies over the goal.
    dim : bool
        The picture is an old one.
    asking : bool
        Which way the camera looks is asked over the live well.
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
    goal_deg : float
        Goal.
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
    description : str
        For a screen reader.
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
    aligning : bool
        Live lies over the goal.
    can_align : bool
        There is a live picture.
    opacity : int
        Of the live picture, per cent.
    quality, quality_icon : str
        How well the heading is known, in words and per cent.
    quality_bad : bool
        Something is to be done about it.
    demo_deg : int or None
        Where the demo's camera is, whole degrees of turn; None for a real one.
    webcams : tuple of (index, name)
        Those there are.
    webcam : int
        Index of the one in use.
    looks : str
        ``sitter``, ``me``, or ``ask``.
    sounds : bool
        Whether it is to be heard.
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
    key : str
        Its own name.
    name : str
        Of its file.
    sentence : str
        "Taken at 93°, in the light, 3° short of the best: match 81 of best 82".
    detail : str
        Style, time, file, and how sure it is.
    icon : str
        Before the sentence.
    inside : bool
        In the light.
    new : bool
        It was opened just now.
    pictured : bool
        Whether there is a picture.
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
    """The photographs of the open place.

    Attributes
    ----------
    rows : tuple of ShotRow
        The last one first.
    busy : str
        What is being done; empty for nothing.
    """

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
    """Everything on the screen.

    Attributes
    ----------
    empty, empty_action : str
        Why there is nothing to turn to, and what fills it; empty when there is.
    mode : str
        ``walk`` or ``selfie``.
    """

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
