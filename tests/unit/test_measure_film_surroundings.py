"""The backgrounds of a film as a panorama, and light that lends it its brightness."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from app.core.base.angles import difference
from app.core.base.colour import luminance
from app.core.environment.environment import from_radiance, reduce_radiance
from app.core.localization.features import build_index
from app.core.localization.photo_location import Photo, locate_photo
from app.core.localization.views import Lens, look
from app.core.measure.film.headings import background, find_headings, step
from app.core.measure.film.surroundings import surroundings, with_detail
from app.core.solver.place_light import prepare
from tests.unit.test_facing import place

LENS = Lens(62.0, (640, 360))


@pytest.mark.slow
def test_a_camera_finds_its_way_back_by_a_film() -> None:
    panorama = place("interior").display
    frames = [look(panorama, 12.0 * number + 180.0, LENS) for number in range(33)]
    known = [background(picture, None) for picture in frames]
    steps = [step(one, other, None) for one, other in itertools.pairwise(known)]
    headings = find_headings(known, steps)
    seen = surroundings(known, headings, np.ones(len(frames)))
    assert seen is not None
    index = build_index(prepare(from_radiance(seen[0].copy(), "film")).display)
    for number in (0, 3, 9, 27):
        taken = locate_photo(Photo(frames[number], LENS.size), index)
        assert taken.heading_deg is not None
        # The first frame's lens is in the middle, and looks the other way.
        assert abs(difference(taken.heading_deg, 12.0 * number + 180.0)) < 1.0


def test_detail_leaves_the_light_as_it_is() -> None:
    chance = np.random.default_rng(3)
    around = np.arange(64) * np.pi / 32
    light = 1.2 + np.outer(np.cos(np.arange(32) / 5), np.cos(2 * around))
    seen = chance.uniform(0.2, 1.0, (512, 1024, 3)).astype(np.float32)
    made = with_detail(light, seen)
    assert made.shape == seen.shape
    assert np.abs(luminance(reduce_radiance(made)) - light).max() < 0.05
    assert np.abs(made[1:] - made[:-1]).mean() > 0.1
