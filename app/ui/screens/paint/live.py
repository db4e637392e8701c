"""What the strokes come to in this place, in pictures, numbers and words."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from app.core.painting.gallery import target_picture
from app.core.solver.portraits import framing, portraits
from app.core.text.turns import arc_words, direction_of, direction_words, signed, size_words
from app.ui.screens.paint.state import LiveState

if TYPE_CHECKING:
    from app.core.base.colour import FloatImage
    from app.core.painting.session import Answer
    from app.core.solver.solve import StyleResult
    from app.ui.presenters.model import Head, Model
    from app.ui.screens.paint.document import PaintDocument
    from app.ui.screens.paint.state import Bytes

    Size: TypeAlias = tuple[int, int]

NO_LIGHT: Final = "No light measured yet."
PREPARING: Final = "Preparing the light of this place…"
NOTHING: Final = "Paint where the face should be brighter, and where darker."


def live_state(
    easel: PaintDocument, answer: Answer, model: Model, size: Size, trouble: str
) -> LiveState:
    """Resolve the live column.

    Parameters
    ----------
    size : tuple of int
        Rows and columns of the portrait.
    """
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
            picture=_portrait(easel.head, target, size) if target.any() else None,
            picture_tag="Target",
        )
    if not np.any(result.match_curve):
        return replace(state, sentence=NOTHING, picture=_shown(easel.head, answer, size))
    return replace(
        _with_numbers(state, result),
        picture=_shown(easel.head, answer, size),
        picture_tag="At the best turn",
    )


def origin_words(model: Model, head: Head, start: str) -> str:
    """Say what the style that painting began from reaches here: "Rembrandt itself: 96, at 96°"."""
    result = next((one for one in model.results if one.name == start), None)
    if result is None or model.head is not head:
        return ""
    match = max(math.floor(result.match), 0)
    return f"{result.title} itself: {match}, at {signed(result.turn_refined_deg)}"


def _with_numbers(state: LiveState, result: StyleResult) -> LiveState:
    turn = result.turn_refined_deg
    reach = f"The dashed ring is the limit of reach, {state.limit:.0f}."
    if result.attainable:
        good = f"Good from {arc_words(result.arc_deg)}. {reach}"
    else:
        why = (result.reason or "Not within the limits").rstrip(".")
        good = f"Out of reach here: {why[:1].lower()}{why[1:]}. {reach}"
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
        in_reach=result.attainable,
    )


def _shown(head: Head, answer: Answer, size: Size) -> Bytes | None:
    return None if answer.picture is None else _portrait(head, answer.picture, size)


def _portrait(head: Head, linear: FloatImage, size: Size) -> Bytes:
    coverage = head.pack.coverage.astype(np.float32)
    shown: Bytes = portraits(linear[np.newaxis], coverage, framing(head.transport.size, size))[0]
    return shown
