"""The list of places in the whole window: searched, opened by its lines, renamed in a sheet."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest
from PySide6.QtWidgets import QLineEdit
from pytestqt.qtbot import QtBot

from app.core.storage.places.store import create_place, list_places
from app.ui.widgets.surfaces import Menu, PictureLine
from tests.helpers.whole_window import open_light, opened, quick_heads, sees

NAMES = ("Café, window", "Court, sun", "Court, evening")


def test_places_are_found_opened_and_renamed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, qtbot: QtBot
) -> None:
    quick_heads(monkeypatch)
    home = tmp_path / "home"
    home.mkdir()
    for name in NAMES:
        create_place(home / "places", name, datetime(2026, 6, 21, 12, tzinfo=UTC))
    with opened(home) as (app, robot):
        open_light(app, robot)
        robot.wait(lambda: not app.runner.running("keep"), "keeping")
        place = app.model.place
        assert place is not None
        robot.click("Places")
        robot.wait(lambda: sees(robot, f"More about {NAMES[0]}"), "the list")
        search = robot.find("Search places", QLineEdit)
        search.setFocus()
        robot.write("COURT sun")
        robot.settle()
        assert [sees(robot, f"More about {name}") for name in NAMES] == [False, True, False]
        robot.write(" nowhere")
        robot.settle()
        assert sees(robot, "No places match.")
        search.clear()
        search.textEdited.emit("")
        robot.settle()

        robot.click(f"More about {place.name}")
        (menu,) = (one for one in app.window.findChildren(Menu) if one.isVisible())
        menu.actions()[0].trigger()
        menu.close()
        robot.settle()
        robot.find("Name of the place", QLineEdit).selectAll()
        robot.write("Doorway")
        robot.click("Rename")
        robot.wait(lambda: sees(robot, "More about Doorway"), "the new name")
        robot.wait(lambda: not app.runner.running("keep"), "keeping")
        assert "Doorway" in {one.name for one in list_places(home / "places")}

        line = robot.find("More about Doorway").parentWidget()
        assert isinstance(line, PictureLine)
        robot.click_at(line)
        robot.wait(lambda: not sees(robot, "Search places"), "the place itself")
        assert app.model.place_folder is not None
