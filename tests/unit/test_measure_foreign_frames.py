"""Pictures in a bracket's folder that are no exposures are left out and named; exposures stay."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.cli import main
from app.core.base.colour import srgb_encode
from app.core.environment.environment import read_environment
from app.core.measure.bracket.curve.response import choose_response
from app.core.measure.bracket.foreign_frames import Foreign, foreign_frames
from app.core.measure.bracket.measure import measure
from app.core.measure.bracket.remarks import Reason
from app.core.measure.options import MeasureOptions
from app.core.places.intake import sort_out
from app.devices.simulated.exif import Tags, exif_segment, with_segments
from benchmarks.light.camera_curves import CURVES, FILMIC, SRGB, Curve
from tests.helpers.brackets import light, pictures, samples

Bytes = NDArray[np.uint8]
Float = NDArray[np.float64]
STOPS = (2.0, 0.0, -2.0)


@lru_cache
def place(scene: str = "interior") -> Float:
    return light(scene)[::4, ::4]


def rendered(frames: list[Bytes]) -> Bytes:
    """The camera's own HDR picture: an exposure fusion (Mertens 2007)."""
    fused = cv2.createMergeMertens().process([frame[..., ::-1] for frame in frames])
    return np.asarray(np.clip(fused[..., ::-1] * 255.0, 0.0, 255.0), np.uint8)


def tone_mapped(radiance: Float) -> Bytes:
    """A preview: the global operator of Reinhard 2002."""
    grey = (radiance @ [0.2126, 0.7152, 0.0722])[..., None]
    key = 0.18 / np.exp(np.mean(np.log(grey + 1e-6))) * grey
    scale = key * (1.0 + key / 16.0) / (1.0 + key) / np.maximum(grey, 1e-9)
    return np.asarray(np.rint(255.0 * srgb_encode(np.clip(radiance * scale, 0, 1))), np.uint8)


def strangers(radiance: Float, curve: Curve) -> dict[str, tuple[Bytes, Reason]]:
    frames = pictures(radiance, STOPS, curve)
    (other,) = pictures(place("courtyard"), (0.0,), curve)
    (white,) = pictures(radiance * np.array([1.5, 1.0, 0.5]), (0.0,), curve)
    return {
        "own HDR": (rendered(frames), Reason.TONE_MAPPED),
        "preview": (tone_mapped(radiance), Reason.TONE_MAPPED),
        "different scene": (other, Reason.OTHER_SCENE),
        "black": (np.zeros_like(other), Reason.BLACK),
        "other white balance": (white, Reason.TONE_MAPPED),
    }


def found(frames: list[Bytes], stops: list[float]) -> list[Foreign]:
    """Foreign frames, by their place in the list."""
    order = sorted(range(len(stops)), key=lambda k: -stops[k])
    ordered, falling = [frames[k] for k in order], tuple(stops[k] for k in order)
    codes = samples(ordered, 2)
    choice = choose_response(codes, falling)
    small = [
        np.asarray(cv2.resize(each, (128, 64), interpolation=cv2.INTER_AREA), np.uint8)
        for each in ordered
    ]
    foreign = foreign_frames(small, codes, choice, falling, "auto")
    return [Foreign(order[each.frame], each.reason) for each in foreign]


@pytest.mark.parametrize("stop", [0.0, 2.0, -2.0])
@pytest.mark.parametrize("kind", ["own HDR", "preview", "different scene", "black"])
def test_a_foreign_frame_is_found_whatever_exposure_it_states(kind: str, stop: float) -> None:
    frames = pictures(place(), STOPS)
    picture, reason = strangers(place(), SRGB)[kind]
    if (kind, stop) == ("black", -2.0):
        return  # Beside so dark a frame black says nothing, and does no harm.
    assert found([*frames, picture], [*STOPS, stop]) == [Foreign(3, reason)]


def test_a_frame_of_another_white_balance_is_found() -> None:
    picture, reason = strangers(place(), SRGB)["other white balance"]
    assert found([*pictures(place(), STOPS), picture], [*STOPS, 0.0]) == [Foreign(3, reason)]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["own HDR", "preview", "different scene", "black"])
def test_a_foreign_frame_beside_a_camera_curve_is_found(kind: str) -> None:
    stops = (2.0, 0.0, -2.0, -4.0)
    picture, reason = strangers(place(), FILMIC)[kind]
    frames = pictures(place(), stops, FILMIC)
    assert found([*frames, picture], [*stops, 0.0]) == [Foreign(4, reason)]


@pytest.mark.parametrize("stops", [STOPS, (1.0, 0.0, -1.0), (2.0, 0.0, -2.0, -4.0, -6.0)])
def test_exposures_are_never_foreign(stops: tuple[float, ...]) -> None:
    assert found(pictures(place(), stops), list(stops)) == []


@pytest.mark.slow
@pytest.mark.parametrize("curve", CURVES, ids=lambda curve: curve.name)
@pytest.mark.parametrize("scene", ["interior", "courtyard"])
def test_exposures_through_camera_curves_are_never_foreign(curve: Curve, scene: str) -> None:
    for stops in (STOPS, (2.0, 0.0, -2.0, -4.0)):
        assert found(pictures(place(scene), stops, curve), list(stops)) == []


def test_a_wrong_tag_is_measured_instead() -> None:
    for true, stated in ((1.0, 0.0), (-1.3, 0.0), (-3.0, -2.0)):
        frames = pictures(place(), (*STOPS, true))
        assert found(frames, [*STOPS, stated]) == []


def test_light_that_flickers_and_people_that_walk_are_no_reason() -> None:
    radiance = place().copy()
    left = radiance.copy()
    left[:, : left.shape[1] // 2] *= 0.75  # a lamp lights half of the place, and flickers
    walker = radiance.copy()
    walker[40:100, 60:90] = 0.05
    for changed in (left, walker):
        frames = [
            pictures(light_then, (stop,), seed=k)[0]
            for k, (light_then, stop) in enumerate(
                zip((radiance, changed, radiance, radiance), (2.0, 0.0, -2.0, -4.0), strict=True)
            )
        ]
        assert found(frames, [2.0, 0.0, -2.0, -4.0]) == []


def shoot(folder: Path, name: str, codes: Bytes, stop: float) -> Path:
    """Write a JPEG that states an exposure."""
    tags = Tags(
        make="Simulated",
        model="Camera",
        software="1",
        date_time="2026:06:21 12:00:00",
        shutter_s=2.0**stop / 64.0,
        aperture=2.0,
        iso=100.0,
        shape=(codes.shape[0], codes.shape[1]),
        panorama=False,
    )
    _, data = cv2.imencode(".jpg", codes[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 95])
    file = folder / name
    file.write_bytes(with_segments(data.tobytes(), [exif_segment(tags)]))
    return file


def test_a_merge_names_what_it_leaves_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    radiance = light("interior")[::2, ::2]
    shot = tmp_path / "shot"
    shot.mkdir()
    frames = pictures(radiance, STOPS)
    files = [shoot(shot, f"{k}.jpg", frames[k], stop) for k, stop in enumerate(STOPS)]
    target = tmp_path / "place.exr"
    assert main(["merge", *map(str, files), "-o", str(target)]) == 0
    clean = read_environment(target).radiance.tobytes()
    own = shoot(shot, "own.jpg", rendered(frames), 0.0)
    small = cv2.resize(frames[1], None, fx=0.25, fy=0.25)
    shoot(shot, "thumb.jpg", np.asarray(small, np.uint8), 0.0)
    capsys.readouterr()
    assert main(["merge", str(shot), "-o", str(target), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["left_out"] == [{"file": str(own), "reason": "tone-mapped"}]
    assert {Path(frame["file"]).name for frame in said["frames"]} == {"0.jpg", "1.jpg", "2.jpg"}
    assert any("own.jpg" in words and "left out" in words for words in said["warnings"])
    assert any("thumb.jpg" in words for words in said["warnings"])
    assert not any("tone curve" in words for words in said["warnings"])
    assert read_environment(target).radiance.tobytes() == clean
    probe = measure(sort_out([shot]).files, MeasureOptions(alone=True, sort_out=True))
    assert [each.path.name for each in probe.left_out] == ["own.jpg"]
