"""Whatever answers in place of a camera: every call ends soon, in a typed value or a device error.

Replies are derived from good ones by mutation: of their JSON, their bytes, their headers and their
timing. They pass through http.client and urllib3, but not through sockets; time is virtual.
"""

from __future__ import annotations

import copy
import gc
import json
import random
import tracemalloc
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import requests
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.devices.errors import DeviceError
from app.devices.passwords import Credentials
from app.devices.simulated.exchange import Pause, Piece
from app.devices.theta.client import OscClient
from app.devices.theta.endpoint import Endpoint
from app.devices.theta.messages import (
    CommandReply,
    FileEntry,
    Info,
    State,
    parse_command,
    parse_entries,
    parse_info,
    parse_state,
    safe_name,
)
from app.devices.theta.reply import Incoming
from app.devices.theta.untrusted import MAX_BYTES, parse_json
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
    listing,
)

HERE = Endpoint("127.0.0.1", 8080)
SECRET = "sesame-81"
SESSION = {"state": "done", "results": {"sessionId": "SID_1", "timeout": 180}}
OLD_STATE = {"fingerprint": "F", "state": {"_apiVersion": 1, "batteryLevel": 0.5}}
GOOD: list[Any] = [INFO, STATE, OLD_STATE, OPTIONS, PROGRESS, TAKEN, REFUSED, SESSION]
FILES = [listing([entry(number) for number in range(8)], total=40), listing([])]
GOOD += FILES
FITTING: dict[str, list[Any]] = {
    "camera.listFiles": FILES,
    "camera.getOptions": [OPTIONS],
    "camera.startSession": [SESSION],
    "camera.takePicture": [PROGRESS, TAKEN],
    "camera.startCapture": [PROGRESS, TAKEN],
}
JPEG = b"\xff\xd8\xff\xe1" + bytes(range(256)) * 8 + b"\xff\xd9"

JUNK: list[Any] = [
    None, True, False, 0, -1, 1, 2**63, -(2**70), 1e308, 5e-324, 0.1, "", "x", "all", "\x00",
    "\ud800", "é" * 300, "x" * 100_000, [], {}, [[]], {"": None}, [None] * 2000,
    "http://192.168.1.1/../../notes", "file:///private/notes", "//evil.example/x", "\\\\evil\\x",
    "http://evil.example/" + "a" * 5000, "../../x", "R1.JPG\r\nX: y", "serviceUnavailable",
    {"code": "serviceUnavailable"}, {"code": {"code": []}}, "error", "inProgress", "done",
]  # fmt: skip
TROUBLE: list[Piece] = [Drop(), Pause(0.5), Pause(15.0), Pause(100.0)]
RAW: list[bytes] = [
    b"NaN", b"Infinity", b"-Infinity", b"1e999", b"9" * 5000, b"0." + b"1" * 5000,
    b"[" * 2000 + b"]" * 2000, b'{"a":' * 500 + b"1" + b"}" * 500, b'"\\ud800"', b'"\xff\xfe"',
    b'"\\u0000"', b"{" + b'"a":1,' * 2000 + b'"a":2}', b"tru", b"'x'", b"\xef\xbb\xbf", b"",
]  # fmt: skip
HEADERS = [
    "Content-Length: 0", "Content-Length: -1", "Content-Length: 5, 5", "Content-Length: 5, 6",
    "Content-Length: 99999999999999999999", "Content-Length: 1e3", "Content-Length:",
    "Transfer-Encoding: chunked", "Transfer-Encoding: gzip", "Transfer-Encoding: chunked, chunked",
    "Content-Encoding: gzip", "Content-Encoding: identity", "Content-Encoding: br, gzip",
    "Content-Type: text/html", "Content-Type: image/jpeg", "Content-Type: \x00\xff",
    "Content-Type: application/json; charset=utf-16", "Content-Type:", "No colon at all",
    "WWW-Authenticate: Basic realm=x",
    'WWW-Authenticate: Digest realm="\xe4', "WWW-Authenticate: Digest", "Location: http://evil/",
    "Set-Cookie: a=b", "Connection: close", ": empty", "X: " + "y" * 70_000, " folded", "\x00: x",
    *[f"X-{number}: y" for number in range(3)],
]  # fmt: skip
DIGEST = 'WWW-Authenticate: Digest realm="a", nonce="b", qop="auth"'
STATUS_LINES = [
    "HTTP/1.1 200 OK", "HTTP/1.0 200", "HTTP/1.1 206 Partial", "HTTP/1.1 204 Nothing",
    "HTTP/1.1 100 Continue", "HTTP/1.1 302 Found", "HTTP/1.1 304 Same", "HTTP/1.1 400 Bad",
    "HTTP/1.1 401 Who", "HTTP/1.1 403 No", "HTTP/1.1 404 Gone", "HTTP/1.1 416 Range",
    "HTTP/1.1 500 Oh", "HTTP/1.1 503 Busy", "HTTP/1.1 999 What", "HTTP/1.1 99 Low",
    "HTTP/1.1 -1 Minus", "HTTP/1.1 abc", "HTTP/9.9 200 OK", "HTTP/2 200", "SSH-2.0-x", "", "<html>",
    "HTTP/1.1 200 " + "x" * 70_000, "RTSP/1.0 200 OK",
]  # fmt: skip


def mutate_json(value: Any, dice: random.Random) -> Any:
    """Change one place somewhere in a structure."""
    at = value
    while True:
        inner = list(at.values()) if isinstance(at, dict) else at
        deeper = [item for item in inner if isinstance(item, (dict, list)) and item]
        if not deeper or dice.random() < 0.3:
            break
        at = dice.choice(deeper)
    keys = list(at) if isinstance(at, dict) else list(range(len(at)))
    key = dice.choice(keys)
    kind = dice.randrange(5)
    if kind == 0:
        del at[key]
    elif kind == 1 and isinstance(at, dict):
        at[str(dice.choice(["x", "", "error", "state", "results", "fileUrl"]))] = at[key]
    elif kind == 2 and isinstance(at, list):
        at.extend([at[key]] * dice.choice([1, 50, 500]))
    else:
        at[key] = copy.deepcopy(dice.choice(JUNK))
    return value


def mutate_bytes(data: bytes, dice: random.Random) -> bytes:
    """Cut, flip, insert or repeat."""
    kind = dice.randrange(6)
    at = dice.randrange(len(data) + 1)
    if kind == 0:
        return data[:at]
    if kind == 1:
        return data[:at] + bytes([dice.randrange(256)]) + data[at + 1 :]
    if kind == 2:
        return data[:at] + dice.choice(RAW) + data[at:]
    if kind == 3:
        return data.replace(b":", b":" + dice.choice(RAW) + b",", 1)
    if kind == 4:
        return dice.choice(RAW) + data
    return data[:at] * dice.choice([2, 3])


def fitting(request: requests.PreparedRequest) -> list[Any]:
    """Good answers to a request; any other JSON is one for a file."""
    asked = json.loads(request.body) if isinstance(request.body, bytes) else {}
    if request.path_url == "/osc/info":
        return [INFO]
    if request.path_url == "/osc/state":
        return [STATE, OLD_STATE]
    if request.path_url == "/osc/commands/status":
        return [PROGRESS, TAKEN, REFUSED]
    return FITTING.get(asked.get("name", ""), GOOD)


def body(dice: random.Random, request: requests.PreparedRequest) -> bytes:
    is_file = request.method == "GET" and request.path_url != "/osc/info"
    if dice.random() < (0.7 if is_file else 0.1):
        return dice.choice([JPEG, JPEG, b"<html>", b"", JPEG * 300, b" " * 70_000])
    choice = GOOD if dice.random() < 0.1 else fitting(request)
    value = copy.deepcopy(dice.choice(choice))
    for _ in range(dice.choice([0, 1, 1, 2, 5])):
        if isinstance(value, (dict, list)) and value:
            value = mutate_json(value, dice)
    data = json.dumps(value).encode()
    for _ in range(dice.choice([0, 0, 0, 0, 1, 2])):
        data = mutate_bytes(data, dice)
    return data


def endless(dice: random.Random) -> Iterator[Piece]:
    piece = dice.choice([b" ", b"x" * 65536, b"1\r\n \r\n", b"X: y\r\n", b"\xff\xd8"])
    pause = dice.choice([0.0, 0.0, 1.0, 9.0]) if len(piece) > 1000 else dice.choice([1.0, 9.0])
    while True:
        yield piece
        if pause:
            yield Pause(pause)


def reply(dice: random.Random, request: requests.PreparedRequest) -> Iterator[Piece]:
    data = body(dice, request)
    line = "HTTP/1.1 200 OK" if dice.random() < 0.8 else dice.choice(STATUS_LINES)
    fields = [f"Content-Length: {len(data)}"] if dice.random() < 0.7 else []
    fields += dice.choices(HEADERS, k=dice.choice([0, 0, 0, 1, 2, 4]))
    if dice.random() < 0.05:
        line, fields = "HTTP/1.1 401 Who", [*fields, DIGEST]
    if dice.random() < 0.01:
        fields += ["X: y"] * 200
    head = "\r\n".join([line, *fields, "", ""]).encode("latin-1", "replace")
    whole = head + data
    if dice.random() < 0.05:
        whole = mutate_bytes(whole, dice)
    while whole:
        size = dice.choice([1, 100, 10_000, len(whole)])
        yield whole[:size]
        whole = whole[size:]
        if dice.random() < 0.02:
            yield dice.choice(TROUBLE)
    if dice.random() < 0.05:
        yield from endless(dice)


def read(incoming: Incoming) -> int:
    """What a careful reader takes of a stream."""
    assert incoming.status in (200, 206)
    got = 0
    for chunk in incoming.chunks():
        assert chunk
        got += len(chunk)
        if got > 200_000:
            break
    return got


def read_file(client: OscClient) -> int:
    with client.open_file(FOLDER + "R1.JPG", start=5) as incoming:
        return read(incoming)


CALLS: list[Callable[[OscClient], Any]] = [
    lambda client: client.info(),
    lambda client: client.state(),
    lambda client: client.get_options(["iso", "shutterSpeedSupport"]),
    lambda client: client.set_options({"iso": 100}),
    lambda client: client.take_picture(),
    lambda client: client.start_capture("bracket"),
    lambda client: client.status("41"),
    lambda client: client.list_files(30),
    lambda client: client.delete([f"{HERE.base}/files/R1.JPG"]),
    lambda client: client.thumbnail(FOLDER + "R1.JPG"),
    lambda client: client.use_api_2(),
    read_file,
]


def check(value: Any) -> None:
    """What a caller may rely on."""
    if isinstance(value, tuple):
        for item in value:
            check(item)
    elif isinstance(value, FileEntry):
        assert safe_name(value.name) == value.name
        assert value.url.startswith(f"{HERE.base}/")
        assert value.size >= 0
    elif isinstance(value, CommandReply):
        assert value.state in ("done", "inProgress")
        assert value.id is None or isinstance(value.id, (str, int))
        assert all(url.startswith(f"{HERE.base}/") for url in value.file_urls)
    elif isinstance(value, State):
        assert value.latest_file_url == "" or value.latest_file_url.startswith(f"{HERE.base}/")
        assert value.battery_level is None or 0.0 <= value.battery_level <= 1.0
    elif isinstance(value, dict):
        json.dumps(value, allow_nan=False, ensure_ascii=False).encode("utf-8")
    else:
        assert value is None or isinstance(value, (Info, bool, int, bytes))


def check_sentence(error: DeviceError) -> None:
    """What a user may rely on."""
    assert error.message.endswith(".")
    assert error.hint.endswith(".")
    assert str(error).isprintable()
    assert len(str(error)) < 600
    assert SECRET not in str(error)


class Wild(Rig):
    """Makes up a reply to every request; what it holds instead of replies are its dice."""

    def _next(self, request: requests.PreparedRequest) -> Any:
        return reply(self.replies[0], request)


def one_case(seed: int) -> str:
    """Try one call on made-up replies; say how it ended."""
    dice = random.Random(seed)
    keys = Credentials("THETA1", SECRET) if dice.random() < 0.3 else None
    rig = Wild([dice], endpoint=HERE, credentials=keys)
    try:
        check(dice.choice(CALLS)(rig.client))
        ended = "value"
    except DeviceError as error:
        check_sentence(error)
        ended = type(error).__name__
    assert len(rig.adapter.log) <= 250
    # One request may take its whole minute, and the silence that is noticed only after it; a
    # stream may take 10 s for every 1,024 bytes, of which the reader takes at most 200,000.
    assert rig.clock.now() <= 85.0 * len(rig.adapter.log) + 2000.0
    assert all(str(request.url).startswith(f"{HERE.base}/") for request in rig.adapter.log)
    return ended


seeds = st.integers(0, 2**63 - 1)
quickly = settings(
    max_examples=400, deadline=None, suppress_health_check=list(HealthCheck), database=None
)
slowly = settings(quickly, max_examples=20_000)


@quickly
@given(seeds)
def test_every_call_ends_in_a_value_or_a_device_error(seed: int) -> None:
    one_case(seed)


@pytest.mark.sweep
@slowly
@given(seeds)
def test_every_call_ends_in_a_value_or_a_device_error_at_length(seed: int) -> None:
    one_case(seed)


def test_the_cases_reach_every_kind_of_end() -> None:
    ends = {one_case(seed) for seed in range(400)}
    assert ends == {
        "value", "Unreachable", "BadReply", "CameraRefused", "NotACamera", "PasswordNeeded",
    }  # fmt: skip


@pytest.mark.slow
def test_memory_does_not_grow_and_stays_small() -> None:
    for seed in range(50):
        one_case(seed)
    gc.collect()
    tracemalloc.start()
    try:
        for seed in range(50, 150):
            one_case(seed)
        gc.collect()
        before, _ = tracemalloc.get_traced_memory()
        for seed in range(150, 350):
            one_case(seed)
        gc.collect()
        after, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert after - before < 500_000
    assert most < 20 * MAX_BYTES


@pytest.mark.slow
@quickly
@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
        lambda inner: (
            st.lists(inner, max_size=5)
            | st.dictionaries(
                st.sampled_from(
                    [
                        *("model", "api", "firmwareVersion", "apiLevel", "state", "error", "code"),
                        *("results", "id", "progress", "completion", "entries", "name", "fileUrl"),
                        *("fileUrls", "size", "_latestFileUrl", "_cameraError", "batteryLevel"),
                    ]
                ),
                inner,
            )
        ),
        max_leaves=30,
    )
)
def test_any_json_at_all_is_typed_or_refused(value: Any) -> None:
    readers: list[Callable[[Any], Any]] = [
        parse_info,
        lambda parsed: parse_state(parsed, HERE),
        lambda parsed: parse_command(parsed, HERE),
        lambda parsed: parse_entries(parsed if isinstance(parsed, dict) else {}, HERE),
    ]
    for reader in readers:
        try:
            found = reader(parse_json(json.dumps(value).encode()))
        except DeviceError:
            continue
        check(found)


@quickly
@given(st.binary(max_size=400))
def test_any_bytes_at_all_are_read_or_refused(data: bytes) -> None:
    try:
        value = parse_json(data)
    except DeviceError:
        return
    json.dumps(value, allow_nan=False, ensure_ascii=False).encode("utf-8")
