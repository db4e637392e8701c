"""Metering: one photo in the automatic program, and the bracket planned from its exposure.

A camera does not report its metered exposure (in the automatic program the value is 0), so one
photo is taken and its EXIF is read. The two lenses may differ in exposure, so their mean is used.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any, Final

from app.core.base.atomic_files import file_opener
from app.core.base.errors import ProbeError
from app.core.camera_catalogue import CameraLimits
from app.core.measure.bracket.exposures import metered_exposure
from app.core.measure.plan.planner import Plan, plan
from app.core.measure.read.frame import Exposure
from app.core.measure.read.metadata import read_header
from app.core.places.journal import EXPOSURE_LIMITS
from app.core.text import tr
from app.devices.capture import camera_settings
from app.devices.capture.capture_job import CaptureJob
from app.devices.capture.exposures.single_pictures import SettingsLost, take_picture
from app.devices.capture.exposures.surplus_pictures import delete_pictures, find_listed
from app.devices.capture.reconnection import newest_address
from app.devices.capture.status import Stage
from app.devices.errors import (
    BadReply,
    CaptureFailed,
    DeviceError,
    Unreachable,
    not_written,
)
from app.devices.theta import untrusted

HEAD_BYTES: Final = 128 << 10
"""Number of bytes at the start of a file that contain all its headers. Theta files need 68 kB."""

_AUTOMATIC: Final = 2
_ROUNDS: Final = 4
_LONGEST_S: Final = 15.0
_FILE: Final = ".metering.jpg"
_MOST_VALUES: Final = 400
_MOST_ENTRIES: Final = 8
_SUPPORT: Final = {
    "shutterSpeedSupport": "shutter_s",
    "isoSupport": "iso",
    "apertureSupport": "aperture",
}
_MANUAL: Final = 1


def make_plan(job: CaptureJob) -> None:
    """Set up the camera, meter and plan the bracket, starting over if the settings are lost.

    Raises:
        DeviceError: If the camera refuses, or loses its settings every time.
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
        job.board.say(tr("The camera lost its settings; setting it up again"))
    raise Unreachable(
        tr("The connection to the camera keeps breaking."),
        tr("Move closer to the camera, then try again."),
        "weak",
    )


def _metered_plan(job: CaptureJob) -> Plan:
    job.board.show(Stage.METERING, tr("Setting up the camera"))
    job.profile = camera_settings.save(job.contact, job.session, job.profile)
    camera_settings.prepare(job.contact, job.profile)
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
    """Take a photo in the automatic program and return its exposure.

    The photo is deleted afterwards if it was not there before and the camera itself reported it as
    the newest.

    Raises:
        DeviceError: If there is no photo, or the photo does not record its exposure.
    """
    delete_pictures(job.contact, job.session)
    camera_settings.change(job.contact, {"exposureProgram": _AUTOMATIC})
    if "exposureCompensation" in job.profile.saved:
        camera_settings.change_if_known(job.contact, {"exposureCompensation": 0})
    camera_settings.settle(job.contact, job.profile)
    entries = job.contact.ask(lambda: job.client.list_files(_MOST_ENTRIES))
    latest = job.contact.ask(job.client.state).latest_file_url
    picture = take_picture(job, _LONGEST_S, newest_address(entries, latest))
    new = picture.url != latest and picture.url not in {entry.url for entry in entries}
    ours = find_listed(job.contact, picture.url) if picture.has_name and new else None
    job.session.update(picture_to_delete=ours, shot_start=None)
    exposure = job.contact.ask(lambda: _exposure_of(job, picture.url))
    with suppress(DeviceError):
        # Optional: the first panorama to show.
        small = job.client.thumbnail(picture.url)
        job.board.show(Stage.METERING, tr("Metering"), 0.6, metered=small)
    delete_pictures(job.contact, job.session)
    return exposure


def read_limits(job: CaptureJob) -> CameraLimits:
    """Return the limits of the manual program, which must be active while the lists are read.

    Any lists that the camera does not report are taken from its profile.
    """
    camera_settings.change(job.contact, {"exposureProgram": _MANUAL})
    values = camera_settings.read(job.contact, tuple(_SUPPORT))
    limits = job.profile.fallback
    times, isos, apertures = (
        _values(values.get(name), *EXPOSURE_LIMITS[kind]) for name, kind in _SUPPORT.items()
    )
    return CameraLimits(
        times or limits.shutters_s, isos or limits.isos, apertures or limits.apertures
    )


def _most_shots(job: CaptureJob) -> int:
    """Return the maximum number of frames in a bracket, from the profile or the camera."""
    most = job.profile.max_shots
    if not job.profile.brackets_itself:
        return most
    support = camera_settings.read(job.contact, ("_bracketNumberSupport",)).get(
        "_bracketNumberSupport"
    )
    number = support.get("maxNumber") if isinstance(support, dict) else None
    if isinstance(number, bool) or not isinstance(number, int):
        return most
    return max(2, min(most, number))


def _values(support: Any, least: float, largest: float) -> tuple[float, ...]:
    """Return the numbers in a list that are within the limits, sorted and without 0 (automatic)."""
    if not isinstance(support, list) or len(support) > _MOST_VALUES:
        return ()
    numbers = {untrusted.number(value) for value in support}
    return tuple(sorted(each for each in numbers if each is not None and least <= each <= largest))


def _exposure_of(job: CaptureJob, url: str) -> Exposure:
    """Return the exposure recorded at the start of a file, without downloading the rest."""
    data = _start_of(job, url)
    path = job.session.folder / _FILE
    try:
        with open(path, "wb", opener=file_opener) as stream:
            stream.write(data)
        exposure = metered_exposure(read_header(path))
    except ProbeError as error:
        # The reply may have been cut off; `Contact.ask` repeats the request.
        raise BadReply(tr("The metering photo could not be read."), tr("Start again.")) from error
    except OSError as error:
        raise not_written(CaptureFailed, path.parent, error) from error
    finally:
        with suppress(OSError):
            path.unlink()
    ranges = EXPOSURE_LIMITS.items()
    plausible = all(least <= getattr(exposure, name, 0.0) <= most for name, (least, most) in ranges)
    if exposure is None or not exposure.known or not plausible:
        raise CaptureFailed(
            tr("The camera did not report the exposure it metered."),
            tr("Shoot a bracket by hand and merge the files."),
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
