"""A camera that does not answer, or hangs up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.devices.simulated.exchange import Pause, Reply

NO_ANSWER_S: Final = 600.0
"""A delay that outlasts any client's patience."""

NO_ANSWER: Final = Reply(0, delay_s=NO_ANSWER_S)
"""Nothing is there: not even the connection is taken."""


@dataclass(frozen=True, slots=True)
class Drop(Pause):
    """The connection is cut here."""

    seconds: float = 0.0
