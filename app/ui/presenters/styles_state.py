"""What the Styles screen shows, as plain data."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pathlib import Path

__all__ = [
    "CardState",
    "DetailState",
    "FileWish",
    "Filter",
    "Main",
    "Sizes",
    "Sort",
    "StylesState",
    "StylesView",
    "Way",
]

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]
Size: TypeAlias = tuple[int, int]
"""Rows and columns, device pixels."""

Way: TypeAlias = Literal["", "clockwise", "counter-clockwise", "none"]
"""Direction of a turn that is shown; empty where no turn is."""

Main: TypeAlias = Literal["turn", "lamp", "probe"]
"""What the main button does: go to the turn, try a second light, measure the light first."""


FileWish: TypeAlias = Literal["save_sheet", "export", "import_style"]
"""What a file is asked for."""


class Filter(StrEnum):
    """Which cards are shown."""

    ALL = "all"
    IN_REACH = "in"
    OUT_OF_REACH = "out"
    MINE = "mine"


class Sort(StrEnum):
    """In which order; what is out of reach always comes after what is in reach."""

    MATCH = "match"
    NAME = "name"
    TURN = "turn"
    SIDE = "side"


@dataclass(frozen=True, slots=True)
class Sizes:
    """How large pictures are on the view's screen, rows and columns of device pixels."""

    card: Size = (68, 94)
    portrait: Size = (208, 200)
    background: Size = (136, 128)


@dataclass(frozen=True, slots=True)
class CardState:
    """One card of the gallery. Two that are equal look the same.

    Attributes
    ----------
    key : str
        Name of the style; path of the file of one that is damaged.
    title, line : str
        Name on screen, and side or reason below it.
    brief : str
        Where there is no room for the reason.
    tip : str
        The whole of both, for the tool tip.
    spoken : str
        Accessible name.
    turn : str
        "96°"; empty where there is none.
    way : Way
        Its direction.
    match : str
        "96"; empty where there is none.
    meter : float or None
        The same as the meter shows it, 0 to 100.
    limit : float
        Tick of the meter.
    in_reach : bool
        False is shown grey with the reason.
    own : bool
        One of the user's.
    chosen : bool
        The one in front.
    damaged : Path or None
        File of a style that cannot be read; it has no pictures.
    version : int
        Another number: other pictures.
    target, here : (h, w, 3) uint8 or None
        sRGB, of the size that the view asked for; not compared.
    """

    key: str
    title: str
    line: str
    brief: str = ""
    tip: str = ""
    spoken: str = ""
    turn: str = ""
    way: Way = ""
    match: str = ""
    meter: float | None = None
    limit: float = 45.0
    in_reach: bool = True
    own: bool = False
    chosen: bool = False
    damaged: Path | None = None
    version: int = 0
    target: Bytes | None = field(default=None, compare=False, repr=False)
    here: Bytes | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class DetailState:
    """Everything about the chosen style. Texts are ready to print; empty ones are not shown.

    Attributes
    ----------
    key, title, side : str
        Of the style; the side is named twice.
    own : bool
        One of the user's, which can be renamed, duplicated, deleted and exported.
    target, here : (h, w, 3) uint8 or None
        Portraits of equal size, crop and exposure rule, sRGB.
    target_tag, here_tag : str
        "Target", "Here, at 96°".
    curve : tuple of float
        At 64 turns, 0 to 100; empty where no light was measured.
    curve_name : str
        What it is: "Match by turn".
    limit : float
        Dashed ring.
    arc : tuple of float or None
        Tolerance arc, deg; None out of reach.
    best : float or None
        Best turn, deg.
    peaks : tuple of float
        Turns of the second peaks, deg.
    needle : float
        Turn that is shown, deg.
    at_best : bool
        Whether that is the best one.
    turn : str
        "96°".
    way : Way
        Its direction.
    direction, clock : str
        "clockwise", "toward 3 o’clock".
    good_from, match, strength : str
        "79° to 111°", "96", "62".
    caution : str
        That the turn depends on the sitter's own head, as a sentence; empty where it does not.
    ratio, ratio_short, ratio_tip : str
        "2.3 stops", "4.9:1 key + fill : fill", and the whole sentence.
    glare, glare_tip : str
        Warning, short and whole; empty when no bright lamp shines into the eyes.
    glare_strong : bool
        Whether the sitter will squint.
    in_reach : bool
        Whether the style is.
    verdict, reason : str
        For one that is not: "Best match here is 29 at 62° counter-clockwise. The limit is 45.",
        and why.
    panorama : (H, W, 3) uint8 or None
        Of the place, sRGB; the same object while the place is the same.
    front : float
        Azimuth in it at which the photographer stands, deg.
    weights : (h, w) float32 or None
        Pre-integrated target of turn 0; the same object for the same style and head.
    background : (h, w, 3) uint8 or None
        Behind the sitter at the needle's turn, sRGB.
    main : Main
        What the main button does.
    main_words : str
        And what it says.
    main_works : bool
        Whether it can be pressed.
    """

    key: str = ""
    title: str = ""
    side: str = ""
    own: bool = False
    target: Bytes | None = field(default=None, repr=False)
    here: Bytes | None = field(default=None, repr=False)
    target_tag: str = "Target"
    here_tag: str = ""
    curve: tuple[float, ...] = ()
    curve_name: str = "Match by turn"
    limit: float = 45.0
    arc: tuple[float, float] | None = None
    best: float | None = None
    peaks: tuple[float, ...] = ()
    needle: float = 0.0
    at_best: bool = True
    turn: str = ""
    way: Way = ""
    direction: str = ""
    clock: str = ""
    good_from: str = ""
    match: str = ""
    strength: str = ""
    caution: str = ""
    ratio: str = ""
    ratio_short: str = ""
    ratio_tip: str = ""
    glare: str = ""
    glare_tip: str = ""
    glare_strong: bool = False
    in_reach: bool = True
    verdict: str = ""
    reason: str = ""
    panorama: Bytes | None = field(default=None, repr=False)
    front: float = 0.0
    weights: Float32 | None = field(default=None, repr=False)
    background: Bytes | None = field(default=None, repr=False)
    main: Main = "turn"
    main_words: str = "Turn to this"
    main_works: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class StylesState:
    """What the Styles screen shows.

    Attributes
    ----------
    cards : tuple of CardState
        In the order of reading, damaged ones last.
    filters : tuple of (str, str)
        Key and words of each filter: ("in", "In reach 16").
    filter, sort : str
        Which of them are set.
    places : int
        Cards there would be without a filter, the one for painting and the key included.
    empty : str
        Sentence in place of cards; empty when there are some.
    measured : bool
        Whether there is light; else the gallery offers to measure it.
    busy : bool
        Numbers are old and new ones are on their way.
    limit_words : str
        "Tick at 45", for the key.
    detail : DetailState
        Of the chosen style.
    """

    cards: tuple[CardState, ...] = ()
    filters: tuple[tuple[str, str], ...] = ()
    filter: Filter = Filter.ALL
    sort: Sort = Sort.MATCH
    places: int = 20
    empty: str = ""
    measured: bool = False
    busy: bool = False
    limit_words: str = ""
    detail: DetailState = field(default_factory=DetailState)


class StylesView(Protocol):
    """Shows a `StylesState`."""

    def show_state(self, state: StylesState) -> None:
        """Show it."""

    def ask_name(self, title: str) -> None:
        """Ask for another name of the chosen style; the answer goes to the presenter's `rename`.

        Parameters
        ----------
        title : str
            Its present name.
        """

    def show_trouble(self, sentence: str) -> None:
        """Say beside the name that was typed why it cannot be taken.

        Parameters
        ----------
        sentence : str
            For the user; empty when the name was taken.
        """

    def ask_file(self, what: FileWish, suggested: str) -> None:
        """Ask for a file; the answer goes to the presenter's method of the same name.

        Parameters
        ----------
        what : {"save_sheet", "export", "import_style"}
            What for.
        suggested : str
            Name to offer; empty where one is to be opened.
        """

    def copy(self, text: str) -> None:
        """Put a text where it can be pasted from.

        Parameters
        ----------
        text : str
            Some lines.
        """
