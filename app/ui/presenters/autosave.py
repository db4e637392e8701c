"""Automatic saving of places, shortly after each change."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Final, TypeAlias

from app.core.base.errors import Cancelled
from app.core.base.progress import Report, Token
from app.core.places.place import Place, PlaceError, PlaceSource
from app.core.places.place_folder import PLACE, write_place
from app.core.places.saved.place_json import to_json
from app.core.storage.json_file import Facts
from app.devices.clock import wait
from app.ui.presenters.services import Services

_MOMENT_S: Final = 0.4

Conflicts: TypeAlias = list[tuple[str, Path]]
"""Name of each place that another process has also changed, with the copy of that version."""


class Autosave:
    """Writes places after a short delay, in the order in which they were changed.

    During a continuous change, such as dragging the needle, only the last state is written.
    """

    def __init__(
        self,
        services: Services,
        done: Callable[[Conflicts], None],
        failed: Callable[[Exception], None],
    ) -> None:
        self._services = services
        self._done, self._failed = done, failed
        self._lock = threading.Lock()
        self._writing = threading.Lock()
        self._waiting: dict[Path, Place] = {}
        self._running = False
        self._last: dict[Path, tuple[PlaceSource | None, Facts]] = {}

    def keep(self, folder: Path, place: Place) -> None:
        """Write a place after a short delay, unless a newer state replaces this one first."""
        with self._lock:
            running, self._running = self._running, True
            self._waiting[folder] = place
        if not running:
            self._services.runner.submit("keep", self._soon, done=self._done, failed=self._failed)

    def keep_now(self, folder: Path, place: Place) -> Conflicts:
        """Write a place and everything else that is waiting, for example before the app closes.

        Returns:
            The versions that another process has written since the places were read.

        Raises:
            PlaceError: If a write fails. The failed write is tried again together with the next
                one.
        """
        with self._lock:
            # A waiting older state would otherwise overwrite this one.
            self._waiting[folder] = place
        return self._write_waiting()

    def unkept(self, folder: Path) -> Place | None:
        """Return the unsaved state of a place, or None if everything is already on disk."""
        with self._lock:
            return self._waiting.get(folder)

    def forget(self, folder: Path) -> None:
        """Discard a place's waiting state, for example because the place was saved elsewhere."""
        with self._lock:
            self._waiting.pop(folder, None)

    def _soon(self, token: Token, _report: Report) -> Conflicts:
        try:
            wait(self._services.clock, _MOMENT_S, token)
        except Cancelled:
            # Save the waiting states even if the delay was cancelled.
            self._write_waiting()
            raise
        return self._write_waiting()

    def _write_waiting(self) -> Conflicts:
        # Only writers wait for the disk; callers that queue a place never do.
        with self._writing:
            with self._lock:
                self._running = False
                waiting = tuple(self._waiting.items())
            trouble: PlaceError | None = None
            conflicts: Conflicts = []
            for folder, place in waiting:
                try:
                    if not self._holds(folder, place):
                        other = write_place(folder, place)
                        if other is not None:
                            conflicts.append((place.name, other))
                except PlaceError as error:
                    # Keep the place waiting, because a full disk may have space later.
                    trouble = trouble or error
                else:
                    self._after_write(folder, place)
        if trouble is not None:
            raise trouble
        return conflicts

    def _holds(self, folder: Path, place: Place) -> bool:
        """Return whether the file of the place already contains this state."""
        if not (folder / PLACE).is_file():
            return False
        source, facts = place.source, to_json(place)
        before, last = self._last.get(folder, (None, None))
        if source is None or before is not source:
            # A file with damaged parts is rewritten in full.
            last = None if source is None or place.remarks else source.file_facts
        return facts == last

    def _after_write(self, folder: Path, place: Place) -> None:
        self._last[folder] = (place.source, to_json(place))
        with self._lock:
            if self._waiting.get(folder) is place:
                del self._waiting[folder]
