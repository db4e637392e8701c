"""Drafts of unsaved paintings, saved shortly after each change."""

from __future__ import annotations

import threading
from contextlib import nullcontext
from pathlib import Path
from typing import Final

from app.core.base.atomic_files import make_folder
from app.core.base.errors import CoreError
from app.core.base.progress import Report, Token
from app.core.painting.draft_file import Draft, draft_version, put_draft_aside, save_draft
from app.core.storage.data_lock import writing
from app.core.text import tr
from app.devices.clock import wait
from app.ui.presenters.saving import disk_words
from app.ui.presenters.services import Services

_JOB: Final = "paint-draft"
_DELAY_S: Final = 0.8


class DraftKeeper:
    """Saves drafts in a job, shortly after they change."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._lock = threading.Lock()
        self._writing = threading.Lock()
        self._waiting: dict[Path, Draft | None] = {}
        self._versions: dict[Path, str] = {}
        self._others: list[Path] = []
        self._has_warned = False

    def opened(self, path: Path, version: str) -> None:
        """Remember the version of a draft in order to recognise a newer one from another window."""
        self._versions[path] = version

    def keep(self, path: Path, draft: Draft | None) -> None:
        """Schedule a draft to be saved, or its file to be deleted if `draft` is None."""
        with self._lock:
            self._waiting[path] = draft
        self._start()

    def flush(self) -> bool:
        """Save all pending drafts now. Return whether this succeeded, and warn if it did not."""
        try:
            self._write()
        except (CoreError, OSError) as error:
            self._failed(error)
            return False
        self._report_others()
        return True

    def _start(self) -> None:
        runner = self._services.runner
        # A pending job writes the newest draft.
        if not runner.running(_JOB):
            runner.submit(_JOB, self._work, done=self._on_written, failed=self._failed)

    def _work(self, token: Token, _report: Report) -> None:
        wait(self._services.clock, _DELAY_S, token)
        self._write()

    def _write(self) -> None:
        # Only writers wait for the disk; a stroke that ends meanwhile is queued at once.
        with self._writing:
            with self._lock:
                waiting = tuple(self._waiting.items())
            for path, draft in waiting:
                if draft is not None:
                    make_folder(path.parent)
                with writing(path.parent) if path.parent.is_dir() else nullcontext():
                    self._replace(path, draft)
                with self._lock:
                    if self._waiting.get(path, self) is draft:
                        del self._waiting[path]

    def _replace(self, path: Path, draft: Draft | None) -> None:
        """Save or delete a draft, first renaming its file if another window has written to it."""
        here = draft_version(path)
        if here and here != self._versions.get(path, here):
            self._others.append(put_draft_aside(path))
        if draft is None:
            path.unlink(missing_ok=True)
        else:
            save_draft(path, draft)
        self._versions[path] = draft_version(path)

    def _report_others(self) -> None:
        others, self._others = self._others, []
        for other in others:
            self._services.notify.tell(
                tr(
                    "This style was also painted in another window. That draft is kept as {name}.",
                    name=other.name,
                ),
                kind="warning",
            )

    def _on_written(self, _answer: None) -> None:
        self._report_others()
        self._has_warned = False
        self._services.notify.mended("drafts")
        with self._lock:
            more = bool(self._waiting)
        if more:
            self._start()

    def _failed(self, error: Exception) -> None:
        # Warn only once, not after every stroke; the next stroke tries again.
        if not self._has_warned:
            self._has_warned = True
            why = disk_words(error)
            words = tr(
                "The draft cannot be saved: {reason}. Your strokes are kept while "
                "Turnlight is open. Save them as a style.",
                reason=why or str(error),
            )
            if not why and isinstance(error, CoreError):
                words = tr(
                    "The draft cannot be saved. {message} Your strokes are kept while "
                    "Turnlight is open. Save them as a style.",
                    message=error.message,
                )
            self._services.notify.tell(
                words,
                kind="warning",
                about="drafts",
                stay=True,
            )
