"""Checks before the bracket: which camera it is, and whether it is ready to shoot."""

from __future__ import annotations

from typing import Final

from app.core.text import tr
from app.devices.capture.camera_settings import read
from app.devices.capture.capture_job import CaptureJob
from app.devices.capture.status import Stage
from app.devices.errors import CameraNotReady, CameraRefused, CaptureFailed, DeviceError
from app.devices.protocol_profiles import ModelProfile, profile_for
from app.devices.theta.messages import Info, State
from app.devices.theta.untrusted import number

_LOW_BATTERY: Final = 0.1
_HOT_C: Final = 60.0
_PREVIEW_S: Final = 0.5
_IDLE_S: Final = 15.0
_MOST_SHOTS: Final = {"paper": 3, "full": 10}
_HEAT: Final = (
    tr("The camera is too hot to shoot."),
    tr("Switch it off, let it cool down in the shade for a few minutes, then try again."),
)
_BLOCKING: Final = {
    "NO_MEMORY": (
        tr("The camera’s storage is full."),
        tr("Delete photos that you have already copied from the camera, then try again."),
    ),
    "FILE_NUMBER_OVER": (
        tr("The camera has used up its file numbers."),
        tr("Copy its photos, delete them from the camera, then try again."),
    ),
    "BATTERY_CHARGE_FAIL": (
        tr("The camera’s battery cannot be charged."),
        tr("Unplug the camera, let it cool down or change the battery."),
    ),
    "HIGH_TEMPERATURE": _HEAT,
    "BATTERY_HIGH_TEMPERATURE": _HEAT,
}
_MYSTERIES: Final = frozenset({"disabledCommand", "incomplete", "stopped", "deadline"})
_BROKEN: Final = frozenset(
    {
        "CAPTURE_HW_FAILED",
        "CAPTURE_SW_FAILED",
        "INTERNAL_MEM_ACCESS_FAIL",
        "UNEXPECTED_ERROR",
        "IN_PROGRESS_ERROR",
        "CANNOT_RECORDING",
    }
)


def connect(job: CaptureJob) -> None:
    """Let any preview end, identify the camera and choose its profile.

    Raises:
        DeviceError: If nothing answers, the device is not the camera of this session, or its
            firmware is too old.
    """
    job.board.show(Stage.CONNECTING, tr("Connecting to the camera"))
    # A camera refuses most commands until a preview that was just closed has ended.
    job.contact.pause(_PREVIEW_S)
    job.contact.serial = job.session.journal.serial
    job.info = info = job.contact.meet()
    job.contact.serial = info.serial_number
    job.profile = profile_for(info)
    job.contact.forgets = job.profile.forgets
    job.client.most_listed = job.profile.listed
    _check_firmware(info, job.profile)
    job.session.update(model=info.model, serial=info.serial_number, firmware=info.firmware_text)


def check_ready(job: CaptureJob) -> None:
    """Check that the camera is ready to shoot.

    Raises:
        CameraNotReady: If the camera is not ready, with the reason and a hint.
    """
    job.board.show(Stage.CONNECTING, tr("Checking the camera"), 0.5)
    state = job.contact.ask(job.client.state)
    _check_state(state)
    if state.plugin_running:
        raise CameraNotReady(
            tr("A plug-in is running on the camera."),
            tr("Close the plug-in with the camera’s Mode button or in its app, then try again."),
            "plug-in",
        )
    _check_storage(job)
    wait_until_idle(job, _IDLE_S)


def wait_until_idle(job: CaptureJob, longest_s: float) -> None:
    """Wait until the camera is idle.

    Raises:
        CameraNotReady: If the camera is still busy after `longest_s` seconds.
    """
    until = job.clock.now() + longest_s
    while True:
        status = job.contact.ask(job.client.state).capture_status
        if status in ("", "idle"):
            return
        if job.clock.now() >= until:
            raise CameraNotReady(
                tr("The camera is busy ({status}).", status=status),
                tr(
                    "Wait until it has finished, or stop it with its shutter button, then "
                    "try again."
                ),
                "busy",
            )
        job.contact.pause(1.0)


def explain_error(job: CaptureJob, error: DeviceError) -> DeviceError:
    """Return the cause of a refusal or a stop if the camera's state reveals it, or else `error`."""
    if not isinstance(error, (CameraRefused, CaptureFailed)) or error.code not in _MYSTERIES:
        return error
    try:
        _check_state(job.client.state())
    except CameraNotReady as reason:
        return reason
    except DeviceError:
        pass
    return error


def _check_firmware(info: Info, profile: ModelProfile) -> None:
    if info.firmware and info.firmware < profile.min_firmware:
        version = ".".join(str(number) for number in profile.min_firmware)
        raise CameraNotReady(
            tr(
                "The camera’s firmware {firmware} is too old; {version} is needed.",
                firmware=info.firmware_text,
                version=version,
            ),
            tr("Update the firmware with Ricoh’s app for computers."),
            "firmware",
        )


def _check_state(state: State) -> None:
    """Raise `CameraNotReady` for a reported fault, overheating or a nearly empty battery."""
    for code in state.camera_errors:
        if code in _BLOCKING:
            raise CameraNotReady(*_BLOCKING[code], code)
        if code in _BROKEN:
            raise CameraNotReady(
                tr("The camera reports a fault ({code}).", code=code),
                tr("Restart it; if that does not help, see its manual."),
                code,
            )
    if max(state.board_temperature or 0.0, state.battery_temperature or 0.0) >= _HOT_C:
        raise CameraNotReady(*_HEAT, "HIGH_TEMPERATURE")
    level, charging = state.battery_level, state.battery_state in ("charging", "charged")
    if level is not None and level < _LOW_BATTERY and not charging:
        raise CameraNotReady(
            tr("The camera’s battery is too low for a bracket ({level:.0%}).", level=level),
            tr("Charge the battery or connect the camera to power, then try again."),
            "battery",
        )


def _check_storage(job: CaptureJob) -> None:
    room_for = number(read(job.contact, ("remainingPictures",)).get("remainingPictures"))
    count = _MOST_SHOTS[job.kind] + 1
    if room_for is not None and room_for < count:
        raise CameraNotReady(
            tr(
                "The camera has room for {room} more photos; {count} are needed.",
                room=max(int(room_for), 0),
                count=count,
            ),
            tr("Delete photos that you have already copied from the camera, then try again."),
            "storage",
        )
