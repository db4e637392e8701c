"""Headings and turns: against positions on a floor, in both modes and for both cameras."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.base import sphere
from app.core.base.angles import difference
from app.core.guidance.who_moves import Mode
from app.core.localization.heading_conversion import (
    Looks,
    background_azimuth,
    heading_of_turn,
    offset_angle,
    turn_of_heading,
    widened_fov,
)

ANGLE = st.floats(-180.0, 180.0)


def azimuth(vector: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
    return math.degrees(math.atan2(-vector[0], vector[2]))


@given(ANGLE, ANGLE, st.floats(-30.0, 30.0), st.sampled_from(Looks), st.sampled_from(Mode))
def test_there_and_back(turn: float, front: float, sitter: float, looks: Looks, mode: Mode) -> None:
    heading = heading_of_turn(turn, looks=looks, mode=mode, sitter_deg=sitter, front_deg=front)
    again = turn_of_heading(heading, looks=looks, mode=mode, sitter_deg=sitter, front_deg=front)
    assert abs(difference(again, turn)) < 1e-9


@pytest.mark.parametrize("turn", [-170.0, -45.0, 0.0, 30.0, 90.0, 180.0])
@pytest.mark.parametrize("aside", [-20.0, 0.0, 12.0])
def test_a_camera_that_looks_at_the_sitter(turn: float, aside: float) -> None:
    """The camera stands where the sitter faces, and points `aside` to the right of the sitter."""
    camera = 1.5 * sphere.direction(turn, 0.0)
    to_sitter = azimuth(-camera)
    heading = to_sitter + aside
    found = turn_of_heading(heading, sitter_deg=-aside)
    assert difference(found, turn) == pytest.approx(0.0, abs=1e-9)
    # What is behind the sitter on that line has the same azimuth from the probe.
    behind = 4.0 * (-camera) / 1.5
    assert difference(background_azimuth(turn), azimuth(behind)) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("turn", [-170.0, -45.0, 0.0, 90.0])
def test_a_laptop_that_looks_at_who_holds_it(turn: float) -> None:
    """Walking, it points from the sitter to the photographer; in a selfie, at the sitter."""
    photographer = sphere.direction(turn, 0.0)
    outward, inward = azimuth(photographer), azimuth(-photographer)
    looks = Looks.PHOTOGRAPHER
    walking = turn_of_heading(outward, looks=looks, mode=Mode.WALK)
    selfie = turn_of_heading(inward, looks=looks, mode=Mode.SELFIE)
    assert difference(walking, turn) == pytest.approx(0.0, abs=1e-9)
    assert difference(selfie, turn) == pytest.approx(0.0, abs=1e-9)


def test_the_marker_moves_every_turn() -> None:
    assert turn_of_heading(-90.0, front_deg=30.0) == pytest.approx(60.0)
    assert background_azimuth(60.0, 30.0) == pytest.approx(-90.0)
    assert heading_of_turn(60.0, front_deg=30.0) == pytest.approx(-90.0)


def test_around_the_seam() -> None:
    assert turn_of_heading(0.0) == 180.0
    assert turn_of_heading(1.0) == -179.0
    assert turn_of_heading(-1.0) == 179.0


@pytest.mark.parametrize("distance", [0.6, 1.5, 2.5])
@pytest.mark.parametrize("depth", [2.0, 5.0, 12.0])
def test_the_crop_is_wider_from_the_probe(distance: float, depth: float) -> None:
    """A point at the edge of the picture, seen from both places."""
    edge = math.tan(math.radians(30.0)) * (depth + distance)
    half = math.degrees(math.atan2(edge, depth))
    assert widened_fov(60.0, distance, depth) == pytest.approx(2 * half)
    assert widened_fov(60.0, distance, depth) > 60.0


def test_a_camera_that_looks_away_sees_less_and_far_things_do_not_change() -> None:
    edge = math.tan(math.radians(30.0)) * (5.0 - 1.5)
    half = math.degrees(math.atan2(edge, 5.0))
    assert widened_fov(60.0, 1.5, 5.0, sees_the_sitter=False) == pytest.approx(2 * half)
    assert widened_fov(60.0, 1.5, math.inf) == 60.0
    assert widened_fov(90.0, 5.0, 0.1) == 160.0


def test_columns_and_angles() -> None:
    assert offset_angle(320.0, 640, 60.0) == 0.0
    assert offset_angle(640.0, 640, 60.0) == pytest.approx(30.0)
    assert offset_angle(0.0, 640, 60.0) == pytest.approx(-30.0)
    assert offset_angle(480.0, 640, 60.0) == pytest.approx(16.1, abs=0.01)
