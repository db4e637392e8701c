"""The brush for masks: round on the sphere, everywhere alike."""

from __future__ import annotations

import math

import numpy as np
import pytest

from app.core.environment.environment import energy
from app.core.second_light.captured_lamps.mask_brush import stroke

SHAPE = (256, 512)


def cap_sr(radius_deg: float) -> float:
    return 2.0 * math.pi * (1.0 - math.cos(math.radians(radius_deg)))


@pytest.mark.parametrize("at", [(0.0, 0.0), (179.9, 10.0), (40.0, 60.0), (-90.0, -85.0)])
def test_a_dab_covers_its_cap_wherever_it_lies(at: tuple[float, float]) -> None:
    alpha = stroke(np.zeros(SHAPE, np.float32), (at,), 6.0, True)
    assert float(energy(alpha)) == pytest.approx(cap_sr(6.0), rel=0.03)
    assert alpha.min() >= 0.0
    assert alpha.max() == 1.0


def test_what_is_set_can_be_cleared_and_nothing_else_changes() -> None:
    lamp = stroke(np.zeros(SHAPE, np.float32), ((-60.0, 0.0),), 8.0, True)
    more = stroke(lamp, ((60.0, 0.0),), 5.0, True)
    assert np.array_equal(more[:, :200], lamp[:, :200])
    again = stroke(more, ((60.0, 0.0),), 7.0, False)
    assert np.array_equal(again, lamp)
    assert float(lamp[:, 256:].sum()) == 0.0, "the first is as it was"


def test_a_stroke_leaves_no_gaps_and_goes_the_short_way_around() -> None:
    alpha = stroke(np.zeros(SHAPE, np.float32), ((170.0, 0.0), (-170.0, 0.0)), 2.0, True)
    row = alpha[SHAPE[0] // 2]
    lit = np.flatnonzero(row > 0.99)
    assert len(lit) >= round((20.0 + 3.0) * 512 / 360)
    assert not row[100:400].any()


def test_the_smallest_brush_still_takes_a_texel() -> None:
    alpha = stroke(np.zeros(SHAPE, np.float32), ((0.35, 0.35),), 0.0, True)
    assert alpha.max() > 0.9
