"""What a simulated camera says of itself: /osc/info and /osc/state."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.devices.simulated.storage import STORAGE_ID

if TYPE_CHECKING:
    from app.devices.simulated.camera import SimulatedCamera
    from app.devices.simulated.replies import JsonValue

_BYTES_PER_PICTURE = 5_000_000
_PATHS = ("info", "state", "checkForUpdates", "commands/execute", "commands/status")


def info_of(camera: SimulatedCamera) -> dict[str, JsonValue]:
    """Say what the camera is."""
    person = camera.personality
    info: dict[str, JsonValue] = {
        "manufacturer": person.manufacturer,
        "model": person.model,
        "serialNumber": person.serial,
        "firmwareVersion": person.firmware,
        "supportUrl": "https://example.com/support/",
        "gps": person.camera.lens_words == 1,
        "gyro": not person.switches_api,
        "uptime": int(camera.clock.now() - camera.started) + 30,
        "api": [f"/osc/{path}" for path in _PATHS],
        "endpoints": {"httpPort": camera.port, "httpUpdatesPort": camera.port},
        "apiLevel": list(person.api_levels),
    }
    if person.ricoh and not person.switches_api:
        info["_wlanMacAddress"] = "58:38:79:00:00:01"
        info["_bluetoothMacAddress"] = "58:38:79:00:00:02"
    return info


def state_of(camera: SimulatedCamera) -> dict[str, JsonValue]:
    """Say how the camera does."""
    person = camera.personality
    if camera.api_version == 1:
        return _old_state(camera)
    folder = person.folder.rpartition("/")[0]
    state: dict[str, JsonValue] = {
        "batteryLevel": camera.trouble.battery(camera.battery),
        "storageUri": f"http://{camera.host}/files/{folder + '/' if folder else ''}",
    }
    if person.ricoh:
        state |= _ricoh_state(camera)
        if person.camera.lens_words == 1:
            state |= {"_batteryInsert": True, "_currentStorage": "IN"}
            state |= {"_currentMicrophone": "Internal", "_storageID": STORAGE_ID}
        if person.name in {"X", "X-old", "A1", "Z1"}:
            state["_boardTemp"] = camera.trouble.temperature()
    elif person.insta:
        state["_cardState"] = "pass"
    return state


def _ricoh_state(camera: SimulatedCamera) -> dict[str, JsonValue]:
    job = camera.shooter.job
    latest = camera.storage.files[-1:]
    state: dict[str, JsonValue] = {
        "_apiVersion": camera.api_version,
        "_batteryState": "disconnect",
        "_captureStatus": _capture_status(camera),
        "_latestFileUrl": camera.trouble.poisoned_url(camera.url(latest[0])) if latest else "",
        "_recordedTime": 0,
        "_recordableTime": 0,
    }
    if camera.personality.camera.lens_words > 1:
        state["_compositeShootingElapsedTime"] = 0
    if not camera.personality.switches_api:
        under_way = job is not None and not job.done
        state["_capturedPictures"] = len(job.written) if job is not None and under_way else 0
        state["_cameraError"] = list(camera.trouble.errors(camera))
        state["_function"] = camera.options.get("_function", "normal")
    if camera.personality.digest:
        state |= {"_pluginRunning": False, "_pluginWebServer": True, "_mySettingChanged": False}
    return state


def _old_state(camera: SimulatedCamera) -> dict[str, JsonValue]:
    latest = camera.storage.files[-1:]
    return {
        "sessionId": camera.session or "SID_0000",
        "batteryLevel": camera.trouble.battery(camera.battery),
        "storageChanged": False,
        "_captureStatus": _capture_status(camera),
        "_recordedTime": 0,
        "_recordableTime": 0,
        "_compositeShootingElapsedTime": 0,
        "_latestFileUri": latest[0].path.removeprefix("/files/") if latest else "",
        "_batteryState": "disconnect",
        "_apiVersion": 1,
    }


def _capture_status(camera: SimulatedCamera) -> str:
    job = camera.shooter.job
    return "idle" if job is None else job.status(camera.clock.now())


def live_options(camera: SimulatedCamera) -> dict[str, JsonValue]:
    """Give the options that nobody sets: the date and what is left of the storage."""
    free = camera.trouble.free_bytes(camera)
    return {
        "dateTimeZone": camera.date.text(camera.clock.now()),
        "remainingSpace": free,
        "remainingPictures": free // _BYTES_PER_PICTURE,
        "remainingVideoSeconds": free // 7_000_000,
        "totalSpace": 14_000_000_000,
    }
