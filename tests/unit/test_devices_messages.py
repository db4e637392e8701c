from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.devices.errors import BadReply, CameraRefused, NotACamera
from app.devices.theta.endpoint import Endpoint
from app.devices.theta.messages import (
    parse_command,
    parse_entries,
    parse_info,
    parse_state,
    safe_name,
)
from app.devices.theta.refusals import REFUSALS, bare_refusal, refusal
from app.devices.theta.untrusted import (
    MAX_BYTES,
    MAX_DEPTH,
    MAX_VALUES,
    JsonValue,
    fraction,
    number,
    parse_json,
    texts,
    whole,
    words,
    write_json,
)
from tests.helpers.osc_wire import FOLDER, INFO, OPTIONS, PROGRESS, REFUSED, STATE, TAKEN, entry

HERE = Endpoint("cam.local", 8080)
THERE = FOLDER.replace("http://192.168.1.1", "http://cam.local:8080")


def as_json(value: Any) -> JsonValue:
    return parse_json(json.dumps(value).encode())


def with_state(**changes: Any) -> JsonValue:
    return as_json({"fingerprint": "F", "state": STATE["state"] | changes})  # type: ignore[operator]


# JSON


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"{",
        b"nothing",
        b"<html></html>",
        b'{"a": NaN}',
        b'{"a": Infinity}',
        b'{"a": -Infinity}',
        b'{"a": 1e999}',
        b'{"a": 1' + b"0" * 50 + b"}",
        b'{"a": 0.' + b"1" * 50 + b"}",
        b"[" * (MAX_DEPTH + 1) + b"]" * (MAX_DEPTH + 1),
        b"[" * 90_000 + b"]" * 90_000,
        b'{"a":' * 90_000,
        b"\xff\xfe{\x00}\x00",
    ],
)
def test_json_that_cannot_be_trusted_is_refused(data: bytes) -> None:
    with pytest.raises(BadReply) as caught:
        parse_json(data)
    assert caught.value.hint


def test_too_much_json_is_refused_before_it_is_read() -> None:
    with pytest.raises(BadReply) as caught:
        parse_json(b'"' + b"x" * MAX_BYTES + b'"')
    assert caught.value.code == "too-large"
    with pytest.raises(BadReply) as caught:
        parse_json(b"[" + b"{}," * MAX_VALUES + b"{}]")
    assert caught.value.code == "too-large"


def test_json_at_the_limits_is_read() -> None:
    deep = b"[" * MAX_DEPTH + b"]" * MAX_DEPTH
    assert parse_json(deep) is not None
    assert parse_json(b"\xef\xbb\xbf{}") == {}
    assert parse_json(b'{"a": 1, "a": 2}') == {"a": 2}


def test_broken_text_does_not_hide_the_rest() -> None:
    value = parse_json(b'{"_imageDescription": "caf\xe9", "\\udc80": "\\ud800x", "size": 5}')
    assert value == {"_imageDescription": "caf\ufffd", "?": "?x", "size": 5}
    json.dumps(value, ensure_ascii=False).encode("utf-8")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.00004, "0.00004"),
        (0.00007812, "0.00007812"),
        (0.01666666, "0.01666666"),
        (60, "60"),
        (2.0, "2.0"),
        (True, "true"),
        (None, "null"),
        ("a\u00e4\u2028", '"a\\u00e4\\u2028"'),
        ([1, (2, 3)], "[1,[2,3]]"),
        ({"a": {"b": []}}, '{"a":{"b":[]}}'),
    ],
)
def test_numbers_leave_digit_for_digit(value: Any, text: str) -> None:
    assert write_json(value) == text.encode()


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers(-(10**30), 10**30) | st.text(max_size=8),
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner),
        max_leaves=12,
    )
)
def test_what_is_written_is_json(value: Any) -> None:
    assert json.loads(write_json(value)) == value


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_floats_come_back_exactly(value: float) -> None:
    written = write_json(value)
    assert float(written) == value
    assert b"e" not in written.lower()


@pytest.mark.parametrize("value", [float("nan"), float("inf"), {1: 2}, object(), b"x"])
def test_what_json_does_not_know_is_not_sent(value: Any) -> None:
    with pytest.raises((ValueError, TypeError)):
        write_json(value)


def test_values_of_the_wrong_type_are_neutral() -> None:
    assert number(True) is None
    assert number("1") is None
    assert number(2) == 2.0
    assert fraction(1.01) is None
    assert fraction(-0.1) is None
    assert whole(5.0) == 5
    assert whole(5.5) is None
    assert whole(-1) is None
    assert whole(10**39) is None
    assert words(5) == ""
    assert words(" a\x1b[31m\nb ") == "a[31mb"
    assert len(words("x" * 5000)) == 200
    assert texts("ABC") == ()
    assert texts(["A", 1, "", "B"]) == ("A", "B")


# Info and state


def test_info() -> None:
    info = parse_info(as_json(INFO | {"model": "RICOH THETA X "}))
    assert info.model == "RICOH THETA X"
    assert info.firmware == (3, 60, 3)
    assert info.api_level == (2,)
    assert info.serial_number == "10020030"
    assert info.uptime_s == 321.0


@pytest.mark.parametrize(
    ("text", "firmware"),
    [
        ("01.82", (1, 82)),
        ("2.10.3", (2, 10, 3)),
        ("", ()),
        ("1.2-beta", ()),
        ("9" * 50, ()),
        ("٣.1", ()),
    ],
)
def test_firmware_versions(text: str, firmware: tuple[int, ...]) -> None:
    info = parse_info(as_json(INFO | {"firmwareVersion": text}))
    assert info.firmware == firmware


@pytest.mark.parametrize(
    "value",
    [
        None,
        [],
        "RICOH THETA V",
        {},
        {"model": "Router 3000"},
        {"model": 5, "api": []},
        {"api": [], "apiLevel": [2]},
    ],
)
def test_info_of_something_else(value: Any) -> None:
    with pytest.raises(NotACamera) as caught:
        parse_info(as_json(value))
    assert "router" in caught.value.hint


def test_state() -> None:
    state = parse_state(as_json(STATE), HERE)
    assert state.battery_level == 0.67
    assert state.capture_status == "idle"
    assert state.latest_file_url == f"{THERE}R0010021.JPG"
    assert state.camera_errors == ("COMPASS_CALIBRATION",)
    assert state.api_version == 2
    assert (state.battery_temperature, state.board_temperature) == (31.0, 34.5)


def test_a_state_of_the_old_api() -> None:
    old = {"sessionId": "SID_1", "batteryLevel": 1, "_latestFileUri": "", "_apiVersion": 1}
    state = parse_state(as_json({"fingerprint": "F", "state": old}), HERE)
    assert (state.api_version, state.battery_level) == (1, 1.0)
    assert state.latest_file_url == ""


def test_wrong_fields_of_a_state_are_neutral() -> None:
    state = parse_state(
        with_state(
            batteryLevel=67,
            _latestFileUrl="file:///private/notes",
            _cameraError="HOT",
            _apiVersion=True,
            _captureStatus=["idle"],
            _pluginRunning="yes",
        ),
        HERE,
    )
    assert state.battery_level is None
    assert state.latest_file_url == ""
    assert state.camera_errors == ()
    assert state.api_version is None
    assert state.capture_status == ""
    assert not state.plugin_running


@pytest.mark.parametrize("value", [None, [], {}, {"state": "done"}, {"state": []}])
def test_no_state(value: Any) -> None:
    with pytest.raises(BadReply):
        parse_state(as_json(value), HERE)


def test_an_error_instead_of_a_state() -> None:
    with pytest.raises(CameraRefused) as caught:
        parse_state(as_json(REFUSED), HERE)
    assert caught.value.code == "disabledCommand"


# Commands


def test_a_command_in_progress() -> None:
    command = parse_command(as_json(PROGRESS), HERE)
    assert (command.state, command.id, command.completion) == ("inProgress", "41", 0.25)


@pytest.mark.parametrize(
    ("sent", "kept"),
    [("41", "41"), (41, 41), ("041", "041"), (True, None), ("4\n", None), ("", None), (None, None)],
)
def test_an_id_is_kept_as_it_came(sent: Any, kept: Any) -> None:
    command = parse_command(as_json(PROGRESS | {"id": sent}), HERE)
    assert command.id == kept
    assert type(command.id) is type(kept)
    assert parse_command(as_json(PROGRESS | {"id": "x" * 101}), HERE).id is None


def test_results_lead_to_this_endpoint() -> None:
    command = parse_command(as_json(TAKEN), HERE)
    assert command.state == "done"
    assert command.file_urls == tuple(f"{THERE}R001002{number}.JPG" for number in range(3))
    assert command.refused_urls == 0


def test_urls_that_cannot_be_used_are_left_out_and_counted() -> None:
    good = f"{FOLDER}R0010020.JPG"
    bad = ["http://192.168.1.1/../x", 7, good, "file:///x", good]
    results = {"fileUrls": bad, "fileUrl": "ftp://x/y", "_dngFileUrl": "", "_fileGroup": [good]}
    command = parse_command(as_json({"state": "done", "results": results}), HERE)
    assert command.file_urls == (f"{THERE}R0010020.JPG",)
    assert command.refused_urls == 4


@pytest.mark.parametrize("results", [{}, {"fileUrls": []}, None])
def test_a_stopped_series_has_no_files(results: Any) -> None:
    reply = {"name": "camera.startCapture", "state": "done", "results": results}
    assert parse_command(as_json(reply), HERE).file_urls == ()


def test_an_error_is_raised() -> None:
    with pytest.raises(CameraRefused) as caught:
        parse_command(as_json(REFUSED), HERE)
    assert (caught.value.code, caught.value.status) == ("disabledCommand", 200)
    assert "cannot do this" in caught.value.message


@pytest.mark.parametrize(
    "error", [{"state": "error"}, {"state": "error", "error": 5}, {"error": {"code": 5}}]
)
def test_an_error_without_a_code_is_still_one(error: Any) -> None:
    with pytest.raises(CameraRefused) as caught:
        parse_command(as_json(error), HERE)
    assert caught.value.code == "unexpected"


@pytest.mark.parametrize("value", [None, [], {}, {"state": "paused"}, {"state": 5}, "done"])
def test_no_command(value: Any) -> None:
    with pytest.raises(BadReply):
        parse_command(as_json(value), HERE)


def test_options_come_back_as_they_were() -> None:
    command = parse_command(as_json(OPTIONS), HERE)
    assert command.results["options"] == OPTIONS["results"]["options"]  # type: ignore[index]


# Files


def entries(*values: Any) -> Any:
    return parse_entries({"entries": as_json(list(values))}, HERE)


def test_a_file() -> None:
    (found,) = entries(entry(15))
    assert found.name == "R0000015.JPG"
    assert found.url == f"{THERE}R0000015.JPG"
    assert found.size == 4_000_015
    assert found.date_time == "2026:11:21 14:05:09+09:00"
    assert found.group_id == "B0"


def test_a_file_with_little_said_of_it() -> None:
    (found,) = entries({"name": "R1.JPG", "fileUrl": FOLDER + "R1.JPG", "dateTime": "x"})
    assert (found.size, found.date_time, found.group_id) == (0, "", None)
    (found,) = entries(entry(1, dateTimeZone=5, dateTime="2026:11:21 14:05:09"))
    assert found.date_time == "2026:11:21 14:05:09"
    (found,) = entries(entry(1, size=-5))
    assert found.size == 0


def test_hostile_names_fall_back_to_the_url_and_hostile_urls_are_left_out() -> None:
    found = entries(
        entry(1, name="../../private/notes"),
        entry(2, fileUrl="http://192.168.1.1/../../private/notes"),
        entry(3, fileUrl="https://evil.example/x.JPG"),
        entry(4, name=None),
        entry(5, name="..", fileUrl=FOLDER + "%41.JPG"),
        "R6.JPG",
        None,
        entry(7),
    )
    assert [item.name for item in found] == ["R0000001.JPG", "R0000004.JPG", "R0000007.JPG"]


@pytest.mark.parametrize(
    "name",
    [
        "",
        ".",
        "..",
        ".hidden",
        "a/b",
        "a\\b",
        "a\x00",
        "a\n",
        "ä.JPG",
        "a b",
        "a:b",
        "CON",
        "nul.jpg",
        "a.",
        "x" * 65,
        "com1.JPG",
        "a\u202e.JPG",
    ],
)
def test_unsafe_names(name: str) -> None:
    assert safe_name(name) == ""


@pytest.mark.parametrize("name", ["R0010015.JPG", "a", "x" * 64, "console.JPG", "IMG_2-1.insp"])
def test_safe_names(name: str) -> None:
    assert safe_name(name) == name


@pytest.mark.parametrize("results", [{}, {"entries": None}, {"entries": {}}])
def test_no_list_of_files(results: Any) -> None:
    with pytest.raises(BadReply):
        parse_entries(results, HERE)


# Refusals


def test_every_code_has_a_sentence_and_a_next_step() -> None:
    for code, (sentence, hint) in REFUSALS.items():
        assert sentence.endswith(".")
        assert hint.endswith(".")
        error = refusal(code, 403)
        assert (error.code, error.status, error.message, error.hint) == (code, 403, sentence, hint)


def test_an_unknown_code_is_kept_and_the_camera_quoted() -> None:
    error = refusal("somethingNew", 200, "No mood for pictures")
    assert error.code == "somethingNew"
    assert "No mood for pictures" in error.message
    assert refusal("rm -rf /\n", 500).code == "unexpected"


def test_codes_for_bare_statuses() -> None:
    assert bare_refusal(503).code == "serviceUnavailable"
    assert bare_refusal(404).code == "notFound"
    assert bare_refusal(500).code == "unexpected"
