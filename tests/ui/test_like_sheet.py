"""The sheet that makes a style of a photograph, with mouse and keys."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from app.ui.screens.styles.like_photo_view import LikeSheet
from tests.helpers.styles_screen import Table, lamp_light
from tests.ui.test_screen_styles import Shown
from tests.unit.test_faces import Bytes, portrait, shown_in

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture(params=[False, True], ids=["wide", "compact"])
def shown(qtbot: QtBot, tmp_path: Path, request: pytest.FixtureRequest) -> Shown:
    return Shown(qtbot, Table(tmp_path).open(lamp_light(0.0)), compact=request.param)


def dropped(shown: Shown, picture: Bytes) -> LikeSheet:
    path = shown.table.folder / "Anna.png"
    assert cv2.imwrite(str(path), np.ascontiguousarray(picture[..., ::-1]))
    shown.table.presenter.like.take([path])
    shown.settle()
    sheet = shown.view.sheet
    assert isinstance(sheet, LikeSheet)
    return sheet


def test_all_of_it_is_within_the_window(shown: Shown) -> None:
    sheet = dropped(shown, portrait("generic", 50.0, 40.0))
    panel = sheet._panel
    assert shown.view.rect().contains(panel.geometry())
    for part in (sheet._photo, sheet._face, sheet._head, sheet._lamps, sheet._save):
        assert panel.rect().contains(part.mapTo(panel, part.rect().bottomRight()))
    assert sheet._lamps.accessibleName()
    assert sheet._head.size() == sheet._face.size()


def test_the_key_is_dragged_and_saved(shown: Shown) -> None:
    sheet = dropped(shown, portrait("generic", 50.0, 40.0))
    before, like = sheet._note.text(), shown.table.presenter.like
    place = sheet._lamps.place_of(-60.0, 20.0)
    QTest.mouseClick(sheet._lamps, LEFT, pos=QPoint(round(place[0]), round(place[1])))
    shown.settle()
    assert like.state is not None
    assert like.state.azimuth_deg == pytest.approx(-60, abs=2)
    assert "right" in sheet._note.text()
    QTest.keyClick(sheet._lamps, Qt.Key.Key_Home)
    assert sheet._note.text() == before
    QTest.mouseClick(sheet._ratio.part("4"), LEFT)
    assert "4:1" in sheet._note.text()
    assert sheet._lamps.fill
    QTest.mouseClick(sheet._save, LEFT)
    shown.settle()
    assert shown.view.sheet is None
    (style,) = shown.table.model.user_styles
    assert style.title == "Like Anna"
    assert shown.chosen == style.name


def test_what_is_refused_cannot_be_saved(shown: Shown) -> None:
    sheet = dropped(shown, shown_in("generic", np.ones((64, 128, 3), np.float32)))
    assert "flat" in sheet._trouble.text()
    assert not sheet._save.isEnabled()
    assert not sheet._controls.isVisible()


def test_a_click_on_another_face_reads_it(shown: Shown) -> None:
    both = np.full((700, 1280, 3), 110, np.uint8)
    both[60:, :640] = portrait("generic", 50.0, 40.0)
    both[60:, 640:] = portrait("male", -60.0, 30.0)
    sheet = dropped(shown, both)
    like = shown.table.presenter.like
    assert like.state is not None
    chosen = like.state.chosen
    faces = like.state.faces
    other = faces[1 - chosen].box
    side = sheet._photo.width()
    middle = QPoint(
        round((other[0] + other[2]) / 2 / 1280 * side),
        round((290 + (other[1] + other[3]) / 2) / 1280 * side),
    )
    QTest.mouseClick(sheet._photo, LEFT, pos=middle)
    shown.settle()
    assert like.state.chosen == 1 - chosen
