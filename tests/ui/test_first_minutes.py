"""The first minutes: from an empty window to a turn in three clicks, or three keys."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractButton
from pytestqt.qtbot import QtBot

from app.core.base.angles import whole
from app.core.styles.styles import RARE
from app.ui.presenters.window_model import Step
from app.ui.screens.turn.screen_view import TurnScreen
from app.ui.shell.start import App
from benchmarks.ui.screenshots.command import Robot
from tests.helpers.whole_window import opened, until

PORTRAITS = ("flat", "butterfly", "loop", "rembrandt", "window", "split")


@pytest.fixture
def home(qtbot: QtBot, tmp_path: Path) -> Path:
    return tmp_path


def walk_there(app: App, robot: Robot, ways: tuple[Callable[[], None], ...]) -> None:
    """Go from the start to the turn; the three ways are a click or a key each."""
    first, second, third = ways
    first()
    until(robot, lambda: bool(app.model.results), "the answers")
    second()
    until(robot, lambda: app.model.step == Step.STYLES, "the gallery")
    until(robot, lambda: robot.find("Turn to this").isEnabled(), "a style that is proposed")
    third()
    until(robot, lambda: app.model.step == Step.TURN, "the turn")


def clicks(robot: Robot) -> tuple[Callable[[], None], ...]:
    names = ("Try it in 10 seconds", "See the styles", "Turn to this")
    return tuple(partial(robot.click, name) for name in names)


def check(app: App, robot: Robot) -> None:
    result, goal = app.model.result, app.model.goal_deg
    assert result is not None
    assert goal is not None
    assert goal == pytest.approx(result.turn_refined_deg)
    # A portrait that looks right, and not one that is seldom wanted alone.
    assert result.grade == "yes"
    assert result.name not in RARE
    assert any(kind in result.name for kind in PORTRAITS)
    assert abs(whole(goal)) > 15
    screen = robot.find("Turn", TurnScreen)
    number = screen.presenter.resolve().guidance.number
    assert number == abs(whole(goal))


def test_three_clicks(home: Path) -> None:
    with opened(home, sounds=False) as (app, robot):
        walk_there(app, robot, clicks(robot))
        check(app, robot)


def test_three_keys(home: Path) -> None:
    with opened(home, sounds=False) as (app, robot):
        walk_there(app, robot, ((lambda: robot.press(Qt.Key.Key_Return)),) * 3)
        check(app, robot)


def test_the_rail_says_what_was_chosen(home: Path) -> None:
    with opened(home, sounds=False) as (app, robot):
        walk_there(app, robot, clicks(robot))
        goal = app.model.goal_deg
        assert goal is not None
        assert robot.find("Styles, done", QAbstractButton).accessibleDescription() == "Flat"
        # On the way there is one number only: how far there is to go.
        assert robot.find("Turn", QAbstractButton).accessibleDescription() == ""
        app.model.update(step=Step.STYLES)
        told = robot.find("Turn", QAbstractButton).accessibleDescription()
        assert told == f"{abs(whole(goal))}° counter-clockwise"
