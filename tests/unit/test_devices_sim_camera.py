"""The simulated camera, word by word: every model, without faults."""

from __future__ import annotations

import json
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
import pytest

from app.core.camera_catalogue import camera_facts
from app.core.measure.read.makernote import read_ricoh_note
from app.devices.simulated.camera import SimulatedCamera
from app.devices.simulated.cameras import Personality
from app.devices.simulated.exchange import Pause, Request
from tests.faulty_camera.models import PERSONALITIES, personality_named
from tests.faulty_camera.silence import NO_ANSWER_S
from tests.helpers.scaled_clock import ScaledClock
from tests.helpers.simulated import JSON, QUICK, Talker, bracket, content, path_of, room, stored

ALL = [pytest.param(person, id=person.name) for person in PERSONALITIES]
BRACKETING = [pytest.param(p, id=p.name) for p in PERSONALITIES if p.bracket is not None]
TIMES = (0.01666666, 0.06666666, 0.004)
LISTING = json.dumps(
    {
        "name": "camera.listFiles",
        "parameters": {"fileType": "image", "entryCount": 9, "maxThumbSize": 0},
    }
).encode()


def _talker(person: Personality | str, **options: Any) -> Talker:
    talker = Talker(person, **options)
    talker.wake()
    return talker


def _shoot_bracket(talker: Talker, *times: float) -> dict[str, Any]:
    person = talker.camera.personality
    assert person.bracket is not None
    method = {"_shootingMethod": "bracket"} if person.bracket.method else {}
    talker.set(**method, _autoBracket=bracket(person, *times))
    mode = {} if method else {"_mode": "bracket"}
    return talker.good("startCapture", **mode)


def _shutters(talker: Talker) -> list[float]:
    takes = [file.take for file in stored(talker.camera)]
    return [take.exposure.shutter_s for take in takes if take is not None]


@pytest.mark.parametrize("person", ALL)
def test_info_says_what_the_model_says(person: Personality) -> None:
    status, body = Talker(person).get("/osc/info")
    info = json.loads(body)
    assert status == 200
    assert info["model"] == person.model
    assert info["apiLevel"] == ([1, 2] if person.name in {"S", "SC"} else [2])
    assert info["firmwareVersion"] == person.firmware
    assert not info["serialNumber"].startswith(person.prefix or "XX")


@pytest.mark.parametrize("person", ALL)
def test_a_metered_picture_is_taken_and_downloaded(person: Personality) -> None:
    talker = _talker(person)
    before = talker.clock.now()
    answer = talker.good("takePicture")
    assert answer["state"] == "inProgress"
    assert isinstance(answer["id"], int if person.numeric_ids else str)
    assert answer["progress"] == {"completion": 0.0}
    assert not list(stored(talker.camera))
    done = talker.finish(answer)
    assert talker.clock.now() - before >= person.overhead_s
    url = done["results"]["fileUrl"]
    assert url.startswith("http://192.168.1.1/files/")  # where it was asked for
    status, data = talker.get(path_of(url))
    assert status == 200
    assert data == stored(talker.camera)[0].data
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    assert picture.shape[:2] == QUICK
    assert 0.3 < picture.mean() / 255.0 < 0.6


@pytest.mark.parametrize("person", BRACKETING)
def test_a_bracket_is_taken_as_asked(person: Personality) -> None:
    talker = _talker(person)
    answer = _shoot_bracket(talker, *TIMES)
    assert person.bracket is not None
    talker.clock.sleep(sum(TIMES) + 3 * person.overhead_s - 0.5)
    assert len(stored(talker.camera)) == 2
    # A generic state has no word for it.
    assert talker.state()["_captureStatus"] == "bracket shooting"
    talker.clock.sleep(1.0)
    assert _shutters(talker) == list(TIMES)
    assert talker.state()["_captureStatus"] == "idle"
    status = talker.post("/osc/commands/status", {"id": answer["id"]})[1]
    if person.bracket.watched:
        assert status["state"] == "inProgress"
        assert "results" not in status
    else:
        names = [url.rpartition("/")[2] for url in status["results"]["fileUrls"]]
        assert names == [file.name for file in stored(talker.camera)]
    groups = {entry.get("_autoBracketGroupId") for entry in talker.files()}
    assert len(groups) == 1
    assert (None not in groups) == person.bracket.grouped


def test_frames_are_written_one_after_the_other() -> None:
    talker = _talker("V")
    _shoot_bracket(talker, 1, 2, 4)
    seen = []
    for _ in range(30):
        talker.clock.sleep(1.0)
        seen.append(len(stored(talker.camera)))
    assert seen == sorted(seen)
    ends = [seen.index(count) + 1 for count in (1, 2, 3)]
    assert ends == [4, 9, 16]


def test_progress_rises() -> None:
    talker = _talker("Z1")
    answer = _shoot_bracket(talker, 1, 2, 4)
    number = answer["id"]
    shares = []
    while answer["state"] == "inProgress":
        shares.append(answer["progress"]["completion"])
        talker.clock.sleep(1.0)
        answer = talker.post("/osc/commands/status", {"id": number})[1]
        assert "id" not in answer  # as in Ricoh's examples
    assert shares[0] == 0.0
    assert all(a < b < 1.0 for a, b in pairwise(shares))


def test_addresses_are_those_that_the_client_uses() -> None:
    talker = _talker("V")
    talker.finish(talker.good("takePicture"))
    request = Request("POST", "/osc/commands/execute", JSON, LISTING, "127.0.0.1:8123")
    entry = json.loads(content(talker.camera.answer(request)))["results"]["entries"][0]
    assert entry["fileUrl"].startswith("http://127.0.0.1:8123/files/")
    info = talker.camera.answer(Request("GET", "/osc/info", {}, b"", "127.0.0.1:8123"))
    assert json.loads(content(info))["endpoints"] == {"httpPort": 8123, "httpUpdatesPort": 8123}
    assert json.loads(talker.get("/osc/info")[1])["endpoints"]["httpPort"] == 80


def test_api_2_0_lists_images_by_their_place() -> None:
    talker = Talker("S", older_files=5)
    latest = talker.state()["_latestFileUri"]
    first = talker.good("listImages", entryCount=3, includeThumb=False)["results"]
    assert first["entries"][0]["uri"] == latest
    assert talker.camera.storage.find(f"/files/{latest}") is not None
    assert (len(first["entries"]), first["totalEntries"]) == (3, 5)
    token = first["continuationToken"]
    rest = talker.good("listImages", entryCount=3, includeThumb=False, continuationToken=token)
    assert len(rest["results"]["entries"]) == 2
    assert "continuationToken" not in rest["results"]
    small = talker.good("listImages", entryCount=3, maxSize=160)["results"]["entries"]
    assert len(small) == 1
    assert small[0]["thumbnail"]
    assert talker.code("listImages", entryCount=3) == "missingParameter"
    talker.wake()
    assert talker.code("listImages", entryCount=3, includeThumb=False) == "unknownCommand"


def test_deleting_says_what_could_not_be_deleted() -> None:
    for model in ("generic", "insta360"):
        talker = Talker(model, older_files=1)
        url = talker.files()[0]["fileUrl"]
        assert talker.good("delete", fileUrls=[url])["results"] == {"fileUrls": []}


def test_options_that_other_clients_read_first() -> None:
    names = ("dateTimeZone", "offDelay", "_shutterVolume", "sleepDelay")
    for model in ("V", "Z1", "X"):
        assert set(_talker(model).options(*names)) == set(names)
    assert _talker("Z1").options("_shootingMethodSupport") == {"_shootingMethodSupport": []}
    assert 0 in _talker("X").options("offDelaySupport")["offDelaySupport"]


def test_x_takes_equal_frames_without_its_shooting_method() -> None:
    talker = _talker("X")
    talker.set(exposureProgram=1, shutterSpeed=0.02, iso=100)
    talker.set(_autoBracket=bracket(personality_named("X"), *TIMES))
    done = talker.finish(talker.good("startCapture", _mode="bracket"))
    assert len(done["results"]["fileUrls"]) == 3
    assert _shutters(talker) == [0.02] * 3


def test_x_forgets_its_method_with_the_function() -> None:
    talker = _talker("X")
    talker.set(_shootingMethod="bracket")
    assert talker.code("takePicture") == "disabledCommand"
    talker.set(_function="normal")
    assert talker.options("_shootingMethod") == {"_shootingMethod": "normal"}
    assert talker.code("startCapture") == "disabledCommand"


def test_a1_has_no_bracket() -> None:
    talker = _talker("A1")
    assert talker.code("startCapture", _mode="bracket") == "invalidParameterValue"
    assert talker.code("setOptions", options={"_autoBracket": {}}) == "invalidParameterName"
    assert talker.code("setOptions", options={"_shootingMethod": "bracket"}) == (
        "invalidParameterValue"
    )


def test_old_x_refuses_white_balance_in_its_bracket() -> None:
    person = personality_named("X-old")
    wanted = bracket(personality_named("X"), *TIMES)
    talker = _talker(person)
    assert talker.code("setOptions", options={"_autoBracket": wanted}) == "invalidParameterName"


@pytest.mark.parametrize("name", ["S", "SC"])
def test_old_models_must_be_switched_after_every_connection(name: str) -> None:
    talker = Talker(name)
    assert talker.state()["_apiVersion"] == 1
    assert talker.code("startCapture", _mode="bracket") == "unknownCommand"
    assert talker.code("setOptions", options={"clientVersion": 2}) == "missingParameter"
    assert talker.code("setOptions", sessionId="no", options={}) == "invalidSessionId"
    talker.wake()
    state = talker.state()
    assert state["_apiVersion"] == 2
    assert state["_captureStatus"] == "idle"
    assert talker.code("startSession") == "unknownCommand"
    talker.camera.reconnect()
    assert talker.state()["_apiVersion"] == 1


def test_sc2_forgets_its_settings() -> None:
    talker = _talker("SC2")
    talker.set(sleepDelay=65535, exposureProgram=1)
    talker.camera.reconnect()
    assert talker.options("sleepDelay", "exposureProgram") == {
        "sleepDelay": 180,
        "exposureProgram": 2,
    }
    talker = _talker("Z1")
    talker.set(sleepDelay=65535)
    talker.camera.reconnect()
    assert talker.options("sleepDelay") == {"sleepDelay": 65535}


def test_sc2_hangs_when_asked_for_thumbnails() -> None:
    asked = {"fileType": "image", "entryCount": 1, "maxThumbSize": 640}
    body = {"name": "camera.listFiles", "parameters": asked}
    reply = _talker("SC2", older_files=1).ask("POST", "/osc/commands/execute", body)
    assert reply.delay_s >= NO_ANSWER_S
    entries = _talker("Z1", older_files=1).files(maxThumbSize=640, entryCount=1)
    assert entries[0]["thumbnail"]


def test_sc2_cuts_the_connection_when_pictures_follow_too_fast() -> None:
    talker = _talker("SC2")
    talker.finish(talker.good("takePicture"))
    body = {"name": "camera.takePicture"}
    assert talker.ask("POST", "/osc/commands/execute", body).status == 0
    talker.clock.sleep(3.0)
    talker.good("takePicture")


def test_shooting_too_soon_after_options_is_refused() -> None:
    talker = _talker("Z1")
    talker.good("setOptions", options={"captureMode": "image"})
    talker.clock.sleep(0.95)
    assert talker.code("takePicture") == "disabledCommand"
    assert talker.code("startCapture", _mode="bracket") == "disabledCommand"
    talker.clock.sleep(0.1)
    talker.good("takePicture")


def test_nothing_is_taken_while_the_preview_is_open() -> None:
    talker = _talker("V")
    body = {"name": "camera.getLivePreview"}
    reply = talker.ask("POST", "/osc/commands/execute", body)
    pieces = iter(reply.pieces)
    assert b"---osclivepreview---\r\n" in bytes(next(pieces))  # type: ignore[arg-type]
    assert talker.code("takePicture") == "disabledCommand"
    assert talker.code("getLivePreview") == "disabledCommand"
    pieces.close()  # type: ignore[attr-defined]
    talker.finish(talker.good("takePicture"))


def test_a_preview_ends_with_the_mode() -> None:
    talker = _talker("V")
    reply = talker.ask("POST", "/osc/commands/execute", {"name": "camera.getLivePreview"})
    pieces = iter(reply.pieces)
    next(pieces)
    talker.set(captureMode="video")
    assert list(pieces) == []
    assert talker.code("takePicture") == "disabledCommand"


def test_the_preview_rests_after_a_picture_of_an_sc() -> None:
    talker = _talker("SC")
    talker.finish(talker.good("takePicture"))
    codes = []
    for _ in range(4):
        reply = talker.ask("POST", "/osc/commands/execute", {"name": "camera.getLivePreview"})
        codes.append(reply.status)
        if reply.status == 200:
            break
        talker.clock.sleep(0.5)
    assert codes[0] == 403
    assert codes[-1] == 200


def test_nothing_else_happens_while_it_shoots() -> None:
    talker = _talker("Z1")
    _shoot_bracket(talker, 1, 2)
    for name in ("takePicture", "startCapture", "getLivePreview"):
        assert talker.code(name) == "disabledCommand"
    assert talker.code("setOptions", options={"iso": 100}) == "disabledCommand"
    assert talker.files() == []


def test_a_bracket_can_be_stopped() -> None:
    talker = _talker("Z1")
    answer = _shoot_bracket(talker, 1, 2, 4, 8)
    talker.clock.sleep(4.0)
    assert talker.run("stopCapture") == (200, {"name": "camera.stopCapture", "state": "done"})
    done = talker.finish(answer)
    assert done == {"name": "camera.startCapture", "state": "done", "results": {}}
    assert _shutters(talker) == [1, 2]
    assert talker.code("stopCapture") == "disabledCommand"


def test_the_self_timer_counts_down_and_can_be_stopped() -> None:
    talker = _talker("V")
    talker.set(exposureDelay=5)
    answer = talker.good("takePicture")
    talker.clock.sleep(4.0)
    assert talker.state()["_captureStatus"] == "self-timer countdown"
    assert talker.good("_stopSelfTimer")["state"] == "done"
    status, ended = talker.post("/osc/commands/status", {"id": answer["id"]})
    assert status == 403
    assert ended["error"]["code"] == "canceledShooting"
    assert stored(talker.camera) == ()
    answer = talker.good("takePicture")
    talker.clock.sleep(5.1)
    assert talker.state()["_captureStatus"] == "shooting"
    assert talker.finish(answer)["results"]["fileUrl"]


def test_reconnecting_does_not_stop_a_bracket() -> None:
    talker = _talker("S")
    _shoot_bracket(talker, *TIMES)
    talker.clock.sleep(5.0)
    talker.camera.reconnect()
    talker.clock.sleep(60.0)
    assert _shutters(talker) == list(TIMES)
    talker.wake()
    assert len({entry["_autoBracketGroupId"] for entry in talker.files()}) == 1


def test_the_fingerprint_follows_the_state() -> None:
    talker = _talker("Z1")
    first = talker.post("/osc/state")[1]["fingerprint"]
    assert talker.post("/osc/state")[1]["fingerprint"] == first
    talker.good("takePicture")
    assert talker.post("/osc/state")[1]["fingerprint"] != first


def test_files_are_listed_newest_first_and_in_pages() -> None:
    talker = _talker("Z1", older_files=5)
    names = [entry["name"] for entry in talker.files()]
    assert names == sorted(names, reverse=True)
    assert [entry["name"] for entry in talker.files(entryCount=2, startPosition=2)] == names[2:4]
    assert talker.files(startPosition=99) == []
    entry = talker.files(_detail=False)[0]
    assert "width" not in entry
    assert "dateTime" in entry
    assert talker.files(fileType="video") == []
    assert talker.code("listFiles", fileType="image", entryCount=1) == "missingParameter"
    bad = {"fileType": "image", "entryCount": 1, "maxThumbSize": 1}
    assert talker.code("listFiles", **bad) == "invalidParameterValue"


def test_listed_sizes_are_those_of_the_files() -> None:
    talker = _talker("X", older_files=2)
    for entry in talker.files():
        status, data = talker.get(path_of(entry["fileUrl"]))
        assert (status, len(data)) == (200, entry["size"])
        status, thumb = talker.get(path_of(entry["fileUrl"]) + "?type=thumb")
        picture = cv2.imdecode(np.frombuffer(thumb, np.uint8), cv2.IMREAD_COLOR)
        assert picture is not None
        assert picture.shape[:2] == (160, 320)
        assert len(thumb) == entry["_thumbSize"]


def test_deleting_is_all_or_nothing() -> None:
    talker = _talker("V", older_files=3)
    urls = [entry["fileUrl"] for entry in talker.files()]
    bad = [urls[0], urls[1] + "x"]
    assert talker.code("delete", fileUrls=bad) == "invalidParameterValue"
    assert len(talker.files()) == 3
    talker.good("delete", fileUrls=urls[:2])
    assert [entry["fileUrl"] for entry in talker.files()] == urls[2:]
    assert talker.code("delete", fileUrls=[]) == "invalidParameterValue"
    assert talker.code("delete", fileUrls=["all", urls[2]]) == "invalidParameterValue"
    talker.good("delete", fileUrls=["all"])
    assert talker.files() == []


def test_parts_of_files_where_the_model_gives_them() -> None:
    talker = _talker("Z1", older_files=1)
    path = path_of(talker.files()[0]["fileUrl"])
    whole = talker.get(path)[1]
    reply = talker.ask("GET", path, range="bytes=1000-")
    assert reply.status == 206
    assert content(reply) == whole[1000:]
    assert dict(reply.headers)["Content-Range"] == f"bytes 1000-{len(whole) - 1}/{len(whole)}"
    assert talker.get(path, range="bytes=10-19") == (206, whole[10:20])
    assert talker.get(path, range=f"bytes={len(whole)}-")[0] == 416
    talker = _talker("S", older_files=1)
    path = path_of(talker.files()[0]["fileUrl"])
    assert talker.get(path, range="bytes=1000-") == (200, stored(talker.camera)[0].data)


def test_the_transfer_rate_holds() -> None:
    talker = _talker("Z1", rate_mbit=8.0, shape=(256, 512))
    url = talker.finish(talker.good("takePicture"))["results"]["fileUrl"]
    pieces = list(talker.ask("GET", path_of(url)).pieces)
    size = stored(talker.camera)[0].size
    pauses = sum(piece.seconds for piece in pieces if isinstance(piece, Pause))
    assert pauses == pytest.approx(size / 1e6)
    assert max(len(piece) for piece in pieces if isinstance(piece, bytes)) <= 65536


@pytest.mark.parametrize("person", ALL)
def test_wrong_words_are_refused_as_documented(person: Personality) -> None:
    talker = _talker(person)
    assert talker.code("noSuchThing") == "unknownCommand"
    assert talker.code("getOptions") == "missingParameter"
    assert talker.code("getOptions", optionNames=["_no"]) == "invalidParameterName"
    assert talker.code("setOptions", options={"_no": 1}) == "invalidParameterName"
    assert talker.code("setOptions", options={"remainingSpace": 1}) == "invalidParameterName"
    assert talker.code("takePicture", x=1) == "invalidParameterName"
    status, answer = talker.post("/osc/commands/status", {"id": "999"})
    assert (status, answer["error"]["code"]) == (400, "invalidParameterValue")
    assert talker.get("/nothing")[0] == 404
    assert talker.get(f"/files/{person.folder}/R0019999.JPG")[0] == 404
    assert talker.ask("GET", "/osc/state").status == 405


def test_bodies_that_are_no_json_are_refused() -> None:
    talker = Talker("V")
    for body in (b"{", b"[]", b"\xff", b"[" * 100_000, b"x" * 2_000_000):
        reply = talker.camera.answer(Request("POST", "/osc/commands/execute", JSON, body))
        assert reply.status == 503
    # Other people's clients do not all say what they send.
    plain = {"content-type": "text/plain"}
    assert talker.camera.answer(Request("POST", "/osc/state", plain, b"{}")).status == 200
    assert talker.camera.answer(Request("POST", "/osc/state")).status == 200


def test_insta360_wants_its_header() -> None:
    talker = Talker("insta360")
    assert talker.camera.answer(Request("GET", "/osc/info")).status == 403
    assert talker.get("/osc/info")[0] == 200
    assert "_captureStatus" not in talker.state()


def test_lenses_differ_when_the_camera_meters_by_itself(tmp_path: Any) -> None:
    talker = _talker("S", scene=room(0.01))
    talker.finish(talker.good("takePicture"))
    talker.set(exposureProgram=1, iso=200, shutterSpeed=0.5)
    talker.finish(talker.good("takePicture"))
    notes = []
    for file in stored(talker.camera):
        path = tmp_path / file.name
        path.write_bytes(file.data)
        note = read_ricoh_note(path)
        assert note is not None
        notes.append(note.lens_isos)
    # The front is brighter.
    assert notes[0][0] < notes[0][1]
    assert notes[1] == (200.0, 200.0)


@pytest.mark.parametrize("person", ALL)
def test_default_sizes_are_the_models(person: Personality) -> None:
    talker = _talker(person, shape=None, older_files=0)
    size = talker.options("fileFormat")["fileFormat"]
    assert (size["height"], size["width"]) == person.camera.shape
    talker.good("takePicture")
    job = talker.camera.shooter.job
    assert job is not None
    assert job.frames[0].take.shape == person.camera.shape


@pytest.mark.parametrize("person", ALL)
def test_the_tables_of_the_planner_are_accepted(person: Personality) -> None:
    known = camera_facts(person.model) if person.ricoh else None
    if known is None:
        return
    talker = _talker(person)
    talker.set(exposureProgram=1)
    lists = talker.options("shutterSpeedSupport", "isoSupport", "apertureSupport")
    assert set(known.limits.shutters_s) <= set(lists["shutterSpeedSupport"])
    assert set(known.limits.isos) == set(lists["isoSupport"])
    assert list(known.limits.apertures) == lists["apertureSupport"]


def test_on_real_time_frames_are_rendered_ahead() -> None:
    clock = ScaledClock(200.0)
    camera = SimulatedCamera(room(), "Z1", clock, shape=QUICK)
    body = json.dumps({"name": "camera.takePicture"}).encode()
    assert camera.answer(Request("POST", "/osc/commands/execute", JSON, body)).status == 200
    for _ in range(100):
        if stored(camera):
            break
        clock.sleep(1.0)
    assert stored(camera)[0].size > 1000
    camera.close()


def test_a_password_only_where_there_can_be_one() -> None:
    with pytest.raises(ValueError, match="password"):
        Talker("SC2", password="12345678")
    with pytest.raises(ValueError, match="no camera"):
        Talker("Q")


def test_words_that_single_models_have() -> None:
    """As in replies that Ricoh publishes with its own client."""
    states = {name: set(_talker(name).state()) for name in ("S", "SC2", "V", "Z1", "X")}
    both = {"batteryLevel", "storageUri", "_apiVersion", "_captureStatus", "_latestFileUrl"}
    assert all(both <= words for words in states.values())
    only_x = {"_batteryInsert", "_currentStorage", "_storageID", "_currentMicrophone"}
    for name, words in states.items():
        assert (only_x <= words) == (name == "X")
        assert not only_x & words or name == "X"
        assert ("_cameraError" in words) == (name != "S")
        assert ("_boardTemp" in words) == (name in {"Z1", "X"})
    entry = _talker("X", older_files=1).files()[0]
    assert {"_storageID", "_favorite", "_thumbSize", "isProcessed", "previewUrl"} <= set(entry)


@pytest.mark.parametrize(
    ("name", "parameters", "code"),
    [
        ("setOptions", {}, "missingParameter"),
        ("setOptions", {"options": {}}, "invalidParameterValue"),
        ("setOptions", {"options": []}, "invalidParameterValue"),
        ("getOptions", {"optionNames": "iso"}, "invalidParameterValue"),
        ("getOptions", {"optionNames": [1]}, "invalidParameterValue"),
        ("delete", {}, "missingParameter"),
        ("delete", {"fileUrls": "all"}, "invalidParameterValue"),
        ("delete", {"fileUrls": [7]}, "invalidParameterValue"),
        ("startCapture", {"_mode": "composite"}, "invalidParameterValue"),
        ("stopCapture", {}, "disabledCommand"),
        ("_stopSelfTimer", {}, "disabledCommand"),
    ],
)
def test_commands_that_are_refused(name: str, parameters: dict[str, Any], code: str) -> None:
    assert _talker("Z1").code(name, **parameters) == code


@pytest.mark.parametrize("value", [True, -1, "5", 2.5, None])
def test_counts_of_listed_files_are_whole(value: Any) -> None:
    body = {"fileType": "image", "entryCount": value, "maxThumbSize": 0}
    code = _talker("Z1").code("listFiles", **body)
    assert code == ("missingParameter" if value is None else "invalidParameterValue")


def test_commands_of_the_wrong_shape() -> None:
    talker = Talker("V")
    for body in ({}, {"name": 5}, {"name": "camera.getOptions", "parameters": []}):
        assert talker.post("/osc/commands/execute", body)[0] == 400
    assert talker.post("/osc/commands/status", {})[0] == 400


def test_the_old_api_as_far_as_it_goes() -> None:
    talker = Talker("S")
    session = talker.good("startSession")["results"]["sessionId"]
    names = ["exposureProgram"]
    found = talker.good("getOptions", sessionId=session, optionNames=names)
    assert found["results"]["options"] == {"exposureProgram": 2}
    talker.good("updateSession", sessionId=session)
    assert talker.good("takePicture", sessionId=session)["state"] == "inProgress"
    talker.clock.sleep(20.0)
    assert talker.state()["_captureStatus"] == "idle"
    assert len(stored(talker.camera)) == 1


def test_an_sc2_ends_its_preview_when_it_likes() -> None:
    talker = _talker("SC2")
    reply = talker.ask("POST", "/osc/commands/execute", {"name": "camera.getLivePreview"})
    assert 300 <= len(list(reply.pieces)) <= 1500
    talker.finish(talker.good("takePicture"))
