"""What can be done on every screen, and what lies over the screens: palette, places, settings."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Final

from PySide6.QtCore import QObject, QPoint, QTimer
from PySide6.QtWidgets import QWidget

from app.core.base.angles import wrap
from app.core.base.errors import CoreError
from app.core.solver.solve import proposal
from app.core.storage.settings import Settings
from app.core.storage.settings_file import FILE, write_settings
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.model import Model, Step
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Services
from app.ui.screens.registry import steps
from app.ui.shell.notify import Message, Notify
from app.ui.shell.window import Window
from app.ui.theme import px
from app.ui.widgets.buttons import Button
from app.ui.widgets.dialogs import Sheet, ask_file, ask_files, ask_folder
from app.ui.widgets.displays import Bar
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column, row
from app.ui.widgets.surfaces import Menu, Surface

_TICK_S: Final = 0.1
_SWEEP_DEG: Final = 40.0  # to either side of the best turn
_LOOKED: Final = 0.5  # of the time at the styles, before the needle moves
_WALKED: Final = 0.65  # of the time at the turn, until the goal is reached


STEPS: Final = (
    (
        "probe",
        tr("Measure the light"),
        tr(
            "Put the 360 camera where the sitter’s head will be, its front lens toward you, press "
            "Capture and kneel under it. No camera? Drop any HDR panorama on the window."
        ),
    ),
    (
        "styles",
        tr("Choose a style"),
        tr(
            "Every card shows the studio picture, what this place can give, and how far to turn "
            "for it. Grey cards are out of reach here and show the reason."
        ),
    ),
    (
        "turn",
        tr("Turn to it"),
        tr(
            "Walk around the sitter, who turns with you. The arrow and the number can be read "
            "from three metres; green means you are in the light."
        ),
    ),
    (
        "paint",
        tr("Want it otherwise? Paint it"),
        tr("Brush where the face should be brighter or darker. The best turn follows the brush."),
    ),
    (
        "light",
        tr("Light is missing? Add a lamp"),
        tr(
            "A phone or a small panel often brings a style into reach: where to hold it, how far "
            "away, how bright."
        ),
    ),
)
"""Key, title and words of every step: of the tour, which shows a picture of it, and of the demo."""
SECONDS: Final = {"probe": 18.0, "styles": 30.0, "turn": 36.0, "paint": 18.0, "light": 18.0}
"""How long the demo stays at each."""


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
        texts = column(self._title, self._words, gap=2)
        far = column(..., self._count, self._bar, ..., gap=4)
        leave_it = Button(tr("Leave the demo"), "close", do=leave)
        buttons = (leave_it, self._pause, self._next)
        row((texts, 1), far, *buttons, into=self, gap=12, margins=(24, 12, 24, 12))
        self._bar.setFixedWidth(px(80))

    def show_step(self, number: int, share: float, paused: bool) -> None:
        """Say what is in front, and how much of the demo is over, 0 to 1."""
        _, title, words = STEPS[number]
        self._title.set_text(title)
        self._words.set_text(words)
        self._count.set_text(tr("{page} of {pages}", page=number + 1, pages=len(STEPS)))
        self._bar.set(share)
        self._bar.setAccessibleName(tr("Demo: {percent} %", percent=round(100 * share)))
        self._pause.set_text(tr("Continue") if paused else tr("Pause"))


class GuidedDemo(QObject):
    """Walks through the screens by itself, then calls `ended`; the own place is brought back."""

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
        """End it where it is, and bring back the place and the screen that were open before."""
        self._timer.stop()
        self._window.set_foot(None)
        folder, step = self._came_from
        self._model.update(painting=None, needle_deg=None)
        # Whoever opened another place meanwhile stays there.
        if self._model.demo_open and folder not in (None, self._model.place_folder):
            self._place_controller.open_place(folder, step=step)
        self._ended()
        self.deleteLater()

    def tick(self) -> None:
        """Let a tenth of a second pass."""
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
        """Continue with the next step; after the last one leave."""
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
        """Bring a step to the front, with the style that is proposed."""
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


_THEMES: Final = {
    "dark": tr("Dark colours"),
    "light": tr("Light colours"),
    "contrast": tr("High contrast, for sunlight"),
}
_FILES: Final = (
    tr("Panoramas and photographs") + " (*.exr *.hdr *.jpg *.jpeg *.insp *.png *.tif *.tiff *.dng)"
)


class Commands:
    """The actions of the window as a whole."""

    def __init__(
        self,
        services: Services,
        place_controller: PlaceController,
        notify: Notify,
        open_overlay: Callable[[str, Commands], Sheet],
    ) -> None:
        self.services = services
        self.place_controller = place_controller
        self._window: Window | None = None
        self.overlay: Sheet | None = None
        self.guided: GuidedDemo | None = None
        self._question = ""
        self._notify = notify
        self._open_overlay = open_overlay
        self._writing = threading.Lock()
        self._unkept: Settings | None = None
        self._saved = services.model.settings
        self._clash_told = False
        services.model.changed.connect(self._model_changed)

    def attach(self, window: Window) -> None:
        """Act on this window from now on."""
        self._window = window
        window.asked.connect(self.ask)
        self.place_controller.saving.folder_asker = lambda title: ask_folder(window, title)
        self.place_controller.layer_asker = lambda: self.ask("layers")

    @property
    def window(self) -> Window:
        """The window."""
        assert self._window is not None
        return self._window

    def begin(self) -> None:
        """Offer the demo place and the tour at the very first start."""
        if not self.services.model.settings.tour_seen:
            self.services.notify.tell(
                tr("New here? Five steps show the way, and a demo place is ready to try."),
                actions=[
                    (tr("Take the tour"), lambda: self.ask("tour")),
                    (tr("Demo place"), self.place_controller.open_demo),
                ],
                about="tour",
                stay=True,
            )
            self.change("tour_seen", value=True)

    def go(self, step: str) -> None:
        """Bring a screen of the rail to the front."""
        self.services.model.update(step=step, painting=None)

    def everywhere(self) -> Sequence[Action]:
        """Give all actions that can be done on every screen."""
        undo, asks = self.services.undo, partial(partial, self.ask)
        screens = (
            Action(f"step-{spec.key}", spec.command, partial(self.go, spec.key), spec.icon,
                   f"Ctrl+{number}")
            for number, spec in enumerate(steps(), start=1)
        )  # fmt: skip
        themes = (
            Action(f"theme-{name}", words, partial(self.change, "theme", name), "eye")
            for name, words in _THEMES.items()
        )
        return (
            *screens,
            Action("open-files", tr("Open files…"), self.open_files, "file", "Ctrl+O"),
            Action("open-folder", tr("Open a folder…"), self.open_folder, "folder", "Ctrl+Shift+O"),
            Action("demo", tr("Try the demo place"), self.place_controller.open_demo, "pin"),
            Action("guided-demo", tr("Watch the two-minute demo"), self.guide, "play"),
            Action("undo", tr("Undo"), undo.undo, "undo", "Ctrl+Z",
                   lambda: bool(undo.undo_words), about=undo.undo_words),
            Action("redo", tr("Redo"), undo.redo, "redo", "Ctrl+Shift+Z; Ctrl+Y",
                   lambda: bool(undo.redo_words), about=undo.redo_words),
            Action("places", tr("Places"), asks("places"), "places", "Ctrl+P"),
            Action("settings", tr("Settings"), asks("settings"), "settings", "Ctrl+,"),
            Action("messages", tr("Messages"), asks("messages"), "list"),
            Action("tour", tr("Tour"), asks("tour"), "help"),
            Action("help", tr("Help and shortcuts"), asks("help"), "help", "F1"),
            *themes,
            Action("find", tr("Find anything"), asks("find"), "search", "Ctrl+K",
                   hint=tr("find anything")),
            Action("quit", tr("Quit"), self.quit, "close", "Ctrl+Q"),
        )  # fmt: skip

    def all_actions(self) -> Sequence[Action]:
        """Give what can be done now: here first, then everywhere."""
        return (*self.window.screen_actions(), *self.everywhere())

    def ask(self, what: str, at: QPoint | None = None) -> None:
        """Open something that lies over the screen."""
        self.close_overlay()
        if what == "camera":
            self.go(Step.PROBE)
        elif what == "sitter":
            self._choose_sitter(at or self.window.mapToGlobal(QPoint(0, 0)))
        else:
            self._question = what
            self.overlay = self._open_overlay(what, self)
            self.overlay.closed.connect(self._overlay_closed)

    def guide(self) -> None:
        """Show the program by itself, for two minutes or until it is left."""
        self.close_overlay()
        if self.guided is None:
            self.guided = GuidedDemo(
                self.window, self.place_controller, self.services, self._unguided
            )

    def _unguided(self) -> None:
        self.guided = None

    def show_setting(self, key: str) -> None:
        """Open the settings at one of them."""
        self.ask("settings")
        item = None if self.overlay is None else self.overlay.body.itemAt(0)
        reveal = getattr(None if item is None else item.widget(), "reveal", None)
        if reveal is not None:
            reveal(key)

    def close_overlay(self) -> None:
        """Close what lies over the screen."""
        if self.overlay is not None:
            self.overlay.shut()

    def reopen(self) -> None:
        """Make what lies over the screen again, as after a change of theme."""
        if self.overlay is not None:
            self.ask(self._question)

    def messages(self) -> tuple[Message, ...]:
        """Give what was told since the start; from now on it counts as read."""
        self._notify.read()
        return self._notify.messages

    def _overlay_closed(self) -> None:
        overlay, self.overlay = self.overlay, None
        if overlay is not None:
            overlay.deleteLater()

    def _choose_sitter(self, at: QPoint) -> None:
        selected = self.services.model.head_name
        menu = Menu(self.window, tr("Who is lit"))
        for name, title in self.place_controller.heads():
            icon = "check" if name == selected else "person"
            menu.add(title, partial(self.place_controller.load_head, name), icon)
        menu.add(tr("Choose a file…"), self.choose_head, "folder")
        menu.popup(at)

    def choose_head(self) -> None:
        """Ask for a head that was baked with ``turnlight bake``, and light it."""
        title, kinds = tr("Choose a head of your own"), tr("Baked heads (*.npz)")
        path = ask_file(self.window, title, kinds)
        if path is not None:
            self.place_controller.choose_head(path)

    def open_files(self) -> None:
        """Ask for files and open them."""
        paths = ask_files(self.window, tr("Open files"), _FILES)
        if paths:
            self.open_paths(paths)

    def open_folder(self) -> None:
        """Ask for a folder with a bracket or a panorama and open it."""
        folder = ask_folder(self.window, tr("Open a folder"))
        if folder is not None:
            self.open_paths([folder])

    def open_paths(self, paths: Sequence[Path]) -> None:
        """Open files that were chosen or dropped; what lies over the screen makes way."""
        self.close_overlay()
        self.place_controller.open_paths(paths)

    def change(self, key: str, value: object) -> None:
        """Change one setting and keep it."""
        self.services.model.set(key, value)

    def quit(self) -> None:
        """Close the window."""
        self.window.close()

    def _model_changed(self, names: frozenset[str]) -> None:
        # Not by a place alone: the last one is opened unasked, and one may be brought back here.
        if names & {"step", "painting"}:
            self.close_overlay()
        if "light" in names and self.services.model.light is not None:
            # The offer of the first start is taken up, one way or another.
            self.services.notify.mended("tour")
        if "settings" in names:
            self._keep(self.services.model.settings)

    def shut(self) -> None:
        """Write the settings that are not yet on the disk."""
        try:
            self._write_settings()
        except CoreError as error:
            self._notify.tell_error(error)

    def _keep(self, settings: Settings) -> None:
        self._unkept = settings
        self.services.runner.submit(
            "keep-settings",
            lambda *_: self._write_settings(),
            done=self._settings_kept,
            failed=self._settings_unkept,
        )

    def _settings_kept(self, other: Path | None) -> None:
        self.services.notify.mended("settings")
        if other is not None and not self._clash_told:
            self._clash_told = True
            self.services.notify.tell(
                tr(
                    "Another window changed the settings as well. Those are kept as {name}.",
                    name=other.name,
                ),
                kind="warning",
            )

    def _settings_unkept(self, error: Exception) -> None:
        again = (tr("Try again"), lambda: self._keep(self.services.model.settings))
        self.services.notify.tell_error(error, actions=[again], about="settings")

    def _write_settings(self) -> Path | None:
        # One after the other, and only the newest: an older one never comes last.
        with self._writing:
            settings = self._unkept
            if settings is None:
                return None
            file = self.services.folders.home / FILE
            other = write_settings(file, settings, self._saved)
            self._saved = settings
            if self._unkept is settings:
                self._unkept = None
            return other
