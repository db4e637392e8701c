"""The words of the guidance: short ones are made, not cut."""

from __future__ import annotations

from app.core.guidance.guide import LOST, Goal, HeadingSource, Phase, Reading, guide
from app.core.guidance.who_moves import Mode
from app.words.guidance import HOLD, IN_LIGHT, guide_words, trouble_line

GOAL = Goal(96.0, (79.0, 111.0))


def test_trouble_has_a_line_of_one_sentence() -> None:
    lines = {phase for phase in Phase if trouble_line(phase)}
    assert lines == {*LOST, Phase.LEFT, Phase.AWAY}
    for phase in (*LOST, Phase.LEFT):
        assert trouble_line(phase).count(".") == 1


def test_by_eye_names_what_is_missing() -> None:
    shown, _ = guide(GOAL, Reading(None, 0.0, HeadingSource.STARTING))
    words = guide_words(shown, Mode.WALK, "Starting the webcam")
    assert words.spoken == (
        "Starting the webcam. Turn 96° clockwise, towards 3 o’clock. Walk to your left."
    )
    assert words.headline == "Starting the webcam. Turn 96° clockwise, towards 3 o’clock"


def test_the_spoken_words_name_light_number_and_direction() -> None:
    inside, memory = guide(GOAL, Reading(92.0, 0.0))
    assert f" {IN_LIGHT.here}. 4°" in guide_words(inside).spoken
    held, _ = guide(GOAL, Reading(96.0, 0.2), memory)
    assert guide_words(held).spoken.endswith(f" {IN_LIGHT.here}. {HOLD}.")
