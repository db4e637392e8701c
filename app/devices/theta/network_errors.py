"""What a failed request means: silence, a broken connection, something that is no camera."""

from __future__ import annotations

from collections.abc import Iterator
from http.client import BadStatusLine, RemoteDisconnected, UnknownProtocol
from typing import Final

import requests
from urllib3 import exceptions as urllib3_errors

from app.core.text import tr
from app.devices.errors import BadReply, DeviceError, NotACamera, Unreachable

CLOSED: Final = "closed"
"""Code of the error that a reader gets whose stream was closed from another thread."""

BROKEN: Final = "broken"
"""Code of a connection that ended too early."""

NOBODY: Final = "connection-refused"
"""Code of an address at which a computer refuses the connection: no program listens there."""

NO_SUCH_NAME: Final = "no-such-name"
"""Code of a name that nobody in the network has."""

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


def timeout() -> Unreachable:
    """Say that nothing came in time."""
    return Unreachable(tr("The camera does not answer in time."), _WIFI, "timeout")


def broken(code: str = "") -> Unreachable:
    """Say that the connection ended too early."""
    return Unreachable(tr("The connection to the camera broke."), _NEARER, code or BROKEN)


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
            NO_SUCH_NAME,
        )
    if any(isinstance(link, urllib3_errors.NewConnectionError) for link in chain):
        closed = any(isinstance(link, ConnectionRefusedError) for link in chain)
        code = NOBODY if closed else ""
        return Unreachable(tr("Nothing answers at the camera's address."), _WIFI, code)
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
    waiting, visited = [error], set()
    while waiting:
        link = waiting.pop()
        if id(link) in visited:
            continue
        visited.add(id(link))
        yield link
        causes = (*link.args, getattr(link, "reason", None), link.__cause__, link.__context__)
        waiting.extend(item for item in causes if isinstance(item, BaseException))
