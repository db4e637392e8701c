"""Where the lens stood at each frame of a film, from what is behind the sitter."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from app.core.base.arrays import Bytes
from app.core.localization.views import Lens, look
from app.core.measure.film.headings import (
    Background,
    FramePair,
    Headings,
    background,
    find_headings,
    step,
)
from tests.unit.test_facing import place

LENS = Lens(58.0, (480, 270))
FOCAL = LENS.focal_px / LENS.size[0]


def followed(frames: list[Bytes], focal: float | None = None) -> Headings:
    known: list[Background] = [background(picture, None) for picture in frames]
    steps: list[FramePair] = []
    for number in range(1, len(known)):
        steps.append(step(known[number - 1], known[number], steps[-1] if steps else None))
    return find_headings(known, steps, focal)


def seen(azimuths: np.ndarray, blur: float = 0.0, pitch: float = 0.0) -> list[Bytes]:
    panorama = place("interior").display
    if blur:
        panorama = np.asarray(cv2.GaussianBlur(panorama, (0, 0), blur), np.uint8)
    return [look(panorama, float(azimuth), LENS, pitch) for azimuth in azimuths]


@pytest.mark.parametrize(("way", "pitch"), [(1, 0.0), (-1, 0.0), (1, 8.0)])
def test_a_whole_turn_gives_the_angles_and_the_lens(way: int, pitch: float) -> None:
    azimuths = 30.0 + way * np.arange(0, 396, 11.0)
    found = followed(seen(azimuths, pitch=pitch))
    assert found.closed
    assert found.assumed == 0
    assert found.focal == pytest.approx(FOCAL, rel=0.01)
    assert np.abs(found.turns_deg - (azimuths - azimuths[0])).max() < 1.5


def test_half_a_turn_with_a_known_lens() -> None:
    azimuths = np.arange(0, 180, 9.0)
    found = followed(seen(azimuths), FOCAL)
    assert not found.closed
    assert np.abs(found.turns_deg - azimuths).max() < 3.0


def test_without_points_the_shading_is_followed() -> None:
    azimuths = np.arange(0, 60, 4.0)
    found = followed(seen(azimuths, blur=25.0), FOCAL)
    assert found.assumed == 0
    assert np.abs(found.turns_deg - azimuths).max() < 8.0


def test_before_a_blank_wall_an_even_turn_is_assumed() -> None:
    azimuths = np.arange(0, 40, 5.0)
    frames = seen(azimuths) + [np.full((270, 480, 3), 128, np.uint8)] * 4
    found = followed(frames, FOCAL)
    assert found.assumed == pytest.approx(4 / 11)
    assert found.turns_deg[-1] == pytest.approx(55.0, abs=5.0)


def test_an_assumed_step_goes_on_as_far_as_its_time_says() -> None:
    one, two = (background(picture, None) for picture in seen(np.array([0.0, 5.0])))
    blank = background(np.full((270, 480, 3), 128, np.uint8), None)
    last = step(one, two, None)
    slid = (last.after - last.before).mean(axis=0)
    for pace in (0.5, 1.0, 4.0):
        found = step(two, blank, last, pace)
        assert found.assumed
        assert (found.after - found.before).mean(axis=0) == pytest.approx(pace * slid)


def test_a_camera_that_stands_still_does_not_turn() -> None:
    found = followed(seen(np.zeros(10)))
    assert np.abs(found.turns_deg).max() < 0.2
