"""A simulated camera to talk to, without a client: requests and replies by hand."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np

from app.devices.clock import VirtualClock
from app.devices.simulated.camera import SimulatedCamera
from app.devices.simulated.cameras import Personality
from app.devices.simulated.exchange import Reply, Request
from app.devices.simulated.exposure_maker import ShotOptions
from app.devices.simulated.scene import Scene
from app.devices.simulated.shooting import StoredFile
from tests.faulty_camera.camera import FaultyCamera

QUICK = (32, 64)
JSON = {"content-type": "application/json;charset=utf-8", "x-xsrf-protected": "1"}


@cache
def room(scale: float = 1.0) -> Scene:
    """A small place with a bright front, the same for all."""
    light = np.random.default_rng(7).lognormal(3.0, 1.0, (32, 64, 3)).astype(np.float32)
    light[:, 16:48] *= 4.0
    return Scene(light, ShotOptions(scale=scale))


def stored(camera: SimulatedCamera) -> tuple[StoredFile, ...]:
    """The files that a camera has written so far, oldest first."""
    with camera._lock:
        camera.shooter.settle()
        return tuple(camera.storage.files)


class Talker:
    """Speaks OSC to a camera, word by word, on virtual time."""

    def __init__(self, person: str | Personality, **options: Any) -> None:
        self.clock = VirtualClock(100.0)
        scene = options.pop("scene", None) or room()
        options.setdefault("shape", QUICK)
        self.camera = FaultyCamera(scene, person, self.clock, **options)

    def ask(self, method: str, target: str, body: Any = None, **headers: str) -> Reply:
        data = b"" if body is None else json.dumps(body).encode()
        return self.camera.answer(Request(method, target, JSON | headers, data))

    def get(self, target: str, **headers: str) -> tuple[int, bytes]:
        reply = self.ask("GET", target, **headers)
        return reply.status, content(reply)

    def post(self, target: str, body: Any = None) -> tuple[int, dict[str, Any]]:
        reply = self.ask("POST", target, body)
        return reply.status, json.loads(content(reply))

    def run(self, name: str, **parameters: Any) -> tuple[int, dict[str, Any]]:
        return self.post(
            "/osc/commands/execute", {"name": f"camera.{name}", "parameters": parameters}
        )

    def good(self, name: str, **parameters: Any) -> dict[str, Any]:
        status, answer = self.run(name, **parameters)
        assert status == 200, answer
        return answer

    def code(self, name: str, **parameters: Any) -> str:
        """Run what must be refused; the error code."""
        status, answer = self.run(name, **parameters)
        assert status != 200, answer
        assert answer["state"] == "error"
        return str(answer["error"]["code"])

    def set(self, **options: Any) -> None:
        """Set options, and wait as long as the camera wants."""
        self.good("setOptions", options=options)
        self.clock.sleep(1.01)

    def options(self, *names: str) -> dict[str, Any]:
        found = self.good("getOptions", optionNames=list(names))["results"]["options"]
        assert isinstance(found, dict)
        return found

    def state(self) -> dict[str, Any]:
        inner = self.post("/osc/state")[1]["state"]
        assert isinstance(inner, dict)
        return inner

    def wake(self) -> None:
        """Switch an S or SC to API 2.1."""
        if self.camera.api_version == 1:
            session = self.good("startSession")["results"]["sessionId"]
            self.good("setOptions", sessionId=session, options={"clientVersion": 2})
            self.clock.sleep(1.01)

    def finish(self, answer: dict[str, Any], most_s: float = 400.0) -> dict[str, Any]:
        """Ask until a command is done; only the first answer must have its id."""
        end, number = self.clock.now() + most_s, answer.get("id")
        while answer["state"] == "inProgress":
            assert self.clock.now() < end, "the command never ended"
            self.clock.sleep(0.5)
            answer = self.post("/osc/commands/status", {"id": number})[1]
        return answer

    def files(self, **parameters: Any) -> list[dict[str, Any]]:
        given = {"fileType": "image", "entryCount": 50, "maxThumbSize": 0} | parameters
        entries = self.good("listFiles", **given)["results"]["entries"]
        assert isinstance(entries, list)
        return entries


def content(reply: Reply) -> bytes:
    """Put the bytes of a body together, whatever happens in between."""
    return b"".join(piece for piece in reply.pieces if isinstance(piece, bytes))


def bracket(person: Personality, *times: float, iso: float | None = None) -> dict[str, Any]:
    """Write `_autoBracket` as a model wants it."""
    rules = person.bracket
    assert rules is not None
    shots = []
    for time in times:
        shot: dict[str, Any] = {
            "shutterSpeed": time,
            "iso": iso or person.isos[0],
            "_colorTemperature": 5000,
        }
        if "exposureProgram" in rules.required:
            shot["exposureProgram"] = 1
        if "whiteBalance" in rules.required | rules.optional:
            shot["whiteBalance"] = "_colorTemperature"
        shots.append(shot)
    return {"_bracketNumber": len(shots), "_bracketParameters": shots}


def path_of(url: str) -> str:
    """Path of a URL."""
    return "/" + url.partition("://")[2].partition("/")[2]
