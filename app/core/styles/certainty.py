"""How much the turn for a style depends on the head.

Turnlight computes with a generic head. For most styles, any other head gives the same turn to
within the tolerance arc. The exceptions are listed. The numbers come from
`turnlight evaluate --bake`.
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
"""Half of the paper's tolerance arc, in degrees."""

CERTAINTY_VERSION: Final = 1
_MOST_BYTES: Final = 1 << 16


@dataclass(frozen=True, slots=True)
class Certainty:
    """Spread of the best turn for each style across heads and skins.

    Attributes:
        spread_deg: Mean difference in turn for each style, in degrees. Styles that were never
            within reach are left out.
    """

    spread_deg: Mapping[str, float]
    scenes: int
    heads: tuple[str, ...]

    def less_certain(self, style: str) -> bool:
        """Return whether a style's turn differs between heads by more than the tolerance arc."""
        return self.spread_deg.get(style, 0.0) > TOLERANCE_DEG


def spread_of(style: str, certainty: Certainty | None = None) -> float | None:
    """Return the mean difference in a style's turn between heads, in degrees, or None if small."""
    table = shipped_certainty() if certainty is None else certainty
    if table is None or not table.less_certain(style):
        return None
    return table.spread_deg[style]


@lru_cache(maxsize=1)
def shipped_certainty() -> Certainty | None:
    """Return the certainty data that ship with the program, or None if they are missing."""
    try:
        return load_certainty(resources() / "evaluation" / "certainty.json")
    except CoreError:
        return None


def load_certainty(path: Path) -> Certainty:
    """Read a certainty file.

    Raises:
        CoreError: If the file is missing, damaged or from a different version.
    """
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise CoreError(tr("{name} is too large.", name=path.name), tr("Reinstall Turnlight."))
        facts = json.loads(path.read_text(encoding="utf-8"))
        if int(facts["format_version"]) != CERTAINTY_VERSION:
            raise CoreError(
                tr("{name} was made by another version of Turnlight.", name=path.name),
                tr("Reinstall Turnlight."),
            )
        return Certainty(
            spread_deg={str(k): float(v) for k, v in facts["spread_deg"].items()},
            scenes=int(facts["scenes"]),
            heads=tuple(str(name) for name in facts["heads"]),
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise CoreError(
            tr("{name} is missing or damaged.", name=path.name), tr("Reinstall Turnlight.")
        ) from error
