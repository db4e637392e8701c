"""Messages of the window: errors stay until they are mended, and a bell counts them."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest
from PySide6.QtCore import QRect
from PySide6.QtWidgets import QAbstractButton, QFileDialog, QLineEdit, QWidget

from app.core.base import atomic_files as files
from app.core.base.atomic_files import DiskTrouble
from app.core.places.place_list import list_places
from app.ui.presenters.saving import TROUBLE_WORDS
from app.ui.presenters.window_frame import NOT_SAVED
from app.ui.presenters.window_model import Step
from app.ui.shell.jobs import JobLine
from app.ui.shell.notify import Notify
from benchmarks.ui.screenshots.command import Robot
from tests.helpers.whole_window import NoDevices, open_light, opened, sees

pytestmark = pytest.mark.usefixtures("qtbot")


@pytest.fixture
def home(tmp_path: Path) -> Path:
    (tmp_path / "home").mkdir()
    return tmp_path / "home"


def foot(robot: Robot) -> str:
    """The words in the line at the foot."""
    return str(robot.window._job_line._words.text())  # type: ignore[attr-defined]


def test_what_the_screen_cancels_is_not_cancelled_at_the_foot_too(home: Path) -> None:
    with opened(home, sounds=False) as (app, robot):
        line, window = robot.window._job_line, app.window  # type: ignore[attr-defined]
        window._show_job(JobLine("capture", "Capture", 0.5))
        assert line._bar.isVisible()
        assert not line._cancel.isVisible()
        # From another screen it is cancelled there.
        app.model.update(step=Step.STYLES)
        assert line._cancel.isVisible()
        window._show_job(JobLine("learn", "Learning"))
        app.model.update(step=Step.PROBE)
        assert line._cancel.isVisible()
        window._show_job(None)
        assert not line._cancel.isVisible()
        app.window.resize(1280, 720)
        robot.settle()
        small = robot.window._job_line  # type: ignore[attr-defined]
        assert small._cancel.kind == "quiet"


def test_a_failed_drop_is_said_at_the_foot_and_stays_until_one_succeeds(
    home: Path, tmp_path: Path
) -> None:
    text = tmp_path / "notes.txt"
    text.write_text("no picture")
    with opened(home) as (app, robot):
        open_light(app, robot)
        assert foot(robot) == "Place saved."
        app.place_controller.open_paths([text])
        robot.wait(lambda: not app.runner.running("open"), "the drop")
        assert "notes.txt" in foot(robot)
        assert app.window._toasts.count == 1
        assert sees(robot, "Messages, 1 unread")
        # Another theme makes the window anew, and the error is still there.
        app.commands.change("theme", "light")
        robot.settle()
        assert sees(robot, "Turnlight cannot read")
        assert "notes.txt" in foot(robot)
        robot.click("Messages, 1 unread")
        assert sees(robot, "Close")
        assert sees(robot, "Messages")
        assert not sees(robot, "Messages, 1 unread")
        app.commands.close_overlay()
        assert app.window._toasts.count == 1
        open_light(app, robot)
        assert app.window._toasts.count == 0
        assert foot(robot) == "Place saved."


def test_a_panorama_on_a_full_disk_is_shown_and_saved_elsewhere_with_one_button(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flush = files._flush

    def full(path: Path) -> None:
        if home in path.parents:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        flush(path)

    other = tmp_path / "stick"
    other.mkdir()
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: str(other))
    with opened(home) as (app, robot):
        monkeypatch.setattr(files, "_flush", full)
        open_light(app, robot)
        robot.wait(
            lambda: foot(robot) == NOT_SAVED.format(reason=TROUBLE_WORDS[DiskTrouble.FULL]),
            "the foot",
        )
        places = [text for text in told_of(app.notify) if "studio" in text]
        assert len(places) == 1
        robot.click("Save elsewhere…")
        robot.wait(lambda: app.model.unkept == "", "the other folder")
        assert not any("is not saved" in one.text for one in app.notify._standing)
        monkeypatch.setattr(files, "_flush", flush)
    assert len(list_places(other)) == 1


def told_of(notify: Notify) -> list[str]:
    return [one.text for one in notify.messages if one.kind == "error"]


def test_the_offer_of_the_tour_stays_and_lies_over_no_control(home: Path) -> None:
    with opened(home, NoDevices(), tour_seen=False) as (app, robot):
        robot.wait(lambda: sees(robot, "Take the tour"), "the offer")
        robot.wait(lambda: not app.runner.running("cameras"), "the search")
        robot.settle()
        offer = robot.find("New here?")
        assert offer.stays  # type: ignore[attr-defined]
        place = QRect(offer.mapTo(app.window, offer.rect().topLeft()), offer.size())
        for one in app.window.findChildren(QWidget):
            if isinstance(one, (QAbstractButton, QLineEdit)) and one.isVisible():
                area = QRect(one.mapTo(app.window, one.rect().topLeft()), one.size())
                assert offer.isAncestorOf(one) or not area.intersects(place), one.accessibleName()
        open_light(app, robot)
        assert not sees(robot, "Take the tour")
        app.commands.ask("messages")
        robot.settle()
        # The list offers it again.
        assert sees(robot, "Take the tour: New here?")


@pytest.mark.slow
def test_at_the_start_the_last_place_is_open_and_an_empty_screen_offers_the_recent_ones(
    home: Path,
) -> None:
    with opened(home) as (app, robot):
        open_light(app, robot)
        app.place_controller.change("rename", name="By the window")
        robot.wait(lambda: not app.runner.running("keep"), "keeping")
    with opened(home) as (app, robot):
        robot.wait(lambda: bool(app.model.results), "the last place")
        assert app.model.place is not None
        assert app.model.place.name == "By the window"
        app.place_controller.close()
        robot.wait(lambda: sees(robot, "Open By the window"), "the recent places")
        robot.click("Open By the window")
        robot.wait(lambda: app.model.light is not None, "the place")
        assert not sees(robot, "Recent places")
