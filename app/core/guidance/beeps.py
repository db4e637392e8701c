"""Sounds for the guidance, synthesised from sine waves as 16-bit mono samples.

During a turn, the beeps get faster and slightly higher towards the goal. Inside the arc they come
in pairs, and within two degrees of the goal they become a steady tone. The photographer can
therefore keep looking at the sitter.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Float64
from app.core.guidance.guide import Guide, Phase

Pcm: TypeAlias = NDArray[np.int16]
Sound: TypeAlias = Literal["beep", "pair", "steady", "none"]
"""Kind of sound that is played during a turn."""

RATE: Final = 44_100
"""Number of samples per second."""

_LEVEL: Final = 0.35  # of full scale: audible outdoors without startling the sitter
_FADE_S: Final = 0.008  # without a fade, every tone begins and ends with a click
_STEADY_HZ: Final = 880.0
_STEADY_S: Final = 1.0
_BEEP_S: Final = 0.07
_FAR_DEG: Final = 90.0
_SLOWEST_S: Final = 1.2
_QUICKEST_S: Final = 0.16
_LOWEST_HZ: Final = 520.0
_HIGHEST_HZ: Final = 830.0
_STEPS: Final = 8  # number of pitches, so that only a few sounds are made and cached


@dataclass(frozen=True, slots=True)
class Cue:
    """The sound to play during a turn.

    Attributes:
        sound: ``beep``, ``pair`` (two beeps, inside the arc), ``steady`` (a loop) or ``none``.
        every_s: Time between the starts of two beeps, in seconds, or 0 for ``steady`` and ``none``.
        step: Pitch, 0 to 8, which rises towards the goal.
    """

    sound: Sound
    every_s: float = 0.0
    step: int = 0


def cue(guidance: Guide) -> Cue:
    """Return the sound for a guide, which is ``none`` while there is no number to show."""
    if guidance.to_go is None:
        return Cue("none")
    if guidance.phase is Phase.HOLD:
        return Cue("steady", step=_STEPS)
    to_go = guidance.further if guidance.phase is Phase.NOSE else guidance.to_go
    near = 1.0 - min(abs(to_go), _FAR_DEG) / _FAR_DEG
    every = _SLOWEST_S * (_QUICKEST_S / _SLOWEST_S) ** near
    step = min(int(near * _STEPS), _STEPS - 1)
    if guidance.inside:
        return Cue("pair", max(every, 2.0 * _QUICKEST_S), step)
    return Cue("beep", every, step)


@cache
def samples(sound: Sound, step: int = 0) -> Pcm:
    """Return the samples of one sound.

    Returns:
        (N,) int16, read-only. Mono samples at `RATE`. ``steady`` is a seamless one-second loop, and
        ``none`` is empty.
    """
    if sound == "none":
        wave = np.zeros(0, np.int16)
    elif sound == "steady":
        wave = _pcm(_sine(_STEADY_HZ, _STEADY_S))
    else:
        share = min(max(step, 0), _STEPS) / _STEPS
        beep = _faded(_sine(_LOWEST_HZ + share * (_HIGHEST_HZ - _LOWEST_HZ), _BEEP_S))
        gap = np.zeros(round(0.05 * RATE))
        wave = _pcm(np.concatenate([beep, gap, beep]) if sound == "pair" else beep)
    wave.setflags(write=False)
    return wave


@cache
def chime() -> Pcm:
    """Return the chime for "You may move now", which consists of three rising notes that fade out.

    Returns:
        (N,) int16, read-only. Mono samples at `RATE`, about 1.2 s long.
    """
    length = round(1.2 * RATE)
    mixed = np.zeros(length)
    for place, pitch in enumerate((523.25, 659.26, 783.99)):
        start = round(0.16 * place * RATE)
        time = np.arange(length - start) / RATE
        ring = np.exp(-time / 0.25) * (1.0 - np.exp(-time / 0.004))
        tone = np.sin(2.0 * np.pi * pitch * time) + 0.3 * np.sin(4.0 * np.pi * pitch * time)
        mixed[start:] += 0.6 * ring * tone
    wave = _pcm(_faded(mixed))
    wave.setflags(write=False)
    return wave


def _sine(pitch_hz: float, seconds: float) -> Float64:
    time = np.arange(round(seconds * RATE)) / RATE
    return np.asarray(np.sin(2.0 * np.pi * pitch_hz * time))


def _faded(wave: Float64) -> Float64:
    count = round(_FADE_S * RATE)
    ramp = 0.5 - 0.5 * np.cos(np.pi * np.arange(count) / count)
    faded = wave.copy()
    faded[:count] *= ramp
    faded[-count:] *= ramp[::-1]
    return faded


def _pcm(wave: Float64) -> Pcm:
    return np.round(np.clip(_LEVEL * wave, -1.0, 1.0) * 32767.0).astype(np.int16)
