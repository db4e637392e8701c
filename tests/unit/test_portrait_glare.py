"""Glare in the eyes: the formula on lamps by hand, and the demo scenes at turns known to hurt."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import difference
from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.core.portrait.ratio_and_glare import NOTICEABLE, STRONG, eye_light, glare, light_flow
from app.words.phrases.directions import SIDES, face_direction_words
from app.words.portrait.face_light import flow_words, glare_sentence
from tests.helpers.synthetic import lamp_environment

DEMO = resources() / "demo"
SHAPE = (128, 256)


def lamp(azimuth: float, elevation: float, light: float, size: float = 3.0) -> NDArray[np.float32]:
    """Even light of radiance 1 and a lamp that adds `light` to the illuminance facing it."""
    return (lamp_environment(azimuth, elevation, size, SHAPE) * light + 1.0).astype(np.float32)


def veil_by_hand(away_deg: float, light: float) -> float:
    """L_v / L_b: even light of radiance 1 gives the eye pi, hence L_b = 1."""
    return 10.0 * light * math.cos(math.radians(away_deg)) / away_deg**2


@pytest.mark.slow
@pytest.mark.parametrize("away", [7.0, 12.0, 25.0, 40.0])
@pytest.mark.parametrize("light", [8.0, 40.0])
def test_the_veil_is_that_of_the_formula(away: float, light: float) -> None:
    # A lamp that is small for its distance, as the formula has it.
    found = glare(lamp(-away, 0.0, light, size=2.0), 0.0)
    assert found.veil == pytest.approx(veil_by_hand(away, light), rel=0.06)
    expected = "none" if found.veil < NOTICEABLE else "noticeable"
    if found.veil >= STRONG and away <= 40.0:
        expected = "strong"
    assert found.level == expected


def test_sides_are_the_sitters_own_and_named_twice() -> None:
    # The sitter faces 90: azimuth 78 is counter-clockwise of that, which is at their left.
    found = glare(lamp(78.0, 20.0, 60.0), 90.0)
    assert found.level == "strong"
    assert (found.azimuth_deg, found.elevation_deg) == pytest.approx((12.0, 20.0), abs=0.7)
    assert f" {face_direction_words(12.0, 20.0)}" in glare_sentence(found)
    mirrored = glare(lamp(102.0, 20.0, 60.0), 90.0)
    assert mirrored.azimuth_deg == pytest.approx(-found.azimuth_deg, abs=0.2)
    assert SIDES["right"] in glare_sentence(mirrored)


def test_the_sun_is_named_where_it_is_known() -> None:
    sky = lamp(178.0, 25.0, 60.0)
    assert glare(sky, -175.0, sun=(178.0, 25.0)).kind == "sun"
    assert glare(sky, -175.0, sun=(100.0, 25.0)).kind == "lamp"


@pytest.mark.parametrize(
    ("azimuth", "elevation"),
    [(180.0, 10.0), (75.0, 10.0), (0.0, 62.0), (0.0, -30.0)],
    ids=["behind", "aside", "over the brow", "on the floor"],
)
def test_lamps_that_do_not_shine_into_the_eyes(azimuth: float, elevation: float) -> None:
    assert not glare(lamp(azimuth, elevation, 60.0), 0.0).warns


def test_a_window_is_no_bare_lamp() -> None:
    # 40 degrees wide and twenty times as bright as the room.
    assert glare(lamp(0.0, 10.0, 9.0, size=40.0), 0.0).level == "none"


def test_exposure_does_not_matter() -> None:
    sky = lamp(10.0, 20.0, 40.0)
    assert glare(sky * np.float32(1e-4), 0.0).veil == pytest.approx(glare(sky, 0.0).veil, rel=1e-3)


@pytest.mark.parametrize("light", [np.zeros(SHAPE, np.float32), np.ones(SHAPE, np.float32)])
def test_no_light_and_even_light_have_no_glare(light: NDArray[np.float32]) -> None:
    assert glare(light, 30.0).level == "none"


def test_only_panoramas_are_judged() -> None:
    with pytest.raises(ValueError, match="panorama"):
        glare(np.ones((10, 10), np.float32), 0.0)


def worst(scene: str) -> tuple[dict[float, str], NDArray[np.float32]]:
    light = eye_light(read_environment(DEMO / scene).radiance)
    return {turn: glare(light, turn).level for turn in np.arange(-180.0, 180.0, 5.0)}, light


def test_the_low_sun_of_the_field_blinds_whoever_faces_it() -> None:
    levels, light = worst("scenes/sunrise.exr")
    sun = -light_flow(light, 0.0).azimuth_deg
    assert glare(light, sun).level == "strong"
    for turn, level in levels.items():
        away = abs(difference(turn, sun))
        if away < 25.0:
            assert level == "strong"
        if away > 60.0:
            assert level == "none"


def test_the_demo_courtyard_has_its_sun_where_the_file_says() -> None:
    place = json.loads((DEMO / "location" / "location.json").read_text(encoding="utf-8"))
    sun = (place["sun"]["azimuth_deg"], place["sun"]["elevation_deg"])
    light = eye_light(read_environment(DEMO / "location" / "probe-3.exr").radiance)
    # 47 degrees up: it is noticed, and the brow keeps the worst away.
    facing = glare(light, sun[0] + 10.0, sun)
    assert facing.level == "noticeable"
    assert facing.azimuth_deg == pytest.approx(10.0, abs=1.0)
    assert facing.elevation_deg == pytest.approx(sun[1], abs=1.0)
    assert glare_sentence(facing).startswith("The sun is in the sitter’s view")
    assert glare(light, sun[0] + 90.0, sun).level == "none"


@pytest.mark.parametrize("scene", ["location/probe-1.exr", "scenes/courtyard.exr"])
def test_shade_has_no_glare_at_any_turn(scene: str) -> None:
    levels, _ = worst(scene)
    assert set(levels.values()) == {"none"}


def test_flow_of_one_lamp_and_of_even_light() -> None:
    one = lamp_environment(-30.0, 20.0, 6.0, SHAPE).astype(np.float32)
    flow = light_flow(one, 60.0)
    # From the sitter who faces 60, azimuth -30 is 90 degrees counter-clockwise: at their left.
    assert (flow.azimuth_deg, flow.elevation_deg) == pytest.approx((90.0, 20.0), abs=0.5)
    assert flow.strength == pytest.approx(4.0, abs=0.02)
    assert flow_words(flow).startswith("Hard light with deep shadows from 90° to the sitter’s left")
    even = light_flow(np.ones(SHAPE, np.float32), 0.0)
    assert even.strength < 0.01
    assert flow_words(even) == "Nearly even light from all around"
    assert light_flow(np.zeros(SHAPE, np.float32), 0.0).strength == 0.0


def test_flow_of_an_overcast_sky_is_from_overhead() -> None:
    sky = np.zeros(SHAPE, np.float32)
    sky[: SHAPE[0] // 2] = 1.0
    flow = light_flow(sky, 10.0)
    # A hemisphere: vector pi, scalar 2 pi / 4.
    assert flow.strength == pytest.approx(2.0, abs=0.01)
    assert flow_words(flow) == "Strong light with clear shadows from overhead"
