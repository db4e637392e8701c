"""Watches a folder, and creates places from the brackets that arrive in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from app.core.base.progress import PhraseReport, Token
from app.core.text import tr, tr_plural
from app.devices.watched_folder.incoming_bracket import IncomingBracket
from app.devices.watched_folder.watch import WatchedFolder
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Services

KEY: Final = "watch"


class _Relay(Token):
    """A token that forwards to the current job's token, because one wait spans several jobs."""

    __slots__ = ("brackets", "job")

    def __init__(self) -> None:
        super().__init__()
        self.job = Token()
        self.brackets: Iterator[IncomingBracket] | None = None

    @property
    def cancelled(self) -> bool:
        """Whether the waiting job has been asked to stop."""
        return self.job.cancelled

    def check(self) -> None:
        """Raise `Cancelled` if the waiting job has been cancelled."""
        self.job.check()


class Watching:
    """Watches one folder at a time."""

    def __init__(
        self, services: Services, place_controller: PlaceController, changed: Callable[[], None]
    ) -> None:
        self._services = services
        self._place_controller = place_controller
        self._changed = changed
        self.folder: Path | None = None
        self._relay = _Relay()

    def start(self, folder: Path) -> None:
        """Watch a folder, ignoring the files already in it."""
        self.stop()
        self.folder = folder
        self._relay = _Relay()
        self._wait()
        self._changed()

    def stop(self) -> None:
        """Stop watching."""
        if self.folder is not None:
            self.folder = None
            self._services.runner.cancel(KEY)
            self._changed()

    def _wait(self) -> None:
        folder, relay, clock = self.folder, self._relay, self._services.clock
        if folder is None:
            return

        def work(token: Token, report: PhraseReport) -> IncomingBracket:
            relay.job = token
            report(0.0, tr("Waiting for photos in {name}", name=folder.name))
            if relay.brackets is None:
                relay.brackets = WatchedFolder(folder, clock).brackets(relay)
            return next(relay.brackets)

        self._services.runner.submit(
            KEY,
            work,
            title=tr("Watching {name}", name=folder.name),
            done=lambda bracket: self._arrived(relay, bracket),
            failed=lambda error: self._failed(relay, error),
            cancelled=lambda: self._ended(relay),
        )

    def _arrived(self, relay: _Relay, bracket: IncomingBracket) -> None:
        folder = self.folder
        if relay is not self._relay or folder is None:
            return
        self._services.notify.tell(
            tr_plural(
                "A bracket of {count} frame has arrived in {folder}.",
                "A bracket of {count} frames has arrived in {folder}.",
                len(bracket.paths),
                folder=folder.name,
            )
        )
        self._place_controller.take_in(list(bracket.paths))
        self._wait()

    def _failed(self, relay: _Relay, error: Exception) -> None:
        self._ended(relay)
        self._services.notify.tell_error(error)

    def _ended(self, relay: _Relay) -> None:
        # Ignore a wait that was replaced by a newer wait for the same folder.
        if relay is self._relay and self.folder is not None:
            self.folder = None
            self._changed()
