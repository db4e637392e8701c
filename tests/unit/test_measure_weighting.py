"""Weights and tables of the merge."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.base.colour import srgb_decode, srgb_encode
from app.core.measure.bracket.merge_band import merge_band
from app.core.measure.bracket.weighting import (
    FrameLight,
    Scheme,
    clipped_code,
    float_tables,
    frame_tables,
    neutral_end,
)

SRGB = np.repeat(srgb_decode(np.arange(256) / 255.0).astype(np.float64)[None], 3, axis=0)
STOPS = (2.0, 0.0, -2.0)


@pytest.mark.parametrize("scheme", ["noise", "reinhard"])
@pytest.mark.parametrize("fine", [False, True])
def test_tables_are_finite_positive_and_scaled_by_exposure(scheme: Scheme, fine: bool) -> None:
    for index, stop in enumerate(STOPS):
        tables = frame_tables(SRGB, index, STOPS, 0.0, scheme=scheme, fine=fine)
        count = 65536 if fine else 256
        for table in (tables.bright, tables.faint):
            assert table.shape == (count,)
            assert np.isfinite(table).all()
            assert (table > 0.0).all()
        assert tables.value.shape == (3, count)
        np.testing.assert_allclose(tables.value[:, -1], 2.0**-stop, rtol=1e-6)
        assert (np.diff(tables.value) >= 0.0).all()


def test_noise_weights_are_the_inverse_variance_of_simulated_frames() -> None:
    """The ratio of two frames' weights is the ratio of their measured variances, within a third."""
    generator = np.random.default_rng(5)
    stops = (1.0, -1.0)
    first, second = (frame_tables(SRGB, index, stops, 0.0) for index in (0, 1))
    codes = np.arange(256.0)
    for light in (0.005, 0.02, 0.1, 0.3):
        measured, given = [], []
        for tables, stop in ((first, 1.0), (second, -1.0)):
            exposed = generator.poisson(light * 2.0**stop * 20_000, 200_000)
            counted = (exposed + generator.normal(0.0, 4.0, exposed.size)) / 20_000
            counted += generator.normal(0.0, 0.0015, exposed.size)  # glare and black level
            code = np.interp(np.maximum(counted, 0.0), SRGB[0], codes)
            # What JPEG and rounding add.
            noisy = np.rint(code + generator.normal(0.0, 0.95, code.size))
            index = np.clip(noisy, 0, 255).astype(int)
            measured.append(1.0 / np.var(SRGB[0][index] / 2.0**stop))
            given.append(float((tables.bright[index] * tables.faint[index]).mean()))
        assert given[0] / given[1] == pytest.approx(measured[0] / measured[1], rel=1.0 / 3.0)


def test_the_mean_of_noisy_frames_is_hardly_pulled_down() -> None:
    generator = np.random.default_rng(7)
    for light in (0.002, 0.01, 0.05, 0.2):
        sums = np.zeros((2, 100_000))
        for index, stop in enumerate(STOPS):
            tables = frame_tables(SRGB, index, STOPS, 0.0)
            count = generator.poisson(light * 2.0**stop * 7500, 100_000)
            counted = (count + generator.normal(0.0, 4.0, count.size)) / 7500
            code = np.rint(np.interp(np.maximum(counted, 0.0), SRGB[0], np.arange(256.0)))
            place = code.astype(int)
            weight = tables.bright[place] * tables.faint[place]
            sums += weight * tables.value[0, place], weight
        assert np.mean(sums[0] / sums[1]) == pytest.approx(light, rel=0.02)


def test_clipped_codes_have_next_to_no_weight_and_the_darkest_frame_most_of_it() -> None:
    tables = [frame_tables(SRGB, index, STOPS, 0.0) for index in range(3)]
    for table in tables:
        assert table.clipped == 254
        assert table.bright[254:].max() < 1e-5 * table.bright[128]
        assert (table.own[245:] == 0.0).all()
    last = [float(t.bright[255] * t.faint[255]) for t in tables]
    assert last[2] > 20.0 * max(last[:2])


def test_the_weight_falls_smoothly_to_clipping() -> None:
    tables = frame_tables(SRGB, 0, STOPS, 0.0)
    assert np.abs(np.diff(tables.bright)).max() < 0.12
    assert (np.diff(tables.bright) <= 0.0).all()


def test_the_brightest_frame_decides_where_all_are_black() -> None:
    for scheme in ("noise", "reinhard"):
        black = [float(frame_tables(SRGB, i, STOPS, 0.0, scheme=scheme).faint[0]) for i in range(3)]
        assert black[0] > 3.0 * black[1] > 9.0 * black[2]


def test_reinhard_is_the_hat_within_matlabs_limits() -> None:
    tables = frame_tables(SRGB, 1, STOPS, 0.0, scheme="reinhard")
    weight = tables.bright * tables.faint
    for code in (6, 40, 127, 128, 200, 249):
        assert weight[code] == pytest.approx(1.0 - (2.0 * code / 255.0 - 1.0) ** 12, rel=1e-5)
    assert weight[[0, 5, 250, 255]].max() < 1e-3


def test_a_response_that_ends_early_clips_early() -> None:
    short = SRGB.copy()
    short[1, 240:] = short[1, 240]
    assert clipped_code(short / short[:, -1:]) == 240
    assert clipped_code(SRGB) == 254
    assert frame_tables(short / short[:, -1:], 0, STOPS, 0.0).bright[240:].max() < 1e-5


def test_channels_of_a_response_end_together_and_are_never_lowered() -> None:
    uneven = SRGB * np.array([[0.9], [1.0], [0.8]])
    ended = neutral_end(uneven)
    assert np.ptp(ended[:, 255]) == pytest.approx(0.0, abs=1e-12)
    assert (ended >= uneven).all()
    np.testing.assert_array_equal(ended[:, :236], uneven[:, :236])
    assert (np.diff(ended) >= 0.0).all()


@pytest.mark.parametrize("clips", [True, False])
@pytest.mark.parametrize("scheme", ["noise", "reinhard"])
def test_float_tables_are_positive_and_clip_only_if_told(clips: bool, scheme: Scheme) -> None:
    tables = float_tables(0, STOPS, clips=clips, scheme=scheme)
    for table in (tables.bright, tables.faint):
        assert (table > 0.0).all()
        assert np.isfinite(table).all()
    assert (tables.bright[-1] > 0.5) != clips


def test_where_the_response_is_not_known_darker_frames_have_more_of_a_say() -> None:
    """More for dense brackets than for wide ones, and nothing near black."""
    shares = {}
    for stops in ((1.0, 0.0, -1.0), (2.0, 0.0, -2.0)):
        for known in (True, False):
            code = np.rint(255.0 * srgb_encode(0.1 * 2.0 ** (np.array(stops) - stops[0])))
            tables = [frame_tables(SRGB, i, stops, 0.0, exposures_known=known) for i in range(3)]
            weight = [float(t.faint[int(c)]) for t, c in zip(tables, code, strict=True)]
            shares[stops[0], known] = weight[2] / sum(weight)
            black = [float(t.faint[1]) for t in tables]
            assert black[2] / black[0] == pytest.approx(4.0 ** (stops[2] - stops[0]), rel=0.02)
    assert shares[1.0, False] > 1.25 * shares[1.0, True]
    assert shares[2.0, True] < shares[2.0, False] < 1.25 * shares[2.0, True] + 0.01


def test_what_the_darkest_frame_clips_is_clipped_though_jpeg_moved_a_brighter_frames_white() -> (
    None
):
    lights = [FrameLight(frame_tables(SRGB, index, STOPS, 0.0)) for index in range(3)]
    codes = np.array([[252, 252, 255, 252], [255, 252, 255, 250], [255, 252, 253, 40]], np.uint8)
    bands = [np.repeat(frame[None, :, None], 3, axis=2) for frame in codes]
    band = merge_band(bands, lights, [None] * 3)
    assert band.clipped is not None
    assert (band.clipped[0] > 0).tolist() == [True, False, False, False]
    # A frame's own count is of what it surely clips.
    assert band.clipped_counts == [1, 2, 1]
