"""A camera left behind: noticed when somebody walks before it, and in no other case."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.localization.live.temporal_filters import ASKED_DEG, STILL, STILL_S, Stillness, watch
from app.core.localization.sitter import Sitter, background_mask

Bytes = NDArray[np.uint8]
SIZE = (240, 320)
EVERY_S = 0.25


def room(seed: int = 1) -> Bytes:
    """Random marks of several sizes, larger than a picture of `SIZE`."""
    chance = np.random.default_rng(seed)
    total = np.zeros((300, 400), np.float32)
    for cells in (6, 12, 25, 50, 100):
        grain = chance.normal(0.0, 1.0, (cells, cells)).astype(np.float32)
        total += cv2.resize(grain, (400, 300), interpolation=cv2.INTER_CUBIC)
    return np.asarray(np.clip(128.0 + 32.0 * total, 0.0, 255.0), np.uint8)


def sitter_at(column: float, tall: float = 0.25) -> Sitter:
    half = 0.37 * tall * SIZE[0] / SIZE[1]
    box = (column - half, 0.3, column + half, 0.3 + tall)
    return Sitter(column, 60.0 * (column - 0.5), box, "face", 0.9)


def picture(
    place: Bytes,
    sitter: Sitter | None,
    *,
    shift: tuple[float, float] = (0.0, 0.0),
    stops: float = 0.0,
    seed: int = 0,
) -> Bytes:
    """Take a window of a room, the camera aimed `shift` pixels aside, a grey person in front."""
    move = np.array([[1.0, 0.0, -40.0 - shift[0]], [0.0, 1.0, -30.0 - shift[1]]])
    window = cv2.warpAffine(place, move, (SIZE[1], SIZE[0])).astype(np.float32)
    if sitter is not None:
        window[~background_mask(sitter, SIZE)] = 90.0
    window = window * 2.0 ** (stops / 2.2)
    window += np.random.default_rng(seed).normal(0.0, 4.0, window.shape)
    return np.repeat(np.clip(window, 0.0, 255.0).astype(np.uint8)[..., None], 3, axis=2)


def watched(
    seconds: float,
    sitter: Callable[[float], Sitter | None],
    *,
    asked: Callable[[float], float | None] = lambda _: 60.0,
    shift: Callable[[float], tuple[float, float]] = lambda _: (0.0, 0.0),
    stops: Callable[[float], float] = lambda _: 0.0,
    heading: Callable[[float], float | None] = lambda _: None,
    place: Bytes | None = None,
) -> list[tuple[float, Stillness]]:
    place = room() if place is None else place
    state, seen = STILL, []
    for k in range(round(seconds / EVERY_S)):
        now = 50.0 + k * EVERY_S
        t = now - 50.0
        someone = sitter(t)
        frame = picture(place, someone, shift=shift(t), stops=stops(t), seed=k)
        state = watch(state, frame, now, asked_deg=asked(t), heading_deg=heading(t), sitter=someone)
        seen.append((t, state))
    return seen


def walking(t: float) -> Sitter:
    """Stand for two seconds, then walk across the picture."""
    return sitter_at(0.4 + 0.1 * max(t - 2.0, 0.0))


def said(seen: list[tuple[float, Stillness]]) -> list[float]:
    return [t for t, state in seen if state.left_behind]


def test_somebody_walks_and_the_camera_stays() -> None:
    seen = watched(6.0, walking)
    assert said(seen)
    assert STILL_S <= said(seen)[0] <= STILL_S + 1.5
    assert seen[-1][1].left_behind


def test_somebody_leaves_the_picture() -> None:
    seen = watched(8.0, lambda t: sitter_at(0.5) if t < 3.0 else None)
    assert said(seen)
    assert 4.0 <= said(seen)[0] <= 6.0


def test_somebody_comes_nearer() -> None:
    assert said(watched(6.0, lambda t: sitter_at(0.5, 0.2 + 0.03 * t)))


def test_changing_exposure_and_an_unsteady_heading_change_nothing() -> None:
    seen = watched(
        7.0,
        walking,
        stops=lambda t: 0.8 * np.sin(t),
        heading=lambda t: None if int(t) % 2 else 30.0 + 0.5 * np.sin(9.0 * t),
    )
    assert said(seen)


def test_somebody_who_waits_is_left_alone() -> None:
    sway = watched(20.0, lambda t: sitter_at(0.5 + 0.02 * np.sin(t), 0.25 + 0.01 * np.sin(2.0 * t)))
    assert not said(sway)
    assert sway[-1][1].since_s == pytest.approx(50.0)


def test_one_mistaken_picture_is_no_walk() -> None:
    odd = {24}
    seen = watched(10.0, lambda t: sitter_at(0.9 if round(t / EVERY_S) in odd else 0.5))
    assert not said(seen)


def test_a_face_that_is_lost_for_a_moment_has_not_left() -> None:
    assert not said(watched(12.0, lambda t: None if t % 3.0 > 1.4 else sitter_at(0.5)))


def test_nobody_at_all_says_nothing() -> None:
    assert not said(watched(10.0, lambda _: None))


@pytest.mark.parametrize("asked", [None, 0.0, ASKED_DEG - 1.0, -(ASKED_DEG - 1.0)])
def test_without_a_turn_to_make_nothing_is_said(asked: float | None) -> None:
    seen = watched(7.0, walking, asked=lambda _: asked)
    assert not said(seen)
    assert seen[-1][1] == STILL or seen[-1][1].since_s is None


def test_a_camera_in_the_hands_is_never_left_behind() -> None:
    chance = np.random.default_rng(4)
    sway = np.cumsum(chance.normal(0.0, 1.2, (60, 2)), axis=0)
    path = 0.4 * sway - 0.4 * sway.mean(axis=0)
    steps = [np.hypot(*(b - a)) for a, b in pairwise(path)]
    assert np.median(steps) < 1.5, "0.3 deg from picture to picture"
    seen = watched(10.0, walking, shift=lambda t: tuple(path[round(t / EVERY_S)]))
    assert not said(seen)


def test_a_turning_camera_is_never_left_behind() -> None:
    seen = watched(7.0, walking, shift=lambda t: (4.0 * t, 0.0))
    assert not said(seen)


def test_it_ends_when_the_camera_is_picked_up() -> None:
    seen = watched(9.0, walking, shift=lambda t: (0.0, 0.0) if t < 7.0 else (30.0 * (t - 7.0), 5.0))
    assert seen[27][1].left_behind
    assert not seen[-1][1].left_behind


def test_it_ends_inside_the_arc() -> None:
    seen = watched(8.0, walking, asked=lambda t: 40.0 if t < 7.0 else 0.0)
    assert seen[27][1].left_behind
    assert not seen[-1][1].left_behind


def test_another_heading_is_another_place() -> None:
    seen = watched(7.0, walking, heading=lambda t: 12.0 * t)
    assert not said(seen)


def test_a_blank_wall_tells_nothing() -> None:
    blank = np.full((300, 400), 150, np.uint8)
    assert not said(watched(8.0, walking, place=blank))


def test_pictures_of_another_size_begin_anew() -> None:
    state = STILL
    for k in range(40):
        frame = picture(room(), None, seed=k)[: 240 if k % 2 else 160]
        state = watch(state, frame, k * EVERY_S, asked_deg=60.0, sitter=walking(k * EVERY_S))
        assert not state.left_behind
    assert watch(state, np.zeros((4, 4, 3), np.uint8), 99.0, asked_deg=60.0) == STILL
