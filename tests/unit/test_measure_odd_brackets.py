"""Brackets of phones and hands: frames that are turned, shaken, or toned each in its own way."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.core.base.colour import srgb_encode
from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.core.measure.bracket.alignment.handheld import lay_on_each_other, warp
from app.core.measure.bracket.curve.response import srgb_response
from app.core.measure.bracket.deghosting import trust
from app.core.measure.bracket.grouping import read_bracket
from app.core.measure.bracket.measure import measure
from app.core.measure.bracket.remarks import Motion, MuchMotion
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions
from app.core.measure.read.pixels import open_frames
from app.words.remarks import sentences
from tests.helpers.odd_brackets import Made, Way, error_of, make, speckle, spreads, view
from tests.helpers.photos import write_photo
from tests.helpers.shared import SHARED, needs_shared

STOPS = (2.0, 0.0, -2.0)


@lru_cache
def light() -> np.ndarray:
    scene = read_environment(resources() / "demo" / "scenes" / "interior.exr").radiance
    return view(np.array(scene), 20.0, (400, 600))


def merged(made: Made, folder: Path) -> Measurement:
    paths = []
    for index, frame in enumerate(made.frames):
        paths.append(folder / f"{index}.png")
        assert cv2.imwrite(str(paths[-1]), frame[..., ::-1])
    wishes = MeasureOptions(times=tuple(2.0**stop for stop in made.stops), full=True)
    return measure(paths, wishes)


def opencv(made: Made, align: bool) -> dict[str, tuple[np.ndarray, list[np.ndarray]]]:
    """Debevec's and Robertson's merges, each calibrated, and the frames they were made of."""
    frames = [frame.copy() for frame in made.frames]
    if align:
        cv2.createAlignMTB(5).process(made.frames, frames)
    times = np.exp2(np.array(made.stops, np.float32))
    debevec = cv2.createCalibrateDebevec().process(frames, times)
    robertson = cv2.createCalibrateRobertson().process([f[::2, ::2].copy() for f in frames], times)
    return {
        "debevec": (cv2.createMergeDebevec().process(frames, times, debevec), frames),
        "robertson": (cv2.createMergeRobertson().process(frames, times, robertson), frames),
    }


INNER = (slice(16, -16), slice(16, -16))


@pytest.mark.slow
@pytest.mark.parametrize(
    "way",
    [
        Way(STOPS, steps=(0.4, 1.5), bend=0.35, seed=3),
        Way(STOPS, shake_px=10.0, shake_deg=0.5, seed=4),
        Way(STOPS, steps=(0.4, 1.5), bend=0.35, shake_px=6.0, shake_deg=0.3, seed=5),
    ],
    ids=["phone", "hand", "phone in hand"],
)
def test_a_merge_agrees_with_its_frames_as_well_as_opencvs(tmp_path: Path, way: Way) -> None:
    made = make(light(), way)
    probe = merged(made, tmp_path)
    got = probe.merged.radiance
    frames = [
        warp(frame, lay.homography) if lay.needed else frame
        for frame, lay in zip(made.frames, probe.lays, strict=True)
    ]
    ours = spreads(got[INNER], [frame[INNER] for frame in frames])
    peers = opencv(made, way.shake_px > 0.0)
    theirs = {
        name: spreads(np.nan_to_num(peer)[INNER], [frame[INNER] for frame in laid_frames])
        for name, (peer, laid_frames) in peers.items()
    }
    # Spreads of so small a picture are uncertain by some per cent; and the widest are those of the
    # darkest codes, which Debevec's weights let have a say in what they are judged by.
    for rank, margin in ((0, 1.03), (1, 1.10)):
        assert ours[rank] <= margin * min(one[rank] for one in theirs.values())
    assert speckle(got[INNER]) <= speckle(peers["debevec"][0][INNER]) + 0.0002
    truth, _ = made.seen(1)
    known = np.any([(f.max(-1) < 250) & (f.min(-1) > 4) for f in made.frames], axis=0)
    known[:16] = known[-16:] = known[:, :16] = known[:, -16:] = False
    # Blurring agrees with itself, too; only light that is right agrees with the truth.
    mine = error_of(got, truth, known)
    their_error = error_of(np.nan_to_num(peers["debevec"][0]), truth, known)
    assert mine[0] <= 1.1 * their_error[0]
    assert not any("again" in words for words in sentences(probe.warnings))


def test_a_hand_is_found_to_a_half_a_pixel_although_somebody_walks() -> None:
    made = make(light(), Way(STOPS, shake_px=10.0, shake_deg=0.5, walker=True, seed=6))
    height, width = made.frames[0].shape[:2]
    x, y = np.meshgrid(np.linspace(0, width, 5), np.linspace(0, height, 5))
    points = np.stack([x.ravel(), y.ravel(), np.ones(25)])
    for index, lay in enumerate(lay_on_each_other(made.frames, STOPS, 1, 1.0)):
        true = np.linalg.inv(made.poses[index]) @ made.poses[1] @ points
        found = lay.homography @ points
        off = true[:2] / true[2] - found[:2] / found[2]
        # The median: corners that show a bare wall cannot be compared, and need not be.
        assert np.median(np.hypot(*off)) < 0.5
        assert lay.needed == (index != 1)


def test_frames_from_a_tripod_are_not_touched(tmp_path: Path) -> None:
    made = make(light(), Way(STOPS, seed=7))
    probe = merged(made, tmp_path)
    assert not any(lay.needed for lay in probe.lays)
    assert probe.response.response.name == "sRGB"
    assert probe.motion.share == 0.0


def test_only_a_known_curve_tells_that_too_much_moved() -> None:
    made = make(light(), Way((2.0, 1.0, 0.0, -1.0, -2.0), walker=True, seed=8))
    proxies = [
        np.asarray(cv2.resize(frame, (150, 100), interpolation=cv2.INTER_AREA), np.uint8)
        for frame in made.frames
    ]
    sure, unsure = (
        trust(proxies, made.stops, srgb_response(), exposures_known=known)
        for known in (True, False)
    )
    assert sure.share == unsure.share > 0.15
    assert [type(remark) for remark in sure.remarks] == [Motion, MuchMotion]
    assert [type(remark) for remark in unsure.remarks] == [Motion]


@pytest.mark.slow
@needs_shared
def test_the_memorial_church_stands_still() -> None:
    folder = SHARED / "brackets" / "memorial"
    rows = [row.split() for row in (folder / "image_list.txt").read_text().splitlines()]
    rows = [row for row in rows if row and row[0].startswith("memorial0")]
    wishes = MeasureOptions(times=tuple(float(row[1]) for row in rows))
    probe = measure([folder / row[0] for row in rows], wishes)
    assert not any("again" in words or "moved" in words for words in sentences(probe.warnings))
    assert not any(lay.needed for lay in probe.lays)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("memory", [0, 1 << 30])
def test_ordinary_pictures_are_merged_as_they_were_held(
    tmp_path: Path, orientation: int, memory: int
) -> None:
    ramp = np.linspace(0.02, 0.9, 96 * 64).reshape(96, 64)
    picture = np.stack([ramp, ramp[::-1], ramp[:, ::-1]], axis=-1)
    paths = []
    for stop in (0.0, -1.0):
        codes = np.rint(255.0 * srgb_encode(picture * 2.0**stop)).astype(np.uint8)
        paths.append(write_photo(tmp_path / f"{stop:.0f}.jpg", codes, orientation))
    bracket = read_bracket(paths, [1.0, 0.5])
    assert bracket.shape == (96, 64)
    with open_frames(bracket, memory_bytes=memory) as stack:
        codes = np.rint(255.0 * srgb_encode(picture)).astype(np.uint8)
        off = stack.sources[0].rows(0, 96).astype(int) - codes
        assert np.abs(off).max() <= 16  # JPEG with halved chroma
        assert np.abs(off).mean() < 3.0
