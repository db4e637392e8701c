"""Two minutes of demo: the program walks through the demo place, and can be left at any time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QObject, QTimer
from PySide6.QtWidgets import QWidget

from app.core.base.angles import wrap
from app.core.solver.solve import proposal
from app.core.text import tr
from app.ui.presenters.model import Model, Step
from app.ui.theme import px
from app.ui.widgets.buttons import Button
from app.ui.widgets.dialogs import Sheet
from app.ui.widgets.displays import Bar
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column, row
from app.ui.widgets.surfaces import Surface

if TYPE_CHECKING:
    from app.ui.presenters.place_controller import PlaceController
    from app.ui.presenters.services import Services
    from app.ui.shell.window import Window

_TICK_S: Final = 0.1
_SWEEP_DEG: Final = 40.0  # to either side of the best turn


@dataclass(frozen=True, slots=True)
class Scene:
    """What is shown for some seconds: a screen, words, and what moves on it meanwhile.

    * `enter`: brings it to the front.
    * `move`: takes how much of the scene is over, 0 to 1.
    """

    title: str
    words: str
    seconds: float
    enter: Callable[[], None]
    move: Callable[[float], None] = lambda share: None


class DemoBar(Surface):
    """What is shown and why; pause, continue, leave."""

    def __init__(self, leave: Callable[[], None], pause: Callable[[], None],
                 further: Callable[[], None]) -> None:  # fmt: skip
        super().__init__("raised", ("top",), tr("Two-minute demo"))
        self._title, self._words = Text("", 16, 600), Text("", 14, role="dim", wrap=True)
        self._count = Text("", 12, role="dim")
        self._bar = Bar()
        self._pause = Button(tr("Pause"), "pause", do=pause)
        self._next = Button(tr("Next"), "chevron-right", do=further)
        said = column(self._title, self._words, gap=2)
        far = column(..., self._count, self._bar, ..., gap=4)
        leave_it = Button(tr("Leave the demo"), "close", do=leave)
        buttons = (leave_it, self._pause, self._next)
        row((said, 1), far, *buttons, into=self, gap=12, margins=(24, 12, 24, 12))
        self._bar.setFixedWidth(px(80))

    def show_scene(self, scene: Scene, number: int, count: int) -> None:
        """Say what is in front now."""
        self._title.set_text(scene.title)
        self._words.set_text(scene.words)
        self._count.set_text(tr("{page} of {pages}", page=number + 1, pages=count))

    def show_time(self, share: float, paused: bool) -> None:
        """Show how much of the demo is over, 0 to 1."""
        self._bar.set(share)
        self._bar.setAccessibleName(tr("Demo: {percent} %", percent=round(100 * share)))
        self._pause.set_text(tr("Continue") if paused else tr("Pause"))


class GuidedDemo(QObject):
    """Walks through the screens by itself; who leaves finds the own place again.

    `ended` is called once it is over.
    """

    def __init__(self, window: Window, desk: PlaceController, services: Services,
                 ended: Callable[[], None]) -> None:  # fmt: skip
        super().__init__(window)
        self._window, self._desk, self._services, self._ended = window, desk, services, ended
        self._model: Model = services.model
        self._came_from = (self._model.place_folder, self._model.step)
        self.scenes = self._script()
        self._number, self._over_s, self._paused = -1, 0.0, False
        self._bar: DemoBar | None = None
        self._timer = QTimer(self, interval=round(1000 * _TICK_S))
        self._timer.timeout.connect(self.tick)
        window.set_foot(self._make_bar)
        if not self._model.demo_open:
            desk.open_demo()
        self._timer.start()

    def leave(self) -> None:
        """End it where it is, and bring back the place and the screen that were open before."""
        self._timer.stop()
        self._window.set_foot(None)
        folder, step = self._came_from
        self._model.update(painting=None, needle_deg=None)
        if folder not in (None, self._model.place_folder):
            self._desk.open_place(folder, step=step)
        self._ended()
        self.deleteLater()

    def tick(self) -> None:
        """Let a tenth of a second pass."""
        opening = self._services.runner.running("open")
        ready = self._model.demo_open and self._model.results and not opening
        covered = bool(Sheet.over(self._window))
        if not ready or (self._number >= 0 and (self._paused or covered)):
            return
        if self._number < 0 or self._over_s >= self.scenes[self._number].seconds:
            self._further()
            return
        scene = self.scenes[self._number]
        self._over_s += _TICK_S
        scene.move(self._over_s / scene.seconds)
        self._show()

    def _make_bar(self) -> QWidget:
        self._bar = DemoBar(self.leave, self._pause, self._further)
        self._show()
        return self._bar

    def _pause(self) -> None:
        self._paused = not self._paused
        self._show()

    def _further(self) -> None:
        """Continue with the next scene; after the last one leave."""
        if self._number + 1 == len(self.scenes):
            self.leave()
        elif self._model.demo_open and self._model.results:
            self._number, self._over_s = self._number + 1, 0.0
            self.scenes[self._number].enter()
            self._show()

    def _show(self) -> None:
        if self._bar is not None:
            number = max(self._number, 0)
            before = sum(scene.seconds for scene in self.scenes[:number]) + self._over_s
            whole = sum(scene.seconds for scene in self.scenes)
            self._bar.show_scene(self.scenes[number], number, len(self.scenes))
            self._bar.show_time(before / whole, self._paused)

    # -- what is shown -------------------------------------------------------------------------

    def _script(self) -> tuple[Scene, ...]:
        return (
            Scene(
                tr("This is the light of a place"),
                tr("A 360 camera measured it where the sitter’s head will be. Every answer "
                   "comes from this one panorama."),
                16.0,
                lambda: self._model.update(step=Step.PROBE, painting=None),
            ),
            Scene(
                tr("Every style, and how far to turn for it"),
                tr("Each card shows the studio picture and what this place gives. Grey styles are "
                   "out of reach and say why."),
                20.0,
                self._choose,
            ),
            Scene(
                tr("Between two turns the light changes"),
                tr("The needle sweeps around the best turn; the face follows. You can drag it "
                   "yourself."),
                16.0,
                self._choose,
                self._sweep,
            ),
            Scene(
                tr("You and the sitter turn together"),
                tr("A webcam sees the background and knows how far you are. The number counts "
                   "down as you walk."),
                26.0,
                self._turn,
                lambda share: self._walk(min(1.25 * share, 0.97)),
            ),
            Scene(
                tr("In the light"),
                tr("Green means: take the picture, with any camera you like."),
                14.0,
                lambda: self._walk(1.0),
            ),
            Scene(
                tr("Want another light? Paint it"),
                tr("Brush where the face should be brighter or darker. The best turn follows the "
                   "brush."),
                16.0,
                self._paint,
            ),
            Scene(
                tr("Your turn"),
                tr("The demo place stays open: try it. Or measure a place of your own."),
                12.0,
                self._choose,
            ),
        )  # fmt: skip

    def _choose(self) -> None:
        self._model.update(
            step=Step.STYLES, painting=None, chosen=proposal(self._model.results), needle_deg=None
        )

    def _sweep(self, share: float) -> None:
        result = self._model.result
        if result is not None and not self._model.settings.reduce_motion:
            away = _SWEEP_DEG * math.sin(2.0 * math.pi * share)
            self._model.update(needle_deg=wrap(result.turn_refined_deg + away))

    def _turn(self) -> None:
        result = self._model.result
        if result is not None:
            self._model.update(
                needle_deg=None, goal_deg=result.turn_refined_deg, step=Step.TURN, painting=None
            )
            self._walk(0.0)

    def _walk(self, share: float) -> None:
        """Put the demo's webcam on its way from the start to the goal, 0 to 1."""
        goal, screen = self._model.target_turn_deg, self._window.front_presenter
        demo_turn = getattr(screen, "demo_turn", None)
        if goal is not None and demo_turn is not None:
            demo_turn(share * goal)

    def _paint(self) -> None:
        self._model.update(step=Step.STYLES, painting=self._model.chosen)
