"""The bracket, shot by the camera's own bracketing if possible, otherwise photo by photo."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final

from app.core.base.errors import CoreError
from app.core.measure.plan.planner import Plan, PlannedShot
from app.core.text import tr
from app.devices.capture import camera_settings
from app.devices.capture.capture_job import CaptureJob
from app.devices.capture.exposures.single_pictures import (
    FRAME_S,
    STARTS,
    as_sent,
    ask_how_far,
    set_timer,
    shoot_singly,
    unheard,
)
from app.devices.capture.reconnection import NOT_NOW, Contact, find_frames, newest_address
from app.devices.capture.status import Stage
from app.devices.errors import LOSSES, CameraRefused, CaptureFailed, DeviceError
from app.devices.protocol_profiles import KELVIN, ModelProfile
from app.devices.theta.messages import CommandReply, FileEntry

_WATCH_S: Final = 3.0
_UNSEEN_S: Final = 10.0
_GATHERINGS: Final = 6
_GATHER_S: Final = 2.0
_STOP_S: Final = 30.0
_ENOUGH: Final = 3
_MOST_ENTRIES: Final = 8
_TELLING: Final = 0.2  # fraction of a bracket after which its pace is known
_SLOW: Final = 1.25
_REFUSALS: Final = frozenset(
    {
        "invalidParameterName",
        "invalidParameterValue",
        "missingParameter",
        "disabledCommand",
        "unknownCommand",
    }
)


class _NoBracket(Exception):
    """Raised when the camera refuses to shoot a bracket itself."""


class _NotHeard(Exception):
    """Raised when the camera did not start shooting."""


@dataclass(frozen=True, slots=True)
class Run:
    """A bracket in progress, with its start time and its deadline on the clock."""

    began: float
    until: float


def deadline_s(plan: Plan, delay_s: float = 0.0) -> float:
    """Return the time, in seconds, after which a bracket counts as failed."""
    return sum(shot.exposure.shutter_s * 2 + FRAME_S for shot in plan.shots) + delay_s


def expose(job: CaptureJob) -> None:
    """Shoot the planned bracket and locate its files on the camera.

    Raises:
        DeviceError: If the camera fails. Its photos stay on the camera and are recorded in the
            journal.
        Cancelled: If the token is cancelled.
    """
    plan = job.plan
    job.board.show(Stage.EXPOSING, tr("Starting the bracket"), shots=len(plan.shots))
    _note_start(job)
    job.exposing = True
    urls = _shoot(job, plan)
    job.exposing = False
    job.board.show(
        Stage.EXPOSING, tr("All exposures made"), 1.0, shot=len(plan.shots), may_move=True
    )
    gather(job, urls)


def gather(job: CaptureJob, urls: tuple[str, ...] = (), *, least: int | None = None) -> None:
    """Find the files of the bracket and record them in the journal.

    Args:
        least: Minimum number of files, or None for three.

    Raises:
        CaptureFailed: If fewer files are found.
    """
    count = len(job.plan.shots)
    journal = job.session.journal
    entries: tuple[FileEntry, ...] = ()
    for number in range(_GATHERINGS):
        if number:
            job.contact.pause(_GATHER_S)
        entries = find_frames(
            job.contact,
            count,
            urls=urls,
            group_id=journal.group_id,
            previous=journal.previous_latest,
        )
        if len(entries) >= count:
            break
    group = next((entry.group_id for entry in entries if entry.group_id), "") or ""
    enough = len(entries) >= min(count, _ENOUGH if least is None else least)
    # After an interruption, the photographer's own photos may be among them.
    if enough or least is None:
        job.session.set_frames(entries)
    if not enough:
        raise CaptureFailed(
            tr("The camera took {number} of {count} exposures.", number=len(entries), count=count),
            tr(
                "These photos are still on the camera. Check the camera for an error, then "
                "shoot again."
            ),
            "incomplete",
        )
    job.session.update(exposed=True, group_id=group, singles=(), shot_start=None)
    if len(entries) < count:
        job.warn(
            tr(
                "The camera took only {number} of {count} exposures; these are used.",
                number=len(entries),
                count=count,
            )
        )


def stop(job: CaptureJob) -> None:
    """Stop the camera after the user cancels, ignoring its errors."""
    contact = job.contact.unstoppable(10.0)
    try:
        _stop_shooting(job, contact)
        journal = job.session.journal
        entries = find_frames(contact, len(job.plan.shots), previous=journal.previous_latest)
        job.session.set_frames(entries)
    except (DeviceError, CoreError):
        return


def _stop_shooting(job: CaptureJob, contact: Contact) -> None:
    """Stop the shot if possible. Otherwise, as with a single photo, wait for it to end."""
    status = contact.ask(job.client.state).capture_status
    with suppress(DeviceError):
        if status == "self-timer countdown":
            contact.once(job.client.stop_self_timer)
        elif status not in ("", "idle"):
            contact.once(job.client.stop_capture)
    longest = max(shot.exposure.shutter_s for shot in job.plan.shots)
    until = job.clock.now() + max(longest * 2 + FRAME_S, _STOP_S)
    while status not in ("", "idle") and job.clock.now() < until:
        job.board.say(tr("Waiting until the camera has finished its exposure"))
        contact.pause(1.0)
        status = contact.ask(job.client.state).capture_status


def watch(job: CaptureJob, run: Run) -> None:
    """Poll only the state until the camera has finished shooting and is idle again.

    The camera must report twice in a row that it is idle, because an SC2 reports it once between
    two frames.

    Raises:
        CaptureFailed: If shooting takes too long.
    """
    began, idle, any_progress = job.clock.now(), 0, False
    while True:
        if job.contact.ask(job.client.state).idle:
            idle += 1
        else:
            # Skip this if the camera is idle, since the time may have passed without a connection.
            _check_deadline(job, run.until)
            idle, any_progress = 0, True
        if idle >= 2 and (any_progress or job.clock.now() - began > _UNSEEN_S):
            return
        _tell(job, None, run)
        job.contact.pause(_WATCH_S)


def watch_if_busy(job: CaptureJob, run: Run) -> None:
    """Wait for a busy camera to become idle."""
    if not job.contact.ask(job.client.state).idle:
        watch(job, run)


def bracket_options(profile: ModelProfile, plan: Plan, *, white: bool = True) -> dict[str, Any]:
    """Return the options that prepare a camera to shoot a bracket."""
    keys = [key for key in profile.shot_keys if white or key != "whiteBalance"]
    shots = [{key: _value(key, shot) for key in keys} for shot in plan.shots]
    bracket = {"_bracketNumber": len(shots), "_bracketParameters": shots}
    method = {"_shootingMethod": "bracket"} if profile.needs_method else {}
    return {**method, "_autoBracket": bracket}


def _value(key: str, shot: PlannedShot) -> Any:
    exposure = shot.exposure
    values: dict[str, Any] = {
        "exposureProgram": 1,
        "shutterSpeed": as_sent(exposure.shutter_s),
        "iso": as_sent(exposure.iso),
        "aperture": as_sent(exposure.aperture),
        "whiteBalance": "_colorTemperature",
        "_colorTemperature": KELVIN,
    }
    return values[key]


def _note_start(job: CaptureJob) -> None:
    """Record the camera's newest file so that later files can be recognised as Turnlight's own."""
    entries = job.contact.ask(lambda: job.client.list_files(_MOST_ENTRIES))
    state = job.contact.ask(job.client.state)
    job.session.update(
        stage=Stage.EXPOSING.value,
        previous_latest=newest_address(entries, state.latest_file_url),
        group_id="",
        command_id=None,
        exposed=False,
        frames=(),
        singles=(),
        shot_start=None,
    )


def _shoot(job: CaptureJob, plan: Plan) -> tuple[str, ...]:
    if job.profile.brackets_itself:
        try:
            return _by_itself(job, plan)
        except _NoBracket:
            job.board.say(tr("The camera refused the bracket; taking single photos"))
    if job.profile.needs_method:
        camera_settings.change_if_known(job.contact, {"_shootingMethod": "normal"})
    return shoot_singly(job, plan.shots)


def _by_itself(job: CaptureJob, plan: Plan) -> tuple[str, ...]:
    """Let the camera shoot the bracket, and return any file URLs that the camera reports."""
    losses = job.contact.losses
    for _ in range(STARTS):
        if job.contact.losses != losses:
            losses = job.contact.losses
            camera_settings.prepare(job.contact, job.profile)
        _arm(job, plan)
        if job.contact.losses != losses:
            continue
        camera_settings.settle(job.contact, job.profile)
        run = Run(job.clock.now(), job.clock.now() + deadline_s(plan, job.delay_s))
        with suppress(*LOSSES):
            command = _start(job)
            job.session.update(command_id=command.id)
            return _follow(job, command, run)
        job.contact.reconnect()
        with suppress(_NotHeard):
            return _after_silence(job, run)
    raise unheard()


def _arm(job: CaptureJob, plan: Plan) -> None:
    if job.delay_s:
        set_timer(job)
    for white in (True, False):
        try:
            camera_settings.change(job.contact, bracket_options(job.profile, plan, white=white))
        except CameraRefused as error:
            if error.code not in _REFUSALS:
                raise
            # White balance is optional only for the X.
            if not (white and job.profile.needs_method):
                raise _NoBracket from error
        else:
            return


def _start(job: CaptureJob) -> CommandReply:
    mode = "bracket" if job.profile.sends_mode else None
    try:
        return job.contact.once(lambda: job.client.start_capture(mode), NOT_NOW)
    except CameraRefused as error:
        if error.code in _REFUSALS:
            raise _NoBracket from error
        raise


def _follow(job: CaptureJob, command: CommandReply, run: Run) -> tuple[str, ...]:
    """Wait until the bracket is done, and return any URLs of its files that the camera reports."""
    if job.profile.bracket == "watched" and command.state != "done":
        watch(job, run)
        return ()
    idle = 0
    while command.state != "done":
        _tell(job, command.completion, run)
        job.contact.pause(job.profile.poll_s)
        command = ask_how_far(job, command)
        if command.state != "done" and _overdue(job, run):
            # Some cameras never report the end, but their state shows it.
            idle = idle + 1 if job.contact.ask(job.client.state).idle else 0
            if idle >= 2 and len(_new_files(job)) >= len(job.plan.shots):
                return ()
            if idle != 1:
                _check_deadline(job, run.until)
    urls = command.file_urls
    if not urls and not command.refused_urls and len(_new_files(job)) < len(job.plan.shots):
        raise CaptureFailed(
            tr("The bracket was stopped at the camera."),
            tr("Its photos are still on the camera. Shoot again."),
            "stopped",
        )
    return urls


def _after_silence(job: CaptureJob, run: Run) -> tuple[str, ...]:
    """Wait for a bracket whose start was not confirmed.

    Raises:
        _NotHeard: If the camera did not shoot the bracket.
    """
    watch(job, run)
    if not _new_files(job):
        raise _NotHeard
    return ()


def _new_files(job: CaptureJob) -> tuple[FileEntry, ...]:
    """Return the files on the camera that were written after the bracket started."""
    previous = job.session.journal.previous_latest
    return find_frames(job.contact, len(job.plan.shots), previous=previous)


def _overdue(job: CaptureJob, run: Run) -> bool:
    now = job.clock.now()
    return now > run.until or now - run.began > 1.5 * (job.plan.expected_s + job.delay_s)


def _check_deadline(job: CaptureJob, until: float) -> None:
    if job.clock.now() > until:
        raise CaptureFailed(
            tr("The camera did not finish the bracket."),
            tr("Restart the camera, then shoot again. Its photos are still on the camera."),
            "deadline",
        )


def _tell(job: CaptureJob, completion: float | None, run: Run) -> None:
    """Show the current exposure, judged by the camera's progress or, failing that, by the clock."""
    plan = job.plan
    elapsed_s = job.clock.now() - run.began - job.delay_s
    total = max(plan.expected_s, 0.1)
    share = max(completion or 0.0, min(elapsed_s / total, 0.99))
    shots = len(plan.shots)
    # The reported progress reveals a camera that is slower than planned.
    if completion is not None and completion >= _TELLING:
        slower = elapsed_s / min(completion, 1.0)
        total = slower if slower > _SLOW * total else total
    remaining_s = total - max(elapsed_s, 0.0) if elapsed_s < total else None
    shot = min(int(share * shots) + 1, shots)
    words = (
        tr("Exposure {shot} of {shots}", shot=shot, shots=shots)
        if elapsed_s >= 0.0
        else tr("Self-timer")
    )
    values = {
        "shot": shot,
        "shots": shots,
        "seconds_left": remaining_s,
        "timer_s": max(-elapsed_s, 0.0),
    }
    job.board.show(Stage.EXPOSING, words, share, **values)
