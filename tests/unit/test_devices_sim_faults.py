"""The faults of the simulated camera: each shows, and those that go away do so."""

from __future__ import annotations

import json
from itertools import islice
from typing import Any

import pytest

from app.devices.simulated.exchange import Reply
from tests.faulty_camera.faults import FAULTS, Faults, faults_named
from tests.faulty_camera.models import PERSONALITIES, personality_named
from tests.faulty_camera.silence import NO_ANSWER_S, Drop
from tests.helpers.simulated import Talker, bracket, content, path_of, stored

LASTING = frozenset(
    {
        "401",
        "storage-full",
        "battery-low",
        "overheating",
        "unequal-lens-iso",
        "never-done",
        "404-router-in-place-of-the-camera",
    }
)
"""Those that do not go away by themselves."""

SEEDS = range(8)
TIMES = (0.01666666, 0.06666666, 0.004)


class Patient(Talker):
    """Asks again when it is refused or nobody answers, as a patient client would."""

    def ask(self, method: str, target: str, body: Any = None, **headers: str) -> Reply:
        for _ in range(60):
            reply = super().ask(method, target, body, **headers)
            if reply.delay_s >= NO_ANSWER_S:
                self.clock.sleep(3.0)
                continue
            self.clock.sleep(reply.delay_s)
            if not any(name == "Content-Length" for name, _ in reply.headers):
                continue
            if reply.status in {403, 503} or b'"error"' in b"".join(
                piece for piece in islice(reply.pieces, 2) if isinstance(piece, bytes)
            ):
                self.clock.sleep(1.0)
                continue
            # The generator of a file was begun: ask for it afresh.
            return super().ask(method, target, body, **headers) if method == "GET" else reply
        raise AssertionError(f"{target} was never answered")


def _talker(fault: str, person: str = "Z1", seed: int = 0, **options: Any) -> Talker:
    return Talker(person, faults=[fault], seed=seed, **options)


def _file(talker: Talker) -> tuple[str, bytes]:
    file = stored(talker.camera)[-1]
    return file.path, file.data


def test_every_fault_is_described_and_known() -> None:
    assert all(sentence.endswith(".") for sentence in FAULTS.values())
    assert set(FAULTS) >= LASTING
    with pytest.raises(ValueError, match="no fault 'rain'"):
        Faults(["rain"], 0)


def test_without_faults_nothing_fires() -> None:
    talker = Talker("Z1")
    talker.finish(talker.good("takePicture"))
    assert not any(talker.camera.faults.fired(name) for name in FAULTS)


@pytest.mark.parametrize("seed", SEEDS)
def test_drop_during_download(seed: int) -> None:
    talker = _talker("drop-during-download", seed=seed, older_files=1)
    path, data = _file(talker)
    broken = 0
    for _ in range(8):
        pieces = list(talker.ask("GET", path).pieces)
        sent = b"".join(piece for piece in pieces if isinstance(piece, bytes))
        if any(isinstance(piece, Drop) for piece in pieces):
            broken += 1
            assert data.startswith(sent)
            assert len(sent) < len(data)
    assert 1 <= broken <= 3
    assert talker.camera.faults.fired("drop-during-download") == broken
    assert talker.get(path) == (200, data)


@pytest.mark.parametrize("seed", SEEDS)
def test_truncated_jpeg(seed: int) -> None:
    talker = _talker("truncated-jpeg", seed=seed, older_files=1)
    path, data = _file(talker)
    short = 0
    for _ in range(6):
        reply = talker.ask("GET", path)
        sent = content(reply)
        assert dict(reply.headers)["Content-Length"] == str(len(sent))
        short += len(sent) < len(data)
    assert 1 <= short <= 2
    assert talker.get(path) == (200, data)
    assert talker.files()[0]["size"] == len(data)


@pytest.mark.parametrize("seed", SEEDS)
def test_wrong_content_length(seed: int) -> None:
    talker = _talker("wrong-content-length", seed=seed, older_files=1)
    path, data = _file(talker)
    wrong = 0
    for _ in range(8):
        reply = talker.ask("GET", path)
        assert content(reply) == data
        wrong += dict(reply.headers)["Content-Length"] != str(len(data))
    assert 1 <= wrong <= 3


@pytest.mark.parametrize("seed", SEEDS)
def test_drop_during_exposure(seed: int) -> None:
    talker = _talker("drop-during-exposure", "S", seed)
    talker.wake()
    for _ in range(2):
        # The first or the second picture, as the seed has it.
        answer = talker.run("takePicture")
        if answer[0] != 200:
            talker.wake()
            talker.good("takePicture")
        silent = 0
        for _ in range(60):
            reply = talker.ask("POST", "/osc/state")
            silent += reply.delay_s >= NO_ANSWER_S
            talker.clock.sleep(1.0)
        if talker.camera.faults.fired("drop-during-exposure"):
            break
    assert 2 <= silent <= 21
    assert talker.state()["_apiVersion"] == 1
    assert all(file.size > 0 for file in stored(talker.camera))
    assert len(stored(talker.camera)) == len(talker.camera.shooter.jobs)


@pytest.mark.parametrize("seed", SEEDS)
def test_503_bursts(seed: int) -> None:
    talker = _talker("503-bursts", seed=seed)
    codes = [talker.post("/osc/state")[0] for _ in range(60)]
    bad = codes.count(503)
    assert 2 <= bad <= 12
    assert set(codes) == {200, 503}
    assert codes[-5:] == [200] * 5


@pytest.mark.parametrize("name", ["setOptions", "takePicture"])
def test_disabled_while_preview_is_open(name: str) -> None:
    talker = _talker("disabledcommand-while-preview-is-open")
    options = {"options": {"captureMode": "image"}} if name == "setOptions" else {}
    codes = [talker.run(name, **options)[0] for _ in range(5)]
    assert codes[0] == 403
    assert 200 in codes


@pytest.mark.parametrize("seed", SEEDS)
def test_disabled_too_soon_after_set_options(seed: int) -> None:
    talker = _talker("disabledcommand-too-soon-after-setoptions", seed=seed)
    talker.set(captureMode="image")
    assert talker.code("takePicture") == "disabledCommand"
    talker.clock.sleep(3.5)
    talker.good("takePicture")
    assert talker.camera.faults.fired("disabledcommand-too-soon-after-setoptions")


def test_401() -> None:
    talker = _talker("401")
    for _ in range(30):
        reply = talker.ask("GET", "/osc/info")
        assert reply.status == 401
        assert dict(reply.headers)["WWW-Authenticate"].startswith("Digest ")


@pytest.mark.parametrize("seed", SEEDS)
def test_storage_full(seed: int) -> None:
    talker = _talker("storage-full", seed=seed)
    room = talker.options("remainingPictures")["remainingPictures"]
    assert 0 <= room <= 3
    talker.set(_autoBracket=bracket(personality_named("Z1"), *TIMES))
    if room:
        done = talker.finish(talker.good("startCapture", _mode="bracket"))
        assert len(done["results"]["fileUrls"]) == min(room, 3)
    if room <= 3:
        assert talker.code("takePicture") == "disabledCommand"
        assert talker.state()["_cameraError"][-1] == "NO_MEMORY"
        assert talker.options("remainingPictures") == {"remainingPictures": 0}
    assert talker.camera.faults.fired("storage-full")


def test_battery_low() -> None:
    talker = _talker("battery-low")
    assert talker.state()["batteryLevel"] < 0.05
    assert talker.code("takePicture") == "powerOffSequenceRunning"


@pytest.mark.parametrize("seed", SEEDS)
def test_overheating(seed: int) -> None:
    talker = _talker("overheating", "X", seed)
    for _ in range(2):
        status, answer = talker.run("takePicture")
        if status == 200:
            talker.finish(answer)
    assert talker.code("takePicture") == "disabledCommand"
    assert "HIGH_TEMPERATURE" in talker.state()["_cameraError"]
    assert talker.state()["_boardTemp"] > 60


def _sleeps(talker: Talker) -> bool:
    return talker.ask("GET", "/osc/info").delay_s >= NO_ANSWER_S


@pytest.mark.parametrize("seed", SEEDS)
def test_sleep(seed: int) -> None:
    talker = _talker("sleep", "SC2", seed)
    for _ in range(10):
        while _sleeps(talker):
            talker.clock.sleep(3.0)
        talker.clock.sleep(10.0)
    assert 1 <= talker.camera.faults.fired("sleep") <= 2
    talker = _talker("sleep", "SC2", seed)
    while _sleeps(talker):
        talker.clock.sleep(3.0)
    before = talker.camera.faults.fired("sleep")
    talker.set(sleepDelay=65535)
    for _ in range(10):
        talker.clock.sleep(10.0)
        assert not _sleeps(talker)
    assert talker.camera.faults.fired("sleep") == before


@pytest.mark.parametrize("seed", SEEDS)
def test_error_in_a_200(seed: int) -> None:
    talker = _talker("error-in-a-200", seed=seed)
    states = [talker.run("getOptions", optionNames=["iso"]) for _ in range(15)]
    assert {status for status, _ in states} == {200}
    wrong = [answer for _, answer in states if answer["state"] == "error"]
    assert 2 <= len(wrong) <= 4
    status, answer = talker.run("getOptions", optionNames=["_no"])
    assert (status, answer["error"]["code"]) == (200, "invalidParameterName")


@pytest.mark.parametrize("name", [p.name for p in PERSONALITIES if p.ricoh])
def test_equal_exposures(name: str) -> None:
    person = personality_named(name)
    talker = _talker("equal-exposures", name)
    talker.wake()
    if person.bracket is not None:
        method = {"_shootingMethod": "bracket"} if person.bracket.method else {}
        talker.set(**method, _autoBracket=bracket(person, *TIMES))
        talker.good("startCapture", **({} if method else {"_mode": "bracket"}))
        talker.clock.sleep(60.0)
    else:
        for time in TIMES:
            talker.set(exposureProgram=1, iso=100, shutterSpeed=time)
            talker.finish(talker.good("takePicture"))
    takes = [file.take for file in stored(talker.camera)]
    times = [take.exposure.shutter_s for take in takes if take is not None]
    assert times.count(TIMES[0]) > 1
    assert talker.camera.faults.fired("equal-exposures")


def test_unequal_lens_iso() -> None:
    talker = _talker("unequal-lens-iso")
    talker.set(exposureProgram=1, iso=200, shutterSpeed=0.01)
    talker.finish(talker.good("takePicture"))
    take = stored(talker.camera)[0].take
    assert take is not None
    assert take.lens_gain[0] != take.lens_gain[1]
    assert talker.camera.faults.fired("unequal-lens-iso")


@pytest.mark.parametrize("seed", SEEDS)
def test_slow_status(seed: int) -> None:
    talker = _talker("slow-status", seed=seed)
    number = talker.good("takePicture")["id"]
    slow = [talker.ask("POST", "/osc/commands/status", {"id": number}).delay_s for _ in range(12)]
    assert sum(delay > 20.0 for delay in slow) == 1
    assert 4 <= sum(delay > 2.0 for delay in slow) <= 8
    assert slow[-1] < 0.1


@pytest.mark.parametrize("name", ["Z1", "X", "A1", "generic"])
def test_never_done(name: str) -> None:
    person = personality_named(name)
    talker = _talker("never-done", name)
    if person.bracket is None:
        answer = talker.good("takePicture")
    else:
        method = {"_shootingMethod": "bracket"} if person.bracket.method else {}
        talker.set(**method, _autoBracket=bracket(person, *TIMES))
        answer = talker.good("startCapture", **({} if method else {"_mode": "bracket"}))
    talker.clock.sleep(1000.0)
    status = talker.post("/osc/commands/status", {"id": answer["id"]})[1]
    assert status["state"] == "inProgress"
    assert len(talker.files()) == (1 if person.bracket is None else 3)
    assert talker.camera.faults.fired("never-done")


def test_router_in_place_of_the_camera() -> None:
    talker = _talker("404-router-in-place-of-the-camera")
    for method, path in (("GET", "/osc/info"), ("POST", "/osc/state")):
        reply = talker.ask(method, path)
        assert reply.status == 404
        assert dict(reply.headers)["Content-Type"] == "text/html"
        assert b"router" in content(reply)


@pytest.mark.parametrize("seed", SEEDS)
def test_hostile_file_names(seed: int) -> None:
    talker = _talker("hostile-file-names", seed=seed, older_files=3)
    true = {file.name for file in stored(talker.camera)}
    lists = [[entry["name"] for entry in talker.files()] for _ in range(10)]
    assert all(true <= set(names) for names in lists)
    assert set(lists[0]) - true
    assert set(lists[-1]) == true


@pytest.mark.parametrize("seed", SEEDS)
def test_hostile_urls(seed: int) -> None:
    talker = _talker("hostile-urls", seed=seed, older_files=1)
    good = talker.camera.url(stored(talker.camera)[0])
    urls = [talker.state()["_latestFileUrl"] for _ in range(20)]
    assert 2 <= sum(url != good for url in urls) <= 8
    assert urls[-1] == good


@pytest.mark.parametrize("seed", SEEDS)
def test_endless_response(seed: int) -> None:
    talker = _talker("endless-response", seed=seed)
    endless = 0
    for _ in range(20):
        reply = talker.ask("POST", "/osc/state")
        if "Content-Length" in dict(reply.headers):
            json.loads(content(reply))
        else:
            endless += 1
            assert len(list(islice(reply.pieces, 20_000))) == 20_000
    assert 1 <= endless <= 2


def test_clock_unset() -> None:
    talker = _talker("clock-unset", older_files=1)
    assert talker.files()[0]["dateTimeZone"][:4] in {"1969", "1970", "1999", "2000"}
    assert "NO_DATE_SETTING" in talker.state()["_cameraError"]
    talker.set(dateTimeZone="2026:03:01 10:00:00+01:00")
    assert "NO_DATE_SETTING" not in talker.state()["_cameraError"]
    talker.finish(talker.good("takePicture"))
    assert talker.files()[0]["dateTimeZone"].startswith("2026:03:01 10:00")
    assert talker.code("setOptions", options={"dateTimeZone": "2026:13:01 10:00:00"}) == (
        "invalidParameterValue"
    )


def test_the_same_seed_gives_the_same_troubles() -> None:
    def history(seed: int) -> list[int]:
        talker = Talker("Z1", faults=["503-bursts", "error-in-a-200"], seed=seed)
        return [talker.run("getOptions", optionNames=["iso"])[0] for _ in range(40)]

    assert history(3) == history(3)
    assert len({tuple(history(seed)) for seed in SEEDS}) > 3


@pytest.mark.parametrize("person", [pytest.param(p, id=p.name) for p in PERSONALITIES])
@pytest.mark.parametrize("fault", sorted(set(FAULTS) - LASTING))
def test_who_is_patient_gets_a_picture(fault: str, person: Any) -> None:
    talker = Patient(person, faults=[fault], seed=5)
    for _ in range(30):
        talker.wake()
        status, answer = talker.run("takePicture")
        if status == 200 and answer.get("state") != "error":
            break
        talker.clock.sleep(1.0)
    talker.clock.sleep(30.0)
    assert stored(talker.camera)
    talker.state()
    talker.wake()
    assert any(
        entry["name"] == stored(talker.camera)[0].name and path_of(entry["fileUrl"])
        for _ in range(10)
        for entry in talker.files()
    )


def test_faults_are_found_by_what_a_user_writes() -> None:
    assert faults_named(["Wrong-Content-Length", "wrong-content-length"]) == (
        "wrong-content-length",
    )
    assert set(faults_named(["disabledCommand"])) == {n for n in FAULTS if n.startswith("disabled")}
    with pytest.raises(ValueError, match="no fault 'thunder'"):
        faults_named(["401", "thunder"])
