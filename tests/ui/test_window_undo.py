"""Undo, search and the way to the lamp through the whole window, by keys and clicks."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QApplication, QLineEdit

from app.core.painting.user_styles import list_user_styles
from app.ui.overlays.find import FindBody
from app.ui.overlays.settings import SettingsBody
from app.ui.presenters.window_model import Step
from app.ui.screens.light.screen import LightPresenter
from app.ui.screens.paint.screen import PaintPresenter
from app.ui.screens.styles.screen import StylesPresenter
from app.ui.shell.start import App
from benchmarks.ui.screenshots.command import Robot
from tests.helpers.whole_window import open_light, opened, say, sees

CTRL = Qt.KeyboardModifier.ControlModifier


@pytest.fixture
def running(
    qapp: QApplication, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[App, Robot]]:
    with opened(tmp_path, sounds=False) as (app, robot):
        open_light(app, robot)
        app.window._notify.dismiss()
        yield app, robot


@pytest.mark.slow
def test_ctrl_z_after_deleting_a_style_brings_it_back_and_stays_in_the_gallery(
    running: tuple[App, Robot],
) -> None:
    app, robot = running
    folder = app.services.folders.styles
    app.model.update(step=Step.STYLES, painting="left-rembrandt")
    paint = app.window._presenter_of("paint")
    assert isinstance(paint, PaintPresenter)
    robot.wait(lambda: paint.canvas is not None, "the canvas")
    paint.dab(100.0, 100.0)
    paint.files.named("save", "Mine")
    robot.wait(lambda: bool(list_user_styles(folder)[0]), "the style")
    robot.wait(lambda: app.model.painting == "mine", "the name")
    paint.dab(200.0, 100.0)
    painted = paint.canvas
    robot.press(Qt.Key.Key_Escape)
    robot.wait(lambda: app.model.painting is None, "the gallery")
    styles = app.window._presenter_of("styles")
    assert isinstance(styles, StylesPresenter)
    robot.wait(lambda: styles.files._own_style() is not None, "the card")
    next(a.run for a in app.commands.all_actions() if a.key == "delete-style")()
    say(app, robot, "Mine deleted.")
    assert sees(robot, "Undo delete Mine") or app.services.undo.undo_words == "delete Mine"
    robot.press(Qt.Key.Key_Z, CTRL)
    say(app, robot, "Mine has been restored.")
    assert (app.model.step, app.model.painting) == (Step.STYLES, None)
    assert [one.title for one in app.model.user_styles] == ["Mine"]
    assert app.window._idle[0] == "Undone: delete Mine."
    # And the stroke that was not saved is still there.
    app.model.update(painting="mine")
    robot.wait(lambda: paint.canvas is not None, "the canvas")
    assert painted is not None
    assert paint.canvas is not None
    assert (paint.canvas.weights == painted.weights).all()


def test_anything_is_found_and_nothing_is_said_to_be_nothing(running: tuple[App, Robot]) -> None:
    app, robot = running
    app.commands.ask("find")
    robot.settle()
    body = app.window.findChild(FindBody)
    assert isinstance(body, FindBody)
    body.field.edit.setFocus()
    robot.write("xyzzy")
    robot.settle()
    assert body.nothing.isVisible()
    assert body.nothing.text().startswith("Nothing found for “xyzzy”.")
    body.field.edit.clear()
    robot.write("self-timer")
    robot.settle()
    robot.press(Qt.Key.Key_Return)
    robot.wait(lambda: app.window.findChild(SettingsBody) is not None, "the settings")
    robot.wait(lambda: QApplication.focusWidget() is not None, "the focus")
    robot.settle()
    settings = app.window.findChild(SettingsBody)
    assert isinstance(settings, SettingsBody)
    control = settings._controls["self_timer_s"]
    middle = control.mapTo(settings, control.rect().center())
    assert settings.rect().contains(QPoint(middle.x(), middle.y()))
    focus = QApplication.focusWidget()
    assert focus is not None
    assert not isinstance(focus, QLineEdit)
    assert control is focus or control.isAncestorOf(focus)


@pytest.mark.slow
def test_the_way_to_the_lamp_and_back_by_keys(running: tuple[App, Robot]) -> None:
    app, robot = running
    app.model.update(step=Step.LIGHT)
    robot.settle()
    robot.click("Use the phone")
    light = app.window._presenter_of("light")
    assert isinstance(light, LightPresenter)
    robot.click("Night street, 5 lx")
    robot.wait(lambda: light.front is not None, "the answers")
    robot.wait(lambda: not light.resolve().detail.stale, "the picture")
    robot.press(Qt.Key.Key_T)
    robot.wait(lambda: app.model.step is Step.TURN, "the turn")
    plan = app.model.lamp_plan
    assert plan is not None
    assert plan.hold == light.resolve().hold.hold
    robot.press(Qt.Key.Key_Escape)
    robot.wait(lambda: app.model.step is Step.LIGHT, "the lamp")
