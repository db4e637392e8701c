"""The commands of the Open Spherical Camera protocol, and what a camera says, as types.

Every field of a message is checked before it is used; names of its files, too. A message that lacks
what makes it one is a `BadReply`; any other field that is missing, or is not what it should be,
takes a neutral value.
"""

from __future__ import annotations

import re
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any, Final, Literal, TypeVar

from app.core.base.progress import Token
from app.core.text import tr
from app.devices.clock import Clock, wait
from app.devices.errors import BadReply, CameraNotReady, CameraRefused, DeviceError, Unreachable
from app.devices.mjpeg import MjpegParser, boundary_of
from app.devices.theta.endpoint import Endpoint
from app.devices.theta.link import BUSY, Incoming, Link, no_camera, refused, timeout
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
# Windows takes these for devices, whatever follows the dot.
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

    * `name`: 1 to 64 of A-Z a-z 0-9 _ . - without a dot in front: safe as a part of a path.
    * `date_time`: "2026:11:21 14:05:09+09:00", or without the offset; "" where the camera does not
      tell.
    """

    name: str
    url: str
    size: int = 0
    date_time: str = ""
    group_id: str | None = None


def parse_entries(results: Mapping[str, JsonValue], endpoint: Endpoint) -> tuple[FileEntry, ...]:
    """Read the results of camera.listFiles.

    In the camera's order. Entries without a usable URL are left out; one with an unsafe name is
    called by the last part of its URL if that is safe, and left out if not. Raises `BadReply` when
    there is no list.
    """
    entries = results.get("entries")
    if not isinstance(entries, list):
        raise BadReply(tr("The camera sent an invalid list of files."), tr("Try again."))
    parsed = (_entry(table(entry), endpoint) for entry in entries)
    return tuple(entry for entry in parsed if entry is not None)


def safe_name(text: object) -> str:
    """Give a camera's file name if it can be a part of a path on any system, else "".

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
    """Give a URL at an endpoint, or "" for anything that `Endpoint.rewrite` refuses."""
    if not isinstance(value, str) or not value:
        return ""
    try:
        return endpoint.rewrite(value)
    except BadReply:
        return ""


@dataclass(frozen=True, slots=True)
class Info:
    """Answer to /osc/info.

    * `firmware`: (2, 10, 3) of "2.10.3"; empty when it is not made of numbers.
    * `api_level`: (1, 2) for S and SC, (2,) for later models.
    """

    model: str
    serial_number: str = ""
    firmware: tuple[int, ...] = ()
    firmware_text: str = ""
    api_level: tuple[int, ...] = ()
    uptime_s: float | None = None


@dataclass(frozen=True, slots=True)
class State:
    """Answer to /osc/state.

    * `battery_level`: 0 to 1.
    * `battery_state`: "charging", "charged", "disconnect" or something new.
    * `capture_status`: "idle", "shooting", "bracket shooting" and others; "" where a camera does
      not tell.
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
        """Whether the camera does nothing, as far as it tells."""
        return self.capture_status in ("", "idle")


@dataclass(frozen=True, slots=True)
class CommandReply:
    """Answer to a command.

    * `id`: for asking on; must be sent back exactly as it came. None where it came without a usable
      one.
    * `completion`: 0 to 1 while in progress.
    * `results`: what came of it, as the camera put it.
    * `file_urls`: of its files, at the endpoint in use.
    * `refused_urls`: how many addresses cannot be used.
    """

    state: Literal["done", "inProgress"]
    id: str | int | None = None
    completion: float | None = None
    results: Mapping[str, JsonValue] = field(default_factory=dict)
    file_urls: tuple[str, ...] = ()
    refused_urls: int = 0


def parse_info(value: JsonValue) -> Info:
    """Read the answer to /osc/info.

    Raises `CameraRefused` when it is an error object; `NotACamera` when it is not the
    self-description of an OSC camera.
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
    """Read the answer to /osc/state.

    Raises `CameraRefused` when it is an error object; `BadReply` when it is no state.
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
    """Read the answer to a command or to a question about one.

    Raises `CameraRefused` when it is an error object; `BadReply` when it is no such answer.
    """
    error = refused(value, _OK)
    if error is not None:
        raise error
    fields = table(value)
    state, results, number = fields.get("state"), fields.get("results"), _id(fields.get("id"))
    # Some cameras leave the state out once there are results.
    if state == "done" or (state is None and isinstance(results, dict)):
        urls, bad = _files(table(results), endpoint)
        return CommandReply("done", number, None, table(results), urls, bad)
    if state != "inProgress":
        raise _nonsense()
    return CommandReply(
        "inProgress", number, fraction(table(fields.get("progress")).get("completion"))
    )


def _files(results: Mapping[str, JsonValue], endpoint: Endpoint) -> tuple[tuple[str, ...], int]:
    """Bring the addresses of files to an endpoint; count all addresses that cannot be used."""
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


BUSY_PAUSES_S: Final = (0.5, 1.0, 2.0, 2.0, 3.0)
"""Pauses in seconds before a request is sent again to a camera that is busy."""

MAX_LISTED: Final = 100
"""Entries that are asked for at once; more come page by page."""

MAX_DELETED: Final = 128
"""Files that a camera deletes in one command."""

MAX_THUMBNAIL: Final = 1_000_000
"""Largest thumbnail in bytes; real ones have ten thousand."""

_PREVIEW: Final = ("width", "height", "framerate")
_MULTIPART: Final = {"Accept": "multipart/x-mixed-replace"}
_PREVIEW_SETTLE_S: Final = 1.0  # cameras want it between options and a preview
_MOST_ORIGINALS: Final = 2000
_NEWEST_API: Final = 2
_JPEG: Final = b"\xff\xd8\xff"
_INFO: Final = "/osc/info"
_STATE: Final = "/osc/state"
_EXECUTE: Final = "/osc/commands/execute"
_STATUS: Final = "/osc/commands/status"
# How long each question is waited for, the first time: cameras answer these within a second, and
# a shorter wait makes a lost reply cheap. What is not named here has the link's own patience.
_PATIENCE_S: Final = {
    _INFO: 5.0,
    _STATE: 5.0,
    _STATUS: 8.0,
    "camera.getOptions": 6.0,
    "camera.setOptions": 8.0,
    "camera.startSession": 8.0,
    "camera.delete": 10.0,
}
_UPDATE: Final = tr("Update the camera's firmware with Ricoh's app.")

_T = TypeVar("_T")


class OscClient:
    """One camera.

    All methods raise what `Link.get` raises; `CameraRefused` also for an error object inside a
    good reply. A camera that says it is busy is asked again after `BUSY_PAUSES_S`. A question that
    was not answered in time is given twice the time when it is put again.
    """

    def __init__(self, link: Link, clock: Clock, token: Token | None = None) -> None:
        self.most_listed = MAX_LISTED  # Entries asked for at once; the rest comes page by page.
        self.link = link
        self.clock = clock
        self._token = token
        # Cameras know their files under the URLs they gave, which may name another host.
        self._originals: OrderedDict[str, str] = OrderedDict()
        self._late: dict[str, int] = {}

    def info(self) -> Info:
        """Ask what the camera is."""
        return self._patiently(lambda: parse_info(self._put(_INFO, "", None)))

    def state(self) -> State:
        """Ask how the camera is."""
        endpoint = self.link.endpoint
        return self._patiently(lambda: parse_state(self._put(_STATE, "", None), endpoint))

    def get_options(self, names: Sequence[str]) -> dict[str, JsonValue]:
        """Read options. Raises `BadReply` when there are no options in the reply."""
        results = self.execute("camera.getOptions", {"optionNames": list(names)}).results
        options = results.get("options")
        if not isinstance(options, dict):
            raise BadReply(tr("The camera's settings cannot be read."), tr("Try again."))
        return {name: options[name] for name in names if name in options}

    def set_options(self, options: Mapping[str, JsonValue]) -> None:
        """Change options; all of them or, on an error, perhaps some."""
        self.execute("camera.setOptions", {"options": dict(options)})

    def execute(self, name: str, parameters: Mapping[str, Any] | None = None) -> CommandReply:
        """Send a command, without waiting for its end.

        `parameters`: left out of the request when None.
        """
        body: dict[str, Any] = {"name": name}
        if parameters is not None:
            body["parameters"] = parameters
        return self._command(_EXECUTE, body)

    def status(self, command_id: str | int) -> CommandReply:
        """Ask how a command stands."""
        return self._command(_STATUS, {"id": command_id})

    def take_picture(self) -> CommandReply:
        """Take one picture."""
        return self.execute("camera.takePicture")

    def start_capture(self, mode: str | None) -> CommandReply:
        """Start a series.

        `mode`: "bracket" and others; None where the camera's own shooting method decides.
        """
        return self.execute("camera.startCapture", None if mode is None else {"_mode": mode})

    def stop_capture(self) -> CommandReply:
        """Stop a series."""
        return self.execute("camera.stopCapture")

    def stop_self_timer(self) -> CommandReply:
        """Stop a countdown."""
        return self.execute("camera._stopSelfTimer")

    def list_files(self, count: int) -> tuple[FileEntry, ...]:
        """List pictures, the newest first, each once; none whose name or URL cannot be used."""
        entries: dict[str, FileEntry] = {}
        position = 0
        while position < count:
            results = self.execute(
                "camera.listFiles",
                {
                    "fileType": "image",
                    "startPosition": position,
                    "entryCount": min(count - position, self.most_listed),
                    "maxThumbSize": 0,
                    "_detail": True,
                },
            ).results
            count_before = len(entries)
            entries.update(
                {entry.url: entry for entry in parse_entries(results, self.link.endpoint)}
            )
            # Some give fewer at a time than were asked for; some give the first page for ever.
            rows = results.get("entries")
            position += len(rows) if isinstance(rows, list) else 0
            more = position < (whole(results.get("totalEntries")) or 0)
            if len(entries) == count_before or not more:
                break
        return tuple(entries.values())[:count]

    def delete(self, urls: Sequence[str]) -> None:
        """Delete files on the camera.

        Raises `DeviceError` when one of them is not the URL of a file on this camera, and nothing
        was deleted: cameras take some words for whole kinds of files. The code is "not-a-file".
        """
        if isinstance(urls, str) or not all(self._is_file(url) for url in urls):
            raise DeviceError(
                tr("Only single files of this camera can be deleted."),
                tr("Reconnect the camera."),
                "not-a-file",
            )
        for first in range(0, len(urls), MAX_DELETED):
            batch = [self._originals.get(url, url) for url in urls[first : first + MAX_DELETED]]
            self.execute("camera.delete", {"fileUrls": batch})

    @contextmanager
    def open_file(self, url: str, *, start: int = 0) -> Iterator[Incoming]:
        """Open a file.

        `start`: first byte that is wanted. A camera that does not know ranges answers with 200 and
        the whole file; one that does, with 206. Yields the open file. No other request may be sent
        before it is closed.
        """
        headers = {"Accept": "*/*"}
        if start > 0:
            headers["Range"] = f"bytes={start}-"
        with self._streaming(url, headers) as incoming:
            yield incoming

    def thumbnail(self, url: str) -> bytes:
        """Fetch a file's small picture.

        Returns a JPEG of at most `MAX_THUMBNAIL` bytes; that it can be decoded is not checked.
        Raises `BadReply` when it is larger, or no JPEG.
        """
        data = bytearray()
        end_s = self.clock.now() + self.link.timeouts.whole_s
        mark = "&" if "?" in url else "?"
        with self._streaming(f"{url}{mark}type=thumb", {"Accept": "*/*"}) as incoming:
            for chunk in incoming.chunks():
                data += chunk
                if len(data) > MAX_THUMBNAIL:
                    raise BadReply(
                        tr("The thumbnail is too large."), tr("Fetch the picture itself.")
                    )
                if self.clock.now() > end_s:
                    raise timeout()
        if not data.startswith(_JPEG):
            raise BadReply(tr("The thumbnail is not a picture."), tr("Fetch the picture itself."))
        return bytes(data)

    @contextmanager
    def live_preview(self, size: tuple[int, int, int] | None = None) -> Iterator[Iterator[bytes]]:
        """Open the live preview; no other request over this link before it is closed.

        `size`: columns, rows and pictures per second to ask for; None leaves them to the camera.
        Yields JPEG pictures that are not checked, without end unless the camera ends it.
        """
        self.use_api_2()
        parameters: dict[str, JsonValue] = dict(zip(_PREVIEW, size or (), strict=False))
        if parameters:
            with suppress(CameraRefused):
                self.set_options({"previewFormat": parameters})
        wait(self.clock, _PREVIEW_SETTLE_S, self._token)
        with self._streaming(_EXECUTE, _MULTIPART, {"name": "camera.getLivePreview"}) as incoming:
            parser = MjpegParser(boundary_of(incoming.headers.get("content-type", "")))
            yield (jpeg for chunk in incoming.chunks() for jpeg in parser.feed(chunk))

    def use_api_2(self) -> bool:
        """Switch a Theta S or SC to the API that this client speaks.

        They fall back to the old one with every new connection.

        True if it was switched, False if there was nothing to do. Raises `CameraNotReady` when the
        camera stays at the old API; the code is "old-api".
        """
        if self.state().api_version != 1:
            return False
        session = words(self.execute("camera.startSession", {}).results.get("sessionId"), 100)
        self.execute(
            "camera.setOptions",
            {"sessionId": session, "options": {"clientVersion": _NEWEST_API}},
        )
        if self.state().api_version == 1:
            raise CameraNotReady(tr("The camera's firmware is too old."), _UPDATE, "old-api")
        return True

    def _command(self, path: str, body: Mapping[str, Any]) -> CommandReply:
        def ask() -> CommandReply:
            reply = self._put(path, str(body.get("name", "")), body)
            command = parse_command(reply, self.link.endpoint)
            self._remember(command.results)
            return command

        return self._patiently(ask)

    def _put(self, path: str, name: str, body: Mapping[str, Any] | None) -> JsonValue:
        """Put a question with its own patience, which grows while it stays unanswered."""
        what = name or path
        late = self._late.pop(what, 0)
        patience = _PATIENCE_S.get(what, self.link.timeouts.read_s) * 2.0**late
        try:
            if path == _INFO:
                return self.link.get(path, patience)
            return self.link.post(path, body, patience)
        except Unreachable as error:
            if error.code == "timeout":
                self._late[what] = late + 1
            raise

    @contextmanager
    def _streaming(
        self, url: str, headers: Mapping[str, str], body: Mapping[str, Any] | None = None
    ) -> Iterator[Incoming]:
        with ExitStack() as stack:
            yield self._patiently(lambda: stack.enter_context(self.link.stream(url, headers, body)))

    def _patiently(self, ask: Callable[[], _T]) -> _T:
        for pause_s in BUSY_PAUSES_S:
            try:
                return ask()
            except CameraRefused as error:
                if error.code != BUSY:
                    raise
            wait(self.clock, pause_s, self._token)
        return ask()

    def _remember(self, results: Mapping[str, JsonValue]) -> None:
        """Keep the camera's own spelling of every URL in some results."""
        entries = results.get("entries")
        rows = entries if isinstance(entries, list) else [dict(results)]
        for entry in rows:
            fields = table(entry)
            many = fields.get("fileUrls")
            for address in (fields.get("fileUrl"), *(many if isinstance(many, list) else ())):
                here = safe_url(address, self.link.endpoint)
                if here and here != address:
                    self._originals[here] = str(address)
                    self._originals.move_to_end(here)
        while len(self._originals) > _MOST_ORIGINALS:
            self._originals.popitem(last=False)

    def _is_file(self, url: object) -> bool:
        if not isinstance(url, str):
            return False
        base = f"{self.link.endpoint.base}/"
        same = safe_url(url, self.link.endpoint) == url
        return same and url.startswith(base) and not url.endswith("/") and "?" not in url
