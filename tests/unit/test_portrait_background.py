"""The place behind the head: which part of it, on which side, and how far out of focus."""

from __future__ import annotations

import math

import numpy as np
import pytest

from app.core.portrait.background import F_NUMBER, LENS_M, background, blur_px
from app.core.portrait.gallery_portraits import Framing, framing
from app.core.portrait.portrait_head import ROOM
from app.core.solver.transport import TransportHeader, load_named

ROWS, COLUMNS = 1024, 2048
SIZE = (320, 256)


@pytest.fixture(scope="module")
def camera() -> TransportHeader:
    return load_named("generic").header


def whole() -> Framing:
    return framing(640, SIZE, room=ROOM)


def lamp_at(azimuth: float, elevation: float = 0.0) -> np.ndarray:
    """A panorama with a small lamp."""
    panorama = np.zeros((ROWS, COLUMNS, 3), np.float32)
    row = round((0.5 - elevation / 180) * ROWS - 0.5)
    column = round((azimuth / 360 + 0.5) % 1 * COLUMNS - 0.5) % COLUMNS
    panorama[row - 1 : row + 2, [column - 1, column, (column + 1) % COLUMNS]] = 100
    return panorama


def middle_of(picture: np.ndarray) -> tuple[float, float]:
    grey = picture.sum(axis=2)
    rows, columns = np.indices(grey.shape)
    return tuple(
        float((each + 0.5).ravel() @ grey.ravel() / grey.sum()) for each in (rows, columns)
    )  # type: ignore[return-value]


@pytest.mark.parametrize("facing", [0.0, 40.0, 177.0, -120.0])
def test_what_is_right_of_the_background_in_the_panorama_is_at_the_right(
    camera: TransportHeader, facing: float
) -> None:
    for aside in (-2.0, 0.0, 2.0):
        shown = background(lamp_at(facing + 180 + aside), facing, whole(), camera)
        _, column = middle_of(shown)
        # Along the axis; 6.8 m of background look 5 m wide from where the sitter stands.
        away = math.tan(math.radians(aside)) * 5 / 6.8
        step = 2 * math.tan(math.radians(camera.fov_deg) / 2) / (SIZE[0] / ROOM)
        assert column == pytest.approx(SIZE[1] / 2 + away / step, abs=3.5)


def test_the_horizon_is_at_the_height_of_the_eyes(camera: TransportHeader) -> None:
    """Eyes are 41 rows of 100 below the crown, and hair takes six more."""
    row, _ = middle_of(background(lamp_at(180.0), 0.0, whole(), camera))
    assert row / SIZE[0] == pytest.approx((0.06 + 0.412) / 1.06, abs=0.015)
    above, _ = middle_of(background(lamp_at(180.0, 1.0), 0.0, whole(), camera))
    assert above < row - 20


def test_a_far_point_is_a_disc_as_wide_as_the_aperture_lets_it(camera: TransportHeader) -> None:
    shown = background(lamp_at(180.0), 0.0, whole(), camera)
    grey = shown.sum(axis=2)
    found = 2 * math.sqrt(float((grey > 0.5 * grey.max()).sum()) / math.pi)
    side_m = 2 * camera.distance_m * math.tan(math.radians(camera.fov_deg) / 2)
    wanted = LENS_M / F_NUMBER * 5 / 6.8 / side_m * SIZE[0] / ROOM
    assert found == pytest.approx(wanted, rel=0.12)
    assert blur_px(side_m / camera.distance_m / (SIZE[0] / ROOM), camera.distance_m) == (
        pytest.approx(wanted)
    )


def test_light_is_kept_and_a_larger_picture_shows_the_same(camera: TransportHeader) -> None:
    noise = np.random.default_rng(3).random((ROWS // 16, COLUMNS // 16, 3)).astype(np.float32)
    panorama = np.repeat(np.repeat(noise, 16, axis=0), 16, axis=1)
    small = background(panorama, 30.0, framing(640, (160, 128), room=ROOM), camera)
    large = background(panorama, 30.0, whole(), camera)
    halved = large.reshape(160, 2, 128, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(halved, small, atol=0.02)
    even = background(np.full_like(panorama, 3.0), 0.0, whole(), camera)
    np.testing.assert_allclose(even, 3.0, rtol=1e-5)


def test_pictures_of_transport_and_portrait_have_the_same_behind_them(
    camera: TransportHeader,
) -> None:
    panorama = np.random.default_rng(4).random((64, 128, 3)).astype(np.float32)
    quick = background(panorama, 10.0, framing(100, SIZE, above=ROOM), camera)
    np.testing.assert_allclose(quick, background(panorama, 10.0, whole(), camera), atol=1e-4)
