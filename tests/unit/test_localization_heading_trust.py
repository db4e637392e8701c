"""What is trusted and what is not: fields of view nobody knows, small things, half pictures."""

from __future__ import annotations

from dataclasses import replace
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
from app.core.base.imaging.images import write_png
from app.core.base.paths import resources
from app.core.localization.confidence import LEAST_CONFIDENCE, Evidence, trust
from app.core.localization.features import HeadingIndex, build_index
from app.core.localization.heading import compare, find_heading, see, support, to_heading
from app.core.localization.picture_file import read_shown_panorama
from app.core.localization.rotation import Outlook, fit
from app.core.localization.views import Lens, look
from benchmarks.heading.scripted_turn.scene_files import probe_environment
from benchmarks.heading.scripted_turn.scene_views import SceneViews, Stand
from tests.helpers.cases import sample_first
from tests.helpers.demo_place import demo_panorama
from tests.helpers.lens_matrix import lens_matrix

Bytes = NDArray[np.uint8]
FOLDER: Final = resources() / "demo" / "location" / "views"
GOOD: Final = Evidence(60, share=0.8, spread=0.3, support=15.0, error_deg=0.3, zoom=1.3)


@pytest.fixture(scope="module")
def index() -> HeadingIndex:
    return build_index(demo_panorama())


@cache
def scene() -> SceneViews:
    folder = resources() / "demo" / "location"
    return SceneViews(FOLDER, probe_environment(folder).radiance)


@cache
def view(turn: int, distance: int) -> Bytes:
    picture = cv2.imread(str(FOLDER / f"view-{turn:03d}-{distance}.webp"))
    assert picture is not None
    return np.ascontiguousarray(picture[..., ::-1])


class TestTrust:
    def test_much_evidence_is_trusted(self) -> None:
        assert trust(GOOD) > 0.98

    @pytest.mark.parametrize(
        "weaker",
        [
            {"points": 9},
            {"support": 2.0},
            {"error_deg": 2.0},
            {"spread": 0.02},
            {"share": 0.3},
            {"tilt": 0.8},
            {"zoom": 0.5},
            {"strays": 0.3},
            {"gain": 5.0},
            {"aside": 4.0},
            {"zoom": 1.02, "tilt": 0.3},
            {"wide": 0.6, "flat": 1.0},
            {"wide": 0.22},
            {"wide": 1.3},
        ],
    )
    def test_less_evidence_is_trusted_less(self, weaker: dict[str, float]) -> None:
        worse = replace(GOOD, **weaker)  # type: ignore[arg-type]
        assert trust(worse) < trust(GOOD)

    @pytest.mark.parametrize("usual", [{"strays": 0.1}, {"wide": 0.35}, {"wide": 1.0}])
    def test_what_is_usual_is_not_held_against_it(self, usual: dict[str, float]) -> None:
        assert trust(replace(GOOD, **usual)) == trust(GOOD)  # type: ignore[arg-type]

    def test_many_points_in_a_band_are_enough(self) -> None:
        """A photograph with 76 points and an error of 0.46 deg was refused at 0.73 for less."""
        band = Evidence(76, share=0.45, spread=0.1, support=14.0, error_deg=0.46, zoom=1.25)
        assert trust(band) > LEAST_CONFIDENCE

    def test_few_points_that_the_picture_does_not_bear_out_are_not(self) -> None:
        chance = replace(GOOD, points=9, share=0.3, support=3.0, spread=0.05)
        assert trust(chance) < LEAST_CONFIDENCE

    def test_an_angle_that_may_be_anything_is_not(self) -> None:
        assert trust(replace(GOOD, error_deg=4.0)) < 0.6

    @pytest.mark.parametrize("points", [0, 10**9])
    def test_it_is_a_probability(self, points: int) -> None:
        extreme = replace(GOOD, points=points, support=1e9, error_deg=0.0, spread=0.0)
        assert 0.0 <= trust(extreme) <= 1.0


@pytest.mark.slow
@pytest.mark.parametrize("turn", sample_first([0, 120, 240], 1))
@pytest.mark.parametrize("distance", [120, 250])
def test_an_unknown_field_of_view(index: HeadingIndex, turn: int, distance: int) -> None:
    found = find_heading(view(turn, distance), index, None)
    assert found.heading_deg is not None
    assert difference(found.heading_deg, turn + 180.0) == pytest.approx(0.0, abs=0.6)
    assert found.fov_deg == pytest.approx(60.0, abs=12.0)
    assert found.zoom > 1.0


@pytest.mark.slow
@pytest.mark.parametrize("fov", sample_first([55.0, 40.0, 80.0], 1))
def test_a_field_of_view_is_measured_where_the_probe_stood(index: HeadingIndex, fov: float) -> None:
    found = find_heading(look(demo_panorama(), 70.0, Lens(fov, (640, 480))), index, None)
    assert found.heading_deg == pytest.approx(70.0, abs=0.1)
    assert found.fov_deg == pytest.approx(fov, abs=0.5)
    assert found.zoom == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("fov", [None, 46.0])
def test_an_upright_picture(index: HeadingIndex, fov: float | None) -> None:
    picture = look(demo_panorama(), -65.0, Lens(46.0, (480, 640)), 4.0)
    found = find_heading(picture, index, fov)
    assert found.heading_deg == pytest.approx(-65.0, abs=0.2)
    assert found.pitch_deg == pytest.approx(4.0, abs=0.3)
    assert found.fov_deg == pytest.approx(46.0, abs=0.5)


@pytest.mark.slow
def test_a_large_photograph_with_a_bent_lens(index: HeadingIndex) -> None:
    lens = Lens(66.0, (2016, 1512))
    picture = look(demo_panorama(), 75.0, lens, 5.0)
    matrix = lens_matrix(lens) - np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
    bent = cv2.undistort(picture, matrix, np.array([0.06, -0.01, 0.0, 0.0]))
    for fine in (False, True):
        found = find_heading(np.asarray(bent, np.uint8), index, 66.0, sitter_deg=None, fine=fine)
        assert found.heading_deg == pytest.approx(75.0, abs=0.4)


@pytest.mark.parametrize("turn", [40, 80, 160, 320])
def test_a_sitter_that_nobody_found_costs_a_degree_at_most(index: HeadingIndex, turn: int) -> None:
    """Even if only a strip of the picture is visible. The sitter is in the middle."""
    picture = view(turn, 180)
    middle = picture.shape[1] // 2
    off = []
    for half in (40, 60, 90, middle):
        strip = np.zeros(picture.shape[:2], bool)
        strip[:, middle - half : middle + half] = True
        found = find_heading(picture, index, 60.0, sitter_deg=None, mask=strip)
        if found.heading_deg is not None:
            off.append(abs(difference(found.heading_deg, turn - 180.0)))
    assert len(off) >= 3
    assert max(off) < 1.5


def test_one_small_thing_is_not_a_place(index: HeadingIndex) -> None:
    """A patch of the wall, alone in a grey picture: a poster that may hang anywhere."""
    picture = np.full((480, 640, 3), 128, np.uint8)
    source = look(demo_panorama(), 80.0, Lens(60.0, (640, 480)))
    picture[220:262, 290:346] = source[220:262, 290:346]
    assert find_heading(picture, index, 60.0).status == "unsure"


def test_a_copied_thing_is_not_borne_out_by_the_rest(index: HeadingIndex) -> None:
    """A part of one direction pasted into a picture of another: the whole must decide."""
    lens = Lens(60.0, (640, 480))
    picture = look(demo_panorama(2), 10.0, lens).copy()
    picture[180:300, 200:360] = look(demo_panorama(), 80.0, lens)[180:300, 200:360]
    found = find_heading(picture, index, 60.0)
    assert found.heading_deg is None or found.heading_deg == pytest.approx(80.0, abs=3.0)
    whole = compare(see(look(demo_panorama(), 80.0, lens)), index, 60.0)
    part = compare(see(picture), index, 60.0)
    assert whole is not None
    if part is not None:
        assert part.evidence.support < whole.evidence.support
        assert to_heading(part).confidence < to_heading(whole).confidence


def test_an_askew_picture_is_refused(index: HeadingIndex) -> None:
    upright = look(demo_panorama(), 75.0, Lens(60.0, (640, 480)))
    for picture in (np.rot90(upright), np.rot90(upright, 2)):
        assert find_heading(np.ascontiguousarray(picture), index, 60.0).status == "unsure"


def test_nothing_supports_a_wrong_pose(index: HeadingIndex) -> None:
    lens = Lens(60.0, (640, 480))
    sight = see(look(demo_panorama(), 75.0, lens))
    found = compare(sight, index, 60.0)
    assert found is not None
    rays = (sight.features.places - [320.0, 240.0]) / lens.focal_px
    described = sight.features.descriptors

    def backing(turn_deg: float) -> float:
        turned = sphere.rotation(turn_deg) @ found.pose.rotation
        pose = replace(found.pose, rotation=turned)
        return support(rays, described, index.bearings, index.descriptors, pose)

    assert backing(0.0) > 10.0
    assert max(abs(backing(turn)) for turn in (40.0, 90.0, 180.0)) < 5.0
    few = support(rays[:5], described[:5], index.bearings, index.descriptors, found.pose)
    assert few == 0.0


def test_points_on_a_line_fix_nothing_that_is_trusted() -> None:
    x = np.linspace(-0.4, 0.4, 60)
    rays = np.stack([x, np.zeros_like(x)], axis=1)
    full = np.stack([-x, np.zeros_like(x), np.ones_like(x)], axis=1)
    pose = fit(rays, full / np.linalg.norm(full, axis=1, keepdims=True), Outlook())
    if pose is not None:
        spread = float(np.sqrt(max(np.linalg.eigvalsh(np.cov(rays.T))[0], 0.0)))
        assert spread == pytest.approx(0.0)
        line = replace(GOOD, points=15, spread=spread, share=0.6, support=4.0)
        assert trust(line) < LEAST_CONFIDENCE


class TestPanoramaFile:
    def test_an_ordinary_picture_will_do(self, tmp_path: Path) -> None:
        write_png(tmp_path / "p.png", demo_panorama())
        np.testing.assert_array_equal(read_shown_panorama(tmp_path / "p.png"), demo_panorama())

    def test_an_environment_is_shown_as_everywhere(self) -> None:
        shown = read_shown_panorama(resources() / "demo" / "scenes" / "studio.exr")
        assert shown.shape == (1024, 2048, 3)

    @pytest.mark.parametrize(("size", "words"), [((64, 128), "too small"), ((600, 900), "twice")])
    def test_what_is_none_is_said(self, tmp_path: Path, size: tuple[int, int], words: str) -> None:
        write_png(tmp_path / "p.png", np.zeros((*size, 3), np.uint8))
        with pytest.raises(CoreError, match=words):
            read_shown_panorama(tmp_path / "p.png")

    def test_a_missing_or_damaged_file_is_a_sentence(self, tmp_path: Path) -> None:
        with pytest.raises(CoreError, match="no file"):
            read_shown_panorama(tmp_path / "none.exr")
        (tmp_path / "cut.jpg").write_bytes(b"\xff\xd8\xff\xe0 and no more")
        with pytest.raises(CoreError, match="damaged"):
            read_shown_panorama(tmp_path / "cut.jpg")


# -- a camera that looks away from the sitter -----------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("known", [True, False])
def test_a_camera_that_looks_at_who_carries_it(index: HeadingIndex, known: bool) -> None:
    """It is nearer to what it sees than the probe was; the person in it stands on the line."""
    errors, refused = [], 0
    for turn, aim in ((-150.0, 0.0), (-60.0, 8.0), (20.0, -8.0), (75.0, 0.0), (140.0, 8.0)):
        seen = scene().view(Stand(turn, 1.8, aim, away=True), Lens(64.0, (640, 480)))
        assert seen.heading_deg == pytest.approx(turn + aim)
        assert seen.sitter_deg == pytest.approx(-aim)
        fov = 64.0 if known else None
        found = find_heading(seen.picture, index, fov, sitter_deg=-aim, away=True)
        if found.heading_deg is None:
            refused += 1
            continue
        errors.append(abs(difference(found.heading_deg, seen.heading_deg)))
        # Things look smaller from the probe; a camera that faces the sitter has that never.
        assert found.zoom < 1.0
    assert refused <= 1
    assert max(errors) <= 3.0
    assert np.median(errors) <= 1.0


@pytest.mark.slow
def test_who_stands_far_to_the_side_carries_no_camera(index: HeadingIndex) -> None:
    """A lamp that looks like a head would shift the heading by several degrees."""
    seen = scene().view(Stand(-60.0, 1.8, 0.0, away=True), Lens(64.0, (640, 480)))
    plain = find_heading(seen.picture, index, 64.0, sitter_deg=None, away=True)
    assert plain.heading_deg is not None
    for beside in (-40.0, 26.0):
        found = find_heading(seen.picture, index, 64.0, sitter_deg=beside, away=True)
        assert found == plain
