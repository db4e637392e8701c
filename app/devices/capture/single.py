"""Pictures one by one: for metering, and for cameras without a bracket of their own.

The value that a camera meters cannot be asked for (in its automatic program it answers 0), so one
picture is taken in it and its EXIF is read. Its lenses may have been set differently then; their
mean is what counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

from app.core.base.atomic_files import file_opener
from app.core.base.errors import ProbeError
from app.core.measure.bracket.exposures import metered_exposure
from app.core.measure.plan.planner import CameraLimits, Plan, PlannedShot, plan
from app.core.measure.read.frame import Exposure
from app.core.measure.read.metadata import read_header
from app.core.places.journal import EXPOSURE_LIMITS, SessionFrame, ShotStart
from app.core.text import tr
from app.devices.capture import preparation
from app.devices.capture.connection_loss import NOT_NOW, Contact, find_frames, newest_address
from app.devices.capture.preparation import CaptureJob
from app.devices.capture.session import Session, camera_time
from app.devices.capture.status import Stage
from app.devices.errors import (
    LOSSES,
    BadReply,
    CameraRefused,
    CaptureFailed,
    DeviceError,
    Unreachable,
    not_written,
)
from app.devices.theta import untrusted
from app.devices.theta.client import CommandReply, FileEntry

HEAD_BYTES: Final = 128 << 10
"""Start of a file in which all headers are; public Theta files have theirs in 68 KB."""

_AUTOMATIC: Final = 2
_ROUNDS: Final = 4
_LONGEST_S: Final = 15.0
_FILE: Final = ".metering.jpg"
_MOST_VALUES: Final = 400
_MOST_ENTRIES: Final = 8
_MOST_LISTED: Final = 100
_SUPPORT: Final = {
    "shutterSpeedSupport": "shutter_s",
    "isoSupport": "iso",
    "apertureSupport": "aperture",
}

FRAME_S: Final = 15.0
"""Time that any camera needs for a picture besides its exposure, at most, in seconds."""

STARTS: Final = 4
"""How often a camera is asked to shoot that has not heard it."""

_MANUAL: Final = 1
_LOOKS: Final = 5
_LATE_FILE_S: Final = 6.0
_OVERDUE_S: Final = 9.0
_CLOCK: Final = "dateTimeZone"
_CLOCK_S: Final = 2.0
_CLAIM_S: Final = 60.0
_GONE_CODES: Final = frozenset(
    {"invalidParameterValue", "invalidParameterName", "notFound", "unknownCommand"}
)


def make_plan(job: CaptureJob) -> None:
    """Set the camera up, meter, and plan the bracket.

    All of it is done again when the camera has forgotten its settings in between.

    Raises `DeviceError` when the camera does not allow it, or forgets again and again.
    """
    for _ in range(_ROUNDS):
        losses = job.contact.losses
        with suppress(SettingsLost):
            plan = _metered_plan(job)
            if job.contact.losses == losses:
                job.session.update(plan=plan)
                for note in plan.notes:
                    job.warn(note)
                return
        job.board.say(tr("The camera has forgotten its settings; setting it up again"))
    raise Unreachable(
        tr("The connection to the camera is lost again and again."),
        tr("Go nearer to it, then try again."),
        "weak",
    )


def _metered_plan(job: CaptureJob) -> Plan:
    job.board.show(Stage.METERING, tr("Setting the camera up"))
    job.profile = preparation.save(job.contact, job.session, job.profile)
    preparation.prepare(job.contact, job.profile)
    job.board.show(Stage.METERING, tr("Metering"), 0.3)
    auto_exposure = meter(job)
    job.board.show(Stage.METERING, tr("Planning the bracket"), 0.9)
    limits = read_limits(job)
    job.session.update(metered=auto_exposure)
    try:
        return plan(
            auto_exposure, limits, job.kind, _most_shots(job), overhead_s=job.profile.overhead_s
        )
    except ProbeError as error:
        raise CaptureFailed(error.message, error.hint, "no-plan") from error


def meter(job: CaptureJob) -> Exposure:
    """Take a picture in the automatic program and read its exposure.

    The picture is deleted on the camera afterwards, if the camera itself named it as its newest and
    it was not there before.

    Raises `DeviceError` when no picture comes, or it does not state its exposure.
    """
    delete_pictures(job.contact, job.session)
    preparation.change(job.contact, {"exposureProgram": _AUTOMATIC})
    if "exposureCompensation" in job.profile.saved:
        preparation.change_if_known(job.contact, {"exposureCompensation": 0})
    preparation.settle(job.contact, job.profile)
    entries = job.contact.ask(lambda: job.client.list_files(_MOST_ENTRIES))
    latest = job.contact.ask(job.client.state).latest_file_url
    picture = take_picture(job, _LONGEST_S, newest_address(entries, latest))
    new = picture.url != latest and picture.url not in {entry.url for entry in entries}
    ours = _find_listed(job.contact, picture.url) if picture.has_name and new else None
    job.session.update(picture_to_delete=ours, shot_start=None)
    exposure = job.contact.ask(lambda: _exposure_of(job, picture.url))
    with suppress(DeviceError):
        # The first panorama there is to look at; a capture does without it.
        small = job.client.thumbnail(picture.url)
        job.board.show(Stage.METERING, tr("Metering"), 0.6, metered=small)
    delete_pictures(job.contact, job.session)
    return exposure


def delete_pictures(contact: Contact, session: Session) -> None:
    """Delete the pictures that this program took and does not need.

    These are the picture for metering, and the pictures of an interrupted bracket once another one
    is complete; also where the program ended before it could note their addresses. Where the camera
    does not do it, the journal keeps them for the next time.
    """
    with suppress(DeviceError):
        if session.journal.stage == Stage.METERING.value:
            _claim_shot(contact, session)
        debt = session.journal.picture_to_delete
        if debt is not None:
            _delete(contact, debt)
            session.update(picture_to_delete=None)
        while session.journal.exposed and session.journal.surplus:
            first, *others = session.journal.surplus
            _delete(contact, first)
            session.update(surplus=tuple(others))


def set_aside(contact: Contact, session: Session, frames: Sequence[SessionFrame]) -> None:
    """Note the pictures of an interrupted bracket as surplus: it is shot again.

    `frames`: what the camera had taken when the bracket was stopped.
    """
    _claim_shot(contact, session)
    journal = session.journal
    late = () if journal.picture_to_delete is None else (journal.picture_to_delete,)
    pictures = {frame.url: frame for frame in (*journal.surplus, *frames, *journal.singles, *late)}
    session.update(surplus=tuple(pictures.values()), singles=(), picture_to_delete=None)


def _claim_shot(contact: Contact, session: Session) -> None:
    """Find the picture that was asked for before the program ended, and note it.

    It must be the only new one, the camera's newest, and taken within a minute by the camera's own
    clock: pictures of the photographer are never claimed.
    """
    start = session.journal.shot_start
    if start is None:
        return
    newer = find_frames(contact, 2, previous=start.previous)
    latest = contact.ask(contact.client.state).latest_file_url
    alone = len(newer) == 1 and latest in ("", newer[0].url)
    ours = _noted(newer[0]) if alone and _in_time(start, newer[0]) else None
    session.update(shot_start=None, picture_to_delete=ours or session.journal.picture_to_delete)


def _in_time(start: ShotStart, entry: FileEntry) -> bool:
    """Whether a picture was taken when it was asked for, by the camera's own clock."""
    began, shot_time = camera_time(start.camera_time), camera_time(entry.date_time)
    if began is None or shot_time is None:
        return False
    return -_CLOCK_S <= (shot_time - began).total_seconds() <= _CLAIM_S


def _delete(contact: Contact, debt: SessionFrame) -> None:
    """Delete a picture if it is still that picture: cameras use their names again.

    Only a file of the same date and length is deleted. Raises `DeviceError` when the camera does
    not do it.
    """
    url = contact.client.link.endpoint.rewrite(debt.url)
    there = _find_listed(contact, url)
    if there is None or (there.taken, there.size) != (debt.taken, debt.size):
        return
    try:
        contact.ask(lambda: contact.client.delete([url]), NOT_NOW)
    except CameraRefused:
        # It may have been deleted by a command whose answer was lost.
        if _find_listed(contact, url) is not None:
            raise


def _find_listed(contact: Contact, url: str) -> SessionFrame | None:
    """Look a file up in the camera's list, among the newest first."""
    for count in (_MOST_ENTRIES, _MOST_LISTED):
        entries = contact.ask(partial(contact.client.list_files, count))
        for entry in entries:
            if entry.url == url:
                return _noted(entry)
        if len(entries) < count:
            break
    return None


def _noted(entry: FileEntry) -> SessionFrame:
    return SessionFrame(entry.name, entry.url, max(entry.size, 0), entry.date_time)


def read_limits(job: CaptureJob) -> CameraLimits:
    """Ask what the manual program accepts; the lists follow the program that is set.

    Returns the camera's own where it states them, else those known of the model.
    """
    preparation.change(job.contact, {"exposureProgram": _MANUAL})
    values = preparation.read(job.contact, tuple(_SUPPORT))
    limits = job.profile.fallback
    times, isos, apertures = (
        _values(values.get(name), *EXPOSURE_LIMITS[kind]) for name, kind in _SUPPORT.items()
    )
    return CameraLimits(
        times or limits.shutters_s, isos or limits.isos, apertures or limits.apertures
    )


def _most_shots(job: CaptureJob) -> int:
    """Frames of the longest bracket: what the profile knows, less if the camera says so."""
    most = job.profile.max_shots
    if not job.profile.brackets_itself:
        return most
    support = preparation.read(job.contact, ("_bracketNumberSupport",)).get("_bracketNumberSupport")
    number = support.get("maxNumber") if isinstance(support, dict) else None
    if isinstance(number, bool) or not isinstance(number, int):
        return most
    return max(2, min(most, number))


def _values(support: Any, least: float, largest: float) -> tuple[float, ...]:
    """Return the numbers of a list that can be exposures; 0 stands for automatic."""
    if not isinstance(support, list) or len(support) > _MOST_VALUES:
        return ()
    numbers = {untrusted.number(value) for value in support}
    return tuple(sorted(each for each in numbers if each is not None and least <= each <= largest))


def _exposure_of(job: CaptureJob, url: str) -> Exposure:
    """Read the exposure of a file from its first bytes."""
    data = _start_of(job, url)
    path = job.session.folder / _FILE
    try:
        with open(path, "wb", opener=file_opener) as stream:
            stream.write(data)
        exposure = metered_exposure(read_header(path))
    except ProbeError as error:
        # It may have been cut off on the way: asked for again.
        raise BadReply(
            tr("The picture for metering could not be read."), tr("Start again.")
        ) from error
    except OSError as error:
        raise not_written(CaptureFailed, path.parent, error) from error
    finally:
        with suppress(OSError):
            path.unlink()
    ranges = EXPOSURE_LIMITS.items()
    plausible = all(least <= getattr(exposure, name, 0.0) <= most for name, (least, most) in ranges)
    if exposure is None or not exposure.known or not plausible:
        raise CaptureFailed(
            tr("The camera does not state the exposure it metered."),
            tr("Take a bracket by hand and merge its files."),
            "metering",
        )
    return exposure


def _start_of(job: CaptureJob, url: str) -> bytes:
    data = b""
    with job.client.open_file(url) as incoming:
        for chunk in incoming.chunks():
            job.token.check()
            data += chunk
            if len(data) >= HEAD_BYTES:
                break
    return data[:HEAD_BYTES]


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
    clock_text = preparation.read(job.contact, (_CLOCK,)).get(_CLOCK)
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
            preparation.change_if_known(job.contact, {"exposureDelay": 0})
        if number + 1 < len(shots):
            job.contact.pause(job.profile.rest_s)
    return tuple(urls)


def set_timer(job: CaptureJob) -> None:
    """Set the self-timer; a camera that does not want it shoots at once, and that is said."""
    if preparation.change_if_known(job.contact, {"exposureDelay": job.delay_s}):
        job.delay_s = 0
        job.board.say(tr("The camera does not accept the self-timer; it shoots at once"))
        job.warn(tr("The camera did not accept the self-timer: the pictures were taken at once."))


def _one(job: CaptureJob, shot: PlannedShot, number: int, earlier: tuple[str, ...]) -> str:
    previous = earlier[-1] if earlier else job.session.journal.previous_latest
    for attempt in range(STARTS):
        if attempt:
            preparation.prepare(job.contact, job.profile)
        losses = job.contact.losses
        _set_exposure(job, shot)
        if job.profile.stitching:
            _keep_seams(job, first=number == 0)
        if number == 0 and job.delay_s:
            set_timer(job)
        delay = job.delay_s if number == 0 else 0
        if job.contact.losses != losses:
            continue
        preparation.settle(job.contact, job.profile)
        if delay:
            values = {"shot": 1, "shots": len(job.plan.shots), "timer_s": float(delay)}
            job.board.show(Stage.EXPOSING, tr("Self-timer"), **values)
        with suppress(SettingsLost):
            url = take_picture(job, shot.exposure.shutter_s * 2 + delay, previous).url
            _note_single(job, url)
            return url
    raise unheard()


def _note_single(job: CaptureJob, url: str) -> None:
    picture = _find_listed(job.contact, url)
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
            is_latest |= not latest and start is not None and _in_time(start, first)
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
    refusals = preparation.change_if_known(job.contact, options)
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
    preparation.change_if_known(job.contact, {"_imageStitching": f"dynamic{seam_mode}"})
    preparation.change_if_known(job.contact, {"_topBottomCorrection": f"Apply{seam_mode}"})
