"""The webcam at the demo location: it shows the turn it is set to, and breaks on demand."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import difference
from app.core.base.paths import resources
from app.core.localization.features import build_index
from app.core.localization.heading import find_heading
from app.core.localization.heading_conversion import turn_of_heading
from app.devices.clock import VirtualClock
from app.devices.webcam import SimulatedWebcam, WebcamError, WebcamFrame, WebcamState
from app.devices.webcam.simulated import FOV_DEG, FPS, DemoViews
from tests.helpers.demo_place import demo_panorama
from tests.helpers.fragile_webcam import FragileWebcam
from tests.helpers.scaled_clock import ScaledClock
from tests.helpers.waiting import PATIENCE_S, until

Bytes = NDArray[np.uint8]
VIEWS: Final = resources() / "demo" / "location" / "views"


@pytest.fixture(scope="module")
def scene() -> DemoViews:
    return DemoViews(VIEWS, 1.2)


def rendered(turn: int, distance: int = 120) -> Bytes:
    picture = cv2.imread(str(VIEWS / f"view-{turn:03d}-{distance}.webp"))
    assert picture is not None
    return np.ascontiguousarray(picture[48:336, :, ::-1])


def differ(first: Bytes, second: Bytes) -> float:
    """Mean difference of what is coarser than a few pixels."""
    soft = [cv2.GaussianBlur(p, (0, 0), 2.0).astype(float) for p in (first, second)]
    return float(np.abs(soft[0] - soft[1]).mean())


@pytest.mark.parametrize("turn", [0, 90, 355])
def test_at_a_rendered_turn_it_is_the_rendered_view(scene: DemoViews, turn: int) -> None:
    shown = scene.picture(float(turn))
    assert shown.shape == (288, 512, 3)
    assert differ(shown, rendered(turn)) < 3.0
    assert differ(shown, rendered(turn)) < differ(shown, rendered((turn + 5) % 360)) / 3


@pytest.mark.parametrize("turn", [90, 180])
def test_between_views_it_is_near_to_what_would_be_rendered(turn: int, tmp_path: Path) -> None:
    """A location without the view at this turn makes it from those 5 deg to both sides."""
    text = (VIEWS / "views.json").read_text("utf-8")
    (tmp_path / "views.json").write_text(text.replace(f'"turn_deg": {turn},', '"turn_deg": 1000,'))
    for near in (turn - 5, turn, turn + 5):
        for kind in ("webp", "png"):
            shutil.copy(VIEWS / f"view-{near:03d}-120.{kind}", tmp_path)
    made = DemoViews(tmp_path, 1.2).picture(float(turn))
    assert differ(made, rendered(turn)) < 0.5 * differ(rendered(turn - 5), rendered(turn + 5))


@pytest.mark.slow
def test_headings_found_in_it_are_those_it_is_set_to(scene: DemoViews) -> None:
    index = build_index(demo_panorama())
    for turn in (-177.5, -101.3, 2.5, 63.7, 138.8):
        large = np.asarray(cv2.resize(scene.picture(turn), (1280, 720)), np.uint8)
        found = find_heading(large, index, FOV_DEG)
        assert found.heading_deg is not None
        assert difference(turn_of_heading(found.heading_deg), turn) == pytest.approx(0.0, abs=0.5)


def test_clockwise_pans_to_the_right(scene: DemoViews) -> None:
    """The camera goes to its left and pans right: the far background moves to the left."""
    before, after = (
        cv2.cvtColor(scene.picture(turn), cv2.COLOR_RGB2GRAY)[:100].astype(np.float32)
        for turn in (181.0, 183.0)
    )
    (x, _), _ = cv2.phaseCorrelate(before, after)
    assert x < -3.0


def test_the_sitter_stays_in_the_middle(scene: DemoViews) -> None:
    first, second = scene.picture(92.4), scene.picture(92.6)
    assert differ(first[:, 226:286], second[:, 226:286]) < 2.0
    one, other = rendered(90)[100:180, 236:276], rendered(95)[100:180, 236:276]
    between = scene.picture(92.5)[100:180, 236:276].astype(float).mean(axis=(0, 1))
    limits = np.stack([p.astype(float).mean(axis=(0, 1)) for p in (one, other)])
    assert (between >= limits.min(axis=0) - 3).all()
    assert (between <= limits.max(axis=0) + 3).all()


def test_all_around_without_a_hole(scene: DemoViews) -> None:
    for turn in (-180.0, -2.5, 0.0, 179.9, 359.99, 720.0):
        picture = scene.picture(turn)
        assert picture.dtype == np.uint8
        assert (picture.max(axis=2) == 0).mean() < 0.001


@pytest.mark.parametrize(
    "damage", ["no folder", "no table", "bad table", "no picture", "bad depth"]
)
def test_damaged_views_are_said_to_be(tmp_path: Path, damage: str) -> None:
    folder = tmp_path / "views"
    if damage != "no folder":
        folder.mkdir()
    if damage in ("no picture", "bad depth"):
        shutil.copy(VIEWS / "views.json", folder)
    if damage == "bad table":
        (folder / "views.json").write_text('{"focal_px": []}')
    if damage == "bad depth":
        for turn in (0, 5):
            shutil.copy(VIEWS / f"view-{turn:03d}-120.webp", folder)
            (folder / f"view-{turn:03d}-120.png").write_bytes(b"no picture")
    with pytest.raises(WebcamError) as caught:
        DemoViews(folder, 1.2).picture(0.0)
    assert caught.value.code == "no-views"


@pytest.fixture
def webcam() -> Iterator[FragileWebcam]:
    made = FragileWebcam(VIEWS, ScaledClock(10.0))
    yield made
    made.close(PATIENCE_S)


def newest(webcam: SimulatedWebcam, after: int = -1) -> WebcamFrame:
    frames: list[WebcamFrame] = []

    def came() -> bool:
        frame = webcam.frames.get(0.1)
        if frame is not None and frame.number > after:
            frames.append(frame)
        return bool(frames)

    until(came, "a picture")
    return frames[-1]


def test_it_follows_the_turn(webcam: SimulatedWebcam) -> None:
    assert webcam.count == 0
    assert webcam.fov_deg == FOV_DEG
    webcam.set_turn(455.0)
    assert webcam.turn_deg == 95.0
    assert webcam.heading_deg == -85.0
    webcam.open()
    frame = newest(webcam)
    assert frame.picture.shape == (720, 1280, 3)
    assert differ(cv2.resize(frame.picture, (512, 288)), rendered(95)) < 4.0  # type: ignore[arg-type]
    webcam.set_turn(40.0)
    frame = newest(webcam, webcam.count + 1)
    assert differ(cv2.resize(frame.picture, (512, 288)), rendered(40)) < 4.0  # type: ignore[arg-type]
    assert webcam.state is WebcamState.LIVE
    assert webcam.error is None


def test_unplugged_and_plugged_in(webcam: FragileWebcam) -> None:
    webcam.open()
    newest(webcam)
    webcam.plugged = False
    until(lambda: webcam.state in (WebcamState.LOST, WebcamState.RETRYING))
    error = webcam.error
    assert error is not None
    assert error.code in ("unplugged", "no-webcam")
    count = webcam.count
    webcam.plugged = True
    newest(webcam, count)
    until(lambda: webcam.state is WebcamState.LIVE)


def test_black_and_frozen(webcam: FragileWebcam) -> None:
    webcam.open()
    newest(webcam)
    webcam.black = True
    until(lambda: (error := webcam.error) is not None and error.code == "black")
    webcam.black = False
    until(lambda: webcam.error is None)
    webcam.frozen = True
    until(lambda: webcam.state is not WebcamState.LIVE)
    webcam.frozen = False
    until(lambda: webcam.state is WebcamState.LIVE)


def test_it_keeps_its_pace() -> None:
    """On its own clock, and without making up for what a slow reader of the clock has missed."""
    clock = VirtualClock(100.0)
    source = SimulatedWebcam(VIEWS, clock, size=(640, 360))
    source.connect()
    for _ in range(round(FPS)):
        assert source.read() is not None
    assert clock.now() == pytest.approx(101.0)
    clock.sleep(5.0)
    for _ in range(round(FPS)):
        source.read()
    assert clock.now() == pytest.approx(107.0, abs=3.0 / FPS)


def test_it_can_be_opened_again() -> None:
    webcam = SimulatedWebcam(VIEWS, ScaledClock(10.0), distance_m=1.7)
    for _ in range(2):
        webcam.open()
        first = newest(webcam)
        newest(webcam, first.number + 3)
        webcam.close(PATIENCE_S)
        assert webcam.state is WebcamState.OFF
    assert webcam.distance_m == 1.8
