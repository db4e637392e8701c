"""The sitter's head, against the demo location's views, where the truth is known."""

from __future__ import annotations

import json
import math
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.errors import CoreError
from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.core.faces import finder
from app.core.localization import sitter as module
from app.core.localization.heading_conversion import offset_angle
from app.core.localization.sitter import Sitter, background_mask, find_sitter
from app.core.localization.views import Lens, look
from app.core.measure.finish.display import display_panorama
from benchmarks.heading.scripted_turn.phone import disturbed, random_disturbance
from tests.helpers.cases import sample_first

Bytes = NDArray[np.uint8]
VIEWS = resources() / "demo" / "location" / "views"
FOV_DEG = 60.0
SIZE = (640, 480)


def focal(width: int, fov_deg: float) -> float:
    return 0.5 * width / math.tan(math.radians(fov_deg) / 2.0)


def aimed_aside(picture: Bytes, aside_deg: float) -> Bytes:
    """What the camera sees that is turned so that the sitter appears `aside_deg` to the right.

    A camera that turns about its own middle sees the same rays: a homography, without parallax.
    """
    height, width = picture.shape[:2]
    old, new = focal(width, FOV_DEG), focal(SIZE[0], FOV_DEG)
    a = math.radians(-aside_deg)
    turn = np.array(
        [[math.cos(a), 0.0, -math.sin(a)], [0.0, 1.0, 0.0], [math.sin(a), 0.0, math.cos(a)]]
    )
    before = np.array([[old, 0, width / 2 - 0.5], [0, old, height / 2 - 0.5], [0, 0, 1]])
    after = np.array([[new, 0, SIZE[0] / 2 - 0.5], [0, new, SIZE[1] / 2 - 0.5], [0, 0, 1]])
    return np.asarray(cv2.warpPerspective(picture, after @ turn @ np.linalg.inv(before), SIZE))


def view(turn_deg: int, distance_cm: int, aside_deg: float = 0.0) -> Bytes:
    file = VIEWS / f"view-{turn_deg:03d}-{distance_cm}.webp"
    codes = cv2.imread(str(file))
    assert codes is not None
    read = cv2.cvtColor(codes, cv2.COLOR_BGR2RGB)
    return aimed_aside(np.asarray(read, np.uint8), aside_deg)


@cache
def panorama(name: str) -> Bytes:
    file = resources() / "demo" / "scenes" / f"{name}.exr"
    radiance = np.asarray(read_environment(file).radiance, np.float32)
    return np.asarray(display_panorama(radiance, 0.0), np.uint8)


@pytest.fixture
def no_face(monkeypatch: pytest.MonkeyPatch) -> None:
    """As where no face shows: the own network alone."""
    monkeypatch.setattr(module, "_largest_face", lambda *_: None)


def blind(*_: object) -> list[object]:
    raise AssertionError("the whole picture was searched")


def test_the_sitter_of_these_views_is_on_the_axis() -> None:
    views = json.loads((VIEWS / "views.json").read_text())["views"]
    for one in views:
        to_head = np.array([0.0, 1.6, 0.0]) - one["position_m"]
        seen = np.array(one["rotation"]) @ to_head
        assert abs(math.degrees(math.atan2(seen[0], seen[2]))) < 1e-3


@pytest.mark.slow
def test_the_angle_is_that_of_the_middle_of_the_head() -> None:
    chance, errors, asked = np.random.default_rng(11), [], 0
    for turn in range(0, 360, 40):
        for distance in (120, 180, 250):
            for aside in (-15.0, 0.0, 15.0):
                picture = view(turn, distance, aside)
                picture = disturbed(picture, random_disturbance(chance), chance)
                found = find_sitter(picture, FOV_DEG)
                asked += 1
                if found is not None:
                    errors.append(found.angle_deg - aside)
    off = np.abs(errors)
    assert len(errors) >= 0.9 * asked
    assert np.median(off) <= 0.5
    assert np.percentile(off, 95) <= 1.5
    assert abs(np.median(errors)) <= 0.25, "the middle of the head, not of its bright half"


@pytest.mark.parametrize("stops", [-2.0, -1.0, 1.0, 2.0])
def test_exposure_hardly_matters(stops: float) -> None:
    plain = view(150, 180, 10.0)
    codes = 255.0 * np.clip((plain / 255.0) ** 2.2 * 2.0**stops, 0.0, 1.0) ** (1.0 / 2.2)
    found = find_sitter(codes.astype(np.uint8), FOV_DEG)
    assert found is not None
    assert found.angle_deg == pytest.approx(10.0, abs=0.8)


def test_mirroring_mirrors_the_answer() -> None:
    picture = view(90, 120, 7.0)
    found, other = find_sitter(picture, 70.0), find_sitter(picture[:, ::-1].copy(), 70.0)
    assert found is not None
    assert other is not None
    assert found.column + other.column == pytest.approx(1.0, abs=0.005)
    assert found.angle_deg == pytest.approx(-other.angle_deg, abs=0.3)


def test_box_column_and_angle_say_the_same() -> None:
    found = find_sitter(view(120, 180, -9.0), 60.0)
    assert found is not None
    left, top, right, bottom = found.box
    assert left < found.column < right
    assert found.column == pytest.approx((left + right) / 2.0)
    assert found.angle_deg == pytest.approx(offset_angle(found.column * 640, 640, 60.0), abs=1e-9)
    # 23 cm from crown to chin, 1.8 m away.
    expected = focal(640, 60.0) * 0.23 / 1.8
    assert (bottom - top) * 480 == pytest.approx(expected, rel=0.2)
    assert 0.5 < found.confidence <= 1.0
    assert found.kind == "face"


def test_portrait_pictures_too() -> None:
    tall = np.ascontiguousarray(view(60, 180)[:, 140:500])
    found = find_sitter(tall, 36.0)
    assert found is not None
    assert found.angle_deg == pytest.approx(0.0, abs=0.8)


def test_near_the_last_one_the_search_stays_there(monkeypatch: pytest.MonkeyPatch) -> None:
    before = find_sitter(view(200, 120, 0.0), FOV_DEG)
    assert before is not None
    monkeypatch.setattr(module, "_found_anywhere", blind)
    for aside in (-4.0, 0.0, 4.0):
        found = find_sitter(view(200, 120, aside), FOV_DEG, before)
        assert found is not None
        assert found.angle_deg == pytest.approx(aside, abs=1.0)


def test_a_sitter_who_jumped_is_found_again() -> None:
    before = find_sitter(view(200, 120, -15.0), FOV_DEG)
    found = find_sitter(view(200, 120, 18.0), FOV_DEG, before)
    assert found is not None
    assert found.angle_deg == pytest.approx(18.0, abs=1.0)


def test_near_is_cheaper(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = view(45, 180)
    found = find_sitter(picture, FOV_DEG)
    assert found is not None
    monkeypatch.setattr(finder, "_answers", blind)
    again = find_sitter(picture, FOV_DEG, found)
    assert again is not None
    assert again.column == pytest.approx(found.column, abs=0.003)


def test_near_is_cheaper_without_a_face(no_face: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the pixels that are looked at; the network's time is in proportion to them."""
    picture, seen = view(45, 180), []
    found = find_sitter(picture, FOV_DEG)
    assert found is not None
    answers = module._answers

    def counted(grey: Bytes, network: object) -> NDArray[np.float32]:
        seen.append(grey.size)
        return answers(grey, network)

    monkeypatch.setattr(module, "_answers", counted)
    cost = []
    for near in (None, found):
        seen.clear()
        assert find_sitter(picture, FOV_DEG, near) is not None
        cost.append(sum(seen))
    assert cost[1] < 0.6 * cost[0]
    assert cost[1] < 75_000


@pytest.mark.slow
@pytest.mark.parametrize("faces", [True, False])
def test_the_middle_of_the_head_with_and_without_landmarks(
    faces: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Faces that show are told by landmarks, heads that are half turned off by the own network."""
    if not faces:
        monkeypatch.setattr(module, "_largest_face", lambda *_: None)
    errors = [
        abs(found.angle_deg - aside)
        for turn in range(0, 360, 60)
        for aside in (-12.0, 12.0)
        if (found := find_sitter(view(turn, 180, aside), FOV_DEG)) is not None
    ]
    assert len(errors) >= 11
    assert np.median(errors) <= 0.5
    assert max(errors) <= 1.5


@pytest.mark.slow
@pytest.mark.parametrize("name", sample_first(["courtyard", "forest", "sunrise"], 1))
def test_nobody_is_found_where_nobody_is(name: str) -> None:
    """In places that the network has not learnt from."""
    chance, found = np.random.default_rng(8), 0
    for azimuth in range(0, 360, 15):
        lens = Lens(float(chance.uniform(40.0, 80.0)), SIZE)
        picture = look(panorama(name), float(azimuth), lens, float(chance.normal(0.0, 6.0)))
        found += find_sitter(picture, lens.fov_deg) is not None
    assert found <= 1


@pytest.mark.parametrize("level", [0, 90, 255])
def test_a_blank_picture_has_nobody(level: int) -> None:
    chance = np.random.default_rng(level)
    noise = np.clip(level + chance.normal(0.0, 6.0, (480, 640, 3)), 0.0, 255.0).astype(np.uint8)
    assert find_sitter(noise, FOV_DEG) is None


@pytest.mark.parametrize("shape", [(1, 1), (8, 640), (480, 4), (33, 33), (37, 801)])
def test_odd_sizes_are_no_trouble(shape: tuple[int, int]) -> None:
    somewhere = Sitter(0.99, 29.0, (0.9, -0.5, 1.4, 0.6))
    picture = np.zeros((*shape, 3), np.uint8)
    assert find_sitter(picture, FOV_DEG) is None
    assert find_sitter(picture, FOV_DEG, somewhere) is None


def test_the_mask_covers_the_sitter_and_leaves_the_place() -> None:
    """Against the depth maps: what is nearer than the place behind is the sitter."""
    for distance in (120, 180, 250):
        found = find_sitter(view(90, distance), FOV_DEG)
        assert found is not None
        mask = background_mask(found, (192, 256))
        assert mask.shape == (192, 256)
        assert mask.dtype == np.bool_
        code = cv2.imread(str(VIEWS / f"view-090-{distance}.png"), cv2.IMREAD_UNCHANGED)
        assert code is not None
        metres = 0.4 * 65535.0 / np.maximum(code, 1)
        person = (metres > distance / 100 - 0.45) & (metres < distance / 100 + 0.35)
        person[:, :40] = person[:, -40:] = False  # furniture
        person[150:] = False
        assert (~mask)[person].mean() >= 0.9
        assert mask.mean() >= 0.5


def test_the_mask_of_a_head_beyond_the_edge() -> None:
    mask = background_mask(Sitter(-0.05, -31.0, (-0.2, 0.1, 0.1, 0.5)), (60, 80))
    assert not mask.all()
    assert mask[:, 60:].all()


def test_a_damaged_network_is_said(
    no_face: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "sitter").mkdir()
    file = tmp_path / "sitter" / "heads.onnx"
    monkeypatch.setattr(module, "resources", lambda: tmp_path)
    module._network.cache_clear()
    try:
        with pytest.raises(CoreError, match="head detector"):
            find_sitter(view(0, 120), FOV_DEG)
        file.write_bytes(b"")
        with pytest.raises(CoreError, match="head detector"):
            find_sitter(view(0, 120), FOV_DEG)
        file.write_bytes(b"PK\x03\x04 nothing")
        with pytest.raises(CoreError, match="Reinstall Turnlight"):
            find_sitter(view(0, 120), FOV_DEG)
    finally:
        module._network.cache_clear()


def test_a_single_picture_is_believed_earlier_where_the_size_is_likely(
    no_face: None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def unsure(_grey: object, head: module._HeadBox) -> module._HeadBox:
        return module._HeadBox(head.x, head.y, head.tall, 0.8)

    monkeypatch.setattr(module, "_looked_again", unsure)
    seen = view(0, 180)
    assert find_sitter(seen, FOV_DEG) is None
    assert find_sitter(seen, FOV_DEG, keen=True) is not None
    # As seen by a lens of 10 deg it would be far too small.
    assert find_sitter(seen, 10.0, keen=True) is None
