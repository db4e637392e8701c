"""The actions available on every screen: search, places, settings, help, open and undo."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Final

from PySide6.QtCore import QPoint

from app.core.base.errors import CoreError
from app.core.storage.settings import Settings
from app.core.storage.settings_file import FILE, write_settings
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Services
from app.ui.presenters.window_model import Step
from app.ui.screens.registry import steps
from app.ui.shell.guided_demo import GuidedDemo
from app.ui.shell.notify import Message, Notify
from app.ui.shell.window import Window
from app.ui.widgets.dialogs import Sheet, ask_file, ask_files, ask_folder
from app.ui.widgets.surfaces import Menu

_THEMES: Final = {
    "dark": tr("Dark colours"),
    "light": tr("Light colours"),
    "contrast": tr("High contrast, for sunlight"),
}

_FILES: Final = (
    tr("Panoramas and photos") + " (*.exr *.hdr *.jpg *.jpeg *.insp *.png *.tif *.tiff *.dng)"
)


class Commands:
    """The actions that concern the window as a whole."""

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
        """Use the given window from now on."""
        self._window = window
        window.asked.connect(self.ask)
        self.place_controller.saving.folder_asker = lambda title: ask_folder(window, title)
        self.place_controller.layer_asker = lambda: self.ask("layers")

    @property
    def window(self) -> Window:
        """The attached window."""
        assert self._window is not None
        return self._window

    def begin(self) -> None:
        """Offer the demo place and the tour when the app starts for the very first time."""
        if not self.services.model.settings.tour_seen:
            self.services.notify.tell(
                tr("New here? Take the five-step tour, or try the demo place."),
                actions=[
                    (tr("Take the tour"), lambda: self.ask("tour")),
                    (tr("Demo place"), self.place_controller.open_demo),
                ],
                about="tour",
                stay=True,
            )
            self.change("tour_seen", value=True)

    def go(self, step: str) -> None:
        """Switch to one of the screens on the rail."""
        self.services.model.update(step=step, painting=None)

    def everywhere(self) -> Sequence[Action]:
        """Return the actions that are available on every screen."""
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
        """Return all currently available actions, starting with those of the current screen."""
        return (*self.window.screen_actions(), *self.everywhere())

    def ask(self, what: str, at: QPoint | None = None) -> None:
        """Open an overlay."""
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
        """Play the two-minute demo until the demo ends or the user leaves it."""
        self.close_overlay()
        if self.guided is None:
            self.guided = GuidedDemo(
                self.window, self.place_controller, self.services, self._unguided
            )

    def _unguided(self) -> None:
        self.guided = None

    def show_setting(self, key: str) -> None:
        """Open the settings and scroll to one of them."""
        self.ask("settings")
        item = None if self.overlay is None else self.overlay.body.itemAt(0)
        reveal = getattr(None if item is None else item.widget(), "reveal", None)
        if reveal is not None:
            reveal(key)

    def close_overlay(self) -> None:
        """Close the overlay."""
        if self.overlay is not None:
            self.overlay.shut()

    def reopen(self) -> None:
        """Rebuild the open overlay, for example after a change of theme."""
        if self.overlay is not None:
            self.ask(self._question)

    def messages(self) -> tuple[Message, ...]:
        """Return all messages since the app started, and mark the messages as read."""
        self._notify.read()
        return self._notify.messages

    def _overlay_closed(self) -> None:
        overlay, self.overlay = self.overlay, None
        if overlay is not None:
            overlay.deleteLater()

    def _choose_sitter(self, at: QPoint) -> None:
        selected = self.services.model.head_name
        menu = Menu(self.window, tr("Sitter"))
        for name, title in self.place_controller.heads.titles():
            icon = "check" if name == selected else "person"
            menu.add(title, partial(self.place_controller.heads.load, name), icon)
        menu.add(tr("Choose a file…"), self.choose_head, "folder")
        menu.popup(at)

    def choose_head(self) -> None:
        """Ask the user for a head file created with ``turnlight bake``, and load the head."""
        title, kinds = tr("Choose a head of your own"), tr("Baked heads (*.npz)")
        path = ask_file(self.window, title, kinds)
        if path is not None:
            self.place_controller.heads.choose(path)

    def open_files(self) -> None:
        """Ask the user for files, and open the selected files."""
        paths = ask_files(self.window, tr("Open files"), _FILES)
        if paths:
            self.open_paths(paths)

    def open_folder(self) -> None:
        """Ask the user for a folder that contains a bracket or a panorama, and open the folder."""
        folder = ask_folder(self.window, tr("Open a folder"))
        if folder is not None:
            self.open_paths([folder])

    def open_paths(self, paths: Sequence[Path]) -> None:
        """Close the overlay, then open files that were selected or dropped."""
        self.close_overlay()
        self.place_controller.open_paths(paths)

    def change(self, key: str, value: object) -> None:
        """Change a setting, and save the new value."""
        self.services.model.set(key, value)

    def quit(self) -> None:
        """Close the window."""
        self.window.close()

    def _model_changed(self, names: frozenset[str]) -> None:
        # A change of place does not close the overlay, because the last place opens by itself and
        # deleted places are restored from the overlay.
        if names & {"step", "painting"}:
            self.close_overlay()
        if "light" in names and self.services.model.light is not None:
            # The offer of the first start has been accepted, or is no longer needed.
            self.services.notify.mended("tour")
        if "settings" in names:
            self._keep(self.services.model.settings)

    def shut(self) -> None:
        """Write any settings that are not on disk yet."""
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
                    "Another window also changed the settings. Its version is saved as {name}.",
                    name=other.name,
                ),
                kind="warning",
            )

    def _settings_unkept(self, error: Exception) -> None:
        again = (tr("Try again"), lambda: self._keep(self.services.model.settings))
        self.services.notify.tell_error(error, actions=[again], about="settings")

    def _write_settings(self) -> Path | None:
        # Write only the newest version, one at a time, so that an older one is never written last.
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
