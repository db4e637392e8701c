"""Names from files cannot turn around, or hide, what stands beside them on a screen or a sheet."""

from __future__ import annotations

import os
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QRect
from PySide6.QtGui import QFont, QImage, QPainter
from PySide6.QtWidgets import QLabel, QMenu, QWidget
from pytestqt.qtbot import QtBot

from app.core.base.visible_text import STEERING, visible
from app.core.places.place import clean_name, clean_notes, clean_tags
from app.core.second_light.captured_lamps.captured_lamp import make_lamp
from app.core.second_light.captured_lamps.lamp_library import add_lamp
from app.export.canvas import text_width
from app.ui.presenters.window_model import Step
from app.ui.theme import theme
from app.ui.widgets.buttons import Button
from app.ui.widgets.labels import Text
from app.ui.widgets.paint import put_text
from app.ui.widgets.surfaces import Menu
from tests.helpers.dark_room import phone, room
from tests.helpers.whole_window import SCENE, open_light, opened

TURNED = "photo\u202egpj.exe"
NAMES = [TURNED, "a\u2066b\u2069", "bell\x07\x1b[31m", "line\u2028end", "caf\udce9", "\x9bcsi"]
OVERLAYS = ("places", "settings", "find", "messages")


def steers(text: str) -> bool:
    return any(ord(letter) in STEERING for letter in text)


@pytest.mark.parametrize("name", NAMES)
def test_every_way_onto_the_screen_shows_a_harmless_name(qtbot: QtBot, name: str) -> None:
    host = QWidget()
    qtbot.addWidget(host)
    label, button = Text(name), Button(name)
    qtbot.addWidget(label)
    qtbot.addWidget(button)
    action = Menu(host).add(name, lambda: None, why=name)
    shown = [label.text(), button.text(), button.toolTip(), action.text(), action.toolTip()]
    label.set_text("other")
    label.set_text(name)
    assert not any(map(steers, [*shown, label.text()]))
    assert isinstance(Menu(host), QMenu)


def drawn(text: str) -> bytes:
    image = QImage(300, 40, QImage.Format.Format_RGB32)
    image.fill(0)
    painter = QPainter(image)
    put_text(painter, QRect(0, 0, 300, 40), text, QFont("Inter", 12), theme().c.text)
    painter.end()
    return bytes(image.constBits())


def test_painted_name_does_not_turn_what_follows(qtbot: QtBot) -> None:
    assert drawn(f"{TURNED} 96°") == drawn("photo\ufffdgpj.exe 96°")
    assert text_width(TURNED, 12) == text_width(visible(TURNED), 12)


def test_marks_of_real_scripts_stay_readable() -> None:
    for name in ("שלום.jpg", "صورة.jpg", "ışık", "写真", "👩\u200d👧", "Café"):
        assert visible(name) == name
    assert visible("abc\u200fdef") == "abcdef"


@pytest.mark.parametrize("name", NAMES)
def test_kept_words_of_a_place_have_no_steering_letters(name: str) -> None:
    words = [clean_name(name), *clean_tags([name]), clean_notes(f"one\n{name}")]
    assert not any(map(steers, words))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="such names of files")
def test_no_screen_shows_a_steering_letter(
    qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "home"
    monkeypatch.setenv("TURNLIGHT_HOME", str(home))
    (home / "styles").mkdir(parents=True)
    for number, name in enumerate(NAMES):
        (home / "styles" / f"{name}.toml").write_text(f"title = {number}")
    light, mask = room(phone(0.15, 40.0), 0.05, shape=(64, 128))
    lamp = make_lamp("any", light, mask.astype(np.float32), title="x", distance_m=0.15)
    add_lamp(home / "lamps", replace(lamp, title=TURNED, camera=TURNED))
    files = [tmp_path / f"{name}{end}" for name in NAMES for end in (".exr", ".jpg", ".mp4")]
    for path in files:
        if path.suffix == ".exr":
            shutil.copy(SCENE, path)
        else:
            path.write_bytes(os.urandom(100))
    with opened(home, sounds=False) as (app, robot):
        open_light(app, robot, files[0])

        def look(where: str) -> None:
            robot.settle()
            for widget in app.window.findChildren(QWidget):
                words = [widget.toolTip()]
                words += [widget.text()] if isinstance(widget, QLabel) else []
                assert not any(map(steers, words)), (where, words)

        for path in files[1:]:
            app.commands.open_paths([path])
            robot.wait(lambda: not app.runner.running("open"), "opening")
            look(path.name)
        for step in Step:
            app.model.update(step=step)
            look(step.value)
        for what in OVERLAYS:
            app.commands.ask(what)
            look(what)
            app.commands.close_overlay()
