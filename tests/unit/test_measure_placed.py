"""Photographs with known directions become the light that they were taken of."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.colour import srgb_encode
from app.core.base.errors import Cancelled
from app.core.base.progress import Token
from app.core.base.sphere import directions, rotation
from app.core.measure.photos.mosaic import OrientedPicture, light_around

AXES = np.diag([-1.0, -1.0, 1.0])  # of a level camera that looks at azimuth 0
SHAPE = (64, 128)
FOCAL = 57.0  # of pictures of 120 x 120: 93 degrees


def smooth(rays: NDArray[Any]) -> NDArray[Any]:
    """Light by direction, (..., 3), from 0.1 to 0.7."""
    waves = 0.4 + 0.3 * np.sin(2.0 * rays + np.array([0.0, 1.0, 2.0]))
    return np.asarray(waves, np.float32)


def taken(way: NDArray[Any], light: Any = smooth, stops: float = 0.0) -> NDArray[np.uint8]:
    """Codes of a picture, brighter by some stops."""
    middles = (np.arange(120) + 0.5 - 60.0) / FOCAL
    x, y = np.meshgrid(middles, middles)
    rays = np.stack([x, y, np.ones_like(x)], axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    linear = np.clip(light(rays @ way.T) * 2.0**stops, 0.0, 1.0)
    return np.asarray(np.rint(255.0 * srgb_encode(linear)), np.uint8)


def cube(stops: Any = (0.0,) * 6) -> list[OrientedPicture]:
    """Six pictures that show everything."""
    ways = [rotation(yaw, 0.0, 0.0) @ AXES for yaw in (0.0, 90.0, 180.0, -90.0)]
    ways += [rotation(0.0, pitch, 0.0) @ AXES for pitch in (90.0, -90.0)]
    return [
        OrientedPicture(taken(way, stops=stop), way, FOCAL, (2.0**-stop,) * 3)
        for way, stop in zip(ways, stops, strict=True)
    ]


def test_a_cube_of_pictures_gives_the_light_it_was_taken_of() -> None:
    radiance, covered, clipped = light_around(cube(), SHAPE)
    assert covered.all()
    wanted = smooth(directions(SHAPE))
    assert np.abs(radiance - wanted)[covered].max() < 0.02
    assert np.abs(radiance - wanted)[covered].mean() < 0.002
    assert not clipped.any()


def test_exposures_drift_and_the_light_does_not() -> None:
    even = light_around(cube(), SHAPE)[0]
    drifting, covered, _ = light_around(cube((0.3, -0.3, 0.2, 0.0, -0.2, 0.1)), SHAPE)
    assert np.abs(drifting - even)[covered].max() < 0.02


def test_channels_have_gains_of_their_own() -> None:
    warm = [replace(each, gains=(2.0, 1.0, 0.5)) for each in cube()]
    radiance, covered, _ = light_around(warm, SHAPE)
    wanted = smooth(directions(SHAPE)) * np.array([2.0, 1.0, 0.5])
    assert np.abs(radiance - wanted)[covered].max() < 0.04


def test_one_picture_covers_what_a_pinhole_shows() -> None:
    way = rotation(30.0, 10.0, 5.0) @ AXES
    radiance, covered, _ = light_around([OrientedPicture(taken(way), way, FOCAL)], (128, 256))
    seen = directions((128, 256)) @ way
    inside = FOCAL * np.abs(seen[..., :2]).max(axis=-1) < 60.0 * seen[..., 2]
    assert not (covered & ~inside).any()
    assert (inside & ~covered).sum() < 0.1 * inside.sum()  # texels that the edge cuts
    assert (radiance[~covered] == 0.0).all()


def test_a_clipped_lamp_comes_from_the_darker_picture() -> None:
    def lamp(rays: NDArray[Any]) -> NDArray[Any]:
        lit = np.where(rays[..., 2:] > math.cos(math.radians(8.0)), 6.0, 0.2)
        return np.repeat(lit, 3, axis=-1).astype(np.float32)

    bright, dark = (
        OrientedPicture(taken(AXES, lamp, stop), AXES, FOCAL, (2.0**-stop,) * 3)
        for stop in (0.0, -4.0)
    )
    middle = (SHAPE[0] // 2, SHAPE[1] // 2)
    alone, _, clipped = light_around([bright], SHAPE)
    assert alone[middle].max() == pytest.approx(1.0)
    assert clipped[middle] == 1.0
    both, _, clipped = light_around([bright, dark], SHAPE)
    assert both[middle] == pytest.approx(6.0, rel=0.02)
    assert not clipped.any()
    assert both[middle[0], middle[1] + 6] == pytest.approx(0.2, rel=0.02)  # 17 degrees aside


def test_what_is_masked_is_not_there() -> None:
    mask = np.ones((120, 120), bool)
    mask[:, :60] = False  # the left half: azimuths below 0
    _, covered, _ = light_around([OrientedPicture(taken(AXES), AXES, FOCAL, mask=mask)], SHAPE)
    half = SHAPE[1] // 2
    assert covered[:, half + 1 :].any()
    assert not covered[:, :half].any()


def test_linear_pictures_are_taken_as_they_are() -> None:
    linear = np.full((120, 120, 3), 0.25, np.float32)
    radiance, covered, _ = light_around(
        [OrientedPicture(linear, AXES, FOCAL, (4.0, 4.0, 4.0))], SHAPE
    )
    assert radiance[covered] == pytest.approx(1.0, rel=1e-4)


def test_merging_can_be_stopped() -> None:
    token = Token()
    token.cancel()
    with pytest.raises(Cancelled):
        light_around(cube(), SHAPE, token=token)
