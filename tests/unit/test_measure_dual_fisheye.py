"""Unstitched frames: never merged as panoramas, stitched to what a true panorama shows."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.cli import main
from app.core.base.colour import srgb_encode, to_bytes
from app.core.base.errors import EnvironmentFileError, ProbeError
from app.core.base.imaging.images import write_exr
from app.core.base.paths import resources
from app.core.base.sphere import directions
from app.core.environment.environment import read_environment, reduce_radiance, solid_angles
from app.core.localization.picture_file import read_shown_panorama
from app.core.measure.bracket.measure import measure
from app.core.measure.fisheye.circles import (
    MODELS,
    FisheyeLens,
    check_stitched,
    find_circles,
    recognise,
)
from app.core.measure.fisheye.stitch import Stitching
from app.core.measure.options import MeasureOptions
from app.core.measure.single.preview import preview_light
from app.core.measure.ways import measure as measure_files
from app.core.places.intake import sort_out
from tests.helpers.cases import sample_first
from tests.helpers.fisheye import Rig, bracket, fisheyes, write

Float = NDArray[np.float32]
SCENES = sorted((resources() / "demo" / "scenes").glob("*.exr"))
RIGS = {
    "beside each other": Rig(side=336),
    "stacked and stored on their sides": Rig(side=336, stacked=True, turns=(90.0, 90.0)),
    "small circles, stray light, back first": Rig(side=336, fill=0.93, stray=0.004, swapped=True),
    "touching the border": Rig(side=336, fill=1.0, turns=(90.0, -90.0)),
}


def scene(path: Path) -> Float:
    """A panorama whose brightest sixth is clipped at 0 EV."""
    radiance = read_environment(path).radiance.astype(np.float32)
    return radiance / np.float32(np.percentile(radiance.max(axis=-1), 85))


def coded(light: NDArray[Any], stop: float) -> NDArray[np.uint8]:
    """A small JPEG of some light."""
    noise = 0.001 * np.random.default_rng(0).standard_normal(light.shape)
    codes = np.rint(255.0 * srgb_encode(np.clip(light * 2.0**stop + noise, 0.0, 1.0)))
    quality = [cv2.IMWRITE_JPEG_QUALITY, 90]
    _, data = cv2.imencode(".jpg", codes.astype(np.uint8)[..., ::-1], quality)
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)[..., ::-1]


@pytest.mark.slow
@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_no_panorama_is_taken_for_circles_however_it_is_exposed(path: Path) -> None:
    small = cv2.resize(scene(path), (672, 336), interpolation=cv2.INTER_AREA)
    for stop in (-8, -5, -2, 0, 2, 5, 8):
        for picture in (small, np.roll(small, 168, axis=1), np.ascontiguousarray(small[::-1])):
            assert find_circles(coded(picture, stop)) is None


@pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS.keys())
def test_two_circles_are_found_where_they_are(rig: Rig) -> None:
    light = scene(SCENES[4])
    seen, _ = fisheyes(light, rig)
    for stop in (-3, 0, 3):
        circles = find_circles(coded(seen, stop))
        assert circles is not None
        assert circles.radius == pytest.approx(rig.fill / 2.0, abs=0.008)
        for place, lens in enumerate((1, 0) if rig.swapped else (0, 1)):
            moved = np.array([0.0, place]) if rig.stacked else np.array([place, 0.0])
            wanted = 0.5 + np.array(rig.offsets[lens]) + moved
            assert np.abs(np.array(circles.centres[place]) - wanted).max() < 0.006


FRAMES = {  # rows and columns of the frame, and where the circles' part begins
    "16:9, in the middle": ((378, 672), (21, 0)),
    "16:9, at the top": ((378, 672), (0, 0)),
    "16:9, a margin all around": ((450, 800), (60, 50)),
    "4:3": ((504, 672), (80, 0)),
    "square": ((672, 672), (168, 0)),
    "cut off above and below": ((300, 672), (-18, 0)),
}


def framed(seen: Float, shape: tuple[int, int], at: tuple[int, int]) -> Float:
    """Put a picture into a black frame, or cut it off."""
    frame = np.zeros((*shape, 3), np.float32)
    (row, column), (rows, columns) = at, seen.shape[:2]
    top, left = max(row, 0), max(column, 0)
    bottom, right = min(row + rows, shape[0]), min(column + columns, shape[1])
    frame[top:bottom, left:right] = seen[top - row : bottom - row, left - column : right - column]
    return frame


@pytest.mark.parametrize("stacked", [False, True], ids=["beside", "stacked"])
@pytest.mark.parametrize(("shape", "at"), FRAMES.values(), ids=FRAMES.keys())
@pytest.mark.parametrize("noise", [0.0, 0.006])
def test_circles_are_found_in_frames_of_any_proportions(
    shape: tuple[int, int], at: tuple[int, int], stacked: bool, noise: float
) -> None:
    rig = Rig(side=336, stacked=stacked)
    if stacked:
        shape, at = (shape[1], shape[0]), (at[1], at[0])
    seen, _ = fisheyes(scene(SCENES[4]), rig)
    light = framed(seen, shape, at)
    dark = noise * np.abs(np.random.default_rng(1).standard_normal(light.shape))
    side = min(shape)
    for stop in (0, 2):
        circles = find_circles(coded(light + dark * 0.5**stop, stop))
        assert circles is not None
        assert circles.stacked is stacked
        assert circles.radius * side == pytest.approx(rig.fill * 168.0, rel=0.02)
        for place in (0, 1):
            wanted = 168.0 + np.array(rig.offsets[place]) * 336 + np.array([at[1], at[0]])
            wanted[1 if stacked else 0] += 336.0 * place
            assert np.abs(np.array(circles.centres[place]) * side - wanted).max() < 4.0


DOORS = {
    "2:1": ((512, 1024), (0, 0)),
    "16:9": ((576, 1024), (32, 0)),
    "square": ((1024, 1024), (256, 0)),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", sample_first(DOORS, 2))
def test_every_door_recognises_circles(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shape, at = DOORS[name]
    seen, _ = fisheyes(scene(SCENES[4]), Rig(side=512))
    (file,) = write(tmp_path / "shot", framed(seen, shape, at), (0,), "Phone")
    target = tmp_path / "place.exr"
    commands = (
        ["stitch", str(file)],
        ["stitch", str(file.parent)],
        ["stitch", str(file), "--kind", "fisheye"],
        ["merge", str(file)],
    )
    lights = []
    for command in commands:
        assert main([*command, "-o", str(target), "--json"]) == 0
        assert "two fisheye circles" in json.loads(capsys.readouterr().out)["warnings"][0]
        lights.append(read_environment(target).radiance.tobytes())
        target.unlink()
    assert len(set(lights)) == 1
    for way in ("camera", "photos"):
        intake = sort_out([file], way)
        options = MeasureOptions(alone=True, sort_out=True)
        assert measure_files(intake.way, intake.files, options).of(Stitching) is not None
    with pytest.raises(EnvironmentFileError, match="two fisheye circles"):
        read_shown_panorama(file)
    assert main(["solve", str(file), "--json"]) == 0


def test_light_of_two_circles_is_no_panorama(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    seen, _ = fisheyes(scene(SCENES[4]), Rig(side=512))
    file = tmp_path / "circles.exr"
    write_exr(file, seen)
    assert main(["solve", str(file)]) == 2
    assert "two fisheye circles" in capsys.readouterr().err
    with pytest.raises(EnvironmentFileError, match="two fisheye circles"):
        read_shown_panorama(file)
    for path in SCENES:
        check_stitched(read_environment(path).radiance, path.name)


def test_one_photograph_of_other_proportions_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    light = np.asarray(cv2.resize(scene(SCENES[4])[:, :640], (640, 360)), np.float32)
    (file,) = write(tmp_path, light, (0,), "Phone")
    assert main(["merge", str(file), "-o", str(tmp_path / "x.exr")]) == 2
    assert "must be a full panorama" in capsys.readouterr().err


def unprojected(
    lens: FisheyeLens, columns: NDArray[np.float64], rows: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Unit vectors, (N, 3), to places in a lens's picture."""
    right, up = columns - lens.centre[0], lens.centre[1] - rows
    across = np.hypot(right, up)
    table = np.linspace(0.0, np.radians(130.0), 4001)
    angle = np.interp(across, np.maximum.accumulate(lens.radius(table)), table)
    level = np.sin(angle) / np.maximum(across, 1e-12)
    return np.asarray(np.stack([right * level, up * level, np.cos(angle)], axis=-1) @ lens.axes)


def test_a_lens_finds_its_way_back() -> None:
    for model in MODELS:
        lens = FisheyeLens((500.0, 480.0), 290.0, np.diag([-1.0, 1.0, 1.0]), model.bends)
        vectors = directions((64, 128)).astype(np.float64).reshape(-1, 3)
        vectors = vectors[np.degrees(np.arccos(vectors[:, 2])) < 100.0]
        columns, rows, _ = lens.project(vectors.astype(np.float32))
        back = unprojected(lens, columns.astype(np.float64), rows.astype(np.float64))
        assert np.degrees(np.arccos(np.clip((back * vectors).sum(axis=1), -1, 1))).max() < 0.06


def test_frames_of_both_kinds_are_refused_by_name() -> None:
    light = scene(SCENES[0])
    small = cv2.resize(light, (672, 336), interpolation=cv2.INTER_AREA)
    seen, _ = fisheyes(light, RIGS["beside each other"])
    frames = [coded(seen, 0), coded(small, -1), coded(seen, -2)]
    with pytest.raises(ProbeError, match=r"a\.jpg and c\.jpg\. Others do not: b\.jpg"):
        recognise(frames, ["a.jpg", "b.jpg", "c.jpg"])


@pytest.mark.slow
def test_an_unstitched_bracket_becomes_the_panorama_it_was_made_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    light = scene(next(path for path in SCENES if path.stem == "interior"))
    # The lamp above the picture on the wall stands on the seam.
    light = np.roll(light, round((90.0 + 163.6) / 360.0 * light.shape[1]), axis=1)
    light = np.minimum(light, 500.0)  # which the darkest frame holds
    bracket(tmp_path / "shot", light, (2, -1, -4, -7, -10), Rig(side=1024))
    target = tmp_path / "place.exr"
    assert main(["merge", str(tmp_path / "shot"), "-o", str(target), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["stitching"]["field_of_view_deg"] == pytest.approx(195.0, abs=1.5)
    assert "two fisheye circles" in said["warnings"][0]
    shape = (512, 1024)
    # The middle frame, whose saturation is the unit, saturates at 16.
    stitched = 2.0**4 * reduce_radiance(read_environment(target).radiance, shape)
    omega, toward = solid_angles(shape)[:, None], directions(shape)
    for axis in (*np.eye(3), *-np.eye(3)):
        seen = np.maximum(toward @ axis.astype(np.float32), 0.0) * omega
        ratio = (seen[..., None] * stitched).sum((0, 1)) / (seen[..., None] * light).sum((0, 1))
        assert np.abs(ratio - 1.0).max() < 0.03
    lamp = next(each for each in said["lamps"] if abs(each["azimuth_deg"] - 90.0) < 4.0)
    assert abs(lamp["azimuth_deg"] - 90.0) < 1.0
    assert abs(lamp["elevation_deg"] - 28.9) < 1.0


@pytest.mark.slow
def test_circles_on_each_other_and_on_their_sides_are_stitched_upright(tmp_path: Path) -> None:
    light = scene(next(path for path in SCENES if path.stem == "courtyard"))
    rig = Rig(side=640, stacked=True, turns=(90.0, 90.0), swapped=True)
    probe = measure(bracket(tmp_path, light, (2, 0, -2), rig))
    assert probe.bracket.panorama
    stitching = probe.of(Stitching)
    assert stitching is not None
    assert stitching.up_deg == 90.0
    assert probe.merged.radiance.shape[1] == 2 * probe.merged.radiance.shape[0]
    # The upper circle is the back one: front is where it looks.
    seen, shown = (
        reduce_radiance(np.minimum(each, 1.0).astype(np.float32), (64, 128)).ravel()
        for each in (probe.merged.radiance, np.roll(light, 512, axis=1))
    )
    assert np.corrcoef(seen, shown)[0, 1] > 0.97


def test_an_unstitched_picture_gives_no_rough_answer() -> None:
    seen, _ = fisheyes(scene(SCENES[3]), Rig(side=160))
    picture = to_bytes(srgb_encode(seen / np.percentile(seen, 90)))
    assert preview_light(picture, (32, 64)) is None


def test_an_unstitched_picture_is_no_panorama_to_find_a_camera_by(tmp_path: Path) -> None:
    (file,) = bracket(tmp_path, scene(SCENES[3]), (0,), Rig(side=512))
    with pytest.raises(EnvironmentFileError, match="two fisheye circles"):
        read_shown_panorama(file)


def test_lamps_cannot_be_named_in_pictures_that_turn_out_to_be_no_panorama(tmp_path: Path) -> None:
    light = scene(SCENES[0])[:, :300]
    files = write(tmp_path, np.ascontiguousarray(cv2.resize(light, (300, 600))), (0, -2), "Phone")
    with pytest.raises(ProbeError, match="lamps and masks cannot be used"):
        measure(files, MeasureOptions(gains={"A": 1.0}))
