"""Downloading a bracket: the thumbnails, then the files, each decoded while the next arrives."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

from app.core.base.atomic_files import atomic_write_bytes
from app.core.base.errors import CoreError, ProbeError
from app.core.base.phrases import listed
from app.core.base.progress import Token
from app.core.measure.bracket.grouping import EQUAL_STOPS
from app.core.measure.read.metadata import read_header
from app.core.places.journal import SessionFrame
from app.core.text import tr
from app.devices.capture.capture_job import CaptureJob
from app.devices.capture.download import FileSource, fetch_file
from app.devices.capture.file_integrity import jpeg_end, whole_file, whole_picture
from app.devices.capture.status import FrameProgress, Stage
from app.devices.errors import (
    CameraRefused,
    DeviceError,
    DownloadFailed,
    Unreachable,
)
from app.devices.theta.messages import FileEntry

_MAX_THUMBNAIL: Final = 1 << 20


def fetch_thumbnails(
    client: FileSource, targets: Mapping[str, Path], token: Token
) -> dict[str, Path]:
    """Download the thumbnails that the camera offers.

    Thumbnails are only for display, so failures are ignored.

    Args:
        targets: Path at which to save the thumbnail of each URL.

    Returns:
        The paths of the thumbnails that are now on disk, by URL.

    Raises:
        Cancelled: If the token is cancelled.
    """
    paths: dict[str, Path] = {}
    for url, path in targets.items():
        token.check()
        if path.exists():
            paths[url] = path
            continue
        try:
            data = client.thumbnail(url)
            end = jpeg_end(data) if len(data) <= _MAX_THUMBNAIL else None
            if end is not None:
                atomic_write_bytes(path, data[:end])
                paths[url] = path
        except Unreachable:
            break  # only the files themselves are worth waiting for
        except (DeviceError, CoreError):
            continue
    return paths


_CONTINUATIONS: Final = 3
_ENOUGH: Final = 3
# Codes of errors that reconnecting and retrying may resolve.
_PASSING: Final = frozenset({"interrupted", "bad-answers"})
# Codes of errors that concern only one file.
_OF_ONE_FILE: Final = frozenset(
    {"bad-answers", "damaged", "damaged-on-camera", "too-long", "other-file"}
)


def fetch(job: CaptureJob) -> None:
    """Download the frames listed in the journal.

    A failed file does not stop the others. Three complete frames with different exposures are
    enough, with a warning. The other frames stay incomplete in the journal.

    Raises:
        DownloadFailed: If the connection is lost, the disk cannot be written, or too few frames are
            complete. The received data stays on disk, and the download can be resumed.
        CameraRefused: If the camera refuses the files and too few are complete.
        Cancelled: If the token is cancelled.
    """
    job.session.update(stage=Stage.DOWNLOADING.value)
    frames = job.session.journal.frames
    job.arriving.expect(len(frames))
    rows = [FrameProgress(frame.name, size=frame.size, done=frame.done) for frame in frames]
    view = _StatusRows(job, rows)
    view.show(tr("Downloading thumbnails"))
    missing = [frame for frame in frames if not frame.done]
    _thumbnails(job, view, frames if missing else ())
    # Rebuild the camera's entries as they were when the journal was written.
    entries = {one.url: FileEntry(one.name, one.url, one.size, one.taken) for one in missing}
    failed: dict[str, DeviceError] = {}
    for number, frame in enumerate(frames):
        if frame.url in entries:
            error = _one(job, view, number, entries[frame.url])
            if error is not None:
                failed[frame.url] = error
                continue
            job.session.finish_frame(frame.url)
        view.set(number, done=True, received=view.rows[number].size)
        job.arriving.add(job.session.path_of(frame))
    for number, frame in enumerate(frames):
        if frame.url not in entries or frame.url in failed:
            continue
        if job.arriving.problem(job.session.path_of(frame), job.token):
            error = _again(job, view, number, entries[frame.url])
            if error is not None:
                failed[frame.url] = error
    _settle(job, failed)


def _set_aside(job: CaptureJob, frame: SessionFrame) -> None:
    path = job.session.path_of(frame)
    job.arriving.discard(path)
    path.replace(path.with_name(f"{path.name}.damaged"))
    job.session.set_frame(frame.url, done=False, sha256="")


def _settle(job: CaptureJob, failed: Mapping[str, DeviceError]) -> None:
    """Continue with the complete frames if there are enough, or else raise the first error."""
    frames = job.session.journal.frames
    paths = tuple(job.session.path_of(frame) for frame in frames if frame.done)
    if failed:
        if _different(paths) < _ENOUGH:
            raise next(iter(failed.values()))
        names = listed([frame.name for frame in frames if not frame.done])
        job.warn(
            tr(
                "{names} could not be downloaded; only {count} of {total} exposures are used.",
                names=names,
                count=len(paths),
                total=len(job.plan.shots),
            )
        )
    job.paths = paths


def _different(paths: Iterable[Path]) -> int:
    """Count the distinct exposures recorded in the files."""
    evs: list[float] = []
    for path in paths:
        try:
            exposure = read_header(path).frame.exposure
        except ProbeError:
            continue
        if exposure and all(abs(exposure.ev - other) >= EQUAL_STOPS for other in evs):
            evs.append(exposure.ev)
    return len(evs)


class _StatusRows:
    """The rows that the status shows for the files during the download."""

    def __init__(self, job: CaptureJob, rows: list[FrameProgress]) -> None:
        self.job, self.rows = job, rows

    def set(self, number: int, **changes: object) -> None:
        """Change a row and show the progress of all files."""
        self.rows[number] = replace(self.rows[number], **changes)  # type: ignore[arg-type]
        row = self.rows[number]
        total = sum(each.size for each in self.rows)
        here = sum(each.received for each in self.rows)
        remaining_s = (total - here) / row.bytes_per_s if row.bytes_per_s > 0.0 else None
        words = tr("File {number} of {count}", number=number + 1, count=len(self.rows))
        self.show(words, here / total if total else 0.0, remaining_s)

    def show(self, message: str, part: float = 0.0, remaining_s: float | None = None) -> None:
        self.job.board.show(
            Stage.DOWNLOADING,
            message,
            part,
            seconds_left=remaining_s,
            may_move=True,
            frames=tuple(self.rows),
        )


def _thumbnails(job: CaptureJob, view: _StatusRows, frames: tuple[SessionFrame, ...]) -> None:
    folder = job.session.thumbnails
    targets = {frame.url: folder / frame.local for frame in frames if frame.local}
    thumbnails = fetch_thumbnails(job.client, targets, job.token)
    for number, frame in enumerate(frames):
        if frame.url in thumbnails:
            view.set(number, thumbnail=thumbnails[frame.url])
            job.session.set_frame(frame.url, thumbnail=thumbnails[frame.url].name)


def _again(job: CaptureJob, view: _StatusRows, number: int, entry: FileEntry) -> DeviceError | None:
    """Download again a file whose length is right but whose image data is damaged."""
    path = job.session.originals / job.session.local_name(entry)
    _set_aside(job, job.session.journal.frames[number])
    view.set(number, done=False)
    error = _one(job, view, number, entry, whole_picture)
    if error is None:
        job.session.finish_frame(entry.url)
        view.set(number, done=True)
        job.arriving.add(path)
    return error


def _one(
    job: CaptureJob,
    view: _StatusRows,
    number: int,
    entry: FileEntry,
    check: Callable[[Path], bool] = whole_file,
) -> DeviceError | None:
    """Download one file, resuming after a reconnection.

    By default, only the file's structure is checked, because the file is decoded while the next one
    arrives. An error that concerns only this file is returned, and any other error is raised.
    """

    def report(received: int, size: int, rate: float) -> None:
        view.set(number, received=received, size=size, bytes_per_s=rate)

    target = job.session.originals / job.session.local_name(entry)
    for attempt in range(_CONTINUATIONS):
        try:
            fetch_file(job.client, entry, target, job.clock, job.token, report, check=check)
        except CameraRefused as error:
            return error
        except (DownloadFailed, Unreachable) as error:
            passing = isinstance(error, Unreachable) or error.code in _PASSING
            if not passing or attempt + 1 == _CONTINUATIONS:
                if error.code in _OF_ONE_FILE:
                    return error
                raise
        else:
            break
        job.contact.reconnect()
    return None
