"""What is rendered between the views of the demo location, against the views themselves."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Final

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base import sphere
from app.core.base.angles import difference
from app.core.base.errors import CoreError
from app.core.base.paths import resources
from app.core.localization.views import Lens
from benchmarks.heading.scripted_turn.scene_files import SceneFiles, level_pose, probe_environment
from benchmarks.heading.scripted_turn.scene_views import SceneViews, Stand
from tests.helpers.lens_matrix import lens_matrix

Floats = NDArray[np.float64]
FOLDER: Final = resources() / "demo" / "location"
LENS: Final = Lens(60.0, (512, 384))
AXES: Final = np.diag([-1.0, -1.0, 1.0])


@cache
def scene() -> SceneViews:
    return SceneViews(FOLDER / "views", probe_environment(FOLDER).radiance)


def shipped(turn: int, metres: float) -> NDArray[np.uint8]:
    file = FOLDER / "views" / f"view-{turn:03d}-{round(metres * 100)}.webp"
    picture = cv2.imread(str(file), cv2.IMREAD_COLOR_RGB)
    assert picture is not None
    return np.asarray(picture, np.uint8)


def rays(points: Floats, lens: Lens) -> Floats:
    half = np.array(lens.size) / 2.0
    flat = (points + 0.5 - half) / lens.focal_px
    vectors = np.column_stack([flat, np.ones(len(flat))])
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def turned_by(
    first: NDArray[np.uint8], second: NDArray[np.uint8], mask: NDArray[np.uint8]
) -> tuple[Floats, float]:
    """Fit the rotation between two pictures from one place; angles, and median residual, deg."""
    sift = cv2.SIFT.create(1500)
    found = [
        sift.detectAndCompute(cv2.cvtColor(one, cv2.COLOR_RGB2GRAY), mask)
        for one in (first, second)
    ]
    (a, da), (b, db) = found
    pairs = [m for m, n in cv2.BFMatcher().knnMatch(da, db, k=2) if m.distance < 0.75 * n.distance]
    p = rays(np.array([a[m.queryIdx].pt for m in pairs]), LENS)
    q = rays(np.array([b[m.trainIdx].pt for m in pairs]), LENS)
    keep = np.linalg.norm(p - q, axis=1) < np.radians(1.0)
    assert keep.sum() > 100
    rotation, away = np.eye(3), np.zeros(0)
    for _ in range(5):
        u, _, vt = np.linalg.svd(p[keep].T @ q[keep])
        rotation = vt.T @ np.diag([1.0, 1.0, np.linalg.det(vt.T @ u.T)]) @ u.T
        away = np.linalg.norm(p @ rotation.T - q, axis=1)
        keep = away < 3.0 * np.median(away[away < np.radians(1.0)])
    angles = np.array(sphere.angles_of(AXES @ rotation @ AXES))
    return angles, float(np.degrees(np.median(away[keep])))


def test_poses_are_those_of_the_file() -> None:
    for view in json.loads((FOLDER / "views" / "views.json").read_text("utf-8"))["views"]:
        position, rotation = level_pose(view["turn_deg"], view["distance_m"])
        assert np.abs(position - view["position_m"]).max() < 1e-8
        assert np.abs(rotation - view["rotation"]).max() < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize(
    ("turn", "metres"), [(305, 1.8), (180, 1.2), (60, 2.5), (275, 1.8), (0, 1.2), (225, 2.5)]
)
def test_a_view_is_predicted_from_the_others(turn: int, metres: float) -> None:
    predicted = scene().view(Stand(turn, metres), LENS, without=(float(turn), metres))
    truth = shipped(turn, metres)
    behind = SceneFiles(FOLDER / "views").shot(float(turn), metres).behind
    mask = cv2.resize(behind.astype(np.uint8) * 255, LENS.size, interpolation=cv2.INTER_NEAREST)
    angles, residual = turned_by(truth, predicted.picture, np.asarray(mask, np.uint8))
    assert np.abs(angles).max() < 0.04
    assert residual < 0.09  # 0.77 of a pixel
    assert predicted.from_panorama < 0.02
    assert np.abs(truth.astype(int) - predicted.picture).mean() < 9.0


def test_the_truth_is_handed_back() -> None:
    view = scene().view(Stand(200.0, 1.7, 9.0, 2.0, -1.0), Lens(50.0, (160, 120)))
    assert view.turn_deg == pytest.approx(-160.0)
    assert view.heading_deg == pytest.approx(29.0)
    assert view.sitter_deg == pytest.approx(-9.0)
    assert difference(view.heading_deg + view.sitter_deg - 180.0, view.turn_deg) == 0.0
    assert view.picture.shape == (120, 160, 3)
    assert view.picture.dtype == np.uint8


@pytest.mark.parametrize(("aim", "pitch", "roll"), [(12.0, 0.0, 0.0), (-8.0, 3.0, -4.0)])
def test_aiming_turns_the_camera_about_its_own_middle(
    aim: float, pitch: float, roll: float
) -> None:
    straight = scene().view(Stand(90.0, 1.8), LENS).picture
    turned = scene().view(Stand(90.0, 1.8, aim, pitch, roll), LENS).picture
    rotation = sphere.rotation(aim, pitch, roll)
    camera = AXES @ rotation @ AXES  # of the turned camera, in the axes of the straight one
    matrix = lens_matrix(LENS) @ camera @ np.linalg.inv(lens_matrix(LENS))
    shift = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    expected = cv2.warpPerspective(
        straight, np.linalg.inv(shift) @ matrix @ shift, LENS.size, flags=flags
    )
    seen = cv2.erode((expected.max(axis=2) > 0).astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
    assert seen.mean() > 0.5
    gap = np.abs(turned.astype(int) - expected)[seen]
    assert np.median(gap) <= 2.0
    assert gap.mean() < 6.0


def test_the_sitter_is_where_it_is_said() -> None:
    alone = SceneViews(FOLDER / "views", np.zeros((512, 1024, 3), np.float32), sitter=False)
    there = SceneViews(FOLDER / "views", np.zeros((512, 1024, 3), np.float32))
    for stand in (Stand(92.0, 1.5, 10.0), Stand(183.0, 2.2, -12.0), Stand(318.0, 1.2, 3.0)):
        lens = Lens(55.0, (320, 240))
        change = np.abs(
            there.view(stand, lens).picture.astype(int) - alone.view(stand, lens).picture
        ).max(axis=2)
        head = change[110:125] > 12  # eye level, a camera that looks level
        columns = np.flatnonzero(head.sum(axis=0) > 5) + 0.5
        angle = np.degrees(np.arctan((columns.mean() - 160.0) / lens.focal_px))
        assert angle == pytest.approx(-stand.aim_deg, abs=1.2)


def test_nearer_makes_the_sitter_larger_and_the_background_less_so() -> None:
    near, far = (scene().view(Stand(90.0, metres), LENS).picture for metres in (1.2, 2.4))
    # The sitter's arms reach into these columns only from near by.
    assert np.abs(near[300:, 170:200].astype(int) - far[300:, 170:200]).mean() > 20.0


def test_a_narrow_picture_that_one_view_shows_whole() -> None:
    view = scene().view(Stand(180.0, 1.8), Lens(12.0, (160, 120)))
    assert view.from_panorama == 0.0
    assert view.picture.std() > 5.0


def test_too_near_too_far_and_odd_are_refused() -> None:
    for metres in (1.0, 2.6):
        with pytest.raises(ValueError, match=r"1\.2 to 2\.5"):
            scene().view(Stand(0.0, metres), LENS)
    with pytest.raises(ValueError, match="even"):
        scene().view(Stand(0.0, 1.5), Lens(60.0, (641, 480)))


def test_missing_and_damaged_files_are_said_to_be_so(tmp_path: Path) -> None:
    with pytest.raises(CoreError, match="missing or damaged"):
        SceneFiles(tmp_path)
    for text in ("{}", "[]", "not json", '{"focal_px": 1}'):
        (tmp_path / "views.json").write_text(text, encoding="utf-8")
        with pytest.raises(CoreError, match="Reinstall"):
            SceneFiles(tmp_path)
    table = (FOLDER / "views" / "views.json").read_text("utf-8")
    (tmp_path / "views.json").write_text(table, encoding="utf-8")
    (tmp_path / "view-000-120.webp").write_bytes(b"nothing of the kind")
    with pytest.raises(CoreError, match="missing or damaged"):
        SceneFiles(tmp_path).shot(0.0, 1.2)


def test_what_no_view_shows_is_as_bright_as_what_is_beside_it() -> None:
    """The outline of the sitter in the views must not stand there as a dark figure."""
    views = SceneViews(FOLDER / "views", probe_environment(FOLDER).radiance, sitter=False)
    unlit = SceneViews(FOLDER / "views", np.zeros((512, 1024, 3), np.float32), sitter=False)
    stand, lens = Stand(180.0, 1.6, -15.0, away=True), Lens(72.0, (320, 240))
    seen, dark = views.view(stand, lens), unlit.view(stand, lens)
    filled = (dark.picture.max(axis=2) == 0)[60:180]
    assert filled.mean() > 0.02
    grey = seen.picture[60:180].mean(axis=2)
    beside = (cv2.dilate(filled.astype(np.uint8), np.ones((15, 15), np.uint8)) > 0) & ~filled
    assert np.median(grey[filled]) == pytest.approx(np.median(grey[beside]), rel=0.3)
