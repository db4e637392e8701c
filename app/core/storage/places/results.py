"""Results as JSON and back, every float to the last bit."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.core.base.angles import TURNS
from app.core.solver.solve import PeakResult, StyleResult
from app.core.storage.places.place import PlaceError
from app.core.storage.settings.json_file import Unfit, number, optional, text, truth

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from app.core.storage.settings.json_file import Facts

_HUGE: Final = 1e300
_MOST_PEAKS: Final = TURNS
_MOST_RESULTS: Final = 2000
_NUMBER: Final = number(-_HUGE, _HUGE)
_TURN: Final = number(-180.0, 180.0)
_NAME: Final = text(200)
_SENTENCE: Final = text(2000)
_CURVES: Final = ("quality_curve", "match_curve", "strength_curve")
_DIRECTIONS: Final = ("clockwise", "counter-clockwise", "none")


def results_to_json(results: Sequence[StyleResult]) -> list[Facts]:
    """Turn results into what JSON can hold.

    Raises PlaceError when a number is infinite or none; nothing is written that could not be read
    again.
    """
    return [_to_json(result) for result in results]


def results_from_json(value: Any) -> tuple[StyleResult, ...]:
    """Turn that back into results.

    With the same floats to the last bit; curves are (64,) float64, read-only.
    Raises PlaceError when one of them is not a result.
    """
    try:
        return tuple(result_from_json(each) for each in _as_list(value, "the whole"))
    except Unfit as error:
        raise PlaceError(
            f"The kept results cannot be read: {error}.", "They will be worked out anew."
        ) from error


def result_from_json(value: Any) -> StyleResult:
    """Turn one result back.

    Raises Unfit when it is not one.
    """
    facts = _object(value)
    peaks = _list(facts, "peaks", _MOST_PEAKS)
    return StyleResult(
        name=_NAME(_get(facts, "name")),
        title=_NAME(_get(facts, "title")),
        side=_NAME(_get(facts, "side")),
        turn_index=_index(_get(facts, "turn_index")),
        turn_deg=_TURN(_get(facts, "turn_deg")),
        turn_refined_deg=_TURN(_get(facts, "turn_refined_deg")),
        direction=_direction(_get(facts, "direction")),
        quality_curve=_curve(_get(facts, "quality_curve")),
        match_curve=_curve(_get(facts, "match_curve")),
        strength_curve=_curve(_get(facts, "strength_curve")),
        quality=_NUMBER(_get(facts, "quality")),
        match=_NUMBER(_get(facts, "match")),
        strength=_NUMBER(_get(facts, "strength")),
        attainable=truth(_get(facts, "attainable")),
        reason=optional(_SENTENCE)(_get(facts, "reason")),
        arc_deg=_arc(_get(facts, "arc_deg")),
        peaks=tuple(_peak(each) for each in peaks),
    )


def _to_json(result: StyleResult) -> Facts:
    facts: Facts = {
        "name": result.name,
        "title": result.title,
        "side": result.side,
        "turn_index": int(result.turn_index),
        "turn_deg": float(result.turn_deg),
        "turn_refined_deg": float(result.turn_refined_deg),
        "direction": result.direction,
        "quality": float(result.quality),
        "match": float(result.match),
        "strength": float(result.strength),
        "attainable": bool(result.attainable),
        "reason": result.reason,
        "arc_deg": [float(end) for end in result.arc_deg],
        "peaks": [_peak_to_json(peak) for peak in result.peaks],
    }
    facts |= {name: np.asarray(getattr(result, name), np.float64).tolist() for name in _CURVES}
    if not _all_finite(facts):
        raise PlaceError(f"The result for {result.name} is not a number and was not kept.")
    return facts


def _peak_to_json(peak: PeakResult) -> Facts:
    return {
        "turn_deg": float(peak.turn_deg),
        "turn_refined_deg": float(peak.turn_refined_deg),
        "quality": float(peak.quality),
        "match": float(peak.match),
        "strength": float(peak.strength),
        "arc_deg": [float(end) for end in peak.arc_deg],
    }


def _peak(value: Any) -> PeakResult:
    facts = _object(value)
    return PeakResult(
        turn_deg=_TURN(_get(facts, "turn_deg")),
        turn_refined_deg=_TURN(_get(facts, "turn_refined_deg")),
        quality=_NUMBER(_get(facts, "quality")),
        match=_NUMBER(_get(facts, "match")),
        strength=_NUMBER(_get(facts, "strength")),
        arc_deg=_arc(_get(facts, "arc_deg")),
    )


def _all_finite(value: Any) -> bool:
    if isinstance(value, dict):
        return all(_all_finite(each) for each in value.values())
    if isinstance(value, list):
        return all(_all_finite(each) for each in value)
    return not isinstance(value, float) or abs(value) <= _HUGE


def _object(value: Any) -> Facts:
    if not isinstance(value, dict):
        raise Unfit("one of them is not a result")
    return value


def _get(facts: Facts, name: str) -> Any:
    if name not in facts:
        raise Unfit(f"one of them lacks {name}")
    return facts[name]


def _list(facts: Facts, name: str, most: int) -> list[Any]:
    return _as_list(_get(facts, name), name, most)


def _as_list(value: Any, name: str, most: int = _MOST_RESULTS) -> list[Any]:
    if not isinstance(value, list) or len(value) > most:
        raise Unfit(f"{name} is not a list")
    return value


def _index(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < TURNS:
        raise Unfit("a turn is not one of the 64")
    return value


def _direction(value: Any) -> str:
    if value not in _DIRECTIONS:
        raise Unfit("a direction is unknown")
    return str(value)


def _arc(value: Any) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise Unfit("an arc is not a pair")
    return _TURN(value[0]), _TURN(value[1])


def _curve(value: Any) -> NDArray[np.float64]:
    if not isinstance(value, list) or len(value) != TURNS:
        raise Unfit(f"a curve has not {TURNS} turns")
    if not all(type(each) in (float, int) and math.isfinite(each) for each in value):
        raise Unfit("a curve holds something else than numbers")
    curve = np.array(value, np.float64)
    curve.flags.writeable = False
    return curve
