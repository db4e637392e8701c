"""What passes between a simulated camera and whoever carries its words.

The camera knows no sockets: it turns a `Request` into a `Reply`. A reply's body is a series of
pieces: bytes to send, pauses to make, or the end of the connection. `server` plays them over real
HTTP; tests hand them to `requests` in the same process, on virtual time.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


@dataclass(frozen=True, slots=True)
class Request:
    """What a client asks.

    Attributes
    ----------
    method : str
        "GET" or "POST".
    """

    method: str
    target: str
    headers: Mapping[str, str] = field(default_factory=dict)
    body: bytes = b""
    host: str = "192.168.1.1"


@dataclass(frozen=True, slots=True)
class Pause:
    """Nothing is sent for so many seconds."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Drop:
    """The connection is cut here."""


Piece: TypeAlias = bytes | Pause | Drop
"""One thing that happens while a body is sent."""


@dataclass(frozen=True, slots=True)
class Reply:
    """What the camera answers."""

    status: int
    headers: tuple[tuple[str, str], ...] = ()
    pieces: Iterable[Piece] = ()
    delay_s: float = 0.0
