"""Camera curves: increasing, undone exactly, and as published where they are."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.base.colour import srgb_encode
from benchmarks.light.camera_curves import CURVES, GAMMA_18, LOG, REC_709, SRGB, Curve, curve_named

EVERY = pytest.mark.parametrize("curve", CURVES, ids=[curve.name for curve in CURVES])


@EVERY
def test_strictly_increasing_from_black_to_white(curve: Curve) -> None:
    light = np.concatenate([np.logspace(-9, -3, 500), np.linspace(0.001, 1.0, 20001)[1:]])
    coded = curve.encode(light)
    assert (np.diff(coded) > 0.0).all()
    np.testing.assert_allclose(curve.encode([0.0, 1.0]), [0.0, 1.0], atol=1e-12)
    np.testing.assert_array_equal(curve.encode([-1.0, 7.0]), curve.encode([0.0, 1.0]))


@EVERY
def test_decode_undoes_encode(curve: Curve) -> None:
    light = np.concatenate([[0.0], np.logspace(-6, 0, 2000)])
    np.testing.assert_allclose(curve.decode(curve.encode(light)), light, rtol=1e-8, atol=1e-12)


@EVERY
def test_response_is_the_light_of_each_byte(curve: Curve) -> None:
    response = curve.response()
    assert response.shape == (256,)
    assert response[0] == 0.0
    assert response[-1] == 1.0
    assert (np.diff(response) > 0.0).all()
    np.testing.assert_allclose(255.0 * curve.encode(response), np.arange(256), atol=1e-6)


@EVERY
def test_table_rounds_to_the_nearest_byte(curve: Curve) -> None:
    table = curve.table()
    light = np.random.default_rng(4).random(5000) ** 3
    steps = np.rint(np.sqrt(light) * (table.size - 1)).astype(int)
    error = table[steps] - 255.0 * curve.encode(light)
    assert np.abs(error).max() <= 0.54
    assert (np.diff(table.astype(int)) >= 0).all()
    assert set(np.unique(table)) == set(range(256))


def test_srgb_is_the_programs_own() -> None:
    light = np.linspace(0.0, 1.0, 4001)
    np.testing.assert_allclose(SRGB.encode(light), srgb_encode(light), atol=2e-7)


def test_published_values() -> None:
    # IEC 61966-2-1: middle grey; ITU-R BT.709: 1.099 L^0.45 - 0.099 and 4.5 L.
    assert float(SRGB.encode(0.2140411)) == pytest.approx(0.5, abs=1e-6)
    assert float(REC_709.encode(0.18)) == pytest.approx(1.099 * 0.18**0.45 - 0.099, abs=2e-4)
    assert float(REC_709.encode(0.01)) == pytest.approx(0.045, abs=1e-12)
    assert float(GAMMA_18.encode(0.25)) == pytest.approx(0.4629373, abs=1e-6)
    assert float(LOG.encode(0.1)) == pytest.approx(np.log(21.0) / np.log(201.0))


def test_the_others_are_not_srgb() -> None:
    """A step of two stops, read as sRGB, comes out wrong by at least 5 % somewhere."""
    for curve in CURVES[1:]:
        light = np.logspace(-2.5, -0.7, 50)
        ratio = SRGB.decode(curve.encode(4.0 * light)) / SRGB.decode(curve.encode(light))
        assert np.abs(ratio / 4.0 - 1.0).max() > 0.05, curve.name


def test_named() -> None:
    assert curve_named("gamma-1.8") is GAMMA_18
    with pytest.raises(ValueError, match="known: srgb"):
        curve_named("vivid")
