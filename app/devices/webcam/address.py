"""Where a network camera is: an address that a user typed, checked before anything is sent."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias, cast
from urllib.parse import parse_qsl, urlsplit

from app.devices.errors import DeviceError
from app.devices.theta.endpoint import Endpoint
from app.devices.webcam.protocol import WebcamError

Scheme: TypeAlias = Literal["http", "https", "rtsp"]

LONGEST_ADDRESS: Final = 500
"""Characters of an address."""

_PORTS: Final[dict[str, int]] = {"http": 80, "https": 443, "rtsp": 554}
_SCHEME: Final = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://")
_HAS_PORT: Final = re.compile(r"(?:[^:\[\]]+|\[[^\]]*\]):\d+")
_SECRETS: Final = frozenset({"auth", "key", "pass", "passwd", "password", "pwd", "token"})
_HINT: Final = "Type it as the camera’s app shows it, for example http://192.168.1.20:8080/video."


@dataclass(frozen=True, slots=True)
class Address:
    """Address of a stream of pictures.

    Examples
    --------
    >>> str(Address.parse("192.168.1.20:8080/video"))
    'http://192.168.1.20:8080/video'
    """

    scheme: Scheme
    endpoint: Endpoint
    path: str = "/"

    @classmethod
    def parse(cls, text: str) -> Address:
        """Read what a user typed.

        Parameters
        ----------
        text : str
            With or without "http://", "https://" or "rtsp://"; http is meant without.

        Raises
        ------
        WebcamError
            When it is no address, has another scheme, or a user name or password in front of the
            host; the code is "bad-address".
        """
        typed = text.strip()
        if not typed:
            raise _bad("The camera’s address is empty.", _HINT)
        if len(typed) > LONGEST_ADDRESS:
            raise _bad("This address is too long.", _HINT)
        found = _SCHEME.match(typed)
        scheme = found.group(1).lower() if found else "http"
        if scheme not in _PORTS:
            raise _bad(
                f"“{scheme[:20]}” is no way to reach a camera’s pictures.",
                "The address begins with http://, https:// or rtsp://.",
            )
        rest = typed[found.end() :] if found else typed
        host, path = _divided(rest)
        if "@" in host:
            raise _bad(
                "An address with a user name or password in it is not accepted.",
                "Type the address alone; both are asked for when the camera wants them.",
            )
        return cls(cast("Scheme", scheme), _endpoint(host, scheme), _checked(path))

    @property
    def base(self) -> str:
        """Scheme, host and port, without a final slash."""
        host = self.endpoint.host.replace("%", "%25")
        host = f"[{host}]" if ":" in host else host
        port = self.endpoint.port
        return f"{self.scheme}://{host}" + ("" if port == _PORTS[self.scheme] else f":{port}")

    @property
    def secret(self) -> bool:
        """Whether it carries a password in its query: such an address is not to be kept."""
        names = (name for name, _ in parse_qsl(urlsplit(self.path).query, keep_blank_values=True))
        return any(name.lower() in _SECRETS for name in names)

    @property
    def host(self) -> str:
        """Host and port, to show and to log: no path and no query is in it."""
        return self.base.partition("://")[2]

    def at(self, path: str) -> Address:
        """Return the address of another path of the same camera."""
        return Address(self.scheme, self.endpoint, path)

    def __str__(self) -> str:
        """Return all of it, as it is asked for."""
        return f"{self.base}{self.path}"


def _divided(rest: str) -> tuple[str, str]:
    """Part host and port from path and query."""
    end = min((rest.find(sign) for sign in "/?#" if sign in rest), default=len(rest))
    path = rest[end:]
    return rest[:end], path if path.startswith("/") else f"/{path}"


def _endpoint(host: str, scheme: str) -> Endpoint:
    if not host:
        raise _bad("There is no host in this address.", _HINT)
    try:
        read = Endpoint.parse(host)
    except DeviceError as error:
        raise _bad(error.message, _HINT) from None
    given = _HAS_PORT.fullmatch(host) is not None
    return read if given else Endpoint(read.host, _PORTS[scheme])


def _checked(path: str) -> str:
    """Return a path when nothing is in it that does not belong there."""
    try:
        # The checks are those of every address a camera is asked at.
        Endpoint("camera").rewrite(path)
    except DeviceError:
        raise _bad("The part after the host holds signs that do not belong there.", _HINT) from None
    return path


def _bad(message: str, hint: str) -> WebcamError:
    return WebcamError(message, hint, "bad-address")
