"""Failed requests: timeouts, broken connections and devices that are not cameras."""

from __future__ import annotations

from collections.abc import Iterator
from http.client import BadStatusLine, RemoteDisconnected, UnknownProtocol
from typing import Final

import requests
from urllib3 import exceptions as urllib3_errors

from app.core.text import tr
from app.devices.errors import BadReply, DeviceError, NotACamera, Unreachable

CLOSED: Final = "closed"
"""Error code for a stream that was closed by another thread."""

BROKEN: Final = "broken"
"""Error code for a connection that ended too early."""

NOBODY: Final = "connection-refused"
"""Error code for an address that refuses connections because no program is listening."""

NO_SUCH_NAME: Final = "no-such-name"
"""Error code for a host name that does not exist on the network."""

# UnicodeError and ValueError cover invalid host names and invalid chunk lengths.
NETWORK_ERRORS: Final = (
    requests.RequestException,
    urllib3_errors.HTTPError,
    OSError,
    UnicodeError,
    ValueError,
)
"""All exceptions raised by `requests`, `urllib3` and the sockets below them."""

_WIFI: Final = tr(
    "Check that the camera is on and this computer has joined its Wi-Fi, then try again."
)
_NEARER: Final = tr("Move closer to the camera, then try again. Finished downloads are kept.")
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


def timeout() -> Unreachable:
    """Return the error for a reply that did not arrive in time."""
    return Unreachable(tr("The camera did not answer in time."), _WIFI, "timeout")


def broken(code: str = "") -> Unreachable:
    """Return the error for a connection that ended too early."""
    return Unreachable(tr("The connection to the camera was interrupted."), _NEARER, code or BROKEN)


def no_camera() -> NotACamera:
    """Return the error for a device that is not a camera."""
    return NotACamera(
        tr("The device at this address is not a 360 camera."),
        tr(
            "It is probably your router: join the camera’s Wi-Fi (its name ends in “.OSC”), "
            "or type the camera’s address on this network."
        ),
    )


def failure(error: BaseException) -> DeviceError:
    """Convert an exception raised by a request into a `DeviceError`.

    Returns:
        `Unreachable` for timeouts and for refused or broken connections, `NotACamera` for a device
        that uses another protocol, or `BadReply` for invalid headers.
    """
    chain = tuple(_chain(error))
    # urllib3 derives its errors for unknown names and refused connections from its timeouts.
    if any(isinstance(link, (urllib3_errors.NameResolutionError, UnicodeError)) for link in chain):
        return Unreachable(
            tr("There is no camera with this name on the network."),
            tr("Check the spelling, or type the camera’s IP address."),
            NO_SUCH_NAME,
        )
    if any(isinstance(link, urllib3_errors.NewConnectionError) for link in chain):
        closed = any(isinstance(link, ConnectionRefusedError) for link in chain)
        code = NOBODY if closed else ""
        return Unreachable(tr("Nothing answers at the camera’s address."), _WIFI, code)
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
    """Yield an error, its arguments and its causes, each once."""
    waiting, visited = [error], set()
    while waiting:
        link = waiting.pop()
        if id(link) in visited:
            continue
        visited.add(id(link))
        yield link
        causes = (*link.args, getattr(link, "reason", None), link.__cause__, link.__context__)
        waiting.extend(item for item in causes if isinstance(item, BaseException))
