"""Rotations and focal lengths of photographs, against how a panorama was cut."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.colour import srgb_encode
from app.core.base.errors import Cancelled
from app.core.base.paths import resources
from app.core.base.progress import Token, silent
from app.core.base.sphere import angles_of, rotation
from app.core.environment.environment import read_environment
from app.core.measure.photos.rotations import find_links, groups, points_of, turn, upright
from benchmarks.light.stitch_photos import AXES, photograph, placed_off

SIZE = (480, 360)
FOV_DEG = 66.0
FOCAL = 240.0 / math.tan(math.radians(FOV_DEG / 2.0))


@pytest.fixture(scope="module")
def ways() -> list[NDArray[Any]]:
    """A ring of ten, held by a hand."""
    random = np.random.default_rng(3)
    return [
        rotation(36.0 * k + random.normal(), 5.0 + random.normal(), random.normal()) @ AXES
        for k in range(10)
    ]


@pytest.fixture(scope="module")
def points(ways: list[NDArray[Any]]) -> list[Any]:
    light = read_environment(resources() / "demo" / "cafe" / "probe.exr").radiance
    light = np.asarray(cv2.resize(light, (1024, 512)), np.float32)
    light *= 0.6 / np.quantile(light, 0.9)
    linear = (np.clip(photograph(light, way, FOV_DEG, SIZE), 0.0, 1.0) for way in ways)
    return [points_of(np.rint(255.0 * srgb_encode(each)).astype(np.uint8)) for each in linear]


def linked(points: list[Any]) -> list[Any]:
    return find_links(points, list(combinations(range(len(points)), 2)), Token(), silent)


def test_a_ring_is_placed_and_its_lens_measured(ways: Any, points: Any) -> None:
    rotations, focals, off_px = turn([None] * 10, linked(points))
    found = [rotations[k] for k in range(10)]
    assert max(placed_off(ways, found)) < 0.2
    assert [focals[k] for k in range(10)] == pytest.approx([FOCAL] * 10, rel=0.01)
    assert off_px < 1.0


def test_a_wrong_focal_length_in_the_files_is_put_right(points: Any) -> None:
    _, focals, _ = turn([1.5 * FOCAL] * 10, linked(points))
    assert focals[4] == pytest.approx(FOCAL, rel=0.01)


def test_what_shares_nothing_is_left_out(points: Any) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (360, 480, 3), np.uint8)
    links = linked([*points, points_of(noise)])
    assert groups(11, links) == [list(range(10)), [10]]
    assert 10 not in turn([None] * 11, links)[0]


def test_looking_for_links_can_be_stopped(points: Any) -> None:
    token = Token()
    token.cancel()
    with pytest.raises(Cancelled):
        find_links(points, [(0, 1)], token, silent)


@pytest.mark.parametrize("arc", [360.0, 100.0])
def test_up_is_where_the_cameras_right_sides_lie_level(arc: float) -> None:
    tilt = rotation(40.0, 25.0, 60.0)  # of the common system, by chance
    level = [rotation(arc * k / 9.0 + 70.0, 12.0, 0.0) @ AXES for k in range(9)]
    found = upright({k: tilt @ way for k, way in enumerate(level)}, 0)
    for k in range(9):
        yaw, pitch, roll = angles_of(found[k] @ AXES)
        assert math.cos(math.radians(yaw - arc * k / 9.0)) > math.cos(math.radians(0.5))
        assert (pitch, roll) == pytest.approx((12.0, 0.0), abs=1.0)


def test_groups_are_chained_and_the_largest_comes_first() -> None:
    links: Any = [type("L", (), {"numbers": pair}) for pair in ((0, 4), (1, 2), (2, 3), (5, 1))]
    assert groups(7, links) == [[1, 2, 3, 5], [0, 4], [6]]
