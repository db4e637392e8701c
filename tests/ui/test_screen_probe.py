"""The probe's screen by mouse and keyboard."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QLineEdit, QWidget
from pytestqt.qtbot import QtBot

from app.core.places.place_verdict import place_verdict
from app.ui.screens.probe.capture.capture import Running
from app.ui.screens.probe.capture.notice import DISCONNECTED
from app.ui.screens.probe.screen import BEAT_MS, SLOW_BEAT_MS
from app.ui.screens.probe.screen_view import ProbeScreen
from app.ui.screens.probe.ways import WAYS
from app.ui.theme import apply, set_theme
from app.words.phrases.place_verdict import place_verdict_words
from tests.helpers.probe_screen import SERIAL, Bench, vanish_after, with_lamp

FULL, COMPACT = (1352, 804), (952, 620)


@pytest.fixture(autouse=True)
def quick_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.fsync", lambda handle: None)


def shown(bench: Bench, qtbot: QtBot, compact: bool = False) -> ProbeScreen:
    screen = ProbeScreen(bench.presenter, compact)
    qtbot.addWidget(screen)
    bench.presenter.attach(screen)
    screen.resize(*(COMPACT if compact else FULL))
    screen.show()
    qtbot.waitExposed(screen)
    QApplication.processEvents()  # the panorama sets its height by the width it gets
    return screen


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def click(qtbot: QtBot, widget: QWidget) -> None:
    QTest.mouseClick(widget, Qt.MouseButton.LeftButton)


class TestMarker:
    def test_dragging_it_to_the_right_turns_everything_counter_clockwise(
        self, bench: Bench, qtbot: QtBot
    ) -> None:
        with_lamp(bench, 47.0)
        screen = shown(bench, qtbot)
        panorama = screen.light.panorama
        grip = panorama.grip
        assert grip.text == "Photographer stands here"
        start = grip.rect().center()
        step = panorama.picture_rect.width() // 12
        QTest.mousePress(grip, Qt.MouseButton.LeftButton, pos=start)
        QTest.mouseMove(grip, start + QPoint(step // 2, 0))
        held = grip.mapFrom(panorama, QPoint(panorama.picture_rect.center().x() + step, 300))
        QTest.mouseMove(grip, held)
        assert "clockwise" in grip.text
        assert bench.model.front_deg == 0.0
        here = grip.mapFrom(panorama, QPoint(panorama.picture_rect.center().x() + step, 300))
        QTest.mouseRelease(grip, Qt.MouseButton.LeftButton, pos=here)
        assert bench.model.front_deg == pytest.approx(30.0, abs=1.0)
        assert panorama.marker_deg == pytest.approx(bench.model.front_deg)
        (row,) = bench.presenter.resolve().lamps
        assert row.azimuth == "17°"
        qtbot.waitUntil(lambda: abs(panorama.view.azimuth_deg - bench.model.front_deg) < 0.5)
        bench.services.undo.undo()
        assert bench.model.front_deg == 0.0
        assert panorama.marker_deg == 0.0

    def test_by_keyboard_and_enter_does_not_go_on(self, bench: Bench, qtbot: QtBot) -> None:
        with_lamp(bench, 47.0)
        screen = shown(bench, qtbot)
        # As the window binds it: Enter is the main button's, wherever the focus is.
        shortcut = QShortcut(QKeySequence("Return"), screen)
        shortcut.activated.connect(bench.presenter.main)
        screen.activateWindow()
        screen.take_marker()
        grip = screen.light.panorama.grip
        qtbot.waitUntil(grip.hasFocus)
        QTest.keyClick(grip, Qt.Key.Key_Right, Qt.KeyboardModifier.ShiftModifier)
        QTest.keyClick(grip, Qt.Key.Key_Right)
        QTest.keyClick(grip, Qt.Key.Key_Return)
        assert bench.model.front_deg == pytest.approx(11.0)
        assert bench.model.step == "probe"


class TestTools:
    def test_zoom_layers_and_exposure(self, bench: Bench, qtbot: QtBot) -> None:
        with_lamp(bench, 47.0)
        screen = shown(bench, qtbot)
        tools = screen.light.tools
        click(qtbot, tools.near)
        assert tools.percent.text() == "125%"
        click(qtbot, tools.whole)
        assert tools.percent.text() == "100%"
        assert tools.layers["lamps"].isChecked()
        click(qtbot, tools.layers["lamps"])
        assert not tools.layers["lamps"].isChecked()
        assert "lamps" not in bench.presenter.resolve().layers
        QTest.keyClick(tools.exposure, Qt.Key.Key_Right)
        assert bench.presenter.resolve().exposure_ev == pytest.approx(0.1)
        assert tools.exposure.accessibleDescription() == "+0.1 EV"

    def test_nothing_to_look_at_yet(self, bench: Bench, qtbot: QtBot) -> None:
        screen = shown(bench, qtbot)
        assert not screen.light.tools.near.isEnabled()
        assert "no panorama" in screen.light.tools.near.toolTip()
        click(qtbot, screen.light.start.ways[0])
        assert bench.model.place is not None
        assert screen.light.tools.near.isEnabled()
        assert len(screen.light.lamps.rows) == len(bench.presenter.resolve().lamps) > 0


class TestCapture:
    def test_from_the_big_button_to_the_styles(self, bench: Bench, qtbot: QtBot) -> None:
        bench.presenter.enter()
        screen = shown(bench, qtbot)
        column = screen.camera
        signs: list[str] = []

        def look() -> None:
            assert screen.sign.isVisibleTo(screen)
            signs.append(screen.sign.accessibleName())

        bench.runner.beats.append(look)
        assert column.capture.isVisible()
        click(qtbot, column.capture)
        assert column.styles.hasFocus() or not screen.isActiveWindow()
        assert not screen.sign.isVisibleTo(screen)
        assert signs[0] == "Get ready"
        assert {"5", "1", "Frame 2 of 3"} <= set(signs)
        assert signs[-1] == "You may move"
        assert not column.rough.isVisible()
        assert not column.capture.isVisible()
        assert column.again.isVisible()
        assert len(column.frames.views) == 3
        assert column.banner.isVisible()
        click(qtbot, column.styles)
        assert bench.model.step == "styles"

    def test_cancel(self, bench: Bench, qtbot: QtBot) -> None:
        bench.presenter.enter()
        screen = shown(bench, qtbot)
        pressed: list[bool] = []

        def press() -> None:
            if screen.camera.stop.isVisible() and not pressed:
                pressed.append(True)
                click(qtbot, screen.camera.stop)

        bench.runner.beats.append(press)
        click(qtbot, screen.camera.capture)
        assert pressed
        assert screen.camera.capture.isVisible()
        assert not screen.camera.stop.isVisible()

    def test_trouble_has_its_buttons(self, bench: Bench, qtbot: QtBot) -> None:
        bench.presenter.enter()
        screen = shown(bench, qtbot)
        vanish_after(bench, 2)
        click(qtbot, screen.camera.capture)
        banner = screen.camera.banner
        assert banner.isVisible()
        assert banner.accessibleName().startswith(DISCONNECTED.format(here=2, total=3))
        assert banner.button(1).text() == "Merge these two"
        click(qtbot, banner.button(1))
        assert len(screen.camera.frames.views) == 2

    def test_plan_timer_and_checklist(self, bench: Bench, qtbot: QtBot) -> None:
        screen = shown(bench, qtbot)
        click(qtbot, screen.camera.plan.part("full"))
        assert bench.model.settings.plan == "full"
        click(qtbot, screen.camera.timer.part("10"))
        assert bench.model.settings.self_timer_s == 10
        tile = screen.camera.checks[2]
        QTest.keyClick(tile, Qt.Key.Key_Space)
        assert tile.isChecked()
        assert bench.presenter.resolve().ticked == {"kneel"}


class TestWays:
    def test_each_way_shows_what_it_needs(self, bench: Bench, qtbot: QtBot) -> None:
        bench.presenter.enter()
        screen = shown(bench, qtbot)
        column = screen.camera
        for key in ("film", "ball", "photos", "file", "camera"):
            click(qtbot, column.way.part(key))
            camera = key == "camera"
            assert bench.model.settings.measure_with == key
            assert column.head.isVisible() == camera
            assert column.plan.isVisible() == camera
            assert column.steps.isVisible() != camera
            assert column.mirrored.isVisible() == (key == "film")
            assert column.preview.isVisible() == (key in ("camera", "film"))
            assert column.capture.text() == ("Capture" if camera else WAYS[key].button)

    def test_film_may_be_mirrored(self, bench: Bench, qtbot: QtBot) -> None:
        bench.presenter.enter()
        column = shown(bench, qtbot).camera
        click(qtbot, column.way.part("film"))
        assert not column.mirrored.isChecked()
        click(qtbot, column.mirrored)
        assert bench.model.settings.mirrored
        assert column.mirrored.isChecked()

    def test_files_are_asked_for_without_a_camera(
        self, bench: Bench, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        bench.devices.there = False
        bench.presenter.enter()
        screen = shown(bench, qtbot)
        asked: list[str] = []
        monkeypatch.setattr(screen, "ask_measured", asked.append)
        click(qtbot, screen.camera.way.part("film"))
        assert not screen.camera.panel.isVisible()
        click(qtbot, screen.camera.capture)
        assert asked == ["film"]
        click(qtbot, screen.camera.way.part("camera"))
        assert screen.camera.panel.isVisible()


class TestCamera:
    def test_none_found_and_an_address_typed(self, bench: Bench, qtbot: QtBot) -> None:
        bench.devices.there = False
        bench.presenter.enter()
        screen = shown(bench, qtbot)
        panel = screen.camera.panel
        assert panel.isVisible()
        assert panel.trouble.text().startswith("No camera found.")
        assert not screen.camera.capture.isEnabled()
        QTest.keyClicks(panel.address.edit, "192.168.1.7")
        QTest.keyClick(panel.address.edit, Qt.Key.Key_Return)
        assert "Nothing answers" in panel.address.edit.accessibleDescription()
        panel.address.edit.selectAll()
        QTest.keyClicks(panel.address.edit, "192.168.1.1")
        click(qtbot, panel.ask)
        assert screen.camera.head.title.text() == "RICOH THETA V"
        assert screen.camera.capture.isEnabled()

    def test_a_password_is_typed(self, tmp_path: Path, qtbot: QtBot) -> None:
        user = f"THETAYL{SERIAL}"
        bench = Bench(tmp_path, {"user": user, "password": "12345678"})
        bench.presenter.enter()
        screen = shown(bench, qtbot)
        panel = screen.camera.panel
        assert panel.user.text() == user
        assert panel.password.edit.echoMode() is QLineEdit.EchoMode.Password
        QTest.keyClicks(panel.password.edit, "12345678")
        QTest.keyClick(panel.password.edit, Qt.Key.Key_Return)
        assert not panel.isVisible()
        assert screen.camera.capture.isEnabled()
        assert panel.password.text() == ""


@pytest.mark.parametrize("compact", [False, True])
class TestEverywhere:
    @pytest.mark.slow
    def test_every_control_has_a_name(self, bench: Bench, qtbot: QtBot, compact: bool) -> None:
        bench.presenter.enter()
        bench.presenter.open_demo()
        bench.presenter.cameras.toggle_panel()
        screen = shown(bench, qtbot, compact)
        nameless = [
            type(widget).__name__
            for widget in screen.findChildren(QWidget)
            if isinstance(widget, (QAbstractButton, QLineEdit))
            or widget.focusPolicy() & Qt.FocusPolicy.TabFocus
            if not widget.accessibleName()
        ]
        assert nameless == []

    @pytest.mark.slow
    @pytest.mark.parametrize("theme_name", ["dark", "light", "contrast"])
    def test_nothing_lies_outside_or_over_each_other(
        self, bench: Bench, qtbot: QtBot, compact: bool, theme_name: str
    ) -> None:
        set_theme(theme_name)  # type: ignore[arg-type]
        apply(QApplication.instance())  # type: ignore[arg-type]
        bench.presenter.open_demo()
        screen = shown(bench, qtbot, compact)
        light = screen.light
        foot = light.drop.open_button.parentWidget()
        assert foot is not None
        blocks = [light.tools, light.panorama, light._lower, foot]
        tops = [block.mapTo(screen, QPoint(0, 0)).y() for block in blocks]
        ends = [top + block.height() for top, block in zip(tops, blocks, strict=True)]
        assert all(end <= top for end, top in zip(ends[:-1], tops[1:], strict=True))
        assert ends[-1] <= screen.height()
        assert light.panorama.picture_rect.height() >= (250 if compact else 400)
        for button in (light.drop.open_button, light.drop.watch_button, screen.camera.styles):
            assert button.width() >= button.sizeHint().width()


class TestLivePreview:
    def test_it_is_seen_with_the_best_styles_and_closed_by_its_button(
        self, bench: Bench, qtbot: QtBot
    ) -> None:
        bench.presenter.enter()
        screen = shown(bench, qtbot)
        light, seen = screen.light, []

        def look() -> None:
            live = bench.presenter.resolve().live
            if live is None or live.picture is None:
                return
            assert light.preview.isVisible()
            assert light.rough.isVisible()
            assert not light.tools.near.isEnabled()
            cards = [view for view in light.rough.views if view.isVisible()]
            seen.append([view.accessibleName() for view in cards])
            assert [view.title.text() for view in cards] == [card.title for card in live.cards]
            assert all("rough" in view.note.text() for view in cards)
            assert screen.camera.preview.text() == "Stop the preview"
            click(qtbot, screen.camera.preview)

        bench.runner.beats.append(look)
        click(qtbot, screen.camera.preview)
        assert len(seen) == 1
        assert seen[0]
        assert not light.preview.isVisible()
        assert screen.camera.preview.text() == "Live preview"

    def test_it_says_why_it_cannot(self, bench: Bench, qtbot: QtBot) -> None:
        screen = shown(bench, qtbot)
        assert not screen.camera.preview.isEnabled()
        assert "no camera" in screen.camera.preview.toolTip()


class TestTime:
    def test_it_passes_quickly_only_while_a_capture_is_seen(
        self, bench: Bench, qtbot: QtBot
    ) -> None:
        screen = shown(bench, qtbot)
        beat = screen.findChild(QTimer, options=Qt.FindChildOption.FindDirectChildrenOnly)
        assert beat is not None
        assert (beat.isActive(), beat.interval()) == (True, SLOW_BEAT_MS)
        screen.hide()
        assert not beat.isActive()
        state = bench.presenter.resolve()
        capturing = replace(state, running=Running())
        screen.show_state(capturing)
        # Its chime is heard on every screen.
        assert (beat.isActive(), beat.interval()) == (True, SLOW_BEAT_MS)
        screen.show()
        assert (beat.isActive(), beat.interval()) == (True, BEAT_MS)
        screen.show_state(state)
        assert beat.interval() == SLOW_BEAT_MS
        screen.hide()
        assert not beat.isActive()


def test_verdict_is_shown_once_the_results_are_there(bench: Bench, qtbot: QtBot) -> None:
    screen = shown(bench, qtbot)
    assert not screen.light.verdict.isVisible()
    bench.presenter.open_demo()
    model, light = bench.model, bench.model.light
    assert light is not None
    verdict = place_verdict(model.results, light.searched, model.front_deg)
    assert verdict is not None
    assert screen.light.verdict.isVisible()
    assert screen.light.verdict.text() == place_verdict_words(verdict, model.results)
    before = screen.light.verdict.text()
    bench.presenter.move_marker(model.front_deg + 180.0)
    assert screen.light.verdict.text() != before
