"""The demo location: whole, sane in its units, and one and the same place in all its files."""

from __future__ import annotations

import json
from typing import Any, Final

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.colour import luminance, srgb_decode
from app.core.base.paths import resources
from app.core.environment.environment import Environment, read_environment
from app.core.solver.place_light import prepare
from app.core.solver.solve import proposal, solve_all
from app.core.styles.style_pack_file import load_named_pack

Floats = NDArray[np.float64]
FOLDER: Final = resources() / "demo" / "location"
LOCATION: Final[dict[str, Any]] = json.loads((FOLDER / "location.json").read_text("utf-8"))
VIEWS: Final[dict[str, Any]] = json.loads((FOLDER / "views" / "views.json").read_text("utf-8"))
SHAPES: Final = {
    "probe-1.exr": (2048, 4096),
    "probe-2.exr": (1024, 2048),
    "probe-3.exr": (1024, 2048),
}
HEAD: Final = np.array([0.0, 1.6, 0.0])


@pytest.fixture(scope="module")
def panoramas() -> dict[str, Environment]:
    return {name: read_environment(FOLDER / name) for name in SHAPES}


@pytest.fixture(scope="module")
def first(panoramas: dict[str, Environment]) -> NDArray[np.float32]:
    """Radiance at the sitter's head in cd/m2, (2048, 4096, 3)."""
    return panoramas["probe-1.exr"].radiance * np.float32(spot("probe-1.exr")["cd_per_m2_of_one"])


def spot(name: str) -> dict[str, Any]:
    return next(s for s in LOCATION["spots"] if s["file"] == name)


def view(turn: int, distance: float) -> dict[str, Any]:
    return next(v for v in VIEWS["views"] if v["turn_deg"] == turn and v["distance_m"] == distance)


def direction(azimuth_deg: float) -> Floats:
    a = np.radians(azimuth_deg)
    return np.array([-np.sin(a), 0.0, np.cos(a)])


def depth(entry: dict[str, Any]) -> Floats:
    """Depth along the optical axis in metres, inf for the sky."""
    code = cv2.imread(str(FOLDER / "views" / entry["depth"]), cv2.IMREAD_UNCHANGED)
    assert code is not None
    assert code.dtype == np.uint16
    with np.errstate(divide="ignore"):
        return np.asarray(VIEWS["depth"]["near_m"] * 65535 / code.astype(float))


def world_points(entry: dict[str, Any]) -> Floats:
    """What every pixel of the depth map shows, (H, W, 3), inf for the sky."""
    z = depth(entry)
    scale = VIEWS["size"][0] / z.shape[1]
    j, i = np.mgrid[: z.shape[0], : z.shape[1]]
    x = ((i + 0.5) * scale - VIEWS["centre_px"][0]) / VIEWS["focal_px"]
    y = ((j + 0.5) * scale - VIEWS["centre_px"][1]) / VIEWS["focal_px"]
    camera = np.stack([x, y, np.ones_like(x)], axis=2) * np.where(np.isfinite(z), z, 1e6)[..., None]
    return np.asarray(camera @ np.array(entry["rotation"]) + np.array(entry["position_m"]))


def picture(entry: dict[str, Any]) -> Floats:
    """Luminance of a view in cd/m2, undone from its tone curve, at the depth map's size."""
    code = cv2.imread(str(FOLDER / "views" / entry["image"]))
    assert code is not None
    assert [code.shape[1], code.shape[0]] == VIEWS["size"]
    x = np.clip(srgb_decode(code[..., ::-1] / 255.0), 0, 0.999)
    linear = 12.5 * (np.sqrt((1 - x) ** 2 + 4 * x / 25) - (1 - x))
    small = cv2.resize(linear, VIEWS["depth"]["size"], interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.blur(luminance(small / entry["exposure"]), (3, 3)), float)


def look_up(first: NDArray[np.float32], points: Floats) -> Floats:
    """Luminance of the panorama in the directions from the head to points."""
    way = points - HEAD
    u = np.arctan2(-way[..., 0], way[..., 2]) / (2 * np.pi) + 0.5
    v = 0.5 - np.arctan2(way[..., 1], np.hypot(way[..., 0], way[..., 2])) / np.pi
    grey = luminance(cv2.resize(first, (2048, 1024), interpolation=cv2.INTER_AREA))
    grey = np.asarray(cv2.blur(np.pad(grey, ((0, 0), (8, 8)), mode="wrap"), (3, 3)), np.float32)
    x, y = (u * 2048 + 7.5).astype(np.float32), (v * 1024 - 0.5).astype(np.float32)
    return np.asarray(cv2.remap(grey, x, y, cv2.INTER_LINEAR), float)


def test_everything_is_there_and_small_enough() -> None:
    there = {path.relative_to(FOLDER).as_posix() for path in FOLDER.rglob("*") if path.is_file()}
    expected = {"CREDITS.md", "location.json", "views/views.json", *SHAPES}
    for entry in VIEWS["views"]:
        expected |= {f"views/{entry['image']}", f"views/{entry['depth']}"}
    assert there == expected
    assert sum((FOLDER / name).stat().st_size for name in there) <= 30_000_000
    assert "CC0" in LOCATION["licence"]
    assert len(LOCATION["source_sha256"]) == 64


def test_a_view_from_every_place() -> None:
    places = [(v["turn_deg"], v["distance_m"]) for v in VIEWS["views"]]
    assert sorted(places) == sorted((t, d) for t in range(0, 360, 5) for d in (1.2, 1.8, 2.5))


@pytest.mark.parametrize("name", SHAPES)
def test_panorama_is_clean_and_in_sane_units(panoramas: dict[str, Environment], name: str) -> None:
    environment = panoramas[name]
    assert environment.shape == SHAPES[name]
    assert environment.warnings == ()
    assert np.isfinite(environment.radiance).all()
    assert environment.radiance.min() >= 0
    grey = luminance(environment.radiance) * spot(name)["cd_per_m2_of_one"]
    assert 50 < np.median(grey) < 6_000
    assert np.median(grey) == pytest.approx(spot(name)["median_cd_per_m2"], rel=0.02)


def test_spots_are_at_head_height_and_apart() -> None:
    places = [np.array(s["position_m"]) for s in LOCATION["spots"]]
    assert places[0] == pytest.approx(HEAD)
    for index, place in enumerate(places):
        assert place[1] == 1.6
        assert all(np.linalg.norm(place - other) > 3 for other in places[:index])


def test_the_sun_stands_where_it_is_said_to(panoramas: dict[str, Environment]) -> None:
    grey = luminance(panoramas["probe-3.exr"].radiance)
    rows, columns = np.nonzero(grey > 0.3 * grey.max())
    azimuth = 360 * ((columns.mean() + 0.5) / 2048 - 0.5)
    elevation = 90 - 180 * (rows.mean() + 0.5) / 1024
    assert azimuth == pytest.approx(LOCATION["sun"]["azimuth_deg"], abs=0.1)
    assert elevation == pytest.approx(LOCATION["sun"]["elevation_deg"], abs=0.1)
    solid = (2 * np.pi / 2048) * (np.pi / 1024) * np.cos(np.radians(elevation))
    brightest = grey.max() * spot("probe-3.exr")["cd_per_m2_of_one"]
    assert brightest == pytest.approx(spot("probe-3.exr")["brightest_cd_per_m2"], rel=0.05)
    lux = grey[grey > 0.01 * grey.max()].sum() * solid * spot("probe-3.exr")["cd_per_m2_of_one"]
    assert 60_000 < lux < 100_000


@pytest.mark.parametrize("entry", VIEWS["views"], ids=lambda v: v["image"])
def test_pose_is_exact(entry: dict[str, Any]) -> None:
    toward = direction(entry["turn_deg"])
    rotation = np.array(entry["rotation"])
    np.testing.assert_allclose(entry["position_m"], HEAD + entry["distance_m"] * toward, atol=1e-8)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-10)
    assert np.linalg.det(rotation) == pytest.approx(1)
    np.testing.assert_allclose(rotation[2], -toward, atol=1e-10)
    np.testing.assert_allclose(rotation[1], [0, -1, 0], atol=1e-10)


@pytest.mark.parametrize("turn", range(0, 360, 15))
def test_the_sitter_stands_on_the_axis_and_faces_the_camera(turn: int) -> None:
    for distance in VIEWS["distances_m"]:
        z = depth(view(turn, distance))
        rows, columns = z.shape
        face = z[rows // 2 - 2 : rows // 2 + 2, columns // 2 - 2 : columns // 2 + 2]
        # The tip of the nose is 12.5 cm in front of the ears' axis, the cheeks some 8 cm.
        assert distance - 0.14 < face.min() <= face.max() < distance - 0.06
        near = z < distance + 0.3
        middle = np.nonzero(near[rows // 2])[0].mean() + 0.5
        assert middle == pytest.approx(columns / 2, abs=2.0)


@pytest.mark.parametrize("turn", [20, 95, 150, 200, 265])
def test_the_floor_is_flat_and_at_zero(turn: int) -> None:
    height = world_points(view(turn, 2.5))[..., 1]
    assert height[np.isfinite(height)].min() > -0.2
    floor = height[np.abs(height) < 0.01]
    assert floor.size > 0.03 * height.size
    assert np.median(floor) == pytest.approx(0.0, abs=0.002)


@pytest.mark.parametrize("turn", [0, 70, 150, 245, 330])
def test_depth_maps_of_neighbours_agree(turn: int) -> None:
    points = world_points(view(turn, 1.8))
    other = view((turn + 5) % 360, 1.8)
    camera = (points - np.array(other["position_m"])) @ np.array(other["rotation"]).T
    seen = np.isfinite(camera).all(axis=2) & (camera[..., 2] > 2.3) & (camera[..., 2] < 40)
    scale = VIEWS["depth"]["size"][0] / VIEWS["size"][0]
    ahead = np.where(seen, camera[..., 2], 1.0)
    x = (VIEWS["focal_px"] * camera[..., 0] / ahead + VIEWS["centre_px"][0]) * scale - 0.5
    y = (VIEWS["focal_px"] * camera[..., 1] / ahead + VIEWS["centre_px"][1]) * scale - 0.5
    z = depth(other)
    i, j = np.round(x).astype(int), np.round(y).astype(int)
    seen &= (i >= 0) & (i < z.shape[1]) & (j >= 0) & (j < z.shape[0])
    there = z[j[seen], i[seen]]
    ratio = there / camera[..., 2][seen]
    assert seen.mean() > 0.4
    assert np.mean(np.abs(ratio - 1) < 0.03) > 0.75
    assert np.median(ratio) == pytest.approx(1, abs=0.003)


@pytest.mark.parametrize("turn", range(0, 360, 30))
@pytest.mark.parametrize("distance", [1.2, 2.5])
def test_views_show_the_panoramas_background(
    first: NDArray[np.float32], turn: int, distance: float
) -> None:
    entry = view(turn, distance)
    points = world_points(entry)
    shown, expected = picture(entry), look_up(first, points)
    far = depth(entry) > distance + 1.5
    # What is clipped in the view's bytes says nothing; what is hidden from the head is tolerated
    # by looking at medians.
    fair = far & (shown * entry["exposure"] < 4) & (shown * entry["exposure"] > 0.004)
    error = np.log(expected[fair] + 1) - np.log(shown[fair] + 1)
    away = np.abs(error)
    assert fair.mean() > 0.2
    assert np.median(error) == pytest.approx(0, abs=0.08)
    assert np.median(away) < 0.2
    assert np.mean(away < 0.7) > 0.85
    # The same pixels a few degrees further along agree clearly less: the poses matter.
    turned = np.radians(4.0)
    spin = np.array(
        [[np.cos(turned), 0, np.sin(turned)], [0, 1, 0], [-np.sin(turned), 0, np.cos(turned)]]
    )
    wrong = look_up(first, (points - HEAD) @ spin.T + HEAD)[fair]
    assert np.median(np.abs(np.log(wrong + 1) - np.log(shown[fair] + 1))) > 1.8 * np.median(away)


def test_every_direction_has_features(first: NDArray[np.float32]) -> None:
    small = cv2.resize(first, (2048, 1024), interpolation=cv2.INTER_AREA)
    grey = luminance(small)
    tone = np.log(grey + 1)
    low, high = np.percentile(tone, [1, 99])
    code = np.clip(255 * (tone - low) / (high - low), 0, 255).astype(np.uint8)
    # Quarter by quarter: the search in the whole takes 150 MB.
    quarters = np.split(code[300:700], 4, axis=1)
    found = [cv2.SIFT.create(2000).detect(np.ascontiguousarray(one), None) for one in quarters]
    across = np.array([512 * n + k.pt[0] for n, each in enumerate(found) for k in each])
    assert (np.bincount((across / 2048 * 12).astype(int), minlength=12) >= 150).all()


# -- the café of the demo --------------------------------------------------------------------------

CAFE: Final = resources() / "demo" / "cafe"


def test_the_cafe_is_whole_and_small() -> None:
    table = json.loads((CAFE / "views.json").read_text("utf-8"))
    assert [view["turn_deg"] for view in table["views"]] == list(range(0, 360, 5))
    names = {view[kind] for view in table["views"] for kind in ("image", "depth")}
    there = {path.name for path in CAFE.iterdir()}
    assert there == {"CREDITS.md", "probe.exr", "views.json", *names}
    assert sum(path.stat().st_size for path in CAFE.iterdir()) <= 9_000_000
    for view in table["views"]:
        away = np.array(view["position_m"]) - np.array(LOCATION["demo"]["position_m"])
        assert float(np.hypot(*away[[0, 2]])) == pytest.approx(1.2, abs=1e-5)


def test_the_cafe_offers_portraits_that_look_right() -> None:
    light = prepare(read_environment(CAFE / "probe.exr"))
    results = solve_all(load_named_pack("generic"), light.searched)
    reached = {result.name: result.grade for result in results if result.attainable}
    assert reached == {"flat": "yes", "silhouette": "yes"}
    assert proposal(results) == "flat"
