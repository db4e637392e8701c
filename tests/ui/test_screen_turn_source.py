"""The sheet in which the live camera is chosen: by mouse and by keys."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest
from PySide6.QtCore import QCoreApplication, Qt
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog, QLineEdit, QWidget
from pytestqt.qtbot import QtBot

from app.devices.webcam import LiveSource, WebcamError, WebcamState
from app.ui.screens.turn.live.source_view import NO_VIDEO, SourceSheet
from app.ui.theme import apply, set_theme
from tests.unit.test_presenter_turn_sources import PHONE, Rig, shot

ROOM: Final = (1024, 700)


class Shown:
    """A sheet over an empty window, with the picker's rig behind it."""

    def __init__(self, qtbot: QtBot, **settings: object) -> None:
        self.qtbot = qtbot
        self.rig = Rig(**settings)  # type: ignore[arg-type]
        self.rig.camera.start()
        self.host = QWidget()
        self.host.resize(*ROOM)
        qtbot.addWidget(self.host)
        self.host.show()
        self.sheet = SourceSheet(self.host, self.rig.presenter)
        self.sheet.open()
        qtbot.waitExposed(self.host)

    def press(self, widget: QWidget) -> None:
        QTest.mouseClick(widget, Qt.MouseButton.LeftButton)

    def key(self, key: Qt.Key) -> None:
        QTest.keyClick(self.host.focusWidget(), key)

    def choose(self, key: str) -> None:
        self.sheet.source.choose(key)
        self.sheet.source.chosen.emit(key)

    def tick(self) -> None:
        self.rig.clock.sleep(1.0)
        self.rig.camera.tick()
        self.rig.presenter.tick()
        # What appeared gets its place.
        QCoreApplication.processEvents()


@pytest.fixture
def shown(qtbot: QtBot) -> Shown:
    return Shown(qtbot)


def test_it_opens_on_the_list_with_the_names(shown: Shown) -> None:
    assert shown.host.focusWidget() is shown.sheet.source.box
    assert shown.sheet.source.box.accessibleName() == "Camera: Camera 0"
    assert shown.sheet.network.isHidden()
    assert shown.sheet.files.isHidden()
    assert shown.sheet.lens.isVisible()
    shown.key(Qt.Key.Key_Down)
    assert shown.rig.camera.chosen == LiveSource.webcam(1)
    assert shown.sheet.source.box.accessibleName() == "Camera: Camera 1"


def test_a_network_camera_by_keys(shown: Shown) -> None:
    shown.key(Qt.Key.Key_Down)
    shown.key(Qt.Key.Key_Down)
    assert shown.sheet.source.key == "network"
    field = shown.sheet.network.address
    assert field.edit.hasFocus()
    assert shown.sheet.lens.isHidden(), "what is shown is not yet in use"
    QTest.keyClicks(field.edit, "ftp://10.0.0.7/x")
    shown.key(Qt.Key.Key_Return)
    assert "“ftp” cannot be used" in field.edit.accessibleDescription()
    assert not shown.rig.made
    field.edit.selectAll()
    QTest.keyClicks(field.edit, PHONE)
    shown.tick()
    assert field.text() == PHONE, "what is being typed stays"
    shown.key(Qt.Key.Key_Return)
    assert shown.rig.made[0][0] == LiveSource.network(PHONE)
    assert field.edit.accessibleDescription() == ""
    assert shown.sheet.lens.isVisible()
    shown.rig.others[-1].send(shot())
    shown.tick()
    assert re.findall("[0-9]+", shown.sheet.status) == ["128", "72", "24"]


def test_the_password_appears_when_it_is_wanted(shown: Shown) -> None:
    shown.choose("network")
    part = shown.sheet.network
    part.address.set_text(PHONE)
    shown.press(part.connect_to)
    assert not part.password.isVisible()
    shown.rig.others[-1].error = WebcamError("It wants a password.", "Type it.", "password")
    shown.rig.others[-1].state = WebcamState.RETRYING
    shown.tick()
    assert part.password.isVisible()
    assert part.password.edit.echoMode() is QLineEdit.EchoMode.Password
    assert "keyring" in part.hint.text()
    shown.press(part.give)
    assert "both" in part.password.edit.accessibleDescription()
    QTest.keyClicks(part.user.edit, "anna")
    QTest.keyClicks(part.password.edit, "geheim")
    QTest.keyClick(part.password.edit, Qt.Key.Key_Return)
    assert shown.rig.made[-1][2]().password == "geheim"
    assert not part.password.isVisible()
    assert part.password.text() == ""


def test_a_video_is_chosen_in_a_dialog(
    shown: Shown, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown.choose("video")
    files = shown.sheet.files
    assert files.name.text() == NO_VIDEO
    assert "in a loop" in files.how.text()
    asked: list[tuple[object, ...]] = []
    names = ["", str(tmp_path / "missing.mp4")]

    def ask_file(*given: object) -> tuple[str, str]:
        asked.append(given)
        return names[len(asked) - 1], ""

    monkeypatch.setattr(QFileDialog, "getOpenFileName", ask_file)
    shown.press(files.choose)
    assert not files.trouble.isVisible()
    shown.press(files.choose)
    assert "missing.mp4" in files.trouble.text()
    assert "*.mp4" in str(asked[0][-1])


def test_the_field_of_view(shown: Shown) -> None:
    lens = shown.sheet.lens
    assert lens.how.key == "estimate"
    assert not lens.angle.isVisible()
    shown.rig.camera.learn_fov(72.0)
    shown.tick()
    assert lens.words.text() == "72° so far"
    shown.press(lens.how.part("set"))
    assert lens.angle.isVisible()
    assert lens.angle.amount == 72.0
    assert shown.rig.camera.fov_deg == 72.0
    lens.angle.setFocus()
    shown.key(Qt.Key.Key_Right)
    assert shown.rig.camera.fov_deg == 73.0
    shown.press(lens.how.part("estimate"))
    assert shown.rig.camera.fov_deg is None


def test_the_resolution(shown: Shown) -> None:
    field = shown.sheet.lens.resolution
    assert field.key == "0"
    field.box.setFocus()
    shown.key(Qt.Key.Key_Down)
    assert shown.rig.camera.view.width == 640
    assert field.box.accessibleName() == "Resolution: 640 × 480"


def test_one_that_knows_its_field_of_view_is_not_asked(shown: Shown) -> None:
    shown.rig.webcams[0].fov_deg = 60.0
    shown.tick()
    assert shown.sheet.lens.width_text.text().startswith("60°")
    assert not shown.sheet.lens.how.isVisible()


def test_esc_closes_it_and_nothing_is_shown_any_more(shown: Shown) -> None:
    shown.choose("network")
    shown.sheet.network.address.edit.setFocus()
    shown.key(Qt.Key.Key_Escape)
    assert shown.sheet.isHidden()
    before = shown.sheet.status
    shown.rig.webcams[0].send(shot())
    shown.tick()
    assert shown.sheet.status == before


def test_it_may_be_destroyed_while_it_is_open(shown: Shown) -> None:
    shown.sheet.deleteLater()
    shown.qtbot.waitUntil(lambda: shown.rig.presenter._view is None)
    shown.tick()


def test_everything_has_a_name(shown: Shown) -> None:
    shown.choose("network")
    shown.rig.presenter.connect(PHONE)
    for widget in shown.sheet.findChildren(QWidget):
        if widget.focusPolicy() & Qt.FocusPolicy.TabFocus and widget.isVisible():
            assert widget.accessibleName(), widget


@pytest.mark.parametrize("name", ["dark", "light", "contrast"])
@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_it_fits_in_every_theme(
    qtbot: QtBot,
    qapp: object,
    name: str,
    scale: float,
    picture_of: Callable[[QWidget, float], QImage],
    tmp_path: Path,
) -> None:
    set_theme(name, scale)  # type: ignore[arg-type]
    apply(qapp)  # type: ignore[arg-type]
    shown = Shown(qtbot)
    shown.choose("network")
    shown.rig.presenter.connect(PHONE)
    shown.rig.presenter.estimate(False)
    shown.rig.others[-1].error = WebcamError("It wants a password.", "Type it.", "password")
    shown.tick()
    qtbot.wait(50)
    image = picture_of(shown.host, 1.0)
    assert image.save(str(tmp_path / "sheet.png"))
    bar = shown.sheet._scroll.verticalScrollBar()
    assert (bar.maximum() == 0) == (scale == 1.0), "only what does not fit is scrolled"
    for field in (shown.sheet.network.address, shown.sheet.network.password):
        assert field.height() >= field.minimumSizeHint().height(), "nothing is squeezed"
    shown.sheet.network.give.setFocus()
    for _ in range(3):
        shown.sheet.focusNextPrevChild(True)
        focus = shown.host.focusWidget()
        assert focus is not None
        if shown.sheet._scroll.isAncestorOf(focus):
            place = focus.mapTo(shown.sheet._scroll, focus.rect().center())
            assert shown.sheet._scroll.rect().contains(place), "Tab scrolls to where it goes"


@pytest.mark.parametrize("key", ["network", "video", "webcam:0"])
def test_every_kind_is_all_in_sight(shown: Shown, key: str) -> None:
    shown.choose(key)
    shown.tick()
    QCoreApplication.processEvents()
    content = shown.sheet._scroll.widget()
    assert content is not None
    assert shown.sheet._scroll.height() >= content.sizeHint().height()
    assert shown.sheet.source.visibleRegion().boundingRect().height() == shown.sheet.source.height()
