"""Light and the best styles out of one picture of a camera's live preview."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from app.core.base.arrays import Bytes
from app.core.base.colour import luminance, srgb_encode, to_bytes
from app.core.environment.environment import SHAPE, energy
from app.core.measure.single.preview import answers_of, preview_light, rough_answers
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from app.words.measure.preview import rough_words
from tests.helpers.probes import place


@cache
def pack() -> StylePack:
    return load_named_pack("generic")


def seen(*lamps: tuple[float, float, float, float], gain: float = 0.05) -> Bytes:
    """A camera's picture of a dim room with lamps: azimuth, elevation, diameter, radiance."""
    return to_bytes(srgb_encode(gain * place(list(lamps))))


def test_what_is_not_clipped_is_linear_light() -> None:
    picture = np.full((256, 512, 3), 60, np.uint8)
    picture[:, 256:] = 120
    light = preview_light(picture, SHAPE)
    assert light is not None
    assert light.clipped_share == 0.0
    assert np.array_equal(light.light, light.lamps)
    # 60 and 120 are 0.0452 and 0.1878 of linear light (IEC 61966-2-1).
    assert light.light[16, 40, 0] / light.light[16, 10, 0] == pytest.approx(4.157, rel=1e-3)


def test_what_is_clipped_counts_as_three_stops_brighter_and_a_small_one_as_a_lamp() -> None:
    picture = np.full((256, 512, 3), 60, np.uint8)
    plain = preview_light(picture, SHAPE)
    # 1.4 x 1.4 deg at the horizon: 6e-4 sr, as a lamp 5 / sqrt(6e-4) = 204 times as bright.
    picture[127:129, 255:257] = 255
    lit = preview_light(picture, SHAPE)
    assert plain is not None
    assert lit is not None
    added, lamp = (
        float(energy(luminance(now)) - energy(luminance(before)))
        for now, before in ((lit.light, plain.light), (lit.lamps, plain.lamps))
    )
    solid_angle = (2 * np.pi / 256) ** 2
    assert added == pytest.approx(solid_angle * (8.0 - 0.0452), rel=0.02)
    assert lamp == pytest.approx(solid_angle * (5.0 / np.sqrt(solid_angle) - 0.0452), rel=0.02)
    assert lit.clipped_share == pytest.approx(8.0 * solid_angle / (0.0452 * 4 * np.pi), rel=0.05)


@pytest.mark.parametrize("shape", [(64, 64, 3), (16, 32, 3), (200, 401, 3)])
def test_no_whole_panorama(shape: tuple[int, int, int]) -> None:
    assert preview_light(np.full(shape, 90, np.uint8), SHAPE) is None


def test_black() -> None:
    assert preview_light(np.zeros((64, 128, 3), np.uint8), SHAPE) is None
    assert rough_words(answers_of(None, pack())) == ""


def test_the_best_three_by_grade_then_match() -> None:
    light = preview_light(seen((40.0, 35.0, 12.0, 40.0)), SHAPE)
    assert light is not None
    answers = rough_answers(light, pack())
    assert 1 <= len(answers) <= 3
    keys = [(one.result.grade == "soft", -one.result.match) for one in answers]
    assert keys == sorted(keys)
    assert all(one.result.attainable for one in answers)
    words = rough_words(answers_of(seen((40.0, 35.0, 12.0, 40.0)), pack()))
    assert words.startswith("Rough first answer: ")
    assert answers[0].result.title in words


def test_turns_move_with_the_panorama() -> None:
    picture = seen((40.0, 35.0, 12.0, 40.0))
    moved = np.roll(picture, picture.shape[1] // 4, axis=1)  # 90 deg to the right
    one, other = (preview_light(each, SHAPE) for each in (picture, moved))
    assert one is not None
    assert other is not None
    first, second = (rough_answers(light, pack()) for light in (one, other))
    assert [each.result.name for each in first] == [each.result.name for each in second]
    for before, now in zip(first, second, strict=True):
        turned = (now.result.turn_refined_deg - before.result.turn_refined_deg) % 360.0
        assert turned == pytest.approx(90.0, abs=0.5)


def test_a_turn_that_hangs_on_a_clipped_lamp_needs_the_bracket() -> None:
    """A large grey window at one side, a clipped bulb at the other: which one is stronger?"""
    window, bulb = (-100.0, 20.0, 60.0, 2.0), (80.0, 30.0, 4.0, 400.0)
    hanging = preview_light(seen(window, bulb), SHAPE)
    lone = preview_light(seen(window), SHAPE)
    assert hanging is not None
    assert lone is not None
    assert any(one.unsure for one in rough_answers(hanging, pack()))
    assert not any(one.unsure for one in rough_answers(lone, pack()))
