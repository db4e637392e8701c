"""Replies of an imagined camera as bytes, carried to a client without sockets, for tests.

Only the socket is simulated: http.client and urllib3 read what it gives.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from http.client import HTTPException, HTTPResponse
from typing import Any

import requests
import urllib3

from app.devices.bounded_socket import Watch, WatchedAdapter
from app.devices.clock import VirtualClock
from app.devices.passwords import Credentials
from app.devices.simulated.exchange import Pause, Piece
from app.devices.theta.client import OscClient
from app.devices.theta.endpoint import Endpoint
from app.devices.theta.link import Link
from app.devices.theta.reply import Timeouts
from tests.faulty_camera.silence import Drop

FOLDER = "http://192.168.1.1/files/0123456789abcdef0123456789abcdef/100RICOH/"

INFO = {
    "manufacturer": "RICOH",
    "model": "RICOH THETA Z1",
    "serialNumber": "10020030",
    "firmwareVersion": "3.60.3",
    "supportUrl": "https://example.com/support/",
    "gps": False,
    "gyro": True,
    "uptime": 321,
    "api": ["/osc/info", "/osc/state", "/osc/commands/execute", "/osc/commands/status"],
    "endpoints": {"httpPort": 80, "httpUpdatesPort": 80},
    "apiLevel": [2],
    "_wlanMacAddress": "02:00:00:00:00:01",
    "_bluetoothMacAddress": "02:00:00:00:00:02",
}

STATE = {
    "fingerprint": "FIG_0042",
    "state": {
        "batteryLevel": 0.67,
        "storageUri": FOLDER.removesuffix("100RICOH/"),
        "_apiVersion": 2,
        "_batteryState": "charging",
        "_batteryTemp": 31,
        "_boardTemp": 34.5,
        "_cameraError": ["COMPASS_CALIBRATION"],
        "_captureStatus": "idle",
        "_capturedPictures": 0,
        "_function": "normal",
        "_latestFileUrl": f"{FOLDER}R0010021.JPG",
        "_pluginRunning": False,
        "_recordableTime": 0,
        "_recordedTime": 0,
    },
}

PROGRESS = {
    "name": "camera.startCapture",
    "state": "inProgress",
    "id": "41",
    "progress": {"completion": 0.25},
}

TAKEN = {
    "name": "camera.startCapture",
    "state": "done",
    "results": {"fileUrls": [f"{FOLDER}R001002{number}.JPG" for number in range(3)]},
}

REFUSED = {
    "name": "camera.setOptions",
    "state": "error",
    "error": {"code": "disabledCommand", "message": "Command is currently disabled."},
}

OPTIONS = {
    "name": "camera.getOptions",
    "state": "done",
    "results": {"options": {"iso": 100, "shutterSpeedSupport": [0.00004, 0.01666666, 60]}},
}


def entry(number: int, **more: Any) -> dict[str, Any]:
    name = f"R{number:07d}.JPG"
    return {
        "name": name,
        "fileUrl": FOLDER + name,
        "size": 4_000_000 + number,
        "dateTimeZone": "2026:11:21 14:05:09+09:00",
        "width": 6720,
        "height": 3360,
        "isProcessed": True,
        "previewUrl": "",
        "_thumbSize": 4000,
        "_projectionType": "Equirectangular",
        "_autoBracketGroupId": "B0",
    } | more


def listing(entries: Sequence[dict[str, Any]], total: int | None = None) -> dict[str, Any]:
    return {
        "name": "camera.listFiles",
        "state": "done",
        "results": {
            "entries": list(entries),
            "totalEntries": len(entries) if total is None else total,
        },
    }


def http(
    body: object = b"", status: int = 200, headers: dict[str, str] | None = None
) -> list[Piece]:
    """A whole reply; anything but bytes becomes JSON."""
    data = body if isinstance(body, bytes) else json.dumps(body).encode()
    kind = "application/octet-stream" if isinstance(body, bytes) else "application/json"
    fields = {"Content-Type": kind, "Content-Length": str(len(data))} | (headers or {})
    head = f"HTTP/1.1 {status} Words\r\n"
    head += "".join(f"{name}: {value}\r\n" for name, value in fields.items() if value)
    return [head.encode() + b"\r\n", data]


class _Wire(io.RawIOBase):
    """What comes out of the imagined socket, on virtual time."""

    def __init__(
        self, pieces: Sequence[Piece], clock: VirtualClock, limit_s: float, watch: Watch | None
    ) -> None:
        self._pieces = iter(pieces)
        self._rest = memoryview(b"")  # a slice of which costs nothing, however long it is
        self._clock = clock
        self._limit_s = limit_s
        self._watch = watch

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        while not self._rest:
            piece = next(self._pieces, None)
            if piece is None:
                return 0
            if isinstance(piece, Drop):
                raise ConnectionResetError("cut")
            if isinstance(piece, Pause):
                self._clock.sleep(min(piece.seconds, self._limit_s))
                if piece.seconds > self._limit_s or (self._watch and self._watch.late):
                    raise TimeoutError("silent")
            else:
                self._rest = memoryview(piece)
        count = min(len(buffer), len(self._rest))
        buffer[:count], self._rest = self._rest[:count], self._rest[count:]
        return count


@dataclass
class _Socket:
    wire: _Wire

    def makefile(self, mode: str) -> io.BufferedReader:
        del mode
        return io.BufferedReader(self.wire)


class WireAdapter(WatchedAdapter):
    """Answers every request with what `answer` makes of it; its sockets keep the watch too."""

    def __init__(
        self,
        answer: Callable[[requests.PreparedRequest], Sequence[Piece]],
        clock: VirtualClock,
        *,
        keeps_watch: bool = True,
    ) -> None:
        super().__init__()
        self._keeps_watch = keeps_watch
        self._answer = answer
        self._clock = clock
        self.log: list[requests.PreparedRequest] = []

    def send(self, request: requests.PreparedRequest, **how: Any) -> requests.Response:  # type: ignore[override]
        assert how["stream"]
        assert not how["proxies"]
        self.log.append(request)
        watch = self.watch if self._keeps_watch else None
        wire = _Wire(self._answer(request), self._clock, how["timeout"][1], watch)
        low = HTTPResponse(_Socket(wire), method=request.method)  # type: ignore[arg-type]
        try:
            low.begin()
            response = urllib3.HTTPResponse(
                body=low,
                headers=urllib3.HTTPHeaderDict(low.msg.items()),
                status=low.status,
                reason=low.reason,
                preload_content=False,
                decode_content=False,
                original_response=low,
                request_method=request.method,
            )
        except TimeoutError as error:
            raise requests.ReadTimeout(error) from error
        except (HTTPException, OSError) as error:
            low.close()
            inner = urllib3.exceptions.ProtocolError("Connection aborted.", error)
            raise requests.ConnectionError(inner) from error
        except urllib3.exceptions.InvalidHeader as error:
            low.close()
            raise requests.exceptions.InvalidHeader(error) from error
        return self.build_response(request, response)


@dataclass
class Rig:
    """A client with scripted replies, one after the other; the last one stays."""

    replies: list[Any]
    endpoint: Endpoint = field(default_factory=lambda: Endpoint("192.168.1.1"))
    credentials: Credentials | None = None
    timeouts: Timeouts = field(default_factory=Timeouts)
    keeps_watch: bool = True

    def __post_init__(self) -> None:
        self.clock = VirtualClock()
        self.adapter = WireAdapter(self._next, self.clock, keeps_watch=self.keeps_watch)
        self.link = Link(
            self.endpoint,
            self.clock,
            self.credentials,
            adapter=self.adapter,
            timeouts=self.timeouts,
        )
        self.client = OscClient(self.link, self.clock)

    def _next(self, request: requests.PreparedRequest) -> Sequence[Piece]:
        del request
        reply: Sequence[Piece] = self.replies.pop(0) if len(self.replies) > 1 else self.replies[0]
        return reply

    @property
    def asked(self) -> list[Any]:
        """Bodies of all requests as JSON; None for empty ones."""
        bodies = [request.body for request in self.adapter.log]
        return [json.loads(body) if isinstance(body, bytes) else None for body in bodies]
