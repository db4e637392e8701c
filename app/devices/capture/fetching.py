"""Bringing the frames over: small pictures first, then the files, each read as it arrives."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from app.core.probe.rough import rough_environment
from app.devices.capture.download import FileProgress, fetch_file, fetch_thumbnails
from app.devices.capture.status import FrameProgress, Stage
from app.devices.capture.whole import whole_file, whole_picture
from app.devices.errors import DownloadFailed, Unreachable
from app.devices.osc.messages import FileEntry

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from app.core.probe.rough import Rough
    from app.devices.capture.job import Job
    from app.devices.capture.session import SessionFrame

__all__ = ["fetch"]

_CONTINUATIONS: Final = 3


def fetch(job: Job) -> None:
    """Bring all frames of the journal over.

    Raises
    ------
    DownloadFailed
        When one does not come whole; what came stays and can be continued.
    Cancelled
        When the token was cancelled.
    """
    job.session.update(stage=Stage.DOWNLOADING.value)
    frames = job.session.journal.frames
    job.arriving.expect(len(frames))
    rows = [FrameProgress(frame.name, size=frame.size, done=frame.done) for frame in frames]
    view = _View(job, rows)
    view.show("Looking at the small pictures")
    missing = [frame for frame in frames if not frame.done]
    _thumbnails(job, view, frames if missing else ())
    entries = {frame.url: _entry(frame) for frame in missing}
    for number, frame in enumerate(frames):
        if frame.url in entries:
            _one(job, view, number, entries[frame.url])
            job.session.finish_frame(frame.url)
        view.set(number, done=True, received=view.rows[number].size)
        job.arriving.add(job.session.path_of(frame))
    for number, frame in enumerate(frames):
        if frame.url in entries and job.arriving.problem(job.session.path_of(frame), job.token):
            _again(job, view, number, entries[frame.url])
    job.paths = tuple(job.session.path_of(frame) for frame in job.session.journal.frames)


class _View:
    """The rows of the status while files come."""

    def __init__(self, job: Job, rows: list[FrameProgress]) -> None:
        self.job, self.rows = job, rows
        self.rough: Rough | None = None

    def set(self, number: int, **changes: object) -> None:
        """Change a row and say how far everything is."""
        self.rows[number] = replace(self.rows[number], **changes)  # type: ignore[arg-type]
        row = self.rows[number]
        total = sum(each.size for each in self.rows)
        here = sum(each.received for each in self.rows)
        left = (total - here) / row.bytes_per_s if row.bytes_per_s > 0.0 else None
        words = f"File {number + 1} of {len(self.rows)}"
        self.show(words, here / total if total else 0.0, left)

    def show(self, message: str, part: float = 0.0, left: float | None = None) -> None:
        """Show all rows."""
        self.job.board.show(
            Stage.DOWNLOADING,
            message,
            part,
            seconds_left=left,
            may_move=True,
            frames=tuple(self.rows),
            rough=self.rough,
        )


def _thumbnails(job: Job, view: _View, frames: tuple[SessionFrame, ...]) -> None:
    folder = job.session.thumbnails
    wanted = {frame.url: folder / frame.local for frame in frames if frame.local}
    found = fetch_thumbnails(job.client, wanted, job.token)
    for number, frame in enumerate(frames):
        if frame.url in found:
            view.set(number, thumbnail=found[frame.url])
            job.session.set_frame(frame.url, thumbnail=found[frame.url].name)
    shots = job.plan.shots
    if len(frames) == len(shots):
        pictures = [found.get(frame.url) for frame in frames]
        view.rough = rough_environment(pictures, [shot.exposure for shot in shots])


def _entry(frame: SessionFrame) -> FileEntry:
    """Return what the camera said of a file when the journal was written."""
    return FileEntry(
        name=frame.name,
        url=frame.url,
        size=frame.size,
        taken=frame.taken,
        width=0,
        height=0,
        group_id=None,
        is_processed=True,
        projection="",
    )


def _again(job: Job, view: _View, number: int, entry: FileEntry) -> None:
    """Fetch a file once more whose length was right but whose picture is damaged."""
    path = job.session.originals / job.session.local_name(entry)
    job.arriving.discard(path)
    path.rename(path.with_name(f"{path.name}.damaged"))
    job.session.set_frame(entry.url, done=False, sha256="")
    _one(job, view, number, entry, whole_picture)
    job.session.finish_frame(entry.url)
    job.arriving.add(path)


def _one(
    job: Job,
    view: _View,
    number: int,
    entry: FileEntry,
    check: Callable[[Path], bool] = whole_file,
) -> None:
    """Bring one file over, and go on with it when the link comes back.

    Only its structure is checked here by default: it is decoded while the next one comes.
    """

    def report(progress: FileProgress) -> None:
        view.set(
            number,
            received=progress.received,
            size=progress.size,
            bytes_per_s=progress.bytes_per_s,
        )

    target = job.session.originals / job.session.local_name(entry)
    for attempt in range(_CONTINUATIONS):
        try:
            fetch_file(job.client, entry, target, job.clock, job.token, report, check=check)
        except (DownloadFailed, Unreachable):
            if attempt + 1 == _CONTINUATIONS:
                raise
            job.contact.reconnect()
        else:
            return
