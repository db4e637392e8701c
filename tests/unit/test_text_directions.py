"""Words that say where a light is."""

from __future__ import annotations

import pytest

from app.core.second_light.placements import direction
from app.words.phrases.directions import (
    direction_words,
    face_direction_words,
    light_words,
    placement_words,
)


@pytest.mark.parametrize(
    ("azimuth", "words"),
    [
        (0.0, "in front"),
        (-20.0, "in front, a little to the sitter’s right (camera left)"),
        (45.0, "half in front, half to the sitter’s left (camera right)"),
        (-75.0, "to the sitter’s right (camera left), a little in front"),
        (90.0, "to the sitter’s left (camera right)"),
        (-90.0, "to the sitter’s right (camera left)"),
        (270.0, "to the sitter’s right (camera left)"),
        (112.0, "to the sitter’s left (camera right), a little behind"),
        (-135.0, "half behind, half to the sitter’s right (camera left)"),
        (160.0, "behind, a little to the sitter’s left (camera right)"),
        (180.0, "behind"),
        (-180.0, "behind"),
    ],
)
def test_sides_in_words(azimuth: float, words: str) -> None:
    assert placement_words(azimuth, 1.0) == f"{words}, at the height of the ears"


def test_words_with_height_and_distances() -> None:
    assert placement_words(112.0, 20.4, 0.3, 0.213) == (
        "to the sitter’s left (camera right), a little behind, raised 20°, "
        "30 cm from the middle of the head, about 20 cm from the skin"
    )
    assert placement_words(0.0, -34.0, 1.25, 1.13).endswith(
        "lowered 34°, 1.2 m from the middle of the head, about 1.1 m from the skin"
    )


def test_words_say_the_side_that_the_direction_has() -> None:
    for azimuth in range(-175, 180, 10):
        if abs(azimuth) < 8 or abs(azimuth) > 172:
            continue
        # +X is the sitter’s left, which the camera in front sees on its right.
        on_left = direction(azimuth, 0.0)[0] > 0
        wanted = "left (camera right)" if on_left else "right (camera left)"
        assert wanted in placement_words(azimuth, 0.0)


@pytest.mark.parametrize(
    ("azimuth", "elevation", "words"),
    [
        (0.2, 0.3, "straight ahead, at eye level"),
        (179.8, 5.0, "straight behind, 5° up"),
        (-40.0, -12.0, "40° to the sitter’s right (camera left), 12° down"),
    ],
)
def test_directions_from_the_face(azimuth: float, elevation: float, words: str) -> None:
    assert face_direction_words(azimuth, elevation) == words


@pytest.mark.parametrize(
    ("azimuth", "elevation", "words"),
    [
        (90.0, 0.0, "sitter’s right (camera left)"),
        (-90.0, 0.0, "sitter’s left (camera right)"),
        (45.0, 0.0, "in front, sitter’s right (camera left)"),
        (-130.0, 45.0, "behind, sitter’s left (camera right), high"),
        (178.0, -30.0, "behind, low"),
        (10.0, 80.0, "overhead"),
    ],
)
def test_where_a_light_is_for_the_sitter(azimuth: float, elevation: float, words: str) -> None:
    assert direction_words(azimuth, elevation, of_sitter=True) == words


def test_sides_are_named_twice() -> None:
    assert light_words("left") == "Light from the sitter’s left (camera right)"
    assert light_words("right") == "Light from the sitter’s right (camera left)"
    assert light_words("none", "in front, from above") == "Light from in front and above"
    assert light_words("none") == ""
