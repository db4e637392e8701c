"""The commands of a simulated camera."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

from app.devices.simulated.exchange import NO_ANSWER, CommandRefused, json_reply, refusal
from app.devices.simulated.shooting import begin_capture, begin_picture, finished, started
from app.devices.simulated.storage import live_options

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.core.hdr.frame import Exposure
    from app.devices.simulated.camera import SimulatedCamera
    from app.devices.simulated.exchange import JsonValue, Reply
    from app.devices.simulated.personality import Personality
    from app.devices.simulated.storage import StoredFile


def metadata_of(person: Personality, file: StoredFile) -> dict[str, JsonValue]:
    """Describe a file.

    Raises `CommandRefused`: invalidParameterValue for a file that the camera did not take.
    """
    take = file.take
    if take is None:
        raise CommandRefused("invalidParameterValue")
    rows, columns = file.shape
    wrong, no_size = person.metadata == "wrong", person.metadata == "no-size"
    exif: dict[str, JsonValue] = {
        "ExifVersion": "0231",
        "DateTime": take.taken,
        "Make": person.camera.make.strip(),
        "Model": person.camera.model.strip(),
        "Software": person.camera.software.strip(),
        "ExposureProgram": take.program,
        "ExposureTime": 0.004 if wrong else take.exposure.shutter_s,
        "PhotographicSensitivity": 0 if wrong else int(take.exposure.iso),
        "FNumber": take.exposure.aperture,
        "ExposureBiasValue": 0.0,
        # The X has the words and no values for them.
        "ApertureValue": 0 if no_size else round(2.0 * math.log2(take.exposure.aperture), 2),
        "BrightnessValue": 0 if no_size else _brightness(take.exposure),
        "Flash": 32,
        "Compression": 6,
        "ColorSpace": 1,
        "Orientation": 1,
        "WhiteBalance": int(take.fixed_balance),
    }
    if person.metadata == "full":
        exif |= {"ImageWidth": columns, "ImageLength": rows}
    xmp: dict[str, JsonValue] = {
        "ProjectionType": "equirectangular",
        "UsePanoramaViewer": True,
        "CroppedAreaImageHeightPixels": rows,
        "CroppedAreaImageWidthPixels": columns,
        "CroppedAreaLeftPixels": 0,
        "CroppedAreaTopPixels": 0,
        "FullPanoHeightPixels": rows,
        "FullPanoWidthPixels": columns,
    }
    return {"exif": exif, "xmp": xmp}


def _brightness(exposure: Exposure) -> float:
    """APEX: Av + Tv - Sv, as if the frame were rightly exposed."""
    speed = math.log2(exposure.iso / 3.125)
    return round(2.0 * math.log2(exposure.aperture) - math.log2(exposure.shutter_s) - speed, 2)


Parameters: TypeAlias = "dict[str, JsonValue]"
_SESSION_S: Final = 180
_SETTLE_S: Final = 1.0


def _everywhere(person: Personality) -> bool:
    del person
    return True


def _on_ricohs(person: Personality) -> bool:
    return person.ricoh


@dataclass(frozen=True, slots=True)
class Command:
    """One command.

    `act`: takes the camera and the parameters; returns what is added to name and state, or a whole
    reply. Raises `CommandRefused`.
    """

    act: Callable[[SimulatedCamera, Parameters], Parameters | Reply]
    parameters: frozenset[str] = frozenset()
    there: Callable[[Personality], bool] = _everywhere


def command_status(camera: SimulatedCamera, body: Parameters) -> Reply:
    """Answer /osc/commands/status.

    inProgress, done, or the error that ended the command. Raises `CommandRefused`: missingParameter
    without an id, invalidParameterValue for an unknown one.
    """
    number = body.get("id")
    if number is None:
        raise CommandRefused("missingParameter")
    job = camera.shooter.find(str(number))
    if job is None:
        raise CommandRefused("invalidParameterValue")
    if job.cancelled:
        return refusal(job.name, "canceledShooting")
    if not job.done or job.watched or camera.trouble.hides_end(camera, job):
        answer = started(camera, job)
        if not camera.personality.status_ids:
            del answer["id"]
        return json_reply(answer)
    return json_reply(finished(camera, job))


def _get_options(camera: SimulatedCamera, parameters: Parameters) -> Parameters:
    names = parameters.get("optionNames")
    if names is None:
        raise CommandRefused("missingParameter")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise CommandRefused("invalidParameterValue")
    values = camera.store.get([str(name) for name in names], live_options(camera))
    return {"results": {"options": values}}


def _set_options(camera: SimulatedCamera, parameters: Parameters) -> Parameters:
    options = parameters.get("options")
    if options is None:
        raise CommandRefused("missingParameter")
    if not isinstance(options, dict) or not options:
        raise CommandRefused("invalidParameterValue")
    # In API 2.0 there is nothing that a preview could be in the way of.
    lingers = camera.api_version > 1 and camera.trouble.preview_lingers(camera)
    if camera.shooter.busy or lingers:
        raise CommandRefused("disabledCommand")
    _check_date(camera, options)
    before = camera.options["captureMode"], camera.options["fileFormat"]
    camera.store.set(options)
    camera.options_set_at = camera.clock.now()
    if before != (camera.options["captureMode"], camera.options["fileFormat"]):
        camera.preview.close()
    return {}


def _check_date(camera: SimulatedCamera, options: Parameters) -> None:
    text = options.get("dateTimeZone")
    if not isinstance(text, str) or len(options) > 1:
        return
    try:
        camera.date.set(text, camera.clock.now())
    except ValueError:
        raise CommandRefused("invalidParameterValue") from None


def _take_picture(camera: SimulatedCamera, parameters: Parameters) -> Parameters | Reply:
    del parameters
    _check_ready(camera)
    return begin_picture(camera)


def _start_capture(camera: SimulatedCamera, parameters: Parameters) -> Parameters | Reply:
    _check_ready(camera)
    return begin_capture(camera, parameters.get("_mode", parameters.get("mode")))


def _check_ready(camera: SimulatedCamera) -> None:
    """Refuse to shoot while something else is under way, or too soon."""
    camera.trouble.check_shooting(camera)
    if camera.shooter.busy:
        raise CommandRefused("disabledCommand", "Shooting is under way.")
    if camera.preview.body is not None or camera.trouble.preview_lingers(camera):
        raise CommandRefused("disabledCommand", "The live preview is open.")
    _check_settled(camera)


def _check_settled(camera: SimulatedCamera) -> None:
    since = camera.clock.now() - camera.options_set_at
    if since < _SETTLE_S or camera.trouble.still_settling(since):
        raise CommandRefused("disabledCommand", "Options were set a moment ago.")


def _stop_capture(camera: SimulatedCamera, parameters: Parameters) -> Parameters:
    del parameters
    job = camera.shooter.job
    if job is None or not camera.shooter.busy or job.kind in {"single", "hdr"}:
        raise CommandRefused("disabledCommand")
    camera.shooter.stop()
    camera.shooter.settle()
    return {}


def _stop_self_timer(camera: SimulatedCamera, parameters: Parameters) -> Parameters:
    del parameters
    job = camera.shooter.job
    if job is None or not camera.shooter.busy or camera.clock.now() >= job.begins:
        raise CommandRefused("disabledCommand")
    camera.shooter.stop()
    return {}


def _list_files(camera: SimulatedCamera, parameters: Parameters) -> Parameters | Reply:
    count, thumb = parameters.get("entryCount"), parameters.get("maxThumbSize")
    kind = parameters.get("fileType")
    if count is None or thumb is None or kind is None:
        raise CommandRefused("missingParameter")
    if kind not in {"all", "image", "video"} or thumb not in {0, 640}:
        raise CommandRefused("invalidParameterValue")
    start = parameters.get("startPosition", 0)
    if not _counting(count) or not _counting(start):
        raise CommandRefused("invalidParameterValue")
    if thumb and camera.personality.thumbs_hang:
        return NO_ANSWER
    files = [] if kind == "video" else camera.storage.files[::-1]
    if parameters.get("_sort") == "oldest":
        files.reverse()
    total = len(files)
    files = files[_position(camera, parameters, int(str(start))) :][: int(str(count))]
    entries: list[JsonValue] = []
    for file in files:
        # Only one thumbnail is given at a time.
        size = 640 if thumb and len(files) == 1 else 0
        url = camera.trouble.poisoned_url(camera.url(file))
        detail = parameters.get("_detail", True) is not False
        entries.append(camera.storage.entry(file, url, detail=detail, thumb_size=size))
    camera.trouble.slip_in(camera, entries)
    return {"results": {"entries": entries, "totalEntries": total}}


def _position(camera: SimulatedCamera, parameters: Parameters, start: int) -> int:
    first = parameters.get("_startFileUrl")
    if first is None:
        return start
    files = camera.storage.files[::-1]
    found = [index for index, file in enumerate(files) if camera.url(file) == first]
    if not found:
        raise CommandRefused("invalidParameterValue")
    return found[0]


def _counting(value: JsonValue) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _delete(camera: SimulatedCamera, parameters: Parameters) -> Parameters:
    urls = parameters.get("fileUrls")
    if urls is None:
        raise CommandRefused("missingParameter")
    if not isinstance(urls, list):
        raise CommandRefused("invalidParameterValue")
    camera.storage.delete(urls)
    # The protocol lists those that could not be deleted; Ricoh's cameras do all or nothing.
    return {} if camera.personality.ricoh else {"results": {"fileUrls": []}}


def _get_metadata(camera: SimulatedCamera, parameters: Parameters) -> Parameters:
    url = parameters.get("fileUrl")
    if url is None:
        raise CommandRefused("missingParameter")
    path = "/" + str(url).partition("://")[2].partition("/")[2]
    file = camera.storage.find(path)
    if file is None:
        raise CommandRefused("invalidParameterValue")
    return {"results": metadata_of(camera.personality, file)}


def _live_preview(camera: SimulatedCamera, parameters: Parameters) -> Reply:
    del parameters
    now = camera.clock.now()
    job = camera.shooter.job
    resting = job is not None and now - job.ended < camera.personality.preview_rest_s
    if camera.shooter.busy or resting or camera.preview.body is not None:
        raise CommandRefused("disabledCommand")
    if camera.options["captureMode"] != "image" and camera.personality.switches_api:
        raise CommandRefused("disabledCommand")
    _check_settled(camera)
    return camera.preview.open()


def _start_session(camera: SimulatedCamera, parameters: Parameters) -> Parameters:
    del parameters
    camera.session = "SID_0001"
    return {"results": {"sessionId": camera.session, "timeout": _SESSION_S}}


def _old_session(camera: SimulatedCamera, parameters: Parameters) -> None:
    given = parameters.pop("sessionId", None)
    if given is None:
        raise CommandRefused("missingParameter")
    if not camera.session or given != camera.session:
        raise CommandRefused("invalidSessionId", "The session is not open.")


def _old_set_options(camera: SimulatedCamera, parameters: Parameters) -> Parameters:
    _old_session(camera, parameters)
    result = _set_options(camera, parameters)
    options = parameters.get("options")
    if isinstance(options, dict) and options.get("clientVersion") == 2:
        camera.api_version = 2
        camera.session = ""
    return result


def _old_get_options(camera: SimulatedCamera, parameters: Parameters) -> Parameters:
    _old_session(camera, parameters)
    return _get_options(camera, parameters)


def _old_take_picture(camera: SimulatedCamera, parameters: Parameters) -> Parameters | Reply:
    _old_session(camera, parameters)
    return _take_picture(camera, parameters)


def _list_images(camera: SimulatedCamera, parameters: Parameters) -> Parameters:
    """List files as API 2.0 does: by their place in the storage, and page by page with a token."""
    count, token = parameters.get("entryCount"), str(parameters.get("continuationToken", "0"))
    thumbs = parameters.get("includeThumb", True) is not False
    if count is None or (thumbs and parameters.get("maxSize") is None):
        raise CommandRefused("missingParameter")
    if not _counting(count) or not token.isdecimal() or len(token) > 9:
        raise CommandRefused("invalidParameterValue")
    files = camera.storage.files[::-1]
    start = int(token)
    stop = start + (1 if thumbs else int(str(count)))
    entries: list[JsonValue] = []
    for file in files[start:stop]:
        entry = camera.storage.entry(file, "", detail=True, thumb_size=160 if thumbs else 0)
        kept = {"name", "size", "dateTimeZone", "width", "height", "thumbnail"}
        shown: dict[str, JsonValue] = {"uri": file.path.removeprefix("/files/")}
        shown |= {name: value for name, value in entry.items() if name in kept}
        entries.append(shown)
    results: Parameters = {"entries": entries, "totalEntries": len(files)}
    if stop < len(files):
        results["continuationToken"] = str(stop)
    return {"results": results}


def _nothing(camera: SimulatedCamera, parameters: Parameters) -> Parameters:
    _old_session(camera, parameters)
    return {}


def _reset(camera: SimulatedCamera, parameters: Parameters) -> Parameters:
    del parameters
    camera.store.reset()
    return {}


def _has_metadata(person: Personality) -> bool:
    return person.metadata != "none"


_FILES: Final = frozenset(
    {"fileType", "entryCount", "startPosition", "maxThumbSize", "_detail", "_sort", "_storage"}
)

COMMANDS: Final = {
    "camera.getOptions": Command(_get_options, frozenset({"optionNames"})),
    "camera.setOptions": Command(_set_options, frozenset({"options"})),
    "camera.takePicture": Command(_take_picture),
    "camera.startCapture": Command(_start_capture, frozenset({"_mode", "mode"})),
    "camera.stopCapture": Command(_stop_capture),
    "camera._stopSelfTimer": Command(_stop_self_timer, there=_on_ricohs),
    "camera.listFiles": Command(_list_files, _FILES | {"_startFileUrl"}),
    "camera.delete": Command(_delete, frozenset({"fileUrls"})),
    "camera._getMetadata": Command(_get_metadata, frozenset({"fileUrl"}), _has_metadata),
    "camera.getLivePreview": Command(_live_preview),
    "camera.reset": Command(_reset),
}
"""Web API v2.1."""

_SESSION: Final = frozenset({"sessionId"})
OLD_COMMANDS: Final = {
    "camera.startSession": Command(_start_session, frozenset({"timeout"})),
    "camera.closeSession": Command(_nothing, _SESSION),
    "camera.updateSession": Command(_nothing, _SESSION),
    "camera.getOptions": Command(_old_get_options, _SESSION | {"optionNames"}),
    "camera.setOptions": Command(_old_set_options, _SESSION | {"options"}),
    "camera.takePicture": Command(_old_take_picture, _SESSION),
    "camera.listImages": Command(
        _list_images, frozenset({"entryCount", "maxSize", "continuationToken", "includeThumb"})
    ),
}
"""Web API v2.0, as far as somebody needs it to leave it."""
