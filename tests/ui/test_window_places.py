"""The list of places in the whole window: searched, opened by its lines, renamed in a sheet."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QLineEdit, QPlainTextEdit
from pytestqt.qtbot import QtBot

from app.core.places.place_folder import create_place
from app.core.places.place_list import list_places
from app.ui.overlays.places import PlacesBody
from app.ui.overlays.spots import SpotsSheet
from app.ui.widgets.buttons import Button
from app.ui.widgets.fields import ListField
from app.ui.widgets.surfaces import Menu, OutlineBox, PictureLine
from tests.helpers.whole_window import SCENE, open_light, opened, sees

NAMES = ("Café, window", "Court, sun", "Court, evening")


def test_places_are_found_opened_and_renamed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, qtbot: QtBot
) -> None:
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
        robot.click("Done")
        robot.wait(lambda: sees(robot, "More about Doorway"), "the new name")
        robot.wait(lambda: not app.runner.running("keep"), "keeping")
        assert "Doorway" in {one.name for one in list_places(home / "places")}

        line = robot.find("More about Doorway").parentWidget()
        assert isinstance(line, PictureLine)
        robot.click_at(line)
        robot.wait(lambda: not sees(robot, "Search places"), "the place itself")
        assert app.model.place_folder is not None


def test_spots_are_picked_compared_and_opened_with_the_style(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, qtbot: QtBot
) -> None:
    home = tmp_path / "home"
    home.mkdir()
    with opened(home) as (app, robot):
        for scene in ("forest", "studio"):
            open_light(app, robot, SCENE.with_stem(scene))
            robot.wait(lambda: not app.runner.running("keep"), "keeping")
        here = app.model.place_folder
        other = next(one for one in list_places(home / "places") if one.folder != here)
        robot.click("Places")
        robot.wait(lambda: sees(robot, "Compare forest"), "the list")
        assert sees(robot, "Today, 2 places")
        robot.click("Compare forest")
        # The day's own button says which day.
        assert not robot.find("Compare 1 spot").isEnabled()
        # Ctrl and a click anywhere on a line picks it, too.
        line = robot.find("More about studio").parentWidget()
        assert isinstance(line, PictureLine)
        held = Qt.KeyboardModifier.ControlModifier
        monkeypatch.setattr(QGuiApplication, "keyboardModifiers", lambda: held)
        robot.click_at(line)
        monkeypatch.undo()
        robot.click("Compare 2 spots")
        robot.wait(lambda: bool(app.window.findChildren(SpotsSheet)), "the comparison")
        robot.wait(lambda: not app.runner.running("spots"), "reading")
        robot.settle()
        (sheet,) = app.window.findChildren(SpotsSheet)
        cards = [one for one in sheet.findChildren(OutlineBox) if "match" in one.accessibleName()]
        assert len(cards) == 2
        assert sum(one.accessibleName().startswith("Best spot. ") for one in cards) == 1
        field = sheet.findChildren(ListField)[0]
        field.choose("right-split")
        field.chosen.emit("right-split")
        robot.settle()
        forest = next(
            one
            for one in sheet.findChildren(Button)
            if one.accessibleName() == "Open forest" and one.isVisible()
        )
        forest.click()
        robot.wait(lambda: app.model.place_folder == other.folder, "the place")
        robot.wait(lambda: not app.runner.running("solve"), "solving")
        assert (app.model.chosen, app.model.step) == ("right-split", "styles")
        assert not sees(robot, "Search places")


def test_tags_and_notes_are_given_in_the_list(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, qtbot: QtBot
) -> None:
    home = tmp_path / "home"
    home.mkdir()
    for name in (*NAMES, "Arcade"):
        create_place(home / "places", name, datetime(2026, 6, 21, 12, tzinfo=UTC))

    with opened(home) as (app, robot):
        robot.click("Places")
        robot.wait(lambda: sees(robot, "More about Arcade"), "the list")
        robot.click("More about Arcade")
        (menu,) = (one for one in robot.window.findChildren(Menu) if one.isVisible())
        menu.actions()[0].trigger()
        menu.close()
        robot.settle()
        robot.find("Tags, separated by commas", QLineEdit).setFocus()
        robot.write("brick, north light")
        robot.find("Notes", QPlainTextEdit).setPlainText("Ask for the key.")
        # However it is closed, what was typed is kept.
        robot.press(Qt.Key.Key_Escape)
        robot.wait(lambda: sees(robot, "Search for north light"), "the tags")
        robot.wait(lambda: not app.runner.running("files"), "keeping")
        robot.wait(lambda: not app.runner.running("places"), "the list")
        robot.settle()
        kept = next(one for one in list_places(home / "places") if one.name == "Arcade")
        assert (kept.tags, kept.notes) == (("brick", "north light"), "Ask for the key.")
        robot.click("Search for brick")
        robot.settle()
        assert [sees(robot, f"More about {name}") for name in (*NAMES, "Arcade")] == [
            False, False, False, True,
        ]  # fmt: skip
        assert sees(robot, "Sunday 21 June, 4 places")


def test_a_long_list_comes_in_small_steps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, qtbot: QtBot
) -> None:
    """No event makes, shows or hides more than a few of 60 lines; arrows walk through them."""
    home = tmp_path / "home"
    home.mkdir()
    for number in range(60):
        when = datetime(2026, 6, 21, 12, tzinfo=UTC) - timedelta(hours=5 * number)
        create_place(home / "places", f"{'odd' if number % 2 else 'even'} {number}", when)
    with opened(home) as (_, robot):
        robot.click("Places")
        robot.wait(lambda: sees(robot, "More about odd 59"), "the list")
        robot.settle()
        (body,) = robot.window.findChildren(PlacesBody)
        counts: list[int] = []
        steps = body._lay_more

        def counted() -> None:
            before = sum(one.isHidden() for one in body.findChildren(PictureLine))
            steps()
            after = sum(one.isHidden() for one in body.findChildren(PictureLine))
            counts.append(abs(after - before))

        body._making.timeout.disconnect()
        body._making.timeout.connect(counted)
        robot.find("Search places", QLineEdit).setFocus()
        robot.write("odd")
        robot.wait(lambda: not body._making.isActive(), "searching")
        assert sum(not one.isHidden() for one in body.findChildren(PictureLine)) == 30
        assert 0 < max(counts) <= 4
        # Tab comes to what is found, never to a line that is hidden.
        robot.find("Search places", QLineEdit).setFocus()
        robot.press(Qt.Key.Key_Tab)
        focused = robot.window.focusWidget()
        assert focused is not None
        assert focused.isVisible()
        assert "odd 1" in focused.accessibleName()
        robot.find("More about odd 1").setFocus()
        robot.press(Qt.Key.Key_Down)
        focused = robot.window.focusWidget()
        assert focused is not None
        assert focused.accessibleName() == "More about odd 3"
