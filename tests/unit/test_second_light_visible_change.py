"""What the eye sees of a lamp: the change of L* between two pictures of a head."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.second_light.lamp_spot import LampSpot
from app.core.second_light.place_pictures import PlacePictures, lamp_pictures, place_pictures
from app.core.second_light.placements import placement
from app.core.second_light.search import LampPlacement, place_all
from app.core.second_light.visible_change import (
    VISIBLE,
    VisibleChange,
    lightness,
    visible_change,
)
from app.core.solver.place_light import Expose
from app.core.solver.style_signature import Grade
from app.core.solver.transport import render
from tests.helpers.second_light import captured, coloured_place, from_word, pack
from tests.helpers.synthetic import lambert_sphere_transport

SIZE = 100
FACE = 2700  # pixels, of which 270 decide
TRANSPORT = lambert_sphere_transport()
SPHERE = 2000  # pixels of the face of that head
RULES: tuple[Expose, ...] = ("face", "dark", "background")


def grey(lightness_: float) -> NDArray[np.float32]:
    """Return an even picture of an L*, by the inverse of the CIE's formula above L* 8."""
    return np.full((SIZE, SIZE, 3), ((lightness_ + 16.0) / 116.0) ** 3, np.float32)


def change(before: NDArray[np.float32], after: NDArray[np.float32]) -> float:
    full = np.ones((SIZE, SIZE), np.float32)
    return visible_change(before, after, full, FACE).delta_lightness


def test_lightness_has_the_values_of_the_standard() -> None:
    # From tables of CIE 1976 L*: Y 18.42 % is 50, Y 1 % is 8.99, Y 0.5 % is 4.52.
    tones = np.array([0.1842, 0.01, 0.005])
    values = lightness(np.repeat(tones[:, None], 3, axis=1))
    np.testing.assert_allclose(values, [50.0, 8.99, 4.52], atol=0.01)


def test_equal_pictures_do_not_change() -> None:
    picture = np.random.default_rng(1).random((SIZE, SIZE, 3)).astype(np.float32)
    assert change(picture, picture) == 0.0


@pytest.mark.parametrize("step", [0.5, 3.0, -7.0])
def test_an_even_change_is_its_own_size(step: float) -> None:
    assert change(grey(50.0), grey(50.0 + step)) == pytest.approx(abs(step), abs=0.01)


def test_a_changed_part_of_a_tenth_of_the_face_counts_in_full() -> None:
    # 16 x 17 pixels; the blur takes a little at their edge.
    before, after = grey(50.0), grey(50.0)
    after[40:56, 30:47] = grey(60.0)[0, 0]
    assert 7.0 < change(before, after) <= 10.0
    # A band of a rim's width has the same area.
    band = grey(50.0)
    band[10:78, 20:24] = grey(60.0)[0, 0]
    assert change(before, band) > VISIBLE


def test_a_speck_is_not_a_change() -> None:
    before, after = grey(40.0), grey(40.0)
    after[50:52, 50:52] = grey(70.0)[0, 0]
    assert change(before, after) < VISIBLE


def test_a_change_behind_the_head_does_not_count() -> None:
    before, after = grey(50.0), grey(50.0)
    after[:, 60:] = grey(70.0)[0, 0]
    coverage = np.zeros((SIZE, SIZE), np.float32)
    coverage[:, :60] = 1.0
    assert visible_change(before, after, coverage, FACE).delta_lightness == 0.0


def test_clipped_tones_look_alike() -> None:
    bright = np.full((SIZE, SIZE, 3), 20.0, np.float32)
    assert change(bright, 2.0 * bright) < 0.5


def test_black_pictures_do_not_change() -> None:
    black = np.zeros((SIZE, SIZE, 3), np.float32)
    assert change(black, black) == 0.0


def test_two_just_noticeable_differences_are_visible() -> None:
    assert pytest.approx(2 * 2.3) == VISIBLE
    assert VisibleChange(4.6).visible
    assert not VisibleChange(4.59).visible


def alone(light: NDArray[np.float32], *turns: int) -> PlacePictures:
    return place_pictures(TRANSPORT, light, turns, SPHERE)


@pytest.mark.parametrize("expose", RULES)
def test_a_picture_of_the_place_itself_does_not_change(expose: Expose) -> None:
    light = coloured_place()
    same = render(TRANSPORT, np.roll(light, -5, axis=1))
    change = alone(light, 5, 9).change(expose, (9, 5), same)
    assert change.delta_lightness == pytest.approx(0.0, abs=1e-3)
    # Neither does one that the best turn without the lamp gives as well.
    best = render(TRANSPORT, np.roll(light, -9, axis=1))
    change = alone(light, 5, 9).change("face", (9, 5), best)
    assert change.delta_lightness == pytest.approx(0.0, abs=1e-3)


def test_brighter_light_is_exposed_away_unless_the_background_decides() -> None:
    light = coloured_place()
    brighter = 4.0 * render(TRANSPORT, light)
    scene = alone(light, 0)
    assert scene.change("face", (0, 0), brighter).delta_lightness < 1e-3
    assert scene.change("dark", (0, 0), brighter).delta_lightness < 1e-3
    assert scene.change("background", (0, 0), brighter).visible


def test_the_change_does_not_depend_on_the_exposure_of_the_place() -> None:
    light = coloured_place()
    here = place_all(pack(), TRANSPORT, light, captured(400.0))
    there = place_all(pack(), TRANSPORT, light * np.float32(2.0), captured(800.0))
    for one, other in zip(here, there, strict=True):
        assert other.placement == one.placement
        # Lamp and place have single precision.
        wanted = pytest.approx(one.change.delta_lightness, abs=0.02)
        assert other.change.delta_lightness == wanted


@pytest.mark.parametrize("word", ["", "phone@0.3"])
def test_the_picture_with_a_lamp_has_the_light_of_both(word: str) -> None:
    added = from_word(word)[1] if word else captured()
    light, spot, power = coloured_place(), LampSpot(7, 300), 0.5
    turned = np.roll(light, -spot.turn, axis=1)
    (picture,) = lamp_pictures(TRANSPORT, light, added, [spot], [power])
    weights = np.asarray(TRANSPORT.header.luminance_weights)
    shade = (1.0 - added.alpha[spot.number])[..., None]
    wanted = render(TRANSPORT, turned * shade) @ weights + power * added.pictures[spot.number]
    np.testing.assert_allclose(picture @ weights, wanted, rtol=1e-3, atol=1e-3 * wanted.max())
    assert placement(spot.number)[0] != 0.0


def test_only_a_higher_grade_that_is_visible_is_a_rescue() -> None:
    one = place_all(pack(), TRANSPORT, coloured_place(), captured(), styles=["badger"])[0]
    seen, same = VisibleChange(VISIBLE), VisibleChange(VISIBLE - 0.01)

    def graded(before: Grade | None, after: Grade | None, change: VisibleChange) -> LampPlacement:
        old = replace(one.before, grade=before, attainable=before in ("soft", "yes"))
        return replace(
            one, before=old, grade=after, attainable=after in ("soft", "yes"), change=change
        )

    assert graded("no", "soft", seen).rescued
    assert graded("no", "yes", seen).rescued
    assert graded("soft", "yes", seen).raised
    assert not graded("soft", "yes", seen).rescued
    assert not graded("yes", "yes", seen).raised
    assert not graded("yes", "soft", seen).raised
    assert not graded("no", "yes", same).rescued
    assert graded("no", "yes", same).hardly_changed
    # A painted style has no grade: its limits and the eye decide.
    painted = replace(graded(None, None, seen), attainable=True)
    assert painted.rescued
    assert not replace(painted, change=same).rescued


def test_a_lamp_is_only_said_to_help_where_its_effect_is_visible() -> None:
    # A strong lamp in a dim even room, and the same lamp at a ten-thousandth of its power.
    room = np.full((32, 64, 3), 0.2, np.float32)
    for one in place_all(pack(), TRANSPORT, room, captured(400.0)):
        assert one.change.visible
        assert one.rescued == (one.attainable and not one.before.attainable)
    for one in place_all(pack(), TRANSPORT, coloured_place(), captured(4e-3)):
        assert one.hardly_changed == (not one.change.visible)
        if one.hardly_changed:
            assert not one.rescued
