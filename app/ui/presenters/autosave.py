"""Writing of places, a moment after they change."""

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
"""Names of places, and the copies of what another process has written of them."""


class Autosave:
    """Writes places in the order of their changes, a moment later.

    While something moves, as a needle under the hand, only the last of it is written.
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
        """Write a place soon; a newer state of it replaces this one until then."""
        with self._lock:
            running, self._running = self._running, True
            self._waiting[folder] = place
        if not running:
            self._services.runner.submit("keep", self._soon, done=self._done, failed=self._failed)

    def keep_now(self, folder: Path, place: Place) -> Conflicts:
        """Write a place before going on, as at the end; and whatever else still waits.

        Returns what another process has written into them since they were read.

        Raises:
            PlaceError: When the disk refuses; it is tried again with the next that is kept.
        """
        with self._lock:
            # One that still waits would put an older state back.
            self._waiting[folder] = place
        return self._write_waiting()

    def unkept(self, folder: Path) -> Place | None:
        """Return the state of a place that is not on the disk yet; None if everything is."""
        with self._lock:
            return self._waiting.get(folder)

    def forget(self, folder: Path) -> None:
        """Drop what is waiting for a place, as when it was saved elsewhere."""
        with self._lock:
            self._waiting.pop(folder, None)

    def _soon(self, token: Token, _report: Report) -> Conflicts:
        try:
            wait(self._services.clock, _MOMENT_S, token)
        except Cancelled:
            # What was handed over is not lost.
            self._write_waiting()
            raise
        return self._write_waiting()

    def _write_waiting(self) -> Conflicts:
        # Only writers wait for the disk, never who hands something over.
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
                    # It waits on: a disk that is full now may have room later.
                    trouble = trouble or error
                else:
                    self._after_write(folder, place)
        if trouble is not None:
            raise trouble
        return conflicts

    def _holds(self, folder: Path, place: Place) -> bool:
        """Whether the file is as the place: it was read so, or written so since."""
        if not (folder / PLACE).is_file():
            return False
        source, facts = place.source, to_json(place)
        before, last = self._last.get(folder, (None, None))
        if source is None or before is not source:
            # What was found damaged is written whole.
            last = None if source is None or place.remarks else source.file_facts
        return facts == last

    def _after_write(self, folder: Path, place: Place) -> None:
        self._last[folder] = (place.source, to_json(place))
        with self._lock:
            if self._waiting.get(folder) is place:
                del self._waiting[folder]
