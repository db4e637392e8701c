"""Bringing the frames over: small pictures first, then the files, each read as it arrives."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.core.base.errors import ProbeError
from app.core.hdr.bracket import EQUAL_STOPS
from app.core.hdr.contradiction import disagreeing
from app.core.hdr.decoding import Pixels
from app.core.hdr.metadata import read_header
from app.core.text import tr, tr_plural
from app.core.text.quantities import listed
from app.devices.capture.download import fetch_file, fetch_thumbnails
from app.devices.capture.file_integrity import whole_file, whole_picture
from app.devices.capture.job import Job
from app.devices.capture.status import FrameProgress, Stage
from app.devices.errors import (
    CameraRefused,
    CaptureFailed,
    DeviceError,
    DownloadFailed,
    Unreachable,
)
from app.devices.theta.messages import FileEntry

if TYPE_CHECKING:
    from app.devices.capture.session import SessionFrame

_CONTINUATIONS: Final = 3
_ENOUGH: Final = 3
# What another try may mend once the camera has been found again.
_PASSING: Final = frozenset({"interrupted", "bad-answers"})
# What one file has, and the next one need not have.
_OF_ONE_FILE: Final = frozenset(
    {"bad-answers", "damaged", "damaged-on-camera", "too-long", "other-file"}
)


def fetch(job: Job) -> None:
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
    view = _View(job, rows)
    view.show(tr("Looking at the small pictures"))
    missing = [frame for frame in frames if not frame.done]
    _thumbnails(job, view, frames if missing else ())
    entries = {frame.url: _entry(frame) for frame in missing}
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
    if entries:
        _compare(job, view, entries, failed)
    _settle(job, failed)


def _compare(
    job: Job, view: _View, entries: Mapping[str, FileEntry], failed: dict[str, DeviceError]
) -> None:
    """Fetch frames once more that do not fit the others; leave them out, or ask, if they stay so.

    Damage inside a JPEG that can still be decoded is seen only beside the other frames.
    """
    frames = job.session.journal.frames
    for number in _misfits(job, failed):
        if frames[number].url in entries:
            view.show(
                tr("Fetching {name} again: it does not fit the others", name=frames[number].name)
            )
            error = _again(job, view, number, entries[frames[number].url])
            if error is not None:
                failed[frames[number].url] = error
    misfits = _misfits(job, failed) if view.fetched_again else ()
    if not misfits:
        return
    others = [
        job.session.path_of(frame)
        for number, frame in enumerate(frames)
        if number not in misfits and frame.url not in failed
    ]
    names = listed([frames[number].name for number in misfits])
    what = tr_plural(
        "{names} does not match the other frames, even when fetched again.",
        "{names} do not match the other frames, even when fetched again.",
        len(misfits),
        names=names,
    )
    if _different(others) < _ENOUGH:
        raise CaptureFailed(
            what,
            tr(
                "Something changed during the bracket, or the file is damaged on the "
                "camera. Open this session again to use all frames, or capture again."
            ),
            "misfit",
        )
    for number in misfits:
        _set_aside(job, frames[number])
        failed[frames[number].url] = DownloadFailed(what, tr("Take the bracket again."), "damaged")


def _misfits(job: Job, failed: Mapping[str, DeviceError]) -> tuple[int, ...]:
    """Numbers of the frames that look damaged beside the others."""
    here: list[int] = []
    small: list[Pixels] = []
    stops: list[float] = []
    for number, frame in enumerate(job.session.journal.frames):
        path = job.session.path_of(frame)
        picture = None if frame.url in failed else job.arriving.proxy(path, job.token)
        exposure = None if picture is None else read_header(path).frame.exposure
        if picture is None or exposure is None or picture.dtype != "uint8":
            continue
        if picture.shape[1] == 2 * picture.shape[0]:
            here.append(number)
            small.append(picture)
            stops.append(exposure.ev)
    return tuple(here[place] for place in disagreeing(small, stops))


def _set_aside(job: Job, frame: SessionFrame) -> None:
    path = job.session.path_of(frame)
    job.arriving.discard(path)
    path.replace(path.with_name(f"{path.name}.damaged"))
    job.session.set_frame(frame.url, done=False, sha256="")


def _settle(job: Job, failed: Mapping[str, DeviceError]) -> None:
    """Be content with the frames that are whole where they are enough, or say why not."""
    frames = job.session.journal.frames
    paths = tuple(job.session.path_of(frame) for frame in frames if frame.done)
    if failed:
        if _different(paths) < _ENOUGH:
            raise next(iter(failed.values()))
        names = listed([frame.name for frame in frames if not frame.done])
        job.warn(
            tr(
                "{names} could not be brought over whole; only {count} of {wanted} "
                "exposures are used.",
                names=names,
                count=len(paths),
                wanted=len(job.plan.shots),
            )
        )
    job.paths = paths


def _different(paths: Iterable[Path]) -> int:
    """Count the exposures that differ; a file that does not state its own is of no use here."""
    known: list[float] = []
    for path in paths:
        try:
            exposure = read_header(path).frame.exposure
        except ProbeError:
            continue
        if exposure and all(abs(exposure.ev - other) >= EQUAL_STOPS for other in known):
            known.append(exposure.ev)
    return len(known)


class _View:
    """The rows of the status while files come."""

    def __init__(self, job: Job, rows: list[FrameProgress]) -> None:
        self.job, self.rows = job, rows
        self.fetched_again = False

    def set(self, number: int, **changes: object) -> None:
        """Change a row and say how far everything is."""
        self.rows[number] = replace(self.rows[number], **changes)  # type: ignore[arg-type]
        row = self.rows[number]
        total = sum(each.size for each in self.rows)
        here = sum(each.received for each in self.rows)
        left = (total - here) / row.bytes_per_s if row.bytes_per_s > 0.0 else None
        words = tr("File {number} of {count}", number=number + 1, count=len(self.rows))
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
        )


def _thumbnails(job: Job, view: _View, frames: tuple[SessionFrame, ...]) -> None:
    folder = job.session.thumbnails
    wanted = {frame.url: folder / frame.local for frame in frames if frame.local}
    found = fetch_thumbnails(job.client, wanted, job.token)
    for number, frame in enumerate(frames):
        if frame.url in found:
            view.set(number, thumbnail=found[frame.url])
            job.session.set_frame(frame.url, thumbnail=found[frame.url].name)


def _entry(frame: SessionFrame) -> FileEntry:
    """Return what the camera said of a file when the journal was written."""
    return FileEntry(frame.name, frame.url, frame.size, frame.taken)


def _again(job: Job, view: _View, number: int, entry: FileEntry) -> DeviceError | None:
    """Fetch a file once more whose length was right but whose picture is damaged."""
    path = job.session.originals / job.session.local_name(entry)
    _set_aside(job, job.session.journal.frames[number])
    view.fetched_again = True
    view.set(number, done=False)
    error = _one(job, view, number, entry, whole_picture)
    if error is None:
        job.session.finish_frame(entry.url)
        view.set(number, done=True)
        job.arriving.add(path)
    return error


def _one(
    job: Job,
    view: _View,
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
