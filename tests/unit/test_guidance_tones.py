"""Sounds: quicker as one gets near, without clicks, and never too loud."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from app.core.guidance.beeps import RATE, Cue, Sound, chime, cue, samples
from app.core.guidance.guide import Goal, HeadingSource, Reading, guide

GOAL = Goal(96.0, (79.0, 111.0))


def heard(turn: float) -> Cue:
    return cue(guide(GOAL, Reading(turn, 0.0))[0])


def test_quicker_as_one_gets_near() -> None:
    cues = [heard(turn) for turn in (-60.0, 0.0, 30.0, 60.0, 78.0)]
    assert all(one.sound == "beep" for one in cues)
    pauses = [one.every_s for one in cues]
    assert pauses == sorted(pauses, reverse=True)
    assert pauses[-1] < pauses[0] / 2
    assert all(one.every_s > 0.1 for one in cues)
    assert [one.step for one in cues] == sorted(one.step for one in cues)


def test_inside_and_hold_sound_different() -> None:
    assert heard(85.0).sound == "pair"
    assert heard(95.0).sound == "steady"


def test_the_same_from_both_sides() -> None:
    assert heard(60.0) == heard(132.0)


def test_a_nose_that_is_off_beeps_as_a_turn_of_so_many_degrees_does() -> None:
    aside = Goal(96.0, (79.0, 111.0), yaw_deg=30.0)
    cues = [cue(guide(aside, Reading(96.0, 100.0, yaw_deg=yaw))[0]) for yaw in (-30.0, 10.0, 30.0)]
    assert [one.sound for one in cues] == ["beep", "beep", "steady"]
    assert cues[:2] == [heard(36.0), heard(76.0)]


def test_nothing_without_a_number() -> None:
    shown, _ = guide(GOAL, Reading(None, 0.0, HeadingSource.NONE))
    assert cue(shown) == Cue("none")
    assert cue(guide(GOAL, Reading(None, 0.0))[0]).sound == "none"


@pytest.mark.parametrize(
    ("sound", "step"), list(itertools.product(["beep", "pair"], [0, 3, 7, 99]))
)
def test_tones_are_pcm_without_clicks(sound: Sound, step: int) -> None:
    made = samples(sound, step)
    assert made.dtype == np.int16
    assert made.ndim == 1
    assert 0.2 * 32767 < np.abs(made.astype(int)).max() < 0.5 * 32767
    assert abs(int(made[0])) < 50
    assert abs(int(made[-1])) < 50
    assert len(made) / RATE < 0.25


def test_the_steady_tone_can_be_looped() -> None:
    made = samples("steady").astype(int)
    assert len(made) == RATE
    steps = np.abs(np.diff(np.concatenate([made, made])))
    assert steps[len(made) - 1] <= steps[: len(made) - 1].max()


def test_the_chime_is_heard_and_rings_out() -> None:
    made = chime().astype(float)
    assert 0.2 * 32767 < np.abs(made).max() < 0.9 * 32767
    assert np.abs(made[-RATE // 20 :]).max() < 0.05 * np.abs(made).max()
    assert 0.8 < len(made) / RATE < 2.0


def test_pitches_rise() -> None:
    tops = []
    for step in (0, 4, 8):
        spectrum = np.abs(np.fft.rfft(samples("beep", step), RATE))
        tops.append(int(spectrum.argmax()))
    assert tops == sorted(tops)
    assert tops[-1] - tops[0] > 200
    assert samples("none").size == 0
