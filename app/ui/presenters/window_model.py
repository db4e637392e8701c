"""The state of the whole window (the place, the head and the chosen style), and its events."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from app.core.base.angles import difference, wrap
from app.core.base.arrays import Bytes
from app.core.guidance.guide import Goal
from app.core.places.place import Place
from app.core.portrait.head import Head
from app.core.solver.lens.lens_wish import STRAIGHT, LensWish
from app.core.solver.turn_choice import Objective
from app.core.storage.item_library import DamagedItem
from app.core.storage.settings import Settings
from app.core.styles.lamps import Studio
from app.core.text import tr
from app.words.phrases.quantities import lower_first
from app.words.portrait.heads import head_title

if TYPE_CHECKING:
    from app.core.painting.user_style import UserStyle
    from app.core.solver.place_light import PlaceLight
    from app.core.solver.style_result import StyleResult
    from app.devices.theta.camera_identity import FoundCamera


def looking_words(head: Head) -> str:
    """Return the message to show during the search for catchlights.

    The message is empty if the head has no large portraits.
    """
    return tr("Looking for catchlights…") if head.may_be_full else ""


Callback: TypeAlias = Callable[..., None]


class Event:
    """An event with any number of callbacks, for use on a single thread.

    Examples:
        >>> heard: list[int] = []
        >>> event = Event()
        >>> event.connect(heard.append)
        >>> event.emit(3)
        >>> heard
        [3]
    """

    def __init__(self) -> None:
        self._callbacks: tuple[Callback, ...] = ()

    def connect(self, callback: Callback) -> None:
        """Call `callback` on every event. Connecting the same callback twice has no effect."""
        if callback not in self._callbacks:
            self._callbacks = (*self._callbacks, callback)

    def disconnect(self, callback: Callback) -> None:
        """Disconnect `callback`, if it is connected."""
        self._callbacks = tuple(each for each in self._callbacks if each != callback)

    def emit(self, *values: Any) -> None:
        """Call all connected callbacks.

        A callback is skipped if an earlier callback disconnects it.
        """
        for callback in self._callbacks:
            if callback in self._callbacks:
                callback(*values)


_SAME_DEG: Final = 1e-6
NEEDS_LIGHT: Final = tr("Measure or open a place first.")
NO_LIGHT: Final = tr("No light measured yet.")
COMPUTING: Final = tr("Computing…")
"""Text shown in place of an answer, or over an answer for another selection."""
DEMO_SPOT: Final = "demo"
"""Value of `Place.spot` for the demo place."""


class Step(StrEnum):
    """The screens on the rail. `Model.step` holds the current one."""

    PROBE = "probe"
    STYLES = "styles"
    TURN = "turn"
    LIGHT = "light"


@dataclass(frozen=True, slots=True)
class CameraSeen:
    """The 360 camera, as shown in the window's top bar.

    Attributes:
        battery: Charge from 0 to 1, or None if the camera does not report the charge.
    """

    device: FoundCamera
    battery: float | None = None
    free_bytes: int | None = None
    busy: bool = False


@dataclass(frozen=True, slots=True)
class Selection:
    """Everything that an answer depends on. Equal selections have equal answers.

    Attributes:
        head: The head as lit by each style's own lamps, or None while the selected head is loading.
    """

    light: PlaceLight | None
    head: Head | None
    studios: Mapping[str, Studio]
    front_deg: float
    styles: tuple[UserStyle, ...]
    objective: Objective
    lens: LensWish

    def matches_apart_from_front(self, other: Selection) -> bool:
        """Return whether built-in styles have the same answers when given as panorama azimuths."""
        one, two = (replace(each, front_deg=0.0, styles=()) for each in (self, other))
        return one == two


@dataclass(frozen=True, slots=True, eq=False)
class LampPlan:
    """The lamp to hold at a turn, shared by all screens until the sitter reaches the turn.

    Attributes:
        selection: Selection for which the lamp was placed.
        hold, where: `hold` is the instruction, such as "Hold the LED panel in front, raised 28°, at
            full power", and `where` states the lamp's distance from the head and from the skin.
        portrait: Renders a portrait, (rows, columns, 3) uint8 sRGB, with the lamp in position. Its
            arguments are the panorama azimuth that the sitter faces, in degrees, and the size as
            (rows, columns).
        azimuth_deg: Azimuth of the lamp relative to the face, in degrees, positive towards the
            sitter's left.
    """

    head: Head
    light: PlaceLight
    lamp: str
    hold: str
    where: str
    result: StyleResult = field(repr=False)
    portrait: Callable[[float, tuple[int, int]], Bytes] = field(repr=False)
    azimuth_deg: float = 0.0
    selection: Selection | None = field(default=None, repr=False)


class Model:
    """The state that several screens share.

    The state consists of frozen values and is changed only through `update`.

    Attributes:
        before: The previous step, or an empty string at the start.
        head: The head being lit, or None until a head is loaded.
        head_name: The selected head, which may still be loading.
        answered: Selection for which `results` were computed, or None if the results are from a
            file.
        needle_deg: The displayed turn, or None to display the best turn.
        goal_deg: The target turn set by "Turn to this", or None to use the best turn.
        reached: The `aim` at which the sitter was last seen in the light, or None.
        recapture: Whether Probe should capture the full range and then return to this style.
        painting: Name of the style being painted, "" for a new style, or None in the gallery.
    """

    step: str = Step.PROBE
    before: str = ""
    place_folder: Path | None = None
    place: Place | None = None
    light: PlaceLight | None = None
    opening: str = ""
    unkept: str = ""
    front_deg: float = 0.0
    head: Head | None = None
    head_name: str = ""
    results: tuple[StyleResult, ...] = ()
    answered: Selection | None = None
    user_styles: tuple[UserStyle, ...] = ()
    damaged_styles: tuple[DamagedItem, ...] = ()
    chosen: str | None = None
    needle_deg: float | None = None
    goal_deg: float | None = None
    reached: tuple[Path | None, str | None, float] | None = None
    plan: LampPlan | None = None
    painting: str | None = None
    recapture: bool = False
    camera: CameraSeen | None = None
    settings: Settings

    def __init__(self, settings: Settings | None = None) -> None:
        self.changed = Event()
        self.settings = Settings() if settings is None else settings

    def update(self, **changes: Any) -> None:
        """Set attributes, then emit a single event with the names of those that changed.

        Setting `head` also selects that head. Results that are set without `answered` belong to the
        current selection.

        Raises:
            AttributeError: If a name is unknown.
        """
        changed = set()
        if changes.get("step", self.step) != self.step:
            self.before = self.step
        if changes.get("head") is not None:
            changes.setdefault("head_name", changes["head"].name)
        for name, value in changes.items():
            before = getattr(self, name)
            # Arrays inside are never compared, so a different object counts as a different value.
            same = before is value or (isinstance(value, _PLAIN) and before == value)
            if not same:
                setattr(self, name, value)
                changed.add(name)
        if "results" in changes and "answered" not in changes:
            self.answered = self.selection
        if changed:
            self.changed.emit(frozenset(changed))

    def set(self, key: str, value: object) -> None:
        """Change a setting.

        Raises:
            SettingsError: If the value is invalid.
        """
        self.update(settings=self.settings.with_(key, value))

    def choose(self, name: str) -> None:
        """Choose another style, shown at its best turn.

        The needle and the goal are cleared because they belong to the previous style. Choosing the
        current style again keeps them.
        """
        if name != self.chosen:
            self.update(chosen=name, needle_deg=None, goal_deg=None)

    @property
    def studios(self) -> Mapping[str, Studio]:
        """Lamps of the open place, or those for new places if no place is open."""
        return self.settings.studios if self.place is None else self.place.studios

    @property
    def lens(self) -> LensWish:
        """Permitted camera positions, as azimuths of the panorama."""
        return STRAIGHT if self.place is None else self.place.lens

    @property
    def selection(self) -> Selection:
        """The current selection, on which all answers depend."""
        head, settings = self.head, self.settings
        ready = head is not None and head.name == self.head_name
        return Selection(
            light=self.light,
            head=(head.published or head) if head is not None and ready else None,
            studios=self.studios,
            front_deg=self.front_deg,
            styles=self.user_styles,
            objective=settings.objective,
            lens=self.lens,
        )

    @property
    def computing(self) -> bool:
        """Whether `results` are for another selection while new results are being computed."""
        return self.light is not None and self.answered != self.selection

    @property
    def goal_computing(self) -> bool:
        """Whether the goal's answer is for another selection.

        This is always False for a goal with a lamp.
        """
        return self.computing and self.lamp_plan is None

    @property
    def sitter(self) -> str:
        """Title of the selected head, or an empty string until a head is selected."""
        return head_title(self.head_name) if self.head_name else ""

    @property
    def calm(self) -> bool:
        """Whether animations are switched off."""
        return self.settings.reduce_motion

    @property
    def demo_open(self) -> bool:
        """Whether the open demo place is unchanged and therefore uses the demo's own webcam."""
        place = self.place
        if place is None or place.capture is None:
            return False
        return place.spot == DEMO_SPOT and place.capture.plan == "panorama"

    @property
    def result(self) -> StyleResult | None:
        """The answer for the chosen style, or None if there is no answer."""
        return next((one for one in self.results if one.name == self.chosen), None)

    @property
    def own_style(self) -> UserStyle | None:
        """The chosen style if it is one of the user's own, or None if it is not."""
        return next((style for style in self.user_styles if style.name == self.chosen), None)

    @property
    def pack_style(self) -> str | None:
        """Name of the chosen style in the pack.

        For an unpainted copy, this is the name of the original.
        """
        own = self.own_style
        return self.chosen if own is None else own.copy_of or self.chosen

    @property
    def lamp_plan(self) -> LampPlan | None:
        """The lamp to hold at the goal, or None if the goal has no lamp or has changed."""
        plan = self.plan
        if plan is None or self.goal_deg is None or plan.result.name != self.chosen:
            return None
        off = difference(self.azimuth_of(self.goal_deg), plan.result.turn_refined_deg)
        same = plan.head is self.head and plan.light is self.light and abs(off) < _SAME_DEG
        question = plan.selection
        if question is not None and not question.matches_apart_from_front(self.selection):
            return None
        return plan if same else None

    @property
    def goal_result(self) -> StyleResult | None:
        """The answer for the chosen style at the goal, including the goal's lamp."""
        plan = self.lamp_plan
        return self.result if plan is None else plan.result.seen_from(self.front_deg)

    @property
    def target_turn_deg(self) -> float | None:
        """Target turn, which is the goal set by the user or else the chosen style's best turn."""
        if self.goal_deg is not None:
            return self.goal_deg
        return None if self.result is None else self.result.turn_refined_deg

    @property
    def goal(self) -> Goal | None:
        """The target turn with its arc and lamp, or None if there is no target."""
        turn, plan, result = self.target_turn_deg, self.lamp_plan, self.goal_result
        if turn is None:
            return None
        arc = result.arc_at(turn) if result is not None and result.attainable else None
        lamp = "" if plan is None else lower_first(plan.hold)
        return Goal(turn, arc, lamp, 0.0 if result is None else result.yaw_deg)

    @property
    def aim(self) -> tuple[Path | None, str | None, float] | None:
        """Place, style and azimuth of the goal, used to recognise a goal that was reached."""
        if self.goal_deg is None:
            return None
        return self.place_folder, self.chosen, round(self.azimuth_of(self.goal_deg), 3)

    def azimuth_of(self, turn_deg: float) -> float:
        """Return the panorama azimuth that the sitter faces at a turn, in (-180, 180] degrees."""
        return wrap(turn_deg + self.front_deg)


_PLAIN: Final = (str, int, float, bool, Step)
