"""The window: the frame around the current screen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from PySide6.QtCore import QByteArray, QEvent, QPoint, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (
    QAccessible,
    QCloseEvent,
    QDragEnterEvent,
    QDragLeaveEvent,
    QDropEvent,
    QResizeEvent,
)
from PySide6.QtWidgets import QApplication, QStackedWidget, QVBoxLayout, QWidget

from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Services
from app.ui.presenters.window_frame import FrameState
from app.ui.presenters.window_model import Step
from app.ui.screens.registry import SCREENS, ScreenPresenter, ScreenSpec, screen, screen_of, steps
from app.ui.shell.jobs import JobLine, QtRunner, reading_in
from app.ui.shell.notify import Notify
from app.ui.shell.shortcuts import Shortcuts, hints_of
from app.ui.shell.window_frame import (
    PLACES,
    SETTINGS,
    DropVeil,
    JobLineBar,
    Rail,
    TopBar,
    dropped_paths,
    fit_on_screen,
    room_for,
)
from app.ui.theme import ThemeName, apply, px, set_theme
from app.ui.widgets.accessibility import give_role
from app.ui.widgets.dialogs import Sheet
from app.ui.widgets.layouts import add, boxed, column, row
from app.ui.widgets.messages import Toasts

SMALLEST: Final = QSize(1024, 640)
"""Smallest usable size of the window in logical pixels. A smaller screen overrides this size."""
DESIGNED: Final = QSize(1440, 900)
"""Initial size of the window, if there is room for it on the screen."""
FULL_SIZE: Final = QSize(1280, 760)
"""Smallest window size for the full layout. A smaller window uses the narrow layout."""


class Window(QWidget):
    """The only window of the app."""

    paths_dropped = Signal(list)
    asked = Signal(str, QPoint)
    """Emitted to open an overlay, with the global position to use for a menu.

    The overlay is ``places``, ``settings``, ``find``, ``messages``, ``sitter`` or ``camera``.
    """
    closed = Signal()

    def __init__(
        self,
        application: QApplication,
        services: Services,
        place_controller: PlaceController,
        runner: QtRunner,
        notify: Notify,
        actions: Sequence[Action] = (),
    ) -> None:
        super().__init__()
        self._application = application
        self._services = services
        self._place_controller = place_controller
        self._notify = notify
        self._runner = runner
        self._presenters: dict[str, ScreenPresenter] = {}
        self._views: dict[str, QWidget] = {}
        self._front: str | None = None
        self._state: FrameState | None = None
        self._hints: list[tuple[str, str]] = []
        self._idle = ("", "check")
        self._failed = ""
        self._job: JobLine | None = None
        self._framed = False
        self._make_foot: Callable[[], QWidget] | None = None
        self._foot: QWidget | None = None
        self.actions_everywhere = tuple(actions)
        self.before_closing: Callable[[], bool] = lambda: True
        self._global_shortcuts = Shortcuts(self)
        self._screen_shortcuts = Shortcuts(self)
        self.setWindowTitle("Turnlight")
        self.setObjectName("window")
        give_role(self, QAccessible.Role.Window)
        self.setAcceptDrops(True)
        # Show no focus ring before the user touches the keyboard.
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setProperty("noFocusRing", True)
        self._outer = row(into=self)
        self._relayout = QTimer(self)
        self._relayout.setSingleShot(True)
        self._relayout.timeout.connect(self._fit_layout)
        self._veil: DropVeil | None = None
        self._compact = self._wants_compact()
        self._build()
        runner.line_changed.connect(self._show_job)
        runner.ended.connect(self._job_ended)
        notify.changed.connect(self._show_unread)
        services.model.changed.connect(self._model_changed)
        self._global_shortcuts.bind(self.actions_everywhere)
        application.focusChanged.connect(self._focus_moved)

    def show_state(self, state: FrameState) -> None:
        """Show the state of the frame, and switch to the matching screen."""
        if self._state is None or state.status != self._state.status:
            self._failed = ""
        self._state = state
        model = self._services.model
        is_covered = {spec.key for spec in SCREENS if spec.done(model)}
        self._rail.show_steps(state.step, is_covered, {one.key: one.note(model) for one in SCREENS})
        self._top.show_state(state)
        self.say(state.status, state.status_icon)
        self._show_screen()
        self._show_hints()
        # Wait for the screen's layout, so that no message covers a control.
        QTimer.singleShot(0, self._toasts, self._toasts.lay)

    def set_foot(self, make: Callable[[], QWidget] | None) -> None:
        """Show a widget above the line at the foot, or remove the widget if `make` is None."""
        self._make_foot = make
        if self._foot is not None:
            self._foot.hide()
            self._foot.deleteLater()
        self._foot = None if make is None else make()
        layout = self._body.layout()
        if self._foot is not None and isinstance(layout, QVBoxLayout):
            layout.insertWidget(layout.count() - 1, self._foot)

    def say(self, words: str, icon: str = "check") -> None:
        """Show the last result in the line at the foot."""
        self._idle = (words, icon)
        self._show_job(self._job)

    def wear(self, name: ThemeName, scale: float) -> None:
        """Switch to another theme or scale, and rebuild every view."""
        self.setUpdatesEnabled(False)
        # Remove the old views first, so that they never appear in the new theme.
        self._take_down()
        set_theme(name, scale)
        apply(self._application)
        self._compact = self._wants_compact()
        self._put_up()
        self.setUpdatesEnabled(True)

    @property
    def front(self) -> QWidget | None:
        """The current screen, or None if there is none."""
        return None if self._front is None else self._views.get(self._front)

    @property
    def front_presenter(self) -> ScreenPresenter | None:
        """Presenter of the current screen."""
        return None if self._front is None else self._presenters.get(self._front)

    def _focus_moved(self) -> None:
        # Do not search the children, because the focus also moves while a dialog among them is half
        # destroyed.
        covered = bool(Sheet.over(self))
        self._global_shortcuts.rest(covered)
        self._screen_shortcuts.rest(covered)

    def screen_actions(self) -> Sequence[Action]:
        """Return the actions of the current screen."""
        presenter = self.front_presenter
        return () if presenter is None else presenter.actions()

    def refresh_actions(self) -> None:
        """Update the shortcuts after a change to the current screen's actions."""
        actions = self.screen_actions()
        self._screen_shortcuts.bind(actions)
        self._show_hints(actions)

    def _show_hints(self, actions: Sequence[Action] | None = None) -> None:
        """Show those shortcuts that currently have an effect."""
        find = [one for one in self.actions_everywhere if one.hint]
        here = self.screen_actions() if actions is None else actions
        hints = hints_of([*here, *find])
        if hints != self._hints:
            self._hints = hints
            self._job_line.show_hints(hints)

    def _build(self) -> None:
        self._rail = Rail(self._compact, steps(), self._rail_chosen)
        self._top = TopBar(self._compact, self._services.undo, self._ask)
        self._stack = QStackedWidget()

        def show_messages() -> None:
            self._ask("messages")

        self._job_line = JobLineBar(self._compact, self._runner.cancel, show_messages)
        self._hints = []
        self._body = boxed(column(self._top, (self._stack, 1), self._job_line))
        self._foot = None
        self.set_foot(self._make_foot)
        add(self._outer, self._rail, (self._body, 1))
        self._toasts = Toasts(self)
        self._notify.attach(self._toasts)
        self._show_job(self._job)
        self._show_unread()

    def _rebuild(self) -> None:
        self.setUpdatesEnabled(False)
        self._take_down()
        self._put_up()
        self.setUpdatesEnabled(True)

    def _take_down(self) -> None:
        """Remove all views, but keep the presenters."""
        self._notify.attach(None)
        for key in self._views:
            self._presenters[key].detach()
        self._views.clear()
        self._front = None
        self._toasts.clear()
        self._toasts.deleteLater()
        for widget in (self._rail, self._body):
            widget.hide()
            widget.setParent(None)
            widget.deleteLater()

    def _put_up(self) -> None:
        self._build()
        # Show both now, because the layout would only do so one event later.
        self._rail.show()
        self._body.show()
        if self._state is not None:
            self.show_state(self._state)
        # Keep open sheets above the new screen.
        for sheet in Sheet.over(self):
            sheet.raise_()

    def _show_screen(self) -> None:
        spec = screen_of(self._services.model)
        key = spec.key
        if key == self._front:
            return
        before = self.front_presenter
        if before is not None and self._front in self._views:
            before.leave()
        presenter = self._presenter_of(key)
        if key not in self._views:
            view = spec.make_view(presenter, self._compact)
            # Keys that no control uses go to the screen.
            view.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
            view.setProperty("noFocusRing", True)
            view.setAccessibleName(view.accessibleName() or spec.title)
            give_role(view, QAccessible.Role.Pane)
            self._views[key] = view
            self._stack.addWidget(view)
            presenter.attach(view)
        self._front = key
        self._stack.setCurrentWidget(self._views[key])
        presenter.enter()
        self.refresh_actions()
        # Give the focus to the screen, not to the rail that was clicked.
        view = self._views[key]
        getattr(view, "take_focus", view.setFocus)()

    def _presenter_of(self, key: str) -> ScreenPresenter:
        if key not in self._presenters:
            self._presenters[key] = screen(key).make_presenter(
                self._services, self._place_controller
            )
        return self._presenters[key]

    def _expect_styles(self) -> None:
        """Prepare the gallery while the user is looking at the panorama."""

        def ready(_: None) -> None:
            self._presenter_of("styles")
            self._runner.submit("steps-ready", lambda *_: _read_in(SCREENS))

        self._runner.submit("styles-ready", lambda *_: _read_in([screen("styles")]), done=ready)

    def _model_changed(self, names: frozenset[str]) -> None:
        if "light" in names and "styles" not in self._presenters:
            self._expect_styles()
        if names & {"step", "painting"}:
            self._show_screen()

    def _show_job(self, job: JobLine | None) -> None:
        self._job = job
        if job is not None:
            on_probe = self._services.model.step == Step.PROBE
            self._job_line.show_job(job, stopped_above=on_probe and job.key == "capture")
            return
        self._job_line.show_idle(*((self._failed, "error") if self._failed else self._idle))
        self._show_hints()

    def _job_ended(self, title: str, how: str) -> None:
        """Report a failed job at the foot of the window until there is another message."""
        self._failed = tr("{job} failed.", job=title) if how == "failed" else ""
        self._show_job(self._job)

    def _show_unread(self) -> None:
        self._job_line.show_unread(self._notify.unread)

    def _rail_chosen(self, key: str) -> None:
        if key in (PLACES, SETTINGS):
            self._ask(key)
        else:
            self._services.model.update(step=screen(key).key, painting=None)

    def _ask(self, what: str, at: QPoint | None = None) -> None:
        self.asked.emit(what, self.mapToGlobal(QPoint(0, 0)) if at is None else at)

    # -- size ----------------------------------------------------------------------------------

    def _wants_compact(self) -> bool:
        return self.width() < px(FULL_SIZE.width()) or self.height() < px(FULL_SIZE.height())

    def _fit_layout(self) -> None:
        if self._wants_compact() != self._compact:
            self._compact = not self._compact
            self._rebuild()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Choose a layout that fits, once the user has finished resizing the window."""
        super().resizeEvent(event)
        if self._veil is not None:
            self._veil.setGeometry(self.rect())
        self._relayout.start()

    def restore(self, geometry: QByteArray | None) -> None:
        """Restore the previous size and position as far as they fit on this screen."""
        if geometry is None or not self.restoreGeometry(geometry):
            self.resize(DESIGNED)
            self.move(room_for(self).center() - self.rect().center())
        fit_on_screen(self, SMALLEST)
        self._fit_layout()

    def changeEvent(self, event: QEvent) -> None:
        """Fit the window to the screen as soon as the desktop has added the window's frame."""
        super().changeEvent(event)
        if event.type() is QEvent.Type.ActivationChange and not self._framed:
            self._framed = True
            QTimer.singleShot(0, self, lambda: fit_on_screen(self, SMALLEST))

    # -- files dropped anywhere ----------------------------------------------------------------

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Show that files can be dropped here."""
        if dropped_paths(event.mimeData()):
            event.acceptProposedAction()
            self._veil = self._veil or DropVeil(self)
            self._veil.set_words(getattr(self.front_presenter, "drop_words", ""))
            self._veil.setGeometry(self.rect())
            self._veil.show()
            self._veil.raise_()

    def dragLeaveEvent(self, event: QDragLeaveEvent) -> None:
        """Hide the veil again."""
        self._lift_veil()

    def dropEvent(self, event: QDropEvent) -> None:
        """Open the dropped files."""
        self._lift_veil()
        paths: list[Path] = dropped_paths(event.mimeData())
        if paths:
            event.acceptProposedAction()
            self.paths_dropped.emit(paths)

    def _lift_veil(self) -> None:
        if self._veil is not None:
            self._veil.hide()

    # -- the end -------------------------------------------------------------------------------

    def closeEvent(self, event: QCloseEvent) -> None:
        """Stop the devices that the screens use, then close the window."""
        presenter = self.front_presenter
        if presenter is not None:
            presenter.leave()
        if not self.before_closing():
            if presenter is not None:
                presenter.enter()
            event.ignore()
            return
        self.closed.emit()
        super().closeEvent(event)


def _read_in(screens: Sequence[ScreenSpec]) -> None:
    """Import screens before the user opens them."""
    with reading_in():
        for spec in screens:
            spec.read_in()
