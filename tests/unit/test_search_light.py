"""Light in colours is searched as exactly as its pictures are rendered."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from app.core.base.angles import TURNS
from app.core.base.colour import luminance
from app.core.base.paths import resources
from app.core.environment.environment import read_environment, reduce
from app.core.solver.relighting_cache import light_table, painted_curves
from app.core.solver.search import curves, find_colours, luminance_of, seen_light
from app.core.solver.solve import measure, solve_all
from app.core.solver.transport import Transport, render
from app.core.solver.weights import painted, target_weights
from app.core.styles.style_pack_file import load_named_pack, load_transport_of
from benchmarks.truth.stock import rotate
from tests.helpers.synthetic import lambert_sphere_transport, synthetic_pack

SCENES = sorted((resources() / "demo" / "scenes").glob("*.exr"))


@cache
def _generic() -> Transport:
    return load_transport_of(load_named_pack("generic"), "generic")


def _two_colours() -> np.ndarray:
    """A blue half of the sky against a red one, and a lamp of its own colour."""
    rng = np.random.default_rng(4)
    light = np.where(np.arange(64)[:, None] < 32, [1.0, 0.4, 0.1], [0.1, 0.4, 1.0])
    light = light * np.exp(0.5 * rng.standard_normal((32, 64, 1)))
    light[8:10, 40:42] += [30.0, 22.0, 9.0]
    return np.asarray(light)


def _heads(transport: Transport, light: np.ndarray) -> np.ndarray:
    """(64, P) luminance of the head from pictures in colour, one turn after the other."""
    pictures = [render(transport, rotate(light.astype(np.float32), k)) for k in range(TURNS)]
    return np.stack([luminance(each) for each in pictures]).astype(np.float64)


def _correlation(one: np.ndarray, other: np.ndarray, weights: np.ndarray) -> float:
    """Pearson's, weighted."""
    table = np.cov(one, other, aweights=weights)
    return float(table[0, 1] / np.sqrt(table[0, 0] * table[1, 1]))


@pytest.mark.parametrize("scene", SCENES, ids=lambda path: path.stem)
def test_match_and_quality_are_those_of_pictures_in_colour(scene: Path) -> None:
    pack, transport = load_named_pack("generic"), _generic()
    light = reduce(read_environment(scene)).astype(np.float64)
    found = curves(pack.tables, pack.project(light))
    match = measure(pack, found).match
    heads, region = _heads(transport, light), pack.region_on(transport)
    for row, style in enumerate(pack.styles):
        target = luminance(pack.target(style.name)).ravel()[transport.pixels]
        exact = heads @ target_weights(target, transport.face)
        assert np.abs(found.quality[row] - exact).max() <= 0.01 * np.ptp(exact), style.name
        expected = [100 * _correlation(head, target, region) for head in heads]
        if not style.signature.areas:  # whose match is that of areas
            np.testing.assert_allclose(match[row], expected, atol=0.25, err_msg=style.name)
        # The turn taken is as good as any, judged by the pictures in colour.
        assert exact.max() - exact[found.quality[row].argmax()] <= 1e-3 * np.ptp(exact)


def test_luminance_alone_would_be_wrong() -> None:
    """What this is for: light of two colours, counted as grey, gives another match."""
    pack = load_named_pack("generic")
    light = _two_colours()
    match = measure(pack, curves(pack.tables, pack.project(light))).match
    grey = measure(pack, curves(pack.tables, pack.project(luminance(light)))).match
    assert np.abs(match - grey).max() > 5.0


def test_grey_light_is_its_luminance() -> None:
    pack = load_named_pack("generic")
    light = np.exp(np.random.default_rng(1).standard_normal((32, 64)))
    coloured = pack.project(np.repeat(light[..., None], 3, axis=2))
    np.testing.assert_allclose(coloured[:32], light, rtol=1e-12)
    np.testing.assert_allclose(coloured[32:], 0.0, atol=1e-12 * light.sum())
    np.testing.assert_array_equal(pack.project(light)[32:], 0.0)
    np.testing.assert_array_equal(luminance_of(light), light)


def test_parts_hold_the_picture_in_colour() -> None:
    transport = _generic()
    colours = find_colours(transport)
    assert colours.mixing.sum(axis=1) == pytest.approx([1.0, 0.0], abs=1e-12)
    light = _two_colours()
    seen = seen_light(light, colours.mixing, colours.mixtures)
    weights = transport.face / np.count_nonzero(transport.face)
    exact = float(luminance(render(transport, light.astype(np.float32))) @ weights)
    assert float((colours.integrate(weights) * seen).sum()) == pytest.approx(exact, rel=2e-3)


def test_a_mirrored_place_is_seen_mirrored() -> None:
    pack, light = load_named_pack("generic"), _two_colours()
    np.testing.assert_array_equal(pack.project(light[:, ::-1]), pack.project(light)[:, ::-1])


def test_a_head_of_one_colour_has_no_second_part() -> None:
    transport = lambert_sphere_transport()
    grey = Transport(
        header=transport.header,
        pixels=transport.pixels,
        coverage=transport.coverage,
        pixel_basis=np.repeat(transport.pixel_basis[:1], 3, axis=0),
        texel_basis=transport.texel_basis,
    )
    colours = find_colours(grey)
    assert np.isfinite(colours.mixing).all()
    assert np.abs(colours.bases[1]).max() < 1e-5 * np.abs(colours.bases[0]).max()
    weights = transport.face / np.count_nonzero(transport.face)
    assert np.abs(colours.integrate(weights)[32:]).max() < 1e-5


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_exposure_changes_nothing_but_quality(scale: float) -> None:
    pack, light = synthetic_pack(), _two_colours()
    for one, two in zip(solve_all(pack, light), solve_all(pack, scale * light), strict=True):
        assert two.turn_refined_deg == pytest.approx(one.turn_refined_deg, abs=1e-9)
        np.testing.assert_allclose(two.match_curve, one.match_curve, atol=1e-6)
        np.testing.assert_allclose(two.quality_curve, scale * one.quality_curve, rtol=1e-6)


def test_painted_weights_are_searched_in_colour_too() -> None:
    transport, light = _generic(), _two_colours()
    values = np.random.default_rng(3).uniform(-1, 1, len(transport.pixels))
    weights = painted(transport, values)
    found = painted_curves(light_table(transport, light), weights)
    faces = _heads(transport, light / luminance_of(light).mean())[:, transport.face]
    np.testing.assert_allclose(
        found.quality, faces @ weights.weights[transport.face], atol=1e-4 * found.contrast.max()
    )
    np.testing.assert_allclose(found.mean, faces.mean(axis=1), rtol=1e-4)
