"""Keeping a place on the disk: always the newest, never an older one over it."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Final

from app.core.storage.places import PlaceError, write_place
from app.core.storage.places.encoding import to_json
from app.devices.clock import wait

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from app.core.base.progress import Report, Token
    from app.core.storage.places import Place
    from app.core.storage.places.place import Source
    from app.core.storage.settings.json_file import Facts
    from app.ui.presenters.services import Services

_MOMENT_S: Final = 0.4


class Autosave:
    """Writes places in the order in which they were handed over, a moment later.

    While something moves, as a needle under the hand, only the last of it is written.
    """

    def __init__(
        self,
        services: Services,
        done: Callable[[object], None],
        failed: Callable[[Exception], None],
    ) -> None:
        self._services = services
        self._done, self._failed = done, failed
        self._lock = threading.Lock()
        self._writing = threading.Lock()
        self._waiting: dict[Path, Place] = {}
        self._begun = False
        self._last: dict[Path, tuple[Source | None, Facts]] = {}

    def keep(self, folder: Path, place: Place) -> None:
        """Write a place soon; what is handed over until then takes its place."""
        with self._lock:
            begun, self._begun = self._begun, True
            self._waiting[folder] = place
        if not begun:
            self._services.runner.submit("keep", self._soon, done=self._done, failed=self._failed)

    def keep_now(self, folder: Path, place: Place) -> None:
        """Write a place before going on, as at the end; and whatever else still waits.

        Raises
        ------
        PlaceError
            When the disk refuses; it is tried again with the next that is kept.
        """
        with self._lock:
            # One that still waits would put an older state back.
            self._waiting[folder] = place
        self._write_waiting()

    def unkept(self, folder: Path) -> Place | None:
        """Give what the disk has not taken yet of a place; None where it has everything."""
        with self._lock:
            return self._waiting.get(folder)

    def forget(self, folder: Path) -> None:
        """Write nothing more of a place, as when it was kept elsewhere."""
        with self._lock:
            self._waiting.pop(folder, None)

    def _soon(self, token: Token, report: Report) -> None:
        del report
        try:
            wait(self._services.clock, _MOMENT_S, token)
        finally:
            # Also when it is stopped: what was handed over is not lost.
            self._write_waiting()

    def _write_waiting(self) -> None:
        # Only writers wait for the disk, never who hands something over.
        with self._writing:
            with self._lock:
                self._begun = False
                waiting = tuple(self._waiting.items())
            trouble: PlaceError | None = None
            for folder, place in waiting:
                try:
                    if not self._holds(folder, place):
                        write_place(folder, place)
                except PlaceError as error:
                    # It waits on: a disk that is full now may have room later.
                    trouble = trouble or error
                else:
                    self._written(folder, place)
        if trouble is not None:
            raise trouble

    def _holds(self, folder: Path, place: Place) -> bool:
        """Whether the file is as the place: it was read so, or written so since."""
        source, facts = place.source, to_json(place)
        before, last = self._last.get(folder, (None, None))
        if source is None or before is not source:
            # What was found damaged is written whole.
            last = None if source is None or place.remarks else source.found
        return facts == last

    def _written(self, folder: Path, place: Place) -> None:
        self._last[folder] = (place.source, to_json(place))
        with self._lock:
            if self._waiting.get(folder) is place:
                del self._waiting[folder]
