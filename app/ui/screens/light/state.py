"""What the Light screen shows, as plain data.

`PlaceScale` is how bright the open place is: measured, or as the user says.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bytes, Float32
from app.core.base.errors import CoreError
from app.core.second_light.place_brightness import check_lux, illuminance, read_lux
from app.core.solver.head_shape import HeadShape
from app.core.solver.place_light import PlaceLight
from app.core.text import tr
from app.ui.presenters.services import Services
from app.ui.screens.light.mask import MaskEdit
from app.words.phrases.quantities import lux_words

Size: TypeAlias = tuple[int, int]
"""Rows and columns, device pixels."""

Verdict: TypeAlias = Literal["", "in", "out"]
"""Whether the style is in reach where the lamp is held; empty while that is not known."""

WordsWish: TypeAlias = Literal["rename", "distance", "lux"]
"""What is asked about a captured lamp."""

BRIGHTNESS: tuple[tuple[str, str, float], ...] = (
    ("night", tr("Night street"), 5.0),
    ("cellar", tr("Cellar"), 30.0),
    ("living", tr("Living room"), 150.0),
    ("office", tr("Office"), 300.0),
    ("studio", tr("Studio"), 500.0),
    ("window", tr("By a window"), 1500.0),
    ("overcast", tr("Overcast sky"), 8000.0),
    ("sun", tr("Sun"), 60000.0),
)
"""Answers to "How bright is it here?": key, words, lux on a vertical surface at the face."""

DISTANCES_M: tuple[float, ...] = (
    *(round(0.2 + 0.05 * step, 2) for step in range(16)),
    *(round(1.0 + 0.1 * step, 1) for step in range(10)),
    *(2.0 + 0.5 * step for step in range(7)),
)
"""Stops of the distance slider, metres from the middle of the head."""


@dataclass(frozen=True, slots=True)
class LightSizes:
    """How large pictures are on the view's screen, rows and columns of device pixels."""

    row: Size = (56, 56)
    portrait: Size = (176, 160)


@dataclass(frozen=True, slots=True)
class LampState:
    """The lamp in hand, and what the user says about the place.

    Attributes:
        items: tuple of (str, str, str, str). Lamps to choose from: key, title, what it is, icon.
        brightness: "460 lx at the face, as measured"; empty while it is not known.
    """

    items: tuple[tuple[str, str, str, str], ...] = ()
    key: str = ""
    distance: int = 0
    distance_fixed: str = ""
    arm: bool = False
    floor: bool = True
    brightness: str = ""
    own: bool = False


@dataclass(frozen=True, slots=True)
class BrightState:
    """The question how bright the place is.

    `measured`: "Back to the measured 460 lx"; empty where that counts already, or nothing was
    measured.
    """

    key: str = ""
    text: str = ""
    error: str = ""
    keep: str = ""
    measured: str = ""


@dataclass(frozen=True, slots=True)
class WordsAsk:
    """A line that is asked for about a captured lamp."""

    wish: WordsWish
    title: str
    label: str
    button: str
    text: str = ""
    example: str = ""


@dataclass(frozen=True, slots=True)
class CaptureAsk:
    """How a lamp is captured, and what can be made one now."""

    guide: tuple[str, ...]
    other: str = ""
    place: str = ""
    name: str = ""


@dataclass(frozen=True, slots=True)
class RowState:
    """A style in the list. Two that are equal look the same.

    `picture`, (h, w, 3) uint8 or None: target, sRGB; not compared.
    """

    key: str
    title: str
    line: str
    before: int
    after: int
    limit: float = 45.0
    power: str = ""
    chosen: bool = False
    spoken: str = ""
    version: int = 0
    picture: Bytes | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Section:
    """A part of the list: "Now possible with this lamp", "2 of 3", and its styles."""

    title: str
    count: str
    rows: tuple[RowState, ...] = ()


@dataclass(frozen=True, slots=True)
class HoldState:
    """The two steps, in words.

    `turn`, `turn_line`: "Turn 56° counter-clockwise", and what that does.
    """

    turn: str = ""
    turn_line: str = ""
    turn_works: bool = False
    go: str = tr("Turn first")
    go_icon: str = "turn"
    hold: str = ""
    hold_line: str = ""
    map_title: str = tr("Where this lamp works at this turn")


@dataclass(frozen=True, slots=True, eq=False)
class HeadsState:
    """The lamp around the head.

    Attributes:
        shape: HeadShape or None. Outlines, metres.
        best: tuple of float or None. Best azimuth and altitude, deg.
        place_light_deg: From where the place lights the face at the turn, azimuth as above; None
            where its light comes from all around.
    """

    shape: HeadShape | None = field(default=None, repr=False)
    distance_m: float = 0.3
    azimuth_deg: float = 0.0
    altitude_deg: float = 0.0
    best: tuple[float, float] | None = None
    place_light_deg: float | None = None
    spoken: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class SkyState:
    """Matches over all directions of the lamp at the turn that is shown.

    Attributes:
        tones: (h, w) uint8 or None. Brighter is better; azimuth −180 at the left to 180 at the
            right, which is the sitter's left; altitude from the top down.
        closed: (h, w) bool or None. Where the lamp may not be held.
        line: (n, 4) float32. Pieces of the line of the limit: azimuth and altitude of both ends,
            deg.
    """

    tones: Bytes | None = field(default=None, repr=False)
    closed: NDArray[np.bool_] | None = field(default=None, repr=False)
    line: Float32 = field(default_factory=lambda: np.zeros((0, 4), np.float32), repr=False)
    half_height_deg: float = 75.9375
    words: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class LampDetailState:
    """The chosen style with the lamp where it is held.

    Attributes:
        target, with_lamp, without: (h, w, 3) uint8 or None. Portraits, sRGB.
        without_tag: "Without it, at 62°".
        power: "1/8, 3 stops down"; empty for a lamp that has one power only.
    """

    key: str = ""
    title: str = ""
    side: str = ""
    target: Bytes | None = field(default=None, repr=False)
    with_lamp: Bytes | None = field(default=None, repr=False)
    without: Bytes | None = field(default=None, repr=False)
    without_tag: str = tr("Without it")
    before: str = ""
    after: str = ""
    verdict: Verdict = ""
    verdict_words: str = ""
    best_title: str = ""
    best_line: str = ""
    at_best: bool = True
    numbers: tuple[tuple[str, str], ...] = ()
    power: str = ""
    weaker: bool = False
    stronger: bool = False
    stale: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class LightState:
    """What the Light screen shows.

    Attributes:
        actions: tuple of (str, str). Key and words of its buttons.
        meter: Why the lamp in hand cannot be compared with the place, and that its brightness can
            be typed; empty where it can be compared. In place of the schematics.
        capturing: A lamp of one's own is being read.
        stale: Answers for the lamp are not of what is selected; dimmed under "Computing…".
        note: Above the list: "This lamp is too weak at 30 cm. …".
    """

    empty: str = ""
    actions: tuple[tuple[str, str], ...] = ()
    asks: bool = False
    bright: BrightState = field(default_factory=BrightState)
    meter: str = ""
    meter_error: str = ""
    lamp: LampState = field(default_factory=LampState)
    sections: tuple[Section, ...] = ()
    note: str = ""
    note_action: str = ""
    busy: bool = False
    stale: bool = False
    hold: HoldState = field(default_factory=HoldState)
    heads: HeadsState = field(default_factory=HeadsState)
    sky: SkyState = field(default_factory=SkyState)
    detail: LampDetailState = field(default_factory=LampDetailState)
    capturing: bool = False


class LightView(Protocol):
    """Shows a `LightState`."""

    def show_state(self, state: LightState) -> None:
        """Show it."""

    def take_lamp_focus(self) -> None:
        """Give the keyboard to the lamp."""

    def ask_capture(self, ask: CaptureAsk) -> None:
        """Say how a lamp is captured; the answer goes to `LampList.capture`."""

    def ask_pictures(self) -> None:
        """Ask for the pictures of a lamp; the answer goes to `LampList.take`."""

    def ask_words(self, ask: WordsAsk) -> None:
        """Ask for a line; the answer goes to the presenter's `lamp_actions.answer`."""

    def say(self, sentence: str) -> None:
        """Say in the sheet what is wrong with its answer; nothing closes the sheet."""

    def ask_mask(self, edit: MaskEdit) -> None:
        """Let the user paint where the lamp is."""


_SAME = 0.01  # of an answer's lux


class PlaceScale:
    """Luminance of radiance 1 at the open place; what the user says is kept with the place."""

    def __init__(self, services: Services, changed: Callable[[], None]) -> None:
        self._services = services
        self._changed = changed
        # What was said of a light that belongs to no place that is kept.
        self._loose: tuple[PlaceLight, float] | None = None
        self._error = ""
        self.asking = False
        # Of light in its own unit, and what that is of: sums over a whole panorama.
        self._unit: tuple[PlaceLight, float, float] | None = None

    @property
    def white(self) -> float | None:
        """Luminance of radiance 1, cd/m2: as the user says, else as measured."""
        value = self._stated
        return self._measured if value is None else value

    @property
    def camera(self) -> str:
        """Model of the camera that measured the scale; empty where that is not known."""
        place = self._services.model.place
        from_camera = place is not None and place.capture is not None and self._stated is None
        return place.capture.camera if from_camera and place and place.capture else ""

    @property
    def words(self) -> str:
        """Write "460 lx at the face, as measured"; empty while it is not known."""
        white = self.white
        if white is None:
            return ""
        lux = lux_words(self._lux(white))
        if self._stated is None:
            return tr("{lux} at the face, as measured", lux=lux)
        return tr("{lux} at the face, as you said", lux=lux)

    def state(self) -> BrightState:
        """Make what the question shows."""
        white, measured = self.white, self._measured
        if white is None:
            return BrightState(error=self._error)
        lux = self._lux(white)
        key = next((k for k, _, value in BRIGHTNESS if abs(value - lux) <= _SAME * value), "")
        back = ""
        if self._stated is not None and measured is not None:
            back = tr("Back to the measured {lux}", lux=lux_words(self._lux(measured)))
        return BrightState(
            key=key,
            text="" if key and self._stated is not None else lux_words(lux).removesuffix(" lx"),
            error=self._error,
            keep=tr("Keep {lux}", lux=lux_words(lux)),
            measured=back,
        )

    def ask(self) -> None:
        """Ask although an answer is known."""
        self.asking, self._error = True, ""
        self._changed()

    def keep(self) -> None:
        """Leave it as it is."""
        self.asking, self._error = False, ""
        self._changed()

    def choose(self, key: str) -> None:
        """Take one of the answers of `BRIGHTNESS`."""
        self._say(next(lux for name, _, lux in BRIGHTNESS if name == key))

    def type(self, text: str) -> None:
        """Take what a light meter reads, as it was typed."""
        try:
            lux = read_lux(text)
        except CoreError as error:
            self._error = str(error)
            self._changed()
            return
        self._say(lux)

    def measure(self) -> None:
        """Go back to what was measured."""
        self._keep(None)

    def place_changed(self) -> None:
        """Ask no more: another place is open."""
        self.asking, self._error = False, ""

    @property
    def _measured(self) -> float | None:
        place = self._services.model.place
        white = place.capture.white_cd_m2 if place is not None and place.capture else None
        return white or None

    @property
    def _stated(self) -> float | None:
        model = self._services.model
        if model.place is not None:
            return model.place.said_white_cd_m2
        loose = self._loose
        return loose[1] if loose is not None and loose[0] is model.light else None

    def _lux(self, white: float) -> float:
        """Vertical illuminance at the face at turn 0."""
        model, cache = self._services.model, self._unit
        if model.light is None:
            return 0.0
        if cache is None or cache[0] is not model.light or cache[1] != model.front_deg:
            unit = illuminance(model.light.searched, model.front_deg)
            self._unit = cache = (model.light, model.front_deg, unit)
        return white * cache[2]

    def _say(self, lux: float) -> None:
        unit = self._lux(1.0)
        if unit <= 0.0:
            self._error = tr("No light comes from where the photographer stands.")
            self._changed()
            return
        self._keep(check_lux(lux) / unit)

    def _keep(self, white: float | None) -> None:
        model = self._services.model
        self.asking, self._error = False, ""
        if model.place is not None:
            # The window keeps the place with it.
            model.update(place=replace(model.place, said_white_cd_m2=white))
        elif model.light is not None:
            self._loose = None if white is None else (model.light, white)
        self._changed()
