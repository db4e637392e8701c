from __future__ import annotations

from typing import Any

import pytest

from app.core.base.errors import Cancelled
from app.core.base.progress import Token
from app.devices.errors import (
    BadReply,
    CameraNotReady,
    CameraRefused,
    DeviceError,
    NotACamera,
    Unreachable,
)
from app.devices.simulated.exchange import Pause
from app.devices.theta.client import (
    BUSY_PAUSES_S,
    MAX_DELETED,
    MAX_LISTED,
    MAX_THUMBNAIL,
    OscClient,
)
from app.devices.theta.endpoint import Endpoint
from tests.faulty_camera.silence import Drop
from tests.helpers.osc_wire import (
    FOLDER,
    INFO,
    OPTIONS,
    PROGRESS,
    REFUSED,
    STATE,
    TAKEN,
    Rig,
    entry,
    http,
    listing,
)

BUSY = http({"state": "error", "error": {"code": "serviceUnavailable", "message": "x"}}, 503)
DONE = {"name": "camera.setOptions", "state": "done"}
JPEG = b"\xff\xd8\xff\xe0" + b"p" * 500 + b"\xff\xd9"


def state(version: int) -> Any:
    return STATE | {"state": STATE["state"] | {"_apiVersion": version}}  # type: ignore[operator]


def test_info_and_state() -> None:
    rig = Rig([http(INFO), http(STATE)])
    assert rig.client.info().model == "RICOH THETA Z1"
    assert rig.client.state().battery_level == 0.67
    first, second = rig.adapter.log
    assert (first.method, first.path_url) == ("GET", "/osc/info")
    assert (second.method, second.path_url, second.body) == ("POST", "/osc/state", None)
    assert second.headers["Content-Length"] == "0"


def test_options_are_asked_for_by_name() -> None:
    rig = Rig([http(OPTIONS)])
    names = ["iso", "shutterSpeedSupport", "aperture"]
    options = rig.client.get_options(names)
    assert options == {"iso": 100, "shutterSpeedSupport": [0.00004, 0.01666666, 60]}
    assert rig.asked == [{"name": "camera.getOptions", "parameters": {"optionNames": names}}]


def test_a_reply_without_options_is_a_bad_one() -> None:
    with pytest.raises(BadReply):
        Rig([http(DONE)]).client.get_options(["iso"])


def test_options_are_set_as_they_were_listed() -> None:
    rig = Rig([http(DONE)])
    rig.client.set_options({"shutterSpeed": 0.00004, "iso": 100})
    assert b'"shutterSpeed":0.00004' in rig.adapter.log[0].body  # type: ignore[operator]


def test_a_series_from_start_to_end() -> None:
    numeric = PROGRESS | {"id": 41}
    rig = Rig([http(numeric), http(numeric), http(TAKEN)])
    started = rig.client.start_capture("bracket")
    assert started.id == 41
    assert rig.client.status(started.id).completion == 0.25
    assert len(rig.client.status("041").file_urls) == 3
    assert rig.asked == [
        {"name": "camera.startCapture", "parameters": {"_mode": "bracket"}},
        {"id": 41},
        {"id": "041"},
    ]


def test_commands_without_parameters() -> None:
    rig = Rig([http(DONE)])
    rig.client.take_picture()
    rig.client.start_capture(None)
    rig.client.stop_capture()
    rig.client.stop_self_timer()
    assert rig.asked == [
        {"name": f"camera.{name}"}
        for name in ("takePicture", "startCapture", "stopCapture", "_stopSelfTimer")
    ]


@pytest.mark.parametrize("status", [200, 400, 403])
def test_an_error_keeps_its_code_and_status(status: int) -> None:
    rig = Rig([http(REFUSED, status)])
    with pytest.raises(CameraRefused) as caught:
        rig.client.take_picture()
    assert (caught.value.code, caught.value.status) == ("disabledCommand", status)
    assert caught.value.hint
    assert len(rig.adapter.log) == 1


def test_an_error_in_place_of_info_or_state() -> None:
    rig = Rig([http(REFUSED)])
    with pytest.raises(CameraRefused):
        rig.client.info()
    with pytest.raises(CameraRefused):
        rig.client.state()


def test_a_web_page_is_no_camera() -> None:
    page = http(b"<!DOCTYPE html><title>404</title>", 404, {"Content-Type": "text/html"})
    with pytest.raises(NotACamera) as caught:
        Rig([page]).client.info()
    assert "router" in caught.value.hint


# Busy cameras


@pytest.mark.parametrize("bursts", [1, len(BUSY_PAUSES_S)])
def test_a_burst_of_503_is_waited_for(bursts: int) -> None:
    rig = Rig([*[BUSY] * bursts, http(STATE)])
    assert rig.client.state().capture_status == "idle"
    assert rig.clock.now() == pytest.approx(sum(BUSY_PAUSES_S[:bursts]))


def test_busy_without_an_end() -> None:
    rig = Rig([BUSY])
    with pytest.raises(CameraRefused) as caught:
        rig.client.take_picture()
    assert caught.value.code == "serviceUnavailable"
    assert len(rig.adapter.log) == len(BUSY_PAUSES_S) + 1
    assert rig.clock.now() == pytest.approx(sum(BUSY_PAUSES_S))


def test_busy_in_a_good_reply_and_without_a_body() -> None:
    rig = Rig([http({"error": {"code": "serviceUnavailable"}}), http(b"", 503), http(DONE)])
    rig.client.stop_capture()
    assert len(rig.adapter.log) == 3


def test_a_busy_camera_can_be_left() -> None:
    rig = Rig([BUSY])
    token = Token()
    token.cancel()
    with pytest.raises(Cancelled):
        OscClient(rig.link, rig.clock, token).state()


def test_a_busy_camera_is_asked_again_for_a_file() -> None:
    rig = Rig([BUSY, http(JPEG)])
    with rig.client.open_file(FOLDER + "R1.JPG") as incoming:
        assert b"".join(incoming.chunks()) == JPEG


@pytest.mark.parametrize("pieces", [[Drop()], [Pause(100.0)], [b"HTTP/1.1 200 OK\r\n", Drop()]])
def test_a_broken_connection_is_not_tried_again_here(pieces: Any) -> None:
    rig = Rig([pieces])
    with pytest.raises(Unreachable):
        rig.client.take_picture()
    assert len(rig.adapter.log) == 1


# Files


def test_a_listing_asks_for_no_thumbnails() -> None:
    rig = Rig([http(listing([entry(3), entry(2)], total=36))])
    assert [item.name for item in rig.client.list_files(2)] == ["R0000003.JPG", "R0000002.JPG"]
    assert rig.asked[0]["parameters"] == {
        "fileType": "image",
        "startPosition": 0,
        "entryCount": 2,
        "maxThumbSize": 0,
        "_detail": True,
    }


def test_a_long_listing_comes_page_by_page() -> None:
    files = [entry(number) for number in range(250, 0, -1)]
    pages = [http(listing(files[at : at + 100], total=250)) for at in (0, 100, 200)]
    rig = Rig(pages)
    assert len(rig.client.list_files(1000)) == 250
    asked = [body["parameters"] for body in rig.asked]
    assert [item["startPosition"] for item in asked] == [0, 100, 200]
    assert max(item["entryCount"] for item in asked) == MAX_LISTED


def test_a_camera_that_gives_fewer_at_a_time_is_asked_on() -> None:
    files = [entry(number) for number in range(25, 0, -1)]
    pages = [http(listing(files[at : at + 10], total=25)) for at in (0, 10, 20)]
    assert len(Rig(pages).client.list_files(25)) == 25


def test_a_camera_that_repeats_its_first_page_is_not_asked_for_ever() -> None:
    rig = Rig([http(listing([entry(2), entry(1)], total=1000))])
    assert len(rig.client.list_files(1000)) == 2
    assert len(rig.adapter.log) == 2


def test_more_than_was_asked_for_is_cut() -> None:
    rig = Rig([http(listing([entry(number) for number in range(9)]))])
    assert len(rig.client.list_files(3)) == 3
    assert rig.client.list_files(0) == ()


def test_files_are_deleted_under_the_name_the_camera_gave() -> None:
    rig = Rig(
        [http(listing([entry(1)])), http(TAKEN), http(DONE)],
        endpoint=Endpoint("127.0.0.1", 8080),
    )
    (file,) = rig.client.list_files(1)
    taken = rig.client.take_picture().file_urls
    assert file.url.startswith("http://127.0.0.1:8080/files/")
    rig.client.delete([file.url, taken[0], "http://127.0.0.1:8080/files/R9.JPG"])
    assert rig.asked[-1]["parameters"] == {
        "fileUrls": [
            FOLDER + "R0000001.JPG",
            FOLDER + "R0010020.JPG",
            "http://127.0.0.1:8080/files/R9.JPG",
        ]
    }


@pytest.mark.parametrize(
    "urls",
    [
        ["all"],
        ["image"],
        ["VIDEO "],
        "all",
        "http://192.168.1.1/files/R1.JPG",
        ["http://192.168.1.1/files/R1.JPG", "all"],
        ["http://192.168.1.2/files/R1.JPG"],
        ["http://192.168.1.1.evil.example/R1.JPG"],
        ["http://192.168.1.1"],
        ["http://192.168.1.1/"],
        ["http://192.168.1.1/files/"],
        ["http://192.168.1.1/files/../R1.JPG"],
        ["http://192.168.1.1/files/R1.JPG?x"],
        ["/files/R1.JPG"],
        [""],
        [None],
    ],
)
def test_nothing_but_files_of_this_camera_is_deleted(urls: Any) -> None:
    rig = Rig([http(DONE)])
    with pytest.raises(DeviceError) as caught:
        rig.client.delete(urls)
    assert caught.value.code == "not-a-file"
    assert rig.adapter.log == []


def test_many_files_are_deleted_in_parts() -> None:
    rig = Rig([http(DONE)])
    rig.client.delete([f"{FOLDER}R{number}.JPG" for number in range(MAX_DELETED + 1)])
    assert [len(body["parameters"]["fileUrls"]) for body in rig.asked] == [MAX_DELETED, 1]
    rig.client.delete([])
    assert len(rig.adapter.log) == 2


def test_a_file_is_continued_with_a_range() -> None:
    rig = Rig([http(JPEG), http(JPEG[10:], 206)])
    with rig.client.open_file(FOLDER + "R1.JPG") as incoming:
        assert (incoming.status, incoming.length) == (200, len(JPEG))
    assert "Range" not in rig.adapter.log[0].headers
    with rig.client.open_file(FOLDER + "R1.JPG", start=10) as incoming:
        assert incoming.status == 206
        assert b"".join(incoming.chunks(7)) == JPEG[10:]
    assert rig.adapter.log[1].headers["Range"] == "bytes=10-"


def test_a_file_is_fetched_from_this_endpoint_only() -> None:
    rig = Rig([http(JPEG)], endpoint=Endpoint("127.0.0.1", 8080))
    with rig.client.open_file("http://evil.example/files/R1.JPG"):
        pass
    assert rig.adapter.log[0].url == "http://127.0.0.1:8080/files/R1.JPG"
    with pytest.raises(BadReply), rig.client.open_file("file:///private/notes"):
        pass
    assert len(rig.adapter.log) == 1


def test_a_file_that_is_gone() -> None:
    page = http(b"<html>", 404, {"Content-Type": "text/html"})
    with pytest.raises(CameraRefused) as caught, Rig([page]).client.open_file(FOLDER + "R1.JPG"):
        pass
    assert (caught.value.code, caught.value.status) == ("notFound", 404)


def test_thumbnails() -> None:
    rig = Rig([http(JPEG)])
    assert rig.client.thumbnail(FOLDER + "R1.JPG") == JPEG
    assert rig.client.thumbnail(FOLDER + "R1.JPG?x=1") == JPEG
    assert [request.path_url.rpartition("R1.JPG")[2] for request in rig.adapter.log] == [
        "?type=thumb",
        "?x=1&type=thumb",
    ]


@pytest.mark.parametrize("data", [b"", b"GIF89a", JPEG + b"x" * MAX_THUMBNAIL])
def test_thumbnails_that_are_none(data: bytes) -> None:
    with pytest.raises(BadReply):
        Rig([http(data)]).client.thumbnail(FOLDER + "R1.JPG")


def test_a_thumbnail_that_drips_ends() -> None:
    drops: list[Any] = [http(JPEG, 200, {"Content-Length": "900000"})[0]]
    for _ in range(900):
        drops += [b"x" * 200, Pause(1.0)]
    rig = Rig([drops])
    with pytest.raises(Unreachable):
        rig.client.thumbnail(FOLDER + "R1.JPG")
    assert rig.clock.now() <= rig.link.timeouts.whole_s + 2.0


# The API of S and SC


def test_a_theta_s_is_switched_to_the_new_api() -> None:
    session = {"name": "camera.startSession", "state": "done", "results": {"sessionId": "SID_7"}}
    rig = Rig([http(state(1)), http(session), http(DONE), http(state(2))])
    assert rig.client.use_api_2()
    assert rig.asked[2] == {
        "name": "camera.setOptions",
        "parameters": {"sessionId": "SID_7", "options": {"clientVersion": 2}},
    }
    assert not rig.client.use_api_2()
    assert len(rig.adapter.log) == 5


def test_a_theta_s_that_stays_old_is_said() -> None:
    session = {"name": "camera.startSession", "state": "done", "results": {"sessionId": "SID_7"}}
    rig = Rig([http(state(1)), http(session), http(DONE), http(state(1))])
    with pytest.raises(CameraNotReady) as caught:
        rig.client.use_api_2()
    assert caught.value.code == "old-api"
    assert caught.value.hint
