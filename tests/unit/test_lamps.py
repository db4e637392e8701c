"""Far lamps as environments."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.solver.lamps import far_lamp
from app.core.solver.styles import StyleLamp
from tests.helpers.synthetic import lamp_environment, solid_angles


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
