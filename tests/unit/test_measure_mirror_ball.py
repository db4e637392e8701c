"""A mirror ball: found, measured and unwrapped, against pictures that numpy traced."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np
import pytest

from app.core.base.angles import difference
from app.core.base.colour import luminance
from app.core.base.errors import ProbeError
from app.core.base.progress import Token
from app.core.base.sphere import direction, directions
from app.core.environment.environment import solid_angles
from app.core.measure.ball.ball_finder import Ball, find_ball, fused, refined
from app.core.measure.ball.mirror_ball import (
    BallOptions,
    Side,
    find_lens,
    join_sides,
    metal,
    unwrap,
)
from app.core.measure.read.frame import MergedLight
from app.core.measure.read.resampling import azimuth_elevation
from app.words.remarks import sentences
from tests.helpers.cases import sample_first
from tests.helpers.mirror_ball import COLOURS, DIAGONAL_MM, LAMPS, Float32, place, traced

SIZE = (500, 750)


@lru_cache
def picture(
    mm: float = 85.0,
    at: tuple[float, float] = (0.0, 0.0),
    pitch_deg: float = 0.0,
    azimuth_deg: float = 0.0,
) -> Float32:
    return traced(
        place(), SIZE, mm, balls=((*at, 0.0),), pitch_deg=pitch_deg, azimuth_deg=azimuth_deg
    )


def merged(light: Float32) -> MergedLight:
    nothing = np.zeros(light.shape[:2], np.float32)
    return MergedLight(light, nothing, nothing, 0.0, math.inf)


def side_of(light: Float32, rows: int, pitch_deg: float = 0.0) -> Side:
    ball = refined(find_ball(luminance(light), 85.0), light)
    return unwrap(merged(light), ball, rows, BallOptions(pitch_deg=pitch_deg))


def true_ball(
    mm: float,
    at: tuple[float, float] = (0.0, 0.0),
    pitch_deg: float = 0.0,
    size: tuple[int, int] = SIZE,
) -> Ball:
    focal = mm * math.hypot(*size) / DIAGONAL_MM
    cosine, sine = math.cos(math.radians(pitch_deg)), math.sin(math.radians(pitch_deg))
    seen = np.array([at[0], at[1] * cosine - 1.5 * sine, at[1] * sine + 1.5 * cosine])
    far = float(np.linalg.norm(seen))
    return Ball(seen / far, math.asin(0.06 / far), focal, size)


@pytest.mark.parametrize(
    ("mm", "at", "pitch_deg"),
    [(85.0, (0.0, 0.0), 0.0), (85.0, (0.12, -0.08), 0.0), (60.0, (0.3, -0.25), -6.0)],
)
def test_the_outline_is_that_of_the_sphere_in_perspective(
    mm: float, at: tuple[float, float], pitch_deg: float
) -> None:
    light = picture(mm, at, pitch_deg)
    ball = refined(find_ball(luminance(light), mm), light)
    true = true_ball(mm, at, pitch_deg)
    off_px = math.acos(min(float(ball.axis @ true.axis), 1.0)) * ball.focal
    assert off_px < 0.7
    assert ball.radius_px == pytest.approx(true.radius_px, abs=0.5)


@pytest.mark.parametrize(
    ("at", "pitch_deg"), [((0.0, 0.0), 0.0), ((0.12, -0.08), 0.0), ((0.05, -0.35), -13.0)]
)
def test_lamps_are_where_they_stand_around_the_photographer(
    at: tuple[float, float], pitch_deg: float
) -> None:
    side = side_of(picture(85.0, at, pitch_deg), 128, pitch_deg)
    # Azimuth 0 is the line from the ball to the camera, which leads aside when the ball is aside.
    aside = math.degrees(math.atan2(at[0], 1.5))
    for lamp, colour in zip(LAMPS, COLOURS, strict=True):
        azimuth, elevation = centre(side.texels[..., :3], colour)
        assert abs(difference(azimuth, lamp[0] - aside)) < 1.5
        assert elevation == pytest.approx(lamp[1], abs=1.5)


def centre(radiance: Float32, colour: tuple[float, ...]) -> tuple[float, float]:
    """Azimuth and elevation of what shines in a colour."""
    own = np.array(colour) > 0.5
    bright = (radiance[..., own].min(axis=-1) > 15.0) & (radiance[..., ~own].max(axis=-1) < 15.0)
    rows, columns = radiance.shape[:2]
    y, x = np.nonzero(bright)
    toward = np.array(
        [
            direction(360.0 * ((c + 0.5) / columns - 0.5), 90.0 - 180.0 * (r + 0.5) / rows)
            for r, c in zip(y, x, strict=True)
        ]
    )
    return azimuth_elevation(toward.T @ solid_angles((rows, columns))[y])


@pytest.mark.parametrize(("far_m", "at"), [(1e6, (171.0, 1.0)), (3.0, (-172.0, -2.0))])
def test_a_lamp_behind_the_ball_is_seen_past_it(far_m: float, at: tuple[float, float]) -> None:
    """The ball squeezes it into its last pixel; how far behind the lamp is, its rim must tell."""
    light = place().copy()
    up, around = (np.arange(256) + 0.5) * 180 / 256 - 90, (np.arange(512) + 0.5) * 360 / 512 - 180
    lamp = np.hypot(up[::-1, None] - at[1], (around - at[0])[None]) < 3.0
    light[lamp] = (80.0, 80.0, 4.0)
    seen = traced(light, (600, 2400), 52.0, samples=2, far_m=far_m)
    ball = refined(find_ball(luminance(seen), 52.0), seen)
    side = unwrap(merged(seen), ball, 128, BallOptions())
    toward = direction(*at) @ directions((128, 256)).reshape(-1, 3).T
    near = (toward > math.cos(math.radians(12.0))).reshape(128, 256)
    shown = np.where(near[..., None], side.texels[..., :3], 0.0).astype(np.float32)
    azimuth, elevation = centre(shown, (1.0, 1.0, 0.1))
    assert abs(difference(azimuth, at[0])) < 1.5
    assert elevation == pytest.approx(at[1], abs=1.5)
    assert shown[..., 0].max() == pytest.approx(80.0, rel=0.1)


def test_light_is_what_the_place_has_where_the_ball_shows_it() -> None:
    side = side_of(picture(), 64)
    true = np.asarray(cv2.resize(place(), (128, 64), interpolation=cv2.INTER_AREA))
    areas = np.repeat(solid_angles((64, 128))[:, None], 128, axis=1)
    seen = (side.weight > 0.1) * areas
    # The tracer's mirror reflects 66 % at every angle, a metal a little less towards the rim.
    ratio = (luminance(side.texels[..., :3]) * seen).sum() / (luminance(true) * seen).sum()
    assert ratio == pytest.approx(1.0, abs=0.04)
    blind = float(areas[side.weight == 0].sum()) / (4.0 * math.pi)
    assert 0.02 < blind < 0.08


SUN = (500.0, 450.0, 400.0)


@lru_cache
def sunny() -> Float32:
    """The place with a sun of 6 degrees at azimuth 60: (256, 512, 3)."""
    light = place().copy()
    light[(light.max(axis=-1) > 15.0) & (light[..., 1] < 15.0) & (light[..., 2] < 15.0)] = SUN
    return light


@pytest.mark.parametrize("clip", [math.inf, 60.0])
@pytest.mark.parametrize(
    ("colour", "off"), sample_first([((0.25, 0.2, 0.15), 0.02), ((0.5, 0.5, 0.45), 0.035)], 1)
)
def test_specks_of_dirt_are_taken_out(
    colour: tuple[float, float, float], off: float, clip: float
) -> None:
    """In the sun they are brighter than the place, in the shade darker; both would show."""
    plain = unwrapped(traced(sunny(), (800, 1200), 85.0, samples=2))
    side = unwrapped(traced(sunny(), (800, 1200), 85.0, samples=2, dirt=colour), clip)
    dim = (plain.weight > 0.3) & (luminance(plain.texels[..., :3]) < 4.0)
    toward = directions((256, 512)) @ direction(*LAMPS[0]).astype(np.float32)
    for part, most in ((dim & (toward > 0.5), off), (dim & (toward < -0.2), 0.02)):
        made, true = (luminance(each.texels[..., :3])[part] for each in (side, plain))
        assert made.mean() == pytest.approx(true.mean(), rel=0.025)
        # 3 to 6 % of the place are half a stop off where dirt is left.
        assert np.mean(np.abs(np.log2(made / true)) > 0.5) < most


def test_small_things_of_the_place_are_not_taken_for_dirt() -> None:
    """They are of one colour, but not by the light of where they show on the ball."""
    light, random = sunny().copy(), np.random.default_rng(8)
    posters = np.zeros(light.shape[:2], bool)
    for row, column in random.integers((50, 112), (200, 394), (120, 2)):
        posters[row : row + 6, column : column + 6] = True
    posters[:, 208:304] = False  # the photographer's
    light[posters] = (0.25, 0.2, 0.15)
    side = unwrapped(traced(light, (800, 1200), 85.0, samples=2))
    inside = cv2.erode(posters.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    assert inside.sum() > 200
    assert np.mean(side.weight[inside] > 0.1) > 0.99  # what was filled has hardly any
    assert np.mean(np.abs(np.log2(side.texels[inside, 1] / 0.2)) < 0.2) > 0.93


@pytest.mark.parametrize(
    "mirror",
    [
        (0.9, 0.7, 0.4),
        pytest.param((0.5, 0.3, 0.3), marks=pytest.mark.slow),
        pytest.param((0.66, 0.66, 0.66), marks=pytest.mark.slow),
    ],
)
def test_the_colour_of_the_mirror_is_taken_out(mirror: tuple[float, float, float]) -> None:
    """Its rim and the picture past it show the same."""
    soft = np.asarray(cv2.GaussianBlur(place(), (0, 0), 6.0), np.float32)
    seen = traced(soft, (800, 3200), 52.0, samples=2, reflectance=mirror)
    ball = true_ball(52.0, size=(800, 3200))
    side = unwrap(merged(seen), ball, 128, BallOptions())
    true = np.asarray(cv2.resize(soft, (256, 128), interpolation=cv2.INTER_AREA))
    clear = side.weight > 0.3
    made, own = (each[clear].mean(axis=0) for each in (side.texels[..., :3], true))
    assert made / made.sum() == pytest.approx(own / own.sum(), rel=0.05)
    assert any("tinted" in note for note in sentences(side.notes)) == (
        max(mirror) > 1.2 * min(mirror)
    )


@pytest.mark.parametrize("mm", sample_first([50.0, 35.0, 85.0], 1))
def test_a_lens_that_no_file_states_is_found_by_what_is_behind_the_ball(mm: float) -> None:
    size = (round(14 * mm), 8 * round(4 * mm))
    seen = traced(place(), size, mm, samples=2)
    ball = true_ball(mm, size=size).seen_by(50.0)
    found = find_lens(merged(seen), ball, BallOptions(), Token())
    found_mm = found.focal * DIAGONAL_MM / math.hypot(*size)
    # Lenses are tried in steps of half a stop.
    assert abs(math.log2(found_mm / mm)) < 0.55
    # The outline stays where it is.
    assert found.radius_px == pytest.approx(ball.radius_px, rel=1e-3)
    assert found.project(found.axis) == pytest.approx(ball.project(ball.axis), abs=0.01)


def unwrapped(light: Float32, clip: float = math.inf) -> Side:
    """What a ball reflects in a picture that clips at some level, 256 rows."""
    held = np.minimum(light, np.float32(clip))
    ball = true_ball(85.0, size=(light.shape[0], light.shape[1]))
    clipped = np.asarray((held >= clip).any(axis=-1), np.float32)
    return unwrap(replace(merged(held), clipped=clipped), ball, 256, BallOptions())


def test_a_metal_reflects_as_fresnel_says() -> None:
    index = complex(3.2, 3.2)
    head_on = abs((index - 1) / (index + 1)) ** 2
    cosine = np.linspace(0.05, 1.0, 20)
    inner = np.sqrt(1 - (1 - cosine**2) / index**2)
    across = abs((cosine - index * inner) / (cosine + index * inner)) ** 2
    along = abs((index * cosine - inner) / (index * cosine + inner)) ** 2
    found = metal(cosine.astype(np.float32), head_on)
    assert found == pytest.approx(0.5 * (across + along), abs=0.02)


def test_a_second_side_shows_what_the_first_hides() -> None:
    first, second = (side_of(picture(azimuth_deg=azimuth), 96) for azimuth in (0.0, 80.0))
    both = join_sides(first, second, 72.0)
    assert (both.weight == 0).sum() < 0.1 * (first.weight == 0).sum()
    true = np.asarray(cv2.resize(place(), (192, 96), interpolation=cv2.INTER_AREA))
    hidden = (first.weight == 0) & (both.weight > 0.2)
    stops = np.log2(luminance(both.texels[..., :3]) / luminance(true))[hidden]
    assert abs(float(np.median(stops))) < 0.15
    with pytest.raises(ProbeError, match="from another side"):
        join_sides(first, second, -100.0)


def test_two_balls_and_none_are_said() -> None:
    two = traced(place(), SIZE, 60.0, balls=((-0.15, 0.0, 0.0), (0.15, 0.02, 0.0)))
    with pytest.raises(ProbeError, match="2 mirror balls"):
        find_ball(luminance(two))
    for nothing in (np.full(SIZE, 0.5, np.float32), painted_ball(), luminance(place())):
        with pytest.raises(ProbeError, match="No mirror ball"):
            find_ball(nothing)


def painted_ball() -> Float32:
    """A ball that is no mirror, lit from the left, before a smooth background."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]].astype(np.float32)
    u, v = (x - 375) / 120, (y - 250) / 120
    normal = np.sqrt(np.maximum(1 - u * u - v * v, 0))
    shade = 0.05 + np.maximum(0.3 * normal - 0.8 * u, 0)
    return np.asarray(np.where(normal > 0, shade, 0.2 + 0.1 * x / SIZE[1]), np.float32)


def test_frames_are_fused_where_they_are_open() -> None:
    true = np.exp2(np.random.default_rng(0).uniform(-4.0, 3.0, (20, 30, 3))).astype(np.float32)
    stops = (2.0, -1.0, -4.0)
    frames = [np.rint(255 * coded(np.minimum(true * 2.0**s, 1.0))).astype(np.uint8) for s in stops]
    found = fused(frames, stops)
    assert np.abs(np.log2(found / 4.0 / luminance(true))).max() < 0.1


def coded(linear: Float32) -> Float32:
    """The sRGB curve, written out."""
    bent = 1.055 * linear ** (1 / 2.4) - 0.055
    return np.asarray(np.where(linear <= 0.0031308, 12.92 * linear, bent), np.float32)
