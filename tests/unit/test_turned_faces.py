"""The benchmark of turned faces counts what it says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.faces.turned_faces import Pair, composed, judged, overlap, right
from benchmarks.faces.turned_heads import LARGE_PX, ROOM, Pictured, held, place


def test_a_turned_head_looks_right_in_the_picture_and_up() -> None:
    nose = held((30, 15))[:, 2]
    assert np.degrees(np.arctan2(nose[0], nose[2])) == pytest.approx(30)
    assert np.degrees(np.arcsin(nose[1])) == pytest.approx(15)
    assert held((0, 15))[1, 1] > 0
    assert np.linalg.det(held((-45, 15))) == pytest.approx(1)


def test_the_lamp_stands_where_its_name_says() -> None:
    light = place(Path("90"))[..., 0]
    row, column = np.argwhere(light == light.max()).mean(axis=0) + 0.5
    assert 360 * (column / light.shape[1] - 0.5) == pytest.approx(90, abs=0.5)
    assert 90 - 180 * row / light.shape[0] == pytest.approx(20, abs=0.5)


def test_a_face_is_right_where_it_is_and_held_as_it_is() -> None:
    box = (0.0, 0.0, 10.0, 10.0)
    assert overlap(box, (5.0, 0.0, 15.0, 10.0)) == pytest.approx(1 / 3)
    assert overlap(box, (20.0, 20.0, 30.0, 30.0)) == 0.0
    assert right((1.0, 0.0, 11.0, 10.0), 20.0, [box])
    assert not right((1.0, 0.0, 11.0, 10.0), 30.0, [box])
    assert not right((5.0, 0.0, 15.0, 10.0), 0.0, [box])


def test_heads_of_all_sizes_are_where_their_boxes_are() -> None:
    side = round(ROOM * LARGE_PX)
    picture = np.zeros((side, side, 4), np.float32)
    picture[100:400, 150:350] = 1.0
    head = Pictured(picture, (150.0, 100.0, 350.0, 400.0), 3000.0)
    frame, boxes = composed(head, np.full((32, 64, 3), 1e-6, np.float32), 30.0)
    assert sorted(boxes) == [40, 80, 160, 320]
    for left, top, right_edge, bottom in boxes.values():
        inside = frame[round(top) + 3 : round(bottom) - 3, round(left) + 3 : round(right_edge) - 3]
        assert np.ptp(inside) < 1e-3
        assert inside.mean() == pytest.approx(head.gain, rel=1e-3)


def test_the_bars_count_pairs_of_their_own() -> None:
    pairs = [
        Pair("outside", -1.0, 5.0, 50.0, "in the arc, told outside"),
        Pair("inside", -1.0, 5.0, 2.0, "right"),
        Pair("inside", 20.0, 25.0, 20.0, "wrong by the arc"),
        Pair("inside", 30.0, 35.0, 20.0, "wrong by both"),
        Pair("outside", 60.0, 70.0, 4.0, "right"),
        Pair("unsure", 60.0, 70.0, 4.0, "says nothing"),
    ]
    told = judged(pairs)
    assert told["in_the_arc_told_outside"] == {"pairs": 2, "outside": 1, "share": 0.5}
    assert told["over_30_off"]["inside"] == 1
    assert told["over_15_outside"] == {"pairs": 4, "inside": 2, "share": 0.5}
    assert told["unsure"]["unsure"] == 1
    assert told["off_where_outside"] == {"pairs": 2, "median": 27.0}
