"""Left and right, clockwise and not, with one lamp at a known place, through the whole window.

The frame: a panorama's middle column is azimuth 0, azimuths grow to its right, which is clockwise
seen from above. A sitter turned by t faces azimuth t and has azimuth t - 90 at their left hand. So
a lamp at p is at their left side once t = p + 90. Walking, the photographer faces the sitter: from
above, with the sitter in the middle, clockwise around is to the walker's left; who turns on the
spot turns clockwise by turning to the right.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QFileDialog
from pytestqt.qtbot import QtBot

from app.core.base.angles import difference, wrap
from app.core.base.imaging.images import write_exr
from app.ui.plots.guidance import BigDegrees, TurnArrow
from app.ui.presenters.window_model import Step
from app.ui.screens.styles.cards_view import StyleCard, TurnWords
from app.ui.screens.turn.guidance_view import GuideColumn, LargeWords
from app.ui.shell.start import App
from app.ui.widgets.choices import SegmentedChoice
from app.ui.widgets.dialogs import Term
from app.ui.widgets.labels import Text
from benchmarks.ui.screenshots.command import Robot
from tests.helpers.pdf import pdf_text
from tests.helpers.turn_rig import FakeWebcam, frame_of, see_what_is_written
from tests.helpers.whole_window import OneWebcam, open_light, opened, say, until

LAMPS = (60.0, -60.0)
SPLITS = {"left-split": 90.0, "right-split": -90.0}
WAYS = {1: "clockwise", -1: "counter-clockwise"}
WALK = {1: "Walk to your left", -1: "Walk to your right"}
SELFIE = {1: "Turn to your right", -1: "Turn to your left"}


class StillWebcam(FakeWebcam):
    """Shows the same view until it is pointed elsewhere."""

    def open(self) -> None:
        super().open()
        self.point(0.0)

    def point(self, heading_deg: float) -> None:
        self.send(frame_of(heading_deg))


def panorama(path: Path, azimuth_deg: float, elevation_deg: float = 15.0) -> Path:
    """Write 256 x 128 of nearly nothing with one small lamp, by the rule of the file's columns."""
    rows, columns = 128, 256
    azimuths = 360.0 * ((np.arange(columns) + 0.5) / columns - 0.5)
    elevations = 180.0 * (0.5 - (np.arange(rows) + 0.5) / rows)
    aside = np.abs((azimuths - azimuth_deg + 180.0) % 360.0 - 180.0)
    lit = np.hypot(aside[None, :], elevations[:, None] - elevation_deg) < 4.0
    assert 10 < lit.sum() < 100
    picture = np.full((rows, columns, 3), 0.02, np.float32)
    picture[lit] = 200.0
    write_exr(path, picture)
    return path


@pytest.fixture(scope="module", params=LAMPS, ids=["lamp-right-of-middle", "lamp-left-of-middle"])
def lamp_deg(request: pytest.FixtureRequest) -> float:
    return float(request.param)


@pytest.fixture(scope="module")
def webcam() -> StillWebcam:
    return StillWebcam()


@pytest.fixture(scope="module")
def running(
    qapp: QApplication,
    tmp_path_factory: pytest.TempPathFactory,
    lamp_deg: float,
    webcam: StillWebcam,
) -> Iterator[tuple[App, Robot]]:
    home = tmp_path_factory.mktemp("home")
    devices = OneWebcam(webcam)
    with pytest.MonkeyPatch.context() as patch:
        see_what_is_written(patch)
        with opened(home, devices, camera_looks="sitter", sounds=False) as (app, robot):
            open_light(app, robot, panorama(home / "lamp.exr", lamp_deg))
            yield app, robot


@pytest.fixture
def window(qtbot: QtBot, running: tuple[App, Robot]) -> tuple[App, Robot]:
    """The window as it is after opening, with the marker at the middle of the panorama."""
    app, robot = running
    app.place_controller.move_front(0.0)
    app.window._notify.dismiss()
    robot.wait(lambda: not app.runner.running("solve"), "solving")
    return running


def turn_of(app: App, style: str) -> float:
    return next(one.turn_refined_deg for one in app.model.results if one.name == style)


def show_style(app: App, robot: Robot, style: str) -> StyleCard:
    """Choose a style by clicks on its card and its side; cards and detail are up to date then."""
    app.model.update(step=Step.STYLES, painting=None)
    robot.wait(lambda: not app.runner.running("styles-pictures"), "the pictures")
    until(robot, lambda: card_of(robot, style), "the card")
    card = card_of(robot, style)
    robot.click_at(card if card.state.key == style else card.switch)
    assert app.model.chosen == style
    robot.settle()
    return card_of(robot, style)


def card_of(robot: Robot, style: str) -> StyleCard:
    cards = robot.window.findChildren(StyleCard)
    return next(c for c in cards if style in (c.state.key, c.state.other) and c.isVisible())


def detail_of(robot: Robot) -> tuple[int, str]:
    """Number and direction in the detail, as they stand in its labels."""
    words = robot.window.findChild(TurnWords)
    assert words is not None
    shown: list[Text | Term] = [*words.findChildren(Text), *words.findChildren(Term)]
    texts = [text.text() for text in shown if text.isVisible()]
    number = next(text for text in texts if re.fullmatch(r"\d+°", text))
    return int(number[:-1]), next(text for text in texts if text in WAYS.values())


def go_to_turn(app: App, robot: Robot, mode: str) -> None:
    if app.model.step != "turn":
        robot.press(Qt.Key.Key_Return)
    assert app.model.step == "turn"
    column = robot.window.findChild(GuideColumn)
    assert column is not None
    chooser = column.findChild(SegmentedChoice)
    assert chooser is not None
    robot.click_at(chooser.part(mode))
    assert app.model.settings.mode == mode


@dataclass(frozen=True)
class Shown:
    """What stands on the Turn screen."""

    sign: str
    number: int | None
    words: tuple[str, ...]


def guidance(robot: Robot) -> Shown:
    column = robot.window.findChild(GuideColumn)
    assert column is not None
    arrow, degrees = column.findChild(TurnArrow), column.findChild(BigDegrees)
    assert arrow is not None
    assert degrees is not None
    found = re.match(r"(\d+)°", degrees.accessibleName())
    return Shown(
        arrow.sign,
        int(found[1]) if found else None,
        tuple(one.words for one in column.findChildren(LargeWords)),
    )


def pointed(
    robot: Robot, webcam: StillWebcam, turn_deg: float, number: int, way: str = ""
) -> Shown:
    """Let the camera look at a sitter who has turned so far: it points the other way.

    Args:
        way: Way of the number that must be shown; until it is, the number changes with the heading.
    """
    webcam.point(wrap(turn_deg + 180.0))

    def shown() -> bool:
        now = guidance(robot)
        return now.number == number and way in ("", now.sign)

    robot.wait(shown, f"{number}° {way} to go")
    return guidance(robot)


def round_half_up(turn: float) -> int:
    """Whole degrees by another rule than the program's own."""
    return math.floor(abs(turn) + 0.5)


def test_a_split_is_a_quarter_turn_from_the_lamp(
    window: tuple[App, Robot], lamp_deg: float
) -> None:
    app, robot = window
    for style, aside in SPLITS.items():
        expected = wrap(lamp_deg + aside)
        found = turn_of(app, style)
        assert abs(difference(found, expected)) < 4.0
        card = show_style(app, robot, style)
        sign = 1 if found > 0 else -1
        side = "left" if aside > 0 else "right"
        other = "right" if aside > 0 else "left"
        number = round_half_up(found)
        assert card.state.turn == f"{number}°"
        assert card.state.way == WAYS[sign]
        assert f"from the sitter’s {side}, camera {other}" in card.accessibleName()
        assert f"turn {number} degrees {WAYS[sign]}" in card.accessibleName()
        assert detail_of(robot) == (number, WAYS[sign])


@pytest.mark.slow
@pytest.mark.parametrize("style", SPLITS)
def test_feet_and_arrow_for_both_who_walk_and_who_turn(
    window: tuple[App, Robot], webcam: StillWebcam, style: str
) -> None:
    app, robot = window
    show_style(app, robot, style)
    turn = turn_of(app, style)
    number, sign = round_half_up(turn), 1 if turn > 0 else -1
    for mode, feet in (("walk", WALK), ("selfie", SELFIE)):
        go_to_turn(app, robot, mode)
        pointed(robot, webcam, 0.0, number)
        # A quarter turn may also be what stood there before, the other way.
        robot.wait(lambda: guidance(robot).sign == WAYS[sign], "the way there")
        shown = guidance(robot)
        assert WAYS[sign] in shown.words
        assert feet[sign] in shown.words
        assert feet[-sign] not in shown.words
        # A quarter turn short of the goal, then a quarter turn beyond it.
        goal = sign * number
        short = pointed(robot, webcam, goal - 90.0, 90)
        assert (short.sign, WALK[1] in short.words, SELFIE[1] in short.words) == (
            "clockwise",
            mode == "walk",
            mode == "selfie",
        )
        webcam.point(wrap(goal + 180.0))
        robot.wait(lambda: guidance(robot).sign == "check", "being in the light")
        webcam.point(wrap(goal + 90.0 + 180.0))
        robot.wait(lambda: guidance(robot).sign == "counter-clockwise", "the way back")
        back = guidance(robot)
        assert back.number == 90
        assert feet[-1] in back.words


def test_the_marker_moves_every_number_that_is_shown(
    window: tuple[App, Robot], webcam: StillWebcam, lamp_deg: float
) -> None:
    app, robot = window
    # Away from the middle on the lamp's side: no turn gets so small that one stands in the light.
    moved = math.copysign(25.0, lamp_deg)
    before = {style: turn_of(app, style) for style in SPLITS}
    app.place_controller.move_front(moved)
    robot.wait(lambda: not app.runner.running("solve"), "solving")
    for style, aside in SPLITS.items():
        turn = turn_of(app, style)
        assert difference(turn, wrap(before[style] - moved)) == pytest.approx(0.0, abs=1e-6)
        assert abs(difference(turn, wrap(lamp_deg + aside - moved))) < 4.0
        number, sign = round_half_up(turn), 1 if turn > 0 else -1
        card = show_style(app, robot, style)
        assert (card.state.turn, card.state.way) == (f"{number}°", WAYS[sign])
        assert detail_of(robot) == (number, WAYS[sign])
        go_to_turn(app, robot, "walk")
        # The camera's heading is one of the panorama: who has not turned faces the marker.
        shown = pointed(robot, webcam, moved, number, WAYS[sign])
        assert shown.sign == WAYS[sign]
        assert WALK[sign] in shown.words


def test_the_set_sheet_says_the_same(
    window: tuple[App, Robot], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    app, robot = window
    for style, aside in SPLITS.items():
        file = tmp_path / f"{style}.pdf"
        monkeypatch.setattr(
            QFileDialog, "getSaveFileName", lambda *_, file=file: (str(file), "PDF (*.pdf)")
        )
        show_style(app, robot, style)
        robot.press(Qt.Key.Key_S, Qt.KeyboardModifier.ControlModifier)
        say(app, robot, f"{file.name} saved in")
        turn = turn_of(app, style)
        number, sign = round_half_up(turn), 1 if turn > 0 else -1
        side, other = ("left", "right") if aside > 0 else ("right", "left")
        words = pdf_text(file.read_bytes())
        assert f"{number}°" in words
        assert WAYS[sign] in words
        assert f"{WALK[sign]}, around the sitter." in words
        assert f"Here, {number}° {WAYS[sign]}" in words
        assert f"Light from the sitter’s {side} (camera {other})" in words
        assert WALK[-sign] not in words
        assert SELFIE[sign] not in words
