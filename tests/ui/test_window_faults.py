"""Things that go wrong, through the whole window: what is said, what is kept, what still works."""

from __future__ import annotations

import errno
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractButton, QFileDialog

from app.core.base.atomic_files import DiskTrouble
from app.core.base.paths import resources
from app.core.painting.user_style import not_saved
from app.core.painting.user_styles import list_user_styles
from app.core.places.place_folder import read_place
from app.core.places.place_list import list_places
from app.core.places.remarks import LightMissing
from app.core.storage.settings_file import FILE, read_settings
from app.core.styles.styles import load_styles
from app.devices.clock import SystemClock
from app.devices.simulated.exchange import Reply, Request
from app.ui.plots.guidance import BigDegrees
from app.ui.presenters.saving import TROUBLE_WORDS
from app.ui.presenters.window_model import Step
from app.ui.screens.paint.canvas_view import PaintCanvas
from app.ui.screens.probe.capture.notice import DISCONNECTED, FRAMES_SAVED
from app.ui.screens.styles.cards_view import DamagedCard, StyleCard
from app.ui.screens.turn.live.live_view import Well
from app.ui.shell.start import App
from app.ui.theme import theme
from app.ui.widgets.labels import Text
from app.words.phrases.quantities import place_name
from app.words.remarks import remark_words
from benchmarks.ui.screenshots.command import Robot
from tests.helpers.cameras import Rig
from tests.helpers.fragile_webcam import FragileWebcam
from tests.helpers.probe_screen import RigDevices
from tests.helpers.whole_window import (
    SCENE,
    OneWebcam,
    open_light,
    opened,
    say,
    told,
    until,
)

ROOT = Path(__file__).resolve().parents[2]
CTRL = Qt.KeyboardModifier.ControlModifier

pytestmark = pytest.mark.usefixtures("qtbot")


@pytest.fixture
def home(tmp_path: Path) -> Path:
    (tmp_path / "home").mkdir()
    return tmp_path / "home"


@contextmanager
def full_disk() -> Iterator[None]:
    """No file gets its name, and none can be filled, as on a disk without room."""

    def refuse(*_: Any, **__: Any) -> Any:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("app.core.base.atomic_files.os.replace", refuse)
        patch.setattr(Path, "write_bytes", refuse)
        yield


def works(app: App, robot: Robot) -> None:
    """The rest of the window goes on: every step comes to the front, and a turn can be had."""
    for step, name in zip(Step, ("Probe", "Styles", "Turn", "Light"), strict=True):
        robot.click(name)
        assert app.model.step is step
        assert app.window.front is not None
        assert app.window.front.isVisible()


def next_step_in(sentence: str) -> bool:
    """Whether a message has more than one sentence: what happened, then what to do."""
    return len([part for part in sentence.replace(".json", "").split(". ") if part.strip()]) >= 2


def half_written(folder: Path) -> list[str]:
    """Temporary files that were left behind."""
    return [path.name for path in folder.rglob(".*-*") if path.is_file()]


# -- the camera ------------------------------------------------------------------------------------


def vanish_after(rig: Rig, files: int, patch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Let the camera go away once so many whole pictures were fetched; gives the way back.

    The first of them is the one for metering.
    """
    camera, real, fetched = rig.camera, rig.camera.answer, set[str]()

    def answer(request: Request) -> Reply:
        if request.method == "GET" and request.target.lower().endswith(".jpg"):
            fetched.add(request.target)
            if len(fetched) > files:
                patch.setattr(camera, "reachable", lambda: False)
                # Connections that are open die as well.
                camera.epoch += 1
                raise ConnectionResetError("Connection reset by peer")
        return real(request)

    patch.setattr(camera, "answer", answer)

    def come_back() -> None:
        patch.undo()

    return come_back


def test_the_camera_goes_away_in_the_middle_and_comes_back(home: Path, tmp_path: Path) -> None:
    rig = Rig(tmp_path / "rig", shape=(128, 256))
    patch = pytest.MonkeyPatch()
    come_back = vanish_after(rig, 3, patch)
    with opened(home, RigDevices(rig), rig.clock, plan="paper") as (app, robot):
        robot.wait(lambda: app.model.camera is not None, "the camera")
        robot.wait(lambda: not app.runner.running("camera-state"), "the camera's state")
        robot.click("Capture")
        lost = DISCONNECTED.format(here=2, total=3)
        until(robot, lambda: robot.find(lost), "the notice")
        assert f" {FRAMES_SAVED[2]} " in robot.find(lost).accessibleName()
        (folder,) = (place.folder for place in list_places(home / "places"))
        frames = sorted(path.name for path in folder.rglob("originals/*.JPG"))
        assert len(frames) == 2
        works(app, robot)
        robot.click("Probe")
        come_back()
        shots = len(rig.camera.storage.files)
        robot.click("Resume")
        robot.wait(lambda: bool(app.model.results), "the answers")
        assert len(rig.camera.storage.files) == shots
        assert app.model.place_folder == folder
        assert set(frames) < {path.name for path in folder.rglob("originals/*.JPG")}
    assert [place.trouble for place in list_places(home / "places")] == [None]


def test_a_capture_cut_off_is_offered_at_the_next_start(home: Path, tmp_path: Path) -> None:
    rig = Rig(tmp_path / "rig", shape=(128, 256))
    patch = pytest.MonkeyPatch()
    come_back = vanish_after(rig, 3, patch)
    with opened(home, RigDevices(rig), rig.clock, plan="paper") as (app, robot):
        robot.wait(lambda: app.model.camera is not None, "the camera")
        robot.wait(lambda: not app.runner.running("camera-state"), "the camera's state")
        robot.click("Capture")
        until(robot, lambda: robot.find("Camera disconnected"), "the notice")
    come_back()
    with opened(home) as (app, robot):
        offered = f"“{place_name(datetime.now().astimezone())}” from"
        until(robot, lambda: robot.find(offered), "the offer")
        offer = robot.find(offered).accessibleName()
        assert " 2 of 3 " in offer
        robot.click("Merge these two")
        robot.wait(lambda: bool(app.model.results), "the answers")
        works(app, robot)


# -- the webcam ------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_webcam_is_pulled_out_and_put_back(home: Path) -> None:
    location = resources() / "demo" / "location"
    webcam = FragileWebcam(location / "views", SystemClock(), size=(480, 320))
    with opened(home, OneWebcam(webcam), camera_looks="sitter", sounds=False) as (app, robot):
        open_light(app, robot, location / "probe-1.exr")
        app.model.update(step=Step.TURN, chosen="left-split")
        until(robot, lambda: "to go" in number_shown(robot), "a number from the live picture")
        before = number_shown(robot)
        webcam.plugged = False
        until(robot, lambda: gone(robot), "the message")
        assert "Plug it back in" in gone(robot)
        # The way stays to be seen: the whole turn by eye.
        works(app, robot)
        robot.click("Turn")
        webcam.plugged = True
        until(robot, lambda: number_shown(robot) == before, "the number again")
        assert not gone(robot)


def number_shown(robot: Robot) -> str:
    degrees = robot.window.findChild(BigDegrees)
    return "" if degrees is None else degrees.accessibleName()


def gone(robot: Robot) -> str:
    """What is said of a webcam that was disconnected, over the live picture."""
    wells = [well.message for well in robot.window.findChildren(Well) if well.isVisible()]
    return next((words for words in wells if "disconnected" in words or "No webcam" in words), "")


# -- a full disk -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_place_that_cannot_be_kept_is_kept_once_there_is_room(home: Path) -> None:
    with opened(home) as (app, robot):
        open_light(app, robot)
        folder = app.model.place_folder
        assert folder is not None
        robot.wait(lambda: not app.runner.running("keep"), "keeping")
        before = (folder / "place.json").read_bytes()
        with full_disk():
            app.place_controller.move_front(40.0)
            sentence = say(app, robot, "are not saved")
            assert "“studio”" in sentence
            assert TROUBLE_WORDS[DiskTrouble.FULL] in sentence
            assert "Free some space" in sentence
            assert (folder / "place.json").read_bytes() == before
            works(app, robot)
            # Another place, and back again: what the disk did not take is not forgotten.
            app.place_controller.close()
            assert app.model.place is None
            app.place_controller.open_place(folder)
            robot.wait(lambda: bool(app.model.results), "the place")
            assert app.model.front_deg == 40.0
        # The place's background may be on its way to the disk just now.
        robot.wait(lambda: half_written(home) == [], "no file half written")
    assert read_place(folder).front_deg == 40.0


def test_a_panorama_without_room_leaves_nothing_half(home: Path) -> None:
    with opened(home) as (app, robot):
        with full_disk():
            app.place_controller.open_paths([SCENE])
            sentence = say(app, robot, "is not saved: the disk is full")
            assert next_step_in(sentence)
            # It is solved and shown all the same.
            robot.wait(lambda: bool(app.model.results), "the answers")
        assert app.model.place_folder is None
        assert list_places(home / "places") == ()
        assert half_written(home) == []
        open_light(app, robot)
        works(app, robot)


def test_closing_waits_once_while_the_disk_is_full(home: Path) -> None:
    with opened(home) as (app, robot):
        open_light(app, robot)
        folder = app.model.place_folder
        assert folder is not None
        robot.wait(lambda: not app.runner.running("keep"), "keeping")
        with full_disk():
            app.model.update(goal_deg=12.0)
            app.window.close()
            assert app.window.isVisible()
            assert "close again" in say(app, robot, "last changes are not saved")
            works(app, robot)
        app.window.close()
        assert not app.window.isVisible()
    assert read_place(folder).goal_deg == 12.0


def test_settings_that_cannot_be_kept_count_and_are_kept_later(home: Path) -> None:
    with opened(home) as (app, robot):
        with full_disk():
            app.commands.change("theme", "light")
            assert "until you quit" in say(app, robot, "settings were not saved")
            assert theme().name == "light"
            works(app, robot)
        assert read_settings(home / FILE)[0].theme != "light"
    # Room again at the end is early enough.
    assert read_settings(home / FILE)[0].theme == "light"


def test_the_last_change_before_closing_is_kept(home: Path) -> None:
    with opened(home) as (app, _robot):
        for size in (1.1, 1.2, 1.3, 1.25):
            app.commands.change("text_scale", size)
    assert read_settings(home / FILE)[0].text_scale == 1.25


def test_a_set_sheet_without_room_leaves_the_old_one(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "sheet.pdf"
    file.write_bytes(b"the one of yesterday")
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(file), ""))
    with opened(home) as (app, robot):
        open_light(app, robot)
        robot.click("Styles")
        robot.wait(lambda: not app.runner.running("styles-pictures"), "the pictures")
        with full_disk():
            robot.press(Qt.Key.Key_S, CTRL)
            sentence = say(app, robot, "sheet.pdf: no space left")
            assert next_step_in(sentence)
            assert file.read_bytes() == b"the one of yesterday"
            assert half_written(tmp_path) == []
        robot.press(Qt.Key.Key_S, CTRL)
        say(app, robot, "sheet.pdf saved")
        assert file.read_bytes().startswith(b"%PDF")
        works(app, robot)


def paint(app: App, robot: Robot) -> PaintCanvas:
    """Begin a style from nothing: a brighter stroke and a darker one, with the mouse."""
    app.model.update(step=Step.STYLES, painting="")
    canvas = robot.window.findChild(PaintCanvas)
    assert canvas is not None
    presenter: Any = app.window.front_presenter
    robot.wait(lambda: presenter.canvas is not None, "the canvas")
    size = presenter.canvas.size
    for key, left in ((Qt.Key.Key_B, 0.35), (Qt.Key.Key_D, 0.55)):
        robot.press(key)
        places = [(left + 0.04 * step) * size for step in range(4)]
        robot.drag(canvas, [canvas.at(x, 0.45 * size).toPoint() for x in places])
    assert presenter.canvas.weights.min() < 0.0 < presenter.canvas.weights.max()
    robot.wait(lambda: presenter.save_works, "what the strokes come to")
    return canvas


@pytest.mark.slow
def test_a_painted_style_without_room_stays_on_the_canvas(home: Path) -> None:
    with opened(home) as (app, robot):
        open_light(app, robot)
        paint(app, robot)
        presenter: Any = app.window.front_presenter
        painted = presenter.canvas.weights.copy()
        robot.press(Qt.Key.Key_S, CTRL)
        robot.write("Window light")
        with full_disk():
            robot.press(Qt.Key.Key_Return)
            say(app, robot, not_saved(OSError(errno.ENOSPC, "")).hint)
            assert (presenter.canvas.weights == painted).all()
            assert half_written(home) == []
        # The name is still there to be taken once more.
        robot.press(Qt.Key.Key_Return)
        say(app, robot, "Window light saved")
        styles, damaged = list_user_styles(home / "styles")
        assert [style.title for style in styles] == ["Window light"]
        assert damaged == ()
        assert (styles[0].weights == painted).all()
        works(app, robot)


# -- damaged files ---------------------------------------------------------------------------------


def kept_places(home: Path, *names: str) -> list[Path]:
    """Make places as the app does, and leave."""
    with opened(home) as (app, robot):
        for _ in names:
            open_light(app, robot)
        robot.wait(lambda: not app.runner.running("keep"), "keeping")
    folders = [place.folder for place in list_places(home / "places")]
    assert len(folders) == len(names)
    return folders


def cut_off(folder: Path) -> None:
    file = folder / "place.json"
    data = file.read_bytes()
    file.write_bytes(data[: len(data) // 3])


def no_light(folder: Path) -> None:
    for file in folder.glob("*.exr"):
        file.unlink()


def broken_light(folder: Path) -> None:
    for file in folder.glob("*.exr"):
        file.write_bytes(b"not a picture any more")


def no_sense(folder: Path) -> None:
    (folder / "place.json").write_bytes(b"\x00\xff" * 50)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("damage", "listed", "light"),
    [
        (cut_off, "Part of this place cannot be read", True),
        (no_sense, "Part of this place cannot be read", True),
        (no_light, remark_words(LightMissing()), False),
        (broken_light, "", False),
    ],
)
def test_a_damaged_place_is_opened_from_the_list(
    home: Path, damage: Callable[[Path], None], listed: str, light: bool
) -> None:
    whole, hurt = kept_places(home, "whole", "hurt")
    damage(hurt)
    files = {path.name: path.read_bytes() for path in hurt.iterdir() if path.is_file()}
    with opened(home) as (app, robot):
        robot.click("Places")
        robot.wait(lambda: len(openers(robot)) == 2, "the list")
        if listed:
            texts = [one.text() for one in robot.window.findChildren(Text)]
            assert any(listed in text for text in texts), texts
        number = [place.folder for place in list_places(home / "places")].index(hurt)
        robot.click_at(openers(robot)[number])
        until(
            robot, lambda: any("studio" in text or "place" in text for text in told(app)), "words"
        )
        assert next_step_in(" ".join(told(app))), told(app)
        if light:
            robot.wait(lambda: bool(app.model.results), "the answers")
            assert app.model.place_folder == hurt
        else:
            assert app.model.place_folder != hurt
        works(app, robot)
        app.place_controller.open_place(whole)
        robot.wait(lambda: app.model.place_folder == whole, "the other place")
        robot.wait(lambda: not app.runner.running("keep"), "keeping")
    for name, data in files.items():
        kept = {path.read_bytes() for path in hurt.iterdir() if path.name.startswith(name)}
        assert data in kept, f"{name} was lost"


def openers(robot: Robot) -> list[QAbstractButton]:
    """Buttons of the list that open a place, from above."""
    buttons = robot.window.findChildren(QAbstractButton)
    found = [one for one in buttons if one.isVisible() and one.accessibleName() == "Open studio"]
    return sorted(found, key=lambda one: one.mapToGlobal(one.rect().topLeft()).y())


def test_a_setting_out_of_range_is_said_and_the_others_hold(home: Path) -> None:
    text = json.dumps({"format_version": 1, "text_scale": 70, "theme": "light", "tour_seen": True})
    (home / FILE).write_text(text, encoding="utf-8")
    with opened(home) as (app, robot):
        assert theme().name == "light"
        assert theme().scale == 1.0
        sentence = told(app)[0]
        assert "reset to" in sentence
        assert any("saved as settings.json.bak" in one for one in told(app))
        works(app, robot)
    assert (home / "settings.json.bak").read_text(encoding="utf-8") == text


@pytest.mark.slow
@pytest.mark.parametrize("garbage", [b"", b"title = ", b"\xff\xfe\x00", b"[weights]\nx = 1\n"])
def test_a_damaged_style_has_a_card_with_a_warning(home: Path, garbage: bytes) -> None:
    (home / "styles").mkdir()
    file = home / "styles" / "evening.toml"
    file.write_bytes(garbage)
    with opened(home) as (app, robot):
        open_light(app, robot)
        robot.click("Styles")
        until(robot, lambda: robot.find("evening, ", DamagedCard), "the card")
        card = robot.find("evening, ", DamagedCard)
        assert card.isVisible()
        assert card.button.isEnabled()
        assert "Show file" in card.button.text()
        assert len(card.accessibleName()) > len("evening, ") + 10
        titles = {style.title for style in load_styles()}
        assert len(robot.window.findChildren(StyleCard)) == len(titles)
        works(app, robot)
    assert file.read_bytes() == garbage


@pytest.mark.slow
def test_a_style_whose_layers_are_gone_has_a_card_with_a_warning(home: Path) -> None:
    with opened(home) as (app, robot):
        open_light(app, robot)
        paint(app, robot)
        robot.press(Qt.Key.Key_S, CTRL)
        robot.write("Window light")
        robot.press(Qt.Key.Key_Return)
        say(app, robot, "Window light saved")
    toml = next((home / "styles").glob("*.toml"))
    layers = [path for path in (home / "styles").iterdir() if path.is_file() and path != toml]
    assert layers
    for path in layers:
        path.unlink()
    with opened(home) as (app, robot):
        robot.click("Styles")
        until(robot, lambda: robot.find(f"{toml.stem}, ", DamagedCard), "the card")
        works(app, robot)
    assert toml.exists()


# -- killed ----------------------------------------------------------------------------------------

KILLED = """
import sys
from datetime import datetime
from pathlib import Path
from PySide6.QtWidgets import QApplication
from app.devices.clock import SystemClock
from app.ui.presenters.window_model import Step
from benchmarks.ui.screenshots.command import Robot
from app.ui.shell.start import App
from app.ui.shell.launch_options import LaunchOptions
from tests.helpers.whole_window import SCENE, NoDevices

application = QApplication([])
app = App(application, LaunchOptions(), NoDevices(), SystemClock(), Path(sys.argv[1]))
app.show()
robot = Robot(app.window)
robot.wait(lambda: app.model.head is not None, "the head")
app.place_controller.open_paths([SCENE])
robot.wait(lambda: bool(app.model.results) and not app.runner.running("open"), "the answers")
app.model.update(step=Step.STYLES, painting="")
presenter = app.window.front_presenter
robot.wait(lambda: presenter.canvas is not None, "the canvas")
size = presenter.canvas.size
number = 0
while True:
    number += 1
    presenter.press((0.4 * size, (0.3 + number % 30 / 100.0) * size, 1.0))
    presenter.draw([(0.6 * size, 0.5 * size, 1.0)])
    presenter.lift()
    app.place_controller.change("notes", notes=f"{number} " * 3000)
    app.place_controller.move_front(number % 180 - 90.0)
    app.commands.change("volume", float(number % 20 * 5))
    presenter.files.named("save-as", f"Style {number}")
    robot.wait(lambda: not presenter.files.saving, "saving")
    if number == 2:
        print("ready", flush=True)
"""


@contextmanager
def started(home: Path) -> Iterator[subprocess.Popen[str]]:
    """The app in a process of its own, which saves without a pause."""
    process = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(home)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen", "OPENBLAS_NUM_THREADS": "1"},
    )
    try:
        assert process.stdout is not None
        if process.stdout.readline() != "ready\n":
            process.kill()
            raise AssertionError(process.communicate()[1])
        yield process
    finally:
        process.kill()
        process.communicate()


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="processes are killed")
def test_killed_in_the_middle_of_saving_nothing_is_lost(home: Path) -> None:
    rng = random.Random(11)
    titles: set[str] = set()
    for life in range(1, 6):
        with started(home) as process:
            time.sleep(rng.uniform(0.05, 0.6))
            process.send_signal(signal.SIGKILL)
            process.wait(600)
        assert process.returncode == -signal.SIGKILL
        assert read_settings(home / FILE)[1] == ()
        places = list_places(home / "places")
        assert [place.trouble for place in places] == [None] * life
        for place in places:
            kept = read_place(place.folder)
            assert kept.remarks == ()
            words = kept.notes.split()
            assert len(set(words)) <= 1
        styles, damaged = list_user_styles(home / "styles")
        assert damaged == ()
        known = {style.title for style in styles}
        # What was there before the last life is all there still.
        assert titles <= known
        titles = known
    assert len(titles) >= 10
    with opened(home) as (app, robot):
        assert told(app) == []
        until(robot, lambda: len(app.model.user_styles) == len(titles), "the styles")
        robot.wait(lambda: app.model.light is not None, "the place that was open last")
        before = app.model.light
        app.place_controller.open_place(list_places(home / "places")[0].folder)
        robot.wait(lambda: app.model.light is not before, "the newest place")
        robot.wait(lambda: bool(app.model.results), "the answers")
        works(app, robot)
        # The strokes of the last life that no style has are on the canvas again.
        app.model.update(step=Step.STYLES, painting="")
        robot.settle()
        assert not [words for words in told(app) if "went wrong" in words]
