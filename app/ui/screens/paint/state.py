"""What the Paint screen shows, and what it is asked to do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any, Final, Literal, Protocol, TypeAlias

from app.core.base.arrays import Bytes, Float32
from app.core.painting.canvas import Canvas, Region
from app.core.painting.stroke import Brush, Tool
from app.core.text import tr

SMALLEST: Final = 4.0
LARGEST: Final = 160.0
"""Diameters of the brush, canvas pixels."""

_LIMITS: Final = {"diameter": (SMALLEST, LARGEST), "strength": (0.0, 1.0), "softness": (0.0, 1.0)}
TOOLS: Final = {
    Tool.BRIGHTER: tr("brighter"),
    Tool.DARKER: tr("darker"),
    Tool.IGNORE: tr("ignore"),
    Tool.RESTORE: tr("restore"),
}
_GROW: Final = 1.15
_EVEN: Final = 2.0

Way: TypeAlias = Literal["clockwise", "counter-clockwise", "none", ""]
Point: TypeAlias = "tuple[float, float, float]"
"""Where the pen is, canvas pixels from the upper left corner, and its pressure, 0 to 1."""

NameWish: TypeAlias = Literal["save", "save-as", "rename"]
"""What a name is asked for."""

FileWish: TypeAlias = Literal["export", "import_style"]
"""What a file is asked for."""


def head_words(yaw_deg: float) -> str:
    """Say from where the head is seen."""
    if not yaw_deg:
        return tr("the head seen from the front")
    size = round(abs(yaw_deg))
    if yaw_deg > 0:
        return tr("the head turned {size}° to its left", size=size)
    return tr("the head turned {size}° to its right", size=size)


class CanvasMode(StrEnum):
    """What the canvas shows."""

    WEIGHTS = "weights"
    TARGET = "target"
    HERE = "here"


@dataclass(frozen=True, slots=True, eq=False)
class HeadLook:
    """The head that is painted on, as it lies under the weights.

    Attributes:
        grey: (N, N) float32. In soft grey light, sRGB values 0 to 1, continued beyond the head's
            edge.
        coverage: (N, N) float32. Share of each pixel that the head covers.
        yaw_deg: How far the face is turned toward its own left from the line to the lens.
        places: (N, N, 3) float32 or None. Of a face that is turned: where the front shows the skin
            that each pixel does, as `PaintedHead.places_on_front` says.
    """

    grey: Float32 = field(repr=False)
    coverage: Float32 = field(repr=False)
    yaw_deg: float = 0.0
    places: Float32 | None = field(default=None, repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class LiveState:
    """What the strokes come to in this place.

    Attributes:
        picture: (h, w, 3) uint8 or None. Portrait, sRGB.
        panorama: (h, w, 3) uint8 or None. Of the place, sRGB.
        front: Panorama azimuth at which the photographer stands, deg.
        weights: (H, W) float32 or None. Pre-integrated target at turn 0.
        peaks: Turns of second peaks, deg.
        stale: Not of what is selected; dimmed under "Computing…".
    """

    stale: bool = False
    sentence: str = ""
    offers_probe: bool = False
    turn: str = ""
    direction: str = ""
    way: Way = ""
    match: str = ""
    match_value: float = 0.0
    limit: float = 45.0
    origin: str = ""
    picture: Bytes | None = field(default=None, repr=False)
    picture_tag: str = ""
    panorama: Bytes | None = field(default=None, repr=False)
    front: float = 0.0
    weights: Float32 | None = field(default=None, repr=False)
    turn_deg: float = 0.0
    curve: tuple[float, ...] = field(default=(), repr=False)
    arc: tuple[float, float] | None = None
    peaks: tuple[float, ...] = ()
    good: str = ""
    dashed: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class PaintState:
    """What the Paint screen shows, apart from the canvas itself.

    Attributes:
        status: "not saved yet", "saved", or empty.
        picture: (N, N, 3) uint8 or None. Picture of the head, sRGB, continued beyond its edge, when
            no weights are shown.
        starts: tuple of (str, str, str). Key, title and side of what can be started from.
    """

    title: str = ""
    status: str = ""
    notice: str = ""
    brush: Brush = field(default_factory=Brush)
    mode: CanvasMode = CanvasMode.WEIGHTS
    head: HeadLook | None = field(default=None, repr=False)
    picture: Bytes | None = field(default=None, repr=False)
    starts: tuple[tuple[str, str, str], ...] = field(default=(), repr=False)
    start: str = ""
    undo: str = ""
    redo: str = ""
    can_clear: bool = False
    save_words: str = tr("Save as my style")
    save_why: str = ""
    saving: bool = False
    live: LiveState = field(default_factory=LiveState)


class PaintView(Protocol):
    """Shows a `PaintState` and a canvas."""

    def show_state(self, state: PaintState) -> None:
        """Show it."""

    def canvas_changed(self, canvas: Canvas, regions: tuple[Region, ...] | None) -> None:
        """Show what is painted.

        `regions`: what has changed since the last call; None: everything.
        """

    def ask_name(self, wish: NameWish, title: str) -> None:
        """Ask for a name; the answer goes to the presenter's `files.named`."""

    def show_trouble(self, sentence: str) -> None:
        """Say beside the name why it cannot be taken; empty: it was, or is no longer wanted."""

    def ask_file(self, what: FileWish, suggested: str) -> None:
        """Ask for a file; the answer goes to the presenter's `files` method of the same name."""


class BrushBox:
    """Holds the brush and takes what the user changes of it."""

    def __init__(self, changed: Callable[[], None]) -> None:
        self._changed = changed
        self.brush = Brush(pen_pressure=True)

    def change(self, **changes: Any) -> None:
        """Change fields of the `Brush`; numbers are kept within their limits."""
        for name, (least, most) in _LIMITS.items():
            if name in changes:
                changes[name] = min(max(float(changes[name]), least), most)
        brush = replace(self.brush, **changes)
        if brush != self.brush:
            self.brush = brush
            self._changed()

    def resize(self, steps: int) -> None:
        """Make it larger or smaller by some steps of 15 %, of 2 pixels at least."""
        now = self.brush.diameter
        size = round(now * _GROW**steps / _EVEN) * _EVEN
        self.change(diameter=now + _EVEN * steps if size == now else size)

    def flip(self, name: str) -> None:
        """Change over ``mirror`` or ``pen_pressure``."""
        self.change(**{name: not getattr(self.brush, name)})
