"""Whether the files are the bracket that was asked for."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.core.measure.plan.planner import Plan, PlannedShot
from app.core.measure.read.frame import Exposure
from app.devices.capture.file_integrity import check_frames, planned_times
from app.devices.errors import CaptureFailed
from tests.helpers.exif_bytes import SHORT, THETA_V, camera_tags, exif, jpeg

TIMES = ((1, 60), (1, 15), (1, 250))


def bracket(*shots: tuple[tuple[int, int], float, float]) -> Plan:
    planned = [
        PlannedShot(Exposure(time[0] / time[1], iso, aperture), 0.0, 0.0)
        for time, iso, aperture in shots
    ]
    return Plan("paper", tuple(planned), 9.0)


PLAN = bracket(*((time, 100.0, 2.0) for time in TIMES))


def write(
    folder: Path,
    times: tuple[tuple[int, int] | None, ...] = TIMES,
    iso: int | None = 100,
    **kind: object,
) -> list[Path]:
    paths = []
    for number, time in enumerate(times):
        path = folder / f"R00{number}.JPG"
        tags = camera_tags(time, iso, (20, 10) if time else None)
        path.write_bytes(jpeg(exif(None, tags), seed=number))
        paths.append(path)
    return paths


def test_the_planned_bracket_passes(tmp_path: Path) -> None:
    assert check_frames(write(tmp_path), PLAN) == ()


def test_another_order_passes(tmp_path: Path) -> None:
    assert check_frames(write(tmp_path)[::-1], PLAN) == ()


def test_nominal_thirds_pass(tmp_path: Path) -> None:
    # Cameras write 1/13 s for 0.07692307 s and 10/600 s for 1/60 s.
    paths = write(tmp_path, ((10, 600), (1, 15), (4, 1000)))
    assert check_frames(paths, PLAN) == ()


@pytest.mark.parametrize("count", [2, 3])
def test_equal_exposures_are_refused_and_the_files_stay(tmp_path: Path, count: int) -> None:
    paths = write(tmp_path, (TIMES[0],) * count)
    with pytest.raises(CaptureFailed, match="identical exposures instead of a bracket") as caught:
        check_frames(paths, PLAN)
    assert {2: "two", 3: "three"}[count] in caught.value.message
    assert caught.value.code == "equal-exposures"
    assert "kept" in caught.value.hint
    assert all(path.exists() for path in paths)


def test_tone_mapping_is_refused(tmp_path: Path) -> None:
    paths = write(tmp_path)
    mapped = [(0x0002, SHORT, (1,)) if entry[0] == 0x0002 else entry for entry in THETA_V]
    paths[1].write_bytes(jpeg(exif(mapped, camera_tags(TIMES[1], 100))))
    with pytest.raises(CaptureFailed, match=r"R001\.JPG was taken with the camera.s HDR"):
        check_frames(paths, PLAN)


def test_a_wrong_iso_is_said(tmp_path: Path) -> None:
    paths = write(tmp_path)
    paths[2].write_bytes(jpeg(exif(None, camera_tags(TIMES[2], 400))))
    (sentence,) = check_frames(paths, PLAN)
    assert sentence.startswith("R002.JPG ")
    assert "1/250 s, ISO 400, f/2" in sentence.split(" instead of ")[0]
    assert "1/250 s, ISO 100, f/2" in sentence.split(" instead of ")[1]


def test_a_wrong_aperture_is_said(tmp_path: Path) -> None:
    plan = bracket(*((time, 100.0, 2.8) for time in TIMES))
    assert len(check_frames(write(tmp_path), plan)) == 3


def test_a_frame_too_many_is_said(tmp_path: Path) -> None:
    paths = write(tmp_path, (*TIMES, (1, 1000)))
    (sentence,) = check_frames(paths, PLAN)
    assert "R003.JPG" in sentence
    assert "not in the plan" in sentence


def test_a_file_named_twice_counts_once(tmp_path: Path) -> None:
    paths = write(tmp_path)
    assert check_frames([*paths, paths[0]], PLAN) == ()


def test_files_that_are_no_pictures_end_in_a_sentence(tmp_path: Path) -> None:
    paths = write(tmp_path)
    paths[1].write_bytes(b"<html>")
    with pytest.raises(CaptureFailed, match=r"R001\.JPG"):
        check_frames(paths, PLAN)


def test_times_of_the_plan_stand_in_for_exif(tmp_path: Path) -> None:
    silent = write(tmp_path, (None, None, None), iso=None)
    assert planned_times(silent, PLAN) == tuple(one / other for one, other in TIMES)
    assert len(check_frames(silent, PLAN)) == 3
    assert planned_times(silent[:2], PLAN) is None
    assert planned_times(write(tmp_path), PLAN) is None
