"""The second light on the real head: exactness, rescue in the dark, both sides."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import wrap
from app.core.base.paths import resources
from app.core.environment.environment import read_environment, reduce
from app.core.second_light.added_light import AddedLight, from_captured, from_numbers, prepare_near
from app.core.second_light.captured_lamps.captured_lamp import make_lamp, place_lamp
from app.core.second_light.contrast import FaceBasis, less_mean, prepare_face
from app.core.second_light.lamp_presets import parse, powers_of
from app.core.second_light.lamp_tables import (
    LampTables,
    lamp_alone,
    lamp_tables,
    left_everywhere,
    see_place,
)
from app.core.second_light.place_brightness import illuminance
from app.core.second_light.placements import placement
from app.core.second_light.search import LampPlacement, place_all
from app.core.second_light.visible_change import VISIBLE
from app.core.solver.head_shape import load_shape_of
from app.core.solver.relighting_cache import normalised
from app.core.solver.transport import Transport, render
from app.core.solver.weights import target_weights
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack, load_transport_of
from app.core.styles.styles import NAMES
from tests.helpers.cases import sample_first
from tests.helpers.second_light import answers_per_steradian, composite, full_targets, plain_near
from tests.helpers.shared import SHARED, needs_shared

DIM = {
    "dikhololo_night": 5.0,
    "st_peters_square_night": 5.0,
    "drachenfels_cellar": 30.0,
    "empty_warehouse_01": 150.0,
    "leadenhall_market": 200.0,
    "lebombo": 200.0,
    "st_fagans_interior": 300.0,
}
OTHERS = ("quarry_01", "rooitou_park", "potsdamer_platz")

pytestmark = pytest.mark.slow


@cache
def _head() -> tuple[StylePack, Transport, FaceBasis]:
    pack = load_named_pack("generic")
    transport = load_transport_of(pack, "generic")
    return pack, transport, prepare_face(transport, pack.region_on(transport))


@cache
def _lamp(word: str) -> tuple[AddedLight, LampTables]:
    pack, transport, face = _head()
    if word == "captured":
        light = np.full((256, 512, 3), 0.01, np.float32)
        alpha = np.zeros((256, 512), np.float32)
        alpha[118:150, 250:270] = 1.0  # not in the middle, and not its own mirror image
        light[118:150, 250:270] = (700.0, 600.0, 420.0)
        light[118:124, 250:256] *= 6.0
        lamp = make_lamp("tall", light, alpha, white_cd_m2=1.0, distance_m=0.4)
        added = from_captured(transport, place_lamp(lamp), face=face)
    else:
        shape = load_shape_of(transport, "generic")
        near = prepare_near(transport, shape)
        added = from_numbers(transport, shape, parse(word), near=near, face=face)
    return added, lamp_tables(pack, transport, added)


@cache
def _scene(name: str, lux: float) -> NDArray[np.float32]:
    light = reduce(read_environment(SHARED / "hdri" / f"{name}_1k.hdr"))
    return light * np.float32(lux / illuminance(light))


@needs_shared
@pytest.mark.parametrize("name", sample_first([*DIM, *OTHERS], 3))
def test_quality_and_its_maximum_are_eq_7(name: str) -> None:
    pack, transport, _ = _head()
    added, tables = _lamp("captured")
    place = _scene(name, DIM.get(name, 8000.0))
    light, scale = normalised(place, (32, 64))
    seen = see_place(tables, light, scale)
    found = (
        left_everywhere(tables, seen, range(len(NAMES)))
        + lamp_alone(tables, seen, range(len(NAMES)))[:, None]
    )
    found *= scale
    targets = full_targets(pack)
    rng = np.random.default_rng(1)
    for turn, number in zip(rng.integers(0, 64, 220), rng.integers(0, 576, 220), strict=True):
        plain = np.tensordot(targets, composite(added, place, turn, number), 3)
        np.testing.assert_allclose(
            found[:, turn, number], plain, rtol=1e-4, atol=1e-6 * np.abs(plain).max()
        )
    for row, one in enumerate(place_all(pack, transport, place, added, "paper", tables=tables)):
        assert one.quality == pytest.approx(float(found[row].max()), rel=1e-6)
        whole = float((targets[row] * composite(added, place, one.turn_index, one.placement)).sum())
        assert one.quality == pytest.approx(whole, rel=1e-4)


@needs_shared
@pytest.mark.parametrize("word", ["phone@0.3", "panel@0.6"])
def test_with_a_lamp_from_numbers_it_is_eq_7_with_the_near_picture(word: str) -> None:
    """C = F . (1 - a) L + f . N: N by the formula written down, then all 36,864 of each style."""
    pack, transport, _ = _head()
    added, tables = _lamp(word)
    targets = full_targets(pack)
    weights = np.asarray(transport.header.luminance_weights)
    pictures = (
        pack.targets.reshape(len(NAMES), -1, 3)[:, transport.pixels].astype(np.float64) @ weights
    )
    f = np.stack([target_weights(picture, transport.face) for picture in pictures])
    rng = np.random.default_rng(5)
    numbers, turns = rng.choice(576, 28, replace=False), rng.integers(0, 64, (28, 8))
    for name in ("lebombo", "rooitou_park", "dikhololo_night"):
        place = _scene(name, DIM.get(name, 60000.0))
        light, scale = normalised(place, (32, 64))
        seen = see_place(tables, light, scale)
        rows = range(len(NAMES))
        found = left_everywhere(tables, seen, rows)
        found = (found + lamp_alone(tables, seen, rows)[:, None]) * scale
        for number, some in zip(numbers.tolist(), turns.tolist(), strict=True):
            near = f @ _plain_near(word, number)
            for turn in some:
                plain = np.tensordot(targets, composite(added, place, turn, number), 3) + near
                most = np.abs(found[:, turn]).max(axis=1)
                np.testing.assert_array_less(np.abs(found[:, turn, number] - plain), 1e-4 * most)
        best = _brute_force(targets, added, place, f @ added.pictures.T.astype(np.float64))
        answers = place_all(pack, transport, place, added, "paper", tables=tables)
        for one, most in zip(answers, best.tolist(), strict=True):
            assert one.quality == pytest.approx(most, rel=1e-4)


@cache
def _answers() -> NDArray[np.float64]:
    return answers_per_steradian(_head()[1])


@cache
def _plain_near(word: str, number: int) -> NDArray[np.float64]:
    transport = _head()[1]
    shape = load_shape_of(transport, "generic")
    return plain_near(_answers(), shape, parse(word), *placement(number))


def _brute_force(
    targets: NDArray[np.float64],
    added: AddedLight,
    place: NDArray[np.float32],
    near: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(S,) largest quality of all turns and placements."""
    clear = 1.0 - added.alpha.reshape(576, -1).astype(np.float64)
    best = np.full(len(targets), -np.inf)
    for turn in range(64):
        turned = np.roll(place.astype(np.float64), -turn, axis=1)
        shown = (targets * turned).sum(axis=3).reshape(len(targets), -1)
        best = np.maximum(best, (shown @ clear.T + near).max(axis=1))
    return best


@needs_shared
@pytest.mark.parametrize("word", ["captured", "panel@0.3"])
def test_match_is_that_of_the_rendered_picture(word: str) -> None:
    pack, transport, _ = _head()
    added, tables = _lamp(word)
    weights = np.asarray(transport.header.luminance_weights)
    region = pack.region_on(transport)
    for name in ("lebombo", "rooitou_park", "dikhololo_night"):
        place = _scene(name, DIM.get(name, 8000.0))
        # Match over areas, as silhouettes have, is no correlation of pictures.
        faces = [style.name for style in pack.styles if not style.signature.areas]
        for one in place_all(pack, transport, place, added, styles=faces, tables=tables):
            seen = composite(added, place, one.turn_index, one.placement).astype(np.float32)
            picture = render(transport, seen) @ weights
            if added.light is None:
                picture = picture + added.pictures[one.placement]
            target = pack.target(one.name).reshape(-1, 3)[transport.pixels] @ weights
            table = np.cov(target, picture, aweights=region)
            plain = 100 * table[0, 1] / np.sqrt(table[0, 0] * table[1, 1])
            assert one.match == pytest.approx(plain, abs=0.5)
            assert one.map.ravel()[one.placement] == pytest.approx(plain, abs=0.5)


@needs_shared
@pytest.mark.parametrize(
    "name", sample_first(["quarry_01", "lebombo", "rooitou_park", "chinese_garden"], 2)
)
@pytest.mark.parametrize("word", ["captured", "phone@0.3", "softbox@1"])
def test_the_map_holds_the_match_of_every_placement(word: str, name: str) -> None:
    """Also where the lamp hides the sun."""
    pack, transport, _ = _head()
    added, tables = _lamp(word)
    place = _scene(name, DIM.get(name, 60000.0))
    weights = np.asarray(transport.header.luminance_weights)
    region = pack.region_on(transport)
    styles = ["butterfly", "left-rim", "left-loop", "below", "badger"]
    for one in place_all(pack, transport, place, added, styles=styles, tables=tables):
        clear = 1.0 - added.alpha.astype(np.float32)[..., None]
        lights = clear * np.roll(place, -one.turn_index, axis=1).astype(np.float32)
        if added.light is not None:
            lights = lights + added.light
        flat = lights.reshape(576, -1, 3)
        pictures = np.zeros((576, len(transport.pixels)), np.float32)
        for channel, weight in enumerate(weights.tolist()):
            seen = (flat[..., channel] @ transport.texel_basis.T) * np.float32(weight)
            pictures += seen @ transport.pixel_basis[channel].T
        if added.light is None:
            pictures += added.pictures
        target = pack.target(one.name).reshape(-1, 3)[transport.pixels] @ weights
        centred, target = (less_mean(each, np.sqrt(region)) for each in (pictures, target))
        plain = 100 * centred @ target / np.linalg.norm(centred, axis=1) / np.linalg.norm(target)
        np.testing.assert_allclose(one.map.ravel(), plain, atol=0.5)


@needs_shared
@pytest.mark.parametrize("name", DIM)
def test_a_panel_at_30_cm_makes_badger_and_loop_rim_better_in_the_dark(name: str) -> None:
    pack, transport, _ = _head()
    added, tables = _lamp("panel@0.3")
    styles = ["badger", "left-loop-rim", "right-loop-rim"]
    found = place_all(
        pack,
        transport,
        _scene(name, DIM[name]),
        added,
        styles=styles,
        powers=powers_of("panel"),
        tables=tables,
    )
    for one in found:
        assert one.match > one.before.match
        assert one.attainable or not one.before.attainable


@needs_shared
def test_a_mirrored_place_gives_the_mirrored_answer() -> None:
    pack, transport, _ = _head()
    added, tables = _lamp("panel@0.3")
    place = _scene("drachenfels_cellar", 30.0)

    def answers(light: NDArray[np.float32]) -> dict[str, LampPlacement]:
        found = place_all(pack, transport, light, added, powers=(1 / 32, 1 / 64), tables=tables)
        return {one.name: one for one in found}

    here, there = answers(place), answers(place[:, ::-1])
    for name in ("left-loop-rim", "right-split", "left-below-side"):
        twin = name.replace("left", "*").replace("right", "left").replace("*", "right")
        one, other = here[name], there[twin]
        assert wrap(other.turn_deg + one.turn_deg) == 0.0
        assert wrap(other.lamp_azimuth_deg + one.lamp_azimuth_deg) == 0.0
        assert other.lamp_altitude_deg == one.lamp_altitude_deg
        assert other.match == pytest.approx(one.match, abs=0.05)


def _on_demo_place(name: str, lux: float, word: str) -> dict[str, LampPlacement]:
    pack, transport, _ = _head()
    added, tables = _lamp(word)
    light = reduce(read_environment(resources() / "demo" / "scenes" / f"{name}.exr"))
    light = light * np.float32(lux / illuminance(light))
    powers = powers_of(word.partition("@")[0])
    found = place_all(pack, transport, light, added, powers=powers, tables=tables)
    return {one.name: one for one in found}


def test_a_phone_at_2_m_in_a_bright_place_is_not_said_to_help() -> None:
    for name, lux in {"sunset": 800.0, "sunrise": 1500.0, "courtyard": 20000.0}.items():
        for one in _on_demo_place(name, lux, "phone@2").values():
            if one.raised:
                assert one.hardly_changed
            assert not one.rescued
            if one.turn_index == one.before.turn_index:
                assert one.change.delta_lightness < 1.0


def test_a_panel_in_a_dark_place_is_said_to_help() -> None:
    found = _on_demo_place("night", 30.0, "panel@1")
    for name in ("right-split", "left-loop", "below", "left-window"):
        assert not found[name].before.attainable
        assert found[name].rescued
        assert found[name].change.delta_lightness > 2.0 * VISIBLE
