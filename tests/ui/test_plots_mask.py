"""The canvas on which is painted where a lamp is: directions, zoom, hands and keys."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QObject, QPoint, QPointF, QRect, Qt
from PySide6.QtGui import QPaintEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from app.ui.plots.mask_canvas import MaskCanvas
from app.ui.theme import theme

PLAIN = Qt.KeyboardModifier.NoModifier


@dataclass
class Drawn:
    picture: np.ndarray = field(default_factory=lambda: np.full((64, 128, 3), 60, np.uint8))
    alpha: np.ndarray = field(default_factory=lambda: np.zeros((64, 128), np.float32))
    centre: tuple[float, float] = (170.0, 10.0)
    adds_lamp: bool = True
    radius_deg: float = 4.0


def canvas_of(qtbot: QtBot, state: Drawn | None = None) -> MaskCanvas:
    canvas = MaskCanvas()
    qtbot.addWidget(canvas)
    canvas.resize(720, 360)
    canvas.show_state(state or Drawn())
    canvas.show()
    return canvas


def test_a_place_and_its_direction_are_each_others(qtbot: QtBot) -> None:
    canvas = canvas_of(qtbot)
    assert canvas.place_of(170.0, 0.0) == (360.0, 180.0), "an empty mask is seen whole"
    # Over the seam the shorter way: azimuth grows to the right.
    assert canvas.place_of(-170.0, 0.0)[0] > 360.0
    for spot in ((150.0, 40.0), (-170.0, -60.0), (20.0, 0.0)):
        assert canvas.spot_at(canvas.place_of(*spot)) == pytest.approx(spot)


def test_a_small_lamp_is_seen_closely_and_the_picture_never_leaves_the_canvas(
    qtbot: QtBot,
) -> None:
    state = Drawn()
    state.alpha[26:32, 120:126] = 1.0
    canvas = canvas_of(qtbot, state)
    across = canvas.place_of(171.0, 10.0)[0] - canvas.place_of(170.0, 10.0)[0]
    assert across == pytest.approx(4.0 * 720 / 360)
    for _ in range(5):
        canvas.zoom(-1)
    assert canvas.place_of(0.0, 90.0)[1] == pytest.approx(0.0)
    assert canvas.place_of(0.0, -90.0)[1] == pytest.approx(360.0)


def test_the_wheel_keeps_what_is_under_the_pointer(qtbot: QtBot) -> None:
    canvas = canvas_of(qtbot)
    at = QPointF(500.0, 150.0)
    before = canvas.spot_at((at.x(), at.y()))
    event = QWheelEvent(
        at, at, QPoint(), QPoint(0, 120), Qt.MouseButton.NoButton, PLAIN,
        Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(canvas, event)
    assert canvas.spot_at((at.x(), at.y())) == pytest.approx(before, abs=0.1)


def test_mouse_and_keys_paint(qtbot: QtBot) -> None:
    canvas = canvas_of(qtbot)
    begun: list[tuple[float, float]] = []
    went: list[tuple[float, float]] = []
    ended: list[int] = []
    canvas.pressed.connect(lambda a, e: begun.append((a, e)))
    canvas.drawn.connect(lambda a, e: went.append((a, e)))
    canvas.lifted.connect(lambda: ended.append(1))
    left = Qt.MouseButton.LeftButton
    QTest.mousePress(canvas, left, PLAIN, QPoint(360, 180))
    QTest.mouseMove(canvas, QPoint(380, 180))
    QTest.mouseRelease(canvas, left, PLAIN, QPoint(380, 180))
    assert begun == [pytest.approx((170.0, 0.0))]
    assert went == [pytest.approx((180.0, 0.0))]
    assert len(ended) == 1
    canvas.setFocus()
    QTest.keyClick(canvas, Qt.Key.Key_Right)
    QTest.keyClick(canvas, Qt.Key.Key_Up, Qt.KeyboardModifier.ShiftModifier)
    QTest.keyClick(canvas, Qt.Key.Key_Space)
    assert begun[1] == pytest.approx((-179.0, 10.0))
    assert len(ended) == 2
    QTest.mouseMove(canvas, QPoint(10, 10))
    assert len(went) == 1, "nothing is painted while no button is down"


def test_ring_is_painted_where_the_pointer_goes(qtbot: QtBot) -> None:
    canvas = canvas_of(qtbot)
    QApplication.processEvents()
    painted: list[QRect] = []

    class Painted(QObject):
        def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
            if isinstance(event, QPaintEvent):
                painted.append(event.rect())
            return False

    watch = Painted()
    canvas.panel.viewport().installEventFilter(watch)
    for place in (QPoint(200, 100), QPoint(500, 250)):
        painted.clear()
        QTest.mouseMove(canvas, place)
        QApplication.processEvents()
        assert any(area.contains(place) for area in painted)
    canvas.setFocus()
    painted.clear()
    QTest.keyClick(canvas, Qt.Key.Key_Right, Qt.KeyboardModifier.ShiftModifier)
    QApplication.processEvents()
    assert any(area.contains(QPoint(520, 250)) for area in painted)


def test_the_mask_is_amber_with_an_edge_and_the_rest_is_the_picture(qtbot: QtBot) -> None:
    state = Drawn(centre=(0.0, 0.0))
    state.alpha[16:48, 48:80] = 1.0
    canvas = canvas_of(qtbot, state)
    image = canvas.grab().toImage()
    wide = image.width() / 720.0
    inside = image.pixelColor(round(400 * wide), round(200 * wide))
    outside = image.pixelColor(round(60 * wide), round(60 * wide))
    assert outside.red() == outside.blue() == 60
    assert inside.red() - inside.blue() > 30
    row = [image.pixelColor(x, round(140 * wide)) for x in range(image.width())]
    assert max(min(c.red(), c.blue()) for c in row) > 180, "a white line"
    assert min(max(c.red(), c.blue()) for c in row) < 20, "on a black one"
    assert theme().c.amberfill.red() > theme().c.amberfill.blue()
