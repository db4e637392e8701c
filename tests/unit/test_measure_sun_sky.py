"""Tests of the clear-sky model against published values."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import get_args

import numpy as np
import pytest

from app.core.base.colour import LUMINANCE_WEIGHTS
from app.core.measure.finish.sunlight import (
    SUN_DIAMETER_DEG,
    SUN_SOLID_ANGLE_SR,
    SkyWord,
    air_mass,
    direct_normal_lux,
    sun_colour,
)


@pytest.mark.parametrize(
    ("elevation", "published"),
    # Kasten and Young 1989, table II.
    [(90.0, 1.0), (60.0, 1.1539), (30.0, 1.9939), (20.0, 2.9016), (10.0, 5.5841), (0.0, 37.92)],
)
def test_air_mass_matches_the_published_table(elevation: float, published: float) -> None:
    assert air_mass(elevation) == pytest.approx(published, rel=5e-3)


def test_air_mass_is_the_secant_high_up_and_never_falls_towards_the_horizon() -> None:
    for elevation in range(30, 91):
        secant = 1.0 / math.sin(math.radians(elevation))
        assert air_mass(elevation) == pytest.approx(secant, rel=0.005)
    masses = [air_mass(e) for e in np.arange(0.0, 90.1, 0.5)]
    assert all(a > b for a, b in pairwise(masses))


@pytest.mark.parametrize("elevation", [15.0, 21.0, 30.0, 45.0, 60.0, 75.0, 90.0])
def test_clear_sky_is_ies_rp21(elevation: float) -> None:
    # The recommended practice itself, with its own air mass 1 / sin.
    published = 127_500.0 * math.exp(-0.21 / math.sin(math.radians(elevation)))
    assert direct_normal_lux(elevation) == pytest.approx(published, rel=0.012)


@pytest.mark.parametrize("elevation", [10.0, 20.0, 30.0, 45.0, 60.0, 90.0])
def test_agrees_with_another_published_model(elevation: float) -> None:
    # Navvab et al. 1984: E0 exp(-a m T), turbidity 2.5 for country air, 5 for industrial air.
    mass = air_mass(elevation)
    extinction = 0.1 / (1.0 + 0.0045 * mass)
    country = 127_500.0 * math.exp(-extinction * mass * 2.5)
    industrial = 127_500.0 * math.exp(-extinction * mass * 5.0)
    assert direct_normal_lux(elevation) == pytest.approx(country, rel=0.22)
    assert direct_normal_lux(elevation, "hazy") == pytest.approx(industrial, rel=0.1)


def test_high_sun_on_the_level_is_full_daylight() -> None:
    # 100 klx is the usual figure for direct sun; the horizontal component at 60 deg is 87 klx.
    assert 95_000 < direct_normal_lux(75.0) < 110_000
    assert direct_normal_lux(60.0) * math.sin(math.pi / 3) == pytest.approx(86_700, rel=0.01)


def test_words_lower_the_light_in_order() -> None:
    for elevation in (5.0, 30.0, 90.0):
        values = [direct_normal_lux(elevation, word) for word in get_args(SkyWord)]
        assert values == sorted(values, reverse=True)
        assert values[2] < 0.6 * values[0]


def test_disc_has_its_published_size() -> None:
    assert pytest.approx(0.533, abs=0.001) == SUN_DIAMETER_DEG
    assert math.pi * 0.00465**2 == pytest.approx(SUN_SOLID_ANGLE_SR, rel=0.002)
    # Debevec 2003: the disc of radius 0.00465 has a 46,334th of the hemisphere's projected pi.
    assert math.pi / SUN_SOLID_ANGLE_SR == pytest.approx(46_334, rel=0.005)


@pytest.mark.parametrize("sky", get_args(SkyWord))
def test_colour_keeps_luminance_and_reddens(sky: SkyWord) -> None:
    previous = 0.0
    for elevation in (90.0, 45.0, 20.0, 10.0, 8.0):
        colour = sun_colour(elevation, sky)
        assert colour @ np.array(LUMINANCE_WEIGHTS) == pytest.approx(1.0)
        assert (colour >= 0).all()
        assert colour[0] / colour[2] > previous
        previous = colour[0] / colour[2]


def test_sun_at_air_mass_one_and_a_half_is_white() -> None:
    elevation = math.degrees(math.asin(1 / 1.5))
    assert sun_colour(elevation) == pytest.approx([1.0, 1.0, 1.0], abs=0.01)
