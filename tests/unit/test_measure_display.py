"""The panorama as it is shown: the same tones as everywhere, faster, with its marks."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from app.core.base import colour
from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.core.measure.finish.display import (
    clip_overlay,
    display_gain,
    display_panorama,
    mask_overlay,
)
from app.core.measure.finish.lamp_detection import Light
from app.core.measure.finish.masks import box_mask
from app.core.measure.finish.tripod_detection import Clutter, Suggestion
from app.core.measure.read.frame import MergedLight
from app.export.merge_preview import preview

pytestmark = pytest.mark.usefixtures("qapp")

SCENES = ("city", "interior", "night", "sunset")


def mark(
    name: str,
    azimuth: float,
    elevation: float,
    diameter: float = 4.0,
    share: float = 0.2,
    clipped: bool = False,
) -> Light:
    """Make a lamp; only what the preview shows matters."""
    texels = np.zeros(0, np.int32)
    return Light(name, azimuth, elevation, diameter, 1.0, 0.01, share, clipped, 0.0, texels)


def scene(name: str) -> np.ndarray:
    return np.asarray(read_environment(resources() / "demo" / "scenes" / f"{name}.exr").radiance)


def merged(radiance: np.ndarray) -> MergedLight:
    zero = np.zeros(radiance.shape[:2], np.float32)
    return MergedLight(np.asarray(radiance, np.float32), zero, zero, 0.0, 1.0)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("wide", [True, False])
def test_the_tones_are_those_of_every_other_picture(
    name: str, wide: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not wide:
        monkeypatch.setattr(colour, "wide_tables", lambda: False)
    light = scene(name)[:500]  # not a whole number of bands
    stops = 0.7
    shown = display_panorama(light, stops, light.shape[1])
    gain = colour.panorama_exposure(colour.luminance(light)) * 2.0**stops
    expected = colour.to_bytes(colour.tone_map(light, gain))
    apart = np.abs(shown.astype(int) - expected)
    assert apart.max() <= 1
    assert (apart > 0).mean() < 0.02


def test_the_gain_is_the_programs_own_moved_by_stops() -> None:
    light = scene("studio")
    own = colour.panorama_exposure(colour.luminance(light))
    assert display_gain(light) == pytest.approx(own, rel=1e-6)
    assert display_gain(light, 2.0) == pytest.approx(4.0 * own, rel=1e-6)
    assert display_gain(light, -1.0) == pytest.approx(own / 2.0, rel=1e-6)


@pytest.mark.parametrize("stops", [-12.0, 0.0, 12.0])
def test_light_of_any_size_is_shown_without_a_wrap(stops: float) -> None:
    light = np.full((64, 128, 3), 0.3, np.float32)
    light[10, 10] = 1e30
    light[20, 20] = (1e30, 0.0, 0.0)
    light[30, 30] = 0.0
    light[40, 40] = 1e-30
    shown = display_panorama(light, stops, 128)
    assert shown[10, 10].min() == 255
    assert shown[20, 20, 0] >= 254
    assert shown[30, 30].max() == 0
    assert shown[40, 40].max() == 0


def test_brighter_light_is_never_shown_darker() -> None:
    ramp = np.geomspace(1e-5, 1e5, 4096, dtype=np.float32)
    light = np.ones((64, 4096, 3), np.float32) * ramp[:, None]
    light *= np.array([1.0, 0.7, 0.4], np.float32)
    shown = display_panorama(light, 0.0, 4096).astype(int)
    assert (np.diff(shown[0], axis=0) >= 0).all()
    assert np.ptp(shown, axis=0).max() == 0


@pytest.mark.parametrize(
    ("shape", "width", "expected"),
    [
        ((512, 1024), 2048, (1024, 2048)),
        ((512, 1024), 256, (128, 256)),
        ((100, 150), 300, (200, 300)),
    ],
)
def test_any_width_is_made(shape: tuple[int, int], width: int, expected: tuple[int, int]) -> None:
    light = np.full((*shape, 3), (0.1, 0.2, 0.3), np.float32)
    shown = display_panorama(light, 0.0, width)
    assert shown.shape == (*expected, 3)
    assert shown.dtype == np.uint8
    assert np.ptp(shown.reshape(-1, 3), axis=0).max() == 0


def test_smaller_pictures_average_light_before_the_tone_curve() -> None:
    light = np.zeros((128, 256, 3), np.float32)
    light[::2] = 1.0
    gain = display_gain(light)
    expected = colour.to_bytes(colour.tone_map(np.full(3, 0.5), gain))
    assert np.abs(display_panorama(light, 0.0, 64)[5, 5].astype(int) - expected).max() <= 1


@pytest.mark.slow
@pytest.mark.alone
def test_showing_is_several_times_faster_than_the_plain_way() -> None:
    light = np.repeat(np.repeat(scene("sunset"), 2, axis=0), 2, axis=1)

    def best(work: object, times: int) -> float:
        spans = []
        for _ in range(times):
            start = time.process_time()
            assert callable(work)
            work()
            spans.append(time.process_time() - start)
        return min(spans)

    fast = best(lambda: display_panorama(light), 5)
    plain = best(lambda: colour.to_bytes(colour.tone_map(light, 0.3)), 2)
    assert fast < plain / 5.0


def test_clipped_areas_are_hatched_in_black_and_white() -> None:
    shown = np.full((512, 1024, 3), 128, np.uint8)
    clipped = np.zeros((256, 512), np.float32)
    clipped[100:140, 200:260] = 1.0
    clipped[30, 30] = 0.2  # a point must be seen too
    marked = clip_overlay(shown, clipped)
    inside = marked[205:275, 405:515]
    assert set(np.unique(inside)) == {0x10, 0xF5}
    assert 0.4 < (inside == 0xF5).mean() < 0.6
    assert (marked[60:62, 60:62] != 128).all()
    assert (marked[:50] == 128).all()
    assert (marked[300:] == 128).all()
    assert (shown == 128).all()
    np.testing.assert_array_equal(clip_overlay(shown, np.zeros_like(clipped)), shown)


def test_a_mask_is_tinted_with_an_edge_but_none_at_the_seam() -> None:
    shown = np.full((512, 1024, 3), 100, np.uint8)
    mask = box_mask(160.0, -160.0, -40.0, 10.0, (256, 512))
    marked = mask_overlay(shown, mask).astype(int)
    tinted = marked[300, 1000]
    assert tinted[2] > 130 > tinted[0]
    # The same all the way to the seam, on both sides of it.
    np.testing.assert_array_equal(marked[300, 1000:], np.broadcast_to(tinted, (24, 3)))
    np.testing.assert_array_equal(marked[300, :24], np.broadcast_to(tinted, (24, 3)))
    edge = marked[300, 962:974].max(axis=0)
    assert edge.min() > 150
    assert (marked[300, 100:900] == 100).all()
    np.testing.assert_array_equal(mask_overlay(shown, np.zeros_like(mask)), shown)


def test_the_preview_holds_the_panorama_and_marks_the_lamps_where_they_are() -> None:
    light = merged(scene("interior"))
    plain = preview(light)
    marks = [mark("A", 90.0, 0.0), mark("B", -90.0, 45.0, clipped=True)]
    marked = preview(light, marks)
    assert plain.shape[1] == marked.shape[1] == 2048 + 2 * 48
    assert marked.shape[0] > plain.shape[0]
    top = marked.shape[0] - 2048 // 2  # less than this much above and below the panorama
    rows = slice(0, 104 + 1024)
    changed = np.nonzero((plain[rows] != marked[rows]).any(axis=2))
    assert top > 0
    for azimuth, elevation in ((90.0, 0.0), (-90.0, 45.0)):
        x = 48 + 2048 * (azimuth / 360.0 + 0.5)
        y = 104 + 1024 * (0.5 - elevation / 180.0)
        away = np.hypot(changed[1] - x, changed[0] - y)
        assert away.min() < 30.0
    far = [
        min(
            np.hypot(column - (48 + 2048 * (a / 360 + 0.5)), row - (104 + 1024 * (0.5 - e / 180)))
            for a, e in ((90.0, 0.0), (-90.0, 45.0))
        )
        for row, column in zip(*changed, strict=True)
    ]
    assert max(far) < 90.0


def test_letters_of_lamps_close_together_do_not_cover_each_other() -> None:
    light = merged(scene("interior"))
    one = preview(light, [mark("A", 10.0, 20.0), mark("B", 60.0, 20.0)])
    two = preview(light, [mark("A", 10.0, 20.0), mark("B", 12.0, 21.0)])
    plain = preview(light, [mark("C", -100.0, -60.0), mark("D", -60.0, -60.0)])
    rows = slice(400, 700)

    def ink(picture: np.ndarray) -> int:
        """Pixels of the tags' near black that were not black before."""
        tag = (picture[rows, 900:1700] == 0x10).all(axis=2)
        return int((tag & ~(plain[rows, 900:1700] == 0x10).all(axis=2)).sum())

    assert ink(two) > 0.9 * ink(one)


def test_a_lamp_at_the_seam_keeps_its_letter_inside() -> None:
    light = merged(scene("interior"))
    marked = preview(light, [mark("A", 180.0, 89.0), mark("B", -180.0, -89.0)])
    plain = preview(light)
    high = min(len(plain), len(marked))
    changed = (plain[:high] != marked[:high]).any(axis=2)
    assert not changed[:, :20].any()
    assert not changed[:, -20:].any()


def test_the_preview_names_masks_clipping_and_exposure() -> None:
    light = merged(scene("interior"))
    clipped = box_mask(20.0, 40.0, 0.0, 20.0, light.radiance.shape[:2])
    mask = box_mask(-60.0, -20.0, -90.0, -60.0, light.radiance.shape[:2])
    noted = preview(
        replace(light, clipped=clipped), (), [Clutter(Suggestion(12.0), mask, 0.05, 0.7)], 1.0
    )
    assert noted.shape[0] > preview(light).shape[0] + 100  # three lines of legend
    x, y = 48 + round(2048 * (30 / 360 + 0.5)), 104 + round(1024 * (0.5 - 10 / 180))
    patch = noted[y - 20 : y + 20, x - 20 : x + 20]
    assert set(np.unique(patch)) == {0x10, 0xF5}


def test_a_display_panorama_at_hand_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    light = merged(scene("night"))
    shown = display_panorama(light.radiance)
    expected = preview(light)
    monkeypatch.setattr("app.export.merge_preview.display_panorama", lambda *_: 1 / 0)
    np.testing.assert_array_equal(preview(light, display=shown), expected)


def test_more_lamps_than_rows_are_summed_up_and_ordinary_pictures_have_no_scale() -> None:
    light = merged(scene("interior"))
    lamps = [mark(letter, 10.0 * k, 10.0) for k, letter in enumerate("ABCDEFGHIJKL")]
    eight, twelve = preview(light, lamps[:8]), preview(light, lamps)
    assert twelve.shape[0] == eight.shape[0] + 52
    photo = merged(np.full((300, 400, 3), 0.2, np.float32))
    assert preview(photo, lamps[:2]).shape[1] == 2048 + 96
