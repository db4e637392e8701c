"""Pictures one by one: for metering, and for cameras without a bracket of their own."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from app.devices.capture import settings
from app.devices.capture.recovery import NOT_NOW, find_frames
from app.devices.capture.status import Stage
from app.devices.errors import LOSSES, CameraRefused, CaptureFailed, Unreachable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.hdr.planner import PlannedShot
    from app.devices.capture.job import Job
    from app.devices.theta.messages import Command

FRAME_S: Final = 15.0
"""Time that any camera needs for a picture besides its exposure, at most, in seconds."""

STARTS: Final = 4
"""How often a camera is asked to shoot that has not heard it."""

_MANUAL: Final = 1
_LOOKS: Final = 5
_LATE_FILE_S: Final = 6.0
_OVERDUE_S: Final = 9.0
_GONE: Final = frozenset(
    {"invalidParameterValue", "invalidParameterName", "notFound", "unknownCommand"}
)


def as_sent(value: float) -> int | float:
    """Write whole numbers without a point, as cameras do."""
    return int(value) if value == int(value) else value


@dataclass(frozen=True, slots=True)
class Taken:
    """A picture on the camera.

    Attributes
    ----------
    named : bool
        The camera named it as the one just taken; else it was found in the list of files.
    """

    url: str
    named: bool


class Forgotten(Exception):
    """The camera has not begun to shoot, and may have lost its settings."""


def take_picture(job: Job, longest_s: float, previous: str) -> Taken:
    """Take a picture and wait until it is stored.

    Where nobody knows whether the camera has heard it, its state and its files tell; only a picture
    that was not taken is asked for again.

    Parameters
    ----------
    longest_s : float
        Longest time the picture may need besides `FRAME_S`, in seconds.

    Raises
    ------
    Unreachable
        When the camera never hears it.
    Forgotten
        When it was not heard, and the settings must be made again first.
    CaptureFailed
        When it takes too long, or the camera was stopped.
    """
    for _ in range(STARTS):
        forgotten = job.contact.forgotten
        with suppress(*LOSSES):
            return _taken(job, longest_s, previous)
        job.contact.reconnect()
        found = _taken_anyway(job, longest_s, previous)
        if found is not None:
            return found
        if job.contact.forgotten != forgotten:
            raise Forgotten
    raise unheard()


def unheard() -> Unreachable:
    """Say that starting fails again and again."""
    return Unreachable(
        "The connection is lost again and again when the camera is to shoot.",
        "Go nearer to it, then try again.",
        "weak",
    )


def _taken(job: Job, longest_s: float, previous: str) -> Taken:
    began, idle = job.clock.now(), 0
    command = job.contact.once(job.client.take_picture, NOT_NOW)
    while command.state != "done":
        spent = job.clock.now() - began - longest_s
        if spent > FRAME_S:
            # Slow answers may have used up the time in which it would have been found below.
            found = find_frames(job.contact, 1, previous=previous)
            if found:
                return Taken(found[0].url, named=False)
            raise CaptureFailed(
                "The camera does not finish its picture.", "Switch it off and on.", "deadline"
            )
        job.contact.pause(job.profile.poll_s)
        command = ask_how_far(job, command)
        if spent > _OVERDUE_S and command.state != "done":
            # Some never say that they are done; their state and their files tell.
            status = job.contact.ask(job.client.state).capture_status
            idle = idle + 1 if status in ("", "idle") else 0
            found = find_frames(job.contact, 1, previous=previous) if idle >= 2 else ()
            if found:
                return Taken(found[0].url, named=False)
    urls = command.file_urls
    if urls:
        return Taken(urls[0], named=True)
    # An address that cannot be used was not named in vain: the list has it, too.
    for _ in range(_LOOKS if command.refused_urls else 1):
        found = find_frames(job.contact, 1, previous=previous)
        if found:
            return Taken(found[0].url, named=False)
        job.contact.pause(1.0)
    raise CaptureFailed(
        "The camera was stopped before its picture was taken.", "Start again.", "stopped"
    )


def ask_how_far(job: Job, command: Command) -> Command:
    """Ask for a command's state once; its id is that of the first reply.

    Raises
    ------
    Unreachable
        When the camera gave no id, or does not know the command any more.
    CaptureFailed
        When the shot was cancelled at the camera.
    """
    number = command.id
    if number is None:
        raise Unreachable("The camera does not say which picture it takes.")
    try:
        # Ricoh's own examples of status replies have no id.
        return replace(job.contact.ask(lambda: job.client.status(number), NOT_NOW), id=number)
    except CameraRefused as error:
        if error.code == "canceledShooting":
            raise CaptureFailed(
                "The exposure was stopped at the camera.", "Start again.", "stopped"
            ) from error
        if error.code in _GONE:
            raise Unreachable("The camera has forgotten its picture.") from error
        raise


def shoot_singly(job: Job, shots: Sequence[PlannedShot]) -> tuple[str, ...]:
    """Take the frames of a bracket one after the other in the manual program.

    Seam and level of the first are kept for the others where the camera can do that; the
    self-timer runs before the first only.

    Raises
    ------
    DeviceError
        When a picture cannot be taken.
    """
    urls: list[str] = []
    for number, shot in enumerate(shots):
        left = sum(each.exposure.shutter_s + job.profile.overhead_s for each in shots[number:])
        job.board.show(
            Stage.EXPOSING,
            f"Exposure {number + 1} of {len(shots)}",
            number / len(shots),
            shot=number + 1,
            shots=len(shots),
            seconds_left=left,
        )
        urls.append(_one(job, shot, number, tuple(urls)))
        if number == 0 and job.delay_s:
            settings.change_if_known(job.contact, {"exposureDelay": 0})
        if number + 1 < len(shots):
            job.contact.pause(job.profile.rest_s)
    return tuple(urls)


def set_timer(job: Job) -> None:
    """Set the self-timer; a camera that does not want it shoots at once, and that is said."""
    if settings.change_if_known(job.contact, {"exposureDelay": job.delay_s}):
        job.delay_s = 0
        job.board.say("The camera does not accept the self-timer; it shoots at once")
        job.warn("The camera did not accept the self-timer: the pictures were taken at once.")


def _one(job: Job, shot: PlannedShot, number: int, taken: tuple[str, ...]) -> str:
    previous = taken[-1] if taken else job.session.journal.previous_latest
    for attempt in range(STARTS):
        if attempt:
            settings.prepare(job.contact, job.profile)
        forgotten = job.contact.forgotten
        _set_exposure(job, shot)
        if job.profile.stitching:
            _keep_seams(job, first=number == 0)
        if number == 0 and job.delay_s:
            set_timer(job)
        delay = job.delay_s if number == 0 else 0
        if job.contact.forgotten != forgotten:
            continue
        settings.settle(job.contact, job.profile)
        with suppress(Forgotten):
            return take_picture(job, shot.exposure.shutter_s * 2 + delay, previous).url
    raise unheard()


def _taken_anyway(job: Job, longest_s: float, previous: str) -> Taken | None:
    """Look for a picture that was taken although nobody heard of it.

    It counts as named where it alone is new and the camera's state calls it the newest.
    """
    until = job.clock.now() + longest_s + FRAME_S
    quiet = 0.0
    while job.clock.now() < until and quiet <= _LATE_FILE_S:
        state = job.contact.ask(job.client.state)
        busy = state.capture_status not in ("", "idle")
        quiet = 0.0 if busy else quiet + 1.0
        newer = () if busy else find_frames(job.contact, 2, previous=previous)
        if newer:
            return Taken(newer[0].url, len(newer) == 1 and newer[0].url == state.latest_file_url)
        job.contact.pause(1.0)
    return None


def _set_exposure(job: Job, shot: PlannedShot) -> None:
    exposure = shot.exposure
    options: dict[str, Any] = {
        "exposureProgram": _MANUAL,
        "iso": as_sent(exposure.iso),
        "shutterSpeed": as_sent(exposure.shutter_s),
    }
    if "aperture" in job.profile.saved:
        options["aperture"] = as_sent(exposure.aperture)
    refused = settings.change_if_known(job.contact, options)
    if {"exposureProgram", "iso", "shutterSpeed"} & set(refused):
        raise CaptureFailed(
            f"The camera does not take {exposure.shutter_s:.4g} s at ISO {exposure.iso:g}.",
            "Set it to still pictures in manual mode and try again; if that does not help, take a"
            " bracket by hand and merge its files.",
            "no-manual",
        )


def _keep_seams(job: Job, *, first: bool) -> None:
    """Frames that are stitched and levelled alike lie on each other."""
    kept = "Save" if first else "Load"
    settings.change_if_known(job.contact, {"_imageStitching": f"dynamic{kept}"})
    settings.change_if_known(job.contact, {"_topBottomCorrection": f"Apply{kept}"})
