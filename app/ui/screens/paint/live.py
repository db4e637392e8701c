"""The live column, which shows the result of the strokes at this place while the pen moves."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final, Literal, TypeAlias

import numpy as np

from app.core.base.angles import direction_of, wrap
from app.core.base.arrays import Bytes, Float32
from app.core.base.errors import CoreError
from app.core.base.progress import Report, Token
from app.core.painting.painting_session import Answer
from app.core.portrait.head import Head
from app.core.solver.place_light import Facing, PlaceLight, picture_at
from app.core.solver.relighting_cache import LightTable, light_table
from app.core.solver.style_result import StyleResult
from app.core.solver.transport import Transport
from app.core.solver.turn_choice import LIMITS
from app.core.text import tr
from app.ui.presenters.services import Services
from app.ui.presenters.window_model import NO_LIGHT, Model
from app.ui.screens.paint.document import PaintDocument
from app.words.phrases.turns import arc_words, direction_lines, signed, size_words
from app.words.why_out_of_reach import out_of_reach_sentence, reason_sentence

Size: TypeAlias = tuple[int, int]
Way: TypeAlias = Literal["clockwise", "counter-clockwise", "none", ""]

LIMIT_RING: Final = tr("The dashed ring is the limit of reach, {limit:.0f}.")
PREPARING: Final = tr("Preparing the light of this place…")
NO_STROKES: Final = tr("Paint where the face should be brighter and where it should be darker.")
_TARGET: Final = tr("Target")
_AT_BEST: Final = tr("At the best turn")
_LIGHT_JOB: Final = "paint-light"
_LARGER_JOB: Final = "paint-larger"
_PORTRAIT: Final = (232, 200)


@dataclass(frozen=True, slots=True, eq=False)
class LiveState:
    """The answer for the canvas. Its properties provide the numbers and the text for display.

    Attributes:
        sentence: Text that replaces the numbers, or an empty string if there is a `result`.
        origin: Text on the result of the original style here.
        picture: Portrait, (h, w, 3) uint8 sRGB, or None if there is none.
        panorama: Panorama of the place, (h, w, 3) uint8 sRGB, or None if there is no light.
        front: Panorama azimuth of the photographer, in degrees.
        weights: Pre-integrated target at turn 0, (H, W) float32, or None.
        limit: Minimum match at which the style is within reach.
        stale: Whether the answer is for another head or place and therefore dimmed under
            "Computing…".
    """

    stale: bool = False
    sentence: str = ""
    offers_probe: bool = False
    limit: float = 45.0
    origin: str = ""
    picture: Bytes | None = field(default=None, repr=False)
    picture_tag: str = ""
    panorama: Bytes | None = field(default=None, repr=False)
    front: float = 0.0
    weights: Float32 | None = field(default=None, repr=False)
    result: StyleResult | None = field(default=None, repr=False)

    @property
    def turn_deg(self) -> float:
        """Best turn, in degrees, or 0 if there is no result."""
        return 0.0 if self.result is None else self.result.turn_refined_deg

    @property
    def turn(self) -> str:
        """Size of the best turn, such as "96°"."""
        return "" if self.result is None else size_words(self.turn_deg)

    @property
    def direction(self) -> str:
        """Direction of the best turn, in one or two lines."""
        return "" if self.result is None else direction_lines(self.turn_deg)

    @property
    def way(self) -> Way:
        """Direction of the best turn, or an empty string if there is no result."""
        return "" if self.result is None else direction_of(self.turn_deg)

    @property
    def match_value(self) -> float:
        """Match at the best turn, from 0 to 100."""
        return 0.0 if self.result is None else max(self.result.match, 0.0)

    @property
    def match(self) -> str:
        """Match at the best turn, in whole points."""
        return "" if self.result is None else f"{math.floor(self.match_value)}"

    @property
    def curve(self) -> tuple[float, ...]:
        """Match at 64 turns, or an empty tuple if there is no result."""
        return () if self.result is None else tuple(map(float, self.result.match_curve))

    @property
    def arc(self) -> tuple[float, float] | None:
        """Tolerance arc, in degrees, or None if the style is out of reach."""
        result = self.result
        return None if result is None or not result.attainable else result.arc_deg

    @property
    def peaks(self) -> tuple[float, ...]:
        """Turns of the other peaks, in degrees."""
        peaks = () if self.result is None else self.result.peaks[1:]
        return tuple(peak.turn_refined_deg for peak in peaks)

    @property
    def good(self) -> str:
        """Sentence on the range of good turns, on what is missing, or on both."""
        result = self.result
        if result is None:
            return ""
        if not result.attainable:
            return out_of_reach_sentence(result.shortfall)
        good = tr("Good from {arc}.", arc=arc_words(result.arc_deg))
        if result.shortfall is None:
            return good
        return tr("{good} Soft. {what}.", good=good, what=reason_sentence(result.shortfall))

    @property
    def dashed(self) -> str:
        """Sentence that explains the ring in the plot."""
        if self.result is None:
            return ""
        return LIMIT_RING.format(limit=self.limit)


class LightOnHead:
    """Keeps one light table. When the light or the head changes, a job computes a new table.

    Attributes:
        trouble: The reason why the light cannot be used, or an empty string if it can be used.
    """

    def __init__(self, services: Services, ready: Callable[[], None]) -> None:
        self._services = services
        self._ready = ready
        self._table: LightTable | None = None
        self._of: tuple[PlaceLight, Transport, bool] | None = None
        self.trouble = ""

    def table(self) -> LightTable | None:
        """Return the table for the model's light and head, or None until it is computed."""
        model = self._services.model
        if model.light is None or model.head is None:
            return None
        light, transport = model.light, model.head.transport
        key, grey = self._of, model.settings.objective == "paper"
        same = key is not None and key[0] is light and key[1] is transport
        if key is None or not same or key[2] != grey:
            self._of, self._table, self.trouble = (light, transport, grey), None, ""
            self._make(light, transport, grey)
        return self._table

    def _make(self, light: PlaceLight, transport: Transport, grey: bool) -> None:
        key = self._of

        def work(token: Token, _report: Report) -> LightTable:
            token.check()
            return light_table(transport, light.searched, pictures=True, grey=grey)

        def done(table: LightTable) -> None:
            if self._of is key:
                self._table = table
                self._ready()

        def failed(error: Exception) -> None:
            if self._of is key:
                message = error.message if isinstance(error, CoreError) else ""
                self.trouble = message or tr("The light of this place cannot be used.")
                self._services.notify.tell_error(error)
                self._ready()

        self._services.runner.submit(_LIGHT_JOB, work, done=done, failed=failed)


class LiveAnswer:
    """Solves the canvas and resolves the live column.

    Args:
        ready: Called when a new light table is ready.
        changed: Called when a larger portrait is ready.
    """

    def __init__(
        self, services: Services, ready: Callable[[], None], changed: Callable[[], None]
    ) -> None:
        self._services = services
        self._changed = changed
        self._document: PaintDocument | None = None
        self._size: Size = _PORTRAIT
        self._in_stroke = False  # whether the last full update was during a stroke
        self.light = LightOnHead(services, ready)
        self.answer: Answer | None = None
        self.state = LiveState()

    def take(self, document: PaintDocument | None) -> None:
        """Switch to this painting."""
        self._document = document
        if document is None:
            self.answer = None

    def set_size(self, rows: int, columns: int) -> bool:
        """Set the size of the portrait, in pixels, and return whether the size has changed."""
        if (rows, columns) == self._size or rows <= 0 or columns <= 0:
            return False
        self._size = (rows, columns)
        self.look()
        return True

    def look(self) -> None:
        """Solve the canvas and update the whole column."""
        if self._document is not None:
            self._resolve(self._document, self._document.session.answer())

    def follow(self) -> bool:
        """Solve the canvas after the pen has moved.

        Returns:
            True if only the live column needs an update, or False if the whole screen may need one.
        """
        document, before, light = self._document, self.answer, self._services.model.light
        if document is None:
            return False
        answer = document.session.answer()
        result, linear = answer.result, answer.picture
        if light is None or result is None or linear is None or before is None:
            self._resolve(document, answer)
            return False
        if not self._in_stroke or answer.advice is not before.advice:
            self._resolve(document, answer)
            return False
        turn = result.turn_refined_deg + self._services.model.front_deg
        facing = Facing(light, turn, document.head.expose_of(document.start))
        (picture,) = document.head.portraits([linear], self._size, [facing], quick=True)
        state = replace(self.state, weights=answer.preintegrated, picture=picture)
        self.answer, self.state = answer, _with_result(state, result)
        return True

    def _resolve(self, document: PaintDocument, answer: Answer) -> None:
        self.answer, self._in_stroke = answer, document.session.stroking
        model = self._services.model
        own, light = document.own_answer(model), model.light
        result = answer.result if own is None else own
        self.state = state = LiveState(
            stale=self._is_stale(document, own),
            limit=_limit(document),
            weights=answer.preintegrated,
            front=model.front_deg,
            panorama=None if light is None else light.display,
            origin=origin_words(model, document.head, document.start),
        )
        if light is None or result is None:
            self.state = self._without_result(state, document)
            return
        portrait = _portrait(document, answer, own, light, model.front_deg, self._size)
        if portrait is not None:
            # fast enough to keep up with the pen
            state = replace(state, picture=portrait(quick=True))
        self.state = state = _with_result(state, result)
        if portrait and document.head.may_be_full_at(self._size) and not self._in_stroke:
            make, done = portrait, partial(self._enlarge, state)
            self._services.runner.submit(_LARGER_JOB, lambda *_: make(quick=False), done=done)

    def _is_stale(self, document: PaintDocument, own: StyleResult | None) -> bool:
        model = self._services.model
        same_head = document.head is model.head and document.head.name == model.head_name
        return not same_head or (own is not None and bool(model.computing))

    def _without_result(self, state: LiveState, document: PaintDocument) -> LiveState:
        """Show the target picture, with a sentence in place of the numbers."""
        has_light = self._services.model.light is not None
        target, lamps = document.target()
        picture = document.head.portrait(target, self._size, lamps) if target.any() else None
        return replace(
            state,
            sentence=self.light.trouble or PREPARING if has_light else NO_LIGHT,
            offers_probe=not has_light,
            picture=picture,
            picture_tag=_TARGET,
        )

    def _enlarge(self, state: LiveState, picture: Bytes) -> None:
        """Show the portrait at full size once the pen is at rest."""
        if self.state is state:
            self.state = replace(state, picture=picture)
            self._changed()


def _with_result(state: LiveState, result: StyleResult) -> LiveState:
    if not np.any(result.match_curve):
        return replace(state, sentence=NO_STROKES, result=None, picture_tag="")
    return replace(state, sentence="", result=result, picture_tag=_AT_BEST)


def _portrait(
    document: PaintDocument,
    answer: Answer,
    own: StyleResult | None,
    light: PlaceLight,
    front_deg: float,
    size: Size,
) -> Callable[..., Bytes] | None:
    """Return a function that renders the portrait at the best turn, or None if that is unknown.

    The function takes one argument, `quick`, which has the same meaning as in `Head.portraits`.

    Args:
        own: Result of the style that the canvas still matches, or None if the canvas has been
            changed.
    """
    result, linear, head = answer.result, answer.picture, document.head
    expose = head.expose_of(document.start)
    if own is not None:
        head = document.head.turned(own.yaw_deg)
        here = Facing(light, wrap(own.nose_deg + front_deg), expose)
        linear = picture_at(head.transport, light, here.turn_deg)
    elif result is None or linear is None:
        return None
    else:
        here = Facing(light, result.turn_refined_deg + front_deg, expose)
    return lambda quick: head.portraits([linear], size, [here], quick=quick)[0]


def _limit(document: PaintDocument) -> float:
    """Return the minimum match at which the style is within reach, as shown on its card."""
    pack, name = document.head.pack, document.built_in
    own = pack.styles[pack.index(name)].signature if name else None
    return own.match[1] if own is not None and own.relations else LIMITS.match


def origin_words(model: Model, head: Head, start: str) -> str:
    """Describe the result of the original style, for example "Rembrandt itself: 96, at 96°"."""
    result = next((one for one in model.results if one.name == start), None)
    if result is None or model.head is not head or model.computing:
        return ""
    match = max(math.floor(result.match), 0)
    return tr(
        "{style} itself: {match}, at {turn}",
        style=result.title,
        match=match,
        turn=signed(result.turn_refined_deg),
    )
