"""A simulated camera without sockets: requests in, replies out, time from a clock.

It knows nothing of the client: the words, the limits and the bad habits are those of the models as
Ricoh documents them and users report them.
"""

from __future__ import annotations

import hashlib
import json
import re
import threading
from typing import TYPE_CHECKING, Final

from app.devices.simulated.commands import COMMANDS, OLD_COMMANDS, command_status
from app.devices.simulated.exchange import (
    NO_ANSWER,
    CommandRefused,
    file_reply,
    json_reply,
    refusal,
    text_reply,
)
from app.devices.simulated.faults import Faults
from app.devices.simulated.options import OptionStore
from app.devices.simulated.personality import personality_named
from app.devices.simulated.preview import PreviewGate
from app.devices.simulated.shooting import Shooter
from app.devices.simulated.storage import CameraDate, Storage, info_of, state_of
from app.devices.simulated.trouble import Trouble

if TYPE_CHECKING:
    from collections.abc import Collection

    from app.devices.clock import Clock
    from app.devices.simulated.exchange import JsonValue, Reply, Request
    from app.devices.simulated.personality import Personality
    from app.devices.simulated.scene import Scene
    from app.devices.simulated.storage import StoredFile


_LIFE_S: Final = 300.0
_PAIR: Final = re.compile(r'([a-zA-Z]+)\s*=\s*(?:"((?:[^"\\]|\\.)*)"|([^\s,"]+))')


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
        """Judge a request.

        `now`: time in seconds.
        """
        header = request.headers.get("authorization", "")
        scheme, _, rest = header.partition(" ")
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


_KEPT_REQUESTS: Final = 5000
_MOST_BODY: Final = 1_000_000


class SimulatedCamera:
    """One camera, from the moment its Wi-Fi is on.

    * `clock`: time. On a `VirtualClock` pictures are rendered when somebody first needs them,
      otherwise in a thread from the start of the shooting on (`close` ends it).
    * `user`, `password`: with a password the camera is in somebody's network and wants digest
      authentication; the user is "THETA" and the serial number unless given.
    * `rate_mbit`: transfer rate of files in megabits per second; no limit unless given.
    * `shape`: rows and columns of all frames, for quick trials; else what the camera is set to.
    * `battery`: charge, 0 to 1.

    `host`, `port`: where the last client asked for it: the address in its URLs. Else where it
    believes to be. Raises `ValueError` for a fault or personality that does not exist, or a
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
        self.personality = person
        self.scene = scene
        self.clock = clock
        self.rate_mbit = rate_mbit
        self.battery = battery
        self.faults = Faults(faults, seed)
        self.started = clock.now()
        self.trouble = Trouble(self.faults)
        self.date = CameraDate(self.started, self.trouble.first_year)
        self.store = OptionStore(person)
        self.storage = Storage(person)
        self.shooter = Shooter(scene, person, clock, self.date, self.storage, shape)
        self.preview = PreviewGate(self)
        self.api_version = 1 if person.switches_api else 2
        self.session = ""
        self.options_set_at = float("-inf")
        self.log: list[Request] = []
        self.epoch = 0
        self.host = person.address
        self._lock = threading.RLock()
        self._guard = Guard(user or person.user, password, person.model, seed) if password else None
        self._fingerprint = 0
        self._last_state = ""
        self.shooter.store_older(older_files, self.store.values)
        self.trouble.prepare(self)

    @property
    def options(self) -> dict[str, JsonValue]:
        """The options as the camera holds them."""
        return self.store.values

    @property
    def stored_files(self) -> tuple[StoredFile, ...]:
        """The files that the camera has written so far, oldest first."""
        with self._lock:
            self._settle()
            return tuple(self.storage.files)

    def fault_fired(self, name: str) -> bool:
        """Say whether a fault has shown."""
        return self.faults.fired(name) > 0

    def reachable(self) -> bool:
        """Say whether a connection would be taken now; asking wakes a sleeping camera, in time."""
        with self._lock:
            return self.trouble.reachable(self)

    def reconnect(self) -> None:
        """Lose the Wi-Fi and take it up again: old connections die, and some models forget."""
        with self._lock:
            self._settle()
            self.epoch += 1
            self.session = ""
            self.preview.close()
            if self.personality.switches_api:
                self.api_version = 1
            if not self.personality.keeps_settings:
                self.store.reset()

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
            self._settle()
            early = self.trouble.before(self, request) or self._unlocked(request)
            if early is not None:
                return early
            return self.trouble.after(self, request, self._route(request))

    def url(self, file: StoredFile) -> str:
        """URL of a file."""
        return f"http://{self.host}{file.path}"

    @property
    def port(self) -> int:
        """The port of its address."""
        digits = self.host.rpartition("]")[2].rpartition(":")[2]
        return int(digits) if digits.isdecimal() and len(digits) < 6 and ":" in self.host else 80

    def state(self) -> dict[str, JsonValue]:
        """Make the words of /osc/state; the fingerprint changes with them."""
        state = state_of(self)
        words = json.dumps(state)
        if words != self._last_state:
            self._last_state = words
            self._fingerprint += 1
        return {"fingerprint": f"FIG_{self._fingerprint:04d}", "state": state}

    def _settle(self) -> None:
        self.shooter.settle()

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
