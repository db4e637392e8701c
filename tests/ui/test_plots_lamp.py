"""The drawings of the lamp: where it is drawn, and where the hand puts it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from app.core.solver.head_shape import HeadShape
from app.ui.plots.head_views import AboveView, SideView
from app.ui.plots.lamps import LampPlot
from app.ui.plots.sky_map import SkyMap
from app.ui.screens.light.placement.sky import sky_of
from app.ui.screens.light.two_steps import HeadsState
from app.ui.theme import set_theme

KEY, SHIFT = Qt.Key, Qt.KeyboardModifier.ShiftModifier


def egg() -> HeadShape:
    """A head of which only the outlines matter: with a nose, and a neck."""
    angle = np.linspace(0.0, 2 * np.pi, 40, endpoint=False)
    above = np.stack([0.08 * np.sin(angle), 0.1 * np.cos(angle)], axis=1)
    above[0] = (0.0, 0.125)
    side = np.stack([0.1 * np.cos(angle), 0.12 * np.sin(angle)], axis=1)
    side[0] = (0.125, 0.0)
    three = np.zeros((3, 3), np.float32)
    return HeadShape(
        "egg", np.arange(3, dtype=np.int32), three, three,
        above.astype(np.float32), side.astype(np.float32), three[0],
    )  # fmt: skip


def at(azimuth: float, altitude: float, distance: float = 0.3) -> HeadsState:
    return HeadsState(egg(), distance, azimuth, altitude, (0.0, 0.0), 60.0, "somewhere")


def shown(qtbot: QtBot, plot: LampPlot, state: HeadsState) -> LampPlot:
    qtbot.addWidget(plot)
    plot.resize(*((616, 160) if isinstance(plot, SkyMap) else (300, 404)))
    if isinstance(plot, SkyMap):
        values = np.tile(np.linspace(0.0, 90.0, 64), (9, 1))
        plot.show_sky(sky_of(values, 45.0))
    plot.show_heads(state)
    plot.show()
    return plot


def test_from_above_the_sitters_left_is_right_and_the_camera_below(qtbot: QtBot) -> None:
    view = AboveView()
    shown(qtbot, view, at(0.0, 0.0))
    x, y = view.middle
    left, right = view.place_of(90.0, 0.0), view.place_of(-90.0, 0.0)
    front, back = view.place_of(0.0, 0.0), view.place_of(180.0, 0.0)
    assert left[0] > x + 50
    assert right[0] < x - 50
    assert front[1] > y + 50
    assert back[1] < y - 50
    raised = view.place_of(90.0, 60.0)
    assert raised[0] - x == pytest.approx((left[0] - x) * 0.5)


def test_from_the_side_the_face_looks_away_from_the_seen_side(qtbot: QtBot) -> None:
    view = SideView()
    shown(qtbot, view, at(80.0, 0.0))
    x, y = view.middle
    assert view.from_left
    assert view.place_of(20.0, 0.0)[0] < x, "the camera is at the left"
    assert view.place_of(80.0, 40.0)[1] < y
    other = SideView()
    shown(qtbot, other, at(-80.0, 0.0))
    assert not other.from_left
    view = other
    assert view.place_of(-20.0, 0.0)[0] > x, "the camera is at the right"


def test_both_drawings_have_one_scale(qtbot: QtBot) -> None:
    above, side = AboveView(), SideView()
    for distance in (0.2, 0.3, 0.75, 3.0):
        shown(qtbot, above, at(90.0, 0.0, distance))
        shown(qtbot, side, at(90.0, 0.0, distance))
        assert above.scale == side.scale
        if distance <= 0.9:
            reach = math.dist(above.place_of(90.0, 0.0), above.middle)
            assert reach == pytest.approx(distance * above.scale)
        # The lamp stays in the drawing.
        assert above.place_of(90.0, 0.0)[0] < above.width() - 12


@pytest.mark.parametrize("kind", [AboveView, SideView, SkyMap])
@pytest.mark.parametrize("spot", [(40.0, 30.0), (-75.0, -20.0), (150.0, 5.0)])
def test_the_hand_puts_the_lamp_where_it_points(
    qtbot: QtBot, kind: Callable[[], LampPlot], spot: tuple[float, float]
) -> None:
    view = shown(qtbot, kind(), at(*spot))
    place = view.place_of(*spot)
    azimuth, altitude = view.spot_at(place)
    assert azimuth == pytest.approx(spot[0], abs=1e-6)
    assert altitude == pytest.approx(spot[1], abs=1e-6)


@pytest.mark.parametrize("kind", [AboveView, SideView, SkyMap])
def test_dragging_tells_where_the_lamp_is_held(qtbot: QtBot, kind: Callable[[], LampPlot]) -> None:
    view = shown(qtbot, kind(), at(60.0, 10.0))
    told: list[tuple[float, float]] = []
    view.moved.connect(lambda a, b: told.append((a, b)))
    start, stop = (
        QPointF(*view.place_of(*spot)).toPoint() for spot in ((60.0, 10.0), (75.0, 10.0))
    )
    QTest.mousePress(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, start)
    QTest.mouseMove(view, stop)
    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, stop)
    assert told[-1][0] == pytest.approx(75.0, abs=3.0)
    assert told[-1][1] == pytest.approx(10.0, abs=2.0)
    count = len(told)
    QTest.mouseMove(view, start)
    assert len(told) == count, "let go"


def test_a_press_beside_the_lamp_takes_it_on_the_map_only(qtbot: QtBot) -> None:
    told: list[float] = []
    for kind, takes in ((AboveView, False), (SideView, False), (SkyMap, True)):
        view = shown(qtbot, kind(), at(0.0, 0.0))
        view.moved.connect(lambda a, b: told.append(a))
        told.clear()
        far = QPointF(*view.place_of(-90.0, 0.0)).toPoint()
        QTest.mouseClick(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, far)
        assert bool(told) is takes
        if takes:
            assert told[0] == pytest.approx(-90.0, abs=1.0)


@pytest.mark.parametrize("kind", [AboveView, SideView, SkyMap])
def test_keys_move_the_lamp_by_whole_degrees(qtbot: QtBot, kind: Callable[[], LampPlot]) -> None:
    view = shown(qtbot, kind(), at(59.6, 9.7))
    told: list[tuple[float, float]] = []
    view.moved.connect(lambda a, b: told.append((a, b)))
    home: list[bool] = []
    view.home_asked.connect(lambda: home.append(True))
    for key, held, wanted in (
        (KEY.Key_Right, Qt.KeyboardModifier.NoModifier, (61.0, 9.7)),
        (KEY.Key_Left, SHIFT, (50.0, 9.7)),
        (KEY.Key_Up, Qt.KeyboardModifier.NoModifier, (59.6, 11.0)),
        (KEY.Key_Down, SHIFT, (59.6, 0.0)),
    ):
        QTest.keyClick(view, key, held)
        assert told[-1] == pytest.approx(wanted)
    QTest.keyClick(view, KEY.Key_Home)
    assert home == [True]


@pytest.mark.parametrize("theme", ["dark", "light", "contrast"])
@pytest.mark.parametrize("dpr", [1.0, 2.0])
def test_the_lamp_and_the_best_place_are_seen_on_any_ground(
    qtbot: QtBot, theme: str, dpr: float, picture_of: Callable[[QWidget, float], QImage]
) -> None:
    set_theme(theme)  # type: ignore[arg-type]
    for kind in (AboveView, SideView, SkyMap):
        view = shown(qtbot, kind(), at(90.0, 20.0))
        image = picture_of(view, dpr)
        place = view.place_of(90.0, 20.0)
        # Beside the bulb the dot is amber.
        spot = QPoint(round((place[0] - 9) * dpr), round(place[1] * dpr))
        colour = image.pixelColor(spot)
        assert colour.red() > 200, kind
        assert 150 < colour.green() < 210
        assert colour.blue() < 110


def test_an_empty_drawing_takes_nothing(qtbot: QtBot) -> None:
    for kind in (AboveView, SideView, SkyMap):
        view = kind()
        qtbot.addWidget(view)
        view.resize(view.sizeHint())
        view.show()
        told: list[float] = []
        view.moved.connect(lambda a, b, told=told: told.append(a))
        QTest.mouseClick(view, Qt.MouseButton.LeftButton)
        QTest.keyClick(view, KEY.Key_Right)
        assert told == []
