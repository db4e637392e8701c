"""The search of a second light against eq. 7 written down plainly."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import wrap
from app.core.base.colour import LUMINANCE_WEIGHTS
from app.core.base.errors import CoreError, StyleError
from app.core.base.progress import Token
from app.core.second_light.added_light import AddedLight, from_captured, from_numbers
from app.core.second_light.captured_lamps.captured_lamp import PlacedLamp
from app.core.second_light.contrast import (
    correlate,
    correlate_at,
    find_hidden,
    hidden_tables,
    norm_at,
    norms,
    prepare_face,
)
from app.core.second_light.lamp_presets import parse
from app.core.second_light.lamp_tables import lamp_alone, lamp_tables, left_everywhere, see_place
from app.core.second_light.placements import MIRRORED
from app.core.second_light.search import ALL, place_all
from app.core.second_light.search_kernel import seek
from app.core.solver.head_shape import HeadShape
from app.core.solver.relighting_cache import normalised
from app.core.solver.shortfall import Cause, LightShortfall
from app.core.solver.solve import solve_all
from app.core.solver.transport import render
from app.core.solver.turn_choice import PRICE
from app.core.solver.weights import target_weights
from tests.helpers.second_light import (
    captured,
    coloured_place,
    composite,
    face_basis,
    from_word,
    full_targets,
    pack,
    placed_lamp,
)
from tests.helpers.synthetic import lambert_sphere_transport, synthetic_shape

TRANSPORT = lambert_sphere_transport()


def _combinations(count: int, seed: int = 0) -> list[tuple[int, int]]:
    rng = np.random.default_rng(seed)
    return [
        (int(t), int(j))
        for t, j in zip(rng.integers(0, 64, count), rng.integers(0, 576, count), strict=True)
    ]


def _quality(
    added: AddedLight, place: NDArray[np.float32], **options: object
) -> NDArray[np.float64]:
    """(S, 64, 576) in the unit of the place."""
    tables = lamp_tables(pack(), TRANSPORT, added)
    light, scale = normalised(place, (32, 64))
    seen = see_place(tables, light, scale)
    rows = range(len(pack().styles))
    found = left_everywhere(tables, seen, rows) + lamp_alone(tables, seen, rows)[:, None]
    return found * scale


def _picture(
    added: AddedLight, place: NDArray[np.float32], turn: int, number: int, power: float = 1.0
) -> NDArray[np.float64]:
    """(P,) luminance of the rendered composite, near field included."""
    if added.light is None:
        seen = composite(added, place, turn, number)
    else:
        turned = np.roll(place, -turn, axis=1)
        seen = added.over(turned, number, power)
    picture = render(TRANSPORT, seen.astype(np.float32)) @ np.array(LUMINANCE_WEIGHTS)
    if added.light is None:
        picture = picture + power * added.pictures[number]
    return np.asarray(picture, np.float64)


def _correlation(picture: NDArray[np.float64], name: str) -> float:
    """Pearson's, of a picture and a style's target over the face region."""
    target = pack().target(name).reshape(-1, 3)[TRANSPORT.pixels] @ np.array(LUMINANCE_WEIGHTS)
    table = np.cov(target, picture, aweights=pack().region_on(TRANSPORT))
    return float(table[0, 1] / np.sqrt(table[0, 0] * table[1, 1]))


def test_quality_is_eq_7_on_the_composited_environment() -> None:
    added, place = captured(), coloured_place()
    found, targets = _quality(added, place), full_targets(pack())
    for turn, number in _combinations(240):
        plain = np.tensordot(targets, composite(added, place, turn, number), 3)
        scale = np.abs(plain).max()
        np.testing.assert_allclose(found[:, turn, number], plain, rtol=0, atol=1e-7 * scale)


def test_quality_of_a_lamp_from_numbers_is_the_near_field_formula() -> None:
    _, added = from_word("panel@0.4")
    place = coloured_place() * np.float32(5.0)
    found, targets = _quality(added, place), full_targets(pack())
    flat = pack().targets.reshape(len(pack().styles), -1, 3)[:, TRANSPORT.pixels].astype(np.float64)
    luminance = flat @ np.array(TRANSPORT.header.luminance_weights)
    weights = np.stack([target_weights(one, TRANSPORT.face) for one in luminance])
    for turn, number in _combinations(240):
        plain = np.tensordot(targets, composite(added, place, turn, number), 3)
        plain = plain + weights @ added.pictures[number].astype(np.float64)
        scale = np.abs(plain).max()
        np.testing.assert_allclose(found[:, turn, number], plain, rtol=0, atol=1e-6 * scale)


@pytest.mark.parametrize("name", ["badger", "left-loop-rim", "right-split"])
def test_the_answer_is_the_maximum_of_all_36864(name: str) -> None:
    added, place = captured(), coloured_place(5)
    target = full_targets(pack())[pack().index(name)]
    best = -np.inf
    for turn in range(64):
        turned = np.roll(place.astype(np.float64), -turn, axis=1)
        shown = target * turned
        lost = np.tensordot(added.alpha.astype(np.float64), shown.sum(axis=2), 2)
        assert added.light is not None
        values = shown.sum() - lost + np.tensordot(added.light.astype(np.float64), target, 3)
        best = max(best, float(values.max()))
    (one,) = place_all(pack(), TRANSPORT, place, added, "paper", styles=[name])
    assert one.quality == pytest.approx(best, rel=1e-6)
    plain = float((target * composite(added, place, one.turn_index, one.placement)).sum())
    assert one.quality == pytest.approx(plain, rel=1e-6)
    assert one.evaluated == ALL == 36864
    assert one.map.shape == (9, 64)
    assert one.map.max() == pytest.approx(one.quality, rel=1e-6)


@pytest.mark.parametrize("word", ["", "panel@0.4"])
def test_match_is_the_correlation_with_the_rendered_picture(word: str) -> None:
    added = from_word(word)[1] if word else captured()
    place = coloured_place(7) * np.float32(20.0)
    for one in place_all(pack(), TRANSPORT, place, added):
        picture = _picture(added, place, one.turn_index, one.placement)
        plain = 100 * _correlation(picture, one.name)
        assert one.match == pytest.approx(plain, abs=0.5)
        assert one.map.ravel()[one.placement] == pytest.approx(one.match, abs=0.5)


def test_contrast_holds_when_the_lamp_hides_the_sun() -> None:
    added = captured(1.0)
    place = np.ones((32, 64, 3), np.float32)
    place[10, 31] = 50_000.0
    found = norms(added.contrast, added.hidden, place, 1.0).at(1.0)
    region = pack().region_on(TRANSPORT)
    behind = np.abs(found - found.max()).argmax()
    checked = [divmod(int(behind), 576), *_combinations(40)]
    assert found.min() < 0.2 * found.max()
    for turn, number in checked:
        picture = _picture(added, place, turn, number)
        mean = region @ picture / region.sum()
        exact = float(np.sqrt(region @ (picture - mean) ** 2))
        assert found[turn, number] == pytest.approx(exact, rel=0.01)
        all_in = norm_at(added.contrast, added.hidden, place, 1.0, turn, number)
        assert all_in == pytest.approx(exact, rel=0.003)


def test_one_turn_alone_gives_the_same() -> None:
    rng = np.random.default_rng(1)
    hidden = find_hidden(placed_lamp().alpha)
    tables = tuple(hidden_tables(hidden, rng.standard_normal((3, 4096))))
    light = rng.random((2, 32, 64))
    whole = correlate(hidden, tables, light)
    np.testing.assert_allclose(correlate_at(hidden, tables, light, 11), whole[:, 11], rtol=1e-10)
    added, place = captured(), coloured_place()
    every = norms(added.contrast, added.hidden, place, 2.0).at(0.5)
    alone = norms(added.contrast, added.hidden, place, 2.0, 50).at(0.5)
    np.testing.assert_allclose(alone[0], every[50], rtol=1e-4)


def test_a_lamp_that_hides_nothing_and_one_that_hides_everything() -> None:
    hidden = find_hidden(np.zeros((576, 32, 64)))
    tables = tuple(hidden_tables(hidden, np.ones((2, 4096))))
    assert not correlate(hidden, tables, np.ones((2, 32, 64))).any()
    with pytest.raises(CoreError, match="covers almost everything"):
        find_hidden(np.ones((576, 32, 64)))


@pytest.mark.parametrize("objective", ["picture", "paper"])
def test_a_mirrored_place_gives_the_mirrored_answer(objective: str) -> None:
    place = coloured_place(11) * np.float32(30.0)
    added = captured()
    here = place_all(pack(), TRANSPORT, place, added, objective)  # type: ignore[arg-type]
    there = place_all(pack(), TRANSPORT, place[:, ::-1], added, objective)  # type: ignore[arg-type]
    by_name = {one.name: one for one in there}
    for one in here:
        twin = one.name.replace("left", "*").replace("right", "left").replace("*", "right")
        other = by_name[twin]
        assert other.turn_deg == wrap(-one.turn_deg)
        assert other.placement == MIRRORED[one.placement]
        assert wrap(other.turn_refined_deg + one.turn_refined_deg) == pytest.approx(0, abs=0.05)
        azimuths = other.lamp_azimuth_refined_deg + one.lamp_azimuth_refined_deg
        assert wrap(azimuths) == pytest.approx(0, abs=0.05)
        assert other.lamp_altitude_refined_deg == pytest.approx(
            one.lamp_altitude_refined_deg, abs=0.05
        )
        assert other.match == pytest.approx(one.match, abs=1e-3)
        assert other.quality == pytest.approx(one.quality, rel=1e-5)


def test_sides_a_lamp_in_a_dim_even_room_stands_where_the_style_has_its_own() -> None:
    place = np.full((32, 64, 3), 0.2, np.float32)
    found = {one.name: one for one in place_all(pack(), TRANSPORT, place, captured())}
    assert found["left-split"].lamp_azimuth_refined_deg == pytest.approx(90.0, abs=12.0)
    assert found["right-split"].lamp_azimuth_refined_deg == pytest.approx(-90.0, abs=12.0)
    assert found["below"].lamp_altitude_deg < -20
    assert found["top"].lamp_altitude_deg > 40
    assert not found["left-split"].before.attainable
    assert found["left-split"].rescued


def test_equal_combinations_take_the_smaller_turn_then_azimuth_then_altitude() -> None:
    # A room that is the same all around its axis: every turn is as good as any other.
    place = np.full((32, 64, 3), 0.3, np.float32)
    for one in place_all(pack(), TRANSPORT, place, captured(), "paper"):
        assert one.turn_deg == 0.0
    (flat,) = place_all(pack(), TRANSPORT, place, captured(), "paper", styles=["flat"])
    assert flat.lamp_azimuth_deg >= 0


def test_the_front_moves_turns_and_nothing_else() -> None:
    place, added = coloured_place() * np.float32(20.0), captured()
    plain = place_all(pack(), TRANSPORT, place, added)
    moved = place_all(pack(), TRANSPORT, place, added, front_deg=90.0)
    for one, other in zip(plain, moved, strict=True):
        assert other.turn_deg == wrap(one.turn_deg - 90.0)
        assert other.turn_refined_deg == pytest.approx(wrap(one.turn_refined_deg - 90.0), abs=1e-9)
        assert other.turn_index == one.turn_index
        assert other.placement == one.placement
        assert other.before.turn_deg == wrap(one.before.turn_deg - 90.0)


def test_only_what_is_allowed_is_chosen() -> None:
    place, added = coloured_place() * np.float32(20.0), captured()
    allowed = np.zeros(576, bool)
    allowed[[4 * 64 + 3, 4 * 64 + 4, 5 * 64 + 40]] = True
    for objective in ("picture", "paper"):
        for one in place_all(pack(), TRANSPORT, place, added, objective, is_open=allowed):
            assert allowed[one.placement]
            # No neighbour on both sides may be reached: the lamp stays where it is.
            assert one.lamp_azimuth_refined_deg == one.lamp_azimuth_deg
            assert one.lamp_altitude_refined_deg == one.lamp_altitude_deg
            assert one.evaluated == 64 * 3
    with pytest.raises(CoreError, match="cannot be held"):
        place_all(pack(), TRANSPORT, place, added, is_open=np.zeros(576, bool))


def test_refined_angles_are_near_and_not_worse() -> None:
    place = np.full((32, 64, 3), 0.2, np.float32)
    added = captured()
    for one in place_all(pack(), TRANSPORT, place, added):
        assert abs(wrap(one.turn_refined_deg - one.turn_deg)) <= 5.625 / 2 + 1e-9
        assert abs(wrap(one.lamp_azimuth_refined_deg - one.lamp_azimuth_deg)) <= 5.625 / 2 + 1e-9
        assert abs(one.lamp_altitude_refined_deg - one.lamp_altitude_deg) <= 16.875 / 2 + 1e-9


def test_greedy_turns_first_and_never_beats_the_full_search() -> None:
    place, added = coloured_place(9) * np.float32(10.0), captured()
    full = place_all(pack(), TRANSPORT, place, added, "paper")
    greedy = place_all(pack(), TRANSPORT, place, added, "paper", greedy=True)
    for one, quick in zip(full, greedy, strict=True):
        assert quick.evaluated == 64 + 576
        assert quick.turn_index == quick.before.turn_index
        assert quick.turn_refined_deg == quick.before.turn_refined_deg
        assert quick.quality <= one.quality + 1e-9 * abs(one.quality)
        line = _quality(added, place)[pack().index(one.name), quick.turn_index]
        assert quick.quality == pytest.approx(line.max(), rel=1e-6)
    greedy = place_all(pack(), TRANSPORT, place, added, greedy=True)
    assert [one.turn_index for one in greedy] == [one.before.turn_index for one in greedy]


def test_before_is_what_the_place_gives_alone() -> None:
    place = coloured_place(2)
    for one, alone in zip(
        place_all(pack(), TRANSPORT, place, captured()), solve_all(pack(), place), strict=True
    ):
        assert one.before.match == alone.match
        assert one.before.turn_deg == alone.turn_deg


def test_dimming_finds_the_power_that_fits() -> None:
    place, added = coloured_place(4, 0.8), captured(4000.0)
    powers = (1.0, 1 / 8, 1 / 64)
    full = place_all(pack(), TRANSPORT, place, added)
    dimmed = place_all(pack(), TRANSPORT, place, added, powers=powers)
    assert {one.power for one in dimmed} - {1.0}
    for one, at_full in zip(dimmed, full, strict=True):
        assert one.power in powers
        assert one.attainable or not at_full.attainable
        if one.attainable == at_full.attainable:
            # A turn towards the middle of its arc costs up to a point.
            assert one.match >= at_full.match - 0.5 - PRICE
        picture = _picture(added, place, one.turn_index, one.placement, one.power)
        plain = 100 * _correlation(picture, one.name)
        assert one.match == pytest.approx(plain, abs=0.5)


def test_a_lamp_too_weak_says_so() -> None:
    place = coloured_place() * np.float32(1e6)
    found = place_all(pack(), TRANSPORT, place, captured(), styles=["below", "badger"])
    lacks = [one.shortfall for one in found if not one.attainable]
    assert lacks
    for shortfall in lacks:
        assert isinstance(shortfall, LightShortfall)
        assert shortfall.cause is Cause.WEAK_LAMP


def test_strength_is_that_of_solve_without_any_lamp() -> None:
    place = coloured_place(6)
    nothing = PlacedLamp(
        "none",
        "Nothing",
        np.zeros((576, 32, 64, 3), np.float32),
        np.zeros((576, 32, 64), np.float32),
        1.0,
    )
    added = from_captured(TRANSPORT, nothing, face=face_basis())
    for one in place_all(pack(), TRANSPORT, place, added):
        assert one.turn_index == one.before.turn_index
        assert one.strength == pytest.approx(one.before.strength, rel=1e-6)
        assert one.match == pytest.approx(one.before.match, abs=0.5)
        assert one.attainable == one.before.attainable
        assert one.turn_refined_deg == pytest.approx(one.before.turn_refined_deg, abs=2.9)


def test_bad_input_is_a_sentence() -> None:
    good = placed_lamp()
    bad = partial(replace, replace(good, title="A"))
    with pytest.raises(CoreError, match="is damaged"):
        from_captured(TRANSPORT, bad(light=good.light[:5]), face=face_basis())
    with pytest.raises(CoreError, match="is damaged"):
        from_captured(TRANSPORT, bad(light=good.light * np.float32(np.nan)), face=face_basis())
    with pytest.raises(CoreError, match="mask of A"):
        from_captured(TRANSPORT, bad(alpha=good.alpha * 2), face=face_basis())
    with pytest.raises(CoreError, match="black"):
        place_all(pack(), TRANSPORT, np.zeros((32, 64, 3)), captured())
    with pytest.raises(StyleError):
        place_all(pack(), TRANSPORT, coloured_place(), captured(), styles=["disco"])
    coarse = lambert_sphere_transport(36, (16, 32))
    with pytest.raises(CoreError, match="64 x 32"):
        prepare_face(coarse, coarse.face.astype(float))


def test_preparing_can_be_cancelled() -> None:
    token = Token()
    token.cancel()
    shape: HeadShape = synthetic_shape()
    with pytest.raises(CoreError):
        from_numbers(TRANSPORT, shape, parse("phone@0.3"), token, face=face_basis())


def test_grey_light_may_come_without_colours() -> None:
    grey = coloured_place().mean(axis=2)
    both = np.repeat(grey[..., None], 3, axis=2)
    one = place_all(pack(), TRANSPORT, grey, captured(), styles=["badger"])[0]
    other = place_all(pack(), TRANSPORT, both, captured(), styles=["badger"])[0]
    assert one.placement == other.placement
    assert one.match == pytest.approx(other.match, abs=1e-3)


def test_seeking_needs_some_place() -> None:
    tables = lamp_tables(pack(), TRANSPORT, captured())
    light, scale = normalised(coloured_place(), (32, 64))
    with pytest.raises(CoreError, match="within reach"):
        seek(tables, see_place(tables, light, scale), [0], is_open=np.zeros(576, bool))
