"""Pictures of every screen, made by walking through the program with real clicks and keys.

Run by ``turnlight --demo --screenshots DIR``; tests use the same `Robot`.
"""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar, overload

from PySide6.QtCore import QBuffer, QCoreApplication, QEventLoop, QPoint, QSize, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QWidget

from app.core.base.angles import lies_on_arc
from app.core.base.atomic_files import atomic_write_bytes
from app.core.base.errors import CoreError
from app.core.second_light.lamp_presets import NumbersLamp
from app.core.solver.solve import proposal
from app.core.text import tr
from app.ui.presenters.window_model import Step
from app.ui.screens.light.screen import LightPresenter
from app.ui.screens.light.screen_view import LightScreen
from app.ui.screens.light.style_list import rescued
from app.ui.screens.styles.gallery_view import Gallery
from app.ui.screens.turn.screen_view import TurnScreen
from app.ui.widgets.choices import SegmentedChoice

if TYPE_CHECKING:
    from app.ui.shell.start import App


W = TypeVar("W", bound=QWidget)
_PATIENCE_S: Final = 600.0  # far longer than any expected wait
_TICK_MS: Final = 10


class Lost(Exception):
    """A widget is missing in the window, or an event did not happen."""


class Robot:
    """Walks through a window."""

    def __init__(self, window: QWidget) -> None:
        self.window = window

    @overload
    def find(self, name: str) -> QWidget: ...

    @overload
    def find(self, name: str, kind: type[W]) -> W: ...

    def find(self, name: str, kind: type[QWidget] = QWidget) -> QWidget:
        """Find the visible widget whose accessible name begins with a text.

        Raises:
            Lost: If there is none; the message lists the visible ones.
        """
        seen = [one for one in self.window.findChildren(kind) if one.isVisibleTo(self.window)]
        names = {one.accessibleName(): one for one in reversed(seen) if one.accessibleName()}
        if name in names:
            return names[name]
        # The language `test` puts brackets around its texts.
        start = name.rstrip(" ~]")
        begins = [one for text, one in names.items() if text.startswith(start)]
        if not begins:
            raise Lost(f"There is no {name!r} among: {', '.join(sorted(names))}")
        return begins[0]

    def click(self, name: str, kind: type[QWidget] = QAbstractButton) -> None:
        """Click the middle of a button with the left mouse button."""
        self.click_at(self.find(name, kind))

    def click_at(self, widget: QWidget, at: QPoint | None = None) -> None:
        """Click a point of a widget; its middle by default."""
        point = widget.rect().center() if at is None else at
        QTest.mouseClick(widget, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, point)
        self.settle()

    def drag(self, widget: QWidget, points: list[QPoint]) -> None:
        """Press at the first point, move over the others, release at the last."""
        left, none = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
        QTest.mousePress(widget, left, none, points[0])
        for point in points[1:]:
            QTest.mouseMove(widget, point)
            self.settle()
        QTest.mouseRelease(widget, left, none, points[-1])
        self.settle()

    def press(self, key: Qt.Key, modifier: Qt.KeyboardModifier | None = None) -> None:
        """Press a key in the focused widget."""
        target = QApplication.focusWidget() or self.window
        QTest.keyClick(target, key, modifier or Qt.KeyboardModifier.NoModifier)
        self.settle()

    def write(self, text: str) -> None:
        """Type text in the focused widget."""
        QTest.keyClicks(QApplication.focusWidget() or self.window, text)
        self.settle()

    def settle(self) -> None:
        """Process all pending events."""
        for _ in range(3):
            QCoreApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents)

    def wait(self, happened: Callable[[], bool], what: str, seconds: float = _PATIENCE_S) -> float:
        """Wait until something has happened.

        Raises:
            Lost: If it did not happen in time.
        """
        begun = time.perf_counter()
        while not happened():
            if time.perf_counter() - begun > seconds:
                raise Lost(f"Not within {seconds:g} s: {what}")
            _let_pass(_TICK_MS)
        self.settle()
        return time.perf_counter() - begun

    def picture(self, path: Path) -> None:
        """Save the window as PNG.

        Raises:
            OSError: If it cannot be written.
        """
        self.settle()
        # In memory first: Qt does not report whether the disk stored all of it.
        encoded = QBuffer()
        encoded.open(QBuffer.OpenModeFlag.WriteOnly)
        if not self.window.grab().save(encoded, "PNG"):
            raise OSError(f"{path} cannot be written.")
        atomic_write_bytes(path, bytes(encoded.data().data()))


def _let_pass(milliseconds: int) -> None:
    """Process events for a while; unlike with `QTest.qWait`, other threads run in the meantime."""
    loop = QEventLoop()
    QTimer.singleShot(milliseconds, loop.quit)
    loop.exec()


_PICTURES: Final = (
    "styles-pictures",
    "styles-pictures-larger",
    "styles-detail-larger",
    "paint-larger",
)
_FULL: Final = QSize(1440, 900)
_SMALL: Final = QSize(1024, 700)
_WIDE: Final = QSize(1920, 1080)
_CAPTURE_S: Final = 90.0
_SETTLED_S: Final = 0.3
_FAILED: Final = 1


class Walk:
    """Walks through every screen of the demo and saves numbered pictures."""

    def __init__(self, app: App, folder: Path) -> None:
        self._app = app
        self._folder = folder
        self._robot = Robot(app.window)
        self._count = 0
        self._code = 0

    def run(self) -> int:
        """Run the walk.

        Returns:
            Exit code: 0, or 1 if something was missing.

        Raises:
            CoreError: If the folder cannot be written to.
        """
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise CoreError(
                tr(
                    "Pictures cannot be kept in {folder}: {reason}.",
                    folder=self._folder,
                    reason=error.strerror,
                ),
                tr("Name another folder."),
            ) from error
        self._app.show()
        QTimer.singleShot(0, self._walk)
        self._app.application.exec()
        return self._code

    def _walk(self) -> None:
        self._robot.settle()
        self._app.window.resize(_FULL)
        try:
            for part in (
                self._probe,
                self._styles,
                self._paint,
                self._turn,
                self._light,
                self._others,
            ):
                part()
            self._narrow()
        except Lost as lost:
            print(f"turnlight: {lost}", file=sys.stderr)
            self._code = _FAILED
            self._shoot("lost")
        finally:
            self._app.window.close()

    # -- the parts -----------------------------------------------------------------------------

    def _probe(self) -> None:
        robot, model = self._robot, self._app.model
        robot.wait(lambda: model.head is not None, "the head")
        robot.wait(lambda: model.camera is not None, "the demo camera")
        self._app.window._notify.dismiss()
        self._shoot("probe-empty")
        robot.click(tr("Quick"))
        robot.click(tr("Capture"))
        robot.wait(lambda: self._app.runner.running("capture"), "the capture")
        self._linger(4.0)
        self._shoot("probe-capturing")
        robot.wait(lambda: model.light is not None, "the light", _CAPTURE_S)
        robot.wait(lambda: bool(model.results), "the answers")
        self._linger(1.0)
        self._app.window._notify.dismiss()
        self._shoot("probe")

    def _styles(self) -> None:
        robot, model = self._robot, self._app.model
        robot.click(tr("See the styles"))
        robot.wait(lambda: model.step == Step.STYLES, "the gallery")
        self._linger()
        self._shoot("styles")
        self._choose(next((one.name for one in model.results if not one.attainable), ""))
        self._shoot("styles-out-of-reach")
        self._choose("left-rembrandt")
        self._shoot("styles-rembrandt")
        self._lamps("styles-lamps")
        self._explained("styles-contrast")
        self._compared("styles-compare")

    def _explained(self, name: str) -> None:
        """Open the explanation of a number."""
        self._robot.click(tr("Why?"))
        self._linger()
        self._robot.click(tr("{name}: what does it mean?", name=tr("Contrast")))
        self._linger()
        self._shoot(name)
        self._robot.press(Qt.Key.Key_Escape)
        self._robot.click(tr("Why?"))

    def _compared(self, name: str) -> None:
        """Mark two styles and compare them side by side; then remove the marks."""
        gallery = self._robot.find(tr("Styles"), Gallery)
        for one in self._app.model.results[:2]:
            gallery.marked.emit(one.name)
        self._robot.click(tr("Compare {count}", count=2))
        self._linger(1.0)
        self._shoot(name)
        self._robot.press(Qt.Key.Key_Escape)
        gallery.marked.emit("")

    def _lamps(self, name: str) -> None:
        """Show the choice of lamps."""
        self._robot.click(tr("Lamps: {lamps}", lamps=tr("standard")))
        self._linger()
        self._shoot(name)
        self._robot.press(Qt.Key.Key_Escape)

    def _paint(self) -> None:
        robot, model = self._robot, self._app.model
        robot.click(tr("Paint"))
        robot.wait(lambda: model.painting is not None, "the canvas")
        self._linger()
        self._shoot("paint")
        robot.press(Qt.Key.Key_Escape)
        robot.wait(lambda: model.painting is None, "the gallery again")
        self._app.window._notify.dismiss()

    def _turn(self) -> None:
        robot, app = self._robot, self._app
        # The first in the gallery, like a new user.
        self._choose(proposal(app.model.results) or "")
        robot.click(tr("Turn to this"))
        robot.wait(lambda: app.model.step == Step.TURN, "the turn")
        self._await_heading()
        self._shoot("turn")
        simulated = getattr(app.services.devices, "simulated", None)
        goal = app.model.target_turn_deg
        if simulated is not None and goal is not None:
            arc = robot.find(tr("Turn"), TurnScreen).presenter.resolve().scale.arc_deg
            before = arc is None or lies_on_arc(goal - 4.0, arc)
            simulated.set_turn(goal - 4.0 if before else goal + 4.0)
            self._await_heading()
            self._shoot("turn-in-the-light")
            robot.click_at(robot.find(tr("Who turns"), SegmentedChoice).part("selfie"))
            self._await_heading()
            self._shoot("turn-selfie")
            robot.click_at(robot.find(tr("Who turns"), SegmentedChoice).part("walk"))

    def _await_heading(self) -> None:
        """Wait for a stable number; without a webcam there never is one."""
        robot, presenter = self._robot, self._robot.find(tr("Turn"), TurnScreen).presenter
        self._linger(2.0)
        with contextlib.suppress(Lost):
            robot.wait(lambda: presenter.resolve().scale.now_deg is not None, "the heading")
        self._linger(2.0)

    def _light(self) -> None:
        """Hold a phone, or a panel where that is too weak, at the best position and elsewhere."""
        robot, app = self._robot, self._app
        app.model.update(step=Step.LIGHT)
        self._linger()
        self._shoot("light-empty")
        presenter = robot.find(tr("Light"), LightScreen).presenter
        work = presenter.work
        robot.click(tr("Use the phone"))
        self._linger()
        presenter.scale.ask()
        self._linger()
        self._shoot("light-question")
        if presenter.resolve().bright.keep:
            robot.click(tr("Keep"))
        else:
            robot.click(tr("Cellar, 30 lx"))
        robot.wait(lambda: work.answers is not None, "places for the phone", _CAPTURE_S)
        if work.answers is not None and not rescued(work.answers.placements):
            robot.wait(lambda: not work.coming_closer, "the phone from nearer by", _CAPTURE_S)
            self._shoot("light-too-weak")
            weak = work.answers
            presenter.take_lamp("panel")
            robot.wait(lambda: work.answers is not weak, "places for the panel", _CAPTURE_S)
        if work.answers is not None and (saved := rescued(work.answers.placements)):
            presenter.choose(saved[0].name)
        robot.wait(lambda: not presenter.resolve().detail.stale, "the face with the lamp")
        app.window._notify.dismiss()
        self._shoot("light")
        presenter.focus_lamp()
        for key in (Qt.Key.Key_Up, Qt.Key.Key_Right):
            robot.press(key, Qt.KeyboardModifier.ShiftModifier)
        self._linger(1.0)
        robot.press(Qt.Key.Key_PageDown)
        self._linger(1.0)
        self._shoot("light-elsewhere")
        robot.press(Qt.Key.Key_Home)
        self._linger()
        self._own_lamp(presenter)

    def _own_lamp(self, presenter: LightPresenter) -> None:
        """Make a lamp of the brightest light of the place, and show its position."""
        robot = self._robot
        robot.click(tr("Capture your own lamp"))
        self._linger()
        self._shoot("light-capture")
        robot.write("Window")
        robot.click(tr("Use the place"))
        robot.wait(lambda: presenter.lamps.own is not None, "the lamp", _CAPTURE_S)
        self._linger()
        presenter.lamp_actions.ask("distance")
        self._linger()
        self._shoot("light-distance")
        robot.press(Qt.Key.Key_Escape)
        presenter.lamp_actions.ask_mask()
        robot.wait(lambda: self._sees(tr("Where the lamp is")), "the mask", _CAPTURE_S)
        self._linger()
        robot.press(Qt.Key.Key_Right)
        self._linger()
        self._shoot("light-mask")
        robot.press(Qt.Key.Key_Escape)
        self._held(presenter)
        self._app.window._notify.dismiss()
        self._shoot("light-own")
        presenter.take_lamp("panel")
        self._held(presenter)

    def _sees(self, name: str) -> bool:
        try:
            return self._robot.find(name).isVisible()
        except Lost:
            return False

    def _held(self, presenter: LightPresenter) -> None:
        """Wait until the lamp is at its position, with its pictures."""
        wanted = presenter.lamps.own or presenter.lamps.key

        def there() -> bool:
            answers = presenter.work.answers
            lamp = None if answers is None else answers.hand.lamp
            kind = lamp.kind if isinstance(lamp, NumbersLamp) else lamp
            return kind == wanted and not presenter.resolve().detail.stale

        self._robot.wait(there, "the face with the lamp", _CAPTURE_S)

    def _others(self) -> None:
        app = self._app
        for what in ("places", "settings", "find", "tour", "help"):
            app.commands.ask(what)
            self._linger()
            self._shoot(what)
            app.commands.close_overlay()

    def _narrow(self) -> None:
        app = self._app
        for size, name in ((_SMALL, "narrow"), (_WIDE, "wide")):
            app.window.resize(size)
            self._linger()
            for step in (Step.PROBE, Step.STYLES, Step.TURN, Step.LIGHT):
                app.model.update(step=step, painting=None)
                self._linger(1.0)
                if step == Step.LIGHT:
                    self._held(self._robot.find(tr("Light"), LightScreen).presenter)
                self._shoot(f"{step.value}-{name}")
                if step == Step.STYLES:
                    self._lamps(f"styles-lamps-{name}")
                    self._compared(f"styles-compare-{name}")
            app.model.update(step=Step.STYLES, painting=app.model.chosen)
            self._linger(1.0)
            self._shoot(f"paint-{name}")
            app.model.update(painting=None)

    # -- hands ---------------------------------------------------------------------------------

    def _choose(self, name: str) -> None:
        if name:
            self._app.model.update(chosen=name, needle_deg=None)
            self._linger()

    def _linger(self, seconds: float = _SETTLED_S) -> None:
        clock = self._app.services.clock
        end = clock.now() + seconds
        self._robot.wait(lambda: clock.now() >= end, "some time", seconds + 5.0)

    def _shoot(self, name: str) -> None:
        self._count += 1
        runner = self._app.runner
        # Full-size faces replace small ones a little later.
        self._robot.wait(lambda: not any(map(runner.running, _PICTURES)), "larger pictures")
        self._robot.picture(self._folder / f"{self._count:02d}-{name}.png")
