"""Sentences must be true of the light they are said of."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.solver.light_map import LightMap, light_shortfall
from app.core.solver.shortfall import Cause, LightShortfall, Origin
from app.core.solver.turn_choice import Limits
from app.core.styles.style import Style
from app.core.styles.styles import load_styles
from app.words.why_out_of_reach import reason_sentence
from tests.helpers.synthetic import lamp_environment, solid_angles, texel_directions

Float = NDArray[np.float64]
STYLES = {style.name: style for style in load_styles()}
LIMITS = Limits()


def _reason(
    name: str, light: Float, match: float, strength: float, turn: float = 0.0
) -> LightShortfall | None:
    return light_shortfall(STYLES[name], match, strength, LIMITS, LightMap(light), turn)


def _cause(
    name: str, light: Float, match: float, strength: float, turn: float = 0.0
) -> tuple[Cause, str, Origin | None] | None:
    reason = _reason(name, light, match, strength, turn)
    return None if reason is None else (reason.cause, reason.measure, reason.origin)


def test_an_attainable_style_needs_no_reason() -> None:
    assert _cause("below", lamp_environment(0, -45), 45.0, 20.0) is None


def test_even_light_is_called_even() -> None:
    assert _cause("top", np.ones((32, 64)), 60.0, 12.9) == (Cause.EVEN, "contrast", None)
    assert _cause("top", np.ones((32, 64)), 30.0, 25.0) == (Cause.EVEN, "match", None)


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("below", Origin.BELOW),
        ("left-below-side", Origin.BELOW),
        ("top", Origin.ABOVE),
        ("right-rim", Origin.BEHIND),
        ("left-split", Origin.SIDE),
        ("left-loop", Origin.HIGH_IN_FRONT),
        ("flat", Origin.FRONT),
    ],
)
def test_a_missing_lamp_is_named_by_its_place(name: str, place: Origin) -> None:
    away = -80.0 if STYLES[name].lamps[0].elevation_deg > 0 else 60.0
    light = lamp_environment(0.0, away)
    assert _cause(name, light, 14.3, 50.0) == (Cause.NO_LIGHT, "match", place)


def test_the_place_named_has_no_strong_light_at_any_turn() -> None:
    """A lamp of the style's height somewhere around is not called missing."""
    light = lamp_environment(130.0, -45.0) + 3 * lamp_environment(-50.0, 10.0)
    assert _cause("below", light, 30.0, 50.0) == (Cause.SPOILED, "match", None)


def test_one_of_two_lamps_missing() -> None:
    light = lamp_environment(-95.0, 0.0)
    assert _cause("badger", light, 39.0, 90.0) == (Cause.ONE_SIDE, "match", None)
    light = lamp_environment(-35.0, 35.0)
    assert _cause("left-loop-rim", light, 30.0, 90.0) == (Cause.ONE_SIDE, "match", None)
    light = lamp_environment(0.0, 45.0)
    assert _cause("clamshell", light, 30.0, 90.0) == (Cause.ONE_LAMP, "match", Origin.BELOW)


def test_all_lamps_missing() -> None:
    light = lamp_environment(0.0, -80.0)
    assert _cause("badger", light, 3.0, 90.0) == (Cause.NO_LIGHT, "match", Origin.SIDE)


def test_light_is_there_but_drowned() -> None:
    light = lamp_environment(0.0, 45.0) + lamp_environment(100.0, 30.0) + 0.01
    assert _cause("butterfly", light, 60.0, 15.0) == (Cause.FILLED, "contrast", None)


def test_numbers_never_read_as_their_limit_nor_below_zero() -> None:
    light = lamp_environment(0.0, 45.0)
    assert " 44 " in reason_sentence(_reason("butterfly", light, 44.99, 90.0))
    assert " 0 " in reason_sentence(_reason("butterfly", light, -20.0, -5.0))


def test_painted_weights_have_no_lamps_to_name() -> None:
    light = LightMap(lamp_environment(0.0, 45.0))
    found = light_shortfall(None, 10.0, 50.0, LIMITS, light, 0.0)
    assert found == LightShortfall(Cause.NO_TURN, "match", 10.0, LIMITS.match)
    assert reason_sentence(found) == "No turn gives this pattern here: match 10 of 100"


def test_a_ring_is_the_mean_radiance_in_lobes() -> None:
    rng = np.random.default_rng(1)
    light = rng.random((32, 64))
    directions = texel_directions(32, 64)
    area = solid_angles(32, 64)[:, None]
    for column in (0, 20, 63):
        azimuth = 2 * np.pi * ((column + 0.5) / 64 - 0.5)
        elevation = np.radians(30.0)
        towards = [
            -np.sin(azimuth) * np.cos(elevation),
            np.sin(elevation),
            np.cos(azimuth) * np.cos(elevation),
        ]
        lobe = np.maximum(directions @ towards, 0) ** 20 * area
        expected = (lobe * light).sum() / lobe.sum()
        assert LightMap(light).ring(30.0)[column] == pytest.approx(expected, rel=1e-3)


def test_a_uniform_place_is_even_and_a_lamp_is_not() -> None:
    assert LightMap(np.ones((32, 64))).is_even
    assert LightMap(np.ones((32, 64))).brightest == pytest.approx(1.0)
    assert not LightMap(lamp_environment(0.0, 30.0)).is_even


def test_every_style_gets_a_sentence_everywhere() -> None:
    for style in STYLES.values():
        assert isinstance(style, Style)
        for azimuth in (0.0, 90.0, 180.0):
            for elevation in (-60.0, 0.0, 60.0):
                light = lamp_environment(azimuth, elevation)
                said = reason_sentence(_reason(style.name, light, 20.0, 10.0))
                assert said[0].isupper()
                assert len(said) < 80
