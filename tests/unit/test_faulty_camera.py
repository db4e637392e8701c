"""The faulty camera without faults is the program's own, and knows every fault by itself."""

from __future__ import annotations

import json
from typing import Any

import pytest

from app.devices.clock import VirtualClock
from app.devices.simulated.camera import SimulatedCamera
from app.devices.simulated.cameras import PERSONALITIES, Personality
from app.devices.simulated.exchange import Pause, Request
from tests.faulty_camera import models
from tests.faulty_camera.camera import FaultyCamera, store_older
from tests.helpers.simulated import JSON, QUICK, bracket, path_of, room

_TIMES = (0.01666666, 0.06666666, 0.004)


def conversation(camera: SimulatedCamera) -> list[Any]:
    """Ask a camera of everything: state, options, pictures, a bracket, files. The whole answers."""
    answers: list[Any] = []

    def ask(method: str, target: str, body: Any = None) -> dict[str, Any]:
        data = b"" if body is None else json.dumps(body).encode()
        reply = camera.answer(Request(method, target, JSON, data))
        pieces = list(reply.pieces)
        answers.append((reply.status, reply.headers, pieces, reply.delay_s))
        camera.clock.sleep(sum(each.seconds for each in pieces if isinstance(each, Pause)) + 5.0)
        content = b"".join(each for each in pieces if isinstance(each, bytes))
        answer: dict[str, Any] = json.loads(content) if content[:1] == b"{" else {}
        return answer

    def run(name: str, **parameters: Any) -> dict[str, Any]:
        return ask(
            "POST",
            "/osc/commands/execute",
            {"name": f"camera.{name}", "parameters": parameters},
        )

    person = camera.personality
    ask("GET", "/osc/info")
    ask("POST", "/osc/state")
    run("getOptions", optionNames=["iso", "remainingPictures", "dateTimeZone"])
    run("setOptions", options={"exposureProgram": 1})
    run("takePicture")
    run("takePicture")
    if person.bracket is not None:
        method = {"_shootingMethod": "bracket"} if person.bracket.method else {}
        run("setOptions", options=method | {"_autoBracket": bracket(person, *_TIMES)})
        number = run("startCapture", **({} if method else {"_mode": "bracket"})).get("id")
        ask("POST", "/osc/commands/status", {"id": number})
        camera.clock.sleep(100.0)
        ask("POST", "/osc/commands/status", {"id": number})
    camera.clock.sleep(100.0)
    ask("POST", "/osc/state")
    listing = run("listFiles", fileType="image", entryCount=9, maxThumbSize=0)
    for entry in listing["results"]["entries"]:
        ask("GET", path_of(entry["fileUrl"]))
    run("unheardOf")
    return answers


@pytest.mark.parametrize("person", PERSONALITIES, ids=lambda person: person.name)
def test_faulty_camera_without_faults_answers_as_the_good_one(person: Personality) -> None:
    good = SimulatedCamera(room(), person, VirtualClock(), shape=QUICK)
    store_older(good, 1)
    faulty = FaultyCamera(room(), person, VirtualClock(), shape=QUICK, older_files=1)
    faulty.api_version = 2
    answers = conversation(good)
    assert len({status for status, *_ in answers}) >= 2
    assert conversation(faulty) == answers


def test_old_firmwares_follow_their_models() -> None:
    names = [person.name for person in models.PERSONALITIES]
    assert names[names.index("V") + 1] == "V-old"
    assert names[names.index("X") + 1] == "X-old"
    shared = [name for name in names if not name.endswith("-old") and name != "insta360"]
    assert shared == [person.name for person in PERSONALITIES]
