"""What a screen reader is told while one turns: seldom, but at once of something new."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from app.core.guidance.guide import Phase
    from app.ui.screens.turn.state import Guidance

_PAUSE_S: Final = 3.0


class SpeechThrottle:
    """Does not talk without a pause: one sentence in some seconds, or a new state."""

    def __init__(self) -> None:
        self._told: tuple[Phase | None, str, float] = (None, "", -_PAUSE_S)

    def tell(self, guidance: Guidance, now_s: float) -> Guidance:
        """Fill in what is told."""
        phase, told, since = self._told
        if guidance.phase is not phase or (guidance.spoken != told and now_s - since >= _PAUSE_S):
            self._told = (guidance.phase, guidance.spoken, now_s)
        return replace(guidance, announced=self._told[1])
