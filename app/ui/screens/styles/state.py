"""What the Styles screen shows, as plain data."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Protocol, TypeAlias

from app.core.base.arrays import Bytes, Float32
from app.core.text import tr
from app.words.lamps import SIZE_CHOICES

if TYPE_CHECKING:
    from app.ui.screens.styles.like_photo import LikeState

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

    card: Size = (127, 99)
    portrait: Size = (208, 200)
    background: Size = (136, 128)
    compared: Size = (256, 256)


@dataclass(frozen=True, slots=True)
class CardState:
    """One card of the gallery. Two that are equal look the same.

    Attributes:
        turn: "96°"; empty where there is none.
        swapped: Whether `target` and `here` have changed places.
        meter: float or None. The same as the meter shows it, 0 to 100.
        target, here: (h, w, 3) uint8 or None. sRGB, of the size that the view asked for; not
            compared.
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
    chosen: bool = False
    marked: bool = False
    swapped: bool = False
    damaged: Path | None = None
    version: int = 0
    stale: bool = False  # not of what is selected: dimmed until the new answer is there
    target: Bytes | None = field(default=None, compare=False, repr=False)
    here: Bytes | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class CurveMark:
    """A turn that is marked on the curve, with its picture.

    Attributes:
        tag, words: "Median", "Median at −84°: C 12".
        picture: (h, w, 3) uint8. sRGB, of the size of the portraits.
    """

    tag: str
    turn_deg: float
    words: str
    picture: Bytes = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class DetailState:
    """Everything about the chosen style. Texts are ready to print; empty ones are not shown.

    Attributes:
        target, here: (h, w, 3) uint8 or None. Portraits of equal size, crop and exposure rule,
            sRGB.
        target_tag, here_tag: "Target", "Here, at 96°".
        here_exposed, exposed_tip: "+1.3 stops", and what that is counted from; of the
            target only where the two have changed places.
        lamps_note: "Shown with its own lamps: at 2:1 it would not be seen."
        marks: The turns of median and least C, as in figure 4 of the paper; where C decides.
        curve: At 64 turns, 0 to 100; empty where no light was measured.
        close: "Close to Rembrandt".
        numbers, limit_words: "match 87", "Limit of reach: 45", as the card says them.
        arc: tuple of float or None. Tolerance arc, deg; None out of reach.
        best: float or None. Best turn, deg.
        peaks: Turns of the second peaks, deg.
        needle: Turn that is shown, deg.
        turn: "96°".
        direction, clock: "clockwise", "toward 3 o’clock".
        good_from, match, contrast: "79° to 111°", "96", "62 % of the studio’s".
        ratio, ratio_short, ratio_tip: "2.3 stops", "4.9:1 key + fill : fill", and the whole
            sentence.
        verdict, reason: For one that is not: "Best match here is 29 at 62° counter-clockwise. The
            limit is 45.", and why.
        panorama: (H, W, 3) uint8 or None. Of the place, sRGB; the same object while the place is
            the same.
        front: Azimuth in it at which the photographer stands, deg.
        weights: (h, w) float32 or None. Pre-integrated target of turn 0; the same object for the
            same style and head.
        background: (h, w, 3) uint8 or None. Behind the sitter at the needle's turn, sRGB.
        stale: Nothing of it is of what is selected; dimmed under "Computing…".
    """

    key: str = ""
    title: str = ""
    side: str = ""
    close: str = ""
    target: Bytes | None = field(default=None, repr=False)
    here: Bytes | None = field(default=None, repr=False)
    marks: tuple[CurveMark, ...] = ()
    target_tag: str = tr("Target")
    lamps_note: str = ""
    here_tag: str = ""
    target_exposed: str = ""
    here_exposed: str = ""
    exposed_tip: str = ""
    curve: tuple[float, ...] = ()
    curve_name: str = tr("Match by turn")
    numbers: str = ""
    limit: float = 45.0
    limit_words: str = ""
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
    quality: str = ""
    match: str = ""
    contrast: str = ""
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
    main_words: str = tr("Turn to this")
    main_works: bool = True
    stale: bool = False


@dataclass(frozen=True, slots=True)
class LampsState:
    """The photographer's lamps."""

    words: str = tr("Lamps: {lamps}", lamps=tr("standard"))  # "Lamps: 30°, 4:1"
    # keys and words of what is offered, and keys of what is chosen for the style in front
    sizes: tuple[tuple[str, str], ...] = tuple(SIZE_CHOICES.items())
    size: str = "paper"
    ratio: str = "none"
    # whether that is for this style alone; whether it can be, as a painted one has no lamps; and
    # whether a place is open, which keeps the choice
    only: bool = False
    own: bool = False
    works: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class LensState:
    """The camera position.

    Attributes:
        short, words: "Lens: short", "Lens: short light".
        key: Of `LENS_CHOICES`.
        background: Azimuth of the panorama that must be behind the sitter, deg; None for any.
        width: How far off it may be to either side, deg.
    """

    short: str = tr("Lens: straight")
    words: str = tr("Lens: {lens}", lens=tr("Face to the lens"))
    key: str = "0"
    background: float | None = None
    width: float = 20.0
    panorama: Bytes | None = field(default=None, repr=False)
    works: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class StylesState:
    """What the Styles screen shows.

    Attributes:
        filters: tuple of (str, str). Key and words of each filter: ("in", "In reach 16").
        stale: Cards and detail are not of what is selected; counts are left out.
        rules: On how many styles ours and the paper's rule disagree, where that counts.
        card_width: Least width of a card, logical pixels at scale 1; 0 where the window decides.
        marked: How many styles are marked to be compared.
    """

    cards: tuple[CardState, ...] = ()
    filters: tuple[tuple[str, str], ...] = ()
    filter: Filter = Filter.ALL
    sort: Sort = Sort.MATCH
    empty: str = ""
    measured: bool = False
    busy: bool = False
    stale: bool = False
    clipped: bool = False  # a capture of the full range would hold more of the light
    lamps: LampsState = LampsState()
    lens: LensState = field(default_factory=LensState)
    rules: str = ""
    card_width: int = 0
    marked: int = 0
    swapped: bool = False
    same_exposure: bool = False
    detail: DetailState = field(default_factory=DetailState)


class StylesView(Protocol):
    """Shows a `StylesState`."""

    def show_state(self, state: StylesState) -> None:
        """Show it."""

    def ask_name(self, title: str) -> None:
        """Ask for another name of the chosen style; the answer goes to the presenter's `rename`."""

    def show_trouble(self, sentence: str) -> None:
        """Say beside the name that was typed why it cannot be taken."""

    def show_compared(self, states: tuple[DetailState, ...]) -> None:
        """Show some styles beside each other, each at its best turn."""

    def ask_lens(self) -> None:
        """Ask where the lens may stand."""

    def ask_photo(self) -> None:
        """Ask for a photograph whose light is to become a style."""

    def show_like(self, state: LikeState) -> None:
        """Show what light a photograph has."""

    def ask_file(self, what: FileWish, suggested: str) -> None:
        """Ask for a file; the answer goes to the presenter's method of the same name."""

    def show_folder(self, folder: Path) -> None:
        """Show a folder in the system's file manager."""

    def copy(self, text: str) -> None:
        """Put a text where it can be pasted from."""
