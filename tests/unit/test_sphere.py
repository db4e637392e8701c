"""Rotating panoramas: signs, seams, poles, and the energy of lamps."""

from __future__ import annotations

import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.core.base.sphere import (
    angle_of,
    angles_of,
    direction,
    directions,
    from_vector,
    positions,
    remap_frame,
    rotate_light,
    rotation,
    to_vector,
)
from app.core.environment.environment import energy, read_environment, solid_angles
from benchmarks.truth.stock import rotate

SCENES = sorted((Path(__file__).resolve().parents[2] / "resources/demo/scenes").glob("*.exr"))
TURNS = [(3, 2, 1), (0, -29, -35.8), (0, 40, 0), (0, 90, 0), (170, -80, 120), (45, 45, 45)]


def _where(vector: np.ndarray) -> tuple[float, float]:
    x, y, z = vector
    return float(np.degrees(np.arctan2(-x, z))), float(np.degrees(np.arcsin(y)))


def test_the_axes_are_those_of_the_head_at_turn_0() -> None:
    assert np.allclose(direction(0, 0), [0, 0, 1])  # out of the face, towards the photographer
    assert np.allclose(direction(0, 90), [0, 1, 0])  # up
    assert np.allclose(direction(-90, 0), [1, 0, 0])  # the sitter's left
    axes = np.stack([direction(-90, 0), direction(0, 90), direction(0, 0)])
    assert np.linalg.det(axes) == pytest.approx(1.0)  # right-handed


def test_yaw_turns_clockwise_pitch_lifts_the_front_roll_lowers_the_right() -> None:
    assert _where(rotation(30) @ direction(10, 20)) == pytest.approx((40, 20))
    assert _where(rotation(0, 25) @ direction(0, 0)) == pytest.approx((0, 25))
    assert _where(rotation(0, 0, 35) @ direction(90, 0))[1] == pytest.approx(-35)
    assert _where(rotation(0, 0, 35) @ direction(0, 0)) == pytest.approx((0, 0))
    # Heading, then pitch, then roll: the front is where yaw and pitch say, whatever the roll.
    assert _where(rotation(30, -20, 77) @ direction(0, 0)) == pytest.approx((30, -20))


@given(st.floats(-179, 179), st.floats(-89, 89), st.floats(-179, 179))
def test_angles_are_recovered(yaw: float, pitch: float, roll: float) -> None:
    matrix = rotation(yaw, pitch, roll)
    assert np.allclose(matrix @ matrix.T, np.eye(3))
    assert angles_of(matrix) == pytest.approx((yaw, pitch, roll), abs=1e-6)


@pytest.mark.parametrize("pitch", [90.0, -90.0])
def test_angles_straight_up_and_down_make_the_same_rotation(pitch: float) -> None:
    matrix = rotation(20.0, pitch, 30.0)
    assert np.allclose(rotation(*angles_of(matrix)), matrix, atol=1e-9)


def test_vectors_and_angles() -> None:
    assert angle_of(rotation(0, 0, 12.5)) == pytest.approx(12.5)
    assert np.allclose(to_vector(from_vector(np.array([0.1, -0.2, 0.3]))), [0.1, -0.2, 0.3])
    # Right-handed about up is counter-clockwise from above: negative yaw.
    assert np.allclose(from_vector(np.array([0, np.radians(10), 0])), rotation(-10))


@pytest.mark.parametrize("shape", [(32, 64), (33, 66), (512, 1024)])
def test_positions_undo_directions(shape: tuple[int, int]) -> None:
    columns, rows = positions(directions(shape), shape)
    assert np.abs(columns - np.arange(shape[1])).max() < 2e-3
    assert np.abs(rows - np.arange(shape[0])[:, None]).max() < 2e-3
    assert np.allclose(directions((4, 8))[1, 5], direction(67.5, 22.5), atol=1e-6)


def _smooth(shape: tuple[int, int], matrix: np.ndarray) -> np.ndarray:
    """A smooth picture on the sphere, rotated exactly."""
    back = directions(shape).astype(np.float64) @ matrix
    waves = [[3, 1, -2], [1, -4, 2], [-2, 2, 5]]
    return np.stack([0.5 + 0.45 * np.sin(back @ np.array(w)) for w in waves], axis=-1)


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("kind", ["uint8", "uint16", "float32"])
def test_a_frame_is_rotated_like_the_scene_seams_and_poles_included(
    turn: tuple[float, float, float], kind: str
) -> None:
    shape, matrix = (256, 512), rotation(*turn)
    top = {"uint8": 255, "uint16": 65535, "float32": 1}[kind]
    given = _smooth(shape, np.eye(3)) * top
    wanted = _smooth(shape, matrix) * top
    image = given.astype(kind) if kind == "float32" else np.rint(given).astype(kind)
    result = remap_frame(image, matrix)
    assert result.dtype == image.dtype
    assert result.shape == image.shape
    # Bilinear interpolation and 1/32 pixel of cv2.remap; no pixel off, not at the poles either.
    slack = 1.5 if kind == "uint8" else 0.0015 * top
    assert np.abs(result.astype(float) - wanted).max() < slack


def test_grey_frames_and_whole_turns() -> None:
    image = np.random.default_rng(1).integers(0, 256, (64, 128), np.uint8)
    assert np.array_equal(remap_frame(image, np.eye(3)), image)
    # Clockwise by a quarter: what was in front is now on the right.
    assert np.array_equal(remap_frame(image, rotation(90.0)), rotate(image, -32))


def _lamp_energy(radiance: np.ndarray, at: np.ndarray, radius_deg: float) -> np.ndarray:
    """Light around a direction, with a window that falls off smoothly to the radius."""
    shape = radiance.shape[:2]
    angle = np.degrees(np.arccos(np.clip(directions(shape) @ at.astype(np.float32), -1, 1)))
    window = np.cos(np.minimum(angle / radius_deg, 1.0) * np.pi) + 1.0
    weighted = radiance * (window * solid_angles(shape)[:, None])[..., None]
    return np.asarray(weighted.sum(axis=(0, 1), dtype=np.float64))


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(
    st.tuples(st.floats(-180, 180), st.floats(-90, 90), st.floats(-180, 180)),
    st.integers(0, 511),
    st.integers(0, 1023),
)
def test_one_texel_keeps_its_energy_anywhere(
    turn: tuple[float, float, float], row: int, column: int
) -> None:
    shape, matrix = (512, 1024), rotation(*turn)
    scene = np.full((*shape, 3), 0.25, np.float32)
    scene[row, column] = (9e6, 5e6, 1e6)
    turned = rotate_light(scene, matrix)
    assert np.allclose(energy(turned), energy(scene), rtol=1e-5)
    at = matrix @ directions(shape)[row, column].astype(np.float64)
    own = (scene[row, column] - 0.25) * solid_angles(shape)[row]
    window = directions(shape) @ at.astype(np.float32) > np.cos(np.radians(2.0))
    moved = ((turned - 0.25) * solid_angles(shape)[:, None, None])[window].sum(axis=0)
    assert np.allclose(moved, own, rtol=2e-3)
    assert turned.min() >= 0.2499


@pytest.mark.parametrize("shape", [(512, 1024), pytest.param((1024, 2048), marks=pytest.mark.slow)])
@pytest.mark.parametrize("turn", TURNS)
def test_lamps_of_all_sizes_keep_their_energy(
    shape: tuple[int, int], turn: tuple[float, float, float]
) -> None:
    rng = np.random.default_rng(3)
    looks, matrix = directions(shape), rotation(*turn)
    scene = rng.uniform(0.1, 0.3, (*shape, 3)).astype(np.float32)
    places = [direction(a, e) for a, e in ((10, 30), (120, 75), (-100, -40), (60, 0), (-30, 88))]
    for at, radius in zip(places, (0.27, 0.6, 1.0, 2.0, 1.0), strict=True):
        scene[looks @ at.astype(np.float32) > np.cos(np.radians(radius))] = 2e3 / radius**2
    turned = rotate_light(scene, matrix)
    assert np.allclose(energy(turned), energy(scene), rtol=1e-3)
    for at in places:
        before, after = _lamp_energy(scene, at, 8.0), _lamp_energy(turned, matrix @ at, 8.0)
        assert np.allclose(after, before, rtol=0.01)


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_light_of_real_scenes(path: Path) -> None:
    scene = np.array(read_environment(path).radiance)
    matrix = rotation(0, -29, -35.8)
    turned = rotate_light(scene, matrix)
    assert np.allclose(energy(turned), energy(scene), rtol=1e-3)
    assert np.isfinite(turned).all()
    assert turned.min() >= 0
    # The brightest lamp, and the light of each half of the sphere.
    row, column = np.unravel_index(scene.sum(axis=2).argmax(), scene.shape[:2])
    at = directions(scene.shape[:2])[row, column].astype(np.float64)
    for radius in (6.0, 20.0, 90.0):
        before = _lamp_energy(scene, at, radius)
        assert np.allclose(_lamp_energy(turned, matrix @ at, radius), before, rtol=0.01)


def test_a_uniform_environment_stays_uniform() -> None:
    scene = np.full((128, 256, 3), 0.7, np.float32)
    assert np.abs(rotate_light(scene, rotation(20, 30, 40)) - 0.7).max() < 1e-5


def test_black_environments_and_single_channels() -> None:
    assert not rotate_light(np.zeros((64, 128, 3), np.float32), rotation(1, 2, 3)).any()
    single = np.random.default_rng(0).random((64, 128, 1)).astype(np.float32)
    turned = rotate_light(single, rotation(1, 2, 3))
    assert turned.shape == single.shape
    assert np.allclose(energy(turned), energy(single), rtol=1e-4)


@pytest.mark.slow
@pytest.mark.alone
def test_rotating_a_frame_costs_a_few_plain_resamplings() -> None:
    image = np.random.default_rng(0).integers(0, 256, (1344, 2688, 3), np.uint8)
    matrix = rotation(3, 2, 1)
    columns, rows = (m.astype(np.float32) for m in np.meshgrid(np.arange(2688), np.arange(1344)))
    plain, own = [], []
    for _ in range(3):
        start = time.process_time()
        for band in range(0, 1344, 192):
            part = slice(band, band + 192)
            cv2.remap(image, columns[part] + 0.3, rows[part] + 0.4, cv2.INTER_LINEAR)
        middle = time.process_time()
        remap_frame(image, matrix)
        plain.append(middle - start)
        own.append(time.process_time() - middle)
    assert min(own) < 12 * min(plain)
