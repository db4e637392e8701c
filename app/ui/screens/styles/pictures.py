"""The jobs that render the pictures on the Styles screen, starting with small ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

from app.core.base.angles import wrap
from app.core.base.progress import Report, Token
from app.core.reasons.other_spots import results_elsewhere
from app.core.solver.style_result import StyleResult
from app.ui.presenters.services import Services
from app.ui.screens.styles.cards import front_of
from app.ui.screens.styles.detail import DetailState
from app.ui.screens.styles.detail_pictures import DetailResolver
from app.ui.screens.styles.gallery import Sizes, Snapshot, look, question_of
from app.ui.screens.styles.reason.reason import NO_REASON, AreaReason, Elsewhere, find_reason

_JOB: Final = "styles-pictures"
_LARGER_JOB: Final = "styles-pictures-larger"
_DETAIL_JOB: Final = "styles-detail-larger"
_BACKGROUND: Final = "styles-background"
_REASON_JOB: Final = "styles-detail-reason"


class StylesPictures:
    """The latest gallery and details, and the jobs that render new ones.

    Attributes:
        changed: Called when there are new pictures. Its argument specifies whether to resolve the
            details.
    """

    def __init__(self, services: Services, changed: Callable[[bool], None]) -> None:
        self._services = services
        self._changed = changed
        self._detail = DetailResolver()
        self._reasons: tuple[Snapshot | None, dict[str, AreaReason]] = None, {}
        self._large: tuple[Snapshot, Sizes, DetailState] | None = None
        self.snapshot: Snapshot | None = None
        self.detail_state = DetailState()
        self.sizes = Sizes()
        self.has_asked = False

    @property
    def busy(self) -> bool:
        """Whether the gallery is out of date."""
        runner = self._services.runner
        return runner.running(_JOB) or runner.running("solve")

    @property
    def stale(self) -> bool:
        """Whether the gallery is for another selection."""
        snapshot = self.snapshot
        return snapshot is not None and not snapshot.question.is_current(self._services.model)

    @property
    def front(self) -> str | None:
        """The current style: the chosen style if it exists, or else the suggested style."""
        snapshot = self.snapshot
        return None if snapshot is None else front_of(snapshot, self._services.model.chosen)

    @property
    def result(self) -> StyleResult | None:
        """Result for the current style, or None if there is no result."""
        return None if self.snapshot is None else self.snapshot.results.get(self.front or "")

    @property
    def moved_deg(self) -> float:
        """Angle in degrees by which the marker has moved since the answers were computed."""
        if self.snapshot is None:
            return 0.0
        return self._services.model.front_deg - self.snapshot.question.front_deg

    @property
    def needle_deg(self) -> float | None:
        """Turn in degrees relative to the answers on screen, or None to show the best turn."""
        needle, shift_deg = self._services.model.needle_deg, self.moved_deg
        # Until new answers arrive after a move of the marker, keep the same direction in the
        # panorama.
        return needle if needle is None or shift_deg == 0 else wrap(needle + shift_deg)

    def sized(self, sizes: Sizes) -> None:
        """Render the pictures again at the given sizes."""
        cards = sizes.card != self.sizes.card
        self.sizes = sizes
        if cards and (self.snapshot is not None or self.has_asked):
            self.ask()

    # -- the gallery ---------------------------------------------------------------------------

    def ask(self, *, larger: bool = False) -> None:
        """Render the pictures for the cards, starting with small ones if the place is new."""
        question = question_of(self._services.model, self.sizes.card)
        if question is None:
            return
        self.has_asked = True
        model, before, sizes = self._services.model, self.snapshot, self.sizes
        if before is not None and before.question.light is model.light and model.computing:
            # New pictures will arrive with the new answers.
            return
        # A gallery that was made before there were answers has no pictures of this place.
        same = (
            before is not None
            and before.question.head is question.head
            and before.question.light is question.light
            and bool(before.results or not question.results)
        )
        style, needle, detail = model.chosen, model.needle_deg, DetailResolver(self._detail)

        def work(token: Token, _report: Report) -> tuple[Snapshot, DetailResolver]:
            snapshot = look(question, before, token, quick=not larger and not same)
            front = front_of(snapshot, style)
            if front is not None:
                # The detail needs the gallery first.
                detail.at(snapshot, front, needle, sizes, quick=snapshot.quick)
            return snapshot, detail

        def done(answer: tuple[Snapshot, DetailResolver]) -> None:
            # Drop larger pictures of an older snapshot.
            if not larger or self.snapshot is before:
                self._looked(answer)

        self._services.runner.submit(_LARGER_JOB if larger else _JOB, work, done=done)

    def expose(self) -> None:
        """Render the pictures for the cards again if their common exposure has changed."""
        snapshot, model = self.snapshot, self._services.model
        pinned = (model.chosen or "") if model.settings.same_exposure else None
        if snapshot is not None and snapshot.question.pinned != pinned:
            self.ask(larger=not snapshot.quick)

    def _looked(self, answer: tuple[Snapshot, DetailResolver]) -> None:
        self.snapshot, self._detail = answer
        if self.snapshot.quick and self.snapshot.question.head.may_be_full_at(self.sizes.card):
            self.ask(larger=True)
        else:
            self._expect_turn()
        self._changed(True)

    def _expect_turn(self) -> None:
        """Learn the background of the place while the gallery is being looked at."""
        model, backgrounds = self._services.model, self._services.backgrounds
        light, folder = model.light, model.place_folder
        if light is not None and backgrounds.at_hand(light) is None:
            self._services.runner.submit(
                _BACKGROUND,
                lambda token, report: backgrounds.find(light, folder, token, report),
                # Turn reports any trouble.
                failed=lambda _: None,
            )

    # -- the detail ----------------------------------------------------------------------------

    def resolve(self) -> None:
        """Resolve the details, using small pictures until larger ones are ready."""
        snapshot, key = self.snapshot, self.front
        if snapshot is None or key is None:
            self.detail_state = DetailState(main_works=False)
            return
        needle, sizes, detail = self.needle_deg, self.sizes, self._detail
        # While the needle moves, keep the last large picture until the next one is ready.
        last = None
        if self._large is not None and self._large[0] is snapshot and self._large[1] == sizes:
            last = self._large[2] if self._large[2].key == key else None
        self.detail_state = detail.at(snapshot, key, needle, sizes, quick=True, last=last)
        larger = snapshot.question.head.may_be_full_at(sizes.portrait)
        running = self._services.runner.running(_DETAIL_JOB)
        if larger and detail.is_quick(self.detail_state) and not running:
            # Use drafts while the needle moves, except for the first and the last picture.
            moves = last is not None and last.needle != self.detail_state.needle
            self._ask_detail(snapshot, key, needle, draft=moves)
        self._add_reason(snapshot, key)

    # -- the reason ----------------------------------------------------------------------------

    def _add_reason(self, snapshot: Snapshot, key: str) -> None:
        """Add the reason to the details, or find it first if it is not known yet."""
        if self._reasons[0] is not snapshot:
            self._reasons = snapshot, {}
        reasons, here = self._reasons[1], self.detail_state.here
        if key in reasons:
            size = self.sizes.portrait if here is None else (here.shape[0], here.shape[1])
            why = reasons[key].state(size, at_best=self.detail_state.at_best)
            if why is not NO_REASON:
                self.detail_state = replace(self.detail_state, why=why)
            return
        runner, elsewhere = self._services.runner, self._elsewhere()
        if self.stale or snapshot.question.light is None or runner.running(_REASON_JOB):
            return

        def done(reason: AreaReason) -> None:
            reasons[key] = reason
            self.resolve()
            self._changed(False)

        runner.submit(_REASON_JOB, lambda *_: find_reason(snapshot, key, elsewhere), done=done)

    def _elsewhere(self) -> Elsewhere:
        """Return a function that reads the results of the other spots of the day."""
        model, root = self._services.model, self._services.folders.places
        here, place, head = model.place_folder, model.place, model.head_name
        if place is None:
            return lambda _style: {}
        return lambda style: results_elsewhere(root, here, place, head, style)

    def _ask_detail(
        self, snapshot: Snapshot, key: str, needle: float | None, *, draft: bool
    ) -> None:
        """Render the pictures for the details at full size."""
        detail, sizes = DetailResolver(self._detail), self.sizes

        def done(detail_state: DetailState) -> None:
            if self.snapshot is snapshot:
                self._detail, self._large = detail, (snapshot, sizes, detail_state)
            self.resolve()
            self._changed(False)

        self._services.runner.submit(
            _DETAIL_JOB, lambda *_: detail.at(snapshot, key, needle, sizes, draft=draft), done=done
        )

    def compare(self, keys: Sequence[str], show: Callable[[tuple[DetailState, ...]], None]) -> None:
        """Resolve some styles at their best turns, and pass the results to `show`."""
        snapshot, sizes = self.snapshot, replace(self.sizes, portrait=self.sizes.compared)
        if snapshot is None:
            return

        def work(*_: object) -> tuple[DetailState, ...]:
            return tuple(DetailResolver().at(snapshot, key, None, sizes) for key in keys)

        self._services.runner.submit("styles-compared", work, done=show)
