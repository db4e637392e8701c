"""Solves the open place for the selected head, the styles and the settings."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, Final

from app.core.base.angles import difference, wrap
from app.core.base.progress import Report, Token
from app.core.places.solve_place import solve_place
from app.core.portrait.head import Head
from app.core.solver.solve import proposal
from app.core.solver.style_result import StyleResult
from app.ui.presenters.services import Services
from app.ui.presenters.window_model import Model, Selection

SELECTION_FIELDS: Final = frozenset(
    {"light", "head", "front_deg", "user_styles", "settings", "place"}
)
"""Fields of the model on which the answers depend."""

_SAME_DEG: Final = 1e-6
_NO_GOAL: Final[dict[str, float | None]] = {"goal_deg": None}


class Solving:
    """Solves the open place when the selection changes, and stores the answers in the model."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._question: tuple[Selection, Head] | None = None

    def forget(self) -> None:
        """Make the next call to `solve` start a job even if the selection is unchanged."""
        self._question = None

    def cancel(self) -> None:
        """Cancel any running jobs, because their answers are for another place or head."""
        self._question = None
        self._services.runner.cancel("solve")

    def solve(self) -> None:
        """Start a job to solve the selection, unless it is already solved or being solved."""
        model = self._services.model
        light, head, settings, studios = model.light, model.head, model.settings, model.studios
        if head is None or (light is None and head.studios == studios):
            self.cancel()
            return
        if self._services.runner.running("head"):
            # A job with the new head starts as soon as it is loaded.
            return
        selection = model.selection
        question = selection, head.published or head
        if self._question is not None and self._question == question:
            return
        self._question = question

        def work(token: Token, report: Report) -> tuple[Head, tuple[StyleResult, ...]]:
            studio_head = head.lit_by(selection.studios)
            if light is None:
                return studio_head, ()
            front, lens = selection.front_deg, selection.lens
            return studio_head, solve_place(
                studio_head, light, selection.styles, settings, front, lens
            )

        def failed(error: Exception) -> None:
            # Show no answers rather than those for another selection.
            model.update(results=(), answered=selection)
            self._services.notify.tell_error(error)

        self._services.runner.submit(
            "solve", work, done=partial(self._solved, selection), failed=failed
        )

    def _solved(self, selection: Selection, answer: tuple[Head, tuple[StyleResult, ...]]) -> None:
        model, (head, results) = self._services.model, answer
        new: dict[str, Any] = {"head": head, "results": results, "answered": selection}
        if not results or model.chosen in {result.name for result in results}:
            model.update(**new, **_followed(model, selection, results))
        else:
            # The goal belongs to the previous style.
            best = proposal(results)
            model.update(**new, chosen=best, needle_deg=None, goal_deg=None)


def _followed(
    model: Model, selection: Selection, results: Sequence[StyleResult]
) -> dict[str, float | None]:
    """Return the change to the goal that new answers require, if any.

    A goal at the best turn moves to the new best turn. A goal that was set by hand keeps its
    direction, and a goal that has a lamp keeps that lamp.
    """
    before, answered = model.result, model.answered
    now = next((one for one in results if one.name == model.chosen), None)
    if model.goal_deg is None or now is None:
        return {}
    if model.plan is not None and model.plan.result.name == model.chosen:
        question = model.plan.selection
        return {} if question is None or question.matches_apart_from_front(selection) else _NO_GOAL
    if before is None:
        return {}
    front = model.front_deg if answered is None else answered.front_deg
    best = wrap(before.turn_refined_deg + front)
    if abs(difference(model.azimuth_of(model.goal_deg), best)) > _SAME_DEG:
        return {}
    return {"goal_deg": now.turn_refined_deg}
