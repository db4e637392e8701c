"""The polar plot and the weights on the panorama: pixels, mouse, keyboard, words."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QSize, Qt
from PySide6.QtGui import QColor, QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from app.core.base.angles import at_turn, difference
from app.ui.plots.match_circle import PolarPlot
from app.ui.plots.weights import WeightPanorama, dimmed, tinted
from app.ui.theme import set_theme, theme
from tests.helpers.pace import units

ORANGE, BLUE = (255, 140, 30), (40, 140, 255)
LEFT = Qt.MouseButton.LeftButton


def picture(widget: QWidget, ratio: float = 1.0) -> QImage:
    """Paint a widget into a picture."""
    size = widget.size() * ratio
    image = QImage(size, QImage.Format.Format_RGB32)
    image.setDevicePixelRatio(ratio)
    image.fill(QColor("#1e1e1e"))
    widget.render(image)
    return image


def colour(image: QImage, x: float, y: float) -> tuple[int, int, int]:
    pixel = image.pixelColor(round(x - 0.5), round(y - 0.5))
    return pixel.red(), pixel.green(), pixel.blue()


def near(a: tuple[int, int, int], b: tuple[int, int, int], tolerance: int = 24) -> bool:
    return max(abs(p - q) for p, q in zip(a, b, strict=True)) <= tolerance


def amber() -> tuple[int, int, int]:
    c = theme().c.amberfill
    return c.red(), c.green(), c.blue()


def make_polar(qtbot: QtBot, needle: float = 0.0, **data: object) -> PolarPlot:
    plot = PolarPlot()
    qtbot.addWidget(plot)
    plot.resize(plot.sizeHint())
    turns = np.arange(64) * 5.625
    curve = 50.0 + 40.0 * np.cos(np.radians(turns - 90.0))
    arguments = {"limit": 45.0, "arc": (75.0, 105.0), "best": 90.2, "peaks": (-120.0, 10.0)}
    plot.set_data(curve, **(arguments | data), needle=needle)  # type: ignore[arg-type]
    return plot


class TestPolarPixels:
    @pytest.mark.parametrize("needle", [0.0, 90.0, -90.0, 180.0, 45.0])
    @pytest.mark.parametrize("ratio", [1.0, 2.0])
    def test_the_dot_is_amber_at_its_turn_and_nowhere_else(
        self, qtbot: QtBot, needle: float, ratio: float
    ) -> None:
        plot = make_polar(qtbot, needle, arc=None)
        image, dial = picture(plot, ratio), plot.dial
        for turn in (0.0, 90.0, -90.0, 180.0, 45.0):
            x, y = at_turn(dial.centre, dial.rim, turn)
            assert near(colour(image, x * ratio, y * ratio), amber()) == (turn == needle)

    def test_the_needle_runs_from_the_nose_to_the_rim(self, qtbot: QtBot) -> None:
        plot = make_polar(qtbot, -90.0)
        image, dial = picture(plot, 2.0), plot.dial
        for radius in (35.0, 50.0, 75.0):
            x, y = at_turn(dial.centre, radius, -90.0)
            assert near(colour(image, x * 2, y * 2), amber())

    def test_the_arc_is_tinted_clockwise_from_its_start(self, qtbot: QtBot) -> None:
        plot = make_polar(qtbot, 0.0, arc=(170.0, -150.0))
        image, dial = picture(plot), plot.dial

        def amberish(turn: float) -> bool:
            red, _, blue = colour(image, *at_turn(dial.centre, dial.rim - 14.0, turn))
            return red - blue > 15

        assert [turn for turn in (150, 165, 175, -175, -155, -145, -120) if amberish(turn)] == [
            175, -175, -155
        ]  # fmt: skip

    def test_the_curve_is_wide_where_the_match_is_high(self, qtbot: QtBot) -> None:
        plot = make_polar(qtbot, 0.0, arc=None, peaks=())
        image, dial = picture(plot), plot.dial
        for turn, match in ((90.0, 90.0), (-90.0, 10.0)):
            ring = [
                colour(image, *at_turn(dial.centre, dial.radius(match) + step, turn))[0]
                for step in (-1.0, 0.0, 1.0)
            ]
            assert max(ring) > 170

    @pytest.mark.parametrize("name", ["dark", "light", "contrast"])
    def test_every_theme_paints(self, qtbot: QtBot, name: str) -> None:
        set_theme(name, 1.5)  # type: ignore[arg-type]
        plot = make_polar(qtbot, 90.0)
        assert plot.size() == QSize(336, 336)
        dial = plot.dial
        assert near(colour(picture(plot), *at_turn(dial.centre, dial.rim, 90.0)), amber())

    @pytest.mark.slow
    @pytest.mark.alone
    def test_painting_costs_less_than_5_units(self, qtbot: QtBot) -> None:
        plot = make_polar(qtbot)
        picture(plot, 2.0)
        turns = iter(range(0, 700, 7))

        def paint() -> None:
            plot.set_needle(float(next(turns)))
            picture(plot, 2.0)

        assert units(paint, 20) < 5  # 33 units are a frame


class TestPolarHand:
    def test_dragging_follows_the_pointer(self, qtbot: QtBot) -> None:
        plot = make_polar(qtbot)
        turned: list[float] = []
        released: list[float] = []
        plot.turned.connect(turned.append)
        plot.released.connect(released.append)
        places = [
            QPoint(*(round(v) for v in at_turn(plot.dial.centre, 60.0, turn)))
            for turn in (45.0, 90.0, 135.0)
        ]
        QTest.mousePress(plot, LEFT, pos=places[0])
        QTest.mouseMove(plot, places[1])
        QTest.mouseMove(plot, places[2])
        assert released == []
        QTest.mouseRelease(plot, LEFT, pos=places[2])
        assert turned == pytest.approx([45.0, 90.0, 135.0], abs=1.0)
        assert released == [turned[-1]]
        QTest.mouseMove(plot, places[0])
        assert len(turned) == 3

    def test_a_press_outside_the_dial_or_in_its_middle_does_nothing(self, qtbot: QtBot) -> None:
        plot = make_polar(qtbot)
        turned: list[float] = []
        plot.turned.connect(turned.append)
        QTest.mouseClick(plot, LEFT, pos=QPoint(3, 3))
        QTest.mouseClick(plot, LEFT, pos=QPoint(112, 112))
        assert turned == []

    def test_a_click_takes_a_peak(self, qtbot: QtBot) -> None:
        plot = make_polar(qtbot)
        x, y = plot.peak_places()[0]
        with qtbot.waitSignal(plot.peak_chosen) as chosen:
            QTest.mouseClick(plot, LEFT, pos=QPoint(round(x) + 4, round(y) - 3))
        assert chosen.args == [0]
        assert plot.needle == -120.0

    def test_keys_move_by_whole_degrees(self, qtbot: QtBot) -> None:
        plot = make_polar(qtbot, 90.4)
        turned: list[float] = []
        released: list[float] = []
        plot.turned.connect(turned.append)
        plot.released.connect(released.append)
        shift = Qt.KeyboardModifier.ShiftModifier
        QTest.keyClick(plot, Qt.Key.Key_Right)
        QTest.keyClick(plot, Qt.Key.Key_Left, shift)
        QTest.keyClick(plot, Qt.Key.Key_Up)
        QTest.keyClick(plot, Qt.Key.Key_Down, shift)
        QTest.keyClick(plot, Qt.Key.Key_Home)
        assert turned == [91.0, 81.0, 82.0, 72.0, 90.2]
        assert released == turned

    def test_keys_wrap_past_the_half_turn(self, qtbot: QtBot) -> None:
        plot = make_polar(qtbot, 180.0)
        QTest.keyClick(plot, Qt.Key.Key_Right)
        assert plot.needle == -179.0

    def test_page_keys_go_from_peak_to_peak_clockwise(self, qtbot: QtBot) -> None:
        plot = make_polar(qtbot, 0.0)
        chosen: list[int] = []
        plot.peak_chosen.connect(chosen.append)
        stops = []
        for _ in range(3):
            QTest.keyClick(plot, Qt.Key.Key_PageDown)
            stops.append(plot.needle)
        QTest.keyClick(plot, Qt.Key.Key_PageUp)
        assert stops == [10.0, 90.2, -120.0]
        assert plot.needle == 90.2
        assert chosen == [1, 0]

    def test_setting_values_makes_no_signal(self, qtbot: QtBot) -> None:
        plot = make_polar(qtbot)
        turned: list[float] = []
        plot.turned.connect(turned.append)
        plot.set_needle(400.0)
        assert plot.needle == 40.0
        assert turned == []


class TestPolarWords:
    def test_values_are_said(self, qtbot: QtBot) -> None:
        plot = make_polar(qtbot, -90.0, peaks=(-120.0,))
        assert plot.accessibleName() == "Match by turn"
        words = plot.accessibleDescription()
        assert "Needle: 90° counter-clockwise, match 10 of 100" in words
        assert "Best: 90° clockwise" in words
        assert "Good from 75° to 105°" in words
        assert "Limit of reach: 45" in words
        assert "Second peak: 120° counter-clockwise" in words
        assert plot.focusPolicy() == Qt.FocusPolicy.StrongFocus

    def test_numbers_come_from_who_shows_them_elsewhere(self, qtbot: QtBot) -> None:
        plot = make_polar(qtbot, -90.0)
        plot.tell("C 62, match 87", "Limit of C: 45", ["Median at −84°: C 12"])
        words = plot.accessibleDescription()
        assert "Needle: 90° counter-clockwise, C 62, match 87. " in words
        assert "Limit of C: 45. Median at −84°: C 12" in words
        assert "of 100" not in words

    def test_an_empty_plot_says_so_and_holds_still(self, qtbot: QtBot) -> None:
        plot = PolarPlot()
        qtbot.addWidget(plot)
        plot.set_data([], 45.0, None, None)
        assert plot.accessibleDescription() == "No turn yet"
        QTest.mouseClick(plot, LEFT, pos=QPoint(60, 60))
        QTest.keyClick(plot, Qt.Key.Key_Home)
        QTest.keyClick(plot, Qt.Key.Key_PageDown)
        picture(plot)


def one_texel(column: int) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    target = np.zeros((32, 64))
    target[14:18, column] = 1.0
    target[14:18, (column + 32) % 64] = -1.0
    return target


class TestWeights:
    def test_positive_is_orange_and_negative_blue(self) -> None:
        shown = tinted(one_texel(10), ORANGE, BLUE)
        blue, green, red, opacity = shown[15, 10].astype(float)
        assert opacity > 180
        assert (red, green, blue) == pytest.approx([v * opacity / 255 for v in ORANGE], abs=2)
        blue, green, red, opacity = shown[15, 42].astype(float)
        assert (red, green, blue) == pytest.approx([v * opacity / 255 for v in BLUE], abs=2)
        assert not shown[0].any()

    def test_nothing_and_nonsense_are_clear(self) -> None:
        assert not tinted(np.zeros((32, 64)), ORANGE, BLUE).any()
        assert not tinted(np.full((32, 64), np.nan), ORANGE, BLUE).any()

    def test_texels_are_enlarged_about_their_middles_and_around_the_seam(
        self, qtbot: QtBot
    ) -> None:
        view = WeightPanorama(size=(640, 320), sitter="", behind="")
        qtbot.addWidget(view)
        view.resize(view.sizeHint())
        view.set_picture(np.zeros((128, 256, 3), np.uint8))
        target = np.zeros((32, 64))
        target[:, 0] = 1.0
        view.set_target(target)
        image = picture(view)
        shown = [image.pixelColor(x, 160).red() for x in (0, 4, 5, 9, 639)]
        assert abs(shown[1] - shown[2]) <= 8  # its middle lies between them
        assert shown[0] == pytest.approx(shown[3], abs=8)
        assert shown[4] > 80  # half of the texel's neighbour

    def test_the_place_is_grey_darker_and_moved_to_the_photographer(self, qtbot: QtBot) -> None:
        view = WeightPanorama(size=(320, 160), sitter="", behind="")
        qtbot.addWidget(view)
        view.resize(view.sizeHint())
        place = np.zeros((4, 8, 3), np.uint8)
        place[:, 6] = (255, 0, 0)
        view.set_picture(place, 90.0)
        image = picture(view)
        row = [colour(image, x, 80.0) for x in range(320)]
        # Column 6 has its middle at azimuth 112.5, seen 22.5 beside the photographer.
        bright = [x for x, each in enumerate(row) if each[0] > 30]
        assert np.mean(bright) == pytest.approx(180.0, abs=1.0)
        assert all(red == green == blue < 76 for red, green, blue in row)
        assert max(dimmed(place)[0]) < 76

    def make(self, qtbot: QtBot, turn: float) -> WeightPanorama:
        view = WeightPanorama(size=(256, 128), sitter="", behind="")
        qtbot.addWidget(view)
        view.resize(view.sizeHint())
        view.set_picture(np.full((128, 256, 3), 120, np.uint8))
        view.set_target(one_texel(32))  # in front of the face
        view.set_turn(turn, 12.0)
        return view

    @pytest.mark.parametrize("turn", [0.0, 90.0, -90.0, 45.0])
    def test_weights_turn_with_the_sitter(self, qtbot: QtBot, turn: float) -> None:
        view = self.make(qtbot, turn)
        image = picture(view)
        red, _, blue = colour(image, view.view.x_of(turn + 2.8), 64.0)
        assert red - blue > 60
        red, _, blue = colour(image, view.view.x_of(turn + 182.8), 64.0)
        assert blue - red > 60

    def test_lines_stand_where_the_sitter_faces_and_behind(self, qtbot: QtBot) -> None:
        view = WeightPanorama()
        qtbot.addWidget(view)
        view.resize(view.sizeHint())
        view.set_picture(np.zeros((128, 256, 3), np.uint8))
        view.set_turn(90.0)
        image = picture(view, 2.0)
        row = np.array([colour(image, x, 240)[0] for x in range(1, 544)])
        solid = np.flatnonzero(row > 200)
        assert solid[solid > 272].tolist() == pytest.approx([405, 406, 407, 408], abs=2)
        column = [colour(image, view.view.x_of(-90.0) * 2, y)[0] > 200 for y in range(100, 270)]
        assert 0.4 < float(np.mean(column)) < 0.6  # dotted

    def test_dragging_and_keys_turn_the_sitter(self, qtbot: QtBot) -> None:
        view = self.make(qtbot, 0.0)
        released: list[float] = []
        view.released.connect(released.append)
        QTest.mousePress(view, LEFT, pos=QPoint(128, 60))
        QTest.mouseMove(view, QPoint(192, 60))
        QTest.mouseRelease(view, LEFT, pos=QPoint(192, 60))
        assert abs(difference(view.needle, 90.0)) < 1.0
        QTest.keyClick(view, Qt.Key.Key_Right, Qt.KeyboardModifier.ShiftModifier)
        QTest.keyClick(view, Qt.Key.Key_Home)
        assert released == pytest.approx([90.0, 100.0, 12.0], abs=1.0)
        assert "12° clockwise" in view.accessibleDescription()

    def test_without_a_place_it_is_an_empty_well(self, qtbot: QtBot) -> None:
        view = WeightPanorama()
        qtbot.addWidget(view)
        view.resize(view.sizeHint())
        assert colour(picture(view), 136.0, 68.0) == (0x2B, 0x2B, 0x2B)
