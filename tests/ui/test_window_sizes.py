"""The window on the screens that people have: it fits, and nothing in it is out of reach."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QRect
from PySide6.QtWidgets import QAbstractScrollArea, QApplication, QWidget

from app.core.base.paths import resources
from app.ui.screens.paint.screen_view import PaintScreen
from app.ui.screens.probe.capture.capture import Running
from app.ui.screens.probe.capture.distant_sign import DistantSign
from app.ui.screens.probe.live import Live, RoughCard
from app.ui.screens.probe.screen import ProbeState
from app.ui.screens.probe.screen_view import ProbeScreen
from app.ui.screens.styles.screen_view import StylesScreen
from app.ui.screens.turn.screen_view import TurnScreen
from app.ui.shell.start import App
from app.ui.shell.window import SMALLEST
from app.ui.shell.window_frame import fitted
from app.ui.widgets.labels import Text
from benchmarks.ui.screenshots.command import Robot
from tests.helpers.cases import sample_first
from tests.helpers.whole_window import OneWebcam, open_light, opened
from tests.ui.test_window_reach import (
    OVERLAYS,
    SCREENS,
    bring,
    cut_off,
    dress,
    is_operated,
    overlapping,
    said,
)
from tests.ui.test_window_sides import StillWebcam

# What a title bar of 30 and a task bar of 40 leave of 1280 x 720, 1440 x 900, and 2560 x 1440 at
# twice the size; and the least that is promised.
SIZES = (
    ((1024, 640), 1.0),
    ((1440, 830), 1.5),
    ((1280, 650), 1.0),
    ((1440, 830), 1.0),
    ((1280, 800), 1.0),
    ((2560, 1370), 2.0),
)
MAIN = {
    "probe": "See the styles",
    "styles": "Turn to this",
    "paint": "Save as my style",
    "turn": "Start alignment",
    "light": "Use the phone",
}


@pytest.fixture(scope="module")
def window(
    qapp: QApplication, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[App, Robot]]:
    home = tmp_path_factory.mktemp("home")
    with opened(home, OneWebcam(StillWebcam()), sounds=False) as (app, robot):
        open_light(app, robot, resources() / "demo" / "location" / "probe-1.exr")
        app.model.update(chosen="right-window")
        app.notify.tell("A message of the usual length, that says what to do.")
        yield app, robot


def out_of_reach(root: QWidget) -> list[str]:
    """Controls and words that lie outside of what holds them, unless it can scroll to them."""
    found = []
    for widget in root.findChildren(QWidget):
        if widget.isVisible() and (isinstance(widget, Text) or is_operated(widget)):
            here, rect = widget, widget.rect()
            while here is not root:
                rect.translate(here.pos())
                parent = here.parentWidget()
                assert parent is not None
                area = parent.parentWidget()
                if isinstance(area, QAbstractScrollArea) and area.viewport() is parent:
                    # What is scrolled is all there as soon as it lies within the content.
                    here, rect = area, area.rect()
                    continue
                if not parent.rect().contains(rect) and rect.isValid():
                    found.append(f"{said(widget)} at {rect} of {said(parent)} {parent.size()}")
                    break
                here = parent
    return found


def whole(widget: QWidget) -> bool:
    """Whether all of a widget can be seen without scrolling."""
    return widget.visibleRegion().boundingRect() == widget.rect()


def numbers(root: QWidget) -> list[QWidget]:
    """The turn in large figures, of whichever screen is in front."""
    found: list[QWidget] = [one.detail.words for one in root.findChildren(StylesScreen)]
    found += [one.column._degrees for one in root.findChildren(TurnScreen)]
    found += [one.live._numbers._turn for one in root.findChildren(PaintScreen)]
    return [one for one in found if one.isVisible()]


@pytest.mark.slow
@pytest.mark.parametrize(("size", "scale"), sample_first(SIZES, 2))
def test_every_control_is_inside_on_every_screen(
    window: tuple[App, Robot], size: tuple[int, int], scale: float
) -> None:
    app, robot = window
    dress(app, robot, "dark", scale, size)
    found = []
    for what in (*SCREENS, *OVERLAYS):
        root = bring(app, robot, what)
        assert root.window().size().toTuple() == size
        root.grab()
        troubles = [*out_of_reach(root), *cut_off(root), *overlapping(root)]
        if what in MAIN and not whole(robot.find(MAIN[what])):
            troubles.append(f"{MAIN[what]} has to be scrolled to")
        troubles += [
            f"{said(one)} has to be scrolled to" for one in numbers(root) if not whole(one)
        ]
        found += [f"{what}: {trouble}" for trouble in troubles]
    app.commands.close_overlay()
    assert not found, "\n" + "\n".join(found)


@pytest.mark.slow
@pytest.mark.parametrize(("size", "scale"), sample_first(SIZES, 2))
def test_a_capture_under_way_and_an_empty_place_fit_as_well(
    window: tuple[App, Robot], size: tuple[int, int], scale: float
) -> None:
    app, robot = window
    dress(app, robot, "dark", scale, size)
    bring(app, robot, "probe")
    view = app.window.front
    assert isinstance(view, ProbeScreen)
    picture = np.full((160, 320, 3), 90, np.uint8)
    signs = (
        DistantSign("act", "10", "Kneel now"),
        DistantSign("act", "Frame 13 of 13", "Stay down", 0.9, picture=picture),
        DistantSign("move", "You may move", "Downloading frame 13 of 13", picture=picture),
    )
    card = RoughCard(
        "Clamshell", "sitter’s right (camera left)", "180°", "counter-clockwise",
        "in reach, soft", "rough, needs the bracket", "counterclockwise", True, "Clamshell",
    )  # fmt: skip
    shown = app.window.front_presenter.resolve()  # type: ignore[union-attr]
    states: dict[str, ProbeState] = {
        "Capture": replace(shown, picture=None, findings=None, lamps=(), has_place=False),
        "Stop the preview": replace(shown, live=Live(picture, (card,) * 3, "Rough")),
    }
    for sign in signs:
        running = Running("A rough answer.", sign=sign)
        states[f"Cancel {sign.big}"] = replace(shown, running=running, has_place=False)
    found = []
    # A camera that is still looked for must not show another state meanwhile.
    app.window.front_presenter.detach()  # type: ignore[union-attr]
    for main, state in states.items():
        view.show_state(state)
        robot.settle()
        view.grab()
        found += [*out_of_reach(app.window), *cut_off(app.window), *overlapping(app.window)]
        if not whole(robot.find("Cancel" if main.startswith("Cancel") else main)):
            found.append(f"{main} has to be scrolled to")
    app.window.front_presenter.attach(view)  # type: ignore[union-attr]
    assert not found, "\n" + "\n".join(found)


@pytest.mark.parametrize(
    ("wanted", "room", "got"),
    [
        # A first start on a small screen; a second monitor that is no longer there, to the right
        # and above; one that fits already; a room that does not begin at 0, 0.
        (QRect(0, 0, 1440, 900), QRect(4, 32, 1272, 684), QRect(4, 32, 1272, 684)),
        (QRect(2000, 300, 1200, 800), QRect(0, 30, 1440, 830), QRect(240, 60, 1200, 800)),
        (QRect(100, -900, 1200, 800), QRect(0, 30, 1440, 830), QRect(100, 30, 1200, 800)),
        (QRect(10, 40, 1100, 700), QRect(0, 30, 1440, 830), QRect(10, 40, 1100, 700)),
        (QRect(0, 0, 1440, 900), QRect(1920, 0, 1280, 720), QRect(1920, 0, 1280, 720)),
    ],
)
def test_a_window_is_made_smaller_before_it_is_moved(
    wanted: QRect, room: QRect, got: QRect
) -> None:
    assert fitted(wanted, room) == got
    assert room.contains(fitted(wanted, room))


def test_size_and_place_are_remembered_within_the_screen(
    window: tuple[App, Robot], qapp: QApplication
) -> None:
    app, _ = window
    screen = qapp.primaryScreen().availableGeometry()
    app.window.setMinimumSize(SMALLEST)
    app.window.setGeometry(QRect(QPoint(5000, 4000), SMALLEST * 2))
    kept = app.window.saveGeometry()
    app.window.restore(kept)
    # Drawn in memory the screen is smaller than any that the window is made for.
    assert screen.contains(app.window.geometry())
    app.window.restore(None)
    assert screen.contains(app.window.geometry())
