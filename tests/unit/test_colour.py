"""Luminance, the sRGB curve and the exposure of pictures."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core import colour


def grey(values: np.ndarray) -> np.ndarray:
    """Repeat values in three channels, (..., 3)."""
    return np.repeat(values[..., np.newaxis], 3, axis=-1)


def test_luminance_weights_are_rec709_and_sum_to_one() -> None:
    assert colour.LUMINANCE_WEIGHTS == (0.2126, 0.7152, 0.0722)
    assert sum(colour.LUMINANCE_WEIGHTS) == pytest.approx(1.0, abs=1e-12)


def test_luminance_of_primaries() -> None:
    result = colour.luminance(np.eye(3, dtype=np.float32))
    assert result.dtype == np.float32
    np.testing.assert_allclose(result, colour.LUMINANCE_WEIGHTS, rtol=1e-6)


@pytest.mark.parametrize("shape", [(), (4,), (3, 2)])
def test_luminance_refuses_other_than_three_channels(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="three channels"):
        colour.luminance(np.ones(shape))


@pytest.mark.parametrize(
    ("linear", "encoded"),
    [(0.0, 0.0), (0.0031308, 0.04045), (0.214041, 0.5), (0.5, 0.735357), (1.0, 1.0), (7.0, 1.0)],
)
def test_srgb_encode_against_published_values(linear: float, encoded: float) -> None:
    assert float(colour.srgb_encode(linear)) == pytest.approx(encoded, abs=2e-5)


@given(st.floats(0.0, 1.0))
def test_srgb_round_trip(value: float) -> None:
    assert float(colour.srgb_encode(colour.srgb_decode(value))) == pytest.approx(value, abs=2e-6)


def test_srgb_round_trip_of_every_byte() -> None:
    display = np.arange(256) / 255.0
    again = colour.to_bytes(colour.srgb_encode(colour.srgb_decode(display)))
    np.testing.assert_array_equal(again, np.arange(256))


def test_shoulder_is_straight_then_smooth_and_never_falls() -> None:
    x = np.linspace(0.0, 8.0, 4001)
    y = colour.shoulder(x).astype(np.float64)
    np.testing.assert_allclose(y[x <= 0.55], x[x <= 0.55], atol=1e-6)
    slopes = np.diff(y) / np.diff(x)
    assert (slopes >= -1e-4).all()  # float32 rounding over steps of 0.002
    assert np.abs(np.diff(slopes)).max() < 0.02
    assert y[-1] <= 1.0
    assert float(colour.shoulder(-3.0)) == 0.0


def test_even_face_comes_out_at_the_skin_level() -> None:
    assert colour.face_exposure(np.full(100, 7.0)) * 7.0 == pytest.approx(colour.SKIN_LEVEL)


@pytest.mark.parametrize("scale", [1e-20, 1e-3, 1.0, 1e3, 1e20])
def test_exposure_cancels_the_scale_of_the_light(scale: float) -> None:
    face = np.linspace(0.0, 1.0, 200)
    gain = colour.face_exposure(face)
    assert colour.face_exposure(face * scale) * scale == pytest.approx(gain, rel=1e-9)
    np.testing.assert_allclose(
        colour.tone_map(grey(face * scale), gain / scale),
        colour.tone_map(grey(face), gain),
        atol=1e-6,
    )


def test_rim_light_stays_a_dark_face_with_a_bright_edge() -> None:
    face = np.full(1000, 0.01)
    face[:60] = 1.0
    shown = colour.tone_map(grey(face), colour.face_exposure(face))
    assert 0.75 < shown[0, 0] < 1.0
    assert shown[-1, 0] < 0.15


def test_a_glint_does_not_darken_the_face() -> None:
    face = np.ones(1000)
    gain = colour.face_exposure(face)
    face[:5] = 50.0
    assert colour.face_exposure(face) == pytest.approx(gain, rel=0.01)


def test_black_and_empty_faces_have_gain_one() -> None:
    assert colour.face_exposure(np.zeros(5)) == 1.0
    assert colour.face_exposure(np.zeros(0)) == 1.0
    assert colour.panorama_exposure(np.zeros((4, 8))) == 1.0


def test_developing_keeps_the_hue_until_white() -> None:
    skin = np.array([1.0, 0.6, 0.4])
    for gain in (0.1, 0.5, 1.0, 2.0):
        shown = colour.develop(skin, gain).astype(np.float64)
        # Hue is the share of the way from the smallest to the largest channel.
        assert (shown[1] - shown[2]) / (shown[0] - shown[2]) == pytest.approx(1 / 3, abs=1e-4)
    np.testing.assert_allclose(colour.develop(skin, 0.5), skin * 0.5, rtol=1e-6)
    assert np.ptp(colour.develop(skin, 1e3)) < 0.01
    assert not colour.develop(np.array([0.0, 0.0, -1.0])).any()


def test_panorama_exposure_puts_the_middle_tone_at_the_level() -> None:
    assert colour.panorama_exposure(np.full((8, 16), 5.0), 0.2) == pytest.approx(0.04)
    sunny = np.full((64, 128), 5.0)
    sunny[20, 30] = 1e5
    assert colour.panorama_exposure(sunny, 0.2) == pytest.approx(0.04, rel=0.01)


def test_a_white_floor_is_not_bleached() -> None:
    place = np.full((64, 128), 0.01)
    place[40:] = 3.0
    gain = colour.panorama_exposure(place)
    assert gain * 3.0 == pytest.approx(0.6)
    # One small lamp in a black place is still shown.
    place = np.zeros((64, 128))
    place[20:24, 30:34] = 1e5
    assert 0.0 < colour.panorama_exposure(place) * 1e5 < 1e4


def test_to_bytes_rounds_and_clips() -> None:
    assert colour.to_bytes([-1.0, 0.0, 0.5, 1.0, 2.0]).tolist() == [0, 0, 128, 255, 255]
