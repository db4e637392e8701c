"""Starts the app (its settings, theme, window and first jobs), and ends it without losing data."""

from __future__ import annotations

import contextlib
import logging
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

from PySide6.QtCore import (
    QByteArray,
    QEvent,
    QMessageLogContext,
    QObject,
    Qt,
    QTimer,
    QtMsgType,
    Signal,
    qInstallMessageHandler,
)
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QApplication

from app.core.base.atomic_files import atomic_write_bytes, open_file
from app.core.base.errors import CoreError
from app.core.base.native import plain_numbers
from app.core.base.paths import resources, user_data
from app.core.storage.privacy import tighten
from app.core.storage.settings import Settings
from app.core.storage.settings_file import FILE, read_settings
from app.core.text import tr
from app.devices.clock import Clock
from app.ui.overlays import open_overlay
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Devices, Folders, Services
from app.ui.presenters.undo_stack import UndoStack
from app.ui.presenters.window_frame import FramePresenter
from app.ui.presenters.window_model import Model
from app.ui.shell.commands import Commands
from app.ui.shell.jobs import QtRunner, keep_little
from app.ui.shell.log import LAST_CRASH, LOGS, crash_text
from app.ui.shell.notify import Notify, Speaker
from app.ui.shell.one_window import WindowServer
from app.ui.shell.signals import ending_by_signal
from app.ui.shell.window import Window
from app.ui.theme import ThemeName, apply, set_theme
from app.ui.widgets.dialogs import show_folder
from app.words.settings import note_words

if TYPE_CHECKING:
    from app.ui.shell.launch_options import LaunchOptions


_LEVELS: Final = {
    QtMsgType.QtDebugMsg: logging.DEBUG,
    QtMsgType.QtInfoMsg: logging.INFO,
    QtMsgType.QtWarningMsg: logging.WARNING,
    QtMsgType.QtCriticalMsg: logging.ERROR,
    QtMsgType.QtFatalMsg: logging.CRITICAL,
}
_LOOK_MS: Final = 5_000  # interval for checking whether the open place is still on the disk
_log = logging.getLogger("turnlight")


class _Carrier(QObject):
    """Carries errors from any thread to the main thread."""

    came = Signal(object)


@contextlib.contextmanager
def caught_errors(tell: Callable[[Exception], None]) -> Iterator[None]:
    """Catch every error that would otherwise end a thread or merely be printed.

    Yields:
        None, while the hooks are set. The previous hooks are restored afterwards.
    """
    carrier = _Carrier()
    carrier.came.connect(tell, Qt.ConnectionType.QueuedConnection)

    def take(error: BaseException | None) -> None:
        if isinstance(error, Exception):
            _log.error("uncaught exception", exc_info=error)
            carrier.came.emit(error)

    def on_main(kind: type[BaseException], error: BaseException, trace: Any) -> None:
        if isinstance(error, Exception):
            take(error)
        else:
            sys.__excepthook__(kind, error, trace)

    def from_qt(kind: QtMsgType, _context: QMessageLogContext, message: str) -> None:
        _log.log(_LEVELS.get(kind, logging.INFO), "Qt: %s", message)

    before = (sys.excepthook, threading.excepthook, sys.unraisablehook)
    sys.excepthook = on_main
    threading.excepthook = lambda args: take(args.exc_value)
    sys.unraisablehook = lambda args: take(args.exc_value)
    qt_before = qInstallMessageHandler(from_qt)
    try:
        yield
    finally:
        sys.excepthook, threading.excepthook, sys.unraisablehook = before
        qInstallMessageHandler(qt_before)


_MOST_GEOMETRY: Final = 4096  # bytes


def show_until_closed(app: App) -> int:
    """Show the window, and handle events until the window is closed."""
    app.show()
    code: int = app.application.exec()
    return code


def run(
    options: LaunchOptions,
    devices: Devices,
    clock: Clock,
    use: Callable[[App], int] = show_until_closed,
    *,
    crashed: bool = False,
) -> int:
    """Create the app, and call `use` with it.

    Args:
        crashed: Whether the previous run ended in a crash. If so, the crash is reported.

    Returns:
        The exit code, which is 128 plus the number of the signal if a signal ended the app.
    """
    keep_little()
    application = QApplication.instance() or QApplication(sys.argv[:1])
    assert isinstance(application, QApplication)
    plain_numbers()
    home = user_data()
    app = App(application, options, devices, clock, home)
    if crashed:
        app.tell_crash()
    server = WindowServer(home, app.show_with)
    try:
        with caught_errors(app.notify.tell_error), ending_by_signal(app.end):
            code = use(app)
    finally:
        server.close()
    code = 128 + app.ended_by if app.ended_by else code
    _log.info("end: exit code %d", code)
    return code


class App:
    """The app, which consists of one model, one window and their services."""

    def __init__(
        self,
        application: QApplication,
        options: LaunchOptions,
        devices: Devices,
        clock: Clock,
        home: Path,
    ) -> None:
        application.setApplicationName("Turnlight")
        self.application = application
        self.options = options
        self._window_file = home / "window.bin"
        settings, notes = read_settings(home / FILE)
        self.notify = Notify(_now)
        self.runner = QtRunner(self.notify.tell_error)
        self.model = Model(settings)
        self.services = Services(
            model=self.model,
            runner=self.runner,
            notify=self.notify,
            undo=UndoStack(),
            clock=clock,
            today=_now,
            devices=devices,
            folders=_folders(home, settings),
            sounds=Speaker(),
        )
        self.place_controller = PlaceController(self.services)
        self._warned = False
        self.ended_by = 0
        self._worn = self._look(settings)
        set_theme(*self._worn)
        apply(application)
        self.commands = Commands(self.services, self.place_controller, self.notify, open_overlay)
        self.window = Window(
            application,
            self.services,
            self.place_controller,
            self.runner,
            self.notify,
            self.commands.everywhere(),
        )
        self.window.before_closing = self._may_close
        self.commands.attach(self.window)
        self.frame = FramePresenter(self.services)
        self.frame.attach(self.window)
        self.model.changed.connect(self._model_changed)
        self.window.closed.connect(self.shut)
        look = QTimer(self.window)
        look.setInterval(_LOOK_MS)
        look.timeout.connect(self.place_controller.saving.look)
        look.start()
        self.window.paths_dropped.connect(self.commands.open_paths)
        for note in notes:
            self.notify.tell(note_words(note), kind="warning")

    def show(self) -> None:
        """Show the window at its last position, and start the first jobs after its first paint."""
        _AfterFirstPaint(self.window, self._begin)
        self.window.restore(self._kept_geometry())
        self.window.show()
        self.window.setFocus()

    def shut(self) -> None:
        """End all jobs. By this time, everything has been saved."""
        self._keep_geometry()
        self.commands.shut()
        self.runner.shutdown()
        # Do not rely on the last window, because a menu or a tooltip may still count as one.
        self.application.quit()

    def end(self, number: int) -> None:
        """Save everything possible and close the app, for example after a signal."""
        _log.info("ending by signal %d", number)
        self.ended_by, self._warned = number, True
        try:
            if not self.place_controller.keep_all():
                _log.warning("saved elsewhere: %s", self.place_controller.saving.rescue())
            self.window.close()
        finally:
            self.application.quit()

    def show_with(self, paths: Sequence[Path]) -> None:
        """Bring the window to the front, and open the files received from a second start."""
        window = self.window
        _log.info("shown by another start, with %d files", len(paths))
        window.setWindowState(window.windowState() & ~Qt.WindowState.WindowMinimized)
        window.show()
        window.raise_()
        window.activateWindow()
        self.application.alert(window)
        if paths:
            self.commands.open_paths(paths)

    def tell_crash(self) -> None:
        """Offer the log of the previous run because that run ended in a crash."""
        logs = self._window_file.parent / LOGS
        _log.info("the last crash is in %s", LAST_CRASH)
        self.notify.tell(
            tr("Turnlight crashed last time. The log can help to fix the problem."),
            kind="warning",
            actions=[
                (tr("Show the log"), lambda: show_folder(logs)),
                (tr("Copy the log"), lambda: self._copy(crash_text(logs))),
            ],
            about="crash",
            stay=True,
        )

    def _copy(self, words: str) -> None:
        self.application.clipboard().setText(words)
        self.notify.tell(tr("Log copied."), kind="done")

    def _may_close(self) -> bool:
        """Save everything, and return whether the window may close.

        Only the first failure to save keeps the window open.
        """
        if self.place_controller.keep_all() or self._warned:
            return True
        self._warned = True
        self.notify.tell(
            tr(
                "The last changes are not saved. Free some space first, or close again to discard "
                "them."
            ),
            kind="warning",
        )
        return False

    def _begin(self) -> None:
        paths = self.options.paths
        # The demo begins without a place, like a first start.
        self.place_controller.begin(reopen=not (self.options.demo or paths))
        self.commands.begin()
        folders = self.services.folders
        self.runner.submit("tighten", lambda token, _: tighten(folders.home, folders.places, token))
        if paths:
            self.commands.open_paths(paths)
        threading.Thread(target=_load_libraries).start()

    def _look(self, settings: Settings) -> tuple[ThemeName, float]:
        name = self.options.theme or settings.theme
        if name == "system":
            scheme = QGuiApplication.styleHints().colorScheme()
            name = "light" if scheme is Qt.ColorScheme.Light else "dark"
        return cast("ThemeName", name), settings.text_scale

    def _model_changed(self, names: frozenset[str]) -> None:
        if "settings" in names:
            look = self._look(self.model.settings)
            if look != self._worn:
                self._worn = look
                self.window.wear(*look)
                self.commands.reopen()

    def _kept_geometry(self) -> QByteArray | None:
        with contextlib.suppress(OSError), open_file(self._window_file) as stream:
            return QByteArray(stream.read(_MOST_GEOMETRY))
        return None

    def _keep_geometry(self) -> None:
        if self.options.screenshots is not None:
            return
        with contextlib.suppress(CoreError):
            atomic_write_bytes(self._window_file, bytes(self.window.saveGeometry().data()))


class _AfterFirstPaint(QObject):
    """Calls a function once, right after the window's first paint."""

    def __init__(self, window: Window, call: Callable[[], None]) -> None:
        super().__init__(window)
        self._call = call
        window.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() is QEvent.Type.Paint:
            watched.removeEventFilter(self)
            QTimer.singleShot(0, self._call)
        return False


def _folders(home: Path, settings: Settings) -> Folders:
    folder = settings.places_folder
    return Folders(
        home=home,
        places=Path(folder).expanduser() if folder else home / "places",
        styles=home / "styles",
        drafts=home / "drafts",
        demo=resources() / "demo" / "cafe",
    )


def _load_libraries() -> None:
    """Import the libraries that the screens need, once the window is visible."""
    for name in ("pyqtgraph", "miniaudio"):
        with contextlib.suppress(ImportError):
            import_module(name)


def _now() -> datetime:
    return datetime.now().astimezone()
