"""The commands of Web API v2.0, as far as a client needs them to leave it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.devices.simulated.commands import (
    Action,
    Command,
    Parameters,
    counting,
    get_options,
    set_options,
    take_picture,
)
from app.devices.simulated.exchange import CommandRefused, JsonValue, Reply

if TYPE_CHECKING:
    from app.devices.simulated.body import CameraBody

_SESSION_S: Final = 180

_SESSION: Final = frozenset({"sessionId"})


def _start_session(camera: CameraBody, _parameters: Parameters) -> Parameters:
    camera.session = "SID_0001"
    return {"results": {"sessionId": camera.session, "timeout": _SESSION_S}}


def _old_session(camera: CameraBody, parameters: Parameters) -> None:
    given = parameters.pop("sessionId", None)
    if given is None:
        raise CommandRefused("missingParameter")
    if not camera.session or given != camera.session:
        raise CommandRefused("invalidSessionId", "The session is not open.")


def _in_session(act: Action) -> Action:
    """Make a command want the session's number first."""

    def acts(camera: CameraBody, parameters: Parameters) -> Parameters | Reply:
        _old_session(camera, parameters)
        return act(camera, parameters)

    return acts


def _old_set_options(camera: CameraBody, parameters: Parameters) -> Parameters:
    result = set_options(camera, parameters)
    options = parameters.get("options")
    if isinstance(options, dict) and options.get("clientVersion") == 2:
        camera.api_version = 2
        camera.session = ""
    return result


def _list_images(camera: CameraBody, parameters: Parameters) -> Parameters:
    """List files as API 2.0 does: by their place in the storage, and page by page with a token."""
    count, token = parameters.get("entryCount"), str(parameters.get("continuationToken", "0"))
    thumbs = parameters.get("includeThumb", True) is not False
    if count is None or (thumbs and parameters.get("maxSize") is None):
        raise CommandRefused("missingParameter")
    if not counting(count) or not token.isdecimal() or len(token) > 9:
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


OLD_COMMANDS: Final = {
    "camera.startSession": Command(_start_session, frozenset({"timeout"})),
    "camera.closeSession": Command(_in_session(lambda _camera, _parameters: {}), _SESSION),
    "camera.updateSession": Command(_in_session(lambda _camera, _parameters: {}), _SESSION),
    "camera.getOptions": Command(_in_session(get_options), _SESSION | {"optionNames"}),
    "camera.setOptions": Command(_in_session(_old_set_options), _SESSION | {"options"}),
    "camera.takePicture": Command(_in_session(take_picture), _SESSION),
    "camera.listImages": Command(
        _list_images, frozenset({"entryCount", "maxSize", "continuationToken", "includeThumb"})
    ),
}
"""By their names."""
