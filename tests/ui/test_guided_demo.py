"""The two-minute demo: it shows every screen by itself and leaves everything as it was."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from app.core.places.place import CaptureFacts
from app.ui.presenters.window_model import Step
from app.ui.shell.guided_demo import SECONDS, GuidedDemo
from app.ui.shell.start import App
from benchmarks.ui.screenshots.command import Robot
from tests.helpers.whole_window import open_light, opened, says, sees, until


@pytest.fixture
def home(qtbot: QtBot, tmp_path: Path) -> Path:
    return tmp_path


def begin(app: App, robot: Robot) -> GuidedDemo:
    next(a.run for a in app.commands.all_actions() if a.key == "guided-demo")()
    guided = app.commands.guided
    assert guided is not None
    robot.wait(lambda: guided.number == 0, "the first step")
    assert says(robot, "1 of 5")
    return guided


def test_it_leads_through_the_screens_and_ends(home: Path) -> None:
    with opened(home, sounds=False) as (app, robot):
        begin(app, robot)
        seen = [(app.model.step, app.model.painting is not None)]
        goal = None
        for number in range(2, 6):
            robot.click("Next")
            assert says(robot, f"{number} of 5")
            seen.append((app.model.step, app.model.painting is not None))
            goal = goal or app.model.goal_deg
        assert seen == [
            (Step.PROBE, False),
            (Step.STYLES, False),
            (Step.TURN, False),
            (Step.STYLES, True),
            (Step.LIGHT, False),
        ]
        result = app.model.result
        assert result is not None
        assert result.grade == "yes"
        assert goal == pytest.approx(result.turn_refined_deg)
        robot.click("Next")
        assert app.commands.guided is None
        assert not sees(robot, "Leave the demo")
        assert app.model.demo_open


def test_it_runs_by_itself_and_waits_while_paused(home: Path) -> None:
    with opened(home, sounds=False) as (app, robot):
        guided = begin(app, robot)
        assert sum(SECONDS.values()) == pytest.approx(120.0)
        robot.click("Pause")
        for _ in range(400):
            guided.tick()
        assert says(robot, "1 of 5")
        robot.click("Continue")
        for _ in range(round(10 * SECONDS["probe"]) + 3):
            guided.tick()
        assert says(robot, "2 of 5")


def test_the_webcam_of_the_demo_walks_to_the_goal(home: Path) -> None:
    with opened(home, sounds=False) as (app, robot):
        begin(app, robot)
        for _ in range(2):
            robot.click("Next")
        guided = app.commands.guided
        assert guided is not None
        for _ in range(250):
            guided.tick()
        until(robot, lambda: says(robot, "You are in the light"), "the light")


def test_who_leaves_finds_the_own_place_again(home: Path) -> None:
    with opened(home, sounds=False) as (app, robot):
        open_light(app, robot)
        robot.wait(lambda: app.model.place_folder is not None, "the place on the disk")
        folder = app.model.place_folder
        app.model.update(step=Step.LIGHT)
        begin(app, robot)
        robot.click("Next")
        robot.click("Leave the demo")
        until(robot, lambda: app.model.place_folder == folder, "the own place")
        assert app.model.step == Step.LIGHT
        assert app.commands.guided is None


def test_another_theme_keeps_it_in_sight(home: Path) -> None:
    with opened(home, sounds=False) as (app, robot):
        begin(app, robot)
        app.window.wear("contrast", 1.0)
        assert sees(robot, "Leave the demo")
        robot.click("Next")
        assert says(robot, "2 of 5")


def test_who_opens_another_place_meanwhile_stays_there(home: Path) -> None:
    with opened(home, sounds=False) as (app, robot):
        open_light(app, robot)
        robot.wait(lambda: app.model.place_folder is not None, "the place on the disk")
        begin(app, robot)
        open_light(app, robot)
        there = app.model.light
        robot.click("Leave the demo")
        robot.settle()
        assert app.model.light is there
        assert not app.runner.running("open")


def test_a_capture_over_the_demo_place_is_seen_by_a_real_webcam(home: Path) -> None:
    with opened(home, sounds=False) as (app, robot):
        app.place_controller.open_demo()
        robot.wait(lambda: app.model.demo_open, "the demo place")
        place = app.model.place
        assert place is not None
        app.model.update(place=replace(place, capture=CaptureFacts(plan="full")))
        assert not app.model.demo_open
