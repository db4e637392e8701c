"""The sign that is shown during a capture and can be read from three metres away."""

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
    """The sign for a photographer who kneels under the camera, three metres away.

    Attributes:
        kind: Meaning of the colours: "wait", "act" (kneel and stay) or "move".
        big, caption: Display text such as "Frame 3 of 6" and "Stay down".
        fraction: Fraction of the exposures taken, from 0 to 1, or None before the first exposure.
        spoken: Sentence that is spoken whenever it changes, or an empty string for silence.
        picture: The panorama taken for metering, (h, 2 h, 3) uint8 sRGB, or None if there is none.
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
    """Build the sign for the status of a capture.

    Args:
        count: Number of seconds left on the self-timer.
        delay_s: Length of the self-timer, in seconds.
    """
    message, early = _timed(progress_words(status.message), status), status.stage in _BEFORE
    if not early and (status.may_move or status.stage not in _SHOOTING):
        return DistantSign("move", _MOVE, message, spoken=_MOVE)
    if status.seeking:
        return DistantSign(big=tr("Stay there"), caption=message)
    if early:
        return DistantSign(caption=message)
    if count:
        # The seconds are already displayed in large type.
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
