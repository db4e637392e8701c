"""A camera that does not answer."""

from __future__ import annotations

from typing import Final

from app.devices.simulated.exchange import Reply

NO_ANSWER_S: Final = 600.0
"""A delay that outlasts any client's patience."""

NO_ANSWER: Final = Reply(0, delay_s=NO_ANSWER_S)
"""Nothing is there: not even the connection is taken."""
