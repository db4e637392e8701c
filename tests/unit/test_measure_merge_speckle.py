"""Salt and pepper of colours goes, and colours that are there stay."""

from __future__ import annotations

import numpy as np

from app.core.base.colour import srgb_decode, srgb_encode
from app.core.base.progress import Token
from app.core.measure.bracket.merge import quiet_colours
from app.core.measure.bracket.merge_band import lift_black
from tests.helpers.odd_brackets import decoded, jpeg_bytes, speckle

CODES = srgb_decode(np.arange(256) / 255.0).astype(np.float32)
VALUES = [np.stack([CODES] * 3)]


def wall() -> np.ndarray:
    """A green wall with hardly any blue, shaded, and a dark poster; linear."""
    shade = np.linspace(0.3, 1.0, 240)[None, :, None] * np.ones((160, 1, 1))
    light = shade * np.array([0.30, 0.42, 0.012])
    light[40:110, 60:120] *= 0.15
    return np.asarray(light, np.float32)


def photographed(light: np.ndarray, quality: int = 85) -> np.ndarray:
    rng = np.random.default_rng(3)
    noisy = light + np.sqrt(light / 8000.0 + 1e-6) * rng.standard_normal(light.shape)
    codes = np.rint(255.0 * srgb_encode(np.clip(noisy, 0.0, 1.0))).astype(np.uint8)
    light = CODES[decoded(jpeg_bytes(codes, quality))]
    return np.asarray(np.maximum(light, np.float32(1e-3)))


def test_colours_that_codes_leave_open_are_those_around() -> None:
    light = photographed(wall())
    before = speckle(light)
    kept = light.copy()
    quiet_colours(light, VALUES, Token())
    assert before > 0.02
    assert speckle(light) < 0.25 * before
    changed = light != kept
    off, was = (np.abs(np.log2(one / wall()))[changed] for one in (light, kept))
    assert np.median(off) < 0.8 * np.median(was)
    # Nowhere by more than six codes, whose slopes differ.
    codes = 255.0 * (srgb_encode(light).astype(float) - srgb_encode(kept).astype(float))
    assert np.abs(codes).max() < 9.0


def test_a_small_red_lamp_stays_red() -> None:
    light = np.full((60, 80, 3), 0.2, np.float32)
    light[30, 40:42] = (0.9, 0.1, 0.08)
    kept = light.copy()
    quiet_colours(light, VALUES, Token())
    np.testing.assert_array_equal(light[:29], kept[:29])
    lamp = light[30, 40:42]
    assert (lamp[:, 0] > 4.0 * lamp[:, 1:].max(axis=1)).all()


def test_bands_make_no_difference() -> None:
    tall = np.tile(photographed(wall()), (60, 1, 1))  # more than one band
    light = tall.copy()
    quiet_colours(light, VALUES, Token())
    part = tall[4000:4400].copy()
    quiet_colours(part, VALUES, Token())
    np.testing.assert_array_equal(light[4003:4397], part[3:-3])


def test_only_what_is_near_black_is_lifted() -> None:
    level = 0.004
    light = np.linspace(0.0, 0.2, 2001, dtype=np.float32)[None]
    lifted = light.copy()
    lift_black([lifted], level)
    assert lifted[0, 0] == np.float32(level) * np.float32(np.log(2.0))
    assert (np.diff(lifted[0]) > 0.0).all()
    far = light >= 8.0 * level
    np.testing.assert_array_equal(lifted[far], light[far])
