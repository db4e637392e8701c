"""Requests to a simulated camera, and its replies.

The camera has no sockets and maps each `Request` to a `Reply`. The body of a reply is a series of
pieces, each either bytes or a pause. `server` sends the pieces over real HTTP, and tests pass them
to `requests` in the same process, on virtual time.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import Final, TypeAlias

JsonValue: TypeAlias = "bool | int | float | str | list[JsonValue] | dict[str, JsonValue] | None"
"""A JSON value."""

LATENCY_S: Final = 0.012
"""Delay before every reply, in seconds. It also keeps virtual time moving."""

_FORBIDDEN: Final = (
    "tooManyParameters", "disabledCommand", "corruptedFile", "powerOffSequenceRunning",
    "invalidFileFormat", "invalidSessionId", "canceledShooting",
)  # fmt: skip
_LATER: Final = dict.fromkeys(("serviceUnavailable", "unexpected"), 503)
_STATUS: Final = dict.fromkeys(_FORBIDDEN, 403) | _LATER | {"notFound": 404}
_SENTENCES: Final = {
    "unknownCommand": "There is no such command.",
    "missingParameter": "A parameter is missing.",
    "invalidParameterName": "A parameter or option is not known.",
    "invalidParameterValue": "A value is not allowed.",
    "disabledCommand": "This cannot be done in the camera's present state.",
    "canceledShooting": "Shooting was cancelled.",
    "serviceUnavailable": "Not now.",
    "notFound": "There is nothing here.",
}
_LEAST_CHUNK: Final = 16384
_MOST_CHUNK: Final = 65536
_CHUNK_S: Final = 0.01


@dataclass(frozen=True, slots=True)
class Request:
    """A request from a client. Its `method` is "GET" or "POST"."""

    method: str
    target: str
    headers: Mapping[str, str] = field(default_factory=dict)
    body: bytes = b""
    host: str = "192.168.1.1"


@dataclass(frozen=True, slots=True)
class Pause:
    """A pause between pieces of a body."""

    seconds: float


Piece: TypeAlias = bytes | Pause
"""Bytes of a body, or a pause between them."""


@dataclass(frozen=True, slots=True)
class Reply:
    """The camera's reply."""

    status: int
    headers: tuple[tuple[str, str], ...] = ()
    pieces: Iterable[Piece] = ()
    delay_s: float = 0.0


def head_of(status: int, headers: Iterable[tuple[str, str]]) -> bytes:
    """Return the head of a reply, including its empty line."""
    phrase = HTTPStatus(status).phrase if status in set(HTTPStatus) else "Unknown"
    lines = [f"HTTP/1.1 {status} {phrase}", *(f"{name}: {value}" for name, value in headers)]
    return "\r\n".join([*lines, "", ""]).encode("latin-1", "replace")


class CommandRefused(Exception):
    """A refused command, with an OSC error code.

    Args:
        message: Human-readable message, or "" for the default sentence of the code.
    """

    def __init__(self, code: str, message: str = "") -> None:
        super().__init__(code, message)
        self.code = code
        self.message = message or _SENTENCES.get(code, "Something is wrong.")


def json_reply(value: JsonValue, status: int = 200) -> Reply:
    """Return a reply with a JSON body."""
    body = json.dumps(value).encode()
    return text_reply(body, "application/json;charset=utf-8", status)


def text_reply(body: bytes, kind: str, status: int = 200) -> Reply:
    """Return a reply with a short body of the given type."""
    return Reply(status, (*_headers(kind), ("Content-Length", str(len(body)))), (body,), LATENCY_S)


def refusal(name: str, code: str, message: str = "", *, status: int | None = None) -> Reply:
    """Return a reply with an OSC error.

    Args:
        status: HTTP status, or None for the status that corresponds to the code.
    """
    words = message or _SENTENCES.get(code, "Something is wrong.")
    body: dict[str, JsonValue] = {
        "name": name or "unknown",
        "state": "error",
        "error": {"code": code, "message": words},
    }
    return json_reply(body, _STATUS.get(code, 400) if status is None else status)


def file_reply(
    data: bytes,
    range_header: str,
    rate_mbit: float | None,
    *,
    ranges: bool,
) -> Reply:
    """Return a reply with a file or the requested part of it.

    Args:
        rate_mbit: Transfer rate in megabits per second, or None for no limit.
    """
    headers = [*_headers("image/jpeg")]
    if ranges:
        headers.append(("Accept-Ranges", "bytes"))
    start, stop = 0, len(data)
    status = 200
    if range_header and ranges:
        span = _span(range_header, len(data))
        if span is None:
            headers += [("Content-Range", f"bytes */{len(data)}"), ("Content-Length", "0")]
            return Reply(416, tuple(headers), (), LATENCY_S)
        start, stop = span
        status = 206
        headers.append(("Content-Range", f"bytes {start}-{stop - 1}/{len(data)}"))
    headers.append(("Content-Length", str(stop - start)))
    return Reply(status, tuple(headers), paced(data[start:stop], rate_mbit), LATENCY_S)


def paced(data: bytes, rate_mbit: float | None) -> Iterator[Piece]:
    """Split a body into chunks of 16 to 64 kB, with pauses that produce the transfer rate.

    Args:
        rate_mbit: Transfer rate in megabits per second, or None for no limit.
    """
    rate = None if rate_mbit is None else rate_mbit * 125_000.0
    size = _MOST_CHUNK
    if rate is not None:
        size = min(max(int(rate * _CHUNK_S), _LEAST_CHUNK), _MOST_CHUNK)
    for start in range(0, len(data), size):
        chunk = data[start : start + size]
        if rate is not None:
            yield Pause(len(chunk) / rate)
        yield chunk


def _headers(kind: str) -> tuple[tuple[str, str], ...]:
    return ("Content-Type", kind), ("X-Content-Type-Options", "nosniff")


def _span(range_header: str, size: int) -> tuple[int, int] | None:
    """Parse ``bytes=first-`` or ``bytes=first-last``, or return None for anything else."""
    unit, _, span = range_header.partition("=")
    first, dash, last = span.strip().partition("-")
    if unit.strip() != "bytes" or not dash or not (first.isdecimal() and len(span) < 64):
        return None
    start = int(first)
    stop = int(last) + 1 if last.isdecimal() else size
    stop = min(stop, size)
    return (start, stop) if start < stop else None
