"""The Light screen: which styles a lamp brings within reach, and where to hold it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.angles import wrap
from app.core.second_light.numbers import KINDS, at_distance
from app.core.second_light.placements import ALTITUDES_DEG
from app.core.second_light.scale import illuminance
from app.core.second_light.words import metres
from app.ui.presenters.actions import Action
from app.ui.presenters.light_jobs import LightWork
from app.ui.presenters.light_lamps import Shelf, nearest_stop
from app.ui.presenters.light_resolve import Resolver, Shown, front_of
from app.ui.presenters.light_state import (
    BRIGHTNESS,
    DISTANCES_M,
    LampState,
    LightSizes,
    LightState,
    LightView,
)
from app.ui.presenters.light_words import lux_words, rescued, weak_words
from app.ui.presenters.light_work import (
    Question,
    best_spot,
)
from app.ui.presenters.model import Step

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from app.core.second_light.search import Placed
    from app.core.solve import Objective
    from app.ui.presenters.desk import Desk
    from app.ui.presenters.light_work import Answers, Lamp, Spot
    from app.ui.presenters.services import Services

__all__ = ["LightPresenter"]

_ASKED_ANEW: Final = frozenset({"head", "light", "front_deg", "settings", "place_folder", "place"})
_HIGHEST_DEG: Final = float(ALTITUDES_DEG[-1])
_NO_LAMP: Final = "No lamp chosen. A phone at full brightness is a good first try."
_NO_LIGHT: Final = "No light measured yet. A lamp is placed in the light of a place."
_UNKNOWN: Final = (
    "This lamp was captured with unknown exposure. Type its power or capture it again."
)


class LightPresenter:
    """Resolves the screen, and takes what the user does there.

    Parameters
    ----------
    services : Services
        The window's.
    desk : Desk
        The window's.

    Attributes
    ----------
    shelf : Shelf
        Lamps to choose from.
    work : LightWork
        What is worked out in the background.
    """

    def __init__(self, services: Services, desk: Desk) -> None:
        self._services = services
        del desk
        self.shelf = Shelf(services, self._pursue, self.take_lamp)
        self._view: LightView | None = None
        self._in_front = True
        self._sizes = LightSizes()
        self._resolver = Resolver()
        self._stop = nearest_stop(0.3)
        self._arm, self._floor = False, True
        self._bright: dict[object, str] = {}
        self._spot: Spot | None = None
        self.work = LightWork(services, self._worked, self._answered)
        services.model.changed.connect(self._model_changed)

    # -- what the frame calls ------------------------------------------------------------------

    def attach(self, view: LightView) -> None:
        """Show everything in `view` from now on."""
        self._view = view
        self.shelf.attach(view)
        self.shelf.refresh()
        self._pursue()

    def detach(self) -> None:
        """Show nothing any more."""
        self._view = None
        self.shelf.attach(None)

    def entered(self) -> None:
        """Go on with what has changed meanwhile."""
        self._in_front = True
        self._pursue()

    def left(self) -> None:
        """Nobody looks: nothing new is begun."""
        self._in_front = False

    def actions(self) -> Sequence[Action]:
        """List what can be done here; what has hints comes first."""
        works = self._works
        return (
            Action("lamp-move", "Move the lamp", self.focus_lamp, "bulb", "", works,
                   hint="move lamp", keys="Arrows"),
            Action("lamp-best", "Back to the best place of the lamp", self.go_best, "target", "",
                   works, hint="best place", keys="Home"),
            Action("lamp-turn", "Turn first, then hold the lamp", self.turn, "turn",
                   "T; Return; Enter", works, hint="turn first", keys="T"),
            Action("lamp-own", "Capture a lamp of your own", self.shelf.begin, "plus"),
        )  # fmt: skip

    # -- what the view calls -------------------------------------------------------------------

    def sized(self, sizes: LightSizes) -> None:
        """Learn how large pictures are on the screen."""
        if sizes != self._sizes:
            self._sizes = sizes
            self._pursue()

    def take_lamp(self, key: str) -> None:
        """Choose a lamp; see `LampState.items`."""
        if key != self.shelf.key:
            self.shelf.choose(key)
            if (usual := self.shelf.usual_m) is not None:
                self._stop = nearest_stop(usual)
            self._begin_anew()

    def move_away(self, stop: int) -> None:
        """Hold the lamp nearer or farther; the answers follow."""
        stop = min(max(stop, 0), len(DISTANCES_M) - 1)
        if stop != self._stop and not self.shelf.fixed:
            self._stop = stop
            self._begin_anew()

    def come_closer(self) -> None:
        """Hold the lamp where it would rescue something."""
        if self.work.nearer is not None:
            self.move_away(nearest_stop(self.work.nearer.distance_m))

    def set_arm(self, on: bool) -> None:
        """Allow only what an arm can reach."""
        self._arm = on
        self._begin_anew()

    def set_floor(self, on: bool) -> None:
        """Allow nothing under the floor."""
        self._floor = on
        self._begin_anew()

    def set_brightness(self, key: str) -> None:
        """Say how bright the place is; see `BRIGHTNESS`."""
        self._bright[self._place_key()] = key
        self._begin_anew()

    def press(self, key: str) -> None:
        """Do what a button of the empty screen says."""
        if key == "phone":
            self.take_lamp("phone")
        elif key == "probe":
            self._services.model.update(step=Step.PROBE, painting=None)
        elif key == "capture":
            self.shelf.begin()
        elif key == "again":
            self.work.forget()
            self._pursue()

    def choose(self, name: str) -> None:
        """Bring a style to the front, with the lamp at its best place."""
        self._spot = None
        self._services.model.choose(name)
        self._pursue()

    def hold_at(self, azimuth_deg: float, altitude_deg: float) -> None:
        """Hold the lamp elsewhere: drawings, words and pictures follow.

        Parameters
        ----------
        azimuth_deg, altitude_deg : float
            Deg, positive toward the sitter's left and upward; the latter is kept within the band
            that is searched.
        """
        if self.work.answers is not None:
            height = min(max(altitude_deg, -_HIGHEST_DEG), _HIGHEST_DEG)
            self._spot = (wrap(azimuth_deg), height)
            self._pursue_view()
            self._refresh()

    def go_best(self) -> None:
        """Put the lamp back to its best place."""
        self._spot = None
        self._pursue_view()
        self._refresh()

    def turn(self) -> None:
        """Go to the turn that belongs to the lamp."""
        one = self.front
        if one is not None:
            self._services.model.update(
                chosen=one.name, needle_deg=None, goal_deg=one.turn_refined_deg, step=Step.TURN
            )

    def focus_lamp(self) -> None:
        """Give the keyboard to the lamp."""
        if self._view is not None:
            self._view.take_lamp_focus()

    def take_pictures(self, paths: Sequence[Path]) -> None:
        """Take in the pictures of a lamp of one's own."""
        self.shelf.take(paths)

    # -- resolving -----------------------------------------------------------------------------

    def resolve(self) -> LightState:
        """Work out what the screen shows now."""
        state = LightState(lamp=self._lamp_state(), capturing=self.shelf.capturing)
        model = self._services.model
        if model.light is None:
            return replace(state, empty=_NO_LIGHT, actions=(("probe", "Go to Probe"),))
        if not self.shelf.key:
            return replace(
                state,
                empty=_NO_LAMP,
                actions=(("phone", "Take the phone"), ("capture", "Capture a lamp")),
            )
        if self.shelf.incomparable:
            return replace(state, empty=_UNKNOWN, actions=(("capture", "Capture it again"),))
        if self._gain() is None:
            return replace(state, asks=True)
        if self.work.trouble:
            return replace(state, empty=self.work.trouble, actions=(("again", "Try again"),))
        return self._with_answers(state)

    def _with_answers(self, state: LightState) -> LightState:
        answers, one = self.work.answers, self.front
        state = replace(state, busy=self.work.busy)
        if answers is None or one is None:
            return state
        best = best_spot(one)
        spot = best if self._spot is None else self._spot
        shown = Shown(answers, one, spot, self._distance_m(), self.work.view)
        heads = self._resolver.heads(shown)
        note, action = self._note(answers)
        return replace(
            state,
            sections=self._resolver.sections(answers, one.name, self.work.rows, self.work.version),
            note=note,
            note_action=action,
            hold=self._resolver.hold(shown, heads),
            heads=heads,
            sky=self._resolver.sky(shown),
            detail=self._resolver.detail(shown),
        )

    def _lamp_state(self) -> LampState:
        model = self._services.model
        measured = ""
        if model.light is not None and (white := self._white()) is not None:
            lux = white * illuminance(model.light.searched, model.front_deg)
            measured = f"{lux_words(lux)} at the face, as measured"
        return LampState(
            items=self.shelf.items,
            key=self.shelf.key,
            distance=self._stop,
            distance_words=metres(self._distance_m()),
            distance_fixed=self.shelf.fixed,
            arm=self._arm,
            floor=self._floor,
            brightness=self._bright.get(self._place_key(), ""),
            measured=measured,
        )

    def _note(self, answers: Answers) -> tuple[str, str]:
        out = [one for one in answers.placed if not one.before.attainable]
        if not out:
            return "Every style is in reach here. A lamp can still make some better.", ""
        if rescued(answers.placed) or self.work.busy:
            return "", ""
        if not answers.allowed.all():
            return "Nothing is rescued from where you can hold it. Allow more places.", ""
        if self.work.coming_closer:
            return f"This lamp is too weak at {metres(self._distance_m())}.", ""
        known = self.work.nearer
        if known is None:
            return weak_words(self._distance_m(), None, 0.0)
        return weak_words(self._distance_m(), known.one, known.distance_m)

    # -- what is worked out --------------------------------------------------------------------

    def _begin_anew(self) -> None:
        self._spot = None
        self._pursue()

    def _pursue(self) -> None:
        """Begin whatever is missing, and show what there is."""
        if self._in_front and self._view is not None:
            head, lamp, question = self._services.model.head, self._lamp(), self._question()
            if head is not None:
                self.work.make_rows(head, self._sizes.row)
            if head is not None and lamp is not None and question is not None:
                self.work.place(head, lamp, question)
            self._pursue_view()
        self._refresh()

    def _pursue_view(self) -> None:
        one, answers = self.front, self.work.answers
        if one is not None and answers is not None and self._in_front:
            spot = best_spot(one) if self._spot is None else self._spot
            self.work.look_at(answers, one.name, spot, self._sizes.portrait)

    def _answered(self) -> None:
        """There are new answers: the lamp goes to its best place."""
        self._spot = None
        self._pursue()

    def _worked(self) -> None:
        self._pursue_view()
        self._refresh()

    # -- what it is about ----------------------------------------------------------------------

    def _lamp(self) -> Lamp | None:
        key = self.shelf.key
        if key in KINDS:
            return at_distance(KINDS[key], DISTANCES_M[self._stop])
        return None if self.shelf.incomparable else self.shelf.own

    def _distance_m(self) -> float:
        own = self.shelf.own
        if own is not None and own.distance_m is not None:
            return own.distance_m
        return DISTANCES_M[self._stop]

    def _question(self) -> Question | None:
        model, gain = self._services.model, self._gain()
        if model.light is None or gain is None:
            return None
        settings = model.settings
        objective: Objective = "paper" if settings.objective == "paper" else "picture"
        return Question(
            light=model.light,
            gain=gain,
            front_deg=model.front_deg,
            arm=self._arm,
            floor=self._floor,
            distance_m=self._distance_m(),
            objective=objective,
            epsilon=settings.match_limit,
            min_strength=settings.strength_limit,
        )

    def _white(self) -> float | None:
        """Luminance of radiance 1 here, cd/m2, where that was measured."""
        place = self._services.model.place
        return place.capture.white_cd_m2 if place is not None and place.capture else None

    def _gain(self) -> float | None:
        """Luminance of radiance 1: measured, or from what the user says."""
        model, white = self._services.model, self._white()
        if model.light is None or white is not None:
            return white
        lux = {key: value for key, _, value in BRIGHTNESS}.get(
            self._bright.get(self._place_key(), "")
        )
        own = illuminance(model.light.searched, model.front_deg)
        return None if lux is None else lux / max(own, float(np.finfo(np.float32).tiny))

    def _place_key(self) -> object:
        model = self._services.model
        return model.place_folder or model.light

    @property
    def front(self) -> Placed | None:
        """Answer for the style in front; None until there is one."""
        if self.work.answers is None:
            return None
        return front_of(self.work.answers, self._services.model.chosen)

    def _works(self) -> bool:
        return self.front is not None

    def _model_changed(self, names: frozenset[str]) -> None:
        if "light" in names or "head" in names:
            # Of another place or sitter.
            self.work.clear()
            self._spot = None
        if "chosen" in names:
            self._spot = None
        if names & _ASKED_ANEW or "chosen" in names:
            self._pursue()

    def _refresh(self) -> None:
        if self._view is not None and self._in_front:
            self._view.show_state(self.resolve())
