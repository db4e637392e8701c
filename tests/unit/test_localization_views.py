"""Views of the panorama: known directions on known pixels, the goal view on a real camera’s."""

from __future__ import annotations

import json
import math
from typing import Final

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base import sphere
from app.core.base.paths import resources
from app.core.guidance.who_moves import Mode
from app.core.localization.heading_conversion import (
    BACKGROUND_M,
    Looks,
    heading_of_turn,
    widened_fov,
)
from app.core.localization.views import Lens, background_view, bearings, goal_lens, goal_view, look

Bytes = NDArray[np.uint8]
FOLDER: Final = resources() / "demo" / "location" / "views"
LENS: Final = Lens(60.0, (512, 384))


def spotted(azimuth: float, elevation: float, width: int = 1024) -> Bytes:
    """A grey panorama with one white spot."""
    panorama = np.full((width // 2, width, 3), 40, np.uint8)
    vectors = sphere.directions((width // 2, width))
    panorama[vectors @ sphere.direction(azimuth, elevation) > math.cos(math.radians(1.5))] = 255
    return panorama


def centre(picture: Bytes) -> tuple[float, float]:
    grey = picture[..., 1].astype(float) - 40.0
    rows, columns = np.mgrid[: grey.shape[0], : grey.shape[1]]
    total = grey.sum()
    return float((columns * grey).sum() / total) + 0.5, float((rows * grey).sum() / total) + 0.5


@pytest.mark.parametrize("azimuth", [-179.0, -90.0, 0.0, 100.0, 180.0])
@pytest.mark.parametrize("aside", [-20.0, 0.0, 15.0])
def test_a_direction_lands_on_its_pixel(azimuth: float, aside: float) -> None:
    picture = look(spotted(azimuth + aside, 8.0), azimuth, LENS)
    x = 256 + LENS.focal_px * math.tan(math.radians(aside))
    y = 192 - LENS.focal_px * math.tan(math.radians(8.0)) / math.cos(math.radians(aside))
    assert centre(picture) == pytest.approx((x, y), abs=0.8)


@pytest.mark.parametrize("pitch", [-25.0, 0.0, 30.0])
def test_pixels_and_bearings_agree(pitch: float) -> None:
    pixels = np.array([[256.0, 192.0], [400.5, 100.25], [20.0, 350.0]])
    for vector, pixel in zip(bearings(LENS, 130.0, pitch, pixels), pixels, strict=True):
        elevation = math.degrees(math.asin(vector[1]))
        azimuth = math.degrees(math.atan2(-vector[0], vector[2]))
        picture = look(spotted(azimuth, elevation), 130.0, LENS, pitch)
        if 40 < pixel[0] < 472 and 40 < pixel[1] < 344:
            assert centre(picture) == pytest.approx(tuple(pixel), abs=0.8)
    front = bearings(LENS, 130.0, pitch, pixels[:1])[0]
    np.testing.assert_allclose(front, sphere.direction(130.0, pitch), atol=1e-12)


def test_linear_light_is_averaged_and_not_picked() -> None:
    """A chequered panorama, finer than the view, is even grey in it."""
    fine = np.indices((1024, 2048)).sum(axis=0) % 2
    picture = look(fine.astype(np.float32), 0.0, Lens(60.0, (64, 48)))
    assert picture.dtype == np.float32
    np.testing.assert_allclose(picture, 0.5, atol=0.2)
    assert abs(float(picture.mean()) - 0.5) < 0.02


@pytest.mark.parametrize("turn", [-170.0, -30.0, 0.0, 96.0])
@pytest.mark.parametrize("front", [0.0, 50.0])
def test_the_goal_view_has_the_background_in_its_middle(turn: float, front: float) -> None:
    behind = spotted(turn + 180.0 + front, 0.0)
    assert centre(goal_view(behind, turn, LENS, front_deg=front)) == pytest.approx(
        (256, 192), abs=0.8
    )
    x, _ = centre(background_view(behind, turn, front_deg=front))
    assert x == pytest.approx(64, abs=0.8)
    ahead = spotted(turn + front, 0.0)
    seen = goal_view(ahead, turn, LENS, looks=Looks.PHOTOGRAPHER, front_deg=front)
    assert centre(seen) == pytest.approx((256, 192), abs=0.8)
    selfie = goal_view(
        behind, turn, LENS, looks=Looks.PHOTOGRAPHER, mode=Mode.SELFIE, front_deg=front
    )
    assert centre(selfie) == pytest.approx((256, 192), abs=0.8)


def test_turning_clockwise_moves_the_background_to_the_left() -> None:
    """The camera pans to the right, so things move to the left; the strip's scale grows right."""
    panorama = spotted(-150.0, 0.0)
    xs = [centre(goal_view(panorama, turn, LENS))[0] for turn in (20.0, 25.0, 30.0, 35.0)]
    assert xs == sorted(xs, reverse=True)


def test_a_plane_behind_the_sitter_looks_as_from_the_camera() -> None:
    """A spot on a wall 4 m behind the sitter, seen from the probe and from 1.5 m in front."""
    x, up, depth, camera = 1.2, 0.5, 4.0, 1.5
    azimuth = math.degrees(math.atan2(x, depth))
    elevation = math.degrees(math.atan2(up, math.hypot(x, depth)))
    view = goal_view(spotted(azimuth, elevation), 180.0, LENS, camera_m=camera, background_m=depth)
    focal = LENS.focal_px / (depth + camera)
    assert centre(view) == pytest.approx((256 + focal * x, 192 - focal * up), abs=0.8)


@pytest.mark.parametrize(("turn", "distance"), [(90, 1.8), (180, 2.5), (0, 1.2), (200, 1.8)])
def test_the_goal_view_is_what_a_camera_sees(turn: int, distance: float) -> None:
    """Against the poses and depths of rendered views: a pixel of the wall, and of the goal view.

    What the camera has in a pixel and what the goal view has in the same pixel lie in the same
    direction from the probe, for all that is as far behind the sitter as was said.
    """
    views = json.loads((FOLDER / "views.json").read_text("utf-8"))
    entry = next(v for v in views["views"] if (v["turn_deg"], v["distance_m"]) == (turn, distance))
    code = cv2.imread(str(FOLDER / entry["depth"]), cv2.IMREAD_UNCHANGED)
    assert code is not None
    depth = views["depth"]["near_m"] * 65535 / np.maximum(code.astype(float), 1.0)
    middle = float(np.median(depth[depth > distance + 0.5]))
    rows, columns = np.nonzero(np.abs(depth / middle - 1.0) < 0.05)
    pixels = np.stack([2.0 * columns + 1.0, 2.0 * rows + 1.0], axis=1)
    flat = (pixels - [256.0, 192.0]) / views["focal_px"]
    camera = np.concatenate([flat, np.ones((len(flat), 1))], axis=1) * depth[rows, columns][:, None]
    world = camera @ np.array(entry["rotation"]) + np.array(entry["position_m"])
    truth = world - [0.0, 1.6, 0.0]
    truth /= np.linalg.norm(truth, axis=1, keepdims=True)

    def away(background_m: float) -> float:
        wide = goal_lens(LENS, camera_m=distance, background_m=background_m)
        azimuth = heading_of_turn(turn)
        shown = bearings(wide, azimuth, 0.0, pixels)
        return float(np.degrees(np.linalg.norm(shown - truth, axis=1).max()))

    assert away(middle - distance) < 1.0
    assert away(math.inf) > 1.3 * away(middle - distance) + 0.5
    if middle - distance < 8.0:  # a room: the default is not exact, and far better than nothing
        assert away(BACKGROUND_M) < 0.5 * away(math.inf)


def test_a_wider_background_shows_more_at_the_same_scale() -> None:
    panorama = spotted(-160.0, 0.0)  # 20 deg right of what is behind turn 0
    wide = background_view(panorama, 0.0, (272, 136))
    narrow = background_view(panorama, 0.0, (128, 136))
    assert wide.shape == (136, 272, 3)
    assert centre(wide)[0] - 136 == pytest.approx(centre(narrow)[0] - 64, abs=0.3)


def test_goal_lens_keeps_the_size() -> None:
    wide = goal_lens(LENS, camera_m=1.0, background_m=4.0)
    assert wide.size == LENS.size
    assert wide.fov_deg == pytest.approx(widened_fov(60.0, 1.0, 4.0))
