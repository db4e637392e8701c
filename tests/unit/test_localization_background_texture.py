"""The turn between two pictures, measured from the pictures alone."""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.paths import resources
from app.core.localization.live.background_texture import (
    BackgroundTexture,
    background_of,
    turn_between,
)
from app.core.localization.sitter import Sitter, background_mask, find_sitter
from app.core.localization.views import Lens, look
from tests.helpers.demo_place import demo_panorama

Bytes = NDArray[np.uint8]
LENS: Final = Lens(60.0, (640, 480))
VIEWS: Final = resources() / "demo" / "location" / "views"
SITTER: Final = Sitter(0.5, 0.0, (0.44, 0.3, 0.56, 0.55))


def seen(azimuth: float, lens: Lens = LENS, sitter: Sitter | None = None) -> BackgroundTexture:
    return background_of(look(demo_panorama(), azimuth, lens), sitter, lens.fov_deg)


@pytest.mark.parametrize("turn", [-24.0, -12.0, -5.0, 3.0, 8.0, 16.0, 24.0])
@pytest.mark.parametrize("start", [-170.0, 20.0, 100.0])
def test_a_turn_on_the_spot_is_measured(start: float, turn: float) -> None:
    assert turn_between(seen(start), seen(start + turn)) == pytest.approx(turn, abs=0.3)


@pytest.mark.parametrize("lens", [Lens(40.0, (640, 480)), Lens(90.0, (640, 360))])
def test_the_lens_and_the_shape_do_not_matter(lens: Lens) -> None:
    turn = 0.2 * lens.fov_deg
    assert turn_between(seen(20.0, lens), seen(20.0 + turn, lens)) == pytest.approx(turn, abs=0.4)


def test_exposure_white_balance_and_noise_do_not_matter() -> None:
    other = look(demo_panorama(), 28.0, LENS).astype(np.float64) * [0.55, 0.4, 0.3]
    other += np.random.default_rng(1).normal(0.0, 6.0, other.shape)
    darker = background_of(np.clip(other, 0, 255).astype(np.uint8), None, 60.0)
    assert turn_between(seen(20.0), darker) == pytest.approx(8.0, abs=0.3)


@pytest.mark.parametrize("apart", [90.0, 140.0, 180.0, -120.0])
def test_pictures_without_overlap_show_no_turn(apart: float) -> None:
    for start in range(-180, 180, 30):
        assert turn_between(seen(start), seen(start + apart)) is None


def test_flat_pictures_show_no_turn() -> None:
    grey = background_of(np.full((480, 640, 3), 120, np.uint8), SITTER, 60.0)
    assert turn_between(grey, grey) is None


def test_only_a_masked_sitter_lets_a_camera_be_still() -> None:
    """A sitter fills the middle and stays there: without the mask, the camera seems to be still."""
    person = np.random.default_rng(2).integers(0, 255, (480, 640, 3), np.uint8)
    mask = background_mask(SITTER, (480, 640))[..., None]
    pictures = [np.where(mask, look(demo_panorama(), a, LENS), person) for a in (20.0, 32.0, 20.0)]
    blind = [background_of(picture, None, 60.0) for picture in pictures]
    assert turn_between(blind[0], blind[2]) is None, "it may be the sitter that kept still"
    masked = [background_of(picture, SITTER, 60.0) for picture in pictures]
    assert turn_between(masked[0], masked[1]) == pytest.approx(12.0, abs=0.3)
    assert turn_between(masked[0], masked[2]) == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("start", [60, 120, 200])
def test_a_walk_around_the_sitter_shows_part_of_the_turn(start: int) -> None:
    backgrounds = []
    for turn in (start, start + 10):
        picture = cv2.imread(str(VIEWS / f"view-{turn:03d}-180.webp"))
        assert picture is not None
        rgb = np.ascontiguousarray(picture[..., ::-1], np.uint8)
        backgrounds.append(background_of(rgb, find_sitter(rgb, 60.0, None), 60.0))
    measured = turn_between(*backgrounds)
    assert measured is not None
    assert 6.0 < measured < 9.6
