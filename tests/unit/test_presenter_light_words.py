"""The Light screen's map, and what it works out of a place and a lamp."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from app.core.environment.environment import from_radiance
from app.core.second_light.lamp_answers import LampPosition
from app.core.second_light.placements import ALTITUDES_DEG, AZIMUTHS_DEG
from app.core.solver.place_light import PlaceLight, main_light, prepare
from app.core.styles.lamps import far_lamp
from app.core.styles.style import StyleLamp
from app.ui.screens.light.placement.sky import sky_of
from app.ui.screens.light.two_steps import move_words, place_words

LEFT, RIGHT = "sitter’s left (camera right)", "sitter’s right (camera left)"


def peak_at(azimuth_deg: float, altitude_deg: float) -> Any:
    away = (AZIMUTHS_DEG - azimuth_deg + 180.0) % 360.0 - 180.0
    up = ALTITUDES_DEG - altitude_deg
    return 80.0 * np.exp(-(away[None, :] ** 2 + up[:, None] ** 2) / 1800.0)


@pytest.mark.parametrize(
    ("azimuth", "altitude"), [(90.0, 33.75), (-90.0, -33.75), (0.0, 0.0), (174.375, 16.875)]
)
def test_a_place_of_the_lamp_lies_where_the_map_says(azimuth: float, altitude: float) -> None:
    sky = sky_of(peak_at(azimuth, altitude), 45.0)
    assert sky.tones is not None
    rows, columns = sky.tones.shape
    row, column = np.unravel_index(int(sky.tones.argmax()), sky.tones.shape)
    assert (column + 0.5) / columns == pytest.approx((azimuth + 180.0) / 360.0, abs=0.005)
    half = sky.half_height_deg
    assert (row + 0.5) / rows == pytest.approx((half - altitude) / (2.0 * half), abs=0.015)


def test_the_line_runs_where_the_limit_is() -> None:
    sky = sky_of(peak_at(60.0, 0.0), 45.0)
    ends = sky.line.reshape(-1, 2)
    radius = np.sqrt(1800.0 * np.log(80.0 / 45.0))
    away = np.hypot(ends[:, 0] - 60.0, ends[:, 1])
    # Between placements 17° apart the curve is read by a cubic.
    assert np.abs(away - radius).max() < 2.5
    # Closed: each end is the end of two pieces.
    keys, counts = np.unique(np.round(ends, 3), axis=0, return_counts=True)
    assert len(keys) > 20
    assert (counts == 2).all()


def test_there_is_no_line_for_quality_nor_where_nothing_reaches_the_limit() -> None:
    assert len(sky_of(peak_at(60.0, 0.0), None).line) == 0
    assert len(sky_of(peak_at(60.0, 0.0), 90.0).line) == 0


def test_what_is_closed_lies_where_the_map_says() -> None:
    allowed = np.ones((9, 64), bool)
    allowed[0, 16] = False  # 67.5° down, 90° towards the sitter's left
    closed = sky_of(peak_at(0.0, 0.0), 45.0, allowed.ravel()).closed
    assert closed is not None
    rows, columns = np.nonzero(closed)
    assert set(rows.tolist()) == {len(closed) - 1}
    middle = (columns.mean() + 0.5) / closed.shape[1]
    assert middle == pytest.approx((90.0 + 180.0) / 360.0)


def lamp_place(panorama_deg: float) -> PlaceLight:
    lamp = far_lamp(StyleLamp(-panorama_deg, 20.0, 8.0, 1.0, 2.0), (64, 128))
    radiance = np.repeat(lamp[..., None], 3, axis=2).astype(np.float32)
    return prepare(from_radiance(radiance + 1e-6, "one lamp"))


@pytest.mark.parametrize("facing", [0.0, 70.0, -150.0])
@pytest.mark.parametrize("aside", [40.0, -90.0])
def test_the_places_own_light_comes_from_its_side(facing: float, aside: float) -> None:
    # A lamp at the sitter's left stands counter-clockwise of where they face.
    panorama = (facing - aside + 180.0) % 360.0 - 180.0
    found = main_light(lamp_place(panorama), facing)
    assert found == pytest.approx(aside, abs=1.5)
    side = "left side (camera right)" if aside > 0 else "right side (camera left)"
    assert f"sitter’s {side}" in place_words(found)


def test_even_light_has_no_side() -> None:
    light = prepare(from_radiance(np.ones((32, 64, 3), np.float32), "even"))
    assert main_light(light, 30.0) is None
    assert "all around" in place_words(None)


def test_moves_name_the_side_that_the_lamp_comes_to() -> None:
    assert LEFT in move_words(LampPosition(-20.0, 0.0), LampPosition(30.0, 0.0))
    assert RIGHT in move_words(LampPosition(20.0, 0.0), LampPosition(-30.0, 0.0))
    # Around the back it comes to the other side as well.
    assert RIGHT in move_words(LampPosition(170.0, 0.0), LampPosition(-160.0, 0.0))
    back = move_words(LampPosition(-60.0, 0.0), LampPosition(-90.0, 0.0))
    assert "30° towards the back" in back
