"""What the strokes come to in this place, in pictures, numbers and words."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from app.core.base.arrays import Bytes
from app.core.base.errors import CoreError
from app.core.base.progress import Report, Token
from app.core.painting.canvas import NOTHING_PAINTED
from app.core.painting.session import Answer
from app.core.painting.user_style import UserStyle, target_picture
from app.core.solver.place_light import Facing, PlaceLight
from app.core.solver.relighting_cache import LightTable, light_table
from app.core.solver.solve import StyleResult
from app.core.solver.transport import Transport
from app.core.text import tr
from app.core.text.turns import arc_words, direction_of, direction_words, signed, size_words
from app.ui.presenters.heads import Head
from app.ui.presenters.model import Model
from app.ui.presenters.services import Services
from app.ui.screens.paint.state import LiveState

if TYPE_CHECKING:
    from app.ui.screens.paint.document import PaintDocument

    Size: TypeAlias = tuple[int, int]


_JOB: Final = "paint-light"


NO_LIGHT: Final = tr("No light measured yet.")
PREPARING: Final = tr("Preparing the light of this place…")
NO_STROKES: Final = tr("Paint where the face should be brighter, and where darker.")


class LightOnHead:
    """Keeps one light table; has another made in a job when light or head are others."""

    def __init__(self, services: Services, ready: Callable[[], None]) -> None:
        self._services = services
        self._ready = ready
        self._made: LightTable | None = None
        self._of: tuple[PlaceLight, Transport, bool] | None = None
        self.trouble = ""

    def table(self) -> LightTable | None:
        """Give the table of the model's light and head; None while there is none."""
        model = self._services.model
        if model.light is None or model.head is None:
            return None
        light, transport = model.light, model.head.transport
        known, grey = self._of, model.settings.objective == "paper"
        same = known is not None and known[0] is light and known[1] is transport
        if known is None or not same or known[2] != grey:
            self._of, self._made, self.trouble = (light, transport, grey), None, ""
            self._make(light, transport, grey)
        return self._made

    def _make(self, light: PlaceLight, transport: Transport, grey: bool) -> None:
        wanted = self._of

        def work(token: Token, report: Report) -> LightTable:
            del report
            token.check()
            return light_table(transport, light.searched, pictures=True, grey=grey)

        def done(made: LightTable) -> None:
            if self._of is wanted:
                self._made = made
                self._ready()

        def failed(error: Exception) -> None:
            if self._of is wanted:
                said = error.message if isinstance(error, CoreError) else ""
                self.trouble = said or tr("The light of this place cannot be used.")
                self._services.notify.tell_error(error)
                self._ready()

        self._services.runner.submit(_JOB, work, done=done, failed=failed)


ALL_SAVED: Final = tr("Everything is saved")
NOTHING: Final = ("", tr("Nothing"), tr("an empty face"))


def starts_of(easel: PaintDocument, own: Sequence[UserStyle]) -> tuple[tuple[str, str, str], ...]:
    """List what painting can start from.

    Returns key, title and side: nothing first, then the user's own, then the built-in styles.
    What was saved here begins from something else: it is no start of its own.
    """
    mine = tuple((one.name, one.title, one.side_words or tr("painted by you")) for one in own)
    names = {one.name for one in own}
    rest = (one for one in easel.head.pack.styles if one.name not in names)
    starts = (NOTHING, *mine, *((one.name, one.title, one.side_words) for one in rest))
    return tuple(one for one in starts if one[0] != easel.key or easel.key == easel.start)


def status_of(easel: PaintDocument) -> str:
    """Say whether what is painted is saved."""
    if easel.unsaved:
        return tr("not saved yet") if easel.style is None else tr("changes not saved yet")
    return tr("saved") if easel.style is not None else tr("nothing painted yet")


def save_words(easel: PaintDocument) -> str:
    """Words on the main button."""
    return tr("Save as my style") if easel.style is None else tr("Save changes")


def save_why(advice: str | None, easel: PaintDocument) -> str:
    """Say why what is painted cannot be saved now; empty when it can."""
    if not easel.unsaved:
        return ALL_SAVED if easel.style is not None else NOTHING_PAINTED
    # Restored to what it began from, yet another than what was saved: that can be saved as well.
    return "" if advice == NOTHING_PAINTED and easel.style is not None else advice or ""


def live_state(
    easel: PaintDocument, answer: Answer, model: Model, size: Size, trouble: str
) -> LiveState:
    """Resolve the live column; `size` is rows and columns of the portrait."""
    light, result = model.light, answer.result
    state = LiveState(
        limit=model.settings.match_limit,
        weights=answer.preintegrated,
        front=model.front_deg,
        panorama=None if light is None else light.display,
        origin=origin_words(model, easel.head, easel.start),
    )
    if result is None:
        target = target_picture(easel.head.transport, easel.session.weights)
        return replace(
            state,
            sentence=NO_LIGHT if light is None else trouble or PREPARING,
            offers_probe=light is None,
            picture=easel.head.portrait(target, size) if target.any() else None,
            picture_tag=tr("Target"),
        )
    here = picture_here(easel, answer, model, size)
    if here is not None:
        # At the pace of the brush.
        state = replace(state, picture=here(quick=True))
    if not np.any(result.match_curve):
        return replace(state, sentence=NO_STROKES)
    return replace(_with_numbers(state, result), picture_tag=tr("At the best turn"))


def picture_here(
    easel: PaintDocument, answer: Answer, model: Model, size: Size
) -> Callable[..., Bytes] | None:
    """What makes the picture at the best turn; None while there is none."""
    light, result, linear, head = model.light, answer.result, answer.picture, easel.head
    if light is None or result is None or linear is None:
        return None
    lit = Facing(light, result.turn_refined_deg + model.front_deg)
    return lambda quick: head.portraits([linear], size, [lit], quick=quick)[0]


def origin_words(model: Model, head: Head, start: str) -> str:
    """Say what the style that painting began from reaches here: "Rembrandt itself: 96, at 96°"."""
    result = next((one for one in model.results if one.name == start), None)
    if result is None or model.head is not head:
        return ""
    match = max(math.floor(result.match), 0)
    return tr(
        "{style} itself: {match}, at {turn}",
        style=result.title,
        match=match,
        turn=signed(result.turn_refined_deg),
    )


def _with_numbers(state: LiveState, result: StyleResult) -> LiveState:
    turn = result.turn_refined_deg
    good = tr("Good from {arc}.", arc=arc_words(result.arc_deg))
    if not result.attainable:
        why = (result.reason or tr("Not within the limits")).rstrip(".")
        good = tr("Out of reach here: {reason}.", reason=f"{why[:1].lower()}{why[1:]}")
    return replace(
        state,
        turn=size_words(turn),
        direction=direction_words(turn),
        way=direction_of(turn),
        match=f"{max(math.floor(result.match), 0)}",
        match_value=max(result.match, 0.0),
        turn_deg=turn,
        curve=tuple(float(value) for value in result.match_curve),
        arc=result.arc_deg if result.attainable else None,
        peaks=tuple(peak.turn_refined_deg for peak in result.peaks[1:]),
        good=good,
        dashed=tr("The dashed ring is the limit of reach, {limit:.0f}.", limit=state.limit),
    )
