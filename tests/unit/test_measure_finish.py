"""What is done to merged light: who has the last word, and what is said of it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from app.core.base.errors import ProbeError
from app.core.measure.finish.corrections import finish, still_clipped
from app.core.measure.finish.lamp_detection import find_lights, light_grid
from app.core.measure.finish.masks import parse_mask
from app.core.measure.options import MeasureOptions
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from app.words.remarks import sentences
from tests.helpers.probes import clip, place, sunny_place


@cache
def pack() -> StylePack:
    return load_named_pack("generic")


def test_nothing_is_done_unasked() -> None:
    merged = clip(place([(30.0, 20.0, 10.0, 50.0)]))
    found = finish(merged, pack(), MeasureOptions())
    assert found.merged is merged
    assert found.measured is merged
    assert found.measured_clipped == 0.0
    assert found.restoration is None
    assert found.notes == ()
    assert found.audit is not None
    assert found.audit.in_doubt == ()


def test_the_sun_is_put_back_and_said() -> None:
    merged = clip(sunny_place(), level=150_000.0, cd_m2=1.0)
    found = finish(merged, pack(), MeasureOptions(sun="clear"))
    assert found.restoration is not None
    assert found.measured_clipped > 0
    assert found.merged.radiance.sum() > merged.radiance.sum()
    assert any("sun" in note.lower() for note in sentences(found.notes))
    assert found.measured is merged


def test_the_sun_is_left_when_asked() -> None:
    merged = clip(sunny_place(), level=150_000.0, cd_m2=1.0)
    found = finish(merged, pack(), MeasureOptions(sun="leave"))
    assert found.restoration is None
    assert found.merged is merged
    assert found.audit is not None
    assert found.audit.clipped_energy_range[0] > 0


def test_a_gain_by_hand_beats_the_model_of_the_sky() -> None:
    merged = clip(sunny_place(), level=150_000.0, cd_m2=1.0)
    restored = finish(merged, pack(), MeasureOptions())
    assert restored.restoration is not None
    name = restored.restoration.light
    assert name is not None
    found = finish(merged, pack(), MeasureOptions(gains={name.lower(): 2.0}))
    assert found.restoration is None
    assert any(f"Lamp {name} was made 2 stops brighter" in note for note in sentences(found.notes))


def test_a_meter_reading_sets_a_lamp() -> None:
    merged = clip(place([(30.0, 20.0, 10.0, 50.0)]), cd_m2=10.0)
    found = finish(merged, pack(), MeasureOptions(lux={"A": 5000.0}))
    assert found.merged.radiance.max() > merged.radiance.max()
    assert found.notes


def test_masks_are_filled_and_their_effect_told() -> None:
    merged = clip(place([(30.0, 20.0, 10.0, 50.0)]))
    found = finish(merged, pack(), MeasureOptions(masks=(parse_mask("nadir:-60"),)))
    assert len(found.clutter) == 1
    assert len(found.changes) == len(pack().styles)
    assert "Masking" in sentences(found.notes)[0]


def test_lamps_that_are_not_there_are_named() -> None:
    merged = clip(place([(30.0, 20.0, 10.0, 50.0)]), cd_m2=10.0)
    with pytest.raises(ProbeError, match="no lamp 'Q'"):
        finish(merged, pack(), MeasureOptions(lux={"Q": 100.0}))


def test_a_lamp_that_was_put_right_no_longer_counts_as_clipped() -> None:
    merged = clip(place([(30.0, 20.0, 10.0, 50.0)]), level=20.0)
    lights = find_lights(merged)
    assert lights[0].clipped
    whole = clip(np.asarray(merged.radiance))
    assert not any(light.clipped for light in still_clipped(lights, light_grid(whole)))
