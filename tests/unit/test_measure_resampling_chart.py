"""Charts of the sphere: where directions land, and back."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from app.core.base.sphere import direction, directions
from app.core.measure.read.resampling import Chart, Kind, azimuth_elevation, wrapped_blur

CENTRES = [(0.0, -90.0), (35.0, -90.0), (0.0, 90.0), (180.0, 0.0), (-120.0, 40.0), (10.0, -50.0)]


@pytest.mark.parametrize("kind", ["stereographic", "equidistant"])
@pytest.mark.parametrize("centre", CENTRES)
def test_a_chart_sees_the_direction_that_it_places(centre: tuple[float, float], kind: Kind) -> None:
    chart = Chart(centre, 60.0, 121, kind)
    shape = (180, 360)
    # Three smooth pictures that hold the direction itself: what a pixel sees is where it looks.
    seen = chart.sample(directions(shape))
    column, row = chart.place(shape, slice(0, shape[0]))
    inside = (np.abs(column - 60.0) < 58.0) & (np.abs(row - 60.0) < 58.0)
    assert inside.mean() > 0.1
    back = cv2.remap(seen, column, row, cv2.INTER_LINEAR)[inside]
    apart = np.linalg.norm(back - directions(shape)[inside], axis=-1)
    # A pixel is a degree wide; between the last row and a pole nothing is interpolated.
    beside_pole = np.abs(directions(shape)[inside][:, 1]) > np.sin(np.radians(88.0))
    assert np.degrees(apart[~beside_pole]).max() < 0.1
    assert np.degrees(apart).max() < 0.7


@pytest.mark.parametrize("centre", CENTRES)
def test_distances_are_angles_from_the_middle(centre: tuple[float, float]) -> None:
    for kind in ("stereographic", "equidistant"):
        chart = Chart(centre, 70.0, 81, kind)
        seen = chart.sample(directions((720, 1440)))
        truth = np.degrees(np.arccos(np.clip(seen @ direction(*centre), -1.0, 1.0)))
        assert np.abs(chart.distances() - truth)[chart.distances() > 2.0].max() < 0.3


def test_a_stereographic_chart_keeps_circles() -> None:
    chart = Chart((30.0, 10.0), 80.0, 201)
    about = direction(70.0, 30.0)
    column, row = chart.place((180, 360), slice(0, 180))
    ring = np.abs(np.degrees(np.arccos(directions((180, 360)) @ about)) - 20.0) < 0.25
    assert ring.sum() > 50
    points = np.stack([column[ring], row[ring]], axis=1).astype(float)
    fit = np.linalg.lstsq(
        np.column_stack([points, np.ones(len(points))]), (points**2).sum(axis=1), rcond=None
    )[0]
    centre = fit[:2] / 2.0
    radii = np.hypot(*(points - centre).T)
    assert radii.std() < 0.02 * radii.mean()


def test_what_is_to_the_right_and_up_in_the_panorama_is_so_on_the_chart() -> None:
    chart = Chart((20.0, 0.0), 30.0, 61)
    column, row = chart.place((90, 180), slice(0, 90))
    # Texel of azimuth 31, elevation 11.
    assert column[39, 105] > 30.0
    assert row[39, 105] < 30.0


@pytest.mark.parametrize("angles", [(0.0, 0.0), (90.0, 20.0), (-135.0, -60.0), (170.0, 85.0)])
def test_angles_come_back_from_a_vector(angles: tuple[float, float]) -> None:
    assert azimuth_elevation(3.0 * direction(*angles)) == pytest.approx(angles)


def test_blur_runs_across_the_seam_and_keeps_the_sum() -> None:
    picture = np.zeros((32, 64), np.float32)
    picture[16, 0] = 1.0
    soft = wrapped_blur(picture, 2.0)
    assert soft.sum() == pytest.approx(1.0, rel=1e-3)
    assert soft[16, -1] == pytest.approx(soft[16, 1], rel=1e-5)
