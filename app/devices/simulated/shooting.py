"""Shooting and storage: the current job, the files and the camera's clock.

Only rendering runs in a thread. At every request, `Shooter.settle` writes the frames that are due:
those whose exposure and overhead have ended and whose picture is ready. On virtual time, frames are
rendered when they are first used. Otherwise, they are rendered while the camera shoots.
"""

from __future__ import annotations

import base64
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from functools import partial
from typing import Final, Literal, TypeAlias

from app.devices.clock import Clock, VirtualClock
from app.devices.simulated.cameras import Personality
from app.devices.simulated.exchange import CommandRefused, JsonValue
from app.devices.simulated.scene import Scene, Take, automatic, number_in

TOTAL_BYTES: Final = 14_000_000_000
STORAGE_ID: Final = "5ca1ab1e0ddba11c0ffee0000b0bb1e0"
_FORM: Final = "%Y:%m:%d %H:%M:%S"
_START: Final = datetime(2026, 6, 21, 12, 0, 0)

_MOST_DELETED: Final = 128
_WORDS: dict[JobKind, str] = {
    "single": "shooting",
    "bracket": "bracket shooting",
}


class CameraDate:
    """Local time with a constant offset from UTC.

    Args:
        now: Clock reading at `start`, in seconds.
        start: Local time at that moment.
    """

    def __init__(self, now: float, start: datetime = _START, offset: str = "+02:00") -> None:
        self._base = start
        self._since = now
        self._offset = offset

    def set(self, text: str, now: float) -> None:
        """Set the date and time.

        Raises:
            ValueError: If the date or time is invalid.
        """
        self._base = datetime.strptime(text[:19], _FORM)
        self._since = now
        self._offset = text[19:] or self._offset

    def stamp(self, now: float) -> str:
        """Return the local time in EXIF format."""
        return (self._base + timedelta(seconds=now - self._since)).strftime(_FORM)

    def text(self, now: float) -> str:
        """Return the local time with its offset, as in options and file lists."""
        return self.stamp(now) + self._offset

    @property
    def offset(self) -> str:
        """Offset from UTC, such as "+02:00"."""
        return self._offset


@dataclass(slots=True, eq=False)
class StoredFile:
    """A file on the camera, rendered when first used.

    Attributes:
        shape: Rows and columns.
        makers: Functions that return the bytes of the file ("file") and of its thumbnail ("thumb").
    """

    name: str
    path: str
    date_time: str
    shape: tuple[int, int]
    group: str
    makers: Mapping[str, Callable[[], bytes]]
    take: Take | None = None
    _renditions: dict[str, bytes] = field(default_factory=dict, init=False)
    _lock: threading.Lock = field(default_factory=threading.Lock, init=False)

    @property
    def data(self) -> bytes:
        """The bytes of the file."""
        return self._get("file")

    @property
    def thumb(self) -> bytes:
        """The bytes of the file's thumbnail, a JPEG."""
        return self._get("thumb")

    @property
    def size(self) -> int:
        """Size of the file in bytes."""
        return len(self.data)

    def _get(self, which: str) -> bytes:
        with self._lock:
            if which not in self._renditions:
                self._renditions[which] = self.makers[which]()
            return self._renditions[which]


class Storage:
    """The camera's files, oldest first."""

    def __init__(self, person: Personality) -> None:
        self._person = person
        self.files: list[StoredFile] = []
        self.count = 0

    def next_name(self) -> tuple[str, str]:
        """Return the name and path of the next file. Numbers are never reused."""
        self.count += 1
        name = f"{self._person.stem}{self.count:04d}.JPG"
        return name, f"/files/{self._person.folder}/{name}"

    def add(self, file: StoredFile) -> None:
        """Store a file."""
        self.files.append(file)

    def find(self, path: str) -> StoredFile | None:
        """Return a file by the path of its URL without the query, or None if it does not exist."""
        return next((file for file in self.files if file.path == path), None)

    @property
    def free_bytes(self) -> int:
        """Approximate number of free bytes. Every file counts as 4 MB, so none need be rendered."""
        return TOTAL_BYTES - 4_000_000 * len(self.files)

    def delete(self, urls: Sequence[JsonValue]) -> None:
        """Delete all of the given files, or none of them.

        Args:
            urls: URLs of files, or a single word: "all", "image" or "video".

        Raises:
            CommandRefused: With the code invalidParameterValue if a file is missing, there are too
                many, or a value has the wrong type.
        """
        if list(urls) in (["all"], ["image"]):
            self.files.clear()
            return
        if list(urls) == ["video"]:
            return
        if not 1 <= len(urls) <= _MOST_DELETED:
            raise CommandRefused("invalidParameterValue")
        doomed = []
        for url in urls:
            file = self.find("/" + url.partition("://")[2].partition("/")[2]) if (
                isinstance(url, str)
            ) else None  # fmt: skip
            if file is None:
                raise CommandRefused("invalidParameterValue", "There is no such file.")
            doomed.append(file)
        self.files[:] = [file for file in self.files if file not in doomed]

    def entry(
        self, file: StoredFile, url: str, *, detail: bool, thumb_size: int
    ) -> dict[str, JsonValue]:
        """Return the entry for a file in the reply to camera.listFiles."""
        entry: dict[str, JsonValue] = {
            "name": file.name,
            "fileUrl": url,
            "size": file.size,
            "isProcessed": True,
            "previewUrl": "",
        }
        if not detail:
            entry["dateTime"] = file.date_time[:19]
            return entry
        rows, columns = file.shape
        entry |= {"dateTimeZone": file.date_time, "width": columns, "height": rows}
        if self._person.ricoh:
            entry["_thumbSize"] = len(file.thumb)
            if not self._person.switches_api:
                entry["_projectionType"] = "Equirectangular"
            if self._person.camera.lens_words == 1:
                entry |= {"_favorite": False, "_imageDescription": "", "_uploaded": False}
                entry["_storageID"] = STORAGE_ID
            if file.group:
                entry["_autoBracketGroupId"] = file.group
        if thumb_size:
            entry["thumbnail"] = base64.b64encode(file.thumb).decode()
        return entry


JobKind: TypeAlias = Literal["single", "bracket"]


@dataclass(slots=True)
class PlannedFrame:
    """One frame of a job, with its settings and the times at which it is exposed and stored."""

    start: float
    end: float
    take: Take
    picture: Future[bytes] | None = None


@dataclass(slots=True)
class ShootingJob:
    """One photo or one series, in progress or done.

    Attributes:
        start_s, begins: When the photo or series was requested and when the self-timer ends, in
            seconds.
    """

    number: int
    name: str
    kind: JobKind
    start_s: float
    begins: float
    frames: list[PlannedFrame]
    group: str = ""
    files: list[StoredFile] = field(default_factory=list)
    stopped: bool = False
    cancelled: bool = False
    watched: bool = False

    @property
    def done(self) -> bool:
        """Whether all frames have been written or the job was cancelled."""
        if self.cancelled:
            return True
        return len(self.files) >= len(self.frames)

    @property
    def ended(self) -> float:
        """The time when the last frame was written, or minus infinity if there are no frames."""
        return self.frames[-1].end if self.frames and not self.cancelled else float("-inf")

    def completion(self, now: float) -> float:
        """Return the progress reported by the camera, 0 to 1."""
        if not self.frames or now <= self.begins:
            return 0.0
        whole = self.frames[-1].end - self.begins
        return round(min((now - self.begins) / whole, 0.99), 2)

    def status(self, now: float) -> str:
        """Return the value of `_captureStatus`."""
        if self.done:
            return "idle"
        return "self-timer countdown" if now < self.begins else _WORDS[self.kind]


class Shooter:
    """The part of a camera that takes photos.

    Args:
        shape: Rows and columns of all frames, or None to follow the options.
        manual_gains: Sensitivity of the front lens and of the back lens in the manual program.
    """

    def __init__(
        self,
        scene: Scene,
        person: Personality,
        clock: Clock,
        date: CameraDate,
        storage: Storage,
        shape: tuple[int, int] | None,
    ) -> None:
        self._scene = scene
        self._person = person
        self._clock = clock
        self._date = date
        self._storage = storage
        self._shape = shape
        self._count = 0
        self._pool: ThreadPoolExecutor | None = None
        self._lazy = isinstance(clock, VirtualClock)
        self.jobs: list[ShootingJob] = []
        self.manual_gains = (1.0, 1.0)

    @property
    def job(self) -> ShootingJob | None:
        """The latest job."""
        return self.jobs[-1] if self.jobs else None

    @property
    def busy(self) -> bool:
        """Whether a job is in progress. This is valid only directly after `settle`."""
        return self.job is not None and not self.job.done

    def find(self, number: str) -> ShootingJob | None:
        """Return a job by its id, or None if it does not exist."""
        return next((job for job in self.jobs if str(job.number) == number), None)

    def begin(
        self,
        name: str,
        kind: JobKind,
        shots: Sequence[Mapping[str, JsonValue]],
        options: Mapping[str, JsonValue],
    ) -> ShootingJob:
        """Start shooting.

        Args:
            shots: Options for each frame: exposureProgram with its values, and whiteBalance.
        """
        now = self._clock.now()
        begins = now + number_in(options, "exposureDelay", 0.0)
        frames: list[PlannedFrame] = []
        at = begins
        for settings in shots:
            take = self.plan(settings, options, at)
            end = at + take.exposure.shutter_s + self._person.overhead_s
            frames.append(PlannedFrame(at, end, take))
            at = end
        number = 41 + len(self.jobs)
        group = f"B0FB64CF29AE{number:04X}" if kind == "bracket" else ""
        job = ShootingJob(number, name, kind, now, begins, frames, group)
        self.jobs.append(job)
        self._render_ahead(job)
        return job

    def settle(self) -> None:
        """Write the frames that are due."""
        now = self._clock.now()
        job = self.job
        if job is None or job.cancelled:
            return
        for frame in job.frames[len(job.files) :]:
            if frame.end > now or (frame.picture is not None and not frame.picture.done()):
                break
            job.files.append(self.write(frame, job))

    def stop(self) -> None:
        """Stop after the current frame, or before the first frame if the self-timer is running."""
        now = self._clock.now()
        job = self.job
        if job is None:
            return
        if now < job.begins:
            job.cancelled = True
        else:
            keep = sum(frame.start <= now for frame in job.frames)
            job.frames[max(keep, len(job.files)) :] = []
        job.stopped = True

    def close(self) -> None:
        """End the rendering thread."""
        if self._pool is not None:
            self._pool.shutdown(wait=True, cancel_futures=True)
            self._pool = None

    def plan(
        self, settings: Mapping[str, JsonValue], options: Mapping[str, JsonValue], at: float
    ) -> Take:
        """Plan a frame to be exposed at clock time `at`."""
        exposure, gains = automatic(self._scene, self._person, settings)
        program = int(number_in(settings, "exposureProgram", 2.0))
        self._count += 1
        return Take(
            exposure=exposure,
            shape=self._shape or _shape_of(options),
            number=self._count,
            date_time=self._date.stamp(at),
            program=program,
            lens_gain=self.manual_gains if program == 1 else gains,
            fixed_balance=settings.get("whiteBalance") != "auto",
            hdr=options.get("_filter", "off") in {"hdr", "Hh hdr", "DR Comp"},
        )

    def write(self, frame: PlannedFrame, job: ShootingJob | None) -> StoredFile:
        """Write a job's frame to storage, or an older photo if `job` is None."""
        camera, take = self._person.camera, frame.take
        name, path = self._storage.next_name()
        whole = frame.picture.result if frame.picture else partial(self._scene.frame, camera, take)
        small = partial(self._scene.thumbnail, camera, take, self._person.thumb)
        grouped = self._person.bracket is not None and self._person.bracket.grouped
        file = StoredFile(
            name,
            path,
            take.date_time + self._date.offset,
            take.shape,
            job.group if job is not None and grouped else "",
            {"file": whole, "thumb": small},
            take,
        )
        self._storage.add(file)
        return file

    def _render_ahead(self, job: ShootingJob) -> None:
        if self._lazy:
            return
        if self._pool is None:
            self._pool = ThreadPoolExecutor(1, "simulated camera")
        for frame in job.frames:
            frame.picture = self._pool.submit(self._scene.frame, self._person.camera, frame.take)


def _shape_of(options: Mapping[str, JsonValue]) -> tuple[int, int]:
    size = options.get("fileFormat")
    assert isinstance(size, dict)
    rows, columns = size["height"], size["width"]
    assert isinstance(rows, int)
    assert isinstance(columns, int)
    return rows, columns
