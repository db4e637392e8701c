"""A camera's messages as types: its description, state, command replies and file list.

Every field of a message is checked before use, including file names. A message that lacks an
essential field is a `BadReply`. Any other missing or invalid field is given a neutral value.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

from app.core.text import tr
from app.devices.errors import BadReply
from app.devices.theta.endpoint import Endpoint
from app.devices.theta.network_errors import no_camera
from app.devices.theta.refusals import refused
from app.devices.theta.untrusted import (
    JsonValue,
    flag,
    fraction,
    number,
    table,
    texts,
    whole,
    words,
)

_NAME: Final = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}")
_DATE: Final = re.compile(r"\d{4}:\d\d:\d\d \d\d:\d\d:\d\d(?:[+-]\d\d:\d\d)?", re.ASCII)
_LARGEST_FILE: Final = 2**40
# Windows treats these as devices, whatever follows the dot.
_RESERVED: Final = re.compile(r"(?i:con|prn|aux|nul|com\d|lpt\d)(?:\..*)?")
_OK: Final = 200
_FIRMWARE: Final = re.compile(r"\d{1,6}(?:\.\d{1,6}){0,5}", re.ASCII)
_LONGEST_ID: Final = 100
_HINT: Final = tr("Try again. If the problem persists, restart the camera.")
_URL_KEYS: Final = frozenset({"fileUrl", "_dngFileUrl", "previewUrl", "_localFileUrl"})
_URL_LISTS: Final = frozenset({"fileUrls", "_fileGroup", "_localFileGroup", "convertedFileUrls"})


@dataclass(frozen=True, slots=True)
class FileEntry:
    """A file on the camera.

    Attributes:
        name: 1 to 64 characters of A-Z a-z 0-9 _ . - without a leading dot, safe in a path.
        date_time: Date, such as "2026:11:21 14:05:09+09:00", possibly without the offset, or "" if
            the camera does not state one.
    """

    name: str
    url: str
    size: int = 0
    date_time: str = ""
    group_id: str | None = None


def parse_entries(results: Mapping[str, JsonValue], endpoint: Endpoint) -> tuple[FileEntry, ...]:
    """Parse the results of camera.listFiles, keeping the camera's order.

    An entry without a usable URL is skipped. An unsafe name is replaced with the last part of the
    URL. If that is also unsafe, the entry is skipped.

    Raises:
        BadReply: If there is no list.
    """
    entries = results.get("entries")
    if not isinstance(entries, list):
        raise BadReply(tr("The camera sent an invalid list of files."), tr("Try again."))
    parsed = (_entry(table(entry), endpoint) for entry in entries)
    return tuple(entry for entry in parsed if entry is not None)


def safe_name(text: object) -> str:
    """Return a file name if it is safe in a path on any system, or else "".

    Examples:
        >>> safe_name("R0010015.JPG"), safe_name("../R0010015.JPG")
        ('R0010015.JPG', '')
    """
    if not isinstance(text, str) or not _NAME.fullmatch(text) or text.endswith("."):
        return ""
    return "" if _RESERVED.fullmatch(text) else text


def _entry(fields: Mapping[str, JsonValue], endpoint: Endpoint) -> FileEntry | None:
    url = safe_url(fields.get("fileUrl"), endpoint)
    name = safe_name(fields.get("name")) or safe_name(url.partition("?")[0].rpartition("/")[2])
    if not url or not name:
        return None
    date = next(
        (
            text
            for key in ("dateTimeZone", "dateTime", "_dateTimeZone")
            if _DATE.fullmatch(text := words(fields.get(key), 40))
        ),
        "",
    )
    return FileEntry(
        name=name,
        url=url,
        size=whole(fields.get("size"), _LARGEST_FILE) or 0,
        date_time=date,
        group_id=words(fields.get("_autoBracketGroupId"), 80) or None,
    )


def safe_url(value: object, endpoint: Endpoint) -> str:
    """Return a URL rewritten for an endpoint, or "" if `Endpoint.rewrite` rejects it."""
    if not isinstance(value, str) or not value:
        return ""
    try:
        return endpoint.rewrite(value)
    except BadReply:
        return ""


@dataclass(frozen=True, slots=True)
class Info:
    """Reply to /osc/info.

    Attributes:
        firmware: Version, such as (2, 10, 3) for "2.10.3", or an empty tuple if the version does
            not consist of numbers.
        api_level: (1, 2) for S and SC, (2,) for later models.
    """

    model: str
    serial_number: str = ""
    firmware: tuple[int, ...] = ()
    firmware_text: str = ""
    api_level: tuple[int, ...] = ()
    uptime_s: float | None = None


@dataclass(frozen=True, slots=True)
class State:
    """Reply to /osc/state.

    Attributes:
        battery_level: Battery charge, 0 to 1.
        battery_state: "charging", "charged", "disconnect" or another word.
        capture_status: "idle", "shooting", "bracket shooting" or another word, or "" if the camera
            does not state it.
    """

    battery_level: float | None = None
    battery_state: str = ""
    capture_status: str = ""
    latest_file_url: str = ""
    camera_errors: tuple[str, ...] = ()
    api_version: int | None = None
    plugin_running: bool = False
    board_temperature: float | None = None
    battery_temperature: float | None = None

    @property
    def idle(self) -> bool:
        """Whether the camera reports that it is idle, or reports no status at all."""
        return self.capture_status in ("", "idle")


@dataclass(frozen=True, slots=True)
class CommandReply:
    """Reply to a command.

    Attributes:
        id: Identifier for status requests, sent back unchanged, or None if there is no usable one.
        completion: Progress from 0 to 1.
        results: The camera's results, unchanged.
        file_urls: URLs of the resulting files, rewritten for the endpoint in use.
        refused_urls: Number of unusable URLs.
    """

    state: Literal["done", "inProgress"]
    id: str | int | None = None
    completion: float | None = None
    results: Mapping[str, JsonValue] = field(default_factory=dict)
    file_urls: tuple[str, ...] = ()
    refused_urls: int = 0


def parse_info(value: JsonValue) -> Info:
    """Parse the reply to /osc/info.

    Raises:
        CameraRefused: If the reply is an error object.
        NotACamera: If the reply does not describe an OSC camera.
    """
    error = refused(value, _OK)
    if error is not None:
        raise error
    fields = table(value)
    model = words(fields.get("model"))
    if not model or not ({"api", "apiLevel", "endpoints", "firmwareVersion"} & fields.keys()):
        raise no_camera()
    text = words(fields.get("firmwareVersion"), 40)
    levels = fields.get("apiLevel")
    numbers = [whole(level, 100) for level in levels[:10]] if isinstance(levels, list) else []
    return Info(
        model=model,
        serial_number=words(fields.get("serialNumber"), 40),
        firmware=tuple(int(part) for part in text.split(".")) if _FIRMWARE.fullmatch(text) else (),
        firmware_text=text,
        api_level=tuple(level for level in numbers if level is not None),
        uptime_s=number(fields.get("uptime")),
    )


def parse_state(value: JsonValue, endpoint: Endpoint) -> State:
    """Parse the reply to /osc/state.

    Raises:
        CameraRefused: If the reply is an error object.
        BadReply: If the reply contains no state.
    """
    fields = table(value).get("state")
    if not isinstance(fields, dict):
        raise refused(value, _OK) or _nonsense()
    return State(
        battery_level=fraction(fields.get("batteryLevel")),
        battery_state=words(fields.get("_batteryState"), 40),
        capture_status=words(fields.get("_captureStatus"), 80),
        latest_file_url=safe_url(fields.get("_latestFileUrl"), endpoint),
        camera_errors=texts(fields.get("_cameraError")),
        api_version=whole(fields.get("_apiVersion"), 100),
        plugin_running=flag(fields.get("_pluginRunning")) or False,
        board_temperature=number(fields.get("_boardTemp")),
        battery_temperature=number(fields.get("_batteryTemp")),
    )


def parse_command(value: JsonValue, endpoint: Endpoint) -> CommandReply:
    """Parse the reply to a command or to a status request.

    Raises:
        CameraRefused: If the reply is an error object.
        BadReply: If the reply has any other form.
    """
    error = refused(value, _OK)
    if error is not None:
        raise error
    fields = table(value)
    state, results, number = fields.get("state"), fields.get("results"), _id(fields.get("id"))
    # Some cameras omit the state once there are results.
    if state == "done" or (state is None and isinstance(results, dict)):
        urls, bad = _files(table(results), endpoint)
        return CommandReply("done", number, None, table(results), urls, bad)
    if state != "inProgress":
        raise _nonsense()
    return CommandReply(
        "inProgress", number, fraction(table(fields.get("progress")).get("completion"))
    )


def _files(results: Mapping[str, JsonValue], endpoint: Endpoint) -> tuple[tuple[str, ...], int]:
    """Return the URLs of the files at an endpoint, and the number of unusable URLs."""
    lists = {key: value for key in _URL_LISTS if isinstance(value := results.get(key), list)}
    single = (results.get(key) for key in _URL_KEYS)
    addresses = [*filter(None, single), *(url for urls in lists.values() for url in urls)]
    groups = [results.get("fileUrl"), *lists.get("fileUrls", ()), *lists.get("_fileGroup", ())]
    good = (safe_url(url, endpoint) for url in groups)
    bad = sum(not safe_url(url, endpoint) for url in addresses)
    return tuple(dict.fromkeys(url for url in good if url)), bad


def _id(value: object) -> str | int | None:
    if isinstance(value, str) and 0 < len(value) <= _LONGEST_ID and value.isprintable():
        return value
    return value if isinstance(value, int) and not isinstance(value, bool) else None


def _nonsense() -> BadReply:
    return BadReply(tr("The camera sent an invalid response."), _HINT)
