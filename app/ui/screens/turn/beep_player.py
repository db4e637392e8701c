"""The sounds of the guidance: faster beeps near the light, and a steady tone in the light."""

from __future__ import annotations

from typing import Final

import numpy as np

from app.core.guidance.beeps import Cue, Sound, cue, samples
from app.core.guidance.guide import Guide
from app.ui.presenters.services import Services

_LOOPS: Final = 8  # seconds of the steady tone, which loops without a click
_EARLY_S: Final = 0.04  # replays slightly early, because an overlap is less noticeable than a gap


class BeepPlayer:
    """Plays the sounds of the guidance if the settings allow it."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._playing: Sound = "none"
        self._next_s = 0.0

    def tick(self, guidance: Guide | None) -> None:
        """Play the next sound if it is due, or stop the sound if `guidance` is None."""
        settings = self._services.model.settings
        target_cue = Cue("none") if guidance is None or not settings.sounds else cue(guidance)
        if target_cue.sound == "none":
            self.stop()
            return
        now = self._services.clock.now()
        every = target_cue.every_s or _LOOPS - _EARLY_S
        if target_cue.sound == self._playing:
            # Closer to the light, the next beep is due sooner than first planned.
            self._next_s = min(self._next_s, now + every)
            if now < self._next_s:
                return
        elif self._playing == "steady":
            self._services.sounds.stop()
        self._playing, self._next_s = target_cue.sound, now + every
        volume = settings.volume / 100.0
        sound = samples(target_cue.sound, target_cue.step)
        if target_cue.sound == "steady":
            sound = np.tile(sound, _LOOPS)
        self._services.sounds.play(sound, volume)

    def stop(self) -> None:
        """Stop the sound."""
        if self._playing != "none":
            self._playing = "none"
            self._services.sounds.stop()
