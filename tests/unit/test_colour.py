"""Luminance, the sRGB curve and the exposure of pictures."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.base import colour


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


class TestOtherPrimaries:
    """Against the matrices that the standards and the Academy publish."""

    BT2020 = (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290)
    ACES = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)

    def test_bt2020_as_bt2087_states_it(self) -> None:
        published = [
            [1.6605, -0.5876, -0.0728],
            [-0.1246, 1.1329, -0.0083],
            [-0.0182, -0.1006, 1.1187],
        ]
        np.testing.assert_allclose(colour.rec709_from(self.BT2020), published, atol=1e-4)

    def test_aces_with_its_own_white(self) -> None:
        published = [
            [2.52169, -1.13413, -0.38756],
            [-0.27648, 1.37272, -0.09624],
            [-0.01538, -0.15298, 1.16835],
        ]
        np.testing.assert_allclose(colour.rec709_from(self.ACES), published, atol=1e-3)

    def test_white_stays_white_and_rec709_itself(self) -> None:
        np.testing.assert_allclose(colour.rec709_from(self.ACES).sum(axis=1), 1.0, atol=1e-9)
        np.testing.assert_allclose(colour.rec709_from(colour.REC709), np.eye(3), atol=1e-12)

    @pytest.mark.parametrize(
        "junk",
        [
            (0.0,) * 8,
            (float("nan"),) * 8,
            (0.64, 0.33),
            (0.64, 0.33, 0.64, 0.33, 0.15, 0.06, 0.3127, 0.329),
            (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.9, 0.05),
        ],
    )
    def test_what_is_no_colour(self, junk: tuple[float, ...]) -> None:
        with pytest.raises(ValueError, match=r"chromaticities|white|primaries"):
            colour.rec709_from(junk)


@pytest.mark.parametrize("kind", [np.uint8, np.float16, np.float32])
def test_largest_and_smallest_channel_are_those_of_numpy(kind: type) -> None:
    picture: np.ndarray = np.random.default_rng(1).integers(0, 256, (5, 7, 3)).astype(kind)
    before = picture.copy()
    largest, smallest = colour.largest_channel(picture), colour.smallest_channel(picture)
    assert largest.dtype == smallest.dtype == kind
    np.testing.assert_array_equal(largest, picture.max(axis=-1))
    np.testing.assert_array_equal(smallest, picture.min(axis=-1))
    np.testing.assert_array_equal(picture, before)


def test_a_channel_that_is_no_number_is_not_lost() -> None:
    for channel in range(3):
        picture = np.ones((1, 3), np.float32)
        picture[0, channel] = np.nan
        assert np.isnan(colour.largest_channel(picture)).all()
        assert np.isnan(colour.smallest_channel(picture)).all()
