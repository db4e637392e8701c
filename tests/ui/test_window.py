"""The window as a whole: frame, keys, themes, layouts, what lies over it, what is kept."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, QSize, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QAbstractButton, QApplication, QLabel, QLineEdit, QWidget

from app.core.base.paths import resources
from app.core.places.place_folder import create_place
from app.core.places.place_list import delete_place, list_trash
from app.devices.clock import SystemClock
from app.devices.theta.discovery import Discovery
from app.ui.overlays.help import ManualBody
from app.ui.presenters.places_list import PlacesListPresenter
from app.ui.presenters.services import NO_LOUDSPEAKER
from app.ui.presenters.window_model import Step
from app.ui.shell.launch_options import LaunchOptions
from app.ui.shell.start import App
from app.ui.shell.window_frame import DropVeil
from app.ui.theme import theme
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.fields import ListField, Toggle
from app.ui.widgets.labels import Text
from app.words.explanations import EXPLANATIONS
from benchmarks.ui.screenshots.command import Lost, Robot

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pytestqt.qtbot import QtBot

    from app.core.base.progress import Token

SCENE = resources() / "demo" / "scenes" / "studio.exr"


class NoDevices:
    """A computer without cameras."""

    def discover(self, token: Token) -> Discovery:
        return Discovery()

    def webcams(self) -> Sequence[tuple[int, str]]:
        return ()


@pytest.fixture
def app(qtbot: QtBot, tmp_path: Path) -> Iterator[App]:
    yield from opened(tmp_path)


def opened(home: Path) -> Iterator[App]:
    application = QApplication.instance()
    assert isinstance(application, QApplication)
    made = App(application, LaunchOptions(), NoDevices(), SystemClock(), home)  # type: ignore[arg-type]
    made.show()
    Robot(made.window).wait(lambda: made.model.head is not None, "the head")
    yield made
    made.window.close()
    made.window.deleteLater()


@pytest.fixture
def robot(app: App) -> Robot:
    app.window._notify.dismiss()
    return Robot(app.window)


def open_scene(app: App, robot: Robot) -> None:
    app.place_controller.open_paths([SCENE])
    robot.wait(lambda: bool(app.model.results), "the answers")


def test_the_rail_leads_to_every_step(app: App, robot: Robot) -> None:
    for step, name in zip(Step, ("Probe", "Styles", "Turn", "Light"), strict=True):
        robot.click(name)
        assert app.model.step is step


def test_ctrl_and_a_number_lead_there_too(app: App, robot: Robot) -> None:
    keys = (Qt.Key.Key_4, Qt.Key.Key_3, Qt.Key.Key_2, Qt.Key.Key_1)
    for key, step in zip(keys, reversed(Step), strict=True):
        robot.press(key, Qt.KeyboardModifier.ControlModifier)
        assert app.model.step is step


def test_a_panorama_dropped_anywhere_becomes_a_place(app: App, robot: Robot) -> None:
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(SCENE))])
    copy, left = Qt.DropAction.CopyAction, Qt.MouseButton.LeftButton
    none = Qt.KeyboardModifier.NoModifier
    app.model.update(step=Step.LIGHT)
    enter = QDragEnterEvent(QPoint(300, 300), copy, data, left, none)
    QApplication.sendEvent(app.window, enter)
    assert bool(enter.isAccepted())
    assert robot.find("Drop a panorama").isVisible()
    QApplication.sendEvent(app.window, QDropEvent(QPointF(300, 300), copy, data, left, none))
    robot.wait(lambda: bool(app.model.results), "the answers")
    assert app.model.place is not None
    assert app.model.place.name == "studio"
    veils = app.window.findChildren(DropVeil)
    assert [veil.isVisible() for veil in veils] == [False]


@pytest.mark.parametrize("name", ["light", "contrast", "dark"])
def test_a_theme_is_worn_at_once_and_kept(app: App, robot: Robot, name: str) -> None:
    app.commands.change("theme", name)
    assert theme().name == name
    assert robot.find("Probe").isVisible()
    robot.wait(lambda: not app.runner.running("keep-settings"), "keeping")
    if name != "dark":
        kept = json.loads((app.services.folders.home / "settings.json").read_text("utf-8"))
        assert name in json.dumps(kept)


def test_a_larger_size_takes_the_narrow_layout(app: App, robot: Robot) -> None:
    app.window.resize(QSize(1440, 900))
    robot.settle()
    wide = robot.find("Steps").width()
    app.commands.change("text_scale", 1.25)
    robot.settle()
    assert theme().scale == pytest.approx(1.25)
    assert robot.find("Steps").width() == pytest.approx(72 * 1.25, abs=1)
    assert wide == 88


def test_the_layout_follows_the_window(app: App, robot: Robot) -> None:
    for size, rail in ((QSize(1440, 900), 88), (QSize(1024, 700), 72)):
        app.window.resize(size)
        robot.wait(
            lambda rail=rail: (
                robot_sees(robot, "Steps")  # type: ignore[misc]
                and robot.find("Steps").width() == rail
            ),
            "the layout",
        )


@pytest.mark.parametrize(
    ("what", "title"),
    [
        ("places", "Places"),
        ("settings", "Settings"),
        ("find", "Find anything"),
        ("messages", "Messages"),
        ("tour", "How it works"),
        ("help", "Help and shortcuts"),
        ("manual", "Manual"),
    ],
)
def test_what_lies_over_the_screen_opens_and_closes_by_esc(
    app: App, robot: Robot, what: str, title: str
) -> None:
    app.commands.ask(what)
    robot.settle()
    sheet = app.commands.overlay
    assert sheet is not None
    assert sheet.accessibleName() == title
    assert sheet.isVisible()
    robot.press(Qt.Key.Key_Escape)
    assert app.commands.overlay is None


@pytest.mark.parametrize("silent", [True, False])
def test_settings_say_where_there_is_no_loudspeaker(
    app: App, monkeypatch: pytest.MonkeyPatch, silent: bool
) -> None:
    monkeypatch.setattr(type(app.services.sounds), "available", not silent)
    app.commands.ask("settings")
    assert app.commands.overlay is not None
    words = [label.text() for label in app.commands.overlay.findChildren(QLabel)]
    assert (NO_LOUDSPEAKER in words) is silent


def test_settings_are_found_by_what_somebody_may_call_them(app: App, robot: Robot) -> None:
    app.commands.ask("settings")
    robot.settle()

    def shown() -> set[str]:
        assert app.commands.overlay is not None
        found: list[QWidget] = list(app.commands.overlay.findChildren(LabelledSlider))
        found += app.commands.overlay.findChildren(Toggle)
        found += [one.box for one in app.commands.overlay.findChildren(ListField)]
        return {one.accessibleName() for one in found if one.isVisible()}

    whole = shown()
    assert len(whole) > 12
    for typed, title in (
        ("dark mode", "Theme"),
        ("selfie", "Who turns"),
        ("FONT", "Text"),
    ):
        robot.write(typed)
        found = shown()
        assert 1 <= len(found) <= 4, typed
        assert any(one.startswith(title) for one in found), typed
        robot.press(Qt.Key.Key_Escape)
        assert shown() == whole, "the first Esc takes back what was typed"
    robot.write("xylophone")
    assert not shown()
    labels = app.commands.overlay.findChildren(QLabel) if app.commands.overlay else []
    said = [label.text() for label in labels if label.isVisible()]
    assert any("“xylophone”" in text for text in said)
    robot.press(Qt.Key.Key_Escape)
    robot.press(Qt.Key.Key_Escape)
    assert app.commands.overlay is None


def test_more_about_a_number_is_in_the_manual(app: App, robot: Robot) -> None:
    """Every explanation leads to its own place in the manual's section about the numbers."""
    for title, _ in EXPLANATIONS.values():
        app.window.asked.emit(f"manual#{title}", QPoint())
        robot.settle()
        assert app.commands.overlay is not None
        (manual,) = app.commands.overlay.findChildren(ManualBody)
        lead = manual._leads[title]
        bar = manual._area.verticalScrollBar()
        top = lead.mapTo(manual._area.viewport(), QPoint()).y()
        assert 0 <= top < 40 or bar.value() == bar.maximum(), title
        words = [text.text() for text in manual.findChildren(Text)]
        assert words.index("What the numbers mean") < words.index(title)
        assert not [text for text in words if "](" in text or "**" in text or "|" in text]


@pytest.mark.parametrize("speaks", [True, False])
def test_settings_offer_a_voice_only_where_the_system_has_one(
    app: App, monkeypatch: pytest.MonkeyPatch, speaks: bool
) -> None:
    monkeypatch.setattr(type(app.services.sounds), "speaks", speaks)
    app.commands.ask("settings")
    assert app.commands.overlay is not None
    names = {one.accessibleName() for one in app.commands.overlay.findChildren(QWidget)}
    assert ("Spoken voice" in names) is speaks


def test_keys_of_the_screen_rest_while_something_lies_over_it(app: App, robot: Robot) -> None:
    app.commands.ask("settings")
    robot.press(Qt.Key.Key_3, Qt.KeyboardModifier.ControlModifier)
    assert app.model.step is Step.PROBE


def test_anything_is_found_by_a_few_letters(app: App, robot: Robot) -> None:
    open_scene(app, robot)
    robot.press(Qt.Key.Key_K, Qt.KeyboardModifier.ControlModifier)
    assert isinstance(QApplication.focusWidget(), QLineEdit)
    robot.write("rembrandt left")
    robot.press(Qt.Key.Key_Return)
    robot.wait(lambda: app.model.step is Step.STYLES, "the gallery")
    assert app.model.chosen == "left-rembrandt"


def test_moving_the_marker_turns_every_answer_and_can_be_undone(app: App, robot: Robot) -> None:
    open_scene(app, robot)
    before = {one.name: one.turn_refined_deg for one in app.model.results}
    app.place_controller.move_front(40.0)
    robot.wait(lambda: not app.runner.running("solve"), "solving")
    for one in app.model.results:
        gone = (before[one.name] - one.turn_refined_deg - 40.0 + 180.0) % 360.0 - 180.0
        assert gone == pytest.approx(0.0, abs=1e-6)
    robot.press(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    robot.wait(lambda: not app.runner.running("solve"), "solving")
    assert {one.name: one.turn_refined_deg for one in app.model.results} == before
    assert app.model.front_deg == 0.0


def test_a_place_opened_again_gives_identical_numbers(qtbot: QtBot, tmp_path: Path) -> None:
    first = opened(tmp_path)
    app = next(first)
    robot = Robot(app.window)
    open_scene(app, robot)
    app.place_controller.move_front(-25.0)
    app.model.update(chosen="top", goal_deg=33.0)
    robot.wait(lambda: not app.runner.running("solve"), "solving")
    results = {one.name: one.turn_refined_deg for one in app.model.results}
    folder = app.model.place_folder
    next(first, None)
    second = opened(tmp_path)
    app = next(second)
    robot = Robot(app.window)
    assert folder is not None
    app.place_controller.open_place(folder)
    robot.wait(lambda: bool(app.model.results), "the place")
    robot.wait(lambda: not app.runner.running("solve"), "solving")
    assert {one.name: one.turn_refined_deg for one in app.model.results} == results
    assert (app.model.chosen, app.model.goal_deg) == ("top", 33.0)
    next(second, None)


def test_a_list_stays_while_a_place_is_opened_behind_it(app: App, robot: Robot) -> None:
    open_scene(app, robot)
    folder = app.model.place_folder
    assert folder is not None
    app.commands.ask("places")
    robot.wait(lambda: robot_sees(robot, "More about studio"), "the list")
    # As when the last place is opened at the start, which nobody asked for just now.
    app.place_controller.close()
    app.place_controller.open_place(folder)
    robot.wait(lambda: app.model.place_folder == folder, "the place")
    assert robot_sees(robot, "More about studio")
    app.window.paths_dropped.emit([SCENE])
    robot.wait(lambda: not robot_sees(robot, "More about studio"), "its end")


def test_a_place_deleted_by_mistake_comes_back(app: App, robot: Robot) -> None:
    open_scene(app, robot)
    folder = app.model.place_folder
    assert folder is not None
    app.commands.ask("places")
    robot.wait(lambda: robot_sees(robot, "More about studio"), "the list")
    shelf = PlacesListPresenter(app.services, app.place_controller)
    shelf.refresh()
    robot.wait(lambda: bool(shelf.resolve().rows), "the list")
    app.commands.close_overlay()
    shelf.delete(folder)
    robot.wait(lambda: robot_sees(robot, "studio deleted."), "the message")
    assert not folder.exists()
    toast = robot.find("studio deleted.")
    undo = next(b for b in toast.findChildren(QAbstractButton) if b.text() == "Undo")
    robot.click_at(undo)
    robot.wait(lambda: folder.exists(), "the place again")
    # And without the message, from the list.
    shelf.delete(folder)
    robot.wait(lambda: bool(list_trash(folder.parent)), "deleting")
    app.commands.ask("places")
    robot.wait(lambda: robot_sees(robot, "Restore studio"), "the end of the list")
    robot.click("Restore studio")
    robot.wait(lambda: folder.exists(), "the place again")
    robot.wait(lambda: robot_sees(robot, "More about studio"), "the list")
    assert not robot_sees(robot, "Restore studio")


def test_what_was_deleted_long_ago_can_still_be_brought_back(qtbot: QtBot, tmp_path: Path) -> None:
    now, places = datetime.now(UTC), tmp_path / "places"
    folder = create_place(places, "old", now)
    old = delete_place(folder, now - timedelta(days=4000))
    running = opened(tmp_path)
    app = next(running)
    robot = Robot(app.window)
    app.commands.ask("places")
    robot.wait(lambda: robot_sees(robot, "Restore old"), "the end of the list")
    robot.click("Restore old")
    robot.wait(lambda: folder.exists() and not old.exists(), "the place again")
    next(running, None)


def robot_sees(robot: Robot, name: str) -> bool:
    try:
        robot.find(name)
    except Lost:
        return False
    return True


def test_a_file_that_cannot_be_read_is_said_and_nothing_is_lost(
    app: App, robot: Robot, tmp_path: Path
) -> None:
    open_scene(app, robot)
    bad = tmp_path / "bad.exr"
    bad.write_bytes(b"not a picture")
    app.place_controller.open_paths([bad])
    robot.wait(lambda: any("bad.exr" in m.text for m in app.notify.messages), "the message")
    assert app.model.place is not None
    assert app.model.place.name == "studio"


def test_damaged_settings_are_said_and_kept_aside(qtbot: QtBot, tmp_path: Path) -> None:
    (tmp_path / "settings.json").write_text("{ not json", encoding="utf-8")
    running = opened(tmp_path)
    app = next(running)
    assert any("settings" in m.text.lower() for m in app.notify.messages)
    app.commands.change("theme", "light")
    Robot(app.window).wait(lambda: not app.runner.running("keep-settings"), "keeping")
    next(running, None)
    assert list(tmp_path.glob("settings.json*.bak*"))


def test_what_lies_over_the_screen_stays_there_when_the_layout_changes(
    app: App, robot: Robot
) -> None:
    app.window.resize(QSize(1440, 900))
    robot.settle()
    app.commands.ask("settings")
    app.window.resize(QSize(1024, 700))
    robot.wait(lambda: robot_sees(robot, "Steps") and robot.find("Steps").width() == 72, "narrow")
    sheet = app.commands.overlay
    assert sheet is not None
    middle = app.window.rect().center()
    under = app.window.childAt(middle)
    assert under is not None
    assert sheet.isAncestorOf(under) or under is sheet
