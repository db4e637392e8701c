"""How bright the place is, by a picture that the camera meters itself, and the bracket around it.

The value that a camera meters cannot be asked for (in its automatic program it answers 0), so one
picture is taken in it and its EXIF is read. Its lenses may have been set differently then; their
mean is what counts.
"""

from __future__ import annotations

import contextlib
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from app.core.base.errors import ProbeError
from app.core.hdr.exposures import metered_exposure
from app.core.hdr.metadata import read_header
from app.core.hdr.planner import CameraLimits, Plan, plan
from app.devices.capture import settings
from app.devices.capture.journal import EXPOSURE_LIMITS, SessionFrame
from app.devices.capture.recovery import NOT_NOW, newest_address
from app.devices.capture.single import Forgotten, take_picture
from app.devices.capture.status import Stage
from app.devices.errors import (
    BadReply,
    CameraRefused,
    CaptureFailed,
    DeviceError,
    Unreachable,
    not_written,
)

if TYPE_CHECKING:
    from app.core.hdr.frame import Exposure
    from app.devices.capture.job import Job
    from app.devices.capture.recovery import Contact
    from app.devices.capture.session import Session

HEAD_BYTES: Final = 128 << 10
"""Start of a file in which all headers are; public Theta files have theirs in 68 KB."""

_AUTOMATIC: Final = 2
_MANUAL: Final = 1
_ROUNDS: Final = 4
_LONGEST_S: Final = 15.0
_FILE: Final = ".metering.jpg"
_MOST_VALUES: Final = 400
_LISTED: Final = 8
_MOST_LISTED: Final = 100
_SUPPORT: Final = {
    "shutterSpeedSupport": "shutter_s",
    "isoSupport": "iso",
    "apertureSupport": "aperture",
}


def make_plan(job: Job) -> None:
    """Set the camera up, meter, and plan the bracket.

    All of it is done again when the camera has forgotten its settings in between.

    Raises
    ------
    DeviceError
        When the camera does not allow it, or forgets again and again.
    """
    for _ in range(_ROUNDS):
        forgotten = job.contact.forgotten
        with contextlib.suppress(Forgotten):
            made = _metered_plan(job)
            if job.contact.forgotten == forgotten:
                job.session.update(plan=made)
                for note in made.notes:
                    job.warn(note)
                return
        job.board.say("The camera has forgotten its settings; setting it up again")
    raise Unreachable(
        "The connection to the camera is lost again and again.",
        "Go nearer to it, then try again.",
        "weak",
    )


def _metered_plan(job: Job) -> Plan:
    job.board.show(Stage.METERING, "Setting the camera up")
    job.profile = settings.save(job.contact, job.session, job.profile)
    settings.prepare(job.contact, job.profile)
    job.board.show(Stage.METERING, "Metering", 0.3)
    metered = meter(job)
    job.board.show(Stage.METERING, "Planning the bracket", 0.9)
    limits = read_limits(job)
    job.session.update(metered=metered)
    try:
        return plan(metered, limits, job.kind, _most_shots(job), overhead_s=job.profile.overhead_s)
    except ProbeError as error:
        raise CaptureFailed(error.message, error.hint, "no-plan") from error


def meter(job: Job) -> Exposure:
    """Take a picture in the automatic program and read its exposure.

    The picture is deleted on the camera afterwards, if the camera itself named it as its newest and
    it was not there before.

    Raises
    ------
    DeviceError
        When no picture comes, or it does not state its exposure.
    """
    delete_picture(job.contact, job.session)
    settings.change(job.contact, {"exposureProgram": _AUTOMATIC})
    if "exposureCompensation" in job.profile.saved:
        settings.change_if_known(job.contact, {"exposureCompensation": 0})
    settings.settle(job.contact, job.profile)
    listed = job.contact.ask(lambda: job.client.list_files(_LISTED))
    latest = job.contact.ask(job.client.state).latest_file_url
    taken = take_picture(job, _LONGEST_S, newest_address(listed, latest))
    if taken.named and taken.url != latest and taken.url not in {entry.url for entry in listed}:
        job.session.update(picture_to_delete=_listed(job.contact, taken.url))
    exposure = job.contact.ask(lambda: _exposure_of(job, taken.url))
    delete_picture(job.contact, job.session)
    return exposure


def delete_picture(contact: Contact, session: Session) -> None:
    """Delete the picture for metering that the journal names, if it is still that picture.

    Cameras use their names again: only a file of the same date and length is deleted. Where the
    camera does not do it, the journal keeps it for the next time.
    """
    owed = session.journal.picture_to_delete
    if owed is None:
        return
    with contextlib.suppress(DeviceError):
        url = contact.client.link.endpoint.rewrite(owed.url)
        there = _listed(contact, url)
        if there is not None and (there.taken, there.size) == (owed.taken, owed.size):
            try:
                contact.ask(lambda: contact.client.delete([url]), NOT_NOW)
            except CameraRefused:
                # It may have been deleted by a command whose answer was lost.
                if _listed(contact, url) is not None:
                    raise
        session.update(picture_to_delete=None)


def _listed(contact: Contact, url: str) -> SessionFrame | None:
    """Look a file up in the camera's list, among the newest first."""
    for count in (_LISTED, _MOST_LISTED):
        listed = contact.ask(partial(contact.client.list_files, count))
        for entry in listed:
            if entry.url == url:
                return SessionFrame(entry.name, url, max(entry.size, 0), entry.taken)
        if len(listed) < count:
            break
    return None


def read_limits(job: Job) -> CameraLimits:
    """Ask what the manual program accepts; the lists follow the program that is set.

    Returns
    -------
    CameraLimits
        The camera's own where it states them, else those known of the model.
    """
    settings.change(job.contact, {"exposureProgram": _MANUAL})
    stated = settings.read(job.contact, tuple(_SUPPORT))
    known = job.profile.fallback
    times, isos, apertures = (
        _values(stated.get(name), *EXPOSURE_LIMITS[kind]) for name, kind in _SUPPORT.items()
    )
    return CameraLimits(times or known.shutters_s, isos or known.isos, apertures or known.apertures)


def _most_shots(job: Job) -> int:
    """Frames of the longest bracket: what the profile knows, less if the camera says so."""
    most = job.profile.max_shots
    if not job.profile.brackets_itself:
        return most
    stated = settings.read(job.contact, ("_bracketNumberSupport",)).get("_bracketNumberSupport")
    number = stated.get("maxNumber") if isinstance(stated, dict) else None
    if isinstance(number, bool) or not isinstance(number, int):
        return most
    return max(2, min(most, number))


def _values(stated: Any, least: float, largest: float) -> tuple[float, ...]:
    """Return the numbers of a list that can be exposures; 0 stands for automatic."""
    if not isinstance(stated, list) or len(stated) > _MOST_VALUES:
        return ()
    numbers = (
        float(value)
        for value in stated
        if isinstance(value, (int, float))
        and not isinstance(value, bool)
        and least <= value <= largest
    )
    return tuple(sorted(set(numbers)))


def _exposure_of(job: Job, url: str) -> Exposure:
    """Read the exposure of a file from its first bytes."""
    data = _start_of(job, url)
    path = job.session.folder / _FILE
    try:
        path.write_bytes(data)
        found = metered_exposure(read_header(path))
    except ProbeError as error:
        # It may have been cut off on the way: asked for again.
        raise BadReply("The picture for metering could not be read.", "Start again.") from error
    except OSError as error:
        raise not_written(CaptureFailed, path.parent, error) from error
    finally:
        with contextlib.suppress(OSError):
            path.unlink()
    if found is None or not found.known or not _plausible(found):
        raise CaptureFailed(
            "The camera does not state the exposure it metered.",
            "Take a bracket by hand and merge its files.",
            "metering",
        )
    return found


def _plausible(exposure: Exposure) -> bool:
    """Whether an exposure that a file states can be one."""
    limits = EXPOSURE_LIMITS.items()
    return all(least <= getattr(exposure, name) <= most for name, (least, most) in limits)


def _start_of(job: Job, url: str) -> bytes:
    parts: list[bytes] = []
    length = 0
    with job.client.open_file(url) as incoming:
        for chunk in incoming.chunks():
            job.token.check()
            parts.append(chunk)
            length += len(chunk)
            if length >= HEAD_BYTES:
                break
    return b"".join(parts)[:HEAD_BYTES]
