"""The jobs of the Light screen, which prepare lamps, place them and render pictures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from threading import Lock
from typing import Final

from app.core.base.arrays import Bytes
from app.core.base.errors import CoreError
from app.core.base.progress import Report, Token
from app.core.portrait.head import Head
from app.core.second_light.in_hand import (
    InHand,
    Lamp,
    LampHead,
    prepare_head,
    take_in_hand,
)
from app.core.second_light.lamp_answers import (
    Answers,
    LampPosition,
    LampQuestion,
    Nearer,
    ask,
    closer,
    seen_from,
)
from app.core.second_light.lamp_presets import NEAREST_M, NumbersLamp
from app.core.second_light.search import LampPlacement
from app.core.solver.lens.lens_wish import STRAIGHT
from app.core.text import tr
from app.devices.clock import wait
from app.ui.presenters.services import Services
from app.ui.presenters.window_model import LampPlan
from app.ui.screens.light.lamp import DISTANCES_M, lamp_name, nearest_stop
from app.ui.screens.light.placement.pictures import (
    LampView,
    Size,
    look,
    portrait_with,
    result_with,
    targets,
)
from app.ui.screens.light.placement.result import LampResult
from app.ui.screens.light.style_list import rescued
from app.ui.screens.light.two_steps import HoldState

_HEAD: Final = "light-head"

_LAMP: Final = "light-lamp"

_PLACES: Final = "light-places"

_VIEW: Final = "light-view"

_CLOSER: Final = "light-closer"

_ROWS: Final = "light-rows"

_PLAN: Final = "light-plan"

_LENS: Final = "light-lens"

_LITTLE_M: Final = 0.02
_REST_S: Final = 1.5


class _LampHeads:
    """Prepares a head for lamps once, for whichever job needs it first."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._latest: LampHead | None = None

    def of(self, head: Head, token: Token) -> LampHead:
        with self._lock:
            if self._latest is None or self._latest.head is not head:
                self._latest = prepare_head(head, token)
            return self._latest


class LightWork:
    """Prepares lamps, places them and renders pictures, without computing anything twice.

    Attributes:
        rows: Target portraits for the list.
        version: Number of times that `rows` have been rendered.
    """

    def __init__(
        self, services: Services, changed: Callable[[], None], answered: Callable[[], None]
    ) -> None:
        self._services = services
        self._changed = changed
        self._answered = answered
        self.answers: Answers | None = None
        self.view: LampView | None = None
        self.rows: dict[str, Bytes] = {}
        self.version = 0
        self.trouble = ""
        self._nearer: Nearer | None = None
        self._tried_closer: Answers | None = None
        self._heads = _LampHeads()
        self._ready: Head | None = None
        self._hand: InHand | None = None
        self._rows_key: tuple[object, ...] = ()
        self._asked_lamp: tuple[object, ...] = ()
        self._asked_places: tuple[object, ...] = ()
        self._view_key: tuple[Answers, str, LampPosition, Size] | None = None
        self.looking = False
        self._lens: tuple[LampPlacement | None, LampPlacement | None] = (None, None)

    @property
    def busy(self) -> bool:
        """Whether new answers are being computed."""
        runner = self._services.runner
        return runner.running(_LAMP) or runner.running(_PLACES)

    def is_current(
        self, head: Head | None, lamp: Lamp | None, question: LampQuestion | None
    ) -> bool:
        """Return whether the answers are for this head, lamp and question."""
        answers = self.answers
        if answers is None or question is None:
            return answers is None
        hand = answers.hand
        return hand.head is head and hand.lamp == lamp and answers.question.key == question.key

    @property
    def coming_closer(self) -> bool:
        """Whether the search at a shorter distance is running."""
        return self._services.runner.running(_CLOSER)

    @property
    def nearer(self) -> Nearer | None:
        """The effect of the lamp at a shorter distance, or None until the effect is computed."""
        nearer = self._nearer
        return nearer if nearer is not None and nearer.answers is self.answers else None

    def clear(self) -> None:
        """Discard the results because the place or the sitter has changed."""
        self.answers = self.view = self._view_key = None

    def forget(self) -> None:
        """Discard the last question, which is then asked again."""
        self._asked_lamp = self._asked_places = ()
        self.trouble = ""

    # -- the list's pictures --------------------------------------------------------------------

    def make_rows(self, head: Head, size: Size) -> None:
        """Render the target portraits of all styles."""
        if self._rows_key == (head, size):
            return
        self._rows_key = (head, size)

        def done(rows: dict[str, Bytes]) -> None:
            self.rows = rows
            self.version += 1
            self._changed()

        self._services.runner.submit(_ROWS, lambda *_: targets(head, size), done=done)

    # -- lamp and positions --------------------------------------------------------------------

    def make_ready(self, head: Head) -> None:
        """Prepare a head for lamps before a lamp is selected."""
        if self._ready is not head:
            self._ready = head
            self._services.runner.submit(
                _HEAD, lambda token, _: self._heads.of(head, token), failed=lambda _: None
            )

    def place(self, head: Head, lamp: Lamp, question: LampQuestion) -> None:
        """Place a lamp, first preparing the lamp if necessary."""
        # Lamps defined by specifications are white.
        grey = question.objective == "paper" and not isinstance(lamp, NumbersLamp)
        if self._asked_lamp != (head, lamp, grey):
            self._try(head, lamp, grey)
        hand = self._hand
        if hand is not None and self._asked_lamp == (hand.head, hand.lamp, hand.grey):
            self._ask(hand, question)

    def _try(self, head: Head, lamp: Lamp, grey: bool) -> None:
        self._asked_lamp, self._asked_places = (head, lamp, grey), ()
        self.trouble = ""

        def work(token: Token, report: Report) -> InHand:
            return take_in_hand(self._heads.of(head, token), lamp, token, report, grey)

        self._services.runner.cancel(_CLOSER)
        self._services.runner.submit(
            _LAMP,
            work,
            title=tr("Trying {lamp} all around the head", lamp=lamp_name(lamp)),
            done=self._in_hand,
            failed=self._failed,
            cancelled=self._stopped,
        )

    def _in_hand(self, hand: InHand) -> None:
        if self._asked_lamp == (hand.head, hand.lamp, hand.grey):
            self._hand = hand
            self._answered()

    def _failed(self, error: Exception) -> None:
        self.trouble = str(error)
        if not isinstance(error, CoreError):
            self._services.notify.tell_error(error)
            self.trouble = tr("The lamp could not be placed.")
        self._changed()

    def _stopped(self) -> None:
        """Report that the user cancelled the search, unless a newer lamp is being prepared."""
        if not self._services.runner.running(_LAMP):
            self.trouble = tr("Stopped before all positions were tried.")
            self._changed()

    def _ask(self, hand: InHand, question: LampQuestion) -> None:
        request = (hand, question.key)
        if self._asked_places == request:
            return
        self._asked_places = request
        # The search at a shorter distance is for the old question, and it takes 50 MB.
        self._services.runner.cancel(_CLOSER)
        self._services.runner.submit(
            _PLACES, lambda *_: ask(hand, question), done=self._on_answers, failed=self._failed
        )

    def _on_answers(self, answers: Answers) -> None:
        if self._asked_places == (answers.hand, answers.question.key):
            self.answers, self.trouble = answers, ""
            self._come_closer(answers)
            self._answered()

    def _come_closer(self, answers: Answers) -> None:
        """Try the lamp at half the distance if it brings no style within reach.

        This takes as much time and memory as the search itself, so it waits for the hand to rest.
        """
        if self._tried_closer is answers:
            return
        lamp = answers.hand.lamp
        out = [one.name for one in answers.placements if not one.before.attainable]
        if rescued(answers.placements) or not out or not isinstance(lamp, NumbersLamp):
            return
        near_m = max(NEAREST_M, DISTANCES_M[nearest_stop(lamp.distance_m / 2.0)])
        if near_m > lamp.distance_m - _LITTLE_M or not answers.is_open.all():
            return
        nearer = replace(lamp, distance_m=near_m)

        def work(token: Token, report: Report) -> LampPlacement | None:
            wait(self._services.clock, _REST_S, token)
            return closer(answers, nearer, out, token, report)

        def done(placement: LampPlacement | None) -> None:
            self._tried_closer = answers
            self._nearer = None if placement is None else Nearer(answers, placement, near_m)
            self._changed()

        self._services.runner.submit(
            _CLOSER,
            work,
            done=done,
            failed=lambda error: None,
        )

    def lens_of(self, one: LampPlacement) -> LampPlacement | None:
        """Return the placement with the lens off the nose's axis, or None until computed."""
        return self._lens[1] if self._lens[0] is one else None

    def find_lens(self, answers: Answers, one: LampPlacement) -> None:
        """Find the best lens position for a style if the lens may leave the nose's axis."""
        if answers.question.lens == STRAIGHT or self._lens[0] is one:
            return
        self._lens = (one, None)

        def done(placement: LampPlacement) -> None:
            if self._lens[0] is one:
                self._lens = (one, placement)
                self._changed()

        self._services.runner.submit(
            _LENS, lambda *_: seen_from(answers, one), done=done, failed=self._failed
        )

    # -- the way to the turn -------------------------------------------------------------------

    def plan(
        self, result: LampResult, match: float, hold: HoldState, done: Callable[[LampPlan], None]
    ) -> None:
        """Build a plan to turn first and then hold the lamp, and pass that plan to `done`."""
        answers, name, position = result.answers, result.one.name, result.position

        def work() -> LampPlan:
            result = result_with(answers, name, position, match)
            head, light, lamp = answers.hand.head, answers.question.light, answers.hand.lamp
            words = (lamp_name(lamp), hold.hold, hold.hold_line)
            portrait = partial(portrait_with, answers, name, position)
            return LampPlan(head, light, *words, result, portrait, position.azimuth_deg)

        self._services.runner.submit(_PLAN, lambda *_: work(), done=done)

    # -- pictures ------------------------------------------------------------------------------

    def look_at(self, answers: Answers, name: str, position: LampPosition, size: Size) -> None:
        """Render pictures. While a job is running, only the newest request is queued.

        If every movement of the lamp cancelled the running job, no picture would ever be finished.
        """
        self._view_key = (answers, name, position, size)
        view = self.view
        view_key = view and (view.answers, view.name, view.position, view.size)
        if self.looking or view_key == self._view_key:
            return
        self._come_closer(answers)
        self.looking = True
        self._services.runner.submit(
            _VIEW,
            lambda *_: look(answers, name, position, size, view),
            done=self._looked,
            failed=self._not_looked,
            cancelled=self._looked_away,
        )

    def _looked(self, view: LampView) -> None:
        self.looking, self.view = False, view
        if self._view_key is not None:
            self.look_at(*self._view_key)
        self._changed()

    def _not_looked(self, error: Exception) -> None:
        self.looking = False
        self._failed(error)

    def _looked_away(self) -> None:
        self.looking = False
