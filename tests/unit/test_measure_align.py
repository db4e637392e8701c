"""Small rotations between frames are found; what only looks like one is not."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.colour import luminance, srgb_encode
from app.core.base.sphere import angle_of, directions, remap_frame, rotation
from app.core.environment.environment import read_environment
from app.core.measure.bracket.alignment.align import FrameAlignment, estimate, reference_of, remarks
from app.core.measure.bracket.remarks import FramesUnlike
from app.words.remarks import sentences
from tests.helpers.cases import sample_first

SCENES = sorted((Path(__file__).resolve().parents[2] / "resources/demo/scenes").glob("*.exr"))
NAMES = [path.stem for path in SCENES]
SMALL = (672, 336)


@cache
def _scene(name: str) -> NDArray[np.float32]:
    """Linear light whose middle tone is 0.18, twice as fine as the file."""
    path = next(path for path in SCENES if path.stem == name)
    light = np.array(read_environment(path).radiance)
    middle = float(np.exp(np.mean(np.log(luminance(light) + 1e-4))))
    fine = cv2.resize(light * np.float32(0.18 / middle), (2048, 1024))
    return np.asarray(fine, np.float32)


def _shoot(
    light: NDArray[np.float32],
    stops: float,
    turn: NDArray[np.float64] | None = None,
    *,
    seed: int = 1,
    curve: float | None = None,
) -> NDArray[np.uint8]:
    """A small copy of a camera's JPEG: rotation, noise, clipping, curve, rounding, compression."""
    rng = np.random.default_rng([seed, round(100 * stops) + 10_000])
    seen = light if turn is None else np.asarray(remap_frame(light, turn), np.float32)
    exposed = seen * np.float32(2.0**stops)
    sigma = np.sqrt(np.clip(exposed, 0, 1) * 2e-4 + 1e-7)
    exposed = exposed + sigma * rng.standard_normal((*exposed.shape[:2], 1), np.float32)
    coded = srgb_encode(exposed) if curve is None else np.clip(exposed, 0, 1) ** (1 / curve)
    bytes_ = np.rint(255 * coded).astype(np.uint8)
    file = cv2.imencode(".jpg", bytes_[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 95])[1]
    decoded = cv2.imdecode(file, cv2.IMREAD_COLOR)
    assert decoded is not None
    small = cv2.resize(
        np.ascontiguousarray(decoded[..., ::-1]), SMALL, interpolation=cv2.INTER_AREA
    )
    return np.asarray(small, np.uint8)


def _misfits(
    found: Sequence[FrameAlignment], turns: Sequence[NDArray[np.float64] | None], reference: int
) -> list[float]:
    """Angle that is left between each frame and the reference after what is applied, degrees."""
    lie = [
        (np.eye(3) if a.rotation is None else a.rotation) @ (np.eye(3) if t is None else t)
        for a, t in zip(found, turns, strict=True)
    ]
    return [angle_of(lie[reference].T @ matrix) for matrix in lie]


@pytest.mark.slow
@pytest.mark.parametrize("name", sample_first(NAMES, 2))
def test_aligned_frames_are_left_alone_and_one_rotated_frame_is_found(name: str) -> None:
    light, stops = _scene(name), (2.0, 0.0, -2.0)
    frames = [_shoot(light, ev) for ev in stops]
    still = estimate(frames, stops)
    assert all(a.trusted and a.rotation is None for a in still)
    assert max(a.angle_deg for a in still) < 0.02
    assert sentences(remarks(still, ["a", "b", "c"])) == ()
    turn = rotation(3.0, 2.0, 1.0)
    for moved, ev in enumerate(stops):
        bracket = [*frames]
        bracket[moved] = _shoot(light, ev, turn)
        turns = [turn if k == moved else None for k in range(3)]
        found = estimate(bracket, stops)
        assert max(_misfits(found, turns, reference_of(bracket))) < 0.05
        assert all(a.residual_deg < 0.05 for a in found)
        assert all(a.rotation is None for a in found) is False


@pytest.mark.slow
@pytest.mark.parametrize("turn", [(10, 0, 0), (0, 10, 0), (0, 0, 10), (-6, 5, -6), (0.2, -0.1, 0)])
@pytest.mark.parametrize("name", sample_first(["studio", "forest", "sunset"], 1))
def test_rotations_up_to_ten_degrees(name: str, turn: tuple[float, float, float]) -> None:
    light, matrix = _scene(name), rotation(*turn)
    frames = [_shoot(light, 1.5), _shoot(light, -0.5), _shoot(light, -2.5, matrix)]
    found = estimate(frames, (1.5, -0.5, -2.5))
    assert max(_misfits(found, [None, None, matrix], 1)) < 0.05
    assert found[0].rotation is None
    assert found[1].rotation is None
    assert found[2].angle_deg == pytest.approx(angle_of(matrix), abs=0.05)


def test_wrong_tags_and_another_curve_do_not_matter() -> None:
    light, matrix = _scene("interior"), rotation(3.0, 2.0, 1.0)
    frames = [_shoot(light, 2, curve=1.7), _shoot(light, 1, matrix, curve=1.7)]
    found = estimate(frames, (5.0, 0.0))  # in truth one stop apart
    assert max(_misfits(found, [None, matrix], reference_of(frames))) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("name", sample_first(["city", "interior", "courtyard", "sunrise"], 2))
def test_people_who_walk_are_not_motion_of_the_camera(name: str) -> None:
    light = _scene(name)
    looks = directions((1024, 2048))
    azimuth = np.degrees(np.arctan2(-looks[..., 0], looks[..., 2]))
    elevation = np.degrees(np.arcsin(looks[..., 1]))
    frames = []
    for ev, places in ((2, (-60, 80)), (0, (-50, 70)), (-2, (-40, 60))):
        crowd = light.copy()
        for place, tone in zip(places, (0.02, 0.5), strict=True):
            body = (np.abs(azimuth - place) < 9) & (np.abs(elevation + 15) < 35)
            stripes = 1.0 + 0.6 * np.sign(np.sin(elevation + azimuth - place))
            crowd[body] = (tone * stripes[body])[:, None] * np.array([1.2, 1.0, 0.7])
        frames.append(_shoot(crowd, ev))
    found = estimate(frames, (2, 0, -2))
    assert all(a.trusted and a.rotation is None for a in found)


@pytest.mark.parametrize("name", ["forest", "sunrise", "city"])
def test_drifting_clouds_are_not_motion_of_the_camera(name: str) -> None:
    light = _scene(name)
    frames = []
    for ev, drift in ((2, 0), (0, 12), (-2, 24)):  # columns of 0.18 degrees
        sky = light.copy()
        sky[:410] = np.roll(sky[:410], drift, axis=1)
        frames.append(_shoot(sky, ev))
    found = estimate(frames, (2, 0, -2))
    assert all(a.rotation is None for a in found)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["night", "interior", "studio"])
def test_blooming_lamps_are_not_motion_of_the_camera(name: str) -> None:
    light = _scene(name)
    lopsided = np.roll(cv2.GaussianBlur(light, (0, 0), 25), 20, axis=1)
    frames = [_shoot(0.8 * light + np.float32(0.2) * lopsided, ev) for ev in (3, 0, -3)]
    found = estimate(frames, (3, 0, -3))
    assert all(a.rotation is None for a in found)


@pytest.mark.parametrize("fill", [0, 128])
def test_half_a_file_is_enough(fill: int) -> None:
    light, matrix = _scene("city"), rotation(3.0, 2.0, 1.0)
    frames = [_shoot(light, 2), _shoot(light, 0), _shoot(light, -2)]
    frames[2][170:] = fill
    assert all(a.rotation is None for a in estimate(frames, (2, 0, -2)))
    frames[2] = _shoot(light, -2, matrix)
    frames[2][170:] = fill
    found = estimate(frames, (2, 0, -2))
    assert max(_misfits(found, [None, None, matrix], 1)) < 0.1


@pytest.mark.slow
def test_a_long_bracket_is_followed_from_frame_to_frame() -> None:
    light, bump = _scene("interior"), rotation(1.0, -2.0, 1.5)
    stops = [4.0 - 2.0 * k for k in range(9)]
    turns = [None if k < 4 else bump for k in range(9)]
    frames = [_shoot(light, ev, turn) for ev, turn in zip(stops, turns, strict=True)]
    found = estimate(frames, stops)
    reference = reference_of(frames)
    compared = [k for k in range(9) if found[k].trusted]
    assert len(compared) >= 5
    left = _misfits(found, turns, reference)
    assert max(left[k] for k in compared) < 0.1
    assert all(found[k].rotation is None for k in range(9) if k not in compared)
    words = sentences(remarks(found, [f"R{k}.JPG" for k in range(9)]))
    turned = [k for k in range(9) if found[k].rotation is not None]
    assert all(f"R{k}.JPG by 2." in words[0] for k in turned)
    assert words[0].count("by 2.") == len(turned)
    if len(compared) < 9:
        lost = next(k for k in range(9) if not found[k].trusted)
        assert f"R{lost}.JPG" in words[1]
        assert "left as shot" in words[1]


@pytest.mark.slow
def test_frames_that_share_nothing_are_left_alone() -> None:
    light = _scene("studio")
    other = _scene("forest")
    rng = np.random.default_rng(0)
    noise = rng.integers(0, 256, (336, 672, 3), np.uint8)
    for stranger in (np.zeros_like(noise), np.full_like(noise, 255), noise, _shoot(other, -1)):
        found = estimate([_shoot(light, 1), _shoot(light, 0), stranger], (1, 0, -1))
        assert not found[2].trusted
        assert all(a.rotation is None for a in found)
        expected = (FramesUnlike(("c",)),) if stranger.std() > 0 else ()
        assert tuple(remarks(found, ["a", "b", "c"])) == expected


def test_lone_frames_and_ordinary_pictures_are_left_alone() -> None:
    picture = np.random.default_rng(0).integers(0, 256, (300, 400, 3), np.uint8)
    assert [a.rotation for a in estimate([picture, picture], (1, 0))] == [None, None]
    assert sentences(remarks(estimate([picture], (0,)), ["a"])) == ()


def test_a_frame_may_be_exposed_as_the_reference_is() -> None:
    light = _scene(NAMES[0])
    stops = [0.0, 0.0, -2.0]
    frames = [_shoot(light, stop, seed=k) for k, stop in enumerate(stops)]
    found = estimate(frames, stops)
    assert len(found) == 3
    assert all(one.rotation is None for one in found)
