"""Filling on the sphere: harmonic functions come back, nothing bright is invented."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.base.colour import luminance
from app.core.base.errors import ProbeError
from app.core.base.paths import resources
from app.core.base.sphere import direction, directions
from app.core.environment.environment import energy, read_environment, solid_angles
from app.core.measure.finish.inpainting import components, fill
from app.core.measure.finish.masks import box_mask, cap_mask
from app.core.measure.read.frame import MergedLight

SHAPE = (256, 512)
PLACES = [(0.0, -90.0), (0.0, 90.0), (180.0, 0.0), (-100.0, 35.0), (40.0, -60.0)]


def merged(radiance: np.ndarray, clipped: np.ndarray | None = None) -> MergedLight:
    shape = radiance.shape[:2]
    zero = np.zeros(shape, np.float32)
    light = np.asarray(radiance, np.float32)
    light.flags.writeable = False
    return MergedLight(light, zero if clipped is None else clipped, zero, 0.0, 1.0)


def disc(centre: tuple[float, float], radius: float, shape: tuple[int, int] = SHAPE) -> np.ndarray:
    cosine = directions(shape) @ direction(*centre)
    return np.asarray(cosine > np.cos(np.radians(radius)), np.float32)


def harmonic(centre: tuple[float, float], shape: tuple[int, int] = SHAPE) -> np.ndarray:
    """Three harmonic functions around a direction: parts of powers of its stereographic chart."""
    out = direction(*centre)
    right = np.cross(out, [0.3, 0.5, 0.81])
    right /= np.linalg.norm(right)
    vectors = directions(shape).astype(float)
    scale = 1.0 / np.maximum(1.0 + vectors @ out, 0.3)
    w = (vectors @ right + 1j * (vectors @ np.cross(out, right))) * scale
    return np.stack([1.0 + 0.0 * w.real, 2.0 + w.real, 2.0 + (w**2).imag], axis=-1)


@pytest.mark.parametrize("centre", PLACES)
@pytest.mark.parametrize("radius", [8.0, 35.0])
def test_harmonic_light_comes_back_anywhere_on_the_sphere(
    centre: tuple[float, float], radius: float
) -> None:
    truth = harmonic(centre).astype(np.float32)
    mask = disc(centre, radius)
    spoilt = np.where(mask[..., None] > 0.0, np.float32(40.0), truth)
    found = fill(merged(spoilt), mask).radiance
    inside = mask > 0.0
    spread = np.ptp(truth[inside], axis=0).max()
    assert np.abs(found - truth)[inside].max() < max(0.03 * spread, 0.004)
    assert np.abs(found - truth)[..., 0].max() < 1e-4


@pytest.mark.parametrize("shape", [(32, 64), (300, 600), (512, 1024)])
def test_constant_light_stays_constant_at_any_size(shape: tuple[int, int]) -> None:
    light = np.full((*shape, 3), (0.2, 0.5, 3.0), np.float32)
    mask = np.maximum(cap_mask(-60.0, shape), box_mask(160.0, -160.0, -30.0, 30.0, shape))
    spoilt = np.where(mask[..., None] > 0.0, np.float32(0.0), light)
    np.testing.assert_allclose(fill(merged(spoilt), mask).radiance, light, rtol=2e-4)


def test_filled_light_is_between_the_darkest_and_the_brightest_around() -> None:
    rng = np.random.default_rng(5)
    light = rng.uniform(0.2, 1.0, (*SHAPE, 3)).astype(np.float32)
    mask = box_mask(150.0, -150.0, -80.0, 20.0, SHAPE)
    light[mask > 0.0] = 100.0
    found = fill(merged(light), mask).radiance[mask > 0.02]
    assert found.min() >= 0.2
    assert found.max() <= 1.0


def test_a_lamp_at_the_edge_does_not_spread_into_the_filling() -> None:
    light = np.full((*SHAPE, 3), 0.5, np.float32)
    mask = box_mask(-20.0, 20.0, -40.0, 0.0, SHAPE)
    light[box_mask(21.8, 26.0, -22.0, -18.0, SHAPE) > 0.0] = (9000.0, 7000.0, 5000.0)
    found = fill(merged(light), mask).radiance[mask > 0.5]
    assert luminance(found).max() < 1.01
    # Its warm hue is kept where it does reach.
    assert (found[..., 0] >= found[..., 2] - 1e-6).all()


def test_only_the_mask_and_its_rim_change() -> None:
    rng = np.random.default_rng(6)
    light = rng.uniform(0.2, 1.0, (*SHAPE, 3)).astype(np.float32)
    clipped = np.full(SHAPE, 0.5, np.float32)
    before = merged(light.copy(), clipped)
    mask = disc((30.0, -50.0), 12.0)
    after = fill(before, mask)
    far = disc((30.0, -50.0), 16.0) == 0.0
    np.testing.assert_array_equal(after.radiance[far], light[far])
    assert (after.clipped[far] == 0.5).all()
    assert (after.clipped[mask == 1.0] == 0.0).all()
    np.testing.assert_array_equal(before.radiance, light)
    assert (before.clipped == 0.5).all()


def test_a_mask_of_lines_a_texel_wide_is_filled() -> None:
    shape = (512, 1024)
    light = np.ones((*shape, 3), np.float32)
    mask = np.zeros(shape, np.float32)
    mask[300:420, 511] = 1.0
    mask[350, 100:240] = 1.0
    light[mask > 0.0] = 0.0
    np.testing.assert_allclose(fill(merged(light), mask).radiance, 1.0, rtol=1e-3)


def test_no_seam_shows_in_a_filling_across_it() -> None:
    environment = read_environment(resources() / "demo" / "scenes" / "studio.exr")
    light = np.array(environment.radiance)
    mask = box_mask(150.0, -150.0, -90.0, -30.0, environment.shape)
    found = fill(merged(light), mask).radiance
    inside = slice(400, 500)
    across = np.abs(found[inside, 0] - found[inside, -1])
    beside = np.abs(found[inside, 1] - found[inside, 0])
    assert across.max() <= 3.0 * beside.max() + 1e-4
    # The nadir is one point: all azimuths agree.
    assert np.ptp(found[-1, :100], axis=0).max() < 0.02 * found[-1].max()


@pytest.mark.parametrize("name", ["city", "forest", "studio", "sunset"])
def test_filling_a_tripod_gives_the_ground_its_light_back(name: str) -> None:
    environment = read_environment(resources() / "demo" / "scenes" / f"{name}.exr")
    truth = np.array(environment.radiance)
    mask = cap_mask(-72.0, environment.shape)
    spoilt = np.where(mask[..., None] > 0.0, np.float32(0.0), truth)
    found = fill(merged(spoilt), mask).radiance
    lower = slice(environment.shape[0] // 2, None)

    def ground(light: np.ndarray) -> np.ndarray:
        rows = solid_angles(environment.shape)[lower]
        return np.tensordot(rows, light[lower].sum(axis=1, dtype=float), axes=1)

    lost = np.abs(ground(spoilt) - ground(truth))
    wrong = np.abs(ground(found) - ground(truth))
    assert (wrong < 0.35 * lost).all()
    np.testing.assert_allclose(energy(found)[1], energy(truth)[1], rtol=0.02)


def test_an_empty_mask_changes_nothing() -> None:
    before = merged(np.ones((*SHAPE, 3), np.float32))
    assert fill(before, np.zeros(SHAPE, np.float32)) is before


def test_what_cannot_be_filled_is_refused() -> None:
    light = np.ones((*SHAPE, 3), np.float32)
    with pytest.raises(ProbeError, match="but the panorama is"):
        fill(merged(light), np.zeros((10, 20), np.float32))
    with pytest.raises(ProbeError, match="twice as wide"):
        fill(merged(np.ones((20, 30, 3), np.float32)), np.ones((20, 30), np.float32))
    with pytest.raises(ProbeError, match="nothing left"):
        fill(merged(light), np.ones(SHAPE, np.float32))


def test_three_quarters_of_the_sphere_can_be_filled() -> None:
    light = np.ones((*SHAPE, 3), np.float32)
    mask = cap_mask(30.0, SHAPE)
    light[mask > 0.0] = 7.0
    np.testing.assert_allclose(fill(merged(light), mask).radiance, 1.0, rtol=1e-3)


def test_parts_that_touch_on_the_sphere_are_one() -> None:
    area = np.zeros((64, 128), bool)
    area[30:34, :3] = area[30:34, -3:] = True  # across the seam
    area[60:, 10:12] = area[60:, 70:72] = True  # at the nadir
    area[5:8, 40:44] = True
    parts = components(area)
    assert len(parts) == 3
    assert sum(int(part.sum()) for part in parts) == int(area.sum())
    assert any(part[31, 0] and part[31, -1] for part in parts)
    assert any(part[-1, 10] and part[-1, 70] for part in parts)
    sizes = [float(part.sum(axis=1) @ solid_angles((64, 128))) for part in parts]
    assert sizes == sorted(sizes, reverse=True)
