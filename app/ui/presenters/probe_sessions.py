"""Captures that were not finished: found again, or cleared away where they took nothing."""

from __future__ import annotations

import contextlib
import shutil
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from app.core.places import PLACE, capture_folders, list_places
from app.devices.capture.journal import Damaged, Newer, SessionJournal, journal_of
from app.devices.capture.session import JOURNAL

if TYPE_CHECKING:
    from datetime import datetime
    from pathlib import Path

    from app.ui.presenters.capturing import Recording

__all__ = ["Unfinished", "tidy", "unfinished"]

_MOST_JOURNAL: Final = 4 << 20
_OVER: Final = frozenset({"idle"})


@dataclass(frozen=True, slots=True)
class Unfinished:
    """A capture that was begun and not finished.

    Attributes
    ----------
    folder, session : Path
        Of the place and of the capture in it.
    name : str
        Of the place.
    made_at : datetime
    here, total : int
        Frames that are here, and that were planned.
    plan : {"paper", "full"}
    """

    folder: Path
    session: Path
    name: str
    made_at: datetime
    here: int
    total: int
    plan: Literal["paper", "full"] = "paper"


def tidy(recording: Recording, *, given_up: bool = False) -> bool:
    """Remove the folder of a capture that took nothing.

    Only what this capture made itself is removed, and only where no picture is in it, nothing
    was exposed and the camera is owed nothing.

    Parameters
    ----------
    recording : Recording
        Of a capture that has ended.
    given_up : bool, optional
        The user stopped it: a part of a bracket stays on the camera and is not waited for.

    Returns
    -------
    bool
        Whether it was removed.
    """
    folder, session = recording.folder, recording.session
    if not recording.began or folder is None or session is None or session.parent != folder:
        return False
    journal = _journal(session)
    if journal is None or journal.settings_to_restore or journal.exposed:
        return False
    if journal.frames and not given_up:
        return False
    with contextlib.suppress(OSError):
        if any((session / "originals").iterdir()) or capture_folders(folder) != (session,):
            return False
        if {entry.name for entry in folder.iterdir()} != {PLACE, session.name}:
            return False
        shutil.rmtree(folder)
        return True
    return False


def unfinished(places: Path) -> tuple[Unfinished, ...]:
    """Look for captures that were interrupted; nothing is changed.

    Parameters
    ----------
    places : Path
        Folder of the places.

    Returns
    -------
    tuple of Unfinished
        Of places without any light, the newest first: captures that ended and could not be kept
        are among them.
    """
    found = []
    for summary in list_places(places):
        if summary.has_light or not summary.captures:
            continue
        session = summary.captures[-1]
        journal = _journal(session)
        if journal is None or journal.stage in _OVER:
            continue
        if not (journal.frames or journal.exposed or journal.settings_to_restore):
            continue
        found.append(
            Unfinished(
                folder=summary.folder,
                session=session,
                name=summary.name,
                made_at=summary.made_at,
                here=sum(frame.done for frame in journal.frames),
                total=0 if journal.plan is None else len(journal.plan.shots),
                plan="paper" if journal.plan is None else journal.plan.kind,
            )
        )
    return tuple(found)


def _journal(session: Path) -> SessionJournal | None:
    try:
        with (session / JOURNAL).open("rb") as stream:
            return journal_of(stream.read(_MOST_JOURNAL).decode("utf-8"))
    except (OSError, Damaged, Newer, UnicodeDecodeError):
        return None
