"""Masks by hand: areas against the sphere's own, and clear words for what is not valid."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from app.core.base.errors import ProbeError
from app.core.environment.environment import solid_angles
from app.core.measure.finish.masks import (
    MaskSpec,
    box_mask,
    cap_mask,
    draw_mask,
    parse_mask,
    picture_mask,
)

SHAPE = (256, 512)


def area(mask: np.ndarray) -> float:
    """Solid angle, sr."""
    return float(mask.sum(axis=1, dtype=float) @ solid_angles((mask.shape[0], mask.shape[1])))


def zone(low: float, high: float, width_deg: float = 360.0) -> float:
    """Solid angle of a part of a zone of the sphere: 2 pi (sin b - sin a), Archimedes."""
    return float(np.radians(width_deg) * (np.sin(np.radians(high)) - np.sin(np.radians(low))))


@pytest.mark.parametrize("elevation", [-85.0, -65.0, -41.3, 10.0])
def test_a_cap_has_the_area_of_a_cap(elevation: float) -> None:
    mask = cap_mask(elevation, SHAPE)
    assert mask.dtype == np.float32
    assert area(mask) == pytest.approx(zone(-90.0, elevation), rel=0.02)
    assert mask[-1].min() == 1.0
    assert mask[0].max() == 0.0


def test_a_cap_over_the_zenith_mirrors_the_one_below() -> None:
    above = draw_mask(parse_mask("zenith:70"), SHAPE)
    np.testing.assert_array_equal(above, cap_mask(-70.0, SHAPE)[::-1])


@pytest.mark.parametrize(
    ("start", "stop", "width"),
    [(-20.0, 20.0, 40.0), (150.0, -150.0, 60.0), (150.0, 210.0, 60.0), (-180.0, 180.0, 360.0)],
)
def test_a_box_has_its_area_also_across_the_seam(start: float, stop: float, width: float) -> None:
    mask = box_mask(start, stop, -60.0, -10.0, SHAPE)
    assert area(mask) == pytest.approx(zone(-60.0, -10.0, width), rel=0.005)
    assert mask.max() <= 1.0


def test_a_box_across_the_seam_is_where_it_should_be() -> None:
    mask = box_mask(170.0, -170.0, -10.0, 10.0, (180, 360))
    columns = np.nonzero(mask[90])[0]
    assert set(columns) == set(range(350, 360)) | set(range(10))


@pytest.mark.parametrize(
    ("text", "spec"),
    [
        ("nadir:-65", MaskSpec("nadir", (-65.0,))),
        (" nadir:−70 ", MaskSpec("nadir", (-70.0,))),
        ("box:-20,20,-90,-40", MaskSpec("box", (-20.0, 20.0, -90.0, -40.0))),
        ("suggested", MaskSpec("suggested")),
        ("masks/stick.PNG", MaskSpec("picture", path=Path("masks/stick.PNG"))),
    ],
)
def test_masks_of_the_command_line_are_read(text: str, spec: MaskSpec) -> None:
    assert parse_mask(text) == spec


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "not valid"),
        ("tripod", "not valid"),
        ("nadir:", "not valid"),
        ("nadir:-65,3", "needs 1 numbers"),
        ("nadir:-95", "outside -90 to 90"),
        ("nadir:nan", "outside -360 to 360"),
        ("box:1,2,3", "needs 4 numbers"),
        ("box:0,10,-20,-40", "not above"),
        ("0,1;2,3;4,5", "not valid"),
    ],
)
def test_what_is_not_a_mask_is_refused_in_words(text: str, words: str) -> None:
    with pytest.raises(ProbeError, match=words):
        parse_mask(text)


def test_suggested_masks_need_a_panorama() -> None:
    with pytest.raises(ProbeError, match="need a panorama"):
        draw_mask(MaskSpec("suggested"), SHAPE)


@pytest.mark.parametrize("ending", ["png", "tif"])
@pytest.mark.parametrize("size", [(64, 128), (512, 1024)])
def test_white_in_a_picture_is_masked(tmp_path: Path, ending: str, size: tuple[int, int]) -> None:
    path = tmp_path / f"mask.{ending}"
    picture = np.zeros((*size, 3), np.uint8)
    picture[size[0] // 2 :] = 255
    assert cv2.imwrite(str(path), picture)
    mask = picture_mask(path, SHAPE)
    assert mask.shape == SHAPE
    assert mask[:120].max() == 0.0
    assert mask[136:].min() == 1.0
    assert area(draw_mask(parse_mask(str(path)), SHAPE)) == pytest.approx(2.0 * np.pi, rel=0.01)


def test_sixteen_bit_masks_and_grey_ones_are_read(tmp_path: Path) -> None:
    path = tmp_path / "mask.png"
    cv2.imwrite(str(path), np.full((32, 64), 65535, np.uint16))
    assert picture_mask(path, SHAPE).min() == 1.0


def test_pictures_that_are_no_masks_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ProbeError, match="was not found"):
        picture_mask(tmp_path / "none.png", SHAPE)
    bad = tmp_path / "bad.png"
    bad.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(40))
    with pytest.raises(ProbeError, match=r"bad\.png"):
        picture_mask(bad, SHAPE)
    square = tmp_path / "square.png"
    cv2.imwrite(str(square), np.zeros((64, 64), np.uint8))
    with pytest.raises(ProbeError, match="64 x 64") as caught:
        picture_mask(square, SHAPE)
    assert "twice as wide" in caught.value.hint


def test_half_a_file_is_refused(tmp_path: Path) -> None:
    whole = tmp_path / "whole.png"
    noise = np.random.default_rng(1).integers(0, 255, (256, 512), np.uint8)
    cv2.imwrite(str(whole), noise)
    cut = tmp_path / "cut.png"
    cut.write_bytes(whole.read_bytes()[:20000])
    with pytest.raises(ProbeError, match="damaged"):
        picture_mask(cut, SHAPE)
