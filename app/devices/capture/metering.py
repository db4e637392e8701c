"""How bright the place is, by a picture that the camera meters itself, and the bracket around it.

The value that a camera meters cannot be asked for (in its automatic program it answers 0), so one
picture is taken in it and its EXIF is read. Its lenses may have been set differently then; their
mean is what counts.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any, Final

from app.core.errors import ProbeError
from app.core.probe.exposures import metered_exposure
from app.core.probe.metadata import read_header
from app.core.probe.planner import CameraLimits, Plan, plan
from app.devices.capture import settings
from app.devices.capture.journal import EXPOSURE_LIMITS
from app.devices.capture.recovery import NOT_NOW, newest_address
from app.devices.capture.single import take_picture
from app.devices.capture.status import Stage
from app.devices.errors import BadReply, CaptureFailed, DeviceError, Unreachable

if TYPE_CHECKING:
    from app.core.probe.frame import Exposure
    from app.devices.capture.job import Job

__all__ = ["make_plan", "meter", "read_limits"]

HEAD_BYTES: Final = 128 << 10
"""Start of a file in which all headers are; public Theta files have theirs in 68 KB."""

_AUTOMATIC: Final = 2
_MANUAL: Final = 1
_ROUNDS: Final = 3
_LONGEST_S: Final = 15.0
_FILE: Final = ".metering.jpg"
_MOST_VALUES: Final = 400
_LISTED: Final = 8
_SUPPORT: Final = {
    "shutterSpeedSupport": "shutter_s",
    "isoSupport": "iso",
    "apertureSupport": "aperture",
}


def make_plan(job: Job) -> None:
    """Set the camera up, meter, and plan the bracket.

    All of it is done again when the connection was lost in between, since a camera may have
    forgotten its settings then.

    Raises
    ------
    DeviceError
        When the camera does not allow it, or the connection is lost again and again.
    """
    for number in range(_ROUNDS):
        losses = job.contact.losses
        with contextlib.suppress(_Lost):
            made = _metered_plan(job)
            if job.contact.losses == losses:
                job.session.update(plan=made)
                for note in made.notes:
                    job.warn(note)
                return
        if number:
            job.board.say("The connection is weak; setting up again")
    raise Unreachable(
        "The connection to the camera is lost again and again.",
        "Go nearer to it, then try again.",
        "weak",
    )


class _Lost(Exception):
    """The link broke at a place where all must be done again."""


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

    The picture is deleted on the camera afterwards, if the camera named it as the one just taken
    and it was not there before.

    Returns
    -------
    Exposure
        Mean of both lenses.

    Raises
    ------
    DeviceError
        When no picture comes, or it does not state its exposure.
    """
    settings.change(job.contact, {"exposureProgram": _AUTOMATIC})
    if "exposureCompensation" in job.profile.saved:
        settings.change_if_known(job.contact, {"exposureCompensation": 0})
    settings.settle(job.contact, job.profile)
    listed = job.contact.ask(lambda: job.client.list_files(_LISTED))
    latest = job.contact.ask(job.client.state).latest_file_url
    try:
        taken = take_picture(job, _LONGEST_S, newest_address(listed, latest))
    except Unreachable:
        job.contact.reconnect()
        raise _Lost from None
    exposure = job.contact.ask(lambda: _exposure_of(job, taken.url))
    if taken.named and taken.url != latest and taken.url not in {entry.url for entry in listed}:
        with contextlib.suppress(DeviceError):  # It stays there; that does no harm.
            job.contact.ask(lambda: job.client.delete([taken.url]), NOT_NOW)
    return exposure


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
        reason = (error.strerror or str(error)).lower()
        raise CaptureFailed(
            f"{path} cannot be written: {reason}.", "Make room on the disk.", "disk"
        ) from error
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
