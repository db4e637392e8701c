"""Pictures one by one: for metering, and for cameras that cannot take a bracket by themselves."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Final

from app.core.measure.plan.planner import PlannedShot
from app.core.places.journal import ShotStart
from app.core.text import tr
from app.devices.capture import camera_settings
from app.devices.capture.connection_loss import NOT_NOW, find_frames
from app.devices.capture.exposures.surplus_pictures import find_listed, in_time
from app.devices.capture.job import CaptureJob
from app.devices.capture.session import camera_time
from app.devices.capture.status import Stage
from app.devices.errors import (
    LOSSES,
    CameraRefused,
    CaptureFailed,
    Unreachable,
)
from app.devices.theta.messages import CommandReply

FRAME_S: Final = 15.0
"""Time that any camera needs for a picture besides its exposure, at most, in seconds."""

STARTS: Final = 4
"""How often a camera is asked to shoot that has not heard it."""

_MANUAL: Final = 1
_LOOKS: Final = 5
_LATE_FILE_S: Final = 6.0
_OVERDUE_S: Final = 9.0
_CLOCK: Final = "dateTimeZone"
_GONE_CODES: Final = frozenset(
    {"invalidParameterValue", "invalidParameterName", "notFound", "unknownCommand"}
)


def as_sent(value: float) -> int | float:
    """Write whole numbers without a point, as cameras do."""
    return int(value) if value == int(value) else value


@dataclass(frozen=True, slots=True)
class CameraPicture:
    """A picture on the camera.

    `has_name`: the camera named it as the one just taken; else it was found in the list of files.
    """

    url: str
    has_name: bool


class SettingsLost(Exception):
    """The camera has not begun to shoot, and may have lost its settings."""


def take_picture(job: CaptureJob, longest_s: float, previous: str) -> CameraPicture:
    """Take a picture and wait until it is stored.

    Where it is unknown whether the camera has heard it, its state and its files tell; only a
    picture that was not taken is asked for again.

    `longest_s`: longest time the picture may need besides `FRAME_S`, in seconds. Raises
    `Unreachable` when the camera never hears it; `SettingsLost` when it was not heard, and the
    settings must be made again first; `CaptureFailed` when it takes too long, or the camera was
    stopped.
    """
    for _ in range(STARTS):
        losses = job.contact.losses
        _note_start(job, previous)
        with suppress(*LOSSES):
            return _take(job, longest_s, previous)
        job.contact.reconnect()
        picture = _taken_anyway(job, longest_s, previous)
        if picture is not None:
            return picture
        if job.contact.losses != losses:
            raise SettingsLost
    raise unheard()


def _note_start(job: CaptureJob, previous: str) -> None:
    """Note that a picture is asked for, so that it can be found if the program ends here."""
    clock_text = camera_settings.read(job.contact, (_CLOCK,)).get(_CLOCK)
    start_time = clock_text if isinstance(clock_text, str) and camera_time(clock_text) else ""
    job.session.update(shot_start=ShotStart(previous, start_time))


def unheard() -> Unreachable:
    """Say that starting fails again and again."""
    return Unreachable(
        tr("The connection is lost again and again when the camera is to shoot."),
        tr("Go nearer to it, then try again."),
        "weak",
    )


def _take(job: CaptureJob, longest_s: float, previous: str) -> CameraPicture:
    began, idle = job.clock.now(), 0
    command = job.contact.once(job.client.take_picture, NOT_NOW)
    while command.state != "done":
        elapsed_s = job.clock.now() - began - longest_s
        if elapsed_s > FRAME_S:
            # Slow answers may have used up the time in which it would have been found below.
            entries = find_frames(job.contact, 1, previous=previous)
            if entries:
                return CameraPicture(entries[0].url, has_name=False)
            raise CaptureFailed(
                tr("The camera does not finish its picture."),
                tr("Switch it off and on."),
                "deadline",
            )
        job.contact.pause(job.profile.poll_s)
        command = ask_how_far(job, command)
        if elapsed_s > _OVERDUE_S and command.state != "done":
            # Some never say that they are done; their state and their files tell.
            idle = idle + 1 if job.contact.ask(job.client.state).idle else 0
            entries = find_frames(job.contact, 1, previous=previous) if idle >= 2 else ()
            if entries:
                return CameraPicture(entries[0].url, has_name=False)
    urls = command.file_urls
    if urls:
        return CameraPicture(urls[0], has_name=True)
    # An address that cannot be used was not named in vain: the list has it, too.
    for _ in range(_LOOKS if command.refused_urls else 1):
        entries = find_frames(job.contact, 1, previous=previous)
        if entries:
            return CameraPicture(entries[0].url, has_name=False)
        job.contact.pause(1.0)
    raise CaptureFailed(
        tr("The camera was stopped before its picture was taken."), tr("Start again."), "stopped"
    )


def ask_how_far(job: CaptureJob, command: CommandReply) -> CommandReply:
    """Ask for a command's state once; its id is that of the first reply.

    Raises `Unreachable` when the camera gave no id, or does not know the command any more;
    `CaptureFailed` when the shot was cancelled at the camera.
    """
    number = command.id
    if number is None:
        raise Unreachable(tr("The camera does not say which picture it takes."))
    try:
        # Ricoh's own examples of status replies have no id.
        return replace(job.contact.ask(lambda: job.client.status(number), NOT_NOW), id=number)
    except CameraRefused as error:
        if error.code == "canceledShooting":
            raise CaptureFailed(
                tr("The exposure was stopped at the camera."), tr("Start again."), "stopped"
            ) from error
        if error.code in _GONE_CODES:
            raise Unreachable(tr("The camera has forgotten its picture.")) from error
        raise


def shoot_singly(job: CaptureJob, shots: Sequence[PlannedShot]) -> tuple[str, ...]:
    """Take the frames of a bracket one after the other in the manual program.

    Seam and level of the first are kept for the others where the camera can do that; the
    self-timer runs before the first only.

    Raises `DeviceError` when a picture cannot be taken.
    """
    urls: list[str] = []
    for number, shot in enumerate(shots):
        remaining_s = sum(
            each.exposure.shutter_s + job.profile.overhead_s for each in shots[number:]
        )
        job.board.show(
            Stage.EXPOSING,
            tr("Exposure {shot} of {shots}", shot=number + 1, shots=len(shots)),
            number / len(shots),
            shot=number + 1,
            shots=len(shots),
            seconds_left=remaining_s,
        )
        urls.append(_one(job, shot, number, tuple(urls)))
        if number == 0 and job.delay_s:
            camera_settings.change_if_known(job.contact, {"exposureDelay": 0})
        if number + 1 < len(shots):
            job.contact.pause(job.profile.rest_s)
    return tuple(urls)


def set_timer(job: CaptureJob) -> None:
    """Set the self-timer; a camera that does not want it shoots at once, and that is said."""
    if camera_settings.change_if_known(job.contact, {"exposureDelay": job.delay_s}):
        job.delay_s = 0
        job.board.say(tr("The camera does not accept the self-timer; it shoots at once"))
        job.warn(tr("The camera did not accept the self-timer: the pictures were taken at once."))


def _one(job: CaptureJob, shot: PlannedShot, number: int, earlier: tuple[str, ...]) -> str:
    previous = earlier[-1] if earlier else job.session.journal.previous_latest
    for attempt in range(STARTS):
        if attempt:
            camera_settings.prepare(job.contact, job.profile)
        losses = job.contact.losses
        _set_exposure(job, shot)
        if job.profile.stitching:
            _keep_seams(job, first=number == 0)
        if number == 0 and job.delay_s:
            set_timer(job)
        delay = job.delay_s if number == 0 else 0
        if job.contact.losses != losses:
            continue
        camera_settings.settle(job.contact, job.profile)
        if delay:
            values = {"shot": 1, "shots": len(job.plan.shots), "timer_s": float(delay)}
            job.board.show(Stage.EXPOSING, tr("Self-timer"), **values)
        with suppress(SettingsLost):
            url = take_picture(job, shot.exposure.shutter_s * 2 + delay, previous).url
            _note_single(job, url)
            return url
    raise unheard()


def _note_single(job: CaptureJob, url: str) -> None:
    picture = find_listed(job.contact, url)
    singles = job.session.journal.singles + (() if picture is None else (picture,))
    job.session.update(singles=singles, shot_start=None)


def _taken_anyway(job: CaptureJob, longest_s: float, previous: str) -> CameraPicture | None:
    """Look for a picture that was taken unannounced.

    It counts as named where it alone is new and the camera's state calls it the newest, or the
    state names none and it was taken in time.
    """
    start = job.session.journal.shot_start
    until = job.clock.now() + longest_s + FRAME_S
    quiet = 0.0
    while job.clock.now() < until and quiet <= _LATE_FILE_S:
        state = job.contact.ask(job.client.state)
        busy = not state.idle
        quiet = 0.0 if busy else quiet + 1.0
        newer = () if busy else find_frames(job.contact, 2, previous=previous)
        if newer:
            latest, first = state.latest_file_url, newer[0]
            is_latest = first.url == latest
            is_latest |= not latest and start is not None and in_time(start, first)
            return CameraPicture(first.url, len(newer) == 1 and is_latest)
        job.contact.pause(1.0)
    return None


def _set_exposure(job: CaptureJob, shot: PlannedShot) -> None:
    exposure = shot.exposure
    options: dict[str, Any] = {
        "exposureProgram": _MANUAL,
        "iso": as_sent(exposure.iso),
        "shutterSpeed": as_sent(exposure.shutter_s),
    }
    if "aperture" in job.profile.saved:
        options["aperture"] = as_sent(exposure.aperture)
    refusals = camera_settings.change_if_known(job.contact, options)
    if {"exposureProgram", "iso", "shutterSpeed"} & set(refusals):
        raise CaptureFailed(
            tr(
                "The camera does not take {seconds:.4g} s at ISO {iso:g}.",
                seconds=exposure.shutter_s,
                iso=exposure.iso,
            ),
            tr(
                "Set it to still pictures in manual mode and try again; if that does not "
                "help, take a bracket by hand and merge its files."
            ),
            "no-manual",
        )


def _keep_seams(job: CaptureJob, *, first: bool) -> None:
    """Frames that are stitched and levelled alike lie on each other."""
    seam_mode = "Save" if first else "Load"
    camera_settings.change_if_known(job.contact, {"_imageStitching": f"dynamic{seam_mode}"})
    camera_settings.change_if_known(job.contact, {"_topBottomCorrection": f"Apply{seam_mode}"})
