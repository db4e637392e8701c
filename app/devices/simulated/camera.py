"""A simulated camera without sockets: requests in, replies out, time from a clock.

It knows nothing of the client: the words, the limits and the bad habits are those of the models as
Ricoh documents them and users report them.

Of Web API v2.0 it has the commands that a client needs to leave it.
"""

from __future__ import annotations

import hashlib
import json
import re
import threading
from collections.abc import Collection
from typing import Final

from app.devices.clock import Clock
from app.devices.simulated.body import CameraBody
from app.devices.simulated.cameras import Personality, personality_named
from app.devices.simulated.commands import (
    COMMANDS,
    Action,
    Command,
    Parameters,
    command_status,
    counting,
    get_options,
    set_options,
    take_picture,
)
from app.devices.simulated.exchange import (
    NO_ANSWER,
    CommandRefused,
    JsonValue,
    Reply,
    Request,
    file_reply,
    json_reply,
    refusal,
    text_reply,
)
from app.devices.simulated.faults import Faults
from app.devices.simulated.scene import Scene
from app.devices.simulated.shooting import STORAGE_ID

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


_LIFE_S: Final = 300.0
_PAIR: Final = re.compile(r'([a-zA-Z]+)\s*=\s*(?:"((?:[^"\\]|\\.)*)"|([^\s,"]+))')

_PATHS = ("info", "state", "checkForUpdates", "commands/execute", "commands/status")
_KEPT_REQUESTS: Final = 5000
_MOST_BODY: Final = 1_000_000


class Guard:
    """Asks for a password and checks what it gets."""

    def __init__(self, user: str, password: str, realm: str, seed: int) -> None:
        self._user = user
        self._password = password
        self._realm = realm
        self._seed = seed
        self._issued: dict[str, float] = {}
        self._used: set[tuple[str, str, str]] = set()

    def challenge(self, now: float, *, stale: bool = False) -> str:
        """Make the WWW-Authenticate header, with a new nonce.

        `now`: time in seconds; a nonce is good for 300.
        """
        nonce = _md5(f"{self._seed}:{len(self._issued)}:{now}:nonce")
        self._issued[nonce] = now
        words = f'Digest realm="{self._realm}", nonce="{nonce}", qop="auth", algorithm=MD5'
        return words + (", stale=true" if stale else "")

    def check(self, request: Request, now: float) -> str:
        """Judge a request. `now`: time in seconds."""
        scheme, _, rest = request.headers.get("authorization", "").partition(" ")
        if scheme.lower() != "digest":
            return "wrong"
        fields = {key.lower(): quoted or plain for key, quoted, plain in _PAIR.findall(rest)}
        if not self._proves(fields, request):
            return "wrong"
        use = (fields["nonce"], fields["nc"], fields["cnonce"])
        # The same words twice are somebody who listened.
        if now - self._issued.get(use[0], -_LIFE_S) >= _LIFE_S or use in self._used:
            return "stale"
        self._used.add(use)
        return "ok"

    def _proves(self, fields: dict[str, str], request: Request) -> bool:
        needed = ("username", "realm", "nonce", "uri", "response", "nc", "cnonce", "qop")
        if not all(fields.get(name) for name in needed):
            return False
        if fields["qop"] != "auth" or fields.get("algorithm", "MD5").upper() != "MD5":
            return False
        # Ricoh's own client leaves the query out of the URI.
        if fields["uri"] not in {request.target, request.target.partition("?")[0]}:
            return False
        if fields["username"] != self._user or fields["realm"] != self._realm:
            return False
        if fields["nonce"] not in self._issued:
            return False
        secret = _md5(f"{self._user}:{self._realm}:{self._password}")
        action = _md5(f"{request.method}:{fields['uri']}")
        parts = (secret, fields["nonce"], fields["nc"], fields["cnonce"], "auth", action)
        return fields["response"] == _md5(":".join(parts))


def _md5(text: str) -> str:
    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()


def info_of(camera: CameraBody) -> dict[str, JsonValue]:
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


def state_of(camera: CameraBody) -> dict[str, JsonValue]:
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


def _ricoh_state(camera: CameraBody) -> dict[str, JsonValue]:
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


def _old_state(camera: CameraBody) -> dict[str, JsonValue]:
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


def _capture_status(camera: CameraBody) -> str:
    job = camera.shooter.job
    return "idle" if job is None else job.status(camera.clock.now())


class SimulatedCamera(CameraBody):
    """One camera, from the moment its Wi-Fi is on.

    * `clock`: time. On a `VirtualClock` pictures are rendered when somebody first needs them,
      otherwise in a thread from the start of the shooting on (`close` ends it).
    * `user`, `password`: with a password the camera is in somebody's network and wants digest
      authentication; the user is "THETA" and the serial number unless given.
    * `rate_mbit`: transfer rate of files in megabits per second; no limit unless given.
    * `shape`: rows and columns of all frames, for quick trials; else what the camera is set to.
    * `battery`: charge, 0 to 1.

    Raises `ValueError` for a fault or personality that does not exist, or a
    password where the model can have none.
    """

    def __init__(
        self,
        scene: Scene,
        personality: Personality | str,
        clock: Clock,
        *,
        faults: Collection[str] = (),
        seed: int = 0,
        user: str = "",
        password: str = "",
        rate_mbit: float | None = None,
        shape: tuple[int, int] | None = None,
        battery: float = 0.8,
        older_files: int = 0,
    ) -> None:
        person = personality_named(personality) if isinstance(personality, str) else personality
        if password and not person.digest:
            raise ValueError(f"a {person.model} cannot ask for a password")
        super().__init__(scene, person, clock, shape, Faults(faults, seed))
        self.rate_mbit = rate_mbit
        self.battery = battery
        self._lock = threading.RLock()
        self._guard = Guard(user or person.user, password, person.model, seed) if password else None
        self._fingerprint = 0
        self._last_state = ""
        self.shooter.store_older(older_files, self.store.values)
        self.trouble.prepare(self)

    def reachable(self) -> bool:
        """Say whether a connection would be taken now; asking wakes a sleeping camera, in time."""
        with self._lock:
            return self.trouble.reachable(self)

    def reconnect(self) -> None:
        """Lose the Wi-Fi and take it up again: old connections die, and some models forget."""
        with self._lock:
            super().reconnect()

    def close(self) -> None:
        """End the rendering in the background."""
        self.shooter.close()

    def answer(self, request: Request) -> Reply:
        """Answer a request.

        Returns what to send; its pieces are made while they are sent. Whoever carries it closes
        `pieces` where it has a `close`. Without a Content-Length the end of the body is to be
        marked by chunked transfer or the end of the connection.
        """
        with self._lock:
            self.host = request.host
            self.log.append(request)
            del self.log[:-_KEPT_REQUESTS]
            if not self.trouble.reachable(self):
                return NO_ANSWER
            self.shooter.settle()
            early = self.trouble.before(self.personality.model, request) or self._unlocked(request)
            if early is not None:
                return early
            return self.trouble.after(request, self._route(request))

    def state(self) -> dict[str, JsonValue]:
        """Make the words of /osc/state; the fingerprint changes with them."""
        state = state_of(self)
        words = json.dumps(state)
        if words != self._last_state:
            self._last_state = words
            self._fingerprint += 1
        return {"fingerprint": f"FIG_{self._fingerprint:04d}", "state": state}

    def _unlocked(self, request: Request) -> Reply | None:
        person = self.personality
        if person.header and person.header not in request.headers:
            return refusal("", "unexpected", f"{person.header} is missing.", status=403)
        if self._guard is None:
            return None
        now = self.clock.now()
        verdict = self._guard.check(request, now)
        if verdict == "ok":
            return None
        body = text_reply(b"", "text/plain", 401)
        challenge = self._guard.challenge(now, stale=verdict == "stale")
        headers = (*body.headers, ("WWW-Authenticate", challenge))
        return type(body)(401, headers, body.pieces, body.delay_s)

    def _route(self, request: Request) -> Reply:
        path = request.target.partition("?")[0]
        gets = {"/osc/info": lambda: json_reply(info_of(self)), "/log/eventLog": self._event_log}
        posts = {
            "/osc/state": lambda _: json_reply(self.state()),
            "/osc/checkForUpdates": self._updates,
            "/osc/commands/execute": self._execute,
            "/osc/commands/status": lambda body: command_status(self, body),
        }
        if path.startswith("/files/") and request.method == "GET":
            return self._file(request)
        if path in gets and request.method == "GET":
            return gets[path]()
        if path in posts and request.method == "POST":
            return self._posted(request, posts[path])
        if path in gets or path in posts:
            return refusal("", "unknownCommand", status=405)
        return refusal("", "notFound")

    def _posted(self, request: Request, act: object) -> Reply:
        assert callable(act)
        name = ""
        try:
            body = _json_of(request)
            name = str(body.get("name", ""))
            reply: Reply = act(body)
        except CommandRefused as refused:
            return refusal(name, refused.code, refused.message)
        return reply

    def _updates(self, body: dict[str, JsonValue]) -> Reply:
        if not isinstance(body.get("stateFingerprint"), str):
            raise CommandRefused("missingParameter")
        return json_reply({"stateFingerprint": self.state()["fingerprint"]})

    def _execute(self, body: dict[str, JsonValue]) -> Reply:
        name, parameters = body.get("name"), body.get("parameters", {})
        if not isinstance(name, str):
            raise CommandRefused("missingParameter")
        if not isinstance(parameters, dict):
            raise CommandRefused("invalidParameterValue")
        commands = OLD_COMMANDS if self.api_version == 1 else COMMANDS
        command = commands.get(name)
        if command is None or not command.there(self.personality):
            raise CommandRefused("unknownCommand")
        for parameter in parameters:
            if parameter not in command.parameters:
                raise CommandRefused("invalidParameterName")
        results = command.act(self, parameters)
        if not isinstance(results, dict):
            return results
        answer: dict[str, JsonValue] = {"name": name, "state": "done"}
        return json_reply(answer | results)

    def _file(self, request: Request) -> Reply:
        path, _, query = request.target.partition("?")
        file = self.storage.find(path)
        if file is None:
            return refusal("", "notFound")
        if query == "type=thumb":
            return text_reply(file.thumb, "image/jpeg")
        data = self.trouble.bytes_of(file)
        asked = request.headers.get("range", "")
        return file_reply(data, asked, self.rate_mbit, ranges=self.personality.ranges)

    def _event_log(self) -> Reply:
        if self.personality.name not in {"X", "Z1", "A1"}:
            return refusal("", "notFound")
        lines = "".join(f"{request.method} {request.target}\n" for request in self.log[-100:])
        return text_reply(lines.encode(), "text/plain")


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
