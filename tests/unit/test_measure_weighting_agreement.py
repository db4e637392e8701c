"""Frames that do not fit each other: scans that are warped, clipped places that are darkened."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from app.core.base.colour import srgb_encode
from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.core.measure.bracket.curve.brightness_transfer import match_codes
from app.core.measure.bracket.curve.response_recovery import srgb_table
from app.core.measure.bracket.measure import measure
from app.core.measure.bracket.weighting import doubts
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions
from app.words.remarks import sentences
from tests.helpers.odd_brackets import Way, decoded, error_of, make, spreads, view
from tests.helpers.shared import SHARED, needs_shared

FIVE = (2.0, 1.0, 0.0, -1.0, -2.0)


def merged(frames: list[np.ndarray], times: list[float], folder: Path) -> Measurement:
    paths = [folder / f"{index:02d}.png" for index in range(len(frames))]
    for path, frame in zip(paths, frames, strict=True):
        assert cv2.imwrite(str(path), frame[..., ::-1])
    return measure(paths, MeasureOptions(times=tuple(times), full=True))


@pytest.mark.slow
@needs_shared
def test_the_memorial_church_agrees_with_its_frames_as_well_as_opencvs_merges(
    tmp_path: Path,
) -> None:
    folder = SHARED / "brackets" / "memorial"
    rows = [row.split() for row in (folder / "image_list.txt").read_text().splitlines()]
    rows = [row for row in rows if row and row[0].startswith("memorial0")]
    frames = [decoded((folder / row[0]).read_bytes()) for row in rows]
    times = np.array([float(row[1]) for row in rows], np.float32)
    # Pure blue marks what the scans' registration left empty.
    blue = [(f[..., 2] > 200) & (f[..., :2].max(axis=-1) < 40) for f in frames]
    marked = np.any(blue, axis=0).astype(np.uint8)
    inside = cv2.dilate(marked, np.ones((5, 5), np.uint8)) == 0
    ours = spreads(merged(frames, times.tolist(), tmp_path).merged.radiance, frames, inside)
    curve = cv2.createCalibrateDebevec().process(frames, times)
    light = np.asarray(cv2.createMergeDebevec().process(frames, times, curve), np.float32)
    debevec = spreads(np.nan_to_num(light).astype(np.float32), frames, inside)
    small = [np.ascontiguousarray(frame[::4, ::4]) for frame in frames]
    curve = cv2.createCalibrateRobertson().process(small, times)
    light = np.asarray(cv2.createMergeRobertson().process(frames, times, curve), np.float32)
    robertson = spreads(np.nan_to_num(light).astype(np.float32), frames, inside)
    assert ours[0] <= min(debevec[0], robertson[0])
    assert ours[1] <= min(debevec[1], robertson[1])


def test_one_frame_that_lies_a_pixel_off_does_not_decide_on_edges(tmp_path: Path) -> None:
    """Stripes of two pixels under a film's curve; the brightest frame shows them a pixel off."""
    rng = np.random.default_rng(3)
    light = np.exp(rng.uniform(-3.0, -0.3, (120, 1))) * np.ones((120, 320))
    light[:, np.arange(320) % 8 < 2] *= 0.12
    frames = []
    for index, stop in enumerate(FIVE):
        seen = np.roll(light, index == 0, axis=1) * 2.0**stop
        codes = 255.0 * np.clip(seen, 0.0, 1.0) ** (1.0 / 1.6) + rng.normal(0.0, 0.7, seen.shape)
        frames.append(np.repeat(np.clip(np.rint(codes), 0, 255).astype(np.uint8)[..., None], 3, 2))
    probe = merged(frames, [2.0**stop for stop in FIVE], tmp_path)
    got = probe.merged.radiance[..., 1]
    known = (light > 0.02) & (light < 1.0)
    known[:, :8] = known[:, -8:] = False
    off = np.abs(np.log2(got / light) - np.median(np.log2(got / light)[known]))
    assert np.percentile(off[known], 95) < 0.35
    assert np.median(off[known]) < 0.1


def test_frames_that_fit_are_not_doubted() -> None:
    rng = np.random.default_rng(1)
    light = np.exp(rng.uniform(-5.0, 0.5, (4000, 1))) * np.ones(3)
    noise = rng.normal(0.0, 1.0, (5, 4000, 3))
    coded = [255.0 * srgb_encode(np.minimum(light * 2.0**stop, 1.0)) for stop in FIVE]
    samples = np.clip(np.rint(np.array(coded) + noise), 0, 255).astype(np.uint8)
    table = np.tile(srgb_table(), (3, 1))
    assert doubts(samples, table, FIVE) == ()
    found = doubts(samples, table, (2.6, 1.0, 0.0, -1.0, -2.0))
    # The wrong exposure shows in the first frame most, and by 0.6 stops.
    assert found[0] == max(found) == pytest.approx(0.6 * np.log(2.0), rel=0.15)
    assert found[4] < 0.1
    # Frames so far apart that there is no third to tell.
    assert doubts(samples[::2], table, (2.6, 0.0, -2.0)) == ()


def test_clipped_places_that_a_local_tone_curve_darkens_count_as_clipped(tmp_path: Path) -> None:
    scene = read_environment(resources() / "demo" / "scenes" / "interior.exr").radiance
    light = view(np.array(scene), 200.0, (400, 600))
    way = Way(FIVE, steps=(0.4, 1.5), bend=0.35, local=0.15, seed=8)
    made = make(light, way)
    samples = np.stack([frame.reshape(-1, 3)[::7] for frame in made.frames])
    whites = match_codes(samples, FIVE).whites
    truth, _ = made.seen(2)
    for frame, stop, white in zip(made.frames[:2], FIVE, whites, strict=False):
        over = (truth.min(axis=-1) * 2.0**stop > 1.05) & (frame.max(axis=-1) < 248)
        assert np.count_nonzero(over) > 1000
        assert np.mean(frame[over].max(axis=-1) >= white) > 0.8
    got = merged(made.frames, [2.0**stop for stop in FIVE], tmp_path)
    known = np.any([(f.max(-1) < 250) & (f.min(-1) > 4) for f in made.frames], axis=0)
    assert error_of(got.merged.radiance, truth, known)[0] < 0.1
    assert not any("again" in words for words in sentences(got.warnings))


def test_whites_of_frames_that_clip_at_white_are_not_looked_for_below() -> None:
    scene = read_environment(resources() / "demo" / "scenes" / "interior.exr").radiance
    light = view(np.array(scene), 200.0, (300, 450))
    for way in (Way(FIVE, seed=9), Way(FIVE, steps=(0.4, 1.5), bend=0.35, seed=10)):
        made = make(light, way)
        samples = np.stack([frame.reshape(-1, 3)[::7] for frame in made.frames])
        assert set(match_codes(samples, FIVE).whites) == {256}
