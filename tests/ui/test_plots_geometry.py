"""Angles to pixels and back, without Qt: signs, wrapping, and labels that make way."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.base.angles import arc_width, at_turn, difference
from app.ui.plots.parts.geometry import (
    Dial,
    arrow_shape,
    head_outline,
    hit,
    sector,
    smooth,
    spread,
    turn_at,
    value_at,
)
from app.ui.plots.parts.mapping import StripScale, Viewport, label_step

ANGLES = st.floats(-720.0, 720.0, allow_nan=False)


class TestCircle:
    @pytest.mark.parametrize(
        ("turn", "place"),
        [(0, (50, 40)), (90, (60, 50)), (-90, (40, 50)), (180, (50, 60)), (-180, (50, 60))],
    )
    def test_zero_is_up_and_clockwise_is_to_the_right(
        self, turn: float, place: tuple[float, float]
    ) -> None:
        assert at_turn((50.0, 50.0), 10.0, turn) == pytest.approx(place)

    @given(ANGLES)
    def test_point_to_turn_undoes_turn_to_point(self, turn: float) -> None:
        back = turn_at((3.0, -7.0), at_turn((3.0, -7.0), 40.0, turn))
        assert abs(difference(back, turn)) < 1e-9
        assert -180.0 < back <= 180.0

    def test_an_arc_that_wraps_goes_the_clockwise_way(self) -> None:
        assert arc_width((170.0, -170.0)) == 20.0
        assert arc_width((-170.0, 170.0)) == 340.0
        assert arc_width((-180.0, 180.0)) == 360.0

    def test_a_wrapping_sector_stays_at_its_side(self) -> None:
        points = sector((0.0, 0.0), 10.0, (170.0, -170.0))
        assert points[0] == (0.0, 0.0)
        assert all(y > 9.8 for _, y in points[1:])
        assert points[1][0] > 0.0 > points[-1][0]

    def test_the_whole_circle_has_no_spoke(self) -> None:
        points = sector((0.0, 0.0), 10.0, (-180.0, 180.0))
        assert all(math.hypot(*point) == pytest.approx(10.0) for point in points)

    def test_a_curve_is_read_at_its_own_turns(self) -> None:
        curve = [float(k) for k in range(64)]
        assert value_at(curve, 90.0) == 16.0
        assert value_at(curve, -90.0) == 48.0
        assert value_at(curve, 5.625 * 1.25) == pytest.approx(1.25)
        assert value_at(curve, -5.625 / 2) == pytest.approx(31.5)  # between 63 and 0

    def test_a_dial_holds_what_leaves_its_scale(self) -> None:
        dial = Dial((0.0, 0.0), 26.0, 94.0)
        assert dial.radius(-40.0) == 26.0
        assert dial.radius(45.0) == pytest.approx(26.0 + 68.0 * 0.45)
        assert dial.radius(130.0) == 94.0
        assert dial.outline([100.0, 0.0, 0.0, 0.0])[0] == pytest.approx((0.0, -94.0))
        assert dial.outline([0.0, 100.0, 0.0, 0.0])[1] == pytest.approx((94.0, 0.0))

    def test_a_smooth_curve_goes_through_its_points_and_stays_round(self) -> None:
        points = [at_turn((0.0, 0.0), 10.0, turn) for turn in range(0, 360, 30)]
        pieces = smooth(points).tolist()
        assert [tuple(piece[2]) for piece in pieces] == [*points[1:], points[0]]
        for start, (first, second, stop) in zip(points, pieces, strict=True):
            middle = [
                (a + 3 * b + 3 * c + d) / 8
                for a, b, c, d in zip(start, first, second, stop, strict=True)
            ]
            assert math.hypot(*middle) == pytest.approx(10.0, abs=0.05)


class TestShapes:
    def test_the_nose_points_along_the_turn(self) -> None:
        nose = head_outline((0.0, 0.0), 10.0, 90.0)[0]
        assert nose == pytest.approx((11.6, 0.0))

    def test_the_head_is_symmetric(self) -> None:
        outline = head_outline((0.0, 0.0), 10.0, 0.0)
        mirrored = {(round(-x, 9), round(y, 9)) for x, y in outline}
        assert mirrored == {(round(x, 9) + 0.0, round(y, 9)) for x, y in outline}

    @pytest.mark.parametrize("size", [(320.0, 104.0), (200.0, 104.0), (480.0, 300.0)])
    def test_arrows_are_mirrored_and_stay_in_their_box(self, size: tuple[float, float]) -> None:
        right = arrow_shape(*size, clockwise=True)
        left = arrow_shape(*size, clockwise=False)
        for a, b in zip(right.head, left.head, strict=True):
            assert (size[0] - a[0], a[1]) == pytest.approx(b)
        assert right.head[1][0] > size[0] / 2 > left.head[1][0]
        tail = at_turn(right.centre, right.outer, right.start_deg)
        for x, y in (*right.head, tail, (right.centre[0], right.centre[1] - right.outer)):
            assert 0.0 <= x <= size[0]
            assert 0.0 <= y <= size[1]

    def test_the_nearest_target_within_reach_is_hit(self) -> None:
        places = [(0.0, 0.0), (10.0, 0.0)]
        assert hit(places, (6.0, 0.0), 5.0) == 1
        assert hit(places, (20.0, 0.0), 5.0) is None
        assert hit([], (0.0, 0.0), 5.0) is None

    def test_labels_move_apart_and_stay_inside(self) -> None:
        assert spread([50.0, 200.0], [40.0, 40.0], 10.0, 0.0, 300.0) == [50.0, 200.0]
        assert spread([100.0, 110.0], [40.0, 40.0], 10.0, 0.0, 300.0) == [80.0, 130.0]
        assert spread([110.0, 100.0], [40.0, 40.0], 10.0, 0.0, 300.0) == [130.0, 80.0]
        first, second = spread([295.0, 290.0], [40.0, 40.0], 10.0, 0.0, 300.0)
        assert first == 280.0
        assert second == 230.0


class TestViewport:
    @given(ANGLES, st.floats(1.0, 8.0), st.floats(0.0, 864.0))
    def test_pixel_to_azimuth_undoes_azimuth_to_pixel(
        self, middle: float, zoom: float, x: float
    ) -> None:
        view = Viewport(864.0, zoom).moved_to(middle, 0.0)
        places = view.xs_of(view.azimuth_at(x), 1e-6)
        assert min(abs(place - x) for place in places) < 1e-6

    def test_clockwise_is_to_the_right_and_up_is_up(self) -> None:
        view = Viewport(720.0)
        assert view.x_of(90.0) == 540.0
        assert view.x_of(-90.0) == 180.0
        assert view.y_of(45.0) == 90.0
        assert view.elevation_at(270.0) == -45.0

    def test_the_seam_stands_at_both_edges(self) -> None:
        assert Viewport(720.0).xs_of(180.0) == [0.0, 720.0]
        assert Viewport(720.0).moved_to(170.0, 0.0).xs_of(-170.0) == [400.0]

    def test_zoom_keeps_what_is_under_the_pointer(self) -> None:
        view = Viewport(864.0).moved_to(170.0, 0.0)
        near = view.zoomed(3.0, 700.0, 250.0)
        assert near.azimuth_at(700.0) == pytest.approx(view.azimuth_at(700.0))
        assert near.elevation_at(250.0) == pytest.approx(view.elevation_at(250.0))
        assert near.zoomed(100.0, 0.0, 0.0).zoom == 8.0

    def test_no_view_reaches_past_the_poles(self) -> None:
        view = Viewport(864.0, 2.0).panned(0.0, 10_000.0)
        assert view.y_of(90.0) == pytest.approx(0.0)
        assert Viewport(864.0).panned(0.0, 500.0).elevation_deg == 0.0

    def test_panning_moves_the_picture_with_the_hand_and_wraps(self) -> None:
        view = Viewport(720.0).panned(100.0, 0.0)
        assert view.x_of(0.0) == 460.0
        assert view.panned(-720.0, 0.0).azimuth_deg == pytest.approx(view.azimuth_deg)

    def test_ticks_count_from_the_photographer(self) -> None:
        view = Viewport(720.0).moved_to(30.0, 0.0)
        ticks = {tick.label: tick.x for tick in view.ticks(30.0, 15, 45) if tick.label}
        assert list(ticks) == [
            "−180°", "−135°", "−90°", "−45°", "0°", "45°", "90°", "135°", "180°"
        ]  # fmt: skip
        assert ticks["0°"] == 360.0
        assert ticks["−180°"] == 0.0

    def test_ticks_go_on_past_the_seam(self) -> None:
        view = Viewport(720.0).moved_to(150.0, 0.0)
        labels = [tick.label for tick in view.ticks(0.0, 45, 45)]
        assert labels == ["0°", "45°", "90°", "135°", "180°", "−135°", "−90°", "−45°"]

    def test_labels_get_closer_only_when_there_is_room(self) -> None:
        assert label_step(2.4, 72) == 45
        assert label_step(4.8, 72) == 15
        assert label_step(0.5, 72) == 90


class TestStrip:
    def test_turns_grow_to_the_right_around_the_goal(self) -> None:
        scale = StripScale(750.0, 96.0)
        assert scale.x_of(96.0) == 375.0
        assert scale.x_of(106.0) == 425.0
        mirrored = StripScale(750.0, 96.0, mirrored=True)
        assert mirrored.x_of(106.0) == 325.0
        assert mirrored.beyond(-173.0) == -scale.beyond(-173.0) == -1
        assert mirrored.bands((90.0, 100.0)) == [pytest.approx((355.0, 405.0))]

    def test_frames_cross_the_half_turn(self) -> None:
        left, right = StripScale(750.0, 178.0).frame(-165.0, 60.0)
        assert (left, right) == pytest.approx((375.0 + 17 * 5 - 150, 375.0 + 17 * 5 + 150))

    def test_what_is_off_the_strip_is_beyond_the_nearer_edge(self) -> None:
        scale = StripScale(750.0, 170.0)
        assert scale.beyond(-110.0) == 1
        assert scale.beyond(90.0) == -1
        assert scale.beyond(-120.0) == 0

    def test_arcs_wrap_and_are_cut_at_the_edges(self) -> None:
        scale = StripScale(750.0, 175.0)
        assert scale.bands((165.0, -170.0)) == [pytest.approx((325.0, 450.0))]
        assert scale.bands((-180.0, 180.0)) == [pytest.approx((0.0, 750.0))]
        assert scale.bands((-10.0, 10.0)) == []
        both = scale.bands((-115.0, 110.0))  # all but the middle
        assert both == [pytest.approx((0.0, 50.0)), pytest.approx((725.0, 750.0))]

    def test_labels_make_way_for_markers(self) -> None:
        ticks = StripScale(824.0, 96.0).ticks(15, (96.0, 74.0), 14.0)
        labels = [tick.label for tick in ticks]
        # They count from the goal to both sides, and no number has a sign.
        assert labels == ["60°", "45°", "", "", "", "15°", "30°", "45°", "60°"]
        assert np.allclose(np.diff([tick.x for tick in ticks]), 15 * 824 / 150)
