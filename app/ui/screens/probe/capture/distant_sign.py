"""The sign that is read from three metres during a capture."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from app.core.text import tr
from app.devices.capture.status import Stage, Status
from app.ui.screens.probe.capture.notice import NUMBERS
from app.words.progress import progress_words


@dataclass(frozen=True, slots=True)
class DistantSign:
    """The sign for somebody who kneels under the camera, three metres away.

    Attributes:
        kind: Of its colours: "wait", "act" (kneel and stay) or "move".
        big, caption: "Frame 3 of 6", "Stay down".
        fraction: Of the exposures, 0 to 1; None while none is made.
        spoken: What a voice says when it has changed; empty for nothing.
        picture: (h, 2 h, 3) uint8 or None. Metered panorama, the first panorama; sRGB.
    """

    kind: Literal["wait", "act", "move"] = "wait"
    big: str = tr("Get ready")
    caption: str = ""
    fraction: float | None = None
    spoken: str = ""
    picture: NDArray[np.uint8] | None = field(default=None, compare=False, repr=False)


_COUNT_ALOUD: Final = 3  # the last seconds are counted down aloud

_KNEEL: Final = tr("Kneel now")

_MOVE: Final = tr("You may move")

_BEFORE: Final = (Stage.IDLE, Stage.CONNECTING)

_SHOOTING: Final = (Stage.METERING, Stage.EXPOSING)


def sign_of(status: Status, count: int, delay_s: int) -> DistantSign:
    """Make the sign; `count`: seconds left on the self-timer."""
    message, early = _timed(progress_words(status.message), status), status.stage in _BEFORE
    if not early and (status.may_move or status.stage not in _SHOOTING):
        return DistantSign("move", _MOVE, message, spoken=_MOVE)
    if status.seeking:
        return DistantSign(big=tr("Stay there"), caption=message)
    if early:
        return DistantSign(caption=message)
    if count:
        # The seconds stand in large type already.
        spoken = NUMBERS[count] if count <= _COUNT_ALOUD else _KNEEL
        return DistantSign("act", str(count), _KNEEL, spoken=spoken)
    if status.shot:
        frame = tr("Frame {shot} of {shots}", shot=status.shot, shots=status.shots)
        stay = _timed(tr("Stay down"), status)
        return DistantSign("act", frame, stay, (status.shot - 1) / status.shots, frame)
    if delay_s:
        return DistantSign(caption=message)
    return DistantSign("act", _KNEEL, message, spoken=_KNEEL)


def _timed(message: str, status: Status) -> str:
    remaining = status.left_words
    return tr("{message}: {left}", message=message, left=remaining) if remaining else message
