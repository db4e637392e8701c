"""The address of a network camera, and a plain or encrypted connection to it with a deadline.

Every read has a deadline both on the injected clock and in real time, and can be interrupted from
another thread. Redirects are never followed.
"""

from __future__ import annotations

import io
import re
import socket
import ssl
from collections.abc import Mapping
from dataclasses import dataclass
from http.client import HTTPException, HTTPResponse
from typing import Any, Final, Literal, TypeAlias, cast
from urllib.parse import parse_qsl, urlsplit

from urllib3.util.wait import wait_for_read

from app.core.text import tr
from app.devices.bounded_socket import BoundedSocket, BoundedTls, Watch, pending
from app.devices.clock import Clock
from app.devices.errors import DeviceError
from app.devices.theta.endpoint import Endpoint
from app.devices.webcam.protocol import WebcamError

Scheme: TypeAlias = Literal["http", "https", "rtsp"]

LONGEST_ADDRESS: Final = 500
"""Maximum length of an address, in characters."""

_PORTS: Final[dict[str, int]] = {"http": 80, "https": 443, "rtsp": 554}
_SCHEME: Final = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://")
_HAS_PORT: Final = re.compile(r"(?:[^:\[\]]+|\[[^\]]*\]):\d+")
_SECRETS: Final = frozenset({"auth", "key", "pass", "passwd", "password", "pwd", "token"})
_HINT: Final = tr(
    "Type it as the camera’s app shows it, for example http://192.168.1.20:8080/video."
)

CONNECT_S: Final = 5.0
"""Time limit for a camera's first reply, in seconds."""

FAILURES: Final = (OSError, HTTPException, ValueError)
"""All exceptions that a broken or hostile connection can cause."""

_PART_S: Final = 0.5  # seconds that a started read may last before the deadline is checked again
_TLS: Final = "https"


@dataclass(frozen=True, slots=True)
class Address:
    """The address of a stream.

    Examples:
        >>> str(Address.parse("192.168.1.20:8080/video"))
        'http://192.168.1.20:8080/video'
    """

    scheme: Scheme
    endpoint: Endpoint
    path: str = "/"

    @classmethod
    def parse(cls, text: str) -> Address:
        """Parse an address typed by the user.

        Args:
            text: Address with or without "http://" (the default), "https://" or "rtsp://".

        Raises:
            WebcamError: With the code "bad-address" if the text is not an address, or has another
                scheme, a user name or a password.
        """
        address = text.strip()
        if not address:
            raise _bad(tr("The camera’s address is empty."), _HINT)
        if len(address) > LONGEST_ADDRESS:
            raise _bad(tr("This address is too long."), _HINT)
        match = _SCHEME.match(address)
        scheme = match.group(1).lower() if match else "http"
        if scheme not in _PORTS:
            raise _bad(
                tr("“{scheme}” cannot be used to reach a camera.", scheme=scheme[:20]),
                tr("The address must begin with http://, https:// or rtsp://."),
            )
        rest = address[match.end() :] if match else address
        host, path = _divided(rest)
        if "@" in host:
            raise _bad(
                tr("An address with a user name or password in it is not accepted."),
                tr("Type the address alone; you will be asked for both if the camera needs them."),
            )
        return cls(cast("Scheme", scheme), _endpoint(host, scheme), _check_path(path))

    @property
    def base(self) -> str:
        """Scheme, host and port, without a trailing slash."""
        host = self.endpoint.host.replace("%", "%25")
        host = f"[{host}]" if ":" in host else host
        port = self.endpoint.port
        return f"{self.scheme}://{host}" + ("" if port == _PORTS[self.scheme] else f":{port}")

    @property
    def secret(self) -> bool:
        """Whether the query contains a password. If so, the address must not be saved."""
        names = (name for name, _ in parse_qsl(urlsplit(self.path).query, keep_blank_values=True))
        return any(name.lower() in _SECRETS for name in names)

    @property
    def host(self) -> str:
        """Host and port for display and logs, without the path and query."""
        return self.base.partition("://")[2]

    def at(self, path: str) -> Address:
        """Return the address of another path on the same camera."""
        return Address(self.scheme, self.endpoint, path)

    def __str__(self) -> str:
        """Return the complete URL."""
        return f"{self.base}{self.path}"


def _divided(rest: str) -> tuple[str, str]:
    """Separate the host and port from the path and query."""
    end = min((rest.find(sign) for sign in "/?#" if sign in rest), default=len(rest))
    path = rest[end:]
    return rest[:end], path if path.startswith("/") else f"/{path}"


def _endpoint(host: str, scheme: str) -> Endpoint:
    if not host:
        raise _bad(tr("This address has no host name."), _HINT)
    try:
        read = Endpoint.parse(host)
    except DeviceError as error:
        raise _bad(error.message, _HINT) from None
    has_port = _HAS_PORT.fullmatch(host) is not None
    return read if has_port else Endpoint(read.host, _PORTS[scheme])


def _check_path(path: str) -> str:
    """Return a path after checking it."""
    try:
        # The same checks as for URLs of 360 cameras.
        Endpoint("camera").rewrite(path)
    except DeviceError:
        raise _bad(tr("The part after the host contains invalid characters."), _HINT) from None
    return path


def _bad(message: str, hint: str) -> WebcamError:
    return WebcamError(message, hint, "bad-address")


class Wire:
    """A connection to one address."""

    def __init__(self, address: Address, clock: Clock) -> None:
        self._address = address
        self._socket: socket.socket | None = None
        self._file: io.BufferedReader | None = None
        self.watch = Watch(clock)

    def connect(self) -> None:
        """Connect to the address. Reads must finish within `CONNECT_S` until the next `allow`.

        Raises:
            WebcamError: If nothing answers.
        """
        endpoint = self._address.endpoint
        self.watch.allow(CONNECT_S)
        try:
            plain = socket.create_connection((endpoint.host, endpoint.port), CONNECT_S)
        except (OSError, UnicodeError) as error:
            raise unreachable(error) from None
        try:
            bounded = (
                self._encrypted(plain) if self._address.scheme == _TLS else BoundedSocket(plain)
            )
            bounded.settimeout(_PART_S)
        except (OSError, ValueError) as error:
            plain.close()
            raise unreachable(error) from None
        bounded.watch, bounded.patient = self.watch, True
        self._socket, self._file = bounded, bounded.makefile("rb")

    def _encrypted(self, plain: socket.socket) -> BoundedTls:
        context = ssl.create_default_context()
        context.sslsocket_class = BoundedTls
        host = self._address.endpoint.host.partition("%")[0]
        return cast("BoundedTls", context.wrap_socket(plain, server_hostname=host))

    def send(self, lines: list[str]) -> None:
        """Send the head of a request without its final empty line.

        Raises:
            OSError, HTTPException, ValueError: If the connection fails (`FAILURES`).
        """
        if self._socket is None:
            raise OSError("not connected")
        self._socket.sendall(_request(lines))

    def readline(self, most: int) -> bytes:
        """Read a line of at most `most` bytes.

        Raises:
            OSError, HTTPException, ValueError: If the connection fails (`FAILURES`).
        """
        if self._file is None:
            raise OSError("not connected")
        return self._file.readline(most)

    def get(self, path: str, headers: Mapping[str, str]) -> HTTPResponse:
        """Send a GET request and read the head of the reply.

        Raises:
            OSError, HTTPException, ValueError: If the connection fails (`FAILURES`).
        """
        host = self._address.host
        lines = [f"GET {path} HTTP/1.1", f"Host: {host}", "Accept: */*", "Connection: close"]
        lines += ["User-Agent: Turnlight", "Accept-Encoding: identity"]
        lines += [f"{name}: {value}" for name, value in headers.items()]
        self.send(lines)
        # HTTPResponse only reads from its socket.
        response = HTTPResponse(cast("Any", self))
        response.begin()
        return response

    def makefile(self, mode: str = "rb") -> io.BufferedReader:
        """Return the stream as a socket would. This is called by `HTTPResponse`."""
        del mode
        if self._file is None:
            raise OSError("not connected")
        return self._file

    @property
    def ready(self) -> bool:
        """Whether received bytes are waiting to be read."""
        connection = self._socket
        return connection is not None and (
            pending(connection) or bool(wait_for_read(connection, timeout=0.0))
        )

    def close(self) -> None:
        """Close the connection. Calling this again has no effect."""
        connection, file = self._socket, self._file
        self._socket = self._file = None
        if connection is not None and file is not None:
            file.close()
            connection.close()


def _request(lines: list[str]) -> bytes:
    if any(ord(sign) < 0x20 for line in lines for sign in line):
        raise ValueError("a line of a request cannot contain control characters")
    return ("\r\n".join(lines) + "\r\n\r\n").encode()


def unreachable(error: BaseException) -> WebcamError:
    """Return the error for a failed connection."""
    if isinstance(error, ssl.SSLCertVerificationError):
        message = tr("The network camera’s certificate is not trusted by this computer.")
        hint = tr("On your own network, type its address with http:// instead.")
    elif isinstance(error, ssl.SSLError):
        message = tr("The device at this address does not support HTTPS.")
        hint = tr("Type the address with http:// instead.")
    elif isinstance(error, (socket.gaierror, UnicodeError)):
        message = tr("There is no device with this name on the network.")
        hint = tr("Type the IP address that the camera’s app shows.")
    else:
        message = tr("The network camera does not answer.")
        hint = tr("Start its app and join the same Wi-Fi. The video resumes automatically.")
    return WebcamError(message, hint, "unreachable")


def camera_gone() -> WebcamError:
    """Return the error for a stream that has stopped."""
    return WebcamError(
        tr("Network camera disconnected."),
        tr("Check that its app is running and on the same Wi-Fi. The video resumes automatically."),
        "unplugged",
    )
