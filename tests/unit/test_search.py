"""Curves over all turns against the plain sums they stand for, and their mirror images."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from app.core.base.angles import TURNS
from app.core.solver.search import (
    build_tables,
    curves,
    curves_of,
    find_colours,
    quality_curves,
    seen_light,
)
from app.core.solver.transport import Transport, render
from app.core.solver.weights import target_weights
from app.core.styles.style_pack_build import build_basis
from tests.helpers.synthetic import (
    lambert_sphere_transport,
    lamp_environment,
    mirrored,
    one_texel,
    synthetic_pack,
)

Float = NDArray[np.float64]
MIRRORED = -np.arange(TURNS) % TURNS


def _rows(seed: int, count: int, shape: tuple[int, int]) -> Float:
    return np.random.default_rng(seed).standard_normal((count, *shape))


def _parts(rows: Float) -> tuple[Float, Float]:
    half = rows.shape[-1] // 2
    even, odd = 0.5 * (rows + rows[..., ::-1]), 0.5 * (rows - rows[..., ::-1])
    return even[..., :half], odd[..., :half]


def _turned(light: Float, turn: int) -> Float:
    return np.roll(light, -turn * light.shape[1] // TURNS, axis=1)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([(32, 64), (64, 128), (8, 64)]))
def test_curves_are_the_plain_sums(seed: int, shape: tuple[int, int]) -> None:
    targets, basis = _rows(seed, 4, shape), _rows(seed + 1, 6, shape)
    mean = np.abs(_rows(seed + 2, 1, shape)[0])
    light = np.abs(_rows(seed + 3, 1, shape)[0])
    even, odd = _parts(basis)
    found = curves(build_tables(targets, mean, even, odd, paired=True), light)
    for turn in range(TURNS):
        turned = _turned(light, turn)
        expected = (targets * turned).sum(axis=(1, 2))
        np.testing.assert_allclose(found.quality[:, turn], expected, atol=1e-9)
        assert found.mean[turn] == pytest.approx((mean * turned).sum(), abs=1e-9)
        contrast = np.linalg.norm((basis * turned).sum(axis=(1, 2)))
        assert found.contrast[turn] == pytest.approx(contrast, rel=1e-9, abs=1e-6)


@pytest.mark.parametrize("paired", [False, True])
def test_many_lights_at_once_are_as_each_by_itself(paired: bool) -> None:
    shape = (16, 32)
    rows, lights = _rows(3, 4, shape), np.abs(_rows(4, 5, shape))
    even, odd = _parts(rows)
    tables = build_tables(rows, rows[0], even, odd, paired=paired, others=rows[2:])
    found = curves_of(tables, lights)
    for k, light in enumerate(lights):
        alone = curves(tables, light)
        for name in ("quality", "mean", "contrast", "others"):
            one, other = getattr(found, name)[k], getattr(alone, name)
            assert one.shape == other.shape
            np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * np.abs(other).max())


def test_rows_of_pure_parity_need_no_partner() -> None:
    shape = (32, 64)
    even, odd = _parts(_rows(5, 6, shape))
    even, odd = even[:4], odd[:2]
    full = np.concatenate(
        [
            np.concatenate([even, even[..., ::-1]], axis=2),
            np.concatenate([odd, -odd[..., ::-1]], axis=2),
        ]
    )
    light = np.abs(_rows(6, 1, shape)[0])
    found = curves(build_tables(_rows(7, 1, shape), np.ones(shape), even, odd), light)
    for turn in range(TURNS):
        contrast = np.linalg.norm((full * _turned(light, turn)).sum(axis=(1, 2)))
        assert found.contrast[turn] == pytest.approx(contrast, rel=1e-9)


def test_half_the_columns_still_give_64_turns() -> None:
    """A coarser environment: whole-texel turns are exact, those between are interpolated."""
    shape = (16, 32)
    targets, light = _rows(8, 3, shape), np.abs(_rows(9, 1, shape)[0])
    found = quality_curves(build_tables(targets, np.ones(shape), *_parts(targets)), light)
    assert found.shape == (3, TURNS)
    for turn in range(0, TURNS, 2):
        expected = (targets * np.roll(light, -turn // 2, axis=1)).sum(axis=(1, 2))
        np.testing.assert_allclose(found[:, turn], expected, atol=1e-9)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_mirrored_panorama_gives_the_mirrored_curves_bit_by_bit(seed: int) -> None:
    shape = (32, 64)
    targets, basis = _rows(seed, 5, shape), _rows(seed + 1, 7, shape)
    even, odd = _parts(basis)
    mean = np.abs(_rows(seed + 2, 1, shape)[0])
    mean = mean + mean[:, ::-1]
    light = np.exp(_rows(seed + 3, 1, shape)[0])
    here = curves(build_tables(targets, mean, even, odd), light)
    flipped = build_tables(targets[..., ::-1], mean, even, odd)
    there = curves(flipped, mirrored(light))
    np.testing.assert_array_equal(there.quality[:, MIRRORED], here.quality)
    np.testing.assert_array_equal(there.mean[MIRRORED], here.mean)
    np.testing.assert_array_equal(there.contrast[MIRRORED], here.contrast)


def test_an_environment_of_another_size_is_an_error() -> None:
    with pytest.raises(ValueError, match="does not fit"):
        quality_curves(synthetic_pack().tables, np.ones((16, 32)))


def _exact(transport: Transport, region: Float, light: Float) -> tuple[Float, Float, Float]:
    """Picture per turn, from the transport itself: (P, 64); mean and contrast over the region."""
    pictures = np.stack(
        [render(transport, _turned(light, turn)) for turn in range(TURNS)], axis=1
    ).astype(np.float64)
    mean = region @ pictures / region.sum()
    return pictures, mean, np.sqrt(region @ (pictures - mean) ** 2)


SCENES = {
    "one texel": one_texel(9, 40),
    "a lamp": lamp_environment(20.0, 40.0),
    "a lamp and fill": lamp_environment(-70.0, 10.0, fill=0.2),
    "two lamps": lamp_environment(80.0, 0.0) + lamp_environment(-95.0, 20.0),
    "noise": np.exp(np.random.default_rng(3).standard_normal((32, 64))),
}


@pytest.mark.parametrize("scene", SCENES)
def test_eq_4_equals_eq_2(scene: str) -> None:
    """Quality from pre-integrated targets against weights times the rendered picture."""
    transport, pack = lambert_sphere_transport(), synthetic_pack()
    light = SCENES[scene]
    found = curves(pack.tables, pack.project(light))
    region = pack.region_on(transport)
    pictures, mean, _ = _exact(transport, region, light)
    for row, style in enumerate(pack.styles):
        target = pack.target(style.name).reshape(-1, 3)[transport.pixels]
        f = target_weights(target @ np.array([0.2126, 0.7152, 0.0722]), transport.face)
        expected = f @ pictures
        # Targets are stored as halves, hence the wider tolerance of this reconstruction.
        np.testing.assert_allclose(found.quality[row], expected, atol=2e-3 * np.abs(expected).max())
    np.testing.assert_allclose(found.mean, mean, rtol=1e-3)


@pytest.mark.parametrize("scene", SCENES)
def test_the_search_basis_holds_the_contrast(scene: str) -> None:
    transport, pack = lambert_sphere_transport(), synthetic_pack()
    found = curves(pack.tables, pack.project(SCENES[scene]))
    _, _, contrast = _exact(transport, pack.region_on(transport), SCENES[scene])
    # Match is at most 100, so half a percent of contrast is half a point of match.
    np.testing.assert_allclose(found.contrast, contrast, rtol=5e-3)
    assert (found.contrast <= contrast * (1 + 1e-4)).all()


def test_a_head_without_symmetry_has_a_paired_basis() -> None:
    whole = lambert_sphere_transport.__wrapped__(24, (32, 64), 80)
    tilted = Transport(
        header=whole.header,
        pixels=whole.pixels,
        coverage=whole.coverage,
        pixel_basis=whole.pixel_basis,
        texel_basis=np.roll(whole.texel_basis.reshape(-1, 32, 64), 3, axis=2).reshape(
            whole.texel_basis.shape
        ),
    )
    weights = target_weights(np.arange(len(whole.pixels), dtype=float), whole.face)[None]
    colours, region = find_colours(tilted), whole.face.astype(float)
    basis = build_basis(tilted, colours, weights, region)
    assert basis.paired
    assert not build_basis(whole, find_colours(whole), weights, region).paired
    light = SCENES["two lamps"]
    none = np.zeros((1, colours.rows, 64))
    tables = build_tables(none, none[0], basis.even, basis.odd, paired=True)
    _, _, contrast = _exact(tilted, region, light)
    seen = seen_light(light, colours.mixing, colours.mixtures)
    np.testing.assert_allclose(curves(tables, seen).contrast, contrast, rtol=5e-3)
