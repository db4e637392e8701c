"""Left and right of the second light, with the real search, through the whole window.

A place without a side, dim, and a lamp strong beside it: then the lamp is the key light. Split from
the sitter's left needs it at the sitter's left, which the camera sees at the right.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint
from PySide6.QtWidgets import QApplication

from app.core.base.imaging.images import write_exr
from app.ui.presenters.window_model import Step
from app.ui.screens.light.screen import LightPresenter
from app.ui.screens.light.screen_view import LightScreen
from app.ui.shell.start import App
from benchmarks.ui.screenshots.command import Robot
from tests.helpers.dark_room import Lamp, room
from tests.helpers.whole_window import open_light, opened

LEFT, RIGHT = "the sitter’s left (camera right)", "the sitter’s right (camera left)"


@pytest.fixture(scope="module")
def running(
    qapp: QApplication, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[App, Robot, LightPresenter, LightScreen]]:
    home = tmp_path_factory.mktemp("home")
    rows = np.linspace(1.2, 0.8, 64, dtype=np.float32)
    path = home / "even.exr"
    write_exr(path, np.broadcast_to(rows[:, None, None], (64, 128, 3)).copy())
    with opened(home, sounds=False) as (app, robot):
        open_light(app, robot, path)
        app.window._notify.dismiss()
        app.model.update(step=Step.LIGHT)
        robot.settle()
        robot.click("Use the phone")
        presenter = app.window._presenter_of("light")
        assert isinstance(presenter, LightPresenter)
        robot.click("Night street, 5 lx")
        robot.wait(lambda: presenter.front is not None, "the answers")
        view = app.window.findChild(LightScreen)
        assert isinstance(view, LightScreen)
        yield app, robot, presenter, view


@pytest.mark.slow
@pytest.mark.parametrize(("style", "sign"), [("left-split", 1), ("right-split", -1)])
def test_the_lamp_of_a_side_is_drawn_and_said_on_that_side(
    running: tuple[App, Robot, LightPresenter, LightScreen], style: str, sign: int
) -> None:
    app, robot, presenter, view = running
    app.model.update(step=Step.LIGHT)
    presenter.choose(style)
    robot.wait(lambda: not presenter.resolve().detail.stale, "the picture")
    robot.settle()
    state = presenter.resolve()
    assert state.detail.key == style
    # Where it is held, by the frame of the placements.
    assert 55.0 < sign * state.heads.azimuth_deg < 115.0
    # In words, twice.
    side, other = (LEFT, RIGHT) if sign > 0 else (RIGHT, LEFT)
    assert side in state.hold.hold
    assert other not in state.hold.hold
    # In the three drawings.
    above, aside, sky = view.middle.plots
    place = above.lamp_place()
    assert place is not None
    assert sign * (place[0] - above.width() / 2.0) > 60.0
    assert view.middle.side.from_left is (sign > 0)
    place = sky.lamp_place()
    assert place is not None
    assert sign * (place[0] - sky.width() / 2.0) > 60.0
    front, back = aside.place_of(sign * 10.0, 0.0), aside.place_of(sign * 170.0, 0.0)
    assert sign * (back[0] - front[0]) > 0, "the camera is where the face looks"
    # In the pictures: the lit half of the face.
    for picture in (state.detail.with_lamp, state.detail.target):
        assert picture is not None
        rows, columns = picture.shape[:2]
        tone = picture.astype(float).mean(axis=2)[rows // 4 : 3 * rows // 4]
        half = columns // 2
        right, left = tone[:, half:].mean(), tone[:, :half].mean()
        assert sign * (right - left) > 5.0
    # In the numbers.
    azimuth = dict(state.detail.numbers)["Lamp azimuth"]
    assert azimuth.startswith("−") is (sign < 0)


@pytest.mark.slow
@pytest.mark.parametrize("sign", [1, -1])
def test_a_lamp_that_is_moved_lights_the_side_that_is_said_at_the_power_that_is_said(
    running: tuple[App, Robot, LightPresenter, LightScreen], sign: int
) -> None:
    app, robot, presenter, view = running
    app.model.update(step=Step.LIGHT)
    presenter.choose("butterfly")
    robot.settle()

    def lit() -> tuple[float, float]:
        """Tones of the picture's left and right half with the lamp held at the side."""
        robot.wait(lambda: not presenter.resolve().detail.stale, "the picture")
        picture = presenter.resolve().detail.with_lamp
        assert picture is not None
        rows, columns = picture.shape[:2]
        tone = picture.astype(float).mean(axis=2)[rows // 4 : 3 * rows // 4]
        return float(tone[:, : columns // 2].mean()), float(tone[:, columns // 2 :].mean())

    # By mouse, on the drawing from above: the sitter's left is at its right.
    above = view.middle.above
    start = QPoint(*(round(value) for value in above.lamp_place() or (0, 0)))
    stop = QPoint(*(round(value) for value in above.place_of(sign * 85.0, 0.0)))
    robot.drag(above, [start, stop])
    while presenter.resolve().detail.stronger:
        presenter.step_power(1)
    left, right = lit()
    state = presenter.resolve()
    side, other = (LEFT, RIGHT) if sign > 0 else (RIGHT, LEFT)
    assert side in state.hold.hold
    assert other not in state.hold.hold
    assert state.hold.hold.endswith(", at full power")
    assert side[:16] in view.middle.map.accessibleDescription()
    assert sign * (right - left) > 5.0
    full = sign * (right - left)
    # Turned down by five stops it hardly counts any more; where it is held stays.
    azimuth = state.heads.azimuth_deg
    for _ in range(5):
        robot.click("Turn the lamp down")
    left, right = lit()
    state = presenter.resolve()
    assert state.hold.hold.endswith(", at 1/32 power")
    assert state.detail.power == "1/32, 5 stops down"
    assert state.heads.azimuth_deg == azimuth
    assert sign * (right - left) < 0.5 * full
    presenter.go_best()


@pytest.mark.slow
def test_a_lamp_of_ones_own_is_on_the_side_that_is_said(
    running: tuple[App, Robot, LightPresenter, LightScreen], tmp_path: Path
) -> None:
    app, robot, presenter, _ = running
    app.model.update(step=Step.LIGHT)
    # In its panorama it is far off to the right and high up: that is turned away.
    light, mask = room(Lamp("box", (0.3, 0.4), 70.0, 30.0, level=300.0), 0.02, shape=(128, 256))
    path = tmp_path / "square.exr"
    write_exr(path, light, 1.0)
    assert mask.any()
    presenter.lamps.take([path])
    robot.wait(lambda: presenter.lamps.own is not None, "the lamp")

    def placed() -> bool:
        answers = presenter.work.answers
        return answers is not None and answers.hand.lamp is presenter.lamps.own

    robot.wait(placed, "its places")
    try:
        for style, sign in (("left-split", 1), ("right-split", -1)):
            presenter.choose(style)
            robot.wait(lambda: not presenter.resolve().detail.stale, "the picture")
            state = presenter.resolve()
            assert 50.0 < sign * state.heads.azimuth_deg < 120.0
            assert state.hold.hold.startswith("Hold “square” ")
            assert (LEFT if sign > 0 else RIGHT) in state.hold.hold
            picture = state.detail.with_lamp
            assert picture is not None
            tone = picture.astype(float).mean(axis=2)[picture.shape[0] // 4 :]
            half = tone.shape[1] // 2
            assert sign * (tone[:, half:].mean() - tone[:, :half].mean()) > 5.0
            assert state.detail.power == ""
    finally:
        presenter.take_lamp("phone")
        robot.wait(lambda: not placed(), "the phone again")
        robot.wait(lambda: not presenter.work.busy, "its places")


@pytest.mark.slow
def test_the_turn_that_is_said_is_the_turn_that_is_gone_to(
    running: tuple[App, Robot, LightPresenter, LightScreen],
) -> None:
    app, robot, presenter, _ = running
    app.model.update(step=Step.LIGHT)
    presenter.choose("left-split")
    robot.settle()
    hold = presenter.resolve().hold
    said = hold.turn
    # Where the light is even all around, no turn is needed, and the button does not ask for one.
    assert (said == "No turn needed") is (hold.go == "Hold the lamp now")
    robot.click(hold.go)
    robot.wait(lambda: app.model.step is Step.TURN, "what the lamp gives there")
    goal = app.model.target_turn_deg
    assert goal is not None
    number = re.search(r"\d+", said)
    assert abs(goal) == pytest.approx(int(number.group()) if number else 0.0, abs=0.5)
    assert ("counter" in said) is (round(goal) < 0)


@pytest.mark.slow
def test_only_what_an_arm_reaches_is_offered(
    running: tuple[App, Robot, LightPresenter, LightScreen],
) -> None:
    app, robot, presenter, view = running
    app.model.update(step=Step.LIGHT)
    robot.settle()
    view.lamp.arm.click()
    robot.wait(lambda: presenter.resolve().sky.closed is not None, "the hatch")
    answers = presenter.work.answers
    assert answers is not None
    assert not answers.is_open.all()
    assert all(answers.is_open[one.placement] for one in answers.placements)
    view.lamp.arm.click()
    robot.wait(lambda: presenter.resolve().sky.closed is None, "no hatch")


@pytest.mark.slow
def test_the_number_where_the_lamp_belongs_is_that_of_its_picture(
    running: tuple[App, Robot, LightPresenter, LightScreen],
) -> None:
    _, robot, presenter, _ = running
    answers = presenter.work.answers
    assert answers is not None
    for name in ("left-split", "butterfly", "left-rembrandt"):
        presenter.choose(name)
        one = answers.of(name)
        assert one is not None
        robot.wait(lambda: not presenter.resolve().detail.stale, "the picture")
        view = presenter.work.view
        assert view is not None
        # The search counts whole texels of the turn; the picture is of the refined one.
        assert view.match == pytest.approx(one.match, abs=1.5)
        assert view.match > one.match - 0.3
