"""The commands of the Open Spherical Camera protocol."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from typing import Any, Final, TypeVar

from app.core.base.progress import Token
from app.core.text import tr
from app.devices.clock import Clock, wait
from app.devices.errors import BadReply, CameraNotReady, CameraRefused, DeviceError, Unreachable
from app.devices.mjpeg import MjpegParser, boundary_of
from app.devices.theta.link import Link
from app.devices.theta.messages import (
    CommandReply,
    FileEntry,
    Info,
    State,
    parse_command,
    parse_entries,
    parse_info,
    parse_state,
    safe_url,
)
from app.devices.theta.network_errors import timeout
from app.devices.theta.refusals import BUSY
from app.devices.theta.reply import Incoming
from app.devices.theta.untrusted import (
    JsonValue,
    table,
    whole,
    words,
)

BUSY_PAUSES_S: Final = (0.5, 1.0, 2.0, 2.0, 3.0)
"""Pauses, in seconds, before a request is sent again to a busy camera."""

MAX_LISTED: Final = 100
"""Maximum number of entries per request. Longer lists are read page by page."""

MAX_DELETED: Final = 128
"""Maximum number of files that a camera deletes in one command."""

MAX_THUMBNAIL: Final = 1_000_000
"""Maximum size of a thumbnail, in bytes. Real thumbnails have about ten thousand bytes."""

_PREVIEW: Final = ("width", "height", "framerate")
_MULTIPART: Final = {"Accept": "multipart/x-mixed-replace"}
# seconds that cameras need between a change of options and a preview
_PREVIEW_SETTLE_S: Final = 1.0
_MOST_ORIGINALS: Final = 2000
_NEWEST_API: Final = 2
_JPEG: Final = b"\xff\xd8\xff"
_INFO: Final = "/osc/info"
_STATE: Final = "/osc/state"
_EXECUTE: Final = "/osc/commands/execute"
_STATUS: Final = "/osc/commands/status"
# First timeout of each request. Cameras answer these within a second, and a short timeout makes a
# lost reply cheap. All other requests have the timeout of the link.
_PATIENCE_S: Final = {
    _INFO: 5.0,
    _STATE: 5.0,
    _STATUS: 8.0,
    "camera.getOptions": 6.0,
    "camera.setOptions": 8.0,
    "camera.startSession": 8.0,
    "camera.delete": 10.0,
}
_UPDATE: Final = tr("Update the camera’s firmware with Ricoh’s app.")
_T = TypeVar("_T")


class OscClient:
    """A client for one camera.

    All methods raise the same errors as `Link.get`. They also raise `CameraRefused` for an error
    object with status 200. A request to a busy camera is repeated after the pauses in
    `BUSY_PAUSES_S`. A request repeated after a timeout is given twice the time.
    """

    def __init__(self, link: Link, clock: Clock, token: Token | None = None) -> None:
        self.most_listed = MAX_LISTED  # entries per page
        self.link = link
        self.clock = clock
        self._token = token
        # To delete a file, a camera needs its own form of the URL, which may name another host.
        self._originals: OrderedDict[str, str] = OrderedDict()
        self._late: dict[str, int] = {}

    def info(self) -> Info:
        """Request the camera's description."""
        return self._patiently(lambda: parse_info(self._put(_INFO, "", None)))

    def state(self) -> State:
        """Request the camera's state."""
        endpoint = self.link.endpoint
        return self._patiently(lambda: parse_state(self._put(_STATE, "", None), endpoint))

    def get_options(self, names: Sequence[str]) -> dict[str, JsonValue]:
        """Read options.

        Raises:
            BadReply: If the reply contains no options.
        """
        results = self.execute("camera.getOptions", {"optionNames": list(names)}).results
        options = results.get("options")
        if not isinstance(options, dict):
            raise BadReply(tr("The camera’s settings cannot be read."), tr("Try again."))
        return {name: options[name] for name in names if name in options}

    def set_options(self, options: Mapping[str, JsonValue]) -> None:
        """Change options. After an error, some of them may have changed."""
        self.execute("camera.setOptions", {"options": dict(options)})

    def execute(self, name: str, parameters: Mapping[str, Any] | None = None) -> CommandReply:
        """Send a command without waiting for it to finish.

        Args:
            parameters: Parameters of the command, or None to omit them from the request.
        """
        body: dict[str, Any] = {"name": name}
        if parameters is not None:
            body["parameters"] = parameters
        return self._command(_EXECUTE, body)

    def status(self, command_id: str | int) -> CommandReply:
        """Request the status of a command."""
        return self._command(_STATUS, {"id": command_id})

    def take_picture(self) -> CommandReply:
        """Take a single photo."""
        return self.execute("camera.takePicture")

    def start_capture(self, mode: str | None) -> CommandReply:
        """Start shooting a series.

        Args:
            mode: "bracket" or another mode, or None for the shooting method set on the camera.
        """
        return self.execute("camera.startCapture", None if mode is None else {"_mode": mode})

    def stop_capture(self) -> CommandReply:
        """Stop shooting a series."""
        return self.execute("camera.stopCapture")

    def stop_self_timer(self) -> CommandReply:
        """Stop the self-timer."""
        return self.execute("camera._stopSelfTimer")

    def list_files(self, count: int) -> tuple[FileEntry, ...]:
        """List the photos that have a usable name and URL, each once, newest first."""
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
            # Some cameras return fewer entries than requested; some return the first page forever.
            rows = results.get("entries")
            position += len(rows) if isinstance(rows, list) else 0
            more = position < (whole(results.get("totalEntries")) or 0)
            if len(entries) == count_before or not more:
                break
        return tuple(entries.values())[:count]

    def delete(self, urls: Sequence[str]) -> None:
        """Delete files on the camera.

        Raises:
            DeviceError: With the code "not-a-file" if any entry is not the URL of a file on this
                camera. In that case nothing is deleted. Without this check, some keywords would
                delete all files of a kind.
        """
        if isinstance(urls, str) or not all(self._is_file(url) for url in urls):
            raise DeviceError(
                tr("Only individual files on this camera can be deleted."),
                tr("Reconnect the camera."),
                "not-a-file",
            )
        for first in range(0, len(urls), MAX_DELETED):
            batch = [self._originals.get(url, url) for url in urls[first : first + MAX_DELETED]]
            self.execute("camera.delete", {"fileUrls": batch})

    @contextmanager
    def open_file(self, url: str, *, start: int = 0) -> Iterator[Incoming]:
        """Open a file at byte offset `start`. No other request may be sent until it is closed.

        A camera that supports ranges replies with status 206, and other cameras reply with status
        200 and the whole file.
        """
        headers = {"Accept": "*/*"}
        if start > 0:
            headers["Range"] = f"bytes={start}-"
        with self._streaming(url, headers) as incoming:
            yield incoming

    def thumbnail(self, url: str) -> bytes:
        """Download the thumbnail of a file.

        Returns:
            A JPEG of at most `MAX_THUMBNAIL` bytes, not decoded.

        Raises:
            BadReply: If the thumbnail is larger than that or is not a JPEG.
        """
        data = bytearray()
        end_s = self.clock.now() + self.link.timeouts.whole_s
        mark = "&" if "?" in url else "?"
        with self._streaming(f"{url}{mark}type=thumb", {"Accept": "*/*"}) as incoming:
            for chunk in incoming.chunks():
                data += chunk
                if len(data) > MAX_THUMBNAIL:
                    raise BadReply(
                        tr("The thumbnail is too large."), tr("Download the photo itself.")
                    )
                if self.clock.now() > end_s:
                    raise timeout()
        if not data.startswith(_JPEG):
            raise BadReply(tr("The thumbnail is not a JPEG."), tr("Download the photo itself."))
        return bytes(data)

    @contextmanager
    def live_preview(self, size: tuple[int, int, int] | None = None) -> Iterator[Iterator[bytes]]:
        """Open the live preview. No other request may be sent until it is closed.

        Args:
            size: Columns, rows and frames per second, or None to use the camera's current setting.

        Yields:
            JPEG frames, not decoded, until the camera ends the preview.
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
        """Switch a Theta S or SC to the API version of this client.

        These models revert to the old version on every new connection.

        Returns:
            Whether a switch was necessary.

        Raises:
            CameraNotReady: With the code "old-api" if the camera keeps the old API.
        """
        if self.state().api_version != 1:
            return False
        session = words(self.execute("camera.startSession", {}).results.get("sessionId"), 100)
        self.execute(
            "camera.setOptions",
            {"sessionId": session, "options": {"clientVersion": _NEWEST_API}},
        )
        if self.state().api_version == 1:
            raise CameraNotReady(tr("The camera’s firmware is too old."), _UPDATE, "old-api")
        return True

    def _command(self, path: str, body: Mapping[str, Any]) -> CommandReply:
        def ask() -> CommandReply:
            reply = self._put(path, str(body.get("name", "")), body)
            command = parse_command(reply, self.link.endpoint)
            self._remember(command.results)
            return command

        return self._patiently(ask)

    def _put(self, path: str, name: str, body: Mapping[str, Any] | None) -> JsonValue:
        """Send a request with a separate time limit, which doubles after each timeout."""
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
        """Store the camera's own form of every URL that the results contain."""
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
