"""A film of the turn beside a place that was measured."""

from __future__ import annotations

from datetime import UTC, datetime
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from app.core.base.angles import difference
from app.core.base.arrays import Bytes
from app.core.base.errors import ProbeError
from app.core.environment.environment import from_radiance
from app.core.localization.features import build_index
from app.core.measure.film.comparison import Beside, beside, looks_mirrored
from app.core.measure.film.film import Film, flipped, read_film
from app.core.places.files.shots import is_frame, keep_film_frames, read_shots
from app.core.solver.place_light import PlaceLight, prepare
from app.core.styles.style_pack_file import load_named_pack
from app.words.measure.ways import beside_words, mirror_words
from tests.helpers.cases import sample_first
from tests.helpers.films import turn_frames
from tests.unit.test_facing import place

NOW = datetime(2026, 6, 1, 12, tzinfo=UTC)


def frames() -> list[tuple[float, float, Bytes]]:
    pictures = turn_frames("interior", 42)
    return [(0.5 * n, n / len(pictures), each) for n, each in enumerate(pictures)]


def glances() -> list[tuple[float, float, Bytes]]:
    return frames()[::3]


@cache
def film() -> Film:
    return read_film(frames())


def turned(name: str, by_deg: float) -> PlaceLight:
    """A place whose panorama begins elsewhere."""
    radiance = place(name).environment.radiance
    columns = round(by_deg / 360.0 * radiance.shape[1])
    return prepare(from_radiance(np.roll(radiance, columns, axis=1), name))


@pytest.mark.slow
@pytest.mark.parametrize("by_deg", sample_first([90.0, 0.0, -120.0], 1))
def test_the_light_says_where_the_film_began_and_both_agree(by_deg: float) -> None:
    pack = load_named_pack("generic")
    found = beside(film(), film().results(pack), glances(), turned("interior", by_deg), pack)
    assert abs(difference(found.offset_deg, by_deg)) < 2.0
    assert len(found.apart_deg) >= 3
    assert np.median(np.abs([*found.apart_deg.values()])) <= 6.0


def test_film_shows_a_place_the_right_way_round_or_mirrored() -> None:
    index = build_index(place("interior").display)
    assert looks_mirrored(glances(), index) is False
    assert looks_mirrored(flipped(glances()), index) is True
    assert looks_mirrored(glances()[:6], build_index(place("sunset").display)) is None


@pytest.mark.slow
def test_mirrored_film_read_as_mirrored_agrees_with_its_place() -> None:
    pack, mirror = load_named_pack("generic"), list(flipped(frames()))
    swapped, restored = read_film(mirror), read_film(flipped(mirror))
    with pytest.raises(ProbeError, match="not show enough of this place"):
        beside(swapped, swapped.results(pack), mirror[::3], place("interior"), pack)
    np.testing.assert_allclose(restored.noses_deg, film().noses_deg, atol=0.5)
    # What the switch prevents: the turn goes the other way.
    assert swapped.noses_deg[-1] == pytest.approx(-restored.noses_deg[-1], abs=8.0)


def test_place_overrules_what_was_said_of_a_mirror() -> None:
    assert mirror_words(False, None) == mirror_words(True, True) == ""
    assert "only its mirror image fits" in mirror_words(False, True)
    assert "not flipped" in mirror_words(True, False)


@pytest.mark.slow
def test_a_film_of_another_place_is_refused() -> None:
    pack = load_named_pack("generic")
    with pytest.raises(ProbeError, match="not show enough of this place"):
        beside(film(), film().results(pack), glances(), turned("sunset", 0.0), pack)


def test_the_disagreement_is_told() -> None:
    assert "agree to within 3°" in beside_words(Beside(0.0, {"a": 3, "b": -2, "c": 9}))
    assert "differ by 12°" in beside_words(Beside(0.0, {"a": 12, "b": -14, "c": 9}))
    assert "no style in common" in beside_words(Beside(0.0, {}))


def test_frames_are_kept_where_the_film_lies_in_the_panorama(tmp_path: Path) -> None:
    results = film().results(load_named_pack("generic"))
    keep_film_frames(tmp_path, film(), results, NOW, 90.0)
    shots, _ = read_shots(tmp_path)
    offered = [one for one in results if one.attainable]
    assert [one.style for one in shots] == [one.name for one in offered]
    for shot, one in zip(shots, offered, strict=True):
        assert is_frame(shot)
        assert abs(difference(shot.goal_facing_deg, one.turn_refined_deg + 90.0)) < 0.01
