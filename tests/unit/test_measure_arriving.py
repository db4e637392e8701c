"""Frames that are read as they come give what they give when they are read together."""

import os
import threading
from dataclasses import fields
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from app.core.base.errors import Cancelled, ProbeError
from app.core.base.paths import resources
from app.core.base.progress import Token
from app.core.environment.environment import read_environment
from app.core.measure.bracket.incoming_frames import ArrivingFrames, rehearse
from app.core.measure.bracket.measure import measure
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions
from app.core.measure.read import opened_frame as frame_preprocessing
from app.core.measure.read.decoding import MemoryRows
from app.core.measure.read.frame import Exposure, Frame
from app.core.measure.read.metadata import read_header
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from app.devices.simulated.cameras import THETA_V
from app.devices.simulated.optics import meter
from app.words.remarks import sentences
from benchmarks.light.shots.brackets import write_bracket

SHAPE = (256, 512)


@lru_cache
def pack() -> StylePack:
    return load_named_pack("generic")


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    light = read_environment(resources() / "demo" / "scenes" / "studio.exr").radiance
    metered = meter(light, THETA_V)
    exposures = [
        Exposure(metered.shutter_s * 2.0**stop, metered.iso, metered.aperture)
        for stop in (0.0, 2.0, -2.0)
    ]
    return write_bracket(tmp_path_factory.mktemp("b"), light, THETA_V, exposures, shape=SHAPE)


def assert_same(one: Measurement, other: Measurement) -> None:
    for name in ("radiance", "clipped", "dark"):
        assert np.array_equal(getattr(one.merged, name), getattr(other.merged, name))
    assert np.array_equal(one.display, other.display)
    for field in fields(Measurement):
        if field.name in ("bracket", "warnings", "notes"):
            assert getattr(one, field.name) == getattr(other, field.name)
    assert repr(one.finished.lights) == repr(other.finished.lights)
    assert one.merged.clipped_fractions == other.merged.clipped_fractions


def count_openings(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of files in the order in which they are opened, wherever that happens."""
    names: list[str] = []

    def counted(frame: Frame, *, hold: bool, token: Token) -> frame_preprocessing.OpenedFrame:
        names.append(frame.path.name)
        return original(frame, hold=hold, token=token)

    original = frame_preprocessing.open_frame
    monkeypatch.setattr("app.core.measure.bracket.incoming_frames.open_frame", counted)
    return names


@pytest.mark.parametrize("expected", [0, 3])
def test_the_result_is_the_same_bit_for_bit_and_nothing_is_read_twice(
    frames: list[Path], expected: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = count_openings(monkeypatch)
    with ArrivingFrames(expected) as arriving:
        for path in reversed(frames):
            arriving.add(path)
            assert arriving.problem(path) == ""
        assert sorted(opened) == [path.name for path in frames]
        probe = arriving.measure(frames, MeasureOptions(full=True))
    assert len(opened) == 3
    assert_same(probe, measure(frames, MeasureOptions(full=True)))


def test_files_that_were_not_added_are_read_now(frames: list[Path]) -> None:
    with ArrivingFrames() as arriving:
        arriving.add(frames[1])
        probe = arriving.measure(frames)
        again = arriving.measure(frames)
    assert_same(probe, measure(frames))
    assert_same(again, probe)


def test_frames_that_do_not_fit_are_not_held(
    frames: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    size = SHAPE[0] * SHAPE[1] * 3
    for expected, limit, held in ((3, 2 * size, 0), (0, 2 * size, 2), (3, 3 * size, 3)):
        with ArrivingFrames(expected, memory_bytes=limit) as arriving:
            for path in frames:
                arriving.add(path)
                arriving.problem(path)
            token = Token()
            count = 0
            for path in frames:
                future = arriving._reading[path]
                count += future.result().hold
            assert count == held
            for path in frames:
                frame = read_header(path).frame
                opened = arriving.take(frame, hold=False, token=token)
                # What was held although it shall not be is given up, and read by rows.
                assert not isinstance(opened.source, MemoryRows)
                opened.source.close()
            assert arriving._cache_bytes == 0


def test_a_damaged_file_is_told_and_can_come_again(frames: list[Path], tmp_path: Path) -> None:
    paths = [tmp_path / path.name for path in frames]
    for path, source in zip(paths, frames, strict=True):
        path.write_bytes(source.read_bytes())
    good = paths[2].read_bytes()
    with ArrivingFrames(3) as arriving:
        paths[2].write_bytes(good[: len(good) // 2])
        for path in paths:
            arriving.add(path)
        assert [bool(arriving.problem(path)) for path in paths] == [False, False, True]
        assert arriving.problem(tmp_path / "never added") == ""
        paths[2].write_bytes(good)
        arriving.add(paths[2])
        assert arriving.problem(paths[2]) == ""
        probe = arriving.measure(paths)
    assert np.array_equal(probe.merged.radiance, measure(frames).merged.radiance)


def test_a_damaged_frame_is_left_out_as_ever(frames: list[Path], tmp_path: Path) -> None:
    cut = tmp_path / "R0019999.JPG"
    data = frames[2].read_bytes()
    cut.write_bytes(data[: len(data) // 2])
    files = [*frames[:2], cut]
    with ArrivingFrames(3) as arriving:
        for path in files:
            arriving.add(path)
        probe = arriving.measure(files)
    assert_same(probe, measure(files))
    assert any("left out" in line for line in sentences(probe.warnings))
    missing = [tmp_path / "missing.JPG", frames[0]]
    with ArrivingFrames() as arriving:
        arriving.add(missing[0])
        with pytest.raises(ProbeError, match="no file"):
            arriving.measure(missing)


def test_a_file_that_changed_is_read_again(frames: list[Path], tmp_path: Path) -> None:
    path = tmp_path / "a.JPG"
    path.write_bytes(frames[0].read_bytes())
    with ArrivingFrames() as arriving:
        arriving.add(path)
        arriving.problem(path)
        path.write_bytes(frames[1].read_bytes())
        os.utime(path, ns=(1, 1))
        opened = arriving.take(read_header(path).frame, hold=True, token=Token())
    direct = frame_preprocessing.open_frame(read_header(frames[1]).frame, hold=True, token=Token())
    assert np.array_equal(opened.samples, direct.samples)


def test_a_rehearsal_goes_the_whole_way_once(
    frames: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    rehearse(pack())  # raises nothing
    done: list[StylePack] = []
    monkeypatch.setattr("app.core.measure.bracket.incoming_frames._REHEARSED", threading.Event())
    monkeypatch.setattr("app.core.measure.bracket.incoming_frames.rehearse", done.append)
    for _ in range(2):
        with ArrivingFrames() as arriving:
            arriving.prepare(pack())
            arriving.add(frames[0])
            assert arriving.problem(frames[0]) == ""
    assert len(done) == 1


class _Source:
    """Rows that only count how often they are closed."""

    def __init__(self, closed: list[int]) -> None:
        self.closed = closed

    def close(self) -> None:
        self.closed.append(1)


def fake_opening(monkeypatch: pytest.MonkeyPatch, gate: threading.Event | None = None) -> list[int]:
    closed: list[int] = []

    def opened(frame: Frame, *, hold: bool, token: Token) -> frame_preprocessing.OpenedFrame:
        if gate is not None:
            gate.wait(120.0)
        empty = np.zeros((1, 1, 3), np.uint8)
        source = _Source(closed)
        return frame_preprocessing.OpenedFrame(source, empty, empty, 0.0)  # type: ignore[arg-type]

    monkeypatch.setattr("app.core.measure.bracket.incoming_frames.open_frame", opened)
    return closed


def test_everything_is_closed_whatever_happens(
    frames: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    closed = fake_opening(monkeypatch)
    before = threading.active_count()
    arriving = ArrivingFrames(3)
    for path in frames:
        arriving.add(path)
        arriving.problem(path)
    arriving.add(frames[0])  # the first reading of it is of no use any more
    arriving.problem(frames[0])
    assert len(closed) == 1
    taken = arriving.take(read_header(frames[0]).frame, hold=True, token=Token())
    arriving.close()
    arriving.close()
    assert len(closed) == 3
    taken.source.close()
    assert len(closed) == 4
    assert threading.active_count() == before
    arriving.add(frames[0])
    assert arriving.problem(frames[0]) == ""


def test_a_frame_that_is_still_being_read_is_closed_when_it_comes(
    frames: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    gate = threading.Event()
    closed = fake_opening(monkeypatch, gate)
    arriving = ArrivingFrames()
    arriving.add(frames[0])
    token = Token()
    timer = threading.Timer(0.1, token.cancel)
    timer.start()
    with pytest.raises(Cancelled):
        arriving.take(read_header(frames[0]).frame, hold=True, token=token)
    timer.join()
    assert closed == []
    gate.set()
    arriving.close()
    assert closed == [1]
