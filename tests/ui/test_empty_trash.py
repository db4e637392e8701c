"""Deleted places go for good only after a question that says how many and how large they are."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

from PySide6.QtWidgets import QApplication

from app.core.places.place_folder import create_place
from app.core.places.place_list import delete_place, list_trash
from app.ui.overlays.places import EmptyTrash
from app.ui.shell.start import App
from app.ui.widgets.buttons import Button
from app.ui.widgets.dialogs import Sheet
from tests.helpers.whole_window import opened, say

NOON = datetime(2026, 5, 4, 12, tzinfo=UTC)


def shows(app: App, name: str) -> bool:
    seen = [each for each in app.window.findChildren(Button) if each.isVisibleTo(app.window)]
    return name in {each.accessibleName() for each in seen}


def test_the_trash_is_emptied_from_the_list(qapp: QApplication, tmp_path: Path) -> None:
    places = tmp_path / "home" / "places"
    for _ in range(2):
        delete_place(create_place(places, "Court", NOON))
    with opened(tmp_path / "home", sounds=False) as (app, robot):
        app.commands.ask("places")
        robot.wait(lambda: shows(app, "Empty trash…"), "the trash")
        robot.find("Empty trash…", Button).click()
        robot.settle()
        sheet = Sheet.over(app.window)[-1]
        assert isinstance(sheet, EmptyTrash)
        assert len(list_trash(places)) == 2
        robot.find("Delete", Button).click()
        say(app, robot, "2 places deleted.")
    assert list_trash(places) == ()
