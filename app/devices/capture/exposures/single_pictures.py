"""Single photos, for metering and for cameras that cannot shoot a bracket themselves."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Final

from app.core.measure.plan.planner import PlannedShot
from app.core.places.journal import ShotStart
from app.core.text import tr
from app.devices.capture import camera_settings
from app.devices.capture.capture_job import CaptureJob
from app.devices.capture.exposures.surplus_pictures import find_listed, in_time
from app.devices.capture.reconnection import NOT_NOW, find_frames
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
"""Maximum time, in seconds, that any camera needs for a photo beyond the exposure time."""

STARTS: Final = 4
"""Number of attempts to start a shot if the camera does not receive the command."""

_MANUAL: Final = 1
_LOOKS: Final = 5
_LATE_FILE_S: Final = 6.0
_OVERDUE_S: Final = 9.0
_CLOCK: Final = "dateTimeZone"
_GONE_CODES: Final = frozenset(
    {"invalidParameterValue", "invalidParameterName", "notFound", "unknownCommand"}
)


def as_sent(value: float) -> int | float:
    """Return a whole number as an int, since cameras write it without a decimal point."""
    return int(value) if value == int(value) else value


@dataclass(frozen=True, slots=True)
class CameraPicture:
    """A photo on the camera.

    Attributes:
        has_name: Whether the camera named the photo as the one just taken. Otherwise, the photo was
            found in the file list.
    """

    url: str
    has_name: bool


class SettingsLost(Exception):
    """Raised when the camera did not start shooting and may have lost its settings."""


def take_picture(job: CaptureJob, longest_s: float, previous: str) -> CameraPicture:
    """Take a photo and wait until it is on the camera's storage.

    After a connection loss, the camera's state and files show whether the photo was taken. A photo
    is requested again only if it was not taken.

    Args:
        longest_s: Time allowed for the photo, in seconds, in addition to `FRAME_S`.

    Raises:
        Unreachable: If the camera never receives the command.
        SettingsLost: If the camera did not receive the command and its settings must be restored
            first.
        CaptureFailed: If the photo takes too long, or the camera was stopped.
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
    """Record the request for a photo so that the photo can be found if the program ends here."""
    clock_text = camera_settings.read(job.contact, (_CLOCK,)).get(_CLOCK)
    start_time = clock_text if isinstance(clock_text, str) and camera_time(clock_text) else ""
    job.session.update(shot_start=ShotStart(previous, start_time))


def unheard() -> Unreachable:
    """Return the error for a command that the camera never received."""
    return Unreachable(
        tr("The connection breaks every time the camera starts to shoot."),
        tr("Move closer to the camera, then try again."),
        "weak",
    )


def _take(job: CaptureJob, longest_s: float, previous: str) -> CameraPicture:
    began, idle = job.clock.now(), 0
    command = job.contact.once(job.client.take_picture, NOT_NOW)
    while command.state != "done":
        elapsed_s = job.clock.now() - began - longest_s
        if elapsed_s > FRAME_S:
            # Slow replies may have used up the time in which the loop would have found the photo.
            entries = find_frames(job.contact, 1, previous=previous)
            if entries:
                return CameraPicture(entries[0].url, has_name=False)
            raise CaptureFailed(
                tr("The camera did not finish the photo."),
                tr("Restart the camera, then try again."),
                "deadline",
            )
        job.contact.pause(job.profile.poll_s)
        command = ask_how_far(job, command)
        if elapsed_s > _OVERDUE_S and command.state != "done":
            # Some cameras never report the end, but their state and files show it.
            idle = idle + 1 if job.contact.ask(job.client.state).idle else 0
            entries = find_frames(job.contact, 1, previous=previous) if idle >= 2 else ()
            if entries:
                return CameraPicture(entries[0].url, has_name=False)
    urls = command.file_urls
    if urls:
        return CameraPicture(urls[0], has_name=True)
    # The file list has usable URLs even if the reply does not.
    for _ in range(_LOOKS if command.refused_urls else 1):
        entries = find_frames(job.contact, 1, previous=previous)
        if entries:
            return CameraPicture(entries[0].url, has_name=False)
        job.contact.pause(1.0)
    raise CaptureFailed(
        tr("The camera was stopped before it took the photo."), tr("Start again."), "stopped"
    )


def ask_how_far(job: CaptureJob, command: CommandReply) -> CommandReply:
    """Request the status of a command once, using the id from its first reply.

    Raises:
        Unreachable: If the camera sent no id, or no longer knows the command.
        CaptureFailed: If the shot was cancelled at the camera.
    """
    number = command.id
    if number is None:
        raise Unreachable(tr("The camera did not identify the shot."))
    try:
        # Ricoh's own examples of status replies have no id.
        return replace(job.contact.ask(lambda: job.client.status(number), NOT_NOW), id=number)
    except CameraRefused as error:
        if error.code == "canceledShooting":
            raise CaptureFailed(
                tr("The exposure was stopped at the camera."), tr("Start again."), "stopped"
            ) from error
        if error.code in _GONE_CODES:
            raise Unreachable(tr("The camera no longer knows the shot.")) from error
        raise


def shoot_singly(job: CaptureJob, shots: Sequence[PlannedShot]) -> tuple[str, ...]:
    """Shoot the frames of a bracket one by one in the manual program.

    All frames use the stitching seam and the level of the first frame, if the camera supports this.
    The self-timer runs only before the first frame.

    Raises:
        DeviceError: If a photo fails.
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
    """Set the self-timer, and warn if the camera refuses it and shoots immediately."""
    if camera_settings.change_if_known(job.contact, {"exposureDelay": job.delay_s}):
        job.delay_s = 0
        job.board.say(tr("The camera has no self-timer; shooting now"))
        job.warn(tr("The camera did not accept the self-timer and shot immediately."))


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
    """Find a photo that was taken although the reply was lost, or return None if there is none.

    The photo counts as named by the camera if it is the only new photo and the camera's state names
    it as the newest, or if the state names no photo and this one was taken in time.
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
                "The camera does not accept {seconds:.4g} s at ISO {iso:g}.",
                seconds=exposure.shutter_s,
                iso=exposure.iso,
            ),
            tr(
                "Set the camera to photos in manual mode and try again, or shoot a bracket by "
                "hand and merge the files."
            ),
            "no-manual",
        )


def _keep_seams(job: CaptureJob, *, first: bool) -> None:
    """Use the same stitching seam and level for all frames so that they align."""
    seam_mode = "Save" if first else "Load"
    camera_settings.change_if_known(job.contact, {"_imageStitching": f"dynamic{seam_mode}"})
    camera_settings.change_if_known(job.contact, {"_topBottomCorrection": f"Apply{seam_mode}"})
