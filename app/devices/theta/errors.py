"""What goes wrong between a camera and its client, in words.

Below HTTP (`failure`), in what a reply is (`judge_json`, `judge_stream`), and in what a camera says
of itself: its error codes (`REFUSALS`).
"""

from __future__ import annotations

import re
from contextlib import suppress
from http.client import BadStatusLine, RemoteDisconnected, UnknownProtocol
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, Protocol

import requests
from urllib3 import exceptions as urllib3_errors

from app.devices.errors import BadReply, CameraRefused, DeviceError, NotACamera, Unreachable
from app.devices.theta.untrusted import JsonValue, parse_json, table, words

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_OK: Final = 200
_STREAMS: Final = frozenset({200, 206})
_NOT_OK: Final = 300
_ERRORS: Final = 400
_NOT_FOUND: Final = 404
_SERVER_ERRORS: Final = 500
_ELSEWHERE: Final = frozenset({404, 405, 407, 410, 421, 426, 451, 511})
_ERROR_BYTES: Final = 65536
_PAGE: Final = re.compile(rb"[\s\xef\xbb\xbf]*<")

BUSY: Final = "serviceUnavailable"
"""The one code after which the same request may simply be sent again."""

_UPDATE: Final = "Update the camera's firmware with Ricoh's app; if it is new, tell us the model."
_RESTART: Final = "Restart the camera, then try again."
_WAIT: Final = "Wait a few seconds, then try again."
REFUSALS: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "unknownCommand": ("The camera does not know this command.", _UPDATE),
        "missingParameter": ("The camera misses something in the request.", _UPDATE),
        "invalidParameterName": ("The camera does not know one of the settings.", _UPDATE),
        "invalidParameterValue": (
            "The camera does not accept a value, or the file is no longer on it.",
            "Connect again, so that the camera's own lists are read anew.",
        ),
        "tooManyParameters": ("The camera was given too much at once.", _UPDATE),
        "disabledCommand": (
            "The camera cannot do this at the moment.",
            "Wait until it has finished, close plug-ins, set it to still pictures, then try again.",
        ),
        "corruptedFile": (
            "A file on the camera is damaged.",
            "Take the picture again; if it happens often, check the camera's storage.",
        ),
        "powerOffSequenceRunning": (
            "The camera is switching itself off.",
            "Switch it on again and charge it if needed.",
        ),
        "invalidFileFormat": (
            "The camera cannot store pictures in this format.",
            "Choose another picture size.",
        ),
        "canceledShooting": ("The shot was cancelled on the camera.", "Start it again."),
        "canceledConversion": ("The conversion was cancelled on the camera.", "Start it again."),
        BUSY: ("The camera is busy.", _WAIT),
        "unexpected": ("The camera reports a fault of its own.", _RESTART),
        "serverError": ("The camera reports a fault of its own.", _RESTART),
        "notFound": (
            "This is not on the camera.",
            "The file may have been deleted; look at the camera's pictures.",
        ),
        "invalidSessionId": ("The camera has ended the connection.", "Connect again."),
        "cameraInExclusiveUse": (
            "Another app is using the camera.",
            "Close it on the other device, or switch the camera's Wi-Fi off and on.",
        ),
        "unactivated": (
            "The camera is not activated yet.",
            "Activate it with its maker's app, then connect again.",
        ),
    }
)
"""Error code of the camera: a sentence, and what to do next."""

_UNKNOWN: Final = ("The camera refused.", _WAIT)
_CODE: Final = re.compile(r"[A-Za-z][A-Za-z0-9_.-]{0,59}")
_BY_STATUS: Final = MappingProxyType({404: "notFound", 416: "invalidParameterValue", 503: BUSY})
CLOSED: Final = "closed"
"""Code of the error that a reader gets whose stream was closed from another thread."""

# UnicodeError and ValueError: names that no resolver takes, chunk lengths that are no numbers.
NETWORK_ERRORS: Final = (
    requests.RequestException,
    urllib3_errors.HTTPError,
    OSError,
    UnicodeError,
    ValueError,
)
"""Everything that `requests`, `urllib3` and the sockets below them raise."""

_WIFI: Final = "Check that the camera is on and this computer is in its Wi-Fi, then try again."
_NEARER: Final = "Go nearer to the camera, then try again; what has arrived is kept."
_TIMEOUTS: Final = (
    requests.Timeout,
    urllib3_errors.TimeoutError,
    TimeoutError,
)
_NONSENSE: Final = (
    requests.exceptions.InvalidHeader,
    requests.exceptions.ContentDecodingError,
    urllib3_errors.InvalidHeader,
    urllib3_errors.DecodeError,
    urllib3_errors.ResponseNotChunked,
)


class Answer(Protocol):
    """A reply as far as it is judged."""

    status: int
    headers: Mapping[str, str]

    def whole(self, most: int) -> bytes:
        """Read all of a short body."""


def judge_json(reply: Answer, data: bytes) -> JsonValue:
    """Read a reply that should be JSON.

    Returns the value; an error object inside a good reply is left to the reader of the message.
    Raises `CameraRefused` for an HTTP error, with the camera's code where it gave one; `NotACamera`
    for a web page, a redirect or a path that nobody knows; `BadReply` for anything else that is no
    JSON.
    """
    if _OK <= reply.status < _NOT_OK:
        if _is_page(reply, data):
            raise no_camera()
        return parse_json(data)
    _raise_error_within(data, reply.status)
    elsewhere = reply.status < _ERRORS or reply.status in _ELSEWHERE
    if elsewhere or (reply.status < _SERVER_ERRORS and _is_page(reply, data)):
        raise no_camera()
    raise bare_refusal(reply.status)


def judge_stream(reply: Answer) -> None:
    """Make sure that a reply is something to be streamed.

    Raises `CameraRefused` for an HTTP error, and for an error object where a file should be; 404 is
    "notFound"; `NotACamera` for a redirect, and for a web page where a file should be; `BadReply`
    for a reply of any other kind.
    """
    kind = reply.headers.get("content-type", "").lower()
    if reply.status in _STREAMS:
        if "html" in kind:
            raise no_camera()
        if "json" not in kind:
            return
    data = reply.whole(_ERROR_BYTES)
    _raise_error_within(data, reply.status)
    if _NOT_OK <= reply.status < _ERRORS:
        raise no_camera()
    if reply.status >= _ERRORS:
        raise bare_refusal(reply.status)
    raise BadReply("The camera sent something else than the file.", "Try again.")


def refused(value: JsonValue, status: int) -> CameraRefused | None:
    """Find an error object in a message."""
    message = table(value)
    error = message.get("error")
    if not isinstance(error, dict) and message.get("state") != "error":
        return None
    fields = table(error)
    return refusal(words(fields.get("code")), status, words(fields.get("message")))


def _raise_error_within(data: bytes, status: int) -> None:
    error: CameraRefused | None = None
    with suppress(BadReply):
        error = refused(parse_json(data), status)
    if error is not None:
        raise error


def _is_page(reply: Answer, data: bytes) -> bool:
    return "html" in reply.headers.get("content-type", "").lower() or bool(_PAGE.match(data))


def bare_refusal(status: int) -> CameraRefused:
    """Make the error for a reply that has only an HTTP status."""
    return refusal(_BY_STATUS.get(status, "unexpected"), status)


def refusal(code: str, status: int, said: str = "") -> CameraRefused:
    """Make the error for what a camera answered.

    * `code`: the camera's; one that does not look like a code is taken as "unexpected".
    * `said`: the camera's own sentence, shown only for a code that `REFUSALS` does not know.

    With code and status kept.
    """
    sound = code if _CODE.fullmatch(code) else "unexpected"
    sentence, hint = REFUSALS.get(sound, _UNKNOWN)
    if sound not in REFUSALS:
        sentence = f'The camera refused: "{said or sound}".'
    return CameraRefused(sentence, hint, sound, status)


def timeout() -> Unreachable:
    """Say that nothing came in time."""
    return Unreachable("The camera does not answer in time.", _WIFI, "timeout")


def broken(code: str = "") -> Unreachable:
    """Say that the connection ended too early."""
    return Unreachable("The connection to the camera broke.", _NEARER, code or "broken")


def no_camera() -> NotACamera:
    """Say that something else answers."""
    return NotACamera(
        "Something answers at this address, but it is not a 360 camera.",
        "It is probably the router of your own network: choose the camera's Wi-Fi (its name "
        'ends in ".OSC"), or type the address that the camera has in this network.',
    )


def failure(error: BaseException) -> DeviceError:
    """Say what a failed request means.

    `Unreachable` for silence, refusal and broken connections, `NotACamera` where something speaks
    another language, `BadReply` for headers that make no sense.
    """
    chain = tuple(_chain(error))
    # urllib3 derives its errors of names and refused connections from its timeouts.
    if any(isinstance(link, (urllib3_errors.NameResolutionError, UnicodeError)) for link in chain):
        return Unreachable(
            "No camera of this name is in the network.",
            "Check the spelling, or type the camera's address in numbers.",
            "no-such-name",
        )
    if any(isinstance(link, urllib3_errors.NewConnectionError) for link in chain):
        return Unreachable("Nothing answers at the camera's address.", _WIFI)
    if any(isinstance(link, _TIMEOUTS) for link in chain):
        return timeout()
    if any(_foreign(link) for link in chain):
        return no_camera()
    if any(isinstance(link, _NONSENSE) for link in chain):
        return BadReply(
            "The camera sent an invalid response.", "Restart the camera, then try again."
        )
    return broken()


def _foreign(error: BaseException) -> bool:
    return isinstance(error, (BadStatusLine, UnknownProtocol)) and not isinstance(
        error, RemoteDisconnected
    )


def _chain(error: BaseException) -> Iterator[BaseException]:
    """Walk an error and what it carries; each once."""
    waiting, seen = [error], set()
    while waiting:
        link = waiting.pop()
        if id(link) in seen:
            continue
        seen.add(id(link))
        yield link
        carried = (*link.args, getattr(link, "reason", None), link.__cause__, link.__context__)
        waiting.extend(item for item in carried if isinstance(item, BaseException))
