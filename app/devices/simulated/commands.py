"""The commands of a simulated camera, with their replies and their progress."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, TypeAlias

from app.devices.simulated.body import CameraBody
from app.devices.simulated.cameras import Personality
from app.devices.simulated.exchange import (
    CommandRefused,
    JsonValue,
    Reply,
    json_reply,
    refusal,
)
from app.devices.simulated.shooting import JobKind, ShootingJob

_OF_ONE_SHOT: Final = (
    "exposureProgram", "iso", "shutterSpeed", "aperture", "exposureCompensation",
    "isoAutoHighLimit", "whiteBalance",
)  # fmt: skip
_BYTES_PER_PICTURE: Final = 5_000_000
_FILES: Final = frozenset(
    {"fileType", "entryCount", "startPosition", "maxThumbSize", "_detail", "_storage"}
)


def begin_picture(camera: CameraBody) -> Reply:
    """Take a single photo, and return the reply "inProgress" with an id.

    Raises:
        CommandRefused: With the code disabledCommand if the camera is in another mode.
    """
    if camera.options["captureMode"] != "image" or camera.store.method != "normal":
        raise CommandRefused("disabledCommand")
    return _begin(camera, "camera.takePicture", "single", [_settings(camera)])


def begin_capture(camera: CameraBody, mode: JsonValue) -> Reply:
    """Start a bracket, and return the reply "inProgress" with an id.

    Args:
        mode: The parameter `_mode`, or None if the request omits it.

    Raises:
        CommandRefused: With the code disabledCommand if the camera is set to single photos or
            videos, or invalidParameterValue for another series or a model without a bracket.
    """
    rules = camera.personality.bracket
    mode = camera.store.method if mode is None else mode
    if mode == "normal" or camera.options["captureMode"] == "video":
        raise CommandRefused("disabledCommand")
    if mode != "bracket" or rules is None:
        raise CommandRefused("invalidParameterValue")
    shots = _bracket(camera)
    if rules.method and camera.store.method != "bracket":
        # The X takes the requested number of photos, but all with the settings of a single photo.
        shots = [_settings(camera)] * len(shots)
    return _begin(camera, "camera.startCapture", "bracket", shots)


def command_state(camera: CameraBody, job: ShootingJob) -> dict[str, JsonValue]:
    """Return the reply for a command in progress."""
    number: JsonValue = job.number if camera.personality.numeric_ids else str(job.number)
    share = 0.0 if job.watched else job.completion(camera.clock.now())
    return {
        "name": job.name, "state": "inProgress", "id": number, "progress": {"completion": share},
    }  # fmt: skip


def finished(camera: CameraBody, job: ShootingJob) -> dict[str, JsonValue]:
    """Return the reply for a finished command, with the URLs of its files.

    A series that was stopped has no URLs.
    """
    urls: list[JsonValue] = [camera.stated_url(file) for file in job.files]
    results: dict[str, JsonValue]
    if job.kind == "single":
        results = {"fileUrl": urls[0] if urls else ""}
    else:
        results = {} if job.stopped else {"fileUrls": urls}
    return {"name": job.name, "state": "done", "results": results}


def _settings(camera: CameraBody) -> dict[str, JsonValue]:
    settings: dict[str, JsonValue] = {
        name: camera.options[name] for name in _OF_ONE_SHOT if name in camera.options
    }
    if camera.options.get("_filter", "off") != "off":
        settings["exposureProgram"] = 2
    return settings


def _bracket(camera: CameraBody) -> list[dict[str, JsonValue]]:
    bracket = camera.options["_autoBracket"]
    assert isinstance(bracket, dict)
    shots = bracket["_bracketParameters"]
    assert isinstance(shots, list)
    usual: dict[str, JsonValue] = {
        "exposureProgram": 1,
        "aperture": camera.personality.apertures[0],
        "whiteBalance": "_colorTemperature",
    }
    return [usual | shot for shot in shots if isinstance(shot, dict)]


def _begin(
    camera: CameraBody, name: str, kind: JobKind, shots: list[dict[str, JsonValue]]
) -> Reply:
    job = camera.shoot(name, kind, shots)
    return json_reply(command_state(camera, job))


def live_options(camera: CameraBody) -> dict[str, JsonValue]:
    """Return the read-only options: the date and the free storage."""
    free = camera.free_bytes()
    return {
        "dateTimeZone": camera.date.text(camera.clock.now()),
        "remainingSpace": free,
        "remainingPictures": free // _BYTES_PER_PICTURE,
        "remainingVideoSeconds": free // 7_000_000,
        "totalSpace": 14_000_000_000,
    }


Parameters: TypeAlias = "dict[str, JsonValue]"
Action: TypeAlias = "Callable[[CameraBody, Parameters], Parameters | Reply]"


@dataclass(frozen=True, slots=True)
class Command:
    """A command of the camera.

    Attributes:
        act: Function that takes the camera and the parameters, and returns either the results to
            add to the name and state, or a complete reply. It may raise `CommandRefused`.
    """

    act: Action
    parameters: frozenset[str] = frozenset()
    there: Callable[[Personality], bool] = lambda _: True


def _parameter(parameters: Parameters, name: str) -> JsonValue:
    value = parameters.get(name)
    if value is None:
        raise CommandRefused("missingParameter")
    return value


def command_status(camera: CameraBody, body: Parameters) -> Reply:
    """Return the reply to /osc/commands/status: in progress, done, or the command's error.

    Raises:
        CommandRefused: With the code missingParameter if there is no id, or invalidParameterValue
            if the id is unknown.
    """
    job = camera.shooter.find(str(_parameter(body, "id")))
    if job is None:
        raise CommandRefused("invalidParameterValue")
    if job.cancelled:
        return refusal(job.name, "canceledShooting")
    if not camera.has_ended(job):
        answer = command_state(camera, job)
        if not camera.personality.status_ids:
            del answer["id"]
        return json_reply(answer)
    return json_reply(finished(camera, job))


def get_options(camera: CameraBody, parameters: Parameters) -> Parameters:
    """Read options."""
    names = _parameter(parameters, "optionNames")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise CommandRefused("invalidParameterValue")
    values = camera.store.get([str(name) for name in names], live_options(camera))
    return {"results": {"options": values}}


def set_options(camera: CameraBody, parameters: Parameters) -> Parameters:
    """Change options."""
    options = _parameter(parameters, "options")
    if not isinstance(options, dict) or not options:
        raise CommandRefused("invalidParameterValue")
    camera.check_settable()
    _check_date(camera, options)
    before = camera.options["captureMode"], camera.options["fileFormat"]
    camera.store.set(options)
    camera.options_set_at = camera.clock.now()
    if before != (camera.options["captureMode"], camera.options["fileFormat"]):
        camera.preview.close()
    return {}


def _check_date(camera: CameraBody, options: Parameters) -> None:
    text = options.get("dateTimeZone")
    if not isinstance(text, str) or len(options) > 1:
        return
    try:
        camera.date.set(text, camera.clock.now())
    except ValueError:
        raise CommandRefused("invalidParameterValue") from None


def take_picture(camera: CameraBody, _parameters: Parameters) -> Parameters | Reply:
    """Take a single photo."""
    camera.check_ready()
    return begin_picture(camera)


def _start_capture(camera: CameraBody, parameters: Parameters) -> Parameters | Reply:
    camera.check_ready()
    return begin_capture(camera, parameters.get("_mode", parameters.get("mode")))


def _stop_capture(camera: CameraBody, _parameters: Parameters) -> Parameters:
    job = camera.shooter.job
    if job is None or not camera.shooter.busy or job.kind == "single":
        raise CommandRefused("disabledCommand")
    camera.shooter.stop()
    camera.shooter.settle()
    return {}


def _stop_self_timer(camera: CameraBody, _parameters: Parameters) -> Parameters:
    job = camera.shooter.job
    if job is None or not camera.shooter.busy or camera.clock.now() >= job.begins:
        raise CommandRefused("disabledCommand")
    camera.shooter.stop()
    return {}


def _list_files(camera: CameraBody, parameters: Parameters) -> Parameters:
    keys = ("entryCount", "maxThumbSize", "fileType")
    count, thumb, kind = (_parameter(parameters, name) for name in keys)
    if kind not in {"all", "image", "video"} or thumb not in {0, 640}:
        raise CommandRefused("invalidParameterValue")
    start = parameters.get("startPosition", 0)
    if not counting(count) or not counting(start):
        raise CommandRefused("invalidParameterValue")
    files = [] if kind == "video" else camera.storage.files[::-1]
    total = len(files)
    files = files[int(str(start)) :][: int(str(count))]
    # A list with several entries has no thumbnails.
    size = 640 if thumb and len(files) == 1 else 0
    detail = parameters.get("_detail", True) is not False
    entries = camera.listing(files, detail=detail, thumb_size=size)
    return {"results": {"entries": entries, "totalEntries": total}}


def counting(value: JsonValue) -> bool:
    """Return whether a value is a non-negative whole number."""
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _delete(camera: CameraBody, parameters: Parameters) -> Parameters:
    urls = _parameter(parameters, "fileUrls")
    if not isinstance(urls, list):
        raise CommandRefused("invalidParameterValue")
    camera.storage.delete(urls)
    # The protocol lists files that could not be deleted, but Ricoh's cameras delete all or none.
    return {} if camera.personality.ricoh else {"results": {"fileUrls": []}}


def _live_preview(camera: CameraBody, _parameters: Parameters) -> Reply:
    if camera.shooter.busy or camera.preview.body is not None:
        raise CommandRefused("disabledCommand")
    if camera.options["captureMode"] != "image" and camera.personality.switches_api:
        raise CommandRefused("disabledCommand")
    camera.check_settled()
    return camera.preview.open()


COMMANDS: Final = {
    "camera.getOptions": Command(get_options, frozenset({"optionNames"})),
    "camera.setOptions": Command(set_options, frozenset({"options"})),
    "camera.takePicture": Command(take_picture),
    "camera.startCapture": Command(_start_capture, frozenset({"_mode", "mode"})),
    "camera.stopCapture": Command(_stop_capture),
    "camera._stopSelfTimer": Command(_stop_self_timer, there=lambda person: person.ricoh),
    "camera.listFiles": Command(_list_files, _FILES),
    "camera.delete": Command(_delete, frozenset({"fileUrls"})),
    "camera.getLivePreview": Command(_live_preview),
}
"""The commands of Web API v2.1, keyed by name."""
