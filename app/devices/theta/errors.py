"""What goes wrong between a camera and its client, in words.

Below HTTP (`failure`), and in what a camera says of itself: its error codes (`REFUSALS`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from http.client import BadStatusLine, RemoteDisconnected, UnknownProtocol
from types import MappingProxyType
from typing import Final

import requests
from urllib3 import exceptions as urllib3_errors

from app.core.text import tr
from app.devices.errors import BadReply, CameraRefused, DeviceError, NotACamera, Unreachable
from app.devices.theta.untrusted import JsonValue, table, words

BUSY: Final = "serviceUnavailable"
"""The one code after which the same request may simply be sent again."""

_UPDATE: Final = tr(
    "Update the camera's firmware with Ricoh's app; if it is new, tell us the model."
)
_RESTART: Final = tr("Restart the camera, then try again.")
_WAIT: Final = tr("Wait a few seconds, then try again.")
REFUSALS: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "unknownCommand": (tr("The camera does not know this command."), _UPDATE),
        "missingParameter": (tr("The request to the camera was incomplete."), _UPDATE),
        "invalidParameterName": (tr("The camera does not know one of the settings."), _UPDATE),
        "invalidParameterValue": (
            tr("The camera does not accept a value, or the file is no longer on it."),
            tr("Connect again, so that the camera's own lists are read again."),
        ),
        "tooManyParameters": (tr("The camera was sent too much at once."), _UPDATE),
        "disabledCommand": (
            tr("The camera cannot do this at the moment."),
            tr(
                "Wait until it has finished, close plug-ins, set it to still pictures, "
                "then try again."
            ),
        ),
        "corruptedFile": (
            tr("A file on the camera is damaged."),
            tr("Take the picture again; if it happens often, check the camera's storage."),
        ),
        "powerOffSequenceRunning": (
            tr("The camera is switching itself off."),
            tr("Switch it on again and charge it if needed."),
        ),
        "invalidFileFormat": (
            tr("The camera cannot store pictures in this format."),
            tr("Choose another picture size."),
        ),
        "canceledShooting": (tr("The shot was cancelled on the camera."), tr("Start it again.")),
        "canceledConversion": (
            tr("The conversion was cancelled on the camera."),
            tr("Start it again."),
        ),
        BUSY: (tr("The camera is busy."), _WAIT),
        "unexpected": (tr("The camera reports a fault of its own."), _RESTART),
        "serverError": (tr("The camera reports a fault of its own."), _RESTART),
        "notFound": (
            tr("This is not on the camera."),
            tr("The file may have been deleted; look at the camera's pictures."),
        ),
        "invalidSessionId": (tr("The camera closed the connection."), tr("Connect again.")),
        "cameraInExclusiveUse": (
            tr("Another app is using the camera."),
            tr("Close it on the other device, or switch the camera's Wi-Fi off and on."),
        ),
        "unactivated": (
            tr("The camera is not activated yet."),
            tr("Activate it with its maker's app, then connect again."),
        ),
    }
)
"""Error code of the camera: a sentence, and what to do next."""

_UNKNOWN: Final = (tr("The camera refused."), _WAIT)
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

_WIFI: Final = tr("Check that the camera is on and this computer is in its Wi-Fi, then try again.")
_NEARER: Final = tr("Go nearer to the camera, then try again; what has arrived is kept.")
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


def refused(value: JsonValue, status: int) -> CameraRefused | None:
    """Find an error object in a message."""
    message = table(value)
    error = message.get("error")
    if not isinstance(error, dict) and message.get("state") != "error":
        return None
    fields = table(error)
    return refusal(words(fields.get("code")), status, words(fields.get("message")))


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
        sentence = tr('The camera refused: "{said}".', said=said or sound)
    return CameraRefused(sentence, hint, sound, status)


def timeout() -> Unreachable:
    """Say that nothing came in time."""
    return Unreachable(tr("The camera does not answer in time."), _WIFI, "timeout")


def broken(code: str = "") -> Unreachable:
    """Say that the connection ended too early."""
    return Unreachable(tr("The connection to the camera broke."), _NEARER, code or "broken")


def no_camera() -> NotACamera:
    """Say that something else answers."""
    return NotACamera(
        tr("Something answers at this address, but it is not a 360 camera."),
        tr(
            "It is probably the router of your own network: choose the camera's "
            'Wi-Fi (its name ends in ".OSC"), or type the address that the camera '
            "has in this network."
        ),
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
            tr("No camera of this name is in the network."),
            tr("Check the spelling, or type the camera's address in numbers."),
            "no-such-name",
        )
    if any(isinstance(link, urllib3_errors.NewConnectionError) for link in chain):
        return Unreachable(tr("Nothing answers at the camera's address."), _WIFI)
    if any(isinstance(link, _TIMEOUTS) for link in chain):
        return timeout()
    if any(_foreign(link) for link in chain):
        return no_camera()
    if any(isinstance(link, _NONSENSE) for link in chain):
        return BadReply(
            tr("The camera sent an invalid response."), tr("Restart the camera, then try again.")
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
