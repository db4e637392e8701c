"""The Paint screen: strokes by mouse, pen and keyboard, what is seen, and what is said."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import (
    QImage,
    QKeyEvent,
    QKeySequence,
    QPointingDevice,
    QShortcut,
    QTabletEvent,
    QWheelEvent,
)
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QLineEdit, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from app.core.painting.canvas import Canvas
from app.core.painting.draft_file import load_draft
from app.core.painting.stroke import Tool
from app.core.portrait.head import Head
from app.core.solver.transport import load_named
from app.core.styles.style_pack_file import load_named_pack
from app.ui.plots.match_circle import PolarPlot
from app.ui.plots.weights import WeightPanorama
from app.ui.presenters.window_model import NO_LIGHT
from app.ui.screens.paint import face_view as face_module
from app.ui.screens.paint.canvas import CanvasMode
from app.ui.screens.paint.face_view import SITTERS_LEFT, SITTERS_RIGHT
from app.ui.screens.paint.screen_view import PaintScreen
from app.ui.screens.paint.tools_view import ToolColumn, ToolStrip
from app.ui.shell.jobs import QtRunner
from app.ui.theme import apply, set_theme
from app.ui.widgets.dialogs import LineSheet
from app.ui.widgets.paint import draw_tag
from tests.helpers.paint_studio import Studio, studio

LEFT, MIDDLE = Qt.MouseButton.LeftButton, Qt.MouseButton.MiddleButton
PLAIN = Qt.KeyboardModifier.NoModifier


class Booth:
    """A window with the Paint screen in it."""

    def __init__(
        self,
        qtbot: QtBot,
        home: Path,
        key: str = "",
        compact: bool = False,
        lamp_deg: float | None = 0.0,
    ) -> None:
        self.room: Studio = studio(home, lamp_deg)
        self.presenter = self.room.presenter
        self.window = QWidget()
        self.window.resize(*((952, 620) if compact else (1352, 804)))
        self.screen = PaintScreen(self.presenter, compact)
        column = QVBoxLayout(self.window)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.screen)
        qtbot.addWidget(self.window)
        self.presenter.attach(self.screen)
        self.room.enter(key)
        self.window.show()
        self.window.activateWindow()
        qtbot.waitUntil(self.window.isActiveWindow)
        self.face = self.screen.canvas

    @property
    def canvas(self) -> Canvas:
        """What is painted."""
        canvas = self.presenter.canvas
        assert canvas is not None
        return canvas

    def at(self, x: float, y: float) -> QPoint:
        """Where a share of the canvas lies on the screen."""
        return self.face.at(x * self.canvas.size, y * self.canvas.size).toPoint()

    def drag(self, *places: tuple[float, float], button: Qt.MouseButton = LEFT) -> None:
        """Press, move and release the mouse."""
        first, *rest = [self.at(*place) for place in places]
        QTest.mousePress(self.face, button, PLAIN, first)
        for place in rest:
            QTest.mouseMove(self.face, place)
        QTest.mouseRelease(self.face, button, PLAIN, self.at(*places[-1]))

    def spot(self, x: float, y: float) -> float:
        """Weight at a share of the canvas."""
        size = self.canvas.size
        return float(self.canvas.weights[int(y * size), int(x * size)])


@pytest.fixture
def booth(qtbot: QtBot, tmp_path: Path) -> Booth:
    return Booth(qtbot, tmp_path)


def test_mouse_paints_where_it_is(booth: Booth) -> None:
    booth.presenter.tools.change(strength=1.0)
    booth.drag((0.3, 0.4), (0.3, 0.5), (0.4, 0.5))
    assert booth.spot(0.3, 0.45) == pytest.approx(1.0, abs=1e-3)
    assert booth.spot(0.35, 0.5) == pytest.approx(1.0, abs=1e-3)
    assert booth.spot(0.7, 0.5) == 0.0
    assert booth.room.services.undo.undo_words.startswith("stroke on ")


def test_left_half_of_the_picture_is_the_sitters_right_and_says_so(
    booth: Booth, monkeypatch: pytest.MonkeyPatch
) -> None:
    tags: dict[str, float] = {}
    plain = draw_tag

    def noted(painter: Any, x: float, y: float, text: str, anchor: Any) -> Any:
        tags[text] = x
        return plain(painter, x, y, text, anchor)

    monkeypatch.setattr(face_module, "draw_tag", noted)
    booth.face.grab()
    middle = booth.face.width() / 2
    assert tags[SITTERS_RIGHT] < middle < tags[SITTERS_LEFT]
    # Brighter on the side called the sitter's left: they turn clockwise from a lamp in front.
    booth.presenter.tools.change(strength=1.0)
    booth.drag((0.7, 0.3), (0.7, 0.6))
    booth.presenter.tools.change(tool=Tool.DARKER)
    booth.drag((0.3, 0.3), (0.3, 0.6))
    live = booth.presenter.resolve().live
    assert (live.direction, live.turn_deg > 30) == ("clockwise", True)


def test_strokes_are_seen_in_orange_and_blue_and_ignored_areas_hatched(
    booth: Booth, picture_of: Callable[[QWidget, float], QImage]
) -> None:
    def colour(x: float, y: float) -> tuple[int, int, int]:
        image = picture_of(booth.face, 1.0)
        pixel = image.pixelColor(booth.at(x, y))
        return pixel.red(), pixel.green(), pixel.blue()

    red, green, blue = colour(0.3, 0.5)
    assert max(red, green, blue) - min(red, green, blue) <= 3
    booth.presenter.tools.change(strength=1.0)
    booth.presenter.tools.change(mirror=True)
    booth.drag((0.3, 0.5), (0.35, 0.5))
    for x in (0.3, 0.7):
        red, green, blue = colour(x, 0.5)
        assert red > green > blue
    booth.presenter.tools.change(tool=Tool.DARKER)
    booth.drag((0.3, 0.5), (0.35, 0.5))
    red, green, blue = colour(0.3, 0.5)
    assert blue > green > red
    booth.presenter.tools.change(tool=Tool.IGNORE)
    booth.drag((0.3, 0.5), (0.35, 0.5))
    image = picture_of(booth.face, 1.0)
    here = booth.at(0.3, 0.5)
    row = [image.pixelColor(here + QPoint(dx, 0)).value() for dx in range(-12, 13)]
    assert max(row) - min(row) > 60  # lines, no flat grey


def test_only_what_changed_is_coloured_anew_and_exactly(booth: Booth) -> None:
    """The buffer that followed the brush equals one that is made from nothing."""
    for tool in Tool:
        booth.presenter.tools.change(tool=tool)
        booth.drag((0.2 + 0.1 * len(tool) / 8, 0.4), (0.5, 0.5), (0.6, 0.3))
    booth.room.services.undo.undo()
    colours = booth.face._face._colours
    followed = colours.pixels.copy(), colours.ignored.copy()
    colours.show_weights(booth.canvas)
    np.testing.assert_array_equal(followed[0], colours.pixels)
    np.testing.assert_array_equal(followed[1], colours.ignored)


def test_paint_on_a_turned_head_lies_on_the_same_skin_from_the_front(booth: Booth) -> None:
    head = Head("generic", load_named_pack("generic"), load_named("generic"))
    booth.room.model.update(head=head)
    booth.presenter.tools.change(strength=1.0)
    booth.presenter.look.turn_head(2)
    assert booth.face.accessibleName() == "Canvas, the head turned 30° to its left"
    booth.presenter.tools.change(diameter=12)
    before = booth.face._face._colours.pixels.copy()
    # Their right eye, where the two pictures show it.
    aside, front = (0.585, 0.415), (0.378, 0.415)
    booth.drag(aside, aside)
    changed = np.argwhere(before != booth.face._face._colours.pixels).mean(axis=0)
    size = booth.canvas.size
    np.testing.assert_allclose(changed[::-1] / size, aside, atol=0.01)
    painted = np.argwhere(booth.canvas.weights > 0.5).mean(axis=0)
    np.testing.assert_allclose(painted[::-1] / size, front, atol=0.02)
    # Behind the ear the front shows nothing that could be painted on.
    kept = booth.canvas.weights.copy()
    booth.drag((0.24, 0.4), (0.25, 0.4))
    np.testing.assert_array_equal(booth.canvas.weights, kept)


def test_moves_of_one_frame_are_taken_together(booth: Booth, qtbot: QtBot) -> None:
    told: list[list[tuple[float, float, float]]] = []
    booth.face.drawn.connect(told.append)
    QTest.mousePress(booth.face, LEFT, PLAIN, booth.at(0.3, 0.4))
    for x in np.linspace(0.3, 0.6, 7):
        QApplication.sendEvent(booth.face, _mouse_move(booth, booth.at(float(x), 0.4)))
    assert told == []
    qtbot.waitUntil(lambda: bool(told))
    # Seven moves, and before them the place where the pen came down.
    assert [len(points) for points in told] == [8]
    QTest.mouseRelease(booth.face, LEFT, PLAIN, booth.at(0.6, 0.4))
    assert booth.spot(0.45, 0.4) > 0


def test_pen_pressure_counts_and_its_other_end_restores(booth: Booth) -> None:
    booth.presenter.tools.change(strength=1.0)
    _pen(booth, (0.4, 0.4), 0.25)
    assert booth.spot(0.4, 0.4) == pytest.approx(0.25, abs=0.02)
    booth.presenter.tools.change(pen_pressure=False)
    _pen(booth, (0.6, 0.4), 0.25)
    assert booth.spot(0.6, 0.4) == pytest.approx(1.0, abs=1e-3)
    _pen(booth, (0.6, 0.4), 1.0, QPointingDevice.PointerType.Eraser)
    assert booth.spot(0.6, 0.4) == pytest.approx(0.0, abs=1e-3)


def test_keyboard_moves_the_brush_and_paints_dabs(booth: Booth) -> None:
    face = booth.face
    face.setFocus()
    booth.presenter.tools.change(strength=1.0)
    QTest.keyClick(face, Qt.Key.Key_Return)
    first = np.argwhere(booth.canvas.weights > 0.99).mean(axis=0)
    booth.room.services.undo.undo()
    for _ in range(3):
        QTest.keyClick(face, Qt.Key.Key_Right, Qt.KeyboardModifier.ShiftModifier)
    QTest.keyClick(face, Qt.Key.Key_Up)
    QTest.keyClick(face, Qt.Key.Key_Space)
    second = np.argwhere(booth.canvas.weights > 0.99).mean(axis=0)
    np.testing.assert_allclose(second - first, (-1, 30), atol=1.0)
    assert "brighter, 64 px" in face.accessibleDescription()
    assert "% from the left" in face.accessibleDescription()


def test_brush_never_leaves_what_is_seen(booth: Booth) -> None:
    face = booth.face
    face.setFocus()
    for _ in range(6):
        QTest.keyClick(face, Qt.Key.Key_Plus)
    for _ in range(60):
        QTest.keyClick(face, Qt.Key.Key_Left, Qt.KeyboardModifier.ShiftModifier)
    assert face._ring is not None
    assert face.rect().contains(face._ring.toPoint())


def test_enter_paints_on_the_canvas_even_where_it_is_a_shortcut(booth: Booth) -> None:
    taken: list[bool] = []
    shortcut = QShortcut(QKeySequence("Return"), booth.window)
    shortcut.activated.connect(lambda: taken.append(True))
    booth.face.setFocus()
    QTest.keyClick(booth.face, Qt.Key.Key_Return)
    assert booth.canvas.touched
    assert taken == []


def test_wheel_zooms_around_the_pointer(booth: Booth) -> None:
    face, here = booth.face, QPointF(200.0, 300.0)
    before = face.viewing.to_canvas(here.x(), here.y())
    zoom = face.viewing.zoom
    wheel = QWheelEvent(
        here, face.mapToGlobal(here), QPoint(), QPoint(0, 120), Qt.MouseButton.NoButton, PLAIN,
        Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(face, wheel)
    assert face.viewing.zoom == pytest.approx(1.2 * zoom)
    assert face.viewing.to_canvas(here.x(), here.y()) == pytest.approx(before)
    QTest.keyClick(face, Qt.Key.Key_0)
    assert face.viewing.zoom == zoom


@pytest.mark.parametrize("how", ["middle", "space"])
def test_panning_moves_the_canvas_and_paints_nothing(booth: Booth, how: str) -> None:
    face = booth.face
    face.setFocus()
    before = booth.at(0.5, 0.5)
    if how == "space":
        QTest.keyPress(face, Qt.Key.Key_Space)
    button = MIDDLE if how == "middle" else LEFT
    start = QPoint(300, 300)
    QTest.mousePress(face, button, PLAIN, start)
    QTest.mouseMove(face, start + QPoint(25, -10))
    QTest.mouseRelease(face, button, PLAIN, start + QPoint(25, -10))
    if how == "space":
        QTest.keyRelease(face, Qt.Key.Key_Space)
    assert booth.at(0.5, 0.5) - before == QPoint(25, -10)
    assert not booth.canvas.touched


def test_head_fits_again_when_the_window_changes(booth: Booth) -> None:
    small = booth.face.viewing.zoom
    booth.window.resize(1900, 1200)
    QApplication.processEvents()
    assert booth.face.viewing.zoom > small


def test_target_and_here_take_the_place_of_the_weights(booth: Booth) -> None:
    booth.presenter.tools.change(strength=1.0)
    booth.drag((0.7, 0.3), (0.7, 0.6))
    weights = booth.face.grab().toImage()
    booth.presenter.look.show(CanvasMode.TARGET)
    target = booth.face.grab().toImage()
    assert target != weights
    # Strokes go on while the target is shown, and show in it.
    booth.presenter.tools.change(tool=Tool.DARKER)
    booth.drag((0.3, 0.3), (0.3, 0.6))
    assert booth.face.grab().toImage() != target
    booth.presenter.look.show(CanvasMode.WEIGHTS)
    assert booth.spot(0.3, 0.45) < 0
    colours = booth.face._face._colours
    followed = colours.pixels.copy()
    colours.show_weights(booth.canvas)
    np.testing.assert_array_equal(followed, colours.pixels)


def test_tools_are_one_stop_and_arrows_choose(booth: Booth) -> None:
    buttons = {
        one.text(): one for one in booth.screen.tools.findChildren(QAbstractButton) if one.text()
    }
    buttons["Brighter"].setFocus()
    QTest.keyClick(buttons["Brighter"], Qt.Key.Key_Down)
    assert booth.presenter.tools.brush.tool == "darker"
    stops = [
        name
        for name in ("Brighter", "Darker", "Ignore", "Restore")
        if buttons[name].focusPolicy() & Qt.FocusPolicy.TabFocus
    ]
    assert stops == ["Darker"]
    QTest.mouseClick(buttons["Restore"], LEFT)
    assert booth.presenter.tools.brush.tool == "restore"


@pytest.mark.parametrize("compact", [False, True])
def test_every_control_has_a_name_and_stays_inside(
    qtbot: QtBot, tmp_path: Path, compact: bool
) -> None:
    booth = Booth(qtbot, tmp_path, "left-split", compact)
    nameless = [
        type(one).__name__
        for one in booth.screen.findChildren(QWidget)
        if one.focusPolicy() != Qt.FocusPolicy.NoFocus
        and one.isVisibleTo(booth.screen)
        and not one.accessibleName()
    ]
    assert nameless == []
    whole = booth.screen.rect()
    for one in booth.screen.findChildren(QAbstractButton):
        if one.isVisibleTo(booth.screen):
            corner = one.mapTo(booth.screen, QPoint(0, 0))
            assert whole.contains(corner), one.accessibleName()
            assert whole.contains(corner + QPoint(one.width() - 1, one.height() - 1))


def test_narrow_windows_have_icons_and_no_plot(qtbot: QtBot, tmp_path: Path) -> None:
    wide = Booth(qtbot, tmp_path)
    narrow = Booth(qtbot, tmp_path / "narrow", compact=True)
    assert isinstance(wide.screen.tools, ToolColumn)
    assert isinstance(narrow.screen.tools, ToolStrip)
    assert (wide.screen.tools.width(), wide.screen.live.width()) == (232, 392)
    assert (narrow.screen.tools.width(), narrow.screen.live.width()) == (64, 296)
    assert (wide.face.width(), abs(wide.face.height() - 676) <= 2) == (680, True)
    assert wide.screen.findChildren(PolarPlot)
    assert not narrow.screen.findChildren(PolarPlot)
    for booth in (wide, narrow):
        booth.presenter.tools.change(diameter=100)
        assert booth.screen.tools.sliders._sliders["diameter"][0].amount == 100


def test_saving_asks_for_a_name_and_takes_enter(qtbot: QtBot, tmp_path: Path) -> None:
    booth = Booth(qtbot, tmp_path, "left-split")
    save = booth.screen.live._save
    assert (save.isEnabled(), save.toolTip()) == (False, "Nothing painted yet")
    booth.drag((0.3, 0.3), (0.6, 0.6))
    assert save.isEnabled()
    taken: list[str] = []
    for keys in ("Return", "B", "Escape"):
        shortcut = QShortcut(QKeySequence(keys), booth.window)
        shortcut.activated.connect(lambda keys=keys: taken.append(keys))
    QTest.mouseClick(save, LEFT)
    sheet = booth.window.findChild(LineSheet)
    assert sheet is not None
    line = sheet.findChild(QLineEdit)
    assert line is not None
    assert (line.text(), line.hasFocus()) == ("My Split", True)
    line.clear()
    QTest.keyClick(line, Qt.Key.Key_Return)
    assert "Enter a name" in line.accessibleDescription()
    QTest.keyClicks(line, "Bright")
    QTest.keyClick(line, Qt.Key.Key_Return)
    assert [one.title for one in booth.room.model.user_styles] == ["Bright"]
    assert not sheet.isVisible()
    assert taken == []
    assert booth.screen.crumbs._title.text() == "Bright"


def test_escape_in_the_sheet_closes_the_sheet_alone(qtbot: QtBot, tmp_path: Path) -> None:
    booth = Booth(qtbot, tmp_path, "left-split")
    booth.presenter.files.ask_rename()
    sheet = booth.window.findChild(LineSheet)
    assert sheet is not None
    left: list[bool] = []
    shortcut = QShortcut(QKeySequence("Escape"), booth.window)
    shortcut.activated.connect(lambda: left.append(True))
    line = sheet.findChild(QLineEdit)
    assert line is not None
    QTest.keyClick(line, Qt.Key.Key_Escape)
    assert (sheet.isVisible(), left) == (False, [])
    booth.presenter.files.ask_rename()
    assert any(one.isVisible() for one in booth.window.findChildren(LineSheet))


def test_without_light_the_column_says_so_and_leads_to_probe(qtbot: QtBot, tmp_path: Path) -> None:
    booth = Booth(qtbot, tmp_path, "left-split", lamp_deg=None)
    buttons = [
        one
        for one in booth.screen.live.findChildren(QAbstractButton)
        if one.isVisible() and one.text() == "Go to Probe"
    ]
    assert booth.screen.live._numbers._sentence.text() == NO_LIGHT
    panorama = booth.screen.live.findChild(WeightPanorama)
    assert panorama is not None
    assert not panorama.isVisible()
    booth.drag((0.3, 0.3), (0.6, 0.6))
    assert booth.canvas.touched
    QTest.mouseClick(buttons[0], LEFT)
    assert booth.room.model.step == "probe"


@pytest.mark.parametrize("theme", ["dark", "light", "contrast"])
@pytest.mark.parametrize("ratio", [1.0, 2.0])
def test_outline_of_the_head_is_drawn_at_the_screens_own_resolution(
    qtbot: QtBot,
    tmp_path: Path,
    qapp: QApplication,
    picture_of: Callable[[QWidget, float], QImage],
    theme: Any,
    ratio: float,
) -> None:
    set_theme(theme)
    apply(qapp)
    booth = Booth(qtbot, tmp_path)
    image = picture_of(booth.face, ratio)
    y = round(booth.at(0.5, 0.5).y() * ratio)
    row = np.array([image.pixelColor(x, y).value() for x in range(image.width())])
    assert row[round(20 * ratio)] == 0x2B
    head = row > 0x2B + 8
    start = int(np.argmax(head))
    inside = int(row[start + round(12 * ratio)])
    rise = np.flatnonzero((row > 0x2B + 4) & (row < 0x2B + 0.9 * (inside - 0x2B)))
    assert np.sum(np.abs(rise - start) < 10 * ratio) <= 6  # device pixels, at either resolution


@pytest.mark.slow
@pytest.mark.alone
def test_a_segment_costs_little_more_than_its_own_answer(booth: Booth) -> None:
    """Event to pixels, by the app's CPU time against what the search alone needs."""
    face, session = booth.face, booth.presenter._document.session  # type: ignore[union-attr]
    booth.window.activateWindow()
    places = [booth.at(0.5 + 0.2 * np.cos(a), 0.5 + 0.2 * np.sin(a)) for a in np.linspace(0, 6, 50)]
    QTest.mousePress(face, LEFT, PLAIN, places[0])
    segments, answers = [], []
    for place in places:
        begun = time.process_time()
        QApplication.sendEvent(face, _mouse_move(booth, place))
        face.flush()
        QApplication.processEvents()
        segments.append(time.process_time() - begun)
        begun = time.process_time()
        for _ in range(5):
            session.answer()
        answers.append((time.process_time() - begun) / 5)
    QTest.mouseRelease(face, LEFT, PLAIN, places[-1])
    ratio = float(np.median(segments) / np.median(answers))
    print(f"segment {1000 * np.median(segments):.1f} ms, {ratio:.1f} answers")
    assert ratio < 25.0


def test_draft_is_written_by_a_job_and_at_once_when_the_screen_is_left(
    qtbot: QtBot, tmp_path: Path
) -> None:
    failures: list[Exception] = []
    runner = QtRunner(failures.append)
    room = studio(tmp_path, runner=runner)
    draft = tmp_path / "drafts" / "paint.npz"
    room.enter()
    qtbot.waitUntil(lambda: room.presenter.resolve().live.panorama is not None)
    room.stroke((0.4, 0.4), (0.6, 0.6))
    assert not draft.exists()
    qtbot.waitUntil(draft.exists)
    qtbot.waitUntil(lambda: not runner.running("paint-draft"))
    painted = room.presenter.canvas
    room.presenter.press((50.0, 50.0, 1.0))
    room.leave()
    kept = load_draft(draft).canvas
    assert painted is not None
    assert not np.array_equal(kept.weights, painted.weights)
    assert runner.shutdown()
    np.testing.assert_array_equal(load_draft(draft).canvas.weights, kept.weights)
    assert failures == []


def _mouse_move(booth: Booth, place: QPoint) -> Any:
    from PySide6.QtGui import QMouseEvent

    here = QPointF(place)
    return QMouseEvent(
        QEvent.Type.MouseMove, here, booth.face.mapToGlobal(here), Qt.MouseButton.NoButton, LEFT,
        PLAIN,
    )  # fmt: skip


def _pen(
    booth: Booth,
    place: tuple[float, float],
    pressure: float,
    pointer: QPointingDevice.PointerType = QPointingDevice.PointerType.Pen,
) -> None:
    kind = QPointingDevice.DeviceType.Stylus
    pen = QPointingDevice("pen", 7, kind, pointer, QPointingDevice.Capability.Pressure, 1, 3)
    here = QPointF(booth.at(*place))
    there = booth.face.mapToGlobal(here)
    types = (QEvent.Type.TabletPress, QEvent.Type.TabletMove, QEvent.Type.TabletRelease)
    for what in types:
        held = Qt.MouseButton.NoButton if what == types[2] else LEFT
        cause = Qt.MouseButton.NoButton if what == types[1] else LEFT
        event = QTabletEvent(
            what, pen, here, there, pressure, 0.0, 0.0, 0.0, 0.0, 0.0, PLAIN, cause, held
        )
        QApplication.sendEvent(booth.face, event)


def test_focus_leaves_and_comes_back_without_a_trace(booth: Booth) -> None:
    other = booth.screen.live._more
    booth.face.setFocus()
    other.setFocus()
    QApplication.sendEvent(booth.face, QKeyEvent(QEvent.Type.KeyRelease, Qt.Key.Key_Space, PLAIN))
    assert not booth.canvas.touched
