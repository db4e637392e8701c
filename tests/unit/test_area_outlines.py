"""The outlines shown on a face lie on the areas that are compared."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from app.core.base.arrays import Bools, Float32
from app.core.portrait.gallery_portraits import framing
from app.core.portrait.head import Head, load_head
from app.core.portrait.portrait_head import ROOM
from app.core.reasons.area_outlines import AreaOutline, area_outlines
from app.core.solver.face import AREAS, AROUND
from app.core.solver.head_shape import load_shape_of

SIZE = (416, 400)
OVALS = ("right patch", "left cheek", "right nose shadow", "lids", "middle line", "throat")


def inside(head: Head, outline: AreaOutline, size: tuple[int, int] = SIZE) -> Bools:
    mask = np.zeros(size, np.uint8)
    for loop in outline.in_portrait(head, size):
        corners = np.round(loop * size[::-1] - 0.5).astype(np.int32)
        cv2.fillPoly(mask, [corners], 1)
    return mask > 0


def framed(weights: Float32, size: tuple[int, int]) -> Float32:
    """The weights of an area, cropped and scaled by the code that draws quick portraits."""
    frame = framing(len(weights), size, above=ROOM)
    return np.asarray(frame.of(weights[np.newaxis])[0].T)


def weights_of(head: Head, area: str) -> Float32:
    return np.asarray(head.pack.areas[AREAS.index(area)], np.float32)


@pytest.mark.parametrize("size", [SIZE, (136, 200), (300, 180)])
@pytest.mark.parametrize("name", ["generic", "female", "male"])
def test_an_outline_contains_the_light_of_its_area(name: str, size: tuple[int, int]) -> None:
    head = load_head(name)
    for outline in area_outlines(head, OVALS):
        weights = framed(weights_of(head, outline.area), size)
        mask = inside(head, outline, size)
        # The rim of an oval is soft, and a small picture has few pixels.
        assert weights[mask].sum() > 0.75 * weights.sum(), outline.area
        assert mask.sum() < 2.0 * (weights > 0.25 * weights.max()).sum(), outline.area
        if len(outline.loops) > 1:
            continue
        middle = (np.array(each).mean() for each in np.nonzero(mask))
        rows, columns = np.indices(size)
        for place, plane in zip(middle, (rows, columns), strict=True):
            assert place == pytest.approx((plane * weights).sum() / weights.sum(), abs=4.0)


@pytest.mark.parametrize("name", ["generic", "female", "male"])
def test_a_full_portrait_has_its_outlines_in_the_same_place(name: str) -> None:
    """A full-size picture is cut to size by other code, from a picture with room for hair."""
    head = load_head(name)
    rows = 640
    side = round(rows / ROOM)
    frame = framing(rows, SIZE, room=ROOM)
    for outline in area_outlines(head, OVALS):
        large = cv2.resize(weights_of(head, outline.area), (side, side))
        above, beside = rows - side, (rows - side) // 2
        edges = above, 0, beside, above - beside
        whole = cv2.copyMakeBorder(large, *edges, cv2.BORDER_CONSTANT)
        picture = frame.cut(np.asarray(whole, np.float32))
        assert picture[inside(head, outline)].sum() > 0.75 * picture.sum(), outline.area


@pytest.mark.parametrize("name", ["generic", "female", "male"])
def test_the_patch_lies_below_the_far_eye(name: str) -> None:
    """The triangle of Rembrandt light: under the eye, beside the nose, on its own side."""
    head = load_head(name)
    shape = load_shape_of(head.transport, name)
    frame = framing(head.transport.size, SIZE, above=ROOM)
    row, column = np.divmod(shape.pixels, head.transport.size)
    eye = np.hypot(*(shape.positions - shape.eye_point)[:, :2].T).argmin()
    eye_y = (row[eye] + 0.5 - frame.top) / frame.step / SIZE[0]
    eye_x = (column[eye] + 0.5 - frame.left) / frame.step / SIZE[1]
    right, left = area_outlines(head, ["right patch", "left patch"])
    (loop,) = right.in_portrait(head, SIZE)
    assert loop[:, 1].min() > eye_y
    assert loop[:, 0].max() < eye_x  # the sitter's right is at the left of the picture
    (mirrored,) = left.in_portrait(head, SIZE)
    assert np.mean([loop[:, 0].mean(), mirrored[:, 0].mean()]) == pytest.approx(eye_x, abs=0.01)


def test_an_area_of_several_parts_has_an_outline_for_each() -> None:
    lids, line = area_outlines(load_head("generic"), ["lids", "middle line"])
    assert (len(lids.loops), len(line.loops)) == (2, 3)


def test_what_surrounds_the_head_has_no_outline() -> None:
    for outline in area_outlines(load_head("generic"), AREAS[AROUND]):
        assert outline.loops == ()


def test_outlines_turn_with_the_face() -> None:
    """A face that turns to its own left moves its features to the right of the picture."""
    head = load_head("generic")
    turned = head.turned(30.0)
    areas = ["under the nose", "left cheek", "right cheek"]
    here = [each.in_portrait(head, SIZE)[0].mean(axis=0) for each in area_outlines(head, areas)]
    there = [
        each.in_portrait(turned, SIZE)[0].mean(axis=0) for each in area_outlines(turned, areas)
    ]
    assert all(two[0] > one[0] + 0.03 for one, two in zip(here, there, strict=True))
    assert all(abs(two[1] - one[1]) < 0.04 for one, two in zip(here, there, strict=True))
    coverage = framed(turned.pack.coverage.astype(np.float32), SIZE)
    for outline in area_outlines(turned, areas):
        assert coverage[inside(turned, outline)].mean() > 0.98, outline.area
