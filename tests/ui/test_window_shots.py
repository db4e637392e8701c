"""A photograph from a known turn, dropped on the whole window: what stands there is the truth."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from PySide6.QtCore import QMimeData, QPoint, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QApplication, QFileDialog
from pytestqt.qtbot import QtBot

from app.core.base.angles import whole, wrap
from app.core.base.paths import resources
from app.core.places.files.shots import is_frame, read_shots
from app.ui.presenters.window_model import Step
from app.ui.screens.turn.photos.photos import DROP_WORDS, REMOVED
from app.ui.screens.turn.photos.photos_view import ShotsLine, ShotsSheet
from app.ui.shell.start import App
from app.ui.shell.window_frame import DropVeil
from app.ui.widgets.labels import Text
from benchmarks.ui.screenshots.command import Robot
from tests.helpers.films import write_film
from tests.helpers.photos import taken_from, write_photo
from tests.helpers.whole_window import open_light, opened, say, until

LOCATION = resources() / "demo" / "location"
STYLE = "left-loop"


@pytest.fixture(scope="module")
def running(
    qapp: QApplication, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[App, Robot]]:
    home = tmp_path_factory.mktemp("home")
    with opened(home, camera_looks="sitter", sounds=False) as (app, robot):
        open_light(app, robot, LOCATION / "probe-1.exr")
        yield app, robot


@pytest.fixture
def window(qtbot: QtBot, running: tuple[App, Robot]) -> tuple[App, Robot]:
    app, robot = running
    app.model.choose(STYLE)
    app.model.update(step=Step.TURN, painting=None)
    robot.settle()
    return running


def drop(app: App, paths: list[Path]) -> str:
    """Hold files over the window, read what is offered, and let them go."""
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(path)) for path in paths])
    where, action = QPoint(40, 40), Qt.DropAction.CopyAction
    button, keys = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    app.window.dragEnterEvent(QDragEnterEvent(where, action, data, button, keys))
    veil = app.window.findChild(DropVeil)
    assert veil is not None
    assert veil.isVisible()
    words = veil.accessibleName()
    app.window.dropEvent(QDropEvent(where.toPointF(), action, data, button, keys))
    assert not veil.isVisible()
    return words


def line(robot: Robot) -> ShotsLine:
    found = robot.window.findChild(ShotsLine)
    assert found is not None
    return found


def goal_of(app: App) -> int:
    goal = app.model.target_turn_deg
    assert goal is not None
    return whole(goal)


@pytest.mark.slow
@pytest.mark.parametrize(("short", "aim"), [(4.0, 0.0), (-25.0, 7.0)])
def test_a_dropped_photo_says_at_which_turn_it_was_taken(
    window: tuple[App, Robot], tmp_path: Path, short: float, aim: float
) -> None:
    app, robot = window
    turn = wrap(goal_of(app) - short)
    before = app.model.place_folder
    photo = write_photo(tmp_path / f"IMG_{short}.jpg", taken_from(turn, aim).picture, 6)
    assert drop(app, [photo]) == DROP_WORDS
    until(robot, lambda: "best" in line(robot).words or "°" in line(robot).words, "answer")
    until(robot, lambda: "Looking" not in line(robot).words, "the end")
    assert before is not None
    shot = read_shots(before)[0][-1]
    assert shot.facing_deg is not None
    taken = wrap(shot.facing_deg - app.model.front_deg)
    assert abs(wrap(taken - turn)) <= 3.0
    assert ("In the light" in line(robot).words) == (shot.outside_deg == 0), line(robot).words
    assert line(robot).again.isVisible() == (shot.outside_deg != 0)
    result = app.model.result
    assert result is not None
    assert shot.match is not None
    assert shot.best == int(result.match)
    nearest = round(wrap(taken - app.model.front_deg) / 5.625) % 64
    assert abs(shot.match - result.match_curve[nearest]) <= 3.0
    # It is kept with the place that was open, and no other was made.
    assert app.model.place_folder == before
    assert (before / "shots" / "originals" / photo.name).read_bytes() == photo.read_bytes()


@pytest.mark.slow
def test_a_dropped_film_is_held_against_the_place_and_shows_its_own_frames(
    window: tuple[App, Robot], tmp_path: Path
) -> None:
    app, robot = window
    folder, frames = app.model.place_folder, []
    for turn in [*range(0, 360, 5), 0, 5, 10]:
        picture = cv2.imread(str(LOCATION / "views" / f"view-{turn:03d}-120.webp"))
        assert picture is not None
        frames.append(np.array(picture[..., ::-1], np.uint8))
    drop(app, [write_film(tmp_path / "turn.mp4", tuple(frames))])
    assert "agree to within" in say(app, robot, "Film and panorama")
    assert folder is not None
    kept = [shot for shot in read_shots(folder)[0] if is_frame(shot)]
    assert len(kept) >= 2
    # What is offered is seen from where it was filmed.
    assert all(shot.outside_deg == 0 and shot.name.startswith("Film ") for shot in kept)
    assert app.model.place_folder == folder
    app.model.choose(kept[0].style)
    robot.settle()
    until(robot, lambda: robot.find(kept[0].name), "the frame beside the target")


@pytest.mark.slow
def test_the_button_opens_one_and_the_list_removes_it(
    window: tuple[App, Robot], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    app, robot = window
    wall = write_photo(tmp_path / "wall.jpg", np.full((900, 1200, 3), 150, np.uint8))
    monkeypatch.setattr(QFileDialog, "getOpenFileNames", lambda *_: ([str(wall)], ""))
    robot.press(Qt.Key.Key_P)
    until(robot, lambda: "not found" in line(robot).words, "unsure")
    robot.click_at(line(robot).lister)
    sheet = robot.window.findChild(ShotsSheet)
    assert sheet is not None
    names = [text.text() for text in sheet.findChildren(Text)]
    assert any("wall.jpg" in name for name in names)
    robot.click("Remove wall.jpg")
    gone = REMOVED.format(name="wall.jpg")
    robot.wait(lambda: any(m.text == gone for m in app.notify.messages), "the message")
    robot.settle()
    assert "not found" not in line(robot).words
    sheet.shut()
    robot.press(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    until(robot, lambda: "not found" in line(robot).words, "it again")


@pytest.mark.slow
def test_a_wide_picture_is_no_photo_of_the_place(window: tuple[App, Robot], tmp_path: Path) -> None:
    app, robot = window
    before = app.model.place_folder
    assert before is not None
    drop(app, [write_photo(tmp_path / "wall.jpg", np.full((900, 1200, 3), 150, np.uint8))])
    until(robot, lambda: line(robot).words.endswith("."), "the photo")
    wide = tmp_path / "pano.png"
    assert cv2.imwrite(str(wide), np.full((256, 512, 3), 120, np.uint8))
    drop(app, [wide])
    # Taken for a panorama, a place of its own, not for a photo of the place.
    until(robot, lambda: app.model.place_folder not in (before, None), "a rough place")
    assert app.model.place is not None
    assert app.model.place.capture is not None
    assert app.model.place.capture.plan == "rough"
    # What was kept is there when the place is opened again.
    app.place_controller.open_place(before)
    robot.wait(lambda: app.model.place_folder == before, "the place")
    app.model.update(step=Step.TURN, painting=None)
    until(robot, lambda: line(robot).lister.isVisible(), "the photos")
