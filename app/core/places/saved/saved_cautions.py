"""Convert the cautions of a place to and from JSON, and read the lists of earlier versions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from app.core.cautions.caution import Caution, Hazard
from app.core.storage.json_file import Check, Facts, entries, listed, number, optional, record, text

_MOST_CAUTIONS: Final = 100
_MOST_STYLES: Final = 1000
_NAMES: Final = listed(text(4000), _MOST_STYLES)
_HAZARDS: Final = frozenset(Hazard)
_CHECKS: Final[dict[str, Check]] = {
    "hazard": Hazard,
    "amount": optional(number(0.0, 1e6)),
    "styles": optional(_NAMES),
}
_CAUTION: Final = record(Caution, _CHECKS)
# Earlier versions list the styles that depend on clipped light and on gaps under these names.
_CLIPPED, _UNSEEN = "doubtful", "doubtful_unseen"


def cautions_of(value: Any) -> tuple[Caution, ...]:
    """Read cautions, skipping those with hazards from newer versions."""
    rows = listed(entries, _MOST_CAUTIONS)(value)
    return tuple(_CAUTION(row) for row in rows if row.get("hazard") in _HAZARDS)


def cautions_to_json(cautions: Sequence[Caution]) -> Facts:
    """Return the entries for cautions, including those that earlier versions read."""
    return {
        "cautions": [
            {
                "hazard": each.hazard.value,
                "amount": each.amount,
                "styles": None if each.styles is None else list(each.styles),
            }
            for each in cautions
        ],
        _CLIPPED: _styles(cautions, Hazard.CLIPPED, Hazard.ROUGH),
        _UNSEEN: _styles(cautions, Hazard.UNSEEN),
    }


def with_cautions(facts: Facts) -> Facts:
    """Add the cautions to the facts of a capture from an earlier version."""
    if "cautions" in facts:
        return facts
    rough = facts.get("plan") == "rough"
    rows = [
        {"hazard": hazard, "amount": amount, "styles": facts[name]}
        for name, hazard, amount in (
            (_CLIPPED, Hazard.ROUGH if rough else Hazard.CLIPPED, facts.get("clipped_share")),
            (_UNSEEN, Hazard.UNSEEN, facts.get("blind")),
        )
        if facts.get(name)
    ]
    return facts | {"cautions": rows}


def _styles(cautions: Sequence[Caution], *hazards: Hazard) -> list[str]:
    return [
        name
        for each in cautions
        if each.hazard in hazards and each.styles is not None
        for name in each.styles
    ]
