"""A session: one folder for one place and time, with a journal that survives the power cut.

    FOLDER/session.json      how far it has come; written before every act, whole or not at all
    FOLDER/originals/        the camera's files, never changed once they are whole
    FOLDER/thumbnails/       small pictures to look at while the files come

A file in `originals` gets its name only when it is whole; until then it is called ``NAME.part``.
So whatever happens in between, opening the folder again finds every file that was complete.

`Debts` lists the captures that still owe a camera its settings, so that the next one puts them
back: a capture notes itself there before it changes anything. What exactly is owed stands in the
journal of its session.
"""

from __future__ import annotations

import json
import math
import os
import re
import threading
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias
from urllib.parse import urlsplit

from app.core.base.errors import CoreError
from app.core.base.files import (
    atomic_write_text,
    check_target,
    make_folder,
    open_file,
    os_errors_as,
    words_of,
)
from app.core.hdr.frame import Exposure
from app.core.hdr.planner import Plan, PlannedShot
from app.core.storage.json_file import (
    Check,
    Unfit,
    entries,
    listed,
    number,
    one_of,
    optional,
    plain,
    record,
    text,
    truth,
    whole,
)
from app.core.text import tr
from app.devices.capture.file_integrity import sha256_of, whole_picture
from app.devices.errors import BadReply
from app.devices.theta.untrusted import parse_json, table, words

if TYPE_CHECKING:
    from app.devices.theta.client import FileEntry


VERSION: Final = 1
"""Of the journal's form; a file with a higher one is left alone."""

EXPOSURE_LIMITS: Final = {
    "shutter_s": (1e-7, 1e5),
    "iso": (0.5, 1e7),
    "aperture": (0.3, 1000.0),
}
"""Least and largest value of an exposure that a journal holds."""

JsonValue: TypeAlias = "bool | int | float | str | list[JsonValue] | dict[str, JsonValue] | None"

_KIND: Final = "turnlight-session"
_MAX_TEXT: Final = 4000
_MAX_ITEMS: Final = 400
_MAX_DEPTH: Final = 12
_MAX_SIZE: Final = 1 << 40
_LOCAL: Final = r"([A-Za-z0-9][A-Za-z0-9_.-]{0,99})?"
_NAME: Final = r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}"
_URL: Final = r"http://[^\s/@\\?#]{1,300}/[^\s\\]{0,2000}"


class Newer(ValueError):
    """The journal was written by a newer version of this program."""


@dataclass(frozen=True, slots=True)
class SessionFrame:
    """One picture of the camera."""

    name: str
    url: str
    size: int = 0
    taken: str = ""
    local: str = ""
    thumbnail: str = ""
    done: bool = False
    sha256: str = ""


@dataclass(frozen=True, slots=True)
class ShotStart:
    """What was there before the camera was asked for a picture.

    * `previous`: address of its newest file, "" where it had none.
    * `camera_time`: by its own clock, "" where it does not state it.
    """

    previous: str
    camera_time: str


@dataclass(frozen=True, slots=True)
class SessionJournal:
    """How far a capture has come.

    * `exposed`: all exposures have been made.
    * `shot_start`: of a picture whose address is not in the journal yet.
    * `singles`: pictures of a bracket that is shot one by one.
    * `surplus`: pictures of interrupted brackets, deleted on the camera once another bracket is
      complete.
    """

    model: str = ""
    serial: str = ""
    firmware: str = ""
    stage: str = "idle"
    metered: Exposure | None = None
    plan: Plan | None = None
    settings_to_restore: Mapping[str, JsonValue] = field(default_factory=dict)
    picture_to_delete: SessionFrame | None = None
    shot_start: ShotStart | None = None
    singles: tuple[SessionFrame, ...] = ()
    surplus: tuple[SessionFrame, ...] = ()
    previous_latest: str = ""
    command_id: str | int | None = None
    group_id: str = ""
    exposed: bool = False
    frames: tuple[SessionFrame, ...] = ()
    environment: str = ""
    started: str = ""
    finished: str = ""
    seconds: Mapping[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def owes(self) -> bool:
        """Whether the camera has not been given back as it was."""
        pictures = self.picture_to_delete is not None or (self.exposed and bool(self.surplus))
        metering = self.shot_start is not None and self.stage == "metering"
        return bool(self.settings_to_restore) or pictures or metering


def text_of(journal: SessionJournal) -> str:
    """Write a journal down, as JSON that `journal_of` reads back to an equal journal.

    Raises `Unfit` when a value would be refused on reading, or is a password: nothing is ever
    written that cannot be read again.
    """
    facts = {"kind": _KIND, "version": VERSION, **plain(journal)}
    written = json.dumps(facts, ensure_ascii=False, allow_nan=False, indent=1) + "\n"
    journal_of(written)
    return written


def journal_of(data: str | bytes) -> SessionJournal:
    """Read a journal that may be damaged or forged.

    Raises `Newer` when its version is higher than `VERSION`; `Unfit` for everything else that is
    not a journal.
    """
    try:
        facts = entries(json.loads(data))
    except (RecursionError, ValueError) as error:
        raise Unfit("not JSON") from error
    if facts.get("kind") != _KIND:
        raise Unfit("not the journal of a session")
    if whole(1, 1 << 30)(facts.get("version")) > VERSION:
        raise Newer
    return _JOURNAL(facts)


def keepable(settings: Mapping[str, JsonValue]) -> dict[str, JsonValue]:
    """Leave out the settings of a camera that a journal cannot hold."""
    kept: dict[str, JsonValue] = {}
    for name, value in settings.items():
        with suppress(Unfit):
            kept |= _settings({name: value})
    return kept


def _line(value: Any) -> str:
    """Check for a line of text without control characters."""
    line = text(_MAX_TEXT)(value)
    if not line.isprintable():
        raise Unfit("control characters")
    return line


def _like(pattern: str) -> Check:
    check = text(_MAX_TEXT, pattern)
    return lambda value: check(_line(value))


def _frame(**facts: Any) -> SessionFrame:
    frame = SessionFrame(**facts)
    if frame.done and not (frame.local and frame.sha256):
        raise Unfit("a whole file without a name or a checksum")
    return frame


def _settings(value: Any) -> dict[str, JsonValue]:
    settings = entries(value)
    for name in settings:
        if not re.fullmatch(r"_?[A-Za-z][A-Za-z0-9_]{0,63}", name) or "password" in name.lower():
            raise Unfit("a setting's name that is not allowed")
    _check_setting(settings, _MAX_DEPTH)
    return settings


def _check_setting(value: Any, deepest: int) -> None:
    if deepest == 0:
        raise Unfit("nested too deeply")
    if isinstance(value, str):
        _line(value)
    elif isinstance(value, float) and not math.isfinite(value):
        raise Unfit("not a number")
    elif isinstance(value, (list, dict)):
        if len(value) > _MAX_ITEMS:
            raise Unfit("too long")
        for each in [*value, *value.values()] if isinstance(value, dict) else value:
            _check_setting(each, deepest - 1)


def _command_id(value: Any) -> str | int | None:
    whole_number = isinstance(value, int) and not isinstance(value, bool)
    return value if value is None or whole_number else _line(value)


def _seconds(value: Any) -> dict[str, float]:
    if len(entries(value)) > _MAX_ITEMS:
        raise Unfit("too many times")
    return {_line(name): number(0.0, 1e9)(time) for name, time in value.items()}


_EXPOSURE: Final = record(
    Exposure, {name: number(*limits) for name, limits in EXPOSURE_LIMITS.items()} | {"known": truth}
)
_SHOT: Final = record(
    PlannedShot,
    {"exposure": _EXPOSURE, "wanted_ev": number(-60.0, 60.0), "ev_offset": number(-60.0, 60.0)},
)
_PLAN: Final = record(
    Plan,
    {
        "kind": one_of("paper", "full"),
        "shots": listed(_SHOT, _MAX_ITEMS),
        "expected_s": number(0.0, 1e6),
        "notes": listed(_line, _MAX_ITEMS),
    },
)
_FRAME: Final = record(
    _frame,
    {
        "name": _like(_NAME),
        "url": _like(_URL),
        "size": whole(0, _MAX_SIZE),
        "taken": _line,
        "local": _like(_LOCAL),
        "thumbnail": _like(_LOCAL),
        "done": truth,
        "sha256": _like(r"([0-9a-f]{64})?"),
    },
)
_SHOT_START: Final = record(ShotStart, {"previous": _line, "camera_time": _line})
_CHECKS: Final[dict[str, Check]] = {
    "model": _line,
    "serial": _line,
    "firmware": _line,
    "stage": _like(r"[a-z][a-z-]{0,31}"),
    "metered": optional(_EXPOSURE),
    "plan": optional(_PLAN),
    "settings_to_restore": _settings,
    "picture_to_delete": optional(_FRAME),
    "shot_start": optional(_SHOT_START),
    "singles": listed(_FRAME, _MAX_ITEMS),
    "surplus": listed(_FRAME, _MAX_ITEMS),
    "previous_latest": _line,
    "command_id": _command_id,
    "group_id": _line,
    "exposed": truth,
    "frames": listed(_FRAME, _MAX_ITEMS),
    "environment": _like(_LOCAL),
    "started": _line,
    "finished": _line,
    "seconds": _seconds,
    "warnings": listed(_line, _MAX_ITEMS),
}
# Journals of earlier versions lack these.
_LATER: Final = frozenset({"picture_to_delete", "shot_start", "singles", "surplus"})
_JOURNAL: Final = record(SessionJournal, _CHECKS, _CHECKS.keys() - _LATER)


FILE: Final = "owed-cameras.json"
"""Name of the file in the user's folder."""

_MOST: Final = 50
_MOST_BYTES: Final = 1 << 18
_LONGEST: Final = 4000

JOURNAL: Final = "session.json"
"""Name of the journal in the session's folder."""

_MAX_BYTES: Final = 4 << 20
_MAX_WARNINGS: Final = 100
_ORIGINALS: Final = "originals"
_THUMBNAILS: Final = "thumbnails"
_DAMAGED: Final = re.compile(r"session\.damaged-[0-9]+\.json")
# What a killed `atomic_write` leaves of the journal and of the environment, and metering of its
# picture.
_TEMPORARY: Final = re.compile(r"\.session-.*\.json|\.environment-.*\.exr|\.metering\.jpg")
# Files that systems leave in folders by themselves.
_LITTER: Final = frozenset({".DS_Store", "Thumbs.db", "desktop.ini", ".directory"})
_TAKEN: Final = re.compile(r"(\d{4}):(\d\d):(\d\d) (\d\d):(\d\d):(\d\d)")
_UNSAFE: Final = re.compile(r"[^A-Za-z0-9_.-]")
_TEXTS: Final = ("model", "serial", "firmware", "group_id", "previous_latest")


class Debts:
    """A file with the folders of such captures, the oldest first."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def note(self, session: Session) -> None:
        """Add a capture; a file that cannot be written is no reason not to capture."""
        folder = str(session.folder.resolve())
        self._write([*(each for each in self._read() if each != folder), folder])

    def settle(self, session: Session) -> None:
        """Take a capture out that owes nothing any more."""
        folder, known = str(session.folder.resolve()), self._read()
        if not session.owes and folder in known:
            self._write([each for each in known if each != folder])

    def of(self, serial: str, besides: Session) -> list[Session]:
        """Open the other sessions that owe this camera something, the newest first."""
        found: list[Session] = []
        for folder in reversed(self._read()):
            if Path(folder) == besides.folder.resolve() or not (Path(folder) / JOURNAL).is_file():
                continue
            with suppress(CoreError):
                session = Session.open(folder)
                if session.owes and session.journal.serial == serial:
                    found.append(session)
        return found

    def _read(self) -> list[str]:
        try:
            with open_file(self._path) as stream:
                listed = table(parse_json(stream.read(_MOST_BYTES))).get("sessions")
        except (OSError, BadReply):
            return []
        if not isinstance(listed, list):
            return []
        texts = [words(each, _LONGEST) for each in listed[-_MOST:]]
        return [each for each in texts if each and Path(each).is_absolute()]

    def _write(self, folders: list[str]) -> None:
        with suppress(OSError, CoreError):
            make_folder(self._path.parent)
            text = json.dumps({"format": 1, "sessions": folders[-_MOST:]}, indent=1)
            atomic_write_text(self._path, text + "\n")


__all__ = ["JOURNAL", "Session", "SessionFrame", "SessionJournal"]


class Session:
    """A folder with the files of one capture and what is known of it.

    Made by `create`, `open` or `open_or_create`. Safe to use from several threads; two processes
    must not use one folder at the same time.
    """

    def __init__(self, folder: Path, journal: SessionJournal, notices: Iterable[str] = ()) -> None:
        self.folder = folder
        self.notices = tuple(notices)
        self._journal = journal
        self._lock = threading.RLock()

    @classmethod
    def create(cls, folder: Path | str) -> Session:
        """Make a session in a folder that is missing or empty.

        Raises `CoreError` when the folder holds something, or cannot be made or written.
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
        """Open a session that exists and check the files it holds.

        A journal that cannot be read is kept under another name and a new one is begun; the
        files in `originals` stay and are found again by their names. Files that became whole
        without the journal knowing are taken up; files that the journal knows but that are gone
        or changed count as not there.

        Raises `CoreError` when there is no session in the folder, or a newer version of this
        program made it.
        """
        place = Path(folder)
        if not any(name == JOURNAL or _DAMAGED.fullmatch(name) for name in _entries(place)):
            raise CoreError(
                tr("The folder {place} is not a session.", place=place),
                tr("Choose the folder that a capture made."),
            )
        journal, notices = _read(place)
        session = cls(place, journal, notices)
        session._prepare()
        session._take_stock()
        return session

    @classmethod
    def open_or_create(cls, folder: Path | str) -> Session:
        """Resume the session in a folder, or begin one in a missing or empty folder.

        Raises `CoreError` when the folder holds something that is not a session: it is not taken
        over.
        """
        place = Path(folder)
        names = _entries(place)
        if any(name == JOURNAL or _DAMAGED.fullmatch(name) for name in names):
            return cls.open(place)
        if any(not _is_ours(name) for name in names):
            raise CoreError(
                tr("The folder {place} holds something other than a session.", place=place),
                tr("Choose a new or empty folder."),
            )
        return cls.create(place)

    @property
    def originals(self) -> Path:
        """Folder of the camera's own files."""
        return self.folder / _ORIGINALS

    @property
    def thumbnails(self) -> Path:
        """Folder of small pictures."""
        return self.folder / _THUMBNAILS

    @property
    def journal(self) -> SessionJournal:
        """How far the session has come."""
        return self._journal

    @property
    def unfinished(self) -> bool:
        """Whether a capture was begun here and did not come to its end."""
        return self._journal.stage not in ("idle", "done")

    @property
    def owes(self) -> bool:
        """Whether the camera has not been given back as it was."""
        return self._journal.owes

    @property
    def complete(self) -> bool:
        """Whether every file of the bracket is here, so that the camera is not needed."""
        journal = self._journal
        here = bool(journal.frames) and all(frame.done for frame in journal.frames)
        return journal.plan is not None and journal.exposed and here

    def update(self, **changes: Any) -> None:
        """Change the journal, on disk first: call it before the act that it speaks of.

        `**changes`: fields of `SessionJournal`. Texts that come from a camera are cleaned of
        control characters and cut to a bearable length. Raises `CoreError` when the disk refuses;
        the journal in memory is as before then; `ValueError` when a value could not be read back,
        or holds a password.
        """
        with self._lock:
            for name in _TEXTS:
                if name in changes:
                    changes[name] = _clean(changes[name], 1000)
            if "warnings" in changes:
                kept = tuple(changes["warnings"])[:_MAX_WARNINGS]
                changes["warnings"] = tuple(_clean(each, 1000) for each in kept)
            journal = replace(self._journal, **changes)
            atomic_write_text(self.folder / JOURNAL, text_of(journal))
            self._journal = journal

    def warn(self, sentence: str) -> None:
        """Add a warning, once."""
        with self._lock:
            if _clean(sentence, 1000) not in self._journal.warnings:
                self.update(warnings=(*self._journal.warnings, sentence))

    def set_frames(self, entries: Iterable[FileEntry]) -> tuple[SessionFrame, ...]:
        """State which files of the camera are the frames, in the order of shooting.

        What is known of a frame already is kept, also where the camera has another address now;
        each gets its local name.
        """
        with self._lock:
            known = {_on_camera(frame.url): frame for frame in self._journal.frames}
            frames: list[SessionFrame] = []
            for entry in entries:
                old = known.get(_on_camera(entry.url), SessionFrame(entry.name, entry.url))
                taken = _clean(entry.taken, 100)
                size = max(entry.size, 0)
                new = replace(old, name=entry.name, url=entry.url, size=size, taken=taken)
                used = {each.local for each in (*known.values(), *frames)}
                local = old.local or self._free_name(entry, used)
                frames.append(replace(new, local=local))
            self.update(frames=tuple(frames))
            return self._journal.frames

    def set_frame(self, url: str, **changes: Any) -> None:
        """Change what the journal says of one frame."""
        with self._lock:
            frames = tuple(
                replace(frame, **changes) if frame.url == url else frame
                for frame in self._journal.frames
            )
            self.update(frames=frames)

    def finish_frame(self, url: str) -> None:
        """State that the file of a frame is there, whole; its checksum is taken from the disk."""
        frame = next(each for each in self._journal.frames if each.url == url)
        self.set_frame(url, done=True, sha256=sha256_of(self.originals / frame.local))

    def local_name(self, entry: FileEntry) -> str:
        """Choose the name of a file in `originals`.

        Date, time and the camera's own name, since cameras use their names again and again; a
        number is added where even that is taken by another file. The same entry always gets the
        same name.

        `entry`: what the camera says of the file; only letters, digits, "_", "." and "-" of its
        name are used.
        """
        with self._lock:
            for frame in self._journal.frames:
                if _on_camera(frame.url) == _on_camera(entry.url) and frame.local:
                    return frame.local
            return self._free_name(entry, {frame.local for frame in self._journal.frames})

    def path_of(self, frame: SessionFrame) -> Path:
        """Where the file of a frame is or will be."""
        return self.originals / frame.local

    def _free_name(self, entry: FileEntry, used: set[str]) -> str:
        # Some systems hold names that differ only in case for the same.
        taken = {name.casefold() for name in used}
        base = Path(_UNSAFE.sub("_", entry.name)[:64].lstrip("."))
        stem, ending = f"{_date(entry.taken)}_{base.stem}", base.suffix
        for count in range(1, 1000):
            name = f"{stem}{'' if count == 1 else f'-{count}'}{ending}"
            if name.casefold() not in taken and self._fits(name, entry):
                return name
        raise CoreError(
            tr(
                "There are too many files called {stem} in {originals}.",
                stem=stem,
                originals=self.originals,
            )
        )

    def _fits(self, name: str, entry: FileEntry) -> bool:
        """Whether a name is free, or its file is what the entry speaks of."""
        path = self.originals / name
        if not path.exists():
            return True
        same = entry.size <= 0 or path.stat().st_size == entry.size
        return same and whole_picture(path)

    def _prepare(self) -> None:
        """Make the folders, and remove what a killed write has left."""
        refused = tr("Cannot make a session in {folder}: {reason}.")
        hint = tr("Choose another folder.")
        with os_errors_as(CoreError, refused, hint, folder=self.folder):
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
        """Make the journal's frames agree with the files that are there."""
        frames = tuple(self._checked(frame) for frame in self._journal.frames)
        self.update(frames=frames)

    def _checked(self, frame: SessionFrame) -> SessionFrame:
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
    """Read the journal, or keep it aside and begin a new one."""
    path = folder / JOURNAL
    fresh = SessionJournal(started=_now())
    try:
        with open_file(path) as stream:
            # A longer one is cut off here, and so no JSON.
            data = stream.read(_MAX_BYTES)
        return journal_of(data), []
    except FileNotFoundError:
        return fresh, [tr("The session's journal is missing; a new one was begun.")]
    except OSError as error:
        raise CoreError(
            tr("Cannot read {path}: {reason}.", path=path, reason=words_of(error))
        ) from error
    except Newer as error:
        raise CoreError(
            tr("The session in {folder} was made by a newer Turnlight.", folder=folder),
            tr("Update this one."),
        ) from error
    except Unfit:
        aside = _beside(folder, "session.damaged", ".json")
        path.rename(aside)
        sentence = tr(
            "The session's journal was damaged; it was kept as {kept} and a new one was begun.",
            kept=aside.name,
        )
        return fresh, [sentence]


def _entries(folder: Path) -> list[str]:
    refused = tr("The folder {folder} cannot be read: {reason}.")
    with os_errors_as(CoreError, refused, folder=folder):
        try:
            return sorted(os.listdir(folder))
        except FileNotFoundError:
            return []
        except NotADirectoryError:
            message = tr("{folder} is not a folder.", folder=folder)
            raise CoreError(message, tr("Choose a folder.")) from None


def _is_ours(name: str) -> bool:
    """Whether an entry may be in the folder of a session that was only just begun."""
    return (
        name in (JOURNAL, _ORIGINALS, _THUMBNAILS)
        or name in _LITTER
        or _TEMPORARY.fullmatch(name) is not None
        or _DAMAGED.fullmatch(name) is not None
    )


def _beside(folder: Path, stem: str, ending: str = "") -> Path:
    """Return the first numbered name that is free."""
    number = 1
    while (folder / f"{stem}-{number}{ending}").exists():
        number += 1
    return folder / f"{stem}-{number}{ending}"


def _on_camera(url: str) -> str:
    """Return what stays of an address when the camera gets another one in the network."""
    return urlsplit(url)._replace(scheme="", netloc="").geturl()


def camera_time(text: str) -> datetime | None:
    """Read a date of the camera's own clock, without its time zone."""
    match = _TAKEN.match(text)
    with suppress(ValueError):
        return None if match is None else datetime(*map(int, match.groups()))  # type: ignore[arg-type]
    return None


def _date(taken: str) -> str:
    """Write the camera's date so that names sort by it."""
    date = camera_time(taken)
    return "undated" if date is None else date.strftime("%Y%m%d-%H%M%S")


def _clean(text: str, longest: int) -> str:
    return "".join(c if c.isprintable() else "?" for c in text[:longest])


def _now() -> str:
    return datetime.now().astimezone().isoformat(timespec="seconds")
