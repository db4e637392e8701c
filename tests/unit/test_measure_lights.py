"""Tests of finding lamps, and of giving them a gain."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from app.core.base.colour import luminance
from app.core.base.errors import ProbeError
from app.core.environment.environment import energy, read_environment, solid_angles
from app.core.measure.finish.corrections import apply_gains
from app.core.measure.finish.lamp_detection import (
    MAX_LIGHTS,
    Light,
    find_lights,
    light_grid,
    upsampled,
)
from benchmarks.truth.stock import rotate
from tests.helpers.probes import clip, place

SCENES = Path(__file__).resolve().parents[2] / "resources" / "demo" / "scenes"


def apart(light: Light, azimuth: float, elevation: float) -> float:
    """Angle between a light's centre and a direction, deg."""
    a, b = math.radians(light.elevation_deg), math.radians(elevation)
    cosine = math.sin(a) * math.sin(b) + math.cos(a) * math.cos(b) * math.cos(
        math.radians(light.azimuth_deg - azimuth)
    )
    return math.degrees(math.acos(min(1.0, cosine)))


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(128, 256), (256, 512), (512, 1024), (1024, 2048)])
@pytest.mark.parametrize("where", [(0.0, 0.0), (90.0, 35.0), (179.9, 10.0), (-120.0, -40.0)])
def test_a_lamp_is_measured(shape: tuple[int, int], where: tuple[float, float]) -> None:
    lights = find_lights(clip(place([(*where, 12.0, 40.0)], shape)))
    assert [light.id for light in lights] == ["A"]
    lamp = lights[0]
    assert apart(lamp, *where) < 0.5
    assert lamp.diameter_deg == pytest.approx(12.0, rel=0.06)
    assert lamp.roundness > 0.9
    assert not lamp.clipped
    solid_angle = 2 * math.pi * (1 - math.cos(math.radians(6.0)))
    share = 40.0 * solid_angle / (39.9 * solid_angle + 0.1 * 4 * math.pi)
    assert lamp.share == pytest.approx(share, rel=0.06)
    # Soft edges darker than an eighth of the lamp count as its surroundings.
    assert 0.0999 < lamp.surround < 0.15


def test_lamps_are_named_in_falling_share() -> None:
    lamps = [(-100.0, 0.0, 6.0, 30.0), (20.0, 20.0, 14.0, 30.0), (120.0, -10.0, 10.0, 30.0)]
    lights = find_lights(clip(place(lamps)))
    assert [light.id for light in lights] == ["A", "B", "C"]
    assert [round(light.azimuth_deg) for light in lights] == [20, 120, -100]
    shares = [light.share for light in lights]
    assert shares == sorted(shares, reverse=True)


def test_turning_the_panorama_turns_the_lamps_across_the_seam() -> None:
    radiance = place([(10.0, 15.0, 9.0, 50.0), (-60.0, 0.0, 7.0, 20.0)])
    still = find_lights(clip(radiance))
    for columns in (64, 255, 256, 300):
        turned = find_lights(clip(rotate(radiance, columns)))
        for before, after in zip(still, turned, strict=True):
            moved = before.azimuth_deg - columns * 360.0 / 512.0
            assert math.remainder(after.azimuth_deg - moved, 360.0) == pytest.approx(0, abs=1e-3)
            assert after.share == pytest.approx(before.share, rel=1e-5)
            assert after.roundness == pytest.approx(before.roundness, rel=1e-4)


def test_a_long_lamp_is_not_round() -> None:
    radiance = place([])
    radiance[120:124, 200:300] = 30.0
    (tube,) = find_lights(clip(radiance))
    assert tube.roundness < 0.2


def test_an_even_place_has_no_lamps() -> None:
    assert find_lights(clip(place([], fill=0.7))) == ()


def test_what_clips_is_a_lamp_whatever_the_threshold() -> None:
    # Half the sphere is bright, so that nothing is four times the mean.
    radiance = place([], fill=0.2)
    radiance[:128] = 1.0
    radiance[60:70, 100:110] = 5.0
    merged = clip(radiance, 1.3)
    (lamp,) = find_lights(merged)
    assert lamp.clipped
    clipped_sr = float((merged.clipped * solid_angles(radiance.shape[:2])[:, None]).sum())
    assert lamp.solid_angle_sr == pytest.approx(clipped_sr, rel=0.02)
    assert lamp.diameter_deg < 10.0


def test_a_clipped_speck_of_the_sun_is_found() -> None:
    radiance = place([], (1024, 2048), fill=0.5)
    radiance[299:302, 699:702] = 1e6
    merged = clip(radiance, 30.0)
    (sun,) = find_lights(merged)
    assert sun.clipped
    assert sun.share < 1e-3
    assert apart(sun, 360.0 * (700.5 / 2048 - 0.5), 90.0 - 180.0 * 300.5 / 1024) < 0.5


def test_every_clipped_region_that_matters_belongs_to_a_light() -> None:
    for path in sorted(SCENES.glob("*.exr")):
        radiance = read_environment(path).radiance.copy()
        light = luminance(radiance)
        merged = clip(radiance, float(np.quantile(light, 0.995)))
        lights = find_lights(merged)
        grid = light_grid(merged)
        lost = (grid.loss * grid.solid_angle).ravel()
        owned = np.concatenate([each.texels for each in lights if each.clipped])
        assert len(lights) <= MAX_LIGHTS
        assert lost[owned].sum() >= 0.95 * lost.sum(), path.stem


def test_only_full_panoramas() -> None:
    with pytest.raises(ProbeError, match="only in a full panorama"):
        find_lights(clip(np.ones((100, 150, 3), np.float32)))
    with pytest.raises(ProbeError, match="black"):
        find_lights(clip(np.zeros((64, 128, 3), np.float32), 1.0))


def test_gain_of_a_clipped_lamp_changes_what_is_clipped_and_nothing_else() -> None:
    radiance = place([(30.0, 20.0, 10.0, 900.0), (-80.0, 0.0, 10.0, 5.0)], (512, 1024))
    merged = clip(radiance, 8.0)
    lights = find_lights(merged)
    brighter = apply_gains(merged, lights, {"a": 3.0})
    inside = merged.clipped > 0
    assert brighter.radiance[inside] == pytest.approx(64.0)
    assert np.array_equal(brighter.radiance[~inside], merged.radiance[~inside])
    assert not brighter.clipped.any()
    assert merged.clipped.any()
    assert merged.radiance.max() == pytest.approx(8.0)


def test_gain_of_another_lamp_leaves_its_surroundings() -> None:
    merged = clip(place([(30.0, 20.0, 10.0, 9.0)], fill=0.5))
    lights = find_lights(merged)
    before = energy(merged.radiance)[0]
    for stops in (2.0, -3.0):
        changed = apply_gains(merged, lights, {"A": stops})
        inside = upsampled(lights[0], merged.clipped.shape)
        above = 8.5 * float(lights[0].solid_angle_sr) * (2.0**stops - 1.0)
        assert energy(changed.radiance)[0] - before == pytest.approx(above, rel=0.02)
        assert np.array_equal(changed.radiance[~inside], merged.radiance[~inside])


def test_gains_are_checked() -> None:
    merged = clip(place([(30.0, 20.0, 10.0, 9.0)]))
    lights = find_lights(merged)
    with pytest.raises(ProbeError, match=r"no lamp 'F'.*Lamps: A"):
        apply_gains(merged, lights, {"F": 1.0})
    with pytest.raises(ProbeError, match="none"):
        apply_gains(merged, (), {"A": 1.0})
    for stops in (float("nan"), 21.0, -float("inf")):
        with pytest.raises(ProbeError, match="-20 to 20 stops"):
            apply_gains(merged, lights, {"A": stops})
