"""Taking pictures: what is under way, for how long, and what has been written so far.

Nothing runs in the background but the rendering. Whenever somebody asks, `Shooter.settle` writes
the frames whose time has come: exposure and overhead have passed, and the picture is ready. On
virtual time pictures are rendered when they are first needed, else from the start of the shooting
on, in a thread.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from app.devices.clock import VirtualClock
from app.devices.simulated.exchange import LATENCY_S, CommandRefused, Reply, json_reply
from app.devices.simulated.scene import Take, automatic
from app.devices.simulated.storage import StoredFile

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from concurrent.futures import Future

    from app.devices.clock import Clock
    from app.devices.simulated.camera import SimulatedCamera
    from app.devices.simulated.exchange import JsonValue
    from app.devices.simulated.personality import Personality
    from app.devices.simulated.scene import Scene
    from app.devices.simulated.storage import CameraDate, Storage


_ENDLESS: Final = 200
_HDR_STEPS: Final = (0.0, -2.0, 2.0)
_OF_ONE_SHOT: Final = (
    "exposureProgram", "iso", "shutterSpeed", "aperture", "exposureCompensation",
    "isoAutoHighLimit", "whiteBalance",
)  # fmt: skip


def begin_picture(camera: SimulatedCamera) -> Reply:
    """Take a single picture.

    inProgress with an id; a cut connection where pictures follow each other too fast. Raises
    `CommandRefused`: disabledCommand in another mode.
    """
    if camera.options["captureMode"] != "image" or camera.store.method != "normal":
        raise CommandRefused("disabledCommand")
    last = camera.shooter.job
    rest = camera.personality.rest_s
    if last is not None and camera.clock.now() - last.ended < rest:
        return Reply(0, delay_s=LATENCY_S)
    settings = _settings(camera)
    if camera.options.get("hdr") == "hdr" and camera.options.get("photoStitching") == "none":
        shots = [settings | {"exposureCompensation": step} for step in _HDR_STEPS]
        return _begin(camera, "camera.takePicture", "hdr", shots)
    return _begin(camera, "camera.takePicture", "single", [settings])


def begin_capture(camera: SimulatedCamera, mode: JsonValue) -> Reply:
    """Begin a series.

    `mode`: `_mode`, None where it was not given. inProgress with an id, or done where the series
    has no end. Raises `CommandRefused`: invalidParameterValue for a mode that the model does not
    have.
    """
    options, person = camera.options, camera.personality
    if options["captureMode"] == "video":
        if mode is not None:
            raise CommandRefused("invalidParameterName")
        return _begin(camera, "camera.startCapture", "video", [])
    rules = person.bracket
    by_method = "_shootingMethod" in options
    if by_method and mode is None:
        mode = camera.store.method
    if mode in {None, "interval"} and not by_method:
        shots = [_settings(camera)] * _ENDLESS
        return _begin(camera, "camera.startCapture", "interval", shots)
    if mode != "bracket" or rules is None:
        raise CommandRefused("disabledCommand" if mode == "normal" else "invalidParameterValue")
    shots = _bracket(camera)
    if rules.method and camera.store.method != "bracket":
        # The X takes as many pictures as asked for, but all of them as it would take one.
        shots = [_settings(camera)] * len(shots)
    return _begin(camera, "camera.startCapture", "bracket", shots)


def started(camera: SimulatedCamera, job: Job) -> dict[str, JsonValue]:
    """Say that a command is under way."""
    number: JsonValue = job.number if camera.personality.numeric_ids else str(job.number)
    share = 0.0 if job.watched else job.completion(camera.clock.now())
    return {
        "name": job.name, "state": "inProgress", "id": number, "progress": {"completion": share},
    }  # fmt: skip


def finished(camera: SimulatedCamera, job: Job) -> dict[str, JsonValue]:
    """Say that a command is done, and where its files are.

    Body of the answer; without URLs where the job was stopped.
    """
    urls: list[JsonValue] = [camera.trouble.poisoned_url(camera.url(file)) for file in job.written]
    results: dict[str, JsonValue]
    if job.kind == "bracket":
        results = {} if job.stopped else {"fileUrls": urls}
    elif job.kind == "hdr":
        results = {"fileUrl": urls[0], "_fileGroup": urls}
    elif job.kind == "single":
        results = {"fileUrl": urls[0] if urls else ""}
    else:
        results = {"fileUrls": urls}
    return {"name": job.name, "state": "done", "results": results}


def _settings(camera: SimulatedCamera) -> dict[str, JsonValue]:
    settings: dict[str, JsonValue] = {
        name: camera.options[name] for name in _OF_ONE_SHOT if name in camera.options
    }
    if camera.options.get("_filter", "off") != "off":
        settings["exposureProgram"] = 2
    return settings


def _bracket(camera: SimulatedCamera) -> list[dict[str, JsonValue]]:
    wanted = camera.options["_autoBracket"]
    assert isinstance(wanted, dict)
    shots = wanted["_bracketParameters"]
    assert isinstance(shots, list)
    usual: dict[str, JsonValue] = {
        "exposureProgram": 1,
        "aperture": camera.personality.apertures[0],
        "whiteBalance": "_colorTemperature",
    }
    return [usual | shot for shot in shots if isinstance(shot, dict)]


def _begin(
    camera: SimulatedCamera, name: str, kind: str, shots: list[dict[str, JsonValue]]
) -> Reply:
    shots = camera.trouble.exposures(camera, shots)
    interval = camera.options["captureInterval"] if kind == "interval" else 0.0
    job = camera.shooter.begin(
        name,
        kind,  # type: ignore[arg-type]
        shots,
        camera.options,
        interval_s=float(str(interval)),
    )
    rules = camera.personality.bracket
    job.watched = kind == "bracket" and rules is not None and rules.watched
    camera.trouble.begun(camera, job)
    if job.open_end:
        return json_reply({"name": name, "state": "done"})
    return json_reply(started(camera, job))


JobKind: TypeAlias = Literal["single", "bracket", "interval", "video", "hdr"]
_WORDS: dict[JobKind, str] = {
    "single": "shooting",
    "bracket": "bracket shooting",
    "interval": "interval shooting",
    "video": "shooting",
    "hdr": "shooting",
}


@dataclass(slots=True)
class PlannedFrame:
    """One frame of a job: when it is exposed, when it is on the storage, and how it is taken."""

    start: float
    end: float
    take: Take
    picture: Future[bytes] | None = None


@dataclass(slots=True)
class Job:
    """One picture or one series under way, or done.

    * `begun`, `begins`: when it was asked for, and when the self-timer has run down, in seconds of
      the clock.
    * `open_end`: whether it goes on until somebody stops it.
    """

    number: int
    name: str
    kind: JobKind
    begun: float
    begins: float
    frames: list[PlannedFrame]
    group: str = ""
    written: list[StoredFile] = field(default_factory=list)
    open_end: bool = False
    stopped: bool = False
    cancelled: bool = False
    watched: bool = False

    @property
    def done(self) -> bool:
        """Whether nothing more will come of it."""
        if self.cancelled:
            return True
        return len(self.written) >= len(self.frames) and not self.open_end

    @property
    def ended(self) -> float:
        """When its last frame was written; a time long ago where there was none."""
        return self.frames[-1].end if self.frames and not self.cancelled else float("-inf")

    def completion(self, now: float) -> float:
        """Share done, 0 to 1, as the camera reports it."""
        if not self.frames or now <= self.begins:
            return 0.0
        whole = self.frames[-1].end - self.begins
        return round(min((now - self.begins) / whole, 0.99), 2)

    def status(self, now: float) -> str:
        """`_captureStatus` while it runs."""
        if self.done:
            return "idle"
        return "self-timer countdown" if now < self.begins else _WORDS[self.kind]


class Shooter:
    """The part of a camera that takes pictures.

    `shape`: size of all frames; None for what the camera is set to.
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
        self._taken = 0
        self._pool: ThreadPoolExecutor | None = None
        self._lazy = isinstance(clock, VirtualClock)
        self.jobs: list[Job] = []
        self.manual_gains = (1.0, 1.0)

    @property
    def job(self) -> Job | None:
        """The last job that was begun."""
        return self.jobs[-1] if self.jobs else None

    @property
    def busy(self) -> bool:
        """Whether a job is under way; only right after `settle`."""
        return self.job is not None and not self.job.done

    def find(self, number: str) -> Job | None:
        """Find a job by its id."""
        return next((job for job in self.jobs if str(job.number) == number), None)

    def begin(
        self,
        name: str,
        kind: JobKind,
        shots: Sequence[Mapping[str, JsonValue]],
        options: Mapping[str, JsonValue],
        *,
        interval_s: float = 0.0,
    ) -> Job:
        """Begin to take pictures.

        `shots`: settings of each frame: exposureProgram and what belongs to it, whiteBalance.
        """
        now = self._clock.now()
        delay = options.get("exposureDelay", 0)
        begins = now + (float(delay) if isinstance(delay, int | float) else 0.0)
        frames: list[PlannedFrame] = []
        at = begins
        for settings in shots:
            take = self._take(settings, options, at)
            if kind == "single":
                take = replace(take, loose=_is_loose(options))
            end = at + take.exposure.shutter_s + self._person.overhead_s
            frames.append(PlannedFrame(at, end, take))
            at = max(end, at + interval_s)
        number = 41 + len(self.jobs)
        group = f"B0FB64CF29AE{number:04X}" if kind == "bracket" else ""
        job = Job(number, name, kind, now, begins, frames, group)
        job.open_end = kind in {"interval", "video"}
        self.jobs.append(job)
        self._render_ahead(job)
        return job

    def settle(self) -> None:
        """Write the frames whose time has come."""
        now = self._clock.now()
        job = self.job
        if job is None or job.cancelled:
            return
        for frame in job.frames[len(job.written) :]:
            if frame.end > now or (frame.picture is not None and not frame.picture.done()):
                break
            job.written.append(self._write(frame, job))

    def stop(self) -> None:
        """Stop after the frame that is being taken; nothing more than that during the timer."""
        now = self._clock.now()
        job = self.job
        if job is None:
            return
        if now < job.begins:
            job.cancelled = True
        else:
            keep = sum(frame.start <= now for frame in job.frames)
            job.frames[max(keep, len(job.written)) :] = []
        job.stopped = True
        job.open_end = False

    def store_older(self, count: int, options: Mapping[str, JsonValue]) -> None:
        """Put pictures onto the storage as if they had been taken before."""
        for index in range(count):
            at = self._clock.now() - 60.0 * (count - index)
            take = self._take({**options, "exposureProgram": 2}, options, at)
            frame = PlannedFrame(at, at, replace(take, shape=(64, 128)))
            self._write(frame, None)

    def close(self) -> None:
        """End the rendering."""
        if self._pool is not None:
            self._pool.shutdown(wait=True, cancel_futures=True)
            self._pool = None

    def _take(
        self, settings: Mapping[str, JsonValue], options: Mapping[str, JsonValue], at: float
    ) -> Take:
        exposure, gains = automatic(self._scene, self._person, settings)
        program = settings.get("exposureProgram", 2)
        manual = program == 1
        self._taken += 1
        return Take(
            exposure=exposure,
            shape=self._shape or _shape_of(options),
            number=self._taken,
            taken=self._date.stamp(at),
            program=int(program) if isinstance(program, int | float) else 2,
            lens_gain=self.manual_gains if manual else gains,
            fixed_balance=settings.get("whiteBalance") != "auto",
            hdr=options.get("_filter", "off") in {"hdr", "Hh hdr", "DR Comp"},
            # Insta360's stitch nothing but what their HDR mode makes.
            unstitched=self._person.insta
            and (options.get("hdr"), options.get("photoStitching")) != ("hdr", "ondevice"),
        )

    def _write(self, frame: PlannedFrame, job: Job | None) -> StoredFile:
        camera, take = self._person.camera, frame.take
        name, path = self._storage.next_name()
        render = frame.picture.result if frame.picture else partial(self._scene.frame, camera, take)
        grouped = self._person.bracket is not None and self._person.bracket.grouped
        file = StoredFile(
            name,
            path,
            take.taken + self._date.offset,
            take.shape,
            job.group if job is not None and grouped else "",
            render,
            partial(self._scene.thumbnail, camera, take, self._person.thumb),
            take,
        )
        self._storage.add(file)
        return file

    def _render_ahead(self, job: Job) -> None:
        if self._lazy or job.open_end:
            return
        if self._pool is None:
            self._pool = ThreadPoolExecutor(1, "simulated camera")
        for frame in job.frames:
            frame.picture = self._pool.submit(self._scene.frame, self._person.camera, frame.take)


def _is_loose(options: Mapping[str, JsonValue]) -> bool:
    """Whether a picture is stitched and levelled without regard to the one before."""
    kept = options.get("_imageStitching") in {"static", "dynamicLoad"}
    return not (kept and options.get("_topBottomCorrection") in {"Disapply", "ApplyLoad"})


def _shape_of(options: Mapping[str, JsonValue]) -> tuple[int, int]:
    size = options.get("fileFormat")
    assert isinstance(size, dict)
    rows, columns = size["height"], size["width"]
    assert isinstance(rows, int)
    assert isinstance(columns, int)
    return rows, columns
