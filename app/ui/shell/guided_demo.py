"""The two-minute demo, which plays the steps of the tour automatically."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from PySide6.QtCore import QObject, QTimer
from PySide6.QtWidgets import QWidget

from app.core.base.angles import wrap
from app.core.solver.solve import proposal
from app.core.text import tr
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Services
from app.ui.presenters.window_model import Model, Step
from app.ui.shell.window import Window
from app.ui.theme import px
from app.ui.widgets.buttons import Button
from app.ui.widgets.dialogs import Sheet
from app.ui.widgets.displays import Bar
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column, row
from app.ui.widgets.surfaces import Surface

_TICK_S: Final = 0.1

_SWEEP_DEG: Final = 40.0  # the needle's sweep to either side of the best turn

_LOOKED: Final = 0.5  # fraction of the time at Styles, before the needle moves

_WALKED: Final = 0.65  # fraction of the time at Turn, until the goal is reached

STEPS: Final = (
    (
        "probe",
        tr("Measure the light"),
        tr(
            "Put the 360 camera where the sitter’s head will be, with its front lens facing you. "
            "Press Capture and kneel below the camera. No camera? Drop any HDR panorama onto the "
            "window."
        ),
    ),
    (
        "styles",
        tr("Choose a style"),
        tr(
            "Every card shows the studio picture, the best result at this place and how far to "
            "turn for it. Grey cards say what this place lacks."
        ),
    ),
    (
        "turn",
        tr("Turn to it"),
        tr(
            "Walk around the sitter, who turns with you. The arrow and the number can be read "
            "from three metres away. Green means that you are in the light."
        ),
    ),
    (
        "paint",
        tr("Want a different light? Paint it"),
        tr("Brush where the face should be brighter or darker. The best turn follows the brush."),
    ),
    (
        "light",
        tr("Not enough light? Add a lamp"),
        tr(
            "A phone or a small panel often brings a style within reach. Turnlight shows where to "
            "hold it, how far away and how bright."
        ),
    ),
)
"""Key, title and text of each step. The tour uses the same steps and adds pictures."""

SECONDS: Final = {"probe": 18.0, "styles": 30.0, "turn": 36.0, "paint": 18.0, "light": 18.0}
"""Duration of each step of the demo, in seconds."""


class DemoBar(Surface):
    """A bar with the current step, its explanation, and buttons to pause, continue and leave."""

    def __init__(self, leave: Callable[[], None], pause: Callable[[], None],
                 further: Callable[[], None]) -> None:  # fmt: skip
        super().__init__("raised", ("top",), tr("Two-minute demo"))
        self._title, self._words = Text("", 16, 600), Text("", 14, role="dim", wrap=True)
        self._count = Text("", 12, role="dim")
        self._bar = Bar()
        self._pause = Button(tr("Pause"), "pause", do=pause)
        self._next = Button(tr("Next"), "chevron-right", do=further)
        texts = column(self._title, self._words, gap=2)
        far = column(..., self._count, self._bar, ..., gap=4)
        leave_it = Button(tr("Leave the demo"), "close", do=leave)
        buttons = (leave_it, self._pause, self._next)
        row((texts, 1), far, *buttons, into=self, gap=12, margins=(24, 12, 24, 12))
        self._bar.setFixedWidth(px(80))

    def show_step(self, number: int, share: float, paused: bool) -> None:
        """Show a step, and the fraction of the demo that has elapsed, from 0 to 1."""
        _, title, words = STEPS[number]
        self._title.set_text(title)
        self._words.set_text(words)
        self._count.set_text(tr("{page} of {pages}", page=number + 1, pages=len(STEPS)))
        self._bar.set(share)
        self._bar.setAccessibleName(tr("Demo: {percent}%", percent=round(100 * share)))
        self._pause.set_text(tr("Continue") if paused else tr("Pause"))


class GuidedDemo(QObject):
    """Walks through the screens, then returns to the user's place and calls `ended`."""

    def __init__(self, window: Window, place_controller: PlaceController, services: Services,
                 ended: Callable[[], None]) -> None:  # fmt: skip
        super().__init__(window)
        self._window, self._place_controller, self._services, self._ended = (
            window,
            place_controller,
            services,
            ended,
        )
        self._model: Model = services.model
        self._came_from = (self._model.place_folder, self._model.step)
        self.number, self._over_s, self._paused = -1, 0.0, False
        self._bar: DemoBar | None = None
        self._timer = QTimer(self)
        self._timer.setInterval(round(1000 * _TICK_S))
        self._timer.timeout.connect(self.tick)
        window.set_foot(self._make_bar)
        if not self._model.demo_open:
            place_controller.open_demo()
        self._timer.start()

    def leave(self) -> None:
        """End the demo, and return to the place and the screen that were open before."""
        self._timer.stop()
        self._window.set_foot(None)
        folder, step = self._came_from
        self._model.update(painting=None, needle_deg=None)
        # The user may have opened another place in the meantime, so keep that place open.
        if self._model.demo_open and folder not in (None, self._model.place_folder):
            self._place_controller.open_place(folder, step=step)
        self._ended()
        self.deleteLater()

    def tick(self) -> None:
        """Advance the demo by one tenth of a second."""
        opening = self._services.runner.running("open")
        ready = self._model.demo_open and self._model.results and not opening
        is_covered = bool(Sheet.over(self._window))
        if not ready or (self.number >= 0 and (self._paused or is_covered)):
            return
        whole_s = SECONDS.get(STEPS[self.number][0], 0.0)
        if self.number < 0 or self._over_s >= whole_s:
            self._further()
            return
        self._over_s += _TICK_S
        self._move(self._over_s / whole_s)
        self._show()

    def _make_bar(self) -> QWidget:
        self._bar = DemoBar(self.leave, self._pause, self._further)
        self._show()
        return self._bar

    def _pause(self) -> None:
        self._paused = not self._paused
        self._show()

    def _further(self) -> None:
        """Continue with the next step, or leave the demo after the last one."""
        if self.number + 1 == len(STEPS):
            self.leave()
        elif self._model.demo_open and self._model.results:
            self.number, self._over_s = self.number + 1, 0.0
            self._enter(STEPS[self.number][0])
            self._show()

    def _show(self) -> None:
        if self._bar is not None:
            number, times = max(self.number, 0), list(SECONDS.values())
            share = (sum(times[:number]) + self._over_s) / sum(times)
            self._bar.show_step(number, share, self._paused)

    def _enter(self, key: str) -> None:
        """Enter a step, with the suggested style selected."""
        model, name = self._model, proposal(self._model.results)
        best = next(one.turn_refined_deg for one in model.results if one.name == name)
        model.update(chosen=name, needle_deg=None, goal_deg=best if key == "turn" else None)
        painting = name if key == "paint" else None
        model.update(step=Step.STYLES if painting else Step(key), painting=painting)
        self._move(0.0)

    def _move(self, share: float) -> None:
        """Sweep the needle around the best turn, or walk to the goal and stay in the light."""
        result, key = self._model.result, STEPS[self.number][0]
        if result is None:
            return
        if key == "turn":
            demo_turn = getattr(self._window.front_presenter, "demo_turn", None)
            if demo_turn is not None:
                demo_turn(min(share / _WALKED, 1.0) * result.turn_refined_deg)
        elif key == "styles" and share > _LOOKED and not self._model.calm:
            away = math.sin(2.0 * math.pi * (share - _LOOKED) / (1.0 - _LOOKED))
            self._model.update(needle_deg=wrap(result.turn_refined_deg + _SWEEP_DEG * away))
