"""The Light screen, which shows which styles a lamp brings within reach and where to hold it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Protocol

from app.core.base.angles import wrap
from app.core.second_light.lamp_answers import (
    LampPosition,
    best_held,
    powers_for,
)
from app.core.second_light.place_brightness import compare
from app.core.second_light.placements import ALTITUDES_DEG
from app.core.second_light.search import LampPlacement
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Presenter, Services
from app.ui.presenters.window_model import LampPlan, Step
from app.ui.screens.light.brightness import BrightState, PlaceScale
from app.ui.screens.light.detail import LampDetailState, detail_of
from app.ui.screens.light.drag_cache import Resolver
from app.ui.screens.light.lamp import DISTANCES_M, LampHold, LampState, lamp_name, nearest_stop
from app.ui.screens.light.lamp_list import LampList
from app.ui.screens.light.own_lamp.actions import LampActions
from app.ui.screens.light.own_lamp.sheets import LampSheets
from app.ui.screens.light.placement.jobs import LightWork
from app.ui.screens.light.placement.pictures import Size
from app.ui.screens.light.placement.result import LampResult
from app.ui.screens.light.placement.sky import SkyState
from app.ui.screens.light.style_list import Section, front_of, note_of
from app.ui.screens.light.two_steps import HeadsState, HoldState, hold_of, way_icon
from app.words.lamps import comparison_sentence, comparison_words


@dataclass(frozen=True, slots=True)
class LightSizes:
    """The sizes of the pictures in the view, each in rows and columns of device pixels."""

    row: Size = (56, 56)
    portrait: Size = (176, 160)


@dataclass(frozen=True, slots=True, eq=False)
class LightState:
    """The state of the Light screen.

    Attributes:
        actions: Key and label for each button.
        meter: Sentence explaining that the lamp in use cannot be compared with the place unless the
            user enters its brightness. The sentence replaces the drawings. It is empty if the lamp
            can be compared.
        capturing: Whether a captured lamp is being loaded.
        stale: Whether the answers are for another selection and therefore dimmed under
            "Computing…".
        note: Text above the list, such as "This lamp is too weak at 30 cm. …".
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


class LightView(LampSheets, Protocol):
    """A view that shows a `LightState`."""

    def show_state(self, state: LightState) -> None:
        """Show the state."""

    def take_lamp_focus(self) -> None:
        """Focus the map of lamp positions."""


_ASKED_ANEW: Final = frozenset({"head", "light", "front_deg", "settings", "place_folder", "place"})
_HIGHEST_DEG: Final = float(ALTITUDES_DEG[-1])
TRYING: Final = tr("Trying {lamp} all around the head…")
STILL_SHOWING: Final = tr("Still showing {lamp}.")
_NO_LAMP: Final = tr("No lamp chosen. A phone at full brightness is a good first try.")
_NO_LIGHT: Final = tr("No light measured yet. Measure a place before adding a lamp.")


class LightPresenter(Presenter[LightView]):
    """Resolves the state of the screen, and handles the user's actions."""

    def __init__(self, services: Services, place_controller: PlaceController) -> None:
        super().__init__(services)
        self.lamps = LampList(services, self._pursue, self.take_lamp)
        self.lamp_actions = LampActions(services, place_controller, self.lamps)
        self.scale = PlaceScale(services, self._begin_anew)
        self._hand = LampHold(services, self.lamps, self.scale)
        self._sizes = LightSizes()
        self._resolver = Resolver()
        self._position: LampPosition | None = None
        self._going = False
        self.work = LightWork(services, self._worked, self._answered)
        services.model.changed.connect(self._model_changed)

    # -- what the frame calls ------------------------------------------------------------------

    def attach(self, view: LightView) -> None:
        """Start showing the state in `view`."""
        self._view = view
        self.lamps.view = view
        self.lamps.refresh()
        self._pursue()

    def detach(self) -> None:
        """Stop showing the state."""
        self._view = self.lamps.view = None

    def enter(self) -> None:
        """Apply any changes made on other screens."""
        self._in_front = True
        self._pursue()

    def leave(self) -> None:
        """Start no new jobs while the screen is hidden."""
        self._in_front = self._going = False

    def actions(self) -> Sequence[Action]:
        """Return the actions of this screen, starting with those that have hints."""
        works = self._works
        way = "turn" if self.front is None else way_icon(self.front.turn_refined_deg)
        # Without a lamp there is nothing to move.
        move, best, turn = (
            (tr("move lamp"), tr("best place"), tr("turn first")) if self.lamps.key else ("",) * 3
        )
        return (
            Action("lamp-move", tr("Move the lamp"), self.focus_lamp, "bulb", "", works,
                   hint=move, keys=tr("Arrows")),
            Action("lamp-best", tr("Return the lamp to its best place"), self.go_best, "target",
                   "", works, hint=best, keys="Home"),
            Action("lamp-turn", tr("Turn first, then hold the lamp"), self.turn, way,
                   "T; Return; Enter", works, hint=turn, keys="T"),
            Action("lamp-weaker", tr("Turn the lamp down"), lambda: self.step_power(-1), "minus",
                   "", lambda: self._may_step(-1), keys="PgDn"),
            Action("lamp-stronger", tr("Turn the lamp up"), lambda: self.step_power(1), "plus", "",
                   lambda: self._may_step(1), keys="PgUp"),
            Action("light-back", tr("Back to the styles"),
                   lambda: self._services.model.update(step=Step.STYLES), "styles", "Esc"),
            Action("lamp-own", tr("Capture your own lamp"), self.lamps.begin, "plus"),
            Action("lamp-bright", tr("How bright is it here?"), self.scale.ask, "sun", "",
                   lambda: self._services.model.light is not None),
            *self.lamp_actions.actions(),
        )  # fmt: skip

    # -- what the view calls -------------------------------------------------------------------

    def sized(self, sizes: LightSizes) -> None:
        """Set the sizes of the pictures on the screen."""
        if sizes != self._sizes:
            self._sizes = sizes
            self._pursue()

    def take_lamp(self, key: str) -> None:
        """Select the lamp with the given key in `LampState.items`."""
        if key != self.lamps.key:
            self.lamps.choose(key)
            if (usual := self.lamps.usual_m) is not None:
                self._hand.stop = nearest_stop(usual)
            self._begin_anew()

    def move_away(self, stop: int) -> None:
        """Set the distance of the lamp to a stop of the slider, and search again."""
        stop = min(max(stop, 0), len(DISTANCES_M) - 1)
        if stop != self._hand.stop and not self.lamps.fixed:
            self._hand.stop = stop
            self._begin_anew()

    def come_closer(self) -> None:
        """Move the lamp to the shorter distance that brings a style within reach."""
        if self.work.nearer is not None:
            self.move_away(nearest_stop(self.work.nearer.distance_m))

    def set_arm(self, on: bool) -> None:
        """Set whether to limit the positions to those within arm's reach."""
        self._hand.arm = on
        self._begin_anew()

    def set_floor(self, on: bool) -> None:
        """Set whether to limit the positions to those above floor level."""
        self._hand.floor = on
        self._begin_anew()

    def press(self, key: str) -> None:
        """Perform the action of a button in the empty state."""
        if key == "phone":
            self.take_lamp("phone")
        elif key == "probe":
            self._services.model.update(step=Step.PROBE, painting=None)
        elif key == "capture":
            self.lamps.begin()
        elif key == "again":
            self.work.forget()
            self._pursue()

    def choose(self, name: str) -> None:
        """Select a style, and move the lamp to its best position."""
        self._position = None
        self._services.model.choose(name)
        self._pursue()

    def hold_at(self, azimuth_deg: float, altitude_deg: float) -> None:
        """Move the lamp to a direction, and update the drawings, the text and the pictures.

        Args:
            azimuth_deg: Azimuth in degrees, positive towards the sitter's left.
            altitude_deg: Altitude in degrees, positive upwards. It is clamped to the range that was
                searched.
        """
        position = self._now
        if position is not None:
            height = min(max(altitude_deg, -_HIGHEST_DEG), _HIGHEST_DEG)
            self._hold(LampPosition(wrap(azimuth_deg), height, position.power))

    def step_power(self, steps: int) -> None:
        """Change the power of the lamp by whole stops, without moving the lamp."""
        position = self._now
        if position is not None and self._may_step(steps):
            powers = self._powers()
            self._hold(position._replace(power=powers[powers.index(position.power) - steps]))

    def go_best(self) -> None:
        """Return the lamp to its best position and power."""
        self._hold(None)

    def _hold(self, position: LampPosition | None) -> None:
        self._position, self._going = position, False
        self._pursue_view()
        self._refresh()

    def turn(self) -> None:
        """Go to the turn that belongs to the lamp's position."""
        self._going = True
        self._go()

    def _go(self) -> None:
        """Go to the turn as soon as the match at the lamp's position has been computed."""
        result = self._result if self._going and not self.stale else None
        match = None if result is None else result.match
        if result is None or match is None:
            return
        self._going = False
        hold = hold_of(result, self._resolver.heads(result))
        selection = self._services.model.selection

        def done(plan: LampPlan) -> None:
            self._turn_with(replace(plan, selection=selection))

        self.work.plan(result, match, hold, done)

    @property
    def stale(self) -> bool:
        """Whether the answers are for another selection."""
        model = self._services.model
        is_loaded = model.head is not None and model.head.name == model.head_name
        head = model.head if is_loaded else None
        return not self.work.is_current(head, self._hand.lamp(), self._hand.question())

    def _turn_with(self, plan: LampPlan) -> None:
        model, position = self._services.model, self._position
        goal = wrap(plan.result.turn_refined_deg - model.front_deg)
        model.update(
            chosen=plan.result.name, needle_deg=None, goal_deg=goal, plan=plan, step=Step.TURN
        )
        self._position = position

    def focus_lamp(self) -> None:
        """Focus the map of lamp positions."""
        if self._view is not None:
            self._view.take_lamp_focus()

    # -- state ---------------------------------------------------------------------------------

    def resolve(self) -> LightState:
        """Return the state of the screen."""
        state = LightState(
            lamp=self._hand.state(), bright=self.scale.state(), capturing=self.lamps.capturing
        )
        if self._services.model.light is None:
            return replace(state, empty=_NO_LIGHT, actions=(("probe", tr("Go to Probe")),))
        if not self.lamps.key:
            return replace(
                state,
                empty=_NO_LAMP,
                actions=(("phone", tr("Use the phone")), ("capture", tr("Capture a lamp"))),
            )
        if self.lamps.own is not None and self.lamps.own.white_cd_m2 is None:
            meter = comparison_words(compare(self.scale.white, self.lamps.own))
            return replace(state, meter=meter, meter_error=self.lamp_actions.trouble)
        if self.scale.white is None or self.scale.asking:
            return replace(state, asks=True)
        if self.work.trouble:
            return replace(state, empty=self.work.trouble, actions=(("again", tr("Try again")),))
        return self._with_answers(state)

    def _with_answers(self, state: LightState) -> LightState:
        work, result = self.work, self._result
        state = replace(state, busy=work.busy, stale=self.stale)
        if result is None:
            return state
        heads = self._resolver.heads(result)
        nearer = (work.busy, work.coming_closer, work.nearer)
        note, action = note_of(result.answers, result.distance_m, *nearer)
        if state.stale:
            note, action = "", ""
        return replace(
            state,
            sections=self._resolver.sections(result, work.rows, work.version),
            note=" ".join(
                part for part in (comparison_sentence(self._hand.comparison()), note) if part
            ),
            note_action=action,
            hold=replace(self._hold_state(result, heads), turn_works=False)
            if state.stale
            else self._hold_state(result, heads),
            heads=heads,
            sky=self._resolver.sky(result),
            detail=detail_of(result),
        )

    def _hold_state(self, result: LampResult, heads: HeadsState) -> HoldState:
        """Return the two steps, or a message while a different lamp is being tried."""
        hold, lamp, lamp_in_hand = (
            hold_of(result, heads),
            self._hand.lamp(),
            result.answers.hand.lamp,
        )
        if not self.work.busy or lamp is None or lamp_name(lamp) == lamp_name(lamp_in_hand):
            return hold
        trying = TRYING.format(lamp=lamp_name(lamp))
        still = STILL_SHOWING.format(lamp=lamp_name(lamp_in_hand))
        return replace(hold, hold=trying, hold_line=still, turn_works=False)

    # -- jobs ----------------------------------------------------------------------------------

    def _begin_anew(self) -> None:
        self._position = None
        self._pursue()

    def _pursue(self) -> None:
        """Start any jobs that are still needed, and show the results so far."""
        if self._in_front and self._view is not None:
            head, lamp, question = (
                self._services.model.head,
                self._hand.lamp(),
                self._hand.question(),
            )
            if head is not None:
                self.work.make_rows(head, self._sizes.row)
            if head is not None and self._services.model.light is not None:
                self.work.make_ready(head)
            if head is not None and lamp is not None and question is not None:
                self.work.place(head, lamp, question)
            self._pursue_view()
        self._refresh()

    def _pursue_view(self) -> None:
        if (result := self._result) is not None and self._in_front:
            name = result.one.name
            self.work.look_at(result.answers, name, result.position, self._sizes.portrait)
            self.work.find_lens(result.answers, result.one)

    def _answered(self) -> None:
        """Move the lamp to the best position in the new answers."""
        self._position = None
        self._pursue()

    def _worked(self) -> None:
        self._pursue_view()
        self._go()
        self._refresh()

    @property
    def front(self) -> LampPlacement | None:
        """Placement for the selected style, or None until it has been found."""
        if self.work.answers is None:
            return None
        return front_of(self.work.answers, self._services.model.pack_style)

    @property
    def _now(self) -> LampPosition | None:
        """Current position of the lamp, or None while its best position is unknown."""
        one = self.front
        return self._position or (None if one is None else best_held(one))

    @property
    def _result(self) -> LampResult | None:
        """The selected style with the lamp at its current position, or None until it is known."""
        answers, one, position = self.work.answers, self.front, self._now
        if answers is None or one is None or position is None:
            return None
        newest, lens = self.work.view, self.work.lens_of(one)
        return LampResult(answers, one, position, self._hand.distance_m, newest, lens)

    def _powers(self) -> tuple[float, ...]:
        answers = self.work.answers
        return () if answers is None else powers_for(answers)

    def _may_step(self, steps: int) -> bool:
        position, powers = self._now, self._powers()
        return (
            position is not None
            and position.power in powers
            and 0 <= powers.index(position.power) - steps < len(powers)
        )

    def _works(self) -> bool:
        return self.front is not None

    def _model_changed(self, names: frozenset[str]) -> None:
        if "light" in names or "head" in names:
            # The results belong to another place or sitter.
            self.work.clear()
            self.scale.place_changed()
            self._position = None
        if "chosen" in names:
            self._position = None
        if names & _ASKED_ANEW or names & {"chosen", "head_name"}:
            self._pursue()
