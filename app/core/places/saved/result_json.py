"""Convert the results of a place to and from JSON with exact floats, checking them on reading."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from app.core.base.angles import TURNS
from app.core.base.arrays import Float64
from app.core.places.place import PlaceError
from app.core.places.saved.saved_reasons import sentence_of, shortfall_of
from app.core.portrait.head_views import MOST_YAW_DEG
from app.core.solver.lens.lens_wish import LIGHTINGS
from app.core.solver.shortfall import Shortfall
from app.core.solver.style_result import Gain, PeakResult, StyleResult
from app.core.solver.style_signature import FORMER_GRADES, GRADES
from app.core.storage.json_file import (
    Check,
    Facts,
    Unfit,
    listed,
    number,
    one_of,
    optional,
    plain,
    record,
    text,
    truth,
    whole,
)
from app.core.text import tr

MOST_RESULTS: Final = 2000
LONGEST_WORD: Final = 200


def arc(value: Any) -> tuple[float, float]:
    """Validate an arc, given as two turns, (from, to), in degrees."""
    if not isinstance(value, list) or len(value) != 2:
        raise Unfit("an arc is not a pair")
    return _TURN(value[0]), _TURN(value[1])


def _curve(value: Any) -> Float64:
    if not isinstance(value, list) or len(value) != TURNS:
        raise Unfit(f"a curve does not have {TURNS} turns")
    if not all(type(each) in (float, int) and math.isfinite(each) for each in value):
        raise Unfit("a curve contains something other than numbers")
    curve = np.array(value, np.float64)
    curve.flags.writeable = False
    return curve


_TURN: Final = number(-180.0, 180.0)
_NUMBER: Final = number(-1e300, 1e300)
WORD: Final = text(LONGEST_WORD)
YAW: Final = number(-MOST_YAW_DEG, MOST_YAW_DEG)
_PEAK: Final[dict[str, Check]] = {
    "turn_deg": _TURN,
    "turn_refined_deg": _TURN,
    "quality": _NUMBER,
    "match": _NUMBER,
    "strength": _NUMBER,
    "arc_deg": arc,
}
_GAIN: Final[dict[str, Check]] = {
    "lighting": one_of(*LIGHTINGS),
    "turn_deg": _TURN,
    "yaw_deg": YAW,
    "match": _NUMBER,
}
_RESULT: Final[dict[str, Check]] = {
    "name": WORD,
    "title": WORD,
    "side": WORD,
    "turn_index": whole(0, TURNS - 1),
    "turn_deg": _TURN,
    "turn_refined_deg": _TURN,
    "direction": one_of("clockwise", "counter-clockwise", "none"),
    "quality": _NUMBER,
    "match": _NUMBER,
    "strength": _NUMBER,
    "attainable": truth,
    "arc_deg": arc,
    "peaks": listed(record(PeakResult, _PEAK), TURNS),
    "quality_curve": _curve,
    "match_curve": _curve,
    "strength_curve": _curve,
    "grade": optional(one_of(*GRADES, former=FORMER_GRADES)),
    "looks_more_like": optional(WORD),
    "same_picture": listed(WORD, MOST_RESULTS),
    "neighbour": optional(WORD),
    "yaw_deg": YAW,
    "yaw_arc_deg": arc,
    "lighting": one_of(*LIGHTINGS),
    "gains": listed(record(Gain, _GAIN), len(LIGHTINGS)),
}
_NEW: Final = frozenset(
    {
        *("grade", "looks_more_like", "same_picture", "neighbour"),
        *("yaw_deg", "yaw_arc_deg", "lighting", "gains"),
    }
)
# The cause as data, and the sentences that earlier versions saved instead.
_WHY: Final[dict[str, Check]] = {
    "cause": optional(shortfall_of),
    "reason": optional(sentence_of),
    "shortfall": optional(sentence_of),
}


def _result(
    cause: Shortfall | None = None,
    reason: Shortfall | None = None,
    shortfall: Shortfall | None = None,
    **values: Any,
) -> StyleResult:
    return StyleResult(**values, shortfall=cause or reason or shortfall)


result_of: Final = record(_result, _RESULT | _WHY, _RESULT.keys() - _NEW)
"""Validator for a result. The curves of the result are (64,) float64, read-only."""


def results_to_json(results: Sequence[StyleResult]) -> list[Facts]:
    """Convert results to JSON.

    Raises:
        PlaceError: If a number is not finite.
    """
    rows = [_result_to_json(result) for result in results]
    for facts in rows:
        try:
            json.dumps(facts, allow_nan=False)
        except ValueError as error:
            raise PlaceError(
                tr("The result for {name} is not a number and was not saved.", name=facts["name"])
            ) from error
    return rows


def _result_to_json(result: StyleResult) -> Facts:
    facts = {name: plain(getattr(result, name)) for name in _RESULT}
    # Earlier versions reject a result without "reason".
    return facts | {"cause": plain(result.shortfall), "reason": None}
