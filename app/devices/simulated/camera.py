"""A simulated camera that has no sockets and maps requests to replies on a given clock.

It implements Web API v2.1 and shares no code with the client. Its names and limits are those that
Ricoh documents or that users report.
"""

from __future__ import annotations

import json
import threading
from typing import Final

from app.devices.clock import Clock
from app.devices.simulated.body import CameraBody
from app.devices.simulated.cameras import Personality, personality_named
from app.devices.simulated.commands import COMMANDS, Command, command_status
from app.devices.simulated.exchange import (
    CommandRefused,
    JsonValue,
    Reply,
    Request,
    file_reply,
    json_reply,
    refusal,
    text_reply,
)
from app.devices.simulated.scene import Scene
from app.devices.simulated.shooting import STORAGE_ID, CameraDate, StoredFile

_PATHS = ("info", "state", "commands/execute", "commands/status")
_KEPT_REQUESTS: Final = 5000
_MOST_BODY: Final = 1_000_000


def info_of(camera: CameraBody) -> dict[str, JsonValue]:
    """Return the reply to /osc/info."""
    person = camera.personality
    info: dict[str, JsonValue] = {
        "manufacturer": person.manufacturer,
        "model": person.model,
        "serialNumber": person.serial,
        "firmwareVersion": person.firmware,
        "supportUrl": "https://example.com/support/",
        "gps": person.camera.lens_words == 1,
        "gyro": not person.switches_api,
        "uptime": int(camera.clock.now() - camera.start_s) + 30,
        "api": [f"/osc/{path}" for path in _PATHS],
        "endpoints": {"httpPort": camera.port, "httpUpdatesPort": camera.port},
        "apiLevel": list(person.api_levels),
    }
    if person.ricoh and not person.switches_api:
        info["_wlanMacAddress"] = "58:38:79:00:00:01"
        info["_bluetoothMacAddress"] = "58:38:79:00:00:02"
    return info


def state_of(camera: CameraBody) -> dict[str, JsonValue]:
    """Return the state in the reply to /osc/state."""
    person = camera.personality
    folder = person.folder.rpartition("/")[0]
    state: dict[str, JsonValue] = {
        "batteryLevel": camera.battery,
        "storageUri": f"http://{camera.host}/files/{folder + '/' if folder else ''}",
    }
    if person.ricoh:
        state |= _ricoh_state(camera)
        if person.camera.lens_words == 1:
            state |= {"_batteryInsert": True, "_currentStorage": "IN"}
            state |= {"_currentMicrophone": "Internal", "_storageID": STORAGE_ID}
        if person.camera.lens_words == 1 or person.name == "Z1":
            state["_boardTemp"] = camera.temperature_c
    return state


def _ricoh_state(camera: CameraBody) -> dict[str, JsonValue]:
    job = camera.shooter.job
    latest = camera.storage.files[-1:]
    state: dict[str, JsonValue] = {
        "_apiVersion": 2,
        "_batteryState": "disconnect",
        "_captureStatus": capture_status(camera),
        "_latestFileUrl": camera.stated_url(latest[0]) if latest else "",
        "_recordedTime": 0,
        "_recordableTime": 0,
    }
    if camera.personality.camera.lens_words > 1:
        state["_compositeShootingElapsedTime"] = 0
    if not camera.personality.switches_api:
        under_way = job is not None and not job.done
        state["_capturedPictures"] = len(job.files) if job is not None and under_way else 0
        state["_cameraError"] = list(camera.errors())
        state["_function"] = camera.options.get("_function", "normal")
    if camera.personality.digest:
        state |= {"_pluginRunning": False, "_pluginWebServer": True, "_mySettingChanged": False}
    return state


def capture_status(camera: CameraBody) -> str:
    """Return the value of `_captureStatus`."""
    job = camera.shooter.job
    return "idle" if job is None else job.status(camera.clock.now())


class SimulatedCamera(CameraBody):
    """One camera with its Wi-Fi switched on.

    Args:
        clock: The camera's clock. On a `VirtualClock`, frames are rendered when they are first
            used. On any other clock, a thread renders them while the camera shoots, and `close`
            ends the thread.
        rate_mbit: Transfer rate of files in megabits per second, or None for no limit.
        shape: Rows and columns of all frames, for quick tests, or None to follow the options.
        date: Date and time of the camera's clock, or None for noon on a summer day.

    Raises:
        ValueError: If the personality does not exist.
    """

    def __init__(
        self,
        scene: Scene,
        personality: Personality | str,
        clock: Clock,
        *,
        rate_mbit: float | None = None,
        shape: tuple[int, int] | None = None,
        date: CameraDate | None = None,
    ) -> None:
        person = personality_named(personality) if isinstance(personality, str) else personality
        super().__init__(scene, person, clock, shape, date)
        self.rate_mbit = rate_mbit
        self._lock = threading.RLock()
        self._fingerprint = 0
        self._last_state = ""

    def close(self) -> None:
        """End the rendering thread."""
        self.shooter.close()

    def answer(self, request: Request) -> Reply:
        """Return the reply to a request.

        The pieces of a reply are created as they are sent, and the server calls `pieces.close` if
        it exists. If there is no Content-Length, chunked transfer or the end of the connection
        marks the end of the body.
        """
        with self._lock:
            self.note(request)
            self.shooter.settle()
            return self.refuse(request) or self.route(request)

    def note(self, request: Request) -> None:
        """Add a request to the log, and use its host for the URLs of files."""
        self.host = request.host
        self.log.append(request)
        del self.log[:-_KEPT_REQUESTS]

    def state(self) -> dict[str, JsonValue]:
        """Return the reply to /osc/state, whose fingerprint changes with the state."""
        state = self.status()
        words = json.dumps(state)
        if words != self._last_state:
            self._last_state = words
            self._fingerprint += 1
        return {"fingerprint": f"FIG_{self._fingerprint:04d}", "state": state}

    def status(self) -> dict[str, JsonValue]:
        """Return the state for /osc/state, without the fingerprint."""
        return state_of(self)

    def refuse(self, _request: Request) -> Reply | None:
        """Return a reply without examining the request, or None to have the request examined."""
        return None

    def route(self, request: Request) -> Reply:
        """Return the reply to a request according to its path."""
        path = request.target.partition("?")[0]
        posts = {
            "/osc/state": lambda _: json_reply(self.state()),
            "/osc/commands/execute": self._execute,
            "/osc/commands/status": lambda body: command_status(self, body),
        }
        if path.startswith("/files/") and request.method == "GET":
            return self._file(request)
        if path == "/osc/info" and request.method == "GET":
            return json_reply(info_of(self))
        if path in posts and request.method == "POST":
            return self._posted(request, posts[path])
        if path in {"/osc/info", *posts}:
            return refusal("", "unknownCommand", status=405)
        return refusal("", "notFound")

    def _posted(self, request: Request, act: object) -> Reply:
        assert callable(act)
        name = ""
        try:
            body = _json_of(request)
            name = str(body.get("name", ""))
            reply: Reply = act(body)
        except CommandRefused as command_error:
            return refusal(name, command_error.code, command_error.message)
        return reply

    def _execute(self, body: dict[str, JsonValue]) -> Reply:
        name, parameters = body.get("name"), body.get("parameters", {})
        if not isinstance(name, str):
            raise CommandRefused("missingParameter")
        if not isinstance(parameters, dict):
            raise CommandRefused("invalidParameterValue")
        command = self.find_command(name)
        if command is None:
            raise CommandRefused("unknownCommand")
        for parameter in parameters:
            if parameter not in command.parameters:
                raise CommandRefused("invalidParameterName")
        results = command.act(self, parameters)
        if not isinstance(results, dict):
            return results
        answer: dict[str, JsonValue] = {"name": name, "state": "done"}
        return json_reply(answer | results)

    def find_command(self, name: str) -> Command | None:
        """Return a command by name, or None if the camera does not have it."""
        command = COMMANDS.get(name)
        return command if command is not None and command.there(self.personality) else None

    def _file(self, request: Request) -> Reply:
        path, _, query = request.target.partition("?")
        file = self.storage.find(path)
        if file is None:
            return refusal("", "notFound")
        if query == "type=thumb":
            return text_reply(file.thumb, "image/jpeg")
        range_header = request.headers.get("range", "")
        data = self.file_data(file)
        return file_reply(data, range_header, self.rate_mbit, ranges=self.personality.ranges)

    def file_data(self, file: StoredFile) -> bytes:
        """Return the bytes of a file for download."""
        return file.data


def _json_of(request: Request) -> dict[str, JsonValue]:
    if not request.body:
        return {}
    if len(request.body) > _MOST_BODY:
        raise CommandRefused("unexpected", "The body is too large.")
    try:
        body = json.loads(request.body)
    except (ValueError, RecursionError):
        raise CommandRefused("unexpected", "The body is not JSON.") from None
    if not isinstance(body, dict):
        raise CommandRefused("unexpected", "The body is not an object.")
    return body
