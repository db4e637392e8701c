"""What lies over the screens, and answers that come when it is gone."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
import shiboken6
from PySide6.QtCore import QCoreApplication, QEvent
from PySide6.QtWidgets import QApplication, QFileDialog, QWidget
from pytestqt.qtbot import QtBot

from app.core.base.imaging.images import write_image
from app.ui.overlays.find import FindBody
from app.ui.overlays.layers import LayersBody
from app.ui.presenters.places_list import _thumbnail
from app.ui.presenters.window_model import Step
from app.ui.screens.paint.screen_view import PaintScreen
from app.ui.widgets.dialogs import LineSheet
from tests.helpers.paint_studio import studio
from tests.helpers.synthetic import own_head
from tests.helpers.whole_window import open_light, opened


def test_a_head_of_ones_own_is_chosen_by_its_file(
    qapp: QApplication, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It lights every screen, and can be what new places start with."""
    anna = str(own_head(tmp_path / "baked", "anna"))
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (anna, ""))
    with opened(tmp_path / "home", sounds=False) as (app, robot):
        open_light(app, robot)
        app.commands.choose_head()
        robot.wait(lambda: app.model.head is not None and app.model.head.name == anna, "the head")
        robot.wait(lambda: not app.runner.running("solve"), "the answers")
        for step in (Step.STYLES, Step.LIGHT, Step.TURN):
            app.model.update(step=step)
            robot.settle()
        app.commands.change("head", anna)
        app.commands.ask("settings")
        robot.settle()
        assert robot.find("Head: Head anna").isVisible()
        assert not [one.text for one in app.notify.messages if one.kind == "error"]


@pytest.mark.usefixtures("qtbot")
def test_places_that_are_found_after_the_list_was_closed() -> None:
    commands, late = MagicMock(), []
    commands.all_actions.return_value = ()
    commands.place_controller.heads.return_value = ()
    commands.services.model.head = None

    def submit(key: str, work: Any, *, done: Any) -> None:
        late.append(done)

    commands.services.runner.submit = submit
    body = FindBody(commands)
    body.deleteLater()
    QCoreApplication.sendPostedEvents(body, QEvent.Type.DeferredDelete.value)
    assert not shiboken6.isValid(body)
    late[0](((), ()))


def test_the_sheet_for_a_name_goes_with_its_screen(qtbot: QtBot, tmp_path: Path) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    room = studio(tmp_path)
    screen = PaintScreen(room.presenter, compact=False)
    screen.setParent(window)
    room.presenter.attach(screen)
    screen.ask_name("save", "Mine")
    (sheet,) = window.findChildren(LineSheet)
    # As the window does when the theme changes.
    room.presenter.detach()
    screen.deleteLater()
    for widget in (screen, sheet):
        QCoreApplication.sendPostedEvents(widget, QEvent.Type.DeferredDelete.value)
    assert not shiboken6.isValid(sheet)


def test_a_small_picture_that_is_gone(tmp_path: Path) -> None:
    assert _thumbnail(tmp_path / "thumbnail.png") is None


def test_a_panorama_with_several_layers_asks_which(qapp: QApplication, tmp_path: Path) -> None:
    """The sheet lists them; a click opens the place by that one."""
    light = np.full((32, 64, 3), 0.5, np.float32)
    light[10:12, 20:24] = 9.0
    file = tmp_path / "layers.exr"
    names = tuple(f"{layer}.{channel}" for layer in ("fill", "key") for channel in "RGB")
    write_image(file, np.dstack([0.1 * light, light]), "float", {}, names)
    with opened(tmp_path / "home", sounds=False) as (app, robot):
        app.commands.open_paths([file])
        robot.wait(lambda: app.commands.overlay is not None, "the sheet")
        body = app.window.findChild(LayersBody)
        assert body is not None
        assert [button.text() for button in body.buttons] == ["fill", "key"]
        body.buttons[1].click()
        robot.wait(lambda: app.model.light is not None, "the place")
        light_here = app.model.light
        assert light_here is not None
        assert light_here.environment.radiance.max() == 9.0
        assert not [one.text for one in app.notify.messages if one.kind == "error"]
