"""Words from somebody else's files are shown as they are: no markup, no picture that they name."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QColor, QImage
from PySide6.QtWidgets import QApplication, QLabel, QMenu, QToolTip, QWidget
from pytestqt.qtbot import QtBot

from app.core.painting.canvas import from_style
from app.core.painting.user_styles import save_user_style
from app.core.second_light.captured_lamps.captured_lamp import make_lamp
from app.core.second_light.captured_lamps.lamp_library import add_lamp
from app.ui.presenters.window_model import Step
from app.ui.widgets.buttons import Button
from app.ui.widgets.surfaces import Menu
from tests.helpers.dark_room import phone, room
from tests.helpers.styles_screen import head
from tests.helpers.whole_window import SCENE, open_light, opened

WIDE = 640
TITLE = "<img src=wide.png> & <b>x</b>"
OVERLAYS = ("places", "settings", "find", "messages", "help", "manual")


@pytest.fixture(autouse=True)
def picture_at_hand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Put the picture where Qt would find it: beside the program."""
    image = QImage(WIDE, WIDE, QImage.Format.Format_RGB32)
    image.fill(QColor("magenta"))
    assert image.save(str(tmp_path / "wide.png"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TURNLIGHT_HOME", str(tmp_path / "home"))


def shown_tip(words: str, of: QWidget) -> QLabel:
    QToolTip.hideText()
    QToolTip.showText(QPoint(50, 50), words, of)
    tips = [one for one in QApplication.topLevelWidgets() if one.inherits("QTipLabel")]
    tip = next(one for one in tips if one.isVisible())
    assert isinstance(tip, QLabel)
    return tip


def labels(window: QWidget) -> Iterator[QLabel]:
    yield from (one for one in window.findChildren(QLabel) if one.text())


def keep_things(home: Path) -> Path:
    """Keep a style, a lamp and a style that cannot be read; give a panorama to open."""
    one = head()
    canvas = from_style(one.pack, one.transport, "left-rembrandt")
    save_user_style(home / "styles", canvas, TITLE, side="left", head="generic", note=TITLE)
    file_name = TITLE.replace("/", "")
    (home / "styles" / f"{file_name}.toml").write_text("title = <")
    light, mask = room(phone(0.15, 40.0), 0.05, shape=(64, 128))
    lamp = make_lamp("any", light, mask.astype(np.float32), title="x", distance_m=0.15)
    add_lamp(home / "lamps", replace(lamp, title=TITLE, camera=TITLE))
    return Path(shutil.copy(SCENE, home / f"{file_name}.exr"))


@pytest.mark.slow
def test_no_screen_takes_a_title_for_markup(
    qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "home"
    panorama = keep_things(home)
    tips: set[str] = set()
    words: set[str] = set()
    with opened(home, sounds=False) as (app, robot):
        open_light(app, robot, panorama)
        mine = next(style for style in app.model.user_styles if style.title == TITLE)

        def look(where: str) -> None:
            robot.settle()
            for label in labels(app.window):
                assert label.textFormat() is Qt.TextFormat.PlainText, label.text()
                words.update([where] if "<img" in label.text() else [])
            for widget in app.window.findChildren(QWidget):
                tip = widget.toolTip()
                if "<" in tip and tip not in tips:
                    tips.add(tip)
                    seen = shown_tip(tip, widget)
                    assert seen.textFormat() is Qt.TextFormat.PlainText
                    assert seen.height() < WIDE / 2

        def has_rows() -> bool:
            return any("More about <" in w.toolTip() for w in app.window.findChildren(QWidget))

        for step in Step:
            app.model.update(step=step)
            app.model.choose(mine.name)
            robot.wait(lambda: not app.runner.running("solve"), "solving")
            look(step.value)
        app.model.update(step=Step.STYLES, painting=mine.name)
        look("paint")
        for what in OVERLAYS:
            app.commands.ask(what)
            if what == "places":  # read in the background
                robot.wait(has_rows, "the list of places")
            look(what)
            app.commands.close_overlay()
    # It was there to be seen.
    assert {"turn", "light", "places", "messages"} <= words
    assert len(tips) >= 2


def test_qt_left_to_itself_would_open_the_picture(qtbot: QtBot) -> None:
    label = QLabel(TITLE)
    qtbot.addWidget(label)
    assert label.sizeHint().height() >= WIDE


def test_a_tip_shows_the_title_as_it_is(qtbot: QtBot) -> None:
    widget = QWidget()
    qtbot.addWidget(widget)
    widget.show()
    tip = shown_tip(TITLE, widget)
    assert tip.text() == TITLE
    assert tip.height() < WIDE / 2
    magenta = QColor("magenta").rgb()
    seen = tip.grab().toImage()
    assert not any(
        seen.pixel(x, y) == magenta for x in range(seen.width()) for y in range(seen.height())
    )
    QToolTip.hideText()


def test_an_ampersand_in_a_menu_or_on_a_button_is_a_letter(qtbot: QtBot) -> None:
    host = QWidget()
    qtbot.addWidget(host)
    menu = Menu(host)
    action = menu.add("Tom & &Jerry\t<b>", lambda: None, shortcut="Ctrl J", why=TITLE)
    assert action.text() == "Tom && &&Jerry <b>\tCtrl J"
    assert isinstance(menu, QMenu)
    button = Button("Light by &Tom")
    qtbot.addWidget(button)
    assert button.text() == "Light by &Tom"
    assert button.shortcut().isEmpty()
    button.set_text("&New")
    assert button.shortcut().isEmpty()
