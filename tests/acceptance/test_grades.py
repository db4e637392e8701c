"""Grades under light whose answer is known: one lamp from anywhere, even light, pairs of lamps."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import difference, wrap
from app.core.environment.environment import reduce_light
from app.core.solver.search import curves
from app.core.solver.solve import measure, solve_all
from app.core.solver.style_result import StyleResult
from app.core.solver.style_signature import YES
from app.core.solver.style_verdict import measure_picture
from app.core.solver.transport import load_named
from app.core.styles.lamps import far_lamp
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack, pack_names
from app.core.styles.styles import mirror_name

Float32 = NDArray[np.float32]
ROWS, COLUMNS = 512, 1024
SIZES_DEG = (0.5, 5.0, 15.0, 40.0)
PIXEL_DEG = 360.0 / COLUMNS
HEADS = pack_names()
_APART_DEG = 0.5


@cache
def _rays() -> NDArray[np.float32]:
    azimuth = ((np.arange(COLUMNS) + 0.5) / COLUMNS - 0.5) * 2 * np.pi
    elevation = np.pi * (0.5 - (np.arange(ROWS) + 0.5) / ROWS)
    a, e = np.meshgrid(azimuth, elevation)
    rays = np.stack([np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)], axis=-1)
    return rays.astype(np.float32)


@cache
def _pack(head: str) -> StylePack:
    return load_named_pack(head)


def panorama(azimuth_deg: float, elevation_deg: float, diameter_deg: float) -> Float32:
    """(512, 1024, 3) panorama of one round lamp, its edge smooth over a pixel."""
    a, e = np.radians(azimuth_deg), np.radians(elevation_deg)
    toward = np.array([np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)], np.float32)
    away = np.degrees(np.arccos(np.clip(_rays() @ toward, -1, 1)))
    lamp = np.clip((diameter_deg / 2 - away) / PIXEL_DEG + 0.5, 0, 1)
    return np.repeat(lamp[..., None], 3, axis=2).astype(np.float32)


def light_of(*lamps: tuple[float, float, float]) -> Float32:
    """(32, 64, 3) light of lamps at azimuth, elevation and diameter, deg."""
    whole = np.sum([panorama(*lamp) for lamp in lamps], axis=0)
    return reduce_light(whole.astype(np.float32))


def _by_name(pack: StylePack, light: Float32) -> dict[str, StyleResult]:
    return {result.name: result for result in solve_all(pack, light)}


def _directions(count: int, seed: int) -> list[tuple[float, float]]:
    rng = np.random.default_rng(seed)
    azimuth = rng.uniform(-180, 180, count)
    elevation = np.degrees(np.arcsin(rng.uniform(-1, 1, count)))
    return list(zip(azimuth.tolist(), elevation.tolist(), strict=True))


def _within(angle: float, ends: tuple[float, float], more: float) -> bool:
    """Whether an azimuth lies between two; from a larger to a smaller one around the back."""
    middle = wrap(ends[0] + ((ends[1] - ends[0]) % 360.0) / 2)
    half = ((ends[1] - ends[0]) % 360.0) / 2
    return abs(wrap(angle - middle)) <= half + more


@pytest.mark.parametrize("size", [*SIZES_DEG, 50.0])
def test_one_lamp_gives_each_style_where_its_file_says(size: float) -> None:
    pack, wrong, dear = _pack("generic"), [], []
    large = size > max(SIZES_DEG)  # what asks for small lamps, too, is held by those
    styles = [style for style in pack.styles if style.key_diameter_deg or not large]
    for azimuth, elevation in _directions(50, round(10 * size)):
        found = _by_name(pack, light_of((azimuth, elevation, size)))
        for style in styles:
            result = found[style.name]
            side = wrap(result.turn_refined_deg - azimuth)
            told = (style.name, round(elevation), result.grade, round(side))
            if style.key_elevation_deg is None or style.key_azimuth_deg is None:
                wrong += [told] if result.grade == "yes" else []
                continue
            low, high = style.key_elevation_deg
            least, most = style.key_diameter_deg or (0.0, 90.0)
            if style.signature.areas and size < least:
                continue  # in a black room, even a small lamp behind the head does it
            if result.grade == "yes" and result.match < result.match_curve.max() - 4.0:
                # Yes at a narrow edge of the signature, far from where the picture matches best.
                dear.append(told)
            elif result.grade == "yes":
                wrong += [] if low - 5 <= elevation <= high + 5 else [told]
                wrong += [] if _within(side, style.key_azimuth_deg, 5.0) else [told]
                wrong += [] if least - 5 <= size <= most + 5 else [told]
            elif low + 5 <= elevation <= high - 5 and least <= size <= most:
                wrong.append(told)
    assert wrong == []
    assert len(dear) <= 0.02 * 50 * len(styles), dear


@pytest.mark.parametrize("size", SIZES_DEG)
@pytest.mark.parametrize("elevation", [5.0, 30.0, 45.0])
@pytest.mark.usefixtures("best_turns")
def test_the_best_turn_follows_a_lamp_that_moves_within_a_texel(
    size: float, elevation: float
) -> None:
    """Against the same lamp elsewhere: the turn moves as far as the lamp."""
    pack, steps = _pack("generic"), np.arange(8) * 5.625 / 8 + 20.0
    by_areas = {style.name for style in pack.styles if style.signature.areas}
    own_size = {style.name: max(lamp.diameter_deg for lamp in style.lamps) for style in pack.styles}
    least_size = {style.name: (style.key_diameter_deg or (0.0,))[0] for style in pack.styles}
    turns: dict[str, list[float]] = {}
    for azimuth in steps.tolist():
        for result in solve_all(pack, light_of((azimuth, elevation, size))):
            if result.grade == "yes":
                turns.setdefault(result.name, []).append(
                    difference(result.turn_refined_deg, azimuth)
                )
    for name, apart in turns.items():
        about = [wrap(angle - apart[0]) for angle in apart]
        if name in by_areas:
            # Their match is much the same all over an arc around the lamp behind.
            assert max(abs(wrap(angle - 180.0)) for angle in apart) <= 15.0, name
            continue
        # A lamp twice as large behind the head as a rim's own is no rim light any more.
        no_rim = name.endswith("-rim") and size > 2 * own_size[name]
        if not no_rim and size >= least_size[name]:
            assert len(apart) < 8 or np.ptp(about) <= 2 * _APART_DEG, name


@pytest.mark.parametrize("head", HEADS)
def test_even_light_is_flat_and_gives_no_style_of_a_side(head: str) -> None:
    for result in solve_all(_pack(head), np.ones((32, 64))):
        assert result.grade == ("yes" if result.name == "flat" else "no"), result.name


@pytest.mark.parametrize("head", HEADS)
def test_each_style_s_own_target_shows_it(head: str) -> None:
    """Under its own lamps, on every head and skin; around the head as the lamps are there."""
    pack = _pack(head)
    for style in pack.styles:
        light = np.sum([far_lamp(lamp, (32, 64)) for lamp in style.lamps], axis=0)
        at_front = curves(pack.tables, pack.project(light))
        measured = measure(pack, at_front)
        row = pack.index(style.name)
        assert measured.yes[row, 0] >= 0, (style.name, measured.yes[row, 0])


@pytest.mark.parametrize("head", HEADS)
def test_each_style_s_baked_target_shows_it(head: str) -> None:
    """The target picture itself; what is known by the place around it is not in a picture."""
    pack, transport = _pack(head), load_named(head)
    weights = np.asarray(transport.header.luminance_weights)
    for row, style in enumerate(pack.styles):
        picture = pack.targets[row].reshape(-1, 3)[transport.pixels].astype(np.float64)
        found = measure_picture(pack, transport, picture @ weights)
        areas = {area for r in style.signature.relations for area in (r.bright, r.dark)}
        if not areas & {"background", "surroundings"}:
            assert found.grade[row] == YES, style.name


@pytest.mark.parametrize("head", HEADS)
def test_symmetric_light_gives_left_and_right_alike(head: str) -> None:
    pack = _pack(head)
    rows = np.linspace(1.0, -1.0, 32)
    overcast = np.repeat(np.maximum(rows, 0.05)[:, None], 64, axis=1)
    two = light_of((-40.0, 20.0, 20.0), (40.0, 20.0, 20.0))
    ring = light_of(*((azimuth, 10.0, 12.0) for azimuth in range(-180, 180, 15)))
    for light in (overcast, two, ring):
        found = _by_name(pack, light)
        for name, result in found.items():
            assert result.grade == found[mirror_name(name)].grade, name
    for light in (overcast, ring):
        for name, result in _by_name(pack, light).items():
            if name.startswith(("left-", "right-")):
                assert result.grade == "no", name


@pytest.mark.parametrize("head", HEADS)
def test_two_lamps_behind_are_a_double_rim(head: str) -> None:
    for azimuth in (125.0, 135.0, 145.0):
        found = _by_name(_pack(head), light_of((azimuth, 20.0, 15.0), (-azimuth, 20.0, 15.0)))
        assert found["double-rim"].grade == "yes", azimuth
        assert abs(found["double-rim"].turn_refined_deg) < 3.0
        assert found["badger"].grade != "yes", azimuth


def test_a_bright_background_makes_a_silhouette_whatever_fills_the_face() -> None:
    """Fill from all round: far under the background it is, near it it is not."""
    pack, window = _pack("generic"), light_of((180.0, 5.0, 50.0))
    for fill, grade in ((0.02, "yes"), (10.0, "no")):
        found = _by_name(pack, window + np.float32(fill))["silhouette"]
        assert found.grade == grade, fill
        assert grade == "no" or abs(found.turn_refined_deg) < 3.0


def test_light_on_the_hair_takes_nothing_from_light_on_the_face() -> None:
    """A hair light beside a loop: both are there, and neither looks more like the other."""
    pack = _pack("generic")
    both = light_of((-35.0, 35.0, 10.0)) + 6 * light_of((180.0, 55.0, 16.0))
    found = _by_name(pack, both)
    assert found["left-loop"].grade == "yes"
    assert found["left-loop"].looks_more_like is None
    assert found["hair-light"].looks_more_like is None


def test_each_style_in_reach_names_what_it_may_be_taken_for() -> None:
    pack = _pack("generic")
    for elevation in (5.0, 30.0, 45.0):
        found = _by_name(pack, light_of((20.0, elevation, 15.0)))
        for name, result in found.items():
            assert result.neighbour in found, name
            assert result.neighbour not in (name, mirror_name(name))
    assert _by_name(pack, light_of((0.0, 40.0, 10.0)))["left-loop"].neighbour == "left-rembrandt"


def test_the_colour_of_a_lamp_changes_no_grade() -> None:
    pack = _pack("generic")
    for elevation in (5.0, 30.0, 45.0, 80.0, -45.0):
        light = light_of((40.0, elevation, 20.0))
        plain = _by_name(pack, light)
        for tint in ((1.0, 0.8, 0.5), (0.7, 0.9, 1.2)):
            for name, result in _by_name(pack, light * np.array(tint, np.float32)).items():
                assert result.grade == plain[name].grade, (name, elevation)
