"""Sounds, seen from a presenter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Sounds(Protocol):
    """Plays short sounds; never waits for their end and never fails."""

    def play(self, samples: NDArray[np.int16], volume: float = 1.0) -> None:
        """Play a sound from its beginning; one that still plays is cut off.

        Parameters
        ----------
        samples : (n,) int16
            Mono at `app.core.guidance.tones.RATE`.
        volume : float, optional
            0 to 1.
        """

    def stop(self) -> None:
        """Be quiet."""

    @property
    def available(self) -> bool:
        """Whether this computer can play sounds."""


class Silence:
    """Plays nothing: for tests, and where there is no loudspeaker."""

    available = False

    def play(self, samples: NDArray[np.int16], volume: float = 1.0) -> None:
        """Play nothing."""

    def stop(self) -> None:
        """Do nothing: there is nothing to stop."""


def sound_words(wanted: bool, sounds: Sounds) -> tuple[str, str]:
    """Say whether the guidance is heard, and with which icon."""
    if not wanted:
        return "Sound off", "sound-off"
    if not sounds.available:
        return "No loudspeaker: the guidance is seen, not heard", "sound-off"
    return "Sound on: quicker as you get near", "sound"
