"""Far lamps as environments, and the measure of single lamps."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.solver.lamps import LampMaps, far_lamp, split_lamps
from app.core.solver.search import MIXTURES, find_colours
from app.core.solver.styles import Style, StyleLamp, load_styles
from app.core.solver.transport import Transport, render
from app.core.solver.weights import target_weights
from tests.helpers.synthetic import (
    lambert_sphere_transport,
    lamp_environment,
    solid_angles,
    style_target,
)

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("azimuth", [0.0, 35.0, -135.0, 180.0])
@pytest.mark.parametrize("elevation", [-45.0, 5.0, 80.0])
def test_a_far_lamp_has_its_power_and_place(azimuth: float, elevation: float) -> None:
    light = far_lamp(StyleLamp(azimuth, elevation, 12.0, 0.7, 2.0), (32, 64))
    area = solid_angles(32, 64)[:, None]
    assert (light * area).sum() == pytest.approx(0.7)
    expected = 0.7 * lamp_environment(-azimuth, elevation, 12.0)
    assert np.abs((light - expected) * area).sum() < 0.05


def test_a_tiny_lamp_still_covers_texels() -> None:
    assert far_lamp(StyleLamp(0.0, 0.0, 0.01, 1.0, 2.0), (16, 32)).sum() > 0


def _targets(styles: tuple[Style, ...]) -> tuple[np.ndarray, np.ndarray]:
    transport = lambert_sphere_transport()
    luminance = np.stack([style_target(transport, s) @ LUMINANCE for s in styles]).astype(float)
    return luminance, np.stack([target_weights(p, transport.face) for p in luminance])


def _split(
    transport: Transport, styles: tuple[Style, ...], luminance: np.ndarray, weights: np.ndarray
) -> LampMaps:
    return split_lamps(transport, find_colours(transport), styles, luminance, weights)


def test_only_styles_with_several_main_lamps_are_measured() -> None:
    styles = load_styles()
    lamps = _split(lambert_sphere_transport(), styles, *_targets(styles))
    measured = {styles[row].name for row in lamps.style}
    assert measured == {"badger", "left-loop-rim", "right-loop-rim"}
    assert len(lamps.maps) == 6
    assert (lamps.ratio > 0).all()


def test_maps_measure_their_own_lamp_and_no_other() -> None:
    transport = lambert_sphere_transport()
    badger = tuple(style for style in load_styles() if style.name == "badger")
    lamps = _split(transport, badger, *_targets(badger))
    for here, lamp in enumerate(badger[0].lamps):
        light = far_lamp(lamp, (32, 64))
        values = (lamps.maps[:, :32] * light).sum(axis=(1, 2))
        mean = render(transport, light)[transport.face].mean()
        assert values[here] / mean > 1.5 * lamps.ratio[here]
        assert values[1 - here] <= 0


def test_maps_see_nothing_in_even_light() -> None:
    badger = tuple(style for style in load_styles() if style.name == "badger")
    lamps = _split(lambert_sphere_transport(), badger, *_targets(badger))
    values = lamps.maps[:, :32].sum(axis=(1, 2))
    assert np.abs(values / lamps.ratio).max() < 0.2


def test_a_target_without_its_lamps_is_not_measured() -> None:
    transport = lambert_sphere_transport()
    lamp = StyleLamp(90.0, 0.0, 10.0, 1.0, 2.0)
    odd = Style("odd", "Odd", "none", "", "", (lamp, StyleLamp(-90.0, 0.0, 10.0, 1.0, 2.0)))
    # Bright where neither lamp reaches, dark where they do.
    light = np.add(*(far_lamp(x, (32, 64)) for x in odd.lamps))
    inside_out = 1.0 - render(transport, light)[None].astype(np.float64)
    weights = np.stack([target_weights(p, transport.face) for p in inside_out])
    lamps = _split(transport, (odd,), -inside_out + 2, weights)
    assert len(lamps.maps) == 0
    assert lamps.maps.shape[1:] == (32 + MIXTURES, 64)
