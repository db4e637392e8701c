"""Suggested masks: painted tripods and people are found, clean ground is left alone."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from app.core.base.errors import ProbeError
from app.core.base.paths import resources
from app.core.base.sphere import direction, rotate_light, rotation
from app.core.environment.environment import read_environment, solid_angles
from app.core.measure.finish.masks import cap_mask, parse_mask
from app.core.measure.finish.tripod_detection import (
    NADIR,
    Clutter,
    Suggestion,
    foot_of,
    resolve,
    suggest,
    union,
)
from app.core.measure.read.frame import MergedLight
from app.core.measure.read.resampling import Chart
from app.words.measure.masks import clutter_name, clutter_reason
from tests.helpers.shared import SHARED, needs_shared

SCENES = ("city", "courtyard", "forest", "interior", "night", "studio", "sunrise", "sunset")
PAINTED = ("city", "courtyard", "forest", "night", "sunset")


def scene(name: str) -> np.ndarray:
    return np.array(read_environment(resources() / "demo" / "scenes" / f"{name}.exr").radiance)


def merged(radiance: np.ndarray) -> MergedLight:
    zero = np.zeros(radiance.shape[:2], np.float32)
    return MergedLight(np.ascontiguousarray(radiance, np.float32), zero, zero, 0.0, 1.0)


def ground(light: np.ndarray) -> float:
    return float(np.median(light[int(0.8 * len(light)) :]))


def paint(light: np.ndarray, drawing: np.ndarray, cover: np.ndarray) -> tuple[np.ndarray, ...]:
    """Put a drawing on the chart around the nadir (160 degrees wide) into a panorama."""
    shape = light.shape[:2]
    column, row = Chart(NADIR, 80.0, cover.shape[0], "equidistant").place(shape, slice(0, shape[0]))
    mask = cv2.remap(cover, column, row, cv2.INTER_LINEAR, borderValue=(0.0,))
    colour = cv2.remap(drawing, column, row, cv2.INTER_LINEAR, borderValue=(0.0, 0.0, 0.0))
    return (light * (1.0 - mask[..., None]) + np.maximum(colour, 0.0)).astype(np.float32), mask


def tripod(light: np.ndarray) -> tuple[np.ndarray, ...]:
    """A black hub 12 degrees wide with three legs that reach 38 degrees from the nadir."""
    cover = np.zeros((1600, 1600), np.float32)
    cv2.circle(cover, (800, 800), 60, (1.0,), -1, cv2.LINE_AA)
    for angle in np.radians((20.0, 140.0, 260.0)):
        end = (round(800 + 380 * np.sin(angle)), round(800 - 380 * np.cos(angle)))
        cv2.line(cover, (800, 800), end, (1.0,), 14, cv2.LINE_AA)
    black = np.array([0.03, 0.03, 0.032], np.float32) * np.float32(ground(light))
    return paint(light, cover[..., None] * black, cover)


def person(light: np.ndarray, azimuth: float) -> tuple[np.ndarray, ...]:
    """An arm from the nadir, and a red jacket from 25 to 62 degrees around an azimuth."""
    axes = Chart(NADIR, 80.0, 1600, "equidistant").axes
    side = direction(azimuth, 0.0)
    x, y = float(side @ axes[0]), -float(side @ axes[1])
    cover = np.zeros((1600, 1600), np.float32)
    drawing = np.zeros((1600, 1600, 3), np.float32)
    parts = ((0, 30, 50, (1.1, 0.75, 0.6)), (25, 55, 200, (0.9, 0.25, 0.18)))
    for start, stop, wide, tone in parts:
        a, b = ((round(800 + 10 * t * x), round(800 + 10 * t * y)) for t in (start, stop))
        cv2.line(cover, a, b, (1.0,), wide)
        cv2.line(drawing, a, b, tuple(value * ground(light) for value in tone), wide)
    noise = np.random.default_rng(3).standard_normal((160, 160)).astype(np.float32)
    folds = np.asarray(cv2.resize(cv2.GaussianBlur(noise, (0, 0), 2.0), (1600, 1600)))
    return paint(light, drawing * (1.0 + 0.8 * folds)[..., None], cover)


def overlap(found: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    """Share of what is there that is masked, and of the mask that is more than 4 deg off it."""
    heights = solid_angles(truth.shape)[:, None]
    chart = Chart(NADIR, 80.0, 400, "equidistant")
    wide = cv2.dilate(chart.sample(truth), np.ones((21, 21), np.uint8))
    column, row = chart.place(truth.shape, slice(0, truth.shape[0]))
    near = cv2.remap(wide, column, row, cv2.INTER_LINEAR, borderValue=(0.0,)) > 0.1
    there = float((found * truth * heights).sum() / (truth * heights).sum())
    stray = float((found * ~near * heights).sum() / (found * heights).sum())
    return there, stray


@pytest.mark.parametrize("name", SCENES)
def test_clean_ground_gives_no_suggestion(name: str) -> None:
    assert suggest(merged(scene(name))) == ()


@pytest.mark.parametrize("name", PAINTED)
def test_a_black_tripod_is_found_where_it_is(name: str) -> None:
    light, truth = tripod(scene(name))
    (found,) = suggest(merged(light))
    there, stray = overlap(found.mask, truth)
    assert there > 0.75
    assert stray < 0.25
    assert isinstance(found.origin, Suggestion)
    assert found.origin.azimuth_deg is None
    assert 0.3 <= found.confidence <= 0.95
    assert found.mask.shape == light.shape[:2]
    assert found.mask.dtype == np.float32
    assert found.mask.min() == 0.0
    assert found.mask.max() == 1.0


def test_at_least_the_hub_is_found_where_other_things_are_black_too() -> None:
    light, _ = tripod(scene("studio"))
    (found,) = suggest(merged(light))
    hub = cap_mask(-84.0, light.shape[:2])
    assert found.mask[hub == 1.0].min() > 0.9


@pytest.mark.parametrize("name", ["city", "sunset", "studio"])
@pytest.mark.parametrize("azimuth", [140.0, 180.0, -60.0])
def test_somebody_who_holds_the_stick_is_found(name: str, azimuth: float) -> None:
    light, truth = person(scene(name), azimuth)
    (found,) = suggest(merged(light))
    there, stray = overlap(found.mask, truth)
    assert there > 0.8
    assert stray < 0.3
    assert isinstance(found.origin, Suggestion)
    assert found.origin.azimuth_deg is not None
    said = found.origin.azimuth_deg
    assert abs((said - azimuth + 180.0) % 360.0 - 180.0) < 15.0


def test_solid_angles_are_stated_right() -> None:
    light, _ = tripod(scene("city"))
    (found,) = suggest(merged(light))
    expected = (found.mask.sum(axis=1) * solid_angles(found.mask.shape)).sum()
    assert found.solid_angle_sr == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("factor", [1e-4, 1.0, 1e4])
def test_exposure_does_not_matter(factor: float) -> None:
    light, _ = tripod(scene("sunset"))
    (found,) = suggest(merged(light * np.float32(factor)))
    (usual,) = suggest(merged(light))
    assert np.abs(found.mask - usual.mask).mean() < 1e-3


def test_the_foot_of_a_tilted_camera_is_looked_at() -> None:
    tilt = rotation(0.0, -29.0, -35.8)
    light, truth = tripod(scene("city"))
    level = merged(rotate_light(light, tilt))
    turned = rotate_light(np.repeat(truth[..., None], 3, axis=2).astype(np.float32), tilt)[..., 0]
    foot = foot_of(tilt)
    np.testing.assert_allclose(direction(*foot), -tilt[:, 1], atol=1e-9)
    (found,) = suggest(level, foot)
    heights = solid_angles(found.mask.shape)[:, None]
    assert (found.mask * turned * heights).sum() > 0.8 * (turned * heights).sum()
    assert suggest(level) == ()


def test_a_camera_that_was_level_has_its_foot_at_the_nadir() -> None:
    assert foot_of(None) == NADIR
    assert foot_of(rotation(0.0))[1] == pytest.approx(-90.0)


@pytest.mark.parametrize("shape", [(32, 64), (128, 256)])
def test_small_and_black_panoramas_are_survived(shape: tuple[int, int]) -> None:
    assert suggest(merged(np.full((*shape, 3), 0.5, np.float32))) == ()
    assert suggest(merged(np.zeros((*shape, 3), np.float32))) == ()


def test_ordinary_pictures_have_no_foot() -> None:
    photo = merged(np.full((200, 300, 3), 0.5, np.float32))
    assert suggest(photo) == ()
    assert resolve((), photo) == ()
    with pytest.raises(ProbeError, match="full panorama"):
        resolve([parse_mask("nadir:-65")], photo)


def test_masks_by_hand_and_suggestions_come_in_the_order_asked_for() -> None:
    light, _ = tripod(scene("city"))
    specs = [parse_mask(text) for text in ("box:0,20,-20,10", "suggested", "nadir:-80")]
    box, found, cap = resolve(specs, merged(light))
    assert (clutter_name(box), box.confidence) == ("masked box", 1.0)
    assert isinstance(found.origin, Suggestion)
    assert found.origin.azimuth_deg is None
    np.testing.assert_array_equal(cap.mask, cap_mask(-80.0, light.shape[:2]))
    assert cap.solid_angle_sr == pytest.approx(2 * np.pi * (1 - np.sin(np.radians(80))), rel=0.01)
    both = union([box, cap], light.shape[:2])
    np.testing.assert_array_equal(both, np.maximum(box.mask, cap.mask))
    assert union([], (4, 8)).sum() == 0.0


@needs_shared
@pytest.mark.parametrize(
    ("name", "at_least_sr", "point"),
    [
        ("theta_v_R0014760.JPG", 0.25, (-150.0, -70.0)),  # hair below the camera
        ("theta_s_tilted_R0010298.JPG", 0.4, (0.0, -75.0)),  # the hand that holds it
    ],
)
def test_photographers_of_real_pictures_are_suggested(
    name: str, at_least_sr: float, point: tuple[float, float]
) -> None:
    coded = cv2.imread(str(SHARED / "theta" / name))
    assert coded is not None
    small = cv2.resize(coded, (1024, 512), interpolation=cv2.INTER_AREA)[..., ::-1]
    (found,) = suggest(merged((small / np.float32(255.0)) ** np.float32(2.2)))
    assert found.solid_angle_sr > at_least_sr
    row, column = round((90 - point[1]) / 180 * 512), round((point[0] / 360 + 0.5) * 1024)
    assert found.mask[row, column] == 1.0


@needs_shared
def test_clean_ground_elsewhere_gives_no_suggestion_either() -> None:
    for path in sorted(Path(SHARED / "hdri").glob("*.hdr")):
        assert suggest(merged(np.array(read_environment(path).radiance))) == (), path.name


def test_a_suggestion_says_no_more_than_it_knows() -> None:
    light, _ = tripod(scene("sunset"))
    (found,) = suggest(merged(light))
    assert isinstance(found, Clutter)
    assert clutter_reason(found).startswith("This area reaches ")
    assert found.confidence < 1.0
