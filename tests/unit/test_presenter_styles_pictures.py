"""Fast portraits of the gallery against the careful ones of the sheet."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.portrait.display_pictures import WELL
from app.core.portrait.gallery_portraits import framing, greyed, portraits
from app.core.solver.peaks import shift, value_at
from app.core.solver.place_light import picture_at
from benchmarks.speed.plain_portrait import portrait
from tests.helpers.styles_screen import head, scene_light


def pictures() -> np.ndarray:
    """Six very different linear pictures: even, split, a bare rim, dim, glaring, black."""
    one = head()
    names = ("flat", "left-split", "right-rim")
    targets = [one.pack.target(name) for name in names]
    here = picture_at(one.transport, scene_light(), 20.0)
    return np.stack([*targets, 1e-6 * here, 1e6 * here, np.zeros_like(here)])


@pytest.mark.parametrize("size", [(100, 100), (68, 94), (208, 200), (416, 400), (149, 110)])
def test_the_same_look_as_the_sheet(size: tuple[int, int]) -> None:
    """Unframed by the careful code, then cut by the framing's own arithmetic."""
    one, linear = head(), pictures()
    coverage = one.pack.coverage.astype(np.float32)
    fast = portraits(linear, coverage, framing(100, size))
    for picture, shown in zip(linear, fast, strict=True):
        # Eight times finer than the picture; then framed by averaging, which nothing can alias.
        slow = portrait(picture, coverage, (800, 800))
        wanted = framing(800, size)
        planes = np.ascontiguousarray(slow.transpose(2, 0, 1)) - np.float32(WELL[0] / 255)
        framed = (wanted.of(planes) + np.float32(WELL[0] / 255)).T * 255
        inside = np.zeros((800, 800), np.float32)
        inside[40:760, 40:760] = 1.0
        area = wanted.of(inside[np.newaxis])[0].T > 0.999
        difference = np.abs(shown.astype(float) - framed)[area]
        assert difference.mean() < 1.0
        assert np.percentile(difference, 99) < 8.0


def test_unscaled_it_is_the_same_to_a_byte() -> None:
    one, linear = head(), pictures()
    coverage = one.pack.coverage.astype(np.float32)
    plain = framing(100, (100, 100))
    step = 102.0 / 100.0
    fast = portraits(linear, coverage, plain)
    assert fast.shape == (6, 100, 100, 3)
    # The middle of the picture, where a shift of at most a pixel cannot hide a wrong tone.
    for picture, shown in zip(linear, fast, strict=True):
        slow = portrait(picture, coverage, (100, 100)) * 255
        for row, column in ((50, 50), (30, 50), (60, 35), (60, 65)):
            here = shown[row, column].astype(float)
            source_row = (row + 0.5) * step - 0.045 * 102.0 - 0.5
            source_column = (column + 0.5 - 50) * step + 50 - 0.5
            near = slow[
                int(source_row) : int(source_row) + 2, int(source_column) : int(source_column) + 2
            ].reshape(-1, 3)
            assert (here >= near.min(axis=0) - 1.5).all()
            assert (here <= near.max(axis=0) + 1.5).all()


def test_what_is_outside_of_the_picture_is_the_well() -> None:
    one = head()
    coverage = one.pack.coverage.astype(np.float32)
    shown = portraits(pictures()[:1], coverage, framing(100, (68, 94)))[0]
    for corner in (shown[0, 0], shown[0, -1], shown[40, 0], shown[40, -1]):
        assert corner.tolist() == list(WELL)


def test_heads_keep_their_place_in_pictures_of_one_shape() -> None:
    """A card at two pixels per logical one shows what it shows at one."""
    one = head()
    coverage = one.pack.coverage.astype(np.float32)
    small = portraits(pictures()[:1], coverage, framing(100, (68, 94)))[0].astype(float)
    large = portraits(pictures()[:1], coverage, framing(100, (136, 188)))[0].astype(float)
    halved = large.reshape(68, 2, 94, 2, 3).mean(axis=(1, 3))
    assert np.abs(small - halved).mean() < 1.5


def test_exposure_does_not_change_a_picture() -> None:
    one, linear = head(), pictures()
    coverage = one.pack.coverage.astype(np.float32)
    frame = framing(100, (208, 200))
    dim, bright = portraits(linear[3:5], coverage, frame).astype(int)
    assert np.abs(dim - bright).max() <= 1


def test_grey_keeps_the_well_and_has_no_colour() -> None:
    one = head()
    coverage = one.pack.coverage.astype(np.float32)
    shown = portraits(pictures()[:2], coverage, framing(100, (68, 94)))
    for picture in shown:
        grey = greyed(picture)
        assert np.ptp(grey.astype(int), axis=2).max() == 0
        assert grey[0, 0].tolist() == list(WELL)
        assert grey.max() < picture.max()


def test_a_curve_between_its_turns() -> None:
    curve = 50.0 + 30.0 * np.cos(np.radians(np.arange(64) * 5.625 - 40.0))
    for turn in (0.0, 5.625, 33.3, -170.0, 180.0):
        wanted = 50.0 + 30.0 * np.cos(np.radians(turn - 40.0))
        assert value_at(curve, turn) == pytest.approx(wanted, abs=1e-9)
        assert value_at(curve, turn) == shift(curve, turn)[0]
