"""The panorama view: pieces without seams, marks in their places, the marker by hand and keys."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QColor, QImage, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from app.core.base.angles import difference
from app.ui.plots.panorama import PanoramaView, SceneLamp
from app.ui.theme import theme

LEFT = Qt.MouseButton.LeftButton
SHIFT = Qt.KeyboardModifier.ShiftModifier


def smooth_place(width: int = 1024) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """A panorama without detail, that goes on around its seam."""
    u = np.arange(width) / width * 2 * np.pi
    v = np.linspace(0, 1, width // 2)[:, None]
    red = 128 + 60 * np.sin(u) + 0 * v
    green = 128 + 60 * np.cos(u) + 0 * v
    blue = 40 + 150 * v + 0 * u
    return np.stack([red, green, blue], axis=-1).astype(np.uint8)


@pytest.fixture
def view(qtbot: QtBot) -> Iterator[PanoramaView]:
    """A view of 720 x 360, two pixels for each degree, of a grey place."""
    made = PanoramaView()
    qtbot.addWidget(made)
    made.resize(720, made.heightForWidth(720))
    made.set_picture(np.full((512, 1024, 3), 100, np.uint8))
    made.show()
    yield made
    made.hide()


def painted(
    view: PanoramaView, ratio: float = 1.0
) -> np.ndarray[tuple[int, ...], np.dtype[np.int_]]:
    image = QImage(view.size() * ratio, QImage.Format.Format_RGB888)
    image.setDevicePixelRatio(ratio)
    image.fill(QColor("#161616"))
    view.render(image)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    return rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3).astype(int)


def amber_columns(view: PanoramaView) -> list[int]:
    row = painted(view)[40]
    return [int(x) for x in np.flatnonzero(row[:, 0] - row[:, 2] > 100)]


def wheel(view: PanoramaView, x: float, y: float, notches: int) -> None:
    place = QPointF(x, y)
    QApplication.sendEvent(
        view,
        QWheelEvent(
            place,
            view.mapToGlobal(place),
            QPoint(),
            QPoint(0, 120 * notches),
            Qt.MouseButton.NoButton,
            Qt.KeyboardModifier.NoModifier,
            Qt.ScrollPhase.NoScrollPhase,
            False,
        ),
    )


def shown_as(qtbot: QtBot, place: np.ndarray, width: int) -> PanoramaView:
    """A view so many pixels wide, without marks."""
    made = PanoramaView()
    qtbot.addWidget(made)
    made.resize(width, made.heightForWidth(width))
    made.set_shown(marker=False)
    made.set_picture(place)
    return made


class TestPicture:
    @pytest.mark.parametrize("width", [300, 1024, 1500])
    @pytest.mark.parametrize("zoom", [1.0, 5.0])
    def test_what_is_shown_is_part_of_the_scaled_picture(
        self, qtbot: QtBot, width: int, zoom: float
    ) -> None:
        place = smooth_place()
        view = shown_as(qtbot, place, width)
        view.set_zoom(zoom)
        whole = (round(width * zoom), round(width * zoom) // 2)
        expected = cv2.resize(place, whole, interpolation=cv2.INTER_LINEAR)
        left, top = (whole[0] - width) // 2, (whole[1] - width // 2) // 2
        piece = expected[top : top + width // 2, left : left + width].astype(int)
        # Smooth content: two ways of scaling it agree, except in the rounded corners.
        assert np.abs(painted(view)[: width // 2] - piece)[8:-8, 8:-8].max() <= 3

    def test_the_panorama_wraps_between_its_texels(self, qtbot: QtBot) -> None:
        place = np.zeros((8, 16, 3), np.uint8)
        place[:, 0] = 240
        view = shown_as(qtbot, place, 1600)
        view.set_front(180.0)
        row = painted(view)[400, :, 0]
        # Half way from the last texel to the first; Qt counts in sixteenths of a texel.
        assert np.abs(row[798:802] - 120).max() <= 240 / 16
        assert row[850] == 240
        assert row[740] <= 240 / 16

    @pytest.mark.parametrize(("width", "zoom"), [(256, 1.0), (1024, 1.0), (512, 4.0)])
    def test_only_what_is_clipped_is_hatched_and_thin_lamps_too(
        self, qtbot: QtBot, width: int, zoom: float
    ) -> None:
        clipped = np.zeros((512, 1024), bool)
        clipped[200:202, 450:550] = True  # thin
        clipped[230:280, 480:540] = True
        view = shown_as(qtbot, np.full((512, 1024, 3), 128, np.uint8), width)
        view.set_clipped(clipped)
        view.set_zoom(zoom)
        shown = painted(view)
        unit = width * zoom / 1024

        def part(top: int, bottom: int, left: int, right: int) -> np.ndarray:
            rows = [round(width / 4 + (y - 256) * unit) for y in (top, bottom)]
            columns = [round(width / 2 + (x - 512) * unit) for x in (left, right)]
            return shown[rows[0] : max(rows[1], rows[0] + 1), columns[0] : columns[1]]

        block = part(236, 274, 486, 534)
        assert block.min() < 40
        assert block.max() > 220
        assert 90 < block.mean() < 170
        # Black and white alternate; only the soft edges of lines are grey.
        assert (np.abs(part(201, 202, 454, 546) - 128) > 30).mean() > 0.6
        assert (part(208, 222, 440, 560) == 128).all()

    def test_hatching_goes_on_around_the_seam(self, qtbot: QtBot) -> None:
        clipped = np.zeros((512, 1024), bool)
        clipped[200:300, :60] = clipped[200:300, -60:] = True
        view = shown_as(qtbot, np.full((512, 1024, 3), 128, np.uint8), 1024)
        view.set_clipped(clipped)
        view.set_front(180.0)
        row = painted(view)[250, 460:564, 0]
        # White lines come every eight pixels, also over the seam in the middle.
        white = np.flatnonzero((row[1:] > 128) & (row[:-1] <= 128))
        assert np.unique(np.diff(white)).tolist() == [8]


class TestMarks:
    def test_the_line_stands_at_the_photographer(self, view: PanoramaView) -> None:
        assert amber_columns(view) == [359, 360]
        view.set_front(50.0)
        assert amber_columns(view) == [359, 360]  # scrolled to the middle

    @pytest.mark.parametrize("ratio", [1.0, 2.0])
    def test_the_line_has_a_dark_edge(self, view: PanoramaView, ratio: float) -> None:
        row = painted(view, ratio)[round(40 * ratio)]
        middle = round(360 * ratio)
        assert row[middle - round(1.5 * ratio) - 1 : middle + round(2 * ratio)].min() < 40

    def test_picture_is_scrolled_and_not_mirrored(self, view: PanoramaView) -> None:
        place = np.zeros((512, 1024, 3), np.uint8)
        place[:, 768:] = (0, 200, 0)  # azimuth 90 to 180
        view.set_picture(place)
        view.set_front(90.0)
        row = painted(view)[100]
        green = np.flatnonzero(row[:, 1] > 150)
        assert green.min() == pytest.approx(360, abs=2)
        assert green.max() == pytest.approx(540, abs=2)

    def test_lamps_stand_at_their_directions(self, view: PanoramaView) -> None:
        view.set_shown(marker=False)
        view.set_lamps([SceneLamp("A", 47.0, 30.0)])
        dark = painted(view).max(axis=2)[:350] < 40
        rows, columns = np.nonzero(dark[:, 5:-5])
        assert float(columns.mean()) + 5 == pytest.approx(360 + 94, abs=1.5)
        assert float(rows.mean()) == pytest.approx(180 - 60, abs=1.5)
        view.set_shown(lamps=False)
        assert not (painted(view).max(axis=2)[5:350, 5:-5] < 40).any()

    def test_the_grid_comes_and_goes(self, view: PanoramaView) -> None:
        view.set_shown(marker=False)
        assert np.ptp(painted(view)[90, 10:710, 0]) == 0
        view.set_shown(grid=True)
        row = painted(view)[90, :, 0]
        assert row[270] > 130  # 45° counter-clockwise
        assert row[310] == 100

    def test_hatching_comes_and_goes(self, view: PanoramaView) -> None:
        clipped = np.zeros((256, 512), np.float32)
        clipped[40:80, 350:450] = 0.5
        view.set_clipped(clipped)
        assert painted(view)[56:112, 500:620].max() > 220
        view.set_shown(clipped=False)
        assert np.ptp(painted(view)[56:112, 500:620]) == 0

    def test_another_exposure_replaces_the_picture_and_keeps_the_hatching(
        self, view: PanoramaView
    ) -> None:
        clipped = np.zeros((256, 512), bool)
        clipped[40:80, 350:450] = True
        view.set_clipped(clipped)
        for grey in (100, 30, 60, 90, 120):
            view.set_picture(np.full((512, 1024, 3), grey, np.uint8))
            shown = painted(view)
            assert shown[200, 100, 0] == grey
            assert shown[56:112, 500:620].max() > 220

    def test_without_a_picture_there_is_a_well_and_no_marker(self, view: PanoramaView) -> None:
        view.set_picture(None)
        assert tuple(painted(view)[100, 100]) == (0x2B, 0x2B, 0x2B)
        assert view.grip.isHidden()
        assert view.accessibleDescription() == "No panorama yet"


class TestLooking:
    def test_the_picture_keeps_two_to_one_in_any_size(self, view: PanoramaView) -> None:
        view.resize(900, 300)
        area = view.picture_rect
        assert area.width() == 2 * area.height()
        assert area.bottom() + 1 <= 300 - theme().px(28)
        assert area.left() == (900 - area.width()) // 2

    def test_the_wheel_zooms_around_the_pointer(self, view: PanoramaView, qtbot: QtBot) -> None:
        before = view.view.azimuth_at(600.0)
        with qtbot.waitSignal(view.zoom_changed) as zoomed:
            wheel(view, 600.0, 100.0, 2)
        assert zoomed.args == [pytest.approx(1.5625)]
        assert view.view.azimuth_at(600.0) == pytest.approx(before)
        wheel(view, 10.0, 10.0, 50)
        assert view.view.zoom == 8.0
        wheel(view, 10.0, 10.0, -50)
        assert view.view.zoom == 1.0

    def test_dragging_moves_the_picture_around_the_seam(self, view: PanoramaView) -> None:
        QTest.mousePress(view, LEFT, pos=QPoint(100, 50))
        QTest.mouseMove(view, QPoint(400, 50))
        QTest.mouseRelease(view, LEFT, pos=QPoint(400, 50))
        assert view.view.azimuth_deg == -150.0
        QTest.mouseMove(view, QPoint(500, 50))
        assert view.view.azimuth_deg == -150.0
        assert view.marker_deg == 0.0

    def test_keys_look_around_and_zoom(self, view: PanoramaView) -> None:
        QTest.keyClick(view, Qt.Key.Key_Right)
        QTest.keyClick(view, Qt.Key.Key_Right, SHIFT)
        assert view.view.azimuth_deg == 11.0
        QTest.keyClick(view, Qt.Key.Key_Plus)
        QTest.keyClick(view, Qt.Key.Key_Plus)
        QTest.keyClick(view, Qt.Key.Key_Up, SHIFT)
        assert view.view.elevation_deg == 10.0
        QTest.keyClick(view, Qt.Key.Key_Home)
        assert (view.view.azimuth_deg, view.view.elevation_deg) == (0.0, 0.0)
        QTest.keyClick(view, Qt.Key.Key_Minus)
        assert view.view.zoom == pytest.approx(1.25)
        QTest.keyClick(view, Qt.Key.Key_0)
        assert view.view.zoom == 1.0

    def test_zooming_paints_only_what_is_seen(self, view: PanoramaView) -> None:
        place = smooth_place()
        view.set_picture(place)
        view.set_shown(marker=False)
        view.set_zoom(8.0)
        shown = painted(view, 2.0)
        middle = place[256, 512].astype(int)
        assert np.abs(shown[360, 720] - middle).max() <= 2
        assert np.ptp(shown[100:600, 100:1300, 0]) < 60

    def test_it_says_where_it_looks_and_what_is_there(self, view: PanoramaView) -> None:
        view.set_front(10.0)
        view.set_lamps([SceneLamp("A", 57.0, 30.2)])
        words = view.accessibleDescription()
        assert "Zoom 100%" in words
        assert "Lamp A: 47° clockwise, 30° up" in words
        assert view.accessibleName()

    def test_gliding_ends_at_the_photographer(self, view: PanoramaView, qtbot: QtBot) -> None:
        view.set_front(40.0, glide=True)
        assert view.view.azimuth_deg == 0.0
        qtbot.waitUntil(lambda: view.view.azimuth_deg == 40.0)


class TestMarker:
    def test_the_grip_lies_on_the_line_above_the_lower_edge(self, view: PanoramaView) -> None:
        grip = view.grip
        assert grip.geometry().center().x() == pytest.approx(360, abs=1)
        assert grip.geometry().bottom() + 1 == 360 - 16
        assert grip.height() == 36
        assert grip.accessibleName() == "Photographer stands here"

    def test_dragging_the_grip_moves_the_marker_and_not_the_picture(
        self, view: PanoramaView
    ) -> None:
        moved: list[float] = []
        released: list[float] = []
        view.marker_moved.connect(moved.append)
        view.marker_released.connect(released.append)
        grip = view.grip
        middle = grip.rect().center()
        QTest.mousePress(grip, LEFT, pos=middle)
        QTest.mouseMove(grip, middle + QPoint(25, 0))
        assert moved[-1] == pytest.approx(12.5, abs=1.0)
        assert grip.text == f"{round(moved[-1])}° clockwise"
        assert released == []
        QTest.mouseRelease(grip, LEFT, pos=grip.rect().center())
        assert released == [view.marker_deg]
        assert view.view.azimuth_deg == 0.0
        assert view.marker_deg == pytest.approx(12.5, abs=1.0)
        view.set_front(view.marker_deg)
        assert grip.text == "Photographer stands here"
        assert view.view.azimuth_deg == view.marker_deg

    def test_the_line_can_be_dragged_too(self, view: PanoramaView) -> None:
        released: list[float] = []
        view.marker_released.connect(released.append)
        QTest.mousePress(view, LEFT, pos=QPoint(362, 100))
        QTest.mouseMove(view, QPoint(180, 100))
        QTest.mouseRelease(view, LEFT, pos=QPoint(180, 100))
        assert released == [-90.0]
        assert amber_columns(view) == [179, 180]

    def test_the_marker_goes_around_the_seam(self, view: PanoramaView) -> None:
        view.set_front(170.0)
        QTest.mousePress(view, LEFT, pos=QPoint(360, 100))
        QTest.mouseMove(view, QPoint(400, 100))
        QTest.mouseRelease(view, LEFT, pos=QPoint(400, 100))
        assert view.marker_deg == -170.0
        assert view.grip.text == "20° clockwise"

    def test_m_takes_it_arrows_step_enter_keeps_it(self, view: PanoramaView) -> None:
        moved: list[float] = []
        released: list[float] = []
        view.marker_moved.connect(moved.append)
        view.marker_released.connect(released.append)
        view.activateWindow()
        QTest.keyClick(view, Qt.Key.Key_M)
        grip = view.grip
        QTest.keyClick(grip, Qt.Key.Key_Right)
        QTest.keyClick(grip, Qt.Key.Key_Left, SHIFT)
        assert moved == [1.0, -9.0]
        assert grip.accessibleDescription() == "9° counter-clockwise"
        assert released == []
        QTest.keyClick(grip, Qt.Key.Key_Return)
        assert released == [-9.0]

    def test_escape_and_home_take_it_back(self, view: PanoramaView) -> None:
        released: list[float] = []
        view.marker_released.connect(released.append)
        for key in (Qt.Key.Key_Escape, Qt.Key.Key_Home):
            QTest.keyClick(view.grip, Qt.Key.Key_Right, SHIFT)
            assert view.marker_deg == 10.0
            QTest.keyClick(view.grip, key)
            assert view.marker_deg == 0.0
        assert released == []

    def test_m_looks_at_a_marker_that_is_out_of_sight(self, view: PanoramaView) -> None:
        view.set_zoom(6.0)
        view.set_front(0.0)
        QTest.keyClick(view, Qt.Key.Key_Left, SHIFT)
        for _ in range(6):
            QTest.keyClick(view, Qt.Key.Key_Left, SHIFT)
        assert view.grip.isHidden()
        QTest.keyClick(view, Qt.Key.Key_M)
        assert view.view.azimuth_deg == 0.0
        assert view.grip.isVisible()

    def test_the_grip_stays_inside_the_picture(self, view: PanoramaView) -> None:
        QTest.mousePress(view, LEFT, pos=QPoint(360, 100))
        QTest.mouseMove(view, QPoint(715, 100))
        assert view.grip.geometry().right() < 720
        assert abs(difference(view.marker_deg, 177.5)) < 1e-9
        QTest.mouseRelease(view, LEFT, pos=QPoint(715, 100))

    def test_selfie_mode_has_other_words(self, view: PanoramaView) -> None:
        view.set_marker_words("You face this way")
        assert view.grip.text == "You face this way"
        assert view.grip.accessibleName() == "You face this way"


def test_what_is_made_ready_ahead_shows_nothing_until_there_is_a_picture(qtbot: QtBot) -> None:
    view = PanoramaView()
    qtbot.addWidget(view)
    view.show()
    view.make_ready()
    panel = view.panel
    assert panel.isHidden()
    view.set_picture(np.full((512, 1024, 3), 100, np.uint8))
    assert not panel.isHidden()
    assert view.panel is panel
