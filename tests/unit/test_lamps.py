"""Studio lamps as environments: places, sizes and lighting ratios."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.base.arrays import Float64
from app.core.base.errors import StyleError
from app.core.environment.environment import SHAPE
from app.core.styles.lamps import Studio, far_lamp, parse_ratio, parse_softness, studio_light
from app.core.styles.style import StyleLamp
from app.core.styles.styles import NAMES, load_styles
from tests.helpers.synthetic import lamp_environment, solid_angles


@pytest.mark.parametrize("azimuth", [0.0, 35.0, -135.0, 180.0])
@pytest.mark.parametrize("elevation", [-45.0, 5.0, 80.0])
def test_a_far_lamp_has_its_power_and_place(azimuth: float, elevation: float) -> None:
    light = far_lamp(StyleLamp(azimuth, elevation, 12.0, 0.7, 2.0), (32, 64))
    area = solid_angles(32, 64)[:, None]
    assert (light * area).sum() == pytest.approx(0.7)
    expected = 0.7 * lamp_environment(-azimuth, elevation, 12.0)
    assert np.abs((light - expected) * area).sum() < 0.05


def test_a_tiny_lamp_still_covers_texels() -> None:
    assert far_lamp(StyleLamp(0.0, 0.0, 0.01, 1.0, 2.0), (16, 32)).sum() > 0


@pytest.mark.parametrize("ratio", [2.0, 3.0, 4.0, 8.0])
@pytest.mark.parametrize("softness", [None, 10.0, 30.0, 45.0])
def test_the_ratio_is_what_an_incident_meter_reads(softness: float | None, ratio: float) -> None:
    """Of a dome pointed at each light: key and fill over fill; within what texels tell apart."""
    style = load_styles()[NAMES.index("left-split")]
    key = studio_light(style, Studio(softness), SHAPE)
    fill = studio_light(style, Studio(softness, ratio), SHAPE) - key
    facing_key = _incident(key, style.lamps[0].azimuth_deg, style.lamps[0].elevation_deg)
    facing_fill = _incident(fill, 0.0, 0.0)
    assert (facing_key + facing_fill) / facing_fill == pytest.approx(ratio, rel=0.02)


def _incident(light: Float64, azimuth_deg: float, elevation_deg: float) -> float:
    """Irradiance of a surface that faces a direction, by plain summation over texels."""
    height, width = light.shape
    azimuth = -((np.arange(width) + 0.5) / width - 0.5) * 2 * np.pi
    elevation = np.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    at, up = np.radians(azimuth_deg), np.radians(elevation_deg)
    cosine = np.sin(up) * np.sin(elevation) + np.cos(up) * np.cos(elevation) * np.cos(azimuth - at)
    area = solid_angles(height, width)[:, None]
    return float((light * area * np.maximum(cosine, 0.0)).sum())


@pytest.mark.parametrize(
    ("text", "degrees"),
    [("hard", 10.0), ("large", 45.0), ("12.5", 12.5), ("dish@1", 30.8), ("octabox@1.5", 43.6)],
)
def test_sizes_of_lamps_in_words(text: str, degrees: float) -> None:
    """A 55 cm dish at 1 m and a 120 cm octabox at 1.5 m, as textbooks have them."""
    assert parse_softness(text) == pytest.approx(degrees, abs=0.1)


@pytest.mark.parametrize("text", ["", "big", "dish@", "dish@0", "lamp@2", "nan", "1e999"])
def test_what_is_no_size_of_a_lamp(text: str) -> None:
    with pytest.raises(StyleError):
        parse_softness(text)


@pytest.mark.parametrize("text", ["", "4:2", "four", "nan:1"])
def test_what_is_no_ratio(text: str) -> None:
    with pytest.raises(StyleError):
        parse_ratio(text)


def test_no_studio_has_such_lamps() -> None:
    for wrong in ({"softness_deg": 0.0}, {"softness_deg": 120.0}, {"ratio": 1.0}):
        with pytest.raises(StyleError):
            Studio(**wrong)
