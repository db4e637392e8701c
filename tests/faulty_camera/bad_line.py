"""A bad line to a simulated camera: one request in ten fails, in one way, by a seed."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from app.devices.simulated.exchange import (
    Pause,
    Reply,
    Request,
    head_of,
    text_reply,
)
from tests.faulty_camera.silence import NO_ANSWER, NO_ANSWER_S, Drop

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.devices.simulated.camera import SimulatedCamera
    from app.devices.simulated.exchange import Piece

KINDS: Final = (
    "lost-request",
    "lost-reply",
    "reset",
    "truncation",
    "503",
    "html",
    "redirect",
    "401",
    "delay",
    "stall",
    "slow",
    "half-close",
    "garbage",
    "duplicate",
)
"""How a request fails.

* `lost-request`, `lost-reply`: silence. `reset`: the connection breaks, before or after the camera
  hears the request. `truncation`: the body ends early.
* `503`, `html`, `redirect`, `401`: something between answers instead of the camera.
* `delay`: the reply comes 2 to 30 s late. `stall`: its body stops for good in the middle.
  `slow`: its body drips at 300 to 3,000 bytes a second. `half-close`: the stream ends inside the
  body, without a reset.
* `garbage`: some bytes of JSON, or all of a picture, are not what was sent. `duplicate`: the
  request arrives twice, and the first or the second reply comes back; or the reply comes twice.
"""

_PAGE: Final = b"<!DOCTYPE html><html><title>Login</title><body>Sign in.</body></html>"
_DRIP: Final = 256
_CHALLENGES: Final = (
    'Digest realm="router", nonce="5ca1ab1e", qop="auth"',
    'Basic realm="router"',
)


class BadLine:
    """Takes the place of a camera's `answer`; serves under the adapter and under real sockets.

    Args:
        camera: Whose answers pass through here from now on.
        kind: One of `KINDS`.
        share: Of the requests that go wrong.
    """

    def __init__(
        self, camera: SimulatedCamera, kind: str, *, seed: int = 0, share: float = 0.1
    ) -> None:
        self.struck = self.requests = 0
        self._kind, self._share = kind, share
        self._dice = random.Random(f"{kind}/{seed}")
        self._answer: Callable[[Request], Reply] = camera.answer
        camera.answer = self.answer  # type: ignore[method-assign]
        self._changes: Final = {
            "truncation": self._cut,
            "delay": self._late,
            "stall": self._stalled,
            "slow": self._slow,
            "half-close": self._half_closed,
            "garbage": self._garbled,
            "duplicate": self._doubled,
        }

    def answer(self, request: Request) -> Reply:
        """Answer as the camera does, or fail on the way there or back."""
        self.requests += 1
        if self._dice.random() >= self._share:
            return self._answer(request)
        self.struck += 1
        if self._kind in ("lost-request", "503", "html", "redirect", "401"):
            return self._instead()
        if self._kind == "reset" and self._dice.random() < 0.5:
            return Reply(0)
        reply = self._answer(request)
        change = self._changes.get(self._kind)
        if change is not None:
            return change(request, reply)
        close = getattr(reply.pieces, "close", None)
        if close is not None:
            close()
        return NO_ANSWER if self._kind == "lost-reply" else Reply(0, delay_s=reply.delay_s)

    def _instead(self) -> Reply:
        if self._kind == "503":
            return text_reply(_PAGE, "text/html", 503)
        if self._kind == "html":
            return text_reply(_PAGE, "text/html")
        if self._kind == "redirect":
            return _with(text_reply(b"", "text/html", 302), "Location", "http://10.0.0.1/login")
        if self._kind == "401":
            challenge = self._dice.choice(_CHALLENGES)
            return _with(text_reply(_PAGE, "text/html", 401), "WWW-Authenticate", challenge)
        return NO_ANSWER

    def _late(self, request: Request, reply: Reply) -> Reply:
        del request
        return replace(reply, delay_s=reply.delay_s + self._dice.uniform(2.0, 30.0))

    def _stalled(self, request: Request, reply: Reply) -> Reply:
        del request
        most = int(_length(reply) * self._dice.uniform(0.0, 0.98))
        return replace(reply, pieces=_until(reply.pieces, most, Pause(NO_ANSWER_S), Drop()))

    def _slow(self, request: Request, reply: Reply) -> Reply:
        del request
        return replace(reply, pieces=_dripping(reply.pieces, self._dice.uniform(300.0, 3000.0)))

    def _half_closed(self, request: Request, reply: Reply) -> Reply:
        """End the stream in the middle of the body, without a reset."""
        del request
        most = int(_length(reply) * self._dice.uniform(0.0, 0.98))
        return replace(reply, pieces=_until(reply.pieces, most))

    def _garbled(self, request: Request, reply: Reply) -> Reply:
        del request
        # Few wrong bytes inside a picture cannot be seen; TCP's checksum is there for them.
        json = any("json" in value for _, value in reply.headers)
        return replace(reply, pieces=_garbled(reply.pieces, self._dice, whole=not json))

    def _doubled(self, request: Request, reply: Reply) -> Reply:
        choice = self._dice.random()
        if choice < 0.5:
            again = self._answer(request)
            return again if choice < 0.25 else reply
        return replace(reply, pieces=(*reply.pieces, *_wire_of(reply)))

    def _cut(self, request: Request, reply: Reply) -> Reply:
        """Cut a body, with a connection that breaks or a length that fits."""
        del request
        most = int(_length(reply) * self._dice.uniform(0.0, 0.98))
        if self._dice.random() < 0.5:
            return replace(reply, pieces=_until(reply.pieces, most, Drop()))
        headers = tuple(h for h in reply.headers if h[0].lower() != "content-length")
        headers += (("Content-Length", str(most)),)
        return replace(reply, headers=headers, pieces=_until(reply.pieces, most))


def _with(reply: Reply, name: str, value: str) -> Reply:
    return replace(reply, headers=(*reply.headers, (name, value)))


def _length(reply: Reply) -> int:
    stated = (v for n, v in reply.headers if n.lower() == "content-length")
    return int(next(stated, "65536"))


def _until(pieces: Iterable[Piece], most: int, *end: Piece) -> Iterator[Piece]:
    """Send at most so many bytes, then the end."""
    left = most
    for piece in pieces:
        if isinstance(piece, Pause | Drop):
            yield piece
        elif left > 0:
            yield piece[:left]
            left -= len(piece)
    yield from end


def _dripping(pieces: Iterable[Piece], rate: float) -> Iterator[Piece]:
    for piece in pieces:
        if isinstance(piece, Pause | Drop):
            yield piece
            continue
        for start in range(0, len(piece), _DRIP):
            drop = piece[start : start + _DRIP]
            yield Pause(len(drop) / rate)
            yield drop


def _garbled(pieces: Iterable[Piece], dice: random.Random, *, whole: bool) -> Iterator[Piece]:
    """Change some bytes of every piece, or all."""
    for piece in pieces:
        if isinstance(piece, Pause | Drop) or not piece:
            yield piece
            continue
        data = bytearray(piece)
        for _ in range(len(data) if whole else dice.randint(1, 20)):
            data[dice.randrange(len(data))] = dice.randrange(128, 256)
        yield bytes(data)


def _wire_of(reply: Reply) -> Iterator[Piece]:
    """Write a reply as its bytes on the wire."""
    yield head_of(reply.status, reply.headers)
    if not isinstance(reply.pieces, Iterator):  # A file's pieces can be read once only.
        yield from reply.pieces
