"""A camera that wakes up in Web API v2.0, as a Theta S and SC do whenever their Wi-Fi is joined.

Of that version it has the commands that a client needs to leave it.
"""

from __future__ import annotations

from typing import Any, Final

from app.devices.clock import Clock
from app.devices.simulated.body import CameraBody
from app.devices.simulated.camera import capture_status
from app.devices.simulated.cameras import Personality
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
from app.devices.simulated.scene import Scene
from tests.faulty_camera.insta import InstaCamera

_SESSION_S: Final = 180
_SESSION: Final = frozenset({"sessionId"})


class OldApiCamera(InstaCamera):
    """A camera whose Web API is v2.0 until a client switches it, where the model has that version.

    * `api_version`: 1 for v2.0, 2 for v2.1.
    * `session`: number of the open session of v2.0, empty where there is none.
    """

    def __init__(
        self, scene: Scene, personality: Personality | str, clock: Clock, **options: Any
    ) -> None:
        super().__init__(scene, personality, clock, **options)
        self.session = ""
        self.api_version = 2
        self._old_commands = {
            "camera.startSession": Command(self._start_session, frozenset({"timeout"})),
            "camera.closeSession": Command(self._in_session(_nothing), _SESSION),
            "camera.updateSession": Command(self._in_session(_nothing), _SESSION),
            "camera.getOptions": Command(self._in_session(get_options), _SESSION | {"optionNames"}),
            "camera.setOptions": Command(
                self._in_session(self._set_options), _SESSION | {"options"}
            ),
            "camera.takePicture": Command(self._in_session(take_picture), _SESSION),
            "camera.listImages": Command(
                _list_images,
                frozenset({"entryCount", "maxSize", "continuationToken", "includeThumb"}),
            ),
        }
        self.wake()

    def wake(self) -> None:
        """Begin in the oldest version that the model has, without a session."""
        self.session = ""
        if self.personality.switches_api:
            self.api_version = 1

    def find_command(self, name: str) -> Command | None:
        return self._old_commands.get(name) if self.api_version == 1 else super().find_command(name)

    def status(self) -> dict[str, JsonValue]:
        if self.api_version > 1:
            return super().status()
        latest = self.storage.files[-1:]
        return {
            "sessionId": self.session or "SID_0000",
            "batteryLevel": self.battery,
            "storageChanged": False,
            "_captureStatus": capture_status(self),
            "_recordedTime": 0,
            "_recordableTime": 0,
            "_compositeShootingElapsedTime": 0,
            "_latestFileUri": latest[0].path.removeprefix("/files/") if latest else "",
            "_batteryState": "disconnect",
            "_apiVersion": 1,
        }

    def _start_session(self, _camera: CameraBody, _parameters: Parameters) -> Parameters:
        self.session = "SID_0001"
        return {"results": {"sessionId": self.session, "timeout": _SESSION_S}}

    def _in_session(self, act: Action) -> Action:
        """Make a command require the session's number first."""

        def checked(camera: CameraBody, parameters: Parameters) -> Parameters | Reply:
            session = parameters.pop("sessionId", None)
            if session is None:
                raise CommandRefused("missingParameter")
            if not self.session or session != self.session:
                raise CommandRefused("invalidSessionId", "The session is not open.")
            return act(camera, parameters)

        return checked

    def _set_options(self, camera: CameraBody, parameters: Parameters) -> Parameters:
        result = set_options(camera, parameters)
        options = parameters.get("options")
        if isinstance(options, dict) and options.get("clientVersion") == 2:
            self.api_version = 2
            self.session = ""
        return result


def _nothing(_camera: CameraBody, _parameters: Parameters) -> Parameters:
    return {}


def _list_images(camera: CameraBody, parameters: Parameters) -> Parameters:
    """List files by position, and page by page with a token."""
    count, token = parameters.get("entryCount"), str(parameters.get("continuationToken", "0"))
    thumbs = parameters.get("includeThumb", True) is not False
    if count is None or (thumbs and parameters.get("maxSize") is None):
        raise CommandRefused("missingParameter")
    if not counting(count) or not token.isdecimal() or len(token) > 9:
        raise CommandRefused("invalidParameterValue")
    files = camera.storage.files[::-1]
    start = int(token)
    stop = start + (1 if thumbs else int(str(count)))
    names = {"name", "size", "dateTimeZone", "width", "height", "thumbnail"}
    entries: list[JsonValue] = []
    for file in files[start:stop]:
        entry = camera.storage.entry(file, "", detail=True, thumb_size=160 if thumbs else 0)
        uri: dict[str, JsonValue] = {"uri": file.path.removeprefix("/files/")}
        entries.append(uri | {name: value for name, value in entry.items() if name in names})
    results: Parameters = {"entries": entries, "totalEntries": len(files)}
    if stop < len(files):
        results["continuationToken"] = str(stop)
    return {"results": results}
