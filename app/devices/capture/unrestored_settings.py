"""The captures whose camera settings the next capture has to restore.

A capture is recorded here before it changes anything on the camera. The settings themselves are
saved in the journal of its session.
"""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from typing import Final

from app.core.base.atomic_files import (
    atomic_write_text,
    make_folder,
    open_file,
)
from app.core.base.errors import CoreError
from app.core.places.journal import (
    JOURNAL,
)
from app.devices.capture.session import Session
from app.devices.errors import BadReply
from app.devices.theta.untrusted import parse_json, table, words

FILE: Final = "owed-cameras.json"
"""Name of the file in the user's data folder."""

_MOST: Final = 50
_MOST_BYTES: Final = 1 << 18
_LONGEST: Final = 4000


class Debts:
    """A file that lists the folders of captures with settings still to restore, oldest first."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def note(self, session: Session) -> None:
        """Add a capture, ignoring any failure to write the file."""
        folder = str(session.folder.resolve())
        self._write([*(each for each in self._read() if each != folder), folder])

    def settle(self, session: Session) -> None:
        """Remove a capture whose settings have been restored."""
        folder, folders = str(session.folder.resolve()), self._read()
        if not session.owes and folder in folders:
            self._write([each for each in folders if each != folder])

    def of(self, serial: str, besides: Session) -> list[Session]:
        """Open the other sessions with settings still to restore on this camera, newest first."""
        sessions: list[Session] = []
        for folder in reversed(self._read()):
            if Path(folder) == besides.folder.resolve() or not (Path(folder) / JOURNAL).is_file():
                continue
            with suppress(CoreError):
                session = Session.open(folder)
                if session.owes and session.journal.serial == serial:
                    sessions.append(session)
        return sessions

    def _read(self) -> list[str]:
        try:
            with open_file(self._path) as stream:
                sessions = table(parse_json(stream.read(_MOST_BYTES))).get("sessions")
        except (OSError, BadReply):
            return []
        if not isinstance(sessions, list):
            return []
        texts = [words(each, _LONGEST) for each in sessions[-_MOST:]]
        return [each for each in texts if each and Path(each).is_absolute()]

    def _write(self, folders: list[str]) -> None:
        with suppress(OSError, CoreError):
            make_folder(self._path.parent)
            text = json.dumps({"format": 1, "sessions": folders[-_MOST:]}, indent=1)
            atomic_write_text(self._path, text + "\n")
