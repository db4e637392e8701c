"""Pictures under a near lamp, and what it hides, against physics that is known without them."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.colour import LUMINANCE_WEIGHTS
from app.core.base.errors import Cancelled
from app.core.base.progress import Token
from app.core.environment.environment import solid_angles
from app.core.second_light.added_light import (
    NearField,
    coverage,
    near_luminances,
    near_picture,
    prepare_near,
)
from app.core.second_light.lamp_presets import NumbersLamp, parse
from app.core.second_light.placements import ALTITUDES_DEG, MIRRORED, placement
from tests.helpers.second_light import answers_per_steradian, plain_near
from tests.helpers.synthetic import ALBEDO, HEAD, lambert_sphere_transport, synthetic_shape

TRANSPORT = lambert_sphere_transport()
PLACES = [(0.0, 0.0), (35.0, 45.0), (-90.0, 16.875), (140.0, -33.75)]


@cache
def _near() -> NearField:
    return prepare_near(TRANSPORT, synthetic_shape())


@cache
def _answers() -> NDArray[np.float64]:
    return answers_per_steradian(TRANSPORT)


def _grey(lamp: NumbersLamp, azimuth: float, altitude: float) -> NDArray[np.float64]:
    picture = near_picture(_near(), lamp, azimuth, altitude)
    assert picture.shape == (len(TRANSPORT.pixels), 3)
    assert picture.dtype == np.float32
    found: NDArray[np.float64] = picture.astype(np.float64) @ np.array(LUMINANCE_WEIGHTS)
    return found


def _apart(one: NDArray[np.float64], two: NDArray[np.float64]) -> float:
    face = TRANSPORT.face
    return float(np.linalg.norm(one[face] - two[face]) / np.linalg.norm(two[face]))


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("word", ["phone@0.3", "panel@0.6", "softbox@0.4"])
def test_pictures_are_the_formula_written_down(word: str, place: tuple[float, float]) -> None:
    lamp = parse(word)
    plain = plain_near(_answers(), synthetic_shape(), lamp, *place)
    assert _apart(_grey(lamp, *place), plain) < 1e-3


@pytest.mark.parametrize("place", PLACES)
def test_far_away_it_is_the_distant_picture_and_falls_with_the_square(
    place: tuple[float, float],
) -> None:
    """T lit from one direction by the same illuminance, which at 1 m is the lamp's own number."""
    lamp = replace(parse("phone"), size_m=(0.01, 0.01))
    middle = replace(_near(), positions=np.zeros_like(_near().positions))
    at_1m = near_picture(middle, replace(lamp, distance_m=1.0), *place) @ LUMINANCE_WEIGHTS
    errors = []
    for metres in (1.25, 2.5, 5.0):
        far = _grey(replace(lamp, distance_m=metres), *place) * metres**2
        errors.append(_apart(far, at_1m.astype(np.float64)))
    # What is left of nearness halves with every doubling.
    assert errors[2] < 0.6 * errors[1] < 0.36 * errors[0]
    assert errors[2] < 0.06


def test_lux_at_one_metre_is_what_skin_that_faces_the_lamp_gets() -> None:
    """A matte head of known albedo: radiance = albedo E / pi where it faces the lamp."""
    lamp = replace(parse("panel"), distance_m=2.0, size_m=(0.02, 0.02), lux_at_1m=314.0)
    picture = near_picture(_near(), lamp, 0.0, 60.0)
    # Over the forehead, clear of the nose, where the ellipsoid's normal points to the lamp.
    toward = np.array([0.0, math.sin(math.radians(60)), math.cos(math.radians(60))])
    normal = synthetic_shape().positions / HEAD**2
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    pixel = int(np.argmax(np.where(TRANSPORT.face, normal @ toward, -1)))
    cosine = float(normal[pixel] @ toward)
    way = toward * 2.0 - synthetic_shape().positions[pixel]
    lux = 314.0 / float(way @ way)
    # Texels of 5.6 degrees smooth the cosine a little.
    np.testing.assert_allclose(picture[pixel], np.array(ALBEDO) * lux * cosine / math.pi, rtol=0.03)


def test_light_adds_up_and_has_the_lamps_colour() -> None:
    lamp = parse("panel@0.5")
    white = near_picture(_near(), lamp, 20.0, 10.0)
    double = near_picture(_near(), replace(lamp, lux_at_1m=800.0), 20.0, 10.0)
    np.testing.assert_allclose(double, 2 * white, rtol=1e-6)
    warm = near_picture(_near(), replace(lamp, colour=(1.77, 0.83, 0.3)), 20.0, 10.0)
    np.testing.assert_allclose(warm, white * np.array([1.77, 0.83, 0.3]), rtol=1e-6)


def test_a_lamp_is_the_sum_of_its_halves() -> None:
    """Held straight ahead, a wide lamp is two narrow ones beside each other, both facing ahead.

    Seen from 2 m, a half that is swung aside by its own angle differs by second order only.
    """
    whole = replace(parse("panel"), distance_m=2.0, size_m=(0.4, 0.2))
    half = replace(whole, size_m=(0.2, 0.2), lux_at_1m=whole.lux_at_1m / 2.0)
    aside = math.degrees(math.atan(0.1 / 2.0))
    both = _grey(half, aside, 0.0) + _grey(half, -aside, 0.0)
    assert _apart(both, _grey(whole, 0.0, 0.0)) < 0.01


@pytest.mark.parametrize("word", ["phone@0.3", "softbox@0.5"])
def test_mirrored_placements_give_mirrored_pictures(word: str) -> None:
    size = TRANSPORT.size
    mirrored = TRANSPORT.pixels // size * size + size - 1 - TRANSPORT.pixels % size
    twin = np.searchsorted(TRANSPORT.pixels, mirrored)
    here, there = (near_picture(_near(), parse(word), a, 20.0) for a in (50.0, -50.0))
    np.testing.assert_allclose(there[twin], here, rtol=1e-3, atol=1e-3 * here.max())
    # Towards the sitter's left is image right.
    x = synthetic_shape().positions[:, 0]
    assert here[x > 0.03].mean() > 2 * here[x < -0.03].mean()


def test_all_placements_at_once_are_the_single_ones() -> None:
    lamp = parse("bulb@0.6")
    seen: list[float] = []
    found = near_luminances(_near(), lamp, report=lambda share, words: seen.append(share))
    assert found.shape == (576, len(TRANSPORT.pixels))
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    for number in (0, 70, 256, 300, 575):
        one = _grey(lamp, *placement(number))
        np.testing.assert_allclose(found[number], one, rtol=2e-3, atol=1e-3 * one.max())
    size = TRANSPORT.size
    mirrored = TRANSPORT.pixels // size * size + size - 1 - TRANSPORT.pixels % size
    twin = np.searchsorted(TRANSPORT.pixels, mirrored)
    np.testing.assert_allclose(found[MIRRORED][:, twin], found, rtol=1e-3, atol=1e-3 * found.max())


def test_trying_all_placements_can_be_stopped() -> None:
    token = Token()
    token.cancel()
    with pytest.raises(Cancelled):
        near_luminances(_near(), parse("phone"), token)


WHOLE = [
    ("phone@0.3", 0.005), ("panel@0.5", 0.005), ("softbox@0.6", 0.005), ("torch@0.3", 1e-6),
    ("torch@5", 1e-6), ("flash@5", 1e-6), ("bulb@0.6", 0.005),
]  # fmt: skip


@pytest.mark.parametrize(("word", "slack"), WHOLE)
def test_what_a_lamp_hides_adds_up_to_its_solid_angle(word: str, slack: float) -> None:
    lamp = parse(word)
    hidden = coverage(lamp, (32, 64))
    assert hidden.shape == (576, 32, 64)
    assert hidden.min() >= 0.0
    assert hidden.max() <= 1.0
    x, y = (size / 2 / lamp.distance_m for size in lamp.size_m)
    whole = 4 * math.atan(x * y / math.sqrt(1 + x * x + y * y))
    if lamp.round:  # of an ellipse: summed over thin rings
        r = (np.arange(400) + 0.5) / 400
        angle = 2 * np.pi * (np.arange(400) + 0.5) / 400
        u, v = np.outer(r, np.cos(angle)) * x, np.outer(r, np.sin(angle)) * y
        ring = (r[:, None] / (1 + u * u + v * v) ** 1.5).sum()
        whole = float(ring) * x * y * 2 * np.pi / 400**2
    found = (hidden * solid_angles((32, 64))[:, None]).sum(axis=(1, 2))
    np.testing.assert_allclose(found, whole, rtol=slack + 2e-3 * lamp.round)


def test_a_tiny_lamp_hides_its_true_share_of_the_texels_it_stands_in() -> None:
    """At azimuth 0 it stands on the edge between two columns, at altitude 0 between two rows."""
    lamp = parse("torch@0.3")
    texel = coverage(lamp, (32, 64))[4 * 64]
    disc = math.pi / 4 * (0.006 / 0.3) ** 2
    corner = texel[15:17, 31:33]
    np.testing.assert_allclose(corner, disc / 4 / solid_angles((32, 64))[15], rtol=0.02)
    assert texel.sum() == pytest.approx(corner.sum())


def test_what_is_hidden_stands_where_the_lamp_is() -> None:
    hidden = coverage(parse("phone@0.4"), (32, 64))
    for number in (256, 256 + 16, 5 * 64 + 40, 2 * 64 + 60):
        azimuth, altitude = placement(number)
        row, column = np.unravel_index(int(np.argmax(hidden[number])), (32, 64))
        # Towards the sitter's left is towards the left of the panorama.
        assert abs((360 * ((column + 0.5) / 64 - 0.5) + azimuth + 180) % 360 - 180) < 6.0
        assert abs(90 - 180 * (row + 0.5) / 32 - altitude) < 12.0
    upright = [hidden[row * 64] for row in range(len(ALTITUDES_DEG))]
    for one in upright:
        np.testing.assert_allclose(one, one[:, ::-1], atol=1e-6)


def test_shares_are_those_of_a_fine_drawing() -> None:
    rows = 1024
    up = np.pi * (0.5 - (np.arange(rows) + 0.5) / rows)[:, None]
    around = 2 * np.pi * ((np.arange(2 * rows) + 0.5) / (2 * rows) - 0.5)
    ahead = np.cos(up) * np.cos(around)
    inside = (np.abs(np.cos(up) * np.sin(around)) <= 0.085 / 0.3 * ahead) & (
        np.abs(np.sin(up)) <= 0.05 / 0.3 * ahead
    )
    weight = inside * np.cos(up)
    share = weight.reshape(32, 32, 64, 32).sum(axis=(1, 3))
    share /= np.cos(up).reshape(32, 32).sum(axis=1)[:, None] * 32
    found = coverage(parse("panel@0.3"), (32, 64))[4 * 64]
    np.testing.assert_allclose(found, share, atol=0.03)
    assert float(np.sqrt(np.mean((found - share)[share > 0] ** 2))) < 0.01
