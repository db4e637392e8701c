"""Portraits at full size: developed fast, exposed and framed as the quick ones they replace."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from app.core.base import colour
from app.core.portrait.gallery_portraits import (
    CLOSE_SHAPE,
    exposure_in_mean_light,
    exposures,
    framing,
    large_portrait,
    light_exposures,
)
from app.core.portrait.head import Head
from app.core.portrait.portrait_head import CLOSE_COLUMNS, CLOSE_ROWS, ROOM
from app.core.solver.place_light import Facing, pictures_at
from app.core.solver.transport import load_named, render, to_image
from app.core.styles.lamps import far_lamp
from app.core.styles.style import StyleLamp
from tests.helpers.styles_screen import head, scene_light

TURNS = [0.0, 75.0, -140.0]


@cache
def who(*, hair: str = "plain", in_place: bool = False) -> Head:
    return replace(head(), hair=hair, in_place=in_place)


def face_of(shown: np.ndarray) -> float:
    """Linear brightness of forehead, cheeks and chin in a portrait of the head alone."""
    high, wide = shown.shape[:2]
    part = shown[int(0.3 * high) : int(0.85 * high), int(0.28 * wide) : int(0.72 * wide)]
    return float(colour.luminance(colour.srgb_decode(part / 255)).mean())


@pytest.mark.parametrize("scene", ["courtyard", "sunset"])
@pytest.mark.parametrize("hair", ["plain", "short"])
@pytest.mark.parametrize("size", [(256, 200), (416, 400)])
def test_the_larger_picture_is_as_bright_as_the_quick_one(
    scene: str, hair: str, size: tuple[int, int]
) -> None:
    one, light = who(hair=hair), scene_light(scene)
    linear, lit = pictures_at(one.transport, light, TURNS), [Facing(light, t) for t in TURNS]
    quick = one.portraits(linear, size, lit, close=True, quick=True)
    large = one.portraits(linear, size, lit, close=True)
    for small, full in zip(quick, large, strict=True):
        # Bald they differ by a few per cent; brows, lashes and shade of hair take a little more.
        assert face_of(full) == pytest.approx(face_of(small), rel=0.05 if hair == "plain" else 0.2)


def test_targets_too() -> None:
    one = who()
    styles = [one.pack.styles[one.pack.index(name)] for name in ("butterfly", "left-rembrandt")]
    linear = [one.pack.target(style.name) for style in styles]
    quick = one.portraits(linear, (256, 200), styles, close=True, quick=True)
    large = one.portraits(linear, (256, 200), styles, close=True)
    for small, full in zip(quick, large, strict=True):
        assert face_of(full) == pytest.approx(face_of(small), rel=0.12)


@pytest.mark.parametrize(("size", "close"), [((256, 200), True), ((208, 200), False)])
def test_the_larger_picture_shows_the_head_at_the_same_place(
    size: tuple[int, int], close: bool
) -> None:
    """Where the bald head ends at the left and at the right."""
    one, light = who(), scene_light("sunset")
    linear, lit = pictures_at(one.transport, light, [0.0]), [Facing(light, 0.0)]
    ends = []
    for quick in (True, False):
        (shown,) = one.portraits(linear, size, lit, close=close, quick=quick)
        row = np.abs(shown[size[0] // 2].astype(int) - 0x2B).sum(axis=1) > 40
        ends.append((int(np.argmax(row)), int(np.argmax(row[::-1]))))
    assert np.abs(np.subtract(ends[0], ends[1])).max() <= 2


def test_tables_develop_as_the_curve_does() -> None:
    """Up to a byte, from shade to far above white, with light behind that fills the edge."""
    rng = np.random.default_rng(1)
    picture = np.exp(rng.normal(-1, 2, (90, 70, 3))).astype(np.float32)
    away = np.repeat(rng.random((90, 70, 1)), 3, axis=2).astype(np.float32)
    behind = np.exp(rng.normal(0, 2, picture.shape)).astype(np.float32)
    for gain in (1e-3, 0.7, 50.0):
        whole = picture + away * behind
        wanted = colour.to_bytes(colour.tone_map(whole, gain)).astype(int)
        shown = large_portrait(picture, away, gain, behind)
        assert np.abs(shown - wanted).max() <= 1
    grey = large_portrait(np.zeros_like(picture), np.ones_like(picture), 1.0)
    assert (grey == 0x2B).all()


@pytest.mark.parametrize("size", [(256, 200), (400, 560), (300, 200), (900, 720)])
def test_a_cut_is_the_careful_frame_to_half_a_pixel(size: tuple[int, int]) -> None:
    smooth = np.random.default_rng(2).random((20, 20, 3)).astype(np.float32)
    large = cv2.resize(smooth, (640, 640), interpolation=cv2.INTER_CUBIC)
    picture = np.asarray(large, np.float32)
    frame = framing(640, size, room=ROOM)
    careful = frame.of(np.ascontiguousarray(picture.transpose(2, 0, 1))).T
    found = frame.cut(picture)
    assert found.shape == (*size, 3)
    inside = frame.cut(np.ones((640, 640), np.float32)) > 0.999
    assert np.abs(found - careful)[inside].mean() < 0.01


def test_dark_skin_is_exposed_as_medium_skin_in_the_same_light() -> None:
    light = scene_light("interior").searched
    dark, medium = load_named("generic-dark"), load_named("generic")
    (one,) = light_exposures(dark, [light])
    (other,) = exposures(
        to_image(medium, render(medium, light))[None], to_image(medium, medium.coverage)
    )
    assert one == pytest.approx(other, rel=1e-4)


def test_stops_count_from_a_face_in_the_mean_light() -> None:
    """In light from all around alike, however strong, they are none."""
    transport = load_named("generic")
    even = np.full((32, 64, 3), 5.0, np.float32)
    (seen,) = light_exposures(transport, [even])
    assert seen == pytest.approx(exposure_in_mean_light(transport, even), rel=1e-4)
    lamp = even.copy()
    lamp[10:20, 28:36] = 100.0
    (front,) = light_exposures(transport, [lamp])
    assert front < 0.7 * exposure_in_mean_light(transport, lamp)


def test_the_place_is_behind_the_head_and_targets_keep_the_grey() -> None:
    light = scene_light("courtyard")
    grey, place = who(hair="short"), who(hair="short", in_place=True)
    linear, lit = pictures_at(grey.transport, light, [150.0]), [Facing(light, 150.0)]
    for quick in (True, False):
        (one,) = grey.portraits(linear, (256, 200), lit, quick=quick)
        (other,) = place.portraits(linear, (256, 200), lit, quick=quick)
        assert (one[:20, :10] == 0x2B).all()
        assert np.ptp(other[:60, :10].reshape(-1, 3).astype(int), axis=0).min() > 5
        np.testing.assert_array_equal(one[100:180, 80:120], other[100:180, 80:120])
    style = grey.pack.styles[0]
    (target,) = place.portraits([grey.pack.target(style.name)], (256, 200), [style])
    assert (target[:20, :10] == 0x2B).all()


def test_one_exposure_makes_darker_light_look_darker() -> None:
    one, light = who(), scene_light("courtyard")
    linear, lit = pictures_at(one.transport, light, TURNS), [Facing(light, t) for t in TURNS]
    own = one.exposures(linear, lit)
    for quick in (True, False):
        pinned, free = (
            one.portraits(linear, (256, 200), lit, close=True, quick=quick, gains=exposed)
            for exposed in ([own[0]] * len(own), ())
        )
        np.testing.assert_array_equal(pinned[0], free[0])
        for gain, alike, best in zip(own[1:], pinned[1:], free[1:], strict=True):
            change = np.log2(face_of(alike) / face_of(best))
            assert change == pytest.approx(np.log2(own[0] / gain), rel=0.35)


def test_cards_show_only_what_a_close_head_has() -> None:
    side = 320
    for wide in range(60, 500, 7):
        frame = framing(side, (round(wide * CLOSE_SHAPE), wide), True, ROOM)
        high, across = (each * frame.step for each in frame.size)
        assert frame.top + high <= CLOSE_ROWS * side
        assert across <= CLOSE_COLUMNS * side


def least_of(work: Callable[[], object]) -> float:
    """Processor seconds of the fastest of ten runs."""
    took = []
    for _ in range(10):
        began = time.process_time()
        work()
        took.append(time.process_time() - began)
    return min(took)


@pytest.mark.slow
@pytest.mark.alone
@pytest.mark.parametrize(("size", "times"), [((256, 200), 6.0), ((640, 512), 3.0)])
def test_developing_is_fast(size: tuple[int, int], times: float) -> None:
    """Beside developing the whole picture by the plain rule, and scaling that."""
    rng = np.random.default_rng(5)
    side = 320 if size[0] < 320 else 640
    picture = rng.random((side, side, 3)).astype(np.float32)
    frame = framing(side, size, room=ROOM)
    away = frame.cut(rng.random(picture.shape).astype(np.float32))
    behind = rng.random((*size, 3)).astype(np.float32)
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        ours = least_of(lambda: large_portrait(frame.cut(picture), away, 2.0, behind))
        plain = least_of(lambda: frame.cut(colour.srgb_encode(colour.develop(2.0 * picture))))
    finally:
        cv2.setNumThreads(threads)
    assert ours * times < plain, plain / ours


class TestWithALamp:
    """A second light: as bright as the transport has it, drawn as if it were far away."""

    FAR = StyleLamp(50.0, 10.0, 20.0, 1.0, 0.5)

    def light_of(self, lamp: StyleLamp) -> np.ndarray:
        light = far_lamp(lamp, (32, 64))[..., None] * np.ones(3)
        return np.asarray(light, np.float32)

    def picture(self, light: np.ndarray) -> np.ndarray:
        transport = who().transport
        return to_image(transport, render(transport, light))

    @pytest.mark.parametrize("size", [(256, 200), (416, 400)])
    def test_without_any_it_is_the_picture_of_the_place(self, size: tuple[int, int]) -> None:
        one, here = who(hair="short", in_place=True), Facing(scene_light("courtyard"), 40.0)
        place = pictures_at(one.transport, here.light, [40.0])[0]
        far = self.light_of(self.FAR)
        shown = one.portrait_with(here, [place, np.zeros_like(place), far], size)
        wanted = one.portrait(place, size, here).astype(int)
        # One is drawn at half the size where that is enough.
        assert np.abs(shown - wanted).mean() < 2.0

    def test_it_is_as_bright_as_near_and_hidden_make_it(self) -> None:
        """Half of the place hidden, and a lamp whose light falls off from brow to chin."""
        one, here = who(), Facing(scene_light("sunset"), 40.0)
        place = 0.5 * pictures_at(one.transport, here.light, [40.0])[0]
        far = self.light_of(self.FAR)
        lamp = self.picture(far) * np.linspace(2.0, 0.5, 100, dtype=np.float32)[:, None, None]
        lamp *= 4 * place.sum() / lamp.sum()
        lit = one.portrait_with(here, [place, lamp, far], (256, 200)).astype(float)
        (quick,) = one.portraits([place + lamp], (256, 200), [here], quick=True)
        for rows in (slice(80, 120), slice(120, 160), slice(160, 190)):
            found, wanted = (
                float(colour.luminance(colour.srgb_decode(each[rows, 70:130] / 255)).mean())
                for each in (lit, quick)
            )
            assert found == pytest.approx(wanted, rel=0.08)

    @pytest.mark.parametrize("side", [1, -1])
    def test_a_lamp_at_the_sitters_left_lights_the_right_of_the_picture(self, side: int) -> None:
        one, here = who(hair="short"), Facing(scene_light("sunset"), 40.0)
        place = 0.0 * pictures_at(one.transport, here.light, [40.0])[0]
        far = self.light_of(replace(self.FAR, azimuth_deg=70.0 * side))
        shown = one.portrait_with(here, [place, self.picture(far), far], (256, 256)).astype(float)
        left, right = shown[100:170, 80:128].mean(), shown[100:170, 128:176].mean()
        assert (right > 2 * left) if side > 0 else (left > 2 * right)
