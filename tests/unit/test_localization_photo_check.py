"""A photograph that was taken: read whichever way up, located, and judged by known turns."""

from __future__ import annotations

import os
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.core.base.angles import difference, wrap
from app.core.base.errors import Cancelled, CoreError
from app.core.base.progress import Token
from app.core.environment.environment import Environment
from app.core.guidance.guide import Goal
from app.core.localization.photo_location import (
    Photo,
    is_panorama,
    judge,
    locate_photo,
    read_photo,
    search_photo,
)
from app.core.solver.place_light import prepare
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.solver.turn_choice import Limits
from app.words.photos import photo_warnings
from tests.helpers.cases import sample_first
from tests.helpers.photos import demo_index, photo_bytes, taken_from, write_photo
from tests.helpers.synthetic import lamp_environment, synthetic_pack

LANDSCAPE = np.zeros((240, 320, 3), np.uint8)
LANDSCAPE[:120, :160] = (220, 40, 40)  # the upper left corner is red,
LANDSCAPE[120:, 160:] = (40, 40, 220)  # the lower right one blue


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_photo_is_upright_whichever_way_the_camera_was_held(
    tmp_path: Path, orientation: int
) -> None:
    path = write_photo(tmp_path / "photo.jpg", LANDSCAPE, orientation)
    photo = read_photo(path)
    assert photo.picture.shape == (240, 320, 3)
    assert photo.size == (320, 240)
    np.testing.assert_allclose(photo.picture[60, 80], (220, 40, 40), atol=12)
    np.testing.assert_allclose(photo.picture[180, 240], (40, 40, 220), atol=12)
    np.testing.assert_allclose(photo.picture[60, 240], 0, atol=12)


@pytest.mark.parametrize(
    ("lens", "front"),
    [
        (b"iPhone 15 front camera 2.69mm f/1.9", True),
        (b"Pixel 8 Pro front camera 2.74mm f/2.2", True),
        (b"iPhone 15 back dual wide camera 5.96mm f/1.6", False),
        (b"EF 85mm f/1.8 USM", False),
        (None, False),
    ],
)
def test_photo_of_a_front_camera_may_be_mirrored(
    tmp_path: Path, lens: bytes | None, front: bool
) -> None:
    path = tmp_path / "selfie.jpg"
    path.write_bytes(photo_bytes(LANDSCAPE, lens=lens))
    assert read_photo(path).front_camera is front


@pytest.mark.slow
def test_place_tells_a_mirrored_photo() -> None:
    photo = Photo(taken_from(40.0).picture, (1200, 900), None, 30.0)
    plain, mirror = (locate_photo(one, demo_index()) for one in (photo, photo.flipped))
    assert (plain.mirrored, mirror.mirrored) == (False, True)
    assert mirror.facing_deg == pytest.approx(plain.facing_deg, abs=1.0)
    assert search_photo(photo.flipped, demo_index(), mirrored=True).mirrored
    assert search_photo(photo, demo_index(), mirrored=True).heading.heading_deg is None


def test_a_portrait_is_as_wide_as_its_short_side(tmp_path: Path) -> None:
    # 35 mm equivalents mean the diagonal (CIPA DCG-001), 43.27 mm of the frame.
    upright = write_photo(tmp_path / "a.jpg", np.zeros((320, 240, 3), np.uint8), 6)
    lying = write_photo(tmp_path / "b.jpg", LANDSCAPE, 1)
    assert read_photo(lying).fov_deg == pytest.approx(60.0, abs=0.1)
    assert read_photo(upright).size == (240, 320)
    assert read_photo(upright).fov_deg == pytest.approx(46.8, abs=0.1)


def test_when_it_was_taken(tmp_path: Path) -> None:
    path = tmp_path / "photo.jpg"

    def said(taken: bytes | None, offset: bytes | None) -> datetime | None:
        path.write_bytes(photo_bytes(LANDSCAPE, taken=taken, offset=offset))
        return read_photo(path).taken_at

    zone = timezone(timedelta(hours=1))
    whole = b"2026:11:21 14:03:20"
    assert said(whole, b"+01:00") == datetime(2026, 11, 21, 14, 3, 20, tzinfo=zone)
    plain = said(whole, None)
    assert plain is not None
    assert plain.tzinfo is None
    assert plain.replace(tzinfo=UTC) == datetime(2026, 11, 21, 14, 3, 20, tzinfo=UTC)
    for junk in (b"0000:00:00 00:00:00", b"    :  :     :  :  ", b"yesterday", b"\xff\xfe"):
        assert said(junk, b"+01:00") is None
    assert said(None, None) is None


def test_a_large_photo_is_made_small_and_one_of_16_bits_is_read(tmp_path: Path) -> None:
    path = tmp_path / "photo.png"
    deep = np.zeros((1500, 3000, 3), np.uint16)
    deep[..., 0] = 40_000
    assert cv2.imwrite(str(path), deep[..., ::-1])
    photo = read_photo(path)
    assert photo.size == (3000, 1500)
    assert photo.picture.shape == (800, 1600, 3)
    assert photo.picture.dtype == np.uint8
    assert photo.picture[5, 5].tolist() == [40_000 >> 8, 0, 0]
    assert (photo.focal_mm, photo.fov_deg, photo.taken_at) == (None, None, None)
    assert is_panorama(path)
    assert not is_panorama(write_photo(tmp_path / "lying.jpg", LANDSCAPE))


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "empty"),
        (b"hello, this is no picture at all", "not a readable picture"),
        (b"\xff\xd8\xff\xe0 and then nothing", "damaged"),
    ],
)
def test_what_is_no_photo(tmp_path: Path, data: bytes, says: str) -> None:
    path = tmp_path / "photo.jpg"
    path.write_bytes(data)
    with pytest.raises(CoreError, match=says):
        read_photo(path)
    with pytest.raises(CoreError, match=says):
        is_panorama(path)


def test_what_is_cut_off_missing_or_never_ends(tmp_path: Path) -> None:
    path = write_photo(tmp_path / "photo.jpg", taken_from(90.0).picture)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(CoreError, match="damaged"):
        read_photo(path)
    with pytest.raises(CoreError, match="no file"):
        read_photo(tmp_path / "other.jpg")
    with pytest.raises(CoreError, match="is not a picture file"):
        read_photo(tmp_path)
    os.mkfifo(tmp_path / "pipe.jpg")
    with pytest.raises(CoreError, match="is not a picture file"):
        read_photo(tmp_path / "pipe.jpg")
    assert cv2.imwrite(str(path), np.zeros((90, 120, 3), np.uint8))
    with pytest.raises(CoreError, match="120 x 90"):
        read_photo(path)


def test_it_can_be_stopped(tmp_path: Path) -> None:
    token = Token()
    token.cancel()
    path = write_photo(tmp_path / "photo.jpg", LANDSCAPE)
    with pytest.raises(Cancelled):
        read_photo(path, token)
    with pytest.raises(Cancelled):
        locate_photo(read_photo(path), demo_index(), token)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("turn", "aim"), sample_first([(-127.0, 8.0), (93.0, 0.0), (20.0, -8.0)], 1)
)
def test_a_known_turn_with_the_sitter_beside_the_middle(turn: float, aim: float) -> None:
    view = taken_from(turn, aim)
    taken = locate_photo(Photo(view.picture, (4000, 3000), None, 30.0), demo_index())
    assert taken.status == "found"
    assert taken.heading_deg is not None
    assert taken.facing_deg is not None
    assert abs(difference(taken.heading_deg, view.heading_deg)) <= 3.0
    # The sitter's own angle counts: without it the turn would be as far off as the aim.
    assert abs(difference(taken.facing_deg, view.turn_deg)) <= 3.0
    assert taken.sitter_deg == pytest.approx(view.sitter_deg, abs=3.0)
    assert 0.5 < taken.confidence <= 1.0


@pytest.mark.slow
def test_cropped_photos_are_found_although_their_focal_length_lies() -> None:
    off = []
    for azimuth in range(8, 368, 72):
        view = taken_from(float(azimuth))
        middle = np.ascontiguousarray(view.picture[:, 250:950])
        taken = locate_photo(Photo(middle, (700, 900), None, 14.0), demo_index())
        if taken.facing_deg is not None:
            off.append(abs(difference(taken.facing_deg, view.turn_deg)))
    assert len(off) >= 4
    assert max(off) <= 3.0


@pytest.mark.slow
def test_a_crop_is_said_and_a_whole_photo_is_not_called_one() -> None:
    view = taken_from(104.0)
    middle = np.ascontiguousarray(view.picture[:, 250:950])
    cropped = search_photo(Photo(middle, (700, 900), None, 14.0), demo_index())
    (warning,) = photo_warnings(cropped)
    assert warning.startswith("The photo seems to be cropped: ")
    whole = search_photo(Photo(view.picture, (4000, 3000), None, 30.0), demo_index())
    assert whole.stated_deg is None
    assert whole.heading.fov_deg == pytest.approx(60.0, rel=0.05)


def test_a_photo_from_elsewhere_is_unsure() -> None:
    chance = np.random.default_rng(3)
    noise = cv2.GaussianBlur(chance.integers(0, 255, (600, 800, 3), dtype=np.uint8), (0, 0), 4)
    wall = np.full((600, 800, 3), 170, np.uint8)
    for picture in (np.asarray(noise, np.uint8), wall):
        taken = locate_photo(Photo(picture, (800, 600), None, 30.0), demo_index())
        assert (taken.status, taken.heading_deg, taken.facing_deg) == ("unsure", None, None)


def result_of(lamp_deg: float) -> StyleResult:
    luminance = lamp_environment(lamp_deg, 20.0, fill=0.02)
    light = prepare(
        Environment(np.repeat(luminance[..., None], 3, axis=2).astype(np.float32), "lamp")
    )
    pack = synthetic_pack()
    results = solve_all(pack, light.searched, "picture", limits=Limits(0.0, 0.0))
    return next(one for one in results if one.name == "butterfly")


@pytest.mark.parametrize("lamp", [60.0, -60.0])
def test_the_verdict_on_a_known_turn(lamp: float) -> None:
    # A lamp in front of the face is at the turn of its azimuth, and a place mirrored is mirrored.
    result = result_of(lamp)
    goal = Goal(result.turn_refined_deg, result.arc_deg)
    assert result.turn_refined_deg == pytest.approx(lamp, abs=1.0)
    best = judge(result.turn_refined_deg, goal, result)
    assert (best.to_go_deg, best.outside_deg) == (0, 0)
    assert best.match == best.best
    way = 1 if lamp > 0 else -1
    short = judge(lamp - way * 40.0, goal, result)
    past = judge(lamp + way * 40.0, goal, result)
    assert way * short.to_go_deg == pytest.approx(40, abs=1)
    assert way * past.to_go_deg == pytest.approx(-40, abs=1)
    assert 0 < short.outside_deg < 40
    assert short.match < best.match
    assert short.best == past.best == best.best
    assert short.goal_deg - short.turn_deg == short.to_go_deg
    around = [judge(wrap(lamp + by), goal, result).match for by in range(0, 91, 30)]
    assert around == sorted(around, reverse=True)
