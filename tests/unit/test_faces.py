"""Faces in pictures: the app's own portraits, places without people, and how a face reads."""

from __future__ import annotations

import math
from functools import cache

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.colour import to_bytes
from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.core.faces.finder import Face, face_mesh, find_faces
from app.core.faces.light_from_face import FaceLight, Unread, read_light
from app.core.faces.pose import USUAL_FOCAL, head_pose
from app.core.localization.views import Lens, look
from app.core.portrait.full_size_portrait import portrait_picture
from app.core.portrait.light import portrait_light
from app.core.portrait.portrait_file import load_portrait
from app.core.solver.place_light import prepare, turned
from tests.helpers.cases import sample_first
from tests.helpers.demo_place import demo_panorama

Bytes = NDArray[np.uint8]
Floats = NDArray[np.float32]
EYES = (33, 133), (362, 263)
# One head each time; the others belong to the sweeps.
HEADS = sample_first(["generic", "female", "male"], 1)


def lamp(azimuth_deg: float, elevation_deg: float, size_deg: float = 10.0) -> Floats:
    """A black place with one round lamp, towards the left of a sitter at turn 0."""
    rows, columns = 256, 512
    around = np.radians(180 - 360 * (np.arange(columns) + 0.5) / columns)[None]
    up = np.radians(90 - 180 * (np.arange(rows) + 0.5) / rows)[:, None]
    a, e = np.radians([azimuth_deg, elevation_deg])
    cosine = np.sin(up) * np.sin(e) + np.cos(up) * np.cos(e) * np.cos(around - a)
    shown = np.degrees(np.arccos(np.clip(cosine, -1, 1))) < size_deg / 2
    return np.repeat(shown[..., None], 3, axis=2).astype(np.float32) * 100


@cache
def portrait(name: str, azimuth_deg: float, elevation_deg: float) -> Bytes:
    """The app's own portrait of a head under one lamp, on grey."""
    return shown_in(name, lamp(azimuth_deg, elevation_deg))


def shown_in(name: str, place: Floats) -> Bytes:
    known = load_portrait(name, "medium", "short")
    assert known is not None
    picture = portrait_picture(*known, portrait_light(place), 0.0)
    linear = np.clip(0.9 * picture / np.percentile(picture, 99), 0, 1)
    linear[known[0].coverage == 0] = 0.2
    return np.asarray(
        to_bytes(np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055))
    )


def eyes_of(name: str) -> NDArray[np.float64]:
    """Where the portrait's eyes are, right one first: the pixels that show the eyeballs; (2, 2)."""
    known = load_portrait(name, "medium", "short")
    assert known is not None
    head = known[0]
    row, column = np.divmod(head.pixels[head.glass], head.inside.shape[1])
    middle = np.array([column.mean() + 0.5, row.mean() + 0.5])
    return np.stack([middle, [2 * head.inside.shape[1] - middle[0], middle[1]]])


@pytest.mark.parametrize("name", HEADS)
@pytest.mark.parametrize("side", [40, 160, 540])
@pytest.mark.parametrize("stops", [-3, 0])
def test_faces_of_any_size_and_exposure(name: str, side: int, stops: int) -> None:
    whole = portrait(name, 20.0, 20.0)
    scale = side / 385  # from forehead to chin
    small = cv2.resize(whole, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    picture = np.full((960, 1280, 3), 110, np.uint8)
    picture[30 : 30 + small.shape[0], 200 : 200 + small.shape[1]] = small
    picture = np.asarray((255 * (picture / 255) / 2 ** (-stops / 2.2)).round(), np.uint8)
    (face,) = find_faces(picture)
    assert face.confidence > (0.8 if side > 40 else 0.4)
    for corners, eye in zip(EYES, eyes_of(name) * scale + [200, 30], strict=True):
        found = face.landmarks[list(corners), :2].mean(axis=0)
        assert math.dist(found, eye) < 0.06 * side
    assert face.side == pytest.approx(side, rel=0.15)


def test_several_faces_the_largest_first() -> None:
    large = portrait("generic", 20.0, 20.0)
    small = cv2.resize(portrait("male", 20.0, 20.0), None, fx=0.4, fy=0.4)
    picture = np.full((640, 1000, 3), 120, np.uint8)
    picture[:, 350:990] = large
    picture[200 : 200 + small.shape[0], 20 : 20 + small.shape[1]] = small
    first, second = find_faces(picture)
    assert first.box[0] > 350 > second.box[2]


def test_the_largest_in_focus_comes_first() -> None:
    """A face out of focus in the foreground is not whom the picture is of."""
    frame = np.full((1000, 1600, 3), 120, np.uint8)
    large = cv2.resize(portrait("male", 35.0, 35.0), (800, 800))
    frame[100:900, 700:1500] = large
    frame[300:700, 100:500] = cv2.resize(
        portrait("female", 35.0, 35.0), (400, 400), interpolation=cv2.INTER_AREA
    )
    first, second = find_faces(frame)
    assert first.side > second.side
    frame[100:900, 700:1500] = cv2.GaussianBlur(large, (0, 0), 14)
    first, second = find_faces(frame)
    assert first.side < second.side


def test_a_face_is_found_again_and_lost() -> None:
    picture = portrait("generic", 20.0, 20.0)
    (face,) = find_faces(picture)
    (again,) = find_faces(np.roll(picture, 12, axis=1), face)
    assert np.allclose(again.landmarks[:, 0], face.landmarks[:, 0] + 12, atol=6)
    assert find_faces(np.full_like(picture, 90), face) == ()


def test_a_mirrored_face_is_the_mirror_image() -> None:
    picture = portrait("female", 40.0, 10.0)
    (face,), (other,) = find_faces(picture), find_faces(np.ascontiguousarray(picture[:, ::-1]))
    mirrored = other.landmarks[face_mesh().mirrored] * [-1, 1, 1] + [picture.shape[1], 0, 0]
    assert np.linalg.norm((face.landmarks - mirrored)[:, :2], axis=1).mean() < 4
    one, two = read_light(picture, face), read_light(picture[:, ::-1].copy(), other)
    assert one.azimuth_deg is not None
    assert two.azimuth_deg is not None
    assert one.azimuth_deg == pytest.approx(-two.azimuth_deg, abs=3)


def test_no_face_in_a_place_without_people() -> None:
    panorama = demo_panorama()
    for heading in range(0, 360, 30):
        for pitch in (-15.0, 15.0):
            view = look(panorama, float(heading), Lens(60.0, (640, 480)), pitch)
            assert find_faces(np.asarray(view, np.uint8)) == ()


@pytest.mark.parametrize("yaw", [-50.0, 0.0, 20.0])
@pytest.mark.parametrize("pitch", [-15.0, 10.0])
@pytest.mark.parametrize("aside_cm", [0.0, 25.0])
def test_pose_of_a_projected_head(yaw: float, pitch: float, aside_cm: float) -> None:
    """By hand: the canonical face, turned towards the lens, a metre away, through a pinhole."""
    y, p = math.radians(yaw), math.radians(pitch)
    up = np.array([[1, 0, 0], [0, math.cos(p), math.sin(p)], [0, -math.sin(p), math.cos(p)]])
    around = np.array([[math.cos(y), 0, math.sin(y)], [0, 1, 0], [-math.sin(y), 0, math.cos(y)]])
    line = math.atan2(-aside_cm, 100.0)
    toward = np.array(
        [[math.cos(line), 0, math.sin(line)], [0, 1, 0], [-math.sin(line), 0, math.cos(line)]]
    )
    points = face_mesh().points @ (toward @ around @ up).T + [aside_cm, 0, -100.0]
    focal = USUAL_FOCAL * 1000
    seen = focal * points[:, :2] / -points[:, 2:] * [1, -1] + 500
    landmarks = np.concatenate([seen, points[:, 2:]], axis=1).astype(np.float32)
    pose = head_pose(Face(landmarks, 1.0), (1000, 1000))
    assert pose.yaw_deg == pytest.approx(yaw, abs=0.5)
    assert pose.pitch_deg == pytest.approx(pitch, abs=0.5)


def read(picture: Bytes) -> FaceLight:
    return read_light(picture, find_faces(picture)[0])


@pytest.mark.parametrize("name", HEADS)
@pytest.mark.parametrize(
    ("azimuth", "elevation"), [(0, 45), (35, 35), (-60, 40), (-80, 10), (45, -20), (10, 70)]
)
def test_direction_of_one_lamp(name: str, azimuth: float, elevation: float) -> None:
    found = read(portrait(name, azimuth, elevation))
    assert found.reason is None
    assert found.key == "front"
    assert found.azimuth_deg is not None
    assert found.elevation_deg is not None
    ways = [
        np.array([math.sin(a) * math.cos(e), math.sin(e), math.cos(a) * math.cos(e)])
        for a, e in (
            np.radians([azimuth, elevation]),
            np.radians([found.azimuth_deg, found.elevation_deg]),
        )
    ]
    assert math.degrees(math.acos(min(ways[0] @ ways[1], 1.0))) < 14


def test_light_from_behind_has_no_direction() -> None:
    found = read(portrait("generic", 115.0, 15.0))
    assert (found.key, found.azimuth_deg, found.elevation_deg) == ("behind", None, None)


def test_even_light_is_flat() -> None:
    found = read(shown_in("generic", np.ones((64, 128, 3), np.float32)))
    assert found.reason is Unread.FLAT
    assert found.azimuth_deg is None
    assert found.ratio_stops == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize(
    ("style", "azimuth", "elevation"),
    [("left-loop", 35, 35), ("right-rembrandt", -60, 40), ("butterfly", 0, 45), ("top", 0, 80)],
)
def test_style_of_one_lamp(style: str, azimuth: float, elevation: float) -> None:
    found = read(portrait("male", azimuth, elevation))
    assert style in [name for name, _ in found.styles[:2]]


def test_style_in_a_soft_room() -> None:
    """Where the app itself offers the style: in a room with a window and white walls."""
    room = prepare(read_environment(resources() / "demo" / "scenes" / "interior.exr"))
    found = read(shown_in("generic", turned(room, 71.0, (256, 512))))
    assert found.styles[0][0] == "left-rembrandt"


@pytest.mark.parametrize(("ratio", "told"), [(8, 8.0), (4, 4.0), (2.5, 2.5)])
def test_a_fill_beside_the_key(ratio: float, told: float) -> None:
    key, fill = lamp(-65, 35), lamp(0, 0, 90.0)
    rows = np.cos(np.radians(90 - 180 * (np.arange(256) + 0.5) / 256))[:, None, None]
    # A meter that points at a lamp 90 degrees wide sees 0.854 of what one far away would give.
    whole = key / (key * rows).sum() + fill / (fill * rows).sum() / 0.854 / (ratio - 1)
    found = read(shown_in("generic", np.asarray(whole * 1e5, np.float32)))
    assert found.fill_ratio == told
    assert found.azimuth_deg == pytest.approx(-65, abs=6)
    assert found.elevation_deg == pytest.approx(35, abs=6)
    assert read(portrait("generic", -65, 35)).fill_ratio is None


def test_ratio_is_that_of_the_cheeks() -> None:
    """A lamp from the left and the same, a quarter as strong, from the right: two stops."""
    found = read(shown_in("generic", (lamp(80, 10) + lamp(-80, 10) / 4).astype(np.float32)))
    assert found.ratio_stops == pytest.approx(2.0, abs=0.35)


def mixed(ratio: float, fill: Floats, *keys: Floats) -> Floats:
    """Lamps and a fill, key and fill to fill as an upright meter sees them."""
    rows = np.cos(np.radians(90 - 180 * (np.arange(256) + 0.5) / 256))[:, None, None]
    key = np.sum(keys, axis=0)
    whole = key / (key * rows).sum() * (ratio - 1) + fill / (fill * rows).sum() / 0.854
    return np.asarray(whole * 1e5, np.float32)


def sky(*toward: float) -> Floats:
    """Light from all around, brighter towards one side: the sitter's left, up, front."""
    around = np.radians(180 - 360 * (np.arange(512) + 0.5) / 512)[None]
    up = np.radians(90 - 180 * (np.arange(256) + 0.5) / 256)[:, None]
    ways = np.sin(around) * np.cos(up), np.sin(up) + 0 * around, np.cos(around) * np.cos(up)
    shown = 1 + sum(share * way for share, way in zip(toward, ways, strict=True))
    return np.repeat(shown[..., None], 3, axis=2).astype(np.float32)


@pytest.mark.parametrize("name", HEADS)
@pytest.mark.parametrize(
    "toward", [(0.0, 0.0, 0.0), (0.12, 0.0, 0.0), (-0.12, 0.05, 0.1), (0.0, 0.0, 0.2)]
)
def test_even_light_has_no_direction(name: str, toward: tuple[float, float, float]) -> None:
    found = read(shown_in(name, sky(*toward)))
    assert (found.key, found.azimuth_deg, found.error_deg) == ("flat", None, None)
    assert found.reason is Unread.FLAT


@pytest.mark.parametrize("name", HEADS)
@pytest.mark.parametrize("elevation", [0, 5, 10])
def test_flash_at_the_lens_is_read_within_its_error(name: str, elevation: float) -> None:
    found = read(portrait(name, 0, elevation))
    assert found.key == "front"
    assert found.azimuth_deg is not None
    assert found.elevation_deg is not None
    assert found.error_deg is not None
    off = math.hypot(found.azimuth_deg, found.elevation_deg - elevation)
    assert off <= found.error_deg <= 20


@pytest.mark.parametrize("name", HEADS)
@pytest.mark.parametrize("ratio", [4, 16])
@pytest.mark.parametrize("azimuth", [115, -125])
def test_backlight_beside_a_fill_is_behind(name: str, ratio: float, azimuth: float) -> None:
    found = read(shown_in(name, mixed(ratio, lamp(0, 0, 90.0), lamp(azimuth, 15))))
    assert (found.key, found.azimuth_deg) == ("behind", None)


@pytest.mark.parametrize("azimuth", [115, -125])
def test_strong_fill_beside_backlight_is_flat_or_frontal(azimuth: float) -> None:
    found = read(shown_in("female", mixed(2, lamp(0, 0, 90.0), lamp(azimuth, 15))))
    assert found.azimuth_deg is None or abs(found.azimuth_deg) < 15


@pytest.mark.parametrize("azimuth", sample_first([-75, 30, 75], 1))
@pytest.mark.parametrize("ratio", [2, 3])
def test_key_in_front_beside_a_fill_is_not_behind(ratio: float, azimuth: float) -> None:
    found = read(shown_in("male", mixed(ratio, lamp(0, 0, 90.0), lamp(azimuth, 15))))
    assert found.key == "front"
