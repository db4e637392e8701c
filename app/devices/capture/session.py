"""A session: one folder for one capture, with a journal that survives a power cut.

    FOLDER/session.json      the journal, written atomically before every step
    FOLDER/originals/        the camera's files, never changed once they are complete
    FOLDER/thumbnails/       thumbnails to show during the download

A file in `originals` gets its final name only when it is complete. Until then, it is called
``NAME.part``. Reopening the folder therefore always finds every complete file.
"""

from __future__ import annotations

import os
import re
import threading
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlsplit

from app.core.base.atomic_files import (
    atomic_write_text,
    check_target,
    make_folder,
    open_file,
    os_errors_as,
    words_of,
)
from app.core.base.errors import CoreError
from app.core.base.remarks import PlainRemark, Remark
from app.core.places.journal import (
    JOURNAL,
    Newer,
    SessionFrame,
    SessionJournal,
    journal_of,
    text_of,
)
from app.core.storage.json_file import Unfit
from app.core.text import tr
from app.devices.capture.file_integrity import sha256_of, whole_picture

if TYPE_CHECKING:
    from app.devices.theta.messages import FileEntry


_MAX_BYTES: Final = 4 << 20
_MAX_WARNINGS: Final = 100
_ORIGINALS: Final = "originals"
_THUMBNAILS: Final = "thumbnails"
_DAMAGED: Final = re.compile(r"session\.damaged-[0-9]+\.json")
# Temporary files left by a killed process: the journal, the environment and the metering photo.
_TEMPORARY: Final = re.compile(r"\.session-.*\.json|\.environment-.*\.exr|\.metering\.jpg")
# Files that operating systems add to folders.
_LITTER: Final = frozenset({".DS_Store", "Thumbs.db", "desktop.ini", ".directory"})
_DATE: Final = re.compile(r"(\d{4}):(\d\d):(\d\d) (\d\d):(\d\d):(\d\d)")
_UNSAFE: Final = re.compile(r"[^A-Za-z0-9_.-]")
_TEXTS: Final = ("model", "serial", "firmware", "group_id", "previous_latest")


class Session:
    """The folder of one capture, with its journal.

    Use `create`, `open` or `open_or_create`. A session may be used by several threads, but not by
    several processes at once.
    """

    def __init__(self, folder: Path, journal: SessionJournal, notices: Iterable[str] = ()) -> None:
        self.folder = folder
        self.notices = tuple(notices)
        self._journal = journal
        self._lock = threading.RLock()

    @classmethod
    def create(cls, folder: Path | str) -> Session:
        """Create a session in a missing or empty folder.

        Raises:
            CoreError: If the folder is not empty, or cannot be created or written.
        """
        place = Path(folder)
        if any(not _is_ours(name) or name == JOURNAL for name in _entries(place)):
            raise CoreError(
                tr("The folder {place} is not empty.", place=place),
                tr("Choose a new folder for the session."),
            )
        session = cls(place, SessionJournal(started=_now()))
        session._prepare()
        session.update()
        return session

    @classmethod
    def open(cls, folder: Path | str) -> Session:
        """Open an existing session and check its files.

        An unreadable journal is renamed and a new one is started. The files in `originals` stay
        there and are matched by name. Complete files that the journal lacks are added to it, and
        files that have disappeared or changed count as missing.

        Raises:
            CoreError: If the folder is not a session, or was created by a newer version of this
                program.
        """
        place = Path(folder)
        if not any(name == JOURNAL or _DAMAGED.fullmatch(name) for name in _entries(place)):
            raise CoreError(
                tr("The folder {place} is not a session.", place=place),
                tr("Choose the folder of a capture."),
            )
        journal, notices = _read(place)
        session = cls(place, journal, notices)
        session._prepare()
        session._take_stock()
        return session

    @classmethod
    def open_or_create(cls, folder: Path | str) -> Session:
        """Resume the session in a folder, or create one in a missing or empty folder.

        Raises:
            CoreError: If the folder has files that are not from a session.
        """
        place = Path(folder)
        names = _entries(place)
        if any(name == JOURNAL or _DAMAGED.fullmatch(name) for name in names):
            return cls.open(place)
        if any(not _is_ours(name) for name in names):
            raise CoreError(
                tr("The folder {place} contains files that are not from a session.", place=place),
                tr("Choose a new or empty folder."),
            )
        return cls.create(place)

    @property
    def originals(self) -> Path:
        """Folder of the camera's own files."""
        return self.folder / _ORIGINALS

    @property
    def thumbnails(self) -> Path:
        """Folder of the thumbnails."""
        return self.folder / _THUMBNAILS

    @property
    def journal(self) -> SessionJournal:
        """The journal as it is stored on disk."""
        return self._journal

    @property
    def unfinished(self) -> bool:
        """Whether a capture was started here but not finished."""
        return self._journal.stage not in ("idle", "done")

    @property
    def owes(self) -> bool:
        """Whether the camera's settings still have to be restored."""
        return self._journal.owes

    @property
    def complete(self) -> bool:
        """Whether every file of the bracket is on disk and the camera is no longer needed."""
        journal = self._journal
        here = bool(journal.frames) and all(frame.done for frame in journal.frames)
        return journal.plan is not None and journal.exposed and here

    def update(self, **changes: Any) -> None:
        """Change the journal, first on disk and then in memory.

        Call this before the step that the change records.

        Args:
            **changes: Fields of `SessionJournal`. Text from a camera is truncated, and its control
                characters are replaced.

        Raises:
            CoreError: If the journal cannot be written. The journal in memory is then unchanged.
            ValueError: If a value could not be read back, or contains a password.
        """
        with self._lock:
            for name in _TEXTS:
                if name in changes:
                    changes[name] = _clean(changes[name], 1000)
            if "warnings" in changes:
                warnings = tuple(changes["warnings"])[:_MAX_WARNINGS]
                changes["warnings"] = tuple(map(_cleaned, warnings))
            journal = replace(self._journal, **changes)
            atomic_write_text(self.folder / JOURNAL, text_of(journal))
            self._journal = journal

    def warn(self, remark: Remark) -> None:
        """Add a warning unless it is already there."""
        with self._lock:
            if _cleaned(remark) not in self._journal.warnings:
                self.update(warnings=(*self._journal.warnings, remark))

    def set_frames(self, entries: Iterable[FileEntry]) -> tuple[SessionFrame, ...]:
        """Record which files on the camera are the frames, in shooting order.

        Data about known frames is kept, even if the camera has a new address. Each frame gets a
        local name.
        """
        with self._lock:
            frames_by_url = {_on_camera(frame.url): frame for frame in self._journal.frames}
            frames: list[SessionFrame] = []
            for entry in entries:
                old = frames_by_url.get(_on_camera(entry.url), SessionFrame(entry.name, entry.url))
                date = _clean(entry.date_time, 100)
                size = max(entry.size, 0)
                new = replace(old, name=entry.name, url=entry.url, size=size, taken=date)
                names_here = {each.local for each in (*frames_by_url.values(), *frames)}
                local = old.local or self._free_name(entry, names_here)
                frames.append(replace(new, local=local))
            self.update(frames=tuple(frames))
            return self._journal.frames

    def set_frame(self, url: str, **changes: Any) -> None:
        """Change one frame in the journal."""
        with self._lock:
            frames = tuple(
                replace(frame, **changes) if frame.url == url else frame
                for frame in self._journal.frames
            )
            self.update(frames=frames)

    def finish_frame(self, url: str) -> None:
        """Mark a frame as downloaded and store the checksum of its file."""
        frame = next(each for each in self._journal.frames if each.url == url)
        self.set_frame(url, done=True, sha256=sha256_of(self.originals / frame.local))

    def local_name(self, entry: FileEntry) -> str:
        """Return the name of a file in `originals`. The same entry always gets the same name.

        The name consists of the date and time, the camera's file name restricted to letters,
        digits, "_", "." and "-", and a number if another file has that name. The date is needed
        because cameras reuse names.
        """
        with self._lock:
            for frame in self._journal.frames:
                if _on_camera(frame.url) == _on_camera(entry.url) and frame.local:
                    return frame.local
            return self._free_name(entry, {frame.local for frame in self._journal.frames})

    def path_of(self, frame: SessionFrame) -> Path:
        """Return the path of a frame's file, which may not exist yet."""
        return self.originals / frame.local

    def _free_name(self, entry: FileEntry, names_here: set[str]) -> str:
        # Some systems treat names that differ only in case as equal.
        names = {name.casefold() for name in names_here}
        base = Path(_UNSAFE.sub("_", entry.name)[:64].lstrip("."))
        stem, ending = f"{_date(entry.date_time)}_{base.stem}", base.suffix
        for count in range(1, 1000):
            name = f"{stem}{'' if count == 1 else f'-{count}'}{ending}"
            if name.casefold() not in names and self._fits(name, entry):
                return name
        raise CoreError(
            tr(
                "There are too many files named {stem} in {originals}.",
                stem=stem,
                originals=self.originals,
            )
        )

    def _fits(self, name: str, entry: FileEntry) -> bool:
        """Return whether a name is free, or already belongs to the entry."""
        path = self.originals / name
        if not path.exists():
            return True
        same = entry.size <= 0 or path.stat().st_size == entry.size
        return same and whole_picture(path)

    def _prepare(self) -> None:
        """Create the folders, and remove temporary files left by a killed process."""
        sentence = tr("Cannot create a session in {folder}: {reason}.")
        hint = tr("Choose another folder.")
        with os_errors_as(CoreError, sentence, hint, folder=self.folder):
            for folder in (self.folder, self.originals, self.thumbnails):
                make_folder(folder)
            for name in _entries(self.folder):
                if _TEMPORARY.fullmatch(name):
                    (self.folder / name).unlink()
            for name in _entries(self.thumbnails):
                if name.startswith(".") and name not in _LITTER:
                    (self.thumbnails / name).unlink()
        check_target(self.folder / JOURNAL)
        check_target(self.originals / "x")

    def _take_stock(self) -> None:
        """Update the journal's frames from the files found on disk."""
        frames = tuple(self._check_frame(frame) for frame in self._journal.frames)
        self.update(frames=frames)

    def _check_frame(self, frame: SessionFrame) -> SessionFrame:
        path = self.originals / frame.local
        if not frame.local or not path.is_file():
            return replace(frame, done=False, sha256="")
        if frame.done and sha256_of(path) == frame.sha256:
            return frame
        if whole_picture(path):
            return replace(frame, done=True, sha256=sha256_of(path))
        aside = _beside(self.originals, f"{path.name}.damaged")
        path.rename(aside)
        self.notices += (
            tr("{name} is damaged; it was kept as {kept}.", name=path.name, kept=aside.name),
        )
        return replace(frame, done=False, sha256="")


def _read(folder: Path) -> tuple[SessionJournal, list[str]]:
    """Read the journal. If it is unreadable, rename it and start a new one."""
    path = folder / JOURNAL
    fresh = SessionJournal(started=_now())
    try:
        with open_file(path) as stream:
            # Longer files are truncated here, and are then rejected as invalid JSON.
            data = stream.read(_MAX_BYTES)
        return journal_of(data), []
    except FileNotFoundError:
        return fresh, [tr("The session’s journal is missing; a new one was started.")]
    except OSError as error:
        raise CoreError(
            tr("Cannot read {path}: {reason}.", path=path, reason=words_of(error))
        ) from error
    except Newer as error:
        raise CoreError(
            tr(
                "The session in {folder} was created by a newer version of Turnlight.",
                folder=folder,
            ),
            tr("Update Turnlight."),
        ) from error
    except Unfit:
        aside = _beside(folder, "session.damaged", ".json")
        path.rename(aside)
        sentence = tr(
            "The session’s journal was damaged; it was kept as {kept} and a new one was started.",
            kept=aside.name,
        )
        return fresh, [sentence]


def _entries(folder: Path) -> list[str]:
    sentence = tr("The folder {folder} cannot be read: {reason}.")
    with os_errors_as(CoreError, sentence, folder=folder):
        try:
            return sorted(os.listdir(folder))
        except FileNotFoundError:
            return []
        except NotADirectoryError:
            message = tr("{folder} is not a folder.", folder=folder)
            raise CoreError(message, tr("Choose a folder.")) from None


def _is_ours(name: str) -> bool:
    """Return whether an entry is allowed in the folder of a new session."""
    return (
        name in (JOURNAL, _ORIGINALS, _THUMBNAILS)
        or name in _LITTER
        or _TEMPORARY.fullmatch(name) is not None
        or _DAMAGED.fullmatch(name) is not None
    )


def _beside(folder: Path, stem: str, ending: str = "") -> Path:
    """Return the first numbered path that is not in use."""
    number = 1
    while (folder / f"{stem}-{number}{ending}").exists():
        number += 1
    return folder / f"{stem}-{number}{ending}"


def _on_camera(url: str) -> str:
    """Return only the path and query of a URL, since the host changes with the network."""
    return urlsplit(url)._replace(scheme="", netloc="").geturl()


def camera_time(text: str) -> datetime | None:
    """Parse a date from the camera's clock, ignoring its time zone, or return None if invalid."""
    match = _DATE.match(text)
    with suppress(ValueError):
        return None if match is None else datetime(*map(int, match.groups()))  # type: ignore[arg-type]
    return None


def _date(stamp: str) -> str:
    """Format the camera's date so that names sort chronologically."""
    date = camera_time(stamp)
    return "undated" if date is None else date.strftime("%Y%m%d-%H%M%S")


def _cleaned(remark: Remark) -> Remark:
    if isinstance(remark, PlainRemark):
        return PlainRemark(_clean(remark.sentence, 1000))
    return remark


def _clean(text: str, longest: int) -> str:
    return "".join(c if c.isprintable() else "?" for c in text[:longest])


def _now() -> str:
    return datetime.now().astimezone().isoformat(timespec="seconds")
