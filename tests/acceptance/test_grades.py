"""Grades under light whose answer is known: one lamp from anywhere, even light, pairs of lamps."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import difference, wrap
from app.core.solver.environment import reduce_light
from app.core.solver.solve import StyleResult, solve_all
from app.core.solver.style_pack import StylePack, load_named_pack, pack_names
from app.core.solver.styles import mirror_name

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


@pytest.mark.parametrize("size", SIZES_DEG)
def test_one_lamp_gives_each_style_where_its_file_says(size: float) -> None:
    pack, wrong = _pack("generic"), []
    for azimuth, elevation in _directions(50, round(10 * size)):
        found = _by_name(pack, light_of((azimuth, elevation, size)))
        for style in pack.styles:
            result = found[style.name]
            side = wrap(result.turn_refined_deg - azimuth)
            told = (style.name, round(elevation), result.grade, round(side))
            if style.key_elevation_deg is None or style.key_azimuth_deg is None:
                wrong += [told] if result.grade == "yes" else []
                continue
            low, high = style.key_elevation_deg
            if result.grade == "yes":
                wrong += [] if low - 5 <= elevation <= high + 5 else [told]
                left, right = style.key_azimuth_deg
                wrong += [] if left - 5 <= side <= right + 5 else [told]
            elif low + 5 <= elevation <= high - 5:
                wrong.append(told)
    assert wrong == []


@pytest.mark.parametrize("size", SIZES_DEG)
@pytest.mark.parametrize("elevation", [5.0, 30.0, 45.0])
def test_the_turn_follows_a_lamp_that_moves_within_a_texel(size: float, elevation: float) -> None:
    """Against the same lamp elsewhere: the turn moves as far as the lamp."""
    pack, steps = _pack("generic"), np.arange(8) * 5.625 / 8 + 20.0
    turns: dict[str, list[float]] = {}
    for azimuth in steps.tolist():
        for result in solve_all(pack, light_of((azimuth, elevation, size))):
            if result.grade == "yes":
                turns.setdefault(result.name, []).append(
                    difference(result.turn_refined_deg, azimuth)
                )
    for name, apart in turns.items():
        assert len(apart) < 8 or np.ptp(apart) <= 2 * _APART_DEG, name


@pytest.mark.parametrize("head", HEADS)
def test_even_light_is_flat_and_gives_no_style_of_a_side(head: str) -> None:
    for result in solve_all(_pack(head), np.ones((32, 64))):
        assert result.grade == ("yes" if result.name == "flat" else "no"), result.name


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
    for name, result in _by_name(pack, overcast).items():
        if name.startswith(("left-", "right-")):
            assert result.grade == "no", name


def test_the_colour_of_a_lamp_changes_no_grade() -> None:
    pack = _pack("generic")
    for elevation in (5.0, 30.0, 45.0, 80.0, -45.0):
        light = light_of((40.0, elevation, 20.0))
        plain = _by_name(pack, light)
        for tint in ((1.0, 0.8, 0.5), (0.7, 0.9, 1.2)):
            for name, result in _by_name(pack, light * np.array(tint, np.float32)).items():
                assert result.grade == plain[name].grade, (name, elevation)
