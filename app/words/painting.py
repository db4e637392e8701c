"""Sentences about paintings."""

from __future__ import annotations

from typing import Final

from app.core.painting.canvas import Advice
from app.core.text import tr

_ADVICE: Final = {
    Advice.NOTHING_PAINTED: tr("Nothing painted yet"),
    Advice.ONE_SIDED: tr("Paint at least one brighter area and one darker area."),
}


def advice_words(advice: Advice | None) -> str:
    """Describe what a canvas still needs, or return "" if nothing is missing."""
    return "" if advice is None else _ADVICE[advice]
