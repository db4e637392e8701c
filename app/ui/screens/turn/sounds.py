"""The sounds of turning: when to play which."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.guidance.tones import Cue, Sound, cue, samples

if TYPE_CHECKING:
    from app.core.guidance.guide import Guide
    from app.ui.presenters.services import Services

_LOOPS: Final = 8  # of the steady tone, one second each, whose end joins its start
_EARLY_S: Final = 0.04  # rather cut the tone a little than let it fall silent


class Beeper:
    """Plays what a guide asks for, as the settings allow."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._playing: Sound = "none"
        self._next_s = 0.0

    def tick(self, shown: Guide | None) -> None:
        """Play the next sound if it is time for it.

        Parameters
        ----------
        shown : Guide or None
            What the screen says; None for nothing to be heard.
        """
        settings = self._services.model.settings
        wanted = Cue("none") if shown is None or not settings.sounds else cue(shown)
        if wanted.sound == "none":
            self.stop()
            return
        now = self._services.clock.now()
        every = wanted.every_s or _LOOPS - _EARLY_S
        if wanted.sound == self._playing:
            # Nearer than before, the next beep comes sooner than it was meant to.
            self._next_s = min(self._next_s, now + every)
            if now < self._next_s:
                return
        elif self._playing == "steady":
            self._services.sounds.stop()
        self._playing, self._next_s = wanted.sound, now + every
        volume = settings.volume / 100.0
        sound = samples(wanted.sound, wanted.step)
        if wanted.sound == "steady":
            sound = np.tile(sound, _LOOPS)
        self._services.sounds.play(sound, volume)

    def stop(self) -> None:
        """Be quiet."""
        if self._playing != "none":
            self._playing = "none"
            self._services.sounds.stop()
