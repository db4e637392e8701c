"""Lamps from numbers: what is built in, and what is refused in a sentence."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from app.core.base.colour import LUMINANCE_WEIGHTS
from app.core.base.errors import CoreError
from app.core.second_light.lamp_presets import KINDS, at_distance, parse


def test_words_of_every_kind() -> None:
    assert {"phone", "panel", "flash", "softbox"} <= set(KINDS)
    for name, kind in KINDS.items():
        lamp = parse(name)
        assert (lamp.kind, lamp.distance_m) == (name, kind.distance_m)
        assert parse(f" {name.upper()}@0.75 ") == at_distance(kind, 0.75)
        assert float(np.dot(LUMINANCE_WEIGHTS, lamp.colour)) == pytest.approx(1.0, abs=0.01)


def test_metres_may_say_so() -> None:
    assert parse("phone@0.3m") == parse("phone@0.3") == parse("phone@.3")


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("lantern", "no lamp “lantern”"),
        ("", "no lamp “"),
        ("@0.3", "no lamp “"),
        ("phone@near", "“near” is not a distance"),
        ("phone@", "“” is not a distance"),
        ("phone@nan", "“nan” is not a distance"),
        ("phone@inf", "“inf” is not a distance"),
        ("phone@0.3@0.4", "is not a distance"),
        ("phone@0.05", "0.05 m from the middle of the head"),
        ("phone@-1", "-1 m from the middle of the head"),
        ("phone@30", "30 m from the middle of the head"),
    ],
)
def test_bad_words_are_answered_with_a_sentence_and_what_to_do(word: str, said: str) -> None:
    with pytest.raises(CoreError, match=said) as found:
        parse(word)
    assert found.value.hint


@pytest.mark.parametrize("lux", [0.0, -5.0, math.nan, math.inf, 1e9])
def test_no_lamp_without_light(lux: float) -> None:
    with pytest.raises(CoreError, match="No lamp gives"):
        replace(parse("panel"), lux_at_1m=lux)


@pytest.mark.parametrize("size", [(0.0, 0.1), (0.1, math.nan), (9.0, 9.0), (-0.1, 0.1)])
def test_no_lamp_without_a_size(size: tuple[float, float]) -> None:
    with pytest.raises(CoreError, match="cannot be used"):
        replace(parse("panel"), size_m=size)


def test_numbers_fit_their_words() -> None:
    # A phone of 600 cd/m2, 7 x 15 cm: E = L A / d^2.
    assert parse("phone").luminance == pytest.approx(600.0)
    assert parse("tablet").luminance == pytest.approx(500.0, rel=0.02)
    # 50 lm over half the room, Lambertian: I = flux / pi.
    assert parse("torch").lux_at_1m == pytest.approx(50.0 / math.pi, rel=0.01)
    # Guide number 40 at ISO 100: f/40 at 1 m. An incident meter asks 250 N^2 / 100 lux seconds for
    # that; 1/16 of them in 1/160 s.
    assert parse("flash").lux_at_1m == pytest.approx(250.0 * 40**2 / 100.0 / 16.0 * 160.0)


def test_a_round_lamp_is_an_ellipse() -> None:
    bulb = parse("bulb")
    assert bulb.round
    assert bulb.luminance == pytest.approx(70.0 / (0.20 * 0.15 * math.pi / 4.0))
