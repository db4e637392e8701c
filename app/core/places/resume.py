"""Find unfinished places and complete them."""

from __future__ import annotations

import contextlib
import shutil
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Final, Literal

from app.core.base.progress import Report, Token
from app.core.measure.read.metadata import FRAME_ENDINGS
from app.core.places.files.originals import ORIGINALS
from app.core.places.intake import Intake
from app.core.places.journal import journal_in
from app.core.places.place import OpenPlace
from app.core.places.place_folder import PLACE, PlaceSummary, capture_folders, read_place
from app.core.places.place_list import list_places
from app.core.places.place_measurement import measure_intake
from app.core.places.save import save_place
from app.core.storage.settings import Settings

_OVER: Final = frozenset({"idle"})


@dataclass(frozen=True, slots=True)
class UnfinishedPlace:
    """A place without light.

    Attributes:
        session: Folder of the place's capture, or None if the photos were opened from files.
        here, total: Number of frames on disk, and number of frames in total.
    """

    folder: Path
    session: Path | None
    name: str
    made_at: datetime
    here: int = 0
    total: int = 0
    plan: Literal["paper", "full"] = "paper"
    files: tuple[Path, ...] = ()

    @property
    def can_finish(self) -> bool:
        """Whether there are frames from which the place can be completed."""
        return self.session is not None or bool(self.files)


def list_unfinished(places: Path) -> tuple[UnfinishedPlace, ...]:
    """List the places that can be completed, newest first.

    None of these places has light. Captures that ended but could not be saved are included.
    """
    every = (find_unfinished(summary) for summary in list_places(places))
    return tuple(each for each in every if each is not None and each.can_finish)


def find_unfinished(summary: PlaceSummary) -> UnfinishedPlace | None:
    """Describe an unfinished place, or return None if the place has light."""
    if summary.has_light or summary.state == "newer":
        return None
    empty = UnfinishedPlace(summary.folder, None, summary.name, summary.made_at)
    session = summary.captures[-1] if summary.captures else None
    journal = None if session is None else journal_in(session)
    if session is not None and journal is not None:
        has_begun = journal.frames or journal.exposed or journal.owes
        if has_begun and journal.stage not in _OVER:
            return replace(
                empty,
                session=session,
                here=sum(frame.done for frame in journal.frames),
                total=0 if journal.plan is None else len(journal.plan.shots),
                plan="paper" if journal.plan is None else journal.plan.kind,
            )
    homes = (summary.folder, *reversed(summary.captures))
    folders = (_photographs(home / ORIGINALS) for home in homes)
    files = next((photos for photos in folders if photos), ())
    unfinished = replace(empty, files=files)
    # A damaged place that cannot be completed reports its own problem.
    return unfinished if unfinished.can_finish or summary.state in ("whole", "unfinished") else None


def finish_files(
    unfinished: UnfinishedPlace, settings: Settings, token: Token, report: Report
) -> OpenPlace:
    """Merge the photos of an unfinished place.

    Raises:
        CoreError: If the photos cannot be merged or the disk fails.
        Cancelled: If the token is cancelled.
    """
    intake = Intake(unfinished.name, files=unfinished.files)
    measured = measure_intake(intake, settings, token, report)
    place = replace(
        read_place(unfinished.folder),
        location=measured.location,
        capture=measured.facts,
        studios=settings.studios,
    )
    return save_place(OpenPlace(unfinished.folder, place, measured.light))


def drop_empty_place(folder: Path, session: Path, *, given_up: bool = False) -> bool:
    """Remove a place whose only capture is empty, and return whether the place was removed.

    The place stays if it contains a photo, if anything was exposed, or if camera settings must
    still be restored.

    Args:
        session: Folder of the capture.
        given_up: Whether the user stopped the capture. A partial bracket on the camera is then
            abandoned.
    """
    if session.parent != folder:
        return False
    journal = journal_in(session)
    if journal is None or journal.owes or journal.exposed:
        return False
    if journal.frames and not given_up:
        return False
    with contextlib.suppress(OSError):
        if any((session / ORIGINALS).iterdir()) or capture_folders(folder) != (session,):
            return False
        if {entry.name for entry in folder.iterdir()} != {PLACE, session.name}:
            return False
        shutil.rmtree(folder)
        return True
    return False


def _photographs(folder: Path) -> tuple[Path, ...]:
    try:
        photos = [each for each in folder.iterdir() if each.suffix.lower() in FRAME_ENDINGS]
        return tuple(sorted(each for each in photos if each.is_file()))
    except OSError:
        return ()
