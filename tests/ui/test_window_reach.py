"""A walk over every widget of every screen: named, reached by keys, whole, and not too small."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import pytest
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractScrollArea,
    QAbstractSlider,
    QApplication,
    QLineEdit,
    QScrollBar,
    QWidget,
)
from pytestqt.qtbot import QtBot

from app.core.base.paths import resources
from app.ui.presenters.window_model import Step
from app.ui.screens.turn.live.question_view import CameraQuestion
from app.ui.shell.start import App
from app.ui.theme import ThemeName, theme
from app.ui.theme.theme import Theme
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.choices import SegmentedChoice
from app.ui.widgets.dialogs import Sheet
from app.ui.widgets.labels import Text
from benchmarks.ui.screenshots.command import Robot
from tests.helpers.whole_window import OneWebcam, open_light, opened
from tests.ui.test_window_sides import StillWebcam

SCREENS = ("probe", "styles", "paint", "turn", "light")
OVERLAYS = ("places", "settings", "find", "messages", "tour", "help", "manual")
SIZES = ((1440, 900), (1024, 700))
LEAST_PX = 12


@pytest.fixture(scope="module")
def running(
    request: pytest.FixtureRequest, qapp: QApplication, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[App, Robot]]:
    home = tmp_path_factory.mktemp("home")
    with opened(home, OneWebcam(StillWebcam()), sounds=False) as (app, robot):
        if request.param != "empty":
            open_light(app, robot, resources() / "demo" / "location" / "probe-1.exr")
            app.model.update(chosen="left-split")
        app.notify.tell("A message of the usual length, that says what to do.")
        app.window._notify.dismiss()
        yield app, robot


@pytest.fixture
def window(qtbot: QtBot, running: tuple[App, Robot]) -> tuple[App, Robot]:
    return running


def dress(app: App, robot: Robot, name: ThemeName, scale: float, size: tuple[int, int]) -> None:
    app.commands.close_overlay()
    app.window.resize(*size)
    # The theme that every test begins with is not the one that the window wears.
    app.window.wear(name, scale)
    robot.settle()
    assert (theme().name, theme().scale) == (name, scale)


def bring(app: App, robot: Robot, what: str) -> QWidget:
    """Bring a screen to the front, or open what lies over it; give what is to be looked at."""
    if what in OVERLAYS:
        app.commands.ask(what)
        robot.wait(lambda: not app.runner.running("places"), "the list of places")
        robot.settle()
        sheet = app.commands.overlay
        assert isinstance(sheet, Sheet)
        return sheet
    app.commands.close_overlay()
    if what == "paint":
        app.model.update(step=Step.STYLES, painting="left-rembrandt")
    else:
        app.model.update(step=Step(what), painting=None)
    for job in ("styles-pictures", "paint-open", "turn-webcams", "cameras", "unfinished"):
        robot.wait(lambda job=job: not app.runner.running(job), job)  # type: ignore[misc]
    app.window._notify.dismiss()
    robot.settle()
    return app.window


def in_sight(root: QWidget) -> list[QWidget]:
    """Everything in a window or sheet that is not scrolled out of sight."""
    return [
        one
        for one in root.findChildren(QWidget)
        if one.isVisible() and not one.visibleRegion().isEmpty()
    ]


def said(widget: QWidget) -> str:
    """Name of a widget for a message."""
    words = widget.accessibleName() or getattr(widget, "text", str)()
    parent = widget.parentWidget()
    return f"{type(widget).__name__} {str(words)[:40]!r} in {type(parent).__name__}"


# -- names and keyboard ----------------------------------------------------------------------------


def is_operated(widget: QWidget) -> bool:
    """Whether somebody can click it or type into it."""
    if isinstance(widget, QScrollBar) or widget.focusProxy() is not None:
        return False
    if widget.testAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents):
        return widget.focusPolicy() != Qt.FocusPolicy.NoFocus
    if isinstance(widget, (QAbstractButton, QAbstractSlider, QLineEdit)):
        return widget.isEnabled()
    focusable = widget.focusPolicy() != Qt.FocusPolicy.NoFocus
    return focusable and widget.isEnabled() and not widget.property("noFocusRing")


def tab_stops(root: QWidget, robot: Robot) -> list[QWidget]:
    """Press Tab until it comes round again."""
    found: list[QWidget] = []
    for _ in range(200):
        focus = QApplication.focusWidget()
        QTest.keyClick(focus or robot.window, Qt.Key.Key_Tab)
        focus = QApplication.focusWidget()
        assert focus is not None
        if focus in found:
            break
        found.append(focus)
    else:
        raise AssertionError("Tab never comes round")
    return found


def reached(stops: list[QWidget], root: QWidget) -> set[QWidget]:
    """What Tab leads to, and by arrows the groups of which it is a part."""
    found = set(stops)
    for group in root.findChildren(Roving):
        members = set(group._members)
        if members & found:
            found |= members
    for row in root.findChildren(SegmentedChoice):
        parts = set(row.findChildren(QAbstractButton))
        if parts & found or row in found:
            found |= parts
    return found


@pytest.mark.slow
@pytest.mark.parametrize("running", ["empty", "place"], indirect=True)
@pytest.mark.parametrize("size", SIZES)
def test_everything_is_named_and_reached_by_keyboard(
    window: tuple[App, Robot], size: tuple[int, int]
) -> None:
    app, robot = window
    dress(app, robot, "dark", 1.0, size)
    nameless, unreached = [], []
    for what in (*SCREENS, *OVERLAYS):
        root = bring(app, robot, what)
        nameless += [
            f"{what}: {said(widget)}"
            for widget in root.findChildren(QWidget)
            if widget.isVisible() and is_operated(widget) and not widget.accessibleName().strip()
        ]
        found = reached(tab_stops(root, robot), root)
        unreached += [
            f"{what}: {said(widget)}"
            for widget in in_sight(root)
            if is_operated(widget)
            and widget not in found
            and not isinstance(widget, QAbstractScrollArea)
            and not only_by_mouse(widget)
        ]
    app.commands.close_overlay()
    assert not nameless, "\n" + "\n".join(nameless)
    assert not unreached, "\n" + "\n".join(unreached)


def only_by_mouse(widget: QWidget) -> bool:
    """Whether a key does the same, so that it need not be a stop."""
    return widget.focusPolicy() == Qt.FocusPolicy.NoFocus and "(" in widget.toolTip()


# -- what is printed -------------------------------------------------------------------------------


def area(widget: QWidget, root: QWidget) -> QRect:
    return QRect(widget.mapTo(root, QPoint(0, 0)), widget.size())


def cut_off(root: QWidget) -> list[str]:
    """Texts and buttons with less room than they need, and those that reach out of their parent."""
    found = []
    for widget in in_sight(root):
        if not isinstance(widget, (Text, QAbstractButton)) or not widget.isVisible():
            continue
        parent = widget.parentWidget()
        if parent is not None and not parent.rect().contains(widget.geometry()):
            found.append(f"{said(widget)} reaches out: {widget.geometry()} of {parent.size()}")
        if isinstance(widget, Text):
            trouble = short_of_room(widget)
            if trouble:
                found.append(f"{said(widget)}: {trouble}")
            continue
        need = widget.minimumSizeHint()
        if widget.width() < need.width() or widget.height() < need.height():
            found.append(f"{said(widget)} is {widget.size()}, needs {need}")
    return found


def short_of_room(text: Text) -> str:
    if not text.text():
        return ""
    need = text.sizeHint()
    if text.wordWrap():
        high = text.heightForWidth(text.width())
        return f"{text.height()} high, needs {high}" if text.height() < high else ""
    if text.height() < need.height():
        return f"{text.height()} high, needs {need.height()}"
    if text.width() < need.width() and text.toolTip() != text.text():
        return f"{text.width()} wide, needs {need.width()}, no tool tip"
    return ""


def overlapping(root: QWidget) -> list[str]:
    """Pairs of texts and buttons that lie over each other."""
    leaves = [
        one
        for one in in_sight(root)
        if isinstance(one, (Text, QAbstractButton)) and (not isinstance(one, Text) or one.text())
    ]
    spots = {
        one: one.visibleRegion().boundingRect().translated(one.mapTo(root, QPoint(0, 0)))
        for one in leaves
    }
    return [
        f"{said(first)} {spots[first]} over {said(second)} {spots[second]}"
        for first, second in combinations(leaves, 2)
        if spots[first].intersects(spots[second])
        and not first.isAncestorOf(second)
        and not second.isAncestorOf(first)
        and asks(first) is asks(second)
    ]


def asks(widget: QWidget) -> bool:
    """Whether it belongs to the question of the Turn screen, a panel that covers what is below."""
    parent = widget.parentWidget()
    return isinstance(parent, CameraQuestion) or (parent is not None and asks(parent))


@pytest.mark.parametrize("running", ["empty", "place"], indirect=True)
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("scale", [1.0, 1.5])
# Letters and lines are as wide in "light" as in "dark".
@pytest.mark.parametrize(
    "name", ["dark", pytest.param("light", marks=pytest.mark.sweep), "contrast"]
)
def test_nothing_is_cut_off_or_over_something_else_or_too_small(
    window: tuple[App, Robot],
    name: ThemeName,
    scale: float,
    size: tuple[int, int],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    app, robot = window
    asked: set[int] = set()
    plain = Theme.font

    def noted(self: Theme, size: int, weight: int = 400) -> object:
        asked.add(size)
        return plain(self, size, weight)

    monkeypatch.setattr(Theme, "font", noted)
    dress(app, robot, name, scale, size)
    found = []
    for what in (*SCREENS, *OVERLAYS):
        root = bring(app, robot, what)
        root.grab()
        found += [f"{what}: {trouble}" for trouble in (*cut_off(root), *overlapping(root))]
    app.commands.close_overlay()
    assert not found, "\n" + "\n".join(found)
    assert min(asked) >= LEAST_PX
