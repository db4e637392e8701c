"""The strip of background and the signs of the guidance."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from app.core.base.angles import difference
from app.core.guidance.walk_plan import PlanDrawing, PlanMark
from app.ui.plots.guidance import NAMES, BigDegrees, TurnArrow
from app.ui.plots.mask_canvas import draw_brush_ring
from app.ui.plots.walk_plan import PlanView
from app.ui.plots.weights import WeightLegend, WeightScale
from app.ui.screens.turn.background_strip import Scale
from app.ui.screens.turn.background_strip_view import BackgroundStrip
from app.ui.theme import set_theme, theme
from app.words.plan import PlanWords, plan_words

GROUND = "#1e1e1e"


def pixels(widget: QWidget, ratio: float = 1.0) -> np.ndarray[tuple[int, ...], np.dtype[np.int_]]:
    """Paint a widget; (h, w, 3) red, green, blue."""
    image = QImage(widget.size() * ratio, QImage.Format.Format_RGB888)
    image.setDevicePixelRatio(ratio)
    image.fill(QColor(GROUND))
    widget.render(image)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    return rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3).astype(int)


def inked(widget: QWidget) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Where a widget painted anything."""
    found: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
    found = np.abs(pixels(widget) - 0x1E).max(axis=2) > 20
    return found


def make_strip(
    qtbot: QtBot,
    goal: float,
    now: float | None,
    arc: tuple[float, float] | None = None,
    grey: int = 100,
) -> BackgroundStrip:
    strip = BackgroundStrip()
    qtbot.addWidget(strip)
    strip.resize(750, 284)
    picture = np.full((220, 750, 3), grey, np.uint8)
    strip.set_state(Scale(goal, now, None, 60.0, arc, "goal 96°", "now 73°", "", "A"), picture)
    return strip


class TestStrip:
    @pytest.mark.parametrize(("goal", "now"), [(96.0, 73.0), (178.0, -165.0), (-170.0, 175.0)])
    def test_frames_stand_at_their_turns(self, qtbot: QtBot, goal: float, now: float) -> None:
        strip = make_strip(qtbot, goal, now)
        row = pixels(strip)[180]
        left, right = strip.scale.frame(now, 60.0)
        for edge in (left, right):
            x = round(edge)
            assert row[x - 2 : x + 3].min(axis=1).max() > 240  # white
        amber = (row[:, 0] - row[:, 2]) > 100
        goal_left, goal_right = strip.scale.frame(goal, 60.0)
        shown = [x for x in (goal_left, goal_right) if abs(x - left) > 8 and abs(x - right) > 8]
        column = pixels(strip)[10:210, :, :]
        amber = ((column[..., 0] - column[..., 2]) > 100).mean(axis=0) > 0.4
        assert shown
        for edge in shown:
            assert amber[round(edge) - 2 : round(edge) + 3].any()
        assert not amber[10:60].any()

    def test_outside_both_frames_it_is_42_percent_darker(self, qtbot: QtBot) -> None:
        row = pixels(make_strip(qtbot, 96.0, 73.0))[180, :, 0]
        scale = make_strip(qtbot, 96.0, 73.0).scale
        assert row[round(scale.x_of(35.0))] == pytest.approx(58, abs=1)
        assert row[round(scale.x_of(150.0))] == pytest.approx(58, abs=1)
        assert row[round(scale.x_of(60.0))] == 100  # now alone
        assert row[round(scale.x_of(120.0))] == 100  # goal alone

    def test_the_band_is_green_inside_the_arc_only(self, qtbot: QtBot) -> None:
        strip = make_strip(qtbot, 178.0, None, (165.0, -170.0))
        bar = pixels(strip)[240]
        scale = strip.scale
        green = (bar[:, 1] - bar[:, 0]) > 60
        assert green[round(scale.x_of(168.0))]
        assert green[round(scale.x_of(-173.0))]
        assert not green[round(scale.x_of(160.0))]
        assert not green[round(scale.x_of(-165.0))]

    def test_markers_stand_on_the_scale(self, qtbot: QtBot) -> None:
        strip = make_strip(qtbot, 96.0, 73.0)
        row = pixels(strip)[230]
        scale = strip.scale
        assert row[round(scale.x_of(73.0))].min() > 200
        red, _, blue = row[round(scale.x_of(96.0))]
        assert red - blue > 100

    @pytest.mark.parametrize(("now", "side"), [(-60.0, -1), (-170.0, 1)])
    def test_a_camera_off_the_strip_is_named_at_the_nearer_edge(
        self, qtbot: QtBot, now: float, side: int
    ) -> None:
        bright = pixels(make_strip(qtbot, 96.0, now, grey=60))[:220].min(axis=2) > 220
        left, right = int(bright[:, :90].sum()), int(bright[:, -90:].sum())
        assert (left > 500) == (side < 0)
        assert (right > 500) == (side > 0)

    def test_every_new_picture_is_shown(self, qtbot: QtBot) -> None:
        strip = make_strip(qtbot, 96.0, None)
        for grey in (40, 80, 120, 160):
            picture = np.full((220, 750, 3), grey, np.uint8)
            strip.set_state(Scale(96.0, goal_words="goal 96°"), picture)
            assert pixels(strip)[180, 375, 0] == grey

    def test_lost_heading_shows_the_goal_alone(self, qtbot: QtBot) -> None:
        shown = pixels(make_strip(qtbot, 96.0, None))[:220]
        assert not (shown.min(axis=2) > 230).any()

    def test_arrow_keys_are_reported(self, qtbot: QtBot) -> None:
        strip = make_strip(qtbot, 96.0, 73.0)
        steps: list[float] = []
        strip.stepped.connect(steps.append)
        QTest.keyClick(strip, Qt.Key.Key_Right)
        QTest.keyClick(strip, Qt.Key.Key_Left, Qt.KeyboardModifier.ShiftModifier)
        assert steps == [1.0, -10.0]

    def test_it_says_what_it_shows(self, qtbot: QtBot) -> None:
        strip = make_strip(qtbot, 96.0, 73.0)
        assert strip.accessibleName()
        assert strip.accessibleDescription() == "A"
        strip.set_state(None)
        assert strip.accessibleDescription() == ""
        pixels(strip)

    @pytest.mark.parametrize("size", [(320, 200), (1648, 560)])
    def test_any_size_paints(self, qtbot: QtBot, size: tuple[int, int]) -> None:
        strip = make_strip(qtbot, -178.0, 179.0, (-180.0, 180.0))
        strip.resize(*size)
        assert pixels(strip).shape == (size[1], size[0], 3)


class TestArrow:
    def make(self, qtbot: QtBot, sign: str) -> TurnArrow:
        arrow = TurnArrow()
        qtbot.addWidget(arrow)
        arrow.resize(arrow.sizeHint())
        arrow.set_sign(sign)  # type: ignore[arg-type]
        return arrow

    def test_clockwise_has_its_head_at_the_right_and_is_mirrored_otherwise(
        self, qtbot: QtBot
    ) -> None:
        right = inked(self.make(qtbot, "clockwise"))
        left = inked(self.make(qtbot, "counter-clockwise"))
        assert right[:, 160:].sum() > 1.2 * right[:, :160].sum()
        # Edges of the two may differ by how half-covered pixels round.
        assert (right != left[:, ::-1]).mean() < 0.005

    def test_inside_the_light_it_is_a_green_check(self, qtbot: QtBot) -> None:
        shown = pixels(self.make(qtbot, "check"))
        assert ((shown[..., 1] - shown[..., 0]) > 60).sum() > 1500
        assert not inked(self.make(qtbot, "none")).any()

    def test_it_names_its_sign(self, qtbot: QtBot) -> None:
        assert self.make(qtbot, "clockwise").accessibleName() == NAMES["clockwise"]
        assert self.make(qtbot, "check").accessibleName() == NAMES["check"]

    def test_in_contrast_it_is_black(self, qtbot: QtBot) -> None:
        set_theme("contrast")
        shown = pixels(self.make(qtbot, "clockwise"))
        assert shown.min() == 0
        assert (shown[..., 0] - shown[..., 2]).max() < 30


class TestBigDegrees:
    def make(self, qtbot: QtBot, width: int, degrees: int | None, words: str) -> BigDegrees:
        number = BigDegrees()
        qtbot.addWidget(number)
        number.resize(width, number.sizeHint().height())
        number.set_value(degrees, words)
        return number

    def test_two_figures_have_the_designed_size(self, qtbot: QtBot) -> None:
        number = self.make(qtbot, 432, 23, "to go")
        assert number.figure_font().pixelSize() == 224
        assert number.sizeHint().height() == 176
        assert number.accessibleName() == "23° to go"

    @pytest.mark.parametrize("width", [200, 300, 432])
    @pytest.mark.parametrize(("degrees", "words"), [(4, "to the best"), (179, "to go"), (6, "")])
    def test_nothing_is_cut_off(self, qtbot: QtBot, width: int, degrees: int, words: str) -> None:
        ink = inked(self.make(qtbot, width, degrees, words))
        assert ink.any()
        assert not ink[:, 0].any()
        assert not ink[:, -1].any()
        assert not ink[0].any()

    def test_it_shrinks_with_the_width(self, qtbot: QtBot) -> None:
        wide = self.make(qtbot, 432, 179, "to go").figure_font().pixelSize()
        narrow = self.make(qtbot, 250, 179, "to go").figure_font().pixelSize()
        assert 48 <= narrow < wide < 224

    def test_lost_heading_shows_nothing(self, qtbot: QtBot) -> None:
        assert not inked(self.make(qtbot, 432, None, "to go")).any()


class TestScale:
    def test_blue_is_at_the_left_and_orange_at_the_right(self, qtbot: QtBot) -> None:
        scale = WeightScale()
        qtbot.addWidget(scale)
        scale.resize(680, 20)
        row = pixels(scale)[10]
        ends = np.flatnonzero(np.abs(row - 0x6E).max(axis=1) < 4)
        assert 300 < float(np.median(ends)) < 380  # grey in the middle of the bar
        assert row[170, 2] - row[170, 0] > 60
        assert row[500, 0] - row[500, 2] > 60
        assert "minus should be darker" in scale.accessibleName()

    def test_signs_stand_on_the_colours(self, qtbot: QtBot) -> None:
        legend = WeightLegend()
        qtbot.addWidget(legend)
        legend.resize(legend.sizeHint())
        shown = pixels(legend, 2.0)
        tile = shown[:32, :32]
        assert tuple(tile[4, 16]) == (255, 140, 30)
        assert tile[16, 16].max() < 40
        assert (tile.max(axis=2) < 60).sum() > 40
        assert all(words in legend.accessibleName() for _, words in legend._words)


class TestBrushRing:
    def draw(self, ground: str, sign: str, radius: float = 30.0) -> QImage:
        image = QImage(100, 100, QImage.Format.Format_RGB32)
        image.fill(QColor(ground))
        painter = QPainter(image)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        draw_brush_ring(painter, (50.0, 50.0), radius, 14.0, sign)  # type: ignore[arg-type]
        painter.end()
        return image

    @pytest.mark.parametrize("ground", ["#ffffff", "#ff8c1e", "#000000"])
    def test_it_holds_on_any_picture(self, qapp: object, ground: str) -> None:
        image = self.draw(ground, "plus")
        line = [image.pixelColor(x, 50).lightness() for x in range(74, 88)]
        assert max(line) > 200
        assert min(line) < 60

    def test_plus_has_an_upright_arm_and_minus_has_none(self, qapp: object) -> None:
        for sign, upright in (("plus", True), ("minus", False)):
            image = self.draw("#6e6e6e", sign)
            assert (image.pixelColor(50, 46).lightness() > 200) == upright
            assert image.pixelColor(46, 50).lightness() > 200

    def test_small_rings_stay_empty(self, qapp: object) -> None:
        image = self.draw("#6e6e6e", "plus", radius=7.0)
        assert image.pixelColor(50, 50) == QColor("#6e6e6e")
        assert theme().name == "dark"


class TestPlan:
    """The walk from above."""

    PLAN = PlanDrawing(
        marks=(
            PlanMark("now", 30.0),
            PlanMark("goal", 90.0),
            PlanMark("start", 0.0),
            PlanMark("light", 200.0),
            PlanMark("lamp", 110.0, "LED panel"),
            PlanMark("background", -90.0),
        ),
        nose_deg=30.0,
        way=(30.0, 60.0),
        arc_deg=(80.0, 100.0),
    )
    WORDS = plan_words(PLAN, "Walk to your left")

    def make(self, qtbot: QtBot, size: tuple[int, int] = (274, 316)) -> PlanView:
        view = PlanView()
        qtbot.addWidget(view)
        view.setFixedSize(*size)
        view.set_plan(self.PLAN, self.WORDS)
        return view

    @pytest.mark.parametrize(("up", "side"), [(180.0, -1.0), (0.0, 1.0)])
    def test_clockwise_goes_to_the_left_of_who_stands_at_the_foot(
        self, qtbot: QtBot, up: float, side: float
    ) -> None:
        view = self.make(qtbot)
        view.set_plan(replace(self.PLAN, up_deg=up), self.WORDS)
        (x, y), ring = view.centre, view.ring
        found = pixels(view)[round(y), round(x + side * ring)]
        amber = theme().c.amberfill
        assert np.abs(found - [amber.red(), amber.green(), amber.blue()]).max() <= 3
        # The light's band goes on behind the goal, in green.
        beyond = view._at(98.0, view.ring + 4.0)
        red, green, _ = pixels(view)[round(beyond[1]), round(beyond[0])]
        assert green > red + 60

    @pytest.mark.parametrize("size", [(274, 316), (168, 264), (237, 190), (500, 420), (420, 208)])
    def test_no_word_is_cut_or_lies_over_another(self, qtbot: QtBot, size: tuple[int, int]) -> None:
        view = self.make(qtbot, size)
        for goal in range(-180, 180, 15):
            marks = tuple(
                replace(mark, turn_deg=mark.turn_deg + goal)
                if mark.kind in ("goal", "background")
                else mark
                for mark in self.PLAN.marks
            )
            view.set_plan(replace(self.PLAN, marks=marks), self.WORDS)
            view.grab()
            words = view._boxes[1 + 5 :]  # after the head, and what is no word
            assert len(words) >= 3, "at least you, goal and start are named"
            inside = QRectF(view.rect())
            for first, area in enumerate(words):
                assert inside.contains(area)
                assert not any(area.intersects(other) for other in words[:first])

    @pytest.mark.parametrize("goal", [-65.0, -25.0, 15.0, 55.0])
    def test_a_word_stands_on_the_far_side_of_the_other_mark(
        self, qtbot: QtBot, goal: float
    ) -> None:
        view = self.make(qtbot, (500, 420))
        marks = (PlanMark("now", goal + 12.0), PlanMark("goal", goal))
        plan = PlanDrawing(marks=marks, up_deg=0.0)
        view.set_plan(plan, replace(plan_words(plan), title="You, from above " * 3))
        view.grab()
        turns = []
        for area in view._boxes[1 + 2 :]:
            x, y = area.center().x() - view.centre[0], area.center().y() - view.centre[1]
            turns.append(difference(math.degrees(math.atan2(x, -y)), goal))
        # What counts least is drawn last: you first, then the goal.
        assert len(turns) == 2
        assert turns[0] > turns[1]
        assert not any(area.top() < 20.0 for area in view._boxes[1 + 2 :])

    @pytest.mark.parametrize(("nose", "lens"), [(30.0, 30.0), (0.0, 30.0), (75.0, 30.0)])
    def test_arrows_show_where_the_nose_points_and_how_the_lens_looks(
        self, qtbot: QtBot, nose: float, lens: float
    ) -> None:
        view, apart = self.make(qtbot), nose != lens
        marks = (PlanMark("now", lens), PlanMark("nose", nose))
        plan = PlanDrawing(marks=marks, nose_deg=nose, lens_deg=lens, yaw_deg=round(lens - nose))
        view.set_plan(plan, plan_words(plan))
        ground = pixels(view)[2:-2, 2:-2]
        bright = (ground.min(axis=2) > 180).astype(float)

        def along(turn: float, start: float, stop: float) -> float:
            spots = [
                view._at(turn, view.ring * (start + k * (stop - start) / 40)) for k in range(41)
            ]
            near = [
                bright[round(y) - 4 : round(y) + 1, round(x) - 4 : round(x) + 1] for x, y in spots
            ]
            return float(np.mean([one.max() for one in near]))

        assert along(nose, 0.32, 0.52) > 0.9
        assert (0.3 < along(lens, 0.6, 0.82) < 1.0) == apart, "the line of sight is dashed"
        assert along(2.0 * lens - nose + (0 if apart else 60), 0.32, 0.52) < 0.3
        assert len(view._boxes) == (1 + 1 + 3 + 1 + 2 if apart else 1 + 1 + 1 + 1)

    def test_it_is_told_in_words(self, qtbot: QtBot) -> None:
        view = self.make(qtbot)
        assert view.accessibleName() == "From above"
        assert view.accessibleDescription().startswith("Walk to your left. At the goal, light: ")
        view.set_plan(PlanDrawing(), PlanWords())
        assert view.accessibleDescription() == ""
