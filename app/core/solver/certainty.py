"""Which styles depend on the sitter's own head and skin more than others: said to the user.

The app computes with a generic head. For most styles any other head would have the sitter turn to
the same place within the tolerance arc; for a few it would not, and those are named. The numbers
come from `turnlight evaluate --bake`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

from app.core.base.errors import CoreError
from app.core.base.paths import resources
from app.core.text import tr

TOLERANCE_DEG: Final = 8.5
"""The tolerance arc of the paper, to either side of the peak, deg."""

CERTAINTY_VERSION: Final = 1
_MOST_BYTES: Final = 1 << 16


@dataclass(frozen=True, slots=True)
class Certainty:
    """How far the best turn of each style lies apart on other heads and skins.

    Attributes:
        spread_deg: Mean angle by style, deg; styles that were attainable nowhere are not in it.
    """

    spread_deg: Mapping[str, float]
    scenes: int
    heads: tuple[str, ...]

    def less_certain(self, style: str) -> bool:
        """Tell whether a style's turn moves further than the tolerance arc reaches."""
        return self.spread_deg.get(style, 0.0) > TOLERANCE_DEG


def caution(style: str, certainty: Certainty | None = None) -> str | None:
    """Say that a style's turn is less certain, None where it is not."""
    known = shipped_certainty() if certainty is None else certainty
    if known is None or not known.less_certain(style):
        return None
    return tr(
        "Less certain: this style depends on the sitter. On other heads and "
        "skins the best turn lay {spread_deg:.0f}° away on average",
        spread_deg=known.spread_deg[style],
    )


@lru_cache(maxsize=1)
def shipped_certainty() -> Certainty | None:
    """Return what ships with the app; None where it is missing, as it only adds a remark."""
    try:
        return load_certainty(resources() / "evaluation" / "certainty.json")
    except CoreError:
        return None


def load_certainty(path: Path) -> Certainty:
    """Read what is known.

    Raises:
        CoreError: If the file is missing, damaged or of another kind.
    """
    hint = tr("Reinstall Turnlight.")
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise CoreError(tr("{name} is too large.", name=path.name), hint)
        facts = json.loads(path.read_text(encoding="utf-8"))
        if int(facts["format_version"]) != CERTAINTY_VERSION:
            raise CoreError(tr("{name} was made by another Turnlight.", name=path.name), hint)
        return Certainty(
            spread_deg={str(k): float(v) for k, v in facts["spread_deg"].items()},
            scenes=int(facts["scenes"]),
            heads=tuple(str(name) for name in facts["heads"]),
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise CoreError(tr("{name} is missing or damaged.", name=path.name), hint) from error
