"""What a simulated phone does to a picture."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.colour import srgb_decode
from benchmarks.heading.scripted_turn.phone import (
    CLEAN,
    Disturbance,
    disturbed,
    random_disturbance,
    swept,
    tone_mapped,
)

Bytes = NDArray[np.uint8]


@pytest.fixture
def picture() -> Bytes:
    ramp = np.tile(np.linspace(20, 235, 160).astype(np.uint8), (120, 1))
    return np.dstack([ramp, ramp[:, ::-1], np.full_like(ramp, 90)])


def light(picture: Bytes) -> NDArray[np.float32]:
    return srgb_decode(picture / 255.0)


def once(picture: Bytes, disturbance: Disturbance, seed: int = 0) -> Bytes:
    return disturbed(picture, disturbance, np.random.default_rng(seed))


def test_a_clean_phone_changes_nothing(picture: Bytes) -> None:
    shown = once(picture, CLEAN)
    assert np.array_equal(shown, picture)
    assert shown is not picture


@pytest.mark.parametrize("ev", [-2.0, -0.5, 1.0, 2.0])
def test_exposure_is_in_linear_light_and_clips(picture: Bytes, ev: float) -> None:
    before, after = light(picture), light(once(picture, Disturbance(ev=ev)))
    expected = np.minimum(before * 2.0**ev, 1.0)
    assert np.abs(after - expected).max() < 0.006
    assert (after[before * 2.0**ev > 1.0] == 1.0).all()


def test_white_balance_leaves_green_alone(picture: Bytes) -> None:
    before, after = light(picture), light(once(picture, Disturbance(white=(1.25, 0.8))))
    assert np.array_equal(after[..., 1], before[..., 1])
    dark = before[..., 0] < 0.5
    assert np.median(after[dark, 0] / before[dark, 0]) == pytest.approx(1.25, rel=0.01)
    assert np.median(after[..., 2] / before[..., 2]) == pytest.approx(0.8, rel=0.02)


def test_noise_is_as_strong_as_said_and_differs_from_picture_to_picture() -> None:
    grey = np.full((200, 200, 3), 128, np.uint8)
    first, second = (once(grey, Disturbance(noise=0.03), seed) for seed in (1, 2))
    assert first.std() == pytest.approx(0.03 * 255.0, rel=0.03)
    assert (first.astype(float) - second).std() == pytest.approx(0.03 * 255 * 2**0.5, rel=0.03)
    assert np.array_equal(first, once(grey, Disturbance(noise=0.03), 1))


def test_blur_keeps_light(picture: Bytes) -> None:
    point = np.zeros((41, 41, 3), np.uint8)
    point[20, 20] = 255
    spread = light(once(point, Disturbance(blur_px=1.5)))[..., 0]
    across = np.arange(41) - 20
    assert spread.sum() == pytest.approx(1.0, abs=0.06)
    assert (spread.sum(axis=0) * across**2).sum() ** 0.5 == pytest.approx(1.5, abs=0.2)


def test_corners_are_darker_and_the_middle_is_not() -> None:
    grey = np.full((300, 400, 3), 128, np.uint8)
    shown = light(once(grey, Disturbance(vignette=0.3))) / light(grey)
    assert shown[150, 200, 0] == pytest.approx(1.0, abs=0.01)
    assert shown[0, 0, 0] == pytest.approx(0.7, abs=0.02)


def test_jpeg_loses_a_little(picture: Bytes) -> None:
    noisy = once(picture, Disturbance(noise=0.02))
    losses = [
        np.abs(once(noisy, Disturbance(jpeg=quality)).astype(int) - noisy).mean()
        for quality in (95, 50)
    ]
    assert 0.0 < losses[0] < losses[1] < 6.0


def test_what_is_drawn_stays_in_its_ranges_and_fills_them() -> None:
    chance = np.random.default_rng(3)
    drawn = [random_disturbance(chance) for _ in range(400)]
    whites = np.array([one.white for one in drawn])
    for values, least, most in (
        (np.array([one.ev for one in drawn]), -2.0, 2.0),
        (whites, 0.8, 1.25),
        (np.array([one.blur_px for one in drawn]), 0.0, 1.5),
        (np.array([one.noise for one in drawn]), 0.0, 0.04),
        (np.array([one.jpeg for one in drawn]), 50.0, 95.0),
    ):
        assert values.min() >= least
        assert values.max() <= most
        assert values.max() - values.min() > 0.95 * (most - least)
    assert random_disturbance(np.random.default_rng(5)) == random_disturbance(
        np.random.default_rng(5)
    )


@pytest.mark.parametrize("pixels", [1.5, -4.0, 7.3])
def test_sweeping_spreads_sideways_only(pixels: float) -> None:
    line = np.zeros((9, 41, 3), np.uint8)
    line[:, 20] = 240
    shown = swept(line, pixels)[4, :, 0].astype(float)
    assert shown.sum() == pytest.approx(240.0, rel=0.03)
    assert shown.max() == pytest.approx(240.0 / abs(pixels), rel=0.05)
    tall = np.zeros((41, 9, 3), np.uint8)
    tall[20] = 240
    assert np.array_equal(swept(tall, pixels), tall)


def test_standing_sweeps_nothing(picture: Bytes) -> None:
    assert swept(picture, 0.4) is picture


def test_a_night_mode_presses_areas_together_and_keeps_what_is_on_them() -> None:
    chance = np.random.default_rng(0)
    areas = np.repeat([30.0, 200.0], 160)[None, :, None] + np.zeros((240, 1, 3))
    marks = chance.normal(0.0, 6.0, (240, 320, 1))
    picture = np.clip(areas + marks, 0, 255).astype(np.uint8)
    assert np.abs(tone_mapped(picture, 0.0).astype(int) - picture).max() <= 1
    mapped = tone_mapped(picture, 1.0).astype(float)
    left, right = mapped[:, 40:120], mapped[:, 200:280]
    assert right.mean() - left.mean() < 0.7 * 170.0
    assert right.mean() > left.mean()
    for area, before in ((left, picture[:, 40:120]), (right, picture[:, 200:280])):
        assert np.corrcoef(area[..., 1].ravel(), before[..., 1].ravel())[0, 1] > 0.9
        assert area.std() > before.std()
