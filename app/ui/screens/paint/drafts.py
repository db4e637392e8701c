"""Drafts of paintings: kept a moment after every stroke, found again at the next entering."""

from __future__ import annotations

import contextlib
import os
import threading
from typing import TYPE_CHECKING, Final

from app.core.base.errors import CoreError, StyleError
from app.core.painting.user_style import Draft, load_draft, save_draft
from app.devices.clock import wait
from app.ui.presenters.saving import disk_words

if TYPE_CHECKING:
    from pathlib import Path

    from app.core.base.progress import Report, Token
    from app.ui.presenters.services import Services

_JOB: Final = "paint-draft"
_DELAY_S: Final = 0.8
_MOST: Final = 20
_AWAY: Final = "draft.npz"


def find_draft(folder: Path, key: str) -> tuple[Path, Draft | None, tuple[str, ...]]:
    """Look for the draft that was begun from a style.

    A file that cannot be read is left as it is; the next free name is taken beside it.

    Returns
    -------
    path : Path
        Where the draft is to be kept from now on.
    notes : tuple of str
        What was wrong with files that are left as they are.
    """
    notes: list[str] = []
    stem = f"paint-{key}" if key else "paint"
    for number in range(1, _MOST + 1):
        path = folder / (f"{stem}.npz" if number == 1 else f"{stem}.{number}.npz")
        if not path.exists():
            return path, None, tuple(notes)
        try:
            return path, load_draft(path), tuple(notes)
        except StyleError as error:
            notes.append(str(error))
    return folder / f"{stem}.{_MOST + 1}.npz", None, tuple(notes)


def put_draft_away(folder: Path, key: str, trash: Path) -> None:
    """Move the draft of a deleted style to it: a new one of that name is not to begin with it."""
    path, draft, _ = find_draft(folder, key)
    if draft is not None:
        # Where it cannot be moved it stays where the style will look for it.
        with contextlib.suppress(OSError):
            os.replace(path, trash / _AWAY)


def bring_draft_back(folder: Path, key: str, trash: Path) -> None:
    """Bring the draft of a restored style back, under the name that the style has now."""
    path, other, _ = find_draft(folder, key)
    if other is None and (trash / _AWAY).exists():
        folder.mkdir(parents=True, exist_ok=True)
        os.replace(trash / _AWAY, path)


class DraftKeeper:
    """Writes drafts a moment after they change, off the thread of the screens."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._lock = threading.Lock()
        self._writing = threading.Lock()
        self._waiting: dict[Path, Draft | None] = {}
        self._told = False

    def keep(self, path: Path, draft: Draft | None) -> None:
        """Write a draft soon; None takes the file away, as there is nothing unsaved any more."""
        with self._lock:
            self._waiting[path] = draft
        self._start()

    def flush(self) -> bool:
        """Write now what waits: the screen, or the window, is about to go.

        Returns
        -------
        bool
            Whether it is on the disk; if not, that is told.
        """
        try:
            self._write()
        except (CoreError, OSError) as error:
            self._failed(error)
            return False
        return True

    def _start(self) -> None:
        runner = self._services.runner
        # One that waits already will take the newest.
        if not runner.running(_JOB):
            runner.submit(_JOB, self._work, done=self._written, failed=self._failed)

    def _work(self, token: Token, report: Report) -> None:
        del report
        wait(self._services.clock, _DELAY_S, token)
        self._write()

    def _write(self) -> None:
        # Only writers wait for the disk, one for the other: who comes second writes the newer
        # one. A stroke that ends meanwhile is handed over at once.
        with self._writing:
            with self._lock:
                waiting = tuple(self._waiting.items())
            for path, draft in waiting:
                if draft is None:
                    path.unlink(missing_ok=True)
                else:
                    path.parent.mkdir(parents=True, exist_ok=True)
                    save_draft(path, draft)
                with self._lock:
                    if self._waiting.get(path, self) is draft:
                        del self._waiting[path]

    def _written(self, _answer: None) -> None:
        self._told = False
        self._services.notify.mended("drafts")
        with self._lock:
            more = bool(self._waiting)
        if more:
            self._start()

    def _failed(self, error: Exception) -> None:
        # Once, not after every stroke; what could not be written is tried again with the next.
        if not self._told:
            self._told = True
            said = disk_words(error)
            if not said:
                said = error.message if isinstance(error, CoreError) else f"{error}"
            self._services.notify.tell(
                f"The draft cannot be saved: {said.rstrip('.')}. "
                "Your strokes are kept while Turnlight is open. Save them as a style.",
                kind="warning",
                about="drafts",
                stay=True,
            )
