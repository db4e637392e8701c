"""Getting to know the camera, and whether it can shoot as it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.devices.capture import settings
from app.devices.capture.status import Stage
from app.devices.errors import CameraNotReady, CameraRefused, CaptureFailed, DeviceError
from app.devices.profiles import profile_for

if TYPE_CHECKING:
    from app.devices.capture.job import Job
    from app.devices.profiles import ModelProfile
    from app.devices.theta.messages import Info, State

_LOW_BATTERY: Final = 0.1
_HOT_C: Final = 60.0
_PREVIEW_S: Final = 0.5
_IDLE_S: Final = 15.0
_MOST_SHOTS: Final = {"paper": 3, "full": 10}

_HEAT: Final = (
    "The camera is too hot to shoot.",
    "Switch it off, let it cool down in the shade for some minutes, then try again.",
)
_BLOCKING: Final = {
    "NO_MEMORY": (
        "The camera's storage is full.",
        "Delete pictures on the camera that you have copied, then try again.",
    ),
    "FILE_NUMBER_OVER": (
        "The camera has used up its file numbers.",
        "Copy its pictures, delete them on the camera, then try again.",
    ),
    "BATTERY_CHARGE_FAIL": (
        "The camera's battery cannot be charged.",
        "Unplug it, let it cool down, or change the battery.",
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


def connect(job: Job) -> None:
    """Close the preview, ask who the camera is and choose its profile.

    Raises
    ------
    DeviceError
        When it does not answer, is no camera, is not the one of this session, or its firmware is
        too old.
    """
    job.board.show(Stage.CONNECTING, "Connecting to the camera")
    # A camera that shows a preview refuses most of what follows.
    job.before_exposing()
    job.contact.pause(_PREVIEW_S)
    journal = job.session.journal
    job.contact.serial = journal.serial
    job.info = info = job.contact.meet()
    job.contact.serial = info.serial_number
    job.profile = profile_for(info)
    job.contact.forgets = job.profile.forgets
    job.client.most_listed = job.profile.listed
    _check_firmware(info, job.profile)
    job.session.update(model=info.model, serial=info.serial_number, firmware=info.firmware_text)


def check_ready(job: Job) -> None:
    """Check that nothing keeps the camera from shooting.

    Raises
    ------
    CameraNotReady
        When something does: what, and what to do about it.
    """
    job.board.show(Stage.CONNECTING, "Checking the camera", 0.5)
    state = job.contact.ask(job.client.state)
    _check_errors(state)
    _check_heat(state)
    _check_power(state)
    if state.plugin_running:
        raise CameraNotReady(
            "A plug-in is running on the camera.",
            "End it with the camera's Mode button or in its own app, then try again.",
            "plug-in",
        )
    _check_storage(job)
    wait_until_idle(job, _IDLE_S)


def wait_until_idle(job: Job, longest_s: float) -> None:
    """Wait until the camera is doing nothing.

    Raises
    ------
    CameraNotReady
        When it is busy for longer.
    """
    until = job.clock.now() + longest_s
    while True:
        status = job.contact.ask(job.client.state).capture_status
        if status in ("", "idle"):
            return
        if job.clock.now() >= until:
            raise CameraNotReady(
                f"The camera is busy ({status}).",
                "Wait until it has finished, or stop it with its shutter button, then try again.",
                "busy",
            )
        job.contact.pause(1.0)


def explained(job: Job, error: DeviceError) -> DeviceError:
    """Find out whether a camera that refused or stopped has a reason that its state tells."""
    if not isinstance(error, (CameraRefused, CaptureFailed)) or error.code not in _MYSTERIES:
        return error
    try:
        state = job.client.state()
        _check_errors(state)
        _check_heat(state)
        _check_power(state)
    except CameraNotReady as reason:
        return reason
    except DeviceError:
        pass
    return error


def _check_firmware(info: Info, profile: ModelProfile) -> None:
    if info.firmware and info.firmware < profile.min_firmware:
        wanted = ".".join(str(number) for number in profile.min_firmware)
        raise CameraNotReady(
            f"The camera's firmware {info.firmware_text} is too old; {wanted} is needed.",
            "Update it with Ricoh's app for the computer.",
            "firmware",
        )


def _check_errors(state: State) -> None:
    for code in state.camera_errors:
        if code in _BLOCKING:
            raise CameraNotReady(*_BLOCKING[code], code)
        if code in _BROKEN:
            raise CameraNotReady(
                f"The camera reports a fault ({code}).",
                "Switch it off and on; if that does not help, see its manual.",
                code,
            )


def _check_heat(state: State) -> None:
    if any(
        degrees is not None and degrees >= _HOT_C
        for degrees in (state.board_temperature, state.battery_temperature)
    ):
        raise CameraNotReady(*_HEAT, "HIGH_TEMPERATURE")


def _check_power(state: State) -> None:
    level = state.battery_level
    if level is None or state.battery_state in ("charging", "charged"):
        return
    if level < _LOW_BATTERY:
        raise CameraNotReady(
            f"The camera's battery is at {level:.0%}: too little for a bracket.",
            "Charge it, or connect it to power, then try again.",
            "battery",
        )


def _check_storage(job: Job) -> None:
    left = settings.read(job.contact, ("remainingPictures",)).get("remainingPictures")
    if isinstance(left, bool) or not isinstance(left, (int, float)):
        return
    wanted = _MOST_SHOTS[job.kind] + 1
    if left < wanted:
        raise CameraNotReady(
            f"The camera has room for {max(int(left), 0)} more pictures; {wanted} are needed.",
            "Delete pictures on the camera that you have copied, then try again.",
            "storage",
        )
