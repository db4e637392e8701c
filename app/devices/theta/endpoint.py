"""The address of a camera, and which of the camera's URLs may be followed.

A camera builds its URLs from the address that it believes it has. Only the path and query of such a
URL are used, at the address that the user typed. A forwarded port therefore works, and no URL can
lead to another computer.
"""

from __future__ import annotations

import ipaddress
import re
from contextlib import suppress
from dataclasses import dataclass
from typing import Final
from urllib.parse import unquote, urlsplit

from app.core.text import tr
from app.devices.errors import BadReply, DeviceError

LONGEST_URL: Final = 2000
"""Maximum length of a URL accepted from a camera, in characters."""

_HTTP_PORT: Final = 80
_LAST_PORT: Final = 65535
_LONGEST_HOST: Final = 253
_LABEL: Final = re.compile(r"[a-z0-9_](?:[a-z0-9_-]{0,61}[a-z0-9_])?")
_ZONE: Final = re.compile(r"[A-Za-z0-9._-]{1,32}")
# Unreserved characters, characters with a meaning inside a path, and complete percent escapes.
_PATH: Final = re.compile(r"/(?:[A-Za-z0-9._~!$&'()*+,;=:@/-]|%[0-9A-Fa-f]{2})*")
_QUERY: Final = re.compile(r"(?:[A-Za-z0-9._~!$&'()*+,;=:@/?-]|%[0-9A-Fa-f]{2})*")
_SCHEME: Final = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://")
_HINT: Final = tr("Type an address such as “192.168.1.1” or “THETAYL00105377.local”.")


@dataclass(frozen=True, slots=True)
class Endpoint:
    """Host and port of a camera.

    Raises:
        DeviceError: With the code "bad-address" if the host or the port is invalid.

    Examples:
        >>> Endpoint.parse("http://cam.local:8080/").url("/osc/info")
        'http://cam.local:8080/osc/info'
    """

    host: str
    port: int = _HTTP_PORT

    def __post_init__(self) -> None:
        if not _is_host(self.host):
            raise _bad_address(self.host)
        if not 0 < self.port <= _LAST_PORT:
            raise DeviceError(
                tr(
                    "A port is a number from 1 to {most}, not {port}.",
                    most=_LAST_PORT,
                    port=self.port,
                ),
                tr("Leave out the port; cameras use port 80."),
                "bad-address",
            )

    @classmethod
    def parse(cls, text: str) -> Endpoint:
        """Parse an address typed by the user.

        Raises:
            DeviceError: With the code "bad-address" if the text is not an address, uses HTTPS or
                contains a password.
        """
        address = text.strip()
        rest = _without_scheme(address).partition("/osc/")[0].rstrip("/")
        if not rest:
            raise DeviceError(tr("The camera’s address is empty."), _HINT, "bad-address")
        if "@" in rest:
            raise DeviceError(
                tr("An address with a user name or password in it is not accepted."),
                tr("Type only the address, and enter the password when you are asked for it."),
                "bad-address",
            )
        if _is_ipv6(rest):
            return cls(_tidy(rest))
        host, port = _split_port(rest, address)
        return cls(_tidy(host), port)

    @property
    def base(self) -> str:
        """Scheme, host and port, without a trailing slash."""
        host = f"[{self.host.replace('%', '%25')}]" if ":" in self.host else self.host
        return f"http://{host}" if self.port == _HTTP_PORT else f"http://{host}:{self.port}"

    def url(self, path: str) -> str:
        """Return the URL of a path.

        Raises:
            BadReply: As in `rewrite`.
        """
        return self.rewrite(path)

    def rewrite(self, url: str) -> str:
        """Point a camera's URL at this host and port, keeping its path and query.

        Raises:
            BadReply: With the code "bad-url" if the URL is longer than `LONGEST_URL`, has a scheme
                other than HTTP, a password, a fragment, an invalid character, or "." or ".." in its
                path, even if percent-encoded.
        """
        if len(url) > LONGEST_URL:
            raise _bad_url(tr("it is too long"))
        whole = f"http://camera{url}" if url.startswith("/") and not url.startswith("//") else url
        # urlsplit silently removes tabs and line breaks, so check for them first.
        if not whole.isascii() or any(ord(sign) <= 0x20 or ord(sign) == 0x7F for sign in whole):
            raise _bad_url(tr("it contains invalid characters"))
        try:
            parts = urlsplit(whole)
            netloc = parts.netloc
        except ValueError as error:
            raise _bad_url(tr("it is not a URL")) from error
        if parts.scheme != "http" or not netloc or "@" in netloc or "#" in whole:
            raise _bad_url(tr("it is not a plain HTTP address"))
        _check_path(parts.path)
        if not _QUERY.fullmatch(parts.query):
            raise _bad_url(tr("it contains invalid characters"))
        query = f"?{parts.query}" if parts.query else ""
        return f"{self.base}{parts.path}{query}"


def _check_path(path: str) -> None:
    if not _PATH.fullmatch(path) or path.startswith("//"):
        raise _bad_url(tr("its path is empty or contains invalid characters"))
    plain = unquote(path, errors="replace")
    if "%" in plain or any(ord(sign) < 0x20 or sign in "\\\x7f" for sign in plain):
        raise _bad_url(tr("its path contains invalid characters"))
    if plain.count("/") != path.count("/") or {".", ".."} & set(plain.split("/")):
        raise _bad_url(tr("its path leads elsewhere"))


def _without_scheme(text: str) -> str:
    match = _SCHEME.match(text)
    if match is None:
        return text
    scheme = match.group(1).lower()
    if scheme == "https":
        raise DeviceError(
            tr("Cameras of this kind do not support HTTPS."),
            tr("Type the address alone, or put http:// in front of it."),
            "bad-address",
        )
    if scheme != "http":
        raise _bad_address(text)
    return text[match.end() :]


def _split_port(rest: str, text: str) -> tuple[str, int]:
    if rest.startswith("["):
        host, closed, tail = rest[1:].partition("]")
        if not closed or not _is_ipv6(host) or (tail and not tail.startswith(":")):
            raise _bad_address(text)
        digits = tail[1:] if tail else str(_HTTP_PORT)
    else:
        host, colon, digits = rest.partition(":")
        digits = digits if colon else str(_HTTP_PORT)
    if not (digits.isascii() and digits.isdigit() and len(digits) <= len(str(_LAST_PORT))):
        raise _bad_address(text)
    return host, int(digits)


def _tidy(host: str) -> str:
    address, percent, zone = host.partition("%")
    zone = zone.removeprefix("25") if zone.startswith("25") and len(zone) > len("25") else zone
    return address.lower().rstrip(".") + percent + zone


def _is_ipv6(host: str) -> bool:
    address, percent, zone = host.partition("%")
    if percent and not _ZONE.fullmatch(zone):
        return False
    try:
        ipaddress.IPv6Address(address)
    except ValueError:
        return False
    return True


def _is_host(host: str) -> bool:
    if ":" in host:
        return _is_ipv6(host)
    labels = host.split(".")
    if len(host) > _LONGEST_HOST or not all(_LABEL.fullmatch(label) for label in labels):
        return False
    if not labels[-1].isdigit():
        return True
    try:
        ipaddress.IPv4Address(host)
    except ValueError:
        return False
    return True


def _bad_address(text: str) -> DeviceError:
    printable = "".join(sign for sign in text[:60] if sign.isprintable())
    return DeviceError(
        tr("“{address}” is not the address of a camera.", address=printable), _HINT, "bad-address"
    )


def _bad_url(why: str) -> BadReply:
    return BadReply(
        tr("The camera sent an address that cannot be used: {why}.", why=why),
        tr("Restart the camera; if that does not help, update its firmware."),
        "bad-url",
    )


ACCESS_POINT: Final = Endpoint("192.168.1.1")
"""Address of every Ricoh Theta on its own Wi-Fi."""


_NEAR: Final = tuple(
    ipaddress.ip_network(text)
    for text in (
        "10.0.0.0/8",
        "172.16.0.0/12",
        "192.168.0.0/16",
        "169.254.0.0/16",
        "127.0.0.0/8",
        "fc00::/7",
        "fe80::/10",
        "::1/128",
    )
)


def is_near(host: str) -> bool:
    """Return whether an address is on a private network, on this link or on this computer.

    Other addresses are tried only if the user types them.

    Examples:
        >>> is_near("192.168.1.1"), is_near("8.8.8.8"), is_near("fe80::1%eth0")
        (True, False, True)
    """
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return False
    return any(address in network for network in _NEAR)


def check_address(text: str) -> Endpoint:
    """Parse an address typed by the user, without sending anything to it.

    Args:
        text: For example "192.168.1.1", "http://cam.local:8080/" or "[fe80::1%eth0]". Hosts outside
            the local network are also accepted.

    Raises:
        DeviceError: With the code "bad-address" if the text is not an address, or no single camera
            can have that address.
    """
    endpoint = Endpoint.parse(text)
    address = None
    with suppress(ValueError):  # The host is a name.
        address = ipaddress.ip_address(endpoint.host.partition("%")[0])
    everybody = endpoint.host == "255.255.255.255"
    if everybody or (address and (address.is_multicast or address.is_unspecified)):
        raise DeviceError(
            tr("{host} is not the address of a single camera.", host=endpoint.host),
            tr("Type an address such as “192.168.1.1” or “THETAYL00105377.local”."),
            "bad-address",
        )
    return endpoint
