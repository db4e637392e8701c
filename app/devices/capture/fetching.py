"""The frames of a bracket: thumbnails first, then the files; each is read while the next comes."""

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
from app.devices.capture.download import FileSource, fetch_file
from app.devices.capture.file_integrity import jpeg_end, whole_file, whole_picture
from app.devices.capture.job import CaptureJob
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
    """Bring the small pictures over, as far as the camera has them.

    They are only for looking at: what fails is left out and never stops a capture. `targets` says
    where the small picture of each URL shall be; those that are there now are returned.

    Raises `Cancelled` when the token was cancelled.
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
            break  # the files themselves are worth the waiting, these are not
        except (DeviceError, CoreError):
            continue
    return paths


_CONTINUATIONS: Final = 3
_ENOUGH: Final = 3
# What another try may mend once the camera has been found again.
_PASSING: Final = frozenset({"interrupted", "bad-answers"})
# What one file has, and the next one need not have.
_OF_ONE_FILE: Final = frozenset(
    {"bad-answers", "damaged", "damaged-on-camera", "too-long", "other-file"}
)


def fetch(job: CaptureJob) -> None:
    """Bring the frames of the journal over.

    A file that cannot be had does not keep the others from coming. Where three with different
    exposures are whole, these are used and the user is told; the others stay open in the journal.

    Raises `DownloadFailed` when the link does not last, the disk refuses, or too few came whole;
    what came stays and can be continued; `CameraRefused` when the camera does not give the files,
    and too few came whole; `Cancelled` when the token was cancelled.
    """
    job.session.update(stage=Stage.DOWNLOADING.value)
    frames = job.session.journal.frames
    job.arriving.expect(len(frames))
    rows = [FrameProgress(frame.name, size=frame.size, done=frame.done) for frame in frames]
    view = _StatusRows(job, rows)
    view.show(tr("Looking at the small pictures"))
    missing = [frame for frame in frames if not frame.done]
    _thumbnails(job, view, frames if missing else ())
    # What the camera said of a file when the journal was written.
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
    """Be content with the frames that are whole where they are enough, or say why not."""
    frames = job.session.journal.frames
    paths = tuple(job.session.path_of(frame) for frame in frames if frame.done)
    if failed:
        if _different(paths) < _ENOUGH:
            raise next(iter(failed.values()))
        names = listed([frame.name for frame in frames if not frame.done])
        job.warn(
            tr(
                "{names} could not be brought over whole; only {count} of {total} "
                "exposures are used.",
                names=names,
                count=len(paths),
                total=len(job.plan.shots),
            )
        )
    job.paths = paths


def _different(paths: Iterable[Path]) -> int:
    """Count the exposures that differ; a file that does not state its own is of no use here."""
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
    """The rows of the status while files come."""

    def __init__(self, job: CaptureJob, rows: list[FrameProgress]) -> None:
        self.job, self.rows = job, rows

    def set(self, number: int, **changes: object) -> None:
        """Change a row and say how far everything is."""
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
    """Fetch a file once more whose length was right but whose picture is damaged."""
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
    """Bring one file over, and continue with it when the link comes back.

    Only its structure is checked here by default: it is decoded while the next one comes. What is
    wrong with this file alone is returned, everything else is raised.
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
