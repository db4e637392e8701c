"""The live heading: on the demo location's views, whose turns are exact, and on other places."""

from __future__ import annotations

from functools import cache
from typing import Final

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base import sphere
from app.core.base.angles import difference
from app.core.base.errors import Cancelled, CoreError
from app.core.base.paths import resources
from app.core.base.progress import Progress, Task, Token
from app.core.environment.environment import read_environment
from app.core.localization import rotation
from app.core.localization.features import HeadingIndex, build_index
from app.core.localization.heading import Heading, find_heading
from app.core.localization.heading_conversion import turn_of_heading
from app.core.localization.views import Lens, look
from app.core.measure.finish.display import display_panorama
from tests.helpers.cases import sample_first
from tests.helpers.demo_place import demo_panorama
from tests.helpers.lens_matrix import lens_matrix

Bytes = NDArray[np.uint8]
FOLDER: Final = resources() / "demo" / "location" / "views"
PLACES: Final = [(turn, d) for d in (120, 180, 250) for turn in range(0, 360, 40)]


@pytest.fixture(scope="module")
def index() -> HeadingIndex:
    return build_index(demo_panorama())


@cache
def view(turn: int, distance: int) -> Bytes:
    picture = cv2.imread(str(FOLDER / f"view-{turn:03d}-{distance}.webp"))
    assert picture is not None
    return np.ascontiguousarray(picture[..., ::-1])


def errors(found: list[tuple[Heading, float]]) -> NDArray[np.float64]:
    """Of the turns found, degrees; none for who is unsure."""
    turns = [(turn_of_heading(h.heading_deg), t) for h, t in found if h.heading_deg is not None]
    return np.array([abs(difference(turn, truth)) for turn, truth in turns])


@pytest.mark.slow
def test_turns_are_found_despite_parallax(index: HeadingIndex) -> None:
    """Measured on all 216 views: none refused, median 0.02 deg, largest 0.14."""
    found = [(find_heading(view(t, d), index, 60.0), float(t)) for t, d in PLACES]
    off = errors(found)
    assert len(off) == len(PLACES)
    assert np.median(off) < 0.1
    assert off.max() < 0.5
    for heading, _ in found:
        assert abs(heading.pitch_deg) < 1.0
        assert abs(heading.roll_deg) < 1.0
        assert heading.confidence > 0.3


@pytest.mark.slow
@pytest.mark.parametrize("fov", sample_first([50.0, 72.0], 1))
def test_a_wrong_field_of_view_does_no_harm(index: HeadingIndex, fov: float) -> None:
    found = [(find_heading(view(t, d), index, fov), float(t)) for t, d in PLACES[::4]]
    off = errors(found)
    assert len(off) >= len(found) - 1
    assert off.max() < 1.0


@pytest.mark.slow
def test_noise_exposure_blur_and_compression(index: HeadingIndex) -> None:
    chance = np.random.default_rng(3)
    found = []
    for number, (turn, distance) in enumerate(PLACES[::3]):
        worn = view(turn, distance) * (0.4, 1.0, 1.8)[number % 3]
        worn = worn + chance.normal(0.0, 10.0, worn.shape)
        soft = cv2.GaussianBlur(np.clip(worn, 0, 255).astype(np.uint8), (0, 0), 1.2)
        done, data = cv2.imencode(".jpg", soft, [cv2.IMWRITE_JPEG_QUALITY, 60])
        assert done
        picture = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)
        found.append((find_heading(picture, index, 60.0), float(turn)))
    off = errors(found)
    assert len(off) >= len(found) - 1
    assert off.max() < 1.0


@pytest.mark.slow
def test_the_sitter_beside_the_axis(index: HeadingIndex) -> None:
    """The camera pans 8 deg to the right: heading 8 more, sitter at -8, the same turn."""
    lens = Lens(60.0, (512, 384))
    angle = np.radians(8.0)
    pan = np.array(
        [[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]]
    )
    warp = lens_matrix(lens) @ pan @ np.linalg.inv(lens_matrix(lens))
    for turn, distance in PLACES[::5]:
        panned = np.asarray(cv2.warpPerspective(view(turn, distance), warp, lens.size), np.uint8)
        heading = find_heading(panned, index, 60.0, sitter_deg=-8.0)
        assert heading.heading_deg is not None
        assert difference(heading.heading_deg, turn + 180.0 + 8.0) == pytest.approx(0.0, abs=0.6)
        assert difference(
            turn_of_heading(heading.heading_deg, sitter_deg=-8.0), turn
        ) == pytest.approx(0.0, abs=0.6)


def test_tracking_looks_only_near(index: HeadingIndex) -> None:
    picture = view(80, 180)
    near = find_heading(picture, index, 60.0, near_deg=-95.0)
    assert near.heading_deg == pytest.approx(-100.0, abs=0.5)
    assert find_heading(picture, index, 60.0, near_deg=80.0).status == "unsure"


def test_a_tilted_camera(index: HeadingIndex) -> None:
    lens = Lens(60.0, (640, 480))
    picture = look(demo_panorama(), 75.0, lens, 12.0)
    turned = cv2.getRotationMatrix2D((320.0, 240.0), 7.0, 1.0)  # the picture counter-clockwise
    picture = np.asarray(cv2.warpAffine(picture, turned, lens.size), np.uint8)
    heading = find_heading(picture, index, 60.0)
    assert heading.heading_deg == pytest.approx(75.0, abs=0.5)
    assert heading.pitch_deg == pytest.approx(12.0, abs=0.5)
    assert heading.roll_deg == pytest.approx(7.0, abs=0.5)


def test_other_places_are_refused(index: HeadingIndex) -> None:
    lens = Lens(60.0, (640, 480))
    panoramas = [demo_panorama(2)]
    for name in ("courtyard", "studio"):
        light = read_environment(resources() / "demo" / "scenes" / f"{name}.exr")
        panoramas.append(display_panorama(light.radiance, width=2048))
    for number, panorama in enumerate(panoramas):
        for azimuth in (-120.0, 0.0, 120.0):
            found = find_heading(look(panorama, azimuth, lens), index, 60.0)
            assert found.status == "unsure", (number, azimuth)
            assert found.heading_deg is None


@pytest.mark.parametrize("kind", ["black", "noise", "stripes", "mirrored", "tiny"])
def test_what_shows_nothing_is_refused(index: HeadingIndex, kind: str) -> None:
    picture = {
        "black": np.zeros((480, 640, 3), np.uint8),
        "noise": np.random.default_rng(0).integers(0, 256, (480, 640, 3), np.uint8),
        "stripes": np.tile(np.uint8(255) * (np.indices((480, 640))[1] // 20 % 2), 1)[..., None]
        .repeat(3, 2)
        .astype(np.uint8),
        "mirrored": view(80, 180)[:, ::-1].copy(),
        "tiny": np.zeros((8, 8, 3), np.uint8),
    }[kind]
    found = find_heading(picture, index, 60.0)
    assert found.status == "unsure"
    assert found.heading_deg is None


def test_a_masked_picture(index: HeadingIndex) -> None:
    mask = np.zeros((384, 512), bool)
    assert find_heading(view(80, 180), index, 60.0, mask=mask).status == "unsure"
    assert find_heading(view(80, 180), index, 60.0, mask=~mask).status == "found"


def test_an_index_can_be_stopped_and_says_how_far_it_is() -> None:
    token, told = Token(), []

    def report(fraction: float, step: Progress) -> None:
        told.append((fraction, step))
        if len(told) == 3:
            token.cancel()

    with pytest.raises(Cancelled):
        build_index(demo_panorama(), token, report)
    assert [fraction for fraction, _ in told] == sorted(fraction for fraction, _ in told)
    assert told[0][1] == Progress(Task.LEARNING_BACKGROUND)


def test_a_blank_panorama_is_said_to_be_one() -> None:
    with pytest.raises(CoreError, match="too little detail"):
        build_index(np.full((512, 1024, 3), 128, np.uint8))


class TestRotation:
    def scene(
        self, heading: float, camera_m: float, count: int = 80
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Points in a room, seen from the probe and from a camera in front of it."""
        chance = np.random.default_rng(11)
        points = chance.uniform([-4.0, -1.5, 2.5], [4.0, 2.0, 9.0], (count, 3))
        # Right, up, behind the sitter; the camera at -camera_m.
        rays = points[:, :2] / (points[:, 2:] + camera_m) * [1.0, -1.0]
        level = points / np.linalg.norm(points, axis=1, keepdims=True) * [-1.0, 1.0, 1.0]
        return rays, level @ sphere.rotation(heading).T

    @pytest.mark.parametrize("heading", [-170.0, 0.0, 33.0, 179.5])
    @pytest.mark.parametrize("camera_m", [0.0, 0.6, 1.5, 3.0])
    def test_exact_points_give_an_exact_heading(self, heading: float, camera_m: float) -> None:
        rays, bearings = self.scene(heading, camera_m)
        pose = rotation.fit(rays, bearings)
        assert pose is not None
        assert difference(pose.angles_deg[0], heading) == pytest.approx(0.0, abs=0.25)
        # Things are 2.5 to 9 m behind the sitter.
        assert 1.0 + camera_m / 9.0 - 0.05 < pose.zoom < 1.0 + camera_m / 2.5 + 0.05

    def test_wrong_pairs_do_not_matter(self) -> None:
        rays, bearings = self.scene(33.0, 1.5)
        rays = np.concatenate([rays, np.random.default_rng(5).uniform(-0.5, 0.5, (80, 2))])
        bearings = np.concatenate([bearings, np.roll(bearings, 7, axis=0)])
        pose = rotation.fit(rays, bearings)
        assert pose is not None
        assert pose.angles_deg[0] == pytest.approx(33.0, abs=0.4)
        assert pose.inside[:80].mean() > 0.7
        assert pose.inside[80:].mean() < 0.2

    def test_too_little(self) -> None:
        rays, bearings = self.scene(33.0, 1.5, 5)
        assert rotation.fit(rays, bearings) is None
        same = np.repeat(rays[:1], 20, axis=0)
        assert rotation.fit(same, np.repeat(bearings[:1], 20, axis=0)) is None

    def test_the_same_points_give_the_same_answer(self) -> None:
        rays, bearings = self.scene(33.0, 1.5)
        first, second = rotation.fit(rays, bearings), rotation.fit(rays, bearings)
        assert first is not None
        assert second is not None
        np.testing.assert_array_equal(first.rotation, second.rotation)
