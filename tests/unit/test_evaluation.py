"""Evaluation: quality by size, differences and ties, tables, spread, certainty."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.core.base.errors import CoreError, EnvironmentFileError, TransportError
from app.core.base.paths import resources
from app.core.styles.certainty import Certainty, load_certainty, spread_of
from app.core.styles.styles import load_styles
from benchmarks.answers.evaluation.differences import best_turns, change, has_rival
from benchmarks.answers.evaluation.evaluate import PICTURES, block_sums, quality_at_turns
from benchmarks.answers.evaluation.heads import Answers, spread
from benchmarks.answers.evaluation.offsets import Offsets, load_offsets, save_offsets
from benchmarks.answers.evaluation.report.numbers import save_certainty
from benchmarks.answers.evaluation.scenes import default_scenes, find_scenes, read_scenes
from benchmarks.answers.evaluation.tables import (
    TableNote,
    Tables,
    load_tables,
    save_tables,
    styles_digest,
    tables_path,
)
from tests.helpers.hostile_files import write_picture

TURNS = np.arange(64) * 360.0 / 64


def bump(at: float, width: float = 40.0, height: float = 1.0) -> np.ndarray:
    """One smooth peak on a curve of 64 turns."""
    away = (TURNS - at + 180.0) % 360.0 - 180.0
    return height * np.exp(-np.square(away / width))


@pytest.mark.parametrize("width", [64, 128])
def test_quality_is_the_sum_over_the_shifted_environment(width: int) -> None:
    rng = np.random.default_rng(1)
    targets = rng.standard_normal((3, width // 2, width))
    light = rng.random((width // 2, width))
    found = quality_at_turns(targets, light)
    step = width // 64
    for k in (0, 1, 17, 63):
        turned = np.roll(light, -k * step, axis=1)
        np.testing.assert_allclose(found[:, k], (targets * turned).sum(axis=(1, 2)), rtol=1e-9)


def test_fewer_columns_than_turns_are_interpolated() -> None:
    rng = np.random.default_rng(2)
    targets, light = rng.standard_normal((2, 16, 32)), rng.random((16, 32))
    found = quality_at_turns(targets, light)
    own = quality_at_turns(targets, light, 32)
    np.testing.assert_allclose(found[:, ::2], own, rtol=1e-9, atol=1e-9)
    # What varies slowly is hit exactly in between as well.
    slow = np.cos(2 * np.pi * 3 * np.arange(32) / 32)
    between = quality_at_turns(np.eye(1, 32)[None] * 1.0, slow[None])[0]
    np.testing.assert_allclose(between, np.cos(2 * np.pi * 3 * np.arange(64) / 64), atol=1e-9)


def test_block_sums_see_repeated_texels_alike() -> None:
    rng = np.random.default_rng(3)
    targets, light = rng.standard_normal((2, 8, 16)), rng.random((4, 8))
    small = block_sums(targets, (4, 8))
    fine = light.repeat(2, axis=0).repeat(2, axis=1)
    np.testing.assert_allclose((small * light).sum((1, 2)), (targets * fine).sum((1, 2)))


def test_a_moved_peak_is_measured_in_degrees_and_in_what_is_given_up() -> None:
    reference = best_turns(np.stack([bump(90.0), bump(-45.0)]))
    other = best_turns(np.stack([bump(90.0 + 11.25), bump(-45.0)]))
    found = change(reference, other)
    np.testing.assert_allclose(found.degrees, [11.25, 0.0])
    assert found.refined == pytest.approx([11.25, 0.0], abs=0.01)
    assert found.regret == pytest.approx([1 - np.exp(-((11.25 / 40) ** 2)), 0.0], abs=1e-6)
    assert not found.tied.any()
    assert found.mean == pytest.approx(5.625)


def test_angles_are_counted_the_short_way_round() -> None:
    found = change(best_turns(bump(174.375)[None]), best_turns(bump(-174.375)[None]))
    assert found.degrees == pytest.approx([11.25])


def test_two_equal_peaks_count_by_regret_only() -> None:
    two = np.maximum(bump(90.0), bump(-90.0, height=0.995))
    jumped = np.maximum(bump(90.0, height=0.99), bump(-90.0))
    found = change(best_turns(two[None]), best_turns(jumped[None]))
    assert found.tied.all()
    assert found.mean == 0.0
    assert found.degrees == pytest.approx([180.0])
    assert found.regret == pytest.approx([0.005], abs=1e-6)
    assert has_rival(two)
    assert not has_rival(np.maximum(bump(90.0), bump(-90.0, height=0.98)))


def test_the_width_of_a_peak_is_its_three_per_cent_band() -> None:
    found = best_turns(bump(20.0, width=30.0)[None])
    assert found.width_deg[0] == pytest.approx(2 * 30.0 * np.sqrt(-np.log(0.97)), abs=0.1)


def answers(turns: np.ndarray, attainable: np.ndarray) -> Answers:
    curves = np.stack([[bump(t) for t in row] for row in turns])
    index = curves.argmax(axis=2)
    return Answers(curves, index, turns, attainable)


def test_spread_counts_attainable_pairs_only() -> None:
    generic = answers(
        np.array([[0.0, 90.0], [45.0, -90.0]]), np.array([[True, True], [True, False]])
    )
    other = answers(np.array([[11.25, 90.0], [45.0, 90.0]]), np.ones((2, 2), bool))
    found = spread(generic, {"other": other})
    assert found.mean == pytest.approx(11.25 / 3)
    assert found.mean_of_all == pytest.approx((11.25 + 180) / 4)
    assert found.by_style == pytest.approx([5.625, 0.0])
    assert found.regret[0, 0, 0] == pytest.approx(1 - np.exp(-((11.25 / 40) ** 2)), abs=1e-6)


def a_table() -> Tables:
    rng = np.random.default_rng(5)
    note = TableNote("generic", "medium", "ab", "few paths", 0.01)
    styles = load_styles()
    return Tables(
        styles=tuple(style.name for style in styles),
        styles_sha256=styles_digest(styles),
        pictures=(50, 100, 200),
        sizes=rng.standard_normal((3, len(styles), 8, 16)).astype(np.float32),
        sizes_note=note,
        heads={"older": rng.standard_normal((len(styles), 4, 8)).astype(np.float32)},
        head_notes={"older": replace(note, head="older", noise=float("nan"))},
    )


def test_tables_come_back_as_they_were(tmp_path: Path) -> None:
    path, table = tmp_path / "t.npz", a_table()
    save_tables(path, table)
    again = load_tables(path)
    np.testing.assert_array_equal(again.sizes, table.sizes)
    np.testing.assert_array_equal(again.heads["older"], table.heads["older"])
    assert again.styles == table.styles
    assert again.sizes_note == table.sizes_note
    assert np.isnan(again.head_notes["older"].noise)
    np.testing.assert_array_equal(again.picture(100), table.sizes[1])
    assert [p.name for p in tmp_path.iterdir()] == ["t.npz"]


def test_damaged_tables_are_refused_with_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "t.npz"
    with pytest.raises(TransportError, match="no table"):
        load_tables(path)
    path.write_bytes(b"not a zip")
    with pytest.raises(TransportError, match="damaged"):
        load_tables(path)
    np.savez(path, sizes=np.zeros(3))
    with pytest.raises(TransportError, match="not a table"):
        load_tables(path)
    save_tables(path, replace(a_table(), pictures=(1, 2)))
    with pytest.raises(TransportError, match="contradicts"):
        load_tables(path)
    broken = a_table()
    broken.sizes[0, 0, 0, 0] = np.nan
    save_tables(path, broken)
    with pytest.raises(TransportError, match="contradicts"):
        load_tables(path)
    np.savez(path, header=np.frombuffer(b'{"format_version": 99}', np.uint8))
    with pytest.raises(TransportError, match="newer"):
        load_tables(path)


def test_the_digest_of_styles_follows_their_lamps() -> None:
    styles = list(load_styles())
    before = styles_digest(styles)
    lamp = replace(styles[0].lamps[0], power=styles[0].lamps[0].power * 1.01)
    styles[0] = replace(styles[0], lamps=(lamp, *styles[0].lamps[1:]))
    assert styles_digest(styles) != before


def test_offsets_come_back_and_need_every_spot(tmp_path: Path) -> None:
    path = tmp_path / "o.npz"
    light = np.random.default_rng(1).random((3, 4, 8, 3)).astype(np.float32)
    whole = Offsets(
        spots=("here",),
        spot=np.zeros(3, np.int32),
        feet=np.array([0, 1, 2], np.float32),
        bearing_deg=np.zeros(3, np.float32),
        light=light,
    )
    save_offsets(path, whole)
    np.testing.assert_array_equal(load_offsets(path).light, light)
    save_offsets(path, replace(whole, spots=("here", "nowhere")))
    with pytest.raises(TransportError, match="contradicts"):
        load_offsets(path)


def test_only_styles_beyond_the_tolerance_are_cautioned(tmp_path: Path) -> None:
    known = Certainty({"top": 30.0, "flat": 8.5}, 12, ("male",))
    assert spread_of("flat", known) is None
    assert spread_of("unheard-of", known) is None
    assert spread_of("top", known) == 30.0
    path = tmp_path / "certainty.json"
    save_certainty(path, known)
    assert load_certainty(path) == known
    for text in ("", "[]", '{"format_version": 9}', '{"format_version": 1, "spread_deg": 3}'):
        path.write_text(text)
        with pytest.raises(CoreError):
            load_certainty(path)


def test_scenes_are_found_or_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("TURNLIGHT_SHARED", raising=False)
    assert default_scenes(tmp_path / "clone") == resources() / "demo" / "scenes"
    beside = tmp_path / "shared" / "data" / "hdri"
    beside.mkdir(parents=True)
    assert default_scenes(tmp_path / "clone") == beside
    assert len(find_scenes(resources() / "demo" / "scenes")) == 8
    with pytest.raises(EnvironmentFileError, match="no folder"):
        find_scenes(tmp_path / "none")
    with pytest.raises(EnvironmentFileError, match="no panorama"):
        find_scenes(beside)


def test_tables_lie_beside_their_module(tmp_path: Path) -> None:
    assert load_tables(tables_path()).pictures == PICTURES
    assert tables_path(tmp_path) == tmp_path / "tables.npz"


def test_one_bad_panorama_is_left_out_and_named(tmp_path: Path) -> None:
    write_picture(tmp_path / "good.exr", np.ones((16, 32, 3), np.float32), "float")
    (tmp_path / "bad.exr").write_bytes(b"nothing")
    scenes, said = read_scenes(find_scenes(tmp_path))
    assert [scene.name for scene in scenes] == ["good"]
    assert any("Left out: bad.exr" in line for line in said)
    with pytest.raises(EnvironmentFileError, match=r"None of 1 .*bad\.exr"):
        read_scenes([tmp_path / "bad.exr"])
