"""Commands that take pictures, and what is said of them while they run and afterwards."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.devices.simulated.exchange import Reply
from app.devices.simulated.replies import LATENCY_S, CommandRefused, json_reply

if TYPE_CHECKING:
    from app.devices.simulated.camera import SimulatedCamera
    from app.devices.simulated.replies import JsonValue
    from app.devices.simulated.shooting import Job

_ENDLESS: Final = 200
_HDR_STEPS: Final = (0.0, -2.0, 2.0)
_OF_ONE_SHOT: Final = (
    "exposureProgram", "iso", "shutterSpeed", "aperture", "exposureCompensation",
    "isoAutoHighLimit", "whiteBalance",
)  # fmt: skip


def begin_picture(camera: SimulatedCamera) -> Reply:
    """Take a single picture.

    Returns
    -------
    Reply
        inProgress with an id; a cut connection where pictures follow each other too fast.

    Raises
    ------
    CommandRefused
        disabledCommand in another mode.
    """
    if camera.options["captureMode"] != "image" or camera.store.method != "normal":
        raise CommandRefused("disabledCommand")
    last = camera.shooter.job
    rest = camera.personality.rest_s
    if last is not None and camera.clock.now() - last.ended < rest:
        return Reply(0, delay_s=LATENCY_S)
    settings = _settings(camera)
    if camera.options.get("hdr") == "hdr" and camera.options.get("photoStitching") == "none":
        shots = [settings | {"exposureCompensation": step} for step in _HDR_STEPS]
        return _begin(camera, "camera.takePicture", "hdr", shots)
    return _begin(camera, "camera.takePicture", "single", [settings])


def begin_capture(camera: SimulatedCamera, mode: JsonValue) -> Reply:
    """Begin a series.

    Parameters
    ----------
    mode : JsonValue
        `_mode`, None where it was not given.

    Returns
    -------
    Reply
        inProgress with an id, or done where the series has no end.

    Raises
    ------
    CommandRefused
        invalidParameterValue for a mode that the model does not have.
    """
    options, person = camera.options, camera.personality
    if options["captureMode"] == "video":
        if mode is not None:
            raise CommandRefused("invalidParameterName")
        return _begin(camera, "camera.startCapture", "video", [])
    rules = person.bracket
    by_method = "_shootingMethod" in options
    if by_method and mode is None:
        mode = camera.store.method
    if mode in {None, "interval"} and not by_method:
        shots = [_settings(camera)] * _ENDLESS
        return _begin(camera, "camera.startCapture", "interval", shots)
    if mode != "bracket" or rules is None:
        raise CommandRefused("disabledCommand" if mode == "normal" else "invalidParameterValue")
    shots = _bracket(camera)
    if rules.method and camera.store.method != "bracket":
        # The X takes as many pictures as asked for, but all of them as it would take one.
        shots = [_settings(camera)] * len(shots)
    return _begin(camera, "camera.startCapture", "bracket", shots)


def started(camera: SimulatedCamera, job: Job) -> dict[str, JsonValue]:
    """Say that a command is under way."""
    number: JsonValue = job.number if camera.personality.numeric_ids else str(job.number)
    share = 0.0 if job.watched else job.completion(camera.clock.now())
    return {
        "name": job.name, "state": "inProgress", "id": number, "progress": {"completion": share},
    }  # fmt: skip


def finished(camera: SimulatedCamera, job: Job) -> dict[str, JsonValue]:
    """Say that a command is done, and where its files are.

    Returns
    -------
    dict[str, JsonValue]
        Body of the answer; without URLs where the job was stopped.
    """
    urls: list[JsonValue] = [camera.trouble.poisoned_url(camera.url(file)) for file in job.written]
    results: dict[str, JsonValue]
    if job.kind == "bracket":
        results = {} if job.stopped else {"fileUrls": urls}
    elif job.kind == "hdr":
        results = {"fileUrl": urls[0], "_fileGroup": urls}
    elif job.kind == "single":
        results = {"fileUrl": urls[0] if urls else ""}
    else:
        results = {"fileUrls": urls}
    return {"name": job.name, "state": "done", "results": results}


def _settings(camera: SimulatedCamera) -> dict[str, JsonValue]:
    settings: dict[str, JsonValue] = {
        name: camera.options[name] for name in _OF_ONE_SHOT if name in camera.options
    }
    if camera.options.get("_filter", "off") != "off":
        settings["exposureProgram"] = 2
    return settings


def _bracket(camera: SimulatedCamera) -> list[dict[str, JsonValue]]:
    wanted = camera.options["_autoBracket"]
    assert isinstance(wanted, dict)
    shots = wanted["_bracketParameters"]
    assert isinstance(shots, list)
    usual: dict[str, JsonValue] = {
        "exposureProgram": 1,
        "aperture": camera.personality.apertures[0],
        "whiteBalance": "_colorTemperature",
    }
    return [usual | shot for shot in shots if isinstance(shot, dict)]


def _begin(
    camera: SimulatedCamera, name: str, kind: str, shots: list[dict[str, JsonValue]]
) -> Reply:
    shots = camera.trouble.exposures(camera, shots)
    interval = camera.options["captureInterval"] if kind == "interval" else 0.0
    job = camera.shooter.begin(
        name,
        kind,  # type: ignore[arg-type]
        shots,
        camera.options,
        interval_s=float(str(interval)),
    )
    rules = camera.personality.bracket
    job.watched = kind == "bracket" and rules is not None and rules.watched
    camera.trouble.begun(camera, job)
    if job.open_end:
        return json_reply({"name": name, "state": "done"})
    return json_reply(started(camera, job))
